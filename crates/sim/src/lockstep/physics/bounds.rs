//! What ends the smooth part of a run, of several machines side by side.

use standstill_interface::Arithmetic;
use standstill_numeric::{Lane, Pack};

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
pub struct Bounds<const K: usize> {
    /// Per leg the potentials between which it stays blocked, each by its share of the link's voltage and V on top.
    pub low: [[Pack<K>; 2]; 3],
    /// See `low`.
    pub high: [[Pack<K>; 2]; 3],
    /// The rotor's motion: a constant, and factors of its speed in rad/s, of the torque in N·m and of its magnitude
    /// beside the load.
    pub motion: [Pack<K>; 4],
    /// How far the rotor may turn from its start, backwards and forwards, in rad.
    pub stops: [Pack<K>; 2],
    /// ψ_d and ψ_q: the side of zero on which they are, +1 or −1, where the core has a kink there, else 0; and what is
    /// added.
    pub sides: Option<[[Pack<K>; 2]; 2]>,
    /// How far beyond zero each margin must be to count as crossed.
    pub slack: [Pack<K>; ENDS],
}

/// How far the modes are from their ends: the current in A of a conducting leg, the distance in V of a blocked one's
/// potential to the nearer bound; in N·m or rad/s, rad, A, Wb. Negative beyond.
pub type Margins<const K: usize> = [Pack<K>; ENDS];

impl<const K: usize> Bounds<K> {
    /// For cores with or without kinks.
    pub fn new(kinks: bool) -> Self {
        let (zero, far) = (Pack::of(0.0), Pack::of(f64::INFINITY));
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
        machine: &Machine<K>,
        state: &State<Pack<K>>,
        at: &Operating<Pack<K>>,
        change: &Change<Pack<K>>,
        current: &[Pack<K>; 3],
    ) -> Margins<K> {
        let (zero, far) = (Pack::of(0.0), Pack::of(f64::INFINITY));
        let legs = &machine.legs;
        let mut potential = [change.blocked_potential; 3];
        let idle = legs.idle.above(zero);
        if machine.drifts() && Pack::any(idle) {
            potential = self.idle_potentials(machine, state, change, potential);
        }
        // Spelled out: of a loop a compiler would make vectors across the legs, not across the machines.
        let mut margins = [far; ENDS];
        margins[0] = self.leg(machine, state, 0, potential[0], current[0]);
        margins[1] = self.leg(machine, state, 1, potential[1], current[1]);
        margins[2] = self.leg(machine, state, 2, potential[2], current[2]);
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
    fn leg(
        &self,
        machine: &Machine<K>,
        state: &State<Pack<K>>,
        k: usize,
        potential: Pack<K>,
        current: Pack<K>,
    ) -> Pack<K> {
        let (zero, legs) = (Pack::of(0.0), &machine.legs);
        let low = self.low[k][0] * state.link + self.low[k][1];
        let high = self.high[k][0] * state.link + self.high[k][1];
        let mut blocked = (potential - low).least(high - potential);
        if !machine.drifts() {
            // Without anything that drives them, idle legs stay idle.
            blocked = Pack::choose(legs.idle.above(zero), Pack::of(f64::INFINITY), blocked);
        }
        let direction = legs.leg[k].direction;
        Pack::choose(direction.abs().above(zero), direction * current, blocked)
    }

    /// Potentials in V where all legs are blocked: all follow what would drive currents, and what they have in common is
    /// halfway between the bounds.
    #[inline(never)]
    fn idle_potentials(
        &self,
        machine: &Machine<K>,
        state: &State<Pack<K>>,
        change: &Change<Pack<K>>,
        otherwise: [Pack<K>; 3],
    ) -> [Pack<K>; 3] {
        let legs = &machine.legs;
        let held = legs.phases(change.flux);
        let idle = legs.idle.above(Pack::of(0.0));
        let (mut down, mut up) = (Pack::of(f64::INFINITY), Pack::of(f64::INFINITY));
        for k in 0..3 {
            let low = self.low[k][0] * state.link + self.low[k][1];
            let high = self.high[k][0] * state.link + self.high[k][1];
            down = down.least(held[k] - low);
            up = up.least(high - held[k]);
        }
        let bounded = Pack::of(f64::MAX).above((up + down).abs());
        let common = Pack::choose(bounded, (up - down) * 0.5, state.link * 0.5);
        std::array::from_fn(|k| Pack::choose(idle, common + held[k], otherwise[k]))
    }
}
