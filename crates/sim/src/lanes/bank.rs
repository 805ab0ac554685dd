//! Machines side by side: each steps to its own next instant or to the end of one of its modes.

mod stepping;

use standstill_inverter::{Inverter, Source};
use standstill_numeric::{Compute, MOST_LANES, Mask, Symmetric, Wide};
use standstill_plant::{Magnetics, Motor};

use self::stepping::{StepOf, take};
use super::lanes_of;
use crate::case::RunError;
use crate::effect::{Branch, CoreBranch, Span};
use crate::guard::{Bounds, Guard};
use crate::physics::gates::NEVER;
use crate::physics::machine::{Machine, Operating};
use crate::physics::state::State;
use crate::sensing::{Sensed, SensorSettings};
use crate::step::error::Accuracy;
use crate::step::two_derivative::{Here, Tried};

/// Machines of one kind: where they are, until when they step, how long their steps are, and what became of the last.
#[derive(Clone, Debug)]
pub struct Bank<'a, V: Wide> {
    /// The machines.
    pub machine: Machine<'a, V>,
    /// The ends of their modes.
    pub bounds: Bounds<V>,
    /// Where they are.
    pub here: Here<V>,
    /// Sensors with a state.
    pub sensed: Option<Sensed<V>>,
    /// Until when they step.
    pub schedule: Schedule<V>,
    /// How long their steps are.
    pub control: StepControl<V>,
    /// Results of their steps.
    pub outcome: Outcome<V>,
}

/// Instants at which steps end.
#[derive(Clone, Debug)]
pub struct Schedule<V> {
    /// A bit for each machine that steps.
    pub live: u32,
    /// The next instant of each in ns, gate edges apart.
    pub stop: V,
    /// When the sensors of each are read next, or their command ends, in ns.
    pub sample: V,
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
}

/// Length and error of steps.
#[derive(Clone, Debug, Default)]
pub struct StepControl<V: Wide> {
    /// How exact steps must be.
    pub accuracy: Accuracy<V>,
    /// Length of the step to try next, and of the longest one, in ns.
    pub next: V,
    /// See `next`.
    pub longest: V,
    /// The next length where no leg's terminal floated last, one, two, and all: terminals that ring need shorter steps than currents that
    /// flow.
    pub next_by_floating: [V; 4],
    /// Steps in a row that were not taken.
    pub refused: V,
    /// Whether steps are looked at from within: `begin` and `tried` of the outcome are then those of the last.
    pub follow: bool,
    /// Whether the referee takes the steps of a machine alone.
    pub refereed: bool,
}

/// Results of steps.
#[derive(Clone, Debug)]
pub struct Outcome<V: Wide> {
    /// Largest phase current in A so far.
    pub peak: V,
    /// Furthest from the start in rad so far.
    pub moved: V,
    /// Accepted steps, and all.
    pub steps: V,
    /// See `steps`.
    pub evaluations: V,
    /// Where the last step began.
    pub begin: Here<V>,
    /// The branch there.
    pub begin_branch: Option<Branch<V>>,
    /// The last step.
    pub tried: Tried<V>,
    /// Its result. Read number by number: what was stored in small pieces and is loaded in a large one would have to wait
    /// for all that was stored before.
    pub served: Served,
}

/// Result of a step: a bit for each machine.
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
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let machine = Machine::like(motor, inverter, free);
        let at = Operating { inverse_inductance: Symmetric::new(one, zero, one), ..Operating::default() };
        let source = Source { voltage: zero, rise: zero };
        let here = Here { time: zero, state: State::default(), at, source };
        let bounds = Bounds::new(motor.magnetics.core().kinks() != [false; 2]);
        let accuracy = Accuracy { per_flux: one, per_angle: one, per_flux_scale: one, ..Accuracy::default() };
        Self {
            machine,
            bounds,
            here,
            sensed: Sensed::like(sensors),
            schedule: Schedule {
                live: 0,
                stop: zero,
                sample: zero,
                to_mode_end: 0,
                mode_end: zero,
                nearest: 0,
                ending_mode: [None; MOST_LANES],
                expected: V::of(NEVER),
                carried: [0; MOST_LANES],
                swept: 0,
            },
            control: StepControl { accuracy, follow, ..StepControl::default() },
            outcome: Outcome {
                peak: zero,
                moved: zero,
                steps: zero,
                evaluations: zero,
                begin: here,
                begin_branch: None,
                tried: Tried::none(&here),
                served: Served::default(),
            },
        }
    }

    /// Tries a step of each machine that is live. Where a mode ends within it, the next one will end there.
    pub fn step(&mut self) {
        if self.machine.is_rare() || self.control.refereed {
            V::compute(StepOf::<_, true>(self));
        } else {
            V::compute(StepOf::<_, false>(self));
        }
        if let Some(sensed) = &mut self.sensed {
            sensed.follow(&self.machine.legs.axes);
        }
        for lane in lanes_of(self.outcome.served.crossed) {
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
        if self.outcome.served.stuck >> lane & 1 == 1 { RunError::Stuck } else { RunError::NotFinite }
    }

    /// Evaluates a machine anew at its state.
    pub fn look(&mut self, lane: usize) {
        V::compute(LookAt(self, 1 << lane));
    }

    /// The machines at a share of the step taken last.
    pub fn within(&self, share: f64) -> Here<V> {
        V::compute(There(self.span(share)))
    }

    /// A place in the step taken last, by its share of it.
    pub fn span(&self, share: f64) -> Span<'_, 'a, V> {
        let Outcome { begin, begin_branch, tried, .. } = &self.outcome;
        let (machine, branch) = (&self.machine, begin_branch.as_ref());
        Span { machine, branch, from: begin, step: tried, share: V::of(share) }
    }
}

/// Machines evaluated anew at their states: a bit for each.
struct LookAt<'b, 'a, V: Wide>(&'b mut Bank<'a, V>, u32);

impl<V: Wide> Compute for LookAt<'_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let (bank, of) = (self.0, V::Mask::of_bits(self.1));
        let state = &bank.here.state;
        let point = some!(&bank.machine.branch, branch => branch.at(state.flux, None));
        let there = Here { at: bank.machine.operating(state, point.as_ref()), ..bank.here };
        if let (Some(branch), Some(point)) = (&mut bank.machine.branch, &point) {
            branch.set_stiffness(of, point.stiffness);
        }
        take(&bank.machine, true, &mut bank.here, &there, of);
    }
}

/// Advances the sensors of the selected machines (`u32`: lane mask) by a time in s without current or switching.
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

/// Machines at a place in a step.
struct There<'b, 'a, V: Wide>(Span<'b, 'a, V>);

impl<V: Wide> Compute for There<'_, '_, V> {
    type Output = Here<V>;

    #[inline(always)]
    fn compute(self) -> Here<V> {
        self.0.there()
    }
}

#[cfg(test)]
mod tests;
