//! Units as FMI has them: a name, and exponents of SI's base units.

use standstill_quantity::Scale;

/// A unit: symbol, name in FMI, exponents of kg, m, s, A, K and rad, factor to the base unit, and offset.
pub(crate) struct Unit {
    pub symbol: &'static str,
    pub name: &'static str,
    pub base: &'static [(&'static str, i32)],
    pub factor: f64,
    pub offset: f64,
    /// The unit in which tools show it, and how many of that there are in one.
    pub shown: Option<(&'static str, f64)>,
}

const fn si(symbol: &'static str, name: &'static str, base: &'static [(&'static str, i32)]) -> Unit {
    Unit { symbol, name, base, factor: 1.0, offset: 0.0, shown: None }
}

/// Units of the variables. Angles are in rad only, because a variable in degrees beside one in rad would be mistaken
/// for it.
const UNITS: [Unit; 13] = [
    si("A", "A", &[("A", 1)]),
    si("V", "V", &[("kg", 1), ("m", 2), ("s", -3), ("A", -1)]),
    si("Ω", "Ohm", &[("kg", 1), ("m", 2), ("s", -3), ("A", -2)]),
    si("F", "F", &[("kg", -1), ("m", -2), ("s", 4), ("A", 2)]),
    si("s", "s", &[("s", 1)]),
    si("Hz", "Hz", &[("s", -1)]),
    Unit { shown: Some(("deg", 180.0 / std::f64::consts::PI)), ..si("rad", "rad", &[("rad", 1)]) },
    si("rad/s", "rad/s", &[("rad", 1), ("s", -1)]),
    si("N m", "N.m", &[("kg", 1), ("m", 2), ("s", -2)]),
    si("N m s", "N.m.s", &[("kg", 1), ("m", 2), ("s", -1)]),
    si("kg m²", "kg.m2", &[("kg", 1), ("m", 2)]),
    Unit { offset: 273.15, ..si("°C", "degC", &[("K", 1)]) },
    si("", "1", &[]),
];

/// Returns a value for people, in the unit that suits it: all its digits, for a period may be off by nanoseconds.
pub(crate) fn readable(value: f64, symbol: &str) -> String {
    // Nobody counts in kiloseconds.
    if symbol.is_empty() || (symbol == "s" && value.abs() >= 1.0) {
        return format!("{value} {symbol}").trim_end().to_owned();
    }
    let scale = Scale::suiting(symbol, value);
    format!("{} {}", scale.number(value), scale.unit)
}

/// Returns the unit with a symbol of the scenarios' schema.
pub(crate) fn unit(symbol: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.symbol == symbol)
}
