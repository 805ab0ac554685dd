//! From one instant to the next: steps, and the changes of conduction or motion found within them.

use standstill_interface::{AlphaBeta, Phase};
use standstill_inverter::{Conduction, Gate};
use standstill_plant::Heading;

use super::Rig;
use super::deferred::Due;
use crate::case::RunError;
use crate::flow::{CORE, DOMAIN, Evaluation, FLUX, Flow, MARGINS, MOTION, PLANE, STOP};
use crate::integrator::{Attempt, STAGES};
use crate::motion::{Contact, Motion};
use crate::trace::{Event, Probe};

/// Events within one segment beyond which the modes are taken to chatter. A segment of a PWM period has at most
/// a handful.
const MOST_EVENTS: u32 = 1000;

/// How far beyond zero a margin must be to count as crossed: the next mode then contradicts the last one by more
/// than rounding. Current in A, flux in Wb, angle in rad, and the rest in V, N·m or rad/s, whichever the margin is in.
const CURRENT_SLACK: f64 = 1e-10;
const FLUX_SLACK: f64 = 1e-14;
const ANGLE_SLACK: f64 = 1e-12;
const OTHER_SLACK: f64 = 1e-6;

/// The same of the torque that starts a rotor: at most this share of its stiction, or of what rated current can do. There
/// are rotors that a micronewton metre starts.
const STICTION_SHARE: f64 = 1e-4;
const TORQUE_SHARE: f64 = 1e-9;

