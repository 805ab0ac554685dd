//! What a detector costs a microcontroller: the size of its state, and how much it computes.
//!
//! ```text
//! cargo run --release --example footprint                      sizes, steps and samples of a detection
//! valgrind --tool=callgrind --toggle-collect='*counted*' --callgrind-out-file=/dev/null \
//!     target/release/examples/footprint bipolar all            instructions of all its steps ("Collected")
//!     target/release/examples/footprint bipolar last           of the last one, which concludes
//! ```
//! The detector runs in single precision on readings that were recorded before, so that nothing of the simulation is
//! counted. Instructions are those of the machine that this runs on, without its vector units' help: a microcontroller
//! with a floating-point unit needs about as many.

use std::error::Error;
use std::mem::size_of_val;

use standstill_detect::{AnyDetector, Method, MethodName, Settings};
use standstill_interface::{Detector, Reading, Step};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{NoProbe, RotorState, run};

/// Keeps what the drive answered.
struct Recorder {
    inner: AnyDetector<f64>,
    steps: Vec<Vec<Reading<f32>>>,
}

impl Detector<f64> for Recorder {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.steps.push(readings.iter().map(Reading::cast).collect());
        self.inner.step(readings)
    }
}

/// One step of a detector of one type, without the others around it.
#[inline(never)]
fn counted(detector: &mut dyn Detector<f32>, readings: &[Reading<f32>]) -> bool {
    matches!(detector.step(readings), Step::Done(_))
}

/// A detector and its size in bytes.
type Weighed = (Box<dyn Detector<f32>>, usize);

/// The detector inside, which is as large as its own method needs.
fn detector(settings: &Method<f32>) -> Result<Weighed, Box<dyn Error>> {
    fn boxed<D: Detector<f32> + 'static>(detector: D) -> Weighed {
        let size = size_of_val(&detector);
        (Box::new(detector), size)
    }
    Ok(match settings {
        Method::LineInductance(settings) => boxed(settings.detector()?),
        Method::Subdivision(settings) => boxed(settings.detector()?),
        Method::HfiRotating(settings) => boxed(settings.detector()?),
        Method::HfiPulsating(settings) => boxed(settings.detector()?),
        Method::DcAlignment(settings) => boxed(settings.detector()?),
        Method::Bipolar(settings) => boxed(settings.detector()?),
        Method::MaximumLikelihood(settings) => boxed(settings.detector()?),
        Method::OpenTerminal(settings) => boxed(settings.detector()?),
        Method::SixPulse(settings) => boxed(settings.detector()?),
        Method::Foreign(settings) => boxed(settings.detector()?),
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (only, last) = match &arguments[..] {
        [] => (None, false),
        [method, what] if what == "all" || what == "last" => (Some(method), what == "last"),
        _ => return Err("needed: nothing, or a method and `all` or `last`".into()),
    };
    println!("method                       state (bytes)   steps   samples");
    for method in MethodName::ALL.into_iter().filter(|method| only.is_none_or(|name| method.name() == name)) {
        let motor = built_in("paper-5k5").ok_or("no such motor")?;
        let scenario = Scenario::of_method(method, motor, ErrorSet::Default, RotorState::Locked, 1);
        let mut recorder = Recorder { inner: scenario.detector.detector()?, steps: Vec::new() };
        run(&scenario.case(0), &mut recorder, false, &mut NoProbe);
        let settings = Method::<f32>::suited(method, &scenario.nameplate().cast());
        let (mut detector, size) = detector(&settings)?;
        let steps = recorder.steps.len();
        for (number, readings) in recorder.steps.iter().enumerate() {
            let done = if last && number + 1 < steps {
                matches!(detector.step(readings), Step::Done(_))
            } else {
                counted(&mut *detector, readings)
            };
            if done {
                break;
            }
        }
        let samples: usize = recorder.steps.iter().map(Vec::len).sum();
        println!("{:28} {size:13} {steps:7} {samples:9}", method.name());
    }
    Ok(())
}
