//! All methods in one type, by name. Each method is a file in the folder `method` and a line of `methods!`.

mod alignment;
mod bipolar;
mod foreign;
mod line_inductance;
mod maximum_likelihood;
mod open_terminal;
mod pulsating;
mod rotating;
mod six_pulse;
mod subdivision;

use core::fmt;

use standstill_interface::{Angle, Detector, Fault, Findings, Nanos, Outcome, Reading, Real, Step, choice};

use crate::checks::Checks;
use crate::keys::{self, Key, Keyed, Lines, Value};
use crate::nameplate::Nameplate;
use crate::parts::margin::Margin;
use crate::parts::polarity::PolaritySettings;
use crate::settings::{Decay, Settings, SettingsError, Source};
pub use alignment::{Alignment, AlignmentSettings};
pub use bipolar::{Bipolar, BipolarSettings};
pub use foreign::{Foreign, ForeignSettings};
pub use line_inductance::{LineInductance, LineInductanceSettings};
pub use maximum_likelihood::{Adaptive, MOST_SAMPLES, MaximumLikelihood, MaximumLikelihoodSettings};
pub use open_terminal::{OpenTerminal, OpenTerminalSettings};
pub use pulsating::{PulsatingInjection, PulsatingInjectionSettings};
pub use rotating::{RotatingInjection, RotatingInjectionSettings};
pub use six_pulse::{SixPulse, SixPulseSettings};
pub use subdivision::{Subdivision, SubdivisionSettings};

#[cfg(test)]
pub(crate) use {maximum_likelihood::likelihood, pulsating::Pulsating, rotating::Rotating};

/// A detection as its method implements it: steps that a fault can end, and the findings so far.
pub(crate) trait Sequence<T: Real> {
    /// Takes a step as [`Detector::step`] does.
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>>;

    /// Returns the measurements so far, and the smallest margin to a fault.
    fn so_far(&self) -> (&Findings<T>, Margin<T>);
}

choice! {
    /// The methods.
    #[derive(Default, Hash, PartialOrd, Ord)]
    pub enum MethodName {
        /// The paper's line pulses whose current decays slowly, through the zero vector.
        LineInductance = "line-inductance",
        /// The paper's line pulses whose current decays fast, through the diodes.
        LineInductanceFast = "line-inductance-fast" default,
        /// Voltage vectors in all directions, then in ever smaller steps around the one with the largest current.
        Subdivision = "subdivision",
        /// Rotating high-frequency injection.
        HfiRotating = "hfi-rotating",
        /// Pulsating high-frequency injection.
        HfiPulsating = "hfi-pulsating",
        /// A direct current that turns the rotor to a known angle.
        DcAlignment = "dc-alignment",
        /// Line pulses in both directions, which also compare the sensors' gains.
        Bipolar = "bipolar",
        /// Line pulses in both directions, and the most likely angle from all their samples.
        MaximumLikelihood = "maximum-likelihood",
        /// Maximum likelihood with pulses that grow until angle and pole are certain enough.
        MaximumLikelihoodAdaptive = "maximum-likelihood-adaptive",
        /// Line pulses in both directions, and the voltage of the floating terminal.
        OpenTerminal = "open-terminal",
        /// Pulses in six directions, one leg against two, and the time to a comparator's threshold.
        SixPulse = "six-pulse",
    }
}

/// Returns a constant of the settings of the method with this name.
macro_rules! of_settings {
    ($name:expr, $constant:ident) => {
        match $name {
            MethodName::LineInductance | MethodName::LineInductanceFast => {
                LineInductanceSettings::<f64>::$constant
            }
            MethodName::Subdivision => SubdivisionSettings::<f64>::$constant,
            MethodName::HfiRotating => RotatingInjectionSettings::<f64>::$constant,
            MethodName::HfiPulsating => PulsatingInjectionSettings::<f64>::$constant,
            MethodName::DcAlignment => AlignmentSettings::<f64>::$constant,
            MethodName::Bipolar => BipolarSettings::<f64>::$constant,
            MethodName::MaximumLikelihood | MethodName::MaximumLikelihoodAdaptive => {
                MaximumLikelihoodSettings::<f64>::$constant
            }
            MethodName::OpenTerminal => OpenTerminalSettings::<f64>::$constant,
            MethodName::SixPulse => SixPulseSettings::<f64>::$constant,
        }
    };
}

