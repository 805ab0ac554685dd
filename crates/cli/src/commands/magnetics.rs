//! `standstill magnetics`: a survey of a motor's or a flux map's inductances over current.

mod json;
mod text;

use std::path::Path;

use standstill_plant::{
    Continuation, Core, Files, FluxMap, MagneticCircuit, MapAxes, MapLayout, MapReport, MapSamples,
    PolaritySignature, Survey,
};
use standstill_quantity::short;
use standstill_scenario::doubts::of_sheet;

use crate::answer::{Answer, Made};
use crate::arguments::Magnetics;
use crate::error::Error;
use crate::shell::asked::NotedQuestion;
use crate::shell::command_line::quoted;
use crate::shell::terminal::tell;
use crate::shell::{Report, interrupt};

/// Number of equal steps from zero to the largest current.
const STEPS: u16 = 10;

/// The subject of a survey: a motor, or a flux map without a motor.
struct Subject {
    name: String,
    magnetics: MagneticCircuit,
    /// Default of the largest current in A.
    reach: f64,
    pole_pairs: Option<u32>,
    resistance: Option<f64>,
    map: Option<(FluxMap, MapReport)>,
}

impl Subject {
    fn read(options: &Magnetics) -> Result<Self, Error> {
        let path = Path::new(&options.motor);
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        if MapSamples::EXTENSIONS.contains(&extension.to_lowercase().as_str()) {
            return Self::map(path, options);
        }
        if options.pole_pairs.is_some() || options.resistance.is_some() {
            let message =
                "--pole-pairs and --resistance are for flux maps; a data sheet states them itself".to_owned();
            return Err(Error::Arguments(message));
        }
        if options.values.is_some() || options.columns.is_some() || options.beyond.is_some() {
            let message =
                "--values, --columns and --beyond are for flux maps; a data sheet states them in [map]"
                    .to_owned();
            return Err(Error::Arguments(message));
        }
        let sheet = super::sheet(&options.motor)?;
        let map = sheet.map().map_err(Error::Map)?;
        let motor = sheet.motor().map_err(Error::Motor)?.at_temperature(options.temperature.into())?;
        for doubt in of_sheet(&motor) {
            tell(&format!("warning: {}: {doubt}", motor.name));
        }
        let covered = motor.magnetics.range().map_or(f64::INFINITY, covered);
        Ok(Self {
            name: motor.name,
            magnetics: motor.magnetics,
            reach: motor.rated_current.min(covered),
            pole_pairs: Some(motor.pole_pairs),
            resistance: Some(motor.resistance),
            map,
        })
    }

    fn map(path: &Path, options: &Magnetics) -> Result<Self, Error> {
        let temperature = options.temperature;
        if temperature.winding_temperature.is_some() || temperature.magnet_temperature.is_some() {
            let message =
                "a flux map has no temperature coefficients; put it into a data sheet with [thermal]"
                    .to_owned();
            return Err(Error::Arguments(message));
        }
        let layout = MapLayout { values: options.values, columns: options.columns.clone() };
        let samples = MapSamples::read_as(path, &Files::default(), &layout).map_err(Error::Map)?;
        let made = if options.beyond.is_some() { FluxMap::continued } else { FluxMap::new };
        let (map, report) = made(&samples).map_err(Error::Map)?;
        let reach = covered(report.range);
        if reach <= 0.0 {
            let [along_d, along_q] =
                report.range.map(|[low, high]| format!("{} to {} A", short(low), short(high)));
            let [_, [q_low, q_high]] = report.range;
            let message = format!(
                "{}: found i_d from {along_d}, i_q from {along_q}; needed: current to both sides of zero along d and q, as a detection drives it{}",
                report.file,
                if options.beyond.is_none() && q_high.min(-q_low) > 0.0 {
                    "; or --beyond fitted (in a data sheet: beyond = \"fitted\" in [map]), which continues it along d"
                } else {
                    ""
                }
            );
            return Err(Error::Arguments(message));
        }
        Ok(Self {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            magnetics: MagneticCircuit::new(Core::Map(map.clone())).map_err(Error::Magnetics)?,
            reach,
            pole_pairs: options.pole_pairs.or(samples.pole_pairs),
            resistance: options.resistance.or(samples.resistance),
            map: Some((map, report)),
        })
    }
}

