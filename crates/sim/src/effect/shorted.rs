//! Turns of a phase that are shorted: a share k of the turns of phase x is closed on itself through a resistance R_f.
//!
//! The current i_s that circulates in these turns adds to that of the phase. The core sees ī = i + ⅔ k i_s u, with u
//! the axis of phase x; the resistance of the whole winding acts on ī too, and what equal voltages of all phases are
//! only moves the neutral:
//! ```text
//!   dψ/dt = v − R ī,       ī = ∂W/∂ψ
//!   ψ_s = k u·ψ + L_l i_s,   dψ_s/dt = −k R (i_x + i_s) − R_f i_s
//! ```
//! L_l is the leakage that the shorted turns have beyond their share of the phase's: with the coupling c between them and
//! the phase, their own inductance is k² L_x/c², with L_x = L_A + L_σ of a phase, so `L_l = k² (L_x/c² − ⅔ L)`, with L the mean
//! of L_d and L_q. It is one of air, and does not saturate. EMF of the rotor and slopes of a saturated core are in ψ.
//!
//! With χ = ψ_s/k these are a branch in parallel to the core, along u, as eddy currents are one in the rotor:
//! ```text
//!   i = ī + i_b u,   i_b = g (u·ψ − χ) = −⅔ k i_s,   g = ⅔ k²/L_l
//!   dχ/dt = R_b i_b − R i_x,                         R_b = 3/2 (k R + R_f)/k²
//! ```
//! The short begins without a current.

use standstill_interface::Dq;
use standstill_numeric::{Symmetric, Wide};
use standstill_plant::Motor;

use super::eddies::{Driving, lag_behind};
use super::{Begin, Effect, End, Moment, Span, keep, keep_plane};
use crate::case::Case;
use crate::faults::Short;
use crate::ledger::Ledger;
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Operating};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::{Accuracy, settling_error};
use crate::step::two_derivative::{Here, Tried};

/// Shorted turns of the machines in the lanes; all values are zero where no turns are shorted.
#[derive(Clone, Debug, Default)]
pub struct Shorted<V: Wide> {
    /// Axis u of the phase in the run's plane.
    axis: Plane<V>,
    /// Inverse inductance g of the branch in 1/H.
    stiffness: V,
    /// Resistance R_b of the branch in Ω.
    resistance: V,
    /// Resistance R of the winding in Ω.
    winding: V,
    /// Time constant τ of the branch, 1/(g R_b), in s.
    constant: V,
    /// R over g R_b in H: how much the current of the phase counts as flux.
    lost: V,
    /// Flux that makes the current that a flux of 1 Wb makes in the branch.
    weight: V,
}

/// The branch at one flux.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShortPoint<V> {
    axis: Plane<V>,
    stiffness: V,
    /// The lagging flux χ in Wb.
    pub lagging: V,
}

impl<V: Wide> ShortPoint<V> {
    /// Returns the current in A of the core, for a flux in Wb and a current in A of the winding.
    #[inline(always)]
    pub fn core(&self, flux: Plane<V>, current: Plane<V>, lagging: V) -> Plane<V> {
        current - self.axis * ((self.axis.dot(flux) - lagging) * self.stiffness)
    }
}

/// Quantities of the shorted turns over a step.
#[derive(Clone, Copy, Default)]
pub struct ShortStep<V> {
    from: Driving<V>,
    /// Slope of χ in V that the operating point's `relaxing` contains; unset before the first correction.
    counted: Option<V>,
    /// Error of χ in Wb.
    off: V,
}

