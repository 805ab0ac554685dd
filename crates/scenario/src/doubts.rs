//! Doubts: warnings of values that can be simulated but are probably mistakes. These are numbers that no motor has,
//! values that are a large share of their reference (such as the rated current), and keys that contradict one another.

use standstill_detect::{Check, Checks, Method, Signature, Value, keys as of_methods};
use standstill_plant::Motor;
use standstill_quantity::listed;
use standstill_sim::{Arrangement, RotorState};

use crate::keys::{Key, Usual, Values, keys};
use crate::scenario::Scenario;

/// Returns a warning if the detector assumes that the wrong pole draws more current. Such a detector reports the wrong pole in every trial.
/// Returns none if the assumption agrees with the motor's data.
///
/// ```
/// use std::path::Path;
/// use standstill_scenario::{Document, doubts};
///
/// let text = "detector = { method = \"bipolar\", signature = \"inverted\" }";
/// let document = Document::parse(Path::new("s.toml"), text)?;
/// let said = doubts::wrong_signature(&document.scenario_of(&document.motor()?)?);
/// assert!(said.is_some_and(|said| said.contains("poles are named wrongly")));
/// # Ok::<(), standstill_scenario::FileError>(())
/// ```
pub fn wrong_signature(scenario: &Scenario<Method<f64>>) -> Option<String> {
    let mut described = None;
    scenario.detector.describe(&mut |name, value| {
        if name == "signature" || name.ends_with(".signature") {
            described = Some(value.to_string());
        }
    });
    let set = Signature::ALL.into_iter().find(|of| Some(of.in_words()) == described.as_deref())?;
    let drive = scenario.nameplate();
    let known = [drive.signature, drive.pulse_signature];
    // With faults, a wrong signature may be intended.
    let contradicts = scenario.faults.is_empty()
        && set != Signature::None
        && !known.contains(&set)
        && known != [Signature::None; 2];
    contradicts.then(|| {
        let is = known.into_iter().find(|of| *of != Signature::None).unwrap_or(Signature::None);
        format!(
            "detector.signature is \"{}\" ({}), but by the motor's data {}: poles are named wrongly; without this key the signature is the motor's",
            set.name(),
            set.in_words(),
            is.in_words()
        )
    })
}

/// Returns a warning if a number in a motor's data is implausible. The warning describes the mistake that would explain the number. Returns
/// none if all numbers are plausible.
///
/// ```
/// use standstill_plant::built_in;
/// use standstill_scenario::doubts;
///
/// assert_eq!(doubts::of_motor(&built_in("paper-5k5").expect("built in")), None);
/// ```
pub fn of_motor(motor: &Motor) -> Option<String> {
    motor.doubtful().map(|doubtful| format!("{}: {}", motor.name, doubtful.said()))
}

/// Returns all warnings of a motor's data sheet, without the motor's name.
pub fn of_sheet(motor: &Motor) -> Vec<String> {
    motor.doubtful().map(|doubtful| doubtful.said()).into_iter().chain(exchanged_axes(motor)).collect()
}

/// Returns the likely meanings of a doubtful data sheet, the likeliest first. Each is a list of nameplate keys with a number and its unit.
pub fn meant(motor: &Motor) -> Vec<Vec<(&'static str, String)>> {
    let guesses = motor.doubtful().into_iter().flat_map(|doubtful| doubtful.guesses);
    let mut all: Vec<_> = guesses.map(|guess| guess.meant).collect();
    if exchanged_axes(motor).is_some() {
        let [d, q] = [motor.winding.d_axis_inductance(), motor.winding.q_axis_inductance()];
        all.push(vec![("L_d", listed(&[q], "H")), ("L_q", listed(&[d], "H"))]);
    }
    all
}

