//! Effects: the parts of the machines that have a state or a law of their own. Each has one home here.
//!
//! | effect | state | file |
//! |---|---|---|
//! | winding | flux ψ, by quadrature of the drop | `winding.rs` |
//! | rotor | angle and speed | `rotor.rs` |
//! | DC link | voltage of the capacitor | `link.rs` |
//! | eddy currents | flux χ that lags behind | `eddies.rs` |
//! | hysteresis | elastic flux of each play cell | `play.rs` |
//! | terminals with a capacitance | potentials | `terminals.rs` |
//!
//! A step (`step/two_derivative.rs`) calls them in a fixed order and hands from one to the next what couples them. An effect is
//! called by its type, and all its methods are `#[inline(always)]`: only then is it part of the step that is compiled for a width
//! of registers. Bank, ledger, start at rest and the referee's slopes call all of them by the list `each_effect!` and name none.
//!
//! Hysteresis is a branch beside the core ([`CoreBranch`]): code outside of its files knows it as [`Branch`] alone.

mod context;
pub mod eddies;
pub mod link;
pub mod play;
pub mod rotor;
pub mod terminals;
pub mod winding;

use standstill_interface::Dq;
use standstill_numeric::{Symmetric, Wide};
use standstill_plant::{MOST_CELLS, Motor};

pub use self::context::{Begin, End, Looked, Moment, Span, keep, keep_dq, keep_plane, keep_symmetric};
use crate::case::{Case, RunError};
use crate::lanes::mode_ends::First;
use crate::ledger::Ledger;
use crate::physics::legs::Conducting;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::two_derivative::Here;

/// The branch beside the core, in the stator's frame: it meets the winding's flux, and its current adds to the core's.
pub type Branch<V> = play::Cells<V>;

/// The branch over a step.
pub type BranchStep<V> = <Branch<V> as Effect<V>>::Step;

/// State of the branch, which [`State`] does not have: fluxes in Wb.
pub type BranchState<V> = [Plane<V>; MOST_CELLS];

/// The branch at one flux.
#[derive(Clone, Copy, Debug, Default)]
pub struct BranchPoint<V> {
    /// Its current in A.
    pub current: Plane<V>,
    /// How that rises with the flux: its part of Γ, in 1/H.
    pub stiffness: Symmetric<V>,
    /// Its elastic fluxes.
    pub elastic: BranchState<V>,
}

impl<V: Wide> BranchPoint<V> {
    /// Its current in A after a small change of the flux in Wb.
    #[inline(always)]
    pub fn current_after(&self, change: Plane<V>) -> Plane<V> {
        self.current + change.through(self.stiffness)
    }
}

/// Carries something out for each effect of machines, in the order of a step; `$branch`: their branch, if there is one.
macro_rules! each_effect {
    ($machine:expr, $branch:expr, $effect:ident => $do:expr) => {{
        let machine = $machine;
        let (rotors, eddies) = (machine.rotors.as_ref(), machine.circuits.eddies());
        let winding = $crate::effect::winding::Winding;
        each_effect!(@ $effect => $do; rotors, machine.links, winding, eddies, machine.legs, $branch);
    }};
    (@ $effect:ident => $do:expr; $($each:expr),*) => {$({
        let $effect = &$each;
        $do;
    })*};
}
pub(crate) use each_effect;

/// A part of the machines with a state or a law of its own. Its methods for several machines must be `#[inline(always)]`.
pub trait Effect<V: Wide> {
    /// Numbers that it carries through a step.
    type Step: Copy + Default;

