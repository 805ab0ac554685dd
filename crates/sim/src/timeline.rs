//! From a command to what each leg is told, and when.

use standstill_interface::{Abc, Command, Leg, Nanos, Real, Stage};
use standstill_inverter::Gate;

/// One leg's requests over one command, in order of time.
#[derive(Clone, Copy, Debug)]
struct LegPlan {
    /// What the leg does in each of the two stages.
    tasks: [Task; 2],
    /// Ends of the two stages.
    ends: [Nanos; 2],
    carrier: Nanos,
    stage: usize,
    /// Begin of the PWM period and number of the switching instant within it.
    begin: Nanos,
    part: u8,
    start: Nanos,
    /// The next request: when, and which gate.
    next: Option<(Nanos, Gate)>,
}

/// What a leg does in a stage.
#[derive(Clone, Copy, Debug)]
enum Task {
    /// Keeps its gates.
    Keep(Gate),
    /// In each period it is low for `idle`, high for `on`, and low for the rest.
    Modulate { idle: Nanos, on: Nanos },
}

impl Task {
    fn new<T: Real>(leg: Leg<T>, carrier: Nanos) -> Self {
        match leg {
            Leg::Off => Self::Keep(Gate::Off),
            Leg::Low => Self::Keep(Gate::Low),
            Leg::High => Self::Keep(Gate::High),
            Leg::Duty(duty) => {
                // Centre-aligned: low, high in the middle of the period, low.
                let on = on_time(duty.to_double(), carrier);
                Self::Modulate { idle: Nanos((carrier.0 - on.0) / 2), on }
            }
        }
    }
}

impl LegPlan {
    fn new(tasks: [Task; 2], start: Nanos, ends: [Nanos; 2], carrier: Nanos) -> Self {
        let mut plan = Self { tasks, ends, carrier, stage: 0, begin: start, part: 0, start, next: None };
        plan.next = plan.request();
        plan
    }

    /// The request at hand.
    fn request(&self) -> Option<(Nanos, Gate)> {
        let begin = self.begin;
        Some(match *self.tasks.get(self.stage)? {
            Task::Keep(gate) => (begin, gate),
            Task::Modulate { idle, on } => match self.part {
                0 => (begin, if idle == Nanos::ZERO { Gate::High } else { Gate::Low }),
                1 => (begin + idle, if on == Nanos::ZERO { Gate::Low } else { Gate::High }),
                _ => (begin + idle + on, if idle == Nanos::ZERO { Gate::High } else { Gate::Low }),
            },
        })
    }

    /// Steps to the request after this one.
    fn advance(&mut self) {
        if let Some(Task::Modulate { .. }) = self.tasks.get(self.stage) {
            self.part += 1;
            if self.part == 3 {
                (self.part, self.begin) = (0, self.begin + self.carrier);
            }
            self.next = self.request();
            if self.next.is_some_and(|(at, _)| at < self.ends[self.stage]) {
                return;
            }
        }
        self.stage += 1;
        (self.begin, self.part) = (self.ends[0], 0);
        if self.stage < 2 && self.ends[0] == self.ends[1] {
            self.stage = 2;
        }
        self.next = self.request();
    }

    /// What the leg is told just before `at`, which lies after the start of the command.
    fn told(&self, at: Nanos) -> Gate {
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

/// Later than any request.
const NEVER: Nanos = Nanos(u64::MAX);

/// All requests of one command.
#[derive(Clone, Debug)]
pub struct Timeline {
    plans: [LegPlan; 3],
    /// End of the command.
    pub end: Nanos,
}

impl Timeline {
    /// Lays out a command that starts at `start`.
    pub fn new<T: Real>(command: &Command<T>, start: Nanos, carrier: Nanos) -> Self {
        let first = command.stage;
        let second = command.then.unwrap_or(Stage { legs: first.legs, duration: Nanos::ZERO });
        let ends = [start + first.duration, start + first.duration + second.duration];
        let (Abc(a), Abc(b)) = (first.legs, second.legs);
        let plans = [0, 1, 2].map(|k| {
            LegPlan::new([Task::new(a[k], carrier), Task::new(b[k], carrier)], start, ends, carrier)
        });
        Self { plans, end: ends[1] }
    }

    /// When the next request comes; none after the last.
    pub fn next(&self) -> Option<Nanos> {
        let [a, b, c] = self.plans.each_ref().map(|plan| plan.next.map_or(NEVER, |(at, _)| at));
        let next = a.min(b).min(c);
        (next < NEVER).then_some(next)
    }

    /// What the legs are told just before `at`, for a time after the start of the command.
    pub fn told(&self, at: Nanos) -> [Gate; 3] {
        [0, 1, 2].map(|k| self.plans[k].told(at))
    }

    /// Takes the next request of leg `k` that is due at `now`.
    #[inline]
    pub fn take(&mut self, k: usize, now: Nanos) -> Option<Gate> {
        let (at, gate) = self.plans[k].next?;
        (at <= now).then(|| {
            self.plans[k].advance();
            gate
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standstill_interface::{Phase, Sampling};

    fn requests(command: &Command<f64>, leg: usize) -> Vec<(u64, Gate)> {
        let mut line = Timeline::new(command, Nanos(1000), Nanos::from_micros(100));
        let mut seen = Vec::new();
        while let Some(at) = line.next() {
            for k in 0..3 {
                while let Some(gate) = line.take(k, at) {
                    if k == leg {
                        seen.push((at.0, gate));
                    }
                }
            }
        }
        seen
    }

    #[test]
    fn analytic_a_pulse_and_its_decay() {
        let command = Command::sequence(
            Stage::line(Phase::A, Phase::B, Nanos::from_micros(80)),
            Stage::freewheel(Phase::A, Phase::B, Nanos::from_micros(20)),
            Sampling::NONE,
        );
        assert_eq!(requests(&command, 0), [(1000, Gate::High), (81_000, Gate::Low)]);
        assert_eq!(requests(&command, 2), [(1000, Gate::Off), (81_000, Gate::Off)]);
    }

    #[test]
    fn analytic_pwm_is_centred() {
        let legs = Abc::new(Leg::Duty(0.5), Leg::Duty(0.0), Leg::Duty(1.0));
        let command = Command::hold(Stage { legs, duration: Nanos::from_micros(200) }, Sampling::NONE);
        assert_eq!(
            requests(&command, 0),
            [
                (1000, Gate::Low),
                (26_000, Gate::High),
                (76_000, Gate::Low),
                (101_000, Gate::Low),
                (126_000, Gate::High),
                (176_000, Gate::Low),
            ]
        );
        let line = Timeline::new(&command, Nanos(1000), Nanos::from_micros(100));
        for (at, expected) in [
            (26_000, Gate::Low),
            (26_001, Gate::High),
            (76_000, Gate::High),
            (76_001, Gate::Low),
            (201_000, Gate::Low),
        ] {
            assert_eq!(line.told(Nanos(at))[0], expected, "{at}");
        }
        assert!(requests(&command, 1).iter().all(|(_, gate)| *gate == Gate::Low));
        assert!(requests(&command, 2).iter().all(|(_, gate)| *gate == Gate::High));
    }
}
