//! Leaves out the rotor's speed and angle of a scenario, because a check judges a rotor that stands anywhere.

use standstill_scenario::Document;

/// Returns the document without the rotor's speed and acceleration, and this speed as its file writes it. A check judges a rotor at
/// standstill, locked and free. None if the file sets no speed, or if overrides set a rotor that may turn.
pub fn standing(document: &Document) -> Option<(Document, String)> {
    let speed = document.get("rotor.speed").filter(|_| document.origin("rotor.speed").is_none())?;
    let speed = speed.as_str().map_or_else(|| speed.to_string(), str::to_owned);
    let state = document.get("rotor.state").filter(|_| document.origin("rotor.state").is_some());
    if state.is_some_and(|state| ["free", "driven"].map(Some).contains(&state.as_str())) {
        return None;
    }
    let mut document = document.clone();
    document.remove("rotor.speed");
    document.remove("rotor.acceleration");
    Some((document, speed))
}

/// Path of the rotor's angle in a scenario.
pub(super) const ANGLE: &str = "rotor.angle";

/// Returns the document without the rotor's speed and angle, and both as they are written, if they were left out. A check judges all
/// angles.
pub(super) fn anywhere(document: &Document) -> (Document, [Option<String>; 2]) {
    let (mut document, speed) = standing(document)
        .map_or_else(|| (document.clone(), None), |(document, speed)| (document, Some(speed)));
    let angle =
        document.get(ANGLE).map(|angle| angle.as_str().map_or_else(|| angle.to_string(), str::to_owned));
    document.remove(ANGLE);
    (document, [speed, angle])
}
