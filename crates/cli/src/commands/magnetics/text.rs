//! The survey of a magnetic core's inductances as an answer, for text and page.

use std::fmt::Write as _;

use standstill_plant::{
    Continuation, FluxMap, MapReport, OperatingPoint, PolaritySignature, PoleKnowledge, Survey,
};
use standstill_quantity::{decimals, number, short};
use standstill_report::page::{Block, Column, Table, Tone};

use super::{Subject, reach, short_pulse, standard_errors};
use crate::answer::{Answer, verdict};
use crate::figures;

const fn meaning(signature: PolaritySignature) -> &'static str {
    match signature {
        PolaritySignature::Normal => "the larger current is north",
        PolaritySignature::Inverted => {
            "the larger current is south: the paper's polarity test names the wrong pole"
        }
        PolaritySignature::Mixed => "which pole draws the larger current depends on the current",
        PolaritySignature::None => {
            "both poles draw the same current, as far as is known: a polarity test has no answer"
        }
    }
}

/// Returns the text on the electrical time constants and on the torque. Empty if neither the resistance nor the number of pole pairs is
/// known.
fn motor_text(subject: &Subject, survey: &Survey) -> String {
    let mut text = String::new();
    if let Some(r) = subject.resistance {
        let [d, q] = [survey.l_dd, survey.l_qq].map(|l| number(3, l / r * 1e3));
        let _ = writeln!(text, "time constants with {r} Ω: L_d/R {d} ms, L_q/R {q} ms");
    }
    if let (Some(p), Some(point)) = (subject.pole_pairs, survey.along_q.last()) {
        let torque = 1.5 * f64::from(p) * (point.psi_d * point.i_q - point.psi_q * point.i_d);
        let [i_d, i_q, torque] = [point.i_d, point.i_q, torque].map(|value| number(2, value));
        let _ = writeln!(text, "torque with {p} pole pairs at i_d = {i_d} A, i_q = {i_q} A: {torque} N m");
    }
    text
}

/// Returns the text on effects that the table of the core does not contain: harmonics, eddy currents and hysteresis.
fn beside_the_core(subject: &Subject, survey: &Survey) -> String {
    let mut text = String::new();
    let harmonics = subject.magnetics.harmonics();
    if harmonics.any() {
        let _ = writeln!(
            text,
            "harmonics, not in the table: L_4 {} mH, asymmetry of phase a {} mH, ψ_5 {} mWb, ψ_7 {} mWb",
            number(3, harmonics.inductance_4 * 1e3),
            number(3, harmonics.asymmetry * 1e3),
            number(2, harmonics.flux_5 * 1e3),
            number(2, harmonics.flux_7 * 1e3),
        );
    }
    if let (Some([d, q]), Some(branch)) = (short_pulse(subject, survey), subject.magnetics.eddy_currents()) {
        let _ = writeln!(
            text,
            "eddy currents: pulses much shorter than {} µs see L_d {} mH, L_q {} mH",
            number(0, branch.time_constant * 1e6),
            number(3, d * 1e3),
            number(3, q * 1e3)
        );
    }
    if let Some(hysteresis) = subject.magnetics.hysteresis() {
        let _ = writeln!(
            text,
            "hysteresis of the stator's iron, not in the table: coercive current {} A, {} cells, {:.1} % of the smaller inductance not met by small pulses",
            number(3, hysteresis.coercive_current),
            hysteresis.cells,
            hysteresis.depth * 100.0,
        );
    }
    text
}

pub fn of(subject: &Subject, survey: &Survey) -> Answer {
    let setting = format!(
        "{}: open-circuit flux {} Wb, L_d {} mH, L_q {} mH without current{}",
        subject.name,
        number(6, survey.open_circuit_flux),
        number(3, survey.l_dd * 1e3),
        number(3, survey.l_qq * 1e3),
        standard_errors(subject, [0.0; 2]).map_or_else(String::new, |[d, _, q]| {
            format!(" (standard errors {} and {} mH)", number(2, d * 1e3), number(2, q * 1e3))
        })
    );
    let tone = if survey.signature == PolaritySignature::Normal { Tone::Good } else { Tone::Warning };
    let headline = format!(
        "polarity signature up to {} A{}: {}: {}",
        reach(survey),
        if subject.map.as_ref().is_some_and(|(map, _)| map.pole(reach(survey)) != PoleKnowledge::Known) {
            " of what is simulated, which the file does not tell"
        } else {
            ""
        },
        survey.signature.name(),
        meaning(survey.signature)
    );
    let mut text = format!(
        "reciprocity error {:.1e}, {}\n\n",
        survey.reciprocity_error,
        if survey.convex { "inductances positive definite" } else { "inductances NOT positive definite" }
    );
    if let Some((surface, map)) = &subject.map {
        text += &map_text(surface, map);
        if let Some(continued) = &map.continued {
            text += &continued_text(surface, continued, reach(survey));
        }
    }
    text += &motor_text(subject, survey);
    text += &beside_the_core(subject, survey);
    let points = || survey.along_d.iter().chain(&survey.along_q);
    let largest = |of: fn(&OperatingPoint) -> f64| points().map(of).map(f64::abs).fold(0.0, f64::max);
    let current = decimals(2, largest(|p| p.i_d).max(largest(|p| p.i_q)));
    let flux = decimals(4, largest(|p| p.psi_d).max(largest(|p| p.psi_q)));
    let inductance = decimals(3, 1e3 * largest(|p| p.l_dd).max(largest(|p| p.l_qq)));
    let rows = points().map(|p| {
        let saliency = p.l_qq / p.l_dd;
        let mut row: Vec<String> =
            [p.i_d, p.i_q, p.psi_d, p.psi_q, p.l_dd * 1e3, p.l_dq * 1e3, p.l_qq * 1e3, saliency]
                .iter()
                .zip([current, current, flux, flux, inductance, inductance, inductance, 3])
                .map(|(value, digits)| format!("{:.digits$}", value + 0.0))
                .collect();
        let errors = standard_errors(subject, [p.i_d, p.i_q]).into_iter().flatten();
        row.extend(errors.map(|error| {
            if error.is_nan() { "–".to_owned() } else { format!("{:.inductance$}", error * 1e3) }
        }));
        row
    });
    let mut header = vec![
        "i_d (A)",
        "i_q (A)",
        "ψ_d (Wb)",
        "ψ_q (Wb)",
        "L_dd (mH)",
        "L_dq (mH)",
        "L_qq (mH)",
        "L_qq/L_dd",
    ];
    if subject.map.is_some() {
        header.extend(["± L_dd", "± L_dq", "± L_qq"]);
    }
    let columns = header.into_iter().enumerate().map(|(k, title)| match k {
        // On a narrow terminal the standard errors are left out first, then L_dq.
        8.. => Column::number(title).rank(2),
        5 => Column::number(title).rank(1),
        _ => Column::number(title),
    });
    let blocks = vec![
        Block::Code { caption: String::new(), text },
        Block::Table(Table::new(columns).rows(rows)),
        Block::Table(polarity(survey, current, inductance)),
    ];
    let title = format!("Inductances of {}", subject.name);
    Answer::new("magnetics", title, setting, verdict(tone, headline, Vec::new()), blocks).with(
        "magnetics",
        figures::magnetics(survey, &subject.name),
        "",
    )
}

