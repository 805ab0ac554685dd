//! The legs of several inverters side by side as the windings see them.

use standstill_inverter::{AXES, LegMode};
use standstill_numeric::{Heading, Symmetric, Wide};

use super::plane::Plane;

/// The legs in their modes.
#[derive(Clone, Debug)]
pub struct Legs<V: Wide> {
    /// Magnetic axes of the phases in the run's plane.
    pub axes: [Plane<V>; 3],
    /// Leg by leg.
    pub leg: [LegMode<V>; 3],
    /// 1 where all are blocked, else 0.
    pub idle: V,
}

/// Legs and winding resistance as a winding without neutral sees them.
#[derive(Clone, Copy, Debug)]
pub struct Terminals<T> {
    /// Voltage per volt of the link.
    pub rail: Plane<T>,
    /// Voltage in V on top.
    pub offset: Plane<T>,
    /// Resistance of devices and winding in Ω.
    pub resistance: Symmetric<T>,
    /// Axis of the leg that is blocked while the others conduct; zero if there is none.
    pub blocked: Plane<T>,
    /// 1 if there is none, else 0.
    pub free: T,
}

impl<V: Wide> Legs<V> {
    /// All blocked, of rotors at zero.
    pub fn idle() -> Self {
        let zero = V::of(0.0);
        let leg = LegMode { rail: zero, offset: zero, resistance: zero, direction: zero, blocked: zero };
        let mut legs = Self { axes: [Plane::new(zero, zero); 3], leg: [leg; 3], idle: V::of(1.0) };
        for lane in 0..V::LANES {
            legs.put_axes(lane, Heading::ZERO);
        }
        legs
    }

    /// The run's plane of a lane has this heading in the stator's.
    pub fn put_axes(&mut self, lane: usize, start: Heading) {
        for (to, axis) in self.axes.iter_mut().zip(AXES) {
            let axis = Plane::from_stator(axis, start);
            to.x.put(lane, axis.x);
            to.y.put(lane, axis.y);
        }
    }

    /// A leg's mode; that no other is blocked must hold where this one is.
    #[inline]
    pub fn put(&mut self, lane: usize, leg: usize, mode: &LegMode) {
        let to = &mut self.leg[leg];
        to.rail.put(lane, mode.rail);
        to.offset.put(lane, mode.offset);
        to.resistance.put(lane, mode.resistance);
        to.direction.put(lane, mode.direction);
        to.blocked.put(lane, mode.blocked);
    }

    /// Current in A of each phase.
    #[inline(always)]
    pub fn phases(&self, current: Plane<V>) -> [V; 3] {
        let [a, b, c] = &self.axes;
        [a.dot(current), b.dot(current), c.dot(current)]
    }

    /// The legs and the winding together.
    #[inline(always)]
    pub fn terminals(&self, winding: V) -> Terminals<V> {
        let zero = V::of(0.0);
        let none = Plane::new(zero, zero);
        let mut all = Terminals {
            rail: none,
            offset: none,
            resistance: Symmetric::new(winding, zero, winding),
            blocked: none,
            free: V::of(1.0),
        };
        for k in 0..3 {
            let (axis, leg) = (self.axes[k], &self.leg[k]);
            all.rail = all.rail + axis * (leg.rail * (2.0 / 3.0));
            all.offset = all.offset + axis * (leg.offset * (2.0 / 3.0));
            let across = axis * (leg.resistance * (2.0 / 3.0));
            all.resistance.xx = all.resistance.xx + across.x * axis.x;
            all.resistance.xy = all.resistance.xy + across.x * axis.y;
            all.resistance.yy = all.resistance.yy + across.y * axis.y;
            all.blocked = all.blocked + axis * leg.blocked;
            all.free = all.free - leg.blocked;
        }
        all
    }
}
