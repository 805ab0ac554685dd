//! Oscillation (ringing) of the terminals' capacitances with the winding, within a step.
//!
//! ```text
//!   dψ/dt = F + w         F = rail U + offset − R i,  w: voltage that floating terminals put on the winding
//!   dw/dt = −K i          the currents charge these terminals
//!   i = i₀ + Γ₀ (ψ − ψ₀) + j(t)      j: nonlinear remainder, small and slow
//! ```
//! With a constant Γ₀, these equations are two oscillators. With G = √Γ₀, Q the matrix of the eigenvectors of G K G, ω² its
//! eigenvalues, `ξ = QᵀG (ψ − ψ₀)`, `η = QᵀG w`, `I = QᵀG⁻¹ i = ξ + J` and `f = QᵀG F`, their equations are
//! ```text
//!   ξ′ = η + f,   η′ = −ω² I
//! ```
//! The oscillators are solved exactly for cubics f and J that have the values and slopes at both ends. Where ω is zero, the
//! solution is the quadrature of any other step. The winding's resistance damps the oscillators: `f = f* − 2δ I`. The
//! damped oscillators are solved in closed form, too, because in long steps a cubic f could not contain the damping.
//! Dividers at the terminals change the coefficients of the oscillators: `ringing/leak.rs`.

mod leak;

use standstill_numeric::{Symmetric, Wide, sin_cos};

use self::leak::Leak;
use super::modes::Modes;
use super::stumpff::stumpff;
use super::swing::{Far, Near, Powers, about, decayed, over, scaled};
use crate::physics::legs::Terminals;
use crate::physics::machine::{Change, Operating};
use crate::physics::plane::Plane;

/// Square of the largest angle in rad by which a damped mode may turn in a step that [`Near`] solves. A mode that turns
/// further is solved by [`Far`], as an oscillation about a polynomial.
const TURNS: f64 = 0.25;

/// Square of the angle in rad up to which a cubic approximates an oscillation with an error of at most 3e-7.
const FOLLOWED: f64 = 0.01;

/// Largest damping, as a share of a mode's frequency, that the solution of the damped oscillator contains; cubics carry
/// the rest.
const MOST_DAMPED: f64 = 0.9;

/// Number of successive steps with equal errors whose sum may reach the tolerance, if no damping reduces the errors.
pub const ALIKE: f64 = 80.0;

/// Largest total error of a damped oscillation, in multiples of the tolerance; about 5e-8 of rated current at the usual
/// tolerance. The errors of earlier steps decay with the oscillation.
const DAMPED: f64 = 5.0;

/// Estimates the fourth-order term that a cubic neglects, as `error.rs` does for the currents of any other step.
#[inline(always)]
fn fourth_order<V: Wide>(of: &Powers<V>) -> V {
    let (second, third) = ((of[2] + of[3]).abs(), of[3].abs());
    third * third / (second + third + 1e-30)
}

/// Driving voltage F (the equations of this module), current and flux with their slopes, at the begin or at the end of a step.
#[derive(Clone, Copy, Debug)]
pub struct End<V> {
    /// Driving voltage F = rails + offsets − R i in V, without the part of floating terminals. The voltage of shorted turns is added.
    pub force: Plane<V>,
    /// Slope of F in V/s.
    pub force_rise: Plane<V>,
    /// The current in A.
    pub current: Plane<V>,
    /// Slope of the current in A/s.
    pub current_rise: Plane<V>,
    /// Slope of the flux, dψ/dt in V.
    pub flux_rise: Plane<V>,
    /// Change of the flux since the beginning of the step, ψ − ψ₀ in Wb.
    pub flux: Plane<V>,
}

impl<V: Wide> End<V> {
    /// Computes F and the current from the slopes of the machines. `link` is the link's voltage in V and `link_rise` its slope in V/s.
    /// `pull` contains the voltage in V that shorted turns add, and its slope in V/s. `flux` is ψ − ψ₀ in Wb.
    #[inline(always)]
    pub(super) fn of(
        terminals: &Terminals<V>,
        at: &Operating<V>,
        change: &Change<V>,
        [link, link_rise]: [V; 2],
        pull: Option<[Plane<V>; 2]>,
        flux: Plane<V>,
    ) -> Self {
        let mut force = terminals.rail * link + terminals.offset - at.current.through(terminals.resistance);
        let mut force_rise = terminals.rail * link_rise - change.current.through(terminals.resistance);
        if let Some([pull, rise]) = pull {
            (force, force_rise) = (force + pull, force_rise + rise);
        }
        Self {
            force,
            force_rise,
            current: at.current,
            current_rise: change.current,
            flux_rise: change.flux,
            flux,
        }
    }
}

