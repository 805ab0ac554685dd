//! What a step puts right at its end: blocked legs' currents, the link's voltage, the flux that lags behind.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Wide};

use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine, Operating};
use crate::physics::memory::{Iron, Memory};
use crate::physics::plane::Plane;
use crate::physics::state::State;

/// How fast things change at both ends of a step.
#[derive(Clone, Copy)]
pub(super) struct Ends<V> {
    pub change: [Change<V>; 2],
    /// Of the links' voltages, in V/s.
    pub link_rise: [V; 2],
    /// Of the rotors' speeds, in rad/s².
    pub acceleration: [V; 2],
    /// Of the torques, in N·m/s.
    pub torque_rise: [V; 2],
}

/// Takes blocked legs' currents to zero, as an impulse at their terminals would.
pub(super) fn settle<V: Wide>(legs: &Conducting<V>, flux: &mut Plane<V>, at: &mut Operating<V>) {
    let blocked = legs.terminals.blocked;
    let across = blocked.through(at.inverse_inductance);
    let per_impulse = V::of(1.0) / (across.dot(blocked) + legs.terminals.none_blocked);
    settle_by(legs, &across, per_impulse, V::any(legs.idle), flux, at);
}

#[inline(always)]
pub(crate) fn settle_by<V: Wide>(
    legs: &Conducting<V>,
    across: &Plane<V>,
    per_impulse: V,
    any_idle: bool,
    flux: &mut Plane<V>,
    at: &mut Operating<V>,
) {
    let blocked = legs.terminals.blocked;
    let share = blocked.dot(at.current) * per_impulse;
    let (mut impulse, mut change) = (blocked * share, *across * share);
    if any_idle {
        let all = at.current.through(at.inverse_inductance.inverse());
        impulse = Plane::choose(legs.idle, all, impulse);
        change = Plane::choose(legs.idle, at.current, change);
    }
    *flux = *flux - impulse;
    at.current = at.current - change;
}

/// What the cells of the iron add to a current in A that was carried on by their tangent from where they were looked up: a sliding
/// cell turns all along the way to the flux, which began in the direction of `along`.
#[inline(always)]
pub(super) fn turned_by<V: Wide>(
    memory: &Memory<V>,
    iron: &Iron<V>,
    flux: Plane<V>,
    looked_up: Plane<V>,
    along: Plane<V>,
) -> Plane<V> {
    let by_tangent = iron.current + (flux - looked_up).through(iron.tangent);
    memory.iron(&memory.away_at(flux, Some(along))).current - by_tangent
}

/// The winding's flux in the rotor's plane at an end of a step, and how much it changes per step.
#[derive(Clone, Copy)]
pub(crate) struct RotorFlux<T> {
    pub(crate) flux: Dq<T>,
    pub(crate) rise: Dq<T>,
}

impl<V: Wide> RotorFlux<V> {
    #[inline(always)]
    /// At a state, where the flux changes by so much in Wb in the run's plane.
    pub(crate) fn of(machine: &Machine<V>, state: &State<V>, flux_rise: Plane<V>, angle_rise: V) -> Self {
        if machine.rotors.is_none() {
            return Self {
                flux: Dq::new(state.flux.x, state.flux.y),
                rise: Dq::new(flux_rise.x, flux_rise.y),
            };
        }
        let turned = Heading::of(state.turned);
        let rise = flux_rise - state.flux.quarter_turn() * angle_rise;
        Self { flux: state.flux.to_rotor(turned), rise: rise.to_rotor(turned) }
    }
}

/// χ at the end of a step that is `x` time constants long: the rule with two derivatives, which is linear in χ.
#[inline(always)]
pub(crate) fn lag_behind<V: Wide>(x: V, lagging: Dq<V>, begin: &RotorFlux<V>, end: &RotorFlux<V>) -> Dq<V> {
    let (half, twelfth, square) = (x * 0.5, x * (1.0 / 12.0), x * x * (1.0 / 12.0));
    let denominator = V::of(1.0) / (square + half + 1.0);
    let decay = (square - half + 1.0) * denominator;
    let mean = (begin.flux + end.flux) * (half * denominator);
    let tilt = (end.flux - begin.flux) * (square * denominator);
    let bend = (begin.rise - end.rise) * (twelfth * denominator);
    lagging * decay + mean + tilt + bend
}
