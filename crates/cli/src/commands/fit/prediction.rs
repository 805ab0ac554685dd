//! Predictions of records that were not used in the fit. Their residuals show how well the fitted model describes the motor.

use serde_json::{Value, json};
use standstill_fit::{Fit, Prediction};
use standstill_quantity::number;
use standstill_report::page::{Block, Column, Section, Table};

use crate::answer::Answer;
use crate::arguments::Fit as Options;
use crate::figures;
use crate::shell::command_line::quoted;
use crate::shell::values::ampere;

/// Largest ratio of two relative residuals, that of the prediction and that of the fit, at which the fit is valid for a record. A relative
/// residual is divided by the rms of its currents.
const WORSE: f64 = 1.5;

/// Returns the relative residual: the rms difference of prediction and measurement, divided by the rms of the currents.
fn share(of: &Prediction) -> f64 {
    of.residual_rms / of.current_rms
}

/// Returns the section on the predictions: their table, and the conclusion.
pub(super) fn section(fit: &Fit, predicted: &[Prediction], options: &Options) -> Section {
    let own = fit.residual_rms / fit.current_rms;
    let columns =
        [Column::word("trace"), Column::number("differs by, rms"), Column::number("of the currents")];
    let percent = |share: f64| format!("{} %", number(2, 100.0 * share));
    let fitted = vec!["those of the fit".to_owned(), ampere(fit.residual_rms), percent(own)];
    let rows = predicted.iter().map(|of| vec![of.file.clone(), ampere(of.residual_rms), percent(share(of))]);
    let table = Table::new(columns).rows(std::iter::once(fitted).chain(rows));
    let worst = predicted.iter().max_by(|a, b| share(a).total_cmp(&share(b)));
    let said = worst.map_or_else(String::new, |worst| {
        let ratio = share(worst) / own;
        if ratio > WORSE {
            format!(
                "What the fit found does NOT hold for {file}: it leaves {} times the share there. Fit it by itself and compare \
                 angle and inductances: standstill fit {file}{given} --out ANOTHER",
                number(1, ratio),
                file = worst.file,
                given = given(options)
            )
        } else {
            format!(
                "Traces that the fit has not seen differ by at most {} times the share of its own: what it found holds there as \
                 far as it holds at all.",
                number(2, ratio)
            )
        }
    });
    Section::new("Traces that the fit has not seen", [Block::Table(table), Block::Text(said)])
}

/// Returns the options `--motor` and `-s` of this fit, formatted for another command line.
fn given(options: &Options) -> String {
    let motor = options.motor.iter().map(|motor| format!(" --motor {}", quoted(motor)));
    let keys = options.set.iter().map(|(key, value)| format!(" -s {}", quoted(&format!("{key}={value}"))));
    motor.chain(keys).collect()
}

/// Adds the figure of measured and predicted currents to the answer.
pub(super) fn shown(answer: Answer, fit: &Fit, predicted: &[Prediction]) -> Answer {
    if predicted.is_empty() {
        return answer;
    }
    let traces: Vec<_> = predicted.iter().flat_map(|of| of.traces.iter().cloned()).collect();
    let files: Vec<&str> = predicted.iter().map(|of| of.file.as_str()).collect();
    let title = format!("Prediction over measurement: {}", files.join(", "));
    let subtitle =
        "simulated with the fit of the other traces; lines: 95 % of that fit's residuals".to_owned();
    answer.with(
        "prediction",
        figures::fit(&traces, fit.expected_rms, &title, subtitle),
        "Measured and predicted currents, and below what differs. Drag to zoom.",
    )
}

pub(super) fn json(predicted: &[Prediction]) -> Value {
    let one = |of: &Prediction| {
        json!({
            "file": of.file,
            "residual_rms_A": of.residual_rms,
            "current_rms_A": of.current_rms,
            "share": share(of),
        })
    };
    predicted.iter().map(one).collect()
}