/// The solution of both modes over a step.
#[derive(Clone, Copy, Debug)]
pub struct Ringing<V> {
    /// The two eigenmodes.
    pub modes: Modes<V>,
    /// Squares of the angles in rad by which the modes turn in the whole step.
    pub turned: [V; 2],
    /// η at the beginning of the step, times the step's length.
    velocity: [V; 2],
    /// Force f + 2δ ξ (f without the part that damps ξ) times the step's length, as a cubic over the step.
    force: [Powers<V>; 2],
    /// Nonlinear remainder J of the modal currents, as a cubic over the step.
    remainder: [Powers<V>; 2],
    /// Damping δ times the step's length.
    damping: [V; 2],
    /// Coupling by the resistance, times the step's length: drop in the second mode per current of the first. Zero if the second mode
    /// rings.
    across: V,
    /// Rotation of the modes over the whole step; zero if only the step's beginning is known.
    turn: [Turn<V>; 2],
    /// Discharge of the terminals by dividers; none if no dividers exist.
    leak: Option<Leak<V>>,
}

/// Rotation of a mode over a step or a share of it.
#[derive(Clone, Copy, Debug)]
struct Turn<V> {
    /// Stumpff's functions of the square of the damped mode's angle.
    stumpff: [V; 6],
    /// Decay factor e^(−y).
    decay: V,
}

impl<V: Wide> Ringing<V> {
    /// Extrapolates the solution over a step of `h` seconds from the force and the remainder at the beginning. `w` is the voltage in V of
    /// the floating terminals at the beginning. `leak` is the rate in 1/s at which dividers discharge these terminals.
    #[inline(always)]
    pub fn ahead(modes: Modes<V>, h: V, w: Plane<V>, leak: Option<V>, begin: &End<V>) -> Self {
        Self::new::<false>(modes, h, w, leak, [begin, begin])
    }

    /// Returns the solution for a step of `h` seconds between two known ends. `w` is the voltage in V of the floating terminals at the
    /// beginning. `leak` is the rate in 1/s at which dividers discharge these terminals.
    #[inline(always)]
    pub fn between(modes: Modes<V>, h: V, w: Plane<V>, leak: Option<V>, ends: [&End<V>; 2]) -> Self {
        Self::new::<true>(modes, h, w, leak, ends)
    }

    /// Solves both modes. With `CUBIC`, force and remainder are cubics between both ends; else tangents at the beginning.
    #[inline(always)]
    fn new<const CUBIC: bool>(
        modes: Modes<V>,
        h: V,
        w: Plane<V>,
        leak: Option<V>,
        ends: [&End<V>; 2],
    ) -> Self {
        let zero = V::of(0.0);
        let none: Powers<V> = [zero; 4];
        let mut step = Self {
            modes,
            turned: [zero; 2],
            velocity: [zero; 2],
            force: [none; 2],
            remainder: [none; 2],
            damping: [zero; 2],
            across: zero,
            turn: [Turn { stumpff: [zero; 6], decay: zero }; 2],
            leak: some!(leak, leak => Leak::of(leak * h)),
        };
        let second_is_slow = !modes.square[1].above(zero);
        for m in 0..2_usize {
            let turned = modes.square[m] * h * h;
            let half = (modes.damping[m][m] * h * 0.5).least(turned.sqrt() * MOST_DAMPED);
            let xi = pair!(e => modes.to[m].dot(ends[e].flux));
            let xi_rise = pair!(e => modes.to[m].dot(ends[e].flux_rise) * h);
            let modal = pair!(e => modes.back[m].dot(ends[e].current));
            let modal_rise = pair!(e => modes.back[m].dot(ends[e].current_rise) * h);
            let twice = half + half;
            // If the second mode does not ring, the drop that the first mode's current makes in it is computed from that current's mean.
            let mut across = [zero; 2];
            let mut across_rise = [zero; 2];
            if m == 1 {
                step.across = V::only(second_is_slow, modes.damping[1][0] * h);
                across = pair!(e => modes.back[0].dot(ends[e].current) * step.across);
                across_rise = pair!(e => modes.back[0].dot(ends[e].current_rise) * h * step.across);
            }
            let force = pair!(e => modes.to[m].dot(ends[e].force) * h + twice * xi[e] + across[e]);
            let force_rise =
                pair!(e => modes.to[m].dot(ends[e].force_rise) * h * h + twice * xi_rise[e] + across_rise[e]);
            let remainder = pair!(e => modal[e] - xi[e]);
            let remainder_rise = pair!(e => modal_rise[e] - xi_rise[e]);
            step.turned[m] = turned;
            step.velocity[m] = modes.to[m].dot(w) * h;
            step.force[m] = over::<V, CUBIC>(force, force_rise);
            step.remainder[m] = over::<V, CUBIC>(remainder, remainder_rise);
            step.damping[m] = half;
            if step.leak.is_some() {
                step.discharge(m);
            }
            if CUBIC {
                step.turn[m] = step.turn_after(m, V::of(1.0));
            }
        }
        step
    }

