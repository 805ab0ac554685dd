//! The paper's method: three line inductances give the axis, and two voltage vectors decide which end is north.
//!
//! ```text
//!   wait ─► AB pulses ─► wait ─► BC pulses ─► wait ─► CA pulses ─► wait ─► vector at θ̂ ─► wait ─► at θ̂ + 180°
//!           L_AB, R              L_BC, R              L_CA, R  └► θ̂ modulo 180°, (5)–(7)       larger i_d: north
//! ```
//! A last wait follows, so that no current is left after the detection.
//!
//! A pulse puts the DC link across two phases for `pulse`; then the current decays. Samples i1 before it, i2 at its end
//! and i3 in the decay give R and L of the line by equation (10).

mod settings;
#[cfg(test)]
mod tests;

use standstill_interface::{Abc, Command, Fault, Findings, Nanos, Reading, Real, Sampling, Sensed, Stage};

use crate::checks::Check;
use crate::nameplate::Place;
use crate::parts::lines::{Interval, Saliency, line_impedance};
use crate::parts::margin::Margin;
use crate::parts::settle::{Settler, link, link_current, seen};
use crate::parts::then_pole::{Measurement, Next, ThenPole};
use crate::parts::train::LINES;
use crate::parts::{instant, significance, turning};
use crate::settings::{Decay, SettingsError};

pub use settings::LineInductanceSettings;

/// Largest angle in rad (4°) by which the pulses of a line may turn a free rotor.
const MOST_TURNED: f64 = 4.0 * turning::DEGREE;

/// The paper's detector.
pub type LineInductance<T> = ThenPole<T, LinePulses<T>>;

/// The measurement of the paper's detector: pulses across the three lines.
#[derive(Clone, Debug)]
pub struct LinePulses<T> {
    settings: LineInductanceSettings<T>,
    /// Line of the next or present pulse, and the number of the line's pulses before it.
    line: usize,
    pulses: u8,
    /// i1 of the next pulse in A.
    initial: Abc<T>,
    /// Sums of L in H over the pulses of each line; `resistance`, the next field: sums of R in Ω.
    inductance: Abc<T>,
    resistance: Abc<T>,
    /// Sum over all pulses of the square of L's deviation from the mean of its line, in H².
    scatter: T,
    /// Sum over the pulses of 2/(i2 − i1)² in 1/A²: multiplied by the variance of a reading, the relative variance of
    /// L.
    by_readings: T,
    /// L in H of the line's first pulse; `changes`, the next field: for each line, by how much L of its last pulse is
    /// larger.
    first: T,
    changes: Abc<T>,
    /// Sum in ns, by line, of the instants at which the pulses were sampled at their ends.
    ends: [u64; 3],
}

impl<T: Real> LineInductance<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: LineInductanceSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = Abc::new(T::zero(), T::zero(), T::zero());
        let measurement = LinePulses {
            settings,
            line: 0,
            pulses: 0,
            initial: zero,
            inductance: zero,
            resistance: zero,
            scatter: T::zero(),
            by_readings: T::zero(),
            first: T::zero(),
            changes: zero,
            ends: [0; 3],
        };
        let settler = Settler::new(settings.settle, settings.decay == Decay::Fast);
        Ok(Self::start(measurement, settler, settings.polarity))
    }
}

impl<T: Real> LinePulses<T> {
    fn pulse(&self) -> Command<T> {
        let s = &self.settings;
        let (first, second) = LINES[self.line];
        let decay = match s.decay {
            Decay::Slow => Stage::freewheel(first, second, s.period - s.pulse),
            // The wait that follows belongs to the period.
            Decay::Fast => Stage::off(s.period - s.pulse - s.settle.wait),
        };
        let sampling = Sampling::twice(s.pulse - s.sample_lead, s.third_sample());
        Command::sequence(Stage::line(first, second, s.pulse), decay, sampling)
    }

