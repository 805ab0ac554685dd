//! The smooth part: the right-hand side between two instants, equations of motor, bridge and link together.
//!
//! ```text
//!   dψ/dt = v − R i          v from the bridge, i = ∂W/∂ψ
//!   dθ/dt = ω,   J/p dω/dt = T − friction
//!   C dU/dt = (E − U)/R_s − i_dc
//! ```
//! Behind the state stand the energies of the [`Ledger`], integrated along when they are asked for.

use standstill_interface::{AlphaBeta, Dq};
use standstill_inverter::{Bridge, DcLink, Gate, Modes, Port};
use standstill_plant::{Magnetics, Motor};

use crate::motion::Motion;

/// Length of the state without ledger: ψ_α, ψ_β in Wb, θ in rad, ω in rad/s (both electrical), U_dc in V.
pub const CORE: usize = 5;
/// With the five energies of the ledger in J.
pub const WITH_LEDGER: usize = 10;

/// Number of margins that a flow watches.
pub const MARGINS: usize = 6;

/// Where the energy went, in J since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Delivered by the DC source.
    pub source: f64,
    /// Lost in the source's resistance.
    pub source_loss: f64,
    /// Lost in switches and diodes.
    pub device_loss: f64,
    /// Lost in the winding.
    pub copper_loss: f64,
    /// Work of the electromagnetic torque on the rotor.
    pub shaft_work: f64,
    /// Change of the energy in the link's capacitor.
    pub link_change: f64,
    /// Change of the magnetic field's energy.
    pub field_change: f64,
    /// Change of the rotor's kinetic energy.
    pub kinetic_change: f64,
}

impl Ledger {
    /// What the source delivered and no account shows: zero but for the integrator's error.
    pub fn imbalance(&self) -> f64 {
        self.source
            - self.source_loss
            - self.device_loss
            - self.copper_loss
            - self.shaft_work
            - self.link_change
            - self.field_change
    }
}

/// The right-hand side, with everything that stays constant between two instants.
///
/// A state is an array of [`CORE`] numbers, or of [`WITH_LEDGER`] if the energies are wanted.
#[derive(Clone, Debug)]
pub struct Flow<'a> {
    /// The motor.
    pub motor: &'a Motor,
    /// Switches and diodes.
    pub bridge: &'a Bridge,
    /// The DC side.
    pub link: &'a DcLink,
    /// Which switches are on.
    pub gates: [Gate; 3],
    /// Which devices conduct.
    pub modes: Modes,
    /// Whether the rotor moves.
    pub motion: Motion,
    /// On which sides of zero ψ_d and ψ_q are, +1 or −1, where the core has kinks there; 0 where it has none.
    pub sides: [f64; 2],
    // Sine and cosine of a rotor that does not move; there is no need to compute them anew each time.
    still: (f64, f64),
}

/// The machine at one state.
#[derive(Clone, Copy, Debug)]
pub struct Operating {
    /// The motor as the bridge sees it.
    pub port: Port,
    /// Flux in Wb in the rotor's plane.
    pub flux: Dq<f64>,
    /// Current in A in the stator's plane.
    pub current: AlphaBeta<f64>,
    /// Electromagnetic torque in N·m.
    pub torque: f64,
}

impl<'a> Flow<'a> {
    /// With all gates off and nothing conducting.
    pub fn new(motor: &'a Motor, bridge: &'a Bridge, link: &'a DcLink, motion: Motion) -> Self {
        Self {
            motor,
            bridge,
            link,
            gates: [Gate::Off; 3],
            modes: [standstill_inverter::Conduction::Blocked; 3],
            motion,
            sides: motor.core.kinks().map(f64::from),
            still: (0.0, 1.0),
        }
    }

    /// To be called at an instant, before integrating: remembers where a rotor at rest stands.
    pub fn settle(&mut self, angle: f64) {
        self.still = angle.sin_cos();
    }

