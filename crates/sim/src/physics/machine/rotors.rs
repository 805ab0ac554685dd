//! Acceleration of the rotors, and the change of their torque without a new evaluation of the core.

use standstill_numeric::Wide;

use super::{Change, Operating, Rotors};
use crate::effect::BranchPoint;
use crate::effect::shorted::Shorted;
use crate::physics::plane::Plane;
use crate::physics::state::State;

impl<V: Wide> Rotors<V> {
    /// Imposes a constant electrical acceleration in rad/s² on the rotor of a lane. The machine's torque no longer has an effect.
    pub fn drive(&mut self, lane: usize, acceleration: f64) {
        self.per_inertia.put(lane, 0.0);
        self.imposed.put(lane, acceleration);
    }

    /// Returns the electrical acceleration in rad/s² at a torque in N·m and an electrical speed in rad/s.
    #[inline(always)]
    pub fn acceleration(&self, torque: V, speed: V) -> V {
        (torque - self.load - self.dry_friction - speed * self.viscous) * self.per_inertia * self.moving
            + self.imposed
    }

    /// Returns the change of the torque in N·m caused by a correction of the flux in Wb and the current in A, at constant angle.
    #[inline(always)]
    pub fn torque_change(
        &self,
        at: &Operating<V>,
        [flux, current]: [Plane<V>; 2],
        [new_flux, new_current]: [Plane<V>; 2],
    ) -> V {
        (new_flux.cross(new_current) - flux.cross(current) - at.energy_turn.dot(new_flux - flux))
            * self.torque_factor
    }

    /// Returns the time derivative of the electrical acceleration in rad/s³. `torque_rise` is the time derivative of the torque in N·m/s.
    #[inline(always)]
    pub fn jerk(&self, torque_rise: V, acceleration: V) -> V {
        (torque_rise - acceleration * self.viscous) * self.per_inertia * self.moving
    }

    /// Returns the time derivative of the torque in N·m/s. Only the current of the core makes torque: the currents of the play cells
    /// (`branch`) and of the shorted turns are subtracted.
    #[inline(always)]
    pub fn torque_rise(
        &self,
        state: &State<V>,
        at: &Operating<V>,
        change: &Change<V>,
        branch: Option<&BranchPoint<V>>,
        short: Option<&Shorted<V>>,
    ) -> V {
        let speed = state.speed;
        let in_rotor = change.flux - state.flux.quarter_turn() * speed;
        let (mut current, mut rise) = (at.current, change.current);
        if let Some(branch) = branch {
            current = current - branch.current;
            rise = rise - change.flux.through(branch.stiffness);
        }
        if let Some(short) = short {
            let [of_short, slope] = short.flowing(state, at, change);
            (current, rise) = (current - of_short, rise - slope);
        }
        (change.flux.cross(current) + state.flux.cross(rise)
            - at.energy_turn.dot(in_rotor)
            - at.energy_bend * speed)
            * self.torque_factor
            + at.cogging_slope * speed
    }
}
