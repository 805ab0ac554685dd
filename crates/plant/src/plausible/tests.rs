//! Believed motors, and the slips that are made with them.

use std::fmt::Write as _;
use std::path::Path;

use super::*;
use crate::{DataSheet, built_in, built_in_names};

/// The library's motors, those of published sheets, and synthetic ones from milliamperes to kiloamperes.
fn believed() -> Vec<Motor> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/motors");
    let mut motors: Vec<Motor> = built_in_names().map(|name| built_in(name).expect("built in")).collect();
    let mut sheets: Vec<_> =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    sheets.sort();
    for path in sheets {
        let text = std::fs::read_to_string(&path).expect("a text");
        motors.push(DataSheet::parse("own", &text).and_then(|sheet| sheet.motor()).expect("a motor"));
    }
    for (name, plate) in [
        (
            "milliamperes",
            "pole_pairs = 2\nresistance = 400\nL_d = 1\nL_q = 1.4\nmagnet_flux = 0.1\nrated_current = 0.02\ndc_link = 24",
        ),
        (
            "traction-24",
            "pole_pairs = 4\nresistance = 2e-3\nL_d = 60e-6\nL_q = 100e-6\nmagnet_flux = 20e-3\nrated_current = 300\ndc_link = 24",
        ),
        (
            "megawatt",
            "pole_pairs = 6\nresistance = 3e-3\nL_d = 200e-6\nL_q = 300e-6\nmagnet_flux = 0.8\nrated_current = 1500\ndc_link = 1000",
        ),
    ] {
        let sheet = DataSheet::parse(name, &format!("[nameplate]\n{plate}\n"));
        motors.push(sheet.and_then(|sheet| sheet.motor()).expect("a motor"));
    }
    motors
}

/// The same with the ratings that a maker would print of it: torque of rated current less losses, and the speed at which it takes
/// nearly all of the DC link, or a share of that speed.
fn rated(mut motor: Motor, share: f64) -> Motor {
    let numbers = motor.numbers();
    let [magnet, most] = numbers.torque();
    let torque = 0.95 * magnet.max(0.8 * most);
    let drop = motor.resistance * motor.rated_current;
    let phase = numbers.link.expect("a link") / 3.0_f64.sqrt();
    let flux = motor.magnet_flux.max(0.7 * numbers.between() * motor.rated_current);
    let speed =
        (phase - drop).max(0.3 * phase) * 0.8 / flux.hypot(0.5 * numbers.between() * motor.rated_current);
    let speed = share * speed / numbers.pole_pairs;
    motor.ratings =
        Ratings { power: Some(speed * torque), speed_rpm: Some(speed * RPM), torque: Some(torque) };
    motor
}

#[test]
fn law_no_believed_motor_is_doubted_with_or_without_ratings() {
    for motor in believed() {
        assert_eq!(motor.doubtful().map(|doubt| doubt.said()), None, "{}", motor.name);
        // The paper's motor states 5.5 kW, which 8 A peak do not give at 550 V: its ratings are no example.
        for share in [1.0, 0.7, 0.4].into_iter().filter(|_| motor.ratings.power.is_none()) {
            let motor = rated(motor.clone(), share);
            assert_eq!(
                motor.doubtful().map(|doubt| doubt.said()),
                None,
                "{} {:?}",
                motor.name,
                motor.ratings
            );
        }
    }
}

#[test]
fn regress_inertia_and_friction_that_rated_current_cannot_turn_are_doubted() {
    let plate = "pole_pairs = 7\nresistance = 0.06\nL_d = 25e-6\nL_q = 31e-6\nmagnet_flux = 4.5e-3\nrated_current = 25\ndc_link = 24\nsaturation = \"6 %\"";
    let said = |rotor: &str| {
        let sheet = DataSheet::parse("own", &format!("[nameplate]\n{plate}\n[rotor]\n{rotor}\n"));
        let motor = sheet.and_then(|sheet| sheet.motor()).expect("a motor");
        motor.doubtful().map(|doubt| doubt.said())
    };
    let rotor = |inertia: &str, friction: &str| {
        said(&format!("inertia = {inertia}\nstiction = {friction}\ncoulomb = {friction}\nviscous = 0"))
    };
    // 1.2 N m against 40 kg m² up to 440 rad/s.
    let slow = rotor("40", "0.01").expect("four hours");
    assert!(
        slow.starts_with("rated torque takes 4.1 h to bring")
            && slow.contains("a number in g cm²: 4.0e-6 kg m² would fit"),
        "{slow}"
    );
    let stuck = rotor("4e-5", "50").expect("stuck");
    assert!(stuck.starts_with("friction is 42.31 times the 1.182 N m") && stuck.contains("mN m"), "{stuck}");
    let light = rotor("4e-10", "0.01").expect("a millionth");
    assert!(light.contains("to full speed; no single slip"), "{light}");
    assert_eq!(rotor("4e-6", "0.01"), None);
}

