//! The rotor within a step: angle and speed, integrated by the same rule as the flux.

use standstill_interface::Dq;
use standstill_numeric::Wide;

use super::{Begin, BranchPoint, Effect, End, Looked, Moment, Span, keep, keep_plane};
use crate::case::{Case, RotorState};
use crate::ledger::Ledger;
use crate::physics::legs::Conducting;
use crate::physics::links::hermite_area;
use crate::physics::machine::Rotors;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::two_derivative::Here;

/// Share of the correction of the angle that counts as error of a step. [`SHARE_OF_SPEED`] is the share for the correction of
/// the speed, times the step's length. For an acceleration e^(−x s) with small x, the predictions of angle and speed err
/// by x²/24 and x²/6, the corrected values by x³/720 and x⁴/720. No step is longer than the winding's time constant, so
/// for torque, which is of second order in the currents, x is at most 2, and the ratios of the errors are at most 0.012
/// and 0.021. The constants are eight and five times these ratios, for torque that is not a single exponential.
pub(crate) const SHARE_OF_ANGLE: f64 = 0.1;
/// Share of the speed's correction, times the step's length, that counts as error of the angle: see [`SHARE_OF_ANGLE`].
pub(crate) const SHARE_OF_SPEED: f64 = 0.1;

/// Quantities of the rotors over a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct RotorStep<V> {
    /// Accelerations in rad/s² at both ends.
    pub acceleration: [V; 2],
    /// Time derivatives of the accelerations in rad/s³ at both ends.
    jerk: [V; 2],
    /// Time derivatives of the torque in N·m/s at both ends.
    pub torque_rise: [V; 2],
    /// Correction of the angle in rad plus the weighted correction of the speed: the rotor's error before its weight.
    correction: V,
}

impl<V: Wide> Effect<V> for Rotors<V> {
    type Step = RotorStep<V>;

    fn rest(&self, lane: usize, case: &Case<'_>, _: Dq<f64>, state: &mut State<V>) {
        state.turned.put(lane, 0.0);
        state.speed.put(lane, case.start_speed);
    }

    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> RotorStep<V> {
        let zero = V::of(0.0);
        let (h, half, here, state) = (begin.h, begin.h * 0.5, begin.here, &begin.here.state);
        let acceleration = self.acceleration(here.at.torque, state.speed);
        let branch = some!(begin.branch, branch => branch.at(state.flux, None));
        let torque_rise = self.torque_rise(state, &here.at, begin.change, branch.as_ref(), begin.short);
        let jerk = self.jerk(torque_rise, acceleration);
        there.state.speed = state.speed + h * (acceleration + half * jerk);
        there.state.turned =
            state.turned + h * (state.speed * self.moving + half * (acceleration + h * jerk * (1.0 / 3.0)));
        RotorStep {
            acceleration: [acceleration, zero],
            jerk: [jerk, zero],
            torque_rise: [torque_rise, zero],
            correction: zero,
        }
    }

    #[inline(always)]
    fn correct(&self, end: &End<'_, '_, V>, there: &mut Here<V>, step: &mut RotorStep<V>) {
        let (h, from, state) = (end.begin.h, &end.begin.here.state, &mut there.state);
        step.acceleration[1] = self.acceleration(there.at.torque, state.speed);
        let branch = some!(end.looked.branch, branch => BranchPoint {
            current: branch.current_after(state.flux - end.looked.flux),
            ..branch
        });
        step.torque_rise[1] =
            self.torque_rise(state, &there.at, end.change, branch.as_ref(), end.begin.short);
        step.jerk[1] = self.jerk(step.torque_rise[1], step.acceleration[1]);
        let speed = from.speed + hermite_area(h, step.acceleration, step.jerk);
        let turned =
            from.turned + hermite_area(h, [from.speed * self.moving, speed * self.moving], step.acceleration);
        let [angle_error, speed_error] = [turned - state.turned, speed - state.speed];
        (state.turned, state.speed) = (turned, speed);
        there.at.current = there.at.current + there.at.turning * angle_error;
        // An error of the speed within the step acts on the flux only through the voltage that holds blocked legs' currents at zero.
        step.correction = angle_error.abs() + (speed_error * h).abs() * SHARE_OF_SPEED;
    }

    #[inline(always)]
    fn error(&self, step: &RotorStep<V>, accuracy: &Accuracy<V>) -> V {
        step.correction * SHARE_OF_ANGLE * accuracy.per_angle
    }

