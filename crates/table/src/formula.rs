//! Texts in CSV that a spreadsheet would run as formulas.
//!
//! A spreadsheet takes a cell for a formula that begins with `=`, `+`, `-` or `@`, also behind blanks. Where its separator is a
//! semicolon or a tab, as in countries with a decimal comma, cells begin within the texts of a file that separates by commas, too, and
//! quotation marks do not keep lines together there: each part of a text behind `;`, a tab or the end of a line may be a cell.
//! A number with a sign is no formula, and with a unit or a remark behind it neither: behind a number, a spreadsheet computes only if an
//! operator follows, or a name with a bracket right behind it.

use std::borrow::Cow;

/// Characters behind which a cell may begin, within a text.
const BETWEEN: [char; 4] = [';', '\t', '\r', '\n'];

/// Returns a text as a cell of a CSV file: each part that a spreadsheet would take for a formula has an apostrophe before it, as
/// people type it there. [`Reader`](crate::Reader) takes the apostrophes away again.
///
/// ```
/// use standstill_table::defused;
///
/// assert_eq!(defused("=HYPERLINK(\"x\")"), "'=HYPERLINK(\"x\")");
/// assert_eq!(defused("-2+3+cmd|' /C calc'!A0"), "'-2+3+cmd|' /C calc'!A0");
/// // The next cell where semicolons separate.
/// assert_eq!(defused("a;=1+1"), "a;'=1+1");
/// // Quantities stay as they are.
/// assert_eq!(defused("-40 °C (typical)"), "-40 °C (typical)");
/// ```
pub fn defused(text: &str) -> Cow<'_, str> {
    by_part(text, |part| is_formula(part).then(|| format!("'{part}")))
}

/// Returns the text of a cell that [`defused`] wrote.
pub(crate) fn restored(cell: &str) -> Cow<'_, str> {
    by_part(cell, |part| part.strip_prefix('\'').filter(|rest| is_formula(rest)).map(str::to_owned))
}

/// Returns a text whose parts are replaced where `other` returns something.
fn by_part(text: &str, other: impl Fn(&str) -> Option<String>) -> Cow<'_, str> {
    let mut new: Option<String> = None;
    let mut begin = 0;
    for part in text.split_inclusive(BETWEEN) {
        match (other(part), &mut new) {
            (Some(part), Some(new)) => new.push_str(&part),
            (Some(part), None) => new = Some(text[..begin].to_owned() + &part),
            (None, Some(new)) => new.push_str(part),
            (None, None) => {}
        }
        begin += part.len();
    }
    new.map_or(Cow::Borrowed(text), Cow::Owned)
}

/// Returns whether a part of a text begins like a formula, behind apostrophes, quotation marks and blanks, and is no quantity.
fn is_formula(part: &str) -> bool {
    let part = part.trim_start_matches(|c: char| c == '\'' || c == '"' || c.is_whitespace());
    // The last four as Chinese and Japanese keyboards write them, which spreadsheets take, too.
    if !part.starts_with(['=', '+', '-', '@', '＝', '＋', '－', '＠']) {
        return false;
    }
    let mut words = part.trim_end_matches(BETWEEN).split(' ');
    !(words.next().is_some_and(is_number) && words.all(is_remark))
}

/// Returns whether a word is a number, perhaps with its unit: `-40°C`.
fn is_number(word: &str) -> bool {
    let digits = word.trim_end_matches(|c: char| is_of_unit(c) && !c.is_ascii_digit());
    let divides = word[digits.len()..].starts_with('/');
    let is_read =
        |number: &str| number.contains(|c: char| c.is_ascii_digit()) && number.parse::<f64>().is_ok();
    !divides && (is_read(word) || is_read(digits))
}

/// Returns whether a word behind a number is a unit or a word of a remark, perhaps in brackets.
fn is_remark(word: &str) -> bool {
    let word = word.trim_start_matches(['(', '[']).trim_end_matches([')', ']', ',', '.', ':']);
    !word.starts_with('/') && word.chars().all(is_of_unit)
}

fn is_of_unit(c: char) -> bool {
    c.is_alphanumeric() || "°%²³·/".contains(c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_formulas_have_an_apostrophe_and_come_back_and_all_else_stays() {
        let formulas = [
            ("=1+1", "'=1+1"),
            ("+cmd", "'+cmd"),
            ("-x", "'-x"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("\t=1", "\t'=1"),
            ("\r=1", "\r'=1"),
            (" =1", "' =1"),
            ("\"=1\"", "'\"=1\""),
            ("-2+3+cmd|' /C calc'!A0", "'-2+3+cmd|' /C calc'!A0"),
            ("-5 cmd|x", "'-5 cmd|x"),
            ("-5 SUM(A1:A9)", "'-5 SUM(A1:A9)"),
            ("-1*2", "'-1*2"),
            ("-5/A1", "'-5/A1"),
            ("-5 /A1", "'-5 /A1"),
            ("-5 / (A1)", "'-5 / (A1)"),
            ("-5 (/A1)", "'-5 (/A1)"),
            ("-inf", "'-inf"),
            ("+nan", "'+nan"),
            ("＝1+1", "'＝1+1"),
            ("'=1", "''=1"),
            ("''@x", "'''@x"),
            ("- 1", "'- 1"),
            // Cells where semicolons separate, and lines where quotation marks do not hold them together.
            ("a;=1", "a;'=1"),
            ("a;=1;@x; b", "a;'=1;'@x; b"),
            ("a; =HYPERLINK(\"x\")", "a;' =HYPERLINK(\"x\")"),
            ("a;\"=1\"", "a;'\"=1\""),
            ("a\n=1\r\n+x", "a\n'=1\r\n'+x"),
            ("a;'=1", "a;''=1"),
            ("-5 V;-x", "-5 V;'-x"),
        ];
        for (formula, cell) in formulas {
            assert_eq!(defused(formula), cell, "{formula:?}");
            assert_eq!(restored(cell), formula);
        }
        for text in [
            "",
            "found",
            "-40 °C",
            "-40°C",
            "+5",
            "-1e-3 N m",
            "-60 rpm/s",
            "-5 (typical)",
            "-5 mV/K [at 25 °C], typical.",
            "-5 V; +3 %;-1",
            "a=b",
            "a,=b",
            "it's",
            "'quoted'; 'twice'",
            "'",
            "';'",
            "\t",
            "\r\n",
            ";;",
        ] {
            assert_eq!(defused(text), text);
            assert_eq!(restored(text), text);
        }
    }

    /// Every short text of the characters that matter comes back, and no cell of it begins like a formula, whatever separates cells.
    #[test]
    fn law_every_text_comes_back_and_none_runs() {
        let letters = ['=', '-', '\'', ';', '\n', ' ', '"', '1', 'x'];
        for number in 0..letters.len().pow(5) {
            let mut rest = number;
            let pick = |rest: &mut usize| {
                let letter = letters[*rest % letters.len()];
                *rest /= letters.len();
                letter
            };
            let text: String = (0..5).map(|_| pick(&mut rest)).collect();
            let cell = defused(&text);
            assert_eq!(restored(&cell), text, "{cell:?}");
            for part in cell.split(BETWEEN) {
                let begin = part.trim_start_matches(|c: char| c == '"' || c.is_whitespace());
                let runs =
                    begin.starts_with(['=', '@']) || begin.starts_with(['+', '-']) && begin.contains('x');
                // A sign before a number, and a word behind it, at most.
                let quantity = begin.starts_with("-1") && !begin[1..].contains(['-', '=', '\'', '"']);
                assert!(!runs || quantity, "{text:?} as {cell:?}");
            }
        }
    }
}
