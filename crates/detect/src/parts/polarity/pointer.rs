//! The pole from a direction along the magnet.

use standstill_interface::{AlphaBeta, Angle, PoleEvidence, Real, Undetermined};

use super::sequential::{tail, tail_beyond};
use super::{Pole, Signature};

/// Pointer: a vector `D` along the magnet, measured together with the axis, from which the pole is read. The component
/// of `D` along the axis, in units of its own uncertainty, decides; a `D` that points elsewhere is no evidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pointer<T> {
    /// D in any unit: towards the pole that draws more current.
    pub direction: AlphaBeta<T>,
    /// Standard deviation of each component of D in the same unit, by all errors.
    pub deviation: T,
}

impl<T: Real> Pointer<T> {
    /// Returns the angle in rad between D and the axis beyond which the two contradict each other.
    pub fn most_off_axis() -> T {
        T::FRAC_PI_4()
    }

    /// Returns the north pole at one end of `axis` from the component of D along it alone, whatever the component
    /// across it is; none if the component is too small for the probability of a wrong pole to be at most `allowed`.
    pub fn north(&self, axis: Angle<T>, signature: Signature, allowed: T) -> Option<Angle<T>> {
        let deviations = self.direction.park(axis).d / self.deviation;
        let evidence = signature.towards_north(PoleEvidence { deviations, needed: tail_beyond(allowed) })?;
        let ahead = evidence.deviations > T::zero();
        evidence.is_enough().then(|| if ahead { axis } else { axis.opposite() })
    }

    /// Returns the reason for an undetermined pole if D points away from the axis by more than its noise can turn it.
    pub fn off_axis(&self, axis: Angle<T>) -> Option<Undetermined<T>> {
        let on = self.direction.park(axis);
        let angle = on.q.abs().atan2(on.d.abs());
        // A direction is only as well known as its noise lets it be.
        let allowed = Self::most_off_axis() + self.deviation / on.d.abs();
        (angle > allowed).then_some(Undetermined::OffAxis { angle, allowed })
    }

    /// Returns the pole at one end of `axis`; `allowed`: allowed probability of a wrong pole.
    pub fn read(&self, axis: Angle<T>, signature: Signature, allowed: T) -> Pole<T> {
        let z = self.direction.park(axis).d / self.deviation;
        let error = tail(z * z);
        let enough = tail_beyond(allowed);
        let across = self.off_axis(axis);
        let needed = if across.is_some() { T::infinity() } else { enough };
        let reason =
            across.filter(|_| z.abs() >= enough).unwrap_or(Undetermined::NotDecided { error, allowed });
        let evidence = signature.towards_north(PoleEvidence { deviations: z, needed });
        Pole { error: Some(error), ..Pole::decided(axis, evidence, reason) }
    }
}
