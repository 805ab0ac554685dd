//! Commissioning: learns systematic errors of the line inductances from several starts, without a position sensor.
//!
//! Equations (5)–(7) of the paper assume that the inductances of the three lines are waves of 2θ, with equal phases. As
//! a complex number and a mean, the lines are
//! ```text
//! Z = −2/9 Σ L_k w_k,   M = 1/9 Σ L_k,   w = e^{j120°}, 1, e^{−j120°} for L_AB, L_BC, L_CA
//! ```
//! For an ideal motor they are `Z = L_B u` with `u = e^{j2θ}`, and `M = L_A` (all in H). Real motors and drives differ
//! by:
//!
//! * **A 4θ harmonic.** L_4 cos 4θ in phase a, cos 4(θ − 120°) in b, and so on, with the mutual inductances that go
//!   with it, adds `H u⁻²` to Z, with H = L_4. It does not change M.
//! * **Unequal phases.** An excess δ of phase a adds the constant `2/9 δ` to Z; for phases b and c it is turned by
//!   ±120°. Together they are a constant c.
//! * **Unequal gains.** If line k reads 1 + ε_k times its inductance, with `E = Σ ε_k w_k`, then `Z' = Z − 2/3 L_A E +
//!   1/3 (E Z)*`: again a constant, and a term that turns backwards and is |L_B| / (2 L_A) of that constant.
//! * **Saturation.** A pulse with i_d > 0 meets a smaller inductance: L_k is smaller by κ cos³(φ_k − θ), where φ_k is
//!   the line's direction. With `v = e^{jθ}` this adds `j P v⁻¹` to Z, with P = κ/4. Unlike the other effects it depends
//!   on the pole.
//!
//! Together
//! ```text
//! Z = c + S u + H u⁻² + j P v⁻¹,   S = L_B
//! ```
//! Each position gives two equations and adds one unknown, its θ. One equation of each position is left to determine c,
//! S, H and, if the poles are known, P: the component of Z normal to its path over θ, which does not change when the
//! rotor turns.
//!
//! The backward term of unequal gains is neglected: with gain errors of 0.5 % it causes 0.06° rms on a motor with
//! |L_B|/L_A = 0.23. It could be learnt, best together with M, in which it causes a variation with 2θ. But its two
//! unknowns would add as much uncertainty as they remove, with up to 32 positions of a drive with 0.2° of uncertainty
//! per reading, and more with 0.5°.
//!
//! A common rotation of all positions cannot be identified: the winding defines θ = 0. That H and P are real is assumed
//! as well; it holds for motors that are symmetric about the d-axis.

mod correction;
mod fit;
mod model;
#[cfg(test)]
mod tests;

use standstill_interface::{Abc, Angle, Real};

pub use correction::Correction;

use crate::parts::complex::{Complex, Turning};
use crate::parts::lines::{SaliencySign, reflection};
use crate::settings::{SettingsError, require, require_positive};

use fit::{Extent, Factor, Normal, Position, minimise};
use model::{Model, at};
use thiserror::Error;

/// Settings of a commissioning run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissioningSettings<T> {
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// Least number of positions, from 5 to 32.
    pub least_positions: u8,
    /// Largest allowed uncertainty of a corrected angle in the worst position, caused by the learnt values alone,
    /// relative to the uncertainty that the noise of one reading causes. N evenly spread positions give 2/√N, or 2.5/√N
    /// if saturation is learnt.
    pub most_dilution: T,
    /// Largest allowed rms of the fit's residual in units of |L_B|. A larger residual shows that the lines fit no model
    /// of this kind.
    pub most_residual: T,
}

impl<T: Real> CommissioningSettings<T> {
    /// Returns settings for a motor with this saliency: 8 positions, a dilution of at most one reading's uncertainty,
    /// and a residual of at most 6 % of |L_B|, with which one reading has an uncertainty of 1.7°.
    pub fn usual(saliency: SaliencySign) -> Self {
        Self { saliency, least_positions: 8, most_dilution: T::one(), most_residual: T::of(0.06) }
    }

    fn check(&self) -> Result<(), SettingsError> {
        let count = usize::from(self.least_positions);
        require((5..=CAPACITY).contains(&count), "least_positions", "from 5 to 32")?;
        require_positive(self.most_dilution, "most_dilution")?;
        require_positive(self.most_residual, "most_residual")
    }
}

