//! Random numbers: numbered draws for each trial and purpose, computed from a seed or read from a tape.

mod draws;
mod normal;
mod tape;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};
use serde::{Deserialize, Serialize};

pub use draws::Draws;
pub use tape::{Strip, Tape};

/// Purpose of a random number. Each purpose has its own draws. So a new source of error does not change the draws of the others, and two
/// methods see the same errors in the same trial.
///
/// The discriminant of a purpose is the number of the generator's block that contains its first draws. Purposes that are drawn together
/// are neighbours in groups of four, because the generator computes four blocks at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Purpose {
    /// The rotor's angle.
    Angle = 0,
    /// Gate delays of the legs.
    GateDelay = 1,
    /// Phase of the DC link's ripple.
    Ripple = 2,
    /// Position of the rotor within the play of its brake.
    Backlash = 3,
    /// Gain errors of the current sensors.
    CurrentGain = 4,
    /// Offsets of the current sensors.
    CurrentOffset = 5,
    /// Gain error and offset of the DC-link sensor.
    LinkError = 6,
    /// Error of the resolver.
    Resolver = 7,
    /// Noise of each current sample. Draw 3 n + k belongs to phase k in sample n.
    CurrentNoise = 8,
    /// Noise of each DC-link sample.
    LinkNoise = 9,
    /// Jitter of each ADC trigger.
    Jitter = 10,
    /// Corner frequencies of the current sensors. Draw 0 applies to all phases; draws 1 to 3 apply to one phase each.
    Bandwidth = 11,
    /// Values of a scenario's keys with a tolerance. Each key has its own draws, which have the key's name.
    Tolerance = 12,
    /// Choices made by a computation on many trials, such as the order of a Latin hypercube. They do not belong to a single trial.
    Design = 13,
    /// The seed given to an external detector.
    Detector = 14,
    /// Direction of the last magnetisation of the stator's iron.
    Memory = 15,
    /// Gain errors of the dividers at the terminals.
    TerminalGain = 20,
    /// Offsets of the dividers at the terminals.
    TerminalOffset = 21,
    /// Noise of each sample of the terminals' voltages. Draw 3 n + k belongs to phase k in sample n.
    TerminalNoise = 22,
    /// Offsets of the comparators.
    ComparatorOffset = 24,
    /// Propagation delays of the comparators.
    ComparatorDelay = 25,
    /// Error of the timer's clock, and the phase of its ticks relative to the pulses.
    CaptureTimer = 26,
    /// Noise at the comparators. There is one draw for each command with a threshold, or one for each value of band-limited noise.
    ComparatorNoise = 27,
    /// Location, size, sign and onset of faults. Each fault takes four draws.
    Fault = 28,
}

/// The random draws of one trial. They come from the seed or from a [`Tape`].
///
/// Draw n of a purpose depends only on the seed, the trial, the purpose and n. It does not depend on the number and the distribution of
/// other draws, or on how many draws were computed together.
///
/// ```
/// use standstill_sim::{Purpose, Streams, Tape};
///
/// let mut seeded = Streams::new(1, 7).open(Purpose::Resolver);
/// // A tape without draws continues as the trial whose number it has.
/// let mut tape = Tape::new(1, 7);
/// let first = Streams::taped(&tape).open(Purpose::Resolver).normal();
/// assert_eq!(first, seeded.normal());
/// assert_eq!(tape.normals(Purpose::Resolver), &[first]);
/// // What is given is read instead.
/// *tape.normals(Purpose::Resolver) = vec![-3.0];
/// let mut given = Streams::taped(&tape).open(Purpose::Resolver);
/// assert_eq!([given.normal(), given.normal()], [-3.0, seeded.normal()]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Streams<'t> {
    source: Source,
    tape: Option<&'t Tape>,
}

impl<'t> Streams<'t> {
    /// Makes the draws of the trial with number `index` from a seed.
    pub fn new(seed: u64, index: u64) -> Self {
        Self { source: Source::new(seed, index), tape: None }
    }

    /// Makes draws that are read from a tape. Draws beyond the tape's end come from the tape's own seed and are appended to the tape.
    pub fn taped(tape: &'t Tape) -> Self {
        Self { source: tape.source(), tape: Some(tape) }
    }

    /// Returns the number of the trial.
    pub fn index(self) -> u64 {
        self.source.index
    }

    /// Returns the draws of one purpose, beginning with the first. The first draw is computed when it is requested.
    pub fn open(self, purpose: Purpose) -> Draws<'t> {
        self.open_named(purpose, "")
    }

    /// Returns the draws of at most four successive purposes. The first draws of all of them are computed at once, in the time that the
    /// generator needs for a single purpose.
    ///
    /// # Panics
    /// Panics if the discriminants of the purposes are not successive.
    pub fn open_together<const N: usize>(self, purposes: [Purpose; N]) -> [Draws<'t>; N] {
        let words = self.source.words(purposes[0] as u64);
        std::array::from_fn(|k| {
            assert_eq!(purposes[k] as usize, purposes[0] as usize + k, "purposes that follow each other");
            self.open(purposes[k]).beginning_with(&words[IN_BLOCK * k..IN_BLOCK * (k + 1)])
        })
    }

    /// Returns the draws with one purpose and a name. The name is, for example, that of a key with a tolerance.
    #[inline]
    pub fn open_named(self, purpose: Purpose, name: &str) -> Draws<'t> {
        let strip = self.tape.map(|tape| (tape, tape.strip(purpose, name)));
        Draws::new(self.source.named(name), purpose, strip)
    }
}

/// Number of 64-bit words that the generator computes at once: four blocks.
const AT_ONCE: usize = 32;

/// Number of 64-bit words in a block.
const IN_BLOCK: usize = 8;

/// Source of one trial's draws, with the key and the stream of the ChaCha generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Source {
    /// Key of ChaCha. It is derived from the seed only once, not again for each purpose.
    key: [u8; 32],
    index: u64,
}

impl Source {
    fn new(seed: u64, index: u64) -> Self {
        Self { key: ChaCha8Rng::seed_from_u64(seed).get_seed(), index }
    }

    /// Returns the source of the draws with this name. A hash of the name changes the key. An empty name leaves the source unchanged.
    fn named(mut self, name: &str) -> Self {
        if !name.is_empty() {
            // FNV-1a.
            let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
            });
            for (key, hash) in self.key.iter_mut().zip(hash.to_le_bytes()) {
                *key ^= hash;
            }
        }
        self
    }

    /// Returns the random words of four blocks, beginning with the block `block`.
    ///
    /// ChaCha has 2^64 streams of 2^64 blocks for each key. The seed determines the key, and the trial's number selects the stream.
    fn words(&self, block: u64) -> [u64; AT_ONCE] {
        let mut rng = ChaCha8Rng::from_seed(self.key);
        rng.set_stream(self.index);
        rng.set_word_pos(u128::from(block) << 4);
        let mut bytes = [0; 8 * AT_ONCE];
        rng.fill_bytes(&mut bytes);
        let (words, _) = bytes.as_chunks::<8>();
        let mut numbers = [0; AT_ONCE];
        for (number, word) in numbers.iter_mut().zip(words) {
            *number = u64::from_le_bytes(*word);
        }
        numbers
    }
}

#[cfg(test)]
mod tests;