/// Returns the warnings of a scenario, one sentence for each value that is probably a mistake.
///
/// ```
/// use std::path::Path;
/// use standstill_scenario::{Document, doubts};
///
/// let document = Document::parse(Path::new("s.toml"), "sensors.noise = \"20 A\"")?;
/// let said = doubts::of(&document.scenario_of(&document.motor()?)?);
/// assert!(said[0].starts_with("sensors.noise is 20 A, 2.5 times the motor's rated current"), "{said:?}");
/// # Ok::<(), standstill_scenario::FileError>(())
/// ```
pub fn of(scenario: &Scenario<Method<f64>>) -> Vec<String> {
    let (motor, sensors) = (&scenario.motor, &scenario.sensors);
    let rated = motor.rated_current;
    let unusual = keys().filter_map(|key| unusual(scenario, key));
    let mut said: Vec<String> =
        of_sheet(motor).into_iter().map(|doubt| format!("{}: {doubt}", motor.name)).chain(unusual).collect();
    if let Some(adc) = sensors.adc {
        let reach = listed(&[adc.high], "A");
        if adc.high < 0.5 * rated {
            let rated = listed(&[rated], "A");
            said.push(format!(
                "sensors.range is {reach}: currents beyond are cut off, and the motor is rated for {rated}"
            ));
        } else if adc.high > 100.0 * rated {
            said.push(format!(
                "sensors.range is {reach}, {:.0} times the motor's rated current",
                adc.high / rated
            ));
        }
    }
    said.extend(wrong_signature(scenario));
    said.extend(short_pause(scenario));
    said.extend(unnoticed_turning(scenario));
    said.extend(short_settling(scenario));
    said
}

/// Ratio L_d/L_q above which the data sheet of a motor with a magnet may have the two axes exchanged.
const ABOVE: f64 = 1.02;

/// Returns a warning if a motor with a magnet has a larger L_d than L_q. Usually L_d is the smaller inductance of a motor with interior
/// magnets, and both inductances of a motor with surface magnets are equal.
fn exchanged_axes(motor: &Motor) -> Option<String> {
    let [d, q] = [motor.winding.d_axis_inductance(), motor.winding.q_axis_inductance()];
    (motor.has_magnet() && d > ABOVE * q).then(|| {
        format!(
            "L_d is {}, above L_q, {}: unusual beside a magnet. If the sheet has the two exchanged, an axis is found 90° off",
            listed(&[d], "H"),
            listed(&[q], "H")
        )
    })
}

/// Returns a warning if the rotor is driven, but stands still because its speed and its acceleration are zero. [`of`] does not contain this
/// warning, because a sweep over the speed may begin at zero.
///
/// ```
/// use std::path::Path;
/// use standstill_scenario::{Document, doubts};
///
/// let document = Document::parse(Path::new("s.toml"), "rotor.state = \"driven\"")?;
/// let said = doubts::standing(&document.scenario_of(&document.motor()?)?);
/// assert!(said.is_some_and(|said| said.contains("driven at 0 rpm")));
/// # Ok::<(), standstill_scenario::FileError>(())
/// ```
pub fn standing(scenario: &Scenario<Method<f64>>) -> Option<String> {
    let stands = scenario.start_speed == 0.0 && scenario.acceleration == 0.0;
    (scenario.rotor == RotorState::Driven && stands).then(|| {
        "the rotor is driven at 0 rpm, so it stands: give its motion, such as `-s rotor.speed=\"100 rpm\"`".to_owned()
    })
}

/// Returns a warning if the rotor turns, and the method has a check that would notice it, which is off.
fn unnoticed_turning(scenario: &Scenario<Method<f64>>) -> Option<String> {
    let turns = scenario.start_speed != 0.0 || scenario.acceleration != 0.0;
    let Some(Value::Checks(on)) = scenario.detector.get(&of_methods::CHECKS) else { return None };
    (turns && !on.has(Check::Turning)).then(|| {
        let all: Checks = on.with(Check::Turning);
        let list = all.iter().map(|check| format!("\"{}\"", check.name())).collect::<Vec<_>>().join(", ");
        let set = if on == Checks::NONE { "true".to_owned() } else { format!("[{list}]") };
        format!(
            "the rotor turns, and the method does not look whether it does, so that answers may be off by any angle: `-s 'detector.checks={set}'`"
        )
    })
}

