//! Electrical angles on the circle.

use crate::Real;

/// An electrical angle, kept in [0, 2π) rad. Zero is the magnetic axis of phase a; the rotor angle points to
/// the magnet's north pole (the d-axis).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angle<T>(T);

impl<T: Real> Angle<T> {
    /// Makes an angle from radians, with any number of turns.
    pub fn from_radians(radians: T) -> Self {
        let turn = T::TAU();
        let wrapped = radians - turn * (radians / turn).floor();
        // Rounding can lift a tiny negative angle to a whole turn, and push one just below some turns under zero. Of very
        // many turns it leaves nothing.
        Self(if wrapped >= turn || wrapped < T::zero() { T::zero() } else { wrapped })
    }

    /// Makes an angle from degrees, with any number of turns.
    ///
    /// ```
    /// use standstill_interface::Angle;
    ///
    /// let angle = Angle::from_degrees(-90.0_f64);
    /// assert!((angle.degrees() - 270.0).abs() < 1e-12);
    /// assert!((angle.radians() - 1.5 * std::f64::consts::PI).abs() < 1e-12);
    /// ```
    pub fn from_degrees(degrees: T) -> Self {
        Self::from_radians(degrees.to_radians())
    }

    /// Returns the angle in [0, 2π) rad.
    pub fn radians(self) -> T {
        self.0
    }

    /// Returns the angle in [0, 360)°.
    pub fn degrees(self) -> T {
        self.0.to_degrees()
    }

    /// Returns the other pole: half a turn further.
    ///
    /// ```
    /// use standstill_interface::Angle;
    ///
    /// let south = Angle::from_degrees(250.0_f64).opposite();
    /// assert!((south.degrees() - 70.0).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn opposite(self) -> Self {
        Self::from_radians(self.0 + T::PI())
    }

    /// Returns the signed way from `other` to `self`, in (−π, π] rad.
    ///
    /// ```
    /// use standstill_interface::Angle;
    ///
    /// // Across zero the short way is taken.
    /// let error = Angle::from_degrees(1.0_f64).difference(Angle::from_degrees(359.0));
    /// assert!((error.to_degrees() - 2.0).abs() < 1e-12);
    /// ```
    pub fn difference(self, other: Self) -> T {
        let way = Self::from_radians(self.0 - other.0).0;
        if way > T::PI() { way - T::TAU() } else { way }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_difference_is_the_short_signed_way() {
        let way =
            |a: f64, b: f64| Angle::from_degrees(a).difference(Angle::from_degrees(b)).to_degrees().round();
        assert_eq!(way(10.0, 350.0), 20.0);
        assert_eq!(way(350.0, 10.0), -20.0);
        assert_eq!(way(180.0, 0.0), 180.0);
        assert_eq!(way(0.0, 180.0), 180.0);
        assert_eq!(way(725.0, 0.0), 5.0);
    }

    #[test]
    fn law_an_angle_is_within_its_turn() {
        let turn = core::f32::consts::TAU;
        let mut below = 0;
        for k in 0..20_000_u16 {
            let turns = turn * f32::from(k);
            for radians in [turns.next_down(), turns, -turns, -turns.next_down(), turns * 1e20, turns * -1e30]
            {
                let angle = Angle::from_radians(radians).radians();
                assert!((0.0..turn).contains(&angle), "{radians:e}: {angle:e}");
                below += u32::from(radians - turn * (radians / turn).floor() < 0.0);
            }
        }
        assert!(below > 100);
        assert!(Angle::from_radians(f32::NAN).radians().is_nan());
        assert!(Angle::from_radians(f32::INFINITY).radians().is_nan());
    }

    #[test]
    fn regress_a_tiny_negative_angle_stays_below_a_whole_turn() {
        assert!(Angle::from_radians(-1e-20_f64).radians() < core::f64::consts::TAU);
        assert!(Angle::from_radians(-1e-9_f32).radians() < core::f32::consts::TAU);
    }
}
