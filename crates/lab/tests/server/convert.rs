//! The converter of a data sheet's numbers.

use serde_json::{Value, json};
use standstill_plant::DataSheet;

use super::bench;

/// The converter of the page is that of `standstill convert`, with the same numbers and the same refusals.
#[test]
fn law_a_data_sheets_numbers_are_converted_as_by_the_command() {
    let bench = bench(None);
    let ask = |numbers: Value| bench.answer("convert", &json!({ "numbers": numbers }).to_string());
    let given = [("pole_pairs", "7"), ("Kv", "900 rpm/V"), ("resistance", "0.1")];
    let answer = ask(json!(std::collections::BTreeMap::from(given))).expect("an answer");
    let answer: Value = serde_json::from_slice(&answer).expect("JSON");
    let all = DataSheet::equal_numbers(given).expect("numbers");
    assert_eq!(answer["numbers"], json!(all));
    assert!(all.iter().any(|number| number.key == Some("Ke_line_rms")));
    assert_eq!(answer["command"], "standstill convert 'Kv=900 rpm/V' pole_pairs=7 resistance=0.1");
    // What goes into a data sheet is read as what was typed.
    let plate = answer["nameplate"].as_str().expect("a text");
    let table: toml::Table = plate.parse().expect("TOML");
    assert_eq!(table["nameplate"]["Kv"].as_str(), Some("900 rpm/V"));
    assert_eq!(table["nameplate"]["pole_pairs"].as_integer(), Some(7));
    // Numbers as nobody writes them in a file of this format.
    let answer = ask(json!({ "resistance": ".36", "pole_pairs": "007" })).expect("an answer");
    let answer: Value = serde_json::from_slice(&answer).expect("JSON");
    let table: toml::Table = answer["nameplate"].as_str().expect("a text").parse().expect("TOML");
    assert_eq!(table["nameplate"]["resistance"].as_float(), Some(0.36));
    for (numbers, says) in [
        (json!({ "Kv": "900 rpm/V" }), "`pole_pairs` is missing"),
        (json!({ "Ke": "4" }), "Ke_line_rms"),
        (json!({ "resistance": "1", "vesc_R": "1" }), "keep one of them"),
        (json!({ "resistance": "3 mH" }), "Ω"),
        (json!({ "resistance": 3 }), "not a request of the lab"),
    ] {
        let error = ask(numbers.clone()).expect_err("refused").message;
        assert!(error.contains(says), "{numbers}: {error}");
    }
}