/// Returns a warning if a shunt is read before its amplifier has settled. The slew rate `sensors.slew` limits the amplifier. At a switching
/// edge the current in a shunt below a leg jumps by at most the phase current. The current in a DC-link shunt may change its sign, which is
/// a jump of twice the phase current.
fn short_settling(scenario: &Scenario<Method<f64>>) -> Option<String> {
    let (sensors, dead_time) = (&scenario.sensors, scenario.drive.dead_time.seconds());
    let jump = if sensors.arrangement == Arrangement::DcLinkShunt { 2.0 } else { 1.0 };
    let needed = jump * scenario.motor.rated_current / sensors.slew;
    let believed = dead_time + sensors.settle.seconds();
    (sensors.slews() && believed < needed * (1.0 - 1e-9)).then(|| {
        let [needed, believed, least] =
            [needed, believed, needed - dead_time].map(|time| (time * 1e7 - 1e-6).ceil() / 10.0);
        format!(
            "sensors.slew is {}, by which an amplifier takes up to {needed} us after an edge at the motor's rated current, and a shunt is read after {believed} us: what is read too early is wrong, and nothing shows it; set at least `-s sensors.settle=\"{least} us\"`",
            listed(&[sensors.slew], "A/s")
        )
    })
}

/// Returns a warning if the pauses of the method `six-pulse` are too short for the current to decay.
fn short_pause(scenario: &Scenario<Method<f64>>) -> Option<String> {
    let Method::SixPulse(six) = &scenario.detector else { return None };
    let least = six.least_pause(&scenario.nameplate());
    (six.pause < least).then(|| {
        let [pause, least] = [100.0 * six.pause, (100.0 * least).ceil()];
        let seen = if six.timed { ", and no time that is read shows it" } else { "" };
        format!(
            "detector.pause is {pause:.0} % of the longest pulse, in which the current does not decay: what is left turns axis and pole of the next pulses{seen}; set at least `-s detector.pause=\"{least:.0} %\"`"
        )
    })
}

