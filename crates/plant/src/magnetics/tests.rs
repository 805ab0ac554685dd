mod circuit;

use super::*;
use crate::{built_in, built_in_names};

fn all_cores() -> Vec<(String, Core)> {
    let mut cores = Vec::new();
    for name in built_in_names() {
        let motor = built_in(name).expect("built in");
        cores.push((format!("{name}, saturated"), motor.magnetics.core().clone()));
        cores.push((format!("{name}, linear"), motor.linearised().magnetics.core().clone()));
    }
    cores
}

/// The flux in Wb up to which a core is looked at: 1.2 times its open-circuit flux, without a magnet 0.5 Wb.
fn reach(core: &Core) -> f64 {
    let rest = core.flux_at(Dq::new(0.0, 0.0)).expect("open circuit").d.abs();
    1.2 * if rest > 1e-9 { rest } else { 0.4 }
}

/// Fluxes around the working range of a core.
fn fluxes(core: &Core) -> impl Iterator<Item = Dq<f64>> {
    let reach = reach(core);
    (-5..=5).flat_map(move |d| {
        (-5..=5)
            .map(move |q| Dq::new(reach * (f64::from(d) + 0.13) / 5.2, reach * (f64::from(q) - 0.09) / 5.2))
    })
}

#[test]
fn law_current_is_the_gradient_of_the_energy() {
    for (name, core) in all_cores() {
        for flux in fluxes(&core) {
            let h = 2e-5 * reach(&core);
            let slope =
                |step: Dq<f64>| (core.energy(flux + step) - core.energy(flux - step)) / (2.0 * step.norm());
            let i = core.current(flux);
            let numeric = Dq::new(slope(Dq::new(h, 0.0)), slope(Dq::new(0.0, h)));
            assert!((i - numeric).norm() < 1e-5 * (1.0 + i.norm()), "{name} at {flux:?}: {i:?} {numeric:?}");
        }
    }
}

#[test]
fn law_inverse_inductance_is_the_gradient_of_the_current_and_positive_definite() {
    for (name, core) in all_cores() {
        for flux in fluxes(&core) {
            let h = 2e-5 * reach(&core);
            let slope =
                |step: Dq<f64>| (core.current(flux + step) - core.current(flux - step)) * (0.5 / step.norm());
            let (along_d, along_q) = (slope(Dq::new(h, 0.0)), slope(Dq::new(0.0, h)));
            let (_, gamma) = core.current_and_inverse_inductance(flux);
            let scale = gamma.xx.abs() + gamma.yy.abs();
            // Both off-diagonal differences against the one element: reciprocity.
            for (numeric, exact) in
                [(along_d.d, gamma.xx), (along_d.q, gamma.xy), (along_q.d, gamma.xy), (along_q.q, gamma.yy)]
            {
                assert!((numeric - exact).abs() < 1e-6 * scale, "{name} at {flux:?}: {numeric} {exact}");
            }
            assert!(gamma.is_positive_definite(), "{name} at {flux:?}");
        }
    }
}

#[test]
fn law_flux_at_inverts_current() {
    for (name, core) in all_cores() {
        for (d, q) in [(0.0, 0.0), (8.0, 0.0), (-8.0, 0.0), (3.0, -5.0), (-2.0, 7.0)] {
            let current = Dq::new(d, q);
            let flux = core.flux_at(current).expect("a convex core has a flux for each current");
            assert!((core.current(flux) - current).norm() < 1e-9, "{name} at {current:?}");
        }
    }
}

#[test]
fn analytic_published_value_of_the_reluctance_motor() {
    // i(0.3 + 0.1j Wb) evaluated from the published coefficients.
    let core = built_in("reluctance-6k7").expect("built in").magnetics.core().clone();
    let i = core.current(Dq::new(0.3, 0.1));
    assert!((i.d - 5.995_917).abs() < 1e-6 && (i.q - 12.798).abs() < 1e-6, "{i:?}");
}

#[test]
fn analytic_published_values_of_the_magnet_assisted_reluctance_motor() {
    let core = built_in("pm-reluctance").expect("built in").magnetics.core().clone();
    let flux = |i_d: f64| core.flux_at(Dq::new(i_d, 0.0)).expect("flux").d;
    for (current, expected) in [(0.0, 0.476_690), (8.8, 0.730_740), (-8.8, 0.265_637)] {
        assert!((flux(current) - expected).abs() < 1e-6, "{current} A: {} Wb", flux(current));
    }
    let l = core.current_and_inverse_inductance(Dq::new(flux(0.0), 0.0)).1.inverse();
    assert!((l.xx - 29.83e-3).abs() < 0.01e-3 && (l.yy - 149.68e-3).abs() < 0.01e-3, "{l:?}");
}

#[test]
fn analytic_the_paper_motor_saturates_as_table_2_tells() {
    let core = built_in("paper-5k5").expect("built in").magnetics.core().clone();
    let inductance = |i_d: f64| {
        let flux = core.flux_at(Dq::new(i_d, 0.0)).expect("flux");
        core.current_and_inverse_inductance(flux).1.inverse().xx
    };
    let rest = inductance(0.0);
    assert!((rest - 10.65e-3).abs() < 0.01e-3, "{rest}");
    assert!((inductance(8.0) / rest - 1.0 + 0.063).abs() < 0.001, "{}", inductance(8.0) / rest);
    assert!((inductance(-8.0) / rest - 1.0 - 0.034).abs() < 0.001, "{}", inductance(-8.0) / rest);
}

#[test]
fn analytic_saturated_cores_at_rest_match_their_windings() {
    for name in built_in_names() {
        let motor = built_in(name).expect("built in");
        let core = motor.magnetics.core();
        let flux = core.flux_at(Dq::new(0.0, 0.0)).expect("open circuit");
        let l = core.current_and_inverse_inductance(flux).1.inverse();
        assert!((l.xx / motor.winding.d_axis_inductance() - 1.0).abs() < 1e-3, "{name}: {}", l.xx);
        assert!((l.yy / motor.winding.q_axis_inductance() - 1.0).abs() < 1e-3, "{name}: {}", l.yy);
        assert!((flux.d - motor.magnet_flux).abs() < 1e-3 * (motor.magnet_flux + 1e-6), "{name}: {}", flux.d);
    }
}
