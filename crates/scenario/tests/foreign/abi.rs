//! Versions of the header: what a library of each gets.

use std::path::Path;

use standstill_interface::{
    Abc, Angle, Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step, abi,
};
use standstill_scenario::{Record, Verdict};
use standstill_sim::{Ended, Event, NoProbe, Trace, run};

use super::{built, example, plan, probe, records};

fn source(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign").join(name)
}

/// Sources of ABI 1 lie beside their header, with all that the present ones have lost.
/// promise: abi-1-loads
#[test]
fn regress_libraries_of_the_first_header_give_the_results_that_they_give_with_the_present_one() {
    for (name, text) in [
        ("six_vectors.c", "motor = \"paper-5k5\"\nerrors = \"default\"\n"),
        ("rotating.c", "motor = \"light-vehicle\"\nerrors = \"default\"\n"),
    ] {
        let text = format!("{text}[detector]\nlibrary = \"mine.so\"\n");
        let (first, _) = built(&source("abi1").join(name), &[]);
        let (present, _) = example(name);
        let all = |folder| records(&plan(folder, &text).expect("valid"), 0..20);
        let (old, new) = (all(&first), all(&present));
        assert_eq!(old, new, "{name}");
        assert!(old.iter().any(|record| record.verdict() == Verdict::Found), "{name}: {old:?}");
    }
}

#[test]
fn law_a_library_of_a_newer_header_is_refused_by_its_version_with_the_way_to_go_on() {
    let text = "motor = \"light-vehicle\"\n[detector]\nlibrary = \"mine.so\"\nconfig.what = \"found\"\n";
    // Whether it answers every question with its table or, as the header says, only that for its own version.
    for options in [&["-DABI=3"][..], &["-DABI=3", "-DSTRICT"]] {
        let (folder, _) = probe(options);
        let refused = plan(&folder, text).expect_err("newer").to_string();
        assert!(refused.contains("a table of ABI 3, which is newer than this program"), "{refused}");
        assert!(
            refused.contains("one of ABI 1 or 2: compile it with the standstill.h of this program"),
            "{refused}"
        );
    }
    let (folder, _) = probe(&["-DABI=2000", "-DSTRICT"]);
    let refused = plan(&folder, text).expect_err("unheard of").to_string();
    assert!(refused.contains("sts_entry(2) and sts_entry(1) give no table"), "{refused}");
}

/// The detector of `readings.c`, in Rust: it keeps its reading.
struct Once(Command<f64>, Option<Reading<f64>>);

impl Detector<f64> for Once {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        match readings.first() {
            None => Step::Drive(self.0),
            Some(reading) => {
                self.1 = Some(*reading);
                Step::Done(Outcome::Failed {
                    fault: Fault::UnexpectedReadings,
                    findings: Findings::default(),
                })
            }
        }
    }
}

fn scenario(sensors: &str, config: &str) -> String {
    format!(
        "motor = \"paper-5k5\"\nerrors = \"field\"\nrotor.state = \"locked\"\n{sensors}\n[detector]\nlibrary = \"mine.so\"\n\
         [detector.config]\n{config}\n"
    )
}

#[test]
fn cross_a_library_reads_what_a_detector_in_rust_reads() {
    let (folder, _) = built(&source("readings.c"), &[]);
    let timer = "sensors.timer = \"0.32 us\"\nsensors.terminals = true\n";
    let legs = Abc::new(Leg::High, Leg::Low, Leg::Low);
    let pulse = Stage { legs, duration: Nanos(300_000) };
    let decay = Stage::off(Nanos(500_000));
    let cases: [(String, Option<f64>); 4] = [
        (format!("{timer}sensors.arrangement = \"dc-link-shunt\""), None),
        (format!("{timer}sensors.arrangement = \"dc-link-shunt\""), Some(2.5)),
        (format!("{timer}sensors.comparators = \"per-leg\""), Some(2.5)),
        ("sensors.terminals = false".to_owned(), None),
    ];
    let (mut captured, mut hidden) = (0, 0);
    for (sensors, until) in cases {
        let config = until.map_or_else(String::new, |until| format!("until = {until}\n"));
        let command = match until {
            None => Command::sequence(pulse, decay, Sampling::once(pulse.duration)),
            Some(threshold) => Command::until(threshold, pulse, decay, Sampling::once(Nanos::ZERO)),
        };
        for trial in 0..3 {
            let seen = |field: &str| {
                let text = scenario(&sensors, &format!("{config}field = \"{field}\""));
                let record = records(&plan(&folder, &text).expect("valid"), trial..trial + 1)[0];
                let Ended::Outcome(Outcome::Found { angle, .. }) = record.run.ended else {
                    panic!("{sensors}: {record:?}")
                };
                angle
            };
            let here =
                plan(&folder, &scenario(&sensors, &config)).expect("valid").scenario(0).expect("valid");
            let mut once = Once(command, None);
            run(&here.case(trial), &mut once, false, &mut NoProbe);
            let sample = abi::Sample::of(&once.1.expect("a reading"), Nanos::ZERO, 0);
            #[allow(clippy::cast_precision_loss, reason = "as C converts it")]
            let fields = [
                ("captured", f32::from(sample.captured)),
                ("comparator", f32::from(sample.comparator)),
                ("capture_ticks", sample.capture_ticks as f32),
                ("link_current", sample.link_current),
                ("link_current_count", sample.link_current_count as f32),
                ("link_sensed", f32::from(sample.link_sensed)),
                ("terminal[0]", sample.terminal[0]),
                ("terminal[1]", sample.terminal[1]),
                ("terminal_count[0]", sample.terminal_count[0] as f32),
                ("terminal_count[2]", sample.terminal_count[2] as f32),
                ("terminal_sensed[0]", f32::from(sample.terminal_sensed[0])),
                ("current[0]", sample.current[0]),
                ("time_ns", sample.time_ns as f32),
                ("dc_link_count", sample.dc_link_count as f32),
            ];
            for (field, expected) in fields {
                // Beyond 1000 rad an angle is refused: of those the library would have to divide.
                if expected.abs() <= 1000.0 {
                    assert_eq!(seen(field), Angle::from_radians(f64::from(expected)), "{field} {sensors}");
                }
            }
            captured += i32::from(sample.captured);
            hidden += i32::from(sample.link_sensed == 3 && sample.terminal_sensed == [3; 3]);
            // With a threshold the current is that of the threshold, but for delay, noise and offset.
            let current = if sample.link_sensed == 3 { sample.current[0] } else { sample.link_current };
            assert!(until.is_none() || (2.2..3.2).contains(&current), "{current} {sensors}");
            assert!(until.is_none() || sample.capture_ticks > 30, "{sample:?}");
        }
    }
    assert_eq!((captured, hidden), (6, 3));
}

