//! `standstill trace`.

mod verify;

use serde_json::json;
use standstill_campaign::{Record, Scenario, Specimen, Verdict};
use standstill_detect::{MethodName, Settings};
use standstill_interface::Abc;
use standstill_sim::{Ended, Run, Trace, run as simulate};

use crate::Report;
use crate::arguments::Trace as Options;
use crate::columns;
use crate::commands::{scenario, scenario_of};
use crate::error::Error;
use crate::figures;
use crate::interrupt;
use crate::output::Output;

/// Time in s between two rows of `waveform.csv` at most; instants have rows of their own.
const RESOLUTION: f64 = 5e-6;

pub fn run(options: &Options) -> Result<Report, Error> {
    interrupt::at_once();
    match options.method {
        None => trace(options, &scenario(&options.setup)?),
        Some(method) => trace(options, &scenario_of(&options.setup, method)?),
    }
}

fn trace<S: Settings<f64>>(options: &Options, scenario: &Scenario<S>) -> Result<Report, Error> {
    let mut names = vec!["waveform.csv", "events.csv", "result.json", "waveform.svg", "waveform.png"];
    names.extend(options.verify.then_some("verify.csv"));
    let mut output = Output::create(&options.out, &names)?;

    let mut detector = scenario.detector.detector()?;
    let case = scenario.case_at(options.angle.to_radians(), Specimen { drive: 0, noise: 0 });
    let mut trace = Trace::new(RESOLUTION);
    let run = simulate(&case, &mut detector, true, &mut trace);
    let record = Record { trial: 0, run };

    for (name, write) in [
        ("waveform.csv", columns::waveform as fn(&Trace, &mut _) -> std::io::Result<()>),
        ("events.csv", columns::events),
    ] {
        let mut file = output.begin(name)?;
        write(&trace, &mut file).map_err(Error::writing(&options.out.join(name)))?;
        output.close(name, file)?;
    }
    let verified = options.verify.then(|| verify::numerical_error(scenario, options.angle)).transpose()?;
    let mut result = result(options, scenario, &record);
    if let Some(error) = &verified {
        result["numerical_error"] = error.json();
        output.file("verify.csv", error.csv().as_bytes())?;
    }
    output.file("result.json", format!("{result:#}\n").as_bytes())?;
    let method = options.method.map_or_else(String::new, |method| format!(", {method}"));
    let title = format!("{} at θ = {}°{method}", scenario.motor.name, options.angle);
    let figure = figures::detection(&trace, &title);
    output.file("waveform.svg", figure.svg()?.as_bytes())?;
    output.file("waveform.png", &figure.png()?)?;
    let files = output.finish()?;

    let verified = verified.map_or_else(String::new, |error| error.text());
    let text =
        format!("{}{verified}\n{}", summary(&record), super::reproduce::file_list(&options.out, &files));
    Ok(Report { text, code: u8::from(record.verdict() == Verdict::Error) })
}

fn summary(record: &Record) -> String {
    let found = match (record.estimated_angle_deg(), record.error_deg()) {
        (Some(angle), Some(error)) => format!("found {angle:.3}°, error {error:+.3}°"),
        _ => format!("{}: {}", record.verdict().name(), record.reason()),
    };
    let work = record.run.work;
    format!(
        "rotor at {:.3}°: {found}\nrotor moved {:.3}°, detection took {:.1} ms, largest phase current {:.2} A\n\
         {} right-hand sides, {} steps, {} segments, {} events; energy balance closes to {:.1e} J\n",
        record.true_angle_deg(),
        record.rotor_moved_deg(),
        record.run.duration.seconds() * 1e3,
        record.run.peak_current,
        work.derivatives,
        work.steps,
        work.segments,
        work.events,
        record.run.ledger.map_or(0.0, |ledger| ledger.imbalance()),
    )
}

fn result<S>(options: &Options, scenario: &Scenario<S>, record: &Record) -> serde_json::Value {
    let run: &Run<f64> = &record.run;
    let lines = |abc: Abc<f64>, factor: f64| {
        let Abc([ab, bc, ca]) = abc;
        json!({ "ab": ab * factor, "bc": bc * factor, "ca": ca * factor })
    };
    let findings = match run.ended {
        Ended::Outcome(outcome) => Some(*outcome.findings()),
        Ended::Error(_) => None,
    };
    json!({
        "setup": super::setup_json(&options.setup, scenario),
        "method": options.method.map(MethodName::name),
        "start_angle_deg": record.start_angle_deg(),
        "true_angle_deg": record.true_angle_deg(),
        "resolver_angle_deg": run.resolver_angle.to_degrees().rem_euclid(360.0),
        "outcome": record.verdict().name(),
        "reason": record.reason(),
        "estimated_angle_deg": record.estimated_angle_deg(),
        "axis_deg": record.axis_deg(),
        "error_deg": record.error_deg(),
        "pole_correct": record.pole_correct(),
        "rotor_moved_deg": record.rotor_moved_deg(),
        "duration_s": run.duration.seconds(),
        "peak_current_A": run.peak_current,
        "line_inductance_mH": findings.and_then(|f| f.line_inductance).map(|l| lines(l, 1e3)),
        "line_resistance_ohm": findings.and_then(|f| f.line_resistance).map(|r| lines(r, 1.0)),
        "L_A_mH": findings.and_then(|f| f.mean_inductance).map(|l| l * 1e3),
        "L_B_mH": findings.and_then(|f| f.saliency).map(|l| l * 1e3),
        "i_d_along_A": findings.and_then(|f| f.polarity).map(|p| p.along),
        "i_d_against_A": findings.and_then(|f| f.polarity).map(|p| p.against),
        "angle_deviation_deg": findings.and_then(|f| f.angle_deviation).map(f64::to_degrees),
        "pole_error_probability": findings.and_then(|f| f.pole_error),
        "pole_evidence_deviations": findings.and_then(|f| f.pole_evidence).map(|e| e.deviations),
        "pole_evidence_needed": findings.and_then(|f| f.pole_evidence).map(|e| e.needed),
        "sensor_gain": findings.and_then(|f| f.sensor_gain).map(|g| g.0),
        "polarity_margin_A": findings.and_then(|f| f.polarity).map(|p| p.margin()),
        "energy_J": run.ledger.map(|e| json!({
            "source": e.source,
            "source_loss": e.source_loss,
            "device_loss": e.device_loss,
            "copper_loss": e.copper_loss,
            "eddy_loss": e.eddy_loss,
            "shaft_work": e.shaft_work,
            "friction_loss": e.friction_loss,
            "load_work": e.load_work,
            "impact_loss": e.impact_loss,
            "link_change": e.link_change,
            "field_change": e.field_change,
            "kinetic_change": e.kinetic_change,
            "imbalance": e.imbalance(),
        })),
        "right_hand_sides": run.work.derivatives,
    })
}
