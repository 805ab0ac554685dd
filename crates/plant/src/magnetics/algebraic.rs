//! Algebraic saturation after Hinkkanen et al. 2017, <https://doi.org/10.1109/TIA.2016.2644624>.

use standstill_interface::Dq;
use standstill_numeric::{Lane, Symmetric, power};

use super::{IronBridge, Magnetics};

/// ```text
/// i_d = [a_d0 + a_dd |ψ_d|^S + a_dq/(V+2) |ψ_d|^U |ψ_q|^(V+2)] ψ_d − i_f
/// i_q = [a_q0 + a_qq |ψ_q|^T + a_dq/(U+2) |ψ_d|^(U+2) |ψ_q|^V] ψ_q
/// ```
/// the gradient of
/// ```text
/// W = a_d0/2 ψ_d² + a_dd/(S+2) |ψ_d|^(S+2) + a_q0/2 ψ_q² + a_qq/(T+2) |ψ_q|^(T+2)
///     + a_dq/((U+2)(V+2)) |ψ_d|^(U+2) |ψ_q|^(V+2) − i_f ψ_d
/// ```
/// Fluxes in Wb, currents in A. The exponents are whole numbers, as in the published fits.
///
/// A motor with magnets in its reluctance rotor adds an [`IronBridge`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Algebraic<T = f64> {
    /// a_d0 in 1/H.
    pub d: T,
    /// a_dd in A/Wb^(S+1).
    pub dd: T,
    /// S.
    pub d_exponent: u8,
    /// a_q0 in 1/H.
    pub q: T,
    /// a_qq in A/Wb^(T+1).
    pub qq: T,
    /// T.
    pub q_exponent: u8,
    /// a_dq in A/Wb^(U+V+3).
    pub cross: T,
    /// U.
    pub cross_d_exponent: u8,
    /// V.
    pub cross_q_exponent: u8,
    /// i_f in A, the magnet as a current that magnetises the d-axis.
    pub magnet_current: T,
    /// Iron bridges beside the magnets; none for a rotor without them.
    pub bridge: Option<IronBridge<T>>,
}

impl Algebraic {
    /// Scales the magnets, without changing the iron, such that the flux without current is `flux` in Wb, along d. The
    /// magnets appear in i_f and ψ_n, which are both in proportion to the remanence. Returns none if no such factor is
    /// found.
    ///
    /// With a factor k, ribs and magnet give the current `k i_f + g(k ψ_n − ψ)`, with `g(b) = G(|b|) b`, and the iron
    /// draws i(ψ). The current never falls with k, so bisection finds the k at which both are equal. For `ψ → 0`, k
    /// goes to zero: no magnet, ribs not saturated, `L_d = 1/a_d0`.
    pub(super) fn with_flux(&self, flux: f64) -> Option<Self> {
        let at = |factor: f64| Self {
            magnet_current: factor * self.magnet_current,
            bridge: self
                .bridge
                .map(|bridge| IronBridge { magnet_flux: factor * bridge.magnet_flux, ..bridge }),
            ..*self
        };
        let iron = Self { magnet_current: 0.0, bridge: None, ..*self }.current(Dq::new(flux, 0.0)).d;
        let short = |factor: f64| {
            let Self { magnet_current, bridge, .. } = at(factor);
            magnet_current + bridge.map_or(0.0, |b| b.along_d(b.magnet_flux - flux)) < iron
        };
        let (mut low, mut high) = (0.0, 1.0);
        while short(high) {
            (low, high) = (high, 2.0 * high);
            if high > 1e6 {
                return None;
            }
        }
        for _ in 0..200 {
            let middle = (low + high) / 2.0;
            if short(middle) { low = middle } else { high = middle }
        }
        Some(at(high))
    }
}

