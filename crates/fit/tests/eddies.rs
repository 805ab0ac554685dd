//! Eddy currents from records: a linear motor with one branch for each axis, integrated here by steps of 50 ns,
//! `dψ/dt = u − R i`, `i = ψ/L + G (ψ − χ)`, `dχ/dt = (ψ − χ)/τ`, `G = k/((1 − k) L)`: an infinitely short pulse meets (1 − k) L.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use std::fmt::Write as _;

use standstill_fit::record::Record;
use standstill_fit::{DeviceKind, Devices, Estimate, Fit, MISFIT, MOST_USED, Start, fit};
use standstill_plant::DataSheet;

const RESISTANCE: f64 = 0.5;
const INDUCTANCE: [f64; 2] = [150e-6, 190e-6];
const TIME: f64 = 8e-6;
const LINK: f64 = 36.0;
const ANGLE: f64 = 40.0;

/// A record of trains +, −, + along each of three phases, 75, 150 and 75 µs, with noise of 5 mA.
fn record(depth: [f64; 2], angle: f64) -> Record {
    const DT: f64 = 50e-9;
    let mut text = "t_s,i_a_A,i_b_A,i_c_A,u_dc_V,leg_a,leg_b,leg_c\n".to_owned();
    let mut stages = Vec::new();
    for phase in 0..3 {
        let along = |high: bool| std::array::from_fn::<_, 3, _>(|k| (k == phase) == high);
        stages.extend([
            (1_500, [false; 3]),
            (1_500, along(true)),
            (3_000, along(false)),
            (1_500, along(true)),
        ]);
        stages.push((40_000, [false; 3]));
    }
    let axis = |k: usize| (angle - 120.0 * k as f64).to_radians();
    let (mut psi, mut chi) = ([0.0_f64; 2], [0.0_f64; 2]);
    let (mut seed, mut time, mut next) = (1_u64, 0.0, 0.0);
    let mut noise = || {
        // The sum of twelve uniform numbers, less six.
        let sum: f64 = (0..12)
            .map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (seed >> 11) as f64 / (1_u64 << 53) as f64
            })
            .sum();
        5e-3 * (sum - 6.0)
    };
    for (steps, legs) in stages {
        let on = legs.map(|high| if high { LINK } else { 0.0 });
        let along = |wave: fn(f64) -> f64| 2.0 / 3.0 * (0..3).map(|k| on[k] * wave(axis(k))).sum::<f64>();
        let voltage = [along(f64::cos), -along(f64::sin)];
        for _ in 0..steps {
            let current: [f64; 2] = std::array::from_fn(|n| {
                let g = depth[n] / ((1.0 - depth[n]) * INDUCTANCE[n]);
                psi[n] / INDUCTANCE[n] + g * (psi[n] - chi[n])
            });
            if time >= next {
                // Slow where nothing changes.
                next += if steps > 10_000 { 20e-6 } else { 2e-6 };
                let phase: [f64; 3] = std::array::from_fn(|k| {
                    current[0] * axis(k).cos() - current[1] * axis(k).sin() + noise()
                });
                let names = legs.map(|high| if high { "high" } else { "low" });
                let [a, b, c] = phase;
                writeln!(text, "{time:.9},{a:.5},{b:.5},{c:.5},{LINK},{}", names.join(",")).expect("a text");
            }
            for n in 0..2 {
                let lag = psi[n] - chi[n];
                psi[n] += DT * (voltage[n] - RESISTANCE * current[n]);
                chi[n] += DT * lag / TIME;
            }
            time += DT;
        }
    }
    Record::parse("eddies.csv", &text).expect("a record")
}

fn fitted(record: &Record) -> Fit {
    let devices = Devices {
        kind: DeviceKind::Mosfet,
        switch_drop: 0.0,
        switch_resistance: 0.0,
        diode_drop: 0.8,
        diode_resistance: 0.01,
    };
    let stated = ["switch_resistance", "dead_time"].map(str::to_owned).to_vec();
    let start = Start { motor: None, devices, dead_time: 0.0, stated, settle: 0.0, most_used: MOST_USED };
    fit(std::slice::from_ref(record), &start, &|| false).expect("a motor")
}

fn estimate<'a>(fit: &'a Fit, name: &str) -> Option<&'a Estimate> {
    fit.parameters.iter().find(|estimate| estimate.name == name)
}

#[test]
fn law_eddy_currents_are_found_with_the_motor_that_has_them() {
    let found = fitted(&record([0.4, 0.25], ANGLE));
    assert!(found.widened < MISFIT && found.residual_rms < 6e-3, "{} {}", found.widened, found.residual_rms);
    for (name, truth, share) in [
        ("eddy.d_depth", 0.4, 0.05),
        ("eddy.q_depth", 0.25, 0.05),
        ("eddy.time_constant", TIME, 0.05),
        ("L_d", INDUCTANCE[0], 0.01),
        ("L_q", INDUCTANCE[1], 0.01),
        ("resistance", RESISTANCE, 0.02),
    ] {
        let of = estimate(&found, name).expect("an estimate");
        assert!(of.identified && (of.value / truth - 1.0).abs() < share, "{of:?}, not {truth}");
    }
    let angle = estimate(&found, "angle").expect("an estimate").value;
    let off = (angle - ANGLE + 90.0).rem_euclid(180.0) - 90.0;
    assert!(off.abs() < 0.2, "{angle}");
    // A data sheet has them, and is read again.
    let sheet = found.sheet("eddies.csv", None);
    let motor = DataSheet::parse("motor.toml", &sheet).and_then(|sheet| sheet.motor()).expect("a motor");
    let eddy = motor.magnetics.eddy_currents().expect("eddy currents");
    assert!((eddy.d_depth - 0.4).abs() < 0.02 && (eddy.time_constant / TIME - 1.0).abs() < 0.05, "{eddy:?}");
}

#[test]
fn law_a_motor_without_eddy_currents_is_given_none() {
    let found = fitted(&record([0.0, 0.0], ANGLE));
    assert!(found.widened < MISFIT && estimate(&found, "eddy.time_constant").is_none(), "{}", found.widened);
    assert!(!found.sheet("eddies.csv", None).contains("[eddy]"));
}
