//! Conversion of texts to numbers and back.

use std::fmt;

use crate::human::rounded;
use crate::prefix::{self, Prefix};
use crate::unit::{DIMENSIONS, Dimension};

/// A text that is not a quantity of the dimension asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QuantityError {
    found: String,
    dimension: Dimension,
}

impl fmt::Display for QuantityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, dimension: Dimension { symbol, share, .. } } = self;
        if *share {
            write!(f, "`{found}` is not a share, such as 0.005 or \"0.5 %\"")
        } else if symbol.is_empty() {
            write!(f, "`{found}` is not a finite number without unit")
        } else {
            let prefixes = prefix::typed();
            write!(
                f,
                "`{found}` is not a finite number in {symbol}, such as \"1.5 {symbol}\", with or without a prefix {prefixes}{}",
                self.dimension.hint(found).unwrap_or_default()
            )
        }
    }
}

impl std::error::Error for QuantityError {}

/// Units that data sheets have and scenarios do not, without blanks: each with the symbol of its dimension and its value in that unit.
const FOREIGN: [(&str, &str, f64); 11] = [
    ("hp", "W", 745.7),
    ("ps", "W", 735.5),
    ("rad/s", "rpm", 30.0 / std::f64::consts::PI),
    ("rps", "rpm", 60.0),
    ("rad", "deg", 180.0 / std::f64::consts::PI),
    ("min", "s", 60.0),
    ("gcm2", "kg m²", 1e-7),
    ("ncm", "N m", 1e-2),
    ("kgcm", "N m", 0.098_066_5),
    ("ozin", "N m", 0.007_061_55),
    ("lbft", "N m", 1.355_818),
];

/// Returns the number that a text begins with, and the rest, without blanks around them.
///
/// "1e-3 m" cannot be mistaken for an exponent because units have letters.
///
/// ```
/// assert_eq!(standstill_quantity::split("12.5 mA"), ("12.5", "mA"));
/// ```
pub fn split(text: &str) -> (&str, &str) {
    let text = text.trim();
    let digits = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    (number.trim(), unit.trim())
}

/// Returns a unit in lower case, without blanks, points and signs of powers.
fn bare(unit: &str) -> String {
    let bare: String = unit.chars().filter(|c| !matches!(c, ' ' | '·' | '.' | '^')).collect();
    bare.replace('²', "2").to_lowercase()
}

impl Dimension {
    /// Returns the value of a text in the SI unit.
    pub(crate) fn parse(&self, text: &str) -> Result<f64, QuantityError> {
        let error = || QuantityError { found: text.to_owned(), dimension: *self };
        let (number, unit) = split(text);
        let power = self.power(unit).ok_or_else(error)?;
        // As text, so that "80 us" is exactly 80e-6 and not 80.0 * 1e-6.
        let value = if let Some((mantissa, exponent)) = number.split_once(['e', 'E']) {
            let exponent = exponent.parse::<i32>().map_err(|_| error())?;
            format!("{mantissa}e{}", exponent.saturating_add(power)).parse()
        } else {
            format!("{number}e{power}").parse()
        };
        value.ok().filter(|value: &f64| value.is_finite()).ok_or_else(error)
    }

    /// Returns the end of an error message that guesses what a refused text means; none if nothing is known of its unit.
    fn hint(&self, text: &str) -> Option<String> {
        let (number, unit) = split(text);
        let value: f64 = number.parse().ok()?;
        let bare = bare(unit);
        if let Some((_, _, factor)) =
            FOREIGN.iter().find(|(name, symbol, _)| *name == bare && *symbol == self.symbol)
        {
            let digits = crate::magnitude(value * factor).unwrap_or(0) - 4;
            let short = rounded(rounded(value * factor, -digits).round(), digits);
            return Some(format!("; {text} are {}", self.text(short)));
        }
        if bare.ends_with("rms") {
            return Some(
                "; a unit does not say that a value is an rms value: the keys of rms values end in `_rms`"
                    .to_owned(),
            );
        }
        let alike = |prefix: &Prefix| {
            let spelled = |symbol: &str| format!("{}{symbol}", prefix.symbol);
            self.spellings().map(spelled).find(|spelled| spelled.to_lowercase() == unit.to_lowercase())
        };
        let mut usual = Prefix::all().filter(|prefix| prefix.symbol == self.usual).chain(Prefix::all());
        usual.find_map(alike).map(|unit| format!("; did you mean \"{number} {unit}\"?"))
    }

