//! The two eigenmodes in which terminals with a capacitance oscillate with a winding (symbols: `ringing.rs`).

#[cfg(test)]
mod tests;

use standstill_numeric::{Symmetric, Wide};

use crate::physics::plane::Plane;

/// Smallest squared frequency of a ringing mode, relative to the mean of both modes' squared frequencies; a smaller
/// value is a rounding error and counts as zero.
const RINGS: f64 = 1e-9;

/// The two eigenmodes of machines side by side.
#[derive(Clone, Copy, Debug)]
pub struct Modes<V> {
    /// Matrix QᵀG: maps the change of the flux in Wb to ξ; the columns of its transpose map the modal currents I to the current in A.
    pub to: [Plane<V>; 2],
    /// Matrix QᵀG⁻¹: maps the current in A to the modal currents I; its transpose maps ξ to the flux in Wb.
    pub back: [Plane<V>; 2],
    /// Square of each mode's angular frequency, ω² in 1/s².
    pub square: [V; 2],
    /// Matrix QᵀG R G Q in 1/s, with the resistance R in Ω: its diagonal damps the modes, the other elements couple them.
    pub damping: [[V; 2]; 2],
}

impl<V: Wide> Modes<V> {
    /// Finds the modes for this inverse inductance in 1/H, inverse capacitance of the terminals in 1/F, and
    /// resistance in Ω.
    #[inline(always)]
    pub fn of(gamma: Symmetric<V>, charging: Symmetric<V>, resistance: &Symmetric<V>) -> Self {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let root = gamma.determinant().sqrt();
        let scale = one / (gamma.xx + gamma.yy + root + root).sqrt();
        let g = Symmetric::new((gamma.xx + root) * scale, gamma.xy * scale, (gamma.yy + root) * scale);
        let inverse = g.inverse();
        // G K G.
        let columns = [Plane::new(g.xx, g.xy), Plane::new(g.xy, g.yy)];
        let charged = pair!(m => columns[m].through(charging));
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
        let to = pair!(m => axes[m].through(g));
        let back = pair!(m => axes[m].through(inverse));
        let dropped = pair!(m => to[m].through(*resistance));
        let damping =
            [[to[0].dot(dropped[0]), to[0].dot(dropped[1])], [to[1].dot(dropped[0]), to[1].dot(dropped[1])]];
        Self { to, back, square, damping }
    }

