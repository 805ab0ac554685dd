//! The three legs together: which devices conduct, and the terminal potentials that follow.

use standstill_interface::AlphaBeta;
use standstill_plant::Symmetric;

use crate::{Conduction, Devices, Gate, Legs};

/// One conduction mode per leg, a to c.
pub type Modes = [Conduction; 3];

/// What an idle leg (both switches off, no current) may do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OpenLeg {
    /// Its diodes conduct as soon as its potential leaves the rails, as in every real bridge.
    #[default]
    Diodes,
    /// It stays without current whatever its potential, as behind a contactor: equation (3) of the paper takes
    /// the third phase as open.
    Open,
}

/// The motor as the bridge sees it at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Port<T = f64> {
    /// Phase currents in A into the motor.
    pub current: [T; 3],
    /// Inverse incremental inductance Γ in 1/H, in the stator's plane.
    pub inverse_inductance: Symmetric<T>,
    /// The voltage in V that would hold the currents as they are: resistive drop plus back-EMF.
    pub holding: AlphaBeta<T>,
    /// DC-link voltage in V.
    pub dc_link: T,
}

/// Switches and diodes of the three legs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// Their drops.
    pub devices: Devices,
    /// What an idle leg may do.
    pub open_leg: OpenLeg,
}

/// Below this current, in A, a leg counts as currentless when modes are resolved.
pub const RESTING_CURRENT: f64 = 1e-9;

/// Magnetic axes of the phases: `i_k = p_k · i`.
pub(crate) const AXES: [AlphaBeta<f64>; 3] = {
    const HALF_ROOT_3: f64 = 0.866_025_403_784_438_6;
    [AlphaBeta::new(1.0, 0.0), AlphaBeta::new(-0.5, HALF_ROOT_3), AlphaBeta::new(-0.5, -HALF_ROOT_3)]
};

