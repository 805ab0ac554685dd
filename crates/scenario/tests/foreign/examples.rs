//! The examples in C find the rotor, and what the equations say of the rotating injection holds.

use standstill_scenario::{Record, Verdict};

use crate::{example, plan, records};

/// The scenario of the rotating injection on its motors.
fn rotating(motor: &str, errors: &str, config: &str) -> String {
    // An ideal drive has no devices whose channels could have a resistance.
    let drive = if errors == "none" {
        ""
    } else {
        "[inverter]\ndc_link = \"50 V\"\ndead_time = \"0.5 us\"\ndevices = \"mosfet\"\nchannel_resistance = \"2 mohm\"\n"
    };
    format!(
        "motor = \"{motor}\"\nerrors = \"{errors}\"\n{drive}[detector]\nlibrary = \"mine.so\"\n[detector.config]\nvoltage = 20\n{config}"
    )
}

fn wrong(records: &[Record]) -> usize {
    records.iter().filter(|record| record.pole_correct() == Some(false)).count()
}

fn worst_axis(records: &[Record]) -> f64 {
    records.iter().filter_map(Record::axis_error_deg).fold(0.0, |worst, error| error.abs().max(worst))
}

#[test]
fn law_the_papers_method_as_an_interrupt_finds_the_rotor() {
    let (folder, _) = example("line_inductance.c");
    for motor in ["light-vehicle", "paper-5k5"] {
        let text = format!("motor = \"{motor}\"\nerrors = \"none\"\ndetector.library = \"mine.so\"\n");
        let records = records(&plan(&folder, &text).expect("valid"), 0..40);
        assert!(records.iter().all(|record| record.verdict() == Verdict::Found), "{}", records[0].reason());
        assert_eq!(wrong(&records), 0, "{motor}");
        assert!(worst_axis(&records) < 6.0, "{motor}: {}", worst_axis(&records));
    }
}

#[test]
fn law_an_ideal_drive_names_no_wrong_pole_by_rotating_injection() {
    let (folder, _) = example("rotating.c");
    let plan = plan(&folder, &rotating("light-vehicle", "none", "turns = 4\n")).expect("valid");
    let all = records(&plan, 0..60);
    assert!(all.iter().all(|record| record.verdict() == Verdict::Found));
    assert_eq!(wrong(&all), 0);
    assert!(worst_axis(&all) < 2.0, "{}", worst_axis(&all));
    // A turn of 16 directions takes 16 periods of 80 µs; one is ignored, and the first two halves are off.
    assert!((all[0].run.duration.seconds() - (5.0 * 16.0 + 1.0) * 80e-6).abs() < 60e-6);
    // Lanes, threads and the order of trials do not show.
    let scenario = plan.scenario(0).expect("valid");
    for trial in [41, 3] {
        let alone = plan.trial(0, &scenario, trial).expect("runs");
        assert_eq!(alone, all[usize::try_from(trial).expect("small")]);
    }
}

#[test]
fn law_a_threshold_above_the_pole_difference_names_the_wrong_pole_for_half_of_all_positions() {
    let (folder, _) = example("rotating.c");
    let config = "turns = 4\npole = \"threshold\"\nthreshold = 0.5\n";
    let plan = plan(&folder, &rotating("light-vehicle", "default", config)).expect("valid");
    let all = records(&plan, 0..400);
    let share = wrong(&all) as f64 / 400.0;
    // 400 coins: ± 5 % is two standard deviations.
    assert!((0.42..0.58).contains(&share), "{share}");
    let axes = all.iter().filter(|record| record.axis_error_deg().is_some_and(|error| error.abs() < 2.0));
    assert!(axes.count() > 390, "the axis is right meanwhile: {}", worst_axis(&all));
}

#[test]
fn law_more_saturation_more_voltage_and_more_turns_speak_for_the_pole() {
    let (folder, _) = example("rotating.c");
    let evidence = |motor: &str, voltage: f64, turns: u32| {
        let text = rotating(motor, "default", &format!("turns = {turns}\n"))
            .replace("voltage = 20", &format!("voltage = {voltage}"));
        let all = records(&plan(&folder, &text).expect("valid"), 0..60);
        let told = all.iter().filter_map(|record| {
            let standstill_sim::Ended::Outcome(outcome) = record.run.ended else { return None };
            outcome.evidence_for(standstill_interface::Angle::from_radians(record.run.end_angle))
        });
        let mut told: Vec<f64> = told.collect();
        told.sort_by(f64::total_cmp);
        told[told.len() / 2]
    };
    let usual = evidence("light-vehicle-stiff", 20.0, 8);
    assert!(usual > 0.0, "{usual}");
    assert!(evidence("light-vehicle", 20.0, 8) > usual);
    assert!(evidence("light-vehicle-stiff", 8.0, 8) < usual);
    // Noise averages away over the turns. What legs that switch unequally add to each of them does not.
    assert!(evidence("light-vehicle-stiff", 20.0, 30) > usual);
}

