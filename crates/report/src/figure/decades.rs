//! The ticks of logarithmic axes.

use super::axis::{Tick, Ticks, ticks};

/// The densest ticks of a logarithmic axis that fit, and between them marks without a text.
pub(super) fn log_ticks(range: (f64, f64), fits: impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let decades = (range.1 / range.0).log10();
    let mut choices: Vec<(&[f64], i32)> = vec![(&[1.0, 2.0, 5.0], 1), (&[1.0, 3.0], 1), (&[1.0], 1)];
    if decades < 1.3 {
        choices.insert(0, (&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0], 1));
    }
    choices.extend([2, 3, 5, 10, 20, 50, 100].map(|every| -> (&[f64], i32) { (&[1.0], every) }));
    let places =
        choices.into_iter().map(|(mantissas, every)| places(range, mantissas, every)).collect::<Vec<_>>();
    // Less than three marks make no scale: within a small part of a decade, differences do.
    if places[0].len() < 3 {
        for most in [6.0, 4.0, 3.0, 2.0] {
            let even = ticks(&Ticks::Auto, range, most, most + 2.0);
            if fits(&even) || most == 2.0 {
                return even;
            }
        }
    }
    let texts: Vec<Vec<Tick>> = places.iter().map(|set| label(set)).collect();
    let mut chosen = texts.iter().find(|set| fits(set)).or(texts.last()).cloned().unwrap_or_default();
    if decades <= 8.0 {
        let all: Vec<f64> = (1..=9).map(f64::from).collect();
        for (mantissa, exponent) in self::places(range, &all, 1) {
            let at = value(mantissa, exponent);
            if chosen.iter().all(|tick| (tick.at / at - 1.0).abs() > 1e-6) {
                chosen.push(Tick { at, text: String::new() });
            }
        }
    }
    chosen
}

fn value(mantissa: f64, exponent: i32) -> f64 {
    // Dividing by a power of ten is exact where multiplying by its inverse is not.
    if exponent < 0 { mantissa / 10f64.powi(-exponent) } else { mantissa * 10f64.powi(exponent) }
}

/// The mantissas in every so many decades that a range contains.
fn places(range: (f64, f64), mantissas: &[f64], every: i32) -> Vec<(f64, i32)> {
    #[expect(clippy::cast_possible_truncation, reason = "exponents of numbers are within ±308")]
    let (first, last) = (range.0.log10().floor() as i32, range.1.log10().ceil() as i32);
    let slack = 1e-9;
    (first..=last)
        .filter(|exponent| exponent.rem_euclid(every) == 0)
        .flat_map(|exponent| mantissas.iter().map(move |&mantissa| (mantissa, exponent)))
        .filter(|&(mantissa, exponent)| {
            let at = value(mantissa, exponent);
            at >= range.0 * (1.0 - slack) && at <= range.1 * (1.0 + slack)
        })
        .collect()
}

/// Ticks with plain numbers, or with powers of ten if one of the numbers would be long.
fn label(places: &[(f64, i32)]) -> Vec<Tick> {
    let plain = places.iter().all(|(_, exponent)| (-4..6).contains(exponent));
    let text = |&(mantissa, exponent): &(f64, i32)| {
        if plain {
            let decimals = i32::from(mantissa.fract() != 0.0) - exponent;
            return format!("{:.*}", usize::try_from(decimals).unwrap_or(0), value(mantissa, exponent));
        }
        match (mantissa == 1.0, exponent) {
            (_, 0) => format!("{mantissa}"),
            (true, _) => format!("10{}", superscript(f64::from(exponent))),
            (false, _) => format!("{mantissa}·10{}", superscript(f64::from(exponent))),
        }
    };
    places.iter().map(|place| Tick { at: value(place.0, place.1), text: text(place) }).collect()
}

/// An exponent in small raised digits.
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

    fn texts(range: (f64, f64), most: usize) -> Vec<String> {
        let found = log_ticks(range, |ticks| ticks.len() <= most);
        found.into_iter().map(|tick| tick.text).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn law_ticks_of_a_logarithmic_axis_are_as_many_as_fit() {
        assert_eq!(texts((0.01, 1.0), 10), ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]);
        assert_eq!(texts((0.01, 1.0), 5), ["0.01", "0.03", "0.1", "0.3", "1"]);
        assert_eq!(texts((0.01, 1.0), 4), ["0.01", "0.1", "1"]);
        assert_eq!(texts((1.2, 4.9), 9), ["1.5", "2", "3", "4"]);
        assert_eq!(texts((2.2, 2.8), 9), ["2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8"]);
        assert_eq!(texts((2.2, 2.8), 5), ["2.2", "2.4", "2.6", "2.8"]);
        assert_eq!(texts((1e-9, 1.0), 4), ["10⁻⁹", "10⁻⁶", "10⁻³", "1"]);
        assert!(texts((1e-300, 1e300), 8).len() <= 8);
    }

    #[test]
    fn law_marks_between_fill_the_decades() {
        let all = log_ticks((1.0, 100.0), |ticks| ticks.len() <= 3);
        assert_eq!((all.len(), all.iter().filter(|tick| tick.text.is_empty()).count()), (19, 16));
    }
}
