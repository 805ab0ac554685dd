//! What is looked at in each run, and what only some runs are asked: their energies, and the referee.

use standstill_detect::{Method, Settings as _};
use standstill_interface::{Command, Detector, Reading, Step};
use standstill_scenario::{Record, Scenario};
use standstill_sim::{
    ComparatorSettings, Ended, Ledger, NoProbe, Run, RunError, SensorSettings, Sensors, Tolerance, referee,
    run,
};

use super::ask::Script;

/// Most steps of a run. A motor of 8 µH rings with terminals of 0.5 nF at 2.5 MHz: 75,000 periods in 30 ms, of some fifty steps
/// each, are four million.
const MOST_STEPS: u64 = 10_000_000;

/// Most steps of a run that the referee repeats.
const SHORT: u64 = 3000;

/// Returns an error if a run ended in a way that no run may.
pub fn over(record: &Record) -> Result<(), String> {
    let run = &record.run;
    if let Ended::Error(
        error @ (RunError::Chatter(_) | RunError::NotFinite(_) | RunError::NoStep(_) | RunError::Stuck(_)),
    ) = run.ended
    {
        let at = run.duration.seconds();
        return Err(format!("trial {}: {error} at {at} s, {:?}", record.trial, run.work));
    }
    if record.reason_name().is_some_and(|name| name.trim().is_empty()) {
        return Err(format!("trial {}: ended without a name: {run:?}", record.trial));
    }
    if run.work.steps > MOST_STEPS || run.work.segments > MOST_STEPS {
        return Err(format!("trial {}: {:?}", record.trial, run.work));
    }
    let said = format!("{run:?}");
    // Evidence without any known error of the readings is infinite, and what no evidence reaches too.
    let evidence = said.find("pole_evidence: Some(").map_or(0..0, |from| {
        let length = said[from..].find(')').unwrap_or(0);
        from..from + length
    });
    let rest = [&said[..evidence.start], &said[evidence.end..]];
    if said.contains("NaN") || rest.iter().any(|part| part.contains("inf")) {
        return Err(format!("trial {}: a number is not finite: {said}", record.trial));
    }
    Ok(())
}

/// Share of the energies that were moved by which they may miss.
const IMBALANCE: f64 = 1e-6;

/// Returns an error if the energies of a scenario's first trial do not balance.
pub fn balances(scenario: &Scenario<Method<f64>>) -> Result<(), String> {
    let mut case = scenario.case(0);
    // The usual tolerance leaves millivolts of a link's capacitor open, which are much of what pulses take from it.
    case.tolerance = Tolerance { flux: 1e-2 * scenario.tolerance.flux };
    let mut detector = scenario.detector_for(&case).map_err(|error| format!("{error:?}"))?;
    let run: Run<f64> = run(&case, &mut detector, true, &mut NoProbe);
    over(&Record { trial: 0, run })?;
    let ledger = run.ledger.ok_or("a ledger was asked for")?;
    let Ledger { source, copper_loss, device_loss, field_change, link_change, .. } = ledger;
    let Ledger { shaft_work, kinetic_change, terminal_change, friction_loss, load_work, .. } = ledger;
    // What a tolerance of the flux is in energy, at the largest current; and next to nothing of what rated current stores.
    let (winding, rated) = (&scenario.motor.winding, scenario.motor.rated_current);
    let rest = winding.d_axis_inductance().min(winding.q_axis_inductance()) * rated * rated;
    let slack = 1e2 * scenario.tolerance.flux * run.peak_current + 1e-9 * rest;
    // A link's change is the difference of two large energies.
    let link = &scenario.drive.link;
    let stored = link.storage.map_or(0.0, |of| of.capacitance * link.voltage * link.voltage / 2.0);
    let electrical =
        [source, copper_loss, device_loss, field_change, link_change, terminal_change, shaft_work, stored];
    let mechanical = [shaft_work, kinetic_change, friction_loss, load_work];
    let most = |of: &[f64]| of.iter().fold(0.0_f64, |most, next| most.max(next.abs()));
    for (kind, missing, scale) in [
        ("electrical", ledger.imbalance(), most(&electrical)),
        ("mechanical", ledger.mechanical_imbalance(), most(&mechanical)),
    ] {
        if missing.is_nan() || missing.abs() > IMBALANCE * scale + slack {
            return Err(format!(
                "{kind} energies miss by {missing:e} J of {scale:e} J (slack {slack:e} J): {ledger:?}, {:?}",
                run.ended
            ));
        }
    }
    Ok(())
}

/// Keeps each command of a detector.
pub struct Recorder<D> {
    pub detector: D,
    pub commands: Vec<Command<f64>>,
}

impl<D: Detector<f64>> Detector<f64> for Recorder<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let step = self.detector.step(readings);
        if let Step::Drive(command) = &step {
            self.commands.push(*command);
        }
        step
    }
}

/// Share of rated current, or of the largest one if that is more, by which the referee may differ.
const DIFFERENCE: f64 = 1e-5;

/// Repeats the commands of a scenario's first trial with the referee; returns false if the run is too long for it, or has no
/// reading to compare.
pub fn agrees_with_referee(scenario: &Scenario<Method<f64>>) -> Result<bool, String> {
    let mut case = scenario.case(0);
    let detector = scenario.detector.detector().map_err(|error| format!("{error:?}"))?;
    let mut recorder = Recorder { detector, commands: Vec::new() };
    let first: Run<f64> = run(&case, &mut recorder, false, &mut NoProbe);
    if first.work.steps > SHORT {
        return Ok(false);
    }
    let jitter = case.sensors.settings.jitter;
    // The first crossing of a noise depends on where it is looked at.
    let comparator = ComparatorSettings { noise: 0.0, ..case.sensors.settings.comparator };
    case.sensors = Sensors::nominal(SensorSettings { jitter, comparator, ..SensorSettings::IDEAL });
    let [mut ours, mut theirs] = [(); 2].map(|()| Script::new(recorder.commands.clone()));
    let new: Run<f64> = run(&case, &mut ours, false, &mut NoProbe);
    case.tolerance = Tolerance { flux: 1e-3 * scenario.tolerance.flux };
    let old: Run<f64> = referee(&case, &mut theirs, false, &mut NoProbe);
    let pairs = ours.readings.iter().zip(&theirs.readings);
    let worst = pairs
        .flat_map(|(a, b)| (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs()))
        .fold(0.0_f64, |worst, next| if next.is_nan() { f64::INFINITY } else { worst.max(next) });
    let scale = scenario.motor.rated_current.max(first.peak_current);
    if worst > DIFFERENCE * scale || ours.readings.len() != theirs.readings.len() {
        return Err(format!(
            "the referee's currents differ by {worst:e} A of {scale:e} A; {} and {} readings; {:?}, {:?}",
            ours.readings.len(),
            theirs.readings.len(),
            new.ended,
            old.ended
        ));
    }
    Ok(!ours.readings.is_empty())
}
