//! The DC link within a step: its voltage equals the source's, or it is the voltage of a capacitor that the source
//! feeds through a resistance.

use standstill_interface::Dq;
use standstill_inverter::Source;
use standstill_numeric::Wide;

use super::{Begin, Effect, End, Moment, Span, keep};
use crate::case::Case;
use crate::ledger::Ledger;
use crate::physics::legs::Conducting;
use crate::physics::links::{Links, Storages, hermite_area};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::Here;

/// Time in s that converts a correction of the link's voltage in V into an estimated flux error in Wb. It is only 0.3 µs,
/// because the error of the corrected voltage is far smaller than the correction.
const SHARE_OF_LINK: f64 = 3e-7;

/// The same time in s for a step in which the source reaches its largest current, or falls below it. The slope of the source's current
/// jumps there, so the corrected voltage is no better than the correction.
const SHARE_OF_KINK: f64 = 1e-4;

/// Quantities of the DC link over a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinkStep<V> {
    /// The link's voltage in V at both ends.
    pub voltage: [V; 2],
    /// Slope of the voltage in V/s at both ends.
    pub rise: [V; 2],
    /// Second derivative of the voltage in V/s² at the beginning.
    bend: V,
    /// Integral of the predicted voltage over the step in V·s.
    pub area: V,
    /// Integral of the corrected voltage less that of the predicted one, in V·s.
    pub more: V,
    /// Correction of the voltage in V at the end.
    correction: V,
    /// Rate in 1/s at which the source replaces a lack of the link's voltage, at both ends: zero at its largest current.
    gradient: [V; 2],
}

impl<V: Wide> LinkStep<V> {
    /// Returns the voltage in V and its slope in V/s at the beginning (0) or the end (1).
    #[inline(always)]
    pub fn at(&self, end: usize) -> [V; 2] {
        [self.voltage[end], self.rise[end]]
    }

    /// Returns the predicted integral of the voltage in V·s over a step of `h` seconds less that of the tangent at the
    /// beginning.
    #[inline(always)]
    pub fn over_tangent(&self, h: V) -> V {
        self.area - (self.voltage[0] * h + self.rise[0] * (h * h * 0.5))
    }

    /// Returns the corrected integral of the voltage in V·s over a step of `h` seconds less that of the cubic between the
    /// ends. Zero if the link has a capacitor, whose voltage is this cubic.
    #[inline(always)]
    pub fn over_cubic(&self, h: V) -> V {
        self.area + self.more - hermite_area(h, self.voltage, self.rise)
    }
}

impl<V: Wide> Links<V> {
    /// Corrects links with a capacitor a second time, after the terminals' correction has changed the currents and slopes of the first one.
    /// The flux at the end follows.
    #[inline(always)]
    pub fn correct_again(&self, end: &End<'_, '_, V>, there: &mut Here<V>, step: &mut LinkStep<V>) {
        if self.storage.is_none() {
            return;
        }
        let Begin { machine, legs, .. } = *end.begin;
        let (known, more) = (machine.change::<true>(legs, &there.at, &there.state), step.more);
        self.correct(&End { change: &known, ..*end }, there, step);
        let late = end.looked.held(legs, legs.terminals.rail * (step.more - more));
        there.state.flux = there.state.flux + late;
        there.at.current = there.at.current + late.through(end.looked.gamma);
    }
}

impl<V: Wide> Effect<V> for Links<V> {
    type Step = LinkStep<V>;

    fn is_still(&self) -> bool {
        self.storage.is_none()
    }