    /// Returns a mode's rotation after a share of the step.
    #[inline(always)]
    fn turn_after(&self, m: usize, share: V) -> Turn<V> {
        let (turned, damping) = (self.turned[m] * share * share, self.damping[m] * share);
        Turn { stumpff: stumpff(turned - damping * damping), decay: decayed(damping) }
    }

    /// Returns ψ − ψ₀ in Wb at the end of the step, and the mean of the current in A that charges the terminals.
    #[inline(always)]
    pub fn at_end(&self) -> [Plane<V>; 2] {
        self.turned_by(V::of(1.0), &self.turn)
    }

    /// Returns ψ − ψ₀ in Wb and the mean current in A that charges the terminals, after a share of the step.
    #[inline(always)]
    pub fn after(&self, share: V) -> [Plane<V>; 2] {
        self.turned_by(share, &pair!(m => self.turn_after(m, share)))
    }

    /// Returns the result of [`Self::after`]. `turn` contains the rotations of the modes over this share.
    #[inline(always)]
    fn turned_by(&self, share: V, turn: &[Turn<V>; 2]) -> [Plane<V>; 2] {
        let (first, mean) = self.mode(0, share, V::of(0.0), &turn[0]);
        let [mean, charging_first] = self.means(0, share, first, mean);
        let (second, mean) = self.mode(1, share, mean * self.across * share, &turn[1]);
        let [_, charging_second] = self.means(1, share, second, mean);
        let [to, back] = [&self.modes.to, &self.modes.back];
        [back[0] * first + back[1] * second, to[0] * charging_first + to[1] * charging_second]
    }

    /// Returns ξ and the mean of ξ + J of a mode after a share of the step; `dropped`: drop caused by the other mode's
    /// current.
    #[inline(always)]
    fn mode(&self, m: usize, share: V, dropped: V, turn: &Turn<V>) -> (V, V) {
        let mut force = scaled(&self.force[m], share, share);
        let remainder = scaled(&self.remainder[m], share, V::of(1.0));
        force[0] = force[0] - dropped;
        let turned = self.turned[m] * share * share;
        let damping = self.damping[m] * share;
        let velocity = self.velocity[m] * share;
        let Turn { stumpff, decay } = *turn;
        let damped = damping.above(V::of(0.0));
        let far = damped & turned.above(V::of(TURNS));
        let near = Near { turned, damping, decay, stumpff }.after(velocity, &force, &remainder, damped);
        if !V::any(far) {
            return (near[0], near[1]);
        }
        let [cos, sin, ..] = stumpff;
        let by = Far { turned: V::choose(far, turned, V::of(1.0)), damping, decay, cos, sin };
        let [flux, mean] = by.after(velocity, &force, &remainder);
        (V::choose(far, flux, near[0]), V::choose(far, mean, near[1]))
    }

    /// Returns the part of a resistance in Ω that the closed-form solution does not contain as damping; cubics account for its
    /// drop.
    #[inline(always)]
    pub(super) fn left_to_cubics(&self, resistance: &Symmetric<V>, h: V) -> Symmetric<V> {
        // In a step of zero length the damping is zero, too.
        let per_length = V::of(2.0) / h.greatest(V::of(1e-30));
        let mut left = *resistance;
        for m in 0..2_usize {
            let (axis, mut solved) = (self.modes.back[m], self.damping[m] * per_length);
            if let Some(leak) = &self.leak {
                solved = solved - leak.damping(m) * per_length;
            }
            left.xx = left.xx - solved * axis.x * axis.x;
            left.xy = left.xy - solved * axis.x * axis.y;
            left.yy = left.yy - solved * axis.y * axis.y;
        }
        left
    }

