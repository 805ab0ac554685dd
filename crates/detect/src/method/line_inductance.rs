//! The paper's method: three line inductances give the axis, and two voltage vectors decide which end is north.
//!
//! ```text
//!   wait ─► AB pulses ─► wait ─► BC pulses ─► wait ─► CA pulses ─► wait ─► vector at θ̂ ─► wait ─► at θ̂ + 180°
//!           L_AB, R              L_BC, R              L_CA, R  └► θ̂ modulo 180°, (5)–(7)       larger i_d: north
//! ```
//! and a last wait, so that no current is left after the detection.
//!
//! A pulse puts the DC link across two phases for `pulse`; then the current decays. Samples i1 before it, i2 at its end
//! and i3 in the decay give R and L of the line by equation (10).

mod settings;
#[cfg(test)]
mod tests;

use standstill_interface::{Abc, Command, Fault, Findings, Nanos, Reading, Real, Sampling, Stage, Step};

use crate::method::Sequence;
use crate::nameplate::Place;
use crate::parts::lines::{Interval, Saliency, line_impedance};
use crate::parts::margin::Margin;
use crate::parts::polarity::PolarityTest;
use crate::parts::settle::{Settler, link, link_current, seen};
use crate::parts::significance;
use crate::parts::train::LINES;
use crate::settings::{Decay, SettingsError};

pub use settings::LineInductanceSettings;

/// State of the sequence, named after the last command, whose readings come next.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // As for `Step`: boxing would need an allocator.
enum State<T> {
    Start,
    Settling { line: usize, pulse: u8 },
    Pulsing { line: usize, pulse: u8 },
    Testing(PolarityTest<T>),
}

/// The paper's detector.
#[derive(Clone, Debug)]
pub struct LineInductance<T> {
    settings: LineInductanceSettings<T>,
    state: State<T>,
    settler: Settler<T>,
    /// i1 of the next pulse in A.
    initial: Abc<T>,
    /// Sums over the pulses of each line.
    inductance: Abc<T>,
    resistance: Abc<T>,
    /// Sum over the lines of the squares of L in H² that their pulses are away from the line's mean.
    scatter: T,
    /// Sum over the pulses of 2/(i2 − i1)² in 1/A²: the variance that the noise of single readings gives L, relative.
    by_readings: T,
    findings: Findings<T>,
}

