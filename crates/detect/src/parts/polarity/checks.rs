//! Checks of a polarity test by vectors: whether all parts are intact, and whether the rotor stands still.

use standstill_interface::{
    Abc, AlphaBeta, Angle, Fault, Phase, PoleEvidence, Reading, Real, Sensed, Undetermined,
};

use super::{Pointer, PolarityTest, Pole};
use crate::checks::Check;
use crate::parts::settle::{is_reading, seen};
use crate::parts::turning::{self, Short};

/// Current through shorted terminals, as the sensors show it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Driven<T> {
    /// Current in A; where it is beyond a sensor's range, the end of the range.
    current: Abc<T>,
    /// Whether the current of a phase without a sensor was derived from the others.
    is_derived: bool,
    /// The first phase whose current is beyond its sensor's range.
    clipped: Option<Phase>,
}

impl<T: Real> Driven<T> {
    pub fn of(reading: &Reading<T>) -> Result<Self, Fault<T>> {
        let mut clipped = None;
        for phase in Phase::ALL {
            match seen(reading, phase) {
                // The current is at least that at the end of the range.
                Err(Fault::Clipped(_)) if is_reading(reading.current[phase]) => {
                    clipped = clipped.or(Some(phase));
                }
                other => drop(other?),
            }
        }
        let is_derived = reading.sensed.0.contains(&Sensed::Derived);
        Ok(Self { current: reading.current, is_derived, clipped })
    }
}

impl<T: Real> PolarityTest<T> {
    /// Checks that vectors raise enough of the set current, and that the responses along the axis and against it differ by no more than the
    /// poles can make them.
    pub(super) fn check_directions(&mut self) -> Result<(), Fault<T>> {
        if self.vectors == 0 || !self.settings.checks.has(Check::BothWays) {
            return Ok(());
        }
        let n = T::of(f64::from(self.pairs()));
        let mean = (self.along + self.against) / (n + n);
        let needed = self.settings.current * self.settings.least_share;
        self.settler.margin.at_least(mean, needed);
        if mean < needed {
            return Err(Fault::NoCurrent { peak: mean, needed });
        }
        let (apart, allowed) = ((self.sum / n).abs(), self.settings.both_ways);
        self.settler.margin.at_most(apart, allowed);
        // NaN ends a detection in `Pole::outcome`.
        if apart > allowed { Err(Fault::DirectionsDiffer { phase: None, apart, allowed }) } else { Ok(()) }
    }

    /// Checks that the rotor stands still, from the current that its magnet drove through the shorted terminals. The
    /// pole is left undetermined if a speed that this current would not show may have turned the rotor so far, since
    /// its axis was measured, that one pole is taken for the other.
    pub(super) fn check_standing(&mut self, pole: &mut Pole<T>) -> Result<(), Fault<T>> {
        let Some(driven) = self.driven else { return Ok(()) };
        let s = &self.settings;
        let short = Short {
            duration: T::of(s.short_time().seconds()),
            resistance: s.resistance,
            inductance: s.q_axis_inductance,
            flux: s.magnet_flux,
            lost: s.lost,
        };
        let (offset, waits) = self.settler.offset();
        let current = Abc(core::array::from_fn(|k| driven.current.0[k] - offset.0[k])).clarke();
        let noise = &self.settler.noise;
        // Variance of a reading, and of the mean of the readings without current.
        let variance = noise.deviation() * noise.deviation() * s.by_reading() * (T::one() + waits.recip());
        let deviation = turning::deviation(variance, noise.freedom(), driven.is_derived);
        let known = (pole.undetermined.is_none().then_some(pole.angle), T::of(self.since.seconds()));
        let unseen =
            short.check(&mut self.settler.margin, current, (self.settler.dc_link, deviation), known)?;
        if let Some(phase) = driven.clipped {
            return Err(Fault::Clipped(phase));
        }
        let (angle, allowed) = (self.settler.margin.unseen(unseen) * known.1, Pointer::most_off_axis());
        if angle > allowed && pole.undetermined.is_none() {
            pole.open(Undetermined::MayHaveTurned { angle, allowed });
        }
        Ok(())
    }

    /// Returns the reason for an undetermined pole if the difference of the responses, as a vector, points away from
    /// the axis. Such a difference is no evidence, however large it is: it comes from a faulty part, or the axis is
    /// wrong. None without enough evidence, which is a reason of its own.
    ///
    /// A rotor that moves between two vectors also makes such a difference. In pairs in the order ABBA it cancels, up
    /// to 1/n of it for an odd number n of pairs, so the rule of two vectors does not use this check. A turning rotor
    /// makes one, too: its magnet drives `−ωψt/L_q` across the axis, equally in both vectors.
    pub(super) fn off_axis(&self, draws_more: PoleEvidence<T>) -> Option<Undetermined<T>> {
        let n = T::of(f64::from(self.pairs()));
        let direction = AlphaBeta::new(self.sum / n, self.across / n);
        // The evidence is the difference along the axis in its own deviations.
        let pointer = Pointer { direction, deviation: (direction.alpha / draws_more.deviations).abs() };
        draws_more.is_enough().then(|| pointer.off_axis(Angle::from_radians(T::zero()))).flatten()
    }
}