/// Returns the largest current in A that a flux map covers in all four directions: +d, −d, +q and −q. The arguments are the ranges of i_d
/// and i_q.
fn covered([[d_low, d_high], [q_low, q_high]]: [[f64; 2]; 2]) -> f64 {
    (-d_low).min(d_high).min(-q_low).min(q_high)
}

pub fn run(options: &Magnetics) -> Result<Report, Error> {
    interrupt::at_once();
    let subject = Subject::read(options)?;
    let reach = options.current.unwrap_or(subject.reach);
    if let (Some((_, map)), Some(range)) = (&subject.map, subject.magnetics.range()) {
        let most = covered(range);
        if reach > most * (1.0 + 1e-9) {
            let [[d_low, d_high], [q_low, q_high]] = range.map(|ends| ends.map(short));
            // The largest covered current with six digits, rounded down if the rounded value would lie beyond the map.
            let nearest = short(most);
            let beyond = nearest.parse::<f64>().is_ok_and(|nearest| nearest > most * (1.0 + 1e-9));
            let most = if beyond { short(most * (1.0 - 5e-6)) } else { nearest };
            let message = format!(
                "--current {reach}: the map {} covers i_d from {d_low} to {d_high} A, i_q from {q_low} to {q_high} A; needed: at most {most} A",
                map.file
            );
            return Err(Error::Arguments(message));
        }
    }
    let uncertainty = subject.map.as_ref().map_or(0.0, |(_, map)| map.distance[0]);
    let mut survey = Survey::of(&subject.magnetics, reach, STEPS, uncertainty).map_err(Error::Magnetics)?;
    if let Some((_, map)) = &subject.map {
        // The reciprocity error of the file's data, not of the map fitted to them.
        survey.reciprocity_error = map.reciprocity_error;
        if map.axes == MapAxes::NoMagnet {
            // Without a magnet both poles are alike; a difference between them is noise of the map.
            survey.signature = PolaritySignature::None;
        }
    }
    let asked = NotedQuestion::new("magnetics", subject.name.clone(), &survey, options.force.force);
    let answer = Answer { json: json::of(&subject, &survey), ..text::of(&subject, &survey) };
    let answer =
        if subject.map.is_none() || Path::new(&options.motor).extension().is_some_and(|end| end == "toml") {
            let motor = quoted(&options.motor);
            answer.next(
                "which method finds this motor's rotor, with which pulses",
                format!("standstill check {motor}"),
            )
        } else {
            // A data sheet needs these options as keys of [map], which `init` does not write.
            let is_plain = options.values.is_none() && options.columns.is_none() && options.beyond.is_none();
            let map = if is_plain { format!(" --map {}", quoted(&options.motor)) } else { String::new() };
            answer.next(
                "a data sheet to fill in, whose [map] names this file (docs/own-motor-map.md)",
                format!("standstill init --motor mine.toml{map}"),
            )
        };
    let folder = (!options.json).then(|| options.out.clone());
    answer.report(folder, options.json, &Made { asked: Some(asked), ..Made::default() })
}

/// Returns the standard errors of L_dd, L_dq and L_qq in H. `current` has i_d and i_q in A, on one of the axes. NaN if the current is
/// outside the measured range. None if the inductances do not come from a flux map. The magnet temperature changes the operating point on
/// the map, but not the accuracy of the map.
fn standard_errors(subject: &Subject, current: [f64; 2]) -> Option<[f64; 3]> {
    let (_, map) = subject.map.as_ref()?;
    // The accuracy of the continued part of a map is not known.
    let beyond =
        |continued: &Continuation| current[0] < continued.measured[0] || current[0] > continued.measured[1];
    if map.continued.as_deref().is_some_and(beyond) {
        return Some([f64::NAN; 3]);
    }
    Some(map.errors.at(current))
}

/// Returns the largest current of the survey in A.
fn reach(survey: &Survey) -> f64 {
    survey.polarity.last().map_or(0.0, |point| point.current)
}

/// Returns L_d and L_q in H as an infinitely short pulse measures them. Eddy currents reduce these values. None for a motor without eddy
/// currents.
fn short_pulse(subject: &Subject, survey: &Survey) -> Option<[f64; 2]> {
    let branch = subject.magnetics.eddy_currents()?;
    Some([survey.l_dd * (1.0 - branch.d_depth), survey.l_qq * (1.0 - branch.q_depth)])
}
