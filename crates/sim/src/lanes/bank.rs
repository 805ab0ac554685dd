//! Machines side by side: each steps to its own next instant, or to the end of one of its modes if that is earlier.

mod stepping;

use standstill_inverter::{Inverter, Source};
use standstill_numeric::{Compute, MOST_LANES, Mask, Symmetric, Wide};
use standstill_plant::{Magnetics, Motor};

use self::stepping::{StepOf, take};
use super::lanes_of;
use crate::case::{Case, Place, RunError};
use crate::control::can_move;
use crate::effect::shorted::Shorted;
use crate::effect::{Branch, Span};
use crate::guard::{Bounds, Guard};
use crate::physics::gates::NEVER;
use crate::physics::machine::{Machine, Operating};
use crate::physics::state::State;
use crate::sensing::{Sensed, SensorSettings};
use crate::step::error::Accuracy;
use crate::step::two_derivative::{Here, Tried};

/// Machines of one kind in lanes. The bank holds the machines' states, the instants to which the machines step, the
/// lengths of the steps, and the result of the last step.
#[derive(Clone, Debug)]
pub struct Bank<'a, V: Wide> {
    /// The machines.
    pub machine: Machine<'a, V>,
    /// The bounds at which the machines' modes end.
    pub bounds: Bounds<V>,
    /// The machines' present states.
    pub here: Here<V>,
    /// The machines' sensors, if these have a state (filters, pick-up).
    pub sensed: Option<Sensed<V>>,
    /// Instants to which the machines step.
    pub schedule: Schedule<V>,
    /// Control of the length of the steps.
    pub control: StepControl<V>,
    /// Results of the steps.
    pub outcome: Outcome<V>,
}

/// Instants at which steps end.
#[derive(Clone, Debug)]
pub struct Schedule<V> {
    /// A bit for each machine that steps.
    pub live: u32,
    /// Next instant of each machine in ns, apart from gate edges.
    pub stop: V,
    /// Time in ns at which each machine next reads its sensors or ends its command, whichever is earlier.
    pub sample: V,
    /// A bit for each machine whose mode ends at `mode_end`.
    pub to_mode_end: u32,
    /// Time in ns at which the mode ends, for each machine in `to_mode_end`.
    pub mode_end: V,
    /// A bit for each machine whose mode ends between `mode_end` and the last floating-point number before it. No floating-point number
    /// is closer to the end.
    pub nearest: u32,
    /// Guard of the mode that ends at `mode_end`. None if a margin was negative only because of rounding.
    pub ending_mode: [Option<Guard>; MOST_LANES],
    /// Time in ns at which a current is expected to have charged a terminal to its bound.
    pub expected: V,
    /// Leg whose terminal is expected to reach its bound at the time `expected`.
    pub carried: [usize; MOST_LANES],
    /// A bit for each machine for which a time `expected` was set at the last change of its legs' conduction modes.
    pub swept: u32,
}

/// Control of the steps' length and error.
#[derive(Clone, Debug, Default)]
pub struct StepControl<V: Wide> {
    /// Required accuracy of a step.
    pub accuracy: Accuracy<V>,
    /// Length in ns of the step to try next.
    pub next: V,
    /// Largest length in ns of a step.
    pub longest: V,
    /// Length in ns of the last step with no, one, two or three floating terminals. Floating terminals ring, and a ringing needs shorter
    /// steps.
    pub next_by_floating: [V; 4],
    /// Number of successive rejected steps.
    pub refused: V,
    /// Whether values inside steps are needed. Then `begin` and `tried` of [`Outcome`] always belong to the last step.
    pub follow: bool,
    /// Whether the referee, an independent integrator, takes the steps. Possible only for a single machine.
    pub refereed: bool,
}

/// Results of steps.
#[derive(Clone, Debug)]
pub struct Outcome<V: Wide> {
    /// Largest phase current in A since the start of the run.
    pub peak: V,
    /// Largest distance in rad from the initial position since the start of the run.
    pub moved: V,
    /// Number of accepted steps.
    pub steps: V,
    /// Number of attempted steps, accepted or not.
    pub evaluations: V,
    /// State of the machines at the beginning of the last step.
    pub begin: Here<V>,
    /// The play cells at the beginning of the last step.
    pub begin_branch: Option<Branch<V>>,
    /// The last attempted step.
    pub tried: Tried<V>,
    /// Result of the last step. The code reads its fields one by one: they are stored one by one, and a wide load would wait for all
    /// these stores.
    pub served: Served,
}

/// Result of a step. Each field is a bit mask of machines.
#[derive(Clone, Copy, Debug, Default)]
pub struct Served {
    /// Machines that took the step.
    pub accepted: u32,
    /// Machines that reached their next instant or the end of a mode.
    pub arrived: u32,
    /// Machines with a blocked leg whose potential was out of its bounds already before the step.
    pub out_of_bounds: u32,
    /// Machines that cannot continue, because no step is short enough, too many successive steps were rejected, or values are not
    /// numbers.
    pub broken: u32,
    /// Machines of `broken` whose steps are exact enough, but pass the end of a mode at any length.
    pub stuck: u32,
    /// For each leg, the machines whose request to this leg has been carried out. These machines need the leg's next request.
    pub carried_out: [u32; 3],
    /// Machines in which a mode ends within the step.
    crossed: u32,
}

