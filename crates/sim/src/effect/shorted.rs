//! Shorted turns: a share k of the turns of phase x is short-circuited by a resistance R_f.
//!
//! The current i_s that circulates in these turns adds to the phase current. The core is magnetised by ī = i + ⅔ k i_s u, with
//! u the axis of phase x. The resistance of the whole winding acts on ī, too; equal voltages in all phases only move the
//! potential of the neutral:
//! ```text
//!   dψ/dt = v − R ī,       ī = ∂W/∂ψ
//!   ψ_s = k u·ψ + L_l i_s,   dψ_s/dt = −k R (i_x + i_s) − R_f i_s
//! ```
//! L_l is the leakage inductance of the shorted turns: their self-inductance less the part that links ψ. With the coupling c between these
//! turns and the phase, their own inductance is k² L_x/c², where L_x = L_A + L_σ is that of the phase. So `L_l = k² (L_x/c² − ⅔ L)`, with
//! L the mean of L_d and L_q. L_l belongs to paths in air and does not saturate. The rotor's EMF and the core's saturation are contained
//! in ψ.
//!
//! With χ = ψ_s/k, the shorted turns are a branch in parallel to the core along u, as eddy currents are one in the rotor's
//! frame:
//! ```text
//!   i = ī + i_b u,   i_b = g (u·ψ − χ) = −⅔ k i_s,   g = ⅔ k²/L_l
//!   dχ/dt = R_b i_b − R i_x,                         R_b = 3/2 (k R + R_f)/k²
//! ```
//! When the short begins, its current i_s is zero.

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
    /// R/(g R_b) in H: factor from the phase current to the flux by which it reduces the flux that χ follows.
    lost: V,
    /// Weight of an error of χ as an error of the winding's flux: 1 + g L.
    weight: V,
}

/// The branch of the shorted turns at one flux χ.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShortPoint<V> {
    /// Axis u of the phase in the run's plane.
    axis: Plane<V>,
    /// Inverse inductance g of the branch in 1/H.
    stiffness: V,
    /// The lagging flux χ in Wb.
    pub lagging: V,
}

impl<V: Wide> ShortPoint<V> {
    /// Returns the core's current in A, which is the terminals' current minus the branch's current. `flux` is the flux of the winding in
    /// Wb. `current` is the current of the terminals in A. `lagging` is the flux χ in Wb.
    #[inline(always)]
    pub fn core(&self, flux: Plane<V>, current: Plane<V>, lagging: V) -> Plane<V> {
        current - self.axis * ((self.axis.dot(flux) - lagging) * self.stiffness)
    }
}

/// Quantities of the shorted turns over a step.
#[derive(Clone, Copy, Default)]
pub struct ShortStep<V> {
    /// The flux that χ follows, at the beginning of the step.
    from: Driving<V>,
    /// Slope of χ in V with which the end's `relaxing` was last computed; none before the first correction.
    counted: Option<V>,
    /// Error of χ in Wb.
    off: V,
}

impl<V: Wide> Shorted<V> {
    /// Shorts turns of a lane's motor, in the phase with this axis, at a flux of the winding in Wb. Returns the initial flux χ in Wb: the
    /// winding's flux along the axis, because no current flows in the shorted turns yet.
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

    /// Removes the shorted turns of a lane.
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

    /// Returns the time derivative of χ in V, with this current of the terminals in A.
    #[inline(always)]
    fn rise(&self, state: &State<V>, current: Plane<V>) -> V {
        self.current(state) * self.resistance - self.axis.dot(current) * self.winding
    }

    /// Returns the current of the branch in A and its time derivative in A/s.
    #[inline(always)]
    pub fn flowing(&self, state: &State<V>, at: &Operating<V>, change: &Change<V>) -> [Plane<V>; 2] {
        let rise = (self.axis.dot(change.flux) - self.rise(state, at.current)) * self.stiffness;
        [self.axis * self.current(state), self.axis * rise]
    }

    /// Returns R i_b in V: the resistive drop R i of the terminals' current i is too large by this, because only ī = i − i_b passes
    /// through the winding's resistance.
    #[inline(always)]
    pub fn pull(&self, state: &State<V>) -> Plane<V> {
        self.axis * (self.current(state) * self.winding)
    }

