//! Sets the numbers of the sensors that depend on several keys, and checks the rules between these keys.

use standstill_interface::Nanos;
use standstill_numeric::whole;
use standstill_quantity::Quantity;
use standstill_quantity::unit::One;
use standstill_sim::{Adc, Arrangement, Comparators, PickUp, SensorSettings};

use crate::document::FileError;
use crate::errors::{ErrorSet, PICK_UP};
use crate::keys::{SensorsTable, Table as _};
use crate::named::Named;

/// Keys that need a drive with comparators.
const WATCHED: [&str; 5] = [
    "sensors.comparators",
    "sensors.comparator_offset",
    "sensors.comparator_delay",
    "sensors.comparator_delay_spread",
    "sensors.blanking",
];

/// Keys that need comparators with a timer that captures their trips.
const CAPTURED: [&str; 5] = [
    "sensors.timer_error",
    "sensors.comparator_noise",
    "sensors.comparator_bandwidth",
    "sensors.threshold_range",
    "sensors.threshold_bits",
];

impl SensorsTable {
    /// Checks the rules between the sensors' keys, and sets the numbers that depend on several keys.
    pub(super) fn apply_rules(
        &self,
        errors: ErrorSet,
        sensors: &mut SensorSettings,
    ) -> Result<(), FileError> {
        sensors.pick_up = self.pick_up(sensors.pick_up)?;
        if let Some(error) = self.resolver_error {
            sensors.resolver.error = error.value().to_radians();
        }
        if let Some(Named(arrangement)) = self.arrangement {
            sensors.arrangement = arrangement;
        }
        self.needs_comparators(sensors)?;
        if let Some(Named(comparators)) = self.comparators {
            sensors.comparator.arrangement = comparators;
            check_own_comparators(sensors)?;
        }
        if let Some(bits) = self.threshold_bits {
            let bits = whole(bits.value());
            sensors.comparator.bits = bits;
            if bits > 0 && sensors.comparator.range == 0.0 {
                let needed = "`sensors.threshold_range` beside it, where the error set has none";
                return Err(FileError::key("sensors.threshold_bits", &bits.to_string(), needed));
            }
        }
        if let Some(count) = self.oversampling {
            sensors.oversampling = whole(count.value());
        }
        self.needs(
            &["sensors.conversion"],
            sensors.oversampling > 1,
            "`sensors.oversampling` above 1 beside it: one conversion has no distance from another",
        )?;
        if let Some(apart) = self.conversion
            && Nanos::from_seconds(apart.value()) < sensors.skew * 2
        {
            let needed = format!(
                "at least twice `sensors.skew`, {:.3} us: all phases are converted before the first one again",
                sensors.skew.seconds() * 2e6
            );
            return Err(FileError::key("sensors.conversion", &apart.to_string(), &needed));
        }
        self.needs(
            &["sensors.comparator_bandwidth"],
            sensors.comparator.noise > 0.0,
            "`sensors.comparator_noise` above 0 beside it: without noise there is nothing to filter",
        )?;
        self.needs(
            &["sensors.settle"],
            sensors.arrangement.follows_legs(),
            "`sensors.arrangement` \"dc-link-shunt\" or \"low-side-shunts\": sensors in the phases see no edges",
        )?;
        self.check_amplifiers(sensors)?;
        if sensors.arrangement == Arrangement::DcLinkShunt {
            self.needs(
                &["sensors.skew", "sensors.bandwidth_mismatch"],
                false,
                "another `sensors.arrangement`, or no such key: one shunt in the DC link is one channel",
            )?;
            sensors.settle =
                self.settle.map_or(errors.settle(), |settle| Nanos::from_seconds(settle.value()));
        }
        let low = self.range_low.map(Quantity::value);
        let high = self.range.map(Quantity::value).or_else(|| low.and(sensors.adc).map(|adc| adc.high));
        let range = high.map(|high| [low.unwrap_or(-high), high]);
        self.needs(
            &["sensors.range_low"],
            high.is_some(),
            "`sensors.range` and `sensors.bits` beside it, where the error set has no converter",
        )?;
        sensors.adc = converter("sensors", sensors.adc, range, self.bits)?;
        Ok(())
    }