impl MethodName {
    /// Returns the kinds of readings of which any one is enough for the method.
    pub const fn sources(self) -> &'static [Source] {
        match self {
            // With slow decay the current circulates through the lower switches, where a shunt in the DC link does not
            // see it.
            Self::LineInductance => &[Source::PhaseCurrents],
            _ => of_settings!(self, SOURCES),
        }
    }

    /// Returns the checks that a list of the method's key `checks` can name, see [`Keyed::CHECKS`].
    pub const fn checks(self) -> Checks {
        of_settings!(self, CHECKS)
    }
}

impl fmt::Display for MethodName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

macro_rules! methods {
    ($($(#[$doc:meta])* $variant:ident: $settings:ident => $detector:ident),* $(,)?) => {
        /// Settings of any method.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Method<T> {
            $($(#[$doc])* $variant($settings<T>)),*
        }

        /// A detector of any method.
        #[derive(Clone, Debug)]
        // The enum is as large as its largest detector, mostly memory for samples. Boxing that would need an allocator.
        #[allow(clippy::large_enum_variant)]
        pub enum AnyDetector<T> {
            $($(#[$doc])* $variant($detector<T>)),*
        }

        $(impl<T: Real> Detector<T> for $detector<T> {
            fn step(&mut self, readings: &[Reading<T>]) -> Step<T> {
                let outcome = match self.next(readings) {
                    Ok(Step::Drive(command)) => return Step::Drive(command),
                    Ok(Step::Done(outcome)) => outcome,
                    Err(fault) => Outcome::Failed { fault, findings: *self.so_far().0 },
                };
                Step::Done(outcome.with_fault_margin(self.so_far().1.smallest()))
            }
        }

        impl<T: Real> Settings<T> for $settings<T> {
            type Detector = $detector<T>;

            fn detector(&self) -> Result<Self::Detector, SettingsError> {
                $detector::new(*self)
            }

            fn carrier_period(&self) -> Option<Nanos> {
                self.carrier()
            }

            fn turns_rotor(&self) -> bool {
                Self::TURNS_ROTOR
            }

            fn sources(&self) -> &'static [Source] {
                self.needed_sources()
            }
        })*

        in_numbers!(f32, $($variant),*);
        in_numbers!(f64, $($variant),*);

        impl<T: Real> Method<T> {
            /// Returns a key's value; none if the method, as it is set, does not have the key.
            pub fn get(&self, key: &Key) -> Option<Value> {
                match self {
                    $(Self::$variant(settings) => $settings::<T>::setting(key).and_then(|s| (s.get)(settings))),*
                }
            }

            /// Sets a key to a value within its range; returns false if the method, as it is set, does not have the
            /// key.
            pub fn set(&mut self, key: &Key, value: Value) -> bool {
                match self {
                    $(Self::$variant(settings) => $settings::<T>::setting(key).is_some_and(|s| (s.set)(settings, value))),*
                }
            }

            /// Describes the settings: see [`Keyed::describe`].
            pub fn describe(&self, line: &mut Lines<'_>) {
                match self {
                    $(Self::$variant(settings) => settings.describe(line)),*
                }
            }

            /// Returns whether the method has the key.
            pub fn has(&self, key: &Key) -> bool {
                match self {
                    $(Self::$variant(_) => $settings::<T>::setting(key).is_some()),*
                }
            }
        }

    };
}

/// Instantiates all methods for one numeric type, so that they are compiled here once, and not again in each crate that
/// uses them.
macro_rules! in_numbers {
    ($number:ty, $($variant:ident),*) => {
        impl Detector<$number> for AnyDetector<$number> {
            fn step(&mut self, readings: &[Reading<$number>]) -> Step<$number> {
                match self {
                    $(Self::$variant(detector) => detector.step(readings)),*
                }
            }
        }

        impl Settings<$number> for Method<$number> {
            type Detector = AnyDetector<$number>;

            fn detector(&self) -> Result<AnyDetector<$number>, SettingsError> {
                match self {
                    $(Self::$variant(settings) => settings.detector().map(AnyDetector::$variant)),*
                }
            }

            fn carrier_period(&self) -> Option<Nanos> {
                match self {
                    $(Self::$variant(settings) => settings.carrier_period()),*
                }
            }

            fn turns_rotor(&self) -> bool {
                match self {
                    $(Self::$variant(settings) => settings.turns_rotor()),*
                }
            }

            fn sources(&self) -> &'static [Source] {
                match self {
                    $(Self::$variant(settings) => settings.sources()),*
                }
            }
        }
    };
}

methods! {
    /// The paper's: three line inductances, then a polarity test.
    LineInductance: LineInductanceSettings => LineInductance,
    /// Voltage vectors in directions that close in on the axis.
    Subdivision: SubdivisionSettings => Subdivision,
    /// Rotating high-frequency injection.
    HfiRotating: RotatingInjectionSettings => RotatingInjection,
    /// Pulsating high-frequency injection.
    HfiPulsating: PulsatingInjectionSettings => PulsatingInjection,
    /// A current that turns the rotor to a known angle.
    DcAlignment: AlignmentSettings => Alignment,
    /// Line pulses in both directions.
    Bipolar: BipolarSettings => Bipolar,
    /// Line pulses in both directions, evaluated by maximum likelihood.
    MaximumLikelihood: MaximumLikelihoodSettings => MaximumLikelihood,
    /// Line pulses, read from the voltage of the open terminal.
    OpenTerminal: OpenTerminalSettings => OpenTerminal,
    /// Six voltage vectors, timed to a threshold of the current or sampled.
    SixPulse: SixPulseSettings => SixPulse,
    /// A detector that is defined outside this crate, such as a library in C.
    Foreign: ForeignSettings => Foreign,
}

impl<T: Real> Method<T> {
    /// Returns the settings of the polarity test that follows the axis; none for methods without such a test.
    pub fn polarity_mut(&mut self) -> Option<&mut PolaritySettings<T>> {
        match self {
            Self::LineInductance(settings) => Some(&mut settings.polarity),
            Self::Subdivision(settings) => Some(&mut settings.vector),
            Self::HfiRotating(settings) => Some(&mut settings.0.polarity),
            Self::HfiPulsating(settings) => Some(&mut settings.0.polarity),
            Self::DcAlignment(_)
            | Self::Bipolar(_)
            | Self::MaximumLikelihood(_)
            | Self::OpenTerminal(_)
            | Self::SixPulse(_)
            | Self::Foreign(_) => None,
        }
    }

    /// Returns whether the axis comes from line pulses.
    pub fn has_line_pulses(&self) -> bool {
        self.has(&keys::PULSE)
    }

    /// Returns whether the pulses depend on earlier readings.
    pub const fn is_adaptive(&self) -> bool {
        matches!(self, Self::MaximumLikelihood(settings) if settings.adaptive.is_some())
    }

    /// Returns half the width of the sectors in which the method answers; none if it answers with an angle.
    pub fn half_sector(&self) -> Option<Angle<T>> {
        let Self::SixPulse(settings) = self else { return None };
        let width = settings.sector.radians();
        (width > T::zero()).then(|| Angle::from_radians(width / T::of(2.0)))
    }

    /// Returns the method with line pulses of this length; none for methods without line pulses.
    #[must_use]
    pub fn with_pulse(mut self, pulse: Nanos) -> Option<Self> {
        self.set(&keys::PULSE, Value::time(pulse)).then_some(self)
    }

    /// Returns a method with settings that suit this motor and drive, and with the motor's polarity signature.
    pub fn suited(name: MethodName, drive: &Nameplate<T>) -> Self {
        let line_inductance = |decay| {
            let mut settings = LineInductanceSettings::paper(decay, drive);
            settings.polarity.signature = drive.signature;
            Self::LineInductance(settings)
        };
        match name {
            MethodName::LineInductance => line_inductance(Decay::Slow),
            MethodName::LineInductanceFast => line_inductance(Decay::Fast),
            MethodName::Subdivision => Self::Subdivision(SubdivisionSettings::suited(drive)),
            MethodName::HfiRotating => Self::HfiRotating(RotatingInjectionSettings::suited(drive)),
            MethodName::HfiPulsating => Self::HfiPulsating(PulsatingInjectionSettings::suited(drive)),
            MethodName::DcAlignment => Self::DcAlignment(AlignmentSettings::suited(drive)),
            MethodName::Bipolar => Self::Bipolar(BipolarSettings::suited(drive)),
            MethodName::MaximumLikelihood => {
                Self::MaximumLikelihood(MaximumLikelihoodSettings::suited(drive))
            }
            MethodName::MaximumLikelihoodAdaptive => {
                Self::MaximumLikelihood(MaximumLikelihoodSettings::adaptive(drive))
            }
            MethodName::OpenTerminal => Self::OpenTerminal(OpenTerminalSettings::suited(drive)),
            MethodName::SixPulse => Self::SixPulse(SixPulseSettings::suited(drive)),
        }
    }
}
