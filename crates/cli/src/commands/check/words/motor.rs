//! What `check` says of the motor: its saliency, its poles, and the saturation that it needs.

use std::fmt::Write as _;

use standstill_analysis::{Condition, Demands, Suitability, informative};
use standstill_detect::{SequentialSettings, Signature};
use standstill_plant::{
    MAGNETS_INSIDE_FROM, PUBLISHED_SATURATION, PoleKnowledge, PublishedFall, PublishedSaturation,
};
use standstill_scenario::ErrorSet;

use super::{Checked, factor, percent};

/// Names the measurement of the saturation.
const MEASURE: &str = "Measure the saturation: `standstill fit` on scope traces of six pulses (docs/own-motor-traces.md, ten minutes), then `saturation = \"… %\"` in [nameplate].";

/// Returns the sentence on the saturation that the verdict assumes and the data sheet does not state, and on the way
/// to measure it; none without such a condition.
pub fn condition(asked: &Checked<'_>) -> Option<String> {
    let Some(Condition::Saturation { least, most, minus_d }) = &asked.found.condition else { return None };
    Some(format!(
        "Saturation is not given. The bench finds the least that suffices: L_d falls by {} at rated current along +d; along −d it then grows by {:.2} %, as iron that saturates alike either way does, L_q does not change. The settings below hold at this value and at {}, where the same pulses draw the most current. {MEASURE}",
        percent(*least),
        -100.0 * minus_d,
        percent(*most),
    ))
}

/// Returns the sentence on published saturation of motors of this kind; none if the data sheet states the motor's own.
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
    let winding = &asked.motor.winding;
    Some(published_at(winding.q_axis_inductance() / winding.d_axis_inductance()))
}

/// Returns the sentence on published saturation of motors with this ratio of L_q to L_d.
fn published_at(ratio: f64) -> String {
    if ratio < MAGNETS_INSIDE_FROM {
        return format!(
            "No published fall of L_d is known to this program for motors whose L_q is {ratio:.2} times L_d, as surface magnets make it (hub motors, outrunners, gimbals): only the measurement tells. What is published is of magnets inside (docs/own-motor.md)."
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

/// Sentences on motors without saliency.
const SAME: &str = " L_d and L_q are the same: there is no axis to find. Many sheets print one inductance: measure both, at two terminals while the shaft is turned by hand.";

pub fn saliency(suitability: &Suitability, demands: &Demands, errors: ErrorSet) -> String {
    let ratio = suitability.saliency_ratio;
    let mut saliency = format!("Saliency: |L_B|/L_A = {ratio:.3}.");
    let Some(bound) = suitability.limit.filter(|_| ratio >= 1e-3) else {
        if ratio < 1e-3 {
            saliency += SAME;
        }
        return saliency;
    };
    // What holds for this specimen too: its gains and offsets are known only as its sensors are made.
    let limit = bound.hybrid_deg.unwrap_or(bound.scheme_deg);
    if informative(limit).is_none() {
        saliency += " The readings of these pulses do not tell the rotor's angle.";
    } else if limit > 0.0 {
        let margin = demands.error_deg / (1.96 * limit);
        let lines = suitability.candidates.first().is_none_or(|tried| tried.settings.has_line_pulses());
        let pulses = if lines { "line pulses" } else { "pulses" };
        let _ = write!(
            saliency,
            " With error set {} no method can know the axis better than {limit:.3}° rms from these {pulses} (Cramér–Rao), {} times {} than the {}° demanded in 95 of 100.",
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
    if rated == Signature::None && pulses == Signature::None {
        return format!(
            "Poles: they draw the same current, to {:.1} % near rated current: no test at standstill can tell them apart.",
            100.0 * difference
        );
    }
    format!(
        "Poles{}: {} near rated current, by {:.1} %, {} times what drive and sensors get wrong between two vectors ({:.1} %); {} in pulses of half that current, by {:.1} %.",
        match (&suitability.condition, suitability.pole) {
            (Some(_), _) => " (of the least saturation that suffices)",
            (None, PoleKnowledge::Assumed) => " (assumed: the map has one side of the d-axis only)",
            _ => "",
        },
        rated.in_words(),
        100.0 * difference,
        factor(difference / floor),
        100.0 * floor,
        pulses.in_words(),
        100.0 * suitability.pulse_difference.abs()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_published_saturation_is_said_with_its_sources_or_that_there_is_none() {
        for none in [0.9, 1.08] {
            let said = published_at(none);
            assert!(
                said.starts_with("No published fall") && said.contains(&format!("{none:.2} times L_d")),
                "{said}"
            );
        }
        let said = published_at(1.6);
        for one in &PUBLISHED_SATURATION {
            assert!(said.contains(one.motor) && said.contains(one.source), "{said}");
        }
        assert!(
            said.contains("6.3 % / -3.4 % at 8 A") && said.contains("-37 % / 4 % at 50 A, 48 % / 8 %"),
            "{said}"
        );
    }
}
