//! The laws that everything magnetic obeys, over every kind of circuit on every built-in motor.

use std::f64::consts::TAU;

use standstill_interface::{AlphaBeta, Dq};
use standstill_numeric::Heading;

use super::super::*;
use crate::{Motor, built_in, built_in_names};

/// Every motor with what its circuit may have on top of the core.
fn circuits() -> Vec<(String, MagneticCircuit)> {
    let mut circuits = Vec::new();
    for name in built_in_names() {
        let motor = built_in(name).expect("built in");
        for (kind, motor) in [("linear", motor.linearised()), ("saturated", motor)] {
            let circuit = motor.magnetics;
            let size = circuit.inductance().smaller_eigenvalue();
            let rest = circuit.rest(Heading::ZERO).norm();
            let harmonics = Harmonics {
                inductance_4: -0.1 * size,
                asymmetry: 0.05 * size,
                flux_5: 0.02 * rest,
                flux_7: -0.01 * rest,
            };
            let eddy = EddyBranch { time_constant: 50e-6, d_depth: 0.3, q_depth: 0.1 };
            let distorted = circuit.clone().with_harmonics(harmonics);
            let hot = distorted.with_magnet(0.9).expect("convex");
            let all = hot.clone().with_eddy_currents(Some(eddy));
            circuits.push((format!("{name}, {kind}"), circuit));
            circuits.push((format!("{name}, {kind}, harmonics"), distorted));
            circuits.push((format!("{name}, {kind}, harmonics, hot"), hot));
            circuits.push((format!("{name}, {kind}, harmonics, hot, eddy"), all));
        }
    }
    circuits
}

/// The flux in Wb up to which a circuit is looked at: beyond its magnet's.
fn reach(circuit: &MagneticCircuit) -> f64 {
    let rest = circuit.rest(Heading::ZERO).d.abs();
    // Without a magnet, as far as that of the paper's motor.
    1.2 * if rest > 1e-9 { rest } else { 0.3 }
}

/// Points of flux and angle across the working range.
fn points(circuit: &MagneticCircuit) -> impl Iterator<Item = (Dq<f64>, f64)> {
    let reach = reach(circuit);
    (-3..=3).flat_map(move |d| {
        (-3..=3).map(move |q| {
            let flux = Dq::new(reach * (f64::from(d) + 0.13) / 3.2, reach * (f64::from(q) - 0.09) / 3.2);
            (flux, 0.7 * f64::from(d) + 0.31 * f64::from(q) + 0.2)
        })
    })
}

#[test]
fn law_current_and_slope_are_the_gradient_of_one_energy() {
    for (name, circuit) in circuits() {
        let (h, turn) = (2e-5 * reach(&circuit), 1e-5);
        // What the energy of the reach is like.
        let usual = 0.03 * reach(&circuit).powi(2) / circuit.inductance().smaller_eigenvalue();
        for (flux, angle) in points(&circuit) {
            let at = Heading::of(angle);
            let state = circuit.state(flux, at);
            let along = |step: Dq<f64>| {
                (circuit.energy(flux + step, at) - circuit.energy(flux - step, at)) / (2.0 * step.norm())
            };
            let current = Dq::new(along(Dq::new(h, 0.0)), along(Dq::new(0.0, h)));
            let scale = 1.0 + state.current.norm();
            assert!(
                (state.current - current).norm() < 2e-5 * scale,
                "{name} {flux:?}: {state:?} {current:?}"
            );
            let energy = |angle| circuit.energy(flux, Heading::of(angle));
            let slope = (energy(angle + turn) - energy(angle - turn)) / (2.0 * turn);
            let size = circuit.energy(flux, at).abs() + usual;
            assert!((state.energy_slope - slope).abs() < 1e-5 * size, "{name} {flux:?}: {state:?} {slope}");
            let slope = |angle| circuit.state(flux, Heading::of(angle)).energy_slope;
            let bend = (slope(angle + h) - slope(angle - h)) / (2.0 * h);
            let size = 1.0 + state.energy_bend.abs();
            assert!((state.energy_bend - bend).abs() < 1e-5 * size, "{name} {flux:?}: {state:?} {bend}");
        }
    }
}

