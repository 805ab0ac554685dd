//! The smooth part: the right-hand side between two instants, equations of motor, bridge and link together.
//!
//! ```text
//!   dψ/dt = v − R i          v from the bridge, i = ∂W/∂ψ
//!   dθ/dt = ω,   J/p dω/dt = T − T_load − friction
//!   C dU/dt = (E − U)/R_s − i_dc
//!   dχ/dt = (ψ − χ)/τ        the flux that lags behind by eddy currents, in the rotor's plane
//! ```
//! Behind the state stand the energies of the [`Ledger`], integrated along when they are asked for.

use standstill_interface::{AlphaBeta, Dq};
use standstill_inverter::{Bridge, DcLink, Gate, Modes, Port};
use standstill_plant::{Heading, Magnetics, Motor};

use crate::motion::Motion;

/// Length of the state without ledger: ψ_α, ψ_β in Wb, θ in rad, ω in rad/s (both electrical), U_dc in V.
pub const CORE: usize = 5;
/// With χ_d and χ_q in Wb, for motors with eddy currents.
pub const WITH_EDDY: usize = 7;
/// With eddy currents and the eight energies of the ledger in J.
pub const WITH_LEDGER: usize = 15;

/// Places of the margins that a flow watches: after those of the three legs come the rotor's motion, its way to the
/// end of the brake's play, the core's way to the end of what is known of it, and the sides of ψ_d and ψ_q.
pub const MOTION: usize = 3;
/// See [`MOTION`].
pub const STOP: usize = 4;
/// See [`MOTION`].
pub const DOMAIN: usize = 5;
/// See [`MOTION`].
pub const FLUX: usize = 6;
/// Number of margins.
pub const MARGINS: usize = 8;

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
    /// Lost in eddy currents.
    pub eddy_loss: f64,
    /// Work of the electromagnetic torque, cogging included, on the rotor.
    pub shaft_work: f64,
    /// Of that, lost in friction.
    pub friction_loss: f64,
    /// Of that, done on the load.
    pub load_work: f64,
    /// Of that, lost where the rotor ran into the end of the brake's play.
    pub impact_loss: f64,
    /// Change of the energy in the link's capacitor.
    pub link_change: f64,
    /// Change of the magnetic field's energy, with what eddy currents and cogging store.
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
            - self.eddy_loss
            - self.shaft_work
            - self.link_change
            - self.field_change
    }

    /// The same on the mechanical side: shaft work that is in no account.
    pub fn mechanical_imbalance(&self) -> f64 {
        self.shaft_work - self.friction_loss - self.load_work - self.impact_loss - self.kinetic_change
    }
}

/// The right-hand side, with everything that stays constant between two instants.
///
/// A state is an array of [`CORE`] numbers, of [`WITH_EDDY`] for a motor with eddy currents, or of [`WITH_LEDGER`]
/// if the energies are wanted.
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
    /// Torque in N·m that the load exerts against forward motion.
    pub load_torque: f64,
    /// Between which electrical angles in rad the brake lets the rotor play, if it is applied.
    pub stops: Option<[f64; 2]>,
    /// On which sides of zero ψ_d and ψ_q are, +1 or −1, where the core has kinks there; 0 where it has none.
    pub sides: [f64; 2],
    // Sine and cosine of a rotor that does not move; there is no need to compute them anew each time.
    still: Heading,
}

/// The machine at one state.
#[derive(Clone, Copy, Debug)]
pub struct Operating {
    /// The motor as the bridge sees it.
    pub port: Port,
    /// Flux in Wb at which the core is: that of the winding but for harmonics.
    pub core_flux: Dq<f64>,
    /// Current in A in the stator's plane.
    pub current: AlphaBeta<f64>,
    /// How far the winding's flux is ahead of χ, in Wb in the rotor's plane.
    pub lag: Dq<f64>,
    /// Heat of eddy currents in W.
    pub eddy_loss: f64,
    /// Electromagnetic torque in N·m, cogging included.
    pub torque: f64,
    /// How far the core is from the end of what is known of it, in A.
    pub domain: f64,
}

