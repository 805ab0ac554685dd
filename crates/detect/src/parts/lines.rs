//! Line inductances: from three samples of a pulse to R and L, from three lines to the rotor's axis.

use standstill_interface::{Abc, AlphaBeta, Angle, Real};

use super::complex::{Complex, Turning};

/// One interval of equation (10): a mean voltage, and the currents at both ends of the interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval<T> {
    /// Mean voltage across the line in V.
    pub voltage: T,
    /// Current in A at the beginning.
    pub begin: T,
    /// Current in A at the end.
    pub end: T,
    /// Length in s.
    pub duration: T,
}

impl<T: Real> Interval<T> {
    pub(crate) fn mean(&self) -> T {
        (self.begin + self.end) / T::of(2.0)
    }

    pub(crate) fn slope(&self) -> T {
        (self.end - self.begin) / self.duration
    }
}

/// Returns R in Ω and L in H of a line from two intervals: equation (10) of the paper, `u = R (i_begin + i_end)/2 + L
/// (i_end − i_begin)/t`, is written for each interval and solved for both.
///
/// `None` if the two intervals do not separate R and L.
///
/// ```
/// use standstill_detect::{Interval, line_impedance};
///
/// // 100 V across 2 Ω and 20 mH in series, by the closed form i = u/R (1 − exp(−t R/L)), at 0, 100 µs and 200 µs.
/// let current = |t: f64| 50.0 * (1.0 - (-t * 100.0).exp());
/// let between = |begin: f64, end: f64| Interval {
///     voltage: 100.0,
///     begin: current(begin),
///     end: current(end),
///     duration: end - begin,
/// };
/// let (resistance, inductance) =
///     line_impedance(between(0.0, 1e-4), between(1e-4, 2e-4)).ok_or("singular")?;
/// assert!((resistance - 2.0).abs() < 1e-3 && (inductance - 20e-3).abs() < 1e-6);
/// # Ok::<(), &str>(())
/// ```
pub fn line_impedance<T: Real>(first: Interval<T>, second: Interval<T>) -> Option<(T, T)> {
    let (a1, b1) = (first.mean(), first.slope());
    let (a2, b2) = (second.mean(), second.slope());
    let determinant = a1 * b2 - a2 * b1;
    let resistance = (first.voltage * b2 - second.voltage * b1) / determinant;
    let inductance = (second.voltage * a1 - first.voltage * a2) / determinant;
    (resistance.is_finite() && inductance.is_finite()).then_some((resistance, inductance))
}

/// Directions in rad of the current vectors that lines AB, BC and CA carry: −30°, 90° and 210°.
pub(crate) fn line_angles<T: Real>() -> [T; 3] {
    [-30.0, 90.0, 210.0].map(|degrees| T::of(degrees).to_radians())
}

/// Returns unit vectors in the directions of [`line_angles`].
pub(crate) fn line_directions<T: Real>() -> [AlphaBeta<T>; 3] {
    line_angles().map(|angle: T| {
        let (sin, cos) = angle.sin_cos();
        AlphaBeta::new(cos, sin)
    })
}

/// Returns Z and M of the lines L_AB, L_BC, L_CA: equations (6) and (5) of the paper in complex numbers. For an ideal
/// motor `Z = L_B e^{j2θ}` and `M = L_A`, all in H.
pub(crate) fn reflection<T: Real>(Abc([ab, bc, ca]): Abc<T>) -> (Complex<T>, T) {
    let nine = T::of(9.0);
    let z = Complex::new((ca + ab - bc - bc) / nine, T::of(3.0).sqrt() * (ca - ab) / nine);
    (z, (ab + bc + ca) / nine)
}

/// The sign of L_B: a property of the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaliencySign {
    /// L_d > L_q, as equations (1)–(7) are printed.
    Positive,
    /// L_d < L_q: interior magnets.
    Negative,
}

impl SaliencySign {
    /// Returns the sign for a motor with these inductances, both in the same unit.
    pub(crate) fn of<T: Real>(d_axis_inductance: T, q_axis_inductance: T) -> Self {
        if d_axis_inductance > q_axis_inductance { Self::Positive } else { Self::Negative }
    }

