//! Texts for HTML and for Plotly, which both know entities and `<sub>`.

use super::super::text::{escaped, pieces};

/// Returns the text as markup: everything escaped, the indices of symbols below the line. Not for attributes: Plotly
/// does not know the entity of the quotation mark.
pub(crate) fn markup(text: &str) -> String {
    pieces(text)
        .iter()
        .map(|piece| {
            let plain = escaped(piece.text);
            if piece.index { format!("<sub>{plain}</sub>") } else { plain }
        })
        .collect()
}

/// Returns markup for a read-out. It is escaped, because Plotly replaces `%{…}` by data.
pub(super) fn template(text: &str) -> String {
    markup(text).replace("%{", "&#37;{")
}

/// Returns an axis label taken apart at its last parentheses: the quantity, and its unit with the space before it.
///
/// `time t (ms)` gives `time t` and ` ms`, `angle (° electrical)` gives `angle` and `° electrical`.
pub(super) fn quantity(label: &str) -> (&str, String) {
    let label = label.trim();
    let Some((name, unit)) = label.strip_suffix(')').and_then(|rest| rest.rsplit_once('(')) else {
        return (label, String::new());
    };
    // An angle's degree follows its number at once, one of temperature does not.
    let angle = unit.strip_prefix('°').is_some_and(|rest| !rest.starts_with(char::is_alphabetic));
    let space = if angle { "" } else { " " };
    (name.trim_end(), format!("{space}{unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_only_indices_become_markup() {
        assert_eq!(markup("i_a < L_d & \"x\""), "i<sub>a</sub> &lt; L<sub>d</sub> &amp; \"x\"");
        assert_eq!(markup("pulse_test"), "pulse_test");
        assert_eq!(template("%{x} 5 %"), "&#37;{x} 5 %");
    }

    #[test]
    fn law_a_unit_is_in_the_last_parentheses() {
        assert_eq!(quantity("time t (ms)"), ("time t", " ms".to_owned()));
        assert_eq!(quantity("angle (of the rotor) (°)"), ("angle (of the rotor)", "°".to_owned()));
        assert_eq!(quantity("winding (°C)").1, " °C");
        assert_eq!(quantity("count"), ("count", String::new()));
    }
}
