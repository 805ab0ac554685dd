//! Faults that change a number of the trial, of the motor or of the drive's knowledge: which one, and to what.

use standstill_detect::{Nameplate, Signature};
use standstill_inverter::Storage;
use standstill_numeric::Heading;

use super::*;

/// Scenarios without and with a fault of a size, beside further keys.
fn pair(keys: &str, mode: FaultMode, size: &str) -> [Scenario<Method<f64>>; 2] {
    let size = if size.is_empty() { String::new() } else { format!("magnitude = {size}\n") };
    let broken = format!("{keys}[[faults]]\nmode = \"{}\"\n{size}", mode.name());
    [scenario(keys), scenario(&broken)]
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found}, not {expected}");
}

/// A drive with all parts; ideal sensors would lack some of them.
const DRIVE: &str = "errors = \"field\"\n[detector]\nmethod = \"bipolar\"\n";

#[test]
fn analytic_a_wrong_sheet_changes_the_numbers_that_it_names_and_no_motor() {
    let sheet = |mode, size| {
        let [whole, broken] = pair(DRIVE, mode, size);
        assert_eq!(whole.motor, broken.motor);
        let mut known: [Nameplate<f64>; 2] = [whole.nameplate(), whole.nameplate()];
        misinform(&broken.faults, &mut known[1]);
        // The method is set up by the wrong sheet.
        assert!(whole.detector != broken.detector);
        known
    };
    let [right, wrong] = sheet(FaultMode::SheetInductance, "1.5");
    near(wrong.d_axis_inductance, 1.5 * right.d_axis_inductance);
    near(wrong.q_axis_inductance, 1.5 * right.q_axis_inductance);
    // A pulse of the rated current lasts L I/V.
    assert!((wrong.rated_pulse.seconds() - 1.5 * right.rated_pulse.seconds()).abs() < 1e-9);
    let restored = Nameplate {
        d_axis_inductance: right.d_axis_inductance,
        q_axis_inductance: right.q_axis_inductance,
        rated_pulse: right.rated_pulse,
        ..wrong
    };
    assert_eq!(restored, right);
    let [right, wrong] = sheet(FaultMode::SheetResistance, "0.5");
    near(wrong.resistance, 0.5 * right.resistance);
    assert_eq!(Nameplate { resistance: right.resistance, ..wrong }, right);
    let [right, wrong] = sheet(FaultMode::SheetSignature, "");
    assert_eq!([right.signature, wrong.signature], [Signature::Normal, Signature::Inverted]);
    let restored = Nameplate { signature: right.signature, pulse_signature: right.pulse_signature, ..wrong };
    assert_eq!(restored, right);
}

/// A drive that takes the pole with less current for north names the angle half a turn away.
#[test]
fn analytic_a_wrong_signature_turns_the_answer_by_half_a_turn() {
    let base = "errors = \"none\"\nmotor = \"paper-5k5\"\n[rotor]\nangle = \"40 deg\"\n[detector]\nmethod = \"bipolar\"\n";
    for (broken, expected) in pair(base, FaultMode::SheetSignature, "").iter().zip([40.0_f64, -140.0]) {
        let found = broken.trial(0).expect("works").run.found().expect("found").to_degrees();
        let off = (found - expected + 180.0).rem_euclid(360.0) - 180.0;
        assert!(off.abs() < 0.5, "{found}, not {expected}");
    }
}

#[test]
fn analytic_a_weak_magnet_has_its_share_of_the_flux() {
    let [whole, broken] = pair(DRIVE, FaultMode::MagnetWeak, "\"20 %\"");
    near(broken.motor.magnet_flux, 0.8 * whole.motor.magnet_flux);
    let flux = |of: &Scenario<Method<f64>>| of.motor.magnetics.rest(Heading::of(0.0)).d;
    assert!((flux(&broken) / flux(&whole) - 0.8).abs() < 1e-9);
    // The drive knows the motor of the data sheet.
    assert_eq!(broken.detector, whole.detector);
}

#[test]
fn analytic_faults_of_the_inverter_have_their_size() {
    let [whole, broken] =
        pair(DRIVE, FaultMode::DeadTimeLong, "10").map(|of| of.case(3).inverter.gates.map(|of| of.dead_time));
    for (whole, broken) in whole.into_iter().zip(broken) {
        assert!(whole > Nanos::ZERO && broken.0.abs_diff(10 * whole.0) <= 10, "{broken:?} {whole:?}");
    }
    let keys = format!("{DRIVE}[inverter]\ncapacitance = \"500 uF\"\nsource_resistance = \"0.2 ohm\"\n");
    let storage =
        |mode, size| pair(&keys, mode, size).map(|of| of.case(3).inverter.link.storage.expect("a capacitor"));
    let [whole, broken] = storage(FaultMode::LinkCapacitorAged, "\"25 %\"");
    near(broken.capacitance, 0.25 * 500e-6);
    assert_eq!(Storage { capacitance: whole.capacitance, ..broken }, whole);
    let [whole, broken] = storage(FaultMode::SupplyWeak, "\"40 ohm\"");
    near(broken.source_resistance, 40.0);
    assert_eq!(Storage { source_resistance: whole.source_resistance, ..broken }, whole);
    let most =
        pair(&keys, FaultMode::SupplyLimited, "\"2 A\"").map(|of| of.case(3).inverter.link.most_current);
    assert_eq!(most, [None, Some(2.0)]);
}

#[test]
fn analytic_faults_of_sensors_and_software_have_their_size() {
    let slow = DRIVE.to_owned() + "[sensors]\nbandwidth = \"200 kHz\"\n";
    let [whole, broken] = pair(&slow, FaultMode::CurrentSlow, "\"10 %\"").map(|of| of.case(3).sensors.corner);
    let slower = (0..3).filter(|k| whole[*k] != broken[*k]).collect::<Vec<_>>();
    assert_eq!(slower.len(), 1, "one sensor");
    near(broken[slower[0]], 0.1 * whole[slower[0]]);
    let [whole, broken] =
        pair(DRIVE, FaultMode::SampleLate, "\"3 us\"").map(|of| of.case(3).sensors.settings.sample_delay);
    assert_eq!(broken, whole + Nanos(3000));
    // A clock that is slow by 20 % counts 80 ticks where there should be 100: each is 1.25 times as long.
    let timed = "[sensors]\narrangement = \"none\"\ntimer = \"0.1 us\"\n[detector]\nmethod = \"six-pulse\"\n";
    let [whole, broken] =
        pair(timed, FaultMode::TimerOff, "\"20 %\"").map(|of| of.case(3).sensors.comparator.tick);
    near(broken, 1.25 * whole);
    let broken = |keys: &str, mode, size| {
        let [_, scenario] = pair(keys, mode, size);
        let case = scenario.case(3);
        let [fault] = case.faults.iter().collect::<Vec<_>>()[..] else { panic!("one") };
        assert_eq!(fault, standstill_sim::Fault::lasting(fault.broken));
        (fault.broken, case.inverter.carrier_period)
    };
    let (late, period) = broken(DRIVE, FaultMode::CommandLate, "");
    assert_eq!(late, Broken::Late(period));
    assert_eq!(broken(DRIVE, FaultMode::DutyLimited, "\"40 %\"").0, Broken::Duty(0.4));
    assert_eq!(broken(DRIVE, FaultMode::SampleLost, "").0, Broken::Stale);
    assert_eq!(broken(timed, FaultMode::ComparatorStuck, "").0, Broken::Deaf);
}
