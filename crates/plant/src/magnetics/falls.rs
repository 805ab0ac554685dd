//! A core from measurements with an LCR meter: the decrease of the inductances at rated current.
//!
//! Along d, the inverse inductance Γ = ∂i_d/∂ψ_d is known at three currents: without current, where it is 1/L_d, and at
//! ±rated current. Over the flux in units of L_d I, with `ψ_d = ψ_m + δ L_d I`, it is
//! ```text
//! g(δ) = 1 + A [w(t) − w(t₀)],  t = (δ + m)/τ,  w(t) = dv/dt,  v(t) = t |t|ⁿ / (1 + |t|ⁿ)
//! ```
//! the law of an [`IronBridge`] with W = n, `a_bp = 1/σⁿ` and `a_b = A/(L_d σⁿ)`, where `σ = τ L_d I`, about the flux
//! `ψ_n = ψ_m − m L_d I`. At ψ_n the iron is not saturated. On both sides it saturates alike, first with the n-th power
//! of the flux, then towards a constant. Iron without flux is not saturated, so ψ_n is zero if the measurements allow
//! it: `m = ψ_m/(L_d I)`. The remaining numbers, A and τ, follow from the inductances at +I and at −I, where `i/I = ∫₀ᵟ
//! g = ±1`.
//!
//! Along q, `i_q = (1/L_q + a_qq ψ_q²) ψ_q` in closed form: with `y = a_qq ψ_q² L_q` at rated current, `1 + 3 y = 1/(1
//! − fall)` and `ψ_q = L_q I/(1 + y)`.

use standstill_numeric::{exp, ln, power, root};
use thiserror::Error;

use super::{Algebraic, IronBridge};

/// Decrease of incremental inductances from no current to rated current, as a share; negative for an increase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Falls {
    /// L_d at rated current along +d, with the magnet.
    pub d: f64,
    /// Decrease of L_d at rated current along −d, against the magnet. None: that of iron that saturates alike on both
    /// sides.
    pub minus_d: Option<f64>,
    /// L_q at rated current along q.
    pub q: f64,
}

/// A fall that no core has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the fall along {key} must be {needed}")]
pub struct FallsError {
    /// The fall: `d`, `minus_d` or `q`.
    pub key: &'static str,
    /// The requirement, in words.
    pub needed: &'static str,
}

/// Smallest allowed Γ, as a share of Γ without current: unsaturated iron has at most four times the inductance that it
/// has under the magnet's flux.
const LEAST: f64 = 0.25;

/// The largest exponent.
const STEEPEST: u8 = 40;

/// Exponent for cores whose measurements do not determine it; published fits have 4 to 6.
const USUAL: u8 = 6;

/// Γ along d in units of its value without current, over flux in units of L_d I.
#[derive(Clone, Copy, Debug)]
struct Knee {
    /// n, even: smooth everywhere.
    exponent: u8,
    /// m: distance of the flux without current from the flux at which the iron is not saturated.
    rest: f64,
    /// τ.
    width: f64,
    /// A.
    height: f64,
}

impl Knee {
    /// Makes a law so wide that it equals a power of the flux to twelve digits.
    fn power(exponent: u8, rest: f64) -> Self {
        let width = (rest + 1.0) * exp(ln(1e12) / f64::from(exponent));
        Self { exponent, rest, width, height: 0.0 }
    }

    fn v(&self, t: f64) -> f64 {
        let p = power(t.abs(), self.exponent);
        t * p / (1.0 + p)
    }

    fn w(&self, t: f64) -> f64 {
        let p = power(t.abs(), self.exponent);
        p * (f64::from(self.exponent) + 1.0 + p) / ((1.0 + p) * (1.0 + p))
    }

    fn t(&self, flux: f64) -> f64 {
        (flux + self.rest) / self.width
    }

    /// Returns g.
    fn slope(&self, flux: f64) -> f64 {
        1.0 + self.height * (self.w(self.t(flux)) - self.w(self.t(0.0)))
    }

    /// Returns i/I.
    fn current(&self, flux: f64) -> f64 {
        let (t, rest) = (self.t(flux), self.t(0.0));
        flux + self.height * (self.width * (self.v(t) - self.v(rest)) - self.w(rest) * flux)
    }

    /// Chooses the height such that g(δ) exceeds 1 by `rise` at current I; none if no height does.
    fn rising(self, rise: f64) -> Option<Self> {
        let at = |flux: f64| {
            let growth = self.w(self.t(flux)) - self.w(self.t(0.0));
            Some(Self { height: rise / growth, ..self }).filter(|_| growth > 0.0)
        };
        // g is above 1 on the way, so that some flux up to 1 makes I; next to none makes none.
        let beyond = |flux: f64| Some(if flux == 0.0 { -1.0 } else { at(flux)?.current(flux) - 1.0 });
        at(root(0.0, 1.0, beyond)?).filter(|knee| knee.least() >= LEAST)
    }

