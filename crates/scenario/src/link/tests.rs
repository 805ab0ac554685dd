use standstill_detect::{Method, Settings};
use standstill_inverter::{Sag, Storage};
use standstill_sim::{Trace, run};

use crate::Scenario;
use crate::tests::{error, scenario};

#[test]
fn analytic_link_capacitor_and_sag_are_where_they_belong() {
    let link = |keys: &str| scenario(&format!("[inverter]\n{keys}")).drive.link;
    let plain = link("");
    assert_eq!((plain.storage, plain.sag), (None, None));
    let all = link(
        "capacitance = \"470 uF\"\nsource_resistance = \"0.2 Ω\"\nsag_depth = \"20 %\"\nsag_start = \"2 ms\"\nsag_duration = 0.01",
    );
    assert_eq!(all.storage, Some(Storage { capacitance: 470e-6, source_resistance: 0.2 }));
    assert_eq!(all.sag, Some(Sag { depth: 0.2, start: 2e-3, duration: 0.01 }));
    let at_once = link("sag_depth = 0.1\nsag_duration = \"5 ms\"");
    assert_eq!(at_once.sag, Some(Sag { depth: 0.1, start: 0.0, duration: 5e-3 }));
    // An axis may begin at zero.
    let none = link("capacitance = 0\nsource_resistance = 1\nsag_depth = \"0 %\"\nsag_duration = \"1 ms\"");
    assert_eq!(none, plain);
    for (keys, parts) in [
        ("capacitance = \"1 mF\"", ["`inverter.capacitance`", "`inverter.source_resistance`"]),
        ("source_resistance = 1", ["`inverter.source_resistance`", "`inverter.capacitance`"]),
        ("capacitance = \"1 uF\"\nsource_resistance = 0.1", ["`inverter.capacitance`", "at least 1 µs"]),
        ("sag_depth = 0.1", ["`inverter.sag_depth`", "`inverter.sag_duration`"]),
        ("sag_duration = 0.1", ["`inverter.sag_duration`", "`inverter.sag_depth`"]),
        ("sag_depth = 1.1\nsag_duration = 1", ["`inverter.sag_depth`", "from 0 to 1"]),
        ("sag_start = 21\nsag_depth = 0.1\nsag_duration = 1", ["`inverter.sag_start`", "0 to 20 s"]),
    ] {
        let message = error(&format!("[inverter]\n{keys}"));
        assert!(parts.iter().all(|part| message.contains(part)) && message.contains("line 2"), "{message}");
    }
}

/// Runs a trial and returns its scenario and its trace.
fn seen(text: &str) -> (Scenario<Method<f64>>, Trace) {
    let scenario = scenario(text);
    let mut trace = Trace::new(1e-6);
    let mut detector = scenario.detector.detector().expect("settings");
    run(&scenario.case(0), &mut detector, false, &mut trace);
    (scenario, trace)
}

#[test]
fn analytic_a_capacitor_gives_the_charge_that_its_voltage_loses() {
    // Through 1 MΩ the source returns almost no charge within a detection.
    let text = "errors = \"none\"\n[inverter]\ncapacitance = \"200 uF\"\nsource_resistance = 1e6\n[detector]\nmethod = \"bipolar\"";
    let (scenario, trace) = seen(text);
    let mut charge = 0.0;
    for pair in trace.snapshots.windows(2) {
        let link = |k: usize| {
            let of_leg = |leg: usize| if pair[0].modes[leg].is_upper() { pair[k].current[leg] } else { 0.0 };
            (0..3).map(of_leg).sum::<f64>()
        };
        charge += (pair[1].time - pair[0].time) * (link(0) + link(1)) / 2.0;
    }
    let last = trace.snapshots.last().expect("a run");
    let lost = 200e-6 * (scenario.drive.link.voltage - last.dc_link);
    assert!(lost > 1e-5 && (charge / lost - 1.0).abs() < 1e-3, "{charge} C, {lost} C");
}

#[test]
fn analytic_a_sag_is_deepest_in_its_middle_and_moves_what_is_found() {
    let text = "[inverter]\nripple = 0\nsag_depth = \"20 %\"\nsag_start = \"1 ms\"\nsag_duration = \"4 ms\"\n[detector]\nmethod = \"bipolar\"";
    let (scenario, trace) = seen(text);
    let at = |time: f64| {
        let later = trace.snapshots.iter().find(|snapshot| snapshot.time >= time).expect("so long");
        later.dc_link / scenario.drive.link.voltage
    };
    assert!((at(0.5e-3) - 1.0).abs() < 1e-12 && (at(5.5e-3) - 1.0).abs() < 1e-12);
    assert!((at(3e-3) - 0.8).abs() < 1e-5 && (at(2e-3) - 0.9).abs() < 1e-3, "{} {}", at(3e-3), at(2e-3));
    let found = |text: &str| crate::tests::scenario(text).trial(0).expect("settings").error_deg();
    assert_ne!(found(text), found(&text.replace("20 %", "0 %")));
}
