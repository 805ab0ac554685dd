//! From a command to what each leg's gates do, and when.

#[cfg(test)]
mod tests;

use standstill_interface::{Abc, Command, Leg, Nanos, Real, Stage};
use standstill_inverter::{Gate, GateDriver, GateTiming};

/// Later than any request and any edge.
const NEVER: Nanos = Nanos(u64::MAX);

/// What a leg does in a stage.
#[derive(Clone, Copy, Debug)]
pub enum Task {
    /// Keeps its gates.
    Keep(Gate),
    /// In each period it is low for `idle`, high for `on`, and low for the rest.
    Modulate { idle: Nanos, on: Nanos },
}

impl Task {
    /// Of a leg that is asked for this, with a carrier of such a period.
    pub fn new<T: Real>(leg: Leg<T>, carrier: Nanos) -> Self {
        match leg {
            Leg::Off => Self::Keep(Gate::Off),
            Leg::Low => Self::Keep(Gate::Low),
            Leg::High => Self::Keep(Gate::High),
            Leg::Duty(duty) => match on_time(duty.to_double(), carrier) {
                Nanos::ZERO => Self::Keep(Gate::Low),
                on if on == carrier => Self::Keep(Gate::High),
                // Centre-aligned: low, high in the middle of the period, low.
                on => Self::Modulate { idle: Nanos((carrier.0 - on.0) / 2), on },
            },
        }
    }

    /// What the leg is told at the begin of the stage.
    fn first(self) -> Gate {
        match self {
            Self::Keep(gate) => gate,
            Self::Modulate { idle: Nanos::ZERO, .. } => Gate::High,
            Self::Modulate { .. } => Gate::Low,
        }
    }
}

/// One leg's requests over one command, in order of time. What repeats the request before is no request.
#[derive(Clone, Copy, Debug)]
pub struct LegPlan {
    /// What the leg does in each of the two stages.
    tasks: [Task; 2],
    start: Nanos,
    /// Ends of the two stages.
    ends: [Nanos; 2],
    carrier: Nanos,
    /// The stage at hand, and whether the next request opens it.
    stage: usize,
    opens: bool,
    /// The next request: when, or never after the last, and which gate.
    at: Nanos,
    gate: Gate,
}

impl LegPlan {
    /// Of a leg that is told nothing.
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

    /// Of a leg with these tasks in the stages of a command.
    pub fn new(tasks: [Task; 2], start: Nanos, ends: [Nanos; 2], carrier: Nanos) -> Self {
        Self { tasks, start, ends, carrier, stage: 0, opens: true, at: start, gate: tasks[0].first() }
    }

    /// The next request, and on to the one after it.
    pub fn take(&mut self) -> Option<(Nanos, Gate)> {
        let request = (self.at, self.gate);
        if self.at == NEVER {
            return None;
        }
        self.advance();
        Some(request)
    }

    /// Steps to the request after this one.
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
        self.stage += 1;
        self.opens = true;
        if self.stage == 1 && self.ends[0] < self.ends[1] {
            (self.at, self.gate) = (self.ends[0], self.tasks[1].first());
        } else {
            (self.stage, self.at) = (2, NEVER);
        }
    }

    /// What the leg is told just before `at`, which lies after the start of the command.
    pub fn told(&self, at: Nanos) -> Gate {
        let before = at - Nanos(1);
        let (stage, stage_start) = if before < self.ends[0] { (0, self.start) } else { (1, self.ends[0]) };
        match self.tasks[stage] {
            Task::Keep(gate) => gate,
            Task::Modulate { idle, on } => {
                let place = (before.0 - stage_start.0) % self.carrier.0;
                if place >= idle.0 && place < idle.0 + on.0 { Gate::High } else { Gate::Low }
            }
        }
    }
}

// A duty between 0 and 1 of a carrier period is a small non-negative number.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn on_time(duty: f64, carrier: Nanos) -> Nanos {
    Nanos((duty.clamp(0.0, 1.0) * carrier.0 as f64).round() as u64)
}

/// One leg: what it is told, and its driver.
#[derive(Clone, Debug)]
struct Line {
    plan: LegPlan,
    driver: GateDriver,
    /// The driver's next edge.
    due: Nanos,
    /// What the leg was told last before the command.
    before: Gate,
}

impl Line {
    /// Gives the driver one request after the other, until its next edge is one that no later request withdraws.
    fn look_ahead(&mut self) {
        while self.plan.at < NEVER && self.driver.next_certain_edge(self.plan.at).is_none() {
            self.tell();
        }
        self.due = self.driver.next_edge().unwrap_or(NEVER);
    }

    fn tell(&mut self) {
        self.driver.request(self.plan.at, self.plan.gate);
        self.plan.advance();
    }
}

/// The gate edges of all legs, command after command.
///
/// What a command will tell the legs is known when it begins: only the edges that follow are instants, not the
/// requests that they follow from.
#[derive(Clone, Debug)]
pub struct Timeline {
    lines: [Line; 3],
    start: Nanos,
    next: Nanos,
}

impl Timeline {
    /// Before the first command, all switches off.
    pub fn new(timings: [GateTiming; 3]) -> Self {
        let line = |timing| Line {
            plan: LegPlan::NONE,
            driver: GateDriver::new(timing),
            due: NEVER,
            before: Gate::Off,
        };
        Self { lines: timings.map(line), start: Nanos::ZERO, next: NEVER }
    }

    /// Lays out the next command, which starts at `start`, where the one before ended.
    pub fn begin<T: Real>(&mut self, command: &Command<T>, start: Nanos, carrier: Nanos) {
        let first = command.stage;
        let second = command.then.unwrap_or(Stage { legs: first.legs, duration: Nanos::ZERO });
        let ends = [start + first.duration, start + first.duration + second.duration];
        let (Abc(a), Abc(b)) = (first.legs, second.legs);
        for (k, line) in self.lines.iter_mut().enumerate() {
            // Requests whose edges come after the end of their command.
            while line.plan.at < NEVER {
                line.tell();
            }
            line.before = line.driver.requested();
            let tasks = [Task::new(a[k], carrier), Task::new(b[k], carrier)];
            line.plan = LegPlan::new(tasks, start, ends, carrier);
            line.look_ahead();
        }
        self.start = start;
        self.find_next();
    }

    fn find_next(&mut self) {
        let [a, b, c] = &self.lines;
        self.next = a.due.min(b.due).min(c.due);
    }

    /// When the next edge comes; later than everything if none does.
    pub const fn next(&self) -> Nanos {
        self.next
    }

    /// What the legs are told just before `at`, a time of this command or its start.
    pub fn told(&self, at: Nanos) -> [Gate; 3] {
        self.lines.each_ref().map(|line| if at > self.start { line.plan.told(at) } else { line.before })
    }

    /// Carries out the edges that are due at `now`: the new gates of the legs whose gates change.
    // Inlined, so that what it returns stays in registers.
    #[inline(always)]
    pub fn take(&mut self, now: Nanos) -> [Option<Gate>; 3] {
        let mut edges = [None; 3];
        for (line, edge) in self.lines.iter_mut().zip(&mut edges) {
            if line.due <= now {
                *edge = line.driver.advance(now).then(|| line.driver.gate());
                line.look_ahead();
            }
        }
        self.find_next();
        edges
    }
}
