//! Guards: conditions that end the smooth part of a run, of several machines side by side.

use standstill_numeric::{Mask, Wide};

use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::state::State;
use crate::sensing::Input;
use crate::step::hermite::Cubic;
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
    /// The current at a comparator reaches its level.
    Trip(Input),
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
    /// Levels of the comparators, on drives with comparators.
    pub levels: Option<Levels<V>>,
}

/// Currents in A at which the comparators trip. Those that do not watch have infinite ones.
#[derive(Clone, Copy, Debug)]
pub struct Levels<V> {
    /// Of the current in the DC link.
    pub link: V,
    /// Of each phase's current into the motor and out of it.
    pub phase: [[V; 3]; 2],
}

/// Returns the current in A that legs draw from the positive rail, or its slope.
#[inline(always)]
fn drawn<V: Wide>(rail: [V; 3], of: [V; 3]) -> V {
    rail[0] * of[0] + rail[1] * of[1] + rail[2] * of[2]
}

impl<V: Wide> Levels<V> {
    /// Returns the margins in A of all comparators over a step, as cubics: link, phases into the motor, phases out of it.
    /// `phases`: the legs' currents in A at both ends, `rise`: their slopes per step, `rail`: 1 for a leg at the positive rail,
    /// else 0.
    #[inline(always)]
    pub fn margins(&self, phases: &[[V; 3]; 2], rise: &[[V; 3]; 2], rail: [V; 3]) -> [Cubic<V>; 7] {
        let current = [drawn(rail, phases[0]), drawn(rail, phases[1])];
        let link = Cubic {
            value: [self.link - current[0], self.link - current[1]],
            slope: [-drawn(rail, rise[0]), -drawn(rail, rise[1])],
        };
        let mut margins = [link; 7];
        for k in 0..3 {
            let [into, out] = [self.phase[0][k], self.phase[1][k]];
            margins[1 + k] = Cubic {
                value: [into - phases[0][k], into - phases[1][k]],
                slope: [-rise[0][k], -rise[1][k]],
            };
            margins[4 + k] =
                Cubic { value: [out + phases[0][k], out + phases[1][k]], slope: [rise[0][k], rise[1][k]] };
        }
        margins
    }

    /// The comparators in the order of [`Self::margins`].
    pub const INPUTS: [Input; 7] = [
        Input::Link,
        Input::Into(0),
        Input::Into(1),
        Input::Into(2),
        Input::Out(0),
        Input::Out(1),
        Input::Out(2),
    ];

    /// Sets the level of each comparator of a lane.
    pub fn put(&mut self, lane: usize, level: impl Fn(Input) -> f64) {
        self.link.put(lane, level(Input::Link));
        for k in 0..3 {
            self.phase[0][k].put(lane, level(Input::Into(k)));
            self.phase[1][k].put(lane, level(Input::Out(k)));
        }
    }
}

/// Distances of the modes from their ends, negative beyond. Leg: the current in A in the direction of its mode,
/// infinite for a blocked leg; for a floating terminal with a capacitance, the distance in V of its potential to the
/// nearer bound. Blocked: the distance in V of the blocked leg's potential to the nearer bound. Motion in N·m or
/// rad/s, stop in rad, domain in A, kink in Wb.
pub type Margins<V> = PerGuard<V>;

impl<V: Wide> Bounds<V> {
    /// Makes bounds that cannot be crossed, for cores with or without kinks, for drives with or without comparators.
    pub fn new(kinks: bool, comparators: bool) -> Self {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        Self {
            motion: [far, zero, zero, zero],
            stops: [V::of(f64::NEG_INFINITY), far],
            sides: kinks.then_some([[zero, far]; 2]),
            slack: PerGuard::all(zero),
            ended: zero,
            levels: comparators.then_some(Levels { link: far, phase: [[far; 3]; 2] }),
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
