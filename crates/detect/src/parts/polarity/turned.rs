//! Whether the vectors show that the rotor has turned since its axis was measured.
//!
//! A rotor that turns at ω is ωT ahead of an axis that was measured a time T before. The voltage that its magnet
//! induces drives the current `−ωψ/R (1 − e^(−R t/L_q))` across the magnet, equally in vectors along the axis and
//! against it. Let E be its part in the difference of a pair, relative to the vectors' currents. Seen from the axis, `E
//! sin ωT` lies along the axis, always towards north. If north draws more current, that only adds to the difference of
//! the poles. If south does, a turning rotor makes one pole look like the other long before it has turned by a right
//! angle.

use standstill_interface::{Real, Undetermined};

use super::{Place, Pointer, PolarityTest, Signature};
use crate::parts::{significance, turning};

/// Largest share of a difference along the axis that may be due to the magnet's induced voltage.
const MOST_INDUCED: f64 = 0.5;

impl<T: Real> PolarityTest<T> {
    /// Returns the reason for an undetermined pole if the currents across the axis, equal in both directions, show a
    /// speed at which the rotor has turned, since its axis was measured, by more than 45°, or by so much that half of a
    /// difference along the axis that speaks for south is induced. Only the part that exceeds noise and the legs'
    /// delays counts.
    pub(super) fn turned(&self) -> Option<Undetermined<T>> {
        let s = &self.settings;
        if self.vectors == 0 || s.magnet_flux <= T::zero() || s.place == Place::InLink {
            return None;
        }
        let n = T::of(f64::from(self.pairs()));
        let current = (self.along + self.against) / (n + n);
        let noise = self.settler.noise.deviation() / current;
        let readings = T::of(4.0) * s.by_reading() * noise * noise / n;
        let [dead, period] = [s.dead_time, s.carrier_period].map(|time| T::of(time.seconds()));
        let delays = significance::of_vector_delays(dead, period, self.settler.dc_link, self.amplitude);
        let doubt = significance::known(readings + delays).sqrt();
        let induced = ((self.across / n).abs() - doubt).max(T::zero());
        let by_volt = turning::by_volt(T::of(s.duration().seconds()), s.resistance, s.q_axis_inductance);
        // Twice, because both vectors of a pair have it.
        let speed = induced * current / (T::of(2.0) * by_volt * s.magnet_flux);
        let angle = speed * T::of(self.since.seconds());
        let mut allowed = Pointer::<T>::most_off_axis();
        if s.signature == Signature::Inverted {
            let share = T::of(MOST_INDUCED) * (self.sum / n).abs() / induced;
            allowed = allowed.min(share.min(T::one()).asin());
        }
        (angle > allowed).then_some(Undetermined::MayHaveTurned { angle, allowed })
    }
}
