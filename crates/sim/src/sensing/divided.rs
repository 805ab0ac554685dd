//! The filters behind the dividers at terminals that have a capacitance, for machines side by side.
//!
//! Over a step the currents are cubics plus oscillations `Re z e^(σ s)`, s from 0 to 1. A terminal's potential is then
//! a cubic plus oscillations `Re w e^(σ s)`, too, for which a filter has a closed form (`filters.rs`):
//! ```text
//!   no device conducts:   dv/ds = −(h/C) i − γ h v      w = −(h/C) z/(σ + γ h)
//!   behind a device:      v = rail U + offset − R i     w = −R z
//! ```
//! γ is the rate at which dividers discharge the terminals. If all three terminals float, their common (mean) potential falls
//! in addition as `e^(−γ h s)`.

#[cfg(test)]
mod tests;

use standstill_numeric::Wide;

use super::filters::{after, means};
use super::sensed::Oscillating;
use crate::effect::terminals::ringing::Oscillation;
use crate::effect::terminals::swing::{Powers, cubic, decayed, scaled};
use crate::physics::legs::Conducting;
use crate::physics::machine::Machine;
use crate::physics::plane::Plane;
use crate::step::two_derivative::{Here, Tried};

/// The filters of the three terminals.
#[derive(Clone, Debug, Default)]
pub struct Divided<V: Wide> {
    /// Reciprocal of the filters' time constant in 1/s.
    rate: V,
    /// Outputs of the filters in V.
    output: [V; 3],
    /// Potential of the drive's end of each open wire, as a share of the link's voltage. Negative for a whole wire.
    held: [V; 3],
    ends: Ends<V>,
    /// Outputs of the filters in V at the beginning of the last step.
    before: [V; 3],
    passed: Passage<V>,
}

/// Potentials of the terminals and voltage of the link at the beginning and the end of a step.
#[derive(Clone, Copy, Debug, Default)]
struct Ends<V> {
    /// Potentials in V.
    potential: [[V; 3]; 2],
    /// Slopes of the potentials of floating terminals, in V per step.
    rise: [[V; 3]; 2],
    /// The link's voltage in V, and its slope in V/s.
    link: [[V; 2]; 2],
    /// Inverse capacitance of a terminal in 1/F.
    elastance: V,
    /// Rate in 1/s at which dividers discharge the terminals.
    leak: V,
}

/// The terminal potentials over a step or over the first part of a step. Each is the sum of a cubic, two oscillations and a decaying
/// common part.
#[derive(Clone, Copy, Debug, Default)]
struct Passage<V> {
    /// Coefficients of each terminal's cubic in V.
    cubic: [Powers<V>; 3],
    /// Complex amplitudes in V of the two modal oscillations, for each terminal.
    phasor: [[[V; 2]; 2]; 3],
    /// Common potential in V of three floating terminals at the beginning. Zero for the drive's end of an open wire.
    common: [V; 3],
    /// Decay exponent γ h of the common potential over the described time.
    leak: V,
}

impl<V: Wide> Divided<V> {
    /// Sets the corner frequency in Hz of a lane's filters, and sets their outputs to the potentials `at_rest` in V.
    pub fn put(&mut self, lane: usize, bandwidth: f64, at_rest: [f64; 3]) {
        self.rate.put(lane, std::f64::consts::TAU * bandwidth);
        for k in 0..3 {
            self.output[k].put(lane, at_rest[k]);
        }
        self.hold(lane, [None; 3]);
    }

    /// Sets the potentials of the drive's ends of open wires, each as a share of the link's voltage. None stands for a whole wire.
    pub fn hold(&mut self, lane: usize, held: [Option<f64>; 3]) {
        for k in 0..3 {
            self.held[k].put(lane, held[k].unwrap_or(-1.0));
        }
    }

    /// Returns the outputs of a lane's filters in V.
    pub fn at(&self, lane: usize) -> [f64; 3] {
        self.output.each_ref().map(|output| output.get(lane))
    }

    /// Returns the outputs in V of a lane's filters within the last step. `share` is the elapsed share of the step. `h` is the length of
    /// the step in s.
    pub fn within(&self, lane: usize, share: f64, h: f64, ringing: Option<&Oscillating<V>>) -> [f64; 3] {
        let one = |number: &V| number.get(lane);
        let of = ringing.map(|ringing| {
            ringing.of.each_ref().map(|of| {
                let [phasor, turns, over] =
                    [&of.phasor, &of.turns, &of.over].map(|of| of.each_ref().map(one));
                Oscillation { phasor, turns, over }.of_lane(0, share)
            })
        });
        let Passage { cubic, phasor, common, leak } = &self.passed;
        let passed = Passage {
            cubic: cubic.each_ref().map(|cubic| scaled(&cubic.each_ref().map(one), share, 1.0)),
            phasor: phasor.each_ref().map(|of| of.each_ref().map(|of| of.each_ref().map(one))),
            common: common.each_ref().map(one),
            leak: one(leak) * share,
        };
        let before = self.before.each_ref().map(one);
        passed.filtered(before, share * (h * one(&self.rate)), of.as_ref())
    }

