//! Data sheets that are no motor, and what is said of them.

use standstill_plant::DataSheet;

/// What is said of a built-in data sheet after a change of its text.
fn refused(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    let sheet = DataSheet::parse("own.toml", &text.replacen(from, to, 1)).expect("its keys are right");
    sheet.motor().expect_err("must be refused").to_string()
}

#[test]
fn regress_the_harmonic_that_is_too_large_is_the_one_named() {
    let text = include_str!("../motors/paper-5k5.toml");
    let entry = |key: &str, value: &str| {
        format!("{key} = {{ value = \"{value}\", source = \"assumed\", reason = \"a test\" }}\n")
    };
    let with = |lines: String| refused(text, "[rotor]", &format!("[harmonics]\n{lines}\n[rotor]"));
    let error = with(entry("asymmetry", "20 mH"));
    assert!(
        error.starts_with("own.toml: `harmonics.asymmetry` is 20 mH") && error.contains("half"),
        "{error}"
    );
    let error = with(entry("inductance_4", "9 mH") + &entry("asymmetry", "0.1 mH"));
    assert!(error.starts_with("own.toml: `harmonics.inductance_4` is 9 mH"), "{error}");
    let error = with(entry("inductance_4", "0.1 mH") + &entry("asymmetry", "-20 mH"));
    assert!(error.starts_with("own.toml: `harmonics.asymmetry` is -20 mH"), "{error}");
}
