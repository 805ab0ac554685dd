//! Changes of the rotor's motion in a run: it starts, stops, or reaches a stop of its brake's play.

use standstill_numeric::Wide;
use standstill_plant::Motor;

use super::run::Control;
use crate::case::{Case, Play, RotorState};
use crate::lanes::bank::Bank;
use crate::physics::motion::{Contact, Motion};
use crate::trace::Event;

/// Tolerance of a current as a share of the rated current: the margin of a leg or of a map must be this far below zero
/// to count as crossed.
const CURRENT_SHARE: f64 = 1.25e-11;
/// Tolerance of a blocked leg's potential, as a share of the link's voltage.
const POTENTIAL_SHARE: f64 = 2e-9;
/// Tolerance of the flux, as a share of mean inductance times rated current.
const FLUX_SHARE: f64 = 1.25e-11;
/// Tolerance of the angle in rad.
const ANGLE_SLACK: f64 = 1e-12;
/// Tolerance of the speed in rad/s, and upper limit in N·m of the tolerance of the torque that starts a rotor, because some
/// rotors start at torques of about 1 µN·m.
const SPEED_SLACK: f64 = 1e-6;

/// Tolerance of the torque that starts a rotor, as a share of its stiction. The larger one of this tolerance and
/// the tolerance by [`TORQUE_SHARE`] applies.
const STICTION_SHARE: f64 = 1e-4;
/// Tolerance of the torque that starts a rotor, as a share of the torque at rated current.
const TORQUE_SHARE: f64 = 1e-9;

/// Returns the flux in Wb by which ψ_d or ψ_q must have passed zero, where the core has a kink, to count as on the other side.
pub(super) fn flux_slack(motor: &Motor) -> f64 {
    FLUX_SHARE * motor.winding.mean_inductance * motor.rated_current
}

/// Returns the magnitude in A up to which a current may be set to zero at the end of its mode: ten times the larger of two
/// values. The first is the error of a step, because the end was located on the cubic of a longer step. The second is
/// the tolerance of the guard, because the end is located at half of this tolerance.
fn ended(case: &Case) -> f64 {
    let winding = &case.motor.winding;
    let least = winding.d_axis_inductance().min(winding.q_axis_inductance());
    10.0 * (case.tolerance.flux / least).max(CURRENT_SHARE * case.motor.rated_current)
}

/// Returns the end of the brake's play that a rotor in this motion touches.
fn touched(motion: Motion) -> Contact {
    match motion {
        Motion::AtUpper => Contact::Upper,
        Motion::AtLower => Contact::Lower,
        _ => Contact::None,
    }
}

/// Returns whether a rotor can move at all.
pub fn can_move(rotor: RotorState) -> bool {
    match rotor {
        RotorState::Locked => false,
        RotorState::Free | RotorState::Driven => true,
        RotorState::Braked(play) => play.below + play.above > 0.0,
    }
}

impl<'a> Control<'a> {
    /// Sets the rotor's initial motion. `pulled` is true if the play cells of the iron make a torque at the initial
    /// position, in addition to cogging.
    pub(super) fn set_up_motion<V: Wide>(&mut self, bank: &mut Bank<'a, V>, pulled: bool) {
        let case = &self.case;
        let cogging = case.motor.cogging(case.start_angle);
        let torque = if pulled { bank.here.at.torque.get(self.lane) } else { cogging } - case.load_torque;
        let speed = case.start_speed;
        let resolve = |contact| Motion::resolve(&case.motor.rotor, speed, torque, contact);
        let motion = match case.rotor {
            _ if !can_move(case.rotor) => Motion::Held,
            // A driven rotor moves whatever friction and torque are.
            RotorState::Driven => Motion::Floating,
            RotorState::Braked(Play { above: 0.0, .. }) => resolve(Contact::Upper),
            RotorState::Braked(Play { below: 0.0, .. }) => resolve(Contact::Lower),
            RotorState::Locked | RotorState::Free | RotorState::Braked(_) => resolve(Contact::None),
        };
        let slack = &mut bank.bounds.slack;
        let [a, b, c] = &mut slack.leg;
        for of_current in [a, b, c, &mut slack.domain] {
            of_current.put(self.lane, CURRENT_SHARE * case.motor.rated_current);
        }
        slack.blocked.put(self.lane, POTENTIAL_SHARE * case.inverter.link.voltage);
        bank.bounds.ended.put(self.lane, ended(case));
        let slack = &mut bank.bounds.slack;
        slack.stop.put(self.lane, ANGLE_SLACK);
        slack.kink.iter_mut().for_each(|slack| slack.put(self.lane, flux_slack(case.motor)));
        self.turn(bank, motion);
        self.set_sides(bank);
    }

