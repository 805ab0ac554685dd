//! Labels of the figures that commands draw of real results: none is cut off, and none lies on another.

use std::cell::RefCell;

use standstill_report::figure::Figure;

thread_local! {
    static DRAWN: RefCell<Vec<(String, Figure)>> = const { RefCell::new(Vec::new()) };
}

/// Keeps a figure that a command draws in this thread.
pub fn seen(name: &str, figure: &Figure) {
    DRAWN.with_borrow_mut(|all| all.push((name.to_owned(), figure.clone())));
}

/// Carries out commands, each with a folder of its own, and looks at the labels of all that they draw: as wide as a page on a desk, a
/// column and a phone. `needed`: the figures that there must be.
fn looks_at(commands: &[&str], needed: &[&str]) {
    const SCENARIO: &str =
        "motor = \"paper-5k5\"\nseed = 5\n[detector]\nmethod = \"bipolar\"\n[rotor]\nstate = \"free\"\n";
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("s.toml"), SCENARIO).expect("written");
    DRAWN.with_borrow_mut(Vec::clear);
    let mut figures = Vec::new();
    for (number, line) in commands.iter().enumerate() {
        let words = line.split_whitespace().map(|word| match word {
            "S" => at("s.toml"),
            word if word.starts_with('#') => at(&word[1..]),
            word => word.replace('~', " "),
        });
        let out = ["--out".to_owned(), at(&number.to_string())];
        let words = std::iter::once("standstill".to_owned()).chain(words).chain(out).map(Into::into);
        crate::arguments(words).and_then(crate::command).unwrap_or_else(|error| panic!("{line}: {error}"));
        let drawn = DRAWN.take();
        figures.extend(drawn.into_iter().map(|(name, figure)| (format!("{line}: {name}"), name, figure)));
    }
    let mut found = Vec::new();
    for (command, _, figure) in &figures {
        for width in [390, 600, 900] {
            let figure = Figure { width, ..figure.clone() };
            if let Some(folder) = std::env::var_os("STANDSTILL_PICTURES") {
                let name = command.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
                let path = std::path::Path::new(&folder).join(format!("{name}-{width}.png"));
                std::fs::write(path, figure.png().expect("a picture")).expect("written");
            }
            let faults = figure.faulty_labels().expect("a figure");
            found.extend(faults.into_iter().map(|fault| format!("{command} at {width}: {fault}")));
        }
    }
    let drawn: Vec<&str> = figures.iter().map(|(_, name, _)| name.as_str()).collect();
    for name in needed {
        assert!(drawn.iter().any(|drawn| drawn.contains(name)), "no figure {name} among {drawn:?}");
    }
    assert!(found.is_empty(), "{} faults:\n{}", found.len(), found.join("\n"));
}

#[test]
fn law_no_label_of_a_comparison_or_an_overlay_is_cut_off_or_lies_on_another() {
    looks_at(
        &[
            "compare S --no-limit --trials 6 --rotor locked --rotor free --errors default --errors field --method bipolar --method line-inductance --method maximum-likelihood",
            "compare hub-hoverboard --no-limit --trials 5 --rotor locked --errors default",
            "compare reluctance-6k7 --trials 5 --rotor locked --errors none --errors default --method bipolar",
        ],
        &["compar"],
    );
}

#[test]
fn law_no_label_of_a_question_is_cut_off_or_lies_on_another() {
    looks_at(
        &[
            "budget S --pairs 100",
            "odds S --event |e|~>~0.1~deg --effort quick",
            "odds S --event |e|~>~0.4~deg --effort quick",
            "require S --key sensors.noise --between 5~mA:300~mA --most 300 --limit rms~<=~1~deg",
            "require S --key sensors.gain_error --between 0.1~%:10~% --most 300 --limit p95~<=~2~deg,~wrong_poles~<=~1~%",
            "require S --key sensors.noise --key sensors.gain_error --most 100 --limit rms~<=~1~deg",
            "tune S --vary detector.pulse=200us:300us --vary detector.rest=1.2:3 --trials 1000 --starts 1 --minimise p95 --against peak_current",
        ],
        &["budget", "odds", "require", "tune"],
    );
}

#[test]
fn law_no_label_of_a_detection_or_a_fit_is_cut_off_or_lies_on_another() {
    let fit = concat!(
        "fit ",
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/traces/six_vectors.csv --motor paper-5k5"
    );
    looks_at(
        &[
            "trace S",
            "trace outrunner --method six-pulse -s errors=field",
            "trace --method open-terminal --motor paper-5k5 --errors field -s sensors.terminals=true",
            "trace S -s detector.pulse=[60~us,~90~us,~120~us]",
            "trace S -s detector.method=[bipolar,~line-inductance,~hfi-pulsating]",
            fit,
            "magnetics paper-5k5",
            "magnetics pm-reluctance",
        ],
        &["waveform", "overlay", "fit", "magnetics"],
    );
}

#[test]
fn law_no_label_of_a_run_is_cut_off_or_lies_on_another() {
    looks_at(
        &[
            "run S --trials 100",
            "report #0",
            "explain #0 --trial 1",
            "faults S --trials 20 --mode phase-open --mode current-sign --mode currents-swapped",
            "sweep S --trials 20 --vary sensors.noise=5~mA,10~mA,20~mA --vary errors=default,harsh",
            "report #4",
            "reproduce --motor paper-5k5 --trials 20",
        ],
        &["error", "line_pulses", "polarity"],
    );
}