    /// Returns the oscillating parts of the modes' currents within the step.
    #[inline(always)]
    pub fn oscillations(&self) -> [Oscillation<V>; 2] {
        let [first, mut second] = pair!(m => self.oscillation(m));
        // If the second mode does not ring, it contains the drop of the first mode's oscillation, −∫ across z e^(σ s) ds.
        let slow = !self.turned[1].above(V::of(0.0));
        let ([re, im], [x, y]) = (first.phasor, first.turns);
        let per = self.across / (x * x + y * y);
        let dropped = [(re * x + im * y) * per, (im * x - re * y) * per];
        for n in 0..2 {
            second.phasor[n] = V::choose(slow, -dropped[n], second.phasor[n]);
            second.turns[n] = V::choose(slow, first.turns[n], second.turns[n]);
            second.over[n] = V::choose(slow, first.over[n], second.over[n]);
        }
        [first, second]
    }

    /// Returns the oscillating part of a mode's current: the modal current less the polynomial about which it
    /// oscillates. Zero if the mode turns so little in a step that a cubic describes the oscillation.
    #[inline(always)]
    fn oscillation(&self, m: usize) -> Oscillation<V> {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let there = self.turned[m].above(V::of(FOLLOWED));
        let turned = V::choose(there, self.turned[m], one);
        let damping = V::only(there, self.damping[m]);
        let (force, j) = (&self.force[m], &self.remainder[m]);
        let [zeroth, first, _] = about(turned, damping, force, j);
        let angle = (turned - damping * damping).sqrt();
        let away = j[0] - zeroth;
        let rise = self.velocity[m] + force[0] + j[1] - first;
        let phasor = [V::only(there, away), V::only(there, -(rise + damping * away) / angle)];
        let Turn { stumpff: [cos, sin, ..], decay } = self.turn[m];
        Oscillation { phasor, turns: [zero - damping, angle], over: [decay * cos, decay * (sin * angle)] }
    }

    /// Returns the error in Wb of the currents between the ends, which arises where their remainders are not cubics.
    #[inline(always)]
    pub fn error_between(&self) -> V {
        let mut all = V::of(0.0);
        for m in 0..2_usize {
            let size = self.modes.back[m].x.abs() + self.modes.back[m].y.abs();
            all = all + size * fourth_order(&self.remainder[m]);
        }
        all
    }

    /// Returns the error of a step in Wb, which arises where force and remainder are not cubics. It is scaled so that
    /// [`ALIKE`] successive steps with this error stay within the tolerance.
    #[inline(always)]
    pub fn error(&self) -> V {
        let mut all = V::of(0.0);
        for m in 0..2_usize {
            let size = self.modes.back[m].x.abs() + self.modes.back[m].y.abs();
            let turned = self.turned[m];
            let angle = turned.sqrt();
            // A remainder in resonance with the mode adds up until the damping limits it.
            let of_remainder = turned / (angle + angle * self.damping[m] + 1.0);
            let both = fourth_order(&self.force[m]) + of_remainder * fourth_order(&self.remainder[m]);
            // Number of steps whose equal errors add up before the damping has removed the first one, limited to `ALIKE`.
            let alike = ((self.damping[m] + 1.0) / (self.damping[m] * DAMPED)).least(V::of(ALIKE));
            all = all + size * both * alike * (1.0 / ALIKE);
        }
        all
    }
}

/// An oscillation Re z e^(σ s), s from 0 to 1 over a step.
#[derive(Clone, Copy, Debug)]
pub struct Oscillation<V> {
    /// Complex amplitude z.
    pub phasor: [V; 2],
    /// Complex rate σ per step.
    pub turns: [V; 2],
    /// Factor e^σ by which the oscillation changes over the whole step.
    pub over: [V; 2],
}

impl<V: Wide> Oscillation<V> {
    /// Copies one lane's oscillation to all lanes, each restricted to the first `share` of the step that stands in its lane.
    #[inline(always)]
    pub fn of_lane(&self, lane: usize, share: V) -> Self {
        let [decay, turn] = pair!(n => share * self.turns[n].get(lane));
        let left = decayed(V::of(0.0) - decay);
        let (sin, cos) = sin_cos(turn);
        let phasor = pair!(n => V::of(self.phasor[n].get(lane)));
        Self { phasor, turns: [decay, turn], over: [left * cos, left * sin] }
    }
}
