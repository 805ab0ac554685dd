//! Pulses of one length whose currents are sampled, at the end of the pulse and after its decay.

use standstill_interface::{Fault, Phase, Reading, Real, Sensed};

use super::{SixPulse, alone};
use crate::parts::settle::{largest, link, link_current, seen};

impl<T: Real> SixPulse<T> {
    /// Returns y and t of the pulse for the vector with this number.
    pub(super) fn sampled(&mut self, number: usize, readings: &[Reading<T>]) -> Result<(T, T), Fault<T>> {
        let [end, after] = readings else { return Err(Fault::UnexpectedReadings) };
        let voltage = link(end)?;
        self.volts = self.volts + voltage;
        let s = self.settings;
        let middle = T::of(s.sensing.averaged.seconds()) / T::of(2.0);
        let dead_time = T::of(s.dead_time.seconds());
        let time = T::of((s.sampled - s.sensing.lead()).seconds()) + middle - dead_time;
        let (current, left, at_once) = if s.in_link() {
            (link_current(end)? - link_current(after)?, link_current(after)?.abs(), T::one())
        } else {
            let current = self.of_single_leg(number, end, after)?;
            (current, largest(after)?, self.at_once(number, end, time))
        };
        let most = s.threshold * T::of(0.25);
        self.margin.at_most(left, most);
        if left > most {
            return Err(Fault::CurrentPersists(left));
        }
        let needed = s.threshold * T::of(0.05);
        self.margin.at_least(current, needed);
        if current < needed {
            return Err(Fault::NoCurrent { peak: current, needed });
        }
        Ok((current * at_once / voltage, time))
    }

    /// Returns the current in A of the vector's single leg along the vector, by the sensors of the phases.
    fn of_single_leg(&mut self, number: usize, end: &Reading<T>, after: &Reading<T>) -> Result<T, Fault<T>> {
        let (phase, high) = alone(number);
        // The residual is the reading without current; that of a derived phase is the negative sum of the other two.
        self.derived = self.derived.with(end);
        let read = seen(end, phase)?;
        let residual = if end.sensed[phase] == Sensed::Derived {
            let others = Phase::ALL.into_iter().filter(|other| *other != phase);
            let mut sum = T::zero();
            for other in others {
                sum = sum + seen(after, other)?;
            }
            -sum
        } else {
            seen(after, phase)?
        };
        Ok(if high { read - residual } else { residual - read })
    }

    /// Returns the factor from the current as it was converted to the current at the instant of the first conversion: a phase that is
    /// converted later reads more, in proportion to the time in s.
    fn at_once(&self, number: usize, end: &Reading<T>, time: T) -> T {
        let sensing = &self.settings.sensing;
        let (phase, _) = alone(number);
        let skew = T::of(sensing.skew.seconds());
        let late = if end.sensed[phase] == Sensed::Derived {
            // Half of the current flows in each of the others.
            skew * T::of((3 - phase as u8).into()) / T::of(2.0)
        } else {
            skew * T::of((phase as u8).into())
        };
        sensing.seen(time) / sensing.seen(time + late)
    }
}
