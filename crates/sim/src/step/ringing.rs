//! Terminals that ring with the winding, within a step.
//!
//! ```text
//!   dψ/dt = F + w         F = rail U + offset − R i,  w what the terminals without a conducting device put on the winding
//!   dw/dt = −K i          their charge
//!   i = i₀ + Γ₀ (ψ − ψ₀) + j(t)      j what is not linear, small and slow
//! ```
//! With Γ₀ as it was at the step's beginning this is two oscillators, which are found as the eigenvectors of G K G with
//! G = √Γ₀: `ξ = RᵀG (ψ − ψ₀)`, `η = RᵀG w`, `I = RᵀG⁻¹ i = ξ + J`,
//! ```text
//!   ξ′ = η + f,   η′ = −ω² I
//! ```
//! They are solved exactly for f and J that are cubics with the values and slopes at both ends. Where ω is zero this is the
//! quadrature of any other step. The winding's resistance damps: `f = f* − 2δ I`, and the damped oscillator is solved
//! exactly as well, where a step is longer than the damping can be left to the cubics.

use standstill_numeric::{Mask, Symmetric, Wide};

use super::hermite::Cubic as Over;
use super::stumpff::stumpff;
use super::two_derivative::Here;
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::plane::Plane;

/// From this square of the angle by which a mode turns in a step its damping is solved with it. Below, cubics do.
const TURNS: f64 = 0.25;

/// A mode rings where the square of its frequency is more than this share of the other's: the rest is rounding.
const RINGS: f64 = 1e-9;

/// The two modes of machines side by side.
#[derive(Clone, Copy, Debug)]
pub struct Modes<V> {
    /// RᵀG: from flux in Wb to ξ; the columns of its transpose from I to current in A.
    pub to: [Plane<V>; 2],
    /// RᵀG⁻¹: from current to I; its transpose from ξ to flux.
    pub back: [Plane<V>; 2],
    /// ω² in 1/s².
    pub square: [V; 2],
    /// RᵀG R G R: how one mode's current drops in the other's, in 1/s.
    damping: [[V; 2]; 2],
}

impl<V: Wide> Modes<V> {
    /// With this inverse inductance in 1/H, terminals that charge so in 1/F, and resistance in Ω.
    #[inline(always)]
    pub fn of(gamma: Symmetric<V>, charging: Symmetric<V>, resistance: &Symmetric<V>) -> Self {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let root = gamma.determinant().sqrt();
        let scale = one / (gamma.xx + gamma.yy + root + root).sqrt();
        let g = Symmetric::new((gamma.xx + root) * scale, gamma.xy * scale, (gamma.yy + root) * scale);
        let inverse = g.inverse();
        // G K G.
        let columns = [Plane::new(g.xx, g.xy), Plane::new(g.xy, g.yy)];
        let charged = columns.map(|column| column.through(charging));
        let (xx, xy, yy) =
            (columns[0].dot(charged[0]), columns[0].dot(charged[1]), columns[1].dot(charged[1]));
        let (mean, half) = ((xx + yy) * 0.5, (xx - yy) * 0.5);
        let radius = (half * half + xy * xy).sqrt();
        let apart = radius.above(mean * 1e-15);
        let safe = V::choose(apart, radius, one);
        let cos2 = V::choose(apart, half / safe, one);
        let sin2 = V::choose(apart, xy / safe, zero);
        // Half the angle, from whichever of cosine and sine is the larger.
        let large = ((cos2.abs() + 1.0) * 0.5).sqrt();
        let small = sin2 * 0.5 / large;
        let turned = zero.above(cos2);
        let cos = V::choose(turned, small, large);
        let sin = V::choose(turned, large, small);
        let low = mean - radius;
        let square = [mean + radius, V::choose(low.above(mean * RINGS), low, zero)];
        let first = Plane::new(cos, sin);
        let axes = [first, first.quarter_turn()];
        let to = axes.map(|axis| axis.through(g));
        let back = axes.map(|axis| axis.through(inverse));
        let dropped = to.map(|axis| axis.through(*resistance));
        let damping =
            [[to[0].dot(dropped[0]), to[0].dot(dropped[1])], [to[1].dot(dropped[0]), to[1].dot(dropped[1])]];
        Self { to, back, square, damping }
    }