    /// Checks that the drive has the current sensors that the slew rate and the acquisition time need. Also checks that a sensor does not
    /// have both a slew rate and an acquisition time.
    fn check_amplifiers(&self, sensors: &SensorSettings) -> Result<(), FileError> {
        self.needs(
            &["sensors.slew"],
            sensors.arrangement.follows_legs(),
            "`sensors.arrangement` \"dc-link-shunt\" or \"low-side-shunts\": only the current of a shunt jumps",
        )?;
        self.needs(
            &["sensors.acquisition"],
            sensors.arrangement != Arrangement::None,
            "another `sensors.arrangement`: without current sensors nothing is acquired",
        )?;
        self.needs(
            &["sensors.acquisition"],
            sensors.acquisition == 0.0 || !sensors.slews(),
            "0, or no `sensors.slew`: a capacitor behind an amplifier that slews is not simulated",
        )
    }

    /// Checks that the drive has the comparators, timer or converter that each of the set keys needs.
    fn needs_comparators(&self, sensors: &SensorSettings) -> Result<(), FileError> {
        let (watches, captures) = (sensors.comparator.any(), sensors.comparator.timer > 0.0);
        let coarse = self.threshold_bits.map_or(f64::from(sensors.comparator.bits), Quantity::value) > 0.0;
        self.needs(
            &["sensors.threshold_range"],
            coarse || !captures,
            "`sensors.threshold_bits` above 0 beside it: a threshold that no converter sets has no range",
        )?;
        for keys in [&WATCHED[..], &CAPTURED] {
            let needed = "`sensors.timer` or `sensors.trip` beside it: this drive has no comparators";
            self.needs(keys, watches, needed)?;
        }
        let needed = "`sensors.timer` beside it: without a timer no trip is captured";
        self.needs(&CAPTURED, captures, needed)
    }

    fn pick_up(&self, pick_up: Option<PickUp>) -> Result<Option<PickUp>, FileError> {
        let mut of = pick_up.unwrap_or(PICK_UP);
        of.amplitude = self.pick_up.map_or(of.amplitude, Quantity::value);
        of.decay = self.pick_up_decay.map_or(of.decay, Quantity::value);
        of.frequency = self.pick_up_frequency.map_or(of.frequency, Quantity::value);
        self.needs(
            &["sensors.pick_up_decay", "sensors.pick_up_frequency"],
            self.pick_up.is_some() || pick_up.is_some(),
            "`sensors.pick_up` beside it, or `errors` \"field\": nothing is picked up here",
        )?;
        Ok((of.amplitude > 0.0).then_some(of))
    }
}

/// Checks that comparators of single phases have a current to watch. A sensor in line with each leg, or a shunt below each leg, provides
/// this current.
fn check_own_comparators(sensors: &SensorSettings) -> Result<(), FileError> {
    let has = match sensors.arrangement {
        Arrangement::ThreeInLine | Arrangement::LowSideShunts => return Ok(()),
        _ if sensors.comparator.arrangement == Comparators::Common => return Ok(()),
        Arrangement::TwoInLine => "no sensor in phase c",
        Arrangement::DcLinkShunt => "one shunt for all legs",
        Arrangement::None => "no sensor in its phases",
    };
    let needed = format!(
        "\"common\", or `sensors.arrangement` \"three-in-line\" or \"low-side-shunts\": comparators of each leg watch a sensor of each leg, and this drive has {has}"
    );
    Err(FileError::key("sensors.comparators", "\"per-leg\"", &needed))
}

/// Replaces the range or the number of bits of an A/D converter. If the error set has no converter, the file must set both. A converter of
/// 0 bits clips to its range and does not quantize.
pub(super) fn converter(
    key: &str,
    adc: Option<Adc>,
    range: Option<[f64; 2]>,
    bits: Option<Quantity<One>>,
) -> Result<Option<Adc>, FileError> {
    let bits = bits.map(|bits| whole(bits.value()));
    match (adc, range, bits) {
        (None, None, None | Some(0)) => Ok(None),
        (None, Some([low, high]), Some(bits)) => Ok(Some(Adc { bits, low, high })),
        (None, ..) => {
            let needed = "range and bits, where the error set has no converter";
            Err(FileError::key(key, "one of range and bits", needed))
        }
        (Some(adc), range, bits) => {
            let [low, high] = range.unwrap_or([adc.low, adc.high]);
            Ok(Some(Adc { bits: bits.unwrap_or(adc.bits), low, high }))
        }
    }
}