impl<T: Lane> Algebraic<T> {
    /// Returns all exponents, that of the bridge last.
    pub(super) fn exponents(&self) -> ([u8; 4], Option<u8>) {
        let Self { d_exponent, q_exponent, cross_d_exponent, cross_q_exponent, .. } = *self;
        let bridge = self.bridge.map(|bridge| bridge.exponent);
        ([d_exponent, q_exponent, cross_d_exponent, cross_q_exponent], bridge)
    }

    /// Returns the current and inverse inductance, of any number of machines.
    #[inline(always)]
    pub(super) fn evaluate(&self, flux: Dq<T>) -> (Dq<T>, Symmetric<T>) {
        let (d, q) = (flux.d.abs(), flux.q.abs());
        let (s, t) = (f64::from(self.d_exponent), f64::from(self.q_exponent));
        let d_term = power(d, self.d_exponent) * self.dd;
        let q_term = power(q, self.q_exponent) * self.qq;
        let (mut slope_d, mut slope_q) = (d_term + self.d, q_term + self.q);
        let mut gamma = Symmetric::new(d_term * (s + 1.0) + self.d, T::of(0.0), q_term * (t + 1.0) + self.q);
        if T::any(self.cross.abs().above(T::of(0.0))) {
            let (u, v) = (f64::from(self.cross_d_exponent), f64::from(self.cross_q_exponent));
            let (d_u, q_v) = (power(d, self.cross_d_exponent), power(q, self.cross_q_exponent));
            let cross = d_u * q_v * self.cross;
            let (along_d, along_q) = (cross * q * q * (1.0 / (v + 2.0)), cross * d * d * (1.0 / (u + 2.0)));
            slope_d = slope_d + along_d;
            slope_q = slope_q + along_q;
            gamma.xx = gamma.xx + along_d * (u + 1.0);
            gamma.yy = gamma.yy + along_q * (v + 1.0);
            gamma.xy = cross * flux.d * flux.q;
        }
        let mut current = Dq::new(slope_d * flux.d - self.magnet_current, slope_q * flux.q);
        if let Some(bridge) = self.bridge {
            let (more_current, more_gamma) = bridge.evaluate(flux);
            current = current + more_current;
            gamma =
                Symmetric::new(gamma.xx + more_gamma.xx, gamma.xy + more_gamma.xy, gamma.yy + more_gamma.yy);
        }
        (current, gamma)
    }
}

impl Magnetics for Algebraic {
    fn energy(&self, flux: Dq<f64>) -> f64 {
        let (d, q) = (flux.d.abs(), flux.q.abs());
        let (s, t) = (f64::from(self.d_exponent), f64::from(self.q_exponent));
        let (u, v) = (f64::from(self.cross_d_exponent), f64::from(self.cross_q_exponent));
        self.d / 2.0 * d * d
            + self.dd / (s + 2.0) * power(d, self.d_exponent) * d * d
            + self.q / 2.0 * q * q
            + self.qq / (t + 2.0) * power(q, self.q_exponent) * q * q
            + self.cross / ((u + 2.0) * (v + 2.0))
                * power(d, self.cross_d_exponent)
                * d
                * d
                * power(q, self.cross_q_exponent)
                * q
                * q
            - self.magnet_current * flux.d
            + self.bridge.map_or(0.0, |bridge| bridge.energy(flux))
    }

    fn kinks(&self) -> [bool; 2] {
        // |ψ|^n ψ with an even n is a polynomial; with an odd one its derivative of order n + 1 jumps. Beyond the
        // sixth that is smoother than a method of order five can see.
        let rough = |factor: f64, exponent: u8| factor != 0.0 && exponent % 2 == 1 && exponent < 6;
        let cross = |exponent| rough(self.cross, exponent);
        [
            rough(self.dd, self.d_exponent) || cross(self.cross_d_exponent),
            rough(self.qq, self.q_exponent) || cross(self.cross_q_exponent),
        ]
    }

    fn current_and_inverse_inductance(&self, flux: Dq<f64>) -> (Dq<f64>, Symmetric) {
        self.evaluate(flux)
    }
}
