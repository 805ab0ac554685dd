//! The rotor's motion: held, resting, sliding, and the stops of a brake's play.

use standstill_numeric::Wide;

use super::run::Control;
use crate::case::{Play, RotorState};
use crate::lanes::bank::Bank;
use crate::physics::bounds::{DOMAIN, FLUX, MOTION, STOP};
use crate::physics::motion::{Contact, Motion};
use crate::step::ends::CURRENT_SLACK;
use crate::trace::Event;

/// How far beyond zero a margin must be to count as crossed: flux in Wb, angle in rad, and speed in rad/s.
pub(super) const FLUX_SLACK: f64 = 1e-12;
const ANGLE_SLACK: f64 = 1e-12;
const SPEED_SLACK: f64 = 1e-6;

/// The same of the torque that starts a rotor: at most this share of its stiction, or of what rated current can do. There
/// are rotors that a micronewton metre starts.
const STICTION_SHARE: f64 = 1e-4;
const TORQUE_SHARE: f64 = 1e-9;

/// Whether a rotor can move at all.
pub fn can_move(rotor: RotorState) -> bool {
    match rotor {
        RotorState::Locked => false,
        RotorState::Free => true,
        RotorState::Braked(play) => play.below + play.above > 0.0,
    }
}

impl<'a> Control<'a> {
    /// The rotor at its start.
    pub(super) fn set_up_motion<V: Wide>(&mut self, bank: &mut Bank<'a, V>) {
        let case = &self.case;
        let torque = case.motor.cogging(case.start_angle) - case.load_torque;
        let resolve = |contact| Motion::resolve(&case.motor.rotor, 0.0, torque, contact);
        let motion = match case.rotor {
            _ if !can_move(case.rotor) => Motion::Held,
            RotorState::Braked(Play { above: 0.0, .. }) => resolve(Contact::Upper),
            RotorState::Braked(Play { below: 0.0, .. }) => resolve(Contact::Lower),
            RotorState::Locked | RotorState::Free | RotorState::Braked(_) => resolve(Contact::None),
        };
        let slack = &mut bank.bounds.slack;
        slack[DOMAIN].put(self.lane, CURRENT_SLACK);
        slack[STOP].put(self.lane, ANGLE_SLACK);
        slack[FLUX].put(self.lane, FLUX_SLACK);
        slack[FLUX + 1].put(self.lane, FLUX_SLACK);
        self.turn(bank, motion);
        self.set_sides(bank);
    }

    /// The slack of the rotor's motion: a torque in N·m while it rests, a speed in rad/s while it slides.
    fn motion_slack(&self) -> f64 {
        if self.motion.moves() {
            return SPEED_SLACK;
        }
        let motor = self.case.motor;
        let flux = motor.magnet_flux + motor.winding.mean_inductance * motor.rated_current;
        let torque = 1.5 * f64::from(motor.pole_pairs) * flux * motor.rated_current;
        SPEED_SLACK.min((STICTION_SHARE * motor.rotor.friction.stiction).max(TORQUE_SHARE * torque))
    }

    /// How far the rotor may turn from its start in rad, backwards (negative) and forwards.
    fn stops(&self) -> [f64; 2] {
        match self.case.rotor {
            RotorState::Braked(play) => [-play.below, play.above],
            RotorState::Locked | RotorState::Free => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// The rotor moves so from now on.
    fn turn<V: Wide>(&mut self, bank: &mut Bank<'a, V>, motion: Motion) {
        self.motion = motion;
        let lane = self.lane;
        let put = |to: &mut V, from: f64| to.put(lane, from);
        let rotor = &self.case.motor.rotor;
        put(&mut bank.bounds.slack[MOTION], self.motion_slack());
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

    /// Kinetic energy in J.
    pub(super) fn kinetic_energy<V: Wide>(&self, bank: &Bank<'a, V>) -> f64 {
        let motor = self.case.motor;
        let speed = bank.here.state.speed.get(self.lane) / f64::from(motor.pole_pairs);
        motor.rotor.inertia * speed * speed / 2.0
    }

    /// The rotor stopped, started, or ran into the end of the brake's play.
    pub(super) fn change_motion<V: Wide>(&mut self, bank: &mut Bank<'a, V>, stopped: bool) {
        let lane = self.lane;
        let mut contact = Contact::None;
        if stopped {
            self.impact_loss += self.kinetic_energy(bank);
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