    /// Returns the power of ten of the SI unit that one of this unit is; none of another dimension's.
    fn power(&self, unit: &str) -> Option<i32> {
        if unit.is_empty() {
            return Some(0);
        }
        if self.share && unit == "%" {
            return Some(-2);
        }
        let own = self.spellings().find_map(|symbol| Prefix::power_of(unit.strip_suffix(symbol)?));
        // Data sheets of servo motors have kg cm², which no prefix makes of kg m².
        own.or_else(|| (self.symbol == "kg m²" && bare(unit) == "kgcm2").then_some(-4))
    }

    /// Returns a value in SI as the field writes it.
    ///
    /// ```
    /// use standstill_quantity::{Unit, unit::Henry};
    ///
    /// assert_eq!(Henry::DIMENSION.text(9.2e-3), "9.2 mH");
    /// ```
    pub fn text(&self, value: f64) -> String {
        let power = Prefix::power_of(self.usual).unwrap_or(0);
        let scaled = rounded(value, -power);
        let number = if scaled != 0.0 && !(1e-3..1e6).contains(&scaled.abs()) {
            format!("{scaled:e}")
        } else {
            format!("{scaled}")
        };
        format!("{number} {}{}", self.usual, self.symbol).trim_end().to_owned()
    }
}

/// Returns the value of a number with any unit: in SI, temperatures in °C, angles in degrees, shares as plain numbers.
/// `None` for a text that is not a quantity of a known dimension.
pub fn si_value(text: &str) -> Option<f64> {
    any_quantity(text).map(|(value, _)| value)
}

/// Returns the power of ten of a unit in SI units, for any dimension; none for unknown units.
///
/// ```
/// use standstill_quantity::{rounded, si_power, si_value};
///
/// assert_eq!(si_power("us"), Some(-6));
/// // A number and its text have one value in SI.
/// assert_eq!(si_value("1.7 us"), Some(rounded(1.7, -6)));
/// assert_eq!(si_power("parsec"), None);
/// ```
pub fn si_power(unit: &str) -> Option<i32> {
    DIMENSIONS.iter().find_map(|dimension| dimension.power(unit))
}

/// Returns the value in SI and the symbol of its unit, which is empty for shares and plain numbers.
pub fn any_quantity(text: &str) -> Option<(f64, &'static str)> {
    DIMENSIONS.iter().find_map(|dimension| Some((dimension.parse(text).ok()?, dimension.symbol)))
}

#[cfg(test)]
mod tests {
    use crate::Unit as _;
    use crate::unit::{
        Ampere, Henry, KilogramSquareMetre, RevolutionsPerMinute, RevolutionsPerMinuteVolt, Watt,
    };

    /// What data sheets and keyboards write in place of a unit is refused with what it means.
    #[test]
    fn law_a_refused_unit_is_refused_with_a_guess() {
        for (dimension, text, hint) in [
            (Watt::DIMENSION, "1.5 hp", "; 1.5 hp are 1.1186 kW"),
            (RevolutionsPerMinute::DIMENSION, "10 rad/s", "; 10 rad/s are 95.493 rpm"),
            (KilogramSquareMetre::DIMENSION, "320 g·cm²", "; 320 g·cm² are 3.2e-5 kg m²"),
            (Ampere::DIMENSION, "10 Arms", "the keys of rms values end in `_rms`"),
            (Henry::DIMENSION, "2 mh", "; did you mean \"2 mH\"?"),
            (RevolutionsPerMinuteVolt::DIMENSION, "40 RPM/V", "; did you mean \"40 rpm/V\"?"),
        ] {
            let refused = dimension.parse(text).expect_err(text).to_string();
            assert!(refused.ends_with(hint), "{refused}");
        }
        // Data sheets of servo motors give inertias in kg cm². A power has no such unit.
        for text in ["3.2 kg cm²", "3.2 kg·cm²", "3.2kgcm2", "3.2 kg cm^2"] {
            assert_eq!(KilogramSquareMetre::DIMENSION.parse(text).expect(text), 3.2e-4);
            assert!(Watt::DIMENSION.parse(text).is_err());
        }
        // Nothing is guessed of what is not known, and of another dimension.
        for (dimension, text) in
            [(Watt::DIMENSION, "1.5 parsec"), (Ampere::DIMENSION, "1.5 hp"), (Henry::DIMENSION, "mH")]
        {
            let refused = dimension.parse(text).expect_err(text).to_string();
            assert!(refused.ends_with('M'), "{refused}");
        }
    }
}