    /// Returns the smallest g, that of unsaturated iron.
    fn least(&self) -> f64 {
        1.0 - self.height * self.w(self.t(0.0))
    }

    /// Returns the excess of g over 1 at current −I.
    fn opposed(&self) -> f64 {
        // No flux makes no current, whatever rounding says; and g is nowhere below the least.
        let beyond = |flux: f64| Some(self.current(flux) + 1.0);
        let flux = root(-1.0 / self.least().min(1.0), 0.0, beyond).unwrap_or(f64::NAN);
        self.slope(flux) - 1.0
    }

    /// Returns the width at which both rises are met. A wide knee is a power of the flux, which bends the most; a
    /// narrow one has the core saturated already. Begins as [`Knee::power`]. None: it would have to bend more than
    /// this power, or leave too little at its foot.
    fn meeting(self, rise: f64, opposed: f64) -> Option<Self> {
        let of = |width: f64| Self { width, ..self }.rising(rise);
        let mut wide = self.width;
        if of(wide)?.opposed() < opposed {
            return None;
        }
        // The first width from above that bends too little.
        let narrow = loop {
            let narrow = 0.8 * wide;
            let knee = of(narrow)?;
            if knee.opposed() < opposed {
                break narrow;
            }
            wide = narrow;
        };
        of(root(narrow, wide, |width| Some(of(width)?.opposed() - opposed))?)
    }

    /// Returns the law of a core that saturates on both sides, with the unsaturated point in between. The larger rise
    /// is at +I.
    fn between(rise: f64, opposed: f64) -> Option<Self> {
        let of = |rest: f64| Self::power(2, rest).rising(rise);
        // In the middle both rise alike; the further away, the less the other one does.
        of(root(0.0, 1.0, |rest| Some(opposed - of(rest)?.opposed()))?)
    }
}

/// Returns the law along d with these rises of g at +I and −I, the first one positive; the place of no flux is
/// `magnet` away.
fn knee(rise: f64, opposed: Option<f64>, magnet: f64) -> Option<Knee> {
    // The iron's own place first; then nearer ones, which leave more at the foot of a steep knee.
    let places = std::iter::successors(Some(magnet), |m| Some(0.9 * m)).take_while(|m| *m > 1.0);
    let Some(opposed) = opposed else {
        let nearest = (magnet <= 1.0).then_some(magnet);
        return places.chain(nearest).find_map(|rest| {
            let exponent = if rest == 0.0 { 2 } else { USUAL };
            Knee::power(exponent, rest).rising(rise)
        });
    };
    if opposed >= 0.0 {
        return Knee::between(rise, opposed);
    }
    places.chain([1.0, 1.5, 2.0, 3.0, 5.0]).find_map(|rest| {
        (2..=STEEPEST).step_by(2).find_map(|exponent| Knee::power(exponent, rest).meeting(rise, opposed))
    })
}

