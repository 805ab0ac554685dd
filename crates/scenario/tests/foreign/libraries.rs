//! What libraries may do, and what is told of those that cannot be a detector.

use standstill_interface::{Angle, Outcome};
use standstill_scenario::{Note, Plan, Record, Verdict};
use standstill_sim::Ended;
use tempfile::TempDir;

use crate::{plan, probe, records};

pub fn asking(what: &str) -> String {
    format!(
        "motor = \"light-vehicle\"\n[detector]\nlibrary = \"mine.so\"\n[detector.config]\nwhat = \"{what}\"\n"
    )
}

pub fn angles(records: &[Record]) -> Vec<f64> {
    records.iter().map(|record| record.estimated_angle_deg().expect("found").to_radians()).collect()
}

/// promise: libraries-set-back
#[test]
fn law_the_memory_of_a_library_is_set_back_before_each_trial() {
    let (folder, _) = probe(&[]);
    let starts = plan(&folder, &asking("starts")).expect("valid");
    let all = records(&starts, 0..40);
    assert!(angles(&all).iter().all(|angle| (angle - 0.1).abs() < 1e-6), "{:?}", angles(&all));
    // A library that says that it keeps nothing is left as it is, and then one sees that this one does.
    let (folder, _) = probe(&["-DFLAGS=STS_REENTRANT"]);
    let kept = plan(&folder, &asking("starts")).expect("valid");
    let angles = angles(&records(&kept, 0..40));
    assert!(angles.iter().any(|angle| *angle > 0.15), "{angles:?}");
}

#[test]
fn law_what_a_library_defines_is_its_own_whatever_the_c_library_has() {
    let (folder, _) = probe(&[]);
    let plan = plan(&folder, &asking("own")).expect("a library");
    // Bound to those of the C library, `random` were not 1 and `timezone` grew from trial to trial.
    for angle in angles(&records(&plan, 0..20)) {
        assert!((angle - 0.1).abs() < 1e-6, "{angle}");
    }
}

#[test]
fn law_each_trial_has_a_seed_of_its_own_and_always_the_same() {
    let (folder, _) = probe(&[]);
    let seeded = plan(&folder, &asking("seed")).expect("valid");
    let all = records(&seeded, 0..50);
    let mut angles = angles(&all);
    let scenario = seeded.scenario(0).expect("valid");
    for trial in [0, 31, 49] {
        assert_eq!(
            seeded.trial(0, &scenario, trial).expect("runs"),
            all[usize::try_from(trial).expect("small")]
        );
    }
    angles.sort_by(f64::total_cmp);
    angles.dedup();
    assert!(angles.len() > 45, "{angles:?}");
}

#[test]
fn law_an_outcome_carries_what_the_library_told() {
    let (folder, _) = probe(&[]);
    let of = |what: &str| records(&plan(&folder, &asking(what)).expect("valid"), 0..1)[0];
    let found = of("found");
    let Ended::Outcome(Outcome::Found { angle, findings }) = found.run.ended else { panic!("{found:?}") };
    assert_eq!(angle, Angle::from_radians(1.0));
    assert_eq!(findings.angle_deviation, Some(0.25));
    let evidence = findings.pole_evidence.expect("a value");
    assert_eq!((evidence.deviations, evidence.needed), (4.0, 3.0));
    assert_eq!((findings.age, found.error_at_instant_deg()), (Some(0.0), found.error_deg()));
    // What it asks for says nothing of a start for whose pole nothing speaks.
    let alone = of("needed-alone");
    assert_eq!(alone.verdict(), Verdict::Undetermined);
    let Ended::Outcome(outcome) = &alone.run.ended else { panic!("{alone:?}") };
    assert_eq!(outcome.findings().pole_evidence, None);
    let axis = of("axis");
    assert_eq!(
        (axis.age_s(), axis.axis_error_at_instant_deg()),
        (None, None),
        "what it does not write is not known"
    );
    assert_eq!(
        (axis.verdict(), axis.reason().as_str()),
        (Verdict::Undetermined, "the hall sensors disagree")
    );
    assert_eq!(axis.reason_name().as_deref(), Some("the hall sensors disagree"));
    let failed = of("failed");
    assert_eq!((failed.verdict(), failed.reason().as_str()), (Verdict::Failed, "reason 9"));
    assert_eq!(of("counts").reason(), "", "codes and values of the converters");
    assert_eq!(of("times").reason(), "", "times of the interrupts");
}

