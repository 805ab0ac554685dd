//! Machines side by side: each steps to its own next instant or to the end of one of its modes.

mod stepping;

use standstill_interface::Dq;
use standstill_inverter::Inverter;
use standstill_numeric::{Compute, MOST_LANES, Mask, Symmetric, Wide};
use standstill_plant::Motor;

use self::stepping::{StepOf, take};
use crate::case::RunError;
use crate::effect::play::Cells;
use crate::guard::{Bounds, Guard};
use crate::physics::gates::NEVER;
use crate::physics::machine::{Machine, Operating};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::sensing::{Sensed, SensorSettings};
use crate::step::error::Accuracy;
use crate::step::two_derivative::{Here, Tried};
use standstill_inverter::Source;

/// Machines of one kind, what they do until when, and what became of it.
#[derive(Clone, Debug)]
pub struct Bank<'a, V: Wide> {
    /// The machines.
    pub machine: Machine<'a, V>,
    /// What ends their modes.
    pub bounds: Bounds<V>,
    /// Where they are.
    pub here: Here<V>,
    /// How exact their steps must be.
    pub accuracy: Accuracy<V>,
    /// A bit for each machine that steps.
    pub live: u32,
    /// The next instant of each in ns, gate edges apart.
    pub stop: V,
    /// When the sensors of each are read next, or their command ends, in ns.
    pub sample: V,
    /// Length of the step to try next, and of the longest one, in ns.
    pub hint: V,
    /// See `hint`.
    pub longest: V,
    /// The hint where no leg's terminal floated last, one, two, and all: what rings needs shorter steps than what flows.
    pub hints: [V; 4],
    /// A bit for each machine of which a mode ends at `mode_end`.
    pub to_mode_end: u32,
    /// In ns.
    pub mode_end: V,
    /// A bit for each machine that cannot come nearer to it: between `mode_end` and the number before it the mode ends.
    pub nearest: u32,
    /// Its guard; none: a margin was negative by rounding only.
    pub ending_mode: [Option<Guard>; MOST_LANES],
    /// When a current is expected to have carried a terminal to its bound, in ns, and of which leg.
    pub expected: V,
    /// See `expected`.
    pub carried: [usize; MOST_LANES],
    /// A bit for each machine that expected so when its legs last conducted otherwise.
    pub swept: u32,
    /// Largest phase current in A so far.
    pub peak: V,
    /// Furthest from the start in rad so far.
    pub moved: V,
    /// Steps in a row that were not taken.
    pub refused: V,
    /// Accepted steps, and all.
    pub steps: V,
    /// See `steps`.
    pub evaluations: V,
    /// Sensors that remember what was before.
    pub sensed: Option<Sensed<V>>,
    /// Whether steps are looked at from within: `begin` and `tried` are then those of the last.
    pub follow: bool,
    /// Whether the referee takes the steps of a machine alone.
    pub refereed: bool,
    /// Where the last step began.
    pub begin: Here<V>,
    /// What the iron remembered there.
    pub begin_cells: Option<Cells<V>>,
    /// The last step.
    pub tried: Tried<V>,
    /// What became of it. Read number by number: what was stored in small pieces and is loaded in a large one would have to wait
    /// for all that was stored before.
    pub served: Served,
}

/// What became of a step: a bit for each machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Served {
    /// Took the step.
    pub accepted: u32,
    /// Is at its next instant, or where a mode ends.
    pub arrived: u32,
    /// A blocked leg's potential was out of its bounds before the step.
    pub out_of_bounds: u32,
    /// Changes too fast for any step, or is no number.
    pub broken: u32,
    /// Of those, who changes no faster than steps can follow, but is beyond the end of a mode in each.
    pub stuck: u32,
    /// A request to a leg has been carried out: the next one is wanted.
    pub carried_out: [u32; 3],
    /// A mode ends within the step.
    crossed: u32,
}

