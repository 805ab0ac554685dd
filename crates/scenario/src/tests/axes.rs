//! Axes, designs and tolerances: points and trials of a plan.

use standstill_detect::Method;
use standstill_interface::Nanos;
use standstill_sim::{Purpose, Tape};

use super::{document, plan};
use crate::{AxisSpec, Plan, Scenario};

fn values(plan: &Plan) -> Vec<Vec<String>> {
    let text =
        |(_, value): &(String, toml::Value)| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    plan.points().iter().map(|point| point.values.iter().map(text).collect()).collect()
}

#[test]
fn analytic_a_grid_is_all_combinations_the_last_axis_first() {
    let plan = plan(
        r#"
        [axes]
        "sensors.noise" = { from = "0 mA", to = "20 mA", points = 3 }
        "detector.method" = ["bipolar", "maximum-likelihood"]
        "inverter.dead_time" = { from = "1 us", to = "4 us", points = 3, log = true }
        "#,
    );
    let all = values(&plan);
    assert_eq!(all.len(), 18);
    assert_eq!(all[0], ["0 mA", "bipolar", "1 us"]);
    assert_eq!(all[1], ["0 mA", "bipolar", "2 us"]);
    assert_eq!(all[3], ["0 mA", "maximum-likelihood", "1 us"]);
    assert_eq!(all[17], ["20 mA", "maximum-likelihood", "4 us"]);
    let last = plan.scenario(17).expect("valid");
    assert_eq!((last.sensors.noise, last.drive.dead_time), (20e-3, Nanos(4000)));
}

#[test]
fn law_points_of_a_design_fill_each_axis_evenly() {
    for kind in ["latin-hypercube", "sobol"] {
        let axes = "[axes]\n\"sensors.noise\" = { from = 0, to = 1 }\n\"sensors.gain_error\" = { from = 0.0, to = 0.5 }";
        let text = format!("{axes}\n[design]\nkind = \"{kind}\"\npoints = 64");
        let plan = plan(&text);
        for axis in 0..2 {
            let mut bins = [0; 16];
            for point in plan.points() {
                let value = &point.values[axis].1;
                let number = value.as_float().or(value.as_integer().map(|x| x as f64)).expect("a number");
                let share = number / [1.0, 0.5][axis];
                // A share of 16 bins is the index of a bin.
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let bin = ((share * 16.0) as usize).min(15);
                bins[bin] += 1;
            }
            assert_eq!(bins, [4; 16], "{kind}, axis {axis}");
        }
        // Another seed gives other points, the same seed the same.
        assert_eq!(values(&plan), values(&self::plan(&text)));
        assert_ne!(values(&plan), values(&self::plan(&format!("seed = 2\n{text}"))));
    }
}

#[test]
fn law_tolerances_have_the_spread_that_is_stated() {
    let plan = plan(
        r#"
        [tolerances]
        "motor.winding.resistance" = { normal = "5 %" }
        "sensors.noise" = { uniform = "4 mA", mean = "10 mA" }
        "inverter.dead_time" = { normal = "200 ns", mean = "2000 ns", truncated = 1 }
        "#,
    );
    let drawn: Vec<_> = (0..600).map(|trial| plan.drawn(0, None, trial).expect("valid")).collect();
    let moments = |value: &dyn Fn(&Scenario<Method<f64>>) -> f64| {
        let n = drawn.len() as f64;
        let mean = drawn.iter().map(value).sum::<f64>() / n;
        (mean, (drawn.iter().map(|s| (value(s) - mean).powi(2)).sum::<f64>() / n).sqrt())
    };
    // Three and a half standard deviations of 600 draws: a mean errs by 0.2 %, a standard deviation by 2.9 %.
    let (mean, deviation) = moments(&|s| s.motor.resistance);
    assert!((mean / 1.2 - 1.0).abs() < 0.007 && (deviation / 0.06 - 1.0).abs() < 0.1, "{mean} {deviation}");
    let (mean, deviation) = moments(&|s| s.sensors.noise);
    let expected = 4e-3 / 3.0_f64.sqrt();
    assert!((mean / 10e-3 - 1.0).abs() < 0.035 && (deviation / expected - 1.0).abs() < 0.065);
    assert!(drawn.iter().all(|s| s.drive.dead_time >= Nanos(1800) && s.drive.dead_time <= Nanos(2200)));
    // The detector keeps the nominal motor: it does not know the drawn one.
    let nominal = plan.scenario(0).expect("valid");
    assert!(drawn.iter().all(|s| s.detector == nominal.detector));
    let one = plan.trial(0, &nominal, 3).expect("valid");
    assert_eq!(one, drawn[3].trial(3).expect("settings"));
    // A tape contains the draws too, each under its key.
    let taped = |tape: &Tape| {
        let drawn = plan.scenario_taped(0, &nominal, tape).expect("valid");
        drawn.trial_taped(tape).expect("settings")
    };
    let mut tape = Tape::new(1, 3);
    assert_eq!(taped(&tape), one);
    assert_eq!(tape.normals_named(Purpose::Tolerance, "motor.winding.resistance").len(), 1);
    tape.grow_from(2, 3);
    assert_eq!(taped(&tape), one);
    tape.normals_named(Purpose::Tolerance, "motor.winding.resistance")[0] += 1.0;
    assert_ne!(taped(&tape), one);
    // A further tolerance does not change the draws of the others.
    let other = self::plan(
        "[tolerances]\n\"sensors.offset\" = { normal = \"1 mA\", mean = \"9 mA\" }\n\"motor.winding.resistance\" = { normal = \"5 %\" }",
    );
    assert_eq!(other.drawn(0, None, 7).expect("valid").motor.resistance, drawn[7].motor.resistance);
}

