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
use standstill_inverter::{Bridge, Conduction, DcLink, Gate, Legs, Modes, Port};
use standstill_plant::{Heading, Lane, Magnetics, Motor};

use crate::motion::Motion;

/// Length of the state of a rotor at rest on a stiff link: ψ_α, ψ_β in Wb.
pub const PLANE: usize = 2;
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

/// The right-hand side, with everything that stays constant between two instants: of one machine, or of several side by
/// side that differ in nothing but their numbers.
///
/// A state is an array of [`PLANE`] numbers for a rotor at rest on a stiff link, of [`CORE`], of [`WITH_EDDY`] for a
/// motor with eddy currents, or of [`WITH_LEDGER`] if the energies are wanted.
#[derive(Clone, Copy, Debug)]
pub struct Machine<'a, T = f64> {
    /// The motor.
    pub motor: &'a Motor,
    /// The DC side, but for the phase of its ripple.
    pub link: &'a DcLink,
    /// That phase in rad.
    pub ripple_phase: T,
    /// The legs in their modes.
    pub legs: Legs<T>,
    /// Whether the rotor moves.
    pub moves: bool,
    /// Friction torque in N·m against its motion at no speed, positive backwards.
    pub dry_friction: T,
    /// Torque in N·m that the load exerts against forward motion.
    pub load_torque: T,
    /// Where a rotor that does not move stands, in rad, and its sine and cosine.
    pub angle: T,
    /// See `angle`.
    pub heading: Heading<T>,
}

/// The machine at one state.
#[derive(Clone, Copy, Debug)]
pub struct Operating<T = f64> {
    /// The motor as the bridge sees it.
    pub port: Port<T>,
    /// Flux in Wb at which the core is: that of the winding but for harmonics.
    pub core_flux: Dq<T>,
    /// Current in A of the core, by which its map is read.
    pub core_current: Dq<T>,
    /// Current in A in the stator's plane.
    pub current: AlphaBeta<T>,
    /// How far the winding's flux is ahead of χ, in Wb in the rotor's plane.
    pub lag: Dq<T>,
    /// Heat of eddy currents in W.
    pub eddy_loss: T,
    /// Electromagnetic torque in N·m, cogging included.
    pub torque: T,
}

/// The right-hand side at one state, and what it was made of.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<const N: usize, T = f64> {
    /// The derivative of the state.
    pub slope: [T; N],
    /// The machine.
    pub operating: Operating<T>,
    /// Terminal potentials in V; of an idle bridge, but for what they have in common.
    pub potentials: [T; 3],
}