#[test]
fn law_inverse_inductance_is_reciprocal_positive_definite_and_the_slope_of_the_current() {
    for (name, circuit) in circuits() {
        let (h, turn) = (2e-6 * reach(&circuit), 1e-6);
        for (flux, angle) in points(&circuit) {
            let at = Heading::of(angle);
            let state = circuit.state(flux, at);
            let gamma = state.inverse_inductance;
            assert!(gamma.is_positive_definite(), "{name} at {flux:?}");
            let current = |step| circuit.state(flux + step, at).current;
            let along = |step: Dq<f64>| (current(step) - current(-step)) * (0.5 / h);
            let (d, q) = (along(Dq::new(h, 0.0)), along(Dq::new(0.0, h)));
            let scale = gamma.xx + gamma.yy;
            for (numeric, exact) in [(d.d, gamma.xx), (d.q, gamma.xy), (q.d, gamma.xy), (q.q, gamma.yy)] {
                assert!((numeric - exact).abs() < 1e-5 * scale, "{name} at {flux:?}: {numeric} {exact}");
            }
            let turned = |angle| circuit.state(flux, Heading::of(angle)).current;
            let slope = (turned(angle + turn) - turned(angle - turn)) * (0.5 / turn);
            assert!(
                (slope - state.current_slope).norm() < 1e-5 * scale * reach(&circuit).min(1.0),
                "{name} at {flux:?}: {slope:?} {state:?}"
            );
        }
    }
}