impl<'a, V: Wide> Bank<'a, V> {
    /// Makes a bank for machines of the same kind as this motor, inverter and sensors. `free` says whether the rotors can move. `follow`
    /// says whether values inside steps are needed.
    pub fn like(
        motor: &'a Motor,
        inverter: &Inverter,
        sensors: &SensorSettings,
        free: bool,
        follow: bool,
    ) -> Self {
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let machine = Machine::like(motor, inverter, free, sensors.load().is_some());
        let at = Operating { inverse_inductance: Symmetric::new(one, zero, one), ..Operating::default() };
        let source = Source { voltage: zero, rise: zero };
        let here = Here { time: zero, state: State::default(), at, source };
        let bounds = Bounds::new(motor.magnetics.core().kinks() != [false; 2], sensors.comparator.any());
        let accuracy = Accuracy { per_flux: one, per_angle: one, per_flux_scale: one, ..Accuracy::default() };
        Self {
            machine,
            bounds,
            here,
            sensed: Sensed::like(sensors, inverter.bridge.terminal_capacitance > 0.0),
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

    /// Makes a bank for machines of the same kind as the machine of a case. `follow` says whether values inside steps are needed.
    pub fn of(case: &Case<'a>, follow: bool) -> Self {
        let sensors = &case.sensors.settings;
        let mut bank = Self::like(case.motor, &case.inverter, sensors, can_move(case.rotor), follow);
        bank.machine.shorted = case.faults.short_turns().then(Shorted::default);
        bank
    }

    /// Tries one step of each live machine. If a mode ends within the step, the step is rejected, and the next step is cut at the end of
    /// the mode.
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

    /// Advances the filters and the pick-up of one machine's sensors by `h` seconds in which no current flows and no gate switches.
    pub fn rest_sensors(&mut self, lane: usize, h: f64) {
        if self.sensed.is_some() {
            V::compute(RestOf(self, 1 << lane, h));
        }
    }

    /// Returns the error that ends the run of a machine that cannot step.
    pub fn why_broken(&self, lane: usize) -> RunError {
        let place = self.place(lane);
        let (state, current) = (&self.here.state, self.here.at.current.get(lane));
        let is_finite = [current.x, current.y, state.link.get(lane)].iter().all(|number| number.is_finite());
        if self.outcome.served.stuck >> lane & 1 == 1 {
            RunError::Stuck(place)
        } else if is_finite {
            RunError::NoStep(place)
        } else {
            RunError::NotFinite(place)
        }
    }

    /// Returns time, conduction modes and currents of a machine, for the message of an error.
    pub fn place(&self, lane: usize) -> Place {
        let (legs, time) = (&self.machine.legs, self.here.time.get(lane));
        let current = self.here.at.current.get(lane);
        Place::new(time, legs.modes(lane, time), legs.axes.each_ref().map(|axis| axis.get(lane).dot(current)))
    }

    /// Computes the operating point of a machine anew from its present state.
    pub fn look(&mut self, lane: usize) {
        V::compute(LookAt(self, 1 << lane));
    }

    /// Returns the state of the machines within the last step. `share` is the elapsed share of the step: 0 at its beginning, 1 at its
    /// end.
    pub fn within(&self, share: f64) -> Here<V> {
        V::compute(There(self.span(share)))
    }

    /// Returns a time within the last step, together with the data of that step. `share` is the elapsed share of the step.
    pub fn span(&self, share: f64) -> Span<'_, 'a, V> {
        let Outcome { begin, begin_branch, tried, .. } = &self.outcome;
        let (machine, branch) = (&self.machine, begin_branch.as_ref());
        Span { machine, branch, from: begin, step: tried, share: V::of(share) }
    }
}

/// Computes the operating points of the selected machines anew from their states. The number is a bit mask of these machines.
struct LookAt<'b, 'a, V: Wide>(&'b mut Bank<'a, V>, u32);

impl<V: Wide> Compute for LookAt<'_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let (bank, of) = (self.0, V::Mask::of_bits(self.1));
        let state = &bank.here.state;
        let point = some!(&bank.machine.branch, branch => branch.at(state.flux, None));
        let short = bank.machine.shorted.as_ref();
        let there = Here { at: bank.machine.operating(state, point.as_ref(), short), ..bank.here };
        if let (Some(branch), Some(point)) = (&mut bank.machine.branch, &point) {
            branch.set_stiffness(of, point.stiffness);
        }
        take(&bank.machine, true, &mut bank.here, &there, of);
    }
}

/// Advances the sensors of the selected machines by a time in s in which no current flows and no gate switches. The first number is a bit
/// mask of these machines.
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

/// Computes the states of the machines at a time within a step.
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
