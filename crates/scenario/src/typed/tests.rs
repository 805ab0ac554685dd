//! Setters against the document: equal scenarios.

use standstill_sim::{Purpose, Streams, Tape};

use crate::keys::{keys, motor::SETTERS};
use crate::tests::plan;
use crate::{Document, FileError, Plan};

/// Compares trials at all points with those of the document, and returns how many of them the setters made.
fn compared(typed: &Plan, trials: u64) -> u64 {
    let mut document = typed.clone();
    document.typed = None;
    let mut set = 0;
    for point in 0..typed.points().len() {
        let nominal = typed.scenario(point).expect("valid");
        let drawn = |plan: &Plan, trial| plan.drawn(point, Some(&nominal), trial).expect("valid");
        for trial in 0..trials {
            assert_eq!(drawn(typed, trial), drawn(&document, trial));
            let streams = Streams::new(nominal.seed, trial);
            let setters = typed.typed.as_ref();
            set += u64::from(setters.is_some_and(|setters| {
                setters.at(point).drawn(&typed.tolerances, &nominal, streams).is_some()
            }));
        }
        assert_ne!(drawn(typed, 0), drawn(typed, 1));
        assert_ne!(drawn(typed, 0), nominal);
    }
    set
}

#[test]
fn law_a_setter_makes_the_scenario_that_the_document_makes() {
    let text =
        |tolerances: &str| format!("[axes]\nerrors = [\"default\", \"field\"]\n[tolerances]\n{tolerances}");
    let typed = plan(&text(
        "\"motor.winding.resistance\" = { normal = \"5 %\" }\n\"sensors.noise\" = { uniform = \"30 %\", mean = \"10 mA\" }\n\
         \"inverter.diode_drop\" = { normal = \"0.1 V\", mean = \"1 V\" }\n\"sensors.bandwidth\" = { uniform = \"10 kHz\", mean = \"150 kHz\" }",
    ));
    assert_eq!(compared(&typed, 300), 600);
    // The document checks values beyond those that were tried: a winding has no negative resistance.
    let wide = plan("trials = 3\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"40 %\" }");
    assert!(wide.typed.is_some());
    let nominal = wide.scenario(0).expect("valid");
    let mut tape = Tape::new(nominal.seed, 0);
    wide.scenario_taped(0, &nominal, &tape).expect("tried");
    tape.normals_named(Purpose::Tolerance, "motor.winding.resistance")[0] = -4.0;
    let refused = wide.scenario_taped(0, &nominal, &tape).expect_err("negative").to_string();
    assert!(refused.contains("winding.resistance"), "{refused}");
    // Without a setter for a key, the document makes all scenarios.
    assert!(plan(&text("\"motor.rating.current\" = { normal = \"5 %\" }")).typed.is_none());
}

/// Motors with all kinds of cores, with rotors that move and iron with hysteresis.
const MOTORS: [(&str, &str); 9] = [
    ("saturated", "motor = \"paper-5k5\""),
    (
        "hot",
        "motor = \"paper-5k5\"\nrotor.state = \"driven\"\nrotor.winding_temperature = \"90 °C\"\nrotor.magnet_temperature = \"80 °C\"",
    ),
    ("with bridges", "motor = \"pm-reluctance\"\nerrors = \"harsh\"\nrotor.magnet_temperature = \"60 °C\""),
    ("without a magnet", "motor = \"reluctance-6k7\"\ninverter.terminal_capacitance = \"1 nF\""),
    ("with harmonics, free", "motor = \"slot-harmonics\"\nrotor.state = \"free\""),
    (
        "that remembers, braked",
        "[motor]\nbase = \"surface-magnet\"\nhysteresis = { coercive_current = \"0.1 A\", depth = \"2 %\", cells = 2 }\nrotor.brake_backlash = \"0.2 deg\"\n[rotor]\nstate = \"brake\"\nmemory = \"former\"",
    ),
    ("of a nameplate, with MOSFETs", "motor = \"outrunner\"\nrotor.state = \"free\""),
    (
        "by a nameplate alone",
        "[motor]\nname = \"pump\"\nnameplate = { pole_pairs = 3, resistance = \"0.9 Ω\", L_d = \"9 mH\", L_q = \"12 mH\", magnet_flux = \"0.3 Wb\", rated_current = \"8 A\", dc_link = \"550 V\", saturation = \"6 %\" }\n[rotor]\nstate = \"free\"",
    ),
    (
        "without saturation",
        "[motor]\nname = \"linear\"\nrating = { current = \"6 A\" }\nwinding = { pole_pairs = 3, resistance = \"0.9 Ω\", mean_inductance = \"7 mH\", saliency = \"-1 mH\", leakage = \"0.3 mH\", magnet_flux = \"0.3 Wb\" }\nharmonics.flux_5 = \"4 mWb\"\neddy = { time_constant = \"200 us\", d_depth = 0.05, q_depth = 0.1 }\nrotor = { inertia = \"0.01 kg m²\", stiction = \"0.2 N m\", coulomb = \"0.1 N m\", viscous = \"0 N m s\" }",
    ),
];

