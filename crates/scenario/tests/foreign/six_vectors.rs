//! The six vectors of `examples/c/six_vectors.c` in Rust, line by line: the same bits, and what a call costs.

use std::hint::black_box;
use std::time::Instant;

use standstill_detect::Nameplate;
use standstill_interface::{
    Abc, Angle, Command, Detector, Findings, Leg, Nanos, Outcome, Own, Reading, Sampling, Stage, Step,
    Undetermined,
};
use standstill_scenario::Record;
use standstill_sim::{Ended, NoProbe, Run, run};

use crate::{example, plan};

const COS: [f32; 6] = [1.0, 0.5, -0.5, -1.0, -0.5, 0.5];
const SIN: [f32; 6] = [0.0, S, S, 0.0, -S, -S];
const S: f32 = 0.866_025_4;
const HIGH: [[bool; 3]; 6] = [
    [true, false, false],
    [true, true, false],
    [false, true, false],
    [false, true, true],
    [false, false, true],
    [true, false, true],
];

struct SixVectors {
    pulse: Nanos,
    peaks: Vec<f32>,
    /// The angle before it was brought into one turn.
    angle: f32,
}

#[allow(clippy::excessive_precision, reason = "as in the C source")]
fn arc(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (big, small) = if ax > ay { (ax, ay) } else { (ay, ax) };
    if big == 0.0 {
        return 0.0;
    }
    let z = small / big;
    let z2 = z * z;
    let polynomial = [0.052_653_32, -0.116_432_87, 0.193_543_46, -0.332_623_47, 0.999_977_26_f32];
    let mut a = polynomial.into_iter().fold(-0.011_721_2_f32, |a, c| a * z2 + c) * z;
    if ay > ax {
        a = std::f32::consts::FRAC_PI_2 - a;
    }
    if x < 0.0 {
        a = std::f32::consts::PI - a;
    }
    if y < 0.0 { -a } else { a }
}

fn root(of: f32) -> f32 {
    let mut root = of;
    for _ in 0..40 {
        if root > 0.0 {
            root = 0.5 * (root + of / root);
        }
    }
    root
}

impl SixVectors {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "as the C source computes")]
    fn new(drive: &Nameplate<f64>) -> Self {
        let [rated, ld, link] =
            [drive.rated_current, drive.d_axis_inductance, drive.dc_link].map(|value| value as f32);
        let pulse_us = 0.5 * rated * ld * 1.5 / link * 1e6;
        Self { pulse: Nanos((pulse_us * 1000.0) as u64), peaks: Vec::new(), angle: 0.0 }
    }

    fn found(&mut self) -> Outcome<f32> {
        let (mut mean, mut x1, mut y1, mut x2, mut y2) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        for (k, peak) in self.peaks.iter().enumerate() {
            mean += peak / 6.0;
            x1 += peak * COS[k] / 3.0;
            y1 += peak * SIN[k] / 3.0;
            x2 += peak * COS[2 * k % 6] / 3.0;
            y2 += peak * SIN[2 * k % 6] / 3.0;
        }
        let mut axis = 0.5 * arc(y2, x2);
        let length = root(x2 * x2 + y2 * y2);
        let c = root(0.5 * (1.0 + x2 / length));
        let s = y2 / length / (2.0 * c);
        let along = x1 * c + y1 * s;
        if along < 0.0 {
            axis += std::f32::consts::PI;
        }
        self.angle = axis;
        let (angle, findings) = (Angle::from_radians(axis), Findings::default());
        if along.abs() < 0.002 * mean {
            let own = Own { code: 2, text: "the poles answer too much alike" };
            return Outcome::Axis { angle, reason: Undetermined::Own(own), findings };
        }
        Outcome::Found { angle, findings }
    }
}

impl Detector<f32> for SixVectors {
    fn step(&mut self, readings: &[Reading<f32>]) -> Step<f32> {
        if let [reading] = readings {
            let Abc([a, b, c]) = reading.current;
            let last = self.peaks.len();
            let beta = (b - c) * 0.577_350_27;
            self.peaks.push(a * COS[last] + beta * SIN[last]);
        }
        if self.peaks.len() == 6 {
            return Step::Done(self.found());
        }
        let legs = HIGH[self.peaks.len()].map(|high| if high { Leg::High } else { Leg::Low });
        Step::Drive(Command::sequence(
            Stage { legs: Abc(legs), duration: self.pulse },
            Stage::off(self.pulse * 3),
            Sampling::once(self.pulse),
        ))
    }
}

