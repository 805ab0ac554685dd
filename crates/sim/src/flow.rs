//! One machine with its gates, modes and motion.

use standstill_interface::{AlphaBeta, Dq};
use standstill_inverter::{Bridge, Conduction, DcLink, Gate, LegModes, Modes};
use standstill_numeric::Heading;
use standstill_plant::{Magnetics, Motor};

use crate::limits::{Limits, MARGINS};
use crate::machine::{CORE, Evaluation, Machine, Operating, WITH_EDDY};
use crate::motion::Motion;

/// One machine with its gates, modes and motion.
#[derive(Clone, Debug)]
pub struct Flow<'a> {
    /// What they make of it while they hold.
    pub machine: Machine<'a>,
    /// What ends that.
    pub limits: Limits,
    /// Switches and diodes.
    pub bridge: &'a Bridge,
    leg_modes: LegModes,
    /// Which switches are on. [`Self::conduct`] looks at them.
    pub gates: [Gate; 3],
    /// Between which electrical angles in rad the brake lets the rotor play, if it is applied. [`Self::turn`] looks at
    /// them.
    pub stops: Option<[f64; 2]>,
    sides: [f64; 2],
    modes: Modes,
    motion: Motion,
}

impl<'a> Flow<'a> {
    /// With all gates off and nothing conducting.
    pub fn new(motor: &'a Motor, bridge: &'a Bridge, link: &'a DcLink, motion: Motion) -> Self {
        let (modes, leg_modes) = ([Conduction::Blocked; 3], LegModes::new(&bridge.devices));
        let machine = Machine {
            motor,
            link,
            ripple_phase: link.ripple_phase,
            legs: leg_modes.legs(modes),
            moves: motion.moves(),
            dry_friction: 0.0,
            load_torque: 0.0,
            angle: 0.0,
            heading: Heading::ZERO,
        };
        let (gates, sides) = ([Gate::Off; 3], motor.magnetics.core().kinks().map(f64::from));
        let mut limits = Limits::NONE;
        limits.set_sides(sides);
        let mut flow = Self { machine, limits, bridge, leg_modes, gates, stops: None, sides, modes, motion };
        flow.conduct(modes);
        flow.turn(motion, 0.0);
        flow
    }

    /// Which devices conduct.
    pub const fn modes(&self) -> Modes {
        self.modes
    }

    /// Other devices conduct.
    pub fn conduct(&mut self, modes: Modes) {
        self.modes = modes;
        self.leg_modes.put(modes, &mut self.machine.legs);
        self.limits.set_legs(self.bridge, self.gates, modes);
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
        self.limits.set_motion(motion, self.machine.motor, self.machine.load_torque, self.stops);
    }

    /// ψ_d or ψ_q, by its number, went to the other side of zero.
    pub fn cross(&mut self, axis: usize) {
        self.sides[axis] = -self.sides[axis];
        self.limits.set_sides(self.sides);
    }

    /// Currents, inductances, back-EMF and torque at a state. `t` in s.
    pub fn operating<const N: usize>(&self, t: f64, y: &[f64; N]) -> Operating {
        self.machine.operating(t, y)
    }

    /// The derivative of the state. `t` in s.
    pub fn derivative<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; N] {
        self.evaluate(t, y).slope
    }

    /// The derivative with all that it follows from. `t` in s.
    pub fn evaluate<const N: usize>(&self, t: f64, y: &[f64; N]) -> Evaluation<N> {
        self.machine.evaluate(&self.machine.terminals(), t, y)
    }

    /// Terminal potentials in V against the negative rail.
    pub fn potentials(&self, at: &Operating) -> [f64; 3] {
        self.bridge.potentials(self.gates, self.modes, &self.machine.port(at))
    }

    /// How far everything that makes the flow smooth is from its end: see [`Limits::margins`].
    pub fn margins<const N: usize>(&self, t: f64, y: &[f64; N]) -> [f64; MARGINS] {
        debug_assert!(N >= CORE || !self.motion.moves());
        self.limits.margins(&self.machine, y, &self.evaluate(t, y))
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
