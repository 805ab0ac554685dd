//! Text about a motor that no settings suit: the changes that were tried, and other ways to start the motor.

use std::fmt::Write as _;

use standstill_analysis::{Advice, Alternative, Candidate, Suitability, Suited, Way};
use standstill_quantity::count;
use standstill_report::page::Block;

use super::super::checked::{amperes, milliseconds, setting};

/// Returns the text for a motor without suitable settings: the changes that were tried, and other ways to start the motor.
pub fn blocks(found: &Suitability) -> Vec<Block> {
    let mut blocks = match found.suited() {
        Suited::Unknown => measured(found),
        Suited::No | Suited::Undecided => changes(found),
        Suited::Yes | Suited::If => return Vec::new(),
    };
    if !found.alternatives.is_empty() {
        blocks.push(Block::Text("What is left:".to_owned()));
        blocks.push(Block::List(found.alternatives.iter().map(other).collect()));
    }
    blocks
}

/// Returns the text on how to measure L_d and L_q. It is for a data sheet that gives only one inductance.
fn measured(found: &Suitability) -> Vec<Block> {
    let mut said = "Measure L_d and L_q: at two terminals the inductance goes from its least to its most twice in an electrical revolution while the shaft is turned by hand; `standstill fit` reads both from scope traces (docs/own-motor-traces.md).".to_owned();
    for Advice { change, helps, .. } in &found.advice {
        if let Some(helps) = helps {
            let _ = write!(said, " With {change} this drive suits: {}.", setting(helps));
        }
    }
    vec![Block::Text(said)]
}

fn changes(found: &Suitability) -> Vec<Block> {
    let looks: usize = found.candidates.iter().map(|candidate| candidate.looks).sum();
    let flowed = found.candidates.iter().map(|of| of.locked.peak_current_a.max(of.free.peak_current_a));
    let most = amperes(flowed.fold(0.0, f64::max));
    let judged = found.candidates.iter().any(Candidate::is_judged);
    let tried = match looks {
        _ if found.is_undecided && !judged => format!(
            "The work that this check may do was spent on looking at {looks} settings, up to {most} A; none was judged."
        ),
        0 | 1 => format!("The one setting that was tried, up to {most} A, does not suffice."),
        _ => format!("None of {looks} settings that were tried, up to {most} A, suffices."),
    };
    if let Some(most) = found.alike_up_to_a {
        return vec![Block::Text(format!(
            "{tried} The poles draw the same current up to {} A: no change of drive or sensors tells them apart with less.",
            amperes(most)
        ))];
    }
    if let Some((open, starts)) = found.open().and_then(|open| Some((open, open.wanting?.starts))) {
        return vec![Block::Text(format!(
            "{} meets all demands on the fresh starts that were tried, but {}. {} starts show whether it holds.",
            setting(&open.setting),
            open.objections.join("; "),
            count(starts)
        ))];
    }
    let (helps, not): (Vec<_>, Vec<_>) = found.advice.iter().partition(|advice| advice.helps.is_some());
    let words: Vec<&str> = not.iter().map(|advice| advice.change.as_str()).collect();
    let not = |head: &str| (!words.is_empty()).then(|| Block::Text(format!("{head}: {}.", words.join("; "))));
    if helps.is_empty() {
        let none =
            "Nor does any of these changes, tried on the bench (those of sensors and dead time together)";
        return [Block::Text(tried)].into_iter().chain(not(none)).collect();
    }
    let with = |advice: &&Advice| {
        format!("{}: {}.", advice.change, advice.helps.as_ref().map_or_else(String::new, setting))
    };
    let does = if helps.len() == 1 { "This change does" } else { "Each of these changes does" };
    let head = format!("{tried} {does}, as tried on the bench:");
    let list = Block::List(helps.iter().map(with).collect());
    [Block::Text(head), list].into_iter().chain(not("Not enough by itself")).collect()
}

/// Describes another way to start the motor.
fn other(alternative: &Alternative) -> String {
    let Alternative { way, setting: with, starts } = alternative;
    let p95 = starts.p95_deg.alone();
    match way {
        Way::Axis => format!(
            "The axis alone, by {}: 95 of 100 errors within {p95}°. Its north end takes a Hall sensor or an encoder.",
            setting(with)
        ),
        Way::Alignment => format!(
            "Alignment: a current turns a free rotor to a known angle, by up to {:.0}° electrical, in {} ms; 95 of 100 errors within {p95}° in {} starts.",
            starts.max_moved_deg,
            milliseconds(starts.mean_duration_s),
            starts.trials
        ),
    }
}