/// A slip: its name, the key that should be named, the factor that mends it, and what it does to the numbers.
type Made = (&'static str, &'static str, fn(f64) -> f64, fn(&mut Numbers));

const ROOT2: f64 = std::f64::consts::SQRT_2;
const ROOT3: f64 = 1.732_050_807_568_877_2;

/// Those that change an order of magnitude.
const COARSE: [Made; 8] = [
    ("Wb for mWb", "magnet_flux", |_| 1e-3, |n| n.flux *= 1e3),
    ("mH for µH", "L_d and L_q", |_| 1e-3, |n| n.inductance = n.inductance.map(|l| 1e3 * l)),
    ("µH for mH", "L_d and L_q", |_| 1e3, |n| n.inductance = n.inductance.map(|l| 1e-3 * l)),
    ("Ω for mΩ", "resistance", |_| 1e-3, |n| n.resistance *= 1e3),
    ("mH for µH in L_q alone", "L_q", |_| 1e-3, |n| n.inductance[1] *= 1e3),
    ("mA for A", "rated_current", |_| 1e3, |n| n.current *= 1e-3),
    ("µH without a unit", "L_d and L_q", |_| 1e-6, |n| n.inductance = n.inductance.map(|l| 1e6 * l)),
    ("mWb for Wb", "magnet_flux", |_| 1e3, |n| n.flux *= 1e-3),
];

/// Those of rms and peak, phase and line, poles and pole pairs, which ratings show.
const FINE: [Made; 6] = [
    ("rms current", "rated_current", |_| ROOT2, |n| n.current /= ROOT2),
    ("flux between two terminals", "magnet_flux", |_| 1.0 / ROOT3, |n| n.flux *= ROOT3),
    ("rms flux of a phase", "magnet_flux", |_| ROOT2, |n| n.flux /= ROOT2),
    ("poles for pole pairs", "pole_pairs", |_| 0.5, |n| n.pole_pairs *= 2.0),
    ("V per mechanical rad/s", "magnet_flux", |p| 1.0 / p, |n| n.flux *= n.pole_pairs),
    (
        "V of lines per mechanical rad/s",
        "magnet_flux",
        |p| 1.0 / (ROOT3 * p),
        |n| n.flux *= ROOT3 * n.pole_pairs,
    ),
];

/// Those that ratings seldom show: a winding's values say little of torque and speed.
const HIDDEN: [Made; 2] = [
    ("R and L between two terminals", "resistance, L_d and L_q", |_| 0.5, |n| winding(n, 2.0)),
    ("R and L of a phase in delta", "resistance, L_d and L_q", |_| 1.0 / 3.0, |n| winding(n, 3.0)),
];

fn winding(numbers: &mut Numbers, factor: f64) {
    numbers.resistance *= factor;
    numbers.inductance = numbers.inductance.map(|l| factor * l);
}

/// Of how many motors a slip is doubted, and its key and factor among those that are named.
fn found((_, key, factor, make): Made, motors: &[Motor]) -> [usize; 3] {
    let mut counts = [0; 3];
    for motor in motors {
        let numbers = motor.numbers();
        let mut off = numbers;
        make(&mut off);
        if key == "magnet_flux" && numbers.flux == 0.0 || (factor(numbers.pole_pairs) - 1.0).abs() < 1e-9 {
            continue;
        }
        counts[0] += 1;
        let Some(doubt) = off.doubtful() else { continue };
        counts[1] += 1;
        let is_named = |guess: &Guess| {
            guess.key == key && (guess.factor / factor(numbers.pole_pairs) - 1.0).abs() < 1e-9
        };
        counts[2] += usize::from(doubt.guesses.iter().any(is_named));
    }
    counts
}

