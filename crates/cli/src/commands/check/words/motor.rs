//! Sentences about the motor and its data sheet, on which the verdict depends.

use std::fmt::Write as _;

use standstill_analysis::{Condition, Demands, Suitability, informative};
use standstill_detect::{SequentialSettings, Signature};
use standstill_plant::{
    DataSheet, Entry, MAGNETS_INSIDE_FROM, Motor, PUBLISHED_SATURATION, PoleKnowledge, PublishedFall,
    PublishedSaturation, Source, fall_of_surface_magnets,
};
use standstill_quantity::listed;
use standstill_scenario::ErrorSet;

use super::super::checked::{Checked, amperes, factor, percent};

/// Sentence on how to measure the saturation.
const MEASURE: &str = "Measure the saturation: `standstill fit` on scope traces of six pulses (docs/own-motor-traces.md, ten minutes), then `saturation = \"… %\"` in [nameplate].";

/// Returns the sentence on the saturation that the verdict assumes because the data sheet does not give it. The sentence also states how to
/// measure the saturation. None if the verdict assumes no saturation.
pub fn condition(asked: &Checked<'_>) -> Option<String> {
    let Some(Condition::Saturation { least, most, minus_d }) = &asked.found.condition else { return None };
    Some(format!(
        "Saturation is not given. The bench finds the least that suffices: L_d falls by {} at rated current along +d; along −d it then grows by {:.2} %, as iron that saturates alike either way does, L_q does not change. The settings below hold at this value and at {}, where the same pulses draw the most current. {MEASURE}",
        percent(*least),
        -100.0 * minus_d,
        percent(*most),
    ))
}

/// Returns the sentence on the published saturation of similar motors. None if the data sheet gives the motor's own saturation.
pub fn published(asked: &Checked<'_>) -> Option<String> {
    let found = asked.found;
    let is_not_given = match &found.condition {
        Some(Condition::Saturation { .. }) => true,
        Some(Condition::Pole) => false,
        None => found.pole == PoleKnowledge::NotGiven,
    };
    if !found.has_magnet || !is_not_given {
        return None;
    }
    let beyond = if estimate_beyond(asked).is_some() {
        " No settings were found up to that estimate: the first of the commands below judges it alone."
    } else {
        ""
    };
    Some(published_at(ratio(asked.motor), fall_of_surface_magnets(asked.motor)) + beyond)
}

fn ratio(motor: &Motor) -> f64 {
    motor.winding.q_axis_inductance() / motor.winding.d_axis_inductance()
}

/// Returns the estimated fall of L_d at rated current, as a share, if it lies beyond the range of saturation for which the verdict holds.
pub fn estimate_beyond(asked: &Checked<'_>) -> Option<f64> {
    let Some(Condition::Saturation { most, .. }) = asked.found.condition else { return None };
    let is_round = ratio(asked.motor) < MAGNETS_INSIDE_FROM;
    fall_of_surface_magnets(asked.motor).filter(|fall| is_round && *fall > most)
}

/// Returns the sentence on the published saturation of motors with this ratio of L_q to L_d. `fall` is the estimated decrease of L_d at
/// rated current, relative to L_d. The estimate assumes that saturated iron is the only cause of the saliency.
fn published_at(ratio: f64, fall: Option<f64>) -> String {
    if ratio < MAGNETS_INSIDE_FROM {
        let estimate = fall.map_or_else(String::new, |fall| {
            format!(
                " An estimate: if this saliency is that of the iron alone, which surface magnets on a round rotor saturate along d, L_d falls by about {:.*} % at rated current (iron by the sixth power of its flux).",
                usize::from(fall < 0.1),
                100.0 * fall
            )
        });
        return format!(
            "No published fall of L_d is known to this program for motors whose L_q is {ratio:.2} times L_d, as surface magnets make it (hub motors, outrunners, gimbals, servos).{estimate} Only the measurement tells. What is published is of magnets inside (docs/own-motor.md)."
        );
    }
    let of_motor = |one: &PublishedSaturation| {
        let fall = |fall: &PublishedFall| {
            format!("{} / {} at {} A", percent(fall.along), percent(fall.against), fall.current)
        };
        let falls: Vec<String> = one.falls.iter().map(fall).collect();
        format!("{}: {} ({})", one.motor, falls.join(", "), one.source)
    };
    let motors: Vec<String> = PUBLISHED_SATURATION.iter().map(of_motor).collect();
    format!(
        "Published falls of L_d along +d / −d, magnets inside: {}. They are too far apart to guess from, and some are larger than what was tried here: measure.",
        motors.join("; ")
    )
}

