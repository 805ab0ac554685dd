//! What ends within a step: changes of conduction and of motion, and the state that follows.

use standstill_interface::{AlphaBeta, Phase};
use standstill_inverter::Conduction;
use standstill_plant::Heading;

use super::Rig;
use crate::case::RunError;
use crate::flow::{DOMAIN, FLUX, MARGINS, MOTION, STOP};
use crate::integrator::Attempt;
use crate::motion::{Contact, Motion};
use crate::step::Trial;
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

impl<const N: usize, P: Probe> Rig<'_, N, P> {
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
        if which < MOTION && self.flow.modes()[which] != Conduction::Blocked {
            let current = self.flow.operating(t, &y).port.current[which];
            return self.flow.modes()[which].direction() * current + CURRENT_SLACK;
        }
        self.flow.margins(t, &y)[which] + self.slack(which)
    }

    /// The first end of a mode within the step: whose, and at which share of the step.
    ///
    /// The margins are looked at in the middle and at the end. What dips below zero and returns within half a
    /// step is smaller than the step's tolerance allows to matter.
    pub(super) fn find_event<const M: usize>(&self, trial: &Trial<M>) -> Option<(usize, f64)> {
        let attempt = &trial.attempt;
        let end = self.flow.margins_at(&trial.end.operating, trial.end.potentials, &attempt.end);
        let middle =
            self.flow.margins_at(&trial.middle.operating, trial.middle.potentials, &trial.middle_state);
        let holds = |margins: &[f64; MARGINS]| margins.iter().all(|margin| *margin >= 0.0);
        if holds(&middle) && holds(&end) {
            return None;
        }
        let with_slack =
            |margins: [f64; MARGINS]| std::array::from_fn(|which| margins[which] + self.slack(which));
        let [middle, end]: [[f64; MARGINS]; 2] = [middle, end].map(with_slack);
        let mut first: Option<(usize, f64)> = None;
        for which in 0..MARGINS {
            let bracket = if middle[which] < 0.0 {
                [(0.0, self.margin(attempt, which, 0.0)), (0.5, middle[which])]
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
    fn locate<const M: usize>(&self, attempt: &Attempt<M>, which: usize, bracket: [(f64, f64); 2]) -> f64 {
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
            // Aimed just beyond zero, where the search is to end, but no further than rounding needs.
            let middle = low + (high - low) * (at_low + 1e-3 * close) / (at_low - at_high);
            let middle = if middle > low && middle < high { middle } else { (low + high) / 2.0 };
            let value = self.margin(attempt, which, middle);
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

    /// Ends the mode whose margin reached zero and finds what follows.
    pub(super) fn handle_event(&mut self, which: usize) -> Result<(), RunError> {
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
        (self.here, self.slope) = (None, None);
        let torque = self.here().torque - self.flow.machine.load_torque;
        let motion = Motion::resolve(&self.case.motor.rotor, self.state[3], torque, contact);
        self.flow.turn(motion, self.state[2]);
        (self.here, self.slope) = (None, None);
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
    pub(super) fn project(&mut self) {
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
            let at = self.here();
            if at.current.norm() < 1e-15 {
                break;
            }
            (self.here, self.slope) = (None, None);
            let excess = at.port.inverse_inductance.inverse().times(at.current);
            self.state[0] -= excess.alpha;
            self.state[1] -= excess.beta;
        }
    }

    /// Moves the flux as a voltage impulse at terminal `k` would, until that phase's current is zero.
    fn project_leg(&mut self, k: usize) {
        for _ in 0..3 {
            let port = self.here().port;
            if port.current[k].abs() < 1e-15 {
                break;
            }
            (self.here, self.slope) = (None, None);
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
        let port = self.here().port;
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
