//! Iron bridges of a magnet-assisted reluctance rotor, after Lelli et al. 2024,
//! <https://doi.org/10.1109/ICEM60801.2024.10700403>.

use standstill_interface::Dq;
use standstill_numeric::{Lane, Symmetric, power};

use super::Magnetics;

/// Thin iron ribs beside the magnets, which the magnets saturate. With d the magnet axis,
/// ```text
/// ψ_b = ψ_d − ψ_n,  s² = ψ_b² + k_q ψ_q²,  G = a_b s^W / (1 + a_bp s^W)
/// i_d += G ψ_b,  i_q += k_q G ψ_q
/// ```
/// the gradient of `∫₀ˢ G(s) s ds`. The ribs draw current only away from ψ_n, the flux that the magnet would drive
/// through them.
///
/// **Temperature.** The energy is that of a barrier between whose two sides there is a magnetic potential `F = G ψ_b`:
/// the magnet lies across it, `ψ_m = ψ_n + F/R_m` with remanent flux ψ_n and reluctance R_m, and so does the rib, whose
/// flux f(F) depends on its iron only. From `ψ_d = ψ_m + f(F)` follows `ψ_b = F/R_m + f(F)`: the law between F and ψ_b,
/// hence G, does not depend on the magnet's strength. Without potential the rib is not saturated and shorts the barrier
/// (G = 0 at ψ_b = 0); the magnet saturates it as far as its flux ψ_n has to come back through it. A warmer magnet is
/// therefore a smaller ψ_n in the same law: it saturates the rib less, and L_d grows. A winding current that opposes
/// the magnet has the opposite effect and saturates the rib further.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IronBridge<T = f64> {
    /// a_b in A/Wb^(W+1).
    pub strength: T,
    /// a_bp in 1/Wb^W.
    pub saturation: T,
    /// k_q.
    pub q_share: T,
    /// ψ_n in Wb.
    pub magnet_flux: T,
    /// W.
    pub exponent: u8,
}

/// Abscissae and weights of Gauss–Legendre quadrature with 8 points on [−1, 1], the positive half.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Panels of the quadrature: the integrand is smooth, this leaves rounding only.
const PANELS: u8 = 8;

impl<T: Lane> IronBridge<T> {
    /// Returns G and s dG/ds, both in 1/H.
    #[inline(always)]
    fn conductance(&self, s: T) -> (T, T) {
        let p = power(s, self.exponent);
        let denominator = p * self.saturation + 1.0;
        let g = p * self.strength / denominator;
        (g, g * f64::from(self.exponent) / denominator)
    }

    #[inline(always)]
    fn coordinates(&self, flux: Dq<T>) -> (T, T) {
        let b = flux.d - self.magnet_flux;
        (b, (b * b + flux.q * self.q_share * flux.q).sqrt())
    }

    /// Returns the current and inverse inductance, of any number of machines.
    #[inline(always)]
    pub(super) fn evaluate(&self, flux: Dq<T>) -> (Dq<T>, Symmetric<T>) {
        let (b, s) = self.coordinates(flux);
        let k = self.q_share;
        let (g, slope) = self.conductance(s);
        // ∂G/∂ψ_d = G' ψ_b/s and ∂G/∂ψ_q = G' k_q ψ_q/s; at s = 0 all of it vanishes.
        let bend = T::choose(s.above(T::of(0.0)), slope / (s * s), T::of(0.0));
        let along_q = flux.q * k;
        (
            Dq::new(g * b, g * along_q),
            Symmetric::new(g + bend * b * b, bend * b * along_q, g * k + bend * along_q * along_q),
        )
    }
}

impl IronBridge {
    /// Returns the current in A of the ribs at ψ_b in Wb, on the d-axis.
    pub(super) fn along_d(&self, flux: f64) -> f64 {
        self.conductance(flux.abs()).0 * flux
    }
}

impl Magnetics for IronBridge {
    fn energy(&self, flux: Dq<f64>) -> f64 {
        let (_, s) = self.coordinates(flux);
        let half = s / f64::from(PANELS) / 2.0;
        let integrand = |s: f64| self.conductance(s).0 * s;
        (0..PANELS)
            .map(|panel| {
                let middle = half * (2.0 * f64::from(panel) + 1.0);
                let pair =
                    |(x, w): &(f64, f64)| w * (integrand(middle - half * x) + integrand(middle + half * x));
                half * GAUSS.iter().map(pair).sum::<f64>()
            })
            .sum()
    }

    fn current_and_inverse_inductance(&self, flux: Dq<f64>) -> (Dq<f64>, Symmetric) {
        self.evaluate(flux)
    }
}