    /// How far the phases' currents and the terminals' potentials swing about what is slow, and where in that they are: from a
    /// current in A and how fast it rises in A/s.
    #[inline(always)]
    pub fn swing(&self, axes: &[Plane<V>; 3], elastance: V, current: Plane<V>, rise: Plane<V>) -> Swing<V> {
        let zero = V::of(0.0);
        let none = [zero; 3];
        let mut swing = Swing { current: none, ahead: none, potential: none, away: none };
        for m in 0..2 {
            let rings = self.square[m].above(zero);
            let per_square = V::only(rings, V::of(1.0) / V::choose(rings, self.square[m], V::of(1.0)));
            let now = self.back[m].dot(current);
            let rise = self.back[m].dot(rise);
            let size = V::only(rings, (now * now + rise * rise * per_square).sqrt());
            let in_potential = size * per_square.sqrt() * elastance;
            for k in 0..3 {
                let share = axes[k].dot(self.to[m]);
                swing.current[k] = swing.current[k] + share.abs() * size;
                swing.ahead[k] = swing.ahead[k] + V::only(rings, share * now);
                swing.potential[k] = swing.potential[k] + share.abs() * in_potential;
                swing.away[k] = swing.away[k] + share * rise * per_square * elastance;
            }
        }
        swing
    }
}

/// How far currents and potentials swing. See [`Modes::swing`].
#[derive(Clone, Copy, Debug)]
pub struct Swing<V> {
    /// How far currents swing at most, in A.
    pub current: [V; 3],
    /// How far they are from what is slow, in A.
    pub ahead: [V; 3],
    /// How far potentials swing at most, in V.
    pub potential: [V; 3],
    /// How far they are from what is slow, in V.
    pub away: [V; 3],
}

/// A cubic over a step: a₀ + a₁ s + a₂ s² + a₃ s³ for s from 0 to 1.
type Cubic<V> = [V; 4];

/// From values and slopes per step at both ends.
#[inline(always)]
fn cubic<V: Wide>(value: [V; 2], slope: [V; 2]) -> Cubic<V> {
    let rise = value[1] - value[0];
    [value[0], slope[0], rise * 3.0 - slope[0] - slope[0] - slope[1], slope[0] + slope[1] - rise - rise]
}

/// What cannot be told of a cubic: as of the currents of any other step (`error.rs`).
#[inline(always)]
fn untold<V: Wide>(of: &Cubic<V>) -> V {
    let (second, third) = ((of[2] + of[3]).abs(), of[3].abs());
    third * third / (second + third + 1e-30)
}

/// Force and remainder at an end of a step.
#[derive(Clone, Copy, Debug)]
pub struct End<V> {
    /// F in V.
    pub force: Plane<V>,
    /// How fast it rises, in V/s.
    pub force_rise: Plane<V>,
    /// The current in A.
    pub current: Plane<V>,
    /// How fast it rises, in A/s.
    pub current_rise: Plane<V>,
    /// dψ/dt in V.
    pub flux_rise: Plane<V>,
    /// ψ − ψ₀ in Wb.
    pub flux: Plane<V>,
}

/// A step of the modes.
#[derive(Clone, Copy, Debug)]
pub struct Ringing<V> {
    /// The modes.
    pub modes: Modes<V>,
    /// Angles squared by which they turn in the whole step.
    pub turned: [V; 2],
    /// η per step at its beginning.
    velocity: [V; 2],
    /// Force per step, without what damps.
    force: [Cubic<V>; 2],
    /// J.
    remainder: [Cubic<V>; 2],
    /// δ times the step's length.
    damping: [V; 2],
    /// Of the first mode's mean current, what drops in the second one's; where that does not ring.
    across: V,
}

impl<V: Wide> Ringing<V> {
    /// The step of `h` seconds of which only its beginning is known: force and remainder go on as they begin. `w` in V at its
    /// beginning.
    #[inline(always)]
    pub fn ahead(modes: Modes<V>, h: V, w: Plane<V>, begin: &End<V>) -> Self {
        Self::new(modes, h, w, [begin, begin], |value, slope| [value[0], slope[0], V::of(0.0), V::of(0.0)])
    }

