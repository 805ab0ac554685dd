//! Sentences of a fit on currents outside the measured range, on slow probes, and on the next steps.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use standstill_fit::{Discrepancy, Fit, Misfit, Pulse, Swing};
use standstill_quantity::unit::{Ampere, Hertz, Second};
use standstill_quantity::{Quantity, Scale, number, significant};

use super::drive::SWITCH_KEYS;
use crate::arguments::Fit as Options;

/// Names of the rotor's axes.
const AXES: [&str; 3] = ["+d", "−d", "q"];

fn amperes(value: f64) -> String {
    Quantity::<Ampere>::si(significant(value, 2)).to_string()
}

/// Returns the sentence on the range of currents in which saturation was measured, and on the saturation that is stated for larger
/// currents. None if no larger currents are stated.
pub(super) fn saturation(fit: &Fit) -> Option<String> {
    let beyond = fit.extrapolated();
    if beyond.is_empty() {
        return None;
    }
    let reached: Vec<String> =
        AXES.iter().zip(fit.reached).map(|(axis, i)| format!("{} along {axis}", amperes(i))).collect();
    let axes: Vec<&str> = beyond.iter().map(|k| AXES[*k]).collect();
    let mut text = format!(
        "The pulses reached {}; saturation is stated at {}. Along {} the data sheet's number is not measured there",
        reached.join(", "),
        amperes(fit.current),
        axes.join(" and ")
    );
    text += if fit.falls.is_some() { " but assumed, as it says." } else { " and left out." };
    Some(text)
}

/// Returns the sentence on the saturation laws of the iron that the intervals of saturation cover. None if no saturation was measured.
pub(super) fn law(fit: &Fit) -> Option<String> {
    let is_measured = fit.parameters.iter().any(|one| one.name.starts_with("saturation") && one.identified);
    is_measured.then(|| {
        "Intervals of saturation contain three laws of iron where the readings do not tell these apart: a knee, a series, and one that saturates late and steeply. Iron that is steeper still may fall by more than they say (docs/notes/fit-coverage.txt).".to_owned()
    })
}

/// Formats the fit's estimate of a drive parameter and the value with which the fit began. Both have three digits.
fn estimated_and_begun_with(fit: &Fit, one: &Discrepancy) -> [String; 2] {
    [fit.estimate(&one.name).map_or(f64::NAN, |estimate| estimate.value), one.begun_with].map(|value| {
        let scale = Scale::suiting(one.unit, value.abs());
        format!("{} {}", significant(scale.number(value), 3), scale.unit.replace("ohm", "Ω"))
    })
}

/// Returns the sentence on a drive parameter whose given value disagrees with the measured currents.
pub(super) fn discrepancy(fit: &Fit, one: &Discrepancy) -> String {
    let [estimate, begun_with] = estimated_and_begun_with(fit, one);
    let (source, side) = (
        if one.is_stated { "stated" } else { "guess of" },
        if one.deviations > 0.0 { "above" } else { "below" },
    );
    format!(
        "{} is {estimate} in these currents, {:.1} standard deviations {side} the {source} {begun_with}: one of the two is wrong, or the currents have something else that looks like it.",
        one.name,
        one.deviations.abs()
    )
}

/// Returns the next step for a drive parameter whose given value disagrees with the measured currents.
fn settled(fit: &Fit, one: &Discrepancy) -> String {
    let [_, begun_with] = estimated_and_begun_with(fit, one);
    let (measure, resembles) = match &one.name[..] {
        "dead_time" => {
            ("measure both gate signals of a leg", "probes or their skew: a slow probe shifts all edges")
        }
        "diode_drop" | "switch_drop" => (
            "measure it (a multimeter's diode test, or the data sheet's curve at this current and temperature)",
            "the DC link's reading: taken away from the bridge it misses the drop of the leads",
        ),
        _ => (
            "take the slope of the data sheet's curve at this current and temperature",
            "the winding's resistance, which warms up, and the leads",
        ),
    };
    format!(
        "For {0}: {measure} and state it, -s inverter.{0}=…; if {begun_with} is right, look at {resembles}",
        one.name
    )
}

