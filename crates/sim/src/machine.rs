//! The smooth part: the right-hand side between two instants, equations of motor, bridge and link together.
//!
//! ```text
//!   dψ/dt = v − R i          v from the bridge, i = ∂W/∂ψ
//!   dθ/dt = ω,   J/p dω/dt = T − T_load − friction
//!   C dU/dt = (E − U)/R_s − i_dc
//!   dχ/dt = (ψ − χ)/τ        the flux that lags behind by eddy currents, in the rotor's plane
//! ```
//! Behind the state stand the energies of the [`crate::Ledger`], integrated along when they are asked for.
//!
//! The winding's flux is kept in the stator's plane. Currents and voltages are computed in the rotor's plane while the
//! rotor stands, where the legs look the same all the time, and in the stator's while it moves: below, *the plane*.

use standstill_interface::{AlphaBeta, Dq};
use standstill_inverter::{DcLink, Legs, Port, Terminals};
use standstill_numeric::{Heading, Lane, Symmetric};
use standstill_plant::Motor;

/// Length of the state of a rotor at rest on a stiff link: ψ_α, ψ_β in Wb.
pub const PLANE: usize = 2;
/// Length of the state without ledger: ψ_α, ψ_β in Wb, θ in rad, ω in rad/s (both electrical), U_dc in V.
pub const CORE: usize = 5;
/// With χ_d and χ_q in Wb, for motors with eddy currents.
pub const WITH_EDDY: usize = 7;
/// With eddy currents and the eight energies of the ledger in J.
pub const WITH_LEDGER: usize = 15;

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
    /// Current in A, in the plane.
    pub current: AlphaBeta<T>,
    /// Inverse incremental inductance Γ in 1/H, in the plane.
    pub inverse_inductance: Symmetric<T>,
    /// Back-EMF in V, in the plane; none while the rotor stands.
    pub emf: Option<AlphaBeta<T>>,
    /// What changes the currents in A/s besides the voltage, in the plane; none if nothing can.
    pub drift: Option<AlphaBeta<T>>,
    /// DC-link voltage in V.
    pub dc_link: T,
    /// Flux in Wb at which the core is: that of the winding but for harmonics.
    pub core_flux: Dq<T>,
    /// Current in A of the core, by which its map is read.
    pub core_current: Dq<T>,
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
    /// Potential in V of the leg that is blocked while others conduct; meaningless if there is none.
    pub blocked_potential: T,
}