impl Algebraic {
    /// Makes the core with these inductances in H without current, this magnet in Wb, and these falls at the rated
    /// current in A. It is convex and smooth everywhere, and does not couple the axes.
    ///
    /// ```
    /// use standstill_interface::Dq;
    /// use standstill_plant::{Algebraic, Falls, Magnetics};
    ///
    /// let falls = Falls { d: 0.06, minus_d: Some(-0.03), q: 0.1 };
    /// let core = Algebraic::falling([2.1e-3, 3.4e-3], 0.09, 10.0, falls)?;
    /// let inductance = |i_d, i_q| -> Result<_, Box<dyn std::error::Error>> {
    ///     let flux = core.flux_at(Dq::new(i_d, i_q))?;
    ///     Ok(core.current_and_inverse_inductance(flux).1.inverse())
    /// };
    /// assert!((inductance(10.0, 0.0)?.xx / 2.1e-3 - 0.94).abs() < 1e-9);
    /// assert!((inductance(-10.0, 0.0)?.xx / 2.1e-3 - 1.03).abs() < 1e-9);
    /// assert!((inductance(0.0, 10.0)?.yy / 3.4e-3 - 0.90).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn falling(
        inductance: [f64; 2],
        magnet_flux: f64,
        rated_current: f64,
        falls: Falls,
    ) -> Result<Self, FallsError> {
        let [l_d, l_q] = inductance;
        let needed = "from -100 % to 90 %";
        for (key, fall) in [("d", falls.d), ("minus_d", falls.minus_d.unwrap_or(falls.d))] {
            if !(-1.0..=0.9).contains(&fall) {
                return Err(FallsError { key, needed });
            }
        }
        if !(0.0..=0.9).contains(&falls.q) {
            return Err(FallsError { key: "q", needed: "from 0 % to 90 %" });
        }
        let along_q = falls.q / (1.0 - falls.q) / 3.0;
        let most_q = l_q * rated_current / (1.0 + along_q);
        let q_only = Self {
            d: 1.0 / l_d,
            q: 1.0 / l_q,
            qq: along_q / (l_q * most_q * most_q),
            q_exponent: 2,
            magnet_current: magnet_flux / l_d,
            ..Self::default()
        };
        let unit = l_d * rated_current;
        let rise = |fall: f64| fall / (1.0 - fall);
        // Without a magnet both are one number.
        let other = falls.minus_d.filter(|other| magnet_flux != 0.0 || *other != falls.d);
        let (d, minus_d) = (rise(falls.d), other.map(rise));
        let magnet = magnet_flux / unit;
        // Which way the core saturates more, and the law as seen from there.
        let (direction, found) = match minus_d {
            Some(_) if magnet_flux == 0.0 => {
                let needed = "the same as d, or left out: without a magnet the core is alike both ways";
                return Err(FallsError { key: "minus_d", needed });
            }
            None | Some(0.0) if d == 0.0 => return Ok(q_only),
            Some(other) if d <= 0.0 && other <= 0.0 => {
                let needed = "positive where minus_d is not: an inductance does not grow both ways";
                return Err(FallsError { key: "d", needed });
            }
            None if d < 0.0 => {
                let needed = "positive, or given with a minus_d that is: some current saturates the core";
                return Err(FallsError { key: "d", needed });
            }
            Some(other) if other > d => (-1.0, knee(other, Some(d), 1.0)),
            other => (1.0, knee(d, other, magnet)),
        };
        let needed = if minus_d == Some(d) {
            "left out: a core that falls that much alike both ways is not among the laws of iron here, and without minus_d it follows from d"
        } else {
            "nearer to d in size: no core that saturates smoothly has these two"
        };
        let knee = found.ok_or(FallsError { key: "minus_d", needed })?;
        let scale = knee.width * unit;
        let foot = magnet_flux - direction * knee.rest * unit;
        let bridge = IronBridge {
            strength: knee.height / (l_d * power(scale, knee.exponent)),
            saturation: 1.0 / power(scale, knee.exponent),
            q_share: 0.0,
            magnet_flux: foot,
            exponent: knee.exponent,
        };
        let own = knee.least() / l_d;
        Ok(Self {
            d: own,
            magnet_current: own * magnet_flux + bridge.along_d(magnet_flux - foot),
            bridge: Some(bridge),
            ..q_only
        })
    }
}

#[cfg(test)]
mod tests {
    use standstill_interface::Dq;

    use super::*;
    use crate::Magnetics;

    /// Ways to saturate, in per cent: as the paper's motor, weakly, strongly, saturated already, straight, to either side,
    /// towards −d.
    const WAYS: [(f64, Option<f64>, f64); 17] = [
        (6.3, Some(-3.4), 0.0),
        (6.0, Some(-3.0), 10.0),
        (6.0, None, 10.0),
        (0.5, Some(-0.4), 1.0),
        (30.0, Some(-12.0), 40.0),
        (60.0, Some(-3.0), 90.0),
        (6.0, Some(-6.3), 5.0),
        (6.0, Some(-7.34), 5.0),
        (6.0, Some(-7.36), 5.0),
        (6.0, Some(-12.0), 5.0),
        (2.0, Some(-40.0), 5.0),
        (6.0, Some(-0.05), 5.0),
        (6.0, Some(0.0), 5.0),
        (6.0, Some(2.0), 5.0),
        (6.0, Some(6.0), 5.0),
        (2.0, Some(6.0), 5.0),
        (-3.0, Some(6.0), 5.0),
    ];

    /// Inductances in H, magnet in Wb and rated current in A: from milliamperes to kiloamperes, magnets of half to forty
    /// times what rated current does.
    const MOTORS: [([f64; 2], f64, f64); 7] = [
        ([10.65e-3, 16.95e-3], 0.45, 8.0),
        ([1.0, 1.4], 0.03, 0.02),
        ([13.5e-6, 16e-6], 1e-3, 20.0),
        ([27e-6, 42e-6], 22.5e-3, 160.0),
        ([200e-6, 300e-6], 1.2, 1500.0),
        ([0.5e-3, 0.5e-3], 0.02, 1.0),
        ([10e-3, 30e-3], 0.04, 8.0),
    ];