/// Returns the words that name the DC link as a possible cause of differences at large currents. Empty unless the DC-link voltage varies by
/// more than 5 % of its mean within a pulse or a train of pulses.
fn first_at_a_soft_link(swing: &Swing, files: &[String]) -> String {
    if !swing.is_soft() {
        return String::new();
    }
    let moves = number(1, 100.0 * swing.spread);
    format!("the DC link of {}, which moves by {moves} % while legs drive, then at ", files[swing.record])
}

/// Returns the sentence on the place where the simulation differs most from the measured currents, and on the likely cause. `files` has the
/// names of the trace files.
pub(super) fn misfit(fit: &Fit, files: &[String]) -> String {
    match fit.misfit() {
        Some(Misfit::LargeCurrents { above, ratio, .. }) => format!(
            "The difference is {ratio:.1} times as large above {} as below: look first at {}the iron, which saturates more steeply than this model has it, or turns the axes (cross-saturation).",
            amperes(above),
            first_at_a_soft_link(&fit.link_swing, files)
        ),
        Some(Misfit::OneFile { record, ratio }) => format!(
            "{} alone is off: the difference in it is {ratio:.1} times as large as in any other file. Its rotor may have stood in another position, its legs or channels may be others, or, of one pulse a file, the iron saturates more in its direction.",
            files[record]
        ),
        Some(Misfit::OnePulse { number, share }) => format!(
            "Pulse {number} of {} has {:.0} % of the difference (squared): its legs may be others, or the rotor moved in it.",
            fit.traces.len(),
            100.0 * share
        ),
        _ => "Look at fit.png: wrong legs or units, a rotor that moved, a DC link that was not read, or a motor with more than this model has.".to_owned(),
    }
}

/// Returns the sentence on a DC-link voltage that varies by more than 2 % of its mean within a pulse or a train of pulses. None if it
/// varies less. `files` has the names of the trace files.
pub(super) fn link(fit: &Fit, files: &[String]) -> Option<String> {
    let Swing { record, ends: [low, high], spread, .. } = fit.link_swing;
    fit.link_swing.is_noted().then(|| {
        format!(
            "The DC link of {} moves between {} and {} V while legs drive, {:.1} % from its mean, which is what is simulated. A link that sags as the current rises looks like resistance.",
            files[record],
            number(1, low),
            number(1, high),
            100.0 * spread
        )
    })
}

/// Returns the advice to measure with a steadier DC-link voltage. None if the voltage varies by at most 5 % of its mean.
fn after_a_soft_link(fit: &Fit) -> Option<String> {
    let swing = fit.link_swing;
    swing.is_soft().then(|| format!("For a steadier DC link: {}", swing.steadier()))
}

/// Returns the next measurements for a fit that does not describe the measured currents. `again` is the command line of this fit. `traces`
/// has the names of the trace files.
fn after_a_misfit(fit: &Fit, again: &str, traces: &[String]) -> Vec<String> {
    let drive = "-s inverter.dead_time=…, -s inverter.diode_drop=…, -s inverter.devices=…";
    let misfit = fit.misfit();
    let mut steps = match misfit {
        Some(Misfit::LargeCurrents { pulse, below, .. }) => vec![
            format!(
                "For angle, L_d, L_q and resistance: record the same pulses at most {} long, which stay below {}, and shorter again until they are described; then standstill fit SHORT.csv --out ANOTHER",
                Quantity::<Second>::si(significant(pulse, 2)),
                amperes(below)
            ),
            "For the saturation: measure a flux map, name it in a data sheet ([map] file = \"MAP.csv\"), then: standstill magnetics SHEET.toml, standstill check SHEET.toml (docs/own-motor-map.md)".to_owned(),
        ],
        Some(Misfit::OneFile { record, .. }) => vec![format!(
            "Leave out {0}, or record its pulses again with the rotor held; where it has several vectors, standstill fit {0} --out ANOTHER tells their angle",
            traces[record]
        )],
        Some(Misfit::OnePulse { number, .. }) => vec![format!(
            "Leave out pulse {number}, or record it again with the rotor held; then {again}"
        )],
        _ => vec![format!("Then {again} with what is known of the drive: {drive}")],
    };
    // Iron that saturates by another law than the model's, and a rotor that moved between files, leave the same pattern in the residuals.
    if let ([first, .., last], Some(Misfit::LargeCurrents { .. } | Misfit::Everywhere)) = (traces, misfit) {
        steps.insert(
            0,
            format!(
                "Fit each file that has several vectors by itself: standstill fit {first} --out ANOTHER, and so on up to {last}. If each fit describes its file, and the angles differ by more than their intervals, the rotor moved between the files"
            ),
        );
    }
    steps
}

