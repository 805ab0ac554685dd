//! Survey of a motor's magnetics for the purposes of detection: inductances, saliency, and which pole draws more
//! current.

use serde::Serialize;
use standstill_interface::{Dq, choice};
use standstill_numeric::{Heading, Symmetric};

use crate::{Harmonics, MagneticCircuit, NoConvergence};

choice! {
    /// Which of two opposite voltage vectors along the d-axis raises the larger current, at the currents surveyed.
    #[derive(Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum PolaritySignature {
        /// The vector towards north, at each current: the magnet brings the core close to saturation.
        Normal = "normal",
        /// The vector towards south, at each current.
        Inverted = "inverted",
        /// The answer depends on the current.
        Mixed = "mixed",
        /// Neither: the motor has no magnet, or no saturation.
        None = "none",
    }
}

/// The core at one current along the d- or the q-axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// i_d in A.
    pub i_d: f64,
    /// i_q in A.
    pub i_q: f64,
    /// ψ_d in Wb.
    pub psi_d: f64,
    /// ψ_q in Wb.
    pub psi_q: f64,
    /// ∂ψ_d/∂i_d in H.
    pub l_dd: f64,
    /// ∂ψ_d/∂i_q in H.
    pub l_dq: f64,
    /// ∂ψ_q/∂i_q in H.
    pub l_qq: f64,
}

/// Average inductances towards north and south at one current, as in a polarity test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PolarityPoint {
    /// Current in A along the d-axis, either way.
    pub current: f64,
    /// Average inductance in H from no current to +i_d.
    pub north: f64,
    /// Average inductance in H from no current to −i_d.
    pub south: f64,
    /// Currents in A towards north and south at equal changes of the flux, the larger of them `current`.
    pub at_equal_flux: [f64; 2],
}

impl PolarityPoint {
    /// Computes the point at this current in A, without harmonics.
    ///
    /// # Errors
    /// No flux of the core gives the current.
    pub fn of(magnetics: &MagneticCircuit, current: f64) -> Result<Self, NoConvergence> {
        let magnetics = &magnetics.clone().with_harmonics(Harmonics::default());
        let rest = magnetics.flux_at(Dq::new(0.0, 0.0), Heading::ZERO)?;
        Self::between(magnetics, rest, current)
    }

    /// Computes the point at this current in A for magnetics without harmonics; `rest`: flux without current in Wb.
    fn between(magnetics: &MagneticCircuit, rest: Dq<f64>, current: f64) -> Result<Self, NoConvergence> {
        let flux_at = |d: f64| magnetics.flux_at(Dq::new(d, 0.0), Heading::ZERO).map(|flux| flux.d);
        let (north, south) = (flux_at(current)? - rest.d, rest.d - flux_at(-current)?);
        // The pole that needs less flux for this current draws it, the other one less: neither leaves a map.
        let change = Dq::new(north.min(south), 0.0);
        let drawn = |flux| magnetics.state(flux, Heading::ZERO).current.d.abs();
        let at_equal_flux = [drawn(rest + change), drawn(rest - change)];
        Ok(Self { current, north: north / current, south: south / current, at_equal_flux })
    }

    /// Returns the relative difference of the currents of north and south at the same change of the flux,
    /// `i_N(Δψ)/i_S(Δψ) − 1`, as after two voltage vectors of equal volt-seconds along +d and −d. To first order it
    /// equals `L_south/L_north − 1` at equal currents, but not for strong saturation.
    ///
    /// ```
    /// use standstill_plant::PolarityPoint;
    ///
    /// // The average inductance towards north is smaller: its core is already driven by the magnet.
    /// let point = PolarityPoint { current: 8.5, north: 9.9e-3, south: 10.6e-3, at_equal_flux: [8.5, 7.9] };
    /// assert!((point.difference() - 0.0759).abs() < 1e-4);
    /// ```
    pub fn difference(&self) -> f64 {
        let [north, south] = self.at_equal_flux;
        north / south - 1.0
    }
}

/// Relative difference of the two average inductances below which they count as equal.
const EQUAL: f64 = 1e-6;

