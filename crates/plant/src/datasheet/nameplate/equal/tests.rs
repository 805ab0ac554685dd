//! Each way of giving a number comes to the others, and back.

use std::f64::consts::SQRT_2;

use super::*;

fn of(given: &[(&str, &str)]) -> Result<Vec<EqualNumber>, String> {
    equal_numbers(&table(given.iter().copied())).map_err(|error| error.to_string())
}

fn value(all: &[EqualNumber], key: &str) -> f64 {
    all.iter().find(|number| number.key == Some(key)).expect(key).value
}

#[test]
fn law_each_way_gives_the_same_numbers_as_any_other() {
    let given = [
        ("pole_pairs", "7"),
        ("resistance", "40 mΩ"),
        ("L_d", "13.5 uH"),
        ("L_q", "16 uH"),
        ("magnet_flux", "1 mWb"),
        ("rated_current", "20 A"),
    ];
    let all = of(&given).expect("numbers");
    let ways: [&[&str]; 16] = [
        &["resistance_delta"],
        &["rated_current_delta"],
        &["Kt_peak"],
        &["Kt_rms"],
        &["resistance_line_to_line"],
        &["vesc_R"],
        &["L_line_to_line_min", "L_line_to_line_max"],
        &["vesc_L", "vesc_ld_lq_diff"],
        &["vesc_lambda"],
        &["Kv"],
        &["Ke_line_peak"],
        &["Ke_line_rms"],
        &["Ke_phase_peak"],
        &["Ke_phase_rms"],
        &["rated_current_rms"],
        &["L_d", "L_q"],
    ];
    for way in ways {
        let texts: Vec<String> = way.iter().map(|key| value(&all, key).to_string()).collect();
        let mut given: Vec<(&str, &str)> =
            way.iter().copied().zip(texts.iter().map(String::as_str)).collect();
        given.push(("pole_pairs", "7"));
        let back = of(&given).expect("numbers");
        assert!(back.len() >= 3, "{way:?}");
        for number in &back {
            let Some(key) = number.key else { continue };
            let expected = value(&all, key);
            assert!(
                (number.value / expected - 1.0).abs() < 1e-4,
                "{way:?}: {key} {} {expected}",
                number.value
            );
        }
    }
}

#[test]
fn analytic_a_hobby_motor_of_900_rpm_per_volt() {
    // ψ = 60 / (2π √3 p Kv); torque per ampere of a phase's peak 8.27 / Kv, as ODrive has it.
    let all = of(&[("pole_pairs", "7"), ("Kv", "900 rpm/V")]).expect("numbers");
    let flux = 60.0 / (2.0 * PI * 3.0_f64.sqrt() * 7.0 * 900.0);
    assert!((value(&all, "magnet_flux") / flux - 1.0).abs() < 1e-5);
    let torque = all.iter().find(|number| number.meaning.contains("ODrive")).expect("a torque constant");
    assert!((torque.value * 900.0 - 8.27).abs() < 0.005, "{}", torque.value);
    // A resistance in delta: two terminals see it parallel to two in series, 2/3.
    let all = of(&[("resistance_line_to_line", "80 mΩ")]).expect("numbers");
    assert!((value(&all, "resistance_delta") * 2.0 / 3.0 - 80e-3).abs() < 1e-9);
}

#[test]
fn analytic_a_winding_in_delta_is_the_star_that_the_terminals_see() {
    // Between two terminals a winding is parallel to the two others in series: 2/3 of it, which is twice a phase of the star. Each terminal
    // feeds two windings whose currents are 120° apart: √3 of one's.
    let given = [("resistance_delta", "120 mΩ"), ("L_delta", "60 uH"), ("rated_current_delta", "10 A")];
    let all = of(&given).expect("numbers");
    for (key, expected) in [
        ("resistance_line_to_line", 80e-3),
        ("L_line_to_line", 40e-6),
        ("L_delta", 60e-6),
        ("rated_current", 10.0 * 3.0_f64.sqrt()),
    ] {
        assert!((value(&all, key) / expected - 1.0).abs() < 1e-5, "{key}");
    }
}

