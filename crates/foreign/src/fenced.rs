//! Guards beside what a library writes.

/// A value with guards on both sides, which a library that writes beyond it overwrites.
#[repr(C)]
pub struct Fenced<T> {
    before: [u64; GUARDS],
    pub inside: T,
    after: [u64; GUARDS],
}

/// Words on each side.
const GUARDS: usize = 4;

/// No number, and no address.
const GUARD: u64 = 0xF5A3_96C1_7FFB_5E1D;

impl<T> Fenced<T> {
    /// This value.
    #[inline]
    pub fn new(inside: T) -> Self {
        Self { before: [GUARD; GUARDS], inside, after: [GUARD; GUARDS] }
    }

    /// Whether nobody has written beside it.
    #[inline]
    pub fn is_whole(&self) -> bool {
        // The compiler may not assume that nobody did.
        std::hint::black_box(&self);
        (self.before, self.after) == ([GUARD; GUARDS], [GUARD; GUARDS])
    }
}