/// A motor's magnetics up to a current.
///
/// ```
/// use standstill_plant::{PolaritySignature, Survey, built_in};
///
/// let motor = built_in("paper-5k5").ok_or("not built in")?;
/// let survey = Survey::of(&motor.magnetics, motor.rated_current, 8, 0.0)?;
/// assert!(survey.convex && survey.l_dd < survey.l_qq);
/// assert_eq!(survey.along_d.len(), 17);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Survey {
    /// Flux in Wb without current.
    pub open_circuit_flux: f64,
    /// Incremental L_d, L_dq, L_q in H without current.
    pub l_dd: f64,
    /// Incremental L_dq in H without current.
    pub l_dq: f64,
    /// Incremental L_q in H without current.
    pub l_qq: f64,
    /// Points along the d-axis from −reach to +reach.
    pub along_d: Vec<OperatingPoint>,
    /// Points along the q-axis from −reach to +reach.
    pub along_q: Vec<OperatingPoint>,
    /// Polarity at currents in ascending order.
    pub polarity: Vec<PolarityPoint>,
    /// Signature of the polarity points.
    pub signature: PolaritySignature,
    /// Reciprocity error: rms of ∂ψ_d/∂i_q − ∂ψ_q/∂i_d over the rms of their mean, from differences over a grid up to
    /// `reach`; zero without cross-coupling. It is zero up to rounding for every core with an energy.
    pub reciprocity_error: f64,
    /// Whether the incremental inductances are positive definite everywhere on that grid.
    pub convex: bool,
}

impl Survey {
    /// Surveys the magnetics of a motor up to `reach` in A, with `steps` points in each direction. Harmonics vary with
    /// the angle and are left out.
    ///
    /// `uncertainty`: standard error of the fluxes in Wb, zero for a formula. Poles whose fluxes differ by less than
    /// four times that count as equal.
    ///
    /// # Errors
    /// No flux of the core gives a current of the survey.
    pub fn of(
        magnetics: &MagneticCircuit,
        reach: f64,
        steps: u16,
        uncertainty: f64,
    ) -> Result<Self, NoConvergence> {
        let magnetics = &magnetics.clone().with_harmonics(Harmonics::default());
        let flux_at = |d: f64, q: f64| magnetics.flux_at(Dq::new(d, q), Heading::ZERO);
        let inductance = |flux| magnetics.state(flux, Heading::ZERO).inverse_inductance.inverse();
        let point = |d: f64, q: f64| -> Result<OperatingPoint, NoConvergence> {
            let flux = flux_at(d, q)?;
            let Symmetric { xx, xy, yy } = inductance(flux);
            Ok(OperatingPoint { i_d: d, i_q: q, psi_d: flux.d, psi_q: flux.q, l_dd: xx, l_dq: xy, l_qq: yy })
        };
        let grid = |k: i32| reach * f64::from(k) / f64::from(steps);
        let n = i32::from(steps);
        let along_d: Result<Vec<_>, _> = (-n..=n).map(|k| point(grid(k), 0.0)).collect();
        let along_q: Result<Vec<_>, _> = (-n..=n).map(|k| point(0.0, grid(k))).collect();

        let rest = point(0.0, 0.0)?;
        let without = Dq::new(rest.psi_d, rest.psi_q);
        let polarity: Result<Vec<_>, NoConvergence> =
            (1..=n).map(|k| PolarityPoint::between(magnetics, without, grid(k))).collect();
        let polarity = polarity?;
        let (reciprocity_error, convex) = grid_checks(magnetics, reach)?;
        Ok(Self {
            open_circuit_flux: rest.psi_d,
            l_dd: rest.l_dd,
            l_dq: rest.l_dq,
            l_qq: rest.l_qq,
            along_d: along_d?,
            along_q: along_q?,
            signature: signature(&polarity, uncertainty),
            polarity,
            reciprocity_error,
            convex,
        })
    }
}

fn signature(polarity: &[PolarityPoint], uncertainty: f64) -> PolaritySignature {
    let equal = |point: &PolarityPoint| EQUAL + 4.0 * uncertainty / (point.north * point.current);
    let more = polarity.iter().any(|point| point.difference() > equal(point));
    let less = polarity.iter().any(|point| point.difference() < -equal(point));
    match (more, less) {
        (true, false) => PolaritySignature::Normal,
        (false, true) => PolaritySignature::Inverted,
        (true, true) => PolaritySignature::Mixed,
        (false, false) => PolaritySignature::None,
    }
}

