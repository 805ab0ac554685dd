//! Pick-up: interference that switching edges induce in the wires between current sensors and converter.

#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use standstill_numeric::{Lane, Mask, Wide, sin_cos};

use crate::effect::terminals::ringing::Oscillation;
use crate::effect::terminals::swing::{Powers, decayed, scaled};
use crate::physics::legs::Conducting;

/// Pick-up in all current readings. At the time t in s after the potential of a leg jumps from one rail to the other, it is `± amplitude
/// · e^(−t/decay) · cos(2π frequency t)`. The sign is positive for a rising edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickUp {
    /// Amplitude in A.
    pub amplitude: f64,
    /// Time constant of the decay in s.
    pub decay: f64,
    /// Frequency in Hz.
    pub frequency: f64,
}

/// Sum of the pick-up of all edges so far, for machines side by side. The pick-up of each edge has the same frequency and decay, so the
/// sum is one complex number.
#[derive(Clone, Copy, Debug, Default)]
pub struct PickedUp<V> {
    /// Amplitude of the pick-up of one edge in A.
    amplitude: V,
    /// Rate of decay in 1/s.
    decay: V,
    /// Angular frequency in rad/s.
    turn: V,
    /// Last potential of each leg as a share of the link's voltage: 0 or 1 at the rails, ½ for a floating leg.
    levels: [V; 3],
    /// Real and imaginary part of the present pick-up in A.
    phasor: [V; 2],
}

/// Amplitude in A below which the pick-up is set to zero. It is far below the resolution of any reading. Without this limit, the decaying
/// pick-up would end in subnormal numbers.
const NOTHING: f64 = 1e-30;

impl<V: Wide> PickedUp<V> {
    /// Sets the parameters of a lane's pick-up, and sets the present pick-up to zero.
    pub fn put(&mut self, lane: usize, of: PickUp) {
        self.amplitude.put(lane, of.amplitude);
        self.decay.put(lane, 1.0 / of.decay);
        self.turn.put(lane, TAU * of.frequency);
        self.levels.iter_mut().for_each(|level| level.put(lane, 0.5));
        self.phasor.iter_mut().for_each(|part| part.put(lane, 0.0));
    }

    /// Returns the present pick-up of a lane in A.
    pub fn at(&self, lane: usize) -> f64 {
        self.phasor[0].get(lane)
    }

    /// Returns the pick-up of one lane in A at several times within a step of `h` seconds. Each lane of `share` is the share of the step
    /// that has elapsed at one of these times. `moves` contains the movement of the potentials and the step's oscillations; none if the
    /// terminals have no capacitance.
    #[inline(always)]
    pub fn within(
        &self,
        lane: usize,
        share: V,
        h: f64,
        moves: Option<(&Moves<V>, &[Oscillation<V>; 2])>,
    ) -> V {
        let mut then = Self {
            amplitude: V::of(self.amplitude.get(lane)),
            decay: V::of(self.decay.get(lane)),
            turn: V::of(self.turn.get(lane)),
            levels: self.levels,
            phasor: pair!(n => V::of(self.phasor[n].get(lane))),
        };
        let moves = some!(moves, (moves, of) => (moves.of_lane(lane, share), of));
        let moves = some!(&moves, (moves, of) => (moves, *of));
        then.advance(V::Mask::of_bits(u32::MAX), share * h, moves);
        then.phasor[0]
    }

    /// Adds the pick-up of a leg whose potential jumps. `share` is the jump as a share of the link's voltage.
    pub fn jump(&mut self, lane: usize, share: f64) {
        self.phasor[0].put(lane, self.at(lane) + self.amplitude.get(lane) * share);
    }

    /// Adds the pick-up caused by the leg potentials that have changed, in the lanes of `taken`. Only for terminals without a
    /// capacitance.
    #[inline(always)]
    pub fn follow(&mut self, taken: V::Mask, legs: &Conducting<V>) {
        let (zero, half, one) = (V::of(0.0), V::of(0.5), V::of(1.0));
        for k in 0..3 {
            let (on, flows) = (&legs.on[k], legs.flows[k]);
            let off = !(on.high | on.low);
            let upper = legs.leg[k].rail.above(half);
            let floats = off & !flows;
            let level = V::choose(on.high, one, V::choose(on.low, zero, V::only(upper, one)));
            let level = V::choose(floats, half, level);
            let old = self.levels[k];
            // A floating potential drifts to or from a rail much more slowly than a switch moves it: no pick-up.
            let floated = !(old.above(half) | half.above(old));
            let moved = V::only(taken & !(floats | floated & off), level - old);
            self.phasor[0] = self.phasor[0] + self.amplitude * moved;
            self.levels[k] = V::choose(taken, level, old);
        }
    }

