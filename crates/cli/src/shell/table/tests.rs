use standstill_report::page::Tone;

use super::*;

fn example() -> Table {
    Table::new([
        Column::word("method"),
        Column::number("sensors.noise mA"),
        Column::number("rms °").rank(2),
        Column::number("largest °").rank(9),
        Column::prose("verdict").judged(),
    ])
    .judged([
        (Tone::Good, ["maximum-likelihood", "20", "0.045", "0.2", "suited"].map(str::to_owned).to_vec()),
        (
            Tone::Bad,
            ["hfi-rotating", "20", "1.329", "5.5", "a free rotor moves by 2.09° where 1° are allowed"]
                .map(str::to_owned)
                .to_vec(),
        ),
    ])
    .headed()
}

#[test]
fn law_tables_are_no_wider_than_they_may_be_and_keep_what_matters() {
    for width in 40..140 {
        let text = example().within(width, false);
        for line in text.lines() {
            assert!(measure_text_width(line) <= width, "{width}: {line}");
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        for word in ["maximum-likelihood", "hfi-rotating", "suited", "allowed"] {
            assert!(words.contains(&word), "{width}: no {word} in\n{text}");
        }
        // Each column is shown, or named as left out, or its cells are listed below each other.
        assert!(text.contains("largest"), "{width}:\n{text}");
    }
}

#[test]
fn law_columns_go_by_rank_and_come_back_with_room() {
    let at = |width| example().within(width, false);
    assert!(at(120).contains("0.045") && at(120).contains("5.5"));
    assert!(!at(120).contains("No room"));
    let narrow = at(46);
    assert!(narrow.contains("0.045") && !narrow.contains("5.5"), "{narrow}");
    let needed = narrow.split("COLUMNS=").nth(1).and_then(|rest| rest.split(' ').next());
    let needed: usize = needed.and_then(|needed| needed.parse().ok()).expect("what it would need");
    assert!(!at(needed).contains("No room") && needed > 46, "{}", at(needed));
}

#[test]
fn law_brackets_go_before_columns_of_a_lower_rank() {
    let table = Table::new([
        Column::number("noise"),
        Column::number("rms").bracket(1),
        Column::number("failed").bracket(3).rank(2),
        Column::number("trials").rank(4),
    ])
    .rows([["5", "0.062 [0.056, 0.069]", "96 (96.00 %)", "100"].map(str::to_owned).to_vec()]);
    let at = |width| table.within(width, false);
    let row =
        |width| at(width).lines().nth(2).unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(row(60), "5 0.062 [0.056, 0.069] 96 (96.00 %) 100");
    assert_eq!(row(50), "5 0.062 [0.056, 0.069] 96 (96.00 %)");
    assert_eq!(row(40), "5 0.062 [0.056, 0.069] 96");
    assert_eq!(row(30), "5 0.062 [0.056, 0.069]");
    assert_eq!(row(20), "5 0.062");
    assert!(at(40).replace('\n', " ").contains("No room for trials, and the brackets of failed: COLUMNS="));
    // The sentence on what was left out names columns without their brackets.
    assert!(at(30).replace('\n', " ").contains("No room for failed, trials: COLUMNS="), "{}", at(30));
    // Cells that are listed below each other keep their brackets.
    assert!(at(12).contains("[0.056"), "{}", at(12));
}

#[test]
fn law_colours_move_no_column() {
    for width in [40, 46, 60, 90, 140] {
        let (plain, coloured) = (example().within(width, false), example().within(width, true));
        assert_ne!(plain, coloured);
        assert_eq!(console::strip_ansi_codes(&coloured), plain, "{width}");
        // A colour ends within its cell.
        assert!(coloured.lines().all(|line| line.matches("\u{1b}[0m").count() <= 1));
    }
}

#[test]
fn law_numbers_stand_below_each_other() {
    let text = Table::new([Column::word("a"), Column::number("b")])
        .rows([["x", "1.5"], ["y", "-22.5"]].map(|row| row.map(str::to_owned).to_vec()))
        .within(80, false);
    assert_eq!(text, " a      b\n──────────\n x    1.5\n y  -22.5\n");
}