#[test]
fn regress_a_motor_comes_before_what_is_changed_of_it() {
    let axes = |first: &str, second: &str| plan(&format!("[axes]\n{first}\n{second}"));
    let motor = "motor = [\"paper-5k5\", \"surface-magnet\"]";
    let resistance = "\"motor.winding.resistance\" = [0.5, 5]";
    let changed = axes(resistance, motor);
    let resistances: Vec<f64> =
        (0..4).map(|k| changed.scenario(k).expect("valid").motor.resistance).collect();
    assert_eq!(resistances, [0.5, 0.5, 5.0, 5.0]);
    assert_eq!(changed.scenario(3).expect("valid"), axes(motor, resistance).scenario(3).expect("valid"));
}

#[test]
fn law_a_width_may_have_another_prefix_than_its_mean() {
    let of = |width: &str| {
        let text =
            format!("[tolerances]\n\"inverter.dead_time\" = {{ uniform = \"{width}\", mean = \"2 us\" }}");
        plan(&text).drawn(0, None, 5).expect("valid").drive.dead_time
    };
    assert_eq!(of("200 ns"), of("0.2 us"));
    assert_eq!(of("200 ns"), of("10 %"));
}

#[test]
fn regress_mistakes_of_axes_and_tolerances_are_named() {
    let cases: [(&str, &[&str]); 16] = [
        (
            "[axes]\n\"sensors.noize\" = [1, 2]",
            &["s.toml: line 2, set as an axis", "`sensors.noize`", "did you mean `noise`"],
        ),
        (
            "[axes]\n\"sensors.noise\" = { from = \"0 mA\", to = \"1 V\", points = 3 }",
            &["line 2", "0 mA", "same unit"],
        ),
        (
            "[axes]\n\"sensors.noise\" = { from = \"0 A\", to = \"1 A\", points = 3, log = true }",
            &["line 2", "positive"],
        ),
        ("[axes]\n\"sensors.noise\" = { from = \"0 A\", to = \"1 A\" }", &["line 2", "points"]),
        ("[axes]\n\"sensors.noise\" = []", &["line 2", "empty list"]),
        (
            "[axes]\n\"sensors.noise\" = { from = \"1 V\", to = \"2 V\", points = 2 }",
            &["set as an axis", "`sensors.noise`", "1 V"],
        ),
        ("[design]\nkind = \"sobol\"", &["design.points", "from 1 to"]),
        ("[tolerances]\n\"sensors.noise\" = { normal = \"5 %\" }", &["line 2", "`mean`"]),
        (
            "[tolerances]\n\"sensors.noise\" = { mean = \"1 A\", normal = \"5 V\" }",
            &["line 2", "same dimension"],
        ),
        ("[tolerances]\n\"sensors.noise\" = { mean = \"1 A\" }", &["line 2", "`normal` and `uniform`"]),
        (
            "[tolerances]\n\"sensors.noise\" = { norml = \"5 %\" }",
            &["line 2", "norml", "did you mean `normal`"],
        ),
        // 1000 draws reach three standard deviations.
        (
            "[tolerances]\n\"sensors.noise\" = { mean = \"10 mA\", normal = \"40 %\" }",
            &["`sensors.noise`", "drawn as a tolerance", "zero or more"],
        ),
        ("[axes]\n\"sensors.noise\" = [\"1 mA\", \"2 mA\", \"1 mA\"]", &["line 2", "twice"]),
        ("[axes]\n\"sensors.noise\" = { from = 1, to = 1, points = 3 }", &["line 2", "both ends"]),
        ("[design]\nkind = \"sobol\"\npoints = 4", &["line 3", "no axes"]),
        (
            "[axes]\nmotor = [\"paper-5k5\", \"surface-magnet\"]\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }",
            &["line 4", "`mean`"],
        ),
    ];
    for (text, parts) in cases {
        let message = Plan::new(document(text)).expect_err("must be refused").to_string();
        for part in parts {
            assert!(message.contains(part), "{text:?} says: {message}");
        }
    }
}

#[test]
fn analytic_axes_of_the_command_line() {
    let mut document = document("[axes]\n\"sensors.noise\" = [1]");
    let axis = AxisSpec::parse("0 mA:50 mA:6").expect("a range");
    document.vary("sensors.noise", &axis).expect("an axis");
    document
        .vary("detector.method", &AxisSpec::parse("bipolar,line-inductance").expect("a list"))
        .expect("an axis");
    let plan = Plan::new(document.clone()).expect("valid");
    assert_eq!(plan.points().len(), 12);
    // A plain number is in SI, and prefixes may differ.
    for text in ["0:0.05 A:6", "0 mA:0.05 A:6", "0:50 mA:6"] {
        document.vary("sensors.noise", &AxisSpec::parse(text).expect("a range")).expect("an axis");
        let same = Plan::new(document.clone()).expect("valid");
        assert_eq!(same.scenario(3).expect("valid"), plan.scenario(3).expect("valid"), "{text}");
    }
    assert_eq!(values(&plan)[3], ["10 mA", "line-inductance"]);
    for text in ["0:1", "0:1:x", "0:1:3:lin"] {
        assert!(AxisSpec::parse(text).is_err(), "{text}");
    }
}
