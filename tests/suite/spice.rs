//! The bridge on a linear motor against ngspice, a circuit simulator: the cases of `tests/cross/ngspice/cases.txt`.
//!
//! The netlists carry switches, drops, diodes and coupled inductors, and gate edges computed by a script of their own;
//! the same lines of `cases.txt` become commands here. A junction of the netlists, in each switch and diode, drops a
//! little of its own, 2.0 to 2.3 mV between 0.1 A and 5 A; here all drops are larger by 2.1 mV. What the logarithm
//! varies about that is most of the deviation that is left: it shrinks in proportion with a smaller junction voltage.

mod cases;
mod sensed;

use std::path::PathBuf;

use standstill_interface::{Command, Leg, Nanos, Phase, Sampling};
use standstill_inverter::{Bridge, DeviceKind, Devices, Gate, GateTiming, Inverter, OpenLeg};
use standstill_sim::{Broken, Event, Fault, NoProbe, Probe, Trace, run};

use crate::bench::{Script, exact_case, ideal_inverter};

use cases::{Spice, cases, folder, number};

/// Largest difference allowed, as a share of the run's largest phase current.
const BOUND: f64 = 1e-4;

/// Times in s and phase currents in A of a golden file.
fn golden(name: &str) -> Vec<[f64; 4]> {
    let mut reader = csv::Reader::from_path(folder().join(format!("{name}.csv"))).expect("golden file");
    reader.deserialize().map(|row| row.expect("golden row")).collect()
}

/// Largest phase current of a golden file in A.
fn full_scale(rows: &[[f64; 4]]) -> f64 {
    rows.iter().flat_map(|row| &row[1..]).fold(0.0, |peak, i| peak.max(i.abs()))
}

impl Spice {
    fn inverter(&self, open_leg: OpenLeg) -> Inverter {
        Inverter {
            bridge: Bridge {
                devices: self.devices,
                open_leg,
                terminal_capacitance: self.capacitance,
                terminal_resistance: self.resistance,
                ..Bridge::default()
            },
            gates: [self.timing; 3],
            ..ideal_inverter(open_leg)
        }
    }

    /// Plays the case; what the probe sees is kept by the caller.
    fn play(&self, open_leg: OpenLeg, probe: &mut impl Probe) -> Script {
        let mut script = Script::new(self.commands.clone());
        let mut case = exact_case(&self.motor, self.inverter(open_leg), self.angle_deg);
        if let Some(short) = self.short {
            assert!(case.faults.push(Fault::lasting(short)));
        }
        run(&case, &mut script, false, probe);
        script
    }

    /// Our samples: time in s and phase currents in A.
    fn samples(&self, open_leg: OpenLeg) -> Vec<[f64; 4]> {
        let script = self.play(open_leg, &mut NoProbe);
        let mut start = Nanos::ZERO;
        let mut readings = script.readings.iter();
        let mut rows = Vec::new();
        for command in &self.commands {
            for reading in readings.by_ref().take(command.sampling.count as usize) {
                let [a, b, c] = reading.current.0;
                rows.push([(start + reading.at).seconds(), a, b, c]);
            }
            start = start + command.duration();
        }
        assert_eq!(rows.len(), script.readings.len(), "{}", self.name);
        rows
    }

    /// Largest difference to ngspice over all rows and phases, as a share of full scale.
    fn deviation(&self, open_leg: OpenLeg) -> f64 {
        let (golden, ours) = (golden(&self.name), self.samples(open_leg));
        assert_eq!(golden.len(), ours.len(), "{}: every row is compared", self.name);
        let mut worst: f64 = 0.0;
        for (theirs, ours) in golden.iter().zip(&ours) {
            assert!((theirs[0] - ours[0]).abs() < 1e-9, "{}: {theirs:?} {ours:?}", self.name);
            for (theirs, ours) in theirs[1..].iter().zip(&ours[1..]) {
                worst = worst.max((theirs - ours).abs());
            }
        }
        worst / full_scale(&golden)
    }

    /// The leg that is off in the first stage of a line pulse.
    fn idle_leg(&self) -> usize {
        let legs = self.commands[0].stage.legs.0;
        legs.iter().position(|leg| *leg == Leg::Off).expect("a line pulse leaves a leg off")
    }

