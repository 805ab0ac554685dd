//! The rotor within a step: angle and speed, by the same rule as the flux.

use standstill_numeric::Wide;

use super::{Begin, Effect, Looked, Span, keep, keep_plane};
use crate::effect::play::Iron;
use crate::physics::legs::Conducting;
use crate::physics::links::hermite_area;
use crate::physics::machine::{Change, Rotors};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::two_derivative::Here;

/// The shares that count of an angle, and of what a speed makes of it within a step, that were put right at its end. For an
/// acceleration e^(−x s) the prediction is off by x²/24 and x²/6, what was put right by x³/720 and x⁴/720 while x is small. No step is
/// longer than the winding's time constant, so torque, of second order in the currents, has x of 2 at most; up to there the share is
/// at most 0.012 and 0.021. Eight and five times that, for torque that is no single exponential.
pub(crate) const SHARE_OF_ANGLE: f64 = 0.1;
/// See [`SHARE_OF_ANGLE`].
pub(crate) const SHARE_OF_SPEED: f64 = 0.1;

/// Rotors over a step.
#[derive(Clone, Copy, Debug)]
pub struct RotorStep<V> {
    /// Accelerations in rad/s² at both ends, and how they change, in rad/s³.
    pub acceleration: [V; 2],
    jerk: [V; 2],
    /// How fast the torque rises at both ends, in N·m/s.
    pub torque_rise: [V; 2],
    /// What the angle was put right by in rad, with what counts of the speed.
    correction: V,
}

impl<V: Wide> RotorStep<V> {
    /// Between two ends at which rotors accelerate so, in rad/s², and torques rise so, in N·m/s.
    pub fn between(acceleration: [V; 2], torque_rise: [V; 2]) -> Self {
        let zero = V::of(0.0);
        Self { acceleration, jerk: [zero; 2], torque_rise, correction: zero }
    }
}

impl<V: Wide> Effect<V> for Rotors<V> {
    type Step = RotorStep<V>;

    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) -> RotorStep<V> {
        let zero = V::of(0.0);
        let (h, half, here, state) = (begin.h, begin.h * 0.5, begin.here, &begin.here.state);
        let acceleration = self.acceleration(here.at.torque, state.speed);
        let iron = some!(begin.cells, cells => cells.iron_here(state.flux));
        let torque_rise = self.torque_rise(state, &here.at, begin.change, iron.as_ref());
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
    fn correct(
        &self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        change: &Change<V>,
        there: &mut Here<V>,
        step: &mut RotorStep<V>,
    ) {
        let (h, from, state) = (begin.h, &begin.here.state, &mut there.state);
        step.acceleration[1] = self.acceleration(there.at.torque, state.speed);
        let iron = some!(looked.iron, iron => Iron {
            current: iron.current + (state.flux - looked.flux).through(iron.tangent),
            ..iron
        });
        step.torque_rise[1] = self.torque_rise(state, &there.at, change, iron.as_ref());
        step.jerk[1] = self.jerk(step.torque_rise[1], step.acceleration[1]);
        let speed = from.speed + hermite_area(h, step.acceleration, step.jerk);
        let turned =
            from.turned + hermite_area(h, [from.speed * self.moving, speed * self.moving], step.acceleration);
        let [angle_error, speed_error] = [turned - state.turned, speed - state.speed];
        (state.turned, state.speed) = (turned, speed);
        there.at.current = there.at.current + there.at.turning * angle_error;
        // The speed acts on the flux through the holding voltage only; what it is off by within a step shows there.
        step.correction = angle_error.abs() + (speed_error * h).abs() * SHARE_OF_SPEED;
    }

    #[inline(always)]
    fn error(&self, step: &RotorStep<V>, accuracy: &Accuracy<V>) -> V {
        step.correction * SHARE_OF_ANGLE * accuracy.per_angle
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
}

impl<V: Wide> Rotors<V> {
    /// The torque where flux and current were put right from these.
    #[inline(always)]
    pub fn follow(&self, looked: &Looked<V>, from: [Plane<V>; 2], there: &mut Here<V>) {
        let change = [looked.core(from[0], from[1]), looked.core(there.state.flux, there.at.current)];
        there.at.torque = there.at.torque + self.torque_change(&there.at, change[0], change[1]);
    }

    /// The torque of what was put right last, and the motion that follows from it.
    #[inline(always)]
    pub fn finish(
        &self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        from: [Plane<V>; 2],
        there: &mut Here<V>,
        step: &mut RotorStep<V>,
    ) {
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