    /// Returns 1 or −1.
    pub(crate) fn factor<T: Real>(self) -> T {
        match self {
            Self::Positive => T::one(),
            Self::Negative => -T::one(),
        }
    }
}

/// Saliency by the three line inductances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saliency<T> {
    /// L_A in H, equation (5).
    pub mean: T,
    /// L_B in H with its sign, the amplitude of equation (6).
    pub amplitude: T,
    /// θ modulo 180°, equation (7): one of the two candidates, in [0°, 180°).
    pub axis: Angle<T>,
}

impl<T: Real> Saliency<T> {
    /// Computes the saliency from L_AB, L_BC, L_CA in H: equations (5)–(7) with the saliency's sign.
    ///
    /// ```
    /// use standstill_detect::{Saliency, SaliencySign};
    /// use standstill_interface::{Abc, Angle};
    ///
    /// // Equation (4) of a motor with interior magnets: L_A = 9.2 mH, L_B = −2.1 mH, the rotor at 70°.
    /// let line = |shift: f64| 27.6e-3 + 6.3e-3 * (140.0 + shift).to_radians().cos();
    /// let lines = Abc::new(line(-120.0), line(0.0), line(120.0));
    /// let saliency = Saliency::from_lines(lines, SaliencySign::Negative);
    /// assert!((saliency.mean - 9.2e-3).abs() < 1e-12 && (saliency.amplitude + 2.1e-3).abs() < 1e-12);
    /// assert!(saliency.axis.difference(Angle::from_degrees(70.0)).abs() < 1e-9);
    /// ```
    pub fn from_lines(lines: Abc<T>, sign: SaliencySign) -> Self {
        let (z, mean) = reflection(lines);
        let sign: T = sign.factor();
        // |L_B| e^{j2θ}.
        let turned = z.scale(sign);
        let twice = Angle::from_radians(turned.argument());
        Self {
            mean,
            amplitude: sign * turned.length(),
            axis: Angle::from_radians(twice.radians() / T::of(2.0)),
        }
    }

    /// Returns ∂θ/∂L for the three lines in rad/H: equation (7) differentiated.
    pub(crate) fn slopes(&self, sign: SaliencySign) -> [T; 3] {
        let twice = self.axis.radians() * T::of(2.0);
        let sign: T = sign.factor();
        let amplitude = self.amplitude.abs();
        let root = T::of(3.0).sqrt();
        let (sin, cos) = twice.sin_cos();
        // d(2θ) = (cos 2θ d(sine) − sin 2θ d(cosine)) / |L_B|.
        [(1.0, -1.0), (-2.0, 0.0), (1.0, 1.0)].map(|(cosine, sine)| {
            sign * (cos * root * T::of(sine) - sin * T::of(cosine)) / (T::of(18.0) * amplitude)
        })
    }

    /// Returns the largest variance, over all directions, of |L_B|/L_A e^{j2θ} for this covariance of the lines in H²:
    /// the larger eigenvalue of the vector's covariance. Noise differs between directions and need not be largest where
    /// z points.
    pub(crate) fn most_variance(&self, covariance: &[[T; 3]; 3]) -> T {
        let columns: [Complex<T>; 3] = core::array::from_fn(|k| {
            let mut one = [T::zero(); 3];
            one[k] = T::one();
            reflection(Abc(one)).0.scale(T::one() / self.mean)
        });
        let zero = T::zero();
        let (mut xx, mut xy, mut yy) = (zero, zero, zero);
        for (row, a) in covariance.iter().zip(columns) {
            for (entry, b) in row.iter().zip(columns) {
                xx = xx + a.re * b.re * *entry;
                xy = xy + a.re * b.im * *entry;
                yy = yy + a.im * b.im * *entry;
            }
        }
        let two = T::of(2.0);
        (xx + yy) / two + ((xx - yy) / two).hypot(xy)
    }

    /// Returns the variance of the axis in rad² for this covariance of the lines in H².
    pub(crate) fn axis_variance(&self, covariance: &[[T; 3]; 3], sign: SaliencySign) -> T {
        let slopes = self.slopes(sign);
        covariance.iter().zip(slopes).fold(T::zero(), |sum, (row, a)| {
            row.iter().zip(slopes).fold(sum, |sum, (entry, b)| sum + a * b * *entry)
        })
    }

