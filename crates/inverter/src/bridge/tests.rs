use super::*;
use crate::DeviceKind;
use Conduction::{Blocked, LowerDiode, LowerReverse, LowerSwitch, UpperDiode, UpperReverse, UpperSwitch};

const REAL: Bridge = Bridge {
    devices: Devices {
        kind: DeviceKind::Igbt,
        switch_drop: 0.9,
        switch_resistance: 0.05,
        diode_drop: 1.0,
        diode_resistance: 0.03,
    },
    open_leg: OpenLeg::Diodes,
    terminal_capacitance: 0.0,
    terminal_resistance: 0.0,
    disconnected: [false; 3],
};

const MOSFETS: Bridge = Bridge {
    devices: Devices { kind: DeviceKind::Mosfet, switch_drop: 0.0, ..REAL.devices },
    open_leg: OpenLeg::Diodes,
    terminal_capacitance: 0.0,
    terminal_resistance: 0.0,
    disconnected: [false; 3],
};

/// Inverse inductance of the paper's motor with its rotor at 30°.
fn port(current: [f64; 3]) -> Port {
    let (sin, cos) = 30_f64.to_radians().sin_cos();
    Port {
        current,
        inverse_inductance: Symmetric::new(1.0 / 10.65e-3, 0.0, 1.0 / 16.95e-3).unpark_by(sin, cos),
        holding: AlphaBeta::new(0.0, 0.0),
        dc_link: 550.0,
    }
}

#[test]
fn law_at_rest_with_all_gates_off_nothing_conducts() {
    assert_eq!(REAL.resolve([Gate::Off; 3], &port([0.0; 3])), [Blocked; 3]);
    assert_eq!(REAL.resolve([Gate::Low; 3], &port([0.0; 3])), [Blocked; 3]);
}

#[test]
fn law_a_line_pulse_takes_two_legs_and_leaves_the_third_within_the_rails() {
    let (gates, port) = ([Gate::High, Gate::Low, Gate::Off], port([0.0; 3]));
    let modes = REAL.resolve(gates, &port);
    assert_eq!(modes, [UpperSwitch, LowerSwitch, Blocked]);
    assert_eq!(REAL.with_all_resting(gates, &port), Some(modes), "seen at first look");
    let u = REAL.potentials(gates, modes, &port);
    assert!((u[0] - 549.1).abs() < 1e-12 && (u[1] - 0.9).abs() < 1e-12 && u[2] > 0.0 && u[2] < 550.0);
    // The blocked leg's potential is the one at which its current stays.
    let slope = port.inverse_inductance.times(plane(u) - port.holding);
    assert!(AXES[2].dot(slope).abs() < 1e-9);
}

#[test]
fn law_currents_choose_diodes_when_the_gates_open() {
    let modes = REAL.resolve([Gate::Off; 3], &port([1.3, -1.3, 0.0]));
    assert_eq!(modes, [LowerDiode, UpperDiode, Blocked]);
}

#[test]
fn law_in_low_side_freewheel_the_idle_leg_conducts_where_saliency_lifts_it_out_of_the_rails() {
    let gates = [Gate::Low, Gate::Low, Gate::Off];
    let ideal = Bridge::default();
    let mut conducting = 0;
    for degree in (0..360).step_by(10) {
        let (sin, cos) = f64::from(degree).to_radians().sin_cos();
        let mut port = port([3.0, -3.0, 0.0]);
        port.inverse_inductance = Symmetric::new(1.0 / 10.65e-3, 0.0, 1.0 / 16.95e-3).unpark_by(sin, cos);
        port.holding = AlphaBeta::new(3.0, -3.0 / 3.0_f64.sqrt()) * 1.0;
        let modes = ideal.resolve(gates, &port);
        assert_eq!(modes[..2], [LowerDiode, LowerSwitch]);
        assert_ne!(modes[2], UpperDiode, "nothing lifts the leg to the positive rail");
        conducting += u32::from(modes[2] == LowerDiode);
        let open = Bridge { open_leg: OpenLeg::Open, ..ideal };
        assert_eq!(open.resolve(gates, &port)[2], Blocked);
    }
    assert!(conducting > 5 && conducting < 36, "{conducting}");
}

#[test]
fn law_a_back_emf_above_the_link_rectifies() {
    let mut port = port([0.0; 3]);
    port.holding = AlphaBeta::new(500.0, 0.0);
    assert_eq!(REAL.resolve([Gate::Off; 3], &port)[0], UpperDiode);
}

