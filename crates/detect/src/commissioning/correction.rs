//! Corrections from commissioning, as they are kept and used.

use standstill_interface::{Abc, Angle, Real};

use super::model::Model;
use crate::parts::complex::{Complex, Turning};
use crate::parts::lines::{Saliency, SaliencySign, reflection};
use crate::settings::{SettingsError, require};

/// Correction by [`Commissioning`](crate::Commissioning): four numbers for a memory that survives without power.
///
/// They are relative to the mean L_A measured along with them. So what scales all lines alike, such as the gain of the
/// DC link's sensor or an unknown dead time, neither spoils a correction nor ages it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction<T> {
    offset: Complex<T>,
    fourth: T,
    saturation: T,
}

impl<T: Real> Correction<T> {
    /// Nothing to correct: equations (5)–(7) of the paper as they are.
    pub fn none() -> Self {
        Self { offset: Complex::zero(), fourth: T::zero(), saturation: T::zero() }
    }

    /// From what [`Correction::values`] gave: `[Re c, Im c, H, P]`, relative to L_A.
    ///
    /// # Errors
    /// Values of no motor that has three phases of one kind: a memory that lost them.
    pub fn new(values: [T; 4]) -> Result<Self, SettingsError> {
        let names = ["correction.offset", "correction.offset", "correction.fourth", "correction.saturation"];
        for (value, name) in values.into_iter().zip(names) {
            // Far beyond any motor: of a phase that differs by a half, |c| is 0.11.
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

    /// To be stored, and given to [`Correction::new`] later.
    pub fn values(&self) -> [T; 4] {
        [self.offset.re, self.offset.im, self.fourth, self.saturation]
    }

    /// L_4 / L_A.
    pub fn fourth(&self) -> T {
        self.fourth
    }

    /// [`Saliency::from_lines`] of L_AB, L_BC, L_CA in H without what was learnt.
    ///
    /// The effect of saturation depends on the pole. `north` is the rotor's angle by a detection, good to 90°; where
    /// it is none, saturation stays uncorrected.
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
