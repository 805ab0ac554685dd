//! Each factor of the error estimate, compared with the true error of a step for exponentials in closed form: the estimate must be
//! larger than the error, but not by much.

use standstill_interface::Dq;
use standstill_inverter::Source;

use super::*;
use crate::effect::eddies::{RotorFlux, lag_behind};
use crate::effect::rotor::{SHARE_OF_ANGLE, SHARE_OF_SPEED};
use crate::effect::terminals::modes::Modes;
use crate::effect::terminals::ringing::End;
use crate::physics::links::hermite_area;
use crate::physics::machine::Operating;
use crate::physics::state::State;

const NONE: Plane<f64> = Plane { x: 0.0, y: 0.0 };

fn along_x(value: f64) -> Plane<f64> {
    Plane::new(value, 0.0)
}

/// Returns a state with this current in A along x.
fn place(current: f64) -> Here<f64> {
    let dq = Dq::new(0.0, 0.0);
    let state = State {
        flux: NONE,
        turned: 0.0,
        speed: 0.0,
        link: 0.0,
        lagging: dq,
        shorted: 0.0,
        potential: [0.0; 3],
    };
    let at = Operating {
        current: along_x(current),
        inverse_inductance: Symmetric::new(1.0, 0.0, 1.0),
        turning: NONE,
        relaxing: NONE,
        energy_turn: NONE,
        energy_bend: 0.0,
        torque: 0.0,
        cogging_slope: 0.0,
        core_flux: dq,
        core_current: dq,
        lag: dq,
    };
    Here { time: 0.0, state, at, source: Source { voltage: 0.0, rise: 0.0 } }
}

/// Returns the estimate for a step of 1 s in which a current falls as e^(−x s); `resistance`: in Ω; `filtered`: field of [`Accuracy`].
fn estimate(x: f64, resistance: f64, filtered: f64) -> f64 {
    let accuracy = Accuracy { per_flux: 1.0, per_angle: 1.0, per_flux_scale: 1.0, filtered, remembered: 0.0 };
    let change =
        |s: f64| Change { flux: NONE, current: along_x(-x * (-x * s).exp()), blocked_potential: 0.0 };
    let resistance = Symmetric::new(resistance, 0.0, resistance);
    let (begin, end) = (place(1.0), place((-x).exp()));
    error(&accuracy, 1.0, &resistance, &begin, &end, [&change(0.0), &change(1.0)], NONE)
}

#[test]
fn analytic_the_drop_of_a_decay_is_estimated_sixteen_times_as_far_off_as_it_is() {
    for x in [0.1_f64, 0.3, 1.0] {
        let end = (-x).exp();
        let missed = (hermite_area(1.0, [1.0, end], [-x, -x * end]) - (1.0 - end) / x).abs();
        let times = estimate(x, 1.0, 0.0) / missed;
        // A factor of eight for other functions than exponentials, and two for the sum of two resistances; less on long steps.
        assert!((8.0..17.0).contains(&times), "{x}: {times}");
    }
}

#[test]
fn analytic_a_filter_sees_half_of_what_is_estimated_between_the_ends() {
    for x in [0.1_f64, 0.3, 1.0] {
        let end = (-x).exp();
        // Value of the cubic in the middle of the step.
        let middle = (1.0 + end) / 2.0 + (-x + x * end) / 8.0;
        let times = estimate(x, 0.0, 1.0) / (middle - (-x / 2.0).exp()).abs();
        assert!((1.2..2.4).contains(&times), "{x}: {times}");
    }
}

