//! The paper's method: three line inductances give the axis, two voltage vectors its north end.
//!
//! ```text
//!   wait ─► AB pulses ─► wait ─► BC pulses ─► wait ─► CA pulses ─► wait ─► vector at θ̂ ─► wait ─► at θ̂ + 180°
//!           L_AB, R              L_BC, R              L_CA, R  └► θ̂ modulo 180°, (5)–(7)       larger i_d: north
//! ```
//! and a last wait, so that the detection leaves no current behind.
//!
//! A pulse puts the DC link across two phases for `pulse`; then the current decays. Samples i1 before it, i2 at
//! its end and i3 in the decay give R and L of the line by equation (10).

use standstill_interface::{
    Abc, Angle, Command, Detector, Fault, Findings, Nanos, Outcome, Phase, Polarity, Reading, Real, Sampling,
    Stage, Step, Undetermined,
};

use crate::lines::{Interval, Saliency, SaliencySign, line_impedance};
use crate::polarity::PolaritySettings;
use crate::settings::{Decay, SettingsError, require, require_positive};
use crate::settle::{Noise, SettleSettings, link, seen};

/// Settings of the paper's method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineInductanceSettings<T> {
    /// t1: how long the DC link is across a line.
    pub pulse: Nanos,
    /// From one pulse to the next.
    pub period: Nanos,
    /// Pulses per line, averaged.
    pub pulses: u8,
    /// How the current decays after a pulse.
    pub decay: Decay,
    /// How long before the end of the pulse i2 is sampled. Zero, as in the paper, samples at the edge itself; a
    /// drive with low-side shunts needs more than its jitter, because beyond the edge its shunts see other legs.
    pub sample_lead: Nanos,
    /// Dead time of the drive: the pulse is shorter by it. Zero: ignored, which scales all inductances alike
    /// and leaves the angle as it is.
    pub dead_time: Nanos,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// Current in A that a pulse must at least raise.
    pub least_current: T,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// The wait before the first pulse of a line and before each vector; with fast decay before each pulse.
    pub settle: SettleSettings<T>,
    /// The polarity test.
    pub polarity: PolaritySettings<T>,
}

impl<T: Real> LineInductanceSettings<T> {
    /// The paper's settings (section 2: pulses of 80 µs every 2.4 ms, three a line, vectors near rated current)
    /// for a motor with this saliency, rated current in A and phase resistance in Ω, on a drive with this
    /// dead time and carrier period. What the paper does not print is chosen here: vectors of 1 ms, 2 % above
    /// the rated current, the mean of Table 2.
    pub fn paper(
        decay: Decay,
        saliency: SaliencySign,
        rated_current: T,
        resistance: T,
        dead_time: Nanos,
        carrier_period: Nanos,
    ) -> Self {
        Self {
            pulse: Nanos::from_micros(80),
            period: Nanos::from_micros(2400),
            pulses: 3,
            decay,
            sample_lead: Nanos::ZERO,
            dead_time,
            saliency,
            least_current: rated_current * T::of(0.02),
            least_saliency: T::of(0.05),
            settle: SettleSettings {
                wait: Nanos::from_micros(500),
                threshold: rated_current * T::of(0.025),
                attempts: 400,
            },
            polarity: PolaritySettings {
                carrier_period,
                // A millisecond, in whole periods.
                periods: u16::try_from((1_000_000 / carrier_period.0.max(1)).max(1)).unwrap_or(u16::MAX),
                current: rated_current * T::of(1.02),
                resistance,
                dead_time,
                least_margin: rated_current * T::of(0.01),
            },
        }
    }

    /// When i3 is sampled, counted from the start of the pulse. With slow decay at the end of the period, as in
    /// the paper; with fast decay four fifths of the pulse later, shortly before the current is gone.
    fn third_sample(&self) -> Nanos {
        match self.decay {
            Decay::Slow => self.period,
            Decay::Fast => self.pulse + Nanos(self.pulse.0 / 5 * 4),
        }
    }

    fn check(&self) -> Result<(), SettingsError> {
        require(self.pulse > Nanos::ZERO, "pulse", "positive")?;
        require(self.pulses > 0, "pulses", "at least 1")?;
        require(
            self.dead_time + self.sample_lead < self.pulse,
            "dead_time",
            "with sample_lead shorter than the pulse",
        )?;
        let decay_needs = self.pulse * 2 + self.settle.wait;
        require(self.period > decay_needs, "period", "longer than two pulses and settle.wait")?;
        require(self.period <= LONGEST, "period", "at most a minute")?;
        require_positive(self.least_current, "least_current")?;
        require_positive(self.least_saliency, "least_saliency")?;
        self.settle.check()?;
        self.polarity.check()
    }
}

