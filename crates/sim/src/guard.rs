//! Guards: conditions that end the smooth part of a run, of several machines side by side.

use standstill_numeric::{Mask, Wide};

use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::state::State;
use crate::step::two_derivative::Here;

/// A condition that ends a mode, and with it the smooth part of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guard {
    /// The current of a leg reaches zero, or the potential of a terminal with a capacitance reaches a rail.
    Leg(usize),
    /// The potential of a blocked leg reaches a rail.
    Blocked,
    /// The rotor starts or stops.
    Motion,
    /// The rotor reaches the end of the brake's play.
    Stop,
    /// The current reaches the end of the flux map.
    Domain,
    /// ψ_d (0) or ψ_q (1) crosses zero, where the core has a kink.
    Kink(usize),
    /// A mode of the branch beside the core ends; each step finds these modes anew.
    Branch,
}

/// A value for each guard except those of the branch.
#[derive(Clone, Copy, Debug, Default)]
pub struct PerGuard<V> {
    /// Values of [`Guard::Leg`], leg by leg.
    pub leg: [V; 3],
    /// Value of [`Guard::Blocked`].
    pub blocked: V,
    /// Value of [`Guard::Motion`].
    pub motion: V,
    /// Value of [`Guard::Stop`].
    pub stop: V,
    /// Value of [`Guard::Domain`].
    pub domain: V,
    /// Values of [`Guard::Kink`], for ψ_d and ψ_q.
    pub kink: [V; 2],
}

impl<V: Wide> PerGuard<V> {
    /// Returns this value for all guards.
    #[inline(always)]
    pub fn all(of: V) -> Self {
        Self { leg: [of; 3], blocked: of, motion: of, stop: of, domain: of, kink: [of; 2] }
    }
}

/// Bounds whose crossing ends the smooth part of a run. A bound that cannot be crossed is infinitely far away.
#[derive(Clone, Debug)]
pub struct Bounds<V: Wide> {
    /// Coefficients of the motion's margin: a constant, and factors of the speed in rad/s, of the torque in N·m, and
    /// of the magnitude of torque less load.
    pub motion: [V; 4],
    /// Angles in rad from the initial position at which the stops are, backwards and forwards.
    pub stops: [V; 2],
    /// For ψ_d and ψ_q: the side of zero on which each is, +1 or −1, where the core has a kink there, else 0; and the
    /// constant that is added to the margin (infinite without a kink).
    pub sides: Option<[[V; 2]; 2]>,
    /// Slack: distance below zero at which each margin counts as crossed.
    pub slack: PerGuard<V>,
    /// Magnitude of a current in A below which it may be set to zero where its mode ends.
    pub ended: V,
}

/// Distances of the modes from their ends, negative beyond. Leg: the current in A in the direction of its mode,
/// infinite for a blocked leg; for a floating terminal with a capacitance, the distance in V of its potential to the
/// nearer bound. Blocked: the distance in V of the blocked leg's potential to the nearer bound. Motion in N·m or
/// rad/s, stop in rad, domain in A, kink in Wb.
pub type Margins<V> = PerGuard<V>;

impl<V: Wide> Bounds<V> {
    /// Makes bounds that cannot be crossed, for cores with or without kinks.
    pub fn new(kinks: bool) -> Self {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        Self {
            motion: [far, zero, zero, zero],
            stops: [V::of(f64::NEG_INFINITY), far],
            sides: kinks.then_some([[zero, far]; 2]),
            slack: PerGuard::all(zero),
            ended: zero,
        }
    }

    /// Returns the margins at a state.
    #[inline(always)]
    pub fn margins<const RARE: bool>(
        &self,
        machine: &Machine<V>,
        legs: &Conducting<V>,
        Here { state, at, .. }: &Here<V>,
        change: &Change<V>,
        current: &[V; 3],
    ) -> Margins<V> {
        let far = V::of(f64::INFINITY);
        let mut margins = PerGuard::all(far);
        for k in 0..3 {
            margins.leg[k] = V::choose(legs.flows[k], legs.leg[k].direction * current[k], far);
        }
        let capacitive = machine.legs.elastance_if::<RARE>().is_some();
        if capacitive {
            for k in 0..3 {
                let [low, high] = machine.legs.range(&legs.on[k]).at(state.link);
                let room = (state.potential[k] - low).least(high - state.potential[k]);
                margins.leg[k] = V::choose(legs.flows[k], margins.leg[k], room);
            }
        }
        let [low, high] = machine.legs.range_of_blocked(legs).at(state.link);
        let potential = change.blocked_potential;
        let none_is_blocked = V::Mask::of_bits(if capacitive { u32::MAX } else { 0 });
        let all_flow = none_is_blocked | legs.flows[0] & legs.flows[1] & legs.flows[2];
        // Where nothing changes what drives them, idle legs stay idle.
        let blocked = V::choose(legs.idle | all_flow, far, (potential - low).least(high - potential));
        margins.blocked = blocked;
        if (machine.drifts() || machine.links.vary()) && V::any(legs.idle) {
            let idle = room_of_idle(machine, legs, state, change);
            margins.blocked = V::choose(legs.idle, idle, blocked);
        }
        if let Some(rotors) = &machine.rotors {
            let [constant, by_speed, by_torque, by_size] = self.motion;
            let (speed, torque) = (state.speed, at.torque);
            margins.motion =
                constant + by_speed * speed + by_torque * torque + by_size * (torque - rotors.load).abs();
            margins.stop = (self.stops[1] - state.turned).least(state.turned - self.stops[0]);
        }
        if machine.circuits.have_ends() {
            margins.domain = machine.circuits.room(at.core_current, &machine.cores);
        }
        if let Some([d, q]) = &self.sides {
            margins.kink[0] = d[0] * at.core_flux.d + d[1];
            margins.kink[1] = q[0] * at.core_flux.q + q[1];
        }
        margins
    }
}

/// Returns the margin in V of legs that are all blocked: the differences of their potentials follow from the induced
/// voltages, and their common part is taken halfway between the bounds.
#[inline(always)]
fn room_of_idle<V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    state: &State<V>,
    change: &Change<V>,
) -> V {
    let held = machine.legs.phases(change.flux);
    let (mut down, mut up) = (V::of(f64::INFINITY), V::of(f64::INFINITY));
    for (on, held) in legs.on.iter().zip(held) {
        let [low, high] = machine.legs.range(on).at(state.link);
        down = down.least(held - low);
        up = up.least(high - held);
    }
    (up + down) * 0.5
}
