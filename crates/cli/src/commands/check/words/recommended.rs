//! Text about the recommended method: its margins, the starts with new random numbers (*fresh starts*) that confirm it, and a method with a
//! larger margin.

use std::fmt::Write as _;

use standstill_analysis::{Candidate, Condition, Demand, Suitability};
use standstill_quantity::count;
use standstill_scenario::Rotor;

use super::super::checked::{amperes, factor, percent, share};

/// Returns the sentence on the recommended method. It has the factor by which the method is better than required, and the demand with the
/// smallest margin.
pub fn sentence(candidate: &Candidate, found: &Suitability) -> String {
    let method = candidate.setting.method;
    // Only for a free rotor is there a demand on movement.
    let is_free = found.rotor.is_none_or(|rotor| rotor == Rotor::Free);
    let mut and = if is_free { " and in movement" } else { "" }.to_owned();
    if matches!(found.condition, Some(Condition::Saturation { .. })) {
        and += ", at the worse of both saturations (the table has the smaller one)";
    }
    let mut said = if candidate.margin().is_finite() {
        format!(
            "Recommended: {method}, {} times better than demanded in error{and}",
            factor(candidate.margin())
        )
    } else {
        // The method names sectors, and the rotor is held: the error beyond the sector is zero, so the margin is infinite.
        format!("Recommended: {method}, 95 of 100 starts within the sector that they name")
    };
    if let (Some(margins), Some(demand)) = (candidate.margins, candidate.binding) {
        let _ = write!(said, ". What binds is {demand}: {}", kept(demand, margins.binding().1));
    }
    said + "."
}

/// Returns the sentence on a suited method that has a larger margin in the table than the recommended method. The sentence states why this
/// method is not recommended. Empty if there is no such method.
pub fn with_more_room(recommended: &Candidate, found: &Suitability) -> String {
    let margin = recommended.margin();
    let others = found.candidates.iter().filter(|of| of.objections.is_empty() && of.margin() > 1.05 * margin);
    let best = others.filter_map(|of| Some((of, of.why_late()?)));
    best.max_by(|(a, _), (b, _)| a.margin().total_cmp(&b.margin())).map_or_else(String::new, |(other, why)| {
        let method = other.method();
        format!(
            " {method} has more room in the few starts of the table, {} times, but {why}: `-s detector.method={method}` judges it alone.",
            factor(other.margin())
        )
    })
}

/// Formats the margin to the limit of a demand.
fn kept(demand: Demand, margin: f64) -> String {
    match demand {
        Demand::Error | Demand::Movement | Demand::Time => {
            format!("{:.0} % of the allowed value", 100.0 / margin)
        }
        Demand::Current => format!("{:.0} % of the allowed current", 100.0 / margin),
        Demand::Pole => {
            format!("in 99 of 100 starts {:.0} % of the evidence that a decision needs", 100.0 * margin)
        }
        Demand::Answers => "too many end without an angle".to_owned(),
    }
}

/// Returns the sentence on the results of the additional starts, which use new random numbers. None if there were no such starts.
pub fn confirmed(found: &Suitability) -> Option<String> {
    let (fresh, candidate) = (found.confirmed()?, found.recommended()?);
    let mut states = match found.rotor {
        None => "with the rotor locked and free".to_owned(),
        Some(Rotor::Brake) => "with a brake that holds the rotor".to_owned(),
        Some(rotor) => format!("with the rotor {}", rotor.name()),
    };
    if let Some(Condition::Saturation { least, most, .. }) = found.condition {
        let _ = write!(states, ", with both saturations of {} and {}", percent(least), percent(most));
    }
    let poles = fresh.wrong_poles_at_most.map_or_else(String::new, |most| match fresh.counted {
        Some(starts) => format!("; {} wrong poles in {starts}, at most {}", fresh.wrong_poles, share(most)),
        None => format!(
            "; {} wrong poles, at most {} if their evidence is normally distributed",
            fresh.wrong_poles,
            share(most)
        ),
    });
    let sectors = [&candidate.locked, &candidate.free].iter().any(|summary| summary.sectors.is_some());
    let beyond = if sectors { " beyond their sectors" } else { "" };
    let without = if fresh.wrong_poles_at_most.is_some() { "an angle or a pole" } else { "an angle" };
    let moved = movement(found.rotor, fresh.moved_deg);
    Some(format!(
        "On {} fresh starts {states} (seed {}): 95 of 100 errors within {:.2}°{beyond}, at most {} without {without} ({:.0} % confidence each){poles}. {moved}{} A flowed at most.",
        count(fresh.starts),
        fresh.seed,
        fresh.p95_at_most_deg,
        share(fresh.without_angle_at_most),
        100.0 * fresh.confidence,
        amperes(fresh.peak_current_a),
    ))
}

/// Returns the part of the sentence of [`confirmed`] on the movement of the rotor in electrical degrees. Empty if the rotor does not move
/// or is driven.
fn movement(rotor: Option<Rotor>, moved_deg: f64) -> String {
    match rotor {
        None | Some(Rotor::Free) => format!("A free rotor moved by {moved_deg:.3}° at most; "),
        Some(Rotor::Brake) if moved_deg > 0.0 => format!(
            "The rotor moved by {moved_deg:.3}° at most in the play of its brake, which does not count as the movement of a free rotor; "
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_the_play_of_a_brake_moves_no_free_rotor() {
        assert!(movement(None, 0.5).starts_with("A free rotor moved by 0.500°"));
        let brake = movement(Some(Rotor::Brake), 2.0);
        assert!(
            brake.contains("2.000°") && brake.contains("play of its brake") && !brake.contains("A free"),
            "{brake}"
        );
        for (rotor, moved) in [(Rotor::Brake, 0.0), (Rotor::Locked, 0.0), (Rotor::Driven, 40.0)] {
            assert_eq!(movement(Some(rotor), moved), "");
        }
    }
}
