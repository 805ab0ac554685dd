//! The three legs together: which devices conduct, and the terminal potentials that follow.

#[cfg(test)]
mod tests;

use standstill_interface::{AlphaBeta, choice};
use standstill_numeric::Symmetric;

use crate::{Conduction, Devices, Gate};

/// Conduction modes of the legs a to c.
pub type Modes = [Conduction; 3];

choice! {
    /// What an idle leg (both switches off, no current) may do.
    #[derive(Default)]
    pub enum OpenLeg {
        /// Its diodes conduct as soon as its potential leaves the rails, as in every real bridge.
        Diodes = "diodes" default,
        /// It stays without current whatever its potential, as behind a contactor: equation (3) of the paper takes
        /// the third phase as open.
        Open = "open",
    }
}

/// The motor as the bridge sees it at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Port<T = f64> {
    /// Phase currents in A into the motor. Exactly zero means that the leg has no current; the caller, who knows how
    /// large the motor's currents are, must round small values to zero.
    pub current: [T; 3],
    /// Inverse incremental inductance Γ in 1/H, in the stator's plane.
    pub inverse_inductance: Symmetric<T>,
    /// The voltage in V that would keep the currents constant: resistive drop plus back-EMF.
    pub holding: AlphaBeta<T>,
    /// DC-link voltage in V.
    pub dc_link: T,
}

/// Switches and diodes of the three legs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// Their drops.
    pub devices: Devices,
    /// Behaviour of a leg with both switches off and no current.
    pub open_leg: OpenLeg,
    /// Capacitance in F of switches and cable from each terminal to the negative rail. Zero: no capacitance, so a leg
    /// without current stores no charge.
    pub terminal_capacitance: f64,
    /// Resistance in Ω of the winding for a current that no device feeds, and that rings with the terminals'
    /// capacitance. At that frequency eddy currents in sheets and conductors increase it.
    pub terminal_resistance: f64,
    /// Legs whose wire to the winding is open. Nothing flows there, and the winding's end may have any potential.
    pub disconnected: [bool; 3],
}

/// Margin in V above which conduction modes are certain. All other modes then violate their margins by as much, except
/// for a factor of the motor's saliency; rounding is a millionth of it.
const CERTAIN: f64 = 1e-6;

/// Magnetic axes of the phases: `i_k = p_k · i`.
pub const AXES: [AlphaBeta<f64>; 3] = {
    const HALF_ROOT_3: f64 = 0.866_025_403_784_438_6;
    [AlphaBeta::new(1.0, 0.0), AlphaBeta::new(-0.5, HALF_ROOT_3), AlphaBeta::new(-0.5, -HALF_ROOT_3)]
};

impl Bridge {
    /// Returns the mode of a leg with this current.
    #[inline]
    fn flowing(&self, gate: Gate, current: f64) -> Conduction {
        let kind = self.devices.kind;
        if current > 0.0 { kind.outflow(gate) } else { kind.inflow(gate) }
    }

    #[inline]
    fn all_flowing(&self, [a, b, c]: [Gate; 3], current: [f64; 3]) -> Modes {
        [self.flowing(a, current[0]), self.flowing(b, current[1]), self.flowing(c, current[2])]
    }