impl<V: Wide> Shorted<V> {
    /// Shorts turns of a lane's motor, in the phase with this axis. Returns the lagging flux χ in Wb: the flux along the axis, because no
    /// current flows in the shorted turns yet.
    pub fn put(&mut self, lane: usize, motor: &Motor, short: &Short, axis: Plane, flux: Plane) -> f64 {
        let (share, winding) = (short.share, &motor.winding);
        let mean = 1.5 * winding.mean_inductance + winding.leakage;
        let stiffness = 2.0 / 3.0 * share * share / short.leakage(motor);
        let resistance = 1.5 * (share * motor.resistance + short.resistance) / (share * share);
        self.axis.put(lane, axis);
        self.stiffness.put(lane, stiffness);
        self.resistance.put(lane, resistance);
        self.winding.put(lane, motor.resistance);
        let constant = 1.0 / (stiffness * resistance);
        self.constant.put(lane, constant);
        self.lost.put(lane, motor.resistance * constant);
        self.weight.put(lane, 1.0 + stiffness * mean);
        axis.dot(flux)
    }

    /// Returns whether a lane's machine has shorted turns.
    pub fn is_there(&self, lane: usize) -> bool {
        self.stiffness.get(lane) > 0.0
    }

    /// Takes a short out of a lane.
    pub fn clear(&mut self, lane: usize) {
        self.axis.put(lane, Plane::default());
        for value in [
            &mut self.stiffness,
            &mut self.resistance,
            &mut self.winding,
            &mut self.constant,
            &mut self.lost,
            &mut self.weight,
        ] {
            value.put(lane, 0.0);
        }
    }

    /// Returns the current i_b of the branch in A.
    #[inline(always)]
    fn current(&self, state: &State<V>) -> V {
        (self.axis.dot(state.flux) - state.shorted) * self.stiffness
    }

    /// Returns the slope of χ in V, with this current of the winding in A.
    #[inline(always)]
    fn rise(&self, state: &State<V>, current: Plane<V>) -> V {
        self.current(state) * self.resistance - self.axis.dot(current) * self.winding
    }

    /// Returns the current of the branch in A and its slope in A/s.
    #[inline(always)]
    pub fn flowing(&self, state: &State<V>, at: &Operating<V>, change: &Change<V>) -> [Plane<V>; 2] {
        let rise = (self.axis.dot(change.flux) - self.rise(state, at.current)) * self.stiffness;
        [self.axis * self.current(state), self.axis * rise]
    }

    /// Returns the voltage in V by which the winding's resistance drops less than the current of the terminals says.
    #[inline(always)]
    pub fn pull(&self, state: &State<V>) -> Plane<V> {
        self.axis * (self.current(state) * self.winding)
    }

    /// Returns [`Self::pull`] of one lane, by scalars: for code that is not compiled for wide registers.
    #[inline(always)]
    pub fn pull_of(&self, state: &State<V>, lane: usize) -> Plane {
        let axis = self.axis.get(lane);
        let current = (axis.dot(state.flux.get(lane)) - state.shorted.get(lane)) * self.stiffness.get(lane);
        axis * (current * self.winding.get(lane))
    }

    /// Returns [`Self::pull`] and its slope in V/s.
    #[inline(always)]
    pub fn pulling(&self, state: &State<V>, at: &Operating<V>, change: &Change<V>) -> [Plane<V>; 2] {
        let [current, rise] = self.flowing(state, at, change);
        [current * self.winding, rise * self.winding]
    }

    /// Adds the branch to the core's operating point.
    #[inline(always)]
    pub fn join(&self, state: &State<V>, at: &mut Operating<V>) {
        let (axis, stiffness, gamma) = (self.axis, self.stiffness, at.inverse_inductance);
        at.current = at.current + axis * self.current(state);
        at.inverse_inductance = Symmetric::new(
            gamma.xx + stiffness * axis.x * axis.x,
            gamma.xy + stiffness * axis.x * axis.y,
            gamma.yy + stiffness * axis.y * axis.y,
        );
        at.relaxing = at.relaxing - axis * (self.rise(state, at.current) * stiffness);
    }

    /// Returns the branch at a state.
    #[inline(always)]
    pub fn point(&self, state: &State<V>) -> ShortPoint<V> {
        ShortPoint { axis: self.axis, stiffness: self.stiffness, lagging: state.shorted }
    }

