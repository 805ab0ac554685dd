//! The answer of a fit: the estimates, how well the currents determine them, and the next steps.

use std::fmt::Write as _;

use serde_json::{Value, json};
use standstill_fit::record::{LINK, Record as Trace};
use standstill_fit::{Estimate, Fit, NonIdentifiable, Prediction};
use standstill_quantity::{Scale, number, significant};
use standstill_report::page::{Block, Column, Section, Table, Tone};

use super::{next, prediction};
use crate::answer::{Answer, Record, Records, verdict};
use crate::arguments::Fit as Options;
use crate::figures;
use crate::shell::values::ampere;
use crate::summary::{decimals_of, fixed};

/// Ratio of the information in the readings to the information in the prior, along one direction of the parameters; a
/// direction with a smaller ratio is named as hardly identified.
const HARDLY_IDENTIFIED: f64 = 0.1;

/// Parameters whose non-identifiable directions the text names; fit.json contains the directions of all parameters.
const OF_THE_WINDING: [&str; 4] = ["L_d", "L_q", "angle", "resistance"];

/// Makes the answer; `files`: names of the trace files.
pub(super) fn of(
    fit: &Fit,
    predicted: &[Prediction],
    traces: &[Trace],
    files: &[String],
    options: &Options,
) -> Answer {
    let records: Records = fit.parameters.iter().map(record).collect();
    let json = json(fit, predicted, &records, files, options);
    let table = Block::Table(table(fit));
    let tells = Section::new("What the currents tell", [Block::List(sentences(fit, files))]);
    let files = files.join(", ");
    let steps =
        Section::new("Next steps", [Block::Text("Next:".to_owned()), Block::List(next::steps(fit, options))]);
    let answer = Answer::new(
        "fit",
        format!("A motor fitted to {files}"),
        setting(fit, traces),
        headline(fit),
        vec![table],
    )
    .with(
        "fit",
        figures::fit(
            &fit.traces,
            fit.expected_rms,
            &format!("Simulation over measurement: {files}"),
            subtitle(fit),
        ),
        "Measured and simulated currents, and below what differs. Drag to zoom.",
    );
    let answer = prediction::shown(answer, fit, predicted);
    let unseen = (!predicted.is_empty()).then(|| prediction::section(fit, predicted, options));
    let sections = answer.sections.into_iter().chain(unseen).chain([tells, steps]).collect();
    Answer { sections, json, csv: Some(records), ..answer }
}

fn subtitle(fit: &Fit) -> String {
    let scale = Scale::suiting("A", fit.residual_rms);
    format!(
        "residual {:.3} {} rms; lines: 95 % of noise and converter",
        scale.number(fit.residual_rms),
        scale.unit
    )
}

fn record(estimate: &Estimate) -> Record {
    Record::default()
        .with("name", &estimate.name)
        .with("unit", estimate.unit)
        .with("value", estimate.value)
        .with("low", estimate.interval.map(|[low, _]| low))
        .with("high", estimate.interval.map(|[_, high]| high))
        .with("identified", estimate.identified)
        .with("at_A", estimate.at)
}

