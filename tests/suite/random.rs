//! Random valid scenarios, detectors that ask for nonsense, and the energies and the referee of some of them: a part of
//! what `scripts/random-detections.sh` runs by the ten thousand; and the surprises that it found.

use standstill_detect::Method;
use standstill_scenario::Scenario;
use standstill_sim::{Ended, RunError};

use crate::random_detections::{Depth, Tally, document, look, run_seed};

/// Seeds of a test, enough for each kind of end. `--short` of the example draws the same scenarios, and `scripts/random-detections.sh` as many
/// others as one likes.
const SCENARIOS: u64 = 300;

#[test]
fn law_no_random_detection_ends_in_a_surprise() {
    let depth = Depth { longest: 0.01, trials: 2, balance: 15, referee: 8, nonsense: 5 };
    let mut tally = Tally::default();
    let surprises: Vec<String> = (0..SCENARIOS)
        .filter_map(|seed| run_seed(seed, depth, &mut tally).err())
        .map(|surprise| surprise.to_string())
        .collect();
    println!("{tally:?}");
    assert!(surprises.is_empty(), "each by its command with --short\n\n{}", surprises.join("\n\n"));
    // Each kind of end occurs, or the scenarios would be no mixture.
    assert_eq!(tally.detections(), 2 * SCENARIOS);
    assert!(tally.counts().into_iter().all(|(name, count)| count > 0 || name == "surprises"), "{tally:?}");
}

/// Makes the scenario of a text.
fn scenario(text: &str) -> Scenario<Method<f64>> {
    let document = document(&[text.to_owned()]).expect("TOML");
    document.scenario_of(&document.motor().expect("a motor")).expect("valid")
}

/// The core's inductance at the end of a step is that of where the step predicted the flux. The next step evaluates it
/// anew, and the potential of the blocked leg jumps by what the prediction missed: beyond the diode's bound.
#[test]
fn regress_a_blocked_leg_whose_potential_jumps_beyond_its_bound_conducts() {
    let scenario = scenario(
        "motor = { name = \"drawn\", nameplate = { pole_pairs = 10, resistance = 1.5592261257970273e-2, \
         L_d = 1.3323974534675669e-2, L_q = 5.1421271050442315e-2, magnet_flux = 3.305728065449615e-3, \
         rated_current = 9.785950924991639e-1, dc_link = 6.662512202758877e0, leakage = 4.023059533445141e-3, \
         saturation = { d = 0.4998, q = 0.4867 } } }\n\
         seed = 110\nerrors = \"harsh\"\ndetector.method = \"line-inductance-fast\"\nsensors.terminals = true\n\
         rotor.state = \"free\"\nrotor.speed = -4.159476451092407e2\n\
         faults = [{ mode = \"command-late\" }, { mode = \"sheet-inductance\", magnitude = 2 }]",
    );
    for trial in [0, 3] {
        let record = scenario.trial(trial).expect("settings");
        assert!(matches!(record.run.ended, Ended::Outcome(_)), "{}", record.reason());
    }
    assert_eq!(look::balances(&scenario), Ok(()));
}

/// The winding of ringing terminals saw a link's capacitor by the slope of its source, and not by its own.
#[test]
fn regress_ringing_terminals_on_a_links_capacitor_agree_with_the_referee_and_keep_the_energy() {
    for capacitance in [1e-3, 7e-3] {
        let scenario = scenario(&format!(
            "motor = \"light-vehicle\"\nerrors = \"none\"\ndetector.method = \"line-inductance-fast\"\n\
             inverter = {{ capacitance = {capacitance}, source_resistance = 0.2, terminal_capacitance = 1e-9 }}"
        ));
        assert_eq!(look::agrees_with_referee(&scenario), Ok(true), "{capacitance} F");
        assert_eq!(look::balances(&scenario), Ok(()), "{capacitance} F");
    }
}