#[test]
fn law_what_a_library_asks_for_takes_effect_when_it_says() {
    for delay in 1..=4 {
        let (folder, _) = probe(&[&format!("-DDELAY={delay}")]);
        let seen = records(&plan(&folder, &asking("delay")).expect("valid"), 0..1);
        let Ended::Outcome(Outcome::Found { angle, .. }) = seen[0].run.ended else { panic!("{seen:?}") };
        // Asked for in call 0, it flows a quarter into half `delay`.
        assert_eq!(angle, Angle::from_radians(f64::from(delay)));
    }
}

#[test]
fn law_what_the_header_does_not_allow_is_a_failed_record_with_its_reason() {
    let (folder, _) = probe(&[]);
    for (what, reason) in [
        ("duty", "duty 1.5 of phase a, not from 0 to 1"),
        ("nan", "duty NaN of phase a"),
        ("leg", "leg a is asked for state 9"),
        ("status", "status 17, which is none of 0 to 3"),
        ("angle", "the angle is NaN"),
        ("angle-huge", "the angle is 1e30 rad"),
        ("evidence-nan", "pole_evidence is NaN"),
        ("deviation", "angle_deviation is -1, not 0 or more"),
        ("age-negative", "age is -1 s, not 0 or more"),
        ("age-long", "age is 2 s, longer than the detection"),
        ("beyond-result", "it wrote beyond its sts_result"),
        ("before-result", "it wrote beyond its sts_result"),
        ("beyond-legs", "it wrote beyond its sts_legs"),
        ("opens", "it calls dlopen in a detection"),
        ("evidence-alone", "pole_needed is not given beside a pole_evidence of 4"),
        ("needed-negative", "pole_needed is -1 beside a pole_evidence of -4"),
        ("never", "not done within 0.05 s"),
    ] {
        let text = asking(what).replace("[detector]\n", "[detector]\ntime_limit = \"50 ms\"\n");
        let all = records(&plan(&folder, &text).expect("valid"), 0..3);
        for record in all {
            assert_eq!(record.verdict(), Verdict::Failed, "{what}");
            assert!(record.reason().contains(reason), "{what}: {}", record.reason());
            assert!(record.run.duration.seconds() <= 0.05);
        }
    }
}

#[test]
fn law_commands_that_are_ever_shorter_do_not_go_on_for_ever() {
    let (folder, _) = probe(&["-DCOMMANDS"]);
    let of = |what: &str| {
        let text = asking(what).replace("[detector]\n", "[detector]\ntime_limit = \"300 ms\"\n");
        records(&plan(&folder, &text).expect("valid"), 0..1)[0]
    };
    let short = of("short");
    assert_eq!(short.reason(), "not done within 100000 commands of less than 1 us on average");
    assert_eq!((short.verdict(), short.run.duration.0), (Verdict::Failed, 100_100));
    assert_eq!(of("edge").reason(), "leg b is to switch at 2001 ns of a stage of 2000 ns");
    assert_eq!(of("beyond-command").reason(), "it wrote beyond its sts_command");
    // More commands than that are allowed where they take their time: then it is the time that ends it.
    let long = of("long");
    assert_eq!((long.reason().as_str(), long.run.duration.0), ("not done within 0.3 s", 300_000_000));
}

#[test]
fn law_a_detector_that_cannot_be_made_in_the_middle_ends_the_run_with_what_the_library_says() {
    let (folder, _) = probe(&[]);
    let text = asking("refuse-some").replace("[detector]\n", "[detector]\ntime_limit = \"20 ms\"\n");
    let plan = plan(&folder, &text).expect("the first trial's is made");
    let scenario = plan.scenario(0).expect("valid");
    let mut done = 0;
    let failed = plan.trials(0, &scenario, &mut (0..100), &mut |_| done += 1).expect_err("an eighth refuse");
    assert!(failed.error.to_string().contains("probe refused: this motor is not for me"), "{}", failed.error);
    assert!(done <= failed.trial, "{done} {}", failed.trial);
}