    /// The step of `h` seconds from one end to the other; `w` in V at its beginning.
    #[inline(always)]
    pub fn between(modes: Modes<V>, h: V, w: Plane<V>, ends: [&End<V>; 2]) -> Self {
        Self::new(modes, h, w, ends, cubic)
    }

    #[inline(always)]
    fn new(
        modes: Modes<V>,
        h: V,
        w: Plane<V>,
        ends: [&End<V>; 2],
        over: impl Fn([V; 2], [V; 2]) -> Cubic<V>,
    ) -> Self {
        let zero = V::of(0.0);
        let none: Cubic<V> = [zero; 4];
        let mut step = Self {
            modes,
            turned: [zero; 2],
            velocity: [zero; 2],
            force: [none; 2],
            remainder: [none; 2],
            damping: [zero; 2],
            across: zero,
        };
        let second_is_slow = !modes.square[1].above(zero);
        for m in 0..2 {
            let turned = modes.square[m] * h * h;
            let half = V::only(turned.above(V::of(TURNS)), modes.damping[m][m] * h * 0.5);
            let xi = ends.map(|end| modes.to[m].dot(end.flux));
            let xi_rise = ends.map(|end| modes.to[m].dot(end.flux_rise) * h);
            let modal = ends.map(|end| modes.back[m].dot(end.current));
            let modal_rise = ends.map(|end| modes.back[m].dot(end.current_rise) * h);
            let twice = half + half;
            // What drops of the first mode's current in the second, which does not ring, follows from its mean.
            let mut across = [zero; 2];
            let mut across_rise = [zero; 2];
            if m == 1 {
                step.across = V::only(second_is_slow, modes.damping[1][0] * h);
                across = ends.map(|end| modes.back[0].dot(end.current) * step.across);
                across_rise = ends.map(|end| modes.back[0].dot(end.current_rise) * h * step.across);
            }
            let force = [0, 1].map(|e: usize| modes.to[m].dot(ends[e].force) * h + twice * xi[e] + across[e]);
            let force_rise = [0, 1].map(|e: usize| {
                modes.to[m].dot(ends[e].force_rise) * h * h + twice * xi_rise[e] + across_rise[e]
            });
            let remainder = [0, 1].map(|e: usize| modal[e] - xi[e]);
            let remainder_rise = [0, 1].map(|e: usize| modal_rise[e] - xi_rise[e]);
            step.turned[m] = turned;
            step.velocity[m] = modes.to[m].dot(w) * h;
            step.force[m] = over(force, force_rise);
            step.remainder[m] = over(remainder, remainder_rise);
            step.damping[m] = half;
        }
        step
    }

    /// After a share of the step: ψ − ψ₀ in Wb, and the mean of the current since its beginning in A.
    #[inline(always)]
    pub fn after(&self, share: V) -> [Plane<V>; 2] {
        let zero = V::of(0.0);
        let (first, mean_first) = self.mode(0, share, zero);
        let (second, mean_second) = self.mode(1, share, mean_first * self.across * share);
        let [to, back] = [&self.modes.to, &self.modes.back];
        [back[0] * first + back[1] * second, to[0] * mean_first + to[1] * mean_second]
    }

