//! Writes one machine's parameters and its state at rest into its lane of the bank.

use standstill_numeric::{Heading, Wide};

use super::run::Control;
use crate::Broken;
use crate::case::{Case, RotorState};
use crate::effect::{Effect, each_effect};
use crate::lanes::bank::Bank;
use crate::physics::gates::NEVER;
use crate::step::error::REMEMBERED;

impl<'a> Control<'a> {
    /// Writes the case's machine, at rest, into its lane. Returns whether the play cells of the iron make a torque at rest.
    pub(super) fn put<V: Wide>(&mut self, bank: &mut Bank<'a, V>) -> bool {
        let Case { motor, inverter, start_angle, load_torque, .. } = &self.case;
        let lane = self.lane;
        let faults = &self.case.faults;
        bank.machine.legs.put_wires(lane, faults.wires());
        bank.machine.put(lane, motor, &inverter.link, *start_angle, *load_torque);
        if let (Some(rotors), RotorState::Driven) = (&mut bank.machine.rotors, self.case.rotor) {
            rotors.drive(lane, self.case.acceleration);
        }
        bank.machine.legs.put_bridge(lane, &inverter.bridge);
        bank.machine.legs.put_load(lane, self.case.sensors.settings.load());
        (0..3).filter(|k| faults.concern_gates(*k)).for_each(|k| self.sequencer.may_lose(k));
        if let Some(sensed) = &mut bank.sensed {
            sensed.put(lane, &self.case.sensors);
        }
        let mut flux = motor.magnetics.rest(Heading::of(*start_angle));
        let mut pulls = false;
        if let Some(branch) = &mut bank.machine.branch {
            match branch.start(lane, &self.case, &mut flux) {
                Ok(found) => pulls = found,
                Err(error) => self.nowhere = Some(error),
            }
        }
        let (machine, here) = (&bank.machine, &mut bank.here);
        here.time.put(lane, 0.0);
        each_effect!(machine, machine.branch.as_ref(), effect => effect.rest(lane, &self.case, flux, &mut here.state));
        machine.links.look(lane, here);
        self.put_steps(bank);
        bank.look(lane);
        pulls
    }

    /// Sets the tolerance and the first length of the machine's steps in its lane, and its counters to zero.
    fn put_steps<V: Wide>(&self, bank: &mut Bank<'a, V>) {
        let Case { motor, tolerance, sensors, .. } = &self.case;
        let (lane, longest) = (self.lane, self.longest_step());
        let put = |to: &mut V, from: f64| to.put(lane, from);
        let control = &mut bank.control;
        let scale = motor.winding.mean_inductance * motor.rated_current;
        put(&mut control.accuracy.per_flux, 1.0 / tolerance.flux);
        put(&mut control.accuracy.per_angle, motor.magnet_flux.max(scale) / tolerance.flux);
        put(&mut control.accuracy.per_flux_scale, 1.0 / scale);
        let slowest = sensors.corner.iter().copied().fold(f64::INFINITY, f64::min);
        let divided = sensors.settings.terminal.and_then(|of| of.bandwidth).unwrap_or(f64::INFINITY);
        let [filtered, remembered] = match sensors.settings.bandwidth {
            Some(corner) => {
                let time_constant = 1.0 / (std::f64::consts::TAU * (corner * slowest).min(divided));
                [motor.winding.mean_inductance, REMEMBERED * time_constant * 1e9]
            }
            None => [0.0; 2],
        };
        put(&mut control.accuracy.filtered, filtered);
        put(&mut control.accuracy.remembered, remembered);
        put(&mut control.next, longest);
        put(&mut control.longest, longest);
        control.next_by_floating.iter_mut().for_each(|next| put(next, longest));
        put(&mut control.refused, 0.0);
        let outcome = &mut bank.outcome;
        for counted in [&mut outcome.peak, &mut outcome.moved, &mut outcome.steps, &mut outcome.evaluations] {
            put(counted, 0.0);
        }
        put(&mut bank.schedule.expected, NEVER);
        bank.schedule.to_mode_end &= !(1 << lane);
        bank.schedule.live |= 1 << lane;
    }

    /// Returns the longest step in ns: the minimum of the winding's shorter time constant, an eighth of the ripple's period (if a
    /// capacitor or a filter follows the ripple), and 1/64 of a sag's duration. In a step longer than the time constant, values
    /// and slopes at both ends do not determine the values between them, and the error estimate may be zero by accident.
    fn longest_step(&self) -> f64 {
        let motor = self.case.motor;
        let winding = &motor.winding;
        let inductance = winding.d_axis_inductance().min(winding.q_axis_inductance());
        let contact = self.case.faults.iter().map(|fault| match fault.broken {
            Broken::Contact(_, resistance) => resistance,
            _ => 0.0,
        });
        let decay = inductance / (motor.resistance + contact.fold(0.0, f64::max)) * 1e9;
        let link = &self.case.inverter.link;
        let Case { sensors, inverter, .. } = &self.case;
        let divides = sensors.settings.divides(inverter.bridge.terminal_capacitance > 0.0);
        let follows = link.storage.is_some() || self.link_filter.is_some() || divides;
        let ripple = if follows && link.ripple != 0.0 { 0.125e9 / link.ripple_frequency } else { decay };
        let ripple = ripple.min(decay);
        link.sag.map_or(ripple, |sag| ripple.min(sag.duration * (1e9 / 64.0)))
    }
}