    /// Gate edges of the run: upper switches of legs a, b, c, then lower ones; time in ns and whether on.
    fn edges(&self) -> [Vec<(f64, bool)>; 6] {
        let mut trace = Trace::new(1.0);
        self.play(OpenLeg::Diodes, &mut trace);
        let mut edges: [Vec<(f64, bool)>; 6] = Default::default();
        for (time, event) in &trace.events {
            let Event::Gate(phase, gate) = *event else { continue };
            for (switch, state) in [(0, Gate::High), (3, Gate::Low)] {
                let edges = &mut edges[switch + phase as usize];
                if edges.last().is_some_and(|(_, on)| *on) != (gate == state) {
                    edges.push((time * 1e9, gate == state));
                }
            }
        }
        edges
    }

    /// The same from the netlist.
    fn edges_of_netlist(&self) -> [Vec<(f64, bool)>; 6] {
        let text = std::fs::read_to_string(folder().join(format!("{}.cir", self.name))).expect("netlist");
        // A line that begins with a plus continues the one before.
        let text = text.replace("\n+ ", " ");
        ["upa", "upb", "upc", "lowa", "lowb", "lowc"].map(|gate| {
            let line = text.lines().find_map(|line| line.strip_prefix(&format!("V{gate} {gate} 0 ")));
            let line = line.unwrap_or_else(|| panic!("{}: no gate {gate}", self.name));
            let Some(points) = line.strip_prefix("PWL(").and_then(|line| line.strip_suffix(")")) else {
                // A constant: off, or on from the beginning.
                return if line == "0" { Vec::new() } else { vec![(0.0, true)] };
            };
            let words: Vec<&str> = points.split(' ').collect();
            let on_at_once = (words[1] == "1").then_some((0.0, true));
            let edges = words.chunks_exact(4).map(|edge| {
                let [from, to] = [edge[0], edge[2]].map(|t| number(t.trim_end_matches('u')) * 1e3);
                assert!(to - from < 1.0 && edge[1] != edge[3], "{}: {edge:?}", self.name);
                ((from + to) / 2.0, edge[3] == "1")
            });
            on_at_once.into_iter().chain(edges).collect()
        })
    }
}

/// All cases whose names begin so, each compared at every row.
fn compared(prefix: &str) -> Vec<Spice> {
    let cases: Vec<Spice> = cases().into_iter().filter(|case| case.name.starts_with(prefix)).collect();
    for case in &cases {
        let worst = case.deviation(OpenLeg::Diodes);
        println!("{:22} {worst:.1e} of {:.3} A", case.name, full_scale(&golden(&case.name)));
        assert!(worst < BOUND, "{}: {worst:e} of full scale", case.name);
    }
    cases
}