    fn between(&self, end: &End<'_, '_, V>, there: &Here<V>) -> RotorStep<V> {
        let here = end.begin.here;
        let first = some!(end.begin.branch, branch => branch.at(here.state.flux, None));
        RotorStep {
            acceleration: [here, there].map(|at| self.acceleration(at.at.torque, at.state.speed)),
            torque_rise: [
                self.torque_rise(&here.state, &here.at, end.begin.change, first.as_ref(), end.begin.short),
                self.torque_rise(
                    &there.state,
                    &there.at,
                    end.change,
                    end.looked.branch.as_ref(),
                    end.begin.short,
                ),
            ],
            ..RotorStep::default()
        }
    }

    #[inline(always)]
    fn within(&self, span: &Span<'_, '_, V>, there: &mut Here<V>) {
        let Some(step) = &span.step.rotor else { return };
        let (from, to) = (&span.from.state, &span.step.end.state);
        let speeds = span.cubic([from.speed, to.speed], step.acceleration);
        there.state.speed = speeds.at(span.share);
        there.state.turned = from.turned + speeds.area(span.share) * span.step.h * self.moving;
    }

    #[inline(always)]
    fn slope(&self, _: &Conducting<V>, here: &Here<V>, slope: &mut State<V>) {
        slope.turned = here.state.speed * self.moving;
        slope.speed = self.acceleration(here.at.torque, here.state.speed);
    }

    #[inline(always)]
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>) {
        keep(of, from.state.turned, &mut to.state.turned);
        keep(of, from.state.speed, &mut to.state.speed);
        keep_plane(of, from.at.turning, &mut to.at.turning);
        keep_plane(of, from.at.energy_turn, &mut to.at.energy_turn);
        keep(of, from.at.energy_bend, &mut to.at.energy_bend);
        keep(of, from.at.torque, &mut to.at.torque);
        keep(of, from.at.cogging_slope, &mut to.at.cogging_slope);
    }

    fn energy(&self, moment: &Moment<'_, '_, V>, stored: &mut Ledger) {
        let motor = moment.case.motor;
        let speed = moment.one(&moment.here.state.speed) / f64::from(motor.pole_pairs);
        stored.kinetic_change += motor.rotor.inertia * speed * speed / 2.0;
    }

    fn power(&self, moment: &Moment<'_, '_, V>, _: &Span<'_, '_, V>, powers: &mut Ledger) {
        let (motor, at) = (moment.case.motor, &moment.here.at);
        let speed = moment.one(&moment.here.state.speed) / f64::from(motor.pole_pairs);
        powers.shaft_work += moment.one(&at.torque) * speed;
        powers.friction_loss += moment.motion.friction(&motor.rotor, speed) * speed;
        powers.load_work += moment.one(&self.load) * speed;
        if moment.case.rotor == RotorState::Driven {
            // The outside drive absorbs all work of the motor, and supplies friction and the acceleration of the rotor's inertia.
            let inert = motor.rotor.inertia * moment.case.acceleration / f64::from(motor.pole_pairs);
            let left = moment.one(&at.torque) - moment.one(&self.load) - inert;
            powers.load_work += left * speed - moment.motion.friction(&motor.rotor, speed) * speed;
        }
    }
}

impl<V: Wide> Rotors<V> {
    /// Updates the torque after flux and current have changed from the values `from` to those of `there`.
    #[inline(always)]
    pub fn follow(&self, looked: &Looked<V>, from: [Plane<V>; 2], there: &mut Here<V>) {
        let change = looked.cores(from, there);
        there.at.torque = there.at.torque + self.torque_change(&there.at, change[0], change[1]);
    }

    /// Updates the torque after the last corrections of flux and current, and from it speed and angle.
    #[inline(always)]
    pub fn finish(
        &self,
        end: &End<'_, '_, V>,
        from: [Plane<V>; 2],
        there: &mut Here<V>,
        step: &mut RotorStep<V>,
    ) {
        let End { begin, looked, .. } = end;
        let (h, before) = (begin.h, &begin.here.state);
        self.follow(looked, from, there);
        step.acceleration[1] = self.acceleration(there.at.torque, there.state.speed);
        there.state.speed = before.speed + hermite_area(h, step.acceleration, step.jerk);
        let speeds = [before.speed * self.moving, there.state.speed * self.moving];
        let turned = before.turned + hermite_area(h, speeds, step.acceleration);
        there.at.current = there.at.current + there.at.turning * (turned - there.state.turned);
        there.state.turned = turned;
        looked.settle(begin.legs, there);
    }
}