/// Returns the table of the inductances at currents toward the north and the south pole. `current` and `inductance` are the numbers of
/// decimals.
fn polarity(survey: &Survey, current: usize, inductance: usize) -> Table {
    let rows = survey.polarity.iter().map(|p| {
        vec![
            format!("{:.current$}", p.current),
            format!("{:.inductance$}", p.north * 1e3),
            format!("{:.inductance$}", p.south * 1e3),
            format!("{:+.2}", 100.0 * p.difference()),
        ]
    });
    let titles = ["current along d (A)", "L to north (mH)", "L to south (mH)", "north draws more by (%)"];
    Table::new(titles.map(Column::number)).rows(rows)
}

/// Returns the text on the side of the flux map that the file does not contain. The program continues the map there by fitted cores. The
/// text has one line for each kind of core. `reach` is the largest current in A.
fn continued_text(map: &FluxMap, continued: &Continuation, reach: f64) -> String {
    let [low, high] = continued.measured.map(short);
    let mut text =
        format!("beyond i_d from {low} to {high} A, which the file has, continued by cores that fit it:\n");
    for spread in continued.spread(map, reach) {
        let kind = if spread.bridged { "with iron bridges" } else { "without iron bridges" };
        let [least, most] = spread.difference.map(|difference| 100.0 * difference);
        let _ = writeln!(
            text,
            "  {} {kind}, the best within {} % of the largest current: north draws more by {least:+.2} to {most:+.2} %",
            spread.cores,
            number(2, 100.0 * spread.distance)
        );
    }
    let _ = writeln!(
        text,
        "  {}",
        map.pole(reach).note().unwrap_or("the pole is known: the file has both sides up to this current")
    );
    text
}

fn map_text(surface: &FluxMap, map: &MapReport) -> String {
    let [[d_low, d_high], [q_low, q_high]] = map.range.map(|ends| ends.map(short));
    let mirrored = match map.mirrored {
        [false, false] => "",
        [true, false] => ", continued to the other i_d by symmetry",
        [false, true] => ", continued to the other i_q by symmetry",
        [true, true] => ", continued to all quadrants by symmetry",
    };
    let off_axis = if map.off_axis.abs() < 5e-3 {
        String::new()
    } else {
        format!(" (flux without current {:+.2}° from it: as much is the rotor's angle off)", map.off_axis)
    };
    let [rms, largest] = map.distance;
    format!(
        "map: {} points, {} × {} grid, i_d {d_low} to {d_high} A, i_q {q_low} to {q_high} A{mirrored}; {}{off_axis}\n\
         nearest map with an energy: {rms:.2e} Wb rms away ({:.3} % of the largest flux), at most {largest:.2e} Wb, at \
         i_d = {} A, i_q = {} A\n\
         evaluation within {:.1e} A of it; cross inductance {} mH rms\n\
         noise {:.2e} Wb rms: {:.0} of {} numbers are free, the rest is smoothed{}{}\n",
        map.points,
        map.size[0],
        map.size[1],
        map.axes,
        100.0 * rms / map.largest_flux,
        number(3, map.furthest[0]),
        number(3, map.furthest[1]),
        map.evaluation_error,
        number(3, map.cross_inductance * 1e3),
        map.noise,
        map.free,
        2 * map.size[0] * map.size[1],
        map.convexity.map_or_else(String::new, |away| {
            format!("\nthat energy was not convex: the nearest convex one, {away:.2e} Wb rms from it, is what is simulated")
        }),
        surface.note().map_or_else(String::new, |note| format!("\n{}", note.replacen("too coarse", "TOO COARSE", 1)))
    )
}
