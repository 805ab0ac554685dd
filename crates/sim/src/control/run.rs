//! One run. After each step it carries out all that is due at the present instant, and returns its next need: a step or a command.
//!
//! ```text
//!   command → gate edges → conduction → voltage → flux → current → reading → detector → command
//! ```

use standstill_interface::{Command, Nanos, Reading, Sampling};
use standstill_inverter::{Conduction, Gate, Modes};
use standstill_numeric::{Lane, Wide};
use standstill_plant::Magnetics;

use super::comparators::Watching;
use super::course::Course;
use super::faults::limited;
use super::gates::GateSequencer;
use super::ledger::Accounts;
use super::past::Past;
use super::requests::validate;
use super::samples::Room;
use crate::case::{Case, RunError};
use crate::lanes::bank::Bank;
use crate::physics::gates::NEVER;
use crate::physics::motion::Motion;
use crate::sensing::{LowPass, Sampler};
use crate::trace::{Event, Probe};

/// The item that a run needs from its caller in order to continue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Want {
    /// A step of the run's machine.
    Step,
    /// The detector's next command, to be given with [`Control::command`]; the readings of the last command are ready.
    Command,
    /// Nothing: the run cannot continue.
    Over(RunError),
}

/// Largest number of events between two instants within [`NO_TIME`]; with more, the run ends as chattering. A handful is usual.
const MOST_EVENTS: u32 = 1000;

/// Length in ns of the window in which events are counted; no machine has a thousand events within it.
const NO_TIME: f64 = 1e3;

/// A run in a lane of a bank.
pub struct Control<'a> {
    pub(super) case: Case<'a>,
    /// Number of the run's lane in the bank.
    pub(super) lane: usize,
    pub(super) probe: Option<&'a mut dyn Probe>,
    pub(super) sequencer: GateSequencer,
    /// Conduction modes and gates at the observer's last snapshot.
    pub(super) shown: (Modes, [Gate; 3]),
    pub(super) motion: Motion,
    /// Signs of ψ_d and ψ_q, +1 or −1, if the core has a kink at zero of that flux; else 0.
    pub(super) sides: [f64; 2],
    pub(super) course: Course,
    pub(super) sampler: Sampler<'a>,
    pub(super) link_filter: Option<LowPass>,
    pub(super) terminal_filters: Option<[LowPass; 3]>,
    pub(super) comparators: Option<Watching<'a>>,
    /// Time in ns of the next instant at which a part breaks or works again.
    pub(super) breaks: f64,
    /// Number of commands so far; counted only in cases with faults.
    commands: u32,
    /// Whether a fault keeps all comparators from tripping at present.
    pub(super) deaf: bool,
    /// Past angles of the rotor.
    pub(super) past: Past,
    /// The readings of the last command, as far as its samples have been converted.
    pub(super) readings: Vec<Reading<f64>>,
    /// Number of events since the later of two times: the last instant and `counted_from`.
    events: u32,
    /// Time in ns of the first of the counted events.
    counted_from: f64,
    /// Number of segments so far: see [`Work`](crate::Work).
    pub(super) segments: u64,
    /// Number of events since the start of the run.
    pub(super) all_events: u64,
    pub(super) accounts: Option<Accounts>,
    /// Time in ns at which the modes of legs without current were found last.
    pub(super) found: f64,
    /// Whether time has passed since the link's voltage was last updated.
    pub(super) stale: bool,
    /// True until the run begins and the observer receives the initial state.
    first: bool,
    /// Error that ends the first command if no initial state with the remanence of the iron could be computed; else none.
    pub(super) nowhere: Option<RunError>,
}

impl<'a> Control<'a> {
    /// Begins the run of a case, at rest, in a lane of a bank of its kind. Observer and ledger are possible only in a bank with one lane.
    pub fn new<V: Wide>(
        case: Case<'a>,
        bank: &mut Bank<'a, V>,
        lane: usize,
        probe: Option<&'a mut dyn Probe>,
        ledger: bool,
        Room { mut readings, taken, mut past }: Room,
    ) -> Self {
        readings.clear();
        past.clear();
        let settings = &case.sensors.settings;
        let link = &case.inverter.link;
        let mut control = Self {
            lane,
            probe,
            sequencer: GateSequencer::new(case.inverter.gates, settings.settle > Nanos::ZERO),
            shown: ([Conduction::Blocked; 3], [Gate::Off; 3]),
            motion: Motion::Held,
            sides: case.motor.magnetics.core().kinks().map(f64::from),
            course: Course::NONE,
            sampler: Sampler::new(&case.sensors, case.faults, case.streams, taken),
            link_filter: settings.dc_link.bandwidth.map(|corner| LowPass::new(corner, link.source(0.0))),
            terminal_filters: None,
            comparators: Watching::of(&case),
            deaf: false,
            breaks: if case.faults.is_empty() { NEVER } else { 0.0 },
            commands: 0,
            past,
            readings,
            events: 0,
            counted_from: 0.0,
            segments: 0,
            all_events: 0,
            accounts: None,
            found: -1.0,
            stale: false,
            first: true,
            nowhere: None,
            case,
        };
        let pulled = control.put(bank);
        control.set_up_motion(bank, pulled);
        control.set_up_dividers(bank);
        if V::ALONE && ledger {
            control.accounts = Some(Accounts::open(&control, bank));
        }
        control.sampler.is_plain = control.has_plain_samples(bank);
        control
    }

