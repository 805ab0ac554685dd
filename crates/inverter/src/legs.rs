//! What the modes make of the legs while they hold: the terminal potentials of one machine, or of several side by side.

use standstill_interface::{AlphaBeta, Dq};
use standstill_numeric::{Heading, Lane, Symmetric};

use crate::bridge::AXES;
use crate::devices::Clamp;
use crate::{Bridge, Conduction, Devices, Gate, Modes, OpenLeg};

/// A leg in its mode. Conducting, it has the potential of its device, `u = rail · U_dc + offset − resistance · i`; blocked,
/// that which keeps its current.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LegMode<T = f64> {
    /// 1 at the positive rail, 0 at the negative or blocked.
    pub rail: T,
    /// In V.
    pub offset: T,
    /// In Ω.
    pub resistance: T,
    /// +1 for current into the motor, −1 for current out of it, 0 for none.
    pub direction: T,
    /// 1 if it is blocked while the others conduct, else 0.
    pub blocked: T,
}

/// The three legs in their modes. With all three blocked only the differences of their potentials follow.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Legs<T = f64> {
    /// Leg by leg.
    pub leg: [LegMode<T>; 3],
    /// 1 if all are blocked, else 0.
    pub idle: T,
}

/// What a leg of a bridge is in each mode.
#[derive(Clone, Copy, Debug)]
pub struct LegModes([LegMode; 5]);

impl LegModes {
    /// With these devices.
    pub fn new(devices: &Devices) -> Self {
        Self(Conduction::ALL.map(|mode| match devices.clamp(mode) {
            Some(Clamp { rail, offset, resistance }) => {
                LegMode { rail, offset, resistance, direction: mode.direction(), blocked: 0.0 }
            }
            None => LegMode { blocked: 1.0, ..LegMode::default() },
        }))
    }

    /// A leg in this mode.
    #[inline]
    pub fn of(&self, mode: Conduction) -> LegMode {
        self.0[mode as usize]
    }

    /// A leg of a bridge of which nothing conducts: no leg is blocked while others conduct.
    pub fn idle(&self) -> LegMode {
        LegMode::default()
    }

    /// The legs in these modes.
    pub fn legs(&self, modes: Modes) -> Legs {
        let mut legs = Legs::default();
        self.put(modes, &mut legs);
        legs
    }

    /// Makes legs those in these modes. In their place: a copy of what was just written piece by piece would wait until all
    /// of it has left the processor.
    #[inline(always)]
    pub fn put(&self, modes: Modes, legs: &mut Legs) {
        let blocked = |k: usize| u32::from(modes[k] == Conduction::Blocked);
        if blocked(0) + blocked(1) + blocked(2) >= 2 {
            *legs = Legs { idle: 1.0, ..Legs::default() };
            return;
        }
        for (leg, mode) in legs.leg.iter_mut().zip(modes) {
            *leg = self.0[mode as usize];
        }
        legs.idle = 0.0;
    }
}

impl Legs {
    /// Legs of which only this is known, which are blocked: one or all.
    pub fn blocked(blocked: [bool; 3]) -> Self {
        let modes = blocked.map(|blocked| if blocked { Conduction::Blocked } else { Conduction::LowerDiode });
        LegModes::new(&Devices::default()).legs(modes)
    }
}

/// The legs as a winding without neutral sees them, in a plane that is turned against the stator's.
#[derive(Clone, Copy, Debug)]
pub struct Terminals<T = f64> {
    /// Voltage per volt of the link.
    pub rail: AlphaBeta<T>,
    /// Voltage in V on top.
    pub offset: AlphaBeta<T>,
    /// Resistance of the devices in Ω.
    pub resistance: Symmetric<T>,
    /// Axis of the leg that is blocked while the others conduct; zero if there is none.
    pub blocked: AlphaBeta<T>,
    /// 1 if there is none, else 0.
    pub free: T,
}

impl<T: Lane> Terminals<T> {
    /// Voltage in V that conducting legs apply, at a current in A.
    #[inline(always)]
    pub fn voltage(&self, dc_link: T, current: AlphaBeta<T>) -> AlphaBeta<T> {
        self.rail * dc_link + self.offset - self.resistance.times(current)
    }
}

impl Bridge {
    /// Between which potentials a leg can be blocked, from below and from above, each as its share of the link's voltage
    /// and volts on top.
    pub fn clamps(&self, gate: Gate) -> [[f64; 2]; 2] {
        if gate == Gate::Off && self.open_leg == OpenLeg::Open {
            return [[0.0, f64::NEG_INFINITY], [0.0, f64::INFINITY]];
        }
        [Conduction::outflow(gate), Conduction::inflow(gate)].map(|mode| {
            let clamp = self.devices.clamp(mode).unwrap_or_default();
            [clamp.rail, clamp.offset]
        })
    }
}

