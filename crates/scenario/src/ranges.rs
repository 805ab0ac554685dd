//! What the numbers of the tables `inverter` and `sensors` may be: one place for whoever checks and whoever tells.

use standstill_interface::Nanos;
use standstill_quantity::unit::Degree;
use standstill_quantity::{Quantity, Scale, Unit};

use super::document::FileError;

/// From where to where, and that in words.
struct Range {
    low: f64,
    high: f64,
    needed: &'static str,
}

const fn from(low: f64, high: f64, needed: &'static str) -> Range {
    Range { low, high, needed }
}

const NOT_NEGATIVE: Range = from(0.0, 1e12, "zero or more");
const POSITIVE: Range = from(f64::MIN_POSITIVE, 1e12, "more than zero");
const SHARE: Range = from(0.0, 1.0, "a share from 0 to 1");
/// A tolerance of a frequency, which stays above zero.
const SPREAD: Range = from(0.0, 0.9, "a share from 0 to 0.9: a corner frequency is more than zero");
/// In whole nanoseconds.
const TIME: Range = from(0.0, 1.0, "from 0 to 1 s");
const BITS: Range = from(0.0, 24.0, "a whole number from 0 to 24");
/// The latest end of what happens to the source is the longest that a detection may take.
const SAG: Range = from(1e-6, 20.0, "from 1 µs to 20 s");

const RANGES: [(&str, Range); 38] = [
    ("inverter.dc_link", POSITIVE),
    ("inverter.ripple", SHARE),
    (
        "inverter.ripple_frequency",
        from(
            0.1,
            1e5,
            "from 0.1 Hz to 100 kHz: a rectifier's ripple has some hundred hertz, and a trial follows each of its periods",
        ),
    ),
    ("inverter.capacitance", from(0.0, 1e3, "from 0 to 1000 F")),
    ("inverter.source_resistance", from(1e-6, 1e6, "from 1 µΩ to 1 MΩ")),
    ("inverter.sag_depth", SHARE),
    ("inverter.sag_start", from(0.0, 20.0, "from 0 to 20 s")),
    ("inverter.sag_duration", SAG),
    ("inverter.dead_time", TIME),
    ("inverter.delay_mismatch", NOT_NEGATIVE),
    ("inverter.carrier", from(10.0, 1e6, "from 10 Hz to 1 MHz")),
    ("inverter.channel_resistance", NOT_NEGATIVE),
    ("inverter.switch_drop", NOT_NEGATIVE),
    ("inverter.switch_resistance", NOT_NEGATIVE),
    ("inverter.diode_drop", NOT_NEGATIVE),
    ("inverter.diode_resistance", NOT_NEGATIVE),
    // Less than 0.1 nF would ring so fast, and more than 10 nF take such charges, that other things count which are not here.
    ("inverter.terminal_capacitance", from(0.0, 1e-8, "0, or from 0.1 nF to 10 nF")),
    ("inverter.terminal_resistance", NOT_NEGATIVE),
    ("sensors.gain_error", SHARE),
    ("sensors.offset", NOT_NEGATIVE),
    ("sensors.noise", NOT_NEGATIVE),
    ("sensors.bandwidth", NOT_NEGATIVE),
    ("sensors.bandwidth_tolerance", SPREAD),
    ("sensors.bandwidth_mismatch", SPREAD),
    (
        "sensors.skew",
        from(0.0, 1e-4, "from 0 to 100 us: the next sample waits until all phases are converted"),
    ),
    ("sensors.pick_up", NOT_NEGATIVE),
    (
        "sensors.pick_up_decay",
        from(1e-9, 1e-4, "from 1 ns to 100 us: what rings longer is no pick-up of an edge"),
    ),
    (
        "sensors.pick_up_frequency",
        from(0.0, 1e9, "from 0 to 1000 MHz: samples are taken in whole nanoseconds"),
    ),
    ("sensors.range", POSITIVE),
    ("sensors.bits", BITS),
    ("sensors.jitter", TIME),
    ("sensors.sample_delay", TIME),
    ("sensors.dc_link_gain_error", SHARE),
    ("sensors.dc_link_offset", NOT_NEGATIVE),
    ("sensors.dc_link_noise", NOT_NEGATIVE),
    ("sensors.dc_link_range", POSITIVE),
    ("sensors.dc_link_bits", BITS),
    ("sensors.resolver_error", NOT_NEGATIVE),
];