#[test]
fn law_configuration_can_be_an_axis_and_a_tolerance() {
    let (folder, _) = probe(&[]);
    let text = asking("found") + "angle = 0.5\n[axes]\n\"detector.config.angle\" = [0.5, 2.0]\n";
    let points = plan(&folder, &text).expect("valid");
    for (point, expected) in [0.5, 2.0].into_iter().enumerate() {
        let scenario = points.scenario(point).expect("valid");
        let record = points.trial(point, &scenario, 3).expect("runs");
        assert!((angles(&[record])[0] - expected).abs() < 1e-6);
    }
    let text =
        asking("found") + "angle = 0.5\n[tolerances]\n\"detector.config.angle\" = { uniform = \"20 %\" }\n";
    let mut angles = angles(&records(&plan(&folder, &text).expect("valid"), 0..30));
    angles.sort_by(f64::total_cmp);
    assert!(angles[0] >= 0.4 && angles[29] <= 0.6 && angles[29] - angles[0] > 0.1, "{angles:?}");
}

#[test]
fn law_the_library_is_part_of_the_run_and_its_text() {
    let (folder, library) = probe(&[]);
    let plan = plan(&folder, &asking("found")).expect("valid");
    let bytes = std::fs::metadata(library).expect("there").len();
    assert_eq!(plan.files()["mine.so"].bytes, bytes);
    let text = plan.text().expect("TOML");
    assert!(text.contains("library = \"mine.so\"") && text.contains("what = \"found\""), "{text}");
    assert!(!text.contains("method"), "{text}");
    let again = crate::plan(&folder, &text).expect("valid");
    assert_eq!(again.text().expect("TOML"), text);
    assert_eq!(again.scenario(0).expect("valid"), plan.scenario(0).expect("valid"));
}

/// Why a scenario with this library cannot be.
fn refused(options: &[&str], change: impl FnOnce(&mut Vec<u8>), text: &str) -> String {
    let (folder, library) = probe(options);
    let mut bytes = std::fs::read(&library).expect("there");
    change(&mut bytes);
    std::fs::write(&library, bytes).expect("written");
    plan(&folder, text).expect_err("must be refused").to_string()
}

/// A folder with libother.so, of these options, and one with a library that is linked to it and looks for it in `folders`.
fn linked(options: &[&str], folders: &str) -> (TempDir, TempDir) {
    let (first, other) = probe(&[&["-DNO_ENTRY", "-DOTHER=1"], options].concat());
    std::fs::rename(other, first.path().join("libother.so")).expect("renamed");
    let at = format!("-L{}", first.path().display());
    let folders = format!("-Wl,-rpath,{}", folders.replace("THERE", &first.path().display().to_string()));
    let options = ["-DLINKED", &at, "-Wl,--no-as-needed", "-Wl,--allow-shlib-undefined", "-lother", &folders];
    let (second, _) = probe(&options);
    (first, second)
}

#[test]
fn law_what_a_library_is_linked_to_is_part_of_the_run_and_is_set_back() {
    let digests = |plan: &Plan| -> Vec<(String, u32)> {
        plan.files().into_iter().map(|(path, digest)| (path, digest.crc32)).collect()
    };
    // With a name of its own and without, in a folder of its own and beside the library.
    for (options, folders) in [
        (&["-Wl,-soname,libother.so"][..], "THERE"),
        (&[], "THERE"),
        (&["-Wl,-soname,libother.so"], "$ORIGIN"),
    ] {
        let (other, folder) = linked(options, folders);
        let at = if folders == "THERE" { other.path() } else { folder.path() };
        std::fs::copy(other.path().join("libother.so"), at.join("libother.so.new")).expect("copied");
        std::fs::rename(at.join("libother.so.new"), at.join("libother.so")).expect("renamed");
        let before = plan(&folder, &asking("linked")).expect("valid");
        assert_eq!(before.files().len(), 2, "{:?}", before.files());
        assert_eq!(before.note(Note::Libraries), None);
        // It counts its calls: the first of each trial.
        for angle in angles(&records(&before, 0..20)) {
            assert!((angle - 0.1).abs() < 1e-6, "{angle}");
        }
        // Another build of it is another run, also in a program that knows the one of before.
        let (changed, _) = linked(&[options, &["-UOTHER", "-DOTHER=2"]].concat(), folders);
        std::fs::copy(changed.path().join("libother.so"), at.join("libother.so.new")).expect("copied");
        std::fs::rename(at.join("libother.so.new"), at.join("libother.so")).expect("renamed");
        let after = plan(&folder, &asking("linked")).expect("valid");
        assert_ne!(digests(&before), digests(&after));
        assert!((angles(&records(&after, 0..1))[0] - 0.2).abs() < 1e-6);
        // A run that has begun goes on with what it has read.
        assert!((angles(&records(&before, 20..21))[0] - 0.1).abs() < 1e-6);
    }
}

