//! A machine's place among others: its numbers, at rest.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Wide};
use standstill_plant::NoConvergence;

use super::run::Control;
use crate::case::{Case, RunError};
use crate::lanes::bank::Bank;
use crate::physics::gates::NEVER;
use crate::physics::plane::Plane;
use crate::step::error::REMEMBERED;

/// Why a machine cannot begin with the current that its iron is left with.
fn without_a_state(error: &NoConvergence) -> RunError {
    // Currents of a map are far below what i64 holds in mA.
    #[allow(clippy::cast_possible_truncation)]
    let milli = |current: f64| (current * 1e3).round() as i64;
    match error.beyond {
        Some(_) => RunError::LeftMap { current_ma: [milli(error.current.d), milli(error.current.q)] },
        None => RunError::NotFinite,
    }
}

impl<'a> Control<'a> {
    /// The machine at rest.
    pub(super) fn put<V: Wide>(&mut self, bank: &mut Bank<'a, V>) {
        let Case { motor, inverter, start_angle, load_torque, tolerance, .. } = &self.case;
        let (lane, motor, link, bridge) = (self.lane, *motor, inverter.link, inverter.bridge);
        bank.machine.put(lane, motor, &link, *start_angle, *load_torque);
        if let Some(sensed) = &mut bank.sensed {
            sensed.put(lane, &self.case.sensors);
        }
        let heading = Heading::of(*start_angle);
        let mut rest = motor.magnetics.rest(heading);
        let iron = motor.magnetics.hysteresis().zip(motor.magnetics.cells());
        if let (Some(play), Some((hysteresis, cells))) = (&mut bank.machine.cells, iron) {
            let last = self.case.memory.map(|last| Heading::of(last - start_angle));
            if let Some(last) = last {
                // No current flows: the core's is against what the iron is left with.
                let left = Dq::new(last.cos, last.sin) * -hysteresis.coercive_current;
                match motor.magnetics.flux_at(left, heading) {
                    Ok(flux) => rest = flux,
                    Err(error) => self.nowhere = Some(without_a_state(&error)),
                }
            }
            let inductance = motor.magnetics.inductance();
            let most = inductance.xx + inductance.yy - inductance.smaller_eigenvalue();
            let last = last.map(|last| Plane::new(last.cos, last.sin));
            play.put(lane, cells, Plane::new(rest.d, rest.q), most, tolerance.flux, last);
        }
        let put = |to: &mut V, from: f64| to.put(lane, from);
        let here = &mut bank.here;
        put(&mut here.time, 0.0);
        put(&mut here.state.flux.x, rest.d);
        put(&mut here.state.flux.y, rest.q);
        put(&mut here.state.turned, 0.0);
        put(&mut here.state.speed, 0.0);
        put(&mut here.state.lagging.d, rest.d);
        put(&mut here.state.lagging.q, rest.q);
        let accuracy = &mut bank.accuracy;
        let scale = motor.winding.mean_inductance * motor.rated_current;
        put(&mut accuracy.per_flux, 1.0 / tolerance.flux);
        put(&mut accuracy.per_angle, motor.magnet_flux.max(scale) / tolerance.flux);
        put(&mut accuracy.per_flux_scale, 1.0 / scale);
        let slowest = self.case.sensors.corner.iter().copied().fold(f64::INFINITY, f64::min);
        let [filtered, remembered] = match self.case.sensors.settings.bandwidth {
            Some(corner) => {
                let time_constant = 1.0 / (std::f64::consts::TAU * corner * slowest);
                [motor.winding.mean_inductance, REMEMBERED * time_constant * 1e9]
            }
            None => [0.0; 2],
        };
        put(&mut accuracy.filtered, filtered);
        put(&mut accuracy.remembered, remembered);
        put(&mut bank.hint, self.longest_step());
        put(&mut bank.longest, self.longest_step());
        bank.hints.iter_mut().for_each(|hint| put(hint, self.longest_step()));
        for counted in
            [&mut bank.refused, &mut bank.peak, &mut bank.moved, &mut bank.steps, &mut bank.evaluations]
        {
            put(counted, 0.0);
        }
        put(&mut bank.expected, NEVER);
        bank.to_mode_end &= !(1 << lane);
        bank.live |= 1 << lane;
        self.look(bank);
        let source = bank.machine.links.source_of(lane, 0.0);
        bank.here.state.link.put(lane, source.voltage);
        self.look_at_link(bank);
        bank.machine.legs.put_bridge(lane, &bridge);
        // Where equal leakages of both switches hold them.
        for potential in &mut bank.here.state.potential {
            potential.put(lane, source.voltage / 2.0);
        }
    }

    /// Longest step in ns: the winding's shorter time constant, beyond which values and slopes at both ends say so little of
    /// what is between that an error of zero may be an accident; a fraction of the ripple's period where a stored voltage
    /// or a filter follows it, and of a sag.
    fn longest_step(&self) -> f64 {
        let motor = self.case.motor;
        let winding = &motor.winding;
        let inductance = winding.d_axis_inductance().min(winding.q_axis_inductance());
        let decay = inductance / motor.resistance * 1e9;
        let link = &self.case.inverter.link;
        let follows = link.storage.is_some() || self.link_filter.is_some();
        let ripple = if follows && link.ripple != 0.0 { 0.125e9 / link.ripple_frequency } else { decay };
        let ripple = ripple.min(decay);
        link.sag.map_or(ripple, |sag| ripple.min(sag.duration * (1e9 / 64.0)))
    }
}
