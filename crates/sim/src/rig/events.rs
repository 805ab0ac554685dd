//! What ends within a step: changes of conduction and of motion, and the state that follows.

use standstill_interface::{AlphaBeta, Phase};
use standstill_inverter::{Conduction, Legs};
use standstill_numeric::Heading;

use super::Rig;
use crate::case::RunError;
use crate::integrator::Attempt;
use crate::lanes::Steps;
use crate::limits::{DOMAIN, FLUX, MARGINS, MOTION, STOP};
use crate::machine::Machine;
use crate::motion::{Contact, Motion};
use crate::stride::{Stride, lowest_at, quartic};
use crate::trace::{Event, Probe};

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

impl<const N: usize, P: Probe, S: Steps> Rig<'_, N, P, S> {
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

    /// What is added to a margin.
    fn slack(&self, which: usize) -> f64 {
        match which {
            FLUX.. => FLUX_SLACK,
            DOMAIN => CURRENT_SLACK,
            STOP => ANGLE_SLACK,
            MOTION => self.motion_slack(),
            leg if self.flow.modes()[leg] == Conduction::Blocked => OTHER_SLACK,
            _ => CURRENT_SLACK,
        }
    }

    /// How far a mode is from its end at share `x` of the step; negative beyond.
    fn margin<const M: usize>(&self, attempt: &Attempt<M>, which: usize, x: f64) -> f64 {
        let (t, y) = (self.time() + x * attempt.h, attempt.dense(x));
        self.flow.margins(t, &y)[which] + self.slack(which)
    }

    /// The leg whose current is the first to reach zero within a step of `h` seconds, and the share of the step at which it
    /// does, from the currents and how fast they rise at its ends. None: none does, or something else ends too.
    pub(super) fn first_zero<const M: usize>(&self, h: f64, stride: &Stride<M>) -> Option<(usize, f64)> {
        if stride.crossing.other_margin < 0.0 {
            return None;
        }
        let begin = self.here?.current;
        let mut first: Option<(usize, f64)> = None;
        for (leg, mode) in self.flow.modes().into_iter().enumerate() {
            let [begin, middle, end] = [begin, stride.crossing.middle_current, stride.port.current]
                .map(|current| mode.direction() * current[leg] + CURRENT_SLACK);
            let rise = stride.crossing.rise.map(|rise| mode.direction() * rise[leg] * h);
            let at = quartic([begin, middle, end], rise);
            let bracket = if middle < 0.0 {
                [(0.0, begin), (0.5, middle)]
            } else if end < 0.0 {
                [(0.5, middle), (1.0, end)]
            } else {
                continue;
            };
            let share = locate(at, 1e-3 * OTHER_SLACK, bracket);
            if first.is_none_or(|(_, earliest)| share < earliest) {
                first = Some((leg, share));
            }
        }
        first
    }

    /// The first end of a mode within a step of `h` seconds from the state: whose, and at which share of the step.
    pub(super) fn find_event<const M: usize>(&self, h: f64) -> Option<(usize, f64)> {
        let attempt = &self.ask::<M>(h).attempt(&self.flow.machine.terminals());
        let begin = self.flow.margins(self.time(), &attempt.start);
        let middle = self.flow.margins(self.time() + h * 0.5, &attempt.dense(0.5));
        let end = self.flow.margins(self.time() + h, &attempt.end);
        let with_slack =
            |margins: [f64; MARGINS]| std::array::from_fn(|which| margins[which] + self.slack(which));
        let [begin, middle, end]: [[f64; MARGINS]; 3] = [begin, middle, end].map(with_slack);
        let mut first: Option<(usize, f64)> = None;
        for which in 0..MARGINS {
            let bracket = if middle[which] < 0.0 {
                [(0.0, begin[which]), (0.5, middle[which])]
            } else if end[which] < 0.0 {
                [(0.5, middle[which]), (1.0, end[which])]
            } else if let Some(low) = lowest_at(begin[which], middle[which], end[which])
                && let at_low = self.margin(attempt, which, low)
                && at_low < 0.0
            {
                // It dips and returns.
                let before = if low > 0.5 { (0.5, middle[which]) } else { (0.0, begin[which]) };
                [before, (low, at_low)]
            } else {
                continue;
            };
            // The rotor is put where the stop is: that must not move it by more than rounding.
            let close = match which {
                STOP => 0.1 * ANGLE_SLACK,
                MOTION => 1e-3 * self.motion_slack(),
                _ => 1e-3 * OTHER_SLACK,
            };
            let share = locate(|x| self.margin(attempt, which, x), close, bracket);
            if first.is_none_or(|(_, earliest)| share < earliest) {
                first = Some((which, share));
            }
        }
        first
    }

    /// Ends the mode whose margin reached zero and finds what follows.
    pub(super) fn handle_event(&mut self, which: usize) -> Result<(), RunError> {
        if which >= FLUX {
            self.flow.cross(which - FLUX);
            self.steps.motion_changed(&self.flow.machine, &self.flow.limits);
            return self.resolve();
        }
        if which == DOMAIN {
            self.probe.event(self.time(), Event::LeftMap);
            return Err(self.left_map());
        }
        if which == STOP || which == MOTION {
            self.change_motion(which);
            // What the rotor induces may have changed at once.
            return self.resolve();
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
        self.steps.motion_changed(&self.flow.machine, &self.flow.limits);
        self.here = None;
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

    /// Makes the currents of these legs zero, where the step has them zero up to its error.
    fn make_zero(&mut self, legs: [bool; 3]) {
        let machine = Machine { legs: Legs::blocked(legs), ..self.flow.machine };
        let terminals = machine.terminals();
        // One Newton step leaves the square of the error, the second nothing.
        for _ in 0..2 {
            let mut at = machine.operating(self.time(), &self.state);
            machine.settle(&terminals, &mut self.state, &mut at);
            self.here = Some(machine.port(&at));
        }
    }

    /// Finds the conduction modes that fit the gates and the state.
    pub(super) fn resolve(&mut self) -> Result<(), RunError> {
        let port = self.here();
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
        self.steps.legs_changed(&self.flow.machine, &self.flow.limits);
        Ok(())
    }
}

/// The share of a step at which a margin ends, just beyond zero by `close` at most: between two shares with their margins.
fn locate(margin: impl Fn(f64) -> f64, close: f64, bracket: [(f64, f64); 2]) -> f64 {
    // Regula falsi with the Illinois modification: as safe as bisection, and quick.
    let [(mut low, mut at_low), (mut high, mut at_high)] = bracket;
    at_low = at_low.max(0.0);
    let mut side = 0;
    for _ in 0..60 {
        if high - low < 1e-13 || at_high > -close {
            break;
        }
        // Aimed just beyond zero, where the search is to end, but no further than rounding needs.
        let middle = low + (high - low) * (at_low + 1e-3 * close) / (at_low - at_high);
        let middle = if middle > low && middle < high { middle } else { (low + high) / 2.0 };
        let value = margin(middle);
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
