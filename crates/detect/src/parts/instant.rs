//! The instant for which an angle holds: the mean of the instants at which the method saw the rotor, weighted as in the angle.
//!
//! A pulse that begins without current shows the inductance at the instant of its sample: the flux, which is the integral of the voltage, is
//! `L i` there, whatever L was before. What the magnet of a turning rotor induces adds an error of its own. It cancels over pulses both ways,
//! and in the mean over the rotor's angles.

use standstill_interface::{Angle, Nanos, Real};

use crate::parts::lines::line_angles;

/// Returns the instant in s for which an axis from three lines holds. `instants` are the mean instants in s at which the lines were measured.
/// A line at the angle x from the axis has `L = 3 (L_A + L_B cos 2x)`. If it is measured when the rotor has turned by δ, it turns the axis
/// by (2/3) sin² 2x · δ; these weights of the three lines sum to 1.
pub(crate) fn of_lines<T: Real>(axis: Angle<T>, instants: [T; 3]) -> T {
    line_angles::<T>().into_iter().zip(instants).fold(T::zero(), |sum, (line, instant)| {
        let sin = ((line - axis.radians()) * T::of(2.0)).sin();
        sum + sin * sin * instant * T::of(2.0 / 3.0)
    })
}

/// Returns the instant in s for which an axis from the open terminals of three lines holds. Their voltages are proportional to sin 2x, which
/// turns the axis by (2/3) cos² 2x of the turn that a line saw.
pub(crate) fn of_terminals<T: Real>(axis: Angle<T>, instants: [T; 3]) -> T {
    let sum = instants.into_iter().fold(T::zero(), |sum, instant| sum + instant);
    sum * T::of(2.0 / 3.0) - of_lines(axis, instants)
}

/// Returns the time in s from an instant in s to the end of the detection, `now`.
pub(crate) fn age<T: Real>(now: Nanos, instant: T) -> T {
    T::of(now.seconds()) - instant
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::lines::{Saliency, SaliencySign};
    use standstill_interface::Abc;

    /// The axis that lines of a slowly turning rotor give is the rotor's at the instant, to first order.
    #[test]
    fn analytic_an_axis_of_a_turning_rotor_is_the_one_of_its_instant() {
        for (l_b, sign) in [(-2.1e-3, SaliencySign::Negative), (2.1e-3, SaliencySign::Positive)] {
            for degree in (0..180).step_by(7) {
                let (start, speed): (f64, f64) = (f64::from(degree).to_radians(), 0.002);
                let instants = [1.0, 2.5, 0.3];
                let angles = line_angles::<f64>();
                let lines = core::array::from_fn(|k| {
                    let x = start + speed * instants[k] - angles[k];
                    3.0 * (9.2e-3 + l_b * (2.0 * x).cos())
                });
                let axis = Saliency::from_lines(Abc(lines), sign).axis;
                let expected = Angle::from_radians(start + speed * of_lines(axis, instants));
                let apart = axis.difference(expected).sin().abs();
                // The second order is (ω t)² = 2.5e-5, twice of it at most; the turns are up to 5e-3.
                assert!(apart < 5e-5, "{degree}: {apart}");
            }
        }
        assert!((of_lines(Angle::from_degrees(33.0), [0.25_f64; 3]) - 0.25).abs() < 1e-15);
        assert_eq!(age(Nanos::from_micros(1500), 5e-4), 1e-3);
    }
}