/// Returns the sentence on a measurement between two terminals. It shows whether R and L of the data sheet are the values of one phase.
/// None for built-in motors, and none if R was measured or was computed from a resistance between two terminals.
pub fn terminals(asked: &Checked<'_>) -> Option<String> {
    let sheet = asked.sheet;
    let is_of_phase = sheet.entries().iter().any(|entry| {
        entry.key == "nameplate.resistance" && matches!(entry.source, Source::Given | Source::Assumed)
    });
    if !is_of_phase || DataSheet::built_in(sheet.name()).is_some() {
        return None;
    }
    let [once, twice] = [1.0, 2.0].map(|factor| listed(&[factor * asked.motor.resistance], "Ω"));
    Some(format!(
        "R and L of the sheet: no other number of it tells a phase from two terminals or a delta's phase. Measure between two terminals: {twice} there, in star or delta, mean that R and L are right. If it is {once}, write `resistance_line_to_line` and L_line_to_line_min, L_line_to_line_max."
    ))
}

fn is_of_saturation(entry: &Entry) -> bool {
    entry.key.starts_with("nameplate.saturation.")
}

/// Returns the sentence on values that are inferred because the data sheet gives the saturation as a single number. None if the sheet gives
/// all values or no value.
pub fn single(asked: &Checked<'_>) -> Option<String> {
    let inferred = |key: &str| asked.sheet.assumed().iter().find(|entry| entry.key.ends_with(key));
    let [minus_d, q] = [".saturation.minus_d", ".saturation.q"].map(inferred);
    let minus_d = minus_d.map(|entry| {
        let fall = entry.value.strip_prefix('-').map_or_else(
            || format!("falls by {}", entry.value),
            |rise| format!("grows by {rise}"),
        );
        format!("along −d L_d {fall} at rated current, inferred from its fall along +d by iron that saturates alike either way")
    });
    let q = q.map(|_| "the fall of L_q is not given: it is taken as unchanged".to_owned());
    let parts: Vec<String> = minus_d.into_iter().chain(q).collect();
    (!parts.is_empty()).then(|| format!("Saturation: {}.", parts.join("; ")))
}

/// Returns the assumptions of the verdict: numbers that the data sheet lacks, and numbers that it marks as assumed. The text for a built-in
/// motor refers to `standstill motors`.
pub fn assumptions(sheet: &DataSheet) -> Vec<String> {
    let list = |head: &str, entries: &[Entry]| {
        let values: Vec<String> =
            entries.iter().map(|entry| format!("{} {}", entry.key, entry.value)).collect();
        (!values.is_empty()).then(|| format!("{head}: {}.", values.join(", ")))
    };
    let left_out = sheet.assumed();
    // `single` lists the values that follow from a saturation given as one number.
    let left_out: Vec<Entry> = left_out.iter().filter(|entry| !is_of_saturation(entry)).cloned().collect();
    let is_written = |entry: &Entry| {
        let is_left_out = left_out.iter().any(|other| other.key == entry.key);
        // A missing saturation is not an assumption: the verdict states what remains open without it.
        let is_open = entry.key == "nameplate.saturation";
        let is_built_in = DataSheet::built_in(sheet.name()).is_some();
        let is_inferred =
            is_of_saturation(entry) && sheet.assumed().iter().any(|other| other.key == entry.key);
        entry.source == Source::Assumed && !is_left_out && !is_inferred && !is_open && !is_built_in
    };
    let written: Vec<Entry> = sheet.entries().into_iter().filter(is_written).collect();
    let said = [
        list("Assumed, as the data sheet does not say", &left_out),
        list("Assumed, as the data sheet itself says", &written),
    ];
    said.into_iter().flatten().collect()
}

/// Sentence for motors without saliency.
const SAME: &str = " L_d and L_q are the same: there is no axis to find.";

