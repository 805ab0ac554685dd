//! Gains of the current sensors relative to each other, from a train.

use standstill_interface::{Abc, Real};

use super::{Derived, Slot};

/// Compares the current sensors: the current into one phase equals the current out of another.
///
/// `r_AB = ln(rms i_A / rms i_B) = ln g_A − ln g_B`, likewise for the other lines, give `ln g_A = (r_AB − r_CA)/3` and
/// so on: the gains relative to their mean, without additional pulses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GainComparison<T> {
    /// Σ i² of each line's first and second phase, in A².
    squares: [[T; 2]; 3],
    /// Σ of the products of both in A²; `count`, the next field: number of products.
    products: [T; 3],
    count: [T; 3],
}

impl<T: Real> GainComparison<T> {
    pub fn new() -> Self {
        let zero = T::zero();
        Self { squares: [[zero; 2]; 3], products: [zero; 3], count: [zero; 3] }
    }

    pub fn add(&mut self, slot: Slot, (from, to): (T, T)) {
        let (first, second) = if slot.forward { (from, to) } else { (to, from) };
        let [a, b] = &mut self.squares[slot.line];
        *a = *a + first * first;
        *b = *b + second * second;
        self.products[slot.line] = self.products[slot.line] + first * second;
        self.count[slot.line] = self.count[slot.line] + T::one();
    }

    /// Returns for each line the noise of one sensor in A rms, from the part of the two sensors' difference that a gain
    /// ratio does not explain, and the rms current. If pairs (x, y) lie on a straight line except for noise, the
    /// smaller eigenvalue of Σ (x, y)(x, y)ᵀ is that of the noise.
    pub fn residuals(&self) -> [(T, T); 3] {
        let two = T::of(2.0);
        core::array::from_fn(|k| {
            let ([a, b], ab) = (self.squares[k], self.products[k]);
            let half = (a + b) / two;
            let larger = half + ((a - b) / two).hypot(ab);
            // The product of both is the determinant; half less the root would lose its digits.
            let smaller =
                if larger > T::zero() { (a * b - ab * ab).max(T::zero()) / larger } else { T::zero() };
            let freedom = (self.count[k] - T::one()).max(T::one());
            ((smaller / freedom).sqrt(), (half / freedom).sqrt())
        })
    }

    /// Returns r of each line and its variance by noise; `variance`: variance of a reading in A². The variance of r is
    /// infinite if a sensor showed nothing.
    pub fn measured(&self, variance: T) -> ([T; 3], [T; 3]) {
        let zero = T::zero();
        let of = |[first, second]: [T; 2]| {
            if first > zero && second > zero {
                let noise = variance * (first.recip() + second.recip());
                ((first / second).ln() / T::of(2.0), noise)
            } else {
                (zero, T::infinity())
            }
        };
        let [ab, bc, ca] = self.squares.map(of);
        ([ab.0, bc.0, ca.0], [ab.1, bc.1, ca.1])
    }

    /// Returns the most likely r of each line and its variance, from a measured r with the variance `noise` and from
    /// gains known with the standard deviation `tolerance`. The noisier a measurement is, the less it counts.
    pub fn known(ratios: [T; 3], noise: [T; 3], tolerance: T) -> ([T; 3], [T; 3]) {
        let prior = T::of(2.0) * tolerance * tolerance;
        let share = noise.map(|noise| if prior > T::zero() { prior / (prior + noise) } else { T::zero() });
        (
            core::array::from_fn(|k| ratios[k] * share[k]),
            core::array::from_fn(|k| (T::one() - share[k]) * prior),
        )
    }

    /// Returns the gains of the phases' sensors relative to their mean, from the lines' r.
    pub fn gains([ab, bc, ca]: [T; 3]) -> Abc<T> {
        let third = T::of(3.0);
        Abc::new(((ab - ca) / third).exp(), ((bc - ab) / third).exp(), ((ca - bc) / third).exp())
    }

    /// Returns the logarithm of the mean gain of each line's two sensors.
    ///
    /// A phase without a sensor shows the value of its line's other phase. Then the line with two sensors gives the
    /// ratio of their gains, and each of the other two lines has one gain.
    pub fn line_gains(ratios: [T; 3], derived: Derived) -> [T; 3] {
        let [ab, bc, ca] = ratios;
        if let Derived::One(phase) = derived {
            let between = (phase as usize + 1) % 3;
            let half = ratios[between] / T::of(2.0);
            let mut gains = [T::zero(); 3];
            gains[(between + 1) % 3] = -half;
            gains[(between + 2) % 3] = half;
            return gains;
        }
        let six = T::of(6.0);
        [(bc - ca) / six, (ca - ab) / six, (ab - bc) / six]
    }

    /// Returns the derivative of each line's mean gain with respect to the r of one line.
    pub fn line_gain_slopes(line: usize, derived: Derived) -> [T; 3] {
        let mut ratios = [T::zero(); 3];
        ratios[line] = T::one();
        Self::line_gains(ratios, derived)
    }
}
