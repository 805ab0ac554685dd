//! Guards: conditions that end a mode, for several machines side by side. A mode is a state in which the solution is
//! smooth: which devices conduct, whether the rotor slides or rests, and the like.

mod comparators;
mod flux;
mod legs;
mod rotor;

use standstill_numeric::Wide;

pub use self::comparators::Levels;
pub use self::legs::POTENTIAL_DEEP;
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::sensing::Input;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::Here;

/// A condition that ends a mode, and with it the time over which the solution is smooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guard {
    /// The current of a leg reaches zero, or the potential of a terminal with a capacitance reaches a rail.
    Leg(usize),
    /// The potential of a blocked leg reaches a rail.
    Blocked,
    /// The rotor starts or stops.
    Motion,
    /// The rotor reaches the end of the brake's play.
    Stop,
    /// The current reaches the end of the flux map.
    Domain,
    /// ψ_d (0) or ψ_q (1) crosses zero, where the core has a kink.
    Kink(usize),
    /// A play cell of the iron begins or ceases to slide; the next step finds anew which cells slide.
    Branch,
    /// The current at a comparator reaches its level.
    Trip(Input),
}

/// One value for each guard, except the guards of play cells and comparators.
#[derive(Clone, Copy, Debug, Default)]
pub struct PerGuard<V> {
    /// Values of [`Guard::Leg`], leg by leg.
    pub leg: [V; 3],
    /// Value of [`Guard::Blocked`].
    pub blocked: V,
    /// Value of [`Guard::Motion`].
    pub motion: V,
    /// Value of [`Guard::Stop`].
    pub stop: V,
    /// Value of [`Guard::Domain`].
    pub domain: V,
    /// Values of [`Guard::Kink`], for ψ_d and ψ_q.
    pub kink: [V; 2],
}

impl<V: Wide> PerGuard<V> {
    /// Returns the record with this value for all guards.
    #[inline(always)]
    pub fn all(of: V) -> Self {
        Self { leg: [of; 3], blocked: of, motion: of, stop: of, domain: of, kink: [of; 2] }
    }
}

/// Bounds whose crossing ends a mode. A bound that cannot be crossed is infinitely far away.
#[derive(Clone, Debug)]
pub struct Bounds<V: Wide> {
    /// Coefficients of the margin of the motion: a constant, and factors of the speed in rad/s, of the torque in N·m,
    /// and of the magnitude of the difference of torque and load in N·m.
    pub motion: [V; 4],
    /// Angles in rad of the brake's stops, backwards and forwards from the initial position.
    pub stops: [V; 2],
    /// For ψ_d and ψ_q: factor and constant of the margin, `factor · ψ + constant`. If the core has a kink at zero, the factor is
    /// the present sign of the flux (+1 or −1) and the constant zero; else the factor is zero and the constant infinite.
    pub sides: Option<[[V; 2]; 2]>,
    /// Slack: distance below zero at which each margin counts as crossed.
    pub slack: PerGuard<V>,
    /// Largest magnitude in A of a current that may be set to zero when its leg's conduction mode ends.
    pub ended: V,
    /// Levels of the comparators, on drives with comparators.
    pub levels: Option<Levels<V>>,
}

/// Distance of each mode from its end; negative after the end. Leg: the current in A in the direction of
/// its mode, infinite for a blocked leg; for a floating terminal with a capacitance, the distance in V of its potential
/// from the nearer bound. Blocked: the distance in V of the blocked leg's potential from the nearer bound. Motion in
/// N·m or rad/s, stop in rad, domain in A, kink in Wb.
pub type Margins<V> = PerGuard<V>;

impl<V: Wide> Bounds<V> {
    /// Makes bounds that cannot be crossed. `kinks` is true if the cores have kinks at zero flux. `comparators` is true if the drives have
    /// comparators.
    pub fn new(kinks: bool, comparators: bool) -> Self {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        Self {
            motion: [far, zero, zero, zero],
            stops: [V::of(f64::NEG_INFINITY), far],
            sides: kinks.then_some([[zero, far]; 2]),
            slack: PerGuard::all(zero),
            ended: zero,
            levels: comparators.then_some(Levels { link: far, phase: [[far; 3]; 2], below: V::of(0.0) }),
        }
    }

    /// Returns the margins at a state.
    #[inline(always)]
    pub fn margins<const RARE: bool>(
        &self,
        machine: &Machine<V>,
        legs: &Conducting<V>,
        here: &Here<V>,
        change: &Change<V>,
        current: &[V; 3],
    ) -> Margins<V> {
        let mut margins = PerGuard::all(V::of(f64::INFINITY));
        Self::set_leg_margins::<RARE>(&mut margins, machine, legs, &here.state, change, current);
        self.set_rotor_margins(&mut margins, machine, here);
        self.set_core_margins(&mut margins, machine, here);
        margins
    }
}

/// The mode that ends first among those examined so far.
pub struct First {
    /// Share of the step at which the mode ends; infinite if no mode ends.
    pub share: f64,
    /// The guard of that mode.
    pub guard: Option<Guard>,
}

impl First {
    /// No mode has ended so far.
    pub const NONE: Self = Self { share: f64::INFINITY, guard: None };

    fn take(&mut self, share: f64, guard: Guard) {
        if share < self.share {
            *self = Self { share, guard: Some(guard) };
        }
    }

    /// Replaces the first guard by this one if its margin over the step is crossed earlier. `slack` is the distance below zero at which the
    /// margin counts as crossed.
    pub fn ends(&mut self, guard: Guard, margin: Cubic<f64>, slack: f64) {
        let to = if margin.value[1] < -slack {
            1.0
        } else if margin.dip() < -slack {
            margin.slope[0] / (margin.slope[0] - margin.slope[1])
        } else {
            return;
        };
        self.take(margin.falls_to(-0.5 * slack, 0.0, to), guard);
    }
}

/// Returns the straight line between a margin's values at the begin and the end of a step, for margins whose slopes are unknown. A
/// negative value at the begin counts as zero.
fn straight(begin: f64, end: f64) -> Cubic<f64> {
    Cubic { value: [begin.max(0.0), end], slope: [end - begin.max(0.0); 2] }
}
