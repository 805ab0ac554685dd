//! Keys of switches and sensors.

use standstill_interface::Nanos;
use standstill_inverter::DeviceKind;
use standstill_sim::{PickUp, SensorSettings};

use super::{error, scenario};
use crate::ErrorSet;

#[test]
fn law_drives_of_at_most_60_volts_have_mosfets_unless_told_otherwise() {
    let s = scenario("motor = \"outrunner\"");
    let devices = s.drive.bridge.devices;
    assert_eq!((devices.kind, devices.switch_drop), (DeviceKind::Mosfet, 0.0));
    // 0.1 V at rated current. The nameplate has the same drop for both directions while a gate is on.
    assert!((devices.switch_resistance * s.motor.rated_current - 0.1).abs() < 1e-12);
    let plate = s.nameplate();
    assert_eq!([plate.switch_drop, plate.reverse_drop], [[0.0, devices.switch_resistance]; 2]);
    assert_eq!(plate.diode_drop, [0.8, devices.diode_resistance]);
    // The kind of switches follows from the motor's nominal DC-link voltage, not from that of the drive.
    let low = scenario("[inverter]\ndc_link = \"48 V\"");
    assert_eq!((low.drive.bridge.devices.kind, low.drive.link.voltage), (DeviceKind::Igbt, 48.0));
    assert_eq!(low.nameplate().reverse_drop, low.nameplate().diode_drop);
    let given = scenario("motor = \"outrunner\"\n[inverter]\ndevices = \"igbt\"\nswitch_drop = \"1.2 V\"");
    assert_eq!(
        (given.drive.bridge.devices.kind, given.drive.bridge.devices.switch_drop),
        (DeviceKind::Igbt, 1.2)
    );
    let given = scenario("[inverter]\ndevices = \"mosfet\"\nchannel_resistance = \"30 mΩ\"");
    assert_eq!(given.drive.bridge.devices.switch_resistance, 0.03);
}

