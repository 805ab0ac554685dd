//! `standstill magnetics`.

use std::fmt::Write as _;

use serde_json::json;
use standstill_plant::{Motor, PolaritySignature, Survey};

use crate::Report;
use crate::arguments::Magnetics;
use crate::error::Error;
use crate::figures;
use crate::interrupt;
use crate::output::Output;
use crate::text::table;

/// Points from no current to the largest.
const STEPS: u16 = 10;

pub fn run(options: &Magnetics) -> Result<Report, Error> {
    interrupt::at_once();
    let motor = super::motor(&options.motor)?.at_temperature(options.temperature.into())?;
    let reach = options.current.unwrap_or(motor.rated_current);
    let survey = Survey::of(&motor, reach, STEPS).map_err(Error::Magnetics)?;
    if options.json {
        return Ok(Report { text: format!("{:#}\n", json_of(&motor, &survey)), code: 0 });
    }
    let mut output = Output::create(&options.out, &["magnetics.svg", "magnetics.png"])?;
    let figure = figures::magnetics(&survey, &motor.name);
    output.file("magnetics.svg", figure.svg()?.as_bytes())?;
    output.file("magnetics.png", &figure.png()?)?;
    let files = output.finish()?;
    let text = text_of(&motor, &survey) + &super::reproduce::file_list(&options.out, &files);
    Ok(Report { text, code: 0 })
}

const fn name(signature: PolaritySignature) -> &'static str {
    match signature {
        PolaritySignature::Normal => "normal",
        PolaritySignature::Inverted => "inverted",
        PolaritySignature::Mixed => "mixed",
        PolaritySignature::None => "none",
    }
}

const fn meaning(signature: PolaritySignature) -> &'static str {
    match signature {
        PolaritySignature::Normal => "the larger current is north",
        PolaritySignature::Inverted => {
            "the larger current is south: the paper's polarity test names the wrong pole"
        }
        PolaritySignature::Mixed => "which pole draws the larger current depends on the current",
        PolaritySignature::None => "both poles draw the same current: a polarity test has no answer",
    }
}

fn json_of(motor: &Motor, survey: &Survey) -> serde_json::Value {
    json!({
        "motor": motor.name,
        "polarity_signature": name(survey.signature),
        "reciprocity_error_rel": survey.reciprocity_error,
        "convex": survey.convex,
        "open_circuit_flux_Wb": survey.open_circuit_flux,
        "l_d_mH": survey.l_dd * 1e3,
        "l_q_mH": survey.l_qq * 1e3,
        "l_dq_mH": survey.l_dq * 1e3 + 0.0,
        "polarity": survey.polarity.iter().map(|p| json!({
            "current_A": p.current,
            "l_north_mH": p.north * 1e3,
            "l_south_mH": p.south * 1e3,
            "difference_rel": p.difference(),
        })).collect::<Vec<_>>(),
        "points": survey.along_d.iter().chain(&survey.along_q).map(|p| json!({
            "i_d_A": p.i_d,
            "i_q_A": p.i_q,
            "psi_d_Wb": p.psi_d,
            "psi_q_Wb": p.psi_q,
            "l_dd_mH": p.l_dd * 1e3,
            "l_dq_mH": p.l_dq * 1e3,
            "l_qq_mH": p.l_qq * 1e3,
        })).collect::<Vec<_>>(),
    })
}

fn text_of(motor: &Motor, survey: &Survey) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}: open-circuit flux {:.6} Wb, L_d {:.3} mH, L_q {:.3} mH without current\n\
         polarity signature up to {} A: {}: {}\nreciprocity error {:.1e}, {}\n",
        motor.name,
        survey.open_circuit_flux,
        survey.l_dd * 1e3,
        survey.l_qq * 1e3,
        survey.polarity.last().map_or(0.0, |point| point.current),
        name(survey.signature),
        meaning(survey.signature),
        survey.reciprocity_error,
        if survey.convex { "inductances positive definite" } else { "inductances NOT positive definite" }
    );
    let rows = survey.along_d.iter().chain(&survey.along_q).map(|p| {
        let saliency = p.l_qq / p.l_dd;
        [p.i_d, p.i_q, p.psi_d, p.psi_q, p.l_dd * 1e3, p.l_dq * 1e3, p.l_qq * 1e3, saliency]
            .iter()
            .zip([2, 2, 4, 4, 3, 3, 3, 3])
            .map(|(value, digits)| format!("{:.digits$}", value + 0.0))
            .collect()
    });
    let header =
        ["i_d (A)", "i_q (A)", "ψ_d (Wb)", "ψ_q (Wb)", "L_dd (mH)", "L_dq (mH)", "L_qq (mH)", "L_qq/L_dd"];
    text += &table(&header, rows, true);
    text.push('\n');
    let rows = survey.polarity.iter().map(|p| {
        vec![
            format!("{:.2}", p.current),
            format!("{:.3}", p.north * 1e3),
            format!("{:.3}", p.south * 1e3),
            format!("{:+.2}", 100.0 * p.difference()),
        ]
    });
    text += &table(
        &["current along d (A)", "L to north (mH)", "L to south (mH)", "north draws more by (%)"],
        rows,
        true,
    );
    text.push('\n');
    text
}
