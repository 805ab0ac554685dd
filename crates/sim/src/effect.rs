//! Effects: the parts of the machines that have their own state variables or their own equations, one file each.
//!
//! | effect | state | file |
//! |---|---|---|
//! | winding | flux ψ | `winding.rs` |
//! | rotor | angle and speed | `rotor.rs` |
//! | DC link | voltage of the capacitor | `link.rs` |
//! | eddy currents | flux χ, which follows ψ with a lag | `eddies.rs` |
//! | shorted turns | flux χ along the phase's axis, which follows ψ with a lag | `shorted.rs` |
//! | hysteresis | elastic flux ψ − π of each play cell, with its pinned flux π | `play.rs` |
//! | terminals with a capacitance | potentials | `terminals.rs` |
//!
//! A step (`step/two_derivative.rs`) calls the effects in a fixed order and passes the quantities that couple them from
//! one to the next. It calls each effect by its concrete type, and all methods of an effect are `#[inline(always)]`: only
//! then are they compiled together with the step for wide registers. Bank, ledger, initial state at rest and the
//! referee's slopes do not name single effects but go through the list `each_effect!`.
//!
//! Hysteresis is a branch in parallel to the core: both have the same flux, and their currents add. Code outside the
//! files of the play cells uses this branch by the name [`Branch`].

mod context;
pub mod eddies;
pub mod link;
pub mod play;
pub mod rotor;
pub mod shorted;
pub mod terminals;
pub mod winding;

use standstill_interface::Dq;
use standstill_numeric::{Symmetric, Wide};
use standstill_plant::MOST_CELLS;

pub use self::context::{Begin, End, Looked, Moment, Span, keep, keep_dq, keep_plane, keep_symmetric};
use crate::case::Case;
use crate::ledger::Ledger;
use crate::physics::legs::Conducting;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::two_derivative::Here;

/// The play cells of hysteresis as a branch in parallel to the core, in the stator's frame. Branch and core have the winding's
/// flux, and their currents add.
pub type Branch<V> = play::Cells<V>;

/// Quantities of the parallel branch of play cells over a step.
pub type BranchStep<V> = <Branch<V> as Effect<V>>::Step;

/// State of the parallel branch, which [`State`] does not contain: one flux in Wb for each play cell.
pub type BranchState<V> = [Plane<V>; MOST_CELLS];

/// The parallel branch of play cells at one flux of the winding.
#[derive(Clone, Copy, Debug, Default)]
pub struct BranchPoint<V> {
    /// The branch's current in A.
    pub current: Plane<V>,
    /// Derivative of the branch's current by the flux, in 1/H: the branch's contribution to the inverse inductance Γ.
    pub stiffness: Symmetric<V>,
    /// Elastic flux of each play cell in Wb: the flux less the flux that the cell pins.
    pub elastic: BranchState<V>,
}

impl<V: Wide> BranchPoint<V> {
    /// Returns the branch's current in A after a small change of the flux in Wb.
    #[inline(always)]
    pub fn current_after(&self, change: Plane<V>) -> Plane<V> {
        self.current + change.through(self.stiffness)
    }
}

/// Evaluates an expression for each effect of the machines, in the order of a step. `$branch` is the machines' optional
/// parallel branch.
macro_rules! each_effect {
    ($machine:expr, $branch:expr, $effect:ident => $do:expr) => {{
        let machine = $machine;
        let (rotors, eddies, shorted) =
            (machine.rotors.as_ref(), machine.circuits.eddies(), machine.shorted.as_ref());
        let winding = $crate::effect::winding::Winding;
        each_effect!(@ $effect => $do; rotors, machine.links, winding, eddies, shorted, machine.legs, $branch);
    }};
    (@ $effect:ident => $do:expr; $($each:expr),*) => {$({
        let $effect = &$each;
        $do;
    })*};
}
pub(crate) use each_effect;

/// A part of the machines with its own state variables or its own equations. Methods that compute all lanes at once must
/// be `#[inline(always)]`.
pub trait Effect<V: Wide> {
    /// Quantities of the effect over one step.
    type Step: Copy + Default;

