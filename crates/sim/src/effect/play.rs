//! Hysteresis of the stator's iron: vector play cells, for machines side by side.
//!
//! A cell has a pinned flux π and an elastic flux e = ψ − π; its current (its "force") is K e. While the cell is stuck, π is
//! constant and e changes as ψ does; while the cell slides, |e| is equal to the reach r, and with n = e/r
//! ```text
//!   de/dt = (1 − n nᵀ) dψ/dt,   dπ/dt = n (n · dψ/dt)
//! ```
//! The path of π is a pursuit curve. Written as n = p/w, it obeys a linear equation, `w' = p·ψ'/r, p' = w ψ'/r`. If ψ follows a
//! parabola, the fourth-order Magnus step of this equation is the exponential of `G = [0 bᵀ; b cJ]`: b is the parabola's chord
//! divided by r, c the area between parabola and chord divided by r², and J a quarter turn. Since G³ = (|b|² − c²) G, the
//! exponential has a closed form. |n| = 1 holds exactly, whatever the error of the formula.
//!
//! A cell keeps its mode (stuck or sliding) over a whole step. The mode ends where |e| reaches r, or where the flux of a
//! sliding cell reverses; steps end there as at the end of any mode, and the modes are found anew at the begin of each step.

mod leap;
mod step;

use standstill_numeric::{Mask, Symmetric, Wide};
use standstill_plant::{Cell, MOST_CELLS};

use super::{BranchPoint, BranchState};
use crate::physics::plane::Plane;
use crate::step::hermite::Cubic;

pub use leap::Before;

/// Number of iterations that find the modes of the cells and the slope of the flux, which depend on each other. Each
/// iteration adds one or two digits.
const ROUNDS: usize = 4;

/// Number of parts of a step; in each part a sliding cell is integrated by one formula.
const PARTS: usize = 4;

/// Flux by which a cell may overshoot the end of its mode, as a share of the flux tolerance of a step: a cell that begins to
/// slide may be beyond its reach by this, and a cell that stops may be beyond the point of reversal. The share is small
/// because a cell is much softer than the core.
const SLACK: f64 = 0.1;

/// Multiple of a cell's tolerance by which the cell may miss the end of its mode in a step that was cut to end there.
const DEEP: f64 = 10.0;

/// Rounding: |e|² may exceed r² by this share of r² although the cell is just at its reach.
const ROUNDED: f64 = 1e-12;

/// The play cells of the machines in the lanes.
#[derive(Clone, Debug, Default)]
pub struct Cells<V: Wide> {
    /// Stiffness K in 1/H.
    stiffness: [V; MOST_CELLS],
    /// Reach r in Wb; 1 if the cell does not exist.
    reach: [V; MOST_CELLS],
    /// Largest inductance of the core in H, over all directions.
    inductance: V,
    /// Tolerance in Wb: see [`SLACK`].
    slack: V,
    /// Flux in Wb at the machines' last accepted state.
    from: Plane<V>,
    /// Elastic flux e of each cell in Wb at that state.
    away: BranchState<V>,
    /// Masks of the lanes in which each cell slides.
    slides: [V::Mask; MOST_CELLS],
    /// The stiffness in 1/H that the cells add to Γ, as last evaluated at the machines' present state.
    tangent: Symmetric<V>,
}

/// Cells after a step, and the ends of their modes within it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moved<V: Wide> {
    /// Elastic flux e of each cell in Wb at the end of the step.
    away: BranchState<V>,
    /// Stiffness in 1/H that the cells add to Γ at the end of the step.
    tangent: Symmetric<V>,
    /// Cells that slide after the step.
    slides: [V::Mask; MOST_CELLS],
    /// Guard function of each cell over the step: r² − |e|² in Wb² for a stuck cell, n · ψ′ in Wb per step for a
    /// sliding one. The mode ends where it falls to zero.
    cubic: [Cubic<V>; MOST_CELLS],
    /// Distance of each cell from the end of its mode, in Wb: negative beyond it.
    margin: [V; MOST_CELLS],
    /// Tolerance of each cell, in the unit of its guard function `cubic`.
    slack: [V; MOST_CELLS],
    /// Error of the step in Wb caused by the cells.
    off: V,
}

/// Returns the unit vector n of a cell's elastic flux; the zero vector if the elastic flux is zero.
#[inline(always)]
fn direction<V: Wide>(away: &Plane<V>) -> Plane<V> {
    *away * (V::of(1.0) / (away.dot(*away).sqrt() + 1e-300))
}

