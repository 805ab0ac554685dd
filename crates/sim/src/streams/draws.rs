//! The draws of one purpose, one after the other.

use std::f64::consts::TAU;
use std::ops::Range;

use super::normal::{
    lower_tail, normal_of_uniform, normals_of_uniforms, uniform_of_normal, uniform_of_word, value_of_draw,
};
use super::{AT_ONCE, IN_BLOCK, Purpose, Source, Tape};

/// The draws of one trial and purpose, read one after the other. Each number takes one draw; an angle takes two.
///
/// ```
/// use standstill_sim::{Purpose, Streams};
///
/// let mut noise = Streams::new(1, 0).open(Purpose::CurrentNoise);
/// let samples: Vec<f64> = (0..9).map(|_| 10e-3 * noise.normal()).collect();
/// // Many at once are the same.
/// let mut at_once = [0.0; 9];
/// Streams::new(1, 0).open(Purpose::CurrentNoise).normals(&mut at_once);
/// assert_eq!(samples, at_once.map(|normal| 10e-3 * normal));
/// ```
#[derive(Clone, Debug)]
pub struct Draws<'t> {
    seeded: Seeded,
    /// The tape, and the number of the strip that contains these draws. None if the draws come from the seed.
    strip: Option<(&'t Tape, usize)>,
    /// Number of the next draw.
    next: u64,
}

impl<'t> Draws<'t> {
    #[inline(always)]
    pub(super) fn new(source: Source, purpose: Purpose, strip: Option<(&'t Tape, usize)>) -> Self {
        Self { seeded: Seeded::new(source, purpose), strip, next: 0 }
    }

    /// Stores the random words of the first draws. The caller has already computed them from the seed.
    #[inline(always)]
    pub(super) fn beginning_with(mut self, words: &[u64]) -> Self {
        self.seeded.take(words, 0);
        self
    }

    /// Draws a standard normal.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        let number = self.advance();
        match self.strip {
            None => self.seeded.normal(number),
            Some(strip) => self.seeded.taped(strip, number),
        }
    }

    /// Fills `out` with standard normals.
    pub fn normals(&mut self, mut out: &mut [f64]) {
        while !out.is_empty() {
            let at_hand = if self.strip.is_none() { self.seeded.normals_from(self.next) } else { &[] };
            let count = at_hand.len().min(out.len()).max(1);
            let (some, rest) = out.split_at_mut(count);
            if at_hand.is_empty() {
                some[0] = self.normal();
            } else {
                some.copy_from_slice(&at_hand[..count]);
                self.next += count as u64;
            }
            out = rest;
        }
    }

    /// Draws a standard normal truncated to ±`most`. The p-quantile of the normal distribution becomes the p-quantile of the truncated
    /// one, so that larger draws give larger results.
    pub fn normal_within(&mut self, most: f64) -> f64 {
        let normal = self.normal();
        let outside = lower_tail(most);
        if outside == 0.0 {
            return normal;
        }
        // Computed from the nearer tail, because small probabilities are exact there.
        let share = lower_tail(normal.abs());
        let size = -normal_of_uniform(outside + share * (1.0 - 2.0 * outside));
        size.clamp(0.0, most).copysign(normal)
    }

    /// Draws a uniform number in [0, 1). The number is an odd multiple of 2^-49.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        let number = self.advance();
        match self.strip {
            None => self.seeded.uniform(number),
            Some(strip) => uniform_of_normal(self.seeded.taped(strip, number)),
        }
    }

    /// Draws a uniform number in `range`.
    pub fn uniform_in(&mut self, range: Range<f64>) -> f64 {
        range.start + (range.end - range.start) * self.uniform()
    }

    /// Draws an integer from 0 to `last`. All integers have the same probability, up to a relative error of `last`/2^48.
    #[inline]
    pub fn integer(&mut self, last: u64) -> u64 {
        let product = u128::from(value_of_draw(self.uniform())) * (u128::from(last) + 1);
        // At most `last`, which is a `u64`.
        #[allow(clippy::cast_possible_truncation)]
        let integer = (product >> 48) as u64;
        integer
    }

    /// Draws a uniform angle in rad in [0, 2π). It is the direction of a vector of two normals, so that a small change of a draw changes
    /// the direction little. An angle proportional to one uniform draw would jump: the draws 0 and 1 would belong to the same direction.
    pub fn angle(&mut self) -> f64 {
        let (x, y) = (self.normal(), self.normal());
        let angle = standstill_numeric::atan2(y, x);
        let angle = if angle < 0.0 { angle + TAU } else { angle };
        // A tiny negative angle plus 2π is rounded to 2π.
        if angle < TAU { angle } else { 0.0 }
    }

    fn advance(&mut self) -> u64 {
        let number = self.next;
        self.next += 1;
        number
    }
}