    /// Bounds in V of the potential of a leg in which no device conducts.
    ///
    /// ```
    /// use standstill_inverter::{Bridge, Devices, Gate, OpenLeg};
    ///
    /// let devices = Devices { diode_drop: 0.7, ..Devices::default() };
    /// let bridge = Bridge { devices, open_leg: OpenLeg::Diodes, ..Bridge::default() };
    /// // With both gates off, a terminal's potential may lie anywhere between the two diodes.
    /// assert_eq!(bridge.bounds(Gate::Off, 550.0), (-0.7, 550.7));
    /// ```
    #[inline]
    pub fn bounds(&self, gate: Gate, dc_link: f64) -> (f64, f64) {
        if gate == Gate::Off && self.open_leg == OpenLeg::Open {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        // Where the leg's devices begin to conduct out of it and into it.
        let Devices { switch_drop, diode_drop, .. } = self.devices;
        let [reverse_drop, _] = self.devices.reverse();
        match gate {
            Gate::Off => (-diode_drop, dc_link + diode_drop),
            Gate::Low => (-reverse_drop, switch_drop),
            Gate::High => (dc_link - switch_drop, dc_link + reverse_drop),
        }
    }

    /// Returns the conduction modes that fit gates and port.
    ///
    /// A leg with current conducts in the direction of its current. For legs without, the modes are the solution of a
    /// complementarity problem: a blocked leg's potential lies within its bounds, a leg that starts to conduct has its
    /// current rise in its direction. Γ is positive definite, so exactly one combination fits, up to ties of measure
    /// zero. Both bounds of a MOSFET leg whose gate is on are equal: it is blocked if its current is zero and stays
    /// zero; otherwise its current passes through zero.
    ///
    /// The most frequent combination is tried first, and is taken if it fits so well that no other one can.
    ///
    /// ```
    /// use standstill_interface::AlphaBeta;
    /// use standstill_inverter::{Bridge, Conduction, Gate, OpenLeg, Port};
    /// use standstill_numeric::Symmetric;
    ///
    /// let bridge = Bridge { open_leg: OpenLeg::Diodes, ..Bridge::default() };
    /// // A motor of 10 mH without saliency and without current, phase a pulsed against phase b, phase c open.
    /// let port = Port {
    ///     current: [0.0; 3],
    ///     inverse_inductance: Symmetric { xx: 100.0, xy: 0.0, yy: 100.0 },
    ///     holding: AlphaBeta::new(0.0, 0.0),
    ///     dc_link: 550.0,
    /// };
    /// let gates = [Gate::High, Gate::Low, Gate::Off];
    /// let modes = bridge.resolve(gates, &port);
    /// assert_eq!(modes, [Conduction::UpperSwitch, Conduction::LowerSwitch, Conduction::Blocked]);
    /// // The open terminal lies at the star point, half way between the other two.
    /// let [a, b, c] = bridge.potentials(gates, modes, &port);
    /// assert!((a - 550.0).abs() < 1e-9 && b.abs() < 1e-9 && (c - 275.0).abs() < 1e-9);
    /// ```
    pub fn resolve(&self, gates: [Gate; 3], port: &Port) -> Modes {
        let resting = port.current.map(|current| current == 0.0);
        let likely = match resting {
            [false, false, false] => return self.all_flowing(gates, port.current),
            [true, false, false] => self.with_one_resting(0, gates, port),
            [false, true, false] => self.with_one_resting(1, gates, port),
            [false, false, true] => self.with_one_resting(2, gates, port),
            // The currents sum to zero: with two of them zero, so is the third.
            _ => self.with_all_resting(gates, port),
        };
        likely.unwrap_or_else(|| self.search(gates, port))
    }

    /// Returns the modes where only `leg` is without current: as its potential is within its bounds or beyond one of
    /// them.
    fn with_one_resting(&self, leg: usize, gates: [Gate; 3], port: &Port) -> Option<Modes> {
        let mut modes = self.all_flowing(gates, port.current);
        modes[leg] = Conduction::Blocked;
        let conducting = |leg: usize| {
            let clamp = self.devices.clamp(modes[leg]).unwrap_or_default();
            clamp.potential(port.dc_link, port.current[leg])
        };
        let (m, n) = ((leg + 1) % 3, (leg + 2) % 3);
        let potential = keeping(leg, port, [(m, conducting(m)), (n, conducting(n))]);
        let (low, high) = self.bounds_of(leg, gates[leg], port.dc_link);
        modes[leg] = if (potential - low).min(high - potential) >= 0.0 {
            Conduction::Blocked
        } else if potential < low - CERTAIN {
            self.devices.kind.outflow(gates[leg])
        } else if potential > high + CERTAIN && potential > low + CERTAIN {
            self.devices.kind.inflow(gates[leg])
        } else {
            return None;
        };
        Some(modes)
    }

    /// Returns the modes if no current flows yet: nothing conducts, or conduction begins through the switches that are
    /// on.
    fn with_all_resting(&self, gates: [Gate; 3], port: &Port) -> Option<Modes> {
        let (kind, drives) = (self.devices.kind, gates.contains(&Gate::High) && gates.contains(&Gate::Low));
        let modes = gates.map(|gate| match gate {
            Gate::High if drives => kind.outflow(gate),
            Gate::Low if drives => kind.inflow(gate),
            _ => Conduction::Blocked,
        });
        (self.fit(gates, modes, [true; 3], port) > CERTAIN).then_some(modes)
    }

    /// Tries all combinations one after the other and returns the first that fits, or the one nearest to fitting.
    fn search(&self, gates: [Gate; 3], port: &Port) -> Modes {
        let mut resting = port.current.map(|current| current == 0.0);
        if resting.iter().filter(|rests| **rests).count() >= 2 {
            resting = [true; 3];
        }
        let options = |leg: usize| -> [Option<Conduction>; 3] {
            let (out, into) = (self.devices.kind.outflow(gates[leg]), self.devices.kind.inflow(gates[leg]));
            let open = gates[leg] == Gate::Off && self.open_leg == OpenLeg::Open;
            if resting[leg] && (open || self.disconnected[leg]) {
                return [Some(Conduction::Blocked), None, None];
            }
            if resting[leg] {
                [Some(Conduction::Blocked), Some(out), Some(into)]
            } else {
                [Some(self.flowing(gates[leg], port.current[leg])), None, None]
            }
        };
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

    /// Returns how well modes fit: the smallest margin of a resting leg in V, negative if the modes contradict gates
    /// and currents.
    fn fit(&self, gates: [Gate; 3], modes: Modes, resting: [bool; 3], port: &Port) -> f64 {
        let potentials = self.potentials(gates, modes, port);
        let slope = port.inverse_inductance.times(plane(potentials) - port.holding);
        (0..3)
            .filter(|leg| resting[*leg])
            .map(|leg| match modes[leg] {
                Conduction::Blocked => self.blocked_margin(leg, gates[leg], potentials[leg], port.dc_link),
                mode => {
                    let axis = AXES[leg];
                    mode.direction() * axis.dot(slope) / axis.dot(port.inverse_inductance.times(axis))
                }
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn blocked_margin(&self, leg: usize, gate: Gate, potential: f64, dc_link: f64) -> f64 {
        let (low, high) = self.bounds_of(leg, gate, dc_link);
        (potential - low).min(high - potential)
    }

    /// Returns [`Self::bounds`] at a leg's end of the winding; infinite if its wire is open.
    #[inline]
    pub fn bounds_of(&self, leg: usize, gate: Gate, dc_link: f64) -> (f64, f64) {
        if self.disconnected[leg] { (f64::NEG_INFINITY, f64::INFINITY) } else { self.bounds(gate, dc_link) }
    }

    /// Returns the terminal potentials in V against the negative rail.
    ///
    /// A conducting leg has its device's potential. A blocked leg k has the potential that keeps its current at zero:
    /// `p_k · Γ (C u − e) = 0`. With all three blocked, only their differences follow from the back-EMF; the common
    /// potential is taken halfway between the bounds, where equal leakages would hold it.
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
                let (m, n) = ((k + 1) % 3, (k + 2) % 3);
                potentials[k] = keeping(k, port, [(m, potentials[m]), (n, potentials[n])]);
            }
            _ => potentials = self.all_blocked(gates, port),
        }
        potentials
    }

    fn all_blocked(&self, gates: [Gate; 3], port: &Port) -> [f64; 3] {
        let holding = AXES.map(|axis| axis.dot(port.holding));
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (leg, (gate, e)) in gates.into_iter().zip(holding).enumerate() {
            let (l, h) = self.bounds_of(leg, gate, port.dc_link);
            low = low.max(l - e);
            high = high.min(h - e);
        }
        let common =
            if low.is_finite() && high.is_finite() { (low + high) / 2.0 } else { port.dc_link / 2.0 };
        holding.map(|e| common + e)
    }
}

/// Returns the potential in V at which leg `k` keeps its current, given the two others': `p_k · Γ (C u − e) = 0`.
#[inline]
fn keeping(k: usize, port: &Port, others: [(usize, f64); 2]) -> f64 {
    let row = port.inverse_inductance.times(AXES[k]);
    let [m, n] = others.map(|(leg, potential)| row.dot(AXES[leg]) * potential);
    (row.dot(port.holding) * 1.5 - (m + n)) / row.dot(AXES[k])
}

/// Returns terminal potentials as a voltage vector in the plane; their common part drops out.
#[inline]
fn plane(potentials: [f64; 3]) -> AlphaBeta<f64> {
    standstill_interface::Abc(potentials).clarke()
}
