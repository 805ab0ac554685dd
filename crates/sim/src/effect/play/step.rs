//! Play cells within a step.

use standstill_numeric::{Symmetric, Wide};

use super::{Cells, Elastic, Iron};
use crate::effect::{Begin, Looked};
use crate::physics::machine::Change;
use crate::physics::plane::Plane;
use crate::step::error::Accuracy;
use crate::step::two_derivative::Here;

impl<V: Wide> Cells<V> {
    /// Current and stiffness where a step predicts its end.
    #[inline(always)]
    pub fn ahead(&self, begin: &Begin<'_, '_, V>, there: &Here<V>) -> Iron<V> {
        self.iron(&self.away_at(there.state.flux, Some(begin.change.flux * begin.h)))
    }

    /// Corrects the current, which the cells' tangent carried on from where the core was evaluated: a sliding cell turns all along the
    /// way. The elastic fluxes in Wb at the end, and the stiffness in 1/H that is part of Γ there.
    #[inline(always)]
    pub fn correct(
        &self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        iron: &Iron<V>,
        there: &mut Here<V>,
    ) -> (Elastic<V>, Symmetric<V>) {
        let (along, flux) = (begin.change.flux * begin.h, there.state.flux);
        let by_tangent = iron.current + (flux - looked.flux).through(iron.tangent);
        let turned = self.iron(&self.away_at(flux, Some(along))).current - by_tangent;
        there.at.current = there.at.current + turned;
        looked.settle(begin.legs, there);
        (self.away_at(there.state.flux, Some(along)), iron.tangent)
    }

    /// Their share of the step's error, relative to the tolerance; the core was evaluated `off` in Wb from the end.
    #[inline(always)]
    pub fn share_of_error(
        &self,
        begin: &Begin<'_, '_, V>,
        change: &Change<V>,
        off: Plane<V>,
        there: &Here<V>,
        accuracy: &Accuracy<V>,
    ) -> V {
        let rise = [begin.change.flux * begin.h, change.flux * begin.h];
        self.error(there.state.flux - begin.here.state.flux, rise, off) * accuracy.per_flux
    }
}