fn json(
    fit: &Fit,
    predicted: &[Prediction],
    records: &Records,
    files: &[String],
    options: &Options,
) -> Value {
    let [low, high] = fit.link_swing.ends;
    json!({
        "files": files,
        "start": options.motor,
        "parameters": records,
        "non_identifiable_directions": fit.non_identifiable.iter().map(|direction| json!({
            "information": direction.information,
            "moves": direction.parts.iter().map(|(name, by)| json!({ "name": name, "by": by })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "pole": { "stated": fit.pole.stated, "identified": fit.pole.identified, "deviations": fit.pole.deviations, "both_ways": fit.pole.both_ways },
        "discrepancies": fit.discrepancies.iter().map(|one| json!({
            "name": one.name,
            "unit": one.unit,
            "begun_with": one.begun_with,
            "stated": one.is_stated,
            "deviations": one.deviations,
        })).collect::<Vec<_>>(),
        "fixed_biases": fit.fixed_biases.iter().map(|bias| json!({
            "fixed": bias.fixed.0,
            "off_by": bias.fixed.1,
            "moves": bias.moves.iter().map(|(name, by)| json!({ "name": name, "by": by })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "residual_rms_A": fit.residual_rms,
        "expected_rms_A": fit.expected_rms,
        "rest_rms_A": fit.rest_rms,
        "current_rms_A": fit.current_rms,
        "predictions": prediction::json(predicted),
        "intervals_widened": fit.widened,
        "converged": fit.converged,
        "describes": fit.describes(),
        "row_stride": fit.every,
        "readings": fit.readings,
        "clipped_readings": fit.clipped,
        "pulses": fit.traces.len(),
        "largest_current_A": fit.reach,
        "saturation_at_A": fit.current,
        "intervals_too_narrow": has_one_shunt(fit),
        "reached_A": { "d": fit.reached[0], "minus_d": fit.reached[1], "q": fit.reached[2] },
        "dc_link_V": fit.link,
        "dc_link_spread": fit.link_swing.spread,
        "dc_link_swing": { "file": files[fit.link_swing.record], "low_V": low, "high_V": high },
    })
}

/// Formats a value and its interval in one unit, with the digits that the interval supports.
fn cells(estimate: &Estimate) -> [String; 2] {
    let share = estimate.name.starts_with("saturation");
    let [low, high] = estimate.interval.unwrap_or([estimate.value; 2]);
    let scale = if share {
        Scale::percent()
    } else {
        Scale::suiting(estimate.unit, estimate.value.abs().max(high - low))
    };
    let decimals = decimals_of([estimate.value, low, high].map(|value| scale.number(value)));
    let number = |value: f64| fixed(scale.number(value), decimals);
    let unit = scale.unit.replace("ohm", "Ω");
    let value = format!("{} {unit}", number(estimate.value)).trim_end().to_owned();
    let interval = match estimate.interval {
        Some(_) if estimate.identified => format!("{} … {}", number(low), number(high)),
        Some(_) => format!("± {} assumed", number((high - low) / 2.0)),
        None => "–".to_owned(),
    };
    [value, interval]
}

/// Returns true if no channel has the current of a single phase, so that all currents come from one shunt in the DC link.
fn has_one_shunt(fit: &Fit) -> bool {
    !fit.channels[..LINK].contains(&true)
}

/// Returns the verdict on whether the simulation describes the currents.
fn headline(fit: &Fit) -> Block {
    let (tone, headline) = if !fit.describes() {
        (Tone::Bad, "the simulation does NOT describe these currents")
    } else if fit.converged {
        (Tone::Good, "the simulation describes these currents")
    } else {
        (Tone::Warning, "the search did NOT end at the most likely parameters")
    };
    let [residual, expected] = [fit.residual_rms, fit.expected_rms].map(ampere);
    // With real iron and real drives residuals are seldom as small as the noise. The share of the currents shows whether the misfit is
    // small.
    let share = match tone {
        Tone::Bad => {
            format!(" ({} % of the currents)", number(2, 100.0 * fit.residual_rms / fit.current_rms))
        }
        _ => String::new(),
    };
    verdict(
        tone,
        format!("{headline}: residual {residual} rms{share}, noise and converter {expected}"),
        Vec::new(),
    )
}

fn setting(fit: &Fit, traces: &[Trace]) -> String {
    let rows: usize = traces.iter().map(|trace| trace.rows.len()).sum();
    let used = if fit.every == 1 { String::new() } else { format!(" (one in {} used)", fit.every) };
    let pulses = match fit.traces.len() {
        1 => "one pulse or train".to_owned(),
        pulses => format!("{pulses} pulses or trains"),
    };
    let [reach, link] = [number(2, fit.reach), number(1, fit.link)];
    format!("{rows} rows{used}, {pulses} from rest, up to {reach} A on {link} V")
}

fn table(fit: &Fit) -> Table {
    let rows = fit.parameters.iter().map(|estimate| {
        let [value, interval] = cells(estimate);
        let measured = if estimate.identified { "measured" } else { "not measured: fixed" };
        let at = estimate.at.filter(|_| estimate.identified);
        let at = at.map(|at| format!(" at {} A", number(2, at))).unwrap_or_default();
        vec![estimate.name.clone() + &at, value, interval, measured.to_owned()]
    });
    let columns = [
        Column::word("parameter"),
        Column::number("value"),
        Column::number("95 % interval"),
        Column::prose(""),
    ];
    Table::new(columns).rows(rows)
}

/// Returns the sentence on the capacitance of the terminals, which the simulation leaves out. Its ringing frequency is that of one phase
/// against the two others in parallel (3/2 of the mean inductance) with 0.3 nF, a usual capacitance of boards.
fn ringing(fit: &Fit) -> String {
    const CAPACITANCE: f64 = 0.3e-9;
    let mean = fit.plant.inductance.iter().sum::<f64>() / 2.0;
    let frequency = 1.0 / (std::f64::consts::TAU * (1.5 * mean * CAPACITANCE).sqrt());
    let [frequency, inductance] = [(frequency, "Hz"), (mean, "H")].map(|(value, unit)| {
        let scale = Scale::suiting(unit, value);
        format!("{} {}", number(0, scale.number(value)), scale.unit)
    });
    format!(
        "The simulated terminals have no capacitance: what rings after a leg opens ({frequency} with {inductance} and 0.3 nF) is read as noise, \
         and what charges a terminal as a current of the motor."
    )
}

/// Returns the sentence on the part of L_d and L_q that an infinitely short pulse meets; none if the readings show no eddy currents.
fn eddies(fit: &Fit) -> Option<String> {
    let time = fit.identified("eddy.time_constant")?;
    let met = [("L_d", "eddy.d_depth"), ("L_q", "eddy.q_depth")];
    let met = met.iter().filter_map(|(name, depth)| {
        Some(format!("{} % of {name}", number(2, 100.0 * (1.0 - fit.identified(depth)?.value))))
    });
    Some(format!(
        "Eddy currents: an infinitely short pulse meets {}, one that lasts several times {} meets all of it.",
        met.collect::<Vec<_>>().join(" and "),
        cells(time)[0]
    ))
}

/// Returns the sentence on a stated angle that the currents contradict: the estimate differs by more than half its 95 % interval, at least
/// 5°, or L_d is more than 2 % above L_q. None if no angle is stated or the currents agree with it.
fn contradicted_angle(fit: &Fit) -> Option<String> {
    let stated = fit.stated_angle()?.to_degrees();
    let off = |angle: f64| (angle - stated + 180.0).rem_euclid(360.0) - 180.0;
    let found = fit.identified("angle").filter(|angle| {
        let half = angle.interval.map_or(0.0, |[low, high]| (high - low) / 2.0);
        off(angle.value).abs() > half.max(5.0)
    });
    if let Some(angle) = found {
        return Some(format!(
            "The currents contradict angle_deg: the axis that they show lies {} from the stated one. Look whether angle_deg is in electrical degrees \
             (mechanical ones times the pole pairs), and at the encoder's zero.",
            format_args!("{:.1}°", off(angle.value))
        ));
    }
    let [d, q] = [fit.identified("L_d")?, fit.identified("L_q")?].map(|estimate| estimate.value);
    (d > 1.02 * q).then(|| {
        "L_d is above L_q, unusual beside a magnet: angle_deg may count from the other axis, 90° away."
            .to_owned()
    })
}

/// Returns the sentence on whether the readings confirm the pole that the records state.
fn stated_pole(fit: &Fit) -> String {
    let Some([d, minus_d, _]) = fit.falls.filter(|_| fit.pole.identified) else {
        return "North is where angle_deg states it; the iron does not tell the poles apart, as far as these currents go.".to_owned();
    };
    let [more, less] = if d >= minus_d { ["along", "against"] } else { ["against", "along"] };
    format!(
        "North is where angle_deg states it, and a current {more} the magnet saturates the iron more than one {less} it, by {:.1} \
         deviations{}.",
        fit.pole.deviations,
        if d < minus_d { ": unusual; look whether angle_deg counts from the south pole" } else { "" }
    )
}

/// Returns the sentences that interpret the numbers; `files`: names of the trace files.
fn sentences(fit: &Fit, files: &[String]) -> Vec<String> {
    let mut said = Vec::new();
    if !fit.describes() {
        let why = match fit.rest_rms.filter(|_| fit.is_far_above_rest()) {
            Some(rest) => format!(
                "The residuals are {} times what the channels scatter at rest",
                number(1, fit.residual_rms / rest)
            ),
            None => "Residuals follow each other".to_owned(),
        };
        said.push(format!(
            "{why}, and intervals are {:.1} times as wide for neighbours that are alike. {}",
            fit.widened,
            next::misfit(fit, files)
        ));
    }
    if !fit.converged {
        said.push("The search for the most likely parameters did NOT end at them: the intervals are not 95 % ones. Begin nearer: --motor with a motor like it, -s inverter.dead_time and the like as known.".to_owned());
    }
    if fit.clipped > 0 {
        said.push(format!(
            "{} readings lie at the ends of their channels' ranges: they count as currents of at least that.",
            fit.clipped
        ));
    }
    said.extend(next::link(fit, files));
    if has_one_shunt(fit) {
        said.push("Through one shunt these intervals are too narrow: in 47 simulated drives of 12 V 81 to 96 % of them held, and 97 % or more twice as wide (docs/notes/fit-coverage.txt). Take twice the interval, or record the phases' currents.".to_owned());
        said.push("One shunt in the DC link shows the current along each pulse's own legs alone: phases that were exchanged, or a pulse with the legs of another, cannot be noticed. Its readings right after a change of the legs are left out (-s sensors.settle).".to_owned());
    }
    if fit.rest_rms.is_none() {
        said.push("Fewer than twelve rows before the first pulse show what the channels scatter at rest: whether the residuals are noise alone is not known.".to_owned());
    }
    said.extend(contradicted_angle(fit));
    said.push(if fit.pole.stated {
        stated_pole(fit)
    } else if fit.pole.identified {
        format!("North from south: {:.1} deviations, by the convention that a current along the magnet saturates the iron more{}.", fit.pole.deviations, if fit.falls.is_some_and(|[d, minus_d, _]| d < minus_d) { " against it (as in the motor that the fit began with)" } else { "" })
    } else if !fit.pole.both_ways {
        "The half turn of the angle stays open: the pulses drive current to one side of the magnet only. The angle may be 180° more. Add pulses the other way.".to_owned()
    } else {
        "The half turn of the angle stays open: the iron saturates alike in both directions, as far as these currents go. The angle may be 180° more.".to_owned()
    });
    said.extend(fit.discrepancies.iter().map(|one| next::discrepancy(fit, one)));
    said.extend(eddies(fit));
    said.extend(next::saturation(fit));
    said.extend(next::law(fit));
    said.extend(next::probe(fit));
    said.push(ringing(fit));
    said.push("No trace tells a gain that all channels, or the DC link's, have in common: resistance and inductances are in proportion to the link's gain over the channels'.".to_owned());
    let of = |name: &str, value: f64| {
        let scale = Scale::suiting(fit.estimate(name).map_or("", |estimate| estimate.unit), value.abs());
        let value = significant(scale.number(value.abs()), 2);
        format!("{value} {}", scale.unit.replace("ohm", "Ω")).trim_end().to_owned()
    };
    let named = |direction: &&NonIdentifiable| {
        direction.information < HARDLY_IDENTIFIED
            && direction.parts.len() > 1
            && OF_THE_WINDING.contains(&direction.parts[0].0.as_str())
    };
    for direction in fit.non_identifiable.iter().filter(named) {
        let first = direction.parts[0].1;
        let part = |(name, by): &(String, f64)| {
            format!("{name} by {}{}", if by * first < 0.0 { "−" } else { "" }, of(name, *by))
        };
        said.push(format!(
            "The readings do not identify one direction of the parameters: a move of {} hardly changes the currents.",
            direction.parts.iter().map(part).collect::<Vec<_>>().join(" together with ")
        ));
    }
    for bias in &fit.fixed_biases {
        let mut moves = String::new();
        for (k, (name, by)) in bias.moves.iter().enumerate() {
            let _ = write!(moves, "{}{name} by {}", if k == 0 { "" } else { ", " }, of(name, *by));
        }
        said.push(format!(
            "{} is fixed, not measured; if it is off by {}, it biases {moves}, which their intervals contain.",
            bias.fixed.0,
            of(&bias.fixed.0, bias.fixed.1)
        ));
    }
    said
}