    /// Returns the flux in Wb that [`Self::pull`] adds over a step, where legs carry a current.
    #[inline(always)]
    pub fn missing(&self, end: &End<'_, '_, V>, there: &Here<V>) -> Plane<V> {
        let Begin { h, legs, here, change, .. } = *end.begin;
        let [from, rise] = self.pulling(&here.state, &here.at, change);
        let [to, last] = self.pulling(&there.state, &there.at, end.change);
        let area = (from + to) * (h * 0.5) + (rise - last) * (h * h * (1.0 / 12.0));
        Plane::choose(legs.idle, Plane::default(), area)
    }

    /// Returns the flux in Wb that [`Self::pull`] has added up to a point within a step.
    #[inline(always)]
    pub fn pulled_within(&self, span: &Span<'_, '_, V>) -> Plane<V> {
        let Span { from, step: Tried { h, legs, end, change: [first, last], .. }, .. } = *span;
        let of = |pull: [Plane<V>; 2]| pull.map(|of| self.axis.dot(of));
        let [begin, rise] = of(self.pulling(&from.state, &from.at, first));
        let [to, to_rise] = of(self.pulling(&end.state, &end.at, last));
        let area = span.cubic([begin, to], [rise, to_rise]).area(span.share) * *h;
        Plane::choose(legs.idle, Plane::default(), self.axis * area)
    }

    /// Returns how many time constants of the branch a step of `h` seconds has.
    #[inline(always)]
    fn constants(&self, h: V) -> V {
        h * self.stiffness * self.resistance
    }

    /// Returns the flux in Wb that χ follows, and its slope in Wb per step of `h` seconds.
    #[inline(always)]
    fn driving(
        &self,
        [flux, current]: [Plane<V>; 2],
        [flux_rise, current_rise]: [Plane<V>; 2],
        h: V,
    ) -> Driving<V> {
        let of = |flux: Plane<V>, current: Plane<V>| self.axis.dot(flux) - self.axis.dot(current) * self.lost;
        Driving { flux: of(flux, current), rise: of(flux_rise, current_rise) * h }
    }
}

impl<V: Wide> Effect<V> for Shorted<V> {
    type Step = ShortStep<V>;

    fn rest(&self, lane: usize, _: &Case<'_>, _: Dq<f64>, state: &mut State<V>) {
        state.shorted.put(lane, 0.0);
    }

    /// Adds what the branch pulls to the predicted flux, too.
    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> ShortStep<V> {
        let Begin { h, legs, here, change, .. } = *begin;
        let [pull, rise] = self.pulling(&here.state, &here.at, change);
        // Ringing terminals have it in their force.
        if begin.machine.legs.elastance.is_none() {
            let more = pull * h + rise * (h * (h * 0.5));
            there.state.flux = Plane::choose(legs.idle, there.state.flux, there.state.flux + more);
        }
        let slopes = [change.flux, change.current];
        let from = self.driving([here.state.flux, here.at.current], slopes, h);
        let current = here.at.current + change.current * h;
        let to = Driving { rise: from.rise, ..self.driving([there.state.flux, current], slopes, h) };
        there.state.shorted = lag_behind(self.constants(h), here.state.shorted, &from, &to);
        ShortStep { from, counted: None, off: V::of(0.0) }
    }

