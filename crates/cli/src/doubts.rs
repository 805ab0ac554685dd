//! Values that can be simulated, but that hardly anybody means: a line of warning each, before the first trial.

use standstill_plant::Motor;
use standstill_quantity::listed;
use standstill_scenario::Scenario;

use crate::host;
use crate::terminal::tell;

/// A value, what is unusual, and compared with what.
struct Doubt {
    key: &'static str,
    value: f64,
    unit: &'static str,
    /// More than this share of `of` is doubtful.
    share: f64,
    of: (f64, &'static str),
}

/// Says on standard error what is doubtful about a scenario. A host has other ways to look at its scenario.
pub fn warn<S>(scenario: &Scenario<S>) {
    if host::current().is_none() {
        for doubt in of(scenario) {
            tell(&format!("warning: {doubt}"));
        }
    }
}

/// What is hardly meant of a motor's numbers, with the slip that would explain it.
pub fn of_motor(motor: &Motor) -> Option<String> {
    motor.doubtful().map(|doubtful| format!("{}: {}", motor.name, doubtful.said()))
}

/// What is doubtful.
pub fn of<S>(scenario: &Scenario<S>) -> Vec<String> {
    let (motor, drive, sensors) = (&scenario.motor, &scenario.drive, &scenario.sensors);
    let rated = (motor.rated_current, "the motor's rated current of");
    let link = (drive.link.voltage, "the DC link of");
    let one = (1.0, "");
    let carrier = (drive.carrier_period.seconds(), "the carrier's period of");
    let usual_link = (motor.dc_link.unwrap_or(drive.link.voltage), "the motor's own DC link of");
    let devices = &drive.bridge.devices;
    let doubt = |key, value, unit, share, of| Doubt { key, value, unit, share, of };
    let mut doubts = vec![
        doubt("sensors.noise", sensors.noise, "A", 0.2, rated),
        doubt("sensors.offset", sensors.offset, "A", 0.2, rated),
        doubt("sensors.gain_error", sensors.gain_error, "", 0.2, one),
        doubt("sensors.jitter", sensors.jitter.seconds(), "s", 0.2, carrier),
        doubt("sensors.sample_delay", sensors.sample_delay.seconds(), "s", 0.5, carrier),
        doubt("sensors.dc_link_noise", sensors.dc_link.noise, "V", 0.2, link),
        doubt("sensors.dc_link_offset", sensors.dc_link.offset, "V", 0.2, link),
        doubt("sensors.dc_link_gain_error", sensors.dc_link.gain_error, "", 0.2, one),
        doubt("inverter.dead_time", drive.dead_time.seconds(), "s", 0.2, carrier),
        doubt("inverter.delay_mismatch", drive.delay_mismatch, "s", 0.1, carrier),
        doubt("inverter.switch_drop", devices.switch_drop, "V", 0.2, link),
        doubt("inverter.diode_drop", devices.diode_drop, "V", 0.2, link),
        doubt("inverter.switch_resistance", devices.switch_resistance * rated.0, "V", 0.2, link),
        doubt("inverter.diode_resistance", devices.diode_resistance * rated.0, "V", 0.2, link),
        doubt("inverter.ripple", drive.link.ripple, "", 0.5, one),
        doubt("inverter.dc_link", drive.link.voltage, "V", 5.0, usual_link),
    ];
    doubts.retain(|doubt| doubt.value > doubt.share * doubt.of.0);
    let mut said: Vec<String> = of_motor(motor).into_iter().chain(doubts.iter().map(Doubt::said)).collect();
    if let Some(adc) = sensors.adc {
        let reach = listed(&[adc.high], "A");
        if adc.high < 0.5 * rated.0 {
            let rated = listed(&[rated.0], "A");
            said.push(format!(
                "sensors.range is {reach}: currents beyond are cut off, and the motor is rated for {rated}"
            ));
        } else if adc.high > 100.0 * rated.0 {
            said.push(format!(
                "sensors.range is {reach}, {:.0} times the motor's rated current",
                adc.high / rated.0
            ));
        }
    }
    said
}

impl Doubt {
    fn said(&self) -> String {
        let Self { key, value, unit, of: (whole, name), .. } = *self;
        let times = value / whole;
        let times = if times < 1.0 { format!("{:.0} %", 100.0 * times) } else { format!("{times:.1} times") };
        if name.is_empty() {
            return format!("{key} is {:.0} %", 100.0 * value);
        }
        let drop = if key.ends_with("_resistance") { "drops " } else { "is " };
        let at = if key.ends_with("_resistance") { " at rated current" } else { "" };
        format!("{key} {drop}{}{at}, {times} of {name} {}", listed(&[value], unit), listed(&[whole], unit))
            .replace("times of", "times")
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use standstill_plant::built_in_names;
    use standstill_scenario::Document;

    use super::*;

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
                "[inverter]\nswitch_drop = \"200 V\"",
                ["inverter.switch_drop is 200 V", "36 % of the DC link of 550 V"],
            ),
        ] {
            let found = doubts(text);
            assert_eq!(found.len(), 1, "{text}: {found:?}");
            assert!(parts.iter().all(|part| found[0].contains(part)), "{}", found[0]);
        }
    }
}
