//! Where something holds, machine by machine.

use standstill_numeric::{Lane, Pack};

/// All bits of a lane set or none.
pub type Mask<const K: usize> = <Pack<K> as Lane>::Mask;

/// One bit for each machine.
#[inline(always)]
pub fn bits<const K: usize>(mask: Mask<K>) -> u32 {
    let mut all = 0;
    for k in 0..K {
        all |= mask[k] & (1 << k);
    }
    // There are at most 32 machines side by side.
    #[allow(clippy::cast_possible_truncation)]
    {
        all as u32
    }
}