/// The right-hand side at one state, and what it was made of.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<const N: usize> {
    /// The derivative of the state.
    pub slope: [f64; N],
    /// The machine.
    pub operating: Operating,
    /// Terminal potentials in V.
    pub potentials: [f64; 3],
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
            load_torque: 0.0,
            stops: None,
            sides: motor.magnetics.core().kinks().map(f64::from),
            still: Heading::ZERO,
        }
    }

    /// To be called at an instant, before integrating: remembers where a rotor at rest stands.
    pub fn settle(&mut self, angle: f64) {
        self.still = Heading::of(angle);
    }

    /// Currents, inductances, back-EMF and torque at a state. `t` in s.
    #[inline]
    pub fn operating<const N: usize>(&self, t: f64, y: &[f64; N]) -> Operating {
        debug_assert!(N >= WITH_EDDY || self.motor.magnetics.eddy_currents().is_none());
        let moves = self.motion.moves();
        let at = if moves { Heading::of(y[2]) } else { self.still };
        let flux = AlphaBeta::new(y[0], y[1]).park_by(at.sin, at.cos);
        let state = self.motor.magnetics.state(flux, at);
        let (mut current_dq, mut gamma_dq) = (state.current, state.inverse_inductance);
        // What changes the currents in A/s while the winding's flux stands still.
        let mut drift = None;
        let (mut lag, mut eddy_loss) = (Dq::new(0.0, 0.0), 0.0);
        if N >= WITH_EDDY {
            lag = flux - Dq::new(y[CORE], y[CORE + 1]);
            if let Some(eddy) = self.motor.magnetics.eddy(lag) {
                current_dq = current_dq + eddy.current;
                gamma_dq.xx += eddy.inverse_inductance.d;
                gamma_dq.yy += eddy.inverse_inductance.q;
                drift = Some(-eddy.current * eddy.time_constant.recip());
                eddy_loss = 1.5 * eddy.current.dot(lag) / eddy.time_constant;
            }
        }
        let current = current_dq.unpark_by(at.sin, at.cos);
        let gamma = gamma_dq.unpark_by(at.sin, at.cos);
        let mut holding = current * self.motor.resistance;
        if moves {
            // di/dt = Γ (v − R i − ω J ψ) + drift + ω (J i + ∂i/∂θ): the currents stay where this vanishes.
            let turning = (current_dq.quarter_turn() + state.current_slope) * y[3];
            drift = Some(drift.map_or(turning, |drift| drift + turning));
            holding = holding + flux.quarter_turn().unpark_by(at.sin, at.cos) * y[3];
        }
        if let Some(drift) = drift {
            holding = holding - gamma.inverse().times(drift.unpark_by(at.sin, at.cos));
        }
        let dc_link = if self.link.storage.is_some() { y[4] } else { self.link.source(t) };
        Operating {
            port: Port { current: current.phases().0, inverse_inductance: gamma, holding, dc_link },
            core_flux: state.core_flux,
            current,
            lag,
            eddy_loss,
            torque: self.motor.torque(flux, current_dq, state.energy_slope) + self.motor.cogging(y[2]),
            domain: self.motor.magnetics.margin(&state),
        }
    }

    /// The derivative of the state. `t` in s.
    #[inline]
    pub fn derivative<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; N] {
        self.evaluate(t, y).slope
    }

    /// The derivative of the state with all that it follows from. `t` in s.
    #[inline]
    pub fn evaluate<const N: usize>(&self, t: f64, y: &[f64; N]) -> Evaluation<N> {
        let operating = self.operating(t, y);
        let Operating { port, current, lag, eddy_loss, torque, .. } = operating;
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
            let friction = self.motion.friction(rotor, mechanical_speed);
            dy[3] = pole_pairs * (torque - self.load_torque - friction) / rotor.inertia;
        }
        if N >= WITH_EDDY
            && let Some(branch) = self.motor.magnetics.eddy_currents()
        {
            dy[CORE] = lag.d / branch.time_constant;
            dy[CORE + 1] = lag.q / branch.time_constant;
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
                dy[WITH_EDDY] = self.link.source(t) * source_current;
                dy[WITH_EDDY + 1] = source_loss;
                dy[WITH_EDDY + 2] = (0..3)
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
                dy[WITH_EDDY + 3] = 1.5 * self.motor.resistance * current.dot(current);
                dy[WITH_EDDY + 4] = eddy_loss;
                dy[WITH_EDDY + 5] = torque * mechanical_speed;
                dy[WITH_EDDY + 6] =
                    self.motion.friction(&self.motor.rotor, mechanical_speed) * mechanical_speed;
                dy[WITH_EDDY + 7] = self.load_torque * mechanical_speed;
            }
        }
        Evaluation { slope: dy, operating, potentials }
    }

    /// How far everything that makes the flow smooth is from its end, positive while it holds: the modes of the
    /// three legs, the rotor's motion and its way to a stop, what is known of the core, and the sides of ψ_d and ψ_q
    /// where the core has kinks.
    #[inline]
    pub fn margins<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; MARGINS] {
        let at = self.operating(t, y);
        let potentials = self.bridge.potentials(self.gates, self.modes, &at.port);
        self.margins_at(&at, potentials, y)
    }

    /// The same of a state of which everything is known already.
    #[inline]
    pub fn margins_at<const N: usize>(
        &self,
        at: &Operating,
        potentials: [f64; 3],
        y: &[f64; N],
    ) -> [f64; MARGINS] {
        let [a, b, c] = self.bridge.margins(self.gates, self.modes, potentials, &at.port);
        let side = |side: f64, flux: f64| if side == 0.0 { f64::INFINITY } else { side * flux };
        [
            a,
            b,
            c,
            self.motion.margin(&self.motor.rotor, y[3], at.torque - self.load_torque),
            self.stops.map_or(f64::INFINITY, |stops| self.motion.margin_to_stop(stops, y[2])),
            at.domain,
            side(self.sides[0], at.core_flux.d),
            side(self.sides[1], at.core_flux.q),
        ]
    }

    /// Energy of the field in J.
    pub fn field_energy<const N: usize>(&self, y: &[f64; N]) -> f64 {
        let at = Heading::of(y[2]);
        let flux = AlphaBeta::new(y[0], y[1]).park_by(at.sin, at.cos);
        let lag = if N >= WITH_EDDY { flux - Dq::new(y[CORE], y[CORE + 1]) } else { Dq::new(0.0, 0.0) };
        self.motor.field_energy(flux, lag, y[2])
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