/// No detection waits longer for a single thing.
const LONGEST: Nanos = Nanos(60_000_000_000);

/// The lines in the paper's order: from the first phase to the second.
const LINES: [(Phase, Phase); 3] = [(Phase::A, Phase::B), (Phase::B, Phase::C), (Phase::C, Phase::A)];

/// What the last command was, and so what its readings mean.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Start,
    Settling { waits: u16, released: bool, next: Action },
    Pulsing { line: usize, pulse: u8 },
    Pushing { against: bool },
}

/// What comes after the current is gone.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Action {
    Pulse { line: usize, pulse: u8 },
    Push { against: bool },
    Answer,
}

/// The paper's detector.
#[derive(Clone, Debug)]
pub struct LineInductance<T> {
    settings: LineInductanceSettings<T>,
    state: State,
    /// i1 of the next pulse in A.
    initial: Abc<T>,
    /// Last DC-link reading in V.
    dc_link: T,
    /// Sums over the pulses of each line.
    inductance: Abc<T>,
    resistance: Abc<T>,
    axis: Angle<T>,
    along: T,
    noise: Noise<T>,
    findings: Findings<T>,
}

impl<T: Real> LineInductance<T> {
    /// A detector, ready for its first step.
    ///
    /// # Errors
    /// A setting with which the method cannot work.
    pub fn new(settings: LineInductanceSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = Abc::new(T::zero(), T::zero(), T::zero());
        Ok(Self {
            settings,
            state: State::Start,
            initial: zero,
            dc_link: T::zero(),
            inductance: zero,
            resistance: zero,
            axis: Angle::from_radians(T::zero()),
            along: T::zero(),
            noise: Noise::new(),
            findings: Findings::default(),
        })
    }

    /// Begins to wait for the current of a pulse to be gone.
    fn settle(&mut self, next: Action) -> Command<T> {
        self.wait(1, self.settings.decay == Decay::Fast, next)
    }

    fn wait(&mut self, waits: u16, released: bool, next: Action) -> Command<T> {
        self.state = State::Settling { waits, released, next };
        self.settings.settle.command(released)
    }

