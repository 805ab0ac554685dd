//! Data sheets that are no motor, and what is said of them.

use std::fmt::Write as _;

use standstill_interface::Dq;
use standstill_plant::{DataSheet, Magnetics, built_in};

/// The text of a built-in data sheet.
fn built_in_text(name: &str) -> &'static str {
    match name {
        "reluctance-6k7" => include_str!("../motors/reluctance-6k7.toml"),
        _ => include_str!("../motors/paper-5k5.toml"),
    }
}

/// What is said of a built-in data sheet after a change of its text.
fn refused(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    let sheet = DataSheet::parse("own.toml", &text.replacen(from, to, 1)).expect("its keys are right");
    sheet.motor().expect_err("must be refused").to_string()
}

#[test]
fn regress_the_harmonic_that_is_too_large_is_the_one_named() {
    let text = include_str!("../motors/paper-5k5.toml");
    let entry = |key: &str, value: &str| {
        format!("{key} = {{ value = \"{value}\", source = \"assumed\", reason = \"a test\" }}\n")
    };
    let with = |lines: String| refused(text, "[rotor]", &format!("[harmonics]\n{lines}\n[rotor]"));
    let error = with(entry("asymmetry", "20 mH"));
    assert!(
        error.starts_with("own.toml: `harmonics.asymmetry` is 20 mH") && error.contains("half"),
        "{error}"
    );
    let error = with(entry("inductance_4", "9 mH") + &entry("asymmetry", "0.1 mH"));
    assert!(error.starts_with("own.toml: `harmonics.inductance_4` is 9 mH"), "{error}");
    let error = with(entry("inductance_4", "0.1 mH") + &entry("asymmetry", "-20 mH"));
    assert!(error.starts_with("own.toml: `harmonics.asymmetry` is -20 mH"), "{error}");
}

#[test]
fn law_a_map_says_once_whether_there_is_a_magnet() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = |name: &str, current: f64, trace: f64| {
        let motor = built_in(name).expect("built in");
        let axis = || (-8..=8).map(|k| 1.5 * motor.rated_current * f64::from(k) / 8.0);
        let flux = |d, q| motor.magnetics.core().flux_at(Dq::new(d, q)).expect("convex");
        let largest = flux(1.5 * motor.rated_current, 0.0).d;
        let mut text = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n".to_owned();
        for (d, q) in axis().flat_map(|d| axis().map(move |q| (d, q))) {
            let Dq { d: psi_d, q: psi_q } = flux(d, q);
            let psi_d = psi_d + trace * largest;
            let _ = writeln!(text, "{},{},{psi_d},{psi_q}", d * current, q * current);
        }
        std::fs::write(folder.path().join("map.csv"), text).expect("written");
        let sheet = built_in_text(name);
        let (head, rest) = sheet.split_once("[saturation]").expect("a table");
        let kept: Vec<&str> = head
            .lines()
            .filter(|line| {
                !["mean_ind", "saliency", "leakage", "magnet_f"].iter().any(|key| line.starts_with(key))
            })
            .collect();
        let file = "[map]\nfile = { value = \"map.csv\", source = \"given\", reason = \"a test\" }\n\n";
        let rotor = &rest[rest.find("[rotor]").expect("a table")..];
        (kept.join("\n") + "\n\n" + file + rotor).replace("\"8 A\"", &format!("\"{} A\"", 8.0 * current))
    };
    let at = folder.path().join("own.toml").display().to_string();
    let motor = |text: &str| DataSheet::parse(&at, text).expect("its keys are right").motor();
    // A trace of flux that a measurement left is no magnet, for anyone.
    let text = map("reluctance-6k7", 1.0, 0.01);
    let own = motor(&text).expect("a motor");
    assert!(own.magnet_flux == 0.0 && !own.has_magnet());
    // Nor can it be declared one.
    let flux = "[winding]\nmagnet_flux = { value = \"0.008 Wb\", source = \"assumed\", reason = \"a test\" }";
    let error = motor(&text.replace("[winding]", flux)).expect_err("must be refused").to_string();
    assert!(error.contains("`winding.magnet_flux`") && error.contains("0.0000e0 Wb"), "{error}");
    // A magnet stays one in a motor of microamperes.
    let own = motor(&map("paper-5k5", 1e-6, 0.0)).expect("a motor");
    assert!((own.magnet_flux - 0.45).abs() < 1e-3 && own.has_magnet(), "{}", own.magnet_flux);
}

#[test]
fn analytic_cogging_has_an_even_number_of_periods() {
    let lcm = |a: u32, b: u32| (1..).map(|k| k * a).find(|n| n % b == 0).expect("the product");
    for (slots, pole_pairs) in (3..=96).step_by(3).flat_map(|slots| (1..=30).map(move |p| (slots, p))) {
        assert_eq!(lcm(slots, 2 * pole_pairs) / pole_pairs % 2, 0, "{slots} slots, {pole_pairs} pole pairs");
    }
    let text = include_str!("../motors/slot-harmonics.toml");
    let error = refused(text, "cogging_periods = { value = 6", "cogging_periods = { value = 9");
    assert!(error.starts_with("own.toml: `rotor.cogging_periods` is 9") && error.contains("even"), "{error}");
}

#[test]
fn regress_the_flux_of_a_small_motor_must_agree_as_well() {
    let mut text = include_str!("../motors/paper-5k5.toml").to_owned();
    for (from, to) in [
        ("\"9.2 mH\"", "\"9.2 µH\""),
        ("\"-2.1 mH\"", "\"-2.1 µH\""),
        ("a_d0 = { value = 89.14", "a_d0 = { value = 93897"),
        ("a_dd = { value = 43.0", "a_dd = { value = 0"),
        ("a_q0 = { value = 59.0", "a_q0 = { value = 58997"),
        ("\"40.47 A\"", "\"8 A\""),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    // 8 A · 10.65 µH = 85.2 µWb.
    let error = refused(&text, "\"0.45 Wb\"", "\"0.02 mWb\"");
    assert!(error.contains("winding.magnet_flux") && error.contains("8.5200e-5 Wb"), "{error}");
    let good = DataSheet::parse("own.toml", &text.replacen("\"0.45 Wb\"", "\"0.0852 mWb\"", 1));
    good.and_then(|sheet| sheet.motor()).expect("a motor");
}