    /// ξ and the mean of I of a mode after a share of the step; `dropped`: what drops of the other's current.
    #[inline(always)]
    fn mode(&self, m: usize, share: V, dropped: V) -> (V, V) {
        let scaled = |of: &Cubic<V>, first: V| {
            let [a, b, c, d] = *of;
            let (two, three) = (share * share, share * share * share);
            [a * first, b * share * first, c * two * first, d * three * first]
        };
        let mut force = scaled(&self.force[m], share);
        let mut remainder = scaled(&self.remainder[m], V::of(1.0));
        force[0] = force[0] - dropped;
        let turned = self.turned[m] * share * share;
        let damping = self.damping[m] * share;
        let velocity = self.velocity[m] * share;
        let damped = damping.above(V::of(0.0));
        let mut square = turned;
        let mut decay = V::of(1.0);
        if V::any(damped) {
            let grow = exponential(damping);
            decay = V::choose(damped, exponential(-damping), decay);
            let grown = |of: &Cubic<V>| {
                let [a, b, c, d] = *of;
                let end = a + b + c + d;
                let slope = b + c + c + d * 3.0;
                let grown = cubic([a, grow * end], [b + damping * a, grow * (slope + damping * end)]);
                [0, 1, 2, 3].map(|n: usize| V::choose(damped, grown[n], of[n]))
            };
            (force, remainder) = (grown(&force), grown(&remainder));
            square = turned - damping * damping;
        }
        let [c0, c1, c2, c3, c4, c5] = stumpff(square);
        // ∫ cos and ∫ sin of the rest of the step over the powers of time.
        let cosines = [c1, c2, c3 * 2.0, c4 * 6.0];
        let sines = [c2, c3, c4 * 2.0, c5 * 6.0];
        let sum = |of: &Cubic<V>, with: &[V; 4]| {
            of[0] * with[0] + of[1] * with[1] + of[2] * with[2] + of[3] * with[3]
        };
        let pull: Cubic<V> = [0, 1, 2, 3].map(|n: usize| turned * remainder[n] + damping * force[n]);
        let flux = c1 * velocity + sum(&force, &cosines) - sum(&pull, &sines);
        // I integrated: as a polynomial where that is exact, else by what the charge has done.
        let mut mean = c2 * velocity + sum(&force, &sines) + sum(&remainder, &cosines);
        if V::any(damped) {
            let speed = c0 * velocity - square * sum(&force, &sines) - sum(&pull, &cosines);
            let end = decay * (speed + damping * flux);
            let safe = V::choose(damped, turned, V::of(1.0));
            mean = V::choose(damped, (velocity - end) / safe, mean);
        }
        (flux * decay, mean)
    }

    /// What of a lane's mode oscillates within the step: what I is without the polynomial about which it swings. None where it turns
    /// so little that cubics follow it.
    pub fn oscillation(&self, lane: usize, m: usize) -> Option<Oscillation> {
        let turned = self.turned[m].get(lane);
        if turned <= TURNS {
            return None;
        }
        let [force, j] = [&self.force[m], &self.remainder[m]].map(|of| of.each_ref().map(|a| a.get(lane)));
        let damping = self.damping[m].get(lane);
        // I″ + 2 y I′ + θ² I = f′ + J″ + 2 y J′ = s₀ + s₁ s + s₂ s², solved by a polynomial p.
        let s = [
            force[1] + 2.0 * j[2] + 2.0 * damping * j[1],
            2.0 * force[2] + 6.0 * j[3] + 4.0 * damping * j[2],
            3.0 * force[3] + 6.0 * damping * j[3],
        ];
        let second = s[2] / turned;
        let first = (s[1] - 4.0 * damping * second) / turned;
        let zeroth = (s[0] - 2.0 * damping * first - 2.0 * second) / turned;
        let angle = (turned - damping * damping).sqrt();
        let away = j[0] - zeroth;
        let rise = self.velocity[m].get(lane) + force[0] + j[1] - first;
        Some(Oscillation { phasor: [away, -(rise + damping * away) / angle], turns: [-damping, angle] })
    }

    /// What a step may be off in Wb as far as force and remainder are no cubics.
    #[inline(always)]
    pub fn error(&self) -> V {
        let mut all = V::of(0.0);
        for m in 0..2 {
            let size = self.modes.back[m].x.abs() + self.modes.back[m].y.abs();
            let turned = self.turned[m];
            let of_remainder = turned / (turned.sqrt() + 1.0);
            let both = untold(&self.force[m]) + of_remainder * untold(&self.remainder[m]);
            all = all + size * both;
        }
        all
    }
}

/// Re z e^(σ s), s from 0 to 1 over a step.
#[derive(Clone, Copy, Debug)]
pub struct Oscillation {
    /// z.
    pub phasor: [f64; 2],
    /// σ.
    pub turns: [f64; 2],
}

/// e^x for |x| up to a half and somewhat more: of Taylor's series what counts.
#[inline(always)]
fn exponential<V: Wide>(x: V) -> V {
    let mut sum = V::of(1.0);
    let mut n = 16.0;
    while n > 0.5 {
        sum = x * sum * (1.0 / n) + 1.0;
        n -= 1.0;
    }
    sum
}

