//! The equations of motor, legs and link between two instants, for several machines side by side.
//!
//! ```text
//!   dψ/dt = v − R i          v from the legs, i = ∂W/∂ψ
//!   di/dt = Γ dψ/dt + ω ∂i/∂θ + decay by eddy currents
//!   dθ/dt = ω,   J/p dω/dt = T − T_load − friction
//!   C dU/dt = (E − U)/R_s − i_dc
//!   dχ/dt = (ψ − χ)/τ        lagging flux of the eddy currents, in the rotor's plane
//!   C dv_k/dt = −i_k − v_k/R potential of a terminal with a divider R, while no device of its leg conducts
//! ```
//! The parallel branches of play cells and of shorted turns have their own equations (`effect.rs`, `effect/shorted.rs`).

mod rotors;

use standstill_interface::Dq;
use standstill_inverter::Inverter;
use standstill_numeric::{Heading, MOST_LANES, Symmetric, Wide, sin_cos};
use standstill_plant::{Circuits, MagneticCircuit, Motor};

use super::legs::{Conducting, Legs};
use super::links::Links;
use super::plane::Plane;
use super::state::State;
use crate::effect::shorted::Shorted;
use crate::effect::{Branch, BranchPoint, keep_symmetric};

/// Machines of one kind, one in each lane. Their equations have the same form; their parameters may differ.
#[derive(Clone, Debug)]
pub struct Machine<'a, V: Wide> {
    /// Parameters of the magnetic circuits, one lane for each machine.
    pub circuits: Circuits<V>,
    /// The magnetic circuits from which the parameters in `circuits` come.
    pub cores: [&'a MagneticCircuit; MOST_LANES],
    /// Resistance of the winding in Ω.
    pub resistance: V,
    /// The DC side.
    pub links: Links<V>,
    /// The legs and their conduction modes.
    pub legs: Legs<V>,
    /// Initial angle of each rotor as a heading (sine and cosine). It is also the angle of the run's plane in the stator's plane.
    pub start: Heading<V>,
    /// The play cells in parallel with the machines' cores. None without hysteresis.
    pub branch: Option<Branch<V>>,
    /// Shorted turns; none if no machine has them.
    pub shorted: Option<Shorted<V>>,
    /// The rotors; none if all are locked.
    pub rotors: Option<Rotors<V>>,
}

/// Rotors that can move.
#[derive(Clone, Debug, Default)]
pub struct Rotors<V: Wide> {
    /// 1 while the rotor moves, else 0.
    pub moving: V,
    /// Dry friction torque in N·m. It is positive if it acts backwards, against a forward motion.
    pub dry_friction: V,
    /// Load torque in N·m. It is positive if it acts against forward motion.
    pub load: V,
    /// Initial electrical angle in rad.
    pub start: V,
    /// Torque factor 3/2 p, with p pole pairs.
    torque_factor: V,
    /// Electrical acceleration per torque, p/J in 1/(kg m²), with p pole pairs.
    per_inertia: V,
    /// Viscous friction torque in N·m per rad/s of electrical speed.
    viscous: V,
    /// Electrical acceleration in rad/s² of a rotor that is driven from outside. The machine's torque does not affect it.
    imposed: V,
    /// Amplitude of the cogging torque in N·m, and number of its periods per electrical revolution.
    cogging: [V; 2],
}

/// Operating point of a machine: the currents, inductances and torque at its present state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Operating<T> {
    /// Current of the winding in A.
    pub current: Plane<T>,
    /// Inverse incremental inductance Γ in 1/H.
    pub inverse_inductance: Symmetric<T>,
    /// Derivative of the current with respect to the angle, ∂i/∂θ in A/rad. The flux ψ is constant in the run's plane.
    pub turning: Plane<T>,
    /// Time derivative of the current in A/s at constant flux ψ. Decaying eddy currents and the currents of shorted turns cause it.
    pub relaxing: Plane<T>,
    /// ∂²W/∂θ∂ψ in A/rad, where W is the core's energy. The slope of the torque needs this derivative of ∂W/∂θ with respect to the flux.
    pub energy_turn: Plane<T>,
    /// ∂²W/∂θ² in J/rad² at constant flux ψ, divided by 3/2. W is the core's energy.
    pub energy_bend: T,
    /// Electromagnetic torque in N·m, cogging included.
    pub torque: T,
    /// Derivative of the cogging torque with respect to the angle, in N·m/rad.
    pub cogging_slope: T,
    /// Flux of the core in Wb. It is the winding's flux minus the flux of the harmonics over the angle.
    pub core_flux: Dq<T>,
    /// Current of the core in A. The flux map is evaluated at this current.
    pub core_current: Dq<T>,
    /// Winding's flux minus the lagging flux χ of the eddy currents, in Wb in the rotor's plane.
    pub lag: Dq<T>,
}