impl<T: Lane> Machine<'_, T> {
    /// Currents, inductances, back-EMF and torque at a state. `t` in s.
    #[inline(always)]
    pub fn operating<const N: usize>(&self, t: T, y: &[T; N]) -> Operating<T> {
        debug_assert!(N >= WITH_EDDY || self.motor.magnetics.eddy_currents().is_none());
        debug_assert!(N >= CORE || !self.moves && self.link.storage.is_none());
        let (angle, at) = if self.moves { (y[2], Heading::of(y[2])) } else { (self.angle, self.heading) };
        let flux = AlphaBeta::new(y[0], y[1]).park_by(at.sin, at.cos);
        let state = self.motor.magnetics.state(flux, at);
        let (mut current_dq, mut gamma_dq) = (state.current, state.inverse_inductance);
        // What changes the currents in A/s while the winding's flux stands still.
        let mut drift = None;
        let zero = T::of(0.0);
        let (mut lag, mut eddy_loss) = (Dq::new(zero, zero), zero);
        if N >= WITH_EDDY {
            lag = flux - Dq::new(y[CORE], y[CORE + 1]);
            if let Some(eddy) = self.motor.magnetics.eddy(lag) {
                current_dq = current_dq + eddy.current;
                gamma_dq.xx = gamma_dq.xx + eddy.inverse_inductance.d;
                gamma_dq.yy = gamma_dq.yy + eddy.inverse_inductance.q;
                drift = Some(-(eddy.current * T::of(eddy.time_constant.recip())));
                eddy_loss = eddy.current.dot(lag) * (1.5 / eddy.time_constant);
            }
        }
        let current = current_dq.unpark_by(at.sin, at.cos);
        let gamma = gamma_dq.unpark_by(at.sin, at.cos);
        let mut holding = current * T::of(self.motor.resistance);
        if self.moves {
            // di/dt = Γ (v − R i − ω J ψ) + drift + ω (J i + ∂i/∂θ): the currents stay where this vanishes.
            let turning = (current_dq.quarter_turn() + state.current_slope) * y[3];
            drift = Some(drift.map_or(turning, |drift| drift + turning));
            holding = holding + flux.quarter_turn().unpark_by(at.sin, at.cos) * y[3];
        }
        if let Some(drift) = drift {
            holding = holding - gamma.inverse().times(drift.unpark_by(at.sin, at.cos));
        }
        let dc_link = match self.link.storage {
            Some(_) => y[4],
            None => self.link.source_at(t, self.ripple_phase),
        };
        Operating {
            port: Port { current: current.phases().0, inverse_inductance: gamma, holding, dc_link },
            core_flux: state.core_flux,
            core_current: state.core_current,
            current,
            lag,
            eddy_loss,
            torque: self.motor.torque(flux, current_dq, state.energy_slope) + self.motor.cogging(angle),
        }
    }

    /// The derivative of the state with all that it follows from. `t` in s.
    #[inline(always)]
    pub fn evaluate<const N: usize>(&self, t: T, y: &[T; N]) -> Evaluation<N, T> {
        self.evaluate_at(t, y, self.operating(t, y))
    }

    /// The same where currents and inductances are known already.
    #[inline(always)]
    pub fn evaluate_at<const N: usize>(&self, t: T, y: &[T; N], operating: Operating<T>) -> Evaluation<N, T> {
        let Operating { port, current, lag, eddy_loss, torque, .. } = operating;
        let potentials = self.legs.potentials(&port);
        let voltage = standstill_interface::Abc(potentials).clarke();
        let slope = voltage - current * T::of(self.motor.resistance);

        let zero = T::of(0.0);
        let mut dy = [zero; N];
        dy[0] = slope.alpha;
        dy[1] = slope.beta;
        if N < CORE {
            return Evaluation { slope: dy, operating, potentials };
        }
        let pole_pairs = f64::from(self.motor.pole_pairs);
        let mechanical_speed = y[3] * (1.0 / pole_pairs);
        let rotor = &self.motor.rotor;
        let friction = self.dry_friction + mechanical_speed * rotor.friction.viscous;
        if self.moves {
            dy[2] = y[3];
            dy[3] = (torque - self.load_torque - friction) * (pole_pairs / rotor.inertia);
        }
        if N >= WITH_EDDY
            && let Some(branch) = self.motor.magnetics.eddy_currents()
        {
            dy[CORE] = lag.d * (1.0 / branch.time_constant);
            dy[CORE + 1] = lag.q * (1.0 / branch.time_constant);
        }

        if self.link.storage.is_some() || N == WITH_LEDGER {
            let [a, b, c] = [0, 1, 2].map(|k| self.legs.rail[k] * port.current[k]);
            let link_current = a + b + c;
            let mut source_current = link_current;
            let mut source_loss = zero;
            if let Some(storage) = self.link.storage {
                let source = self.link.source_at(t, self.ripple_phase);
                source_current = (source - port.dc_link) * (1.0 / storage.source_resistance);
                source_loss = source_current * source_current * storage.source_resistance;
                dy[4] = (source_current - link_current) * (1.0 / storage.capacitance);
            }
            if N == WITH_LEDGER {
                dy[WITH_EDDY] = self.link.source_at(t, self.ripple_phase) * source_current;
                dy[WITH_EDDY + 1] = source_loss;
                let [a, b, c] = [0, 1, 2].map(|k| {
                    let drop = self.legs.rail[k] * port.dc_link - potentials[k];
                    // A blocked leg's current is zero only up to the integrator's error; it loses nothing.
                    let blocked = (self.legs.blocked[k] + self.legs.idle).above(zero);
                    T::choose(blocked, zero, drop * port.current[k])
                });
                dy[WITH_EDDY + 2] = a + b + c;
                dy[WITH_EDDY + 3] = current.dot(current) * (1.5 * self.motor.resistance);
                dy[WITH_EDDY + 4] = eddy_loss;
                dy[WITH_EDDY + 5] = torque * mechanical_speed;
                dy[WITH_EDDY + 6] = friction * mechanical_speed;
                dy[WITH_EDDY + 7] = self.load_torque * mechanical_speed;
            }
        }
        Evaluation { slope: dy, operating, potentials }
    }
}

/// One machine with its gates, modes and motion.
#[derive(Clone, Debug)]
pub struct Flow<'a> {
    /// What they make of it while they hold.
    pub machine: Machine<'a>,
    /// Switches and diodes.
    pub bridge: &'a Bridge,
    /// Which switches are on.
    pub gates: [Gate; 3],
    /// Between which electrical angles in rad the brake lets the rotor play, if it is applied.
    pub stops: Option<[f64; 2]>,
    /// On which sides of zero ψ_d and ψ_q are, +1 or −1, where the core has kinks there; 0 where it has none.
    pub sides: [f64; 2],
    modes: Modes,
    motion: Motion,
}