/// Distribution of a key, narrow enough for each of the motors that have it.
fn spread(key: &str) -> &'static str {
    match key {
        "rotor.winding_temperature" => "normal = \"20\", mean = \"60 °C\", truncated = 3",
        "rotor.magnet_temperature" => "uniform = \"30\", mean = \"50 °C\"",
        "rotor.load" => "normal = \"10 %\", mean = \"50 mN m\"",
        "rotor.speed" => "normal = \"10 %\", mean = \"10 rpm\"",
        "rotor.acceleration" => "normal = \"10 %\", mean = \"60 rpm/s\"",
        "inverter.dc_link" => "uniform = \"8 %\", mean = \"500 V\"",
        "inverter.ripple" => "uniform = \"0.4 %\", mean = \"0.8 %\"",
        "inverter.ripple_frequency" => "uniform = \"10 Hz\", mean = \"300 Hz\"",
        "inverter.dead_time" => "normal = \"15 %\", mean = \"1.7 us\"",
        "inverter.delay_mismatch" => "normal = \"15 %\", mean = \"40 ns\"",
        "inverter.switch_drop" | "inverter.diode_drop" => "normal = \"0.1 V\", mean = \"1 V\", truncated = 3",
        "inverter.channel_resistance" => "uniform = \"20 %\", mean = \"1 mOhm\"",
        "inverter.switch_resistance" | "inverter.diode_resistance" => "uniform = \"20 %\", mean = \"3 mOhm\"",
        "sensors.noise" | "sensors.offset" | "sensors.comparator_offset" | "sensors.comparator_noise" => {
            "uniform = \"30 %\", mean = \"10 mA\""
        }
        "sensors.gain_error" => "uniform = \"0.2 %\", mean = \"0.5 %\"",
        "sensors.bandwidth" | "sensors.terminal_bandwidth" => "uniform = \"10 kHz\", mean = \"150 kHz\"",
        "sensors.timer" => "uniform = \"0.1 us\", mean = \"1 us\"",
        "sensors.timer_error" => "uniform = \"0.1 %\", mean = \"0.3 %\"",
        "sensors.trip" => "uniform = \"1 A\", mean = \"50 A\"",
        "sensors.comparator_delay" | "sensors.comparator_delay_spread" => {
            "uniform = \"10 ns\", mean = \"50 ns\""
        }
        "sensors.comparator_bandwidth" => "uniform = \"0.1 MHz\", mean = \"1 MHz\"",
        "sensors.blanking" => "uniform = \"0.2 us\", mean = \"1 us\"",
        "sensors.threshold_range" => "uniform = \"1 A\", mean = \"20 A\"",
        "detector.time_limit" => "uniform = \"1 s\", mean = \"10 s\"",
        "sensors.bandwidth_tolerance" | "sensors.bandwidth_mismatch" => "uniform = \"1 %\", mean = \"2 %\"",
        "sensors.slew" => "uniform = \"0.2 MA/s\", mean = \"5 MA/s\"",
        "sensors.acquisition" => "uniform = \"20 ns\", mean = \"100 ns\"",
        "sensors.settle" => "uniform = \"0.2 us\", mean = \"3 us\"",
        "sensors.skew" | "sensors.conversion" | "sensors.jitter" | "sensors.sample_delay" => {
            "uniform = \"0.2 us\", mean = \"0.5 us\""
        }
        "sensors.dc_link_gain_error" => "uniform = \"0.1 %\", mean = \"0.2 %\"",
        "sensors.terminal_gain_error" => "uniform = \"0.1 %\", mean = \"0.5 %\"",
        "sensors.terminal_load" => "uniform = \"10 %\", mean = \"2 MΩ\"",
        "sensors.terminal_offset"
        | "sensors.terminal_noise"
        | "sensors.dc_link_offset"
        | "sensors.dc_link_noise" => "uniform = \"10 %\", mean = \"300 mV\"",
        "motor.nameplate.leakage" => "uniform = \"1 uH\", mean = \"2 uH\"",
        "motor.winding.leakage" => "uniform = \"5 uH\", mean = \"5 uH\"",
        "motor.rotor.viscous" => "uniform = \"0.5 mN m s\", mean = \"1 mN m s\"",
        // Sliding friction is at most as large as stiction.
        "motor.rotor.coulomb" => "uniform = \"10 %\", mean = \"0.1 mN m\"",
        "motor.rotor.stiction" => "uniform = \"10 %\", mean = \"2 N m\"",
        // Inductances and magnet must agree with the core within 2 %. A nameplate needs a spread wide enough to change
        // the assumed inertia, which has two digits.
        key if key.starts_with("motor.nameplate.") => "normal = \"5 %\", truncated = 3",
        key if key.starts_with("motor.winding.") => "normal = \"0.3 %\", truncated = 3",
        key if key.starts_with("motor.rotor.") => "uniform = \"10 %\"",
        // All other keys.
        _ => "uniform = \"10 %\"",
    }
}