    /// Corrects χ, with what blocked legs make of the flux as it changes.
    #[inline(always)]
    fn correct(&self, end: &End<'_, '_, V>, there: &mut Here<V>, step: &mut ShortStep<V>) {
        let End { begin, looked, change } = *end;
        let (h, x) = (begin.h, self.constants(begin.h));
        // The slope with which the core was evaluated is that at its own flux.
        let counted = if let Some(counted) = step.counted {
            counted
        } else {
            let mut state = there.state;
            state.flux = looked.flux;
            self.rise(&state, looked.current)
        };
        // χ follows the flux after the correction for blocked legs, not the one before it.
        looked.settle(begin.legs, there);
        let to = self.driving([there.state.flux, there.at.current], [change.flux, change.current], h);
        let missing = lag_behind(x, begin.here.state.shorted, &step.from, &to) - there.state.shorted;
        let follows = looked.follows(begin.legs, self.axis * self.stiffness);
        let follows = self.axis.dot(follows);
        let (half, square) = (x * 0.5, x * x * (1.0 / 12.0));
        let taken = follows * (half + square * (V::of(2.0) - follows)) / (square + half + 1.0);
        let more = missing / (V::of(1.0) - taken);
        there.state.shorted = there.state.shorted + more;
        there.at.current = there.at.current - self.axis * (more * self.stiffness);
        looked.settle(begin.legs, there);
        let rise = self.rise(&there.state, there.at.current);
        there.at.relaxing = there.at.relaxing - self.axis * ((rise - counted) * self.stiffness);
        step.counted = Some(rise);
        // What the lag is off from the one at which it settles behind a flux that bends evenly, τ D′ − τ² D″.
        let per_second = V::of(1.0) / h.greatest(V::of(1e-30));
        let bend = (to.rise - step.from.rise) * (per_second * per_second);
        let off = |driving: &Driving<V>, lagging: V| {
            let settled = (driving.rise * per_second - bend * self.constant) * self.constant;
            (driving.flux - lagging - settled).abs()
        };
        let most = off(&step.from, begin.here.state.shorted).greatest(off(&to, there.state.shorted));
        step.off = settling_error(most, x) * self.weight;
    }

    #[inline(always)]
    fn error(&self, step: &ShortStep<V>, accuracy: &Accuracy<V>) -> V {
        step.off * accuracy.per_flux
    }

    #[inline(always)]
    fn within(&self, span: &Span<'_, '_, V>, there: &mut Here<V>) {
        let (step, part, first) = (span.step, span.step.h * span.share, &span.step.change[0]);
        let [from, to] = [&span.from.at.current, &step.end.at.current];
        let [x, y] = [
            span.cubic([from.x, to.x], [first.current.x, step.change[1].current.x]),
            span.cubic([from.y, to.y], [first.current.y, step.change[1].current.y]),
        ];
        let current = Plane::new(x.at(span.share), y.at(span.share));
        let per_second = V::of(1.0) / step.h.greatest(V::of(1e-30));
        let current_rise = Plane::new(x.rise(span.share), y.rise(span.share)) * per_second;
        let [x, y] = span.flux();
        let flux_rise = Plane::new(x.rise(span.share), y.rise(span.share)) * per_second;
        let begin = self.driving([span.from.state.flux, *from], [first.flux, first.current], part);
        let end = self.driving([there.state.flux, current], [flux_rise, current_rise], part);
        there.state.shorted = lag_behind(self.constants(part), span.from.state.shorted, &begin, &end);
    }

    #[inline(always)]
    fn slope(&self, _: &Conducting<V>, here: &Here<V>, slope: &mut State<V>) {
        slope.shorted = self.rise(&here.state, here.at.current);
    }

    #[inline(always)]
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>) {
        keep(of, from.state.shorted, &mut to.state.shorted);
        keep_plane(of, from.at.relaxing, &mut to.at.relaxing);
    }

    fn energy(&self, moment: &Moment<'_, '_, V>, stored: &mut Ledger) {
        let stiffness = moment.one(&self.stiffness);
        if stiffness > 0.0 {
            let current = moment.one(&self.current(&moment.here.state));
            stored.field_change += 0.75 * current * current / stiffness;
        }
    }

    /// Adds the losses in the shorted turns and in the fault's resistance, beyond those that the winding's current
    /// would make.
    fn power(&self, moment: &Moment<'_, '_, V>, _: &Span<'_, '_, V>, powers: &mut Ledger) {
        let current = moment.one(&self.current(&moment.here.state));
        let phase = self.axis.get(moment.lane).dot(moment.current());
        let (branch, winding) = (moment.one(&self.resistance), moment.one(&self.winding));
        powers.copper_loss += 1.5 * (branch * current - 2.0 * winding * phase) * current;
    }
}
