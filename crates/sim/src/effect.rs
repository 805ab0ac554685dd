//! Effects: what a step is composed of. Each has its state, what it predicts, what it puts right and its share of the error.
//!
//! The scheme calls them in a fixed order and hands from one to the next what couples them. An effect is called by its type: all of
//! it becomes part of the step that is compiled for a width of registers, so that what the effect carries through a step stays in
//! registers.

pub mod eddies;
pub mod link;
pub mod rotor;

use standstill_numeric::{Symmetric, Wide};

use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::memory::{Iron, Memory};
use crate::physics::plane::Plane;
use crate::step::corrections::settle_by;
use crate::step::error::Accuracy;
use crate::step::two_derivative::Here;

/// What is known where a step begins.
#[derive(Clone, Copy)]
pub struct Begin<'s, 'a, V: Wide> {
    /// Its length in s.
    pub h: V,
    /// The machines.
    pub machine: &'s Machine<'a, V>,
    /// What their iron remembers, in code for iron that may.
    pub memory: Option<&'s Memory<V>>,
    /// What the legs are meanwhile.
    pub legs: &'s Conducting<V>,
    /// Where it begins.
    pub here: &'s Here<V>,
    /// How the machines change there.
    pub change: &'s Change<V>,
}

/// What was found where the core was evaluated.
#[derive(Clone, Copy)]
pub struct Looked<V: Wide> {
    /// The flux in Wb there and the current in A.
    pub flux: Plane<V>,
    /// See `flux`.
    pub current: Plane<V>,
    /// What the iron adds.
    pub iron: Option<Iron<V>>,
    /// Γ in 1/H.
    pub gamma: Symmetric<V>,
    /// What an impulse at the blocked leg's terminal changes the current by.
    pub across: Plane<V>,
    /// 1 over what it changes the leg's own current by.
    pub per_impulse: V,
    /// Whether any machine idles.
    pub any_idle: bool,
}

impl<V: Wide> Looked<V> {
    /// Where the core was just evaluated, with this iron.
    #[inline(always)]
    pub fn at(there: &Here<V>, iron: Option<Iron<V>>, legs: &Conducting<V>) -> Self {
        let (terminals, gamma) = (&legs.terminals, there.at.inverse_inductance);
        let across = terminals.blocked.through(gamma);
        let per_impulse = V::of(1.0) / (across.dot(terminals.blocked) + terminals.none_blocked);
        let any_idle = V::any(legs.idle);
        Self { flux: there.state.flux, current: there.at.current, iron, gamma, across, per_impulse, any_idle }
    }

    /// Takes blocked legs' currents to zero.
    #[inline(always)]
    pub fn settle(&self, legs: &Conducting<V>, there: &mut Here<V>) {
        settle_by(legs, &self.across, self.per_impulse, self.any_idle, &mut there.state.flux, &mut there.at);
    }

    /// A flux in Wb without what a blocked leg's terminal would take.
    #[inline(always)]
    pub fn held(&self, legs: &Conducting<V>, flux: Plane<V>) -> Plane<V> {
        flux - legs.terminals.blocked * (self.across.dot(flux) * self.per_impulse)
    }

    /// What of flux and current makes the torque: the stator's iron has no part in it.
    #[inline(always)]
    pub fn core(&self, flux: Plane<V>, current: Plane<V>) -> [Plane<V>; 2] {
        match &self.iron {
            Some(iron) => [flux, iron.core(current, flux - self.flux)],
            None => [flux, current],
        }
    }
}

/// A part of the machines with a state of its own. Its methods must be `#[inline(always)]`.
pub trait Effect<V: Wide> {
    /// What it carries through a step.
    type Step;

    /// Puts its state at the end of the step as it is predicted into `there`.
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> Self::Step;

    /// Puts its state right where currents are known and change so.
    fn correct(
        &self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        change: &Change<V>,
        there: &mut Here<V>,
        step: &mut Self::Step,
    );

    /// What the step may be off by it, relative to the tolerance.
    fn error(&self, step: &Self::Step, accuracy: &Accuracy<V>) -> V;
}

/// An effect that machines of a kind may be without: it then has no part in a step.
impl<V: Wide, E: Effect<V>> Effect<V> for Option<&E> {
    type Step = Option<E::Step>;

    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> Self::Step {
        match self {
            Some(effect) => Some(effect.predict(begin, there)),
            None => None,
        }
    }

    #[inline(always)]
    fn correct(
        &self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        change: &Change<V>,
        there: &mut Here<V>,
        step: &mut Self::Step,
    ) {
        if let (Some(effect), Some(step)) = (self, step) {
            effect.correct(begin, looked, change, there, step);
        }
    }

    #[inline(always)]
    fn error(&self, step: &Self::Step, accuracy: &Accuracy<V>) -> V {
        match (self, step) {
            (Some(effect), Some(step)) => effect.error(step, accuracy),
            _ => V::of(0.0),
        }
    }
}