    /// Writes the effect's initial state for a case at rest into a lane of `state`. `flux` is the flux linkage in Wb in the rotor's plane.
    fn rest(&self, _lane: usize, _case: &Case<'_>, _flux: Dq<f64>, _state: &mut State<V>) {}

    /// Writes the effect's predicted state at the end of the step into `there`.
    #[inline(always)]
    fn predict(&self, _begin: &Begin<'_, '_, V>, _there: &mut Here<V>) -> Self::Step {
        Self::Step::default()
    }

    /// Corrects the effect's state at the end of the step, once currents and their slopes there are known.
    #[inline(always)]
    fn correct(&self, _end: &End<'_, '_, V>, _there: &mut Here<V>, _step: &mut Self::Step) {}

    /// Returns the effect's contribution to the step's error, relative to the tolerance.
    #[inline(always)]
    fn error(&self, _step: &Self::Step, _accuracy: &Accuracy<V>) -> V {
        V::of(0.0)
    }

    /// Returns the effect's quantities of a step if both ends are known. The referee's steps need these quantities.
    #[inline(always)]
    fn between(&self, _end: &End<'_, '_, V>, _there: &Here<V>) -> Self::Step {
        Self::Step::default()
    }

    /// Adds the time derivative of the effect's state variables, per second, to `slope`, for the referee.
    #[inline(always)]
    fn slope(&self, _legs: &Conducting<V>, _here: &Here<V>, _slope: &mut State<V>) {}

    /// Writes the effect's state at a point within a step into `there`.
    #[inline(always)]
    fn within(&self, _span: &Span<'_, '_, V>, _there: &mut Here<V>) {}

    /// Returns whether the effect leaves a machine as it is in which no current flows and the rotor does not move.
    fn is_still(&self) -> bool {
        true
    }

    /// Copies the effect's numbers of the selected machines from one state to another.
    #[inline(always)]
    fn keep(&self, _of: V::Mask, _from: &Here<V>, _to: &mut Here<V>) {}

    /// Adds the energy in J that the effect stores to the energy balance.
    fn energy(&self, _moment: &Moment<'_, '_, V>, _stored: &mut Ledger) {}

    /// Adds the effect's powers in W at a point within a step to the accounts of the energy balance.
    fn power(&self, _moment: &Moment<'_, '_, V>, _span: &Span<'_, '_, V>, _powers: &mut Ledger) {}

    /// Adds energies in J that the effect transfers over a whole step and that are not integrals of its powers.
    fn work(&self, _moment: &Moment<'_, '_, V>, _span: &Span<'_, '_, V>, _spent: &mut Ledger) {}
}

/// Implements methods of an optional effect, which do nothing in machines without the effect.
macro_rules! where_there {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {$(
        #[inline(always)]
        fn $name(&self, $($argument: $type),*) {
            if let Some(effect) = self {
                effect.$name($($argument),*);
            }
        }
    )*};
}

/// An optional effect. Machines without the effect skip this part of the step.
impl<V: Wide, E: Effect<V>> Effect<V> for Option<&E> {
    type Step = Option<E::Step>;

    where_there! {
        rest(lane: usize, case: &Case<'_>, flux: Dq<f64>, state: &mut State<V>);
        slope(legs: &Conducting<V>, here: &Here<V>, slope: &mut State<V>);
        within(span: &Span<'_, '_, V>, there: &mut Here<V>);
        keep(of: V::Mask, from: &Here<V>, to: &mut Here<V>);
        energy(moment: &Moment<'_, '_, V>, stored: &mut Ledger);
        power(moment: &Moment<'_, '_, V>, span: &Span<'_, '_, V>, powers: &mut Ledger);
        work(moment: &Moment<'_, '_, V>, span: &Span<'_, '_, V>, spent: &mut Ledger);
    }

    fn is_still(&self) -> bool {
        self.is_none_or(Effect::is_still)
    }

    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> Self::Step {
        some!(self, effect => effect.predict(begin, there))
    }

    #[inline(always)]
    fn correct(&self, end: &End<'_, '_, V>, there: &mut Here<V>, step: &mut Self::Step) {
        if let (Some(effect), Some(step)) = (self, step) {
            effect.correct(end, there, step);
        }
    }

    #[inline(always)]
    fn error(&self, step: &Self::Step, accuracy: &Accuracy<V>) -> V {
        match (self, step) {
            (Some(effect), Some(step)) => effect.error(step, accuracy),
            _ => V::of(0.0),
        }
    }

    #[inline(always)]
    fn between(&self, end: &End<'_, '_, V>, there: &Here<V>) -> Self::Step {
        some!(self, effect => effect.between(end, there))
    }
}