impl<'a> Flow<'a> {
    /// With all gates off and nothing conducting.
    pub fn new(motor: &'a Motor, bridge: &'a Bridge, link: &'a DcLink, motion: Motion) -> Self {
        let modes = [Conduction::Blocked; 3];
        let machine = Machine {
            motor,
            link,
            ripple_phase: link.ripple_phase,
            legs: Legs::new(&bridge.devices, modes),
            moves: motion.moves(),
            dry_friction: motion.friction(&motor.rotor, 0.0),
            load_torque: 0.0,
            angle: 0.0,
            heading: Heading::ZERO,
        };
        let sides = motor.magnetics.core().kinks().map(f64::from);
        Self { machine, bridge, gates: [Gate::Off; 3], stops: None, sides, modes, motion }
    }

    /// Which devices conduct.
    pub const fn modes(&self) -> Modes {
        self.modes
    }

    /// Other devices conduct.
    pub fn conduct(&mut self, modes: Modes) {
        self.modes = modes;
        self.machine.legs = Legs::new(&self.bridge.devices, modes);
    }

    /// Whether the rotor moves.
    pub const fn motion(&self) -> Motion {
        self.motion
    }

    /// The rotor moves otherwise, from this angle in rad on.
    pub fn turn(&mut self, motion: Motion, angle: f64) {
        self.motion = motion;
        self.machine.moves = motion.moves();
        self.machine.dry_friction = motion.friction(&self.machine.motor.rotor, 0.0);
        self.machine.angle = angle;
        self.machine.heading = Heading::of(angle);
    }

    /// Currents, inductances, back-EMF and torque at a state. `t` in s.
    pub fn operating<const N: usize>(&self, t: f64, y: &[f64; N]) -> Operating {
        self.machine.operating(t, y)
    }

    /// The derivative of the state. `t` in s.
    pub fn derivative<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; N] {
        self.machine.evaluate(t, y).slope
    }

    /// The derivative of the state with all that it follows from. `t` in s.
    pub fn evaluate<const N: usize>(&self, t: f64, y: &[f64; N]) -> Evaluation<N> {
        self.machine.evaluate(t, y)
    }

    /// Terminal potentials in V against the negative rail.
    pub fn potentials(&self, at: &Operating) -> [f64; 3] {
        self.bridge.potentials(self.gates, self.modes, &at.port)
    }

    /// How far everything that makes the flow smooth is from its end, positive while it holds: the modes of the
    /// three legs, the rotor's motion and its way to a stop, what is known of the core, and the sides of ψ_d and ψ_q
    /// where the core has kinks.
    #[inline]
    pub fn margins<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; MARGINS] {
        debug_assert!(N >= CORE || !self.motion.moves());
        let at = self.machine.operating(t, y);
        let potentials = self.machine.legs.potentials(&at.port);
        self.margins_at(&at, potentials, y)
    }

    /// The same of a state of which everything is known already.
    #[inline]
    pub fn margins_at<const N: usize>(
        &self,
        at: &Operating,
        mut potentials: [f64; 3],
        y: &[f64; N],
    ) -> [f64; MARGINS] {
        if self.modes == [Conduction::Blocked; 3] {
            potentials = self.potentials(at);
        }
        let motor = self.machine.motor;
        let (angle, speed) = if N > PLANE { (y[2], y[3]) } else { (self.machine.angle, 0.0) };
        let [a, b, c] = self.bridge.margins(self.gates, self.modes, potentials, &at.port);
        let side = |side: f64, flux: f64| if side == 0.0 { f64::INFINITY } else { side * flux };
        [
            a,
            b,
            c,
            self.motion.margin(&motor.rotor, speed, at.torque - self.machine.load_torque),
            self.stops.map_or(f64::INFINITY, |stops| self.motion.margin_to_stop(stops, angle)),
            motor.magnetics.core().margin(at.core_current),
            side(self.sides[0], at.core_flux.d),
            side(self.sides[1], at.core_flux.q),
        ]
    }

    /// Energy of the field in J.
    pub fn field_energy<const N: usize>(&self, y: &[f64; N]) -> f64 {
        let at = Heading::of(y[2]);
        let flux = AlphaBeta::new(y[0], y[1]).park_by(at.sin, at.cos);
        let lag = if N >= WITH_EDDY { flux - Dq::new(y[CORE], y[CORE + 1]) } else { Dq::new(0.0, 0.0) };
        self.machine.motor.field_energy(flux, lag, y[2])
    }

    /// Energy of the rotor's motion in J.
    pub fn kinetic_energy<const N: usize>(&self, y: &[f64; N]) -> f64 {
        let speed = y[3] / f64::from(self.machine.motor.pole_pairs);
        self.machine.motor.rotor.inertia * speed * speed / 2.0
    }

    /// Energy in the link's capacitor in J.
    pub fn link_energy<const N: usize>(&self, y: &[f64; N]) -> f64 {
        self.machine.link.storage.map_or(0.0, |storage| storage.capacitance * y[4] * y[4] / 2.0)
    }
}
