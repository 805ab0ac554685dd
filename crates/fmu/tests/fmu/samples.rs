//! Several samples in a step.

use standstill_fmu::{Model, Part};
use standstill_interface::{Nanos, Sampling};
use standstill_scenario::{Document, Plan};
use standstill_sim::{Trace, run};

use super::importer::{Slave, Unpacked, at};
use super::{FIELD, PERIOD, Script, command, set_legs};

fn model(text: &str, part: Part) -> Model {
    let document = Document::parse("s.toml".as_ref(), text).expect("TOML");
    Model::new(&document, part).expect("a model")
}

fn sampled(text: &str, samples: u32) -> Unpacked {
    at(model(text, Part::Drive).with_samples(samples).expect("a drive"))
}

/// Readings of a trial that is told the same: code, current and how it was sensed of each of four samples, in whole and half periods, also
/// where the converters take the phases one after another and average.
#[test]
fn cross_each_sample_of_a_step_is_that_of_a_trace() {
    let busy = "\nsensors.skew = \"1 us\"\nsensors.oversampling = 2";
    for (more, [first, every], whole) in [
        ("", [0.25, 0.25], true),
        ("", [0.1, 0.2], false),
        (busy, [0.0, 0.3], true),
        (
            "\ndetector.method = \"bipolar\"\nsensors.arrangement = \"dc-link-shunt\"\nsensors.terminals = true",
            [0.25, 0.25],
            true,
        ),
    ] {
        let text = format!("{FIELD}{more}");
        let unpacked = sampled(&text, 4);
        let slave = Slave::ready(&unpacked, &[("trial", 5.0), ("sample_at", first), ("sample_every", every)]);
        let length = if whole { PERIOD } else { Nanos(PERIOD.0 / 2) };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let [first, interval] = [first, every].map(|share| Nanos((share * length.0 as f64).round() as u64));
        let steps = 40;
        let sampling = Sampling { first, interval, count: 4 };
        let commands = (0..steps).map(|n| {
            let mut told = command(n, whole, n % 2 == 1, 1.0);
            told.sampling = sampling;
            told
        });
        let mut script = Script(commands.collect(), Vec::new());
        let plan = Plan::new(Document::parse("s.toml".as_ref(), &text).expect("TOML")).expect("valid");
        run(&plan.scenario(0).expect("valid").case(5), &mut script, false, &mut Trace::new(1e-3));
        assert_eq!(script.1.len(), 4 * steps as usize);
        let mut different = 0;
        for n in 0..steps {
            set_legs(&slave, n);
            let time = f64::from(n) * length.seconds();
            assert_eq!(slave.step(time, length.seconds()), 0, "{}", slave.said());
            let readings = &script.1[4 * n as usize..][..4];
            for (number, reading) in (1..).zip(readings) {
                for (k, phase) in ["a", "b", "c"].iter().enumerate() {
                    let [current, code] =
                        ["sampled", "count"].map(|of| slave.get(&format!("{of}_{number}.i_{phase}")));
                    assert_eq!(current.to_bits(), reading.current.0[k].to_bits(), "{n}, {number}, {phase}");
                    assert_eq!(code, f64::from(reading.counts.current.0[k]));
                }
                assert_eq!(slave.get(&format!("sampled_{number}.u_dc")).to_bits(), reading.dc_link.to_bits());
                if more.contains("terminals") {
                    assert_eq!(slave.get(&format!("sampled_{number}.u_b")), reading.terminal.0[1]);
                    assert_eq!(slave.get(&format!("sampled_{number}.i_link")), reading.link_current);
                }
            }
            // Those without a number are the last one.
            assert_eq!(slave.get("sampled.i_a"), slave.get("sampled_4.i_a"));
            // A shunt in the link sees no phase.
            let of = |number: u32| ["i_a", "u_dc"].map(|of| slave.get(&format!("sampled_{number}.{of}")));
            different += usize::from(of(1) != of(4));
        }
        assert!(different > 10, "{different} of {steps} steps have samples that differ");
    }
}

/// References of one sample stay what they are, and an FMU of one sample is not told from one of before.
#[test]
fn law_further_samples_come_after_all_other_variables() {
    let one = model(FIELD, Part::Drive);
    let four = sampled(FIELD, 4).model;
    let names = |of: &Model| of.variables.iter().map(|of| of.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&four)[..one.variables.len()], names(&one));
    let readings =
        one.variables.iter().filter(|of| of.is_output() && !of.name.starts_with("actual.")).count();
    assert_eq!(four.variables.len(), one.variables.len() + 1 + 4 * readings);
    assert_ne!(four.token(), one.token());
    let start = |name: &str| four.variables.iter().find(|of| of.name == name).and_then(|of| of.start);
    assert_eq!([start("sample_at"), start("sample_every")], [Some(0.25); 2]);
    let mut names = names(&four);
    names.sort();
    names.dedup();
    assert_eq!(names.len(), four.variables.len(), "each name stands once");
}

#[test]
fn law_samples_behind_the_end_of_a_step_are_refused() {
    let unpacked = sampled(FIELD, 3);
    for (at, every, fits) in
        [(1.0 / 3.0, 1.0 / 3.0, true), (0.5, 0.25, true), (0.5, 0.3, false), (1.0, 0.1, false)]
    {
        let slave = Slave::begun(&unpacked, &[("sample_at", at), ("sample_every", every)]);
        assert_eq!(slave.call("fmi2ExitInitializationMode") == 0, fits, "{at} {every}: {}", slave.said());
        if fits {
            set_legs(&slave, 0);
            assert_eq!(slave.step(0.0, PERIOD.seconds()), 0, "{}", slave.said());
        } else {
            assert!(
                slave.said().contains("`sample_every`: found") && slave.said().contains("needed at most")
            );
        }
    }
    for wrong in [0, 1, 17] {
        let error =
            model(FIELD, Part::Drive).with_samples(wrong).expect_err("too few or too many").to_string();
        assert!(error.contains("needed from 1 to 16"), "{error}");
    }
    let error =
        model("motor = \"paper-5k5\"", Part::Motor).with_samples(2).expect_err("no converters").to_string();
    assert!(error.contains("--part drive"), "{error}");
}
