//! What `check` says of a rotor that turns.

use super::Checked;

/// Formats a speed in rpm: two digits, as the search is good to 9 %.
fn rpm(speed: f64) -> String {
    let place = standstill_quantity::magnitude(speed).unwrap_or(0) - 1;
    standstill_quantity::rounded(standstill_quantity::rounded(speed, -place).round(), place).to_string()
}

/// Returns the part of the verdict on a rotor that turns; empty where that is noticed before the error exceeds what is demanded.
pub fn note(asked: &Checked<'_>) -> String {
    let Some(speeds) = asked.found.turning.filter(|speeds| !speeds.notices_in_time()) else {
        return String::new();
    };
    let exceeds = speeds.exceeds_rpm.map_or_else(String::new, rpm);
    let until = speeds.notices_rpm.map_or_else(String::new, |notices| format!(" to {}", rpm(notices)));
    let demanded = asked.demands.error_deg;
    format!("; of a rotor that turns, from {exceeds}{until} rpm, its error exceeds {demanded}° unnoticed")
}

/// Returns the sentence on the speeds at which the recommended method notices a rotor that turns, and at which its error exceeds the
/// demand; none where they were not measured.
pub fn said(asked: &Checked<'_>) -> Option<String> {
    let (speeds, candidate) = (asked.found.turning?, asked.found.recommended()?);
    let (method, demanded, highest) = (candidate.method(), asked.demands.error_deg, rpm(speeds.highest_rpm));
    let notices = match speeds.notices_rpm {
        Some(notices) => format!("{method} says so in 95 of 100 starts from {} rpm", rpm(notices)),
        None if speeds.is_checked => {
            format!("{method} does not say so in 95 of 100 starts up to {highest} rpm")
        }
        None if asked.found.has_magnet => {
            format!("{method} does not look, as -s detector.checks=true makes it do")
        }
        None => format!("{method} cannot notice it without a magnet, which alone induces a voltage"),
    };
    let exceeds = match speeds.exceeds_rpm {
        Some(exceeds) => {
            let then = if speeds.is_silent { ", where no start has an angle" } else { "" };
            format!("without that 95 of 100 errors are within {demanded}° up to {} rpm{then}", rpm(exceeds))
        }
        None => format!(
            "without that 95 of 100 errors are within {demanded}° up to {highest} rpm, the fastest tried"
        ),
    };
    // A start without an angle has no error, and does not start the motor.
    let answered = if speeds.answered < 1.0 {
        let share = (100.0 * speeds.answered).floor();
        format!("; errors are of those that have an angle, at one of these speeds only {share} %")
    } else {
        String::new()
    };
    Some(format!(
        "Of a rotor that turns, {notices}; {exceeds} ({} starts at each speed, both ways{answered}).",
        speeds.starts
    ))
}
