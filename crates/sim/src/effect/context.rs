//! Arguments of the effects' methods: the ends of a step, a point within a step, one machine at one time. Also functions
//! that copy the values of selected lanes.

use standstill_interface::Dq;
use standstill_numeric::{Symmetric, Wide};

use super::shorted::{ShortPoint, Shorted};
use super::{Branch, BranchPoint, Effect, each_effect};
use crate::case::Case;
use crate::ledger::Ledger;
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::motion::Motion;
use crate::physics::plane::Plane;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::{Here, Tried};

/// The beginning of a step, with the quantities that are constant over the step.
#[derive(Clone, Copy)]
pub struct Begin<'s, 'a, V: Wide> {
    /// Length of the step in s.
    pub h: V,
    /// The machines.
    pub machine: &'s Machine<'a, V>,
    /// The parallel branch of the play cells; none in code for machines without hysteresis.
    pub branch: Option<&'s Branch<V>>,
    /// Shorted turns; none in code for machines without them.
    pub short: Option<&'s Shorted<V>>,
    /// The conducting legs during the step.
    pub legs: &'s Conducting<V>,
    /// State and operating point at the beginning.
    pub here: &'s Here<V>,
    /// Slopes of flux and current at the beginning.
    pub change: &'s Change<V>,
}

/// The end of a step, after the core was evaluated there.
#[derive(Clone, Copy)]
pub struct End<'s, 'a, V: Wide> {
    /// The beginning of the step.
    pub begin: &'s Begin<'s, 'a, V>,
    /// The point at which the core was evaluated.
    pub looked: &'s Looked<V>,
    /// Slopes of flux and current at the end.
    pub change: &'s Change<V>,
}

/// The point (flux) at which the core was evaluated near the end of a step, and the linear response of the currents around it.
#[derive(Clone, Copy)]
pub struct Looked<V: Wide> {
    /// Flux in Wb at which the core was evaluated.
    pub flux: Plane<V>,
    /// Current in A at that flux.
    pub current: Plane<V>,
    /// The parallel branch at that flux.
    pub branch: Option<BranchPoint<V>>,
    /// The branch of shorted turns at that flux.
    pub short: Option<ShortPoint<V>>,
    /// Inverse incremental inductance Γ in 1/H at that flux.
    pub gamma: Symmetric<V>,
    /// Change of the current vector in A per V·s of a voltage impulse at the blocked leg's terminal.
    across: Plane<V>,
    /// Reciprocal of the change of the blocked leg's own current per V·s of that impulse.
    per_impulse: V,
    /// True if at least one machine has no leg that carries current.
    pub any_idle: bool,
}

impl<V: Wide> Looked<V> {
    /// Records the point `there` of the last evaluation of the core. `branch` is the parallel branch of the play cells at this point.
    #[inline(always)]
    pub fn at(
        there: &Here<V>,
        branch: Option<BranchPoint<V>>,
        short: Option<&Shorted<V>>,
        legs: &Conducting<V>,
    ) -> Self {
        let (terminals, gamma) = (&legs.terminals, there.at.inverse_inductance);
        let across = terminals.blocked.through(gamma);
        let per_impulse = V::of(1.0) / (across.dot(terminals.blocked) + terminals.none_blocked);
        let any_idle = V::any(legs.idle);
        Self {
            flux: there.state.flux,
            current: there.at.current,
            branch,
            short: some!(short, short => short.point(&there.state)),
            gamma,
            across,
            per_impulse,
            any_idle,
        }
    }

    /// Sets the currents of blocked legs to zero, and changes the flux as a voltage impulse at their terminals would.
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

    /// Returns the flux in Wb that [`Self::settle`] adds in response when another effect reduces the current by `change` in A.
    #[inline(always)]
    pub fn follows(&self, legs: &Conducting<V>, change: Plane<V>) -> Plane<V> {
        let blocked = legs.terminals.blocked;
        let one = blocked * (blocked.dot(change) * self.per_impulse);
        if !self.any_idle {
            return one;
        }
        Plane::choose(legs.idle, change.through(self.gamma.inverse()), one)
    }

    /// Returns a change of flux in Wb plus the impulse at the blocked leg's terminal that keeps this leg's current unchanged.
    #[inline(always)]
    pub fn held(&self, legs: &Conducting<V>, flux: Plane<V>) -> Plane<V> {
        flux - legs.terminals.blocked * (self.across.dot(flux) * self.per_impulse)
    }

    /// Returns the flux in Wb and the current in A that make the torque: those of the core, so that the currents of the parallel branches
    /// are subtracted. `lagging` is the flux χ of shorted turns in Wb.
    #[inline(always)]
    pub fn core(&self, flux: Plane<V>, mut current: Plane<V>, lagging: V) -> [Plane<V>; 2] {
        if let Some(short) = &self.short {
            current = short.core(flux, current, lagging);
        }
        match &self.branch {
            Some(branch) => [flux, current - branch.current - (flux - self.flux).through(branch.stiffness)],
            None => [flux, current],
        }
    }