/// Reason why a commissioning run gives no correction.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum CommissioningError<T> {
    /// A line inductance is not positive and finite.
    #[error("a line inductance is not positive and finite")]
    NotInductive,
    /// There is no room for another position.
    #[error("no room for more than {room} positions")]
    Full {
        /// Largest number of positions.
        room: usize,
    },
    /// There are too few positions.
    #[error("{found} positions where at least {needed} are needed")]
    TooFew {
        /// Number of positions.
        found: usize,
        /// Number of positions needed.
        needed: usize,
    },
    /// The positions are too close together to separate the unknowns.
    #[error(
        "positions too close to each other: a correction would be {dilution:.2} times as uncertain as one reading, where \
         at most {allowed:.2} is allowed"
    )]
    TooClose {
        /// Dilution found: see [`CommissioningSettings::most_dilution`]. Infinite if an unknown has no effect at all.
        dilution: T,
        /// Largest allowed dilution.
        allowed: T,
    },
    /// The lines do not fit any motor of this kind.
    #[error(
        "lines that no harmonic and no asymmetry explain: {residual:.4} of |L_B| is left, where at most {allowed:.4} is \
         allowed"
    )]
    Unexplained {
        /// Rms of the unexplained part, in units of |L_B|.
        residual: T,
        /// Largest allowed rms, in units of |L_B|.
        allowed: T,
    },
    /// The fit did not converge, or its result does not belong to a motor of this kind.
    #[error("no harmonic and no asymmetry fits the lines")]
    NoConvergence,
}

/// Standard deviations of the learnt values, from the residual and the information matrix of the positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviations<T> {
    /// Standard deviation of the real and of the imaginary part of c, relative to L_A.
    pub offset: T,
    /// Standard deviation of H, relative to L_A.
    pub fourth: T,
    /// Standard deviation of P, relative to L_A; zero if it was not learnt.
    pub saturation: T,
    /// Standard deviation of a corrected angle in rad, rms over the rotor's positions: the joint effect of the deviations
    /// above, without the noise of the reading to be corrected.
    pub axis: T,
}

/// Result of a commissioning run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt<T> {
    /// The correction, which is to be stored in the drive.
    pub correction: Correction<T>,
    /// Standard deviations of the learnt values.
    pub deviations: Deviations<T>,
    /// L_A in H, the mean over the positions.
    pub mean: T,
    /// L_B in H after subtraction of the learnt errors.
    pub saliency: T,
    /// Rms of the residual in H, over the equations in excess of the unknowns: the noise of each component of Z, if
    /// nothing else is wrong.
    pub residual: T,
    /// Dilution: see [`CommissioningSettings::most_dilution`].
    pub dilution: T,
    /// Number of positions from which the values were learnt.
    pub positions: usize,
}

/// Largest number of positions.
const CAPACITY: usize = 32;

/// Line inductances at unknown positions, collected start by start.
///
/// ```
/// use standstill_detect::{Commissioning, CommissioningSettings, SaliencySign};
/// use standstill_interface::Abc;
///
/// // A drive whose line AB reads 2 % too much, started at twelve positions that nobody knows.
/// let mut commissioning = Commissioning::new(CommissioningSettings::usual(SaliencySign::Negative))?;
/// for start in 0..12 {
///     let twice = 2.0 * 2.4_f64 * f64::from(start);
///     let line = |shift: f64| 27.6e-3 + 6.3e-3 * (twice + shift.to_radians()).cos();
///     commissioning.add(Abc::new(1.02 * line(-120.0), line(0.0), line(120.0)), None)?;
/// }
/// let learnt = commissioning.learn()?;
/// assert_eq!(learnt.positions, 12);
/// assert!((learnt.saliency.abs() - 2.1e-3).abs() < 5e-5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Commissioning<T> {
    settings: CommissioningSettings<T>,
    positions: [Position<T>; CAPACITY],
    /// Sum of L_A in H over the positions.
    means: T,
    count: usize,
}

impl<T: Real> Commissioning<T> {
    /// Makes a commissioning without positions.
    ///
    /// # Errors
    /// A setting is outside its range.
    pub fn new(settings: CommissioningSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let none = Position { z: Complex::zero(), north: None };
        Ok(Self { settings, positions: [none; CAPACITY], means: T::zero(), count: 0 })
    }

    /// Returns the number of positions.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns whether there are no positions yet.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Adds L_AB, L_BC, L_CA in H at another position, and the rotor's angle from that detection if it found a pole.
    /// Only the pole is used: an error of the angle below 90° does not matter.
    ///
    /// # Errors
    /// A value is not an inductance, or there is no room for another position; then nothing is added.
    pub fn add(&mut self, lines: Abc<T>, north: Option<Angle<T>>) -> Result<(), CommissioningError<T>> {
        if !lines.0.iter().all(|line| line.is_finite() && *line > T::zero()) {
            return Err(CommissioningError::NotInductive);
        }
        let free = self.positions.get_mut(self.count).ok_or(CommissioningError::Full { room: CAPACITY })?;
        let (z, mean) = reflection(lines);
        *free = Position { z, north };
        self.means = self.means + mean;
        self.count += 1;
        Ok(())
    }

