//! The winding within a step: its flux changes by the exact integral of the terminal voltage less a quadrature of the
//! resistive drop R i.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Symmetric, Wide};

use super::link::LinkStep;
use super::{Begin, Effect, End, Moment, Span, keep_plane, keep_symmetric};
use crate::case::Case;
use crate::ledger::Ledger;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::{Accuracy, error};
use crate::step::two_derivative::{Here, Tried};

/// The winding as an effect; its part of a step is [`WindingStep`].
pub struct Winding;

impl<V: Wide> Effect<V> for Winding {
    type Step = ();

    fn rest(&self, lane: usize, _: &Case<'_>, flux: Dq<f64>, state: &mut State<V>) {
        state.flux.put(lane, Plane::new(flux.d, flux.q));
    }

    #[inline(always)]
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>) {
        keep_plane(of, from.state.flux, &mut to.state.flux);
        keep_symmetric(of, from.at.inverse_inductance, &mut to.at.inverse_inductance);
        keep_plane(of, from.at.current, &mut to.at.current);
    }

    fn energy(&self, moment: &Moment<'_, '_, V>, stored: &mut Ledger) {
        let (state, case) = (&moment.here.state, moment.case);
        let turned = moment.one(&state.turned);
        let flux = state.flux.get(moment.lane).to_rotor(Heading::of(turned));
        let lag = flux - Dq::new(moment.one(&state.lagging.d), moment.one(&state.lagging.q));
        stored.field_change += case.motor.field_energy(flux, lag, case.start_angle + turned);
    }

    fn power(&self, moment: &Moment<'_, '_, V>, _: &Span<'_, '_, V>, powers: &mut Ledger) {
        let current = moment.current();
        let resistance = moment.machine.legs.resistance(moment.lane, moment.one(&moment.machine.resistance));
        powers.copper_loss += 1.5 * current.through(resistance).dot(current);
    }
}

/// Quantities of the winding over a step.
#[derive(Clone, Copy)]
pub struct WindingStep<V> {
    /// Flux in Wb at the end as it would be without the resistive drop.
    known: Plane<V>,
    /// Predicted flux in Wb at the end, with blocked legs' currents at zero, and the current in A at that flux.
    pub predicted: [Plane<V>; 2],
}

impl<V: Wide> WindingStep<V> {
    /// Writes the predicted flux at the end into `there`.
    #[inline(always)]
    pub fn predict(begin: &Begin<'_, '_, V>, link: &LinkStep<V>, there: &mut Here<V>) -> Self {
        let Begin { h, legs, here, change, .. } = *begin;
        let (terminals, flux) = (&legs.terminals, here.state.flux);
        let known = flux + terminals.rail * link.area + terminals.offset * h;
        let drop = (here.at.current * h + change.current * (h * (h * 0.5))).through(terminals.resistance);
        // The voltage that keeps the blocked leg's current at zero, with its value at the beginning.
        let holding = terminals.blocked * (change.blocked_potential * (2.0 / 3.0) * h);
        there.state.flux = Plane::choose(legs.idle, flux + change.flux * h, known - drop + holding);
        Self { known, predicted: [there.state.flux, here.at.current] }
    }

    /// Returns the flux in Wb to be added to the prediction, from the quadrature of the resistive drop.
    #[inline(always)]
    pub fn missing(&self, end: &End<'_, '_, V>, there: &Here<V>, link: &LinkStep<V>) -> Plane<V> {
        let End { begin, looked, change } = *end;
        let Begin { h, legs, here, change: first, .. } = *begin;
        let (half, twelfth, terminals) = (h * 0.5, h * h * (1.0 / 12.0), &legs.terminals);
        let predicted = self.predicted[0];
        let drop = (here.at.current + there.at.current) * half + (first.current - change.current) * twelfth;
        let missing =
            self.known + terminals.rail * link.more - drop.through(terminals.resistance) - predicted;
        if !looked.any_idle {
            return missing;
        }
        let through = here.state.flux + (first.flux + change.flux) * half - predicted;
        Plane::choose(legs.idle, through, missing)
    }

    /// Adds the missing flux in Wb to the state, less the resistive drop of the current that this flux adds.
    #[inline(always)]
    pub fn correct(end: &End<'_, '_, V>, missing: Plane<V>, resistance: Symmetric<V>, there: &mut Here<V>) {
        let (looked, legs) = (end.looked, end.begin.legs);
        let missing = looked.held(legs, missing);
        let feedback = missing.through(looked.gamma).through(resistance) * (end.begin.h * 0.5);
        let missing = Plane::choose(legs.idle, missing, looked.held(legs, missing - feedback));
        there.state.flux = there.state.flux + missing;
        there.at.current = there.at.current + missing.through(looked.gamma);
    }

    /// Returns the winding's contribution to the step's error, relative to the tolerance. `off` is the distance in Wb between the end and
    /// the point at which the core was evaluated.
    #[inline(always)]
    pub fn error(end: &End<'_, '_, V>, there: &Here<V>, off: Plane<V>, accuracy: &Accuracy<V>) -> V {
        let End { begin, change, .. } = *end;
        let resistance = &begin.legs.terminals.resistance;
        error(accuracy, begin.h, resistance, begin.here, there, [begin.change, change], off)
    }
}

/// Returns the flux in Wb at a point within a step. `area` is the integral of the link's voltage up to that point, in V·s.
#[inline(always)]
pub fn flux_within<V: Wide>(span: &Span<'_, '_, V>, area: V) -> Plane<V> {
    let Span { from, step, share, .. } = *span;
    let Tried { h, legs, end: to, change: [first, last], .. } = step;
    let (h, terminals) = (*h, &legs.terminals);
    let (currents, rises) = ([from.at.current, to.at.current], [first.current, last.current]);
    let x = span.cubic([currents[0].x, currents[1].x], [rises[0].x, rises[1].x]);
    let y = span.cubic([currents[0].y, currents[1].y], [rises[0].y, rises[1].y]);
    let charge = Plane::new(x.area(share) * h, y.area(share) * h);
    let potential =
        first.blocked_potential + (last.blocked_potential - first.blocked_potential) * share * 0.5;
    let driven = from.state.flux + terminals.rail * area + terminals.offset * (h * share)
        - charge.through(terminals.resistance)
        + terminals.blocked * (potential * (2.0 / 3.0) * h * share);
    let [x, y] = span.flux();
    Plane::choose(legs.idle, Plane::new(x.at(share), y.at(share)), driven)
}