#[test]
fn law_commands_until_a_threshold_that_cannot_be_are_failed_records_with_their_reason() {
    let (folder, _) = built(&source("readings.c"), &[]);
    let timer = "sensors.timer = \"0.32 us\"";
    for (sensors, config, reason) in [
        (
            "",
            "until = 2.5",
            "a command until 2.5 A on a drive without a timer behind comparators: `sensors.timer`",
        ),
        (timer, "until = -2.5", "a command until -2.5 A, not until a finite current above 0"),
        (timer, "until = \"nan\"", "a command until NaN A, not until a finite current above 0"),
        (
            timer,
            "until = 2.5\nfield = \"duty\"",
            "a command until a threshold in whose first stage leg b switches: it can be off, low or high",
        ),
        (
            timer,
            "until = 2.5\nfield = \"late\"",
            "a sample at 500001 ns after a trip, of a second stage of 500000 ns",
        ),
    ] {
        let text = scenario(sensors, config);
        let record = records(&plan(&folder, &text).expect("valid"), 0..1)[0];
        assert_eq!((record.verdict(), record.reason().as_str()), (Verdict::Failed, reason));
    }
}

/// A detection as `standstill trace` sees it.
fn traced(text: &str, folder: &tempfile::TempDir) -> (Record, Trace) {
    let single = plan(folder, text).expect("valid").single(0, 0).expect("a trial");
    let (record, _, trace) =
        single.scenario.traced(&single.case(), false, f64::INFINITY).expect("a detector");
    (record, trace)
}

/// Of a command with a threshold, the second call is made earlier than it might have been.
#[test]
fn law_channels_and_log_of_commands_stand_at_the_times_of_the_calls() {
    let (folder, _) = built(&source("readings.c"), &[]);
    for (config, until) in [("field = \"log\"", false), ("field = \"log\"\nuntil = 2.5", true)] {
        let (record, trace) = traced(&scenario("sensors.timer = \"0.32 us\"", config), &folder);
        let own = &trace.own;
        assert_eq!(own.names, ["pulses"]);
        let ([(first, one), (second, two)], end) = (&own.rows[..], record.run.duration.seconds()) else {
            panic!("{own:?}")
        };
        assert_eq!((*first, &one[..], &two[..]), (0.0, &[1.0][..], &[2.0][..]));
        assert!((second - end).abs() < 1e-12, "{second} {end}");
        let whole = (second - 800e-6).abs() < 1e-12;
        assert!(whole != until && (520e-6..=800e-6 + 1e-12).contains(second), "{second}");
        let log: Vec<(f64, &str)> = own.log.iter().map(|(time, line)| (*time, line.as_str())).collect();
        assert_eq!(log, [(0.0, "made"), (0.0, "begins"), (*second, "ends"), (*second, "gone")]);
        assert_eq!(record.verdict(), Verdict::Found);
    }
}

/// What breaks a rule is seen as far as it came; where nobody traces, nothing is asked for channels.
#[test]
fn regress_the_call_that_breaks_a_rule_has_its_row() {
    let (folder, _) = built(&source("readings.c"), &[]);
    let (record, trace) = traced(&scenario("", "until = 2.5"), &folder);
    assert_eq!(record.verdict(), Verdict::Failed);
    assert_eq!(trace.own.rows, [(0.0, vec![1.0])]);
    let single =
        plan(&folder, &scenario("", "field = \"log\"")).expect("valid").single(0, 0).expect("a trial");
    let (_, _, trace) = single.scenario.watched(&single.case(), false, f64::INFINITY).expect("a detector");
    assert!(trace.own.rows.is_empty() && trace.own.log.is_empty());
}