pub fn saliency(suitability: &Suitability, demands: &Demands, errors: ErrorSet) -> String {
    let ratio = suitability.saliency_ratio;
    let mut saliency = format!("Saliency: |L_B|/L_A = {ratio:.3}.");
    let Some(bound) = suitability.limit.filter(|_| suitability.has_saliency()) else {
        if !suitability.has_saliency() {
            saliency += SAME;
        }
        return saliency;
    };
    // The limit for a specimen, whose gains and offsets are known only within the tolerances of its sensors.
    let limit = bound.hybrid_deg.unwrap_or(bound.scheme_deg);
    if informative(limit).is_none() {
        saliency += " The readings of these pulses do not tell the rotor's angle.";
    } else if limit > 0.0 {
        let margin = demands.error_deg / (1.96 * limit);
        let pulses = suitability.candidates.first().map_or_else(
            || "these pulses".to_owned(),
            |tried| {
                let lines = if tried.settings.has_line_pulses() { "line " } else { "" };
                format!("the {lines}pulses of {}", tried.method())
            },
        );
        let known = match bound.hybrid_deg {
            Some(_) => {
                format!("; {:.3}° if gains and offsets were known, as `compare` has it", bound.scheme_deg)
            }
            None => String::new(),
        };
        let _ = write!(
            saliency,
            " With error set {} no method can know the axis better than {limit:.3}° rms from {pulses} (Cramér–Rao{known}), {} times {} than the {}° demanded in 95 of 100.",
            errors.name(),
            factor(if margin < 1.0 { 1.0 / margin } else { margin }),
            if margin < 1.0 { "worse" } else { "better" },
            demands.error_deg
        );
    }
    saliency
}

pub fn poles(suitability: &Suitability) -> String {
    let [rated, pulses] = suitability.signature;
    let difference = suitability.polarity_difference.abs();
    let floor = SequentialSettings::<f64>::new(difference).floor;
    if !suitability.has_magnet {
        return "Poles: none, the motor has no magnet; its axis is all there is to find.".to_owned();
    }
    if let (true, Some(note)) = (suitability.pole_is_open(), suitability.pole.note()) {
        let way_out = match suitability.pole {
            PoleKnowledge::NotDetermined => {
                "Points of both sides would tell; `standstill magnetics` shows what each core says."
                    .to_owned()
            }
            _ => format!("By how much L_d falls at rated current along +d would tell. {MEASURE}"),
        };
        return format!("Poles: {note}. {way_out}");
    }
    if let Some(most) = suitability.alike_up_to_a {
        return format!(
            "Poles: they draw the same current up to {} A (to {:.1} % near rated current): no test with such currents tells them apart.",
            amperes(most),
            100.0 * difference
        );
    }
    let strongest = match suitability.strongest {
        Some((signature, difference))
            if suitability.signature == [Signature::None; 2] && signature != Signature::None =>
        {
            format!(
                "; {} at {} A, by {:.1} %, which the pulses below use",
                signature.in_words(),
                amperes(suitability.most_current_a),
                100.0 * difference.abs()
            )
        }
        _ => String::new(),
    };
    let at = |signature: Signature, share: f64, at: &str| {
        let percent = 100.0 * share.abs();
        if signature == Signature::None {
            format!("their currents differ by {percent:.1} % {at}")
        } else {
            format!("{} {at}, by {percent:.1} %", signature.in_words())
        }
    };
    format!(
        "Poles{}: {}, {} times what drive and sensors get wrong between two vectors ({:.1} %); {}{strongest}.",
        match (&suitability.condition, suitability.pole) {
            (Some(_), _) => " (of the least saturation that suffices)",
            (None, PoleKnowledge::Assumed) => " (assumed: the map has one side of the d-axis only)",
            _ => "",
        },
        at(rated, difference, "near rated current"),
        factor(difference / floor),
        100.0 * floor,
        at(pulses, suitability.pulse_difference, "in pulses of half that current")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_published_saturation_is_said_with_its_sources_or_that_there_is_none() {
        for (none, fall) in [(0.9, None), (1.08, Some(0.144))] {
            let said = published_at(none, fall);
            assert!(
                said.starts_with("No published fall") && said.contains(&format!("{none:.2} times L_d")),
                "{said}"
            );
            assert_eq!(said.contains("L_d falls by about 14 %"), fall.is_some(), "{said}");
        }
        let said = published_at(1.6, Some(0.5));
        assert!(!said.contains("50 %"), "surface magnets make no such saliency: {said}");
        for one in &PUBLISHED_SATURATION {
            assert!(said.contains(one.motor) && said.contains(one.source), "{said}");
        }
        assert!(
            said.contains("6.3 % / -3.4 % at 8 A") && said.contains("-37 % / 4 % at 50 A, 48 % / 8 %"),
            "{said}"
        );
    }
}
