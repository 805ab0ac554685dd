//! Eddy currents within a step: the flux that lags behind by them.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Wide};
use standstill_plant::Eddies;

use super::{Begin, Effect, Looked};
use crate::physics::machine::Change;
use crate::physics::plane::Plane;
use crate::step::corrections::{RotorFlux, lag_behind};
use crate::step::error::{Accuracy, relaxing_error};
use crate::step::two_derivative::Here;

/// Eddy currents over a step.
#[derive(Clone, Copy)]
pub struct EddyStep<V> {
    from: RotorFlux<V>,
    /// What the flux may be off, in Wb.
    off: V,
}

impl<V: Wide> Effect<V> for Eddies<V> {
    type Step = EddyStep<V>;

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
    fn correct(
        &self,
        begin: &Begin<'_, '_, V>,
        _: &Looked<V>,
        change: &Change<V>,
        there: &mut Here<V>,
        step: &mut EddyStep<V>,
    ) {
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
}
