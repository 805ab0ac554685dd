//! Voltages and resistances that legs connect to a winding, and the bounds at which their modes end.

use super::*;
use Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};
use standstill_interface::Abc;
use standstill_inverter::{Gate, Port};

const BRIDGE: Bridge = Bridge {
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

/// Returns legs with these gates and conduction modes, for a rotor at 0.7 rad.
fn legs(bridge: &Bridge, gates: [Gate; 3], modes: Modes) -> Legs<f64> {
    let mut legs = Legs::idle(false, false);
    legs.put_axes(0, Heading::of(0.7));
    legs.put_bridge(0, bridge);
    for (leg, gate) in legs.gates.iter_mut().zip(gates) {
        leg.expect(0, Some((0.0, 0.0, gate)));
        leg.carry_out(0);
        leg.expect(0, None);
    }
    legs.put(0, modes);
    assert_eq!(legs.modes(0, 1.0).map(Some), legs_of(modes).map(Some));
    legs
}

/// Returns the modes of the legs that carry current: none if only one leg conducts.
fn legs_of(modes: Modes) -> Modes {
    let flows = modes.iter().filter(|mode| **mode != Blocked).count() > 1;
    if flows { modes } else { [Blocked; 3] }
}

/// The voltage of the three legs in one equation, in a plane at any angle, equals the vector of their potentials.
#[test]
fn analytic_the_legs_in_one_equation_are_the_legs_one_by_one() {
    use Gate::{High, Low, Off};
    let gamma = Symmetric::new(94.0, 3.0, 59.0);
    let current = standstill_interface::AlphaBeta::new(2.0, -1.3);
    let start = Heading::of(0.7);
    for (gates, modes) in [
        ([High, Low, Off], [UpperSwitch, LowerSwitch, LowerDiode]),
        ([Off, Off, High], [UpperDiode, LowerDiode, UpperSwitch]),
        ([High, Low, Off], [UpperSwitch, LowerSwitch, Blocked]),
        ([Off, Low, Off], [Blocked, LowerDiode, UpperDiode]),
    ] {
        let port = Port {
            current: current.phases().0,
            inverse_inductance: gamma,
            holding: current * 1.2,
            dc_link: 550.0,
        };
        let potentials = BRIDGE.potentials(gates, modes, &port);
        let expected = Plane::from_stator(Abc(potentials).clarke(), start);
        let terminals = legs(&BRIDGE, gates, modes).at::<true>(1.0, 0.0).terminals;
        let i = Plane::from_stator(current, start);
        let mut voltage = terminals.rail * 550.0 + terminals.offset - i.through(terminals.resistance);
        if terminals.none_blocked == 0.0 {
            // The blocked leg's current stays constant.
            let across = terminals.blocked.through(gamma.unpark_by(-start.sin, start.cos));
            let driving = voltage - Plane::from_stator(port.holding, start);
            voltage = voltage - terminals.blocked * (across.dot(driving) / across.dot(terminals.blocked));
        }
        let off = voltage - expected;
        assert!(off.dot(off).sqrt() < 1e-10, "{modes:?}");
    }
}

#[test]
fn law_a_blocked_leg_ends_where_a_device_begins_to_conduct() {
    let range = |bridge: &Bridge, gate| {
        let legs = legs(bridge, [Gate::High, Gate::Low, gate], [UpperSwitch, LowerSwitch, Blocked]);
        legs.range_of_blocked(&legs.at::<true>(1.0, 0.0)).at(550.0)
    };
    let open = Bridge { open_leg: OpenLeg::Open, ..BRIDGE };
    assert_eq!(range(&open, Gate::Off), [f64::NEG_INFINITY, f64::INFINITY]);
    assert_eq!(range(&open, Gate::Low), range(&BRIDGE, Gate::Low));
    assert_eq!(range(&BRIDGE, Gate::Off), [-1.0, 551.0]);
    assert_eq!(range(&BRIDGE, Gate::Low), [-1.0, 0.9]);
    assert_eq!(range(&BRIDGE, Gate::High), [549.1, 551.0]);
}

#[test]
fn law_one_leg_alone_cannot_conduct() {
    let alone = legs(&BRIDGE, [Gate::Off, Gate::Low, Gate::Off], [Blocked, LowerSwitch, Blocked]);
    assert!(alone.at::<true>(1.0, 0.0).idle && alone.idle_lanes() & 1 == 1);
}