    /// Returns i1, i2 and i3 of a pulse in A, without the offset steps that occur if different sensors read them.
    fn currents(&self, second: &Reading<T>, third: &Reading<T>) -> Result<[T; 3], Fault<T>> {
        let ((from, to), none) = (LINES[self.line], self.initial);
        Ok(match self.settings.place() {
            Place::InLine => [none[from], seen(second, from)?, seen(third, from)?],
            Place::BelowLegs => [T::zero(), none[to] - seen(second, to)?, seen(third, from)? - none[from]],
            // Diodes return the current to the link.
            Place::InLink => {
                [T::zero(), link_current(second)? - none[from], none[from] - link_current(third)?]
            }
        })
    }

    /// Returns the delay between the trigger of i2 and its sampling.
    fn late(&self, second: &Reading<T>) -> Nanos {
        let sensing = &self.settings.sensing;
        let (from, to) = LINES[self.line];
        match self.settings.place() {
            Place::InLine if self.settings.sample_lead == Nanos::ZERO => Nanos::ZERO,
            // A derived current is as late as the sensor of the line's other phase.
            Place::InLine if second.sensed[from] == Sensed::Derived => {
                Nanos::from_seconds(sensing.late_of(to).to_double())
            }
            Place::InLine => Nanos::from_seconds(sensing.late_of(from).to_double()),
            Place::BelowLegs => Nanos::from_seconds(sensing.late_of(to).to_double()),
            Place::InLink => Nanos(sensing.averaged.0 / 2),
        }
    }

    /// Evaluates a pulse: its R and L.
    fn pulsed(&mut self, readings: &[Reading<T>], margin: &mut Margin<T>) -> Result<(), Fault<T>> {
        let [second, third] = readings else { return Err(Fault::UnexpectedReadings) };
        let phase = LINES[self.line].0;
        let [i1, i2, i3] = self.currents(second, third)?;
        let s = &self.settings;
        let (on_link, off_link) = (link(second)?, link(third)?);
        margin.at_least(i2 - i1, s.least_current);
        if i2 - i1 < s.least_current {
            return Err(Fault::NoCurrent { peak: i2 - i1, needed: s.least_current });
        }
        let seconds = |duration: Nanos| T::of(duration.seconds());
        // Mean voltages: the dead time before the pulse has no voltage; after an early i2 a rest of the pulse follows.
        let late = self.late(second);
        let risen = s.pulse - s.sample_lead + late;
        let rise = Interval {
            voltage: on_link * seconds(risen - s.dead_time) / seconds(risen),
            begin: i1,
            end: i2,
            duration: seconds(risen),
        };
        // A sensor in the phase reads i2 and i3 with the same delay.
        let after = s.third_sample() - s.pulse + if s.place() == Place::InLine { late } else { Nanos::ZERO };
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
        let before = T::of(f64::from(self.pulses));
        if self.pulses > 0 {
            let apart = inductance - self.inductance[phase] / before;
            self.scatter = self.scatter + apart * apart * before / (before + T::one());
            if self.pulses + 1 == s.pulses {
                self.changes[phase] = inductance - self.first;
            }
        } else {
            self.first = inductance;
        }
        self.inductance[phase] = self.inductance[phase] + inductance;
        self.resistance[phase] = self.resistance[phase] + resistance;
        self.initial = third.current;
        Ok(())
    }

    /// Computes the axis from the mean inductances of the lines by equations (5)–(7), and checks it.
    fn find_axis(
        &self,
        settler: &mut Settler<T>,
        findings: &mut Findings<T>,
    ) -> Result<Saliency<T>, Fault<T>> {
        let count = T::of(f64::from(self.settings.pulses));
        let lines = self.inductance.map(|sum| sum / count);
        let (s, margin) = (&self.settings, &mut settler.margin);
        // Equation (10) separates the resistance from the inductance.
        s.plausibility.inductances(margin, lines.0.map(|line| [line; 2]), s.pulse, T::zero())?;
        let saliency = Saliency::from_lines(lines, s.saliency);
        findings.line_inductance = Some(lines);
        findings.line_resistance = Some(self.resistance.map(|sum| sum / count));
        findings.mean_inductance = Some(saliency.mean);
        findings.saliency = Some(saliency.amplitude);
        let (needed, least) = (self.needed(&saliency, settler), self.settings.least_saliency);
        significance::check(&mut settler.margin, saliency.ratio(), needed, least)?;
        self.check_standing(&saliency, settler)?;
        s.plausibility.saliency(&mut settler.margin, (saliency.ratio(), needed), s.pulse, T::zero())?;
        Ok(saliency)
    }

