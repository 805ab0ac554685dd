//! Drives that six pulses cannot work with: which key is named, and what it needs.

use super::*;

#[test]
fn law_what_a_drive_lacks_is_refused_by_its_key() {
    let refused =
        |keys: &[&str]| try_scenario("errors = \"default\"", keys).expect_err("refused").to_string();
    let method = "detector.method=six-pulse";
    let timed = refused(&[method, "detector.timed=true"]);
    assert!(timed.contains("detector.timed") && timed.contains("sensors.timer"), "{timed}");
    for key in ["sensors.comparator_offset=1 A", "sensors.blanking=1 us", "sensors.comparators=per-leg"] {
        let message = refused(&[key]);
        assert!(message.contains("sensors.timer") && message.contains("sensors.trip"), "{message}");
    }
    let message = refused(&["sensors.trip=10 A", "sensors.threshold_bits=8"]);
    assert!(message.contains("sensors.timer"), "{message}");
    // A drive that reads neither times nor currents: the error names both.
    let place = "sensors.arrangement=none";
    let message = refused(&[method, place]);
    let all = ["`sensors.timer`", "three-in-line", "dc-link-shunt"];
    assert!(all.iter().all(|part| message.contains(part)), "{message}");
    let sampled =
        refused(&[method, place, "sensors.timer=1 us", "detector.timed=false", "detector.rounds=2"]);
    assert!(sampled.contains("`detector.timed` true"), "{sampled}");
    // Comparators of each leg need a sensor of each leg.
    for arrangement in ["two-in-line", "dc-link-shunt", "none"] {
        let place = format!("sensors.arrangement={arrangement}");
        let message = refused(&["sensors.timer=1 us", &place, "sensors.comparators=per-leg"]);
        let parts = ["`sensors.comparators`", "\"per-leg\"", "\"common\"", "three-in-line"];
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        let timed = [method, "sensors.timer=1 us", &place, "sensors.comparators=common"];
        assert!(try_scenario("errors = \"default\"", &timed).is_ok(), "{arrangement}");
    }
    // Those of shunts below the legs see three of the six pulses: they trip on overcurrents, and currents are sampled.
    let below =
        ["sensors.arrangement=low-side-shunts", "sensors.timer=1 us", "sensors.comparators=per-leg", method];
    let sampled = try_scenario("errors = \"default\"", &below).expect("sampled");
    assert_eq!(sampled.value("detector.timed"), Some(false.into()));
    let message = refused(&[below[0], below[1], below[2], below[3], "detector.timed=true"]);
    assert!(
        message.contains("`detector.timed`") && message.contains("`sensors.comparators` \"common\""),
        "{message}"
    );
    let once = refused(&[method, "sensors.timer=1 us", "detector.timed=false"]);
    assert!(once.contains("detector.rounds") && once.contains("2 where `timed` is false"), "{once}");
    let exact = try_scenario("errors = \"none\"", &["sensors.timer=1 us", "sensors.threshold_bits=8"]);
    assert!(exact.expect_err("no range").to_string().contains("sensors.threshold_range"));
    let sector = refused(&[method, "detector.sector=45 deg"]);
    assert!(sector.contains("0, 30 or 60"), "{sector}");
}

/// A timer alone does not sample: what pulses need follows from their settings, not from the method's name.
#[test]
fn law_sampled_pulses_are_refused_on_a_drive_without_currents() {
    let load = |timed: &str| {
        let text = format!(
            "sensors.arrangement = \"none\"\nsensors.timer = 1e-6\ndetector.method = \"six-pulse\"\n{timed}"
        );
        let document = Document::parse(Path::new("s.toml"), &text).expect("TOML");
        let scenario = Plan::new(document).and_then(|plan| plan.scenario(0));
        scenario.map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(load(""), Ok(()));
    let error = load("detector.timed = false\ndetector.rounds = 2").expect_err("no currents");
    assert!(error.contains("the currents of the phases") && error.contains("dc-link-shunt"), "{error}");
}

#[test]
fn law_a_threshold_that_the_converter_cannot_set_is_refused() {
    let beyond = ["sensors.threshold_bits=8", "sensors.threshold_range=10 A", "detector.threshold=12 A"];
    let message = try_scenario(PAPER, &beyond).expect_err("beyond the range").to_string();
    assert!(message.contains("threshold") && message.contains("sensors.threshold_range"), "{message}");
    assert!(try_scenario(PAPER, &[beyond[0], beyond[1], "detector.threshold=9.9 A"]).is_ok());
    let message = try_scenario(PAPER, &[beyond[1]]).expect_err("a range of nothing").to_string();
    assert!(message.contains("sensors.threshold_bits"), "{message}");
}

/// Of several keys that lack what they need, the one that stands first in the table is named.
#[test]
fn law_the_first_key_that_lacks_something_is_named() {
    let first = |keys: &[&str]| try_scenario("errors = \"default\"", keys).expect_err("refused").to_string();
    let message = first(&["sensors.blanking=1 us", "sensors.comparators=per-leg", "sensors.timer_error=1 %"]);
    assert!(message.contains("`sensors.comparators`: found per-leg"), "{message}");
    let message = first(&["sensors.threshold_bits=8", "sensors.comparator_noise=1 mA", "sensors.trip=10 A"]);
    assert!(message.contains("`sensors.comparator_noise`: found 0.001 A"), "{message}");
}
