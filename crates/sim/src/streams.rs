//! Random numbers: one stream per trial and purpose.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What a random number is for. Each purpose has a stream of its own, so that a new source of error does not
/// shift the draws of the others, and two methods on the same trial meet the same errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The rotor's angle.
    Angle = 0,
    /// Gain errors of the current sensors.
    CurrentGain = 1,
    /// Offsets of the current sensors.
    CurrentOffset = 2,
    /// Noise of each current sample.
    CurrentNoise = 3,
    /// Gain error and offset of the DC-link sensor.
    LinkError = 4,
    /// Noise of each DC-link sample.
    LinkNoise = 5,
    /// Jitter of each ADC trigger.
    Jitter = 6,
    /// Delays of the legs.
    GateDelay = 7,
    /// Phase of the DC link's ripple.
    Ripple = 8,
    /// Error of the resolver.
    Resolver = 9,
    /// Where within the play of its brake the rotor stands.
    Backlash = 10,
    /// What a tolerance draws.
    Tolerance = 11,
    /// The order of a Latin hypercube.
    Design = 12,
}

/// The random streams of one trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Streams {
    seed: u64,
    index: u64,
}

impl Streams {
    /// The streams of trial `index` under `seed`.
    pub const fn new(seed: u64, index: u64) -> Self {
        Self { seed, index }
    }

    /// Opens the stream of one purpose at its beginning.
    ///
    /// ChaCha has 2^64 streams per key: the seed makes the key, trial and purpose the stream. There is room for
    /// 16 purposes and 2^60 trials.
    pub fn open(self, purpose: Purpose) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream((self.index << 4) | purpose as u64);
        rng
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn law_streams_repeat_and_differ() {
        let draw = |seed, index, purpose| Streams::new(seed, index).open(purpose).random::<u64>();
        let first = draw(1, 0, Purpose::Angle);
        assert_eq!(first, draw(1, 0, Purpose::Angle));
        assert_ne!(first, draw(2, 0, Purpose::Angle));
        assert_ne!(first, draw(1, 1, Purpose::Angle));
        assert_ne!(first, draw(1, 0, Purpose::Jitter));
    }
}