fn tried(motor: &str, tolerances: &str) -> Result<Plan, FileError> {
    // In TOML these keys must precede the text of the motor, which may contain tables.
    let dividers = if tolerances.contains("sensors.terminal_") { "sensors.terminals = true\n" } else { "" };
    let of_comparators =
        ["sensors.comparator_", "sensors.timer_error", "sensors.blanking", "sensors.threshold_range"];
    let timed = of_comparators.iter().any(|key| tolerances.contains(key));
    let timer = if timed { "sensors.timer = 1e-6\n" } else { "" };
    let converter =
        if tolerances.contains("sensors.threshold_range") { "sensors.threshold_bits = 8\n" } else { "" };
    let averaged = if tolerances.contains("sensors.conversion") { "sensors.oversampling = 4\n" } else { "" };
    let noise = if tolerances.contains("sensors.comparator_bandwidth") {
        "sensors.comparator_noise = 0.01\n"
    } else {
        ""
    };
    let shunts = tolerances.contains("sensors.settle") || tolerances.contains("sensors.slew");
    let shunts = if shunts { "sensors.arrangement = \"low-side-shunts\"\n" } else { "" };
    let text = format!(
        "{dividers}{timer}{noise}{converter}{averaged}{shunts}tolerances = {{ {tolerances} }}\n{motor}"
    );
    Plan::new(Document::parse(std::path::Path::new("s.toml"), &text)?)
}

/// Number of draws of each key on each motor. Scenarios must be equal to the last bit, so the first draw shows a setter
/// of a wrong number.
const DRAWS: u64 = 3;

#[test]
fn law_each_setter_makes_what_the_document_makes_on_all_kinds_of_motors() {
    let by_themselves = keys().filter(|key| key.set.is_some()).map(|key| key.path);
    for key in SETTERS.iter().map(|(key, _)| *key).chain(by_themselves) {
        let mut motors = 0;
        for (motor, text) in MOTORS {
            // A flux of zero has no relative spread.
            if (key, motor) == ("motor.winding.magnet_flux", "without a magnet") {
                continue;
            }
            // Some motors lack the key, and some scenarios do not allow it.
            let Ok(plan) = tried(text, &format!("\"{key}\" = {{ {} }}", spread(key))) else { continue };
            // If friction is assumed, stiction and sliding friction are one number, and only the document sets both.
            let both = motor == "by a nameplate alone"
                && ["motor.rotor.stiction", "motor.rotor.coulomb"].contains(&key);
            assert_eq!(compared(&plan, DRAWS), if both { 0 } else { DRAWS }, "{key} of a motor {motor}");
            motors += 1;
        }
        let least = match key {
            "motor.rotor.brake_backlash"
            | "motor.rotor.cogging_torque"
            | "inverter.channel_resistance"
            | "rotor.acceleration" => 1,
            "motor.winding.leakage" | "rotor.load" | "rotor.speed" => 2,
            key if key.starts_with("motor.nameplate.") => 2,
            _ => 5,
        };
        assert!(motors >= least, "{key}: {motors} motors");
    }
}