#[test]
fn law_torque_is_the_slope_of_the_co_energy_at_constant_current() {
    // An independent way to the torque: the currents of the phases stand still while the rotor turns.
    let h = 1e-4;
    for name in built_in_names() {
        let motor = built_in(name).expect("built in");
        let (size, rest) = (motor.magnetics.inductance().smaller_eigenvalue(), reach(&motor.magnetics) / 1.2);
        let harmonics = Harmonics {
            inductance_4: -0.01 * size,
            asymmetry: 0.005 * size,
            flux_5: 0.01 * rest,
            flux_7: -0.005 * rest,
        };
        let circuit = motor.magnetics.clone().with_harmonics(harmonics);
        let motor = Motor { magnetics: circuit.clone(), ..motor };
        for step in 0..12 {
            let angle = f64::from(step) * TAU / 12.0 + 0.1;
            let current = AlphaBeta::new(0.7, -0.5) * motor.rated_current;
            let in_rotor = |at: Heading| current.park_by(at.sin, at.cos);
            let co_energy = |angle: f64| {
                let at = Heading::of(angle);
                let flux = circuit.flux_at(in_rotor(at), at).expect("convex");
                in_rotor(at).dot(flux) - circuit.energy(flux, at)
            };
            let p = f64::from(motor.pole_pairs);
            let expected = 1.5 * p * (co_energy(angle + h) - co_energy(angle - h)) / (2.0 * h);
            let at = Heading::of(angle);
            let flux = circuit.flux_at(in_rotor(at), at).expect("convex");
            let torque = motor.torque(flux, in_rotor(at), circuit.state(flux, at).energy_slope);
            assert!((torque - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{name}: {torque} {expected}");
        }
    }
}

#[test]
fn analytic_harmonics_are_those_of_the_phases() {
    let motor = built_in("paper-5k5").expect("built in").linearised();
    let (l_4, odd) = (-0.3e-3, 0.2e-3);
    let harmonics = Harmonics { inductance_4: l_4, asymmetry: odd, flux_5: 9e-3, flux_7: -4e-3 };
    let circuit = motor.magnetics.clone().with_harmonics(harmonics);
    let winding = motor.winding;
    for degree in (0..360).step_by(5) {
        let angle = f64::from(degree).to_radians();
        let at = Heading::of(angle);
        let rest = circuit.rest(at);
        // Flux of phase a without current.
        let phase_a = rest.unpark_by(at.sin, at.cos).alpha;
        let expected = 0.45 * angle.cos() + 9e-3 * (5.0 * angle).cos() - 4e-3 * (7.0 * angle).cos();
        assert!((phase_a - expected).abs() < 1e-15, "{degree}°: {phase_a} {expected}");
        assert!(circuit.state(rest, at).current.norm() < 1e-12);
        // Flux of each phase from its own current alone, with the 2θ and 4θ terms of that phase: star-connected, a
        // current i in phase k is 2/3 of it along that axis.
        let gamma = circuit.state(rest, at).inverse_inductance.unpark_by(at.sin, at.cos);
        let inductance = gamma.inverse();
        for k in 0..3 {
            let axis = f64::from(k) * TAU / 3.0;
            let along = AlphaBeta::new(axis.cos(), axis.sin());
            let got = along.dot(inductance.times(along));
            let turned = angle - axis;
            let first = if k == 0 { 1.0 } else { 0.25 };
            let phase = winding.mean_inductance
                + winding.saliency * (2.0 * turned).cos()
                + l_4 * (4.0 * turned).cos();
            let expected = 1.5 * phase + 2.0 / 3.0 * odd * first;
            assert!((got - expected).abs() < 1e-15, "{degree}°, phase {k}: {got} {expected}");
        }
    }
}

#[test]
fn analytic_harmonics_are_those_of_a_winding_of_three_phases() {
    let motor = built_in("paper-5k5").expect("built in").linearised();
    let (l_4, odd) = (-0.3e-3, 0.2e-3);
    let harmonics = Harmonics { inductance_4: l_4, asymmetry: odd, ..Harmonics::default() };
    let circuit = motor.magnetics.clone().with_harmonics(harmonics);
    let axis = |k: usize| k as f64 * TAU / 3.0;
    for degree in (0..360).step_by(7) {
        let angle = f64::from(degree).to_radians();
        // Self and mutual inductances: L_4 in all of them, the odd phase in its own alone.
        let mut phases = motor.winding.inductance_matrix(angle);
        for (j, k) in (0..3).flat_map(|j| (0..3).map(move |k| (j, k))) {
            phases[(j, k)] += l_4 * (4.0 * angle - 2.0 * axis(j) - 2.0 * axis(k)).cos();
        }
        phases[(0, 0)] += odd;
        let along = |from: f64, to: f64| {
            let sum = |(j, k)| phases[(j, k)] * (axis(j) - from).cos() * (axis(k) - to).cos();
            2.0 / 3.0 * (0..3).flat_map(|j| (0..3).map(move |k| (j, k))).map(sum).sum::<f64>()
        };
        let at = Heading::of(angle);
        let got = circuit.state(circuit.rest(at), at).inverse_inductance.inverse();
        let q = angle + TAU / 4.0;
        for (got, expected) in
            [(got.xx, along(angle, angle)), (got.xy, along(angle, q)), (got.yy, along(q, q))]
        {
            assert!((got - expected).abs() < 1e-15, "{degree}°: {got} {expected}");
        }
    }
}

#[test]
fn analytic_a_short_pulse_sees_less_inductance_than_a_slow_one() {
    let motor = built_in("paper-5k5").expect("built in").linearised();
    let branch = EddyBranch { time_constant: 50e-6, d_depth: 0.2, q_depth: 0.1 };
    let circuit = motor.magnetics.with_eddy_currents(Some(branch));
    let slow = circuit.inductance();
    let eddy = circuit.eddy(Dq::new(1.0, 1.0)).expect("a branch");
    let gamma = circuit.state(Dq::new(0.5, 0.1), Heading::ZERO).inverse_inductance;
    let fast_d = 1.0 / (gamma.xx + eddy.inverse_inductance.d);
    let fast_q = 1.0 / (gamma.yy + eddy.inverse_inductance.q);
    assert!((fast_d / slow.xx - 0.8).abs() < 1e-12 && (fast_q / slow.yy - 0.9).abs() < 1e-12);
}

#[test]
fn analytic_cogging_is_the_slope_of_its_energy() {
    let cogging = Cogging { torque: 0.4, periods: 6 };
    let h = 1e-6;
    for step in 0..20 {
        let angle = 0.3 * f64::from(step);
        // Over the mechanical angle, four electrical radians each.
        let slope = 4.0 * (cogging.energy(angle + h, 4) - cogging.energy(angle - h, 4)) / (2.0 * h);
        assert!((cogging.at(angle) + slope).abs() < 1e-8);
    }
}

#[test]
fn law_a_rotor_stands_where_friction_holds_it() {
    let mut motor = built_in("slot-harmonics").expect("built in");
    for step in 0..36 {
        let angle = f64::from(step) / 5.0;
        assert_eq!(motor.standing_angle(angle, 0.0), Some(angle), "cogging is below the stiction");
    }
    motor.rotor.friction.stiction = 0.1;
    for step in 0..36 {
        let angle = f64::from(step) / 5.0;
        let stands = motor.standing_angle(angle, 0.05).expect("cogging holds it");
        let net = motor.cogging(stands) - 0.05;
        assert!(net.abs() <= 0.1 + 1e-9, "{angle}: stands at {stands} with {net} N m");
        assert!((stands - angle).abs() <= TAU / 6.0);
        // Downhill: the torque at the start pushed it there.
        let start = motor.cogging(angle) - 0.05;
        assert!(stands == angle || (stands - angle) * start > 0.0, "{angle} {stands} {start}");
    }
    assert_eq!(motor.standing_angle(0.3, 5.0), None, "nothing holds it against such a load");
}

#[test]
fn analytic_a_rotor_that_slides_comes_to_rest_where_its_energy_is_spent() {
    let mut motor = built_in("slot-harmonics").expect("built in");
    motor.rotor.friction = crate::Friction { stiction: 0.1, coulomb: 0.1, viscous: 0.0 };
    motor.rotor.cogging = Some(Cogging { torque: 0.25, periods: 6 });
    // From 6θ = 90°: 0.25 cos x = 0.1 (π/2 − x) at −31.8°, where 0.132 N m are more than friction holds; back to
    // 0.25 (cos x − cos 31.8°) = 0.1 (x + 31.8°), at -15.6°.
    let stop = |from: f64, low: f64, high: f64| {
        let left = |x: f64| 0.25 * (x.cos() - from.cos()) - 0.1 * (x - from).abs();
        let (mut low, mut high, sign) = (low, high, left(low).signum());
        for _ in 0..100 {
            let x = (low + high) / 2.0;
            if left(x) * sign > 0.0 { low = x } else { high = x }
        }
        low
    };
    let once = stop(TAU / 4.0, 0.0, -1.5);
    assert!((once.to_degrees() + 31.8).abs() < 0.1, "{}", once.to_degrees());
    let twice = stop(once, once + 0.1, 1.0);
    for way in [1.0, -1.0] {
        let stands = 6.0 * motor.standing_angle(way * TAU / 24.0, 0.0).expect("a well");
        assert!((stands - way * twice).abs() < 1e-9, "{} {}", stands.to_degrees(), twice.to_degrees());
        assert!(stands.abs() < 23.6_f64.to_radians());
    }
    // With more friction the first stop is the last.
    motor.rotor.friction.stiction = 0.14;
    let stands = 6.0 * motor.standing_angle(TAU / 24.0, 0.0).expect("a well");
    assert!((stands - once).abs() < 1e-9, "{}", stands.to_degrees());
    // A load below sliding friction does not carry it on for ever, one above does once it slides over the top.
    assert!(motor.standing_angle(TAU / 24.0, 0.09).is_some());
    motor.rotor.friction.coulomb = 0.01;
    assert_eq!(motor.standing_angle(TAU / 24.0, 0.14), None);
    // Without any friction it is the bottom of its well.
    motor.rotor.friction = crate::Friction::default();
    assert!(motor.standing_angle(TAU / 24.0, 0.0).expect("a well").abs() < 1e-9);
}

#[test]
fn analytic_a_warm_magnet_saturates_its_bridges_less() {
    let cold = built_in("pm-reluctance").expect("built in").magnetics;
    let rest = cold.rest(Heading::ZERO).d;
    // As built: the numbers of the data sheet.
    let same = cold.with_magnet(1.0).expect("a magnet");
    let l = |circuit: &MagneticCircuit| circuit.inductance();
    assert!((l(&same).xx - l(&cold).xx).abs() < 1e-12 && (l(&same).yy - l(&cold).yy).abs() < 1e-12);
    // By hand: at ψ the iron draws (3.96 + 28.5 ψ⁴) ψ, the ribs give G(s) s with G = 81.75 s²/(1 + s²), and
    // 1/L_d = 3.96 + 142.5 ψ⁴ + G (1 + 2/(1 + s²)).
    for (share, l_d, l_q) in [(0.9, 35.18e-3, 151.89e-3), (0.6, 53.6e-3, 158.5e-3)] {
        let hot = cold.with_magnet(share).expect("a magnet");
        let psi = hot.rest(Heading::ZERO).d;
        assert!((psi - share * rest).abs() < 1e-12, "{psi}");
        assert!(hot.state(Dq::new(psi, 0.0), Heading::ZERO).current.norm() < 1e-12);
        let iron = (3.96 + 28.5 * psi.powi(4)) * psi;
        let g = |s: f64| 81.75 * s * s / (1.0 + s * s);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let s = (low + high) / 2.0;
            if g(s) * s < iron { low = s } else { high = s }
        }
        let expected = 1.0 / (3.96 + 142.5 * psi.powi(4) + g(high) * (1.0 + 2.0 / (1.0 + high * high)));
        let Symmetric { xx, xy, yy } = l(&hot);
        assert!((xx / expected - 1.0).abs() < 1e-9 && xy == 0.0, "{share}: {xx} {expected}");
        assert!((xx / l_d - 1.0).abs() < 1e-3 && (yy / l_q - 1.0).abs() < 1e-2, "{share}: {xx} {yy}");
    }
    // No magnet: no flux, and ribs that nothing saturates.
    let shares = [1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 1e-3, 1e-6, 0.0];
    let circuits = shares.map(|share| cold.with_magnet(share).expect("a magnet"));
    for pair in circuits.windows(2) {
        assert!(l(&pair[1]).xx > l(&pair[0]).xx, "{} {}", l(&pair[1]).xx, l(&pair[0]).xx);
    }
    let none = &circuits[shares.len() - 1];
    assert!(none.rest(Heading::ZERO).norm() == 0.0);
    assert!((l(none).xx * 3.96 - 1.0).abs() < 1e-9, "{}", l(none).xx);
    assert!(
        (none.state(Dq::new(0.2, 0.1), Heading::ZERO).current.d
            + none.state(Dq::new(-0.2, 0.1), Heading::ZERO).current.d)
            .abs()
            < 1e-12
    );
    // A colder one is stronger.
    assert!(l(&cold.with_magnet(1.1).expect("a magnet")).xx < l(&cold).xx);
}
