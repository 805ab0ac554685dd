//! Bounds of the oscillation of currents and potentials, compared with oscillations that are integrated in small steps.

use standstill_interface::AlphaBeta;
use standstill_inverter::AXES;
use standstill_numeric::Heading;

use super::*;
use crate::physics::terminals::of_legs;

/// Inverse capacitance of each terminal in 1/F.
const ELASTANCE: f64 = 1e9;

/// Current in A, and voltage in V that the floating terminals put on the winding.
type Now = [Plane<f64>; 2];

/// Returns the state after a small step of `h` seconds by the classical Runge–Kutta method.
fn stepped(now: Now, h: f64, slope: impl Fn(Now) -> Now) -> Now {
    let on = |by: Now, h: f64| [now[0] + by[0] * h, now[1] + by[1] * h];
    let first = slope(now);
    let second = slope(on(first, h / 2.0));
    let third = slope(on(second, h / 2.0));
    let fourth = slope(on(third, h));
    let mean = |k: usize| (first[k] + (second[k] + third[k]) * 2.0 + fourth[k]) * (1.0 / 6.0);
    on([mean(0), mean(1)], h)
}

/// Currents and potentials stay within the bounds, for various inductances, resistances, floating terminals and initial phases.
#[test]
fn law_currents_and_potentials_never_swing_farther_than_is_said() {
    let axes = AXES.map(|axis: AlphaBeta<f64>| Plane::from_stator(axis, Heading::of(0.4)));
    let conducting = [[false; 3], [true, false, false], [false, false, true]];
    let (mut most, mut least) = (0.0_f64, f64::INFINITY);
    for (number, conducting) in (0..90).flat_map(|number| conducting.map(|legs| (number, legs))) {
        let part = |stride: f64| (f64::from(number) * stride).fract();
        // L_d and L_q from 10 to 40 mH, quality factors from 2 on, and in every third case a resistance of the winding.
        let heading = Heading::of(9.0 * part(0.618));
        let gamma = Symmetric::new(40.0 + 60.0 * part(0.37), 0.0, 25.0 + 10.0 * part(0.71))
            .unpark_by(heading.sin, heading.cos);
        let impedance = (1.5 * ELASTANCE / gamma.xx).sqrt();
        let own = if number % 3 == 0 { 1.0 } else { 0.0 };
        let zero = Plane::new(0.0, 0.0);
        let floating = |each: f64, own: f64| {
            let each = conducting.map(|conducting| if conducting { 0.0 } else { each });
            of_legs(&axes, &each, Symmetric::new(own, 0.0, own))
        };
        let (resistance, charging) = (floating(impedance / 2.0 * part(0.43), own), floating(ELASTANCE, 0.0));
        let slope = |[current, voltage]: Now| {
            let rise = (voltage - current.through(resistance)).through(gamma);
            [rise, zero - current.through(charging)]
        };
        let direction = Heading::of(7.0 * part(0.29));
        let current = Plane::new(0.05 * part(0.53), 0.05 * part(0.91) - 0.02);
        let mut now = [current, Plane::new(direction.cos, direction.sin) * 300.0];
        let modes = Modes::of(gamma, charging, &resistance);
        let h = 6.0 / (ELASTANCE * 30.0 / 3.0).sqrt();
        let [rise, _] = slope(now);
        let swing = modes.swing(&axes, ELASTANCE, [now[0], rise], None, h);
        let (mut charge, mut farthest) = (zero, 0.0_f64);
        let parts = 2000;
        for _ in 0..parts {
            let next = stepped(now, h / f64::from(parts), slope);
            charge = charge + (now[0] + next[0]) * (h / f64::from(parts) / 2.0);
            now = next;
            for k in (0..3).filter(|k| !conducting[*k]) {
                let from_middle = swing.away[k] - axes[k].dot(charge) * ELASTANCE;
                let shares = [axes[k].dot(now[0]) / swing.current[k], from_middle / swing.potential[k]];
                farthest = shares.into_iter().fold(farthest, |far, share| far.max(share.abs()));
            }
        }
        (most, least) = (most.max(farthest), least.min(farthest));
    }
    assert!(most < 1.0 + 1e-5, "beyond what was said: {most}");
    assert!(least > 0.4, "said far too much: {least}");
}

/// In less than half a period, the oscillation of a mode has at most one extremum. So both ends of a step give bounds of the potentials
/// between them, which are closer than those by the amplitude alone if there is no extremum.
#[test]
fn law_between_two_places_of_a_swing_terminals_stay_within_what_is_said() {
    let axes = AXES.map(|axis: AlphaBeta<f64>| Plane::from_stator(axis, Heading::of(0.4)));
    let (mut beyond, mut narrow, mut all) = (f64::NEG_INFINITY, 0_u32, 0_u32);
    for number in 0..30 {
        let part = |stride: f64| (f64::from(number) * stride).fract();
        let heading = Heading::of(9.0 * part(0.618));
        let gamma = Symmetric::new(40.0 + 60.0 * part(0.37), 0.0, 25.0 + 10.0 * part(0.71))
            .unpark_by(heading.sin, heading.cos);
        let impedance = (1.5 * ELASTANCE / gamma.xx).sqrt();
        let none = Symmetric::new(0.0, 0.0, 0.0);
        let resistance = of_legs(&axes, &[impedance / 2.0 * part(0.43); 3], none);
        let charging = of_legs(&axes, &[ELASTANCE; 3], none);
        let slope = |[current, voltage]: Now| {
            let rise = (voltage - current.through(resistance)).through(gamma);
            [rise, Plane::new(0.0, 0.0) - current.through(charging)]
        };
        let direction = Heading::of(7.0 * part(0.29));
        let current = Plane::new(0.05 * part(0.53), 0.05 * part(0.91) - 0.02);
        let mut now = [current, Plane::new(direction.cos, direction.sin) * 300.0];
        let modes = Modes::of(gamma, charging, &resistance);
        let h = 0.1 / modes.square[0].sqrt();
        let mut places = Vec::new();
        for _ in 0..60 {
            places.push(now);
            for _ in 0..20 {
                now = stepped(now, h / 20.0, slope);
            }
        }
        for (first, length) in (0..30).flat_map(|first| [3_usize, 9, 18, 28].map(|length| (first, length))) {
            let time = h * length as f64;
            let swing =
                |at: usize| modes.swing(&axes, ELASTANCE, [places[at][0], slope(places[at])[0]], None, time);
            let (begin, end) = (swing(first), swing(first + length));
            for k in 0..3 {
                let said = [0, 1].map(|m| {
                    Deviation::range([&begin.modes[m], &end.modes[m]], k, modes.square[m] * time * time)
                });
                let [low, high] = [0, 1].map(|side| said[0][side] + said[1][side]);
                for between in first..=first + length {
                    let away = swing(between).away[k];
                    beyond = beyond.max((low - away).max(away - high) / begin.potential[k]);
                }
                all += 1;
                narrow += u32::from(high - low < begin.potential[k]);
            }
        }
    }
    assert!(beyond <= 0.0, "beyond what was said by {beyond} of the amplitude");
    assert!(3 * narrow > all, "hardly ever closer than the amplitude: {narrow} of {all}");
}