    /// Currents, inductances, back-EMF and torque at a state. `t` in s.
    #[inline]
    pub fn operating<const N: usize>(&self, t: f64, y: &[f64; N]) -> Operating {
        let moves = self.motion.moves();
        let (sin, cos) = if moves { y[2].sin_cos() } else { self.still };
        let flux = AlphaBeta::new(y[0], y[1]);
        let flux_dq = flux.park_by(sin, cos);
        let (current_dq, gamma_dq) = self.motor.core.current_and_inverse_inductance(flux_dq);
        let current = current_dq.unpark_by(sin, cos);
        let gamma = gamma_dq.unpark_by(sin, cos);
        let mut holding = current * self.motor.resistance;
        if moves {
            // di/dt = Γ (v − R i − ω J ψ) + ω J i: the currents stay where v = R i + ω (J ψ − Γ⁻¹ J i).
            let emf = flux.quarter_turn() - gamma.inverse().times(current.quarter_turn());
            holding = holding + emf * y[3];
        }
        let dc_link = if self.link.storage.is_some() { y[4] } else { self.link.source(t) };
        Operating {
            port: Port { current: current.phases().0, inverse_inductance: gamma, holding, dc_link },
            flux: flux_dq,
            current,
            torque: self.motor.torque(flux, current),
        }
    }

    /// The derivative of the state. `t` in s.
    #[inline]
    pub fn derivative<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; N] {
        let Operating { port, current, torque, .. } = self.operating(t, y);
        let potentials = self.bridge.potentials(self.gates, self.modes, &port);
        let voltage = standstill_interface::Abc(potentials).clarke();
        let slope = voltage - current * self.motor.resistance;

        let mut dy = [0.0; N];
        dy[0] = slope.alpha;
        dy[1] = slope.beta;
        let pole_pairs = f64::from(self.motor.pole_pairs);
        let mechanical_speed = y[3] / pole_pairs;
        if self.motion.moves() {
            let rotor = &self.motor.rotor;
            dy[2] = y[3];
            dy[3] = pole_pairs * (torque - self.motion.friction(rotor, mechanical_speed)) / rotor.inertia;
        }

        let needs_link_current = self.link.storage.is_some() || N == WITH_LEDGER;
        if needs_link_current {
            let link_current: f64 =
                (0..3).filter(|k| self.modes[*k].is_upper()).map(|k| port.current[k]).sum();
            let mut source_current = link_current;
            let mut source_loss = 0.0;
            if let Some(storage) = self.link.storage {
                source_current = (self.link.source(t) - port.dc_link) / storage.source_resistance;
                source_loss = storage.source_resistance * source_current * source_current;
                dy[4] = (source_current - link_current) / storage.capacitance;
            }
            if N == WITH_LEDGER {
                dy[CORE] = self.link.source(t) * source_current;
                dy[CORE + 1] = source_loss;
                dy[CORE + 2] = (0..3)
                    .map(|k| {
                        let rail = if self.modes[k].is_upper() { port.dc_link } else { 0.0 };
                        // A blocked leg's current is zero only up to the integrator's error; it loses nothing.
                        if self.modes[k].direction() == 0.0 {
                            0.0
                        } else {
                            (rail - potentials[k]) * port.current[k]
                        }
                    })
                    .sum();
                dy[CORE + 3] = 1.5 * self.motor.resistance * current.dot(current);
                dy[CORE + 4] = torque * mechanical_speed;
            }
        }
        dy
    }

    /// How far everything that makes the flow smooth is from its end, positive while it holds: the modes of the
    /// three legs, the rotor's motion, and the sides of ψ_d and ψ_q where the core has kinks.
    #[inline]
    pub fn margins<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; MARGINS] {
        let at = self.operating(t, y);
        let potentials = self.bridge.potentials(self.gates, self.modes, &at.port);
        let [a, b, c] = self.bridge.margins(self.gates, self.modes, potentials, &at.port);
        let side = |side: f64, flux: f64| if side == 0.0 { f64::INFINITY } else { side * flux };
        [
            a,
            b,
            c,
            self.motion.margin(&self.motor.rotor, y[3], at.torque),
            side(self.sides[0], at.flux.d),
            side(self.sides[1], at.flux.q),
        ]
    }

    /// Energy of the field in J.
    pub fn field_energy<const N: usize>(&self, y: &[f64; N]) -> f64 {
        let (sin, cos) = y[2].sin_cos();
        1.5 * self.motor.core.energy(AlphaBeta::new(y[0], y[1]).park_by(sin, cos))
    }

    /// Energy of the rotor's motion in J.
    pub fn kinetic_energy<const N: usize>(&self, y: &[f64; N]) -> f64 {
        let speed = y[3] / f64::from(self.motor.pole_pairs);
        self.motor.rotor.inertia * speed * speed / 2.0
    }

    /// Energy in the link's capacitor in J.
    pub fn link_energy<const N: usize>(&self, y: &[f64; N]) -> f64 {
        self.link.storage.map_or(0.0, |storage| storage.capacitance * y[4] * y[4] / 2.0)
    }
}
