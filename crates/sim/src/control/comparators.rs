//! The comparators of a run: their levels, their blanking, and the effect of a trip.

use standstill_interface::{Capture, Command, Nanos, Sampling, Stage};
use standstill_numeric::Wide;

use super::course::Course;
use super::run::Control;
use crate::case::{Case, RunError};
use crate::guard::Levels;
use crate::lanes::bank::Bank;
use crate::physics::gates::NEVER;
use crate::sensing::{Arrangement, Comparator, ComparatorSettings, Comparators, Input};
use crate::trace::{ComparatorState, Event};
use crate::{Draws, Purpose};

/// Largest distance of the current from the threshold, in standard deviations of the noise, at which values of
/// band-limited noise are generated. The noise exceeds this distance with a probability of 1e-9.
const FAR: f64 = 6.0;

/// The comparators of one run.
#[derive(Clone, Debug)]
pub struct Watching<'a> {
    settings: ComparatorSettings,
    specimen: Comparator,
    noise: Draws<'a>,
    /// The threshold in A of the present command, including the noise of its pulse; none if the command has no
    /// threshold, or if a comparator has already tripped at it.
    threshold: Option<f64>,
    /// Present value in A of band-limited noise; none while the current is too far from the threshold for the noise to
    /// matter.
    value: Option<f64>,
    /// Time in ns at which the comparators' levels change next: the end of the blanking, or the next value of the noise. [`NEVER`] if no
    /// change is due.
    wakes: f64,
    /// True if the last trip was located slightly too early, before the current had reached the level.
    near: bool,
    /// Second stage and sampling of a command with a threshold, kept until its first stage has ended.
    after: Option<(Option<Stage<f64>>, Sampling)>,
    /// The trip in the present command.
    capture: Option<Capture>,
}

impl<'a> Watching<'a> {
    /// Makes the comparators of a case; `None` if its drive has no comparators.
    pub fn of(case: &Case<'a>) -> Option<Self> {
        let settings = case.sensors.settings.comparator;
        settings.any().then(|| Self {
            settings,
            specimen: case.sensors.comparator,
            noise: case.streams.open(Purpose::ComparatorNoise),
            threshold: None,
            value: None,
            wakes: NEVER,
            near: false,
            after: None,
            capture: None,
        })
    }

    /// Returns the time in ns at which the comparators' levels change next.
    pub fn next(&self) -> f64 {
        self.wakes
    }

    /// Returns the trip in the present command; none if no comparator has tripped yet.
    pub fn capture(&self) -> Option<Capture> {
        self.capture
    }

    /// Returns the comparators' state, for an observer.
    pub fn state(&self) -> ComparatorState {
        match self.threshold {
            _ if self.capture.is_some() => ComparatorState::Tripped,
            None if self.settings.trip == 0.0 => ComparatorState::Idle,
            // `wakes` is set by the blanking, or by the noise, which then has a value.
            _ if self.wakes != NEVER && self.value.is_none() => ComparatorState::Blanked,
            _ => ComparatorState::Watching,
        }
    }

    /// Returns whether the first stage of a command with a threshold is still running and its second stage has
    /// not begun.
    pub fn goes_on(&self) -> bool {
        self.after.is_some()
    }

    /// Returns the overcurrent level in A at which a comparator switches the drive off for good; infinite for a comparator that the drive
    /// does not have.
    fn overcurrent(&self, input: Input) -> f64 {
        let exists = (input == Input::Link) == (self.settings.arrangement == Comparators::Common);
        if exists && self.settings.trip > 0.0 {
            self.settings.trip + self.specimen.offset[input.number()]
        } else {
            f64::INFINITY
        }
    }

