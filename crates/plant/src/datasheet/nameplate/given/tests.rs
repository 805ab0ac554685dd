//! Numbers given otherwise come to those of a phase.

use crate::{DataSheet, Motor};

/// A sheet with these lines in place of those of a phase.
fn sheet(lines: &str) -> Result<Motor, String> {
    let phase = [
        "resistance = 0.3816",
        "L_d = 180e-6",
        "L_q = 200e-6",
        "magnet_flux = 6.4e-3",
        "rated_current = 7.1",
    ];
    let group = |key: &str| super::GROUPS.iter().position(|group| group.keys().any(|way| way.contains(&key)));
    let stated: Vec<_> = lines.lines().map(|line| group(line.split(' ').next().expect("a key"))).collect();
    let rest: Vec<&str> = phase
        .into_iter()
        .filter(|line| !stated.contains(&group(line.split(' ').next().expect("a key"))))
        .collect();
    let text = format!("[nameplate]\npole_pairs = 4\ndc_link = 24\n{}\n{lines}\n", rest.join("\n"));
    DataSheet::parse("own.toml", &text).and_then(|sheet| sheet.motor()).map_err(|error| error.to_string())
}

fn near(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
}

#[test]
fn analytic_voltage_and_speed_constants_make_the_flux_that_turns_a_shaft_so() {
    let flux = |line: &str| sheet(line).expect("a motor").magnet_flux;
    // 1,000 rpm are 418.879 rad/s of four pole pairs.
    let omega = 4.0 * 2.0 * std::f64::consts::PI * 1000.0 / 60.0;
    for (key, share) in [
        ("Ke_phase_peak", 1.0),
        ("Ke_phase_rms", 0.5_f64.sqrt()),
        ("Ke_line_peak", 3.0_f64.sqrt()),
        ("Ke_line_rms", 1.5_f64.sqrt()),
    ] {
        near(flux(&format!("{key} = \"{} V/krpm\"", 6.4e-3 * omega * share)), 6.4e-3);
    }
    // At Kv revolutions per minute the peak between two terminals is one volt.
    let kv = 150.0;
    near(flux("Kv = \"150 rpm/V\"") * omega * kv / 1000.0 * 3.0_f64.sqrt(), 1.0);
    // ODrive's torque constant, 8.27 / Kv per ampere of a phase's peak.
    assert!((1.5 * 4.0 * flux("Kv = 150") * kv - 8.27).abs() < 0.005);
    near(flux("vesc_lambda = \"3.4 mWb\""), 3.4e-3);
    near(flux("Ke_line_peak = \"4.64 mV/rpm\""), flux("Ke_line_peak = 4.64"));
}

#[test]
fn cross_a_makers_voltage_constant_is_the_flux_that_a_drive_measured() {
    // Teknic M-2310P-LN-04K: 4.64 V/krpm peak between two terminals by MathWorks, 0.03966 V/Hz by Texas Instruments' identification.
    let flux = sheet("Ke_line_peak = \"4.64 V/krpm\"").expect("a motor").magnet_flux;
    assert!((flux / (0.039_664 / (2.0 * std::f64::consts::PI)) - 1.0).abs() < 0.02, "{flux}");
}

#[test]
fn analytic_values_between_terminals_and_of_a_vesc_are_those_of_a_phase() {
    let lines = sheet(
        "resistance_line_to_line = \"0.1 Ω\"\nL_line_to_line_min = \"40 uH\"\nL_line_to_line_max = \"60 uH\"\nrated_current_rms = \"10 A\"",
    );
    let motor = lines.expect("a motor");
    near(motor.resistance, 0.05);
    near(motor.winding.d_axis_inductance(), 20e-6);
    near(motor.winding.q_axis_inductance(), 30e-6);
    near(motor.rated_current, 200.0_f64.sqrt());
    // L = (L_d + L_q)/2 = 14 µH, L_q − L_d = 4 µH.
    let vesc = sheet(
        "vesc_R = \"18 mΩ\"\nvesc_L = \"14 uH\"\nvesc_ld_lq_diff = \"4 uH\"\nvesc_lambda = \"3.4 mWb\"",
    )
    .expect("a motor");
    near(vesc.resistance, 0.018);
    near(vesc.winding.d_axis_inductance(), 12e-6);
    near(vesc.winding.q_axis_inductance(), 16e-6);
    let one = sheet("L_line_to_line = \"50 uH\"").expect("a motor");
    near(one.winding.d_axis_inductance(), 25e-6);
    near(one.winding.q_axis_inductance(), 25e-6);
}

