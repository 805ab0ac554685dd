//! Rounding mode and exception flags of the processor. Each image has its own, and the program has none of the image's.
#![allow(unsafe_code, reason = "registers of the processor that the language does not know")]

/// Registers of floating point.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub struct Float {
    /// Control and status register of single and double precision.
    sse: u32,
    /// Control word of `long double`; `seen`: its status word with the exceptions so far.
    x87: u16,
    seen: u16,
}

/// The state at a program's start.
#[cfg(target_arch = "x86_64")]
impl Default for Float {
    fn default() -> Self {
        Self { sse: 0x1F80, x87: 0x37F, seen: 0 }
    }
}

#[cfg(target_arch = "x86_64")]
static X87: u16 = 0x37F;

#[cfg(target_arch = "x86_64")]
impl Float {
    /// Sets the processor to this state and returns the previous one. A state that is already set costs nothing.
    #[inline]
    pub fn begin(&self) -> Self {
        let mut before = Self::default();
        // SAFETY: registers are read, and set to what they were in this image; the program computes nothing until `end`.
        unsafe {
            std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut before.sse, options(nostack, preserves_flags));
            if before.sse != self.sse {
                std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const self.sse, options(nostack, preserves_flags));
            }
        }
        if self.x87 != 0x37F || self.seen != 0 {
            self.begin_x87();
        }
        before
    }

    #[cold]
    fn begin_x87(&self) {
        let mut all = [0_u32; 7];
        // SAFETY: as in `begin`; the environment has 28 bytes.
        unsafe {
            std::arch::asm!("fnstenv [{}]", in(reg) &raw mut all, options(nostack));
            all[0] = all[0] & !0xFFFF | u32::from(self.x87);
            all[1] |= u32::from(self.seen);
            std::arch::asm!("fldenv [{}]", in(reg) &raw const all, options(nostack));
        }
    }

    /// Stores the processor's present state here and restores the state `before`.
    #[inline]
    pub fn end(&mut self, before: Self) {
        let mut seen: u16;
        // SAFETY: registers are read, and set to what they were before the image.
        unsafe {
            std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut self.sse, options(nostack, preserves_flags));
            if before.sse != self.sse {
                std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const before.sse, options(nostack, preserves_flags));
            }
            std::arch::asm!("fnstcw [{}]", in(reg) &raw mut self.x87, options(nostack, preserves_flags));
            std::arch::asm!("fnstsw ax", out("ax") seen, options(nostack, preserves_flags));
        }
        // Invalid, denormal, by zero, overflow, underflow, inexact; the stack's fault goes with the first.
        self.seen = seen & 0x7F;
        if self.x87 != 0x37F || self.seen != 0 {
            // SAFETY: as above.
            unsafe {
                std::arch::asm!("fnclex", "fldcw [{}]", in(reg) &raw const X87, options(nostack, preserves_flags));
            }
        }
    }
}

/// Registers of floating point: control and status.
#[cfg(target_arch = "aarch64")]
#[derive(Clone, Copy, Debug, Default)]
pub struct Float {
    control: u64,
    status: u64,
}

#[cfg(target_arch = "aarch64")]
impl Float {
    fn now() -> Self {
        let (control, status): (u64, u64);
        // SAFETY: registers are read.
        unsafe {
            std::arch::asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack, preserves_flags));
            std::arch::asm!("mrs {}, fpsr", out(reg) status, options(nomem, nostack, preserves_flags));
        }
        Self { control, status }
    }

    fn set(self, now: Self) {
        // SAFETY: registers are set to what they were before, in the program or in the image.
        unsafe {
            if self.control != now.control {
                std::arch::asm!("msr fpcr, {}", in(reg) self.control, options(nomem, nostack, preserves_flags));
            }
            if self.status != now.status {
                std::arch::asm!("msr fpsr, {}", in(reg) self.status, options(nomem, nostack, preserves_flags));
            }
        }
    }

    /// Sets the processor to this state and returns the previous one.
    #[inline]
    pub fn begin(&self) -> Self {
        let before = Self::now();
        self.set(before);
        before
    }

    /// Stores the processor's present state here and restores the state `before`.
    #[inline]
    pub fn end(&mut self, before: Self) {
        *self = Self::now();
        before.set(*self);
    }
}

/// Placeholder for processors of which rounding mode and flags are unknown here: an image shares them with the program.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
#[derive(Clone, Copy, Debug, Default)]
pub struct Float;

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
impl Float {
    pub fn begin(&self) -> Self {
        Self
    }

    pub fn end(&mut self, _: Self) {}
}