    /// Advances the pick-up in the lanes of `taken` by `h` seconds. `moves` contains the movement of the potentials in this time and the
    /// step's oscillations.
    #[inline(always)]
    pub fn advance(&mut self, taken: V::Mask, h: V, moves: Option<(&Moves<V>, &[Oscillation<V>; 2])>) {
        let zero = V::of(0.0);
        let z = [zero - self.decay * h, self.turn * h];
        let size = decayed(self.decay * h);
        let (sin, cos) = sin_cos(z[1]);
        let grown = [size * cos, size * sin];
        let mut next = times(self.phasor, grown);
        if let Some((moves, of)) = moves {
            let sum = moves.answer(z, grown, of);
            for n in 0..2 {
                next[n] = next[n] + self.amplitude * sum[n];
            }
        }
        let there = (next[0].abs() + next[1].abs()).above(V::of(NOTHING));
        for n in 0..2 {
            self.phasor[n] = V::choose(taken, V::choose(there, next[n], zero), self.phasor[n]);
        }
    }
}

/// Rate of change of the sum of all terminal potentials over a step, as a multiple of the link's voltage per step. It is a cubic of time
/// plus the step's two oscillations, each with a factor.
#[derive(Clone, Copy, Debug)]
pub struct Moves<V> {
    /// Coefficients of the cubic.
    pub cubic: Powers<V>,
    /// Factors of the two oscillations.
    pub shares: [V; 2],
}

impl<V: Wide> Moves<V> {
    /// Copies the movement of one lane to all lanes. In each lane it is limited to the first part of the step; `share` contains this
    /// part.
    #[inline(always)]
    fn of_lane(&self, lane: usize, share: V) -> Self {
        let one = |number: &V| V::of(number.get(lane));
        let cubic = [one(&self.cubic[0]), one(&self.cubic[1]), one(&self.cubic[2]), one(&self.cubic[3])];
        let shares = pair!(m => share * self.shares[m].get(lane));
        Self { cubic: scaled(&cubic, share, share), shares }
    }

    /// Returns the response ∫ e^(z (1 − s)) x(s) ds to this movement x over a step, where s runs from 0 to 1. `grown` is e^z. The
    /// response to sⁿ is n! φ_(n+1)(z), with φ_(n+1) = (φ_n − 1/n!)/z. The response to an oscillation w e^(σ s) is w (e^σ − e^z)/(σ − z).
    #[inline(always)]
    fn answer(&self, z: [V; 2], grown: [V; 2], of: &[Oscillation<V>; 2]) -> [V; 2] {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        // For a tiny |z| the quotients would consist of rounding errors: their limits are used.
        let far = (z[0] * z[0] + z[1] * z[1]).above(V::of(1e-6));
        let by = [V::choose(far, z[0], one), V::only(far, z[1])];
        let (mut sum, mut phi) = ([zero; 2], grown);
        let (mut factorial, mut power) = (1.0, 0.0);
        for n in 0..4 {
            let next = over([phi[0] - 1.0 / factorial, phi[1]], by);
            let limit = 1.0 / (factorial * (power + 1.0));
            phi = [V::choose(far, next[0], V::of(limit)), V::only(far, next[1])];
            let by = self.cubic[n] * factorial;
            sum = [sum[0] + by * phi[0], sum[1] + by * phi[1]];
            power += 1.0;
            factorial *= power;
        }
        for m in 0..2 {
            let of = &of[m];
            let half = self.shares[m] * 0.5;
            for sign in [1.0, -1.0] {
                let to = [of.over[0] - grown[0], of.over[1] * sign - grown[1]];
                let by = [of.turns[0] - z[0], of.turns[1] * sign - z[1]];
                let part = over(times([of.phasor[0], of.phasor[1] * sign], to), by);
                sum = [sum[0] + half * part[0], sum[1] + half * part[1]];
            }
        }
        sum
    }
}

/// Returns the product of two complex numbers.
#[inline(always)]
fn times<V: Lane>([a, b]: [V; 2], [x, y]: [V; 2]) -> [V; 2] {
    [a * x - b * y, a * y + b * x]
}

/// Returns the quotient of two complex numbers.
#[inline(always)]
fn over<V: Lane>([a, b]: [V; 2], [x, y]: [V; 2]) -> [V; 2] {
    let per = V::of(1.0) / (x * x + y * y);
    [(a * x + b * y) * per, (b * x - a * y) * per]
}
