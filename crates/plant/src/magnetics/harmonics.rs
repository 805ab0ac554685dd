//! Spatial harmonics: changes over the rotor angle beyond equations (1) and (2).
//!
//! A harmonic must not create energy. It is therefore not a correction of the inductances but a change of coordinates:
//! the core's energy is evaluated at
//! ```text
//! u = ψ₀ + A(θ) (ψ − ψ₀ − δ(θ)),   W(ψ, θ) = W₀(u)
//! ```
//! ψ₀ is the flux without current. From it follow, all consistent with one energy,
//! ```text
//! i = Aᵀ ∇W₀,   Γ = Aᵀ ∇²W₀ A,   ∂W/∂θ = ∇W₀ · (A' (ψ − ψ₀ − δ) − A δ')
//! ```
//! Γ stays positive definite for every A: a harmonic cannot make a core unstable. A is chosen such that without
//! saturation the inductances are exactly `L₀ + M(θ)`: with the Cholesky factors `L₀ = G₀ G₀ᵀ` and `L₀ + M = G Gᵀ`, `A
//! = G₀ G⁻¹`.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Lane, Symmetric};

use super::MagneticState;

/// Harmonics of winding and magnet over the rotor angle. All zero: none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Harmonics<T = f64> {
    /// L_4 in H: `L_4 cos 4θ` is added to the self-inductance of phase a, and so on, as slots and rotor bars do, and the
    /// same amplitude to the mutual inductances, `L_4 cos(4θ − 2φ_j − 2φ_k)` between phases at φ_j and φ_k. So equations
    /// (1) and (2) have it of L_B, and like L_B it is 3/2 L_4 in the plane. (In the self-inductances alone it would be a
    /// half.)
    pub inductance_4: T,
    /// Excess in H of phase a's self-inductance over that of the other phases, at any angle. Mutual inductances do not
    /// change, as with additional leakage of that phase. Along its axis, the inductance grows by 2/3 of the excess,
    /// across it by nothing.
    pub asymmetry: T,
    /// Amplitude in Wb of `ψ_5 cos 5θ`, which is added to the magnet's flux linkage of phase a.
    pub flux_5: T,
    /// Amplitude in Wb of `ψ_7 cos 7θ`, which is added to the magnet's flux linkage of phase a. In the rotor's frame,
    /// the fifth and seventh harmonics turn with 6θ.
    pub flux_7: T,
}

/// Lower triangular 2×2 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lower<T = f64> {
    pub(super) xx: T,
    pub(super) yx: T,
    pub(super) yy: T,
}

impl<T: Lane> Lower<T> {
    #[inline(always)]
    const fn new(xx: T, yx: T, yy: T) -> Self {
        Self { xx, yx, yy }
    }

    /// Returns the lower triangular G with `G Gᵀ = m`.
    #[inline(always)]
    fn cholesky(m: Symmetric<T>) -> Self {
        let xx = m.xx.sqrt();
        let yx = m.xy / xx;
        Self::new(xx, yx, (m.yy - yx * yx).sqrt())
    }

    #[inline(always)]
    fn inverse(self) -> Self {
        Self::new(T::of(1.0) / self.xx, -self.yx / (self.xx * self.yy), T::of(1.0) / self.yy)
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self::new(self.xx * other.xx, self.yx * other.xx + self.yy * other.yx, self.yy * other.yy)
    }

    /// Returns the lower triangular H with `H selfᵀ + self Hᵀ = m`.
    #[inline(always)]
    fn halves(self, m: Symmetric<T>) -> Self {
        let xx = m.xx / (self.xx + self.xx);
        let yx = (m.xy - self.yx * xx) / self.xx;
        Self::new(xx, yx, (m.yy * 0.5 - self.yx * yx) / self.yy)
    }

    #[inline(always)]
    fn negative(self) -> Self {
        Self::new(-self.xx, -self.yx, -self.yy)
    }

    #[inline(always)]
    fn apply(self, v: Dq<T>) -> Dq<T> {
        Dq::new(self.xx * v.d, self.yx * v.d + self.yy * v.q)
    }

