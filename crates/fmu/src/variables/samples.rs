//! Variables of several samples in a step.

use super::{Kind, Role, SHARE, Variable};

/// With several samples in a step: what lies between them, and the readings of each beside those of the last one. They come after all
/// others, so that value references stay.
pub(crate) fn add_samples(all: &mut Vec<Variable>, samples: u32) {
    let between = 1.0 / f64::from(samples);
    if let Some(at) = all.iter_mut().find(|of| of.role == Role::SampleAt) {
        at.start = Some(between);
        "When the converters sample for the first time, as a share of the step".clone_into(&mut at.about);
    }
    let about = "From one sample of a step to the next, as a share of the step";
    let every = Variable::new("sample_every", about, Kind::Real, Role::SampleEvery);
    let every = every.start(between).limits([0.0, 1.0], SHARE);
    let readings: Vec<Variable> =
        all.iter().filter(|of| matches!(of.role, Role::Sampled(_))).cloned().collect();
    all.push(every);
    for number in 1..=samples {
        for last in &readings {
            let Role::Sampled(of) = last.role else { continue };
            let name = last.name.replacen('.', &format!("_{number}."), 1);
            let about = format!("Sample {number} of {samples} of the step. {}", last.about);
            let role = Role::Sample(number as usize - 1, of);
            all.push(Variable { name, about, role, ..last.clone() });
        }
    }
}
