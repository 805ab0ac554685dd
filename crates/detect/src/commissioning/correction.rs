//! Corrections from commissioning, as they are stored and applied.

use standstill_interface::{Abc, Angle, Real};

use super::model::Model;
use crate::parts::complex::{Complex, Turning};
use crate::parts::lines::{Saliency, SaliencySign, reflection};
use crate::settings::{SettingsError, require};

/// Correction from [`Commissioning`](crate::Commissioning): four numbers for a non-volatile memory.
///
/// The numbers are relative to the mean L_A that was measured with them. So an effect that scales all lines alike, such
/// as the gain of the DC link's sensor or an unknown dead time, does not change a correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction<T> {
    offset: Complex<T>,
    fourth: T,
    saturation: T,
}

impl<T: Real> Correction<T> {
    /// Returns the correction that changes nothing: equations (5)–(7) of the paper apply unchanged.
    pub fn none() -> Self {
        Self { offset: Complex::zero(), fourth: T::zero(), saturation: T::zero() }
    }

    /// Makes a correction from the numbers that [`Correction::values`] returned: `[Re c, Im c, H, P]`, relative to L_A.
    ///
    /// # Errors
    /// A number is not between −0.5 and 0.5. No motor with three phases of one kind has such values: the memory has
    /// lost them.
    pub fn new(values: [T; 4]) -> Result<Self, SettingsError> {
        let names = ["correction.offset", "correction.offset", "correction.fourth", "correction.saturation"];
        for (value, name) in values.into_iter().zip(names) {
            // Far beyond any motor: if one phase differs by a half, |c| is 0.11.
            require(value.abs() < T::of(0.5), name, "between -0.5 and 0.5")?;
        }
        let [re, im, fourth, saturation] = values;
        Ok(Self { offset: Complex::new(re, im), fourth, saturation })
    }

    /// Makes the correction of a model in the unit in which L_A is `mean`.
    pub(super) fn of(model: &Model<T>, mean: T) -> Result<Self, SettingsError> {
        let Model { offset, fourth, saturation, .. } = *model;
        Self::new([offset.re, offset.im, fourth, saturation].map(|value| value / mean))
    }

    /// Returns the numbers to be stored, from which [`Correction::new`] makes the correction again.
    pub fn values(&self) -> [T; 4] {
        [self.offset.re, self.offset.im, self.fourth, self.saturation]
    }

    /// Returns L_4 / L_A, the relative amplitude of the 4θ harmonic.
    pub fn fourth(&self) -> T {
        self.fourth
    }

    /// Returns [`Saliency::from_lines`] of L_AB, L_BC, L_CA in H after subtracting the learnt errors.
    ///
    /// The effect of saturation depends on the pole. `north` is the rotor's angle from a detection, with an error below
    /// 90°. If it is none, saturation is not corrected.
    pub fn apply(&self, lines: Abc<T>, sign: SaliencySign, north: Option<Angle<T>>) -> Saliency<T> {
        let (z, mean) = reflection(lines);
        let model = Model {
            offset: self.offset.scale(mean),
            saliency: sign.factor(),
            fourth: self.fourth * mean,
            saturation: self.saturation * mean,
        };
        let (angle, amplitude) = model.angle(z, north);
        let two = T::of(2.0);
        let axis = Angle::from_radians(Angle::from_radians(two * angle).radians() / two);
        Saliency { mean, amplitude, axis }
    }
}