/// Generator of the draws of one source and purpose. Each draw depends only on the seed and on the draw's number. The last computed block
/// is kept.
#[derive(Clone, Debug)]
struct Seeded {
    source: Source,
    purpose: Purpose,
    /// The last computed draws.
    block: [f64; AT_ONCE],
    /// The numbers of the draws in `block`.
    numbers: Range<u64>,
    /// Whether the draws in `block` are standard normals instead of uniform numbers.
    are_normals: bool,
}

impl Seeded {
    #[inline(always)]
    fn new(source: Source, purpose: Purpose) -> Self {
        Self { source, purpose, block: [0.0; AT_ONCE], numbers: 0..0, are_normals: false }
    }

    #[inline]
    fn uniform(&mut self, number: u64) -> f64 {
        if !self.numbers.contains(&number) || self.are_normals {
            self.load(number);
        }
        self.at_hand(number)
    }

    #[inline]
    fn normal(&mut self, number: u64) -> f64 {
        if !self.numbers.contains(&number) {
            self.load(number);
        }
        if self.are_normals {
            return self.at_hand(number);
        }
        // Most purposes need only a few draws: these are converted one by one.
        if number < IN_BLOCK as u64 {
            return normal_of_uniform(self.at_hand(number));
        }
        normals_of_uniforms(&mut self.block);
        self.are_normals = true;
        self.at_hand(number)
    }

    /// Returns the normals that have already been computed, beginning with draw `number`.
    #[inline]
    fn normals_from(&self, number: u64) -> &[f64] {
        if !self.are_normals || !self.numbers.contains(&number) {
            return &[];
        }
        // Below the length of a block.
        #[allow(clippy::cast_possible_truncation)]
        let [from, to] = [number, self.numbers.end].map(|number| (number - self.numbers.start) as usize);
        &self.block[from..to]
    }

    /// Returns the normal of draw `number` from a tape's strip. Draws that are missing on the strip are appended from this generator.
    fn taped(&mut self, (tape, strip): (&Tape, usize), number: u64) -> f64 {
        let place = usize::try_from(number).expect("a tape fits into the memory");
        tape.read(strip, place, |number| self.normal(number))
    }

    #[inline]
    fn at_hand(&self, number: u64) -> f64 {
        // Below the length of a block.
        #[allow(clippy::cast_possible_truncation)]
        let place = (number - self.numbers.start) as usize;
        self.block[place]
    }

    /// Computes the uniform numbers of the block that contains draw `number`.
    ///
    /// The discriminant of a purpose is the position of its first block. The purpose's other blocks are far behind the first blocks of
    /// all purposes, in groups of four.
    #[cold]
    fn load(&mut self, number: u64) {
        const FIRST: u64 = IN_BLOCK as u64;
        const FOUR: u64 = AT_ONCE as u64;
        let place = self.purpose as u64;
        let (block, numbers) = if number < FIRST {
            (place, 0..FIRST)
        } else {
            let four = (number - FIRST) / FOUR;
            let start = FIRST + four * FOUR;
            (((place + 1) << 40) + 4 * four, start..start + FOUR)
        };
        self.take(&self.source.words(block), numbers.start);
        self.numbers = numbers;
    }

    /// Stores the uniform numbers of these random words. `from` is the number of the first draw.
    fn take(&mut self, words: &[u64], from: u64) {
        for (uniform, word) in self.block.iter_mut().zip(words) {
            *uniform = uniform_of_word(*word);
        }
        self.numbers = from..from + words.len() as u64;
        self.are_normals = false;
    }
}