    /// Returns the level in A at which a comparator ends the stage; infinite if it cannot end a stage. While no values of
    /// band-limited noise are generated, the level is lower by [`FAR`] standard deviations, so that generation begins in time.
    fn ends_stage(&self, input: Input) -> f64 {
        let exists = (input == Input::Link) == (self.settings.arrangement == Comparators::Common);
        let noise = match self.settings.noise_hold() {
            Some(_) => self.value.unwrap_or(FAR * self.settings.noise),
            None => 0.0,
        };
        self.threshold
            .filter(|_| exists)
            .map_or(f64::INFINITY, |threshold| threshold + self.specimen.offset[input.number()] - noise)
    }

    /// Generates the first or the next value of band-limited noise at the time `now` in ns. Does nothing if there is no such noise.
    fn draw_value(&mut self, now: f64) {
        let Some((hold, correlation)) = self.settings.noise_hold() else { return };
        let fresh = self.settings.noise * self.noise.normal();
        let next = self
            .value
            .map_or(fresh, |value| correlation * value + (1.0 - correlation * correlation).sqrt() * fresh);
        (self.value, self.wakes) = (Some(next), now + hold);
    }
}

impl<'a> Control<'a> {
    /// Prepares the comparators for a command that starts at `start`.
    ///
    /// # Errors
    /// The command has a threshold, but the drive has no timer that captures a trip.
    pub(super) fn set_comparators<V: Wide>(
        &mut self,
        bank: &mut Bank<'a, V>,
        command: &Command<f64>,
        start: Nanos,
    ) -> Result<(), RunError> {
        let Some(watching) = &mut self.comparators else {
            return if command.threshold.is_some() { Err(RunError::NoComparator) } else { Ok(()) };
        };
        if command.threshold.is_some() && watching.settings.timer == 0.0 {
            return Err(RunError::NoComparator);
        }
        (watching.capture, watching.near, watching.value) = (None, false, None);
        watching.after = command.threshold.map(|_| (command.then, command.sampling));
        watching.threshold = command.threshold.map(|threshold| {
            let (noise, lasts) = (watching.settings.noise, watching.settings.noise_bandwidth == 0.0);
            let shift = if noise > 0.0 && lasts { noise * watching.noise.normal() } else { 0.0 };
            watching.settings.set(threshold) - shift
        });
        self.blank(bank, start);
        Ok(())
    }

    /// Disables the comparators from the begin of a stage on, for the blanking time.
    fn blank<V: Wide>(&mut self, bank: &mut Bank<'a, V>, start: Nanos) {
        let Some(watching) = &mut self.comparators else { return };
        let watches = watching.threshold.is_some() || watching.settings.trip > 0.0;
        let until = (start + watching.settings.blanking).0 as f64;
        watching.wakes = if watches { until } else { NEVER };
        if let Some(levels) = &mut bank.bounds.levels {
            levels.put(self.lane, false, |_| f64::INFINITY);
        }
    }

    /// Enables the comparators after the blanking time, or generates the next value of their noise. A comparator whose current already
    /// exceeds its level trips at once.
    pub(super) fn unblank<V: Wide>(&mut self, bank: &mut Bank<'a, V>) -> Result<(), RunError> {
        let now = self.time(bank);
        let Some(watching) = &mut self.comparators else { return Ok(()) };
        watching.wakes = NEVER;
        if watching.value.is_some() && watching.threshold.is_some() {
            watching.draw_value(now);
            watching.near = false;
        }
        self.put_levels(bank);
        let passed =
            Levels::<V>::INPUTS.into_iter().find(|input| self.current_at(bank, *input) >= self.level(*input));
        passed.map_or(Ok(()), |input| self.trip(bank, input))
    }

    /// Returns the level in A at which a comparator trips next.
    fn level(&self, input: Input) -> f64 {
        if self.deaf {
            return f64::INFINITY;
        }
        let level = |watching: &Watching<'_>| watching.ends_stage(input).min(watching.overcurrent(input));
        self.comparators.as_ref().map_or(f64::INFINITY, level)
    }

