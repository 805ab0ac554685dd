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
//! of registers.

pub mod eddies;
pub mod link;
pub mod play;
pub mod rotor;
pub mod terminals;
pub mod winding;

use standstill_interface::Dq;
use standstill_numeric::{Symmetric, Wide};

use crate::effect::play::{Cells, Iron};
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::{Here, Tried};

/// The beginning of a step.
#[derive(Clone, Copy)]
pub struct Begin<'s, 'a, V: Wide> {
    /// Length of the step in s.
    pub h: V,
    /// The machines.
    pub machine: &'s Machine<'a, V>,
    /// The play cells of their iron, in code for iron with hysteresis.
    pub cells: Option<&'s Cells<V>>,
    /// The legs during the step.
    pub legs: &'s Conducting<V>,
    /// State and operating point.
    pub here: &'s Here<V>,
    /// Slopes of flux and current.
    pub change: &'s Change<V>,
}

/// The place at which the core was evaluated, with the linear response there.
#[derive(Clone, Copy)]
pub struct Looked<V: Wide> {
    /// The flux in Wb.
    pub flux: Plane<V>,
    /// The current in A.
    pub current: Plane<V>,
    /// Current and stiffness of the play cells.
    pub iron: Option<Iron<V>>,
    /// Γ in 1/H.
    pub gamma: Symmetric<V>,
    /// Change of the current by an impulse at the blocked leg's terminal.
    across: Plane<V>,
    /// 1 over the change of the leg's own current by that impulse.
    per_impulse: V,
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

    /// Takes blocked legs' currents to zero, as an impulse at their terminals would.
    #[inline(always)]
    pub fn settle(&self, legs: &Conducting<V>, there: &mut Here<V>) {
        let (blocked, at) = (legs.terminals.blocked, &mut there.at);
        let share = blocked.dot(at.current) * self.per_impulse;
        let (mut impulse, mut change) = (blocked * share, self.across * share);
        if self.any_idle {
            let all = at.current.through(at.inverse_inductance.inverse());
            impulse = Plane::choose(legs.idle, all, impulse);
            change = Plane::choose(legs.idle, at.current, change);
        }
        there.state.flux = there.state.flux - impulse;
        at.current = at.current - change;
    }

    /// A flux in Wb without the impulse at a blocked leg's terminal.
    #[inline(always)]
    pub fn held(&self, legs: &Conducting<V>, flux: Plane<V>) -> Plane<V> {
        flux - legs.terminals.blocked * (self.across.dot(flux) * self.per_impulse)
    }

    /// Flux in Wb and current in A that make the torque: the stator's iron has no part in it.
    #[inline(always)]
    pub fn core(&self, flux: Plane<V>, current: Plane<V>) -> [Plane<V>; 2] {
        match &self.iron {
            Some(iron) => [flux, iron.core(current, flux - self.flux)],
            None => [flux, current],
        }
    }
}

/// A place within a step that was tried.
#[derive(Clone, Copy)]
pub struct Span<'s, 'a, V: Wide> {
    /// The machines.
    pub machine: &'s Machine<'a, V>,
    /// Where the step begins.
    pub from: &'s Here<V>,
    /// The step.
    pub step: &'s Tried<V>,
    /// Share of the step that has passed.
    pub share: V,
}

impl<V: Wide> Span<'_, '_, V> {
    /// The cubic over the step with these values at both ends and these slopes, per second.
    #[inline(always)]
    pub fn cubic(&self, value: [V; 2], rise: [V; 2]) -> Cubic<V> {
        Cubic { value, slope: [rise[0] * self.step.h, rise[1] * self.step.h] }
    }

    /// The cubics of the flux's components, in Wb.
    #[inline(always)]
    pub fn flux(&self) -> [Cubic<V>; 2] {
        let [from, to] = [self.from.state.flux, self.step.end.state.flux];
        let [first, last] = [self.step.change[0].flux, self.step.change[1].flux];
        [self.cubic([from.x, to.x], [first.x, last.x]), self.cubic([from.y, to.y], [first.y, last.y])]
    }
}

/// A part of the machines with a state of its own. Its methods must be `#[inline(always)]`.
pub trait Effect<V: Wide> {
    /// Numbers that it carries through a step.
    type Step;

    /// Writes its predicted state at the end of the step into `there`.
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> Self::Step;

    /// Corrects its state, now that currents and their slopes at the end are known.
    fn correct(
        &self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        change: &Change<V>,
        there: &mut Here<V>,
        step: &mut Self::Step,
    );

    /// Its share of the step's error, relative to the tolerance.
    fn error(&self, step: &Self::Step, accuracy: &Accuracy<V>) -> V;

    /// Writes its state within a step into `there`.
    fn within(&self, span: &Span<'_, '_, V>, there: &mut Here<V>);

    /// Adds the slope of its state, per second, for the referee.
    fn slope(&self, legs: &Conducting<V>, here: &Here<V>, slope: &mut State<V>);

    /// Copies its numbers of some machines from one place to another.
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>);
}

/// An effect that machines of a kind may lack: it then has no part in a step.
impl<V: Wide, E: Effect<V>> Effect<V> for Option<&E> {
    type Step = Option<E::Step>;

    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> Self::Step {
        some!(self, effect => effect.predict(begin, there))
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

    #[inline(always)]
    fn within(&self, span: &Span<'_, '_, V>, there: &mut Here<V>) {
        if let Some(effect) = self {
            effect.within(span, there);
        }
    }

    #[inline(always)]
    fn slope(&self, legs: &Conducting<V>, here: &Here<V>, slope: &mut State<V>) {
        if let Some(effect) = self {
            effect.slope(legs, here, slope);
        }
    }

    #[inline(always)]
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>) {
        if let Some(effect) = self {
            effect.keep(of, from, to);
        }
    }
}

/// Copies numbers of some machines.
#[inline(always)]
pub fn keep<V: Wide>(of: V::Mask, from: V, to: &mut V) {
    *to = V::choose(of, from, *to);
}

/// Copies vectors of some machines.
#[inline(always)]
pub fn keep_plane<V: Wide>(of: V::Mask, from: Plane<V>, to: &mut Plane<V>) {
    *to = Plane::choose(of, from, *to);
}

/// Copies vectors in the rotor's plane of some machines.
#[inline(always)]
pub fn keep_dq<V: Wide>(of: V::Mask, from: Dq<V>, to: &mut Dq<V>) {
    keep(of, from.d, &mut to.d);
    keep(of, from.q, &mut to.q);
}