    fn rest(&self, lane: usize, case: &Case<'_>, _: Dq<f64>, state: &mut State<V>) {
        state.link.put(lane, case.inverter.link.source(0.0));
    }

    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> LinkStep<V> {
        let zero = V::of(0.0);
        let (h, here) = (begin.h, begin.here);
        let source = self.source(there.time * 1e-9);
        there.source = source;
        let mut step = LinkStep {
            voltage: [here.state.link, source.voltage],
            rise: [here.source.rise, source.rise],
            bend: zero,
            area: zero,
            more: zero,
            correction: zero,
            gradient: [zero; 2],
        };
        if let Some(storage) = &self.storage {
            let change = begin.change.current;
            let rail = &begin.legs.terminals.rail;
            step.gradient[0] = storage.gradient(here.state.link, here.source.voltage);
            (step.rise[0], step.bend) =
                storage.slopes(rail, here.state.link, here.source, here.at.current, change, step.gradient[0]);
            step.voltage[1] = here.state.link + h * (step.rise[0] + h * 0.5 * step.bend);
            step.area = hermite_area(h, step.voltage, [step.rise[0], step.rise[0] + h * step.bend]);
        } else {
            step.area = self.area(h, here.source, source);
        }
        there.state.link = step.voltage[1];
        step
    }

    #[inline(always)]
    fn correct(&self, end: &End<'_, '_, V>, there: &mut Here<V>, step: &mut LinkStep<V>) {
        let Some(storage) = &self.storage else { return };
        let End { begin, change, .. } = *end;
        let (h, link) = (begin.h, step.voltage[1]);
        let rail = &begin.legs.terminals.rail;
        let gradient = storage.gradient(link, there.source.voltage);
        let (rise, bend) =
            storage.slopes(rail, link, there.source, there.at.current, change.current, gradient);
        let missing = step.voltage[0] + hermite_area(h, [step.rise[0], rise], [step.bend, bend]) - link;
        let x = h * gradient;
        let correction = missing / (x * 0.5 + x * x * (1.0 / 12.0) + 1.0);
        step.voltage[1] = link + correction;
        step.rise[1] = rise - correction * gradient;
        step.gradient[1] = gradient;
        step.correction = step.correction + correction;
        step.more = hermite_area(h, step.voltage, step.rise) - step.area;
        there.state.link = step.voltage[1];
    }

    #[inline(always)]
    fn error(&self, step: &LinkStep<V>, accuracy: &Accuracy<V>) -> V {
        let share = match &self.storage {
            Some(Storages { most: Some(_), .. }) => {
                let [begin, end] = step.gradient;
                let same = V::choose(
                    (begin - end).abs().above(V::of(0.0)),
                    V::of(SHARE_OF_KINK),
                    V::of(SHARE_OF_LINK),
                );
                step.correction.abs() * same
            }
            _ => step.correction.abs() * SHARE_OF_LINK,
        };
        share * accuracy.per_flux
    }

    #[inline(always)]
    fn within(&self, span: &Span<'_, '_, V>, there: &mut Here<V>) {
        there.source = self.source(there.time * 1e-9);
        there.state.link = match &self.storage {
            Some(_) => stored(span).at(span.share),
            None => there.source.voltage,
        };
    }

    #[inline(always)]
    fn slope(&self, legs: &Conducting<V>, here: &Here<V>, slope: &mut State<V>) {
        if let Some(storage) = &self.storage {
            slope.link =
                storage.rise(&legs.terminals.rail, here.state.link, here.source.voltage, here.at.current);
        }
    }