    /// Checks that each line's last pulse finds the inductance of its first one. If the axis turns by δ in between, `L
    /// = 3 (L_A − L_B cos 2x)` changes by `6 L_B δ sin 2x`, with x the angle between axis and line. Currents that grow
    /// from pulse to pulse also change L by saturation, but in all lines alike or by cos 2x: over three lines, both are
    /// orthogonal to sin 2x, whose squares sum to 3/2.
    fn check_standing(&self, saliency: &Saliency<T>, settler: &mut Settler<T>) -> Result<(), Fault<T>> {
        let s = &self.settings;
        if s.pulses < 2 || !s.plausibility.checks.has(Check::Turning) {
            return Ok(());
        }
        let seconds = |duration: Nanos| T::of(duration.seconds());
        let ratio = saliency.ratio();
        let turned = saliency.turned(self.changes);
        let pulses = T::of(3.0) * T::of(f64::from(s.pulses));
        let noise = settler.noise.deviation();
        let readings = self.by_readings / pulses * noise * noise;
        // Both pulses have the same delays of the legs, and jitter of their own.
        let jitter = significance::of_timing(seconds(s.dead_time), seconds(s.pulse)) / T::of(4.0);
        let each = (readings + jitter) / T::of(3.0);
        let span = seconds(s.period * u64::from(s.pulses - 1));
        let apart = T::of(MOST_TURNED);
        turning::check_axis(&mut settler.margin, (turned, span), each.sqrt() / ratio, apart, None)
    }

    /// Returns the square of |L_B|/L_A that must be exceeded. It allows for noise (from the scatter of pulses, or from
    /// the readings without current before a single pulse), for the gain of the one sensor that reads a line, and for
    /// the delays of the legs.
    fn needed(&self, saliency: &Saliency<T>, settler: &Settler<T>) -> T {
        let s = &self.settings;
        let count = T::of(f64::from(s.pulses));
        let line = T::of(3.0) * saliency.mean;
        let lines =
            |variance: T, freedom: T| significance::scattered(significance::of_lines(variance), freedom);
        let noise = if s.pulses > 1 {
            let freedom = T::of(3.0) * (count - T::one());
            lines(self.scatter / (freedom * count * line * line), freedom)
        } else {
            let noise = &settler.noise;
            let readings = self.by_readings / T::of(3.0) * noise.deviation() * noise.deviation();
            let (link, links) = noise.of_link();
            lines(readings, noise.freedom()) + lines(link, links)
        };
        let [dead, pulse] = [s.dead_time, s.pulse].map(|time| T::of(time.seconds()));
        let timing = significance::of_timing(dead, pulse);
        noise + significance::known(significance::of_lines(s.gain_tolerance * s.gain_tolerance + timing))
    }
}

impl<T: Real> Measurement<T> for LinePulses<T> {
    fn rested(&mut self, settler: &Settler<T>) -> Command<T> {
        self.initial = settler.residual;
        self.pulse()
    }

    fn measured(
        &mut self,
        readings: &[Reading<T>],
        settler: &mut Settler<T>,
        findings: &mut Findings<T>,
    ) -> Result<Next<T>, Fault<T>> {
        self.pulsed(readings, &mut settler.margin)?;
        let s = &self.settings;
        // The pulse ends before the decay that belongs to its command.
        self.ends[self.line] += (settler.clock + s.pulse - s.sample_lead - self.pulse().duration()).0;
        self.pulses += 1;
        if self.pulses < self.settings.pulses {
            return Ok(match self.settings.decay {
                Decay::Slow => Next::Drive(self.pulse()),
                Decay::Fast => Next::Wait,
            });
        }
        if self.line + 1 < LINES.len() {
            (self.line, self.pulses) = (self.line + 1, 0);
            return Ok(Next::Wait);
        }
        let axis = self.find_axis(settler, findings)?;
        let instants = self.ends.map(|ends| T::of(Nanos(ends / u64::from(self.settings.pulses)).seconds()));
        let instant = instant::of_lines(axis.axis, instants);
        Ok(Next::Test(axis.axis, instant, T::of(1.5) * (axis.mean + axis.amplitude)))
    }
}