/// The twin's run with its outcome in double precision: what is told of it.
fn in_double(run: &Run<f32>) -> Run<f64> {
    let findings = Findings::default();
    let ended = match run.ended {
        Ended::Outcome(Outcome::Axis { reason: Undetermined::Own(own), .. }) => {
            let angle = Angle::from_radians(0.0);
            Ended::Outcome(Outcome::Axis { angle, reason: Undetermined::Own(own), findings })
        }
        _ => Ended::Outcome(Outcome::Found { angle: Angle::from_radians(0.0), findings }),
    };
    Run {
        ended,
        duration: run.duration,
        start_angle: run.start_angle,
        end_angle: run.end_angle,
        instant_angle: run.instant_angle,
        has_pole: run.has_pole,
        resolver_angle: run.resolver_angle,
        moved: run.moved,
        peak_current: run.peak_current,
        ledger: run.ledger,
        work: run.work,
    }
}

#[test]
fn cross_six_vectors_from_c_give_the_bits_of_the_same_detector_in_rust() {
    let (folder, _) = example("six_vectors.c");
    let mut angles = std::collections::BTreeSet::new();
    for motor in ["light-vehicle", "paper-5k5"] {
        let text = format!("motor = \"{motor}\"\ndetector.library = \"mine.so\"\n");
        let plan = plan(&folder, &text).expect("valid");
        let scenario = plan.scenario(0).expect("valid");
        let records = crate::records(&plan, 0..60);
        let mut near = 0;
        for record in &records {
            let case = scenario.case(record.trial);
            let mut twin = SixVectors::new(&scenario.nameplate());
            let own = run(&case, &mut twin, false, &mut NoProbe);
            let Ended::Outcome(Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) = record.run.ended
            else {
                panic!("{}", record.reason())
            };
            let reasons =
                [*record, Record { trial: record.trial, run: in_double(&own) }].map(|one| one.reason());
            assert_eq!(reasons[0], reasons[1]);
            assert_eq!(angle, Angle::from_radians(f64::from(twin.angle)), "{motor}, trial {}", record.trial);
            assert_eq!(
                (record.run.duration, record.run.peak_current, record.run.end_angle, record.run.work),
                (own.duration, own.peak_current, own.end_angle, own.work)
            );
            angles.insert(angle.radians().to_bits());
            near += u32::from(record.error_deg().is_some_and(|error| error.abs() < 10.0));
        }
        assert!(near > 50, "{motor}: it is a detector, {near} of 60");
    }
    assert!(angles.len() > 100, "trials differ");
}

/// A detector and what it was told.
struct Recorder<D> {
    inner: D,
    steps: Vec<Vec<Reading<f64>>>,
}

impl<D: Detector<f64>> Detector<f64> for Recorder<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.steps.push(readings.to_vec());
        self.inner.step(readings)
    }
}

/// Detections that are timed at once: some 20 µs, so that many are not interrupted.
const AT_ONCE: u32 = 20;

/// The least time in ns of a detection by each of two, by turns.
fn least(mut both: [&mut dyn FnMut(); 2]) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for _ in 0..3000 {
        for (least, detection) in least.iter_mut().zip(&mut both) {
            let begin = Instant::now();
            for _ in 0..AT_ONCE {
                detection();
            }
            *least = least.min(begin.elapsed().as_secs_f64() * 1e9 / f64::from(AT_ONCE));
        }
    }
    least
}

/// `cargo test -p standstill-scenario --test foreign law_a_call -- --nocapture` prints the figures.
#[test]
#[allow(clippy::cast_possible_truncation, reason = "readings in single precision")]
fn law_a_call_into_a_library_costs_little_beside_the_same_detector_in_rust() {
    let (folder, _) = example("six_vectors.c");
    let plan = plan(&folder, "motor = \"light-vehicle\"\ndetector.library = \"mine.so\"\n").expect("valid");
    let scenario = plan.scenario(0).expect("valid");
    let case = scenario.case(0);
    let inner = scenario.detector_for(&case).expect("made");
    let mut recorder = Recorder { inner, steps: Vec::new() };
    run(&case, &mut recorder, false, &mut NoProbe);
    let steps = recorder.steps;
    let single: Vec<Vec<Reading<f32>>> =
        steps.iter().map(|readings| readings.iter().map(Reading::cast).collect()).collect();
    let (maker, nameplate) = (scenario.foreign.as_ref().expect("a library"), scenario.nameplate());
    let [c, rust] = least([
        &mut || {
            let mut detector = maker.detector(7, 0.0, Some(0)).expect("made");
            for readings in &steps {
                let _ = black_box(detector.step(black_box(readings)));
            }
        },
        &mut || {
            let mut detector = SixVectors::new(&nameplate);
            for readings in &single {
                let _ = black_box(detector.step(black_box(readings)));
            }
        },
    ]);
    let calls = steps.len() as f64;
    let most = 1.3 * rust + 200.0 * calls;
    println!(
        "six vectors, a detection of {calls} calls: {c:.0} ns in C, {rust:.0} ns in Rust; 1.3 times that and 200 ns a call are {most:.0} ns"
    );
    assert!(c < most, "{c} ns against {most} ns");
}