    /// Writes the comparators' levels into the bank.
    pub(super) fn put_levels<V: Wide>(&self, bank: &mut Bank<'a, V>) {
        if let Some(levels) = &mut bank.bounds.levels {
            levels.put(self.lane, self.watches_below(), |input| self.level(input));
        }
    }

    /// Returns whether the comparators of the phases watch shunts below the legs.
    fn watches_below(&self) -> bool {
        self.case.sensors.settings.arrangement == Arrangement::LowSideShunts
    }

    /// Returns the present current in A at a comparator, in the direction in which it trips.
    fn current_at<V: Wide>(&self, bank: &Bank<'a, V>, input: Input) -> f64 {
        let current = self.currents(bank);
        let modes = bank.machine.legs.modes(self.lane, self.time(bank));
        match input {
            Input::Link => (0..3).filter(|k| modes[*k].is_upper()).map(|k| current[k]).sum(),
            Input::Into(k) | Input::Out(k) if self.watches_below() && !modes[k].is_lower() => 0.0,
            Input::Into(k) => current[k],
            Input::Out(k) => -current[k],
        }
    }

    /// Handles the trip of a comparator at the present time. A trip at the threshold ends the stage after the comparator's delay; a
    /// trip at the overcurrent level ends the run.
    ///
    /// # Errors
    /// [`RunError::Overcurrent`].
    pub(super) fn trip<V: Wide>(&mut self, bank: &mut Bank<'a, V>, input: Input) -> Result<(), RunError> {
        let now = self.time(bank);
        let current = self.current_at(bank, input);
        let short = self.level(input) - current > bank.bounds.ended.get(self.lane);
        let (start, end) = (self.course.start, self.course.end);
        let Some(watching) = &mut self.comparators else { return Ok(()) };
        if short && !std::mem::replace(&mut watching.near, true) {
            // The trip was located on the cubic of a longer step; the next step begins close to the true time of the trip.
            return Ok(());
        }
        watching.near = false;
        let for_good = watching.overcurrent(input) <= watching.ends_stage(input);
        if !for_good && watching.value.is_none() && watching.settings.noise_hold().is_some() {
            // The current is so near to the threshold that noise may trip the comparator: drawing begins.
            watching.draw_value(now);
            self.put_levels(bank);
            if self.level(input) > current {
                return Ok(());
            }
        }
        let Some(watching) = &mut self.comparators else { return Ok(()) };
        if !for_good {
            let delay = watching.specimen.delay[input.number()];
            let output = now + delay * 1e9;
            // Gates switch at whole nanoseconds. A trip after the end of the stage has no effect.
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a time within a stage"
            )]
            let at = Nanos(output.ceil() as u64);
            (watching.threshold, watching.value, watching.wakes) = (None, None, NEVER);
            if at <= end {
                let ticks = watching.specimen.ticks((output - start.0 as f64) * 1e-9);
                watching.capture = Some(Capture { ticks, comparator: input.phase() });
                self.course.end = at;
            }
            self.put_levels(bank);
        }
        self.event(now * 1e-9, Event::Trip(input.phase()));
        if for_good { Err(RunError::overcurrent(current)) } else { Ok(()) }
    }

    /// Begins the second stage of a command with a threshold.
    pub(super) fn go_on_after_trip<V: Wide>(&mut self, bank: &mut Bank<'a, V>) {
        let Some(watching) = &mut self.comparators else { return };
        (watching.threshold, watching.value, watching.near) = (None, None, false);
        let Some((then, sampling)) = watching.after.take() else { return };
        let start = self.course.end;
        let duration = then.map_or(Nanos::ZERO, |stage| stage.duration);
        self.course = Course { start, end: start + duration, sampling, ..Course::NONE };
        if let Some(stage) = then {
            self.found = -1.0;
            let carrier = self.case.inverter.carrier_period;
            let command = Command::hold(stage, sampling);
            self.sequencer.begin(&mut bank.machine.legs, self.lane, &command, start, carrier);
        }
        self.blank(bank, start);
        self.next_trigger();
    }
}