impl<const N: usize, P: Probe> Rig<'_, N, P> {
    /// Time in s since the start of the run.
    fn time(&self) -> f64 {
        self.reached.seconds() + self.elapsed
    }

    /// Whether new gates of a leg change the flow: unless its current flows through the same device as before.
    pub(super) fn matters(&self, leg: usize, gate: Gate) -> bool {
        let mode = self.flow.modes()[leg];
        let after = match mode.direction() {
            0.0 => return true,
            direction if direction > 0.0 => Conduction::outflow(gate),
            _ => Conduction::inflow(gate),
        };
        after != mode
    }

    /// Carries the flow to the instant at hand.
    pub(super) fn catch_up(&mut self) -> Result<(), RunError> {
        let span = (self.now - self.reached).seconds();
        self.elapsed = 0.0;
        if span > 0.0 {
            self.work.segments += 1;
            if self.probe.resolution().is_some() {
                let state = self.state;
                self.show(self.time(), &state);
            }
            let mut events = 0;
            while self.elapsed < span {
                let stop = if events == 0 { span } else { self.next_that_matters(span)? };
                if stop <= self.elapsed {
                    continue;
                }
                if self.rests() {
                    self.wait(stop);
                } else if self.step(stop)? {
                    events += 1;
                    if events > MOST_EVENTS {
                        return Err(RunError::Chatter);
                    }
                }
            }
        }
        self.carry_until(f64::INFINITY);
        self.reached = self.now;
        self.elapsed = 0.0;
        self.project();
        Ok(())
    }

    /// After a change of modes: when the next waiting change that now matters is, at the end of the span at the latest.
    /// One that is due is carried out.
    fn next_that_matters(&mut self, span: f64) -> Result<f64, RunError> {
        let matters = self.deferred.waiting().iter().find(|(_, due)| match due {
            Due::Command => false,
            Due::Gate(leg, gate) => self.matters(*leg, *gate),
        });
        let Some((at, _)) = matters else { return Ok(span) };
        let stop = (*at - self.reached).seconds();
        if stop <= self.elapsed {
            self.carry_until(stop);
            self.project();
            self.resolve()?;
        }
        Ok(stop.min(span))
    }

    /// Carries out the changes that waited for up to `elapsed` seconds since the last instant.
    fn carry_until(&mut self, elapsed: f64) {
        while let Some((at, _)) = self.deferred.waiting().first()
            && (*at - self.reached).seconds() <= elapsed
            && let Some((at, due)) = self.deferred.take()
        {
            self.carry_at(at.seconds(), due);
        }
    }

    /// Carries out a change of the instant at hand.
    pub(super) fn carry(&mut self, due: Due) {
        self.carry_at(self.now.seconds(), due);
    }

    fn carry_at(&mut self, time: f64, due: Due) {
        let event = match due {
            Due::Command => Event::Command,
            Due::Gate(leg, gate) => {
                self.flow.gates[leg] = gate;
                Event::Gate(Phase::ALL[leg], gate)
            }
        };
        self.probe.event(time, event);
    }

    /// Whether nothing happens before the next instant: no current, no motion, and nothing stored that could drive any.
    fn rests(&self) -> bool {
        let link = self.flow.machine.link;
        self.flow.modes() == [Conduction::Blocked; 3]
            && !self.flow.motion().moves()
            && self.case.motor.magnetics.eddy_currents().is_none()
            && link.storage.is_none()
            && link.sag.is_none()
    }

    /// Lets time pass up to `elapsed` seconds since the last instant while nothing happens.
    fn wait(&mut self, elapsed: f64) {
        let begin = self.time();
        let h = elapsed - self.elapsed;
        let state = self.state;
        self.watch(begin, h, |_| state);
        self.filter(begin, h, |_| state);
        self.slope = None;
        self.elapsed = elapsed;
    }

    /// One accepted step, to `stop` at most, in s since the last instant; true if it ended in an event.
    fn step(&mut self, stop: f64) -> Result<bool, RunError> {
        let slope = if let Some(slope) = self.slope {
            slope
        } else {
            self.work.derivatives += 1;
            self.flow.derivative(self.time(), &self.state)
        };
        let remaining = stop - self.elapsed;
        let mut h = remaining.min(self.step_hint).min(self.longest_step);
        let (attempt, end) = loop {
            let (attempt, end) = self.attempt(&slope, h);
            let error = attempt.error(&self.tolerance);
            if error <= 1.0 {
                // A step cut short by the end of the span says little about the next one's length.
                let next = attempt.next_length(error);
                self.step_hint = if h < self.step_hint { next.max(self.step_hint) } else { next };
                break (attempt, end);
            }
            if h < 1e-15 {
                return Err(RunError::NotFinite);
            }
            self.step_hint = attempt.next_length(error).min(0.9 * h);
            h = self.step_hint;
        };
        match self.find_event(&attempt, &end) {
            None => {
                self.accept(&attempt, &end);
                self.slope = Some(attempt.end_slope);
                self.elapsed = if h == remaining { stop } else { self.elapsed + h };
                Ok(false)
            }
            Some((which, share)) => {
                let (cut, end) = self.attempt(&slope, h * share);
                self.accept(&cut, &end);
                self.slope = None;
                // A cut of no length still ends the mode that it was to end.
                self.elapsed = (self.elapsed + cut.h).min(stop);
                self.carry_until(self.elapsed);
                self.work.events += 1;
                self.handle_event(which)?;
                if self.probe.resolution().is_some() {
                    let state = self.state;
                    self.show(self.time(), &state);
                }
                Ok(true)
            }
        }
    }

    fn attempt(&mut self, slope: &[f64; N], h: f64) -> (Attempt<N>, Evaluation<N>) {
        self.work.derivatives += STAGES;
        let (flow, t) = (&self.flow, self.time());
        if N == CORE && !flow.motion().moves() && flow.machine.link.storage.is_none() {
            // Nothing but the flux changes.
            let [start, slope] = [&self.state, slope].map(|y| [y[0], y[1]]);
            let (attempt, end) = take::<PLANE>(flow, t, &start, &slope, h);
            let attempt = attempt.among(&self.state);
            let Evaluation { operating, potentials, .. } = end;
            return (attempt, Evaluation { slope: attempt.end_slope, operating, potentials });
        }
        take(flow, t, &self.state, slope, h)
    }

    /// The slack of the rotor's motion: a torque in N·m while it rests, a speed in rad/s while it slides.
    fn motion_slack(&self) -> f64 {
        if self.flow.motion().moves() {
            return OTHER_SLACK;
        }
        let motor = &self.case.motor;
        let flux = motor.magnet_flux + motor.winding.mean_inductance * motor.rated_current;
        let torque = 1.5 * f64::from(motor.pole_pairs) * flux * motor.rated_current;
        OTHER_SLACK.min((STICTION_SHARE * motor.rotor.friction.stiction).max(TORQUE_SHARE * torque))
    }

    /// How far the modes are from their end at share `x` of the step; negative beyond.
    fn slack(&self, attempt: &Attempt<N>, x: f64) -> [f64; MARGINS] {
        self.with_slack(self.flow.margins(self.time() + x * attempt.h, &attempt.dense(x)))
    }

    fn with_slack(&self, mut margins: [f64; MARGINS]) -> [f64; MARGINS] {
        for (k, margin) in margins.iter_mut().enumerate() {
            *margin += match k {
                FLUX.. => FLUX_SLACK,
                DOMAIN => CURRENT_SLACK,
                STOP => ANGLE_SLACK,
                MOTION => self.motion_slack(),
                leg if self.flow.modes()[leg] == Conduction::Blocked => OTHER_SLACK,
                _ => CURRENT_SLACK,
            };
        }
        margins
    }

    /// The first end of a mode within the step: whose, and at which share of the step.
    ///
    /// The margins are looked at in the middle and at the end. What dips below zero and returns within half a
    /// step is smaller than the step's tolerance allows to matter.
    fn find_event(&self, attempt: &Attempt<N>, end: &Evaluation<N>) -> Option<(usize, f64)> {
        let end = self.flow.margins_at(&end.operating, end.potentials, &attempt.end);
        let middle = self.flow.margins(self.time() + 0.5 * attempt.h, &attempt.dense(0.5));
        if middle.iter().chain(&end).all(|margin| *margin >= 0.0) {
            return None;
        }
        let (middle, end) = (self.with_slack(middle), self.with_slack(end));
        let mut first: Option<(usize, f64)> = None;
        for which in 0..MARGINS {
            let bracket = if middle[which] < 0.0 {
                [(0.0, self.slack(attempt, 0.0)[which]), (0.5, middle[which])]
            } else if end[which] < 0.0 {
                [(0.5, middle[which]), (1.0, end[which])]
            } else {
                continue;
            };
            let share = self.locate(attempt, which, bracket);
            if first.is_none_or(|(_, earliest)| share < earliest) {
                first = Some((which, share));
            }
        }
        first
    }

    /// The share of the step at which margin `which` ends, just beyond zero: between two shares with their margins.
    fn locate(&self, attempt: &Attempt<N>, which: usize, bracket: [(f64, f64); 2]) -> f64 {
        // Regula falsi with the Illinois modification on the dense output: as safe as bisection, and quick.
        let [(mut low, mut at_low), (mut high, mut at_high)] = bracket;
        at_low = at_low.max(0.0);
        // The rotor is put where the stop is: that must not move it by more than rounding.
        let close = match which {
            STOP => 0.1 * ANGLE_SLACK,
            MOTION => 1e-3 * self.motion_slack(),
            _ => 1e-3 * OTHER_SLACK,
        };
        let mut side = 0;
        for _ in 0..60 {
            if high - low < 1e-13 || at_high > -close {
                break;
            }
            let middle = (low * at_high - high * at_low) / (at_high - at_low);
            let middle = if middle > low && middle < high { middle } else { (low + high) / 2.0 };
            let value = self.slack(attempt, middle)[which];
            if value < 0.0 {
                if side == -1 {
                    at_low /= 2.0;
                }
                (high, at_high, side) = (middle, value, -1);
            } else {
                if side == 1 {
                    at_high /= 2.0;
                }
                (low, at_low, side) = (middle, value, 1);
            }
        }
        high
    }

    /// Makes the end of an attempt the state.
    fn accept(&mut self, attempt: &Attempt<N>, end: &Evaluation<N>) {
        let begin = self.time();
        let at = |x: f64| if x == 1.0 { attempt.end } else { attempt.dense(x) };
        self.watch(begin, attempt.h, at);
        self.filter(begin, attempt.h, at);
        self.state = attempt.end;
        self.work.steps += 1;
        self.moved = self.moved.max((self.state[2] - self.case.start_angle).abs());
        let current = end.operating.port.current;
        self.peak_current = current.iter().fold(self.peak_current, |peak, i| peak.max(i.abs()));
    }

    /// Shows who watches a step of `h` seconds with the state at shares of it, and the gate edges on the way.
    fn watch(&mut self, begin: f64, h: f64, at: impl Fn(f64) -> [f64; N]) {
        let Some(resolution) = self.probe.resolution() else { return };
        // A number of snapshots per step is small and positive.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = (h / resolution).ceil().max(1.0) as u32;
        for part in 1..=parts {
            let x = f64::from(part) / f64::from(parts);
            while let Some((edge, _)) = self.deferred.waiting().first()
                && (*edge - self.reached).seconds() < self.elapsed + x * h
                && let Some((edge, due)) = self.deferred.take()
            {
                let share = ((edge.seconds() - begin) / h).clamp(0.0, 1.0);
                self.show(edge.seconds(), &at(share));
                self.carry_at(edge.seconds(), due);
            }
            self.show(begin + x * h, &at(x));
        }
    }

    /// Carries the sensors' filters over a step of `h` seconds with the state at shares of it.
    fn filter(&mut self, begin: f64, h: f64, at: impl Fn(f64) -> [f64; N]) {
        if self.filters.is_none() && self.link_filter.is_none() || h <= 0.0 {
            return;
        }
        let points =
            [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|x| self.flow.operating(begin + x * h, &at(x)).port);
        if let Some(filters) = &mut self.filters {
            let (settings, modes) = (self.case.sensors.settings, self.flow.modes());
            let seen = points.map(|port| settings.seen(port.current, modes));
            for (k, filter) in filters.iter_mut().enumerate() {
                filter.advance(h, seen.map(|current| current[k]));
            }
        }
        if let Some(filter) = &mut self.link_filter {
            filter.advance(h, points.map(|port| port.dc_link));
        }
    }

    /// Ends the mode whose margin reached zero and finds what follows.
    fn handle_event(&mut self, which: usize) -> Result<(), RunError> {
        if which >= FLUX {
            self.flow.sides[which - FLUX] *= -1.0;
            return Ok(());
        }
        if which == DOMAIN {
            self.probe.event(self.time(), Event::LeftMap);
            return Err(self.left_map());
        }
        if which == STOP || which == MOTION {
            self.change_motion(which);
            return Ok(());
        }
        let (modes, ended) = (self.flow.modes(), which);
        let conducted = modes[ended] != Conduction::Blocked;
        self.make_zero(std::array::from_fn(|k| modes[k] == Conduction::Blocked || (conducted && k == ended)));
        self.resolve()
    }

    /// The rotor stopped, started, or ran into the end of the brake's play.
    fn change_motion(&mut self, which: usize) {
        let mut contact = Contact::None;
        if which == STOP
            && let Some([lower, upper]) = self.flow.stops
        {
            self.impact_loss += self.flow.kinetic_energy(&self.state);
            let ahead = upper - self.state[2] < self.state[2] - lower;
            (contact, self.state[2]) = if ahead { (Contact::Upper, upper) } else { (Contact::Lower, lower) };
        }
        if matches!(self.flow.motion(), Motion::Forward | Motion::Backward) || which == STOP {
            self.state[3] = 0.0;
        }
        let torque = self.flow.operating(self.time(), &self.state).torque - self.flow.machine.load_torque;
        let motion = Motion::resolve(&self.case.motor.rotor, self.state[3], torque, contact);
        self.flow.turn(motion, self.state[2]);
        self.probe.event(self.time(), Event::Motion(motion));
    }

    fn left_map(&self) -> RunError {
        let at = Heading::of(self.state[2]);
        let flux = AlphaBeta::new(self.state[0], self.state[1]).park_by(at.sin, at.cos);
        let current = self.case.motor.magnetics.state(flux, at).core_current;
        // A current in mA is far from the largest whole number.
        #[allow(clippy::cast_possible_truncation)]
        let milli = |current: f64| (current * 1e3).round() as i64;
        RunError::LeftMap { current_ma: [milli(current.d), milli(current.q)] }
    }

    /// Takes the integrator's drift off the currents of blocked legs.
    fn project(&mut self) {
        let modes = self.flow.modes();
        self.make_zero(modes.map(|mode| mode == Conduction::Blocked));
    }

    /// Makes the currents of these legs exactly zero, where the integrator has them zero up to its error.
    fn make_zero(&mut self, legs: [bool; 3]) {
        match legs.iter().filter(|leg| **leg).count() {
            0 => {}
            1 => self.project_leg(legs.iter().position(|leg| *leg).unwrap_or_default()),
            // The currents sum to zero, so all three are. Leg by leg, each would disturb the others.
            _ => self.project_all(),
        }
    }

    /// Moves the flux to where no current flows: that of the magnet, but for eddy currents.
    fn project_all(&mut self) {
        for _ in 0..3 {
            let at = self.flow.operating(self.time(), &self.state);
            if at.current.norm() < 1e-15 {
                break;
            }
            self.slope = None;
            let excess = at.port.inverse_inductance.inverse().times(at.current);
            self.state[0] -= excess.alpha;
            self.state[1] -= excess.beta;
        }
    }

    /// Moves the flux as a voltage impulse at terminal `k` would, until that phase's current is zero.
    fn project_leg(&mut self, k: usize) {
        for _ in 0..3 {
            let port = self.flow.operating(self.time(), &self.state).port;
            if port.current[k].abs() < 1e-15 {
                break;
            }
            self.slope = None;
            let mut unit = [0.0; 3];
            unit[k] = 1.0;
            let push: AlphaBeta<f64> = standstill_interface::Abc(unit).clarke();
            let response = port.inverse_inductance.times(push).phases().0[k];
            let impulse = push * (-port.current[k] / response);
            self.state[0] += impulse.alpha;
            self.state[1] += impulse.beta;
        }
    }

    /// Finds the conduction modes that fit the gates and the state.
    pub(super) fn resolve(&mut self) -> Result<(), RunError> {
        let port = self.flow.operating(self.time(), &self.state).port;
        if !port.current.iter().all(|current| current.is_finite()) {
            return Err(RunError::NotFinite);
        }
        let modes = self.flow.bridge.resolve(self.flow.gates, &port);
        for (k, phase) in Phase::ALL.into_iter().enumerate() {
            if modes[k] != self.flow.modes()[k] {
                self.probe.event(self.time(), Event::Conduction(phase, modes[k]));
            }
        }
        self.flow.conduct(modes);
        self.slope = None;
        Ok(())
    }
}

fn take<const N: usize>(
    flow: &Flow,
    t: f64,
    start: &[f64; N],
    slope: &[f64; N],
    h: f64,
) -> (Attempt<N>, Evaluation<N>) {
    let attempt = Attempt::new(|t, y| flow.derivative(t, y), t, start, slope, h);
    let end = flow.evaluate(t + h, &attempt.end);
    (attempt.with_end_slope(end.slope), end)
}