    #[inline(always)]
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>) {
        keep(of, from.source.voltage, &mut to.source.voltage);
        keep(of, from.source.rise, &mut to.source.rise);
        keep(of, from.state.link, &mut to.state.link);
    }

    fn between(&self, end: &End<'_, '_, V>, there: &Here<V>) -> LinkStep<V> {
        let Begin { h, legs, here, .. } = *end.begin;
        let ends = [here, there];
        let rise = ends.map(|end| match &self.storage {
            Some(storage) => {
                storage.rise(&legs.terminals.rail, end.state.link, end.source.voltage, end.at.current)
            }
            None => end.source.rise,
        });
        let area = self.area(h, here.source, there.source);
        LinkStep { voltage: ends.map(|end| end.state.link), rise, area, ..LinkStep::default() }
    }

    fn energy(&self, moment: &Moment<'_, '_, V>, stored: &mut Ledger) {
        let voltage = moment.one(&moment.here.state.link);
        if let Some(storage) = moment.case.inverter.link.storage {
            stored.link_change += storage.capacitance * voltage * voltage / 2.0;
        }
    }

    fn power(&self, moment: &Moment<'_, '_, V>, span: &Span<'_, '_, V>, powers: &mut Ledger) {
        let (here, current) = (moment.here, moment.phases());
        let source = self.source_of(moment.lane, moment.one(&here.time) * 1e-9).voltage;
        let mut delivered: f64 = (0..3).map(|k| moment.one(&span.step.legs.leg[k].rail) * current[k]).sum();
        let link = &moment.case.inverter.link;
        if link.storage.is_some() {
            let lack = source - moment.one(&here.state.link);
            delivered = link.delivered(lack);
            powers.source_loss += delivered * lack;
        }
        powers.source += source * delivered;
    }
}

impl<V: Wide> Links<V> {
    /// Updates the source's voltage in a lane to the time of `here`. Without a capacitor, also updates the link's voltage, which equals the
    /// source's voltage.
    pub fn look(&self, lane: usize, here: &mut Here<V>) {
        let source = self.source_of(lane, here.time.get(lane) * 1e-9);
        here.source.voltage.put(lane, source.voltage);
        here.source.rise.put(lane, source.rise);
        if self.storage.is_none() {
            here.state.link.put(lane, source.voltage);
        }
    }

    /// Returns the integral of the link's voltage in V·s from the beginning of a step to the point `there` within it.
    #[inline(always)]
    pub fn area_within(&self, span: &Span<'_, '_, V>, there: &Here<V>) -> V {
        match &self.storage {
            Some(_) => stored(span).area(span.share) * span.step.h,
            None => self.area(span.step.h * span.share, span.from.source, there.source),
        }
    }
}

/// Returns the cubic of the link capacitor's voltage over the step.
#[inline(always)]
pub fn stored<V: Wide>(span: &Span<'_, '_, V>) -> Cubic<V> {
    span.cubic([span.from.state.link, span.step.end.state.link], span.step.link.rise)
}

impl<V: Wide> Storages<V> {
    /// Returns the first and the second time derivative of the capacitor's voltage, in V/s and V/s².
    #[inline(always)]
    fn slopes(
        &self,
        rail: &Plane<V>,
        link: V,
        source: Source<V>,
        current: Plane<V>,
        current_rise: Plane<V>,
        gradient: V,
    ) -> (V, V) {
        let rise = self.rise(rail, link, source.voltage, current);
        (rise, (source.rise - rise) * gradient - self.taken(rail, current_rise))
    }

    /// Returns the rate in 1/s at which the source's current changes the link's voltage per V of that voltage: the reciprocal of the charging
    /// time constant, or zero if the source delivers its largest current.
    #[inline(always)]
    fn gradient(&self, link: V, source: V) -> V {
        match self.most {
            Some(most) => V::choose(((source - link) * self.rate).above(most), V::of(0.0), self.rate),
            None => self.rate,
        }
    }

    /// Returns the time derivative of the capacitor's voltage in V/s. `rail` is the voltage vector of the legs per V of the link. `link`
    /// and `source` are voltages in V. `current` is the current vector in A.
    #[inline(always)]
    pub fn rise(&self, rail: &Plane<V>, link: V, source: V, current: Plane<V>) -> V {
        let fed = (source - link) * self.rate;
        let fed = match self.most {
            Some(most) => fed.least(most),
            None => fed,
        };
        fed - self.taken(rail, current)
    }

    /// Returns the rate in V/s at which the current of the upper rail, Σ rail_k i_k = 3/2 rail · i, discharges the
    /// capacitor.
    #[inline(always)]
    fn taken(&self, rail: &Plane<V>, current: Plane<V>) -> V {
        rail.dot(current) * self.elastance * 1.5
    }
}