    #[inline(always)]
    fn apply_transposed(self, v: Dq<T>) -> Dq<T> {
        Dq::new(self.xx * v.d + self.yx * v.q, self.yy * v.q)
    }

    /// Returns `selfᵀ m self`.
    #[inline(always)]
    fn congruent(self, m: Symmetric<T>) -> Symmetric<T> {
        let (row_x, row_y) = (m.xx * self.xx + m.xy * self.yx, m.xy * self.xx + m.yy * self.yx);
        Symmetric::new(self.xx * row_x + self.yx * row_y, self.yy * row_y, self.yy * m.yy * self.yy)
    }
}

/// The coordinates at one rotor angle, with their first and second derivatives over it.
struct Coordinates<T> {
    a: Lower<T>,
    a_slope: Lower<T>,
    a_bend: Lower<T>,
    shift: Dq<T>,
    shift_slope: Dq<T>,
}

/// Harmonics around the operating point of a core.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Distortion<T = f64> {
    pub(super) harmonics: Harmonics<T>,
    pub(super) rest: Dq<T>,
    pub(super) inductance: Symmetric<T>,
    pub(super) factor: Lower<T>,
}

impl<T: Lane> Harmonics<T> {
    /// Returns M(θ) in H with its first and second derivatives over θ. A 4θ term of the phases is a reflection that
    /// turns with −6θ in the rotor's frame. A difference of one phase is a reflection that is at rest in the stator's
    /// frame.
    #[inline(always)]
    fn inductance(&self, at: Heading<T>) -> [Symmetric<T>; 3] {
        let two = at.doubled();
        let six = two.tripled();
        let (four, odd) = (self.inductance_4 * 1.5, self.asymmetry / T::of(3.0));
        let reflection =
            |factor: T, cos: T, sin: T| Symmetric::new(cos * factor, sin * factor, -(cos * factor));
        let sum = |x: Symmetric<T>, y: Symmetric<T>| Symmetric::new(x.xx + y.xx, x.xy + y.xy, x.yy + y.yy);
        let value = sum(reflection(four, six.cos, -six.sin), reflection(odd, two.cos, -two.sin));
        let slope = sum(reflection(four * -6.0, six.sin, six.cos), reflection(odd * -2.0, two.sin, two.cos));
        let bend =
            sum(reflection(four * -36.0, six.cos, -six.sin), reflection(odd * -4.0, two.cos, -two.sin));
        [Symmetric::new(value.xx + odd, value.xy, value.yy + odd), slope, bend]
    }

    /// Returns δ(θ) in Wb and its slope over θ in Wb/rad.
    #[inline(always)]
    fn flux(&self, at: Heading<T>) -> (Dq<T>, Dq<T>) {
        let six = at.doubled().tripled();
        let (d, q) = (self.flux_7 + self.flux_5, self.flux_7 - self.flux_5);
        (Dq::new(six.cos * d, six.sin * q), Dq::new(six.sin * (d * -6.0), six.cos * (q * 6.0)))
    }
}

impl Harmonics {
    /// Returns the largest change of the inductances in H, in any direction at any angle.
    pub fn largest_inductance(&self) -> f64 {
        1.5 * self.inductance_4.abs() + 2.0 / 3.0 * self.asymmetry.abs()
    }

    /// Returns whether they are small enough for a core with this incremental inductance in H without current: at
    /// most half of it in any direction. From the whole of it on there would be angles without inductance.
    pub fn fit(&self, inductance: Symmetric) -> bool {
        self.largest_inductance() <= 0.5 * inductance.smaller_eigenvalue()
    }

    /// Returns whether there is any.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }
}

impl<T: Lane> Distortion<T> {
    /// Makes the harmonics of a core with the flux `rest` in Wb and the incremental inductance `inductance` in H
    /// without current. The harmonics must be smaller than the smaller eigenvalue of the inductance: see
    /// [`Harmonics::fit`].
    pub(super) fn new(harmonics: Harmonics<T>, rest: Dq<T>, inductance: Symmetric<T>) -> Self {
        Self { harmonics, rest, inductance, factor: Lower::cholesky(inductance) }
    }