#[test]
fn law_a_motion_that_the_state_of_the_rotor_cannot_have_is_refused() {
    for (text, parts) in [
        ("rotor.speed = \"5 rpm\"", ["`rotor.speed`", "a rotor that is held", "\"driven\""]),
        ("rotor.acceleration = \"5 rpm/s\"", ["`rotor.acceleration`", "a rotor that is held", "\"driven\""]),
        (
            "rotor.state = \"free\"\nrotor.acceleration = \"5 rpm/s\"",
            ["line 2: `rotor.acceleration`", "a rotor that is free", "\"driven\""],
        ),
        (
            "rotor.state = \"driven\"\nrotor.acceleration = \"5 rpm\"",
            ["line 2: `rotor.acceleration`", "rpm", "rpm/s"],
        ),
    ] {
        let message = error(text);
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    let scenario =
        scenario("rotor = { state = \"driven\", speed = \"-5 rpm\", acceleration = \"60 rpm/s\" }");
    let case = scenario.case(0);
    // Four pole pairs.
    let rpm = 4.0 * std::f64::consts::TAU / 60.0;
    assert!((case.start_speed + 5.0 * rpm).abs() < 1e-12 && (case.acceleration - 60.0 * rpm).abs() < 1e-12);
}

#[test]
fn law_keys_of_the_other_kind_of_switch_are_refused() {
    for (text, parts) in [
        (
            "[inverter]\nchannel_resistance = \"5 mΩ\"",
            ["line 2", "`inverter.channel_resistance`", "\"mosfet\""],
        ),
        (
            "motor = \"gimbal\"\n[inverter]\nswitch_drop = \"1 V\"",
            ["line 3", "`inverter.switch_drop`", "\"igbt\""],
        ),
        (
            "[inverter]\ndevices = \"mosfet\"\nchannel_resistance = \"50 mΩ\"",
            ["line 3", "`inverter.channel_resistance`", "at most 40.000 mΩ"],
        ),
        ("[inverter]\ndevices = \"gan\"", ["line 2", "`inverter.devices`", "igbt, mosfet"]),
        ("[sensors]\nbandwidth_tolerance = \"95 %\"", ["line 2", "`sensors.bandwidth_tolerance`", "0.9"]),
        ("[sensors]\nskew = \"1 ms\"", ["line 2", "`sensors.skew`", "100 us"]),
        ("[sensors]\npick_up_decay = \"1 ms\"", ["line 2", "`sensors.pick_up_decay`", "100 us"]),
        (
            "[sensors]\npick_up_frequency = \"2000 MHz\"",
            ["line 2", "`sensors.pick_up_frequency`", "1000 MHz"],
        ),
        ("[sensors]\npick_up_decay = \"1 us\"", ["line 2", "`sensors.pick_up_decay`", "`sensors.pick_up`"]),
        (
            "[sensors]\npick_up_frequency = \"1 MHz\"",
            ["line 2", "`sensors.pick_up_frequency`", "`sensors.pick_up`"],
        ),
        (
            "detector.method = \"maximum-likelihood\"\n[sensors]\nskew = \"5 us\"",
            ["sensors.skew", "half of the interval", ""],
        ),
        (
            "detector.method = \"maximum-likelihood\"\n[sensors]\npick_up = \"0.2 A\"\npick_up_decay = \"100 us\"",
            ["sensors.pick_up_decay", "a tenth of the shortest pulse", ""],
        ),
    ] {
        let message = error(text);
        for part in parts {
            assert!(message.contains(part), "{text:?} says: {message}");
        }
    }
}

#[test]
fn law_sensors_of_the_field_and_their_keys() {
    let field = scenario("errors = \"field\"");
    let default = scenario("");
    let mut without = field.drive;
    assert_eq!(without.bridge.terminal_capacitance, 0.3e-9);
    (without.bridge.terminal_capacitance, without.bridge.terminal_resistance) = (0.0, 0.0);
    assert_eq!(without, default.drive);
    assert_eq!(scenario("errors = \"field\"\ninverter.terminal_capacitance = 0").drive, default.drive);
    // The error set is the same by its name and by `ErrorSet::drive`.
    let motor = standstill_plant::built_in("paper-5k5").expect("built in");
    assert_eq!(ErrorSet::Field.drive(&motor, DeviceKind::Igbt), field.drive);
    assert!((field.drive.bridge.terminal_resistance / 1661.3 - 1.0).abs() < 1e-4, "{:?}", field.drive.bridge);
    let of = PickUp { amplitude: 0.2, decay: 0.5e-6, frequency: 5e6 };
    assert_eq!((field.sensors.bandwidth, field.sensors.skew), (Some(200e3), Nanos(500)));
    assert_eq!((field.sensors.bandwidth_tolerance, field.sensors.bandwidth_mismatch), (0.2, 0.03));
    assert_eq!(field.sensors.pick_up, Some(of));
    let keys = scenario(
        "[sensors]\nbandwidth = \"200 kHz\"\nbandwidth_tolerance = \"20 %\"\nbandwidth_mismatch = \"3 %\"\nskew = \"0.5 us\"\npick_up = \"0.2 A\"",
    );
    // Its comparators differ, too, on drives that have any.
    let keys_with = SensorSettings { comparator: field.sensors.comparator, ..keys.sensors };
    assert_eq!(keys_with, field.sensors);
    let quiet = scenario("errors = \"field\"\nsensors.pick_up = 0");
    assert_eq!(quiet.sensors.pick_up, None);
    let quick = scenario("errors = \"field\"\nsensors.bandwidth = 0");
    assert_eq!((quick.sensors.bandwidth, quick.nameplate().sensing.bandwidth), (None, None));
    // The amplitude is a share of the sensors' range.
    let small = scenario("motor = \"gimbal\"\nerrors = \"field\"");
    assert!((small.sensors.pick_up.expect("some").amplitude - 0.2 * 0.6 / 8.0).abs() < 1e-12);
}

#[test]
fn law_terminals_with_a_capacitance_have_diodes_and_what_damps_them() {
    use standstill_inverter::OpenLeg::{Diodes, Open};
    let bridge = |text: &str| scenario(&format!("errors = \"none\"\n[inverter]\n{text}")).drive.bridge;
    // In the error set "none", an idle leg is open. With a terminal capacitance, diodes limit the swing of its
    // terminal.
    assert_eq!(bridge("").open_leg, Open);
    let charged = bridge("terminal_capacitance = \"1 nF\"");
    assert_eq!(charged.open_leg, Diodes);
    // Quality factor 5, with 1.5 times the mean of L_d and L_q.
    let impedance = (1.5 * 13.8e-3 / 1e-9_f64).sqrt();
    assert!((charged.terminal_resistance / (impedance / 5.0) - 1.0).abs() < 0.01, "{charged:?}");
    // A sweep over capacitances may begin at zero, where the resistance has no effect.
    let none = bridge("terminal_capacitance = 0\nterminal_resistance = \"900 Ω\"");
    assert_eq!((none.terminal_resistance, none.open_leg), (0.0, Open));
    let given = bridge("terminal_capacitance = \"1 nF\"\nterminal_resistance = \"900 Ω\"");
    assert_eq!(given.terminal_resistance, 900.0);
    for (text, parts) in [
        (
            "[inverter]\nterminal_capacitance = \"1 nF\"\nopen_leg = \"open\"",
            ["line 3", "`inverter.open_leg`", "\"diodes\""],
        ),
        (
            "[inverter]\nterminal_resistance = \"900 Ω\"",
            ["line 2", "`inverter.terminal_resistance`", "`inverter.terminal_capacitance`"],
        ),
        (
            "[inverter]\nterminal_capacitance = 0\nterminal_resistance = \"-1 Ω\"",
            ["line 3", "`inverter.terminal_resistance`", "zero or more"],
        ),
        (
            "[inverter]\nterminal_capacitance = \"1 nF\"\nterminal_resistance = \"3 kΩ\"",
            ["line 3", "`inverter.terminal_resistance`", "with more nothing rings"],
        ),
    ] {
        let message = error(text);
        for part in parts {
            assert!(message.contains(part), "{text:?} says: {message}");
        }
    }
}

#[test]
fn law_dividers_load_terminals_with_a_capacitance_that_ring() {
    let text = |load: &str| {
        format!(
            "errors = \"field\"\n[inverter]\nterminal_capacitance = \"1 nF\"\n[sensors]\nterminals = true\nterminal_load = \"{load}\""
        )
    };
    let built = scenario(&text("1 MΩ"));
    assert_eq!((built.sensors.load(), built.drive.bridge.terminal_capacitance), (Some(1e6), 1e-9));
    // The dividers of an error set do not load terminals with a capacitance.
    assert_eq!(scenario("errors = \"field\"\n[sensors]\nterminals = true").sensors.load(), None);
    // The larger limit is named: here a thousandth of 8 A on 550 V, with a larger current on a lower link √(3 L/C).
    let message = error(&text("4 kΩ"));
    for part in [
        "line 6",
        "`sensors.terminal_load`",
        "4000 Ω",
        "at least 68750 Ω",
        "a thousandth of the rated current",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let message = error(&format!("motor = \"light-vehicle\"\n{}", text("310 Ω")));
    assert!(message.contains("310 Ω") && message.contains("√(3 L/C)"), "{message}");
}