#[test]
fn law_what_is_given_twice_or_wrong_is_refused_by_its_keys() {
    let refused = |lines: &str| sheet(lines).expect_err("must be refused");
    for (lines, message) in [
        (
            "magnet_flux = \"6 mWb\"\nKv = \"150 rpm/V\"",
            "line 9, `Kv`: gives the magnet's flux, as `magnet_flux` does: keep one of them",
        ),
        ("Kv = 150\nKe_line_rms = 3", "`Ke_line_rms`: gives the magnet's flux, as `Kv` does"),
        ("L_d = 1e-4\nL_q = 1e-4\nvesc_L = 1e-4", "`vesc_L`: gives the inductances, as `L_d` does"),
        ("resistance = 1\nresistance_line_to_line = 2", "gives the resistance, as `resistance` does"),
        ("rated_current = 1\nrated_current_rms = 2", "gives the rated current"),
        ("Kv = \"150 V\"", "`150 V` is not a finite number in rpm/V"),
        (
            "Ke = \"4.6 V/krpm\"",
            "a voltage constant is Ke_line_peak, Ke_line_rms, Ke_phase_peak or Ke_phase_rms",
        ),
        ("L_line_to_line_min = 1e-4", "`L_line_to_line_max` is missing"),
        ("L_line_to_line_min = 2e-4\nL_line_to_line_max = 1e-4", "must be at least L_line_to_line_min"),
        ("vesc_L = 1e-4\nvesc_ld_lq_diff = 3e-4", "less than twice vesc_L"),
    ] {
        let error = refused(lines);
        assert!(
            error.contains(message) && error.starts_with("own.toml: [nameplate]: "),
            "{message}: {error}"
        );
        // What stands for a wrong number is not complained of.
        assert!(
            !error.contains("`magnet_flux` is missing") && !error.contains("`L_d` is missing"),
            "{error}"
        );
    }
}

#[test]
fn law_a_converted_number_is_not_called_left_out_and_says_what_it_is_of() {
    let text = "[nameplate]\npole_pairs = 7\nresistance_line_to_line = { value = \"80 mΩ\", source = \"measured\", reason = \"22 °C\" }\nL_line_to_line = \"30 uH\"\nKv = \"900 rpm/V\"\nrated_current = \"20 A\"\ndc_link = \"12 V\"\n";
    let sheet = DataSheet::parse("own.toml", text).expect("a sheet");
    let assumed: Vec<&str> = sheet.assumed().iter().map(|entry| entry.key.as_str()).collect();
    assert!(
        !assumed.iter().any(|key| key.contains("flux") || key.contains("L_") || key.contains("resistance")),
        "{assumed:?}"
    );
    let entry = |key: &str| sheet.entries().into_iter().find(|entry| entry.key == key).expect("an entry");
    let flux = entry("nameplate.magnet_flux");
    assert_eq!(
        (flux.source.to_string().as_str(), flux.reason.as_str()),
        ("inferred", "Kv = 900 rpm/V, 60 / (2π √3 p Kv)")
    );
    let resistance = entry("nameplate.resistance");
    assert_eq!(
        (resistance.source.to_string().as_str(), resistance.reason.as_str()),
        ("measured", "half of 80 mΩ between two terminals; 22 °C")
    );
}