#[test]
fn law_the_channel_of_a_mosfet_is_a_resistance_both_ways() {
    let potential = |gates, current| {
        let port = port(current);
        let modes = MOSFETS.resolve(gates, &port);
        (modes, MOSFETS.potentials(gates, modes, &port))
    };
    for i in [-4.0, -1e-6, 1e-6, 4.0] {
        let (modes, u) = potential([Gate::High, Gate::Low, Gate::Low], [i, -i, 0.0]);
        // Legs a and b are resistances whichever way the current flows; c, at zero, is at its rail as well.
        assert!((u[0] - (550.0 - 0.05 * i)).abs() < 1e-12 && (u[1] - 0.05 * i).abs() < 1e-12, "{u:?}");
        assert!(u[2].abs() < 1e-12 && modes[2] != Blocked, "{modes:?} {u:?}");
        let (modes, u) = potential([Gate::Off; 3], [i, -i, 0.0]);
        let (a, b) = if i > 0.0 { (LowerDiode, UpperDiode) } else { (UpperDiode, LowerDiode) };
        assert_eq!(modes, [a, b, Blocked]);
        let down = -1.0 - 0.03 * i.abs();
        assert!((u[0] - if i > 0.0 { down } else { 550.0 - down }).abs() < 1e-12, "{u:?}");
    }
    let (modes, _) = potential([Gate::Low, Gate::High, Gate::Off], [2.0, -2.0, 0.0]);
    assert_eq!(modes[..2], [LowerReverse, UpperReverse]);
}

#[test]
fn law_a_back_emf_flows_through_the_channels_of_mosfets_without_threshold() {
    let mut port = port([0.0; 3]);
    port.holding = AlphaBeta::new(0.3, 0.1);
    assert_eq!(REAL.resolve([Gate::Low; 3], &port), [Blocked; 3]);
    assert!(!MOSFETS.resolve([Gate::Low; 3], &port).contains(&Blocked));
}

/// Random gates, currents and back-EMFs: the modes found must satisfy every condition, and no margin of
/// theirs may be negative.
#[test]
fn law_resolved_modes_never_contradict_themselves() {
    let mut state = 1_u64;
    let mut random = || {
        // A 64-bit linear congruential generator, enough to shuffle test cases.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let gate = |x: f64| match x {
        x if x < 1.0 / 3.0 => Gate::Off,
        x if x < 2.0 / 3.0 => Gate::Low,
        _ => Gate::High,
    };
    for case in 0..20_000 {
        let gates = [gate(random()), gate(random()), gate(random())];
        let i = AlphaBeta::new(random() - 0.5, random() - 0.5);
        let current = match case % 3 {
            0 => [0.0; 3],
            1 => [i.alpha, -i.alpha, 0.0],
            _ => i.phases().0,
        };
        let (sin, cos) = (random() * 6.3).sin_cos();
        let port = Port {
            current,
            inverse_inductance: Symmetric::new(90.0, 20.0 * (random() - 0.5), 60.0).unpark_by(sin, cos),
            holding: AlphaBeta::new(random() - 0.5, random() - 0.5) * 800.0,
            dc_link: 550.0,
        };
        let bridge = [REAL, MOSFETS][case / 3 % 2];
        let modes = bridge.resolve(gates, &port);
        let resting = current.map(|x| x == 0.0);
        let fit = bridge.fit(gates, modes, resting, &port);
        assert!(fit > -1e-9, "case {case}: {gates:?} {port:?} gave {modes:?} with {fit}");
    }
}

/// The first guess against the search through all combinations, with random and with exactly balanced ports.
#[test]
fn law_what_is_likely_is_what_the_search_finds() {
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let ideal = Bridge::default();
    let open = Bridge { open_leg: OpenLeg::Open, ..REAL };
    let ideal_open = Bridge { open_leg: OpenLeg::Open, ..ideal };
    let mut at_once = 0;
    for case in 0..60_000 {
        let bridge = [REAL, ideal, open, ideal_open, MOSFETS][case % 5];
        let gates = [(); 3].map(|()| match random() {
            x if x < 0.34 => Gate::Off,
            x if x < 0.67 => Gate::Low,
            _ => Gate::High,
        });
        let i = AlphaBeta::new(random() - 0.5, random() - 0.5);
        let mut current = match case / 4 % 4 {
            0 | 1 => [0.0; 3],
            2 => [i.alpha, -i.alpha, 0.0],
            _ => i.phases().0,
        };
        current.rotate_left(case % 3);
        let (sin, cos) = (random() * 6.3).sin_cos();
        let size = [800.0, 3.0, 1e-6, 0.0][case / 16 % 4];
        // Without saliency all is balanced: the idle leg stands where it neither does nor does not conduct.
        let saliency = if case % 6 == 0 { 0.0 } else { 70.0 * random() };
        let port = Port {
            current,
            inverse_inductance: Symmetric::new(90.0, 0.0, 90.0 - saliency).unpark_by(sin, cos),
            holding: AlphaBeta::new(random() - 0.5, random() - 0.5) * size,
            dc_link: if case % 7 == 0 { 0.0 } else { 550.0 },
        };
        let modes = bridge.resolve(gates, &port);
        let resting = current.iter().filter(|current| **current == 0.0).count();
        assert_eq!(modes, bridge.search(gates, &port), "case {case}: {bridge:?} {gates:?} {port:?}");
        // A current flows on, in a winding, whatever the gates do.
        for (mode, current) in modes.iter().zip(current) {
            assert!(current == 0.0 || *mode != Blocked, "case {case}: {current} A through a blocked leg");
        }
        at_once += u32::from(resting == 3 && bridge.with_all_resting(gates, &port).is_some());
    }
    assert!(at_once > 5000, "{at_once}");
}
