//! The requests to each leg and their times, computed from a command.

use standstill_interface::{Command, Leg, Nanos};
use standstill_inverter::Gate;

use crate::case::RunError;

/// A time after any request and any edge.
const NEVER: Nanos = Nanos(u64::MAX);

/// The task of a leg in a stage.
#[derive(Clone, Copy, Debug)]
pub enum Task {
    /// The leg keeps its gates.
    Keep(Gate),
    /// Pulse-width modulation: in each carrier period the leg is low for `idle`, high for `on`, and low for the rest.
    Modulate { idle: Nanos, on: Nanos },
    /// The leg switches once, `at` after the begin of the stage.
    Once { from: Gate, at: Nanos, to: Gate },
}

impl Task {
    /// Returns the task of a leg in a stage of a command. `leg` is the command's order for this leg. `carrier`: period of the PWM.
    pub fn new(leg: Leg<f64>, carrier: Nanos) -> Self {
        let once =
            |from, at, to| if at == Nanos::ZERO { Self::Keep(to) } else { Self::Once { from, at, to } };
        match leg {
            Leg::Rise(at) => once(Gate::Low, at, Gate::High),
            Leg::Fall(at) => once(Gate::High, at, Gate::Low),
            Leg::Off => Self::Keep(Gate::Off),
            Leg::Low => Self::Keep(Gate::Low),
            Leg::High => Self::Keep(Gate::High),
            Leg::Duty(duty) => match on_time(duty, carrier) {
                Nanos::ZERO => Self::Keep(Gate::Low),
                on if on == carrier => Self::Keep(Gate::High),
                // Centre-aligned: low, high in the middle of the period, low.
                on => Self::Modulate { idle: Nanos((carrier.0 - on.0) / 2), on },
            },
        }
    }

    /// Returns the request at the begin of the stage.
    fn first(self) -> Gate {
        match self {
            Self::Keep(gate) | Self::Once { from: gate, .. } => gate,
            Self::Modulate { idle: Nanos::ZERO, .. } => Gate::High,
            Self::Modulate { .. } => Gate::Low,
        }
    }
}

/// One leg's requests over one command, in order of time: one at the begin of each stage, and further ones only where the gate changes.
#[derive(Clone, Copy, Debug)]
pub struct LegPlan {
    /// The leg's tasks in the two stages.
    tasks: [Task; 2],
    start: Nanos,
    /// Ends of the two stages.
    ends: [Nanos; 2],
    carrier: Nanos,
    /// Number of the present stage.
    stage: usize,
    /// True if the next request is the first of the present stage.
    opens: bool,
    /// The next request: its time ([`NEVER`] after the last one) and its gate.
    at: Nanos,
    gate: Gate,
}

impl LegPlan {
    /// The plan of a leg without requests.
    pub const NONE: Self = Self {
        tasks: [Task::Keep(Gate::Off); 2],
        start: Nanos::ZERO,
        ends: [Nanos::ZERO; 2],
        carrier: Nanos::ZERO,
        stage: 2,
        opens: false,
        at: NEVER,
        gate: Gate::Off,
    };

    /// Makes the plan of a leg with these tasks in the two stages of a command. `ends` contains the ends of the stages.
    pub fn new(tasks: [Task; 2], start: Nanos, ends: [Nanos; 2], carrier: Nanos) -> Self {
        Self { tasks, start, ends, carrier, stage: 0, opens: true, at: start, gate: tasks[0].first() }
    }

    /// Makes the plan, without requests, of a leg that keeps its gate throughout a command.
    pub fn held(gate: Gate, start: Nanos, ends: [Nanos; 2], carrier: Nanos) -> Self {
        Self { tasks: [Task::Keep(gate); 2], start, ends, carrier, ..Self::NONE }
    }

    /// Returns whether all requests have been taken.
    pub fn is_over(&self) -> bool {
        self.at == NEVER
    }

    /// Returns the next request and advances to the following request. None after the last request.
    #[inline]
    pub fn take(&mut self) -> Option<(Nanos, Gate)> {
        let request = (self.at, self.gate);
        if self.at == NEVER {
            return None;
        }
        self.advance();
        Some(request)
    }

    /// Advances to the following request.
    fn advance(&mut self) {
        if let Some(Task::Modulate { idle, on }) = self.tasks.get(self.stage)
            && *idle > Nanos::ZERO
        {
            let (wait, gate) = match self.gate {
                Gate::High => (*on, Gate::Low),
                _ if self.opens => (*idle, Gate::High),
                _ => (self.carrier - *on, Gate::High),
            };
            (self.at, self.gate, self.opens) = (self.at + wait, gate, false);
            if self.at < self.ends[self.stage] {
                return;
            }
        }
        if let Some(Task::Once { at, to, .. }) = self.tasks.get(self.stage)
            && self.opens
        {
            (self.at, self.gate, self.opens) = (self.at + *at, *to, false);
            if self.at < self.ends[self.stage] {
                return;
            }
        }
        self.stage += 1;
        self.opens = true;
        if self.stage == 1 && self.ends[0] < self.ends[1] {
            (self.at, self.gate) = (self.ends[0], self.tasks[1].first());
        } else {
            (self.stage, self.at) = (2, NEVER);
        }
    }