#[test]
fn law_a_turn_that_counts_before_the_current_has_settled_names_many_times_the_wrong_poles() {
    let (folder, _) = example("rotating.c");
    let wrong_of = |errors: &str, config: &str| {
        let text = rotating("light-vehicle", errors, &format!("turns = 2\n{config}"));
        wrong(&records(&plan(&folder, &text).expect("valid"), 0..300))
    };
    // The first vector goes back without having gone forth: a current of one rise stays, and dead time opposes it.
    let unsettled = wrong_of("default", "begin = \"back\"\nignore = 0\n");
    let settled = wrong_of("default", "begin = \"back\"\nignore = 2\n");
    let from_rest = wrong_of("default", "ignore = 0\n");
    assert!(unsettled >= 40 && unsettled >= 8 * settled.max(1), "{unsettled} against {settled} of 300");
    assert!(from_rest <= 6, "{from_rest} of 300");
    // Without dead time a current that flows on costs a hundredth of itself a period.
    assert_eq!(wrong_of("none", "begin = \"back\"\nignore = 0\n"), 0);
}

/// The scenario of the pole tests with this saturation along d.
fn pole_test(errors: &str, saturation: &str, config: &str) -> String {
    rotating("light-vehicle", errors, config)
        .replace("motor = \"light-vehicle\"", "motor.base = \"light-vehicle\"")
        .replacen('\n', &format!("\nmotor.nameplate.saturation.d = \"{saturation}\"\n"), 1)
}

/// An ideal drive finds the pole of a motor that gains little: by both signs of a current, whatever end of the axis comes first; and by
/// one pulse, if the threshold lies below the gain.
#[test]
fn law_pole_tests_of_firmware_name_no_wrong_pole_on_an_ideal_drive() {
    let (folder, _) = example("pole_test.c");
    for (saturation, config) in [
        ("2 %", "test = \"both\"\nbias = 20\n"),
        ("17 %", "test = \"both\"\n"),
        ("17 %", "test = \"single\"\nthreshold = 0.05\n"),
    ] {
        let plan = plan(&folder, &pole_test("none", saturation, config)).expect("valid");
        let all = records(&plan, 0..60);
        assert!(all.iter().all(|record| record.verdict() == Verdict::Found), "{}", all[0].reason());
        assert_eq!(wrong(&all), 0, "{saturation} {config}");
        assert!(worst_axis(&all) < 2.0, "{}", worst_axis(&all));
    }
}

/// A single pulse that looks at one end names the other wherever the threshold is not exceeded: with a threshold above the gain that is
/// half of all positions, with one below what drops and dead time take it is the other half.
#[test]
fn law_a_single_pulse_with_a_threshold_beyond_the_gain_names_half_of_the_poles_wrongly() {
    let (folder, _) = example("pole_test.c");
    let share = |saturation: &str, threshold: f64| {
        let config = format!("test = \"single\"\nthreshold = {threshold}\n");
        let plan = plan(&folder, &pole_test("default", saturation, &config)).expect("valid");
        wrong(&records(&plan, 0..400)) as f64 / 400.0
    };
    // 400 coins: ± 5 % is two standard deviations.
    let (above, below) = (share("6.8 %", 0.15), share("6.8 %", -0.15));
    assert!((0.42..0.58).contains(&above) && (0.42..0.58).contains(&below), "{above} {below}");
    // The two halves are each other's complement.
    assert!((above + below - 1.0).abs() < 1e-12, "{above} {below}");
    assert!(share("6.8 %", -0.03) < 0.01);
}

/// The ripples' difference grows with the bias; who asks for deviations is seldom wrong, also where they are few because the noise is.
#[test]
fn law_both_signs_of_a_current_guess_where_the_bias_is_small_and_say_so_if_they_are_asked() {
    let (folder, _) = example("pole_test.c");
    let all = |config: &str, sensors: &str| {
        let text = pole_test("default", "2 %", config) + sensors;
        records(&plan(&folder, &text).expect("valid"), 0..300)
    };
    let small = wrong(&all("test = \"both\"\nbias = 10\n", ""));
    let large = wrong(&all("test = \"both\"\nbias = 40\n", ""));
    assert!(small > 30 && large < 5, "{small} {large}");
    for (least, most_wrong, least_open, sensors) in
        [(2, 3, 150, ""), (4, 1, 200, "[sensors]\nnoise = \"20 mA\"\nbits = 0\n")]
    {
        let asked = all(&format!("test = \"both\"\nbias = 10\nleast = {least}\n"), sensors);
        let open = asked.iter().filter(|record| record.verdict() == Verdict::Undetermined).count();
        assert!(wrong(&asked) < most_wrong && open > least_open, "{least}: {} {open}", wrong(&asked));
    }
}