/// Time derivatives of flux and current of a machine, at one state and with given conduction modes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Change<T> {
    /// Slope of the flux, dψ/dt in V.
    pub flux: Plane<T>,
    /// Slope of the current, di/dt in A/s.
    pub current: Plane<T>,
    /// Potential in V of the leg that is blocked while the other two conduct. Without such a leg the value has no meaning.
    pub blocked_potential: T,
}

impl<'a, V: Wide> Machine<'a, V> {
    /// Makes machines of the same kind as this motor and inverter. All lanes have the motor's values. `free` says whether the rotors can
    /// move. `loaded` says whether dividers draw a current from the terminals.
    pub fn like(motor: &'a Motor, inverter: &Inverter, free: bool, loaded: bool) -> Self {
        let link = &inverter.link;
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let mut machine = Self {
            circuits: Circuits::like(&motor.magnetics),
            cores: [&motor.magnetics; MOST_LANES],
            resistance: zero,
            links: Links::like(link),
            legs: Legs::idle(inverter.bridge.terminal_capacitance > 0.0, loaded),
            start: Heading { sin: zero, cos: one },
            branch: Branch::like(motor),
            shorted: None,
            rotors: free.then(Rotors::default),
        };
        for lane in 0..V::LANES {
            machine.put(lane, motor, link, 0.0, 0.0);
        }
        machine
    }

    /// Puts a machine of this kind into a lane. `angle` is the rotor's electrical angle in rad. `load` is the load torque in N·m.
    pub fn put(
        &mut self,
        lane: usize,
        motor: &'a Motor,
        link: &standstill_inverter::DcLink,
        angle: f64,
        load: f64,
    ) {
        let put = |to: &mut V, from: f64| to.put(lane, from);
        self.circuits.put(lane, &motor.magnetics);
        self.cores[lane] = &motor.magnetics;
        put(&mut self.resistance, motor.resistance);
        self.links.put(lane, link);
        let start = Heading::of(angle);
        put(&mut self.start.sin, start.sin);
        put(&mut self.start.cos, start.cos);
        self.legs.put_axes(lane, start);
        if let Some(shorted) = &mut self.shorted {
            shorted.clear(lane);
        }
        if let Some(rotors) = &mut self.rotors {
            let pole_pairs = f64::from(motor.pole_pairs);
            put(&mut rotors.start, angle);
            put(&mut rotors.load, load);
            put(&mut rotors.torque_factor, 1.5 * pole_pairs);
            put(&mut rotors.per_inertia, pole_pairs / motor.rotor.inertia);
            put(&mut rotors.imposed, 0.0);
            put(&mut rotors.viscous, motor.rotor.friction.viscous / pole_pairs);
            let (torque, periods) = motor
                .rotor
                .cogging
                .map_or((0.0, 1.0), |cogging| (cogging.torque, f64::from(cogging.periods)));
            put(&mut rotors.cogging[0], torque);
            put(&mut rotors.cogging[1], periods);
        }
    }

    /// Returns whether a machine with this motor and inverter is of this kind. `free` and `loaded` have the meanings given at
    /// [`Self::like`].
    pub fn fits(&self, motor: &Motor, inverter: &Inverter, free: bool, loaded: bool) -> bool {
        self.circuits.fits(&motor.magnetics)
            && self.links.fits(&inverter.link)
            && self.rotors.is_some() == free
            && self.legs.elastance.is_some() == (inverter.bridge.terminal_capacitance > 0.0)
            && self.legs.leak.is_some() == (loaded && self.legs.elastance.is_some())
    }

    /// Returns the angle by which the rotors have turned since the start, as sine and cosine.
    #[inline(always)]
    fn turned(&self, state: &State<V>) -> Heading<V> {
        if self.rotors.is_some() {
            Heading::of(state.turned)
        } else {
            Heading { sin: V::of(0.0), cos: V::of(1.0) }
        }
    }

