//! Terminals with a capacitance, of several machines side by side.
//!
//! While no device of a leg conducts, the leg's current charges its terminal's capacitance against the negative rail,
//! and the terminal's potential is a state; while one conducts, the potential is the device's. No leg is blocked, and
//! no equation is implicit.

use standstill_numeric::{Symmetric, Wide};

use super::legs::{Conducting, Legs};
use super::plane::Plane;

/// Returns the matrix in the winding's plane of three legs' resistances in Ω, or of their terminals' elastances in
/// 1/F: `Σ ⅔ w a ⊗ a` over their axes a, added to the matrix `beside`.
#[inline(always)]
pub fn of_legs<V: Wide>(axes: &[Plane<V>; 3], each: &[V; 3], beside: Symmetric<V>) -> Symmetric<V> {
    let mut sum = beside;
    for (axis, each) in axes.iter().zip(each) {
        let across = *axis * (*each * (2.0 / 3.0));
        sum.xx = sum.xx + across.x * axis.x;
        sum.xy = sum.xy + across.x * axis.y;
        sum.yy = sum.yy + across.y * axis.y;
    }
    sum
}

impl<V: Wide> Legs<V> {
    /// Returns [`Self::elastance`] in code for terminals that may have a capacitance; none in code for terminals
    /// without.
    #[inline(always)]
    pub fn elastance_if<const RARE: bool>(&self) -> Option<V> {
        if RARE { self.elastance } else { None }
    }

    /// Returns the voltage in V that legs without a conducting device put on the winding.
    #[inline(always)]
    pub fn floating(&self, legs: &Conducting<V>, potential: &[V; 3]) -> Plane<V> {
        let zero = V::of(0.0);
        let mut sum = Plane::new(zero, zero);
        for k in 0..3 {
            sum = sum + self.axes[k] * (V::choose(legs.flows[k], zero, potential[k]) * (2.0 / 3.0));
        }
        sum
    }

    /// Returns the matrix K in 1/F by which that voltage falls with the current: `dw/dt = −K i`.
    #[inline(always)]
    pub fn charging(&self, legs: &Conducting<V>) -> Symmetric<V> {
        let zero = V::of(0.0);
        let none = Symmetric::new(zero, zero, zero);
        let Some(elastance) = self.elastance else { return none };
        let each = three!(k => V::choose(legs.flows[k], zero, elastance));
        of_legs(&self.axes, &each, none)
    }

    /// Returns the changes in V by a charge in A·s, in the run's plane, of the potentials of legs without a
    /// conducting device; zero for the others.
    #[inline(always)]
    pub fn charged(&self, legs: &Conducting<V>, charge: Plane<V>) -> [V; 3] {
        let zero = V::of(0.0);
        let Some(elastance) = self.elastance else { return [zero; 3] };
        let charge = self.phases(charge);
        three!(k => V::choose(legs.flows[k], zero, -(charge[k] * elastance)))
    }

    /// Returns the potentials in V, in which those of conducting legs follow from their devices at a link voltage in
    /// V and these currents in A.
    #[inline(always)]
    pub fn potentials(&self, legs: &Conducting<V>, potential: [V; 3], link: V, current: Plane<V>) -> [V; 3] {
        let current = self.phases(current);
        three!(k => {
            let leg = &legs.leg[k];
            let clamped = leg.rail * link + leg.offset - leg.resistance * current[k];
            V::choose(legs.flows[k], clamped, potential[k])
        })
    }
}
