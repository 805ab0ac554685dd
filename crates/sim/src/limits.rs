//! How far what makes the flow smooth is from its end.

use standstill_inverter::{Bridge, Conduction, Gate, Modes};
use standstill_numeric::Lane;
use standstill_plant::Motor;

use crate::machine::{Evaluation, Machine, PLANE};
use crate::motion::Motion;

/// Places of the margins: after those of the three legs come the rotor's motion, its way to the end of the brake's play,
/// the core's way to the end of what is known of it, and the sides of ψ_d and ψ_q.
pub const MOTION: usize = 3;
/// See [`MOTION`].
pub const STOP: usize = 4;
/// See [`MOTION`].
pub const DOMAIN: usize = 5;
/// See [`MOTION`].
pub const FLUX: usize = 6;
/// Number of margins.
pub const MARGINS: usize = 8;

/// What ends the smooth part, of one machine or of several side by side. What cannot end it is infinitely far away.
#[derive(Clone, Copy, Debug)]
pub struct Limits<T = f64> {
    /// Per leg the potentials between which it stays blocked, each by its share of the link's voltage and V on top.
    pub low: [[T; 2]; 3],
    /// See `low`.
    pub high: [[T; 2]; 3],
    /// The rotor's motion: a constant, and factors of its speed in rad/s, of the torque in N·m and of its magnitude.
    pub motion: [T; 4],
    /// Electrical angles in rad where the rotor runs into the end of the brake's play.
    pub stops: [T; 2],
    /// ψ_d and ψ_q: the side of zero on which they are, +1 or −1, where the core has a kink there; and a constant.
    pub sides: [[T; 2]; 2],
}

impl Limits {
    /// Nothing conducts, the rotor is held, the core is smooth.
    pub const NONE: Self = Self {
        low: [[0.0; 2]; 3],
        high: [[0.0; 2]; 3],
        motion: [f64::INFINITY, 0.0, 0.0, 0.0],
        stops: [f64::NEG_INFINITY, f64::INFINITY],
        sides: [[0.0, f64::INFINITY]; 2],
    };

    /// The legs conduct otherwise.
    pub fn set_legs(&mut self, bridge: &Bridge, gates: [Gate; 3], modes: Modes) {
        for leg in 0..3 {
            // Those of a conducting leg mean nothing.
            if modes[leg] == Conduction::Blocked {
                [self.low[leg], self.high[leg]] = bridge.clamps(gates[leg]);
            }
        }
    }

    /// The rotor moves otherwise, between stops in rad if the brake is applied.
    pub fn set_motion(&mut self, motion: Motion, motor: &Motor, load: f64, stops: Option<[f64; 2]>) {
        self.motion = motion.limits(&motor.rotor, load);
        self.stops = stops.map_or(Self::NONE.stops, |stops| motion.way(stops));
    }

    /// ψ_d and ψ_q are on these sides of zero; 0 where that does not matter.
    pub fn set_sides(&mut self, sides: [f64; 2]) {
        self.sides = sides.map(|side| [side, if side == 0.0 { f64::INFINITY } else { 0.0 }]);
    }
}

impl<T: Lane> Limits<T> {
    /// The margins at a state and what the machine is there, positive while all goes on as it is: the current in A of a
    /// conducting leg, the distance in V of a blocked one's potential to the nearer bound; in N·m or rad/s, rad, A, Wb.
    #[inline(always)]
    pub fn margins<const N: usize>(
        &self,
        machine: &Machine<T>,
        state: &[T; N],
        there: &Evaluation<N, T>,
    ) -> [T; MARGINS] {
        let at = &there.operating;
        let zero = T::of(0.0);
        let current = machine.phases(at);
        let (mut low, mut high) = ([zero; 3], [zero; 3]);
        for k in 0..3 {
            low[k] = self.low[k][0] * at.dc_link + self.low[k][1];
            high[k] = self.high[k][0] * at.dc_link + self.high[k][1];
        }
        let mut potential = [there.blocked_potential; 3];
        let idle = machine.legs.idle.above(zero);
        if T::any(idle) {
            // All follow the back-EMF, and what they have in common is halfway between the bounds.
            let held = machine.port(at).holding.phases().0;
            let down = (held[0] - low[0]).least(held[1] - low[1]).least(held[2] - low[2]);
            let up = (high[0] - held[0]).least(high[1] - held[1]).least(high[2] - held[2]);
            let bounded = T::of(f64::MAX).above((up + down).abs());
            let common = T::choose(bounded, (up - down) * 0.5, at.dc_link * 0.5);
            for k in 0..3 {
                potential[k] = T::choose(idle, common + held[k], potential[k]);
            }
        }
        let mut leg = [zero; 3];
        for k in 0..3 {
            let blocked = (potential[k] - low[k]).least(high[k] - potential[k]);
            let direction = machine.legs.leg[k].direction;
            leg[k] = T::choose(direction.abs().above(zero), direction * current[k], blocked);
        }
        let (angle, speed) = if N > PLANE { (state[2], state[3]) } else { (machine.angle, zero) };
        let [constant, by_speed, by_torque, by_size] = self.motion;
        let torque = at.torque;
        [
            leg[0],
            leg[1],
            leg[2],
            constant + by_speed * speed + by_torque * torque + by_size * (torque - machine.load_torque).abs(),
            (self.stops[1] - angle).least(angle - self.stops[0]),
            machine.motor.magnetics.core().room(at.core_current),
            self.sides[0][0] * at.core_flux.d + self.sides[0][1],
            self.sides[1][0] * at.core_flux.q + self.sides[1][1],
        ]
    }
}
