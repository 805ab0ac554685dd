//! The list of faults that can be simulated, each with name, place, and the unit and range of its size.

use standstill_detect::Method;
use standstill_interface::choice;
use standstill_quantity::unit::{Ampere, Ohm, One, Second, Share, Volt};
use standstill_quantity::{Quantity, Unit};
use toml::Value;

use crate::Scenario;

choice! {
    /// A failure mode: the part that is broken, and how.
    pub enum FaultMode {
        /// The wire from the drive to a phase is open.
        PhaseOpen = "phase-open",
        /// A contact adds its resistance to a phase.
        ContactResistance = "contact-resistance",
        /// A share of the turns of a phase is closed on itself.
        TurnsShorted = "turns-shorted",
        /// Two wires are exchanged: `at` names the phase whose wire is right.
        TerminalsSwapped = "terminals-swapped",
        /// All three wires are exchanged cyclically, by one terminal or by two.
        TerminalsTurned = "terminals-turned",
        /// The magnets have lost a share of their flux.
        MagnetWeak = "magnet-weak",
        /// The drive assumes the wrong pole to draw more current.
        SheetSignature = "sheet-signature",
        /// The drive assumes the inductances to be this multiple of their true values.
        SheetInductance = "sheet-inductance",
        /// The drive assumes the resistance to be this multiple of its true value.
        SheetResistance = "sheet-resistance",
        /// The upper switch of a leg never turns on, or its gate driver is dead.
        UpperSwitchOpen = "upper-switch-open",
        /// The lower switch of a leg never turns on, or its gate driver is dead.
        LowerSwitchOpen = "lower-switch-open",
        /// A leg never switches.
        LegOff = "leg-off",
        /// The dead time is this multiple of its nominal value.
        DeadTimeLong = "dead-time-long",
        /// The capacitor of the DC link has only this share of its capacitance left.
        LinkCapacitorAged = "link-capacitor-aged",
        /// The source feeds the DC link through this resistance.
        SupplyWeak = "supply-weak",
        /// The source delivers no more than this current to the DC link.
        SupplyLimited = "supply-limited",
        /// A current sensor reads only its offset.
        CurrentDead = "current-dead",
        /// A current sensor repeats the last value that it read.
        CurrentFrozen = "current-frozen",
        /// A current sensor always reads this current, with either sign.
        CurrentStuck = "current-stuck",
        /// One bit of a current converter's codes is always set or always clear; bit 0 is the lowest.
        CurrentBit = "current-bit",
        /// The gain of a current sensor is this multiple of its nominal value.
        CurrentGain = "current-gain",
        /// A current sensor has this additional offset, with either sign.
        CurrentOffset = "current-offset",
        /// A current sensor is connected the wrong way round.
        CurrentSign = "current-sign",
        /// Two current sensors are exchanged: `at` names the phase whose sensor is right.
        CurrentsSwapped = "currents-swapped",
        /// The bandwidth of a current sensor is only this share of its nominal value.
        CurrentSlow = "current-slow",
        /// The reference voltage of all converters drifts: readings grow or shrink by this share per second.
        ReferenceDrift = "reference-drift",
        /// All samples are taken later by this time.
        SampleLate = "sample-late",
        /// The gain of the DC-link voltage sensor is this multiple of its nominal value.
        LinkGain = "link-gain",
        /// The DC-link voltage sensor always reads this voltage.
        LinkStuck = "link-stuck",
        /// No comparator trips.
        ComparatorStuck = "comparator-stuck",
        /// The clock of the timer that captures trips is slow by this share.
        TimerOff = "timer-off",
        /// Commands reach the gates one carrier period late.
        CommandLate = "command-late",
        /// Duty cycles are limited to this share.
        DutyLimited = "duty-limited",
        /// The converter returns the results of the previous sample.
        SampleLost = "sample-lost",
    }
}

/// Description of the size of a fault: how to parse the size, which values are allowed, and which are typical.
#[derive(Clone, Copy)]
pub struct Size {
    /// Function that returns a value in SI units; none if the value is not of the right quantity.
    pub(super) read: fn(&Value) -> Option<f64>,
    /// Smallest and largest value allowed, in SI units.
    pub(super) range: [f64; 2],
    /// The allowed values, described in words.
    pub(super) allowed: &'static str,
    /// Function that returns the smallest and largest typical size of this fault for the drive of a scenario, in SI
    /// units.
    pub typical: fn(&Scenario<Method<f64>>) -> [f64; 2],
}