    /// Returns the currents, inductances and torque at a state. `branch` contains the parallel branch of play cells at the state's flux.
    /// `short` contains the shorted turns.
    #[inline(always)]
    pub fn operating(
        &self,
        state: &State<V>,
        branch: Option<&BranchPoint<V>>,
        short: Option<&Shorted<V>>,
    ) -> Operating<V> {
        let zero = V::of(0.0);
        let turned = self.turned(state);
        let (flux, at) = if self.rotors.is_some() {
            let (sin, cos) = (self.start.sin, self.start.cos);
            let at = Heading {
                sin: sin * turned.cos + cos * turned.sin,
                cos: cos * turned.cos - sin * turned.sin,
            };
            (state.flux.to_rotor(turned), at)
        } else {
            (Dq::new(state.flux.x, state.flux.y), self.start)
        };
        let magnetic = self.circuits.state(flux, at, &self.cores);
        let (mut current, mut gamma) = (magnetic.current, magnetic.inverse_inductance);
        let none = Dq::new(zero, zero);
        let (mut lag, mut relaxing) = (none, none);
        if let Some(eddies) = self.circuits.eddies() {
            lag = flux - state.lagging;
            let g = eddies.inverse_inductance;
            let eddy = Dq::new(lag.d * g.d, lag.q * g.q);
            current = current + eddy;
            gamma.xx = gamma.xx + g.d;
            gamma.yy = gamma.yy + g.q;
            relaxing = -(eddy * eddies.rate);
        }
        let in_plane = |v: Dq<V>| Plane::new(v.d, v.q);
        let mut at_state = Operating {
            current: in_plane(current),
            inverse_inductance: gamma,
            turning: in_plane(none),
            relaxing: in_plane(relaxing),
            energy_turn: in_plane(none),
            energy_bend: magnetic.energy_bend,
            torque: zero,
            cogging_slope: zero,
            core_flux: magnetic.core_flux,
            core_current: magnetic.core_current,
            lag,
        };
        if let Some(rotors) = &self.rotors {
            let (sin, cos) = sin_cos((rotors.start + state.turned) * rotors.cogging[1]);
            at_state.torque = (flux.d * current.q - flux.q * current.d - magnetic.energy_slope)
                * rotors.torque_factor
                - sin * rotors.cogging[0];
            at_state.cogging_slope = -(cos * rotors.cogging[0] * rotors.cogging[1]);
            at_state.current = Plane::from_rotor(current, turned);
            at_state.relaxing = Plane::from_rotor(relaxing, turned);
            let gamma = gamma.unpark_by(turned.sin, turned.cos);
            at_state.inverse_inductance = gamma;
            let slope = current.quarter_turn() + magnetic.current_slope;
            at_state.turning = Plane::from_rotor(slope, turned) - state.flux.quarter_turn().through(gamma);
            at_state.energy_turn = Plane::from_rotor(magnetic.current_slope, turned);
        }
        // The branch is fixed to the stator, so it makes no torque: it is added after the torque is computed.
        if let Some(branch) = branch {
            let gamma = &mut at_state.inverse_inductance;
            at_state.current = at_state.current + branch.current;
            *gamma = plus(gamma, &branch.stiffness);
        }
        if let Some(short) = short {
            short.join(state, &mut at_state);
        }
        at_state
    }

    /// Returns [`Self::branch`] if `RARE` is true, else none. `RARE` is true in code that can step rare kinds of machines
    /// ([`Self::is_rare`]). In all other code the compiler leaves out the computation of hysteresis (play cells).
    #[inline(always)]
    pub fn branch_if<const RARE: bool>(&self) -> Option<&Branch<V>> {
        if RARE { self.branch.as_ref() } else { None }
    }

    /// Returns [`Self::shorted`] if `RARE` is true, as [`Self::branch_if`] does; else none.
    #[inline(always)]
    pub fn shorted_if<const RARE: bool>(&self) -> Option<&Shorted<V>> {
        if RARE { self.shorted.as_ref() } else { None }
    }

    /// Returns the result of [`Shorted::pull_of`] in V; zero without shorted turns.
    #[inline(always)]
    pub fn pull(&self, state: &State<V>, lane: usize) -> Plane {
        self.shorted.as_ref().map_or(Plane::default(), |of| of.pull_of(state, lane))
    }

    /// Returns a current in A at the terminals less the part that shorted turns draw beside the core.
    pub fn without_shorted(&self, state: &State<V>, current: Plane<V>) -> Plane<V> {
        let shorted = self.shorted.as_ref().map(|of| of.point(state));
        shorted.map_or(current, |point| point.core(state.flux, current, state.shorted))
    }