    /// Returns the result of [`Self::pull`] for one lane, for code that is not compiled for wide registers.
    #[inline(always)]
    pub fn pull_of(&self, state: &State<V>, lane: usize) -> Plane {
        let axis = self.axis.get(lane);
        let current = (axis.dot(state.flux.get(lane)) - state.shorted.get(lane)) * self.stiffness.get(lane);
        axis * (current * self.winding.get(lane))
    }

    /// Returns the result of [`Self::pull`] in V and its time derivative in V/s.
    #[inline(always)]
    pub fn pulling(&self, state: &State<V>, at: &Operating<V>, change: &Change<V>) -> [Plane<V>; 2] {
        let [current, rise] = self.flowing(state, at, change);
        [current * self.winding, rise * self.winding]
    }

    /// Adds current, inverse inductance and decay of the branch to the operating point of the core.
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

    /// Returns the integral of [`Self::pull`] over a step in Wb; zero for machines without current.
    #[inline(always)]
    pub fn missing(&self, end: &End<'_, '_, V>, there: &Here<V>) -> Plane<V> {
        let Begin { h, legs, here, change, .. } = *end.begin;
        let [from, rise] = self.pulling(&here.state, &here.at, change);
        let [to, last] = self.pulling(&there.state, &there.at, end.change);
        let area = (from + to) * (h * 0.5) + (rise - last) * (h * h * (1.0 / 12.0));
        Plane::choose(legs.idle, Plane::default(), area)
    }

    /// Returns the integral of [`Self::pull`] in Wb from the beginning of a step to a point within it; zero for machines without current.
    #[inline(always)]
    pub fn pulled_within(&self, span: &Span<'_, '_, V>) -> Plane<V> {
        let Span { from, step: Tried { h, legs, end, change: [first, last], .. }, .. } = *span;
        let of = |pull: [Plane<V>; 2]| pull.map(|of| self.axis.dot(of));
        let [begin, rise] = of(self.pulling(&from.state, &from.at, first));
        let [to, to_rise] = of(self.pulling(&end.state, &end.at, last));
        let area = span.cubic([begin, to], [rise, to_rise]).area(span.share) * *h;
        Plane::choose(legs.idle, Plane::default(), self.axis * area)
    }

    /// Returns the length of a step of `h` seconds in time constants of the branch.
    #[inline(always)]
    fn constants(&self, h: V) -> V {
        h * self.stiffness * self.resistance
    }

    /// Returns the flux in Wb that χ follows, u·ψ − (R/(g R_b)) u·i, and its slope in Wb per step of `h` seconds; from flux and current,
    /// and from their time derivatives.
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

    fn is_still(&self) -> bool {
        false
    }

    fn rest(&self, lane: usize, _: &Case<'_>, _: Dq<f64>, state: &mut State<V>) {
        state.shorted.put(lane, 0.0);
    }

    /// Predicts χ, and adds the integral of [`Self::pull`] to the predicted flux.
    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> ShortStep<V> {
        let Begin { h, legs, here, change, .. } = *begin;
        let [pull, rise] = self.pulling(&here.state, &here.at, change);
        // With ringing terminals, the force of the oscillators contains it.
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

    /// Corrects χ together with the flux change by which blocked legs keep their current at zero.
    #[inline(always)]
    fn correct(&self, end: &End<'_, '_, V>, there: &mut Here<V>, step: &mut ShortStep<V>) {
        let End { begin, looked, change } = *end;
        let (h, x) = (begin.h, self.constants(begin.h));
        // The operating point was computed with the slope of χ at the flux at which the core was evaluated.
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
        // Distance of the lag from its steady state behind a flux D with a constant second derivative, τ D′ − τ² D″.
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

    /// Adds the losses in the shorted turns and in the fault's resistance, beyond the loss R i² that the winding accounts for.
    fn power(&self, moment: &Moment<'_, '_, V>, _: &Span<'_, '_, V>, powers: &mut Ledger) {
        let current = moment.one(&self.current(&moment.here.state));
        let phase = self.axis.get(moment.lane).dot(moment.current());
        let (branch, winding) = (moment.one(&self.resistance), moment.one(&self.winding));
        powers.copper_loss += 1.5 * (branch * current - 2.0 * winding * phase) * current;
    }
}