/// The least and the largest value of a number of the tables `inverter` and `sensors`, in the unit of the schema; none of other
/// keys.
///
/// ```
/// assert_eq!(standstill_scenario::range("sensors.gain_error"), Some([0.0, 1.0]));
/// assert_eq!(standstill_scenario::range("rotor.angle"), None);
/// ```
pub fn range(key: &str) -> Option<[f64; 2]> {
    RANGES.iter().find(|(of, _)| *of == key).map(|(_, range)| [range.low, range.high])
}

/// The same in words, as messages have it.
///
/// ```
/// assert_eq!(standstill_scenario::allowed("sensors.gain_error"), Some("a share from 0 to 1"));
/// ```
pub fn allowed(key: &str) -> Option<&'static str> {
    RANGES.iter().find(|(of, _)| *of == key).map(|(_, range)| range.needed)
}

/// The value of a key of these tables.
///
/// # Errors
/// One that it may not have.
pub(super) fn checked<U: Unit>(key: &str, value: Quantity<U>) -> Result<f64, FileError> {
    let Some((_, Range { low, high, needed })) = RANGES.iter().find(|(of, _)| *of == key) else {
        return Ok(value.value());
    };
    in_range(key, value, [*low, *high], needed)
}

/// The same in whole nanoseconds.
pub(super) fn checked_time<U: Unit>(key: &str, value: Quantity<U>) -> Result<Nanos, FileError> {
    checked(key, value).map(Nanos::from_seconds)
}

/// The same of a converter's bits.
pub(super) fn checked_bits<U: Unit>(key: &str, value: Quantity<U>) -> Result<u8, FileError> {
    let bits = checked(key, value)?;
    if bits.fract() != 0.0 {
        return Err(FileError::key(key, &value.to_string(), BITS.needed));
    }
    // Whole and from 0 to 24.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Ok(bits as u8)
}

/// A value within a range.
///
/// # Errors
/// One that is not.
pub(super) fn in_range<U: Unit>(
    key: &str,
    value: Quantity<U>,
    [low, high]: [f64; 2],
    needed: &str,
) -> Result<f64, FileError> {
    if (low..=high).contains(&value.value()) {
        Ok(value.value())
    } else {
        Err(FileError::key(key, &readable(value), needed))
    }
}

/// The rotor's electrical angle at the start in radians: no more than a turn either way, because more is a mistake.
pub(super) fn start_angle(angle: Quantity<Degree>) -> Result<f64, FileError> {
    in_range("rotor.angle", angle, [-360.0, 360.0], "from -360 deg to 360 deg, electrical")
        .map(f64::to_radians)
}

/// A value in the unit that suits it, as the ranges are written: not 0.02 µF where nanofarads are allowed.
fn readable<U: Unit>(value: Quantity<U>) -> String {
    let si = value.value();
    let scale = Scale::suiting(U::SYMBOL, si.abs());
    // Shares are written in per cent, and what is too large or small for any prefix as it was.
    let readable = scale.number(si);
    if U::SYMBOL.is_empty() || !(1e-3..1e6).contains(&readable.abs()) {
        return value.to_string();
    }
    format!("{readable} {}", scale.unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_values_are_found_in_the_unit_in_which_ranges_are_written() {
        let found = |text: &str| crate::tests::error(text);
        for (value, said) in [("20 nF", "found 20 nF"), ("0.05 nF", "found 50 pF"), ("47 uF", "found 47 µF")]
        {
            let message = found(&format!("[inverter]\nterminal_capacitance = \"{value}\""));
            assert!(message.contains(said) && message.contains("from 0.1 nF to 10 nF"), "{message}");
        }
    }

    #[test]
    fn law_every_number_of_the_tables_has_a_range() {
        for of in crate::keys() {
            let number = matches!(of.values, crate::Values::Number { .. });
            let table = of.key.starts_with("inverter.") || of.key.starts_with("sensors.");
            assert_eq!(range(&of.key).is_some(), number && table, "{}", of.key);
        }
    }
}