impl<'a, V: Wide> Bank<'a, V> {
    /// For machines of the kind of this one, on this kind of inverter; `free`: whether rotors can move, `follow`: whether steps
    /// are looked at from within.
    pub fn like(
        motor: &'a Motor,
        inverter: &Inverter,
        sensors: &SensorSettings,
        free: bool,
        follow: bool,
    ) -> Self {
        use standstill_plant::Magnetics;
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let (plane, dq) = (Plane::new(zero, zero), Dq::new(zero, zero));
        let machine = Machine::like(motor, inverter, free);
        let rest =
            State { flux: plane, turned: zero, speed: zero, link: zero, lagging: dq, potential: [zero; 3] };
        let at = Operating {
            current: plane,
            inverse_inductance: Symmetric::new(one, zero, one),
            turning: plane,
            relaxing: plane,
            energy_turn: plane,
            energy_bend: zero,
            torque: zero,
            cogging_slope: zero,
            core_flux: dq,
            core_current: dq,
            lag: dq,
        };
        let here = Here { time: zero, state: rest, at, source: Source { voltage: zero, rise: zero } };
        let bounds = Bounds::new(motor.magnetics.core().kinks() != [false; 2]);
        let accuracy =
            Accuracy { per_flux: one, per_angle: one, per_flux_scale: one, filtered: zero, remembered: zero };
        let legs = machine.legs.at::<true>(zero, zero);
        let tried = Tried::none(&here, legs);
        Self {
            machine,
            bounds,
            begin: here,
            begin_cells: None,
            here,
            accuracy,
            live: 0,
            stop: zero,
            sample: zero,
            hint: zero,
            longest: zero,
            hints: [zero; 4],
            to_mode_end: 0,
            mode_end: zero,
            nearest: 0,
            ending_mode: [None; MOST_LANES],
            expected: V::of(NEVER),
            carried: [0; MOST_LANES],
            swept: 0,
            peak: zero,
            moved: zero,
            refused: zero,
            steps: zero,
            evaluations: zero,
            sensed: Sensed::like(sensors, legs),
            follow,
            refereed: false,
            tried,
            served: Served::default(),
        }
    }

    /// Tries a step of each machine that is live. Where a mode ends within it, the next one will end there.
    pub fn step(&mut self) {
        if self.machine.legs.elastance.is_some() || self.machine.cells.is_some() || self.refereed {
            V::compute(StepOf::<_, true>(self));
        } else {
            V::compute(StepOf::<_, false>(self));
        }
        if let Some(sensed) = &mut self.sensed {
            sensed.follow(&self.machine.legs.axes);
        }
        let mut left = self.served.crossed;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            self.find_end(lane);
        }
    }

    /// Lets `h` seconds pass for the sensors of a lane in which nothing happens.
    pub fn rest_sensors(&mut self, lane: usize, h: f64) {
        if self.sensed.is_some() {
            V::compute(RestOf(self, 1 << lane, h));
        }
    }

    /// Why a machine is broken.
    pub fn why_broken(&self, lane: usize) -> RunError {
        if self.served.stuck >> lane & 1 == 1 { RunError::Stuck } else { RunError::NotFinite }
    }

    /// Evaluates a machine anew at its state.
    pub fn look(&mut self, lane: usize) {
        V::compute(LookAt(self, 1 << lane));
    }

    /// The machines at a share of the step taken last.
    pub fn within(&self, share: f64) -> Here<V> {
        V::compute(Within(self, share))
    }
}

/// Machines evaluated anew at their states: a bit for each.
struct LookAt<'b, 'a, V: Wide>(&'b mut Bank<'a, V>, u32);

impl<V: Wide> Compute for LookAt<'_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let here = &self.0.here;
        let iron = self.0.machine.cells.as_ref().map(|cells| cells.iron_here(here.state.flux));
        let at = self.0.machine.operating(&here.state, iron.as_ref());
        let there = Here { time: here.time, state: here.state, at, source: here.source };
        let bank = self.0;
        if let (Some(cells), Some(iron)) = (&mut bank.machine.cells, &iron) {
            cells.set_tangent(V::Mask::of_bits(self.1), iron.tangent);
        }
        take(&bank.machine, true, &mut bank.here, &there, V::Mask::of_bits(self.1));
    }
}

/// Machines whose sensors rest for a time in s: a bit for each.
struct RestOf<'b, 'a, V: Wide>(&'b mut Bank<'a, V>, u32, f64);

impl<V: Wide> Compute for RestOf<'_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let Self(bank, which, h) = self;
        let legs = bank.machine.legs.at::<false>(bank.here.time, bank.machine.resistance);
        if let Some(sensed) = &mut bank.sensed {
            sensed.rest(V::Mask::of_bits(which), V::of(h), &legs);
        }
    }
}

/// Machines at a share of the step taken last.
struct Within<'b, 'a, V: Wide>(&'b Bank<'a, V>, f64);

impl<V: Wide> Compute for Within<'_, '_, V> {
    type Output = Here<V>;

    #[inline(always)]
    fn compute(self) -> Here<V> {
        let Self(bank, share) = self;
        bank.tried.within(&bank.machine, &bank.begin, bank.begin_cells.as_ref(), V::of(share))
    }
}

#[cfg(test)]
mod tests;
