//! The answer of a trace: the result of one start's detection, the events during it, and the specimen that was drawn
//! for it.

use serde_json::json;
use standstill_interface::Abc;
use standstill_report::page::{Block, Tone};
use standstill_scenario::{Plan, Record, Scenario, ScenarioFile, Single, Verdict};
use standstill_sim::{Ledger, Run, Trace};

use super::verify::NumericalError;
use super::{instant, shorthands, specimen, trial_of};
use crate::answer::{Answer, verdict};
use crate::arguments::{Seed, Trace as Options};
use crate::commands::question::{Identity, given, setting};
use crate::commands::waveforms;
use crate::error::Error;

/// A trial with its scenario, its result, and its randomly drawn parameters.
pub struct Traced<'a> {
    pub options: &'a Options,
    pub plan: &'a Plan,
    pub single: &'a Single,
    pub file: &'a ScenarioFile,
    pub identity: &'a Identity,
    pub record: &'a Record,
    /// The run of the same trial with its energy balance (ledger) and its numerical work.
    pub watched: &'a Run<f64>,
    pub verified: Option<&'a NumericalError>,
}

impl Traced<'_> {
    /// Returns the answer with the figure of a trace.
    pub fn answer(&self, trace: &Trace) -> Result<Answer, Error> {
        let Self { options, plan, single, file, record, watched, .. } = *self;
        let tone = match record.verdict() {
            Verdict::Found if record.pole_correct() == Some(false) => Tone::Bad,
            Verdict::Found => Tone::Good,
            Verdict::Undetermined => Tone::Warning,
            Verdict::Failed | Verdict::Error => Tone::Bad,
        };
        let place = specimen::heading(plan, single);
        let headline =
            format!("{}, rotor at {:.3}°: {}", place.trim_end(), record.true_angle_deg(), record.in_words(3));
        let drawn = single.in_words();
        let mut blocks = vec![Block::Text("Drawn for this trial:".to_owned()), Block::Facts(drawn)];
        blocks.extend(self.verified.map(|error| Block::Text(error.text())));
        let mut result = self.json()?;
        result["error_at_instant_deg"] = record.error_at_instant_deg().into();
        let files = vec![("result.json", format!("{result:#}\n").into_bytes())];
        let said = setting(file, &single.scenario);
        let figure = waveforms(trace, &title(file, record, options), &said, &single.scenario, record);
        let mut lines = details(record, watched);
        lines.extend(instant::detail(record));
        let verdict = verdict(tone, headline, lines);
        let title = format!("One start: {}", trial_of(options));
        let code = u8::from(record.verdict() == Verdict::Error);
        let answer = Answer::new("trace", title, said, verdict, blocks).with(
            "waveform",
            figure,
            "Drag to zoom; the legend hides and shows.",
        );
        let answer = Answer { json: result, files, code, ..answer };
        Ok(answer.next("many starts like this one", format!("standstill run {}", self.again())))
    }

    /// Returns the arguments of `standstill run` that describe the traced scenario: the scenario, the keys, and the options.
    fn again(&self) -> String {
        let Self { options, file, .. } = *self;
        let (keys, seed) = (&options.source.keys, Seed::default());
        if let Some(scenario) = &options.source.scenario {
            return given(&scenario.to_string_lossy(), keys, seed) + &shorthands(options).as_keys(None);
        }
        let motor = options.setup.motor.as_deref().unwrap_or("paper-5k5");
        let again = given(motor, keys, seed) + &shorthands(options).as_keys(Some("motor"));
        // Without a scenario `trace` uses the paper's method, but `run` does not, so the method is named.
        let named = again.contains("detector.");
        if named { again } else { again + " -s detector.method=" + file.detector.name() }
    }

    /// Returns the whole answer as JSON.
    fn json(&self) -> Result<serde_json::Value, Error> {
        let Self { plan, single, identity, .. } = *self;
        let mut json = result(self.file, &single.scenario, self.record, self.watched);
        json["version"] = identity.of.version.as_str().into();
        json["numerics"] = identity.of.numerics.into();
        json["scenario"] = plan.text()?.into();
        json["point"] = specimen::point_json(plan, single.point);
        json["trial"] = single.trial.into();
        json["specimen"] = specimen::json(&single.case(), &single.drawn);
        if let Some(error) = self.verified {
            json["numerical_error"] = error.json();
        }
        Ok(json)
    }
}

/// Returns the figure's title.
fn title(file: &ScenarioFile, record: &Record, options: &Options) -> String {
    let angle = match file.rotor.angle {
        Some(angle) => angle.value().to_string(),
        None => format!("{:.3}", record.start_angle_deg()),
    };
    format!("{}, rotor at {angle}°", trial_of(options))
}

/// Returns lines on the detection's duration, currents and numerical work.
fn details(record: &Record, watched: &Run<f64>) -> Vec<String> {
    let work = watched.work;
    vec![
        format!(
            "rotor moved {:.3}°, detection took {:.1} ms, largest phase current {:.2} A",
            record.rotor_moved_deg(),
            record.run.duration.seconds() * 1e3,
            record.run.peak_current,
        ),
        format!(
            "{} evaluations of the core, {} steps, {} segments, {} events; energy balance closes to {:.1e} J",
            work.derivatives,
            work.steps,
            work.segments,
            work.events,
            watched.ledger.map_or(0.0, |ledger| ledger.imbalance()),
        ),
    ]
}

/// Returns the results of the detection, its measurements and the energies as JSON.
pub fn result<S>(
    file: &ScenarioFile,
    scenario: &Scenario<S>,
    record: &Record,
    watched: &Run<f64>,
) -> serde_json::Value {
    let run: &Run<f64> = &record.run;
    let lines = |abc: Abc<f64>, factor: f64| {
        let Abc([ab, bc, ca]) = abc;
        json!({ "ab": ab * factor, "bc": bc * factor, "ca": ca * factor })
    };
    let f = record.findings();
    json!({
        "setup": crate::commands::setup_json(file, &scenario.motor),
        "method": file.detector.name(),
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
        "line_inductance_mH": f.line_inductance.map(|l| lines(l, 1e3)),
        "line_resistance_ohm": f.line_resistance.map(|r| lines(r, 1.0)),
        "L_A_mH": f.mean_inductance.map(|l| l * 1e3),
        "L_B_mH": f.saliency.map(|l| l * 1e3),
        "i_d_along_A": f.polarity.map(|p| p.along),
        "i_d_against_A": f.polarity.map(|p| p.against),
        "age_s": f.age,
        "angle_deviation_deg": f.angle_deviation.map(f64::to_degrees),
        "pole_error_probability": f.pole_error,
        "pole_evidence_deviations": f.pole_evidence.map(|e| e.deviations),
        "pole_evidence_needed": f.pole_evidence.map(|e| e.needed),
        "sensor_gain": f.sensor_gain.map(|g| g.0),
        "polarity_margin_A": f.polarity.map(|p| p.margin()),
        "energy_J": watched.ledger.as_ref().map(energies),
        "right_hand_sides": watched.work.derivatives,
    })
}

/// Returns the energy balance of a run, in J, as JSON.
fn energies(ledger: &Ledger) -> serde_json::Value {
    let mut json = json!(ledger);
    json["imbalance"] = ledger.imbalance().into();
    json
}