    /// Returns bounds on the oscillation of the phase currents and of the terminal potentials in the next `h` seconds, and the present
    /// values of that oscillation. `current` is the winding's current in A and `rise` its slope in A/s. `elastance` is the inverse
    /// capacitance of each terminal in 1/F. `leak` contains the rate in 1/s at which dividers discharge the terminals, and the voltage in V
    /// that the terminals put on the winding.
    ///
    /// With the modal currents I, the matrix D ([`Self::damping`]) and η = I′ + D I, the amplitude of a mode is the root of I² +
    /// η²/ω². Resistance reduces the sum of both squared amplitudes, so neither amplitude exceeds the root of that sum. The
    /// coupling D₁₂ makes an amplitude grow by at most h |D₁₂| times that root. Dividers reduce the sum, too. With dividers,
    /// the winding's current oscillates about their current, `−γ/ω²` times the slow part of η.
    #[inline(always)]
    pub fn swing(
        &self,
        axes: &[Plane<V>; 3],
        elastance: V,
        [current, rise]: [Plane<V>; 2],
        leak: Option<(V, Plane<V>)>,
        h: V,
    ) -> Swing<V> {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let none = [zero; 3];
        let rings = pair!(m => self.square[m].above(zero));
        let per_square = pair!(m => V::only(rings[m], one / V::choose(rings[m], self.square[m], one)));
        let mut now = pair!(m => V::only(rings[m], self.back[m].dot(current)));
        if let Some((rate, floating)) = leak {
            let slow = pair!(m => {
                let met = self.damping[m][0] * now[0] + self.damping[m][1] * now[1];
                (self.back[m].dot(rise) + met - self.to[m].dot(floating)) * per_square[m] * rate
            });
            now = pair!(m => now[m] - slow[m]);
        }
        // The charge of a mode, η/ω².
        let charge = pair!(m => {
            let met = self.damping[m][0] * now[0] + self.damping[m][1] * now[1];
            (self.back[m].dot(rise) + met) * per_square[m]
        });
        let energy = pair!(m => now[m] * now[m] + charge[m] * charge[m] * self.square[m]);
        let both = (energy[0] + energy[1]).sqrt();
        let dropped = both * self.damping[0][1].abs() * h;
        let size = pair!(m => V::only(rings[m], (energy[m].sqrt() + dropped).least(both)));
        let mut swing = Swing {
            current: none,
            ahead: none,
            potential: none,
            away: none,
            modes: [Deviation::default(); 2],
        };
        for m in 0..2_usize {
            let in_potential = size[m] * per_square[m].sqrt() * elastance;
            for k in 0..3 {
                let share = axes[k].dot(self.to[m]);
                let mode = &mut swing.modes[m];
                mode.falls[k] = share * now[m];
                mode.most[k] = share.abs() * in_potential;
                mode.away[k] = share * charge[m] * elastance;
                swing.current[k] = swing.current[k] + share.abs() * size[m];
                swing.ahead[k] = swing.ahead[k] + mode.falls[k];
                swing.potential[k] = swing.potential[k] + mode.most[k];
                swing.away[k] = swing.away[k] + mode.away[k];
            }
        }
        swing
    }
}

/// Bounds of the oscillation of currents and potentials. See [`Modes::swing`].
#[derive(Clone, Copy, Debug)]
pub struct Swing<V> {
    /// Largest deviation of the phase currents from their slow parts, in A.
    pub current: [V; 3],
    /// Present deviation of the phase currents from their slow parts, in A.
    pub ahead: [V; 3],
    /// Largest deviation of the potentials from their slow parts, in V.
    pub potential: [V; 3],
    /// Present deviation of the potentials from their slow parts, in V.
    pub away: [V; 3],
    /// The part of each mode in these deviations of the potentials.
    pub modes: [Deviation<V>; 2],
}

/// Deviation of the potentials from their slow parts by one mode.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deviation<V> {
    /// Present deviation in V.
    pub away: [V; 3],
    /// The mode's current in A at each terminal; if it is positive, the deviation falls.
    pub falls: [V; 3],
    /// Largest deviation in V.
    pub most: [V; 3],
}

/// Square of the angle in rad up to which an oscillation has at most one extremum: the angle is a little less than π.
const ONCE: f64 = 8.0;

/// Share of the amplitude by which an oscillation may exceed the values at both ends of a step, because of saturation.
const BEYOND: f64 = 0.01;

impl<V: Wide> Deviation<V> {
    /// Returns the lowest and the highest deviation in V of terminal `k` in a step between two deviations; `turned`: square of the angle
    /// in rad by which the mode turns in the step. Each is at an end of the step, unless the oscillation has an extremum between.
    #[inline(always)]
    pub fn range([begin, end]: [&Self; 2], k: usize, turned: V) -> [V; 2] {
        let zero = V::of(0.0);
        let most = begin.most[k].greatest(end.most[k]);
        let far = turned.above(V::of(ONCE));
        let [from, to] = [begin.falls[k], end.falls[k]];
        let margin = most * BEYOND;
        let low = begin.away[k].least(end.away[k]) - margin;
        let high = begin.away[k].greatest(end.away[k]) + margin;
        let dips = far | from.above(zero) & zero.above(to);
        let peaks = far | zero.above(from) & to.above(zero);
        [V::choose(dips, zero - most, low), V::choose(peaks, most, high)]
    }
}