/// Returns the estimate divided by the true error of the flux, for a step of 1 s in which a mode turns by `angle` in rad and the force (or
/// the nonlinear remainder of the current) falls as e^(−x s).
fn ringing(x: f64, angle: f64, of_force: bool) -> f64 {
    let charging = Symmetric::new(angle * angle, 0.0, 0.0);
    let none = Symmetric::new(0.0, 0.0, 0.0);
    let modes = Modes::of(Symmetric::new(1.0, 0.0, 1.0), charging, &none);
    let end = |s: f64| {
        let (value, rise) = (along_x((-x * s).exp()), along_x(-x * (-x * s).exp()));
        let still = End {
            force: NONE,
            force_rise: NONE,
            current: NONE,
            current_rise: NONE,
            flux_rise: NONE,
            flux: NONE,
        };
        if of_force {
            End { force: value, force_rise: rise, ..still }
        } else {
            End { current: value, current_rise: rise, ..still }
        }
    };
    let step = Ringing::between(modes, 1.0, NONE, None, [&end(0.0), &end(1.0)]);
    // ∫ e^(iθ(1 − s)) e^(−x s) ds = (e^(iθ) − e^(−x))/(x + iθ).
    let (real, imaginary) = (angle.cos() - (-x).exp(), angle.sin());
    let square = x * x + angle * angle;
    let exact = if of_force {
        (real * x + imaginary * angle) / square
    } else {
        -angle * (imaginary * x - real * angle) / square
    };
    let accuracy =
        Accuracy { per_flux: 1.0, per_angle: 1.0, per_flux_scale: 1.0, filtered: 0.0, remembered: 0.0 };
    ringing_error(&accuracy, &step, NONE) / (step.after(1.0)[0].x - exact).abs()
}

#[test]
fn analytic_eighty_steps_of_a_swing_may_be_off_alike() {
    for x in [0.1, 0.3] {
        for of_force in [true, false] {
            let angles = (1..=100).map(|n| f64::from(n) * 0.1);
            let worst = angles.map(|angle| ringing(x, angle, of_force)).fold(f64::INFINITY, f64::min);
            assert!((50.0..100.0).contains(&worst), "{x} {of_force}: {worst}");
        }
    }
}

#[test]
fn analytic_what_counts_of_a_motion_put_right_is_more_than_it_is_off_by() {
    let (mut of_angle, mut of_speed) = (0.0_f64, 0.0_f64);
    for n in 1..=20 {
        let x = f64::from(n) * 0.1;
        let end = (-x).exp();
        let (speed, angle) = ((1.0 - end) / x, (x - 1.0 + end) / (x * x));
        // Predicted and corrected as in a step (`two_derivative.rs`), over 1 s.
        let (speed_ahead, angle_ahead) = (1.0 - x / 2.0, 0.5 - x / 6.0);
        let new_speed = hermite_area(1.0, [1.0, end], [-x, -x * end]);
        let new_angle = hermite_area(1.0, [0.0, new_speed], [1.0, end]);
        of_speed = of_speed.max(((new_speed - speed) / (new_speed - speed_ahead)).abs());
        of_angle = of_angle.max(((new_angle - angle) / (new_angle - angle_ahead)).abs());
    }
    for (share, of) in [(SHARE_OF_ANGLE, of_angle), (SHARE_OF_SPEED, of_speed)] {
        assert!((2.5..9.9).contains(&(share / of)), "{share} {of}");
    }
}

#[test]
fn analytic_a_flux_that_lags_is_off_by_no_more_than_estimated() {
    let mut worst = 0.0_f64;
    for x in [0.1_f64, 0.3, 0.6] {
        for k in [0.0_f64, 0.5, 1.5, 2.0] {
            for begin in [-1.0, 0.0, 0.5, 1.3, 2.0] {
                let flux = |s: f64| RotorFlux {
                    flux: Dq::new((-k * x * s).exp(), 0.0),
                    rise: Dq::new(-k * x * (-k * x * s).exp(), 0.0),
                };
                let along = 1.0 / (1.0 - k);
                let exact = (begin - along) * (-x).exp() + along * (-k * x).exp();
                let end = lag_behind(x, Dq::new(begin, 0.0), &flux(0.0), &flux(1.0)).d;
                let most = (1.0 - begin).abs().max((flux(1.0).flux.d - exact).abs());
                worst = worst.max((end - exact).abs() / relaxing_error(most, x));
            }
        }
    }
    assert!((0.3..1.0).contains(&worst), "{worst}");
}