#[test]
fn analytic_a_torque_constant_is_the_flux_whose_power_it_turns_into() {
    // 14 A rms in phase with the voltage of 7 pole pairs at 3,000 rpm: the power of the three phases is torque times speed.
    let all = of(&[("pole_pairs", "7"), ("Kt_rms", "13 mN m/A")]).expect("numbers");
    let power = 13e-3 * 14.0 * 3000.0 * 2.0 * PI / 60.0;
    let volts = value(&all, "Ke_phase_rms") * 3.0;
    assert!((3.0 * volts * 14.0 / power - 1.0).abs() < 1e-5);
    assert!((value(&all, "Kt_peak") * SQRT_2 / 13e-3 - 1.0).abs() < 1e-5);
}

#[test]
fn regress_a_reluctance_motor_s_inductances_between_terminals_are_not_swapped_on_the_way_back() {
    // Its d axis has the larger inductance; the keys of terminals take the least for L_d.
    let all = of(&[("L_d", "10.1 mH"), ("L_q", "4.1 mH"), ("magnet_flux", "0 Wb")]).expect("numbers");
    let keys: Vec<&str> = all.iter().filter_map(|number| number.key).collect();
    assert!(!keys.iter().any(|key| key.starts_with("L_line_to_line")), "{keys:?}");
    assert!(
        all.iter().any(|number| number.meaning.contains("(along q)") && (number.value - 8.2e-3).abs() < 1e-9)
    );
}

#[test]
fn regress_numbers_that_say_nothing_are_refused_by_name() {
    for (given, said) in [
        (vec![("Kv", "900 rpm/V")], "`pole_pairs` is missing"),
        (vec![("Ke", "4.6 V/krpm")], "Ke_line_peak, Ke_line_rms, Ke_phase_peak or Ke_phase_rms"),
        (vec![("Kt_rms", "12 mN m/A")], "`pole_pairs` is missing"),
        (vec![("Kt", "0.1 N m/A")], "Kt_peak or Kt_rms, per ampere of a phase's peak or rms"),
        (vec![("colour", "red")], "known are pole_pairs"),
        (vec![], "no number to convert"),
        (vec![("pole_pairs", "7")], "no number to convert"),
        (vec![("resistance", "3 mH")], "not a finite number in Ω"),
        (vec![("resistance", "3 mΩ"), ("vesc_R", "3 mΩ")], "keep one of them"),
        (vec![("L_d", "3 mH")], "`L_q` is missing"),
        (vec![("pole_pairs", "2.5"), ("Kv", "900")], "whole number from 1 to 200"),
        (vec![("resistance", "-1 Ω")], "must be positive"),
    ] {
        let said_so = of(&given).expect_err(said);
        assert!(
            said_so.contains(said)
                || said == "known are pole_pairs" && said_so.contains("which are pole_pairs"),
            "{given:?}: {said_so}"
        );
    }
}

/// A form that offers them all: each has words, and each way alone is enough, or needs pole pairs.
#[test]
fn law_each_convertible_key_is_taken_with_those_of_its_way_alone() {
    let keys = convertible_keys();
    let known: Vec<&str> = super::super::given::keys().collect();
    assert_eq!(keys.iter().skip(1).map(|of| of.key).collect::<Vec<_>>(), known);
    for way in 1..=keys.last().expect("keys").way {
        let own: Vec<&ConvertibleKey> = keys.iter().filter(|of| of.way == way).collect();
        let mut given: Vec<(&str, &str)> = own.iter().map(|of| (of.key, "1")).collect();
        given.push(("pole_pairs", "4"));
        let all = of(&given).expect("numbers");
        assert!(all.iter().all(|number| number.quantity == own[0].quantity), "{given:?}");
        for key in own {
            assert!(all.iter().any(|number| number.key == Some(key.key) && number.meaning == key.meaning));
        }
    }
}

/// 52 came back as 51.9998, because the flux between was rounded to six digits.
#[test]
fn regress_a_number_comes_back_as_it_was_given() {
    for key in ["Ke_line_rms", "Ke_phase_peak", "Kv", "Kt_rms", "rated_current_rms", "resistance_delta"] {
        for given in ["52", "0.7", "1234.5"] {
            let all = of(&[(key, given), ("pole_pairs", "3")]).expect("numbers");
            let found = value(&all, key);
            let given: f64 = given.parse().expect("a number");
            assert!((found / given - 1.0).abs() < 1e-12, "{key} {given}: {found}");
        }
    }
}
