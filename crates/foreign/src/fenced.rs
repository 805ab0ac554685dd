//! Guard words around memory that a library writes.

/// A value with guards on both sides, which a library that writes beyond it overwrites.
#[repr(C)]
pub struct Fenced<T> {
    before: [u32; GUARDS],
    pub inside: T,
    after: [u32; GUARDS],
}

/// Number of four-byte words on each side. Words of this size leave no gap between them and the value.
const GUARDS: usize = 8;

/// Value of a guard: neither a number nor half of an address.
const GUARD: u32 = 0x7FFB_5E1D;

impl<T> Fenced<T> {
    /// This value.
    #[inline]
    pub fn new(inside: T) -> Self {
        Self { before: [GUARD; GUARDS], inside, after: [GUARD; GUARDS] }
    }

    /// Returns the value if its guards are unchanged; `name`: its type in C.
    ///
    /// # Errors
    /// The guards were overwritten.
    #[inline]
    pub fn whole(self, name: &'static str) -> Result<T, Beyond> {
        // The compiler may not assume that nobody did.
        std::hint::black_box(&self);
        if (self.before, self.after) == ([GUARD; GUARDS], [GUARD; GUARDS]) {
            Ok(self.inside)
        } else {
            Err(Beyond(name))
        }
    }
}

/// A library wrote beyond a struct of this type.
#[derive(Clone, Copy, Debug)]
pub struct Beyond(pub &'static str);