    /// Returns the tolerance of the motion's guard: a torque in N·m while the rotor rests, a speed in rad/s while it
    /// slides.
    fn motion_slack(&self) -> f64 {
        if self.motion.moves() {
            return SPEED_SLACK;
        }
        let motor = self.case.motor;
        let flux = motor.magnet_flux + motor.winding.mean_inductance * motor.rated_current;
        let torque = 1.5 * f64::from(motor.pole_pairs) * flux * motor.rated_current;
        SPEED_SLACK.min((STICTION_SHARE * motor.rotor.friction.stiction).max(TORQUE_SHARE * torque))
    }

    /// Returns the angles in rad from the initial position of the backward stop (negative) and of the forward stop.
    fn stops(&self) -> [f64; 2] {
        match self.case.rotor {
            RotorState::Braked(play) => [-play.below, play.above],
            RotorState::Locked | RotorState::Free | RotorState::Driven => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// Sets the rotor's motion from now on.
    fn turn<V: Wide>(&mut self, bank: &mut Bank<'a, V>, motion: Motion) {
        self.motion = motion;
        let lane = self.lane;
        let put = |to: &mut V, from: f64| to.put(lane, from);
        let rotor = &self.case.motor.rotor;
        put(&mut bank.bounds.slack.motion, self.motion_slack());
        for (to, from) in bank.bounds.motion.iter_mut().zip(motion.limits(rotor, self.case.load_torque)) {
            put(to, from);
        }
        for (to, from) in bank.bounds.stops.iter_mut().zip(motion.way(self.stops())) {
            put(to, from);
        }
        if let Some(rotors) = &mut bank.machine.rotors {
            put(&mut rotors.moving, f64::from(u8::from(motion.moves())));
            put(&mut rotors.dry_friction, motion.friction(rotor, 0.0));
        }
    }

    /// Changes the rotor's motion after it stopped, started, or ran into an end of the brake's play (`stopped`).
    pub(super) fn change_motion<V: Wide>(&mut self, bank: &mut Bank<'a, V>, stopped: bool) {
        let lane = self.lane;
        // A rotor at a stop whose torque is below its stiction by less than the tolerance must not move into the stop.
        let mut contact = touched(self.motion);
        if stopped {
            if V::ALONE
                && let Some(mut accounts) = self.accounts.take()
            {
                accounts.spent.impact_loss += self.moment(bank, &bank.here).energies().kinetic_change;
                self.accounts = Some(accounts);
            }
            let [lower, upper] = self.stops();
            let turned = bank.here.state.turned.get(lane);
            let ahead = upper - turned < turned - lower;
            let stop;
            (contact, stop) = if ahead { (Contact::Upper, upper) } else { (Contact::Lower, lower) };
            bank.here.state.turned.put(lane, stop);
            bank.look(lane);
        }
        if stopped || matches!(self.motion, Motion::Forward | Motion::Backward) {
            bank.here.state.speed.put(lane, 0.0);
        }
        let torque = bank.here.at.torque.get(lane) - self.case.load_torque;
        let speed = bank.here.state.speed.get(lane);
        let motion = Motion::resolve(&self.case.motor.rotor, speed, torque, contact);
        self.turn(bank, motion);
        let time = self.time(bank);
        self.event(time * 1e-9, Event::Motion(motion));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_rotor_at_a_stop_does_not_leave_it_into_the_stop() {
        let motor = standstill_plant::built_in("gearless-hoist").expect("built in");
        let mut rotor = motor.rotor;
        rotor.friction.stiction = 0.3;
        // The torque falls short of the stiction by less than the slack.
        let torque = 0.3 * (1.0 - 1e-9);
        for (stop, away) in [(Motion::AtUpper, -torque), (Motion::AtLower, torque)] {
            assert_eq!(Motion::resolve(&rotor, 0.0, away, touched(stop)), stop);
        }
        assert_eq!(touched(Motion::Forward), Contact::None);
    }
}