    /// Returns a copy of the run without observer and ledger.
    pub fn unwatched(&self) -> Self {
        Self {
            case: self.case.clone(),
            probe: None,
            sequencer: self.sequencer.clone(),
            sampler: self.sampler.clone(),
            comparators: self.comparators.clone(),
            past: Past::default(),
            readings: self.readings.clone(),
            accounts: None,
            ..*self
        }
    }

    /// Returns the time in ns since the start of the run.
    pub(super) fn time<V: Wide>(&self, bank: &Bank<'a, V>) -> f64 {
        bank.here.time.get(self.lane)
    }

    /// Updates the link's voltage to the present time.
    pub(super) fn look_at_link<V: Wide>(&mut self, bank: &mut Bank<'a, V>) {
        bank.machine.links.look(self.lane, &mut bank.here);
        self.stale = false;
    }

    /// Begins a command of the detector, and returns what the run needs next.
    pub fn command<V: Wide>(&mut self, bank: &mut Bank<'a, V>, command: &Command<f64>) -> Want {
        self.readings.clear();
        self.sampler.clear();
        let carrier = self.case.inverter.carrier_period;
        if let Some(error) = self.nowhere.or(validate(command, carrier).err()) {
            return Want::Over(error);
        }
        self.readings.reserve(command.sampling.count as usize);
        let start = self.course.end;
        let end = start + command.duration();
        if end <= start || end > self.case.time_limit {
            return Want::Over(RunError::TimeLimit(self.case.time_limit));
        }
        self.event(start.seconds(), Event::Command);
        self.found = -1.0;
        let (mut command, mut end) = (*command, end);
        if self.comparators.is_some() || command.threshold.is_some() {
            if let Err(error) = self.set_comparators(bank, &command, start) {
                return Want::Over(error);
            }
            if command.threshold.is_some() {
                end = start + command.stage.duration;
                command = Command::hold(command.stage, Sampling::NONE);
            }
        }
        let mut begins = start;
        if !self.case.faults.is_empty() {
            self.commands += 1;
            if self.case.faults.begin(self.commands, start) {
                let now = start.0 as f64;
                self.breaks =
                    if self.case.faults.at(now).next().is_some() { now } else { self.case.faults.next(now) };
            }
            let faults = &self.case.faults;
            begins = start + faults.late(start.0 as f64);
            command = limited(command, faults.most_duty(start.0 as f64));
        }
        self.sequencer.begin(&mut bank.machine.legs, self.lane, &command, begins, carrier);
        self.course = Course { start, end, sampling: command.sampling, ..Course::NONE };
        self.next_trigger();
        self.go_on(bank, true)
    }

    /// Continues after a step that brought the machine to an instant or to the end of a mode. `out_of_bounds`: whether
    /// the step was refused because a blocked leg's potential was out of its bounds.
    pub fn resume<V: Wide>(&mut self, bank: &mut Bank<'a, V>, out_of_bounds: bool) -> Want {
        let lane = self.lane;
        let mut ended = Ok(());
        // At an ordinary instant, the step has found by itself which requests have been carried out.
        let plain = !out_of_bounds && bank.schedule.to_mode_end >> lane & 1 == 0;
        let [a, b, c] = bank.outcome.served.carried_out;
        let carried_out = !plain || (a | b | c) >> lane & 1 == 1;
        if out_of_bounds {
            bank.schedule.to_mode_end &= !(1 << lane);
            ended = self.count_event(bank).and_then(|()| self.resolve(bank));
            self.show_change(bank);
        } else if plain {
            self.events = 0;
            if self.sampler.is_plain && !carried_out && self.passes_sample(bank) {
                return Want::Step;
            }
        } else {
            bank.schedule.to_mode_end &= !(1 << lane);
            if let Some(guard) = bank.schedule.ending_mode[lane] {
                ended = self.count_event(bank).and_then(|()| self.end_mode(bank, guard));
                self.show_change(bank);
            }
        }
        match ended {
            Ok(()) => self.go_on(bank, carried_out),
            Err(error) => Want::Over(error),
        }
    }

