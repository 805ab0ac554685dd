//! Terminals with a capacitance, of several machines side by side.
//!
//! While no device of a leg conducts, the leg's current charges its terminal's capacitance against the negative rail,
//! and the terminal's potential is a state variable. A divider between terminal and negative rail discharges the
//! capacitance. While a device conducts, it determines the potential. So no leg is blocked, and all equations are explicit.

use standstill_numeric::{Symmetric, Wide};

use super::legs::{Conducting, Legs};
use super::plane::Plane;
use crate::step::two_derivative::Here;

/// Returns the 2 × 2 matrix `beside + Σ ⅔ w a ⊗ a`, a sum over the three legs. The vectors a are the legs' `axes`. The values w in `each`
/// are resistances in Ω or inverse terminal capacitances in 1/F.
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
    /// Returns the inverse capacitance of each terminal in 1/F if `RARE`, that is, in code for rare kinds of machines. Else returns none.
    #[inline(always)]
    pub fn elastance_if<const RARE: bool>(&self) -> Option<V> {
        if RARE { self.elastance } else { None }
    }

    /// Returns the voltage vector w in V at the winding that comes from the terminals of legs without a conducting device.
    #[inline(always)]
    pub fn floating(&self, legs: &Conducting<V>, potential: &[V; 3]) -> Plane<V> {
        let zero = V::of(0.0);
        let mut sum = Plane::new(zero, zero);
        for k in 0..3 {
            sum = sum + self.axes[k] * (V::choose(legs.flows[k], zero, potential[k]) * (2.0 / 3.0));
        }
        sum
    }

    /// Returns the matrix K in 1/F of `dw/dt = −K i`: currents i change the voltage w of [`Self::floating`].
    #[inline(always)]
    pub fn charging(&self, legs: &Conducting<V>) -> Symmetric<V> {
        let zero = V::of(0.0);
        let none = Symmetric::new(zero, zero, zero);
        let Some(elastance) = self.elastance else { return none };
        let each = three!(k => V::choose(legs.flows[k], zero, elastance));
        of_legs(&self.axes, &each, none)
    }

    /// Returns the changes in V of the terminal potentials that a charge in A·s causes. The charge is a vector in the run's plane. The
    /// change is zero for legs with a conducting device.
    #[inline(always)]
    pub fn charged(&self, legs: &Conducting<V>, charge: Plane<V>) -> [V; 3] {
        let zero = V::of(0.0);
        let Some(elastance) = self.elastance else { return [zero; 3] };
        let charge = self.phases(charge);
        three!(k => V::choose(legs.flows[k], zero, -(charge[k] * elastance)))
    }

    /// Returns the slopes of the terminal potentials times the duration `h` in s, that is, the changes in V at constant slope. The change
    /// is zero for legs with a conducting device.
    #[inline(always)]
    pub fn rise(&self, legs: &Conducting<V>, here: &Here<V>, h: V) -> [V; 3] {
        let mut rise = self.charged(legs, here.at.current * h);
        if let Some(leak) = self.leak {
            let (potential, rate) = (&here.state.potential, leak * h);
            rise = three!(k => rise[k] - V::choose(legs.flows[k], V::of(0.0), potential[k] * rate));
        }
        rise
    }

    /// Returns the currents in A that dividers draw from terminals with these potentials in V. None without dividers that draw a current.
    #[inline(always)]
    pub fn taken(&self, potential: &[V; 3]) -> Option<[V; 3]> {
        let conductance = self.leak? / self.elastance?;
        Some(three!(k => potential[k] * conductance))
    }

    /// Returns the potentials of all terminals in V. The potentials of conducting legs are computed from their devices, from the link's
    /// voltage in V and the currents in A. The other potentials are returned unchanged.
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
