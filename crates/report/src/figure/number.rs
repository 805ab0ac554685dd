//! Format of numbers in figures.

/// Returns a number with three significant digits, without trailing zeros, and with a power of ten if it needs more
/// than five places. The minus is the typographic one; numbers that are not finite become a dash.
pub fn significant(value: f64) -> String {
    digits(value, 3)
}

/// Returns a number with so many significant digits, zeros at the end too, so that several stand with the same
/// digits.
pub fn rounded(value: f64, count: usize) -> String {
    written(value, i32::try_from(count.clamp(1, 15)).unwrap_or(3), str::to_owned)
}

/// Writes a number like [`significant`], with at most `most` digits.
pub(crate) fn digits(value: f64, most: i32) -> String {
    written(value, most, |text| {
        let end = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
        end.to_owned()
    })
}

fn written(value: f64, most: i32, trim: impl Fn(&str) -> String) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    // Formatting rounds first, so that 0.9999 has the exponent of 1.
    let rounded = format!("{value:.*e}", usize::try_from(most - 1).unwrap_or(0));
    let (mantissa, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let text = if (-4..most.max(5)).contains(&exponent) {
        let decimals = usize::try_from(most - 1 - exponent).unwrap_or(0);
        // Five digits are a number, not its first three.
        trim(&format!("{value:.decimals$}"))
    } else {
        match trim(mantissa).as_str() {
            "1" => format!("10{}", superscript(f64::from(exponent))),
            "-1" => format!("-10{}", superscript(f64::from(exponent))),
            mantissa => format!("{mantissa}·10{}", superscript(f64::from(exponent))),
        }
    };
    // The exponent's minus is another character.
    text.replace('-', "−")
}

/// Returns an exponent in small raised digits.
pub(super) fn superscript(exponent: f64) -> String {
    format!("{exponent:.0}")
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            // The others follow each other from U+2070.
            digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_three_digits_are_kept() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.012_34, "0.0123"),
            (0.999_9, "1"),
            (-2.5, "−2.5"),
            (123.4, "123"),
            (20_000.0, "20000"),
            (1e-6, "10⁻⁶"),
            (2.5e-7, "2.5·10⁻⁷"),
            (4e9, "4·10⁹"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(significant(value), text);
        }
    }

    #[test]
    fn law_rounded_numbers_keep_their_last_zeros() {
        let said = [0.76, 0.752, 1.4, 0.999_9, 12.04, 123.4].map(|value| rounded(value, 3));
        assert_eq!(said, ["0.760", "0.752", "1.40", "1.00", "12.0", "123"]);
        assert_eq!([0.76, 0.752, 14.4, 0.0].map(|value| rounded(value, 2)), ["0.76", "0.75", "14", "0.0"]);
    }
}