/// Terminals within a step that was tried.
#[derive(Clone, Copy, Debug)]
pub struct Floating<V: Wide> {
    /// How they ring.
    pub ringing: Ringing<V>,
    /// Their potentials in V at both ends, and how fast they rise, in V a step.
    pub potential: [[V; 3]; 2],
    /// See `potential`.
    pub rise: [[V; 3]; 2],
    /// Between which potentials in V no device of a leg conducts, at both ends.
    pub range: [[[V; 2]; 3]; 2],
    /// Legs that swing within their modes, however often in the step.
    pub safe: [V::Mask; 3],
}

/// The square of the angle by which a mode may turn in a step where a swing may end a leg's mode: up to there the cubics of
/// currents and potentials say when.
const SEEN: f64 = 0.36;

/// The same where eddy currents lag behind what rings: up to there the cubic of the flux is as exact as all else.
const LAGGED: f64 = 0.09;

impl<V: Wide> Floating<V> {
    /// Of a step of `h` seconds between two places, where the machines change so and the devices carry these currents in A.
    #[inline(always)]
    pub fn new(
        machine: &Machine<V>,
        legs: &Conducting<V>,
        places: [&Here<V>; 2],
        change: [&Change<V>; 2],
        phases: &[[V; 3]; 2],
        h: V,
        ringing: Ringing<V>,
    ) -> Self {
        let zero = V::of(0.0);
        let elastance = machine.legs.elastance.unwrap_or(zero);
        // What lags behind by eddy currents is not part of the oscillators: cubics must follow.
        let may_turn = if machine.circuits.eddies().is_some() { 0 } else { u32::MAX };
        let mut safe = [V::Mask::of_bits(may_turn); 3];
        let range =
            places.map(|here| [0, 1, 2].map(|k: usize| machine.legs.range(&legs.on[k]).at(here.state.link)));
        for (e, here) in places.into_iter().enumerate() {
            let axes = &machine.legs.axes;
            let swing = ringing.modes.swing(axes, elastance, here.at.current, change[e].current);
            for k in 0..3 {
                let carried = legs.leg[k].direction * (phases[e][k] - swing.ahead[k]) - swing.current[k];
                let middle = here.state.potential[k] - swing.away[k];
                let [low, high] = range[e][k];
                let held = (middle - low).least(high - middle) - swing.potential[k];
                safe[k] = safe[k] & V::choose(legs.flows[k], carried, held).above(zero);
            }
        }
        let rise = change_of_potential(machine, legs, places, h);
        Self { ringing, potential: places.map(|here| here.state.potential), rise, range, safe }
    }

    /// Above 1 where a leg's mode may end in a step that is too long to say when, or eddy currents lag behind in one.
    #[inline(always)]
    pub fn too_long(&self, lagged: bool) -> V {
        let most = if lagged { LAGGED } else { SEEN };
        let turned = self.ringing.turned[0].greatest(self.ringing.turned[1]) * (1.0 / most);
        let all_safe = self.safe[0] & self.safe[1] & self.safe[2];
        V::choose(all_safe, V::of(0.0), turned * turned)
    }

    /// How far a terminal's potential is from its lower and its upper bound in V over the step.
    #[inline(always)]
    pub fn sides(&self, k: usize) -> [Over<V>; 2] {
        let [begin, end] = [self.range[0][k], self.range[1][k]];
        let side = |of: usize, sign: f64| {
            let bounds = [begin[of], end[of]];
            // Bounds move with the link, in a step about evenly.
            let moved = bounds[1] - bounds[0];
            Over {
                value: [0, 1].map(|e: usize| (self.potential[e][k] - bounds[e]) * sign),
                slope: [0, 1].map(|e: usize| (self.rise[e][k] - moved) * sign),
            }
        };
        [side(0, 1.0), side(1, -1.0)]
    }
}

/// How fast potentials rise, in V a step.
#[inline(always)]
fn change_of_potential<V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    places: [&Here<V>; 2],
    h: V,
) -> [[V; 3]; 2] {
    places.map(|here| machine.legs.charged(legs, here.at.current * h))
}
