//! Eddy currents within a step: their flux χ follows the winding's flux with a lag.

use std::ops::{Add, Mul, Sub};

use standstill_interface::Dq;
use standstill_numeric::{Heading, Wide};
use standstill_plant::Eddies;

use super::{Begin, Effect, End, Moment, Span, keep_dq, keep_plane};
use crate::case::Case;
use crate::ledger::Ledger;
use crate::physics::legs::Conducting;
use crate::physics::machine::Machine;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::{Accuracy, relaxing_error};
use crate::step::two_derivative::Here;

/// Quantities of the eddy currents over a step.
#[derive(Clone, Copy, Default)]
pub struct EddyStep<V> {
    /// The winding's flux at the beginning of the step.
    from: RotorFlux<V>,
    /// Error of the lagging flux in Wb.
    off: V,
}

impl<V: Wide> Effect<V> for Eddies<V> {
    type Step = EddyStep<V>;

    fn is_still(&self) -> bool {
        false
    }

    fn rest(&self, lane: usize, _: &Case<'_>, flux: Dq<f64>, state: &mut State<V>) {
        state.lagging.d.put(lane, flux.d);
        state.lagging.q.put(lane, flux.q);
    }

    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> EddyStep<V> {
        let (h, state, rise) = (begin.h, &begin.here.state, begin.change.flux * begin.h);
        let from = RotorFlux::of(begin.machine, state, rise, state.speed * h);
        let to = RotorFlux {
            rise: from.rise,
            ..RotorFlux::of(begin.machine, &there.state, rise, there.state.speed * h)
        };
        there.state.lagging = lag_behind(h * self.rate, state.lagging, &from, &to);
        EddyStep { from, off: V::of(0.0) }
    }

    #[inline(always)]
    fn correct(&self, end: &End<'_, '_, V>, there: &mut Here<V>, step: &mut EddyStep<V>) {
        let End { begin, change, .. } = *end;
        let (h, here) = (begin.h, begin.here);
        let to = RotorFlux::of(begin.machine, &there.state, change.flux * h, there.state.speed * h);
        let new = lag_behind(h * self.rate, here.state.lagging, &step.from, &to);
        let most = here.at.lag.d.abs().greatest(there.at.lag.d.abs())
            + here.at.lag.q.abs().greatest(there.at.lag.q.abs());
        step.off = relaxing_error(most, h * self.rate);
        let (g, more) = (self.inverse_inductance, new - there.state.lagging);
        let more = Dq::new(more.d * g.d, more.q * g.q);
        let turned = if begin.machine.rotors.is_some() {
            Heading::of(there.state.turned)
        } else {
            Heading { sin: V::of(0.0), cos: V::of(1.0) }
        };
        there.at.current = there.at.current - Plane::from_rotor(more, turned);
        there.at.lag = to.flux - new;
        there.state.lagging = new;
    }

    #[inline(always)]
    fn error(&self, step: &EddyStep<V>, accuracy: &Accuracy<V>) -> V {
        step.off * accuracy.per_flux
    }

    #[inline(always)]
    fn within(&self, span: &Span<'_, '_, V>, there: &mut Here<V>) {
        // Applies the step's rule to its first part: a cubic would be inexact where the lag is large.
        let (from, part, first) = (&span.from.state, span.step.h * span.share, &span.step.change[0]);
        let [x, y] = span.flux();
        let rise = Plane::new(x.rise(span.share), y.rise(span.share));
        let begin = RotorFlux::of(span.machine, from, first.flux * part, from.speed * part);
        let end = RotorFlux::of(span.machine, &there.state, rise * span.share, there.state.speed * part);
        there.state.lagging = lag_behind(part * self.rate, from.lagging, &begin, &end);
    }

    #[inline(always)]
    fn slope(&self, _: &Conducting<V>, here: &Here<V>, slope: &mut State<V>) {
        slope.lagging = here.at.lag * self.rate;
    }

    #[inline(always)]
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>) {
        keep_dq(of, from.state.lagging, &mut to.state.lagging);
        keep_plane(of, from.at.relaxing, &mut to.at.relaxing);
        keep_dq(of, from.at.lag, &mut to.at.lag);
    }

    fn power(&self, moment: &Moment<'_, '_, V>, _: &Span<'_, '_, V>, powers: &mut Ledger) {
        let lag = Dq::new(moment.one(&moment.here.at.lag.d), moment.one(&moment.here.at.lag.q));
        if let Some(eddy) = moment.case.motor.magnetics.eddy(lag) {
            powers.eddy_loss += 1.5 * eddy.current.dot(lag) / eddy.time_constant;
        }
    }
}

/// The flux that a lagging flux χ follows, at one end of a step.
#[derive(Clone, Copy, Default)]
pub(crate) struct Driving<F> {
    /// The flux in Wb.
    pub(crate) flux: F,
    /// Its slope in Wb per step.
    pub(crate) rise: F,
}

/// The winding's flux and its slope at one end of a step, in the rotor's plane.
pub(crate) type RotorFlux<T> = Driving<Dq<T>>;

impl<V: Wide> RotorFlux<V> {
    /// Computes the flux at a state, with slopes `flux_rise` in Wb per step in the run's plane and `angle_rise` in
    /// rad per step.
    #[inline(always)]
    pub(crate) fn of(machine: &Machine<V>, state: &State<V>, flux_rise: Plane<V>, angle_rise: V) -> Self {
        if machine.rotors.is_none() {
            return Self {
                flux: Dq::new(state.flux.x, state.flux.y),
                rise: Dq::new(flux_rise.x, flux_rise.y),
            };
        }
        let turned = Heading::of(state.turned);
        let rise = flux_rise - state.flux.quarter_turn() * angle_rise;
        Self { flux: state.flux.to_rotor(turned), rise: rise.to_rotor(turned) }
    }
}

/// Returns the lagging flux χ in Wb at the end of a step of `x` time constants. `lagging` is χ at the beginning of the step. `begin` and
/// `end` describe the flux that χ follows. The two-derivative rule is linear in χ and is solved for its end value.
#[inline(always)]
pub(crate) fn lag_behind<V: Wide, F>(x: V, lagging: F, begin: &Driving<F>, end: &Driving<F>) -> F
where
    F: Copy + Add<Output = F> + Sub<Output = F> + Mul<V, Output = F>,
{
    let (half, twelfth, square) = (x * 0.5, x * (1.0 / 12.0), x * x * (1.0 / 12.0));
    let denominator = V::of(1.0) / (square + half + 1.0);
    let decay = (square - half + 1.0) * denominator;
    let mean = (begin.flux + end.flux) * (half * denominator);
    let tilt = (end.flux - begin.flux) * (square * denominator);
    let bend = (begin.rise - end.rise) * (twelfth * denominator);
    lagging * decay + mean + tilt + bend
}
