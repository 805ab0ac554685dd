//! Play cells when the flux jumps, as it does when a wire that carries a current breaks.
//!
//! Play does not depend on time: the response to a jump is that to a straight path of the flux. A cell is stuck until
//! |e| reaches r. From there on its pinned flux follows a tractrix: after a further distance x (in units of r) on the path,
//! the components of n = e/r along the path and across it are
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
    /// Returns the state of a lane's cells at a flux in Wb, reached from the last accepted state on a straight path.
    pub fn before(&self, lane: usize, flux: Plane<V>) -> Before {
        let flux = flux.get(lane);
        let (change, reach) =
            (flux - self.from.get(lane), self.reach.each_ref().map(|reach| reach.get(lane)));
        let away = std::array::from_fn(|k| straight(self.away[k].get(lane), change, reach[k]).0);
        Before { flux, away }
    }

    /// Moves the cells of a lane from their state `before` a jump to a flux in Wb after it. Returns the loss divided by 3/2, in J.
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

/// Returns a cell's elastic flux in Wb after a straight path of the flux, and ln w of the part of the path on which the cell slid: zero
/// if it was stuck on the whole path.
fn straight(away: Plane, path: Plane, reach: f64) -> (Plane, f64) {
    let (stuck, length) = (away + path, path.dot(path).sqrt());
    if stuck.dot(stuck) <= reach * reach * (1.0 + ROUNDED) || length == 0.0 {
        return (stuck, 0.0);
    }
    let along = path * (1.0 / length);
    let (ahead, beside) = (away.dot(along), away.cross(along));
    // The point at which |e| reaches r. If the previous step ended slightly beyond the reach, the cell slides from the begin.
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
