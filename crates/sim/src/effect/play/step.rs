//! Play cells as an effect in a step: a branch in parallel to the core.

use standstill_interface::Dq;
use standstill_inverter::Conduction;
use standstill_numeric::{Heading, Symmetric, Wide};
use standstill_plant::{MOST_CELLS, Motor, NoConvergence};

use super::{Cells, DEEP, Moved, ROUNDED, ROUNDS, direction};
use crate::case::{Case, Place, RunError};
use crate::effect::{Begin, BranchPoint, BranchState, Effect, End, Moment, Span, keep_plane, keep_symmetric};
use crate::guard::{First, Guard};
use crate::ledger::Ledger;
use crate::physics::plane::Plane;
use crate::step::error::Accuracy;
use crate::step::two_derivative::Here;

impl<V: Wide> Effect<V> for Cells<V> {
    type Step = Moved<V>;

    #[inline(always)]
    fn predict(&self, _: &Begin<'_, '_, V>, _: &mut Here<V>) -> Moved<V> {
        self.blank()
    }

    /// Corrects the current at the end. It was extrapolated with the cells' stiffness from the point at which the core was
    /// evaluated, but the elastic flux of a sliding cell turns along the whole path.
    #[inline(always)]
    fn correct(&self, end: &End<'_, '_, V>, there: &mut Here<V>, moved: &mut Moved<V>) {
        let (begin, looked) = (end.begin, end.looked);
        let Some(point) = &looked.branch else { return };
        let (along, flux) = (begin.change.flux * begin.h, there.state.flux);
        let by_stiffness = point.current_after(flux - looked.flux);
        let turned = self.at(flux, Some(along)).current - by_stiffness;
        there.at.current = there.at.current + turned;
        looked.settle(begin.legs, there);
        let elastic = self.away_at(there.state.flux, Some(along));
        *moved = self.moved_by(end, point, there, elastic);
    }

    #[inline(always)]
    fn error(&self, moved: &Moved<V>, accuracy: &Accuracy<V>) -> V {
        moved.off * accuracy.per_flux
    }

    fn between(&self, end: &End<'_, '_, V>, there: &Here<V>) -> Moved<V> {
        let Some(point) = &end.looked.branch else { return self.blank() };
        self.moved_by(end, point, there, point.elastic)
    }

    fn energy(&self, moment: &Moment<'_, '_, V>, stored: &mut Ledger) {
        stored.field_change += 1.5 * self.energy(moment.lane, moment.here.state.flux);
    }

    fn power(&self, moment: &Moment<'_, '_, V>, span: &Span<'_, '_, V>, powers: &mut Ledger) {
        let [x, y] = span.flux().map(|cubic| cubic.rise(span.share) / span.step.h);
        let along = span.step.change[0].flux * span.step.h * span.share;
        let elastic = self.away_at(moment.here.state.flux, Some(along));
        powers.hysteresis_loss += 1.5 * self.loss(moment.lane, &elastic, Plane::new(x, y));
    }
}

/// The interface of the parallel branch for steps and control.
impl<V: Wide> Cells<V> {
    /// Makes empty cells for machines like this motor; none if the motor has no hysteresis.
    pub fn like(motor: &Motor) -> Option<Self> {
        motor.magnetics.cells().map(|_| Self::idle())
    }

    /// Puts the cells of a case into a lane. `flux` is the flux in Wb without current, in the rotor's plane; it is replaced by the
    /// flux at which the remanence's current and the core's add to zero. Returns whether there is such a remanence, so that the
    /// core's current makes a torque.
    ///
    /// # Errors
    /// No flux balances the current of the iron's remanence.
    pub fn start(&mut self, lane: usize, case: &Case<'_>, flux: &mut Dq<f64>) -> Result<bool, RunError> {
        let magnetics = &case.motor.magnetics;
        let Some((hysteresis, cells)) = magnetics.hysteresis().zip(magnetics.cells()) else {
            return Ok(false);
        };
        let last = case.memory.map(|last| Heading::of(last - case.start_angle));
        let mut found = Ok(last.is_some());
        if let Some(last) = last {
            // The terminals' current is zero: the core's current is opposite to the current of the remanence.
            let left = Dq::new(last.cos, last.sin) * -hysteresis.coercive_current;
            match magnetics.flux_at(left, Heading::of(case.start_angle)) {
                Ok(at) => *flux = at,
                Err(error) => found = Err(without_a_state(&error)),
            }
        }
        let inductance = magnetics.inductance();
        let most = inductance.xx + inductance.yy - inductance.smaller_eigenvalue();
        let last = last.map(|last| Plane::new(last.cos, last.sin));
        self.put(lane, cells, Plane::new(flux.d, flux.q), most, case.tolerance.flux, last);
        found
    }

    /// Finds whether each cell of the selected machines slides or is stuck at the beginning of a step, at a flux in Wb.
    /// The closure computes the slope of the flux in V from the stiffness in 1/H that the branch adds to Γ.
    #[inline(always)]
    pub fn find_modes(
        &mut self,
        of: V::Mask,
        flux: Plane<V>,
        mut rise: impl FnMut(Symmetric<V>) -> Plane<V>,
    ) {
        // A cell at its reach slides if the flux moves it outwards. A cell that has just stopped exceeds its reach by rounding only;
        // without a tolerance it would begin and cease to slide over and over.
        let zero = V::of(0.0);
        let away = self.away_at(flux, None);
        let mut slides = self.slides;
        for _ in 0..ROUNDS {
            let rise = rise(self.tangent_of(&away, &slides));
            for k in 0..MOST_CELLS {
                let beyond = away[k].dot(away[k]).above(self.reach[k] * self.reach[k] * (1.0 + ROUNDED));
                slides[k] = (self.slides[k] | beyond) & away[k].dot(rise).above(zero);
            }
        }
        self.set_stiffness(of, self.tangent_of(&away, &slides));
        for k in 0..MOST_CELLS {
            self.slides[k] = (slides[k] & of) | (self.slides[k] & !of);
        }
    }