/// Returns the direction n of a sliding cell after one part of a step. The matrix G at the head of this file defines `b` and `c`.
#[inline(always)]
fn turn<V: Wide>(n: Plane<V>, b: Plane<V>, c: V) -> Plane<V> {
    let z = (b.dot(b) - c * c) * 0.25;
    // tanh(√z)/√z: a rational function of a quarter of √z, then the argument doubled twice. For large z, tanh is taken as 1.
    let y = z * (1.0 / 16.0);
    let above = (y * 21.0 + 1260.0) * y + 10395.0;
    let below = ((y + 210.0) * y + 4725.0) * y + 10395.0;
    let mut tau = above / below;
    for part in [1.0 / 16.0, 1.0 / 4.0] {
        tau = tau / (z * part * tau * tau + 1.0);
    }
    let far = z.above(V::of(1600.0));
    let tau = V::choose(far, V::of(1.0) / V::choose(far, z, V::of(1.0)).sqrt(), tau);
    let first = b.dot(n);
    let one = b + n.quarter_turn() * c;
    let (second, two) = (b.dot(one), b * first + one.quarter_turn() * c);
    let (keep, half) = (V::of(1.0) - z * tau * tau, tau * tau * 0.5);
    let p = n * keep + one * tau + two * half;
    let w = keep + first * tau + second * half;
    p * (V::of(1.0) / w)
}

impl<V: Wide> Cells<V> {
    /// Makes empty cells, for lanes into which no machine has been put.
    pub fn idle() -> Self {
        Self { reach: [V::of(1.0); MOST_CELLS], ..Self::default() }
    }

    /// Puts the cells of a machine into a lane. `flux` is the present flux in Wb in the run's plane. `inductance` is the largest inductance
    /// of the core in H. `tolerance` is the flux tolerance of a step in Wb. `last` is the unit vector of the iron's last magnetisation,
    /// none for iron that has never been magnetised.
    pub fn put(
        &mut self,
        lane: usize,
        cells: &[Cell; MOST_CELLS],
        flux: Plane,
        inductance: f64,
        tolerance: f64,
        last: Option<Plane>,
    ) {
        self.from.put(lane, flux);
        self.inductance.put(lane, inductance);
        self.slack.put(lane, SLACK * tolerance);
        for (k, cell) in cells.iter().enumerate() {
            let reach = if cell.stiffness > 0.0 { cell.reach } else { 1.0 };
            self.stiffness[k].put(lane, cell.stiffness);
            self.reach[k].put(lane, reach);
            let away = if cell.stiffness > 0.0 { reach } else { 0.0 };
            self.away[k].put(lane, last.map_or(Plane::default(), |last| last * away));
            self.slides[k] = V::Mask::of_bits(self.slides[k].bits() & !(1 << lane));
        }
    }

    /// Returns the elastic flux e of each play cell in Wb after the flux has moved from the last accepted state to `flux` in Wb. `along` is
    /// the initial tangent of the flux path, none for a straight path.
    #[inline(always)]
    pub fn away_at(&self, flux: Plane<V>, along: Option<Plane<V>>) -> BranchState<V> {
        let change = flux - self.from;
        let mut away = three!(k => self.away[k] + change);
        let any = self.slides[0] | self.slides[1] | self.slides[2];
        if !any.anywhere() {
            return away;
        }
        let along = along.unwrap_or(change);
        let bend = change - along;
        let area = along.cross(change) * (1.0 / (6.0 * (PARTS * PARTS * PARTS) as f64));
        // The chords of equal parts (in time) of the parabola.
        let mut chords = [Plane::default(); PARTS];
        for (part, chord) in chords.iter_mut().enumerate() {
            let (one, two) = (1.0 / PARTS as f64, (2 * part + 1) as f64 / (PARTS * PARTS) as f64);
            *chord = along * V::of(one) + bend * V::of(two);
        }
        for k in 0..MOST_CELLS {
            let per_reach = V::of(1.0) / self.reach[k];
            let mut n = direction(&self.away[k]);
            for chord in chords {
                n = turn(n, chord * per_reach, area * per_reach * per_reach);
            }
            away[k] = Plane::choose(self.slides[k], n * self.reach[k], away[k]);
        }
        away
    }

    /// Returns current and stiffness of all cells at these elastic fluxes in Wb, in their present modes.
    #[inline(always)]
    fn point(&self, elastic: BranchState<V>) -> BranchPoint<V> {
        let mut current = Plane::default();
        for k in 0..MOST_CELLS {
            current = current + elastic[k] * self.stiffness[k];
        }
        BranchPoint { current, stiffness: self.tangent_of(&elastic, &self.slides), elastic }
    }

    /// Returns the stiffness in 1/H that the cells add to Γ at these elastic fluxes in Wb: K for a stuck cell, K (1 − n nᵀ) for a sliding
    /// one.
    #[inline(always)]
    fn tangent_of(&self, away: &BranchState<V>, slides: &[V::Mask; MOST_CELLS]) -> Symmetric<V> {
        let mut sum = Symmetric::default();
        for k in 0..MOST_CELLS {
            let n = direction(&away[k]);
            let soft = V::only(slides[k], self.stiffness[k]);
            sum.xx = sum.xx + (self.stiffness[k] - soft * n.x * n.x);
            sum.xy = sum.xy - soft * n.x * n.y;
            sum.yy = sum.yy + (self.stiffness[k] - soft * n.y * n.y);
        }
        sum
    }