/// Returns a warning if the value of a key is too large in relation to the key's reference ([`Key::usual`]).
fn unusual(scenario: &Scenario<Method<f64>>, key: &Key) -> Option<String> {
    let (motor, drive) = (&scenario.motor, &scenario.drive);
    let value = scenario.value(key.path)?.as_float()?;
    let (share, usual) = key.usual?;
    let Values::Number { unit, .. } = key.values() else { return None };
    let link = (drive.link.voltage, "the DC link of");
    let (is, value, unit, at, (whole, name)) = match usual {
        Usual::Whole => ("is", value, unit, "", (1.0, "")),
        Usual::RatedCurrent => ("is", value, unit, "", (motor.rated_current, "the motor's rated current of")),
        Usual::Link => ("is", value, unit, "", link),
        Usual::LinkByDrop => ("drops", value * motor.rated_current, "V", " at rated current", link),
        Usual::NominalLink => {
            ("is", value, unit, "", (motor.dc_link.unwrap_or(value), "the motor's own DC link of"))
        }
        Usual::Carrier => {
            ("is", value, unit, "", (drive.carrier_period.seconds(), "the carrier's period of"))
        }
    };
    let times = value / whole;
    if times <= share {
        return None;
    }
    let path = key.path;
    if name.is_empty() {
        return Some(format!("{path} is {:.0} %", 100.0 * value));
    }
    let times = if times < 1.0 { format!("{:.0} % of", 100.0 * times) } else { format!("{times:.1} times") };
    Some(format!("{path} {is} {}{at}, {times} {name} {}", listed(&[value], unit), listed(&[whole], unit)))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::document::Document;
    use standstill_plant::built_in_names;

    fn doubts(text: &str) -> Vec<String> {
        let document = Document::parse(Path::new("s"), text).expect("TOML");
        let motor = document.motor().expect("a motor");
        of(&document.scenario_of(&motor).expect("a scenario"))
    }

    #[test]
    fn law_no_built_in_motor_and_error_set_is_doubtful() {
        for motor in built_in_names() {
            for errors in ["none", "noise", "default", "harsh", "field"] {
                let found = doubts(&format!("motor = \"{motor}\"\nerrors = \"{errors}\""));
                assert_eq!(found, [""; 0], "{motor}, {errors}");
            }
        }
    }

    #[test]
    fn law_a_signature_that_contradicts_the_motor_is_doubtful() {
        let of = |motor: &str, signature: &str| {
            doubts(&format!(
                "motor = \"{motor}\"\n[detector]\nmethod = \"bipolar\"\nsignature = \"{signature}\"\n"
            ))
        };
        let said = of("paper-5k5", "inverted");
        assert!(
            said.len() == 1 && said[0].contains("north draws") && said[0].contains("south draws"),
            "{said:?}"
        );
        for signature in ["normal", "none"] {
            assert_eq!(of("paper-5k5", signature), [""; 0]);
        }
    }

    #[test]
    fn law_a_driven_rotor_that_stands_is_doubtful() {
        let of = |rotor: &str| {
            let document = Document::parse(Path::new("s"), &format!("[rotor]\n{rotor}")).expect("TOML");
            standing(&document.scenario_of(&document.motor().expect("a motor")).expect("a scenario"))
        };
        assert!(of("state = \"driven\"").is_some_and(|said| said.contains("-s rotor.speed=")));
        for moves in ["speed = \"1 rpm\"", "acceleration = \"60 rpm/s\""] {
            assert_eq!(of(&format!("state = \"driven\"\n{moves}")), None);
        }
        assert_eq!(of("state = \"free\""), None);
    }

    #[test]
    fn law_a_rotor_that_turns_is_doubtful_where_no_check_would_notice_it() {
        let of = |method: &str, rotor: &str, checks: &str| {
            doubts(&format!("[rotor]\n{rotor}\n[detector]\nmethod = \"{method}\"\n{checks}\n"))
        };
        let [driven, free] =
            ["driven", "free"].map(|state| format!("state = \"{state}\"\nspeed = \"10 rpm\""));
        for method in ["hfi-rotating", "hfi-pulsating", "subdivision", "line-inductance", "six-pulse"] {
            for rotor in [&driven, &free] {
                let said = of(method, rotor, if method == "six-pulse" { "checks = false" } else { "" });
                assert!(said.len() == 1 && said[0].starts_with("the rotor turns"), "{method}: {said:?}");
                // The value that it names is one that the method has, and is enough.
                let (_, value) = said[0].split_once("detector.checks=").expect("a key");
                let (value, _) = value.split_once('\'').expect("its end");
                assert_eq!(of(method, rotor, &format!("checks = {value}")), [""; 0], "{value}");
            }
            assert_eq!(of(method, "state = \"free\"", ""), [""; 0]);
        }
        for method in ["bipolar", "maximum-likelihood", "dc-alignment"] {
            assert_eq!(of(method, &driven, ""), [""; 0], "{method}");
        }
        assert_eq!(of("bipolar", &driven, "checks = [\"link\"]").len(), 1);
    }

    #[test]
    fn law_an_amplifier_that_slews_longer_than_it_is_waited_for_is_doubtful() {
        let slews = |arrangement: &str, slew: &str, settle: &str| {
            doubts(&format!(
                "errors = \"default\"\nsensors.arrangement = \"{arrangement}\"\nsensors.slew = \"{slew}\"\nsensors.settle = \"{settle}\""
            ))
        };
        // 16 A by 1 MA/s are 16 us, of which the dead time is 2 us; below the legs half of it.
        for (arrangement, needed, least, less) in [
            ("dc-link-shunt", "up to 16 us", "14 us", "13.8 us"),
            ("low-side-shunts", "up to 8 us", "6 us", "5.8 us"),
        ] {
            let found = slews(arrangement, "1 MA/s", "3 us");
            let [found] = &found[..] else { panic!("{found:?}") };
            for part in [needed, "after 5 us", &format!("-s sensors.settle=\"{least}\""), "1 MA/s"] {
                assert!(found.contains(part), "{found}");
            }
            assert!(slews(arrangement, "1 MA/s", least).is_empty());
            assert!(!slews(arrangement, "1 MA/s", less).is_empty());
            assert!(slews(arrangement, "4 MA/s", "3 us").is_empty());
            assert!(slews(arrangement, "0", "3 us").is_empty());
        }
    }

    #[test]
    fn regress_a_flux_without_its_m_is_named_with_the_one_that_was_meant() {
        let plate = "pole_pairs = 7, resistance = \"21 mΩ\", L_d = \"16 uH\", L_q = \"20 uH\", rated_current = \"60 A\", dc_link = \"48 V\", saturation = \"5 %\"";
        let of = |flux: &str| {
            doubts(&format!("[motor]\nname = \"own\"\nnameplate = {{ {plate}, magnet_flux = \"{flux}\" }}\n"))
        };
        assert_eq!(of("5.2 mWb"), [""; 0]);
        let said = &of("5.2 Wb")[0];
        assert!(said.starts_with("own: ") && said.contains("did you mean magnet_flux 5.2 mWb?"), "{said}");
    }

    #[test]
    fn law_a_pause_in_which_the_current_does_not_decay_is_named_with_the_one_that_does() {
        let of = |pause: &str| {
            doubts(&format!(
                "errors = \"none\"\n[sensors]\ntimer = \"0.32 us\"\n[detector]\nmethod = \"six-pulse\"\npause = \"{pause}\"\n"
            ))
        };
        let said = of("45 %");
        assert!(said.len() == 1 && said[0].starts_with("detector.pause is 45 %"), "{said:?}");
        let (_, set) = said[0].split_once("detector.pause=\"").expect("what to set");
        let set = set.trim_end_matches("\"`");
        assert_eq!(of(set), [""; 0], "{set}");
        let share: f64 = set.trim_end_matches(" %").parse().expect("a share");
        assert_eq!(of(&format!("{} %", share - 1.0)).len(), 1, "{set}");
    }

    #[test]
    fn regress_a_channel_that_takes_a_large_share_of_the_link_is_named() {
        let drops =
            "[inverter]\ndevices = \"mosfet\"\ndc_link = 150\ndiode_drop = 100\nchannel_resistance = 5";
        let found = doubts(drops);
        let named = found.iter().any(|doubt| doubt.contains("inverter.channel_resistance drops 40 V"));
        assert!(named, "{found:?}");
    }

    #[test]
    fn law_absurd_values_are_named_with_what_they_are_compared_with() {
        for (text, parts) in [
            (
                "[sensors]\nnoise = \"20 A\"",
                ["sensors.noise is 20 A", "2.5 times the motor's rated current of 8 A"],
            ),
            ("[sensors]\ngain_error = \"40 %\"", ["sensors.gain_error is", "40 %"]),
            (
                "[inverter]\ndead_time = \"21 us\"",
                ["inverter.dead_time is 21 µs", "21 % of the carrier's period of 100 µs"],
            ),
            ("[sensors]\nrange = \"2 A\"\nbits = 12", ["sensors.range is 2 A", "rated for 8 A"]),
            (
                "[inverter]\nswitch_drop = \"90 V\"\ndc_link = \"250 V\"",
                ["inverter.switch_drop is 90 V", "36 % of the DC link of 250 V"],
            ),
        ] {
            let found = doubts(text);
            assert_eq!(found.len(), 1, "{text}: {found:?}");
            assert!(parts.iter().all(|part| found[0].contains(part)), "{}", found[0]);
        }
    }
}