    /// Continues after a step that could not be taken: finds the modes of legs that conduct without current anew, or ends the run.
    pub fn recover<V: Wide>(&mut self, bank: &mut Bank<'a, V>) -> Want {
        let error = bank.why_broken(self.lane);
        let stuck = matches!(error, RunError::Stuck(_));
        if !stuck || self.found >= self.time(bank) || !self.conducts_nothing(bank) {
            return Want::Over(error);
        }
        // The results of the rejected steps do not apply to the modes that follow.
        bank.schedule.to_mode_end &= !(1 << self.lane);
        bank.control.refused.put(self.lane, 0.0);
        match self.count_event(bank).and_then(|()| self.resolve(bank)) {
            Ok(()) => self.go_on(bank, true),
            Err(error) => Want::Over(error),
        }
    }

    /// Counts an event. More than [`MOST_EVENTS`] within [`NO_TIME`] are an error ([`RunError::Chatter`]); over a longer time, many
    /// events are legitimate, because ringing terminals and iron with hysteresis end many modes.
    fn count_event<V: Wide>(&mut self, bank: &Bank<'a, V>) -> Result<(), RunError> {
        let time = self.time(bank);
        if time > self.counted_from + NO_TIME {
            (self.events, self.counted_from) = (0, time);
        }
        self.events += 1;
        self.all_events += 1;
        if self.events > MOST_EVENTS { Err(RunError::Chatter(bank.place(self.lane))) } else { Ok(()) }
    }

    /// Carries out all that is due, until a step or a command is needed. Order at each instant: samples, next
    /// command, gates. `carried_out`: whether a request to a leg may have been carried out since the last check.
    fn go_on<V: Wide>(&mut self, bank: &mut Bank<'a, V>, mut carried_out: bool) -> Want {
        let lane = self.lane;
        if std::mem::take(&mut self.first) {
            self.show_here(bank);
        }
        // Whether only a gate edge can let legs without current conduct.
        let mut undriven = false;
        loop {
            let time = self.time(bank);
            if let Some((nominal, at)) = self.course.pending
                && at.0 as f64 <= time
            {
                self.sample(bank, nominal);
                continue;
            }
            if self.breaks <= time {
                if let Err(error) = self.change_faults(bank, time) {
                    return Want::Over(error);
                }
                (carried_out, undriven) = (true, false);
                continue;
            }
            let end = self.course.end.0 as f64;
            if time >= end {
                if self.comparators.as_ref().is_some_and(Watching::goes_on) {
                    self.go_on_after_trip(bank);
                    (carried_out, undriven) = (true, false);
                    continue;
                }
                self.show_here(bank);
                return Want::Command;
            }
            if std::mem::take(&mut carried_out) {
                self.carry_out_requests(bank, time);
            }
            // Checked only in runs with a ledger: the check takes 3 % of a trial's time.
            let looks = self.accounts.is_some();
            assert!(!looks || (0..3).all(|k| !self.is_carried_out(bank, time, k)), "a request was missed");
            let capacitive = bank.machine.legs.elastance.is_some();
            if (capacitive || bank.machine.legs.idle_lanes() >> lane & 1 == 1) && self.found < time {
                undriven = !capacitive && !self.drives_legs(bank);
                let found = if undriven { Ok(()) } else { self.resolve(bank) };
                if let Err(error) = found {
                    return Want::Over(error);
                }
            }
            self.show_change(bank);
            if let Some(watching) = &self.comparators
                && watching.next() <= time
            {
                if let Err(error) = self.unblank(bank) {
                    return Want::Over(error);
                }
                undriven = false;
                continue;
            }
            let rests = self.rests(bank);
            let mut edge = NEVER;
            if rests {
                edge = self.next_edge(bank, time);
                if self.sampler.is_plain && undriven {
                    self.sample_at_rest(bank, end.least(edge));
                }
            }
            let sample = self.course.pending.map_or(NEVER, |(_, at)| at.0 as f64);
            let mut stop = end.least(self.next_source_instant(time)).least(self.breaks);
            if rests || !self.reads_within(bank) {
                stop = stop.least(sample);
            }
            stop = self.comparators.as_ref().map_or(stop, |watching| stop.least(watching.next()));
            self.segments += 1;
            if rests {
                self.wait(bank, stop.least(edge));
                carried_out = stop >= edge;
                if undriven && !carried_out {
                    self.found = stop;
                }
                continue;
            }
            if self.stale {
                self.look_at_link(bank);
            }
            self.stop_at(bank, stop);
            self.expect_sample(bank);
            return Want::Step;
        }
    }

    /// Reports an event at a time in s.
    #[inline]
    pub(super) fn event(&mut self, time: f64, event: Event) {
        if let Some(probe) = &mut self.probe {
            probe.event(time, event);
        }
    }
}

#[cfg(test)]
mod tests;
