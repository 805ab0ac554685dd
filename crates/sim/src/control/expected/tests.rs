use super::*;

/// Capacitance of each terminal in F.
const CAPACITANCE: f64 = 1e-9;
/// Angular frequency of the oscillation in rad/s.
const OMEGA: f64 = 1e6;

/// Returns the series of a current a cos ω t + b sin ω t in phase a.
fn swinging(a: f64, b: f64) -> Way {
    let mut current = [Plane::default(); TERMS];
    let (mut cos, mut sin, mut power) = (a, b, 1.0);
    for of in &mut current {
        *of = Plane::new(cos * power, 0.0);
        (cos, sin, power) = (sin, -cos, power * OMEGA);
    }
    let axes = [Plane::new(1.0, 0.0), Plane::new(-0.5, 0.8), Plane::new(-0.5, -0.8)];
    Way { axes, current, square: OMEGA * OMEGA, capacitance: CAPACITANCE, leak: 0.0 }
}

/// A current a cos ω t has carried the charge C Δv after the time asin(ω C Δv/a)/ω.
#[test]
fn analytic_the_time_in_which_a_swing_carries_a_terminal_to_its_bound() {
    for angle in [0.01, 0.1, 0.3, 0.5] {
        let current = 0.2;
        let fall = current * f64::sin(angle) / (OMEGA * CAPACITANCE);
        for (current, bounds) in [(current, [-fall, 1e4]), (-current, [-1e4, fall])] {
            let (constant, exact) = swinging(current, 0.0).carries(0, 0.0, bounds);
            assert!((constant - fall * CAPACITANCE / 0.2).abs() < 1e-18);
            assert!((exact * OMEGA - angle).abs() < 5e-6 * angle, "{angle}: {}", exact * OMEGA);
        }
    }
    // Beyond the angle up to which the series is exact, there is no second time.
    let fall = 0.2 * f64::sin(0.7) / (OMEGA * CAPACITANCE);
    assert_eq!(swinging(0.2, 0.0).carries(0, 0.0, [-fall, 1e4]).1, f64::INFINITY);
}

/// A current that reverses before it has charged a terminal to its bound gives no time, so that it shortens no step.
#[test]
fn analytic_a_current_that_turns_back_carries_no_terminal_to_its_bound() {
    // A current of 1e-6 A reverses after 5e-12 s: it moves the terminal by 2.5e-9 V, and then away from the bound.
    let way = swinging(1e-6, -0.2);
    assert_eq!(way.carries(0, 1e-6, [0.0, 500.0]), (f64::INFINITY, f64::INFINITY));
    // A current that reverses later charges the terminal to the bound: 0.2 A, falling by 0.1 A per radian.
    let (constant, exact) = swinging(0.2, -0.1).carries(0, 10.0, [0.0, 500.0]);
    assert!(constant.is_finite() && exact > constant && exact < 1.1 * constant, "{constant} {exact}");
    // A current that does not reverse charges the terminal to the bound.
    assert!(swinging(1e-6, 0.2).carries(0, 1e-6, [0.0, 500.0]).0 < 1e-8);
}