/// How often a current changes its sign, from beyond 0.1 A to beyond 0.1 A on the other side.
fn sign_changes(rows: &[[f64; 4]], phase: usize) -> usize {
    let signs: Vec<bool> =
        rows.iter().map(|row| row[1 + phase]).filter(|i| i.abs() > 0.1).map(|i| i > 0.0).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

/// Whether a phase carries no current: a microampere is the last digit of the golden files.
fn rests(current: f64) -> bool {
    current.abs() < 5e-6
}

/// promise: circuits
#[test]
fn cross_low_side_freewheel_against_ngspice() {
    let mut conducting = Vec::new();
    for case in compared("slow_") {
        let (rows, idle) = (golden(&case.name), 1 + case.idle_leg());
        if rows.iter().filter(|row| row[idle].abs() > 20e-3).count() >= 100 {
            // With a truly open leg the run must differ, or the diode was never simulated.
            let open = case.deviation(OpenLeg::Open);
            assert!(open > 30.0 * BOUND, "{}: {open}", case.name);
            // The lower diode, and no other: its current flows into the motor.
            assert!(rows.iter().all(|row| row[idle] > -5e-6), "{}", case.name);
            conducting.push(case.name);
        } else {
            assert!(rows.iter().all(|row| rests(row[idle])), "{}: no current or a good deal", case.name);
        }
    }
    // Nearly ideal devices: always. With drops it takes more saliency voltage than the diode's threshold.
    let expected = [
        "slow_ab_000_ideal",
        "slow_ab_043_ideal",
        "slow_bc_100_ideal",
        "slow_ca_241_ideal",
        "slow_bc_300_ideal",
        "slow_ab_000_drops",
        "slow_ca_241_drops",
        "slow_bc_300_drops",
        "slow_ca_151_inverse",
    ];
    assert_eq!(conducting, expected);
}

/// promise: circuits
#[test]
fn cross_gates_off_against_ngspice() {
    let cases = compared("fast_");
    assert_eq!(cases.len(), 11);
    for case in cases {
        let rows = golden(&case.name);
        assert!(full_scale(&rows) > 1.0, "{}", case.name);
        // Before each next pulse and at the end all current is gone.
        assert_eq!(rows.len(), 3 * 40);
        for last in [39, 79, 119] {
            assert!(rows[last][1..].iter().all(|i| rests(*i)), "{}: {:?}", case.name, rows[last]);
        }
    }
}

/// promise: circuits
#[test]
fn cross_voltage_vectors_against_ngspice() {
    let cases = compared("vectors_");
    assert_eq!(cases.len(), 2);
    for case in cases {
        let rows = golden(&case.name);
        // With all gates off after a line pulse and a vector, one phase ends and the other two go on.
        let one_ended = |row: &&[f64; 4]| {
            let off = (1450e-6..1750e-6).contains(&row[0]) || row[0] > 2050e-6;
            let resting = row[1..].iter().filter(|i| rests(**i)).count();
            off && resting == 1 && row[1..].iter().all(|i| rests(*i) || i.abs() > 0.1)
        };
        let ended = rows.iter().filter(one_ended).count();
        assert!(ended >= 30, "{}: {ended}", case.name);
        // Between the vectors everything comes to rest.
        assert!(rows.iter().filter(|row| row[1..].iter().all(|i| rests(*i))).count() >= 20, "{}", case.name);
        assert!((0..3).all(|phase| sign_changes(&rows, phase) >= 1), "{}", case.name);
    }
}

/// promise: circuits
#[test]
fn cross_pwm_against_ngspice() {
    let cases: Vec<Spice> = ["turning_", "opened_"].into_iter().flat_map(compared).collect();
    assert_eq!(cases.len(), 3);
    for case in cases {
        let rows = golden(&case.name);
        assert!(case.timing.dead_time == Nanos::from_micros(2));
        assert!((0..3).all(|phase| sign_changes(&rows, phase) >= 2), "{}", case.name);
        // Opened legs come to rest, alone and together.
        let resting = |legs: usize| {
            rows.iter().filter(|row| row[1..].iter().filter(|i| rests(**i)).count() == legs).count()
        };
        if case.name.starts_with("opened_") {
            assert!(resting(1) > 10 && resting(3) > 10, "{}: {} {}", case.name, resting(1), resting(3));
        }
        // The dead time matters: without it the run differs.
        let without = Spice { timing: GateTiming::default(), ..case };
        assert!(without.deviation(OpenLeg::Diodes) > 30.0 * BOUND);
    }
}

/// promise: circuits
#[test]
fn cross_terminals_with_a_capacitance_against_ngspice() {
    let cases = compared("charged_");
    assert_eq!(cases.len(), 5);
    for case in cases {
        // Without it, and with a twentieth more, the run differs.
        for share in [0.0, 1.05] {
            let other = Spice { capacitance: share * case.capacitance, ..case.clone() };
            assert!(other.deviation(OpenLeg::Diodes) > 5.0 * BOUND, "{}: {share}", other.name);
        }
    }
}

/// promise: circuits
#[test]
fn cross_terminals_whose_ringing_is_damped_against_ngspice() {
    let cases = compared("damped_");
    assert_eq!(cases.len(), 4);
    for case in cases {
        // Without the resistance, and with a tenth more, the run differs.
        for share in [0.0, 1.1] {
            let other = Spice { resistance: share * case.resistance, ..case.clone() };
            let worst = other.deviation(OpenLeg::Diodes);
            println!("{} {share}: {worst:.1e}", other.name);
            assert!(worst > 5.0 * BOUND, "{}: {share}", other.name);
        }
    }
}

/// promise: circuits
#[test]
fn cross_shorted_turns_against_ngspice() {
    let cases = compared("shorted_");
    assert_eq!(cases.len(), 7);
    for case in cases {
        // Without the short, and in the next phase, the run differs.
        let Some(Broken::Shorted(phase, of)) = case.short else { panic!("{}: no short", case.name) };
        for short in [None, Some(Broken::Shorted((phase + 1) % 3, of))] {
            let worst = Spice { short, ..case.clone() }.deviation(OpenLeg::Diodes);
            assert!(worst > 10.0 * BOUND, "{}: {worst:e} with {short:?}", case.name);
        }
    }
}

/// promise: circuits
#[test]
fn cross_mosfets_against_ngspice() {
    let cases = compared("mosfet_");
    assert_eq!(cases.len(), 3);
    for case in cases {
        // With the body diode beside the gated channel, as in an IGBT, the run differs.
        let igbts = Devices { kind: DeviceKind::Igbt, ..case.devices };
        let deviation = Spice { devices: igbts, ..case }.deviation(OpenLeg::Diodes);
        assert!(deviation > 30.0 * BOUND, "{deviation}");
    }
}

#[test]
fn cross_gate_edges_are_those_of_the_netlists_for_ngspice() {
    for case in cases() {
        let (ours, theirs) = (case.edges(), case.edges_of_netlist());
        for (ours, theirs) in ours.iter().zip(&theirs) {
            assert_eq!(ours.len(), theirs.len(), "{}: {ours:?} {theirs:?}", case.name);
            for (ours, theirs) in ours.iter().zip(theirs) {
                assert!(
                    ours.1 == theirs.1 && (ours.0 - theirs.0).abs() < 0.01,
                    "{}: {ours:?} {theirs:?}",
                    case.name
                );
            }
        }
        // Samples keep clear of the edges, so that a current is never read where its slope jumps.
        for row in golden(&case.name) {
            let nearest =
                ours.iter().flatten().map(|(edge, _)| (edge - row[0] * 1e9).abs()).fold(1e9, f64::min);
            assert!(nearest > 199.0, "{}: edge {nearest} ns from the sample at {} s", case.name, row[0]);
        }
    }
}

/// promise: circuits
#[test]
fn cross_no_case_of_ngspice_is_left_out() {
    let named: Vec<String> = cases().into_iter().map(|case| case.name).collect();
    for ending in ["cir", "csv"] {
        let files = std::fs::read_dir(folder()).expect("folder").map(|entry| entry.expect("entry").path());
        let mut found: Vec<PathBuf> =
            files.filter(|path| path.extension().is_some_and(|extension| extension == ending)).collect();
        found.sort();
        let mut expected: Vec<PathBuf> =
            named.iter().map(|name| folder().join(name).with_extension(ending)).collect();
        expected.sort();
        assert_eq!(found, expected);
    }
    // The tests above go by the beginning of the name; motors are fitted to `pulses_` in crates/fit/tests/fit.rs.
    let known = [
        "slow_", "fast_", "vectors_", "turning_", "opened_", "mosfet_", "pulses_", "charged_", "damped_",
        "sensed_", "shorted_",
    ];
    assert!(named.iter().all(|name| known.iter().any(|known| name.starts_with(known))), "{named:?}");
}

#[test]
fn cross_peaks_of_an_earlier_ngspice_run() {
    // Near-ideal devices of another netlist of the same circuit: peaks in A after pulses of 80 µs, 2.4 ms apart.
    let expected = [1.336_48, 2.488_85, 3.484_52];
    let all = cases();
    let case = all.iter().find(|case| case.name == "slow_ab_043_ideal").expect("the same circuit");
    let at_the_peak =
        |command: &Command<f64>| Command { sampling: Sampling::once(Nanos::from_micros(80)), ..*command };
    let mut script = Script::new(case.commands.iter().map(at_the_peak).collect::<Vec<_>>());
    let inverter = case.inverter(OpenLeg::Diodes);
    run(&exact_case(&case.motor, inverter, case.angle_deg), &mut script, false, &mut NoProbe);
    assert_eq!(script.readings.len(), expected.len());
    for (reading, expected) in script.readings.iter().zip(expected) {
        let peak = reading.current[Phase::A];
        assert!((peak / expected - 1.0).abs() < 5e-4, "{peak} against {expected}");
    }
}