/// A second or third size of a fault, with its own optional key beside `magnitude`.
#[derive(Clone, Copy)]
pub struct Further {
    pub size: Size,
    /// The value if the file does not set the key.
    pub(super) without: f64,
}

fn read<U: Unit>(value: &Value) -> Option<f64> {
    value.clone().try_into::<Quantity<U>>().ok().map(Quantity::value)
}

/// Makes a size in the unit `U`.
const fn sized<U: Unit>(
    range: [f64; 2],
    allowed: &'static str,
    typical: fn(&Scenario<Method<f64>>) -> [f64; 2],
) -> Size {
    Size { read: read::<U>, range, allowed, typical }
}

/// The further sizes of the mode `turns-shorted`, each with its key.
const OF_SHORTS: [(&str, Further); 2] = [
    (
        "resistance",
        Further {
            size: sized::<Ohm>([0.0, 1e4], "a resistance from 0 to 10 kΩ", |scenario| {
                super::short::resistances(&scenario.motor)
            }),
            without: 0.0,
        },
    ),
    (
        "coupling",
        Further {
            size: sized::<One>([0.1, 0.99], "a coupling from 0.1 to 0.99", |_| super::short::COUPLINGS),
            without: 0.9,
        },
    ),
];

/// Reason why faults that short the DC link are not simulated.
const SHORTS: &str = "it shorts the DC link through a leg, whose current only stray inductances limit, and there are none here; such a fault trips the drive";

/// Faults that are not simulated: the name of each, and the reason.
pub(super) const REFUSED: [(&str, &str); 8] = [
    ("switch-shorted", SHORTS),
    ("gate-stuck-on", SHORTS),
    ("dead-time-missing", SHORTS),
    ("link-shorted", SHORTS),
    (
        "diode-open",
        "a current that only this diode can carry has no path, and its voltage is one of a clamp or an avalanche, which are not modelled",
    ),
    (
        "frame-short",
        "a short to the frame needs a path for the sum of the three currents, which the machine here does not have",
    ),
    ("pole-pair-weak", "all pole pairs are alike here: `magnet-weak` weakens all of them"),
    (
        "sheet-pole-pairs",
        "the number of pole pairs changes no electrical angle; where the sheet gives Kv or Ke, a wrong number makes another magnet flux, which the \
         check `turning` and alignment read",
    ),
];