impl<T: Lane> Machine<'_, T> {
    /// Sine and cosine of the angle in rad between the stator's plane and the one of [`Operating`].
    #[inline(always)]
    pub fn plane(&self) -> Heading<T> {
        if self.moves { Heading { sin: T::of(0.0), cos: T::of(1.0) } } else { self.heading }
    }

    /// The legs as the winding sees them.
    #[inline(always)]
    pub fn terminals(&self) -> Terminals<T> {
        self.legs.terminals(self.plane())
    }

    /// Currents, inductances, back-EMF and torque at a state. `t` in s.
    #[inline(always)]
    pub fn operating<const N: usize>(&self, t: T, y: &[T; N]) -> Operating<T> {
        debug_assert!(N >= WITH_EDDY || self.motor.magnetics.eddy_currents().is_none());
        debug_assert!(N >= CORE || !self.moves && self.link.storage.is_none());
        let (angle, at) = if self.moves { (y[2], Heading::of(y[2])) } else { (self.angle, self.heading) };
        let flux = AlphaBeta::new(y[0], y[1]).park_by(at.sin, at.cos);
        let state = self.motor.magnetics.state(flux, at);
        let (mut current, mut gamma) = (state.current, state.inverse_inductance);
        let mut drift = None;
        let zero = T::of(0.0);
        let (mut lag, mut eddy_loss) = (Dq::new(zero, zero), zero);
        if N >= WITH_EDDY {
            lag = flux - Dq::new(y[CORE], y[CORE + 1]);
            if let Some(eddy) = self.motor.magnetics.eddy(lag) {
                current = current + eddy.current;
                gamma.xx = gamma.xx + eddy.inverse_inductance.d;
                gamma.yy = gamma.yy + eddy.inverse_inductance.q;
                drift = Some(-(eddy.current * T::of(eddy.time_constant.recip())));
                eddy_loss = eddy.current.dot(lag) * (1.5 / eddy.time_constant);
            }
        }
        let torque = self.motor.torque(flux, current, state.energy_slope) + self.motor.cogging(angle);
        let mut emf = None;
        if self.moves {
            // di/dt = Γ (v − R i − ω J ψ) + drift + ω (J i + ∂i/∂θ).
            let turning = (current.quarter_turn() + state.current_slope) * y[3];
            drift = Some(if let Some(drift) = drift { drift + turning } else { turning });
            emf = Some(AlphaBeta::new(y[0], y[1]).quarter_turn() * y[3]);
        }
        let mut drift_in_plane = None;
        if let Some(drift) = drift {
            drift_in_plane = Some(self.in_plane(drift, at));
        }
        let dc_link = match self.link.storage {
            Some(_) => y[4],
            None => self.link.source_at(t, self.ripple_phase),
        };
        Operating {
            current: self.in_plane(current, at),
            inverse_inductance: if self.moves { gamma.unpark_by(at.sin, at.cos) } else { gamma },
            emf,
            drift: drift_in_plane,
            dc_link,
            core_flux: state.core_flux,
            core_current: state.core_current,
            lag,
            eddy_loss,
            torque,
        }
    }

    /// From the rotor's plane into the plane.
    #[inline(always)]
    fn in_plane(&self, v: Dq<T>, at: Heading<T>) -> AlphaBeta<T> {
        if self.moves { v.unpark_by(at.sin, at.cos) } else { AlphaBeta::new(v.d, v.q) }
    }

    /// The derivative of the state with all that it follows from. `t` in s; `terminals` are [`Self::terminals`].
    #[inline(always)]
    pub fn evaluate<const N: usize>(&self, terminals: &Terminals<T>, t: T, y: &[T; N]) -> Evaluation<N, T> {
        let operating = self.operating(t, y);
        let (slope, blocked_potential) = self.winding(terminals, &operating);

        let zero = T::of(0.0);
        let mut dy = [zero; N];
        dy[0] = slope.alpha;
        dy[1] = slope.beta;
        if N < CORE {
            return Evaluation { slope: dy, operating, blocked_potential };
        }
        let Operating { lag, torque, .. } = operating;
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
            let current = self.phases(&operating);
            let [a, b, c] = &self.legs.leg;
            let link_current = a.rail * current[0] + b.rail * current[1] + c.rail * current[2];
            let mut source_current = link_current;
            let mut source_loss = zero;
            if let Some(storage) = self.link.storage {
                let source = self.link.source_at(t, self.ripple_phase);
                source_current = (source - operating.dc_link) * (1.0 / storage.source_resistance);
                source_loss = source_current * source_current * storage.source_resistance;
                dy[4] = (source_current - link_current) * (1.0 / storage.capacitance);
            }
            if N == WITH_LEDGER {
                dy[WITH_EDDY] = self.link.source_at(t, self.ripple_phase) * source_current;
                dy[WITH_EDDY + 1] = source_loss;
                // A conducting leg's drop is −offset + resistance · i; a blocked one carries nothing.
                let mut device_loss = zero;
                for (leg, current) in self.legs.leg.iter().zip(current) {
                    device_loss = device_loss + (leg.resistance * current - leg.offset) * current;
                }
                let i = operating.current;
                dy[WITH_EDDY + 2] = device_loss;
                dy[WITH_EDDY + 3] = i.dot(i) * (1.5 * self.motor.resistance);
                dy[WITH_EDDY + 4] = operating.eddy_loss;
                dy[WITH_EDDY + 5] = torque * mechanical_speed;
                dy[WITH_EDDY + 6] = friction * mechanical_speed;
                dy[WITH_EDDY + 7] = self.load_torque * mechanical_speed;
            }
        }
        Evaluation { slope: dy, operating, blocked_potential }
    }

    /// dψ/dt in V, in the stator's plane, and the potential in V of a leg that is blocked while others conduct.
    #[inline(always)]
    fn winding(&self, terminals: &Terminals<T>, at: &Operating<T>) -> (AlphaBeta<T>, T) {
        // v − R i, but for the blocked leg.
        let free = terminals.voltage(at.dc_link, at.current) - at.current * T::of(self.motor.resistance);
        // Its potential u is where its current stays: p · (Γ (free + ⅔ u p − e) + drift) = 0.
        let driving = if let Some(emf) = at.emf { free - emf } else { free };
        let across = at.inverse_inductance.times(terminals.blocked);
        let mut rising = across.dot(driving);
        if let Some(drift) = at.drift {
            rising = rising + terminals.blocked.dot(drift);
        }
        let short = rising / (across.dot(terminals.blocked) + terminals.free);
        let mut slope = free - terminals.blocked * short;
        let idle = self.legs.idle.above(T::of(0.0));
        if T::any(idle) {
            // All currents stay.
            let holding = self.holding(at) - at.current * T::of(self.motor.resistance);
            slope.alpha = T::choose(idle, holding.alpha, slope.alpha);
            slope.beta = T::choose(idle, holding.beta, slope.beta);
        }
        (self.out_of_plane(slope), short * -1.5)
    }

    /// The voltage in V that would hold the currents as they are, in the plane.
    #[inline(always)]
    fn holding(&self, at: &Operating<T>) -> AlphaBeta<T> {
        let mut holding = at.current * T::of(self.motor.resistance);
        if let Some(emf) = at.emf {
            holding = holding + emf;
        }
        if let Some(drift) = at.drift {
            holding = holding - at.inverse_inductance.inverse().times(drift);
        }
        holding
    }

    /// From the plane into the stator's.
    #[inline(always)]
    pub fn out_of_plane(&self, v: AlphaBeta<T>) -> AlphaBeta<T> {
        if self.moves { v } else { Dq::new(v.alpha, v.beta).unpark_by(self.heading.sin, self.heading.cos) }
    }

    /// Phase currents in A.
    #[inline(always)]
    pub fn phases(&self, at: &Operating<T>) -> [T; 3] {
        self.out_of_plane(at.current).phases().0
    }

    /// How fast the phase currents rise in A/s, where the state has this derivative.
    #[inline(always)]
    pub fn rise<const N: usize>(&self, there: &Evaluation<N, T>) -> [T; 3] {
        let at = &there.operating;
        let (slope, Heading { sin, cos }) = (AlphaBeta::new(there.slope[0], there.slope[1]), self.plane());
        let Dq { d, q } = slope.park_by(sin, cos);
        let mut driving = AlphaBeta::new(d, q);
        if let Some(emf) = at.emf {
            driving = driving - emf;
        }
        let mut rise = at.inverse_inductance.times(driving);
        if let Some(drift) = at.drift {
            rise = rise + drift;
        }
        self.out_of_plane(rise).phases().0
    }

    /// The machine as the bridge sees it.
    #[inline(always)]
    pub fn port(&self, at: &Operating<T>) -> Port<T> {
        let gamma = at.inverse_inductance;
        let Heading { sin, cos } = self.heading;
        Port {
            current: self.phases(at),
            inverse_inductance: if self.moves { gamma } else { gamma.unpark_by(sin, cos) },
            holding: self.out_of_plane(self.holding(at)),
            dc_link: at.dc_link,
        }
    }

    /// Takes the integrator's error off the currents of blocked legs, at a state and what the machine is there: the flux
    /// moves as a voltage impulse at their terminals would move it.
    #[inline(always)]
    pub fn settle<const N: usize>(
        &self,
        terminals: &Terminals<T>,
        state: &mut [T; N],
        at: &mut Operating<T>,
    ) {
        let gamma = at.inverse_inductance;
        let across = gamma.times(terminals.blocked);
        let share = terminals.blocked.dot(at.current) / (across.dot(terminals.blocked) + terminals.free);
        let mut impulse = terminals.blocked * share;
        at.current = at.current - across * share;
        let idle = self.legs.idle.above(T::of(0.0));
        if T::any(idle) {
            let all = gamma.inverse().times(at.current);
            let zero = T::of(0.0);
            impulse = AlphaBeta::new(
                T::choose(idle, all.alpha, impulse.alpha),
                T::choose(idle, all.beta, impulse.beta),
            );
            at.current = AlphaBeta::new(
                T::choose(idle, zero, at.current.alpha),
                T::choose(idle, zero, at.current.beta),
            );
        }
        let impulse = self.out_of_plane(impulse);
        state[0] = state[0] - impulse.alpha;
        state[1] = state[1] - impulse.beta;
    }
}
