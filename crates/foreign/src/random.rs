//! The random numbers of the C library, number by number the same, as a value: an image has its own.

/// `rand` and `random`: the additive feedback r(i) = r(i − 3) + r(i − 31) of the GNU C library.
#[derive(Clone, Debug)]
pub struct Random {
    last: [u32; 31],
    next: u32,
}

impl Default for Random {
    fn default() -> Self {
        Self::of(1)
    }
}

impl Random {
    /// Makes the state after `srand(seed)`.
    pub fn of(seed: u32) -> Self {
        let mut last = [0_u32; 31];
        // The minimal standard generator of Park and Miller, whose seed is not 0.
        let mut word = i64::from(seed.max(1).cast_signed());
        for slot in &mut last {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 2^31")]
            let bits = word as u32;
            *slot = bits;
            word = word * 16_807 % 2_147_483_647;
            word += if word < 0 { 2_147_483_647 } else { 0 };
        }
        // The sequence begins with its first three numbers again, as r(i) = r(i − 31).
        let mut random = Self { last, next: 0 };
        random.next = 3;
        for _ in 0..310 {
            random.next();
        }
        random
    }

    /// Returns the next number from 0 to 2³¹ − 1.
    pub fn next(&mut self) -> i32 {
        let at = self.next as usize;
        let word = self.last[at].wrapping_add(self.last[(at + 28) % 31]);
        self.last[at] = word;
        self.next = (self.next + 1) % 31;
        (word >> 1).cast_signed()
    }
}

/// `drand48`, `lrand48` and `mrand48`: X ← (5DEECE66D₁₆ X + B₁₆) mod 2⁴⁸.
#[derive(Clone, Debug, Default)]
pub struct Random48(u64);

impl Random48 {
    /// Makes the state after `srand48(seed)`, which uses 32 bits of the seed.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "32 bits")]
    pub fn of(seed: i64) -> Self {
        Self(u64::from(seed as u32) << 16 | 0x330E)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(0x0005_DEEC_E66D).wrapping_add(0xB) & 0xFFFF_FFFF_FFFF;
        self.0
    }

    /// Returns a number from 0 to below 1.
    pub fn share(&mut self) -> f64 {
        self.next() as f64 / (1_u64 << 48) as f64
    }

    /// Returns a number from 0 to 2³¹ − 1.
    #[allow(clippy::cast_possible_wrap, reason = "31 bits")]
    pub fn positive(&mut self) -> i64 {
        (self.next() >> 17) as i64
    }

    /// Returns a number from −2³¹ to 2³¹ − 1.
    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "32 bits")]
    pub fn signed(&mut self) -> i64 {
        i64::from((self.next() >> 16) as i32)
    }
}

#[cfg(test)]
#[allow(unsafe_code, reason = "the C library's own numbers are asked for")]
mod tests {
    use super::*;

    #[test]
    fn cross_random_numbers_are_those_of_the_c_library() {
        for seed in [None, Some(0), Some(1), Some(77), Some(u32::MAX)] {
            let (mut own, mut own_48) = (Random::default(), Random48::default());
            // SAFETY: functions of numbers; no other test of this program asks for them.
            unsafe {
                if let Some(seed) = seed {
                    libc::srand(seed);
                    libc::srand48(seed.into());
                    (own, own_48) = (Random::of(seed), Random48::of(seed.into()));
                }
                for k in 0..1000 {
                    assert_eq!(own.next(), libc::rand(), "{seed:?}, {k}");
                    match k % 3 {
                        0 => assert_eq!(own_48.share().to_bits(), libc::drand48().to_bits(), "{seed:?}"),
                        1 => assert_eq!(own_48.positive(), libc::lrand48(), "{seed:?}"),
                        _ => assert_eq!(own_48.signed(), libc::mrand48(), "{seed:?}"),
                    }
                }
            }
        }
    }
}