    /// Stores the potentials and the link's voltage at both ends of a step. [`Self::advance`] uses them.
    #[inline(always)]
    pub fn keep(&mut self, begin: &Here<V>, tried: &Tried<V>, machine: &Machine<V>) {
        let (Some(floating), Some(elastance)) = (&tried.floating, machine.legs.elastance) else { return };
        let mut leak = V::of(0.0);
        if let Some(rate) = machine.legs.leak {
            leak = rate;
        }
        let link = pair!(e => [tried.link.voltage[e], tried.link.rise[e]]);
        self.ends = Ends {
            potential: [begin.state.potential, tried.end.state.potential],
            rise: floating.rise,
            link,
            elastance,
            leak,
        };
    }

    /// Advances the filters of the lanes in `taken` over the stored step of `h` seconds. `rise` contains the slopes of the currents in
    /// A/s at both ends. `axes` contains the magnetic axes of the legs' phases.
    #[inline(always)]
    pub fn advance(
        &mut self,
        taken: V::Mask,
        h: V,
        legs: &Conducting<V>,
        rise: &[Plane<V>; 2],
        axes: &[Plane<V>; 3],
        ringing: Option<&Oscillating<V>>,
    ) {
        let Ends { potential, rise: floats, link, elastance, leak } = self.ends;
        let (zero, [a, b, c]) = (V::of(0.0), legs.flows);
        let leak = leak * h;
        let sum = potential[0][0] + potential[0][1] + potential[0][2];
        let common = V::choose(a | b | c | !leak.above(zero), zero, sum * (1.0 / 3.0));
        let fallen = decayed(leak);
        let passed = &mut self.passed;
        passed.leak = leak;
        for k in 0..3_usize {
            let (leg, flows, open) = (&legs.leg[k], legs.flows[k], !zero.above(self.held[k]));
            let mut value = pair!(e => potential[e][k]);
            let mut slope = pair!(e => {
                let follows = leg.rail * link[e][1] - leg.resistance * axes[k].dot(rise[e]);
                V::choose(flows, follows * h, floats[e][k])
            });
            value = [value[0] - common, value[1] - common * fallen];
            slope = [slope[0] + common * leak, slope[1] + common * leak * fallen];
            passed.phasor[k] = [[zero; 2]; 2];
            if let Some(ringing) = ringing {
                for m in 0..2_usize {
                    let (of, share) = (&ringing.of[m], axes[k].dot(ringing.to[m]));
                    let [re, im] = of.phasor;
                    let [x, y] = [of.turns[0] + leak, of.turns[1]];
                    let charges = share * elastance * h / (x * x + y * y);
                    let drops = share * leg.resistance;
                    let [p, q] = [
                        V::choose(flows, drops * re, charges * (re * x + im * y)),
                        V::choose(flows, drops * im, charges * (im * x - re * y)),
                    ];
                    let [p, q] = [V::choose(open, zero, -p), V::choose(open, zero, -q)];
                    let rise = [p * of.turns[0] - q * y, p * y + q * of.turns[0]];
                    let [over, turned] = of.over;
                    value = [value[0] - p, value[1] - (p * over - q * turned)];
                    slope = [slope[0] - rise[0], slope[1] - (rise[0] * over - rise[1] * turned)];
                    passed.phasor[k][m] = [p, q];
                }
            }
            for e in 0..2_usize {
                let held = self.held[k] * link[e][0];
                value[e] = V::choose(open, held, value[e]);
                slope[e] = V::choose(open, self.held[k] * link[e][1] * h, slope[e]);
            }
            passed.common[k] = V::choose(open, zero, common);
            passed.cubic[k] = cubic(value, slope);
        }
        self.before = self.output;
        let of = some!(ringing, ringing => &ringing.of);
        let next = passed.filtered(self.before, self.rate * h, of);
        for k in 0..3 {
            self.output[k] = V::choose(taken, next[k], self.before[k]);
        }
    }
}

impl<V: Wide> Passage<V> {
    /// Returns the filters' outputs in V at the end of this passage. `before` contains their outputs in V at its beginning. `a` is the
    /// passage's duration in time constants of the filters. `of` contains the rates and the growth of the two oscillations over the
    /// passage.
    #[inline(always)]
    fn filtered(&self, before: [V; 3], a: V, of: Option<&[Oscillation<V>; 2]>) -> [V; 3] {
        let zero = V::of(0.0);
        let mut common = [zero; 3];
        if V::any(self.leak.above(zero)) {
            // A filter of rate a has the output a (e^(−b) − e^(−a))/(a − b) for an input e^(−b).
            let (_, mean) = means((a - self.leak).abs());
            let answer = a * decayed(a.least(self.leak)) * mean[0];
            common = three!(k => self.common[k] * answer);
        }
        three!(k => {
            let own = some!(of, of => pair!(m => Oscillation { phasor: self.phasor[k][m], ..of[m] }));
            let rings = some!(&own, own => (own, [V::of(1.0); 2]));
            after(before[k], a, &self.cubic[k], rings) + common[k]
        })
    }
}