/// A comparator may end each pulse long before its longest; then it is the time that counts, also where more than 100,000 were given.
#[test]
fn regress_pulses_to_a_threshold_for_ever_are_a_failed_record() {
    let (folder, _) = built(&source("readings.c"), &[]);
    for (config, limit) in
        [("until = 2.5\nfield = \"ever\"", 50), ("until = 1e-4\nfield = \"ever-short\"", 100)]
    {
        let limited = format!("[detector]\ntime_limit = \"{limit} ms\"\n");
        let text = scenario("sensors.timer = \"0.32 us\"", config).replace("[detector]\n", &limited);
        let record = records(&plan(&folder, &text).expect("valid"), 0..1)[0];
        let reason = format!("not done within 0.{} s", if limit == 50 { "05" } else { "1" });
        assert_eq!((record.verdict(), record.reason()), (Verdict::Failed, reason));
        assert!(record.run.duration.seconds() <= f64::from(limit) * 1e-3);
    }
}

/// A row at each sample, with what the drive read there.
#[test]
fn law_channels_of_an_interrupt_stand_at_its_samples() {
    let (folder, _) = probe(&[]);
    let text = "motor = \"light-vehicle\"\n[detector]\nlibrary = \"mine.so\"\nconfig.what = \"delay\"\n";
    let (_, trace) = traced(text, &folder);
    let read = |(_, event): &(f64, Event)| match event {
        Event::Sample(reading) => Some((reading.current.0[0], reading.at.seconds())),
        _ => None,
    };
    let samples: Vec<(f64, f64)> = trace.events.iter().filter_map(read).collect();
    assert_eq!(trace.own.names, ["calls", "last_A"]);
    assert_eq!(trace.own.rows.len(), samples.len());
    for (number, ((time, values), (current, at))) in trace.own.rows.iter().zip(&samples).enumerate() {
        // Twice a period of 80 us, a quarter into each half.
        assert!((time - (40e-6 * number as f64 + at)).abs() < 1e-12, "{time} {at}");
        #[allow(clippy::cast_possible_truncation, reason = "as C has it")]
        let current = f64::from(*current as f32);
        assert_eq!(values[..], [number as f64 + 1.0, current]);
    }
    assert!(samples.len() > 1 && samples.last().is_some_and(|(current, _)| *current > 1.0));
}

#[test]
fn law_an_interrupt_has_several_samples_where_it_asks_for_them_and_a_task_beside_it() {
    let (folder, _) = built(&source("beside.c"), &[]);
    let text = |what: &str| {
        format!(
            "motor = \"light-vehicle\"\nerrors = \"none\"\n[detector]\nlibrary = \"mine.so\"\nconfig.what = \"{what}\"\n"
        )
    };
    for what in ["samples", "moved"] {
        let all = records(&plan(&folder, &text(what)).expect("valid"), 0..2);
        assert!(all.iter().all(|record| record.verdict() == Verdict::Found), "{what}: {}", all[0].reason());
    }
    // The task's phase is another one in each trial, and always the same in one.
    let tasks = plan(&folder, &text("task")).expect("valid");
    let all = records(&tasks, 0..200);
    assert!(all.iter().all(|record| record.verdict() == Verdict::Found), "{}", all[0].reason());
    let phase = |record: &Record| match record.run.ended {
        Ended::Outcome(Outcome::Found { angle, .. }) => angle.radians(),
        _ => f64::NAN,
    };
    let (low, high) =
        all.iter().map(phase).fold((1.0_f64, 0.0_f64), |(low, high), at| (low.min(at), high.max(at)));
    let mean = all.iter().map(phase).sum::<f64>() / 200.0;
    // Uniform: the mean of 200 has a deviation of 0.02.
    assert!(low < 0.05 && high > 0.95 && high <= 1.0 && (mean - 0.5).abs() < 0.1, "{low} {mean} {high}");
    assert_eq!(records(&tasks, 7..8)[0], all[7]);
    for (options, parts) in [
        (&["-DCOMMANDS"][..], ["a task at command level", "STS_INTERRUPT in flags"]),
        (&["-DPERIOD=10"], ["task_ns 10", "from 1000 to 10000000000"]),
        (&["-DSAMPLES=17"], ["samples 17", "from 1 to 16"]),
        (&["-DEVERY=0.6f"], ["3 samples from 0.1 on, one each 0.6", "before the next update"]),
    ] {
        let unused = ["-Wno-unused-function", "-Wno-unused-variable"];
        let (folder, _) = built(&source("beside.c"), &[options, &unused].concat());
        let refused = plan(&folder, &text("samples")).expect_err("cannot be").to_string();
        assert!(parts.iter().all(|part| refused.contains(part)), "{refused}");
    }
}
