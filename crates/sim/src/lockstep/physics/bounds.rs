//! What ends the smooth part of a run, of several machines side by side.

use standstill_numeric::Wide;

use super::machine::{Change, Machine, Operating};
use super::state::State;

/// Ends beside those of the three legs: the rotor's motion, its way to the end of the brake's play, the core's way to the
/// end of what is known of it, and the sides of ψ_d and ψ_q.
pub const MOTION: usize = 3;
/// See [`MOTION`].
pub const STOP: usize = 4;
/// See [`MOTION`].
pub const DOMAIN: usize = 5;
/// See [`MOTION`].
pub const FLUX: usize = 6;
/// Number of ends.
pub const ENDS: usize = 8;

/// What ends the smooth part. What cannot end it is infinitely far away.
#[derive(Clone, Debug)]
pub struct Bounds<V: Wide> {
    /// Per leg the potentials between which it stays blocked, each by its share of the link's voltage and V on top.
    pub low: [[V; 2]; 3],
    /// See `low`.
    pub high: [[V; 2]; 3],
    /// The rotor's motion: a constant, and factors of its speed in rad/s, of the torque in N·m and of its magnitude
    /// beside the load.
    pub motion: [V; 4],
    /// How far the rotor may turn from its start, backwards and forwards, in rad.
    pub stops: [V; 2],
    /// ψ_d and ψ_q: the side of zero on which they are, +1 or −1, where the core has a kink there, else 0; and what is
    /// added.
    pub sides: Option<[[V; 2]; 2]>,
    /// How far beyond zero each margin must be to count as crossed.
    pub slack: [V; ENDS],
}

/// How far the modes are from their ends: the current in A of a conducting leg, the distance in V of a blocked one's
/// potential to the nearer bound; in N·m or rad/s, rad, A, Wb. Negative beyond.
pub type Margins<V> = [V; ENDS];

impl<V: Wide> Bounds<V> {
    /// For cores with or without kinks.
    pub fn new(kinks: bool) -> Self {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        Self {
            low: [[zero, -far]; 3],
            high: [[zero, far]; 3],
            motion: [far, zero, zero, zero],
            stops: [-far, far],
            sides: kinks.then_some([[zero, far]; 2]),
            slack: [zero; ENDS],
        }
    }

    /// The margins at a state.
    #[inline(always)]
    pub fn margins(
        &self,
        machine: &Machine<V>,
        state: &State<V>,
        at: &Operating<V>,
        change: &Change<V>,
        current: &[V; 3],
    ) -> Margins<V> {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        let legs = &machine.legs;
        let mut potential = [change.blocked_potential; 3];
        let idle = legs.idle.above(zero);
        if machine.drifts() && V::any(idle) {
            potential = self.idle_potentials(machine, state, change, potential);
        }
        let mut margins = [far; ENDS];
        for k in 0..3 {
            margins[k] = self.leg(machine, state, k, potential[k], current[k]);
        }
        if let Some(rotors) = &machine.rotors {
            let [constant, by_speed, by_torque, by_size] = self.motion;
            let (speed, torque) = (state.speed, at.torque);
            margins[MOTION] =
                constant + by_speed * speed + by_torque * torque + by_size * (torque - rotors.load).abs();
            margins[STOP] = (self.stops[1] - state.turned).least(state.turned - self.stops[0]);
        }
        if machine.circuits.have_ends() {
            margins[DOMAIN] = machine.circuits.room(at.core_current, &machine.cores);
        }
        if let Some([d, q]) = &self.sides {
            margins[FLUX] = d[0] * at.core_flux.d + d[1];
            margins[FLUX + 1] = q[0] * at.core_flux.q + q[1];
        }
        margins
    }

    /// The margin of a leg with this potential in V, if it is blocked, or this current in A.
    #[inline(always)]
    fn leg(&self, machine: &Machine<V>, state: &State<V>, k: usize, potential: V, current: V) -> V {
        let (zero, legs) = (V::of(0.0), &machine.legs);
        let low = self.low[k][0] * state.link + self.low[k][1];
        let high = self.high[k][0] * state.link + self.high[k][1];
        let mut blocked = (potential - low).least(high - potential);
        if !machine.drifts() {
            // Without anything that drives them, idle legs stay idle.
            blocked = V::choose(legs.idle.above(zero), V::of(f64::INFINITY), blocked);
        }
        let direction = legs.leg[k].direction;
        V::choose(direction.abs().above(zero), direction * current, blocked)
    }

    /// Potentials in V where all legs are blocked: all follow what would drive currents, and what they have in common is
    /// halfway between the bounds.
    #[inline(always)]
    fn idle_potentials(
        &self,
        machine: &Machine<V>,
        state: &State<V>,
        change: &Change<V>,
        otherwise: [V; 3],
    ) -> [V; 3] {
        let legs = &machine.legs;
        let held = legs.phases(change.flux);
        let idle = legs.idle.above(V::of(0.0));
        let (mut down, mut up) = (V::of(f64::INFINITY), V::of(f64::INFINITY));
        for k in 0..3 {
            let low = self.low[k][0] * state.link + self.low[k][1];
            let high = self.high[k][0] * state.link + self.high[k][1];
            down = down.least(held[k] - low);
            up = up.least(high - held[k]);
        }
        let bounded = V::of(f64::MAX).above((up + down).abs());
        let common = V::choose(bounded, (up - down) * 0.5, state.link * 0.5);
        std::array::from_fn(|k| V::choose(idle, common + held[k], otherwise[k]))
    }
}