    /// Estimates the corrections from all positions. Saturation is learnt if the pole is known at every position.
    ///
    /// # Errors
    /// There are too few positions, they are too close to each other, or they do not belong to a motor of this kind.
    pub fn learn(&self) -> Result<Learnt<T>, CommissioningError<T>> {
        let mut positions = self.positions;
        let positions = &mut positions[..self.count];
        let extent = Extent { saturation: positions.iter().all(|position| position.north.is_some()) };
        // At least one equation more than unknowns, so that there is a residual.
        let needed = usize::from(self.settings.least_positions).max(extent.unknowns() + 1);
        if self.count < needed {
            return Err(CommissioningError::TooFew { found: self.count, needed });
        }
        // In units of |L_B|: squares of microhenries are too small for single precision.
        let count = T::of(self.count as f64);
        let mean = self.means / count;
        let unit = positions.iter().fold(T::zero(), |sum, position| sum + position.z.length()) / count;
        if unit <= mean * T::epsilon() {
            return Err(self.unexplained(T::infinity()));
        }
        for position in &mut *positions {
            position.z = position.z.scale(T::one() / unit);
        }
        let start = Model {
            offset: Complex::zero(),
            saliency: self.settings.saliency.factor(),
            fourth: T::zero(),
            saturation: T::zero(),
        };
        // Positions that are too close to each other are refused before the search could diverge on them. The start
        // knows the angles only to a few degrees, so its limit is doubled.
        let before = Normal::of(&start, positions, extent);
        self.spread(&start, &before, extent, T::of(2.0))?;
        let (model, normal) = minimise(start, positions, extent).ok_or(CommissioningError::NoConvergence)?;
        let (factor, dilution, rms) = self.spread(&model, &normal, extent, T::one())?;
        let residual = (normal.cost / T::of((self.count - extent.unknowns()) as f64)).sqrt();
        let share = residual / model.saliency.abs();
        if share.is_nan() || share > self.settings.most_residual {
            return Err(self.unexplained(share));
        }
        let such_a_motor = model.saliency * start.saliency > T::zero() && model.is_unique();
        let correction = Correction::of(&model, mean / unit).ok().filter(|_| such_a_motor);
        let of = |unknown: usize| residual * factor.deviation_of(unknown) * unit / mean;
        Ok(Learnt {
            correction: correction.ok_or(CommissioningError::NoConvergence)?,
            deviations: Deviations {
                offset: of(at::OFFSET).hypot(of(at::OFFSET + 1)) * T::FRAC_1_SQRT_2(),
                fourth: of(at::FOURTH),
                saturation: if extent.saturation { of(at::SATURATION) } else { T::zero() },
                axis: residual * rms,
            },
            mean,
            saliency: model.saliency * unit,
            residual: residual * unit,
            dilution,
            positions: self.count,
        })
    }

    fn unexplained(&self, residual: T) -> CommissioningError<T> {
        CommissioningError::Unexplained { residual, allowed: self.settings.most_residual }
    }

    /// Returns the Cholesky factor of the information matrix, the dilution, and the standard deviation in rad of a
    /// corrected angle for unit noise, rms over the rotor's positions.
    fn spread(
        &self,
        model: &Model<T>,
        normal: &Normal<T>,
        extent: Extent,
        slack: T,
    ) -> Result<(Factor<T>, T, T), CommissioningError<T>> {
        let allowed = self.settings.most_dilution;
        let close = |dilution: T| CommissioningError::TooClose { dilution, allowed };
        let factor = normal.factor(T::zero()).ok_or(close(T::infinity()))?;
        let (mut most, mut squares) = (T::zero(), T::zero());
        for step in 0..ANGLES {
            let angle = T::TAU() * T::of(f64::from(step) / f64::from(ANGLES));
            let deviation = factor.deviation(&extent.only(model.angle_over_unknowns(angle)));
            most = most.max(deviation);
            squares = squares + deviation * deviation;
        }
        // Noise of one reading turns Z by noise / |L_B| in rad, and Z turns by 2θ.
        let dilution = T::of(2.0) * most * model.saliency.abs();
        if dilution <= allowed * slack {
            Ok((factor, dilution, (squares / T::of(f64::from(ANGLES))).sqrt()))
        } else {
            Err(close(dilution))
        }
    }
}

/// Number of angles at which a correction's uncertainty is computed: enough for waves of up to 6θ.
const ANGLES: u8 = 36;