impl<T: Lane> Legs<T> {
    /// The same in a plane at this angle.
    #[inline(always)]
    pub fn terminals(&self, at: Heading<T>) -> Terminals<T> {
        let zero = T::of(0.0);
        let none = AlphaBeta::new(zero, zero);
        let mut all = Terminals {
            rail: none,
            offset: none,
            resistance: Symmetric::new(zero, zero, zero),
            blocked: none,
            free: T::of(1.0),
        };
        for (axis, leg) in AXES.iter().zip(&self.leg) {
            let Dq { d, q } = AlphaBeta::new(T::of(axis.alpha), T::of(axis.beta)).park_by(at.sin, at.cos);
            let axis = AlphaBeta::new(d, q);
            all.rail = all.rail + axis * (leg.rail * (2.0 / 3.0));
            all.offset = all.offset + axis * (leg.offset * (2.0 / 3.0));
            let across = axis * (leg.resistance * (2.0 / 3.0));
            all.resistance.xx = all.resistance.xx + across.alpha * d;
            all.resistance.xy = all.resistance.xy + across.alpha * q;
            all.resistance.yy = all.resistance.yy + across.beta * q;
            all.blocked = all.blocked + axis * leg.blocked;
            all.free = all.free - leg.blocked;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Modes, Port};
    use Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};

    const BRIDGE: Bridge = Bridge {
        devices: Devices {
            switch_drop: 0.9,
            switch_resistance: 0.05,
            diode_drop: 1.0,
            diode_resistance: 0.03,
        },
        open_leg: OpenLeg::Diodes,
    };

    /// What a winding of resistance R sees of the legs, in a plane at any angle, is what their potentials make.
    #[test]
    fn analytic_the_legs_in_one_equation_are_the_legs_one_by_one() {
        let (sin, cos) = 0.7_f64.sin_cos();
        let gamma = Symmetric::new(94.0, 3.0, 59.0);
        let current = AlphaBeta::new(2.0, -1.3);
        for modes in [
            [UpperSwitch, LowerSwitch, LowerDiode],
            [UpperDiode, LowerDiode, UpperSwitch],
            [UpperSwitch, LowerSwitch, Blocked],
            [Blocked, LowerDiode, UpperDiode],
        ] as [Modes; 4]
        {
            let port = Port {
                current: current.phases().0,
                inverse_inductance: gamma,
                holding: current * 1.2,
                dc_link: 550.0,
            };
            let potentials = BRIDGE.potentials([Gate::Off; 3], modes, &port);
            let expected = standstill_interface::Abc(potentials).clarke();
            let terminals = LegModes::new(&BRIDGE.devices).legs(modes).terminals(Heading { sin, cos });
            let turn = |v: AlphaBeta<f64>| {
                let Dq { d, q } = v.park_by(sin, cos);
                AlphaBeta::new(d, q)
            };
            let mut voltage = terminals.voltage(550.0, turn(current));
            if terminals.free == 0.0 {
                // The blocked leg's current stays.
                let gamma = gamma.unpark_by(-sin, cos);
                let across = gamma.times(terminals.blocked);
                let driving = voltage - turn(port.holding);
                voltage = voltage - terminals.blocked * (across.dot(driving) / across.dot(terminals.blocked));
            }
            assert!((voltage - turn(expected)).norm() < 1e-10, "{modes:?}");
        }
    }

    #[test]
    fn law_a_blocked_leg_ends_where_a_device_begins_to_conduct() {
        let open = Bridge { open_leg: OpenLeg::Open, ..BRIDGE };
        assert_eq!(open.clamps(Gate::Off), [[0.0, f64::NEG_INFINITY], [0.0, f64::INFINITY]]);
        assert_eq!(open.clamps(Gate::Low), BRIDGE.clamps(Gate::Low));
        assert_eq!(BRIDGE.clamps(Gate::Off), [[0.0, -1.0], [1.0, 1.0]]);
        assert_eq!(BRIDGE.clamps(Gate::Low), [[0.0, -1.0], [0.0, 0.9]]);
        assert_eq!(BRIDGE.clamps(Gate::High), [[1.0, -0.9], [1.0, 1.0]]);
    }

    #[test]
    fn law_one_leg_alone_cannot_conduct() {
        let legs = LegModes::new(&BRIDGE.devices);
        assert_eq!(legs.legs([Blocked, LowerSwitch, Blocked]), legs.legs([Blocked; 3]));
        assert_eq!(legs.legs([Blocked; 3]).idle, 1.0);
        assert_eq!(Legs::blocked([false, true, false]).leg.map(|leg| leg.blocked), [0.0, 1.0, 0.0]);
    }
}
