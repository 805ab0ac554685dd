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
        // A column is shown, or named as left out, or its cells are stacked.
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
fn law_colours_move_no_column() {
    for width in [40, 46, 60, 90, 140] {
        let (plain, coloured) = (example().within(width, false), example().within(width, true));
        assert_ne!(plain, coloured);
        assert_eq!(console::strip_ansi_codes(&coloured), plain, "{width}");
        // No colour runs into the next column or line.
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

#[test]
fn law_intervals_go_before_columns_of_a_lower_rank_and_values_stay() {
    let table = Table::new([
        Column::word("method"),
        Column::number("rms °").interval(3),
        Column::number("largest °").rank(2),
        Column::number("ms").rank(4),
    ])
    .rows([["a", "0.84 [0.79, 0.89]", "5.5", "25"].map(str::to_owned).to_vec()]);
    let at = |width| table.within(width, false);
    assert!(at(80).contains("0.84 [0.79, 0.89]") && at(80).contains("25") && !at(80).contains("No room"));
    let first = at(38);
    assert!(first.contains("0.84 [0.79, 0.89]") && first.contains("No room for ms"), "{first}");
    let second = at(26);
    assert!(second.contains("0.84") && !second.contains("0.79") && second.contains("5.5"), "{second}");
    assert!(second.replace('\n', " ").contains("No room for ms and the intervals of rms °"), "{second}");
    // Stacked cells have them again.
    assert!(at(12).contains("[0.79"), "{}", at(12));
}
