//! What a shunt in the DC link and dividers at the terminals see, against ngspice's potentials and link current.

use standstill_interface::{Nanos, Reading};
use standstill_inverter::OpenLeg;
use standstill_sim::{Arrangement, NoProbe, TerminalSensor, run};

use super::cases::{Spice, cases, folder};
use super::{BOUND, exact_case};
use crate::bench::Script;

/// Times in s, phase currents in A, potentials of the terminals in V and the link's current in A of a golden file.
fn golden(name: &str) -> Vec<[f64; 8]> {
    let mut reader = csv::Reader::from_path(folder().join(format!("{name}.csv"))).expect("golden file");
    reader.deserialize().map(|row| row.expect("golden row")).collect()
}

/// Readings of a drive with dividers and a shunt in the DC link, each with its time since the start in s.
fn readings(case: &Spice) -> Vec<(f64, Reading<f64>)> {
    let mut script = Script::new(case.commands.clone());
    let mut of = exact_case(&case.motor, case.inverter(OpenLeg::Diodes), case.angle_deg);
    of.sensors.settings.arrangement = Arrangement::DcLinkShunt;
    of.sensors.settings.terminal = Some(TerminalSensor { resistance: case.load, ..TerminalSensor::IDEAL });
    run(&of, &mut script, false, &mut NoProbe);
    let mut readings = script.readings.iter();
    let mut start = Nanos::ZERO;
    let mut rows = Vec::new();
    for command in &case.commands {
        let count = command.sampling.count as usize;
        rows.extend(readings.by_ref().take(count).map(|reading| ((start + reading.at).seconds(), *reading)));
        start = start + command.duration();
    }
    rows
}

/// Largest deviations of the potentials as a share of the link, and of the link's current as a share of the largest current.
fn deviations(case: &Spice) -> [f64; 2] {
    let (golden, ours) = (golden(&case.name), readings(case));
    assert_eq!(golden.len(), ours.len(), "{}: every row is compared", case.name);
    let peak = golden.iter().flat_map(|row| &row[1..4]).fold(0.0_f64, |peak, i| peak.max(i.abs()));
    let [mut volts, mut amps] = [0.0_f64; 2];
    for (theirs, (time, ours)) in golden.iter().zip(&ours) {
        assert!((theirs[0] - time).abs() < 1e-9, "{}: {theirs:?} {ours:?}", case.name);
        for (theirs, ours) in theirs[4..7].iter().zip(ours.terminal.0) {
            volts = volts.max((theirs - ours).abs() / 550.0);
        }
        // A reading leaves out what flows through the shunt to the dividers of terminals at the upper rail.
        let upper = theirs[4..7].iter().filter(|volts| **volts > 549.0);
        let taken = case.load.map_or(0.0, |load| upper.sum::<f64>() / load);
        amps = amps.max((theirs[7] - taken - ours.link_current).abs() / peak);
    }
    [volts, amps]
}

#[test]
fn cross_what_shunt_and_dividers_see_against_ngspice() {
    let cases: Vec<Spice> = cases().into_iter().filter(|case| case.name.starts_with("sensed_")).collect();
    assert_eq!(cases.len(), 4);
    for case in &cases {
        let [volts, amps] = deviations(case);
        println!("{:22} {volts:.1e} of 550 V, {amps:.1e} of the largest current", case.name);
        assert!(volts < 5e-4 && amps < BOUND, "{}: {volts:e} {amps:e}", case.name);
        // The current has both signs: drawn from the link, and returned by diodes. A terminal that floats is at no rail.
        let rows = golden(&case.name);
        assert!(rows.iter().any(|row| row[7] > 0.1) && rows.iter().any(|row| row[7] < -0.1), "{}", case.name);
        assert!(rows.iter().flat_map(|row| &row[4..7]).any(|volts| (50.0..500.0).contains(volts)));
        // Without its dividers, and with dividers of a twentieth more, the potentials differ.
        for load in case.load.iter().flat_map(|load| [None, Some(1.05 * load)]) {
            let other = Spice { load, ..case.clone() };
            assert!(deviations(&other)[0] > 5e-3, "{}: {load:?}", case.name);
        }
        // With a tenth more capacitance the potentials differ.
        let other = Spice { capacitance: 1.1 * case.capacitance, ..case.clone() };
        assert!(deviations(&other)[0] > 1e-3, "{}", case.name);
    }
}