/// A driven rotor takes steps of milliseconds, within which its cogging turns many times: the ledger looked at four points of each.
#[test]
fn regress_the_work_of_cogging_is_counted_in_long_steps_of_a_driven_rotor() {
    let scenario = scenario(
        "motor = { name = \"drawn\", nameplate = { pole_pairs = 200, resistance = 6, L_d = 3.5, L_q = 7.5, magnet_flux = 0, \
         rated_current = 0.18, dc_link = 90 }, rotor = { inertia = 3e-4, stiction = 0, coulomb = 0, viscous = 0, \
         cogging_torque = 3e-5, cogging_periods = 200 } }\n\
         detector = { method = \"subdivision\", time_limit = 0.01 }\nrotor = { state = \"driven\", speed = 15 }",
    );
    assert_eq!(look::balances(&scenario), Ok(()));
}

/// A terminal that falls faster than a link that ripples leaves its diode where both fall alike: the bound's slope over a step is not that at
/// its beginning, and the mode seemed to end a thousand times within 0.1 µs.
#[test]
fn regress_a_terminal_leaves_a_bound_that_ripples() {
    let scenario = scenario(
        "motor = { name = \"drawn\", nameplate = { pole_pairs = 4, resistance = 1.3411279894916948e0, L_d = 6.382245236974377e0, \
         L_q = 3.2803790351414186e1, magnet_flux = 3.546626414467785e-1, rated_current = 1.2616881968291546e-1, \
         dc_link = 6.844165510817115e2, saturation = { d = 0.0481, minus_d = 0.1947, q = 0.4217 } } }\n\
         seed = 1173\nerrors = \"harsh\"\ndetector = { method = \"six-pulse\", time_limit = 3e-2, \
         least_saliency = 0.00033962085185399246 }\nrotor = { state = \"locked\", magnet_temperature = 120.1348364493581 }\n\
         inverter = { terminal_capacitance = 1.7702218147780502e-10, ripple_frequency = 16732.00039923092, \
         terminal_resistance = 17550.37896922989, switch_drop = 1.0651028062562908 }\n\
         sensors = { terminals = true, terminal_bits = 1, bandwidth_mismatch = 0.009299955169040811, oversampling = 18 }",
    );
    for trial in 0..4 {
        let record = scenario.trial(trial).expect("settings");
        assert!(matches!(record.run.ended, Ended::Error(RunError::TimeLimit(_))), "{}", record.reason());
    }
    assert_eq!(look::balances(&scenario), Ok(()));
}

/// A link's capacitor gives what the currents of its rail take. It was corrected with the currents and slopes of terminals that had yet
/// to be put right, so steps of 8 µs drew 2e-5 V too little of it.
#[test]
fn regress_a_links_capacitor_gives_what_ringing_terminals_leave_of_the_current() {
    let scenario = scenario(
        "motor = \"light-vehicle-stiff\"\nseed = 500780\nerrors = \"field\"\n\
         detector = { method = \"maximum-likelihood-adaptive\", time_limit = 0.15 }\nsensors.arrangement = \"low-side-shunts\"\n\
         inverter = { dc_link = 40.9, capacitance = 1.1567e-3, source_resistance = 24.44 }",
    );
    assert_eq!(look::balances(&scenario), Ok(()));
}

/// A potential counts as at its bound within a share of the link's voltage: where that is more than lies between the bounds of a leg's switch
/// and diode, a terminal was at both, and its leg changed between them without end.
#[test]
fn regress_a_terminal_between_two_devices_is_at_one_of_them() {
    let scenario = scenario(
        "motor = \"paper-5k5\"\nseed = 600989\nerrors = \"harsh\"\n\
         detector = { method = \"line-inductance\", time_limit = 3e-2 }\nrotor.state = \"free\"\n\
         sensors = { arrangement = \"two-in-line\", gain_error = 0.007052482794772832 }\n\
         inverter = { terminal_capacitance = 3.4759137218238297e-9, dc_link = 545698.9227573033 }",
    );
    for trial in 0..4 {
        let record = scenario.trial(trial).expect("settings");
        assert_eq!(look::over(&record), Ok(()));
    }
    assert_eq!(look::balances(&scenario), Ok(()));
}
