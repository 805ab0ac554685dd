//! What the stator's iron remembers: the play cells of machines side by side.
//!
//! A cell's elastic flux e = ψ − π is where its force is, K e. While it is stuck e changes as ψ does; while it slides |e| stays r
//! and with n = e/r
//! ```text
//!   de/dt = (1 − n nᵀ) dψ/dt,   dπ/dt = n (n · dψ/dt)
//! ```
//! Of this path, a pursuit curve, (1, n) is a ray that turns by a linear equation, `w' = p·ψ'/r, p' = w ψ'/r` with n = p/w. Over a
//! parabola of ψ its fourth-order Magnus step is the exponential of `G = [0 bᵀ; b cJ]` with b the chord over r, c the area between
//! path and chord over r², and J a quarter turn; and since G³ = (|b|² − c²) G, that is a formula. |n| = 1 stays, whatever it misses.
//!
//! A cell's mode holds over a whole step. It ends where |e| reaches r, or where a sliding cell's flux turns back; steps end there
//! as at the end of any mode, and at the begin of each step modes are found anew.

mod step;

use standstill_numeric::{Mask, Symmetric, Wide};
use standstill_plant::{Cell, MOST_CELLS};

use crate::physics::plane::Plane;
use crate::step::hermite::Cubic;

/// Elastic fluxes e in Wb of the cells, in the run's plane.
pub type Elastic<V> = [Plane<V>; MOST_CELLS];

/// Modes that follow from the modes of legs, and those from these: each round they are right to another digit or two.
pub const ROUNDS: usize = 4;

/// Parts of a step over which cells slide by one formula each.
const PARTS: usize = 4;

/// How far beyond its reach a cell may be where it begins to slide, or from where it turned back, as a share of the flux by which a
/// step may be off: a cell is much softer than the core.
pub const SLACK: f64 = 0.1;

/// So many times this slack it may be off where a step was to end there.
const DEEP: f64 = 10.0;

/// The cells of machines of which each has its own.
#[derive(Clone, Debug)]
pub struct Cells<V: Wide> {
    /// K in 1/H.
    stiffness: [V; MOST_CELLS],
    /// r in Wb; 1 where there is no cell.
    reach: [V; MOST_CELLS],
    /// What the softest direction of the core makes of a force: its inductance in H.
    inductance: V,
    /// See [`SLACK`]; in Wb.
    slack: V,
    /// The flux in Wb where the machines were last, and what was elastic of it.
    from: Plane<V>,
    away: Elastic<V>,
    /// Which cells slide.
    slides: [V::Mask; MOST_CELLS],
    /// What they have added to the inverse inductance in 1/H that is known of where the machines are.
    tangent: Symmetric<V>,
}

/// Force and stiffness of cells.
#[derive(Clone, Copy, Debug)]
pub struct Iron<V> {
    /// In A.
    pub current: Plane<V>,
    /// In 1/H.
    pub tangent: Symmetric<V>,
}

impl<V: Wide> Iron<V> {
    /// The core's current in A where the cells' is taken from the winding's, after a small change of the flux in Wb.
    #[inline(always)]
    pub fn core(&self, current: Plane<V>, change: Plane<V>) -> Plane<V> {
        current - self.current - change.through(self.tangent)
    }
}

/// Cells after a step, and when their modes end within it.
#[derive(Clone, Copy, Debug)]
pub struct Moved<V: Wide> {
    away: Elastic<V>,
    tangent: Symmetric<V>,
    /// Who slides on.
    slides: [V::Mask; MOST_CELLS],
    /// Of a stuck cell r² − |e|² in Wb², of a sliding one n · ψ′ in Wb a step.
    pub cubic: [Cubic<V>; MOST_CELLS],
    /// How far each is from the end of its mode, in Wb: negative beyond.
    pub margin: [V; MOST_CELLS],
    /// What slack makes of `cubic`.
    pub slack: [V; MOST_CELLS],
}