#[test]
fn law_slips_of_data_sheets_are_doubted_and_named() {
    let plain = believed();
    let unrated = || believed().into_iter().filter(|motor| motor.ratings.power.is_none());
    let [full, part] = [1.0, 0.4].map(|share| unrated().map(|motor| rated(motor, share)).collect::<Vec<_>>());
    let mut table = String::new();
    let mut totals = [[0; 3]; 3];
    let kinds = [&COARSE[..], &FINE, &HIDDEN].into_iter().enumerate();
    for (kind, made) in kinds.flat_map(|(kind, all)| all.iter().map(move |made| (kind, made))) {
        let counts = [&plain, &full, &part].map(|motors| found(*made, motors));
        let _ = writeln!(table, "{:34} {:?} {:?} {:?}", made.0, counts[0], counts[1], counts[2]);
        for k in 0..3 {
            // With ratings, at both speeds, but for orders of magnitude.
            totals[kind][k] += if kind == 0 { counts[0][k] } else { counts[1][k] + counts[2][k] };
        }
    }
    println!(
        "slip, without ratings [of, doubted, named], with ratings, at 40 % of the speed\n{table}{totals:?}"
    );
    // Ratings hardly show a winding's values; a doubt that they raise names them all the same.
    let [of, doubted, named] = totals[2].map(|count| count as f64);
    assert!(doubted > 0.0 && doubted < 0.3 * of && named >= 0.75 * doubted, "{totals:?}\n{table}");
    // Orders of magnitude without ratings, factors of √2, √3, 2 and p with them.
    for (kind, [doubted, named]) in [[0.9, 0.85], [0.9, 0.85]].into_iter().enumerate() {
        let [of, found, right] = totals[kind].map(|count| count as f64);
        assert!(found >= doubted * of && right >= named * of, "{kind}: {totals:?}\n{table}");
    }
}

#[test]
fn regress_a_published_flux_per_mechanical_radian_is_named() {
    // arXiv:2305.04046, table 1: 200 W, 3,000 rpm, 0.637 N m, 1.5 A, four pole pairs, 11.6 Ω, 22 mH, 0.3477 Wb at 220 V. It is the voltage
    // between two terminals per mechanical radian: over √3·4 it makes 0.64 N m.
    let sheet = "[nameplate]\npole_pairs = 4\nresistance = 11.6\nL_d = 0.022\nL_q = 0.022\nmagnet_flux = 0.3477\nrated_current_rms = 1.5\ndc_link = 311\npower = 200\nrated_speed = 3000\nrated_torque = 0.637\n";
    let motor = DataSheet::parse("60ST-M00630", sheet).and_then(|sheet| sheet.motor()).expect("a motor");
    let doubt = motor.doubtful().expect("doubted");
    assert!(doubt.said().contains("50.19 mWb, √3·p less, would fit"), "{}", doubt.said());
    let mended = sheet.replace("0.3477", "0.05018");
    let motor = DataSheet::parse("60ST-M00630", &mended).and_then(|sheet| sheet.motor()).expect("a motor");
    assert_eq!(motor.doubtful(), None);
}

#[test]
fn regress_poles_for_pole_pairs_are_named_at_a_rated_speed_below_the_links() {
    // 48 V fill at 7,300 rpm; rated are 3,000 rpm, and the torque is half of what 14 pole pairs make.
    let sheet = "[nameplate]\npole_pairs = 14\nresistance = 0.021\nL_d = 16e-6\nL_q = 20e-6\nmagnet_flux = 5.2e-3\nrated_current = 60\ndc_link = 48\npower = 1029\nrated_speed = 3000\nrated_torque = 3.276\n";
    let motor = DataSheet::parse("m48", sheet).and_then(|sheet| sheet.motor()).expect("a motor");
    let doubt = motor.doubtful().expect("doubted");
    assert!(doubt.what.contains("0.50 times"), "{}", doubt.said());
    assert_eq!((doubt.guesses[0].key, doubt.guesses[0].factor), ("pole_pairs", 0.5), "{}", doubt.said());
    let mended = sheet.replace("pole_pairs = 14", "pole_pairs = 7");
    let motor = DataSheet::parse("m48", &mended).and_then(|sheet| sheet.motor()).expect("a motor");
    assert_eq!(motor.doubtful(), None);
}