    fn act(&mut self, action: Action) -> Step<T> {
        Step::Drive(match action {
            Action::Answer => return Step::Done(self.answer()),
            Action::Pulse { line, pulse } => {
                self.state = State::Pulsing { line, pulse };
                self.pulse(line)
            }
            Action::Push { against } => {
                self.state = State::Pushing { against };
                let saliency = self.findings.saliency.unwrap_or_else(T::zero);
                let mean = self.findings.mean_inductance.unwrap_or_else(T::zero);
                let amplitude = self.settings.polarity.amplitude(T::of(1.5) * (mean + saliency));
                let angle = if against { self.axis.opposite() } else { self.axis };
                self.settings.polarity.command(angle, amplitude, self.dc_link)
            }
        })
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

    /// After a wait: the next action, another wait, or the end.
    fn settled(
        &mut self,
        waits: u16,
        released: bool,
        next: Action,
        readings: &[Reading<T>],
    ) -> Result<Step<T>, Fault<T>> {
        match self.settings.settle.judge(readings)? {
            Ok(residual) if released => {
                self.initial = residual;
                self.dc_link = readings.last().map_or(self.dc_link, |reading| reading.dc_link);
                self.noise.add(readings);
                Ok(self.act(next))
            }
            Ok(_) => Ok(Step::Drive(self.wait(1, true, next))),
            Err(current) if waits >= self.settings.settle.attempts => Err(Fault::CurrentPersists(current)),
            Err(_) => Ok(Step::Drive(self.wait(waits + 1, released, next))),
        }
    }

    /// After a pulse: its R and L, then the next pulse, or the axis and the first vector.
    fn pulsed(&mut self, line: usize, pulse: u8, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        let [second, third] = readings else { return Err(Fault::UnexpectedReadings) };
        let phase = LINES[line].0;
        let (i1, i2, i3) = (self.initial[phase], seen(second, phase)?, seen(third, phase)?);
        let s = &self.settings;
        let (on_link, off_link) = (link(second)?, link(third)?);
        if i2 - i1 < s.least_current {
            return Err(Fault::NoCurrent { peak: i2 - i1, needed: s.least_current });
        }
        let seconds = |duration: Nanos| T::of(duration.seconds());
        // Mean voltages: no voltage in the dead time before the pulse; a rest of the pulse after an early i2.
        let risen = s.pulse - s.sample_lead;
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
        let whole = seconds(after + s.sample_lead);
        let decay = Interval {
            voltage: (on_link * seconds(s.sample_lead) + decaying * seconds(after)) / whole,
            begin: i2,
            end: i3,
            duration: whole,
        };
        let (resistance, inductance) = line_impedance(rise, decay).ok_or(Fault::NotInductive(phase))?;
        if inductance <= T::zero() {
            return Err(Fault::NotInductive(phase));
        }
        self.inductance[phase] = self.inductance[phase] + inductance;
        self.resistance[phase] = self.resistance[phase] + resistance;
        self.initial = third.current;

        let next = pulse + 1;
        if next < s.pulses {
            let action = Action::Pulse { line, pulse: next };
            Ok(match s.decay {
                Decay::Slow => self.act(action),
                Decay::Fast => Step::Drive(self.settle(action)),
            })
        } else if line + 1 < LINES.len() {
            Ok(Step::Drive(self.settle(Action::Pulse { line: line + 1, pulse: 0 })))
        } else {
            self.find_axis()?;
            Ok(Step::Drive(self.settle(Action::Push { against: false })))
        }
    }

    /// Equations (5)–(7).
    fn find_axis(&mut self) -> Result<(), Fault<T>> {
        let count = T::of(f64::from(self.settings.pulses));
        let lines = self.inductance.map(|sum| sum / count);
        let saliency = Saliency::from_lines(lines, self.settings.saliency);
        self.findings.line_inductance = Some(lines);
        self.findings.line_resistance = Some(self.resistance.map(|sum| sum / count));
        self.findings.mean_inductance = Some(saliency.mean);
        self.findings.saliency = Some(saliency.amplitude);
        self.axis = saliency.axis;
        let (ratio, needed) = (saliency.ratio(), self.settings.least_saliency);
        if ratio >= needed { Ok(()) } else { Err(Fault::NoSaliency { ratio, needed }) }
    }

    /// After a vector: the other one, or the answer once the current is gone.
    fn pushed(&mut self, against: bool, readings: &[Reading<T>]) -> Result<Command<T>, Fault<T>> {
        let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
        for phase in Phase::ALL {
            seen(reading, phase)?;
        }
        let angle = if against { self.axis.opposite() } else { self.axis };
        let current = PolaritySettings::direct_current(reading.current, angle);
        if current < self.settings.least_current {
            return Err(Fault::NoCurrent { peak: current, needed: self.settings.least_current });
        }
        if !against {
            self.along = current;
            return Ok(self.settle(Action::Push { against: true }));
        }
        self.findings.polarity = Some(Polarity { along: self.along, against: current });
        Ok(self.settle(Action::Answer))
    }

    /// The larger i_d points north.
    fn answer(&self) -> Outcome<T> {
        let findings = self.findings;
        let (along, against) = findings.polarity.map_or((T::zero(), T::zero()), |p| (p.along, p.against));
        let margin = (along - against).abs();
        let needed = self.settings.polarity.needed_margin(self.noise.deviation());
        if margin >= needed {
            let angle = if along > against { self.axis } else { self.axis.opposite() };
            Outcome::Found { angle, findings }
        } else {
            let reason = Undetermined::MarginBelowNoise { margin, needed };
            Outcome::Axis { angle: self.axis, reason, findings }
        }
    }
}

impl<T: Real> Detector<T> for LineInductance<T> {
    fn step(&mut self, readings: &[Reading<T>]) -> Step<T> {
        let step = match self.state {
            // Whatever flows before the first command has no zero vector to keep it going.
            State::Start => Ok(Step::Drive(self.wait(1, true, Action::Pulse { line: 0, pulse: 0 }))),
            State::Settling { waits, released, next } => self.settled(waits, released, next, readings),
            State::Pulsing { line, pulse } => self.pulsed(line, pulse, readings),
            State::Pushing { against } => self.pushed(against, readings).map(Step::Drive),
        };
        step.unwrap_or_else(|fault| Step::Done(Outcome::Failed { fault, findings: self.findings }))
    }
}