impl<T: Real> LineInductance<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: LineInductanceSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = Abc::new(T::zero(), T::zero(), T::zero());
        Ok(Self {
            settings,
            state: State::Start,
            settler: Settler::new(settings.settle, settings.decay == Decay::Fast),
            initial: zero,
            inductance: zero,
            resistance: zero,
            scatter: T::zero(),
            by_readings: T::zero(),
            findings: Findings::default(),
        })
    }

    /// Begins to wait for the current of a pulse to be gone.
    fn settle(&mut self, line: usize, pulse: u8) -> Step<T> {
        self.state = State::Settling { line, pulse };
        Step::Drive(self.settler.begin())
    }

    fn begin_pulse(&mut self, line: usize, pulse: u8) -> Step<T> {
        self.state = State::Pulsing { line, pulse };
        Step::Drive(self.pulse(line))
    }

    fn pulse(&self, line: usize) -> Command<T> {
        let s = &self.settings;
        let (first, second) = LINES[line];
        let decay = match s.decay {
            Decay::Slow => Stage::freewheel(first, second, s.period - s.pulse),
            // The wait that follows belongs to the period.
            Decay::Fast => Stage::off(s.period - s.pulse - s.settle.wait),
        };
        let sampling = Sampling::twice(s.pulse - s.sample_lead, s.third_sample());
        Command::sequence(Stage::line(first, second, s.pulse), decay, sampling)
    }

    /// Returns i1, i2 and i3 of a pulse in A, without the offset steps that occur if different sensors read them.
    fn currents(&self, line: usize, second: &Reading<T>, third: &Reading<T>) -> Result<[T; 3], Fault<T>> {
        let ((from, to), none) = (LINES[line], self.initial);
        Ok(match self.settings.place() {
            Place::InLine => [none[from], seen(second, from)?, seen(third, from)?],
            Place::BelowLegs => [T::zero(), none[to] - seen(second, to)?, seen(third, from)? - none[from]],
            // Diodes return the current to the link.
            Place::InLink => {
                [T::zero(), link_current(second)? - none[from], none[from] - link_current(third)?]
            }
        })
    }

    /// Returns the delay between the trigger of i2 and its sampling by a shunt.
    fn late(&self, line: usize) -> Nanos {
        let sensing = &self.settings.sensing;
        match self.settings.place() {
            Place::InLine => Nanos::ZERO,
            Place::BelowLegs => Nanos::from_seconds(sensing.late_of(LINES[line].1).to_double()),
            Place::InLink => Nanos(sensing.averaged.0 / 2),
        }
    }

    /// Evaluates a pulse (its R and L), and returns the next pulse, or the axis and the first vector.
    fn pulsed(&mut self, line: usize, pulse: u8, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        let [second, third] = readings else { return Err(Fault::UnexpectedReadings) };
        let phase = LINES[line].0;
        let [i1, i2, i3] = self.currents(line, second, third)?;
        let s = &self.settings;
        let (on_link, off_link) = (link(second)?, link(third)?);
        self.settler.margin.at_least(i2 - i1, s.least_current);
        if i2 - i1 < s.least_current {
            return Err(Fault::NoCurrent { peak: i2 - i1, needed: s.least_current });
        }
        let seconds = |duration: Nanos| T::of(duration.seconds());
        // Mean voltages: no voltage in the dead time before the pulse; a rest of the pulse after an early i2.
        let risen = s.pulse - s.sample_lead + self.late(line);
        let rise = Interval {
            voltage: on_link * seconds(risen - s.dead_time) / seconds(risen),
            begin: i1,
            end: i2,
            duration: seconds(risen),
        };
        let after = s.third_sample() - s.pulse;
        let decaying = match s.decay {
            Decay::Slow => T::zero(),
            Decay::Fast => -off_link,
        };
        let rest = s.pulse - risen;
        let whole = seconds(after + rest);
        let decay = Interval {
            voltage: (on_link * seconds(rest) + decaying * seconds(after)) / whole,
            begin: i2,
            end: i3,
            duration: whole,
        };
        let (resistance, inductance) = line_impedance(rise, decay).ok_or(Fault::NotInductive(phase))?;
        if inductance <= T::zero() {
            return Err(Fault::NotInductive(phase));
        }
        self.by_readings = self.by_readings + T::of(2.0) / ((i2 - i1) * (i2 - i1));
        let before = T::of(f64::from(pulse));
        if pulse > 0 {
            let apart = inductance - self.inductance[phase] / before;
            self.scatter = self.scatter + apart * apart * before / (before + T::one());
        }
        self.inductance[phase] = self.inductance[phase] + inductance;
        self.resistance[phase] = self.resistance[phase] + resistance;
        self.initial = third.current;

        let next = pulse + 1;
        Ok(if next < s.pulses {
            match s.decay {
                Decay::Slow => self.begin_pulse(line, next),
                Decay::Fast => self.settle(line, next),
            }
        } else if line + 1 < LINES.len() {
            self.settle(line + 1, 0)
        } else {
            let axis = self.find_axis()?;
            let d_axis_inductance = T::of(1.5) * (axis.mean + axis.amplitude);
            let mut test =
                PolarityTest::new(self.settings.polarity, self.settler, axis.axis, d_axis_inductance);
            let wait = test.begin();
            self.state = State::Testing(test);
            Step::Drive(wait)
        })
    }

    /// Equations (5)–(7).
    fn find_axis(&mut self) -> Result<Saliency<T>, Fault<T>> {
        let count = T::of(f64::from(self.settings.pulses));
        let lines = self.inductance.map(|sum| sum / count);
        let (s, margin) = (&self.settings, &mut self.settler.margin);
        // Equation (10) leaves the resistance out of the inductance.
        s.plausibility.inductances(margin, lines.0.map(|line| [line; 2]), s.pulse, T::zero())?;
        let saliency = Saliency::from_lines(lines, s.saliency);
        self.findings.line_inductance = Some(lines);
        self.findings.line_resistance = Some(self.resistance.map(|sum| sum / count));
        self.findings.mean_inductance = Some(saliency.mean);
        self.findings.saliency = Some(saliency.amplitude);
        let (needed, least) = (self.needed(&saliency), self.settings.least_saliency);
        significance::check(&mut self.settler.margin, saliency.ratio(), needed, least)?;
        Ok(saliency)
    }

    /// Returns the square of |L_B|/L_A that must be exceeded. It allows for noise (from the scatter of pulses, or from
    /// the readings without current before a single pulse), for the gain of the one sensor that reads a line, and for
    /// the delays of the legs.
    fn needed(&self, saliency: &Saliency<T>) -> T {
        let s = &self.settings;
        let count = T::of(f64::from(s.pulses));
        let line = T::of(3.0) * saliency.mean;
        let lines =
            |variance: T, freedom: T| significance::scattered(significance::of_lines(variance), freedom);
        let noise = if s.pulses > 1 {
            let freedom = T::of(3.0) * (count - T::one());
            lines(self.scatter / (freedom * count * line * line), freedom)
        } else {
            let noise = &self.settler.noise;
            let readings = self.by_readings / T::of(3.0) * noise.deviation() * noise.deviation();
            let (link, links) = noise.of_link();
            lines(readings, noise.freedom()) + lines(link, links)
        };
        let [dead, pulse] = [s.dead_time, s.pulse].map(|time| T::of(time.seconds()));
        let timing = significance::of_timing(dead, pulse);
        noise + significance::known(significance::of_lines(s.gain_tolerance * s.gain_tolerance + timing))
    }
}

impl<T: Real> Sequence<T> for LineInductance<T> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        match &mut self.state {
            State::Start => Ok(self.settle(0, 0)),
            State::Settling { line, pulse } => {
                let (line, pulse) = (*line, *pulse);
                if let Some(wait) = self.settler.step(readings)? {
                    return Ok(Step::Drive(wait));
                }
                self.initial = self.settler.residual;
                Ok(self.begin_pulse(line, pulse))
            }
            State::Pulsing { line, pulse } => {
                let (line, pulse) = (*line, *pulse);
                self.pulsed(line, pulse, readings)
            }
            State::Testing(test) => Ok(test.step(readings)?.with(self.findings)),
        }
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        let margin = match &self.state {
            State::Testing(test) => test.margin(),
            _ => self.settler.margin,
        };
        (&self.findings, margin)
    }
}