impl FaultMode {
    /// Returns the reason why a fault of this name is not simulated; none for the name of a [`FaultMode`] and for an
    /// unknown name.
    ///
    /// ```
    /// use standstill_scenario::FaultMode;
    ///
    /// assert!(FaultMode::refused("switch-shorted").is_some_and(|why| why.contains("DC link")));
    /// assert_eq!(FaultMode::refused("phase-open"), None);
    /// ```
    pub fn refused(name: &str) -> Option<&'static str> {
        REFUSED.iter().find(|(of, _)| *of == name).map(|(_, why)| *why)
    }

    /// Returns the size of this kind of fault; none for faults without a size.
    pub fn size(self) -> Option<Size> {
        let most_current =
            |scenario: &Scenario<Method<f64>>| [0.05, 1.0].map(|share| share * scenario.motor.rated_current);
        Some(match self {
            Self::ContactResistance => {
                sized::<Ohm>([0.0, 1e4], "a resistance from 0 to 10 kΩ (above, `phase-open`)", |scenario| {
                    [0.5, 10.0].map(|times| times * scenario.motor.resistance)
                })
            }
            Self::TurnsShorted => {
                sized::<Share>([0.001, 1.0], "a share of the phase's turns, from 0.1 to 100 %", |scenario| {
                    super::short::shares(&scenario.motor)
                })
            }
            Self::MagnetWeak => sized::<Share>([0.0, 0.9], "a lost share from 0 to 90 %", |_| [0.1, 0.3]),
            Self::SheetInductance | Self::SheetResistance => {
                sized::<One>([0.05, 20.0], "a factor from 0.05 to 20", |_| [2.0, 2.0])
            }
            Self::DeadTimeLong => sized::<One>([1.0, 100.0], "a factor from 1 to 100", |_| [2.0, 10.0]),
            Self::LinkCapacitorAged => {
                sized::<Share>([0.001, 1.0], "a share that is left, from 0.1 to 100 %", |_| [0.1, 0.5])
            }
            Self::SupplyWeak => sized::<Ohm>([1e-6, 1e6], "a resistance from 1 µΩ to 1 MΩ", |scenario| {
                [0.1, 1.0].map(|share| share * scenario.drive.link.voltage / scenario.motor.rated_current)
            }),
            Self::SupplyLimited => sized::<Ampere>([0.0, 1e6], "a current from 0 to 1 MA", |scenario| {
                [0.0, 0.3].map(|share| share * scenario.motor.rated_current)
            }),
            Self::CurrentStuck | Self::CurrentOffset => {
                sized::<Ampere>([0.0, 1e6], "a current from 0 to 1 MA", most_current)
            }
            Self::CurrentBit => sized::<One>([0.0, 23.0], "a bit from 0 to 23", |scenario| {
                let bits = scenario.sensors.adc.map_or(1, |adc| adc.bits.max(1));
                [0.0, f64::from(bits - 1)]
            }),
            Self::CurrentGain => sized::<One>([0.0, 100.0], "a factor from 0 to 100", |_| [0.5, 1.5]),
            Self::LinkGain => sized::<One>([0.01, 100.0], "a factor from 0.01 to 100", |_| [0.5, 1.5]),
            Self::CurrentSlow => {
                sized::<Share>([1e-4, 1.0], "a share that is left, from 0.01 to 100 %", |_| [0.01, 0.3])
            }
            Self::ReferenceDrift => {
                sized::<Share>([0.0, 1e3], "a share in each second, from 0 to 100,000 %", |_| [0.5, 5.0])
            }
            Self::SampleLate => sized::<Second>([0.0, 1e-3], "a time from 0 to 1 ms", |scenario| {
                [0.01, 0.5].map(|share| share * scenario.drive.carrier_period.seconds())
            }),
            Self::LinkStuck => sized::<Volt>([1e-3, 1e6], "a voltage from 1 mV to 1 MV", |scenario| {
                [0.3, 1.5].map(|share| share * scenario.drive.link.voltage)
            }),
            Self::TimerOff => sized::<Share>([0.0, 0.9], "a share from 0 to 90 %", |_| [0.05, 0.5]),
            Self::DutyLimited => sized::<Share>([0.0, 1.0], "a share from 0 to 100 %", |_| [0.5, 0.5]),
            _ => return None,
        })
    }

    /// Returns the further sizes of this kind of fault, each with its key. The size of the key `magnitude` is not among them.
    pub fn further(self) -> &'static [(&'static str, Further)] {
        if self == Self::TurnsShorted { &OF_SHORTS } else { &[] }
    }

    /// Returns whether this kind of fault may end during the detection.
    pub fn may_pass(self) -> bool {
        self.may_begin() && self != Self::TurnsShorted
    }

    /// Returns whether this kind of fault may begin during the detection.
    pub fn may_begin(self) -> bool {
        !self.is_fixed()
            && !matches!(
                self,
                Self::TerminalsSwapped
                    | Self::TerminalsTurned
                    | Self::DeadTimeLong
                    | Self::LinkCapacitorAged
                    | Self::SupplyWeak
                    | Self::SupplyLimited
                    | Self::CurrentSlow
                    | Self::SampleLate
                    | Self::TimerOff
                    | Self::CommandLate
            )
    }

    /// Returns whether this kind of fault has a place: one of the phases, legs or sensors.
    pub fn has_place(self) -> bool {
        matches!(
            self,
            Self::PhaseOpen
                | Self::ContactResistance
                | Self::TurnsShorted
                | Self::TerminalsSwapped
                | Self::UpperSwitchOpen
                | Self::LowerSwitchOpen
                | Self::LegOff
                | Self::CurrentDead
                | Self::CurrentFrozen
                | Self::CurrentStuck
                | Self::CurrentBit
                | Self::CurrentGain
                | Self::CurrentOffset
                | Self::CurrentSign
                | Self::CurrentsSwapped
                | Self::CurrentSlow
        )
    }

    /// Returns true if this kind of fault changes the magnets or the nameplate, which contains the data that the drive knows. Magnets and
    /// nameplate are the same in all trials.
    pub fn is_fixed(self) -> bool {
        matches!(
            self,
            Self::MagnetWeak | Self::SheetSignature | Self::SheetInductance | Self::SheetResistance
        )
    }
}