#[test]
fn law_what_a_library_loads_itself_is_part_of_the_run_and_is_said() {
    let (other, library) = probe(&["-DNO_ENTRY", "-DOTHER=1"]);
    let (folder, _) = probe(&[&format!("-DLOADS=\"{}\"", library.display())]);
    let plan = plan(&folder, &asking("found")).expect("valid");
    assert!(plan.files().contains_key(&library.display().to_string()), "{:?}", plan.files());
    let note = plan.note(Note::Libraries).expect("said");
    assert!(note.contains("it loads ") && note.contains("number of threads"), "{note}");
    drop(other);
}

/// The same of a library that is linked to another one, which is not where the loader looks.
fn refused_without_its_library(text: &str) -> String {
    let (other, folder) = linked(&["-Wl,-soname,libother.so"], "/nowhere");
    drop(other);
    plan(&folder, text).expect_err("must be refused").to_string()
}

#[test]
fn law_what_a_library_shares_with_its_copies_is_said() {
    let note = |options: &[&str]| {
        let (folder, _) = probe(options);
        plan(&folder, &asking("found")).expect("valid").note(Note::Libraries)
    };
    assert_eq!(note(&[]), None);
    let said = note(&["-DKEEPS"]).expect("it calls ctime");
    assert!(said.contains("it calls ctime:") && said.contains("number of threads"), "{said}");
}

/// promise: library-mistakes-first
#[test]
fn law_what_is_wrong_with_a_library_is_said_in_a_line_before_anything_runs() {
    let text = &asking("found");
    let same = |_: &mut Vec<u8>| {};
    let carrier = text.replace("[detector]\n", "inverter.carrier = \"10 kHz\"\n[detector]\n");
    let method = text.replace("[detector]\n", "[detector]\nmethod = \"bipolar\"\n");
    let pulse = text.replace("[detector]\n", "[detector]\npulse = \"100 us\"\n");
    let cases = [
        (
            refused(&[], same, &text.replace("mine.so", "none.so")),
            vec!["none.so", "cannot be read", "No such file"],
        ),
        (refused(&[], |bytes| *bytes = b"hello".to_vec(), text), vec!["no library"]),
        (refused(&[], |bytes| bytes.truncate(900), text), vec!["a damaged library"]),
        (refused(&["-c"], same, text), vec!["an object file, not yet linked"]),
        // The machine's number of another processor.
        (refused(&[], |bytes| bytes[18] = 40, text), vec!["a library for 32-bit Arm"]),
        (refused(&["-DMISSING"], same, text), vec!["HAL_ADC_Start", "TIM1_CNT", "stub them"]),
        (refused(&["-DNO_ENTRY"], same, text), vec!["without sts_entry"]),
        (
            refused_without_its_library(text),
            vec!["linked to libother.so, which cannot be loaded", "ldd names them"],
        ),
        (refused(&["-DABI=3"], same, text), vec!["a table of ABI 3, which is newer", "one of ABI 1 or 2"]),
        (refused(&["-DSIZE=40"], same, text), vec!["a table of 40 bytes", "at least 72 bytes"]),
        (refused(&["-DDELAY=7"], same, text), vec!["update_delay 7", "from 1 to 4"]),
        (refused(&["-DFLAGS=64"], same, text), vec!["flags 0x43"]),
        (refused(&["-DTHREAD_LOCAL"], same, text), vec!["4 bytes of thread-local memory"]),
        (refused(&[], same, &asking("refuse")), vec!["probe refused: this motor is not for me"]),
        (refused(&[], same, &carrier), vec!["a PWM of 12500 Hz", "`inverter.carrier`, 10000 Hz"]),
        (refused(&[], same, &method), vec!["`detector.method`", "beside `detector.library`"]),
        (refused(&[], same, &pulse), vec!["`detector.pulse`", "beside `detector.library`"]),
        (refused(&[], same, "detector.config.x = 1"), vec!["`detector.config.x`", "`detector.library`"]),
        (refused(&[], same, &(text.clone() + "list = [1]\n")), vec!["`detector.config.list`", "found array"]),
    ];
    for (message, parts) in cases {
        assert!(message.contains("s.toml"), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        for part in parts {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}
