//! Texts in CSV that a spreadsheet would run as formulas.

use std::borrow::Cow;

/// Returns a text as a cell of a CSV file: one that a spreadsheet would take for a formula has an apostrophe before it, as people
/// type it there. [`Reader`](crate::Reader) takes the apostrophe away again.
///
/// ```
/// use standstill_table::defused;
///
/// assert_eq!(defused("=HYPERLINK(\"x\")"), "'=HYPERLINK(\"x\")");
/// assert_eq!(defused("-2+3+cmd|' /C calc'!A0"), "'-2+3+cmd|' /C calc'!A0");
/// // Quantities stay as they are.
/// assert_eq!(defused("-40 °C"), "-40 °C");
/// ```
pub fn defused(text: &str) -> Cow<'_, str> {
    if is_formula(text) { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) }
}

/// Returns the text of a cell that [`defused`] wrote.
pub(crate) fn restored(cell: &str) -> &str {
    cell.strip_prefix('\'').filter(|text| is_formula(text)).unwrap_or(cell)
}

/// Returns whether a text begins like a formula, behind any apostrophes, tabs and ends of lines, and is no quantity.
fn is_formula(text: &str) -> bool {
    let text = text.trim_start_matches(['\'', '\t', '\r', '\n']);
    if !text.starts_with(['=', '+', '-', '@']) {
        return false;
    }
    let mut words = text.split(' ');
    let number = words.next().is_some_and(|word| word.parse::<f64>().is_ok());
    let is_unit = |word: &str| word.chars().all(|c| c.is_alphanumeric() || "°%²³·/".contains(c));
    !(number && words.all(is_unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_formulas_have_an_apostrophe_and_come_back_and_all_else_stays() {
        let formulas = [
            "=1+1",
            "+cmd",
            "-x",
            "@SUM(A1)",
            "\t=1",
            "\r=1",
            "-2+3+cmd|' /C calc'!A0",
            "'=1",
            "''@x",
            "- 1",
        ];
        for formula in formulas {
            let cell = defused(formula);
            assert_eq!(cell, format!("'{formula}"), "{formula:?}");
            assert_eq!(restored(&cell), formula);
        }
        for text in [
            "",
            "found",
            "-40 °C",
            "+5",
            "-1e-3 N m",
            "-60 rpm/s",
            "a=b",
            "it's",
            "'quoted'",
            "'",
            "\t",
            "\r\n",
        ] {
            assert_eq!(defused(text), text);
            assert_eq!(restored(text), text);
        }
    }
}
