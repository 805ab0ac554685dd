//! Play cells when the flux jumps at once, as it does where a wire breaks that carries a current.
//!
//! Play does not depend on time: what is pinned follows a jump as it follows any straight path. The cell is stuck until
//! |e| reaches r. From there on what is pinned follows on a tractrix, and at a distance of x reaches
//! ```text
//!   n∥ = (sinh x + n∥₀ cosh x)/w,   n⊥ = n⊥₀/w,   w = cosh x + n∥₀ sinh x
//! ```
//! The loss is K ∫ e · dψ = K r² ln w.

use standstill_numeric::{Mask, Wide, exp, ln};
use standstill_plant::MOST_CELLS;

use super::{Cells, ROUNDED};
use crate::physics::plane::Plane;

/// Flux in Wb of a machine before a jump, and the elastic flux of each of its cells.
#[derive(Clone, Copy, Debug)]
pub struct Before {
    flux: Plane,
    away: [Plane; MOST_CELLS],
}

impl<V: Wide> Cells<V> {
    /// Returns the cells of a lane as they are at a flux in Wb.
    pub fn before(&self, lane: usize, flux: Plane<V>) -> Before {
        let flux = flux.get(lane);
        let (change, reach) =
            (flux - self.from.get(lane), self.reach.each_ref().map(|reach| reach.get(lane)));
        let away = std::array::from_fn(|k| straight(self.away[k].get(lane), change, reach[k]).0);
        Before { flux, away }
    }

    /// Moves the cells of a lane from where they were before a jump to a flux in Wb. Returns the loss divided by 3/2, in J.
    pub fn leap(&mut self, lane: usize, before: &Before, flux: Plane) -> f64 {
        self.from.put(lane, flux);
        let mut lost = 0.0;
        for (k, away) in before.away.into_iter().enumerate() {
            let (stiffness, reach) = (self.stiffness[k].get(lane), self.reach[k].get(lane));
            let (away, logarithm) = straight(away, flux - before.flux, reach);
            self.away[k].put(lane, away);
            lost += stiffness * reach * reach * logarithm;
            let others = self.slides[k].bits() & !(1 << lane);
            self.slides[k] = V::Mask::of_bits(others | u32::from(logarithm != 0.0) << lane);
        }
        lost
    }
}

/// Returns a cell's elastic flux in Wb after a straight path, and ln w of the part on which it slid: zero if it was stuck all along.
fn straight(away: Plane, path: Plane, reach: f64) -> (Plane, f64) {
    let (stuck, length) = (away + path, path.dot(path).sqrt());
    if stuck.dot(stuck) <= reach * reach * (1.0 + ROUNDED) || length == 0.0 {
        return (stuck, 0.0);
    }
    let along = path * (1.0 / length);
    let (ahead, beside) = (away.dot(along), away.cross(along));
    // Where it reaches r: beyond that from the begin on, if the step before ended a little too far out.
    let at = (reach * reach - beside * beside).max(0.0).sqrt();
    let x = ((length - (at - ahead).max(0.0)) / reach).max(0.0);
    let slides_from = away + along * (at - ahead).max(0.0);
    let n = slides_from * (1.0 / slides_from.dot(slides_from).sqrt());
    let cos = n.dot(along);
    // Twice w and twice n∥ w, over e^x.
    let back = exp(-2.0 * x) * (1.0 - cos);
    let (w, ahead) = (1.0 + cos + back, 1.0 + cos - back);
    let across = n.cross(along) * 2.0 * exp(-x);
    let n = (along * ahead - along.quarter_turn() * across) * (1.0 / w);
    (n * reach, x + ln(w / 2.0))
}

#[cfg(test)]
mod tests;