    /// Returns the angle in rad by which the axis turned while the lines changed by these inductances in H, by least
    /// squares. A change common to all lines, or of the saliency's size, does not turn the axis.
    pub(crate) fn turned(&self, changes: Abc<T>) -> T {
        // A turn by δ changes Z = L_B e^{j2θ} by j 2 δ Z.
        let (change, _) = reflection(changes);
        let (sin, cos) = (self.axis.radians() * T::of(2.0)).sin_cos();
        (change.im * cos - change.re * sin) / (T::of(2.0) * self.amplitude)
    }

    /// Returns |L_B| / L_A.
    ///
    /// ```
    /// use standstill_detect::Saliency;
    /// use standstill_interface::Angle;
    ///
    /// let saliency = Saliency { mean: 9.2e-3, amplitude: -2.1e-3, axis: Angle::from_degrees(0.0) };
    /// assert!((saliency.ratio() - 0.228_f64).abs() < 1e-3);
    /// ```
    pub fn ratio(&self) -> T {
        (self.amplitude / self.mean).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_equation_10_recovers_a_line() {
        // Currents that satisfy the two trapezoids exactly for R = 2.4 Ω, L = 27 mH.
        let (r, l, u, t1, t2) = (2.4, 27e-3, 550.0, 80e-6, 2.32e-3);
        let next = |i: f64, u: f64, t: f64| (u - i * (r / 2.0 - l / t)) / (r / 2.0 + l / t);
        let i1 = 0.7;
        let i2 = next(i1, u, t1);
        for (u2, t2) in [(0.0, t2), (-u, 64e-6)] {
            let i3 = next(i2, u2, t2);
            let (resistance, inductance) = line_impedance(
                Interval { voltage: u, begin: i1, end: i2, duration: t1 },
                Interval { voltage: u2, begin: i2, end: i3, duration: t2 },
            )
            .expect("solvable");
            assert!((resistance / r - 1.0).abs() < 1e-10 && (inductance / l - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn law_no_current_is_no_solution() {
        let still = Interval { voltage: 550.0, begin: 0.0, end: 0.0, duration: 80e-6 };
        assert_eq!(line_impedance(still, Interval { voltage: 0.0, ..still }), None);
    }

    #[test]
    fn analytic_row_1_of_table_1() {
        let saliency = Saliency::from_lines(Abc::new(33.6, 27.6, 18.8), SaliencySign::Negative);
        assert!((2.0 * saliency.axis.degrees() - 83.8_f64).abs() < 0.05);
        let single = Saliency::from_lines(Abc::new(33.6_f32, 27.6, 18.8), SaliencySign::Negative);
        assert!((saliency.axis.degrees() - f64::from(single.axis.degrees())).abs() < 1e-5);
    }

    #[test]
    fn analytic_slopes_of_the_angle_are_differences() {
        for sign in [SaliencySign::Negative, SaliencySign::Positive] {
            for degree in [10.0, 100.0, 215.0, 300.0_f64] {
                let line = |shift: f64| 27.6e-3 + 6.3e-3 * (degree.to_radians() + shift).cos();
                let lines = [line(-2.1), line(0.0), line(2.1)];
                let saliency = Saliency::from_lines(Abc(lines), sign);
                for (k, slope) in saliency.slopes(sign).into_iter().enumerate() {
                    let mut moved = lines;
                    moved[k] += 1e-9;
                    let angle = Saliency::from_lines(Abc(moved), sign).axis;
                    let difference = angle.difference(saliency.axis) / 1e-9;
                    assert!((difference - slope).abs() < 1e-4 * slope.abs().max(1.0), "{degree} {k}");
                }
            }
        }
    }

    #[test]
    fn analytic_lines_of_a_known_motor() {
        let (l_a, l_b) = (9.2e-3, -2.1e-3);
        for degree in 0..180 {
            let twice = 2.0 * f64::from(degree).to_radians();
            let third = core::f64::consts::TAU / 3.0;
            let line = |shift: f64| 3.0 * l_a - 3.0 * l_b * (twice + shift).cos();
            let lines = Abc::new(line(-third), line(0.0), line(third));
            let found = Saliency::from_lines(lines, SaliencySign::Negative);
            assert!((found.mean - l_a).abs() < 1e-15 && (found.amplitude - l_b).abs() < 1e-15);
            let error = found.axis.radians() - twice / 2.0;
            assert!(error.sin().abs() < 1e-12, "{degree}");
        }
    }

    #[test]
    fn analytic_lines_of_an_axis_that_turns_show_its_turn_and_nothing_else() {
        for (l_b, sign) in [(-2.1e-3, SaliencySign::Negative), (2.1e-3, SaliencySign::Positive)] {
            for degree in (0..180).step_by(7) {
                let third = core::f64::consts::TAU / 3.0;
                let lines = |l_a: f64, l_b: f64, degrees: f64| {
                    let twice = 2.0 * degrees.to_radians();
                    [-third, 0.0, third].map(|shift| 3.0 * l_a - 3.0 * l_b * (twice + shift).cos())
                };
                let before = lines(9.2e-3, l_b, f64::from(degree));
                let found = Saliency::from_lines(Abc(before), sign);
                let turned = |later: [f64; 3]| {
                    found.turned(Abc(core::array::from_fn(|k| later[k] - before[k]))).to_degrees()
                };
                for ahead in [-2.0, 0.5, 2.0] {
                    let later = lines(9.2e-3, l_b, f64::from(degree) + ahead);
                    assert!((turned(later) / ahead - 1.0).abs() < 2e-3, "{degree} {ahead} {}", turned(later));
                }
                // A core that saturates has less inductance, and another saliency.
                assert!(turned(lines(8.5e-3, l_b * 0.8, f64::from(degree))).abs() < 1e-9, "{degree}");
            }
        }
    }

    #[test]
    fn law_a_covariance_of_lines_gives_the_axis_and_the_saliency_their_variances() {
        use crate::testing::Noise;
        // One line is far noisier than the others: z errs most along that line's direction.
        let deviations = [0.2e-3, 0.01e-3, 0.05e-3];
        let mut covariance = [[0.0; 3]; 3];
        for (k, row) in covariance.iter_mut().enumerate() {
            row[k] = deviations[k] * deviations[k];
        }
        let mut noise = Noise::new(9);
        let nominal = [33.0e-3, 27.0e-3, 26.0e-3];
        let sign = SaliencySign::Negative;
        let plain = Saliency::from_lines(Abc(nominal), sign);
        let (centre, _) = reflection(Abc(nominal));
        let (mut axis, mut square) = (0.0, [0.0; 36]);
        for _ in 0..20_000 {
            let lines = Abc(core::array::from_fn(|k| nominal[k] + deviations[k] * noise.gauss()));
            let off = Saliency::from_lines(lines, sign).axis.radians() - plain.axis.radians();
            axis += off.sin().powi(2) / 20_000.0;
            let z = (reflection(lines).0 - centre).scale(1.0 / plain.mean);
            for (k, square) in square.iter_mut().enumerate() {
                let (sin, cos) = (5.0 * k as f64).to_radians().sin_cos();
                *square += (z.re * cos + z.im * sin).powi(2) / 20_000.0;
            }
        }
        assert!((axis / plain.axis_variance(&covariance, sign) - 1.0).abs() < 0.05, "{axis}");
        let most = square.into_iter().fold(0.0, f64::max);
        assert!((most / plain.most_variance(&covariance) - 1.0).abs() < 0.05, "{most}");
        // The variance along the saliency exceeds the variance across it, and only the latter affects the axis.
        let across = 4.0 * plain.ratio().powi(2) * axis;
        assert!(most > 1.5 * across, "{most} {across}");
        // Equal variances of all lines give equal variances in all directions, as `of_lines` computes.
        let alike = core::array::from_fn(|k| core::array::from_fn(|l| if k == l { 1e-8 } else { 0.0 }));
        let line = 3.0 * plain.mean;
        let stated = crate::parts::significance::of_lines(1e-8 / (line * line));
        assert!((plain.most_variance(&alike) / stated - 1.0).abs() < 1e-9);
    }
}
