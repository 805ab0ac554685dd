//! Text for the terminal.

use std::fmt::Write as _;

use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};

/// Longer texts in tables are broken.
const WIDTH: u16 = 118;

/// A line under the header and nothing else.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// A message of several lines in one, without the advice at its end.
pub fn one_line(message: &str) -> String {
    let body = message.split("\n\nUsage:").next().unwrap_or(message);
    let body = body.split("\n\nFor more information").next().unwrap_or(body);
    let words: Vec<&str> = body.split_whitespace().collect();
    words.join(" ").trim_start_matches("error: ").to_owned()
}

/// A table; columns after the first are aligned to the right if `numbers`.
pub fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>, numbers: bool) -> String {
    let mut table = Table::new();
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(WIDTH);
    finish(table, header, rows, numbers)
}

/// A table of numbers as wide as it needs to be, none of them broken.
pub fn wide_table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    finish(Table::new(), header, rows, true)
}

fn finish(
    mut table: Table,
    header: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
    numbers: bool,
) -> String {
    table.load_style(STYLE).set_header(header);
    table.add_rows(rows);
    if numbers {
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let lines: Vec<String> = table.lines().map(|line| line.trim_end().to_owned()).collect();
    lines.join("\n") + "\n"
}

/// Fills paragraphs to a width, each line behind `indent`.
pub fn fill(text: &str, width: usize, indent: &str) -> String {
    let mut filled = String::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        if !line.is_empty() && indent.len() + line.chars().count() + 1 + word.chars().count() > width {
            let _ = writeln!(filled, "{indent}{line}");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line += word;
    }
    filled + &format!("{indent}{line}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_parser_messages_become_one_line() {
        let message = "error: invalid value 'x' for '--decay <DECAY>'\n  [possible values: slow, fast]\n\nFor more information, try '--help'.\n";
        assert_eq!(
            one_line(message),
            "invalid value 'x' for '--decay <DECAY>' [possible values: slow, fast]"
        );
    }
}