    #[test]
    fn analytic_the_core_has_the_inductances_that_were_given() {
        for (l, flux, rated) in MOTORS {
            for (d, minus_d, q) in WAYS {
                let falls = Falls { d: d / 100.0, minus_d: minus_d.map(|fall| fall / 100.0), q: q / 100.0 };
                let what = format!("{l:?} {flux} {rated} {falls:?}");
                let core =
                    Algebraic::falling(l, flux, rated, falls).unwrap_or_else(|e| panic!("{what}: {e}"));
                let at = |d: f64, q: f64| {
                    let flux = core.flux_at(Dq::new(d * rated, q * rated)).expect("convex");
                    (flux, core.current_and_inverse_inductance(flux).1.inverse())
                };
                let (rest, without) = at(0.0, 0.0);
                assert!((rest.d / flux - 1.0).abs() < 1e-9 && rest.q == 0.0, "{what}: {rest:?}");
                assert!((without.xx / l[0] - 1.0).abs() < 1e-9, "{what}: {without:?}");
                assert!((without.yy / l[1] - 1.0).abs() < 1e-9, "{what}: {without:?}");
                for (place, fall) in [
                    (at(1.0, 0.0).1.xx / l[0], Some(falls.d)),
                    (at(-1.0, 0.0).1.xx / l[0], falls.minus_d),
                    (at(0.0, 1.0).1.yy / l[1], Some(falls.q)),
                    (at(0.0, -1.0).1.yy / l[1], Some(falls.q)),
                ] {
                    let Some(fall) = fall else { continue };
                    assert!((place - (1.0 - fall)).abs() < 1e-8, "{what}: {} for {fall}", 1.0 - place);
                }
                // Convex and at most four times the inductance anywhere, and no kink.
                assert_eq!(core.kinks(), [false; 2]);
                for k in -40..=40 {
                    let (flux, l_here) = at(f64::from(k) / 4.0, 0.3);
                    let gamma = core.current_and_inverse_inductance(flux).1;
                    assert!(gamma.is_positive_definite() && l_here.xx < 4.01 * l[0], "{what} at {k}/4");
                }
            }
        }
    }

    #[test]
    fn analytic_iron_without_flux_is_not_saturated() {
        // The paper's motor, from its own law: i_d = (a_d0 + a_dd |ψ|⁵) ψ − i_f falls by 6.34 % and rises by 3.35 %.
        let own = Algebraic {
            d: 89.14,
            dd: 43.0,
            d_exponent: 5,
            q: 59.0,
            magnet_current: 40.4714,
            ..Algebraic::default()
        };
        let l = |core: &Algebraic, i: f64| {
            let flux = core.flux_at(Dq::new(i, 0.0)).expect("convex");
            core.current_and_inverse_inductance(flux).1.inverse().xx
        };
        let l_d = l(&own, 0.0);
        let fall = |i: f64| 1.0 - l(&own, i) / l_d;
        let rest = own.flux_at(Dq::new(0.0, 0.0)).expect("convex").d;
        let falls = Falls { d: fall(8.0), minus_d: Some(fall(-8.0)), q: 0.0 };
        let core = Algebraic::falling([l_d, 1.0 / 59.0], rest, 8.0, falls).expect("a core");
        assert!(core.bridge.is_some_and(|bridge| bridge.magnet_flux.abs() < 1e-12 && bridge.exponent == 6));
        // In between it is the same iron, within a thousandth.
        for k in -8..=8 {
            let i = f64::from(k);
            assert!((l(&core, i) / l(&own, i) - 1.0).abs() < 1e-3, "{i} A: {} {}", l(&core, i), l(&own, i));
        }
    }

    #[test]
    fn regress_falls_that_no_core_has_are_refused() {
        let refused = |flux: f64, d: f64, minus_d: Option<f64>, q: f64| {
            Algebraic::falling([1e-3, 1e-3], flux, 8.0, Falls { d, minus_d, q }).expect_err("no core").key
        };
        assert_eq!(refused(0.1, 0.95, None, 0.0), "d");
        assert_eq!(refused(0.1, -0.05, None, 0.0), "d");
        assert_eq!(refused(0.1, -0.05, Some(-0.1), 0.0), "d");
        assert_eq!(refused(0.1, 0.05, Some(f64::NAN), 0.0), "minus_d");
        assert_eq!(refused(0.0, 0.05, Some(-0.03), 0.0), "minus_d");
        assert_eq!(refused(0.1, 0.05, None, -0.01), "q");
    }
}
