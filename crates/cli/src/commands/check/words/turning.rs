//! Sentences of `check` on a rotor that turns during the detection.

use super::super::checked::Checked;

/// Formats a positive number with two digits, rounded by `whole` to a whole number of the second one.
fn two_digits(value: f64, whole: fn(f64) -> f64) -> String {
    let place = standstill_quantity::magnitude(value).unwrap_or(0) - 1;
    standstill_quantity::rounded(whole(standstill_quantity::rounded(value, -place)), place).to_string()
}

/// Formats a speed in rpm with two digits. The search finds a speed to within 9 %.
fn rpm(speed: f64) -> String {
    two_digits(speed, f64::round)
}

/// Formats an upper limit of the speed in rpm, rounded down.
fn up_to(speed: f64) -> String {
    two_digits(speed, f64::floor)
}

/// Formats an angle in degrees, rounded up.
fn at_most(angle: f64) -> String {
    two_digits(angle, f64::ceil)
}

/// Returns the part of the verdict on dangerous speeds. At such a speed the error exceeds the demand, and the method does not notice that
/// the rotor turns. Empty if there are no such speeds or none were measured.
pub fn note(asked: &Checked<'_>) -> String {
    let Some((from, until)) = asked.found.turning.and_then(|speeds| speeds.unnoticed_rpm) else {
        return String::new();
    };
    let until = until.map_or_else(String::new, |until| format!(" to {}", rpm(until)));
    let demanded = asked.demands.error_deg;
    format!(
        "; of a rotor that turns, from {}{until} rpm, its error exceeds {demanded}° unnoticed",
        up_to(from)
    )
}

/// Returns the sentence on two speeds of the recommended method. From the first speed on, the method notices that the rotor turns. Up to
/// the second speed, its error meets the demand. None if these speeds were not measured.
pub fn said(asked: &Checked<'_>) -> Option<String> {
    let (speeds, candidate) = (asked.found.turning?, asked.found.recommended()?);
    let (method, demanded, highest) = (candidate.method(), asked.demands.error_deg, rpm(speeds.highest_rpm));
    let notices = match speeds.notices_rpm {
        Some(notices) => format!("{method} says so in 95 of 100 starts from {} rpm", rpm(notices)),
        None if speeds.is_checked => {
            format!("{method} says so in fewer than 95 of 100 starts up to {highest} rpm")
        }
        None if asked.found.has_magnet => {
            format!("{method} does not look, as -s detector.checks=true makes it do")
        }
        None => format!("{method} cannot notice it without a magnet, which alone induces a voltage"),
    };
    let check = if speeds.is_checked { "without that check " } else { "" };
    let within = match speeds.within_rpm {
        Some(within) => {
            let then = if speeds.is_silent { ", and beyond no start has an axis" } else { "" };
            format!("{check}95 of 100 errors are within {demanded}° up to {} rpm{then}", up_to(within))
        }
        None => {
            format!("{check}95 of 100 errors are within {demanded}° up to {highest} rpm, the fastest tried")
        }
    };
    // The angle is that of an instant before the end, and a drive that knows the speed can carry it on.
    let at_instant = match speeds.at_instant_deg {
        Some(error) => format!(" (within {}° at the instant for which each angle holds)", at_most(error)),
        None => String::new(),
    };
    let then = match speeds.unnoticed_rpm {
        Some((_, Some(until))) if speeds.notices_rpm.is_none_or(|notices| notices > 1.1 * until) => {
            format!("; from {} rpm on no more than 5 of 100 starts are answered wrongly", rpm(until))
        }
        _ => String::new(),
    };
    // A start without an axis has no error, and does not start the motor.
    let answered = if speeds.answered < 1.0 {
        format!(
            "; only {} of 100 starts have an axis at one of these speeds",
            (100.0 * speeds.answered).floor()
        )
    } else {
        String::new()
    };
    Some(format!(
        "Of a rotor that turns, {notices}{then}; {within}{at_instant} ({} starts at each speed, half of them in each direction{answered}).",
        speeds.starts
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_speed_up_to_which_something_holds_is_not_rounded_up() {
        assert_eq!([12.97, 0.7861, 130.0, 6.0].map(up_to), ["12", "0.78", "130", "6"]);
        assert_eq!([12.97, 0.7861, 139.0].map(rpm), ["13", "0.79", "140"]);
        assert_eq!([0.121, 0.2, 12.3].map(at_most), ["0.13", "0.2", "13"]);
    }
}