    /// Returns the flux χ of shorted turns in Wb at which the core was evaluated; `there` without shorted turns.
    #[inline(always)]
    fn lagging(&self, there: V) -> V {
        match &self.short {
            Some(short) => short.lagging,
            None => there,
        }
    }

    /// Returns the result of [`Self::core`] twice: for this flux and current before the corrections of a step, and for those of `there`.
    #[inline(always)]
    pub fn cores(&self, [flux, current]: [Plane<V>; 2], there: &Here<V>) -> [[Plane<V>; 2]; 2] {
        let (state, lagging) = (&there.state, self.lagging(there.state.shorted));
        [self.core(flux, current, lagging), self.core(state.flux, there.at.current, state.shorted)]
    }
}

/// A point in time within an attempted step.
#[derive(Clone, Copy)]
pub struct Span<'s, 'a, V: Wide> {
    /// The machines.
    pub machine: &'s Machine<'a, V>,
    /// The parallel branch of the play cells at the beginning of the step.
    pub branch: Option<&'s Branch<V>>,
    /// State and operating point at the beginning of the step.
    pub from: &'s Here<V>,
    /// The attempted step.
    pub step: &'s Tried<V>,
    /// Share of the step that has passed.
    pub share: V,
}

impl<V: Wide> Span<'_, '_, V> {
    /// Returns the cubic over the step with these values and these slopes, per second, at the beginning and at the end.
    #[inline(always)]
    pub fn cubic(&self, value: [V; 2], rise: [V; 2]) -> Cubic<V> {
        Cubic { value, slope: [rise[0] * self.step.h, rise[1] * self.step.h] }
    }

    /// Returns the cubics of the flux's components, in Wb.
    #[inline(always)]
    pub fn flux(&self) -> [Cubic<V>; 2] {
        let [from, to] = [self.from.state.flux, self.step.end.state.flux];
        let [first, last] = [self.step.change[0].flux, self.step.change[1].flux];
        [self.cubic([from.x, to.x], [first.x, last.x]), self.cubic([from.y, to.y], [first.y, last.y])]
    }
}

/// One machine at one time, from which its energy balance is computed.
#[derive(Clone, Copy)]
pub struct Moment<'s, 'a, V: Wide> {
    /// The machine's case.
    pub case: &'s Case<'a>,
    /// The motion of its rotor.
    pub motion: Motion,
    /// The machines of the bank.
    pub machine: &'s Machine<'a, V>,
    /// Number of this machine's lane in the bank.
    pub lane: usize,
    /// State and operating point of the machines at this time.
    pub here: &'s Here<V>,
}

impl<V: Wide> Moment<'_, '_, V> {
    /// Returns this machine's value from a vector with one value per lane.
    pub fn one(&self, pack: &V) -> f64 {
        pack.get(self.lane)
    }

    /// Returns the machine's current in A in the run's plane.
    pub fn current(&self) -> Plane {
        self.here.at.current.get(self.lane)
    }

    /// Returns the machine's phase currents in A.
    pub fn phases(&self) -> [f64; 3] {
        self.machine.legs.phases(self.here.at.current).map(|current| self.one(&current))
    }

    /// Returns the energies in J that all effects store, in the accounts of changes (`field_change`, `link_change` and so on).
    pub fn energies(&self) -> Ledger {
        let mut stored = Ledger::default();
        each_effect!(self.machine, self.machine.branch.as_ref(), effect => effect.energy(self, &mut stored));
        stored
    }

    /// Returns the powers in W of all effects, account by account, at a point within the step just accepted.
    pub fn powers(&self, span: &Span<'_, '_, V>) -> Ledger {
        let mut powers = Ledger::default();
        each_effect!(self.machine, span.branch, effect => effect.power(self, span, &mut powers));
        powers
    }
}

/// Copies the numbers of the selected lanes (`of`) from `from` to `to`.
#[inline(always)]
pub fn keep<V: Wide>(of: V::Mask, from: V, to: &mut V) {
    *to = V::choose(of, from, *to);
}

/// Copies the vectors of the selected lanes (`of`) from `from` to `to`.
#[inline(always)]
pub fn keep_plane<V: Wide>(of: V::Mask, from: Plane<V>, to: &mut Plane<V>) {
    *to = Plane::choose(of, from, *to);
}

/// Copies the matrices of the selected lanes (`of`) from `from` to `to`.
#[inline(always)]
pub fn keep_symmetric<V: Wide>(of: V::Mask, from: Symmetric<V>, to: &mut Symmetric<V>) {
    keep(of, from.xx, &mut to.xx);
    keep(of, from.xy, &mut to.xy);
    keep(of, from.yy, &mut to.yy);
}

/// Copies the vectors in the rotor's plane of the selected lanes (`of`) from `from` to `to`.
#[inline(always)]
pub fn keep_dq<V: Wide>(of: V::Mask, from: Dq<V>, to: &mut Dq<V>) {
    keep(of, from.d, &mut to.d);
    keep(of, from.q, &mut to.q);
}