    /// Returns the intervals of alternating PWM requests: the durations in ns of requests for the upper and for the
    /// lower switch, and the latest time in ns of a request that at least two more follow. None if the requests do not
    /// alternate. `at` is the time of the request two places before the plan's next request.
    pub fn alternates(&self, at: Nanos) -> Option<([f64; 2], f64)> {
        let Some(Task::Modulate { idle, on }) = self.tasks.get(self.stage) else { return None };
        let begin = if self.stage == 0 { self.start } else { self.ends[0] };
        let (on, off) = (on.0, self.carrier.0 - on.0);
        // After the first request of a stage, the time to the next one is different (half of the usual one).
        if *idle == Nanos::ZERO || self.at.0 != at.0 + self.carrier.0 || at < begin {
            return None;
        }
        let last = self.ends[self.stage].0.saturating_sub(1 + on.max(off));
        Some(([on as f64, off as f64], last as f64))
    }

    /// Continues the plan after the request for `gate` at `at`, which must be in the present stage.
    pub fn go_on_after(&mut self, at: Nanos, gate: Gate) {
        (self.at, self.gate, self.opens) = (at, gate, false);
        self.advance();
    }

    /// Returns the request to the leg just before `at`, a time after the begin of the command.
    pub fn requested(&self, at: Nanos) -> Gate {
        let before = at - Nanos(1);
        let (stage, stage_start) = if before < self.ends[0] { (0, self.start) } else { (1, self.ends[0]) };
        match self.tasks[stage] {
            Task::Keep(gate) => gate,
            Task::Once { from, at, to } => {
                if before - stage_start < at {
                    from
                } else {
                    to
                }
            }
            Task::Modulate { idle, on } => {
                let place = (before.0 - stage_start.0) % self.carrier.0;
                if place >= idle.0 && place < idle.0 + on.0 { Gate::High } else { Gate::Low }
            }
        }
    }

    /// Returns the time of the last change of the request between the begin of the command and `at`, a later time; none
    /// if there was no change. `before` is the request before the command.
    pub fn changed(&self, before: Gate, at: Nanos) -> Option<Nanos> {
        let (last, end) = (at - Nanos(1), self.ends[0]);
        let first = self.changed_in(0, before, last.min(end - Nanos(1)));
        // A first stage without duration still makes its first request.
        let held = if end > self.start { self.requested(end) } else { self.tasks[0].first() };
        let second = if last < end { None } else { self.changed_in(1, held, last) };
        second.or(first)
    }

    /// Returns the time of the last change of the request in a stage up to `last`. `before` is the request before the stage.
    fn changed_in(&self, stage: usize, before: Gate, last: Nanos) -> Option<Nanos> {
        let begin = if stage == 0 { self.start } else { self.ends[0] };
        let passed = last - begin;
        let within = match self.tasks[stage] {
            Task::Once { from, at, to } if from != to && passed >= at => Some(at),
            // If `idle` is zero, the gap (1 ns) cannot be centred, and the leg stays high.
            Task::Modulate { idle, on } if idle > Nanos::ZERO => {
                let (periods, place) = (passed.0 / self.carrier.0, passed.0 % self.carrier.0);
                let edge = |period: u64, after: Nanos| Some(self.carrier * period + after);
                if place >= idle.0 + on.0 {
                    edge(periods, idle + on)
                } else if place >= idle.0 {
                    edge(periods, idle)
                } else {
                    periods.checked_sub(1).and_then(|period| edge(period, idle + on))
                }
            }
            _ => None,
        };
        within.map(|after| begin + after).or((self.tasks[stage].first() != before).then_some(begin))
    }
}

/// Returns the time for which a leg with this duty cycle, limited to the range from 0 to 1, is high in each carrier period.
// A time between 0 and a carrier period fits into u64.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub fn on_time(duty: f64, carrier: Nanos) -> Nanos {
    Nanos((duty.clamp(0.0, 1.0) * carrier.0 as f64).round() as u64)
}

/// Largest number of samples of a command: more than any method needs, and few enough for the memory.
const MOST_SAMPLES: u32 = 1 << 20;

/// Checks whether a command can be carried out. `carrier` is the period of the PWM; it is zero on a drive without PWM.
///
/// # Errors
/// [`RunError::BadCommand`] or [`RunError::BadDuty`] if it cannot.
pub fn validate(command: &Command<f64>, carrier: Nanos) -> Result<(), RunError> {
    let duration = command.duration();
    let sampling = command.sampling;
    let too_many = sampling.count > MOST_SAMPLES;
    if duration == Nanos::ZERO || too_many || sampling.last().is_some_and(|last| last > duration) {
        return Err(RunError::BadCommand);
    }
    if let Some(threshold) = command.threshold {
        let samples_end = sampling.last().is_none_or(|last| last <= duration - command.stage.duration);
        let keeps = |leg: &Leg<f64>| matches!(leg, Leg::Off | Leg::Low | Leg::High);
        let first = command.stage.duration > Nanos::ZERO && command.stage.legs.0.iter().all(keeps);
        if !(threshold.is_finite() && samples_end && first) {
            return Err(RunError::BadCommand);
        }
    }
    let stages = [Some(command.stage), command.then];
    let nonsense =
        |leg: &Leg<f64>| matches!(leg, Leg::Duty(duty) if !duty.is_finite() || carrier == Nanos::ZERO);
    if stages.iter().flatten().any(|stage| stage.legs.0.iter().any(nonsense)) {
        return Err(RunError::BadDuty);
    }
    Ok(())
}
