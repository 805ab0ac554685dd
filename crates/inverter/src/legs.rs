//! What the modes make of the legs while they hold: the terminal potentials of one machine, or of several side by side.

use standstill_interface::AlphaBeta;
use standstill_plant::Lane;

use crate::bridge::AXES;
use crate::{Conduction, Devices, Modes, Port};

/// The three legs in their modes.
///
/// A conducting leg has the potential of its device, `u = rail · U_dc + offset − resistance · i`; a single blocked leg
/// that which keeps its current. With all three blocked only the differences of their potentials follow.
#[derive(Clone, Copy, Debug)]
pub struct Legs<T = f64> {
    /// 1 for a leg at the positive rail, 0 at the negative or blocked.
    pub rail: [T; 3],
    /// In V.
    pub offset: [T; 3],
    /// In Ω.
    pub resistance: [T; 3],
    /// 1 for the leg that is blocked while the others conduct, else 0.
    pub blocked: [T; 3],
    /// 1 if all are blocked, else 0.
    pub idle: T,
}

impl Legs {
    /// The legs of a bridge in these modes.
    pub fn new(devices: &Devices, modes: Modes) -> Self {
        let clamps = modes.map(|mode| devices.clamp(mode).unwrap_or_default());
        let blocked = modes.map(|mode| mode == Conduction::Blocked);
        let idle = blocked.iter().filter(|blocked| **blocked).count() >= 2;
        Self {
            rail: clamps.map(|clamp| clamp.rail),
            offset: clamps.map(|clamp| clamp.offset),
            resistance: clamps.map(|clamp| clamp.resistance),
            blocked: blocked.map(|blocked| f64::from(u8::from(blocked && !idle))),
            idle: f64::from(u8::from(idle)),
        }
    }
}

impl<T: Lane> Legs<T> {
    /// Terminal potentials in V against the negative rail; of an idle bridge, but for what they have in common.
    #[inline(always)]
    pub fn potentials(&self, port: &Port<T>) -> [T; 3] {
        let mut potentials = [0, 1, 2]
            .map(|k| self.rail[k] * port.dc_link + self.offset[k] - self.resistance[k] * port.current[k]);
        let zero = T::of(0.0);
        let axis = |k: usize| AlphaBeta::new(T::of(AXES[k].alpha), T::of(AXES[k].beta));
        for k in 0..3 {
            let blocked = self.blocked[k].above(zero);
            if T::any(blocked) {
                // p_k · Γ (C u − e) = 0.
                let row = port.inverse_inductance.times(axis(k));
                let (m, n) = ((k + 1) % 3, (k + 2) % 3);
                let others = row.dot(axis(m)) * potentials[m] + row.dot(axis(n)) * potentials[n];
                let holds = (row.dot(port.holding) * 1.5 - others) / row.dot(axis(k));
                potentials[k] = T::choose(blocked, holds, potentials[k]);
            }
        }
        let idle = self.idle.above(zero);
        if T::any(idle) {
            for (k, potential) in potentials.iter_mut().enumerate() {
                *potential = T::choose(idle, axis(k).dot(port.holding), *potential);
            }
        }
        potentials
    }
}