    #[inline(always)]
    fn coordinates(&self, at: Heading<T>) -> Coordinates<T> {
        let [m, m_slope, m_bend] = self.harmonics.inductance(at);
        let l = self.inductance;
        let g = Lower::cholesky(Symmetric::new(m.xx + l.xx, m.xy + l.xy, m.yy + l.yy));
        // G Gᵀ = L₀ + M: G' Gᵀ + G G'ᵀ = M' and G'' Gᵀ + G G''ᵀ = M'' − 2 G' G'ᵀ.
        let p = g.halves(m_slope);
        let (xx, xy, yy) = (p.xx * p.xx, p.xx * p.yx, p.yx * p.yx + p.yy * p.yy);
        let p_slope =
            g.halves(Symmetric::new(m_bend.xx - (xx + xx), m_bend.xy - (xy + xy), m_bend.yy - (yy + yy)));
        // A = G₀ G⁻¹: A' = −A G' G⁻¹ and A'' = −(2 A' G' + A G'') G⁻¹.
        let back = g.inverse();
        let a = self.factor.times(back);
        let a_slope = a.times(p).times(back).negative();
        let (once, twice) = (a.times(p_slope), a_slope.times(p));
        let a_bend = Lower::new(
            once.xx + twice.xx + twice.xx,
            once.yx + twice.yx + twice.yx,
            once.yy + twice.yy + twice.yy,
        );
        let (shift, shift_slope) = self.harmonics.flux(at);
        Coordinates { a, a_slope, a_bend: a_bend.times(back).negative(), shift, shift_slope }
    }

    /// Returns the core's flux and the matrices of the transformation at a flux of the winding in Wb.
    #[inline(always)]
    pub(super) fn inwards(&self, flux: Dq<T>, at: Heading<T>) -> Inside<T> {
        let c = self.coordinates(at);
        let x = flux - self.rest - c.shift;
        let turning = c.a_slope.apply(x) - c.a.apply(c.shift_slope);
        // δ'' = −36 δ.
        let bend = c.a_bend.apply(x) - c.a_slope.apply(c.shift_slope + c.shift_slope)
            + c.a.apply(Dq::new(c.shift.d * 36.0, c.shift.q * 36.0));
        Inside { core_flux: self.rest + c.a.apply(x), a: c.a, a_slope: c.a_slope, turning, bend }
    }
}

/// The core behind the harmonics.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inside<T> {
    /// Flux u of the core in Wb.
    pub(super) core_flux: Dq<T>,
    a: Lower<T>,
    a_slope: Lower<T>,
    /// ∂u/∂θ at constant ψ, in Wb/rad, and ∂²u/∂θ².
    turning: Dq<T>,
    bend: Dq<T>,
}

impl<T: Lane> Inside<T> {
    /// Returns the winding's state over that of the core, with the magnet's change of temperature.
    #[inline(always)]
    pub(super) fn outwards(
        self,
        core_current: Dq<T>,
        hessian: Symmetric<T>,
        magnet: Dq<T>,
    ) -> MagneticState<T> {
        let Self { core_flux, a, a_slope, turning, bend } = self;
        let slope = Dq::new(core_current.d - magnet.d, core_current.q - magnet.q);
        MagneticState {
            current: a.apply_transposed(slope),
            inverse_inductance: a.congruent(hessian),
            energy_slope: slope.dot(turning),
            energy_bend: slope.dot(bend) + turning.dot(hessian.times_dq(turning)),
            current_slope: a_slope.apply_transposed(slope) + a.apply_transposed(hessian.times_dq(turning)),
            core_flux,
            core_current,
        }
    }
}

impl Distortion {
    /// Returns the flux u of the core at a flux ψ of the winding, both in Wb.
    pub(super) fn core_flux(&self, flux: Dq<f64>, at: Heading) -> Dq<f64> {
        let c = self.coordinates(at);
        self.rest + c.a.apply(flux - self.rest - c.shift)
    }

    /// Returns the flux in Wb without current.
    pub(super) fn rest(&self, at: Heading) -> Dq<f64> {
        self.rest + self.harmonics.flux(at).0
    }
}