    /// Returns the record of a step in which the cells have not moved.
    #[inline(always)]
    fn blank(&self) -> Moved<V> {
        let (zero, away, slides) = (V::of(0.0), self.away, self.slides);
        let (cubic, three) = ([Cubic::default(); MOST_CELLS], [zero; MOST_CELLS]);
        Moved { away, tangent: self.tangent, slides, cubic, margin: three, slack: three, off: zero }
    }

    /// Returns the cells after a step to these elastic fluxes in Wb. `tangent` is the stiffness in 1/H that the cells add to Γ at the end.
    /// `change` is the change of the flux in Wb over the step. `rise` contains the slopes of the flux at both ends in Wb per step. `off` is
    /// the distance in Wb between the end and the point at which the core was evaluated.
    #[inline(always)]
    fn moved(
        &self,
        (away, tangent): (BranchState<V>, Symmetric<V>),
        change: Plane<V>,
        rise: [Plane<V>; 2],
        off: Plane<V>,
    ) -> Moved<V> {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        let mut moved = Moved { away, tangent, off: self.off(change, rise, off), ..self.blank() };
        for k in 0..MOST_CELLS {
            let (sliding, reach) = (self.slides[k], self.reach[k]);
            // Setting a blocked leg's current to zero may have changed the flux since the last step.
            let ends = [Plane::choose(sliding, self.away[k], away[k] - change), away[k]];
            let room = pair!(end => reach * reach - ends[end].dot(ends[end]));
            // A distance beyond the reach that existed before the step does not end the mode in it.
            let past = room[0].least(zero);
            let closing = pair!(end => ends[end].dot(rise[end]) * -2.0);
            let stuck = Cubic { value: pair!(end => room[end] - past), slope: closing };
            let along = pair!(end => direction(&ends[end]).dot(rise[end]));
            let turning = Cubic { value: along, slope: [along[1] - along[0]; 2] };
            // Distance in Wb from the point of reversal to the end of the step, on a path with constant second derivative.
            let square = along[1] * along[1] / ((along[0] - along[1]).abs() * 2.0);
            let back = V::choose(zero.above(along[1]), -square, far);
            let held = stuck.value[1].least(stuck.dip()) * (V::of(0.5) / reach);
            let there = self.stiffness[k].above(zero);
            moved.margin[k] = V::choose(there, V::choose(sliding, back, held), far);
            moved.slack[k] = V::only(!sliding, self.slack * reach * 2.0);
            for end in 0..2 {
                let of = &mut moved.cubic[k];
                of.value[end] = V::choose(sliding, turning.value[end], stuck.value[end]);
                of.slope[end] = V::choose(sliding, turning.slope[end], stuck.slope[end]);
            }
            // A stuck cell beyond its reach may slide from now on; its distance beyond is within the error of a step.
            let beyond = away[k].dot(away[k]).above(reach * reach);
            moved.away[k] = Plane::choose(sliding | beyond, direction(&away[k]) * reach, away[k]);
            moved.slides[k] =
                (sliding & along[1].above(zero) & square.above(self.slack)) | (!sliding & beyond);
        }
        moved
    }

    /// Estimates the error in Wb that sliding cells cause in a step: the path of the flux is not exactly a parabola, and the core was
    /// evaluated at a distance of `off` in Wb from the end. `change`: change of the flux in Wb; `rise`: slope of the flux at both
    /// ends, in Wb per step.
    #[inline(always)]
    fn off(&self, change: Plane<V>, rise: [Plane<V>; 2], off: Plane<V>) -> V {
        let areas = [rise[0].cross(change) * (1.0 / 6.0), change.cross(rise[1]) * (1.0 / 6.0)];
        let (unlike, area) = ((areas[0] - areas[1]).abs(), areas[0].abs());
        let (length, off) = (change.dot(change), off.dot(off));
        let mut all = V::of(0.0);
        for k in 0..MOST_CELLS {
            let (reach, per_reach) = (self.reach[k], V::of(1.0) / self.reach[k]);
            // Turn of n by the error of the formula and by an area that is not that of a parabola.
            let apart =
                (length * per_reach * per_reach * (1.0 / (4 * PARTS * PARTS) as f64)).least(V::of(1.0));
            let turned = (unlike + area * apart * (1.0 / (PARTS * PARTS) as f64)) * per_reach;
            let linear = off * per_reach * 2.0;
            let both = turned.least(reach + reach) + linear.least(reach + reach);
            all = all + V::only(self.slides[k], both * self.stiffness[k] * self.inductance);
        }
        all
    }
}

#[cfg(test)]
mod tests;