fn none<V: Wide>() -> Plane<V> {
    Plane::new(V::of(0.0), V::of(0.0))
}

/// n of a cell; zero where nothing is elastic.
#[inline(always)]
fn direction<V: Wide>(away: &Plane<V>) -> Plane<V> {
    *away * (V::of(1.0) / (away.dot(*away).sqrt() + 1e-300))
}

/// What a formula of one part of a step makes of the direction n, over the chord and the area between path and chord.
#[inline(always)]
fn turn<V: Wide>(n: Plane<V>, b: Plane<V>, c: V) -> Plane<V> {
    let z = (b.dot(b) - c * c) * 0.25;
    // tanh(√z)/√z: of a quarter of √z by a fraction, then doubled twice; where it is 1 but for 1e-7, as if it were.
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
    /// Of machines that are about to come.
    pub fn idle() -> Self {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        Self {
            stiffness: [zero; MOST_CELLS],
            reach: [one; MOST_CELLS],
            inductance: zero,
            slack: zero,
            from: none(),
            away: [none(); MOST_CELLS],
            slides: [V::Mask::of_bits(0); MOST_CELLS],
            tangent: Symmetric::new(zero, zero, zero),
        }
    }

    /// Puts a machine into a lane, with its flux in Wb in the run's plane, the largest inductance of its core in H, and by how much
    /// a step may be off in Wb. `last`: along which unit vector its iron was last magnetised; none: it is virgin.
    pub fn put(
        &mut self,
        lane: usize,
        cells: &[Cell; MOST_CELLS],
        flux: Plane,
        inductance: f64,
        tolerance: f64,
        last: Option<Plane>,
    ) {
        let put = |to: &mut Plane<V>, from: Plane| {
            to.x.put(lane, from.x);
            to.y.put(lane, from.y);
        };
        put(&mut self.from, flux);
        self.inductance.put(lane, inductance);
        self.slack.put(lane, SLACK * tolerance);
        for (k, cell) in cells.iter().enumerate() {
            let reach = if cell.stiffness > 0.0 { cell.reach } else { 1.0 };
            self.stiffness[k].put(lane, cell.stiffness);
            self.reach[k].put(lane, reach);
            let away = if cell.stiffness > 0.0 { reach } else { 0.0 };
            put(&mut self.away[k], last.map_or(Plane::new(0.0, 0.0), |last| last * away));
            self.slides[k] = V::Mask::of_bits(self.slides[k].bits() & !(1 << lane));
        }
    }

    /// What is elastic at a flux in Wb, on a way that began in the direction of `along`.
    #[inline(always)]
    pub fn away_at(&self, flux: Plane<V>, along: Option<Plane<V>>) -> Elastic<V> {
        let change = flux - self.from;
        let mut away = three!(k => self.away[k] + change);
        let any = self.slides[0] | self.slides[1] | self.slides[2];
        if !any.anywhere() {
            return away;
        }
        let along = along.unwrap_or(change);
        let bend = change - along;
        let area = along.cross(change) * (1.0 / (6.0 * (PARTS * PARTS * PARTS) as f64));
        // Chords of a parabola's equal parts.
        let mut chords = [none(); PARTS];
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

    /// Force and stiffness of cells in their modes.
    #[inline(always)]
    pub fn iron(&self, away: &Elastic<V>) -> Iron<V> {
        let mut current = none();
        for k in 0..MOST_CELLS {
            current = current + away[k] * self.stiffness[k];
        }
        Iron { current, tangent: self.tangent_of(away, &self.slides) }
    }

    #[inline(always)]
    fn tangent_of(&self, away: &Elastic<V>, slides: &[V::Mask; MOST_CELLS]) -> Symmetric<V> {
        let zero = V::of(0.0);
        let mut sum = Symmetric::new(zero, zero, zero);
        for k in 0..MOST_CELLS {
            let n = direction(&away[k]);
            let soft = V::only(slides[k], self.stiffness[k]);
            sum.xx = sum.xx + (self.stiffness[k] - soft * n.x * n.x);
            sum.xy = sum.xy - soft * n.x * n.y;
            sum.yy = sum.yy + (self.stiffness[k] - soft * n.y * n.y);
        }
        sum
    }

    /// The same where the machines are, with the modes of the step that begins there.
    #[inline(always)]
    pub fn iron_here(&self, flux: Plane<V>) -> Iron<V> {
        self.iron(&self.away_at(flux, None))
    }

    /// What the cells have added to the inverse inductance that is known of where the machines are.
    #[inline(always)]
    pub const fn tangent(&self) -> Symmetric<V> {
        self.tangent
    }

    /// The same was evaluated anew for some machines.
    #[inline(always)]
    pub fn set_tangent(&mut self, of: V::Mask, tangent: Symmetric<V>) {
        self.tangent.xx = V::choose(of, tangent.xx, self.tangent.xx);
        self.tangent.xy = V::choose(of, tangent.xy, self.tangent.xy);
        self.tangent.yy = V::choose(of, tangent.yy, self.tangent.yy);
    }

    /// Finds the modes for a step of some machines at a flux in Wb: a cell at its reach slides if the flux takes it further. The
    /// flux's rise in V may depend on them: `rise` tells it of what all cells add to the inverse inductance.
    #[inline(always)]
    pub fn find_modes(
        &mut self,
        of: V::Mask,
        flux: Plane<V>,
        mut rise: impl FnMut(Symmetric<V>) -> Plane<V>,
    ) {
        let zero = V::of(0.0);
        let away = self.away_at(flux, None);
        let mut slides = self.slides;
        for _ in 0..ROUNDS {
            let rise = rise(self.tangent_of(&away, &slides));
            for k in 0..MOST_CELLS {
                let beyond = away[k].dot(away[k]).above(self.reach[k] * self.reach[k]);
                slides[k] = (self.slides[k] | beyond) & away[k].dot(rise).above(zero);
            }
        }
        self.set_tangent(of, self.tangent_of(&away, &slides));
        for k in 0..MOST_CELLS {
            self.slides[k] = (slides[k] & of) | (self.slides[k] & !of);
        }
    }

    /// What follows from a step to where so much is elastic, in Wb, with what its end's inverse inductance has of the cells;
    /// `change` and `rise`: of the flux, in Wb and at both ends in Wb a step.
    #[inline(always)]
    pub fn moved(
        &self,
        (away, tangent): (Elastic<V>, Symmetric<V>),
        change: Plane<V>,
        rise: [Plane<V>; 2],
    ) -> Moved<V> {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        let blank = Cubic { value: [zero; 2], slope: [zero; 2] };
        let mut moved = Moved {
            away,
            tangent,
            slides: self.slides,
            cubic: [blank; MOST_CELLS],
            margin: [far; MOST_CELLS],
            slack: [zero; MOST_CELLS],
        };
        for k in 0..MOST_CELLS {
            let (sliding, reach) = (self.slides[k], self.reach[k]);
            // A leg that was taken to be blocked may have moved the flux since the last step.
            let ends = [Plane::choose(sliding, self.away[k], away[k] - change), away[k]];
            let room = pair!(end => reach * reach - ends[end].dot(ends[end]));
            // What it was beyond before ends nothing now.
            let past = room[0].least(zero);
            let closing = pair!(end => ends[end].dot(rise[end]) * -2.0);
            let stuck = Cubic { value: pair!(end => room[end] - past), slope: closing };
            let along = pair!(end => direction(&ends[end]).dot(rise[end]));
            let turning = Cubic { value: along, slope: [along[1] - along[0]; 2] };
            // How far it went back, on a path that bends evenly.
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
            // A stuck cell that is at its reach may slide from now on; what it is beyond by is within the error of a step.
            let beyond = away[k].dot(away[k]).above(reach * reach);
            moved.away[k] = Plane::choose(sliding | beyond, direction(&away[k]) * reach, away[k]);
            moved.slides[k] =
                (sliding & along[1].above(zero) & square.above(self.slack)) | (!sliding & beyond);
        }
        moved
    }

    /// The least room of a step's cells, within it and at its end, in Wb with their slack: negative where a mode ended.
    #[inline(always)]
    pub fn room(&self, moved: &Moved<V>) -> [V; 2] {
        let least = moved.margin[0].least(moved.margin[1]).least(moved.margin[2]);
        [least + self.slack, least + self.slack * DEEP]
    }

    /// Whether a mode of this cell ended in a lane's step.
    pub fn ended(&self, moved: &Moved<V>, lane: usize, cell: usize) -> bool {
        moved.margin[cell].get(lane) < -self.slack.get(lane)
    }

    /// Makes the end of a step, at a flux in Wb, the place of those that took it.
    #[inline(always)]
    pub fn take(&mut self, of: V::Mask, flux: Plane<V>, moved: &Moved<V>) {
        self.from = Plane::choose(of, flux, self.from);
        for k in 0..MOST_CELLS {
            self.away[k] = Plane::choose(of, moved.away[k], self.away[k]);
            self.slides[k] = (moved.slides[k] & of) | (self.slides[k] & !of);
        }
        self.set_tangent(of, moved.tangent);
    }

    /// By how much in Wb a step may be off for what its cells do: the path is no parabola, and the core was evaluated `off` in Wb
    /// from where it ended. `rise`: of the flux at both ends, in Wb a step.
    #[inline(always)]
    pub fn error(&self, change: Plane<V>, rise: [Plane<V>; 2], off: Plane<V>) -> V {
        let areas = [rise[0].cross(change) * (1.0 / 6.0), change.cross(rise[1]) * (1.0 / 6.0)];
        let (untold, area) = ((areas[0] - areas[1]).abs(), areas[0].abs());
        let (length, off) = (change.dot(change), off.dot(off));
        let mut all = V::of(0.0);
        for k in 0..MOST_CELLS {
            let (reach, per_reach) = (self.reach[k], V::of(1.0) / self.reach[k]);
            // Of the formula's own error, and of an area that is not right, what turns n.
            let apart =
                (length * per_reach * per_reach * (1.0 / (4 * PARTS * PARTS) as f64)).least(V::of(1.0));
            let turned = (untold + area * apart * (1.0 / (PARTS * PARTS) as f64)) * per_reach;
            let linear = off * per_reach * 2.0;
            let both = turned.least(reach + reach) + linear.least(reach + reach);
            all = all + V::only(self.slides[k], both * self.stiffness[k] * self.inductance);
        }
        all
    }

    /// The cells' energy over 3/2, in J.
    pub fn energy(&self, lane: usize, flux: Plane<V>) -> f64 {
        let away = self.away_at(flux, None);
        let stored = |k: usize| self.stiffness[k].get(lane) * away[k].dot(away[k]).get(lane) / 2.0;
        (0..MOST_CELLS).map(stored).sum()
    }

    /// What cells turn into heat over 3/2, in W, where the flux in Wb rises so in V.
    pub fn loss(&self, lane: usize, away: &Elastic<V>, rise: Plane<V>) -> f64 {
        let lost = |k: usize| {
            let sliding = V::only(self.slides[k], self.stiffness[k] * away[k].dot(rise));
            sliding.get(lane)
        };
        (0..MOST_CELLS).map(lost).sum()
    }

    /// How what is pinned moves, in V, where the flux rises so.
    #[inline(always)]
    pub fn pinned_rise(&self, away: &Elastic<V>, rise: Plane<V>) -> Elastic<V> {
        let mut moves = [none(); MOST_CELLS];
        for k in 0..MOST_CELLS {
            let n = direction(&away[k]);
            moves[k] = Plane::choose(self.slides[k], n * n.dot(rise), none());
        }
        moves
    }
}

#[cfg(test)]
#[path = "play_tests.rs"]
mod tests;