/// Returns the sentence on slow current probes. None if the fit did not estimate the delay of the probes.
pub(super) fn probe(fit: &Fit) -> Option<String> {
    let lag = fit.estimate("probe_lag")?.value;
    Some(format!(
        "The currents lag as behind probes of {} bandwidth (first order, {}): the simulation has them so. A probe of ten times that bandwidth makes delay, dead time and drops exact.",
        Quantity::<Hertz>::si(significant(1.0 / (TAU * lag), 2)),
        Quantity::<Second>::si(significant(lag, 2))
    ))
}

fn pulse(fit: &Fit, axis: usize, Pulse { legs, duration, current }: Pulse) -> String {
    format!(
        "record a pulse with legs {}, {} long, which drives {} along {}{}",
        legs.join(","),
        Quantity::<Second>::si(significant(duration, 2)),
        amperes(current),
        AXES[axis],
        if axis < 2 && !fit.pole.identified { ", or the other way" } else { "" }
    )
}

/// Returns the next steps for the user, with command lines.
pub(super) fn steps(fit: &Fit, options: &Options) -> Vec<String> {
    let traces: Vec<String> = options.traces.iter().map(|path| path.display().to_string()).collect();
    let mut again = format!("standstill fit {}", traces.join(" "));
    if let Some(motor) = &options.motor {
        let _ = write!(again, " --motor {motor}");
    }
    if !fit.describes() || !fit.converged {
        let figure = options.out.join("fit.png");
        let look = format!("Look at {} before anything else", figure.display());
        let first = std::iter::once(look).chain(after_a_soft_link(fit));
        return first.chain(after_a_misfit(fit, &again, &traces)).collect();
    }
    let mut steps: Vec<String> = fit.discrepancies.iter().map(|one| settled(fit, one)).collect();
    steps.extend(after_a_soft_link(fit));
    let pulses: Vec<String> = fit
        .extrapolated()
        .into_iter()
        .filter_map(|axis| Some(pulse(fit, axis, fit.pulse_along(axis)?)))
        .collect();
    if !pulses.is_empty() {
        steps.push(format!("For saturation: {}; then {again} MORE.csv --out ANOTHER", pulses.join("; ")));
    }
    if !options.set.iter().any(|(key, _)| SWITCH_KEYS.contains(&key.as_str())) {
        let switch = fit.plant.devices.switch_resistance;
        steps.push(format!(
            "For the resistance: measure it between two terminals (half of that), or state the switches' from their data sheet (here {} mΩ, a guess): -s {}",
            significant(1e3 * switch, 2),
            if fit.plant.devices.switch_drop > 0.0 { SWITCH_KEYS[0] } else { SWITCH_KEYS[1] }
        ));
    }
    let sheet = options.out.join("motor.toml");
    steps.push(format!(
        "Write magnet_flux, pole_pairs, rated_current and inertia of the motor into {0}, then: standstill check {0}",
        sheet.display()
    ));
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A DC-link voltage may fall or rise as the current changes. The text therefore states the file and the size of the variation, but no
    /// direction.
    #[test]
    fn law_large_currents_are_laid_first_at_a_soft_link_by_name() {
        let files = ["stiff.csv", "soft.csv"].map(str::to_owned);
        let swing = |spread: f64| Swing { record: 1, ends: [10.0, 14.0], spread, pulses: 1 };
        let words = first_at_a_soft_link(&swing(0.123), &files);
        assert_eq!(words, "the DC link of soft.csv, which moves by 12.3 % while legs drive, then at ");
        assert_eq!(first_at_a_soft_link(&swing(0.04), &files), "");
    }
}