/// What it cannot do ends with its reason: currents that a shunt does not show, and a rotor that turns meanwhile.
#[test]
fn law_a_pole_test_that_cannot_see_or_has_moved_the_rotor_fails_with_its_reason() {
    let (folder, _) = example("pole_test.c");
    for (more, reason) in [
        ("[sensors]\narrangement = \"low-side-shunts\"\n", "does not see its phase"),
        ("[sensors]\narrangement = \"dc-link-shunt\"\n", "does not see its phase"),
        ("[rotor]\nstate = \"driven\"\nspeed = \"200 rpm\"\n", "needs a brake"),
    ] {
        let text = pole_test("default", "17 %", "test = \"both\"\n") + more;
        let all = records(&plan(&folder, &text).expect("valid"), 0..20);
        assert!(all.iter().all(|record| record.reason().contains(reason)), "{more}: {}", all[0].reason());
    }
    for (config, reason) in [
        ("bias = -80\n", "bias must be"),
        ("count = 15\n", "a multiple of 10"),
        ("treshold = 0.1\n", "keys are test"),
        ("voltage = 40\n", "half the DC link"),
        ("threshold = \"none\"\n", "threshold from -1 to 1"),
    ] {
        let text = pole_test("default", "17 %", config).replace("voltage = 20\nvoltage", "voltage");
        let refused = plan(&folder, &text).and_then(|plan| plan.scenario(0).map(|_| ())).expect_err(config);
        assert!(refused.to_string().contains(reason), "{config}: {refused}");
    }
}

/// Both take the same trials: motors, comparators, timers and noise are the same, and the same currents flow.
#[test]
fn cross_six_pulses_as_an_application_note_writes_them_agree_with_the_method() {
    let (folder, _) = example("six_pulse.c");
    let drive = "sensors.timer = \"0.32 us\"\nsensors.comparators = \"common\"\n";
    for errors in ["default", "field"] {
        let text = |detector: &str| {
            format!("motor = \"paper-5k5\"\nerrors = \"{errors}\"\n{drive}[detector]\n{detector}\n")
        };
        let of = |detector: &str| records(&plan(&folder, &text(detector)).expect("valid"), 0..300);
        let (in_c, method) = (of("library = \"mine.so\""), of("method = \"six-pulse\""));
        assert_eq!((wrong(&in_c), wrong(&method)), (0, 0), "{errors}");
        let named =
            |records: &[Record]| records.iter().filter(|record| record.verdict() == Verdict::Found).count();
        let mut most = 0.0_f64;
        for (ours, theirs) in in_c.iter().zip(&method) {
            let (Some(one), Some(other)) = (ours.axis_deg(), theirs.axis_deg()) else {
                panic!("{}: {} and {}", ours.trial, ours.reason(), theirs.reason())
            };
            // Axes are apart by at most a quarter of a turn.
            let apart = (one - other).rem_euclid(180.0);
            most = most.max(apart.min(180.0 - apart));
        }
        println!(
            "{errors}: axes at most {most:.3}° apart, worst axes {:.3}° and {:.3}°; {} and {} of {} poles named",
            worst_axis(&in_c),
            worst_axis(&method),
            named(&in_c),
            named(&method),
            in_c.len()
        );
        assert!(most < 1.0 && worst_axis(&in_c) < 1.0, "{errors}: {most}°, {}°", worst_axis(&in_c));
        assert!(named(&in_c) * 100 >= 99 * in_c.len(), "{errors}: {} poles named", named(&in_c));
    }
}

/// A key that is mistyped or has no number must not leave a setting at its usual value.
#[test]
fn regress_examples_refuse_settings_that_they_do_not_know() {
    for (source, config, reason) in [
        ("six_pulse.c", "treshold = 20", "keys of the configuration are threshold"),
        ("six_pulse.c", "evidence = \"much\"", "evidence 0 or more"),
        ("rotating.c", "volatge = 20", "keys of the configuration are pole"),
        ("rotating.c", "turns = \"many\"", "turns must be from 1 to 64"),
    ] {
        let (folder, _) = example(source);
        let text = format!(
            "motor = \"paper-5k5\"\nsensors.timer = \"0.32 us\"\n[detector]\nlibrary = \"mine.so\"\n[detector.config]\n{config}\n"
        );
        let refused = plan(&folder, &text).and_then(|plan| plan.scenario(0).map(|_| ())).expect_err(config);
        assert!(refused.to_string().contains(reason), "{config}: {refused}");
    }
}

/// Without current there is no trip, and without a timer no detector.
#[test]
fn law_six_pulses_say_what_they_lack() {
    let (folder, _) = example("six_pulse.c");
    let text = |drive: &str, config: &str| {
        format!(
            "motor = \"paper-5k5\"\n{drive}\n[detector]\nlibrary = \"mine.so\"\n[detector.config]\n{config}\n"
        )
    };
    let refused = plan(&folder, &text("", "")).expect_err("no timer").to_string();
    assert!(
        refused.contains("six pulses with a timer refused: this drive captures no time: sensors.timer"),
        "{refused}"
    );
    let timer = "sensors.timer = \"0.32 us\"";
    let short = records(&plan(&folder, &text(timer, "longest_us = 5")).expect("valid"), 0..2);
    assert!(
        short.iter().all(|record| record.reason() == "a pulse whose current did not reach the threshold")
    );
}
