//! Pulses of one length whose currents are sampled.

use super::*;

/// A motor that does not saturate has no pole to find. Shunts below the legs read both directions of a phase by other shunts, and the
/// difference of their gains must not be taken for one.
#[test]
fn law_gains_of_shunts_below_the_legs_are_not_taken_for_a_pole() {
    let text = "errors = \"none\"\n[sensors]\narrangement = \"low-side-shunts\"\ngain_error = \"1 %\"\n[detector]\nmethod = \"six-pulse\"\n";
    let mut scenario = scenario(text, &[]);
    scenario.motor = scenario.motor.linearised();
    let ends = ends(&scenario, 200);
    assert!(ends.open > 150 && ends.found == 0, "{ends:?}");
}

/// One shunt in the link reads the current of the single leg in all six directions, by one gain and one offset, which divide out. Sensors of
/// each phase do not: gains of 1 % on a motor whose saliency is a quarter turn the axis by up to 1 %/0.25/2 rad.
#[test]
fn law_gain_and_offset_of_one_shunt_in_the_link_cost_nothing() {
    let text = "errors = \"none\"\n[sensors]\ngain_error = \"1 %\"\noffset = \"40 mA\"\n[detector]\nmethod = \"six-pulse\"\n";
    let [link, phases] = ["dc-link-shunt", "three-in-line"]
        .map(|place| scenario(text, &[&format!("sensors.arrangement={place}")]));
    let mut exact = link.clone();
    (exact.sensors.gain_error, exact.sensors.offset) = (0.0, 0.0);
    let [link, exact, phases] = [link, exact, phases].map(|scenario| ends(&scenario, 100));
    assert_eq!((link.wrong, link.failed, link.found + link.open), (0, 0, 100), "{link:?}");
    assert!(link.rms < 1.02 * exact.rms + 1e-3, "{link:?} {exact:?}");
    assert!(phases.rms > 3.0 * link.rms, "{link:?} {phases:?}");
}

/// With the errors of a drive: no wrong pole, and an axis better than that of three sensors.
#[test]
fn law_one_shunt_in_the_link_serves_sampled_pulses() {
    let method = "detector.method=six-pulse";
    for errors in ["default", "field"] {
        let text = format!("errors = \"{errors}\"");
        let [link, phases] = ["dc-link-shunt", "three-in-line"]
            .map(|place| ends(&scenario(&text, &[method, &format!("sensors.arrangement={place}")]), 150));
        assert_eq!((link.wrong, link.failed), (0, 0), "{errors}: {link:?}");
        assert!(link.found > 120 && link.rms < 0.7 * phases.rms, "{errors}: {link:?} {phases:?}");
    }
}