impl Bridge {
    /// Bounds in V of a blocked leg's potential.
    fn bounds(&self, gate: Gate, dc_link: f64) -> (f64, f64) {
        if gate == Gate::Off && self.open_leg == OpenLeg::Open {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let bound = |mode| self.devices.clamp(mode).map_or(0.0, |clamp| clamp.potential(dc_link, 0.0));
        (bound(Conduction::outflow(gate)), bound(Conduction::inflow(gate)))
    }

    /// The conduction modes that fit gates and port.
    ///
    /// A leg with current conducts in the direction of its current. For legs without, the modes are the
    /// solution of a complementarity problem: a blocked leg's potential lies within its bounds, a leg that
    /// starts to conduct has its current rise in its direction. Γ is positive definite, so exactly one
    /// combination fits, up to ties of measure zero.
    pub fn resolve(&self, gates: [Gate; 3], port: &Port) -> Modes {
        let mut resting = port.current.map(|current| current.abs() <= RESTING_CURRENT);
        // The currents sum to zero: with two of them zero, so is the third.
        if resting.iter().filter(|rests| **rests).count() >= 2 {
            resting = [true; 3];
        }
        let options = |leg: usize| -> [Option<Conduction>; 3] {
            let (out, into) = (Conduction::outflow(gates[leg]), Conduction::inflow(gates[leg]));
            if resting[leg] && gates[leg] == Gate::Off && self.open_leg == OpenLeg::Open {
                return [Some(Conduction::Blocked), None, None];
            }
            match (resting[leg], port.current[leg] > 0.0) {
                (true, _) => [Some(Conduction::Blocked), Some(out), Some(into)],
                (false, true) => [Some(out), None, None],
                (false, false) => [Some(into), None, None],
            }
        };
        // No choice: one mode each, as the currents flow.
        let flowing = |leg: usize| {
            let gate = gates[leg];
            if port.current[leg] > 0.0 { Conduction::outflow(gate) } else { Conduction::inflow(gate) }
        };
        if resting == [false; 3] {
            return [0, 1, 2].map(flowing);
        }
        // Mostly a single leg that rests goes on resting.
        if let Some(leg) = resting.iter().position(|rests| *rests)
            && resting != [true; 3]
        {
            let mut modes = [0, 1, 2].map(flowing);
            modes[leg] = Conduction::Blocked;
            let potential = Legs::new(&self.devices, modes).potentials(port)[leg];
            if self.blocked_margin(gates[leg], potential, port.dc_link) >= 0.0 {
                return modes;
            }
        }
        let mut best = ([Conduction::Blocked; 3], f64::NEG_INFINITY);
        for a in options(0).into_iter().flatten() {
            for b in options(1).into_iter().flatten() {
                for c in options(2).into_iter().flatten() {
                    let modes = [a, b, c];
                    let blocked = modes.iter().filter(|mode| **mode == Conduction::Blocked).count();
                    // One conducting leg alone cannot carry a current: the same as all blocked.
                    if blocked == 2 {
                        continue;
                    }
                    let fit = self.fit(gates, modes, resting, port);
                    if fit >= 0.0 {
                        return modes;
                    }
                    if fit > best.1 {
                        best = (modes, fit);
                    }
                }
            }
        }
        best.0
    }

    /// How well modes fit: the smallest margin of a resting leg in V, negative if the modes contradict.
    fn fit(&self, gates: [Gate; 3], modes: Modes, resting: [bool; 3], port: &Port) -> f64 {
        let potentials = self.potentials(gates, modes, port);
        let slope = port.inverse_inductance.times(plane(potentials) - port.holding);
        (0..3)
            .filter(|leg| resting[*leg])
            .map(|leg| match modes[leg] {
                Conduction::Blocked => self.blocked_margin(gates[leg], potentials[leg], port.dc_link),
                mode => {
                    let axis = AXES[leg];
                    mode.direction() * axis.dot(slope) / axis.dot(port.inverse_inductance.times(axis))
                }
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn blocked_margin(&self, gate: Gate, potential: f64, dc_link: f64) -> f64 {
        let (low, high) = self.bounds(gate, dc_link);
        (potential - low).min(high - potential)
    }

    /// Terminal potentials in V against the negative rail.
    ///
    /// A conducting leg's potential is its device's. A blocked leg k has the potential that keeps its current:
    /// `p_k · Γ (C u − e) = 0`. With all three blocked, only their differences follow from the back-EMF; the
    /// common potential is taken halfway between the bounds, where equal leakages would hold it.
    #[inline]
    pub fn potentials(&self, gates: [Gate; 3], modes: Modes, port: &Port) -> [f64; 3] {
        let mut potentials = [0.0; 3];
        let mut blocked = [0; 3];
        let mut count = 0;
        for leg in 0..3 {
            if let Some(clamp) = self.devices.clamp(modes[leg]) {
                potentials[leg] = clamp.potential(port.dc_link, port.current[leg]);
            } else {
                blocked[count] = leg;
                count += 1;
            }
        }
        match count {
            0 => {}
            1 => {
                let k = blocked[0];
                let row = port.inverse_inductance.times(AXES[k]);
                let others: f64 = (0..3).filter(|m| *m != k).map(|m| row.dot(AXES[m]) * potentials[m]).sum();
                potentials[k] = (1.5 * row.dot(port.holding) - others) / row.dot(AXES[k]);
            }
            _ => potentials = self.all_blocked(gates, port),
        }
        potentials
    }

    fn all_blocked(&self, gates: [Gate; 3], port: &Port) -> [f64; 3] {
        let holding = AXES.map(|axis| axis.dot(port.holding));
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (gate, e) in gates.into_iter().zip(holding) {
            let (l, h) = self.bounds(gate, port.dc_link);
            low = low.max(l - e);
            high = high.min(h - e);
        }
        let common =
            if low.is_finite() && high.is_finite() { (low + high) / 2.0 } else { port.dc_link / 2.0 };
        holding.map(|e| common + e)
    }

    /// How far each leg is from changing its mode, positive while the mode holds: the current in A of a
    /// conducting leg, the distance to the nearer bound in V of a blocked one.
    #[inline]
    pub fn margins(&self, gates: [Gate; 3], modes: Modes, potentials: [f64; 3], port: &Port) -> [f64; 3] {
        std::array::from_fn(|leg| match modes[leg] {
            Conduction::Blocked => self.blocked_margin(gates[leg], potentials[leg], port.dc_link),
            mode => mode.direction() * port.current[leg],
        })
    }
}

/// Terminal potentials as a voltage in the plane; the common part drops out.
#[inline]
fn plane(potentials: [f64; 3]) -> AlphaBeta<f64> {
    standstill_interface::Abc(potentials).clarke()
}

#[cfg(test)]
mod tests {
    use super::*;
    use Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};

    const REAL: Bridge = Bridge {
        devices: Devices {
            switch_drop: 0.9,
            switch_resistance: 0.05,
            diode_drop: 1.0,
            diode_resistance: 0.03,
        },
        open_leg: OpenLeg::Diodes,
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
            let modes = REAL.resolve(gates, &port);
            let resting = current.map(|x| x == 0.0);
            let fit = REAL.fit(gates, modes, resting, &port);
            assert!(fit > -1e-9, "case {case}: {gates:?} {port:?} gave {modes:?} with {fit}");
        }
    }
}
