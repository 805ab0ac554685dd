//! An independent integrator: the method of Dormand and Prince for the same equations, one machine at a time.
//!
//! The referee shares neither the quadrature nor the prediction nor the error estimate of the engine's own step, so it
//! can judge that step. It evaluates the core seven times per step.

use standstill_interface::Dq;
use standstill_numeric::Wide;

use super::error::Accuracy;
use super::two_derivative::{Here, Parts, Tried};
use crate::effect::terminals::{TerminalStep, clamp};
use crate::effect::{Begin, BranchState, Effect, End, Looked, each_effect};
use crate::guard::Bounds;
use crate::physics::legs::Conducting;
use crate::physics::machine::Machine;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::dormand_prince::Attempt;

/// Number of values of a state without the pinned fluxes of the play cells.
const OWN: usize = 11;
/// Number of values of a state with the pinned fluxes of the play cells.
const NUMBERS: usize = OWN + size_of::<BranchState<f64>>() / size_of::<f64>();

/// Tolerance of the speed in rad/s, divided by the tolerance of the angle in rad. It also is the tolerance of the link's voltage in V,
/// divided by the tolerance of the flux in Wb. Within 0.1 ms, such errors grow to the tolerances of angle and flux.
const PER_SECOND: f64 = 1e4;

/// Returns the values of a state, followed by the components of the pinned fluxes of the play cells.
fn numbers<V: Wide>(state: &State<V>, pinned: &BranchState<V>) -> [V; NUMBERS] {
    let State { flux, turned, speed, link, lagging, shorted, potential: [a, b, c] } = *state;
    let own = [flux.x, flux.y, turned, speed, link, lagging.d, lagging.q, shorted, a, b, c];
    std::array::from_fn(|n| match n.checked_sub(OWN) {
        None => own[n],
        Some(n) if n % 2 == 0 => pinned[n / 2].x,
        Some(n) => pinned[n / 2].y,
    })
}

impl<V: Wide> Tried<V> {
    /// Attempts a step from `here` to the times `until` in ns with the method of Dormand and Prince.
    pub fn refereed(
        machine: &Machine<V>,
        bounds: &Bounds<V>,
        legs: &Conducting<V>,
        here: &Here<V>,
        until: V,
        accuracy: &Accuracy<V>,
    ) -> Self {
        let h = (until - here.time) * 1e-9;
        let (branch, short) = (machine.branch.as_ref(), machine.shorted.as_ref());
        let mut pinned = BranchState::default();
        if let Some(branch) = branch {
            pinned = branch.at(here.state.flux, None).elastic.map(|elastic| here.state.flux - elastic);
        }
        let attempt = Attempt::new(numbers(&here.state, &pinned), h).take(
            |time, y| {
                let (slope, pinned) = slope(machine, legs, time, &state_of(machine, time, y), &pinned_of(y));
                numbers(&slope, &pinned)
            },
            here.time * 1e-9,
        );
        let state = state_of(machine, until * 1e-9, &attempt.end);
        let point = branch.map(|branch| branch.pinned_at(state.flux, &pinned_of(&attempt.end)));
        let at = machine.operating(&state, point.as_ref(), short);
        let mut there = Here { time: until, state, at, source: machine.links.source(until * 1e-9) };
        let looked = Looked::at(&there, point, short, legs);
        looked.settle(legs, &mut there);
        let change = [
            machine.change::<true>(legs, &here.at, &here.state),
            machine.change::<true>(legs, &there.at, &there.state),
        ];
        if let Some(rotors) = &machine.rotors {
            rotors.follow(&looked, [looked.flux, looked.current], &mut there);
        }
        let begin = Begin { h, machine, branch, short, legs, here, change: &change[0] };
        let end = End { begin: &begin, looked: &looked, change: &change[1] };
        let rotor = machine.rotors.as_ref().between(&end, &there);
        if machine.legs.elastance.is_some() {
            clamp(machine, legs, &mut there);
        }
        let link = machine.links.between(&end, &there);
        let ringing = TerminalStep::of(&begin, &link).map(|terminals| terminals.between(&end, &link, &there));
        let branch = branch.between(&end, &there);
        let error = attempt.error(&tolerances(accuracy));
        Self::between::<true>(&end, bounds, there, Parts { link, rotor, ringing, branch }, error)
    }
}

/// Returns the tolerance of each value of a state, in the order of [`numbers`].
fn tolerances<V: Wide>(accuracy: &Accuracy<V>) -> [f64; NUMBERS] {
    let (flux, angle) = (1.0 / accuracy.per_flux.get(0), 1.0 / accuracy.per_angle.get(0));
    let (speed, volt) = (angle * PER_SECOND, flux * PER_SECOND);
    let own = [flux, flux, angle, speed, volt, flux, flux, flux, volt, volt, volt];
    std::array::from_fn(|n| own.get(n).copied().unwrap_or(flux))
}

/// Returns the state that has these values, at a time in s. Without a capacitor the link's voltage is the source's voltage.
fn state_of<V: Wide>(machine: &Machine<V>, time: V, y: &[V; NUMBERS]) -> State<V> {
    let [x, y, turned, speed, mut link, d, q, shorted, a, b, c, ..] = *y;
    if machine.links.storage.is_none() {
        link = machine.links.source(time).voltage;
    }
    let lagging = Dq::new(d, q);
    State { flux: Plane::new(x, y), turned, speed, link, lagging, shorted, potential: [a, b, c] }
}

/// Returns the pinned fluxes of the play cells in Wb.
fn pinned_of<V: Wide>(y: &[V; NUMBERS]) -> BranchState<V> {
    std::array::from_fn(|k| Plane::new(y[OWN + 2 * k], y[OWN + 1 + 2 * k]))
}

/// Returns the time derivatives of a state and of the play cells' pinned fluxes, at a time in s.
fn slope<V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    time: V,
    state: &State<V>,
    pinned: &BranchState<V>,
) -> (State<V>, BranchState<V>) {
    let point = machine.branch.as_ref().map(|branch| branch.pinned_at(state.flux, pinned));
    let at = machine.operating(state, point.as_ref(), machine.shorted.as_ref());
    let here = Here { time, state: *state, at, source: machine.links.source(time) };
    let flux = machine.change::<true>(legs, &at, state).flux;
    let mut slope = State { flux, ..State::default() };
    each_effect!(machine, machine.branch.as_ref(), effect => effect.slope(legs, &here, &mut slope));
    let moves = machine.branch.as_ref().zip(point.as_ref());
    let moves = moves.map_or_else(BranchState::default, |(branch, point)| branch.pinned_rise(point, flux));
    (slope, moves)
}