/// Returns the reciprocity error from central differences of ψ(i), and whether the energy is convex, on a grid of
/// currents.
fn grid_checks(magnetics: &MagneticCircuit, reach: f64) -> Result<(f64, bool), NoConvergence> {
    let flux_at = |d: f64, q: f64| magnetics.flux_at(Dq::new(d, q), Heading::ZERO);
    let step = 1e-3 * reach;
    let (mut curl, mut cross, mut self_inductance) = (0.0, 0.0, 0.0);
    let mut convex = true;
    for a in -4..=4 {
        for b in -4..=4 {
            // The differences stay within the reach, which may be all of a map.
            let inner = reach - step;
            let (d, q) = (inner * f64::from(a) / 4.0, inner * f64::from(b) / 4.0);
            let flux = flux_at(d, q)?;
            convex &= magnetics.state(flux, Heading::ZERO).inverse_inductance.is_positive_definite();
            let dq = flux_at(d, q + step)?.d - flux_at(d, q - step)?.d;
            let qd = flux_at(d + step, q)?.q - flux_at(d - step, q)?.q;
            curl += (dq - qd) * (dq - qd);
            cross += ((dq + qd) / 2.0) * ((dq + qd) / 2.0);
            let dd = flux_at(d + step, q)?.d - flux_at(d - step, q)?.d;
            self_inductance += dd * dd;
        }
    }
    // Without cross-coupling both are rounding.
    let error = if cross < 1e-16 * self_inductance { 0.0 } else { (curl / cross).sqrt() };
    Ok((error, convex))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Magnetics, Motor, built_in, built_in_names};

    fn survey(motor: &Motor) -> Survey {
        Survey::of(&motor.magnetics, motor.rated_current, 8, 0.0).expect("built in")
    }

    #[test]
    fn law_each_motor_has_its_polarity_signature() {
        let signature = |name: &str| survey(&built_in(name).expect("built in")).signature;
        assert_eq!(signature("paper-5k5"), PolaritySignature::Normal);
        assert_eq!(signature("gearless-hoist"), PolaritySignature::Normal);
        assert_eq!(signature("surface-magnet"), PolaritySignature::Normal);
        assert_eq!(signature("low-inertia"), PolaritySignature::Normal);
        assert_eq!(signature("cross-saturation"), PolaritySignature::Normal);
        assert_eq!(signature("slot-harmonics"), PolaritySignature::Normal);
        assert_eq!(signature("pm-reluctance"), PolaritySignature::Inverted);
        assert_eq!(signature("reluctance-6k7"), PolaritySignature::None);
        for name in built_in_names() {
            let linear = built_in(name).expect("built in").linearised();
            assert_eq!(survey(&linear).signature, PolaritySignature::None, "{name}, linear");
        }
    }

    #[test]
    fn law_every_core_is_reciprocal_and_convex() {
        for name in built_in_names() {
            let survey = survey(&built_in(name).expect("built in"));
            assert!(survey.convex && survey.reciprocity_error < 1e-3, "{name}: {}", survey.reciprocity_error);
        }
    }

    #[test]
    fn law_a_difference_below_the_uncertainty_is_no_signature() {
        let motor = built_in("paper-5k5").expect("built in");
        let signature = |uncertainty| {
            Survey::of(&motor.magnetics, motor.rated_current, 8, uncertainty).expect("built in").signature
        };
        // 5 % of 10 mH at 8 A: 4 mWb between the poles.
        assert_eq!(signature(5e-4), PolaritySignature::Normal);
        assert_eq!(signature(3e-3), PolaritySignature::None);
    }

    #[test]
    fn analytic_the_poles_are_compared_at_equal_volt_seconds() {
        for name in ["paper-5k5", "pm-reluctance", "gearless-hoist"] {
            let motor = built_in(name).expect("built in");
            let point = PolarityPoint::of(&motor.magnetics, motor.rated_current).expect("built in");
            let core = motor.magnetics.core();
            let rest = core.flux_at(Dq::new(0.0, 0.0)).expect("convex").d;
            let [north, south] = point.at_equal_flux;
            assert!((north.max(south) / motor.rated_current - 1.0).abs() < 1e-9, "{name}: {point:?}");
            // Integrated along the pulse: both vectors, volt-second by volt-second.
            let end = core.flux_at(Dq::new(north, 0.0)).expect("convex").d - rest;
            let (mut current, steps) = ([0.0; 2], 20_000);
            for k in 0..steps {
                let psi = end * (f64::from(k) + 0.5) / f64::from(steps);
                for (current, flux) in current.iter_mut().zip([rest + psi, rest - psi]) {
                    *current +=
                        core.current_and_inverse_inductance(Dq::new(flux, 0.0)).1.xx * end / f64::from(steps);
                }
            }
            let expected = current[0] / current[1] - 1.0;
            assert!((point.difference() / expected - 1.0).abs() < 1e-6, "{name}: {point:?} {expected}");
        }
    }

    #[test]
    fn analytic_the_paper_motors_polarity_difference_is_that_of_table_2() {
        // 8.17 A against about 7.8 A: a few per cent at rated current.
        let survey = survey(&built_in("paper-5k5").expect("built in"));
        let difference = survey.polarity.last().expect("points").difference();
        assert!((0.035..0.065).contains(&difference), "{difference}");
    }
}