    /// Finds out which play cells of the selected machines slide at the beginning of a step.
    #[inline(always)]
    pub fn find_modes(&mut self, of: V::Mask, legs: &Conducting<V>, at: &mut Operating<V>, state: &State<V>) {
        let Some(mut branch) = self.branch.take() else { return };
        let mut there = *at;
        let bare = minus(&at.inverse_inductance, &branch.stiffness());
        branch.find_modes(of, state.flux, |stiffness| {
            there.inverse_inductance = plus(&bare, &stiffness);
            self.change::<true>(legs, &there, state).flux
        });
        keep_symmetric(of, plus(&bare, &branch.stiffness()), &mut at.inverse_inductance);
        self.branch = Some(branch);
    }

    /// Returns the time derivative of the currents in A/s at constant flux. The rotation of the rotor and the decay of eddy currents
    /// cause it.
    #[inline(always)]
    pub fn drift(&self, at: &Operating<V>, speed: V) -> Plane<V> {
        if self.rotors.is_some() { at.turning * speed + at.relaxing } else { at.relaxing }
    }

    /// Returns the time derivatives of flux and currents at a state.
    #[inline(always)]
    pub fn change<const RARE: bool>(
        &self,
        legs: &Conducting<V>,
        at: &Operating<V>,
        state: &State<V>,
    ) -> Change<V> {
        let terminals = &legs.terminals;
        let gamma = at.inverse_inductance;
        let (speed, link) = (state.speed, state.link);
        // v − R i, without the blocked leg's part of v.
        let mut driven = terminals.rail * link + terminals.offset - at.current.through(terminals.resistance);
        if self.legs.elastance_if::<RARE>().is_some() {
            driven = driven + self.legs.floating(legs, &state.potential);
        }
        if let Some(short) = self.shorted_if::<RARE>() {
            driven = driven + short.pull(state);
        }
        // The potential u of the blocked leg, with axis b, keeps its current constant: b · (Γ (driven + ⅔ u b) + drift) = 0.
        let across = terminals.blocked.through(gamma);
        let mut rising = across.dot(driven);
        let drifts = self.drifts_if::<RARE>();
        if drifts {
            rising = rising + terminals.blocked.dot(self.drift(at, speed));
        }
        let short = rising / (across.dot(terminals.blocked) + terminals.none_blocked);
        let mut flux = driven - terminals.blocked * short;
        if V::any(legs.idle) {
            // All currents stay constant.
            let mut holding = Plane::new(V::of(0.0), V::of(0.0));
            if drifts {
                holding = holding - self.drift(at, speed).through(gamma.inverse());
            }
            flux = Plane::choose(legs.idle, holding, flux);
        }
        let mut current = flux.through(gamma);
        if drifts {
            current = current + self.drift(at, speed);
        }
        Change { flux, current, blocked_potential: short * -1.5 }
    }

    /// Returns whether eddy currents, shorted turns or play cells react to the flux. The closed-form solution for ringing terminals does
    /// not contain this reaction.
    #[inline(always)]
    pub fn lags(&self) -> bool {
        self.circuits.eddies().is_some() || self.branch.is_some() || self.shorted.is_some()
    }

    /// Returns whether the machines are of a rare kind: with terminal capacitances, play cells or shorted turns. Only code with `RARE`
    /// can step them.
    pub fn is_rare(&self) -> bool {
        self.legs.elastance.is_some() || self.branch.is_some() || self.shorted.is_some()
    }

    /// Returns whether currents can change without a voltage: through rotation, eddy currents or shorted turns.
    #[inline(always)]
    pub fn drifts(&self) -> bool {
        self.drifts_if::<true>()
    }

    /// Returns the result of [`Self::drifts`]. Without `RARE` no machine has shorted turns, and the check for them is left out.
    #[inline(always)]
    pub fn drifts_if<const RARE: bool>(&self) -> bool {
        self.rotors.is_some() || self.circuits.eddies().is_some() || RARE && self.shorted.is_some()
    }
}

#[inline(always)]
fn plus<V: Wide>(a: &Symmetric<V>, b: &Symmetric<V>) -> Symmetric<V> {
    Symmetric::new(a.xx + b.xx, a.xy + b.xy, a.yy + b.yy)
}

#[inline(always)]
fn minus<V: Wide>(a: &Symmetric<V>, b: &Symmetric<V>) -> Symmetric<V> {
    Symmetric::new(a.xx - b.xx, a.xy - b.xy, a.yy - b.yy)
}
