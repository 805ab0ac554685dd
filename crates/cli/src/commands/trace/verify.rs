//! The numerical error of a run, found by repeating the run with the referee, a second integrator of the same equations, at a tighter
//! tolerance.

use std::fmt::Write as _;
use std::io::Write;

use serde_json::json;
use standstill_detect::SettingsError;
use standstill_interface::Outcome;
use standstill_scenario::{Record, Single};
use standstill_sim::{Ended, Event, Run, Tolerance, Trace, referee, run};
use standstill_table::{Cell, Column, Format, Kind, Writer};

use crate::answer::TableFile;

/// Ratio of the tolerance of the reference run to the tolerance of the usual run.
const TIGHTER: f64 = 1e-3;

/// The numerical error of a run, and the quantities with which the error is compared.
pub struct NumericalError {
    /// Tolerance of the usual run in Wb.
    tolerance: f64,
    /// Samples of both runs.
    samples: Vec<Pair>,
    /// Largest difference of the sampled phase currents in A.
    current: f64,
    /// Difference of the axis angles in degrees. None unless both runs found an axis.
    angle: Option<f64>,
    /// Difference of the polarity margins in A. None unless both runs have a polarity margin.
    margin: Option<f64>,
    /// Polarity margin of the usual run in A.
    polarity_margin: Option<f64>,
    /// Noise of the current sensors in A.
    noise: f64,
}

/// One sample of both runs, with the time in s and the phase currents in A.
struct Pair {
    time: f64,
    usual: [f64; 3],
    tight: [f64; 3],
}

/// A run and its samples. Each sample contains the time in s and the phase currents in A.
type Attempt = (Run<f64>, Vec<(f64, [f64; 3])>);

/// Runs the detection twice with the same random values: as usual, and as a reference with another solver (the referee) and a tighter
/// tolerance.
///
/// Both runs omit the A/D converters. Converters would round the two currents to equal or to neighbouring codes and so hide the error.
pub fn numerical_error(single: &Single) -> Result<NumericalError, SettingsError> {
    let scenario = &single.scenario;
    let attempt = |tolerance: Tolerance, refereed: bool| -> Result<Attempt, SettingsError> {
        let mut case = single.case();
        case.tolerance = tolerance;
        case.sensors.settings.adc = None;
        case.sensors.settings.dc_link.adc = None;
        // Only the samples of the trace are needed.
        let mut trace = Trace::new(f64::INFINITY);
        let mut detector = scenario.detector_for(&case)?;
        let by = if refereed { referee } else { run };
        let run = by(&case, &mut detector, false, &mut trace);
        let samples = trace.events.iter().filter_map(|(time, event)| match event {
            Event::Sample(reading) => Some((*time, reading.current.0)),
            _ => None,
        });
        Ok((run, samples.collect()))
    };
    let usual = scenario.tolerance;
    let (run, samples) = attempt(usual, false)?;
    let (tight_run, tight) = attempt(Tolerance { flux: usual.flux * TIGHTER }, true)?;
    let pair = |((time, usual), (_, tight))| Pair { time, usual, tight };
    let samples: Vec<Pair> = samples.into_iter().zip(tight).map(pair).collect();
    let errors = samples.iter().flat_map(Pair::error);
    let current = errors.map(f64::abs).fold(0.0, f64::max);
    let margin = |run: &Run<f64>| match run.ended {
        Ended::Outcome(Outcome::Found { findings, .. } | Outcome::Axis { findings, .. }) => {
            findings.polarity.map(|polarity| polarity.margin())
        }
        _ => None,
    };
    let axis = |run: &Run<f64>| Record { trial: 0, run: *run }.axis_deg();
    let both = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| (a - b).abs());
    Ok(NumericalError {
        tolerance: usual.flux,
        samples,
        current,
        angle: both(axis(&run), axis(&tight_run)),
        margin: both(margin(&run), margin(&tight_run)),
        polarity_margin: margin(&run),
        noise: scenario.sensors.noise,
    })
}

impl Pair {
    fn error(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.usual[k] - self.tight[k])
    }
}

impl NumericalError {
    /// Returns a table with each sample and the numerical error of its currents. `of` is the identity of the trial.
    pub fn table<'a>(&'a self, of: &'a [(String, String)]) -> TableFile<'a> {
        let columns = ["t_s", "i_a_A", "i_b_A", "i_c_A", "error_a_A", "error_b_A", "error_c_A"];
        let rows = move |file: &mut (dyn Write + Send)| {
            let columns = columns.map(|name| Column::new(name, Kind::Number)).to_vec();
            let mut writer = Writer::new(file, Format::Csv, columns, of)?;
            for pair in &self.samples {
                let numbers = std::iter::once(pair.time).chain(pair.usual).chain(pair.error());
                writer.row(&numbers.map(Cell::Number).collect::<Vec<_>>())?;
            }
            writer.finish()
        };
        TableFile { name: "verify.csv".to_owned(), rows: Box::new(rows) }
    }

    pub fn text(&self) -> String {
        let mut text = format!(
            "numerical error at a tolerance of {:.0e} Wb, against the referee at one {:.0} times tighter, without converters:\n  \
             sampled currents {:.1e} A at most ({} samples, each in verify.csv), where the sensors' noise is {:.1e} A\n",
            self.tolerance,
            1.0 / TIGHTER,
            self.current,
            self.samples.len(),
            self.noise,
        );
        if let Some((error, margin)) = self.margin.zip(self.polarity_margin) {
            let _ = writeln!(
                text,
                "  polarity margin {error:.1e} A, where it is {margin:.3} A without converters"
            );
        }
        if let Some(error) = self.angle {
            let _ = writeln!(text, "  axis {error:.1e}°");
        }
        text
    }

    pub fn json(&self) -> serde_json::Value {
        json!({
            "tolerance_Wb": self.tolerance,
            "samples": self.samples.len(),
            "current_A": self.current,
            "polarity_margin_A": self.margin,
            "axis_deg": self.angle,
            "sensor_noise_A": self.noise,
        })
    }
}