    /// Writes its state of a case at rest, with this flux in Wb in the rotor's plane, into a lane.
    fn rest(&self, _lane: usize, _case: &Case<'_>, _flux: Dq<f64>, _state: &mut State<V>) {}

    /// Writes its predicted state at the end of the step into `there`.
    #[inline(always)]
    fn predict(&self, _begin: &Begin<'_, '_, V>, _there: &mut Here<V>) -> Self::Step {
        Self::Step::default()
    }

    /// Corrects its state, now that currents and their slopes at the end are known.
    #[inline(always)]
    fn correct(&self, _end: &End<'_, '_, V>, _there: &mut Here<V>, _step: &mut Self::Step) {}

    /// Its share of the step's error, relative to the tolerance.
    #[inline(always)]
    fn error(&self, _step: &Self::Step, _accuracy: &Accuracy<V>) -> V {
        V::of(0.0)
    }

    /// Its numbers of a step from one place to another that is known: the referee's.
    #[inline(always)]
    fn between(&self, _end: &End<'_, '_, V>, _there: &Here<V>) -> Self::Step {
        Self::Step::default()
    }

    /// Adds the slope of its state, per second, for the referee.
    #[inline(always)]
    fn slope(&self, _legs: &Conducting<V>, _here: &Here<V>, _slope: &mut State<V>) {}

    /// Writes its state within a step into `there`.
    #[inline(always)]
    fn within(&self, _span: &Span<'_, '_, V>, _there: &mut Here<V>) {}

    /// Copies its numbers of some machines from one place to another.
    #[inline(always)]
    fn keep(&self, _of: V::Mask, _from: &Here<V>, _to: &mut Here<V>) {}

    /// Adds the energy in J that it stores to the accounts of changes.
    fn energy(&self, _moment: &Moment<'_, '_, V>, _stored: &mut Ledger) {}

    /// Adds its powers in W at a place within a step.
    fn power(&self, _moment: &Moment<'_, '_, V>, _span: &Span<'_, '_, V>, _powers: &mut Ledger) {}

    /// Adds energies in J that a whole step moved at once.
    fn work(&self, _moment: &Moment<'_, '_, V>, _span: &Span<'_, '_, V>, _spent: &mut Ledger) {}
}

/// A branch beside the core ([`Branch`]): what steps and control ask of it.
pub trait CoreBranch<V: Wide>: Effect<V> + Sized {
    /// For machines of this motor's kind; none where they have no such branch.
    fn like(_motor: &Motor) -> Option<Self> {
        None
    }

    /// Puts a case into a lane; `flux`: in Wb without current, in the rotor's plane, to which its own current adds. Whether that makes a
    /// torque.
    ///
    /// # Errors
    /// No flux holds the current that it is left with.
    fn start(&mut self, _lane: usize, _case: &Case<'_>, _flux: &mut Dq<f64>) -> Result<bool, RunError> {
        Ok(false)
    }

    /// Finds the modes in which some machines begin a step at a flux in Wb: the flux's rise in V follows from the stiffness in 1/H that
    /// is the branch's part of Γ.
    #[inline(always)]
    fn find_modes(&mut self, _: V::Mask, _: Plane<V>, _: impl FnMut(Symmetric<V>) -> Plane<V>) {}

    /// The branch at a flux in Wb, on a way that began in the direction of `along`.
    #[inline(always)]
    fn at(&self, _flux: Plane<V>, _along: Option<Plane<V>>) -> BranchPoint<V> {
        BranchPoint::default()
    }

    /// Its part of the Γ in 1/H that is known of where the machines are.
    #[inline(always)]
    fn stiffness(&self) -> Symmetric<V> {
        Symmetric::default()
    }

    /// Γ was evaluated anew for some machines with this part in 1/H.
    #[inline(always)]
    fn set_stiffness(&mut self, _of: V::Mask, _stiffness: Symmetric<V>) {}

    /// Makes the end of a step, at a flux in Wb, the place of those that took it.
    #[inline(always)]
    fn take(&mut self, _of: V::Mask, _flux: Plane<V>, _step: &Self::Step) {}

    /// The least room of its modes within a step and at its end, in Wb with their slack: negative where one ended.
    #[inline(always)]
    fn room(&self, _step: &Self::Step) -> [V; 2] {
        [V::of(f64::INFINITY); 2]
    }

    /// Its modes that end within the step of a lane.
    fn ends(&self, _step: &Self::Step, _lane: usize, _first: &mut First) {}

    /// The branch at a flux in Wb, where fluxes are pinned so.
    fn pinned_at(&self, _flux: Plane<V>, _pinned: &BranchState<V>) -> BranchPoint<V> {
        BranchPoint::default()
    }

    /// How what is pinned moves, in V, where the flux rises so.
    fn pinned_rise(&self, _at: &BranchPoint<V>, _rise: Plane<V>) -> BranchState<V> {
        BranchState::default()
    }
}

/// Methods of an effect that machines of a kind may lack: none where it is not there.
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

/// An effect that machines of a kind may lack: it then has no part in a step.
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