    /// Returns current and stiffness of the branch at a flux in Wb. `along` is the initial tangent of the flux path, none for a straight
    /// path.
    #[inline(always)]
    pub fn at(&self, flux: Plane<V>, along: Option<Plane<V>>) -> BranchPoint<V> {
        self.point(self.away_at(flux, along))
    }

    /// Returns the stiffness in 1/H that the branch adds to Γ, as last evaluated at the machines' present state.
    #[inline(always)]
    pub fn stiffness(&self) -> Symmetric<V> {
        self.tangent
    }

    /// Notes the stiffness in 1/H that the branch adds to Γ, for the selected machines, after a new evaluation of Γ.
    #[inline(always)]
    pub fn set_stiffness(&mut self, of: V::Mask, stiffness: Symmetric<V>) {
        keep_symmetric(of, stiffness, &mut self.tangent);
    }

    /// Sets the state of the selected machines to the end of a step. `flux` is the flux there in Wb.
    #[inline(always)]
    pub fn take(&mut self, of: V::Mask, flux: Plane<V>, moved: &Moved<V>) {
        keep_plane(of, flux, &mut self.from);
        for k in 0..MOST_CELLS {
            keep_plane(of, moved.away[k], &mut self.away[k]);
            self.slides[k] = (moved.slides[k] & of) | (self.slides[k] & !of);
        }
        self.set_stiffness(of, moved.tangent);
    }

    /// Returns the smallest margin of the cells in a step, in Wb, plus a tolerance; negative if a cell's mode ended. The first value has
    /// the tolerance of ordinary steps, the second that of steps that were cut to end at the end of a mode.
    #[inline(always)]
    pub fn room(&self, moved: &Moved<V>) -> [V; 2] {
        let least = moved.margin[0].least(moved.margin[1]).least(moved.margin[2]);
        [least + self.slack, least + self.slack * DEEP]
    }

    /// Replaces `first`, the mode that ends first in the step of a lane, if the mode of a cell ends earlier.
    pub fn ends(&self, moved: &Moved<V>, lane: usize, first: &mut First) {
        for k in (0..MOST_CELLS).filter(|k| moved.margin[*k].get(lane) < -self.slack.get(lane)) {
            first.ends(Guard::Branch, moved.cubic[k].get(lane), moved.slack[k].get(lane));
        }
    }

    /// Returns current and stiffness of the branch at the flux ψ in Wb if its cells have these pinned fluxes π in Wb: each cell's elastic
    /// flux is ψ − π. The referee integrates π itself; [`Self::at`] follows it from the path of ψ.
    pub fn pinned_at(&self, flux: Plane<V>, pinned: &BranchState<V>) -> BranchPoint<V> {
        self.point(pinned.map(|pinned| flux - pinned))
    }

    /// Returns the time derivatives of the pinned fluxes π in V, for this time derivative of the flux in V.
    pub fn pinned_rise(&self, at: &BranchPoint<V>, rise: Plane<V>) -> BranchState<V> {
        std::array::from_fn(|k| {
            let n = direction(&at.elastic[k]);
            Plane::choose(self.slides[k], n * n.dot(rise), Plane::default())
        })
    }

    /// Returns the result of [`Self::moved`] for a step between two ends. `elastic` contains the elastic fluxes in Wb at the end.
    #[inline(always)]
    fn moved_by(
        &self,
        end: &End<'_, '_, V>,
        point: &BranchPoint<V>,
        there: &Here<V>,
        elastic: BranchState<V>,
    ) -> Moved<V> {
        let (begin, flux) = (end.begin, there.state.flux);
        let rise = [begin.change.flux * begin.h, end.change.flux * begin.h];
        let (change, off) = (flux - begin.here.state.flux, flux - end.looked.flux);
        self.moved((elastic, point.stiffness), change, rise, off)
    }

    /// Returns the cells' stored energy divided by 3/2, in J.
    pub(super) fn energy(&self, lane: usize, flux: Plane<V>) -> f64 {
        let elastic = self.away_at(flux, None);
        let energy = |k: usize| (self.stiffness[k] * elastic[k].dot(elastic[k])).get(lane) / 2.0;
        (0..MOST_CELLS).map(energy).sum()
    }

    /// Returns the cells' loss divided by 3/2, in W, for these elastic fluxes in Wb and this slope of the flux in V.
    pub(super) fn loss(&self, lane: usize, elastic: &BranchState<V>, rise: Plane<V>) -> f64 {
        let lost = |k: usize| V::only(self.slides[k], self.stiffness[k] * elastic[k].dot(rise)).get(lane);
        (0..MOST_CELLS).map(lost).sum()
    }
}

/// Converts the error of the search for a flux that balances the remanence into an error of the run.
fn without_a_state(error: &NoConvergence) -> RunError {
    match error.beyond {
        Some(_) => RunError::left_map([error.current.d, error.current.q]),
        None => RunError::NotFinite(Place::new(0.0, [Conduction::Blocked; 3], [f64::NAN; 3])),
    }
}
