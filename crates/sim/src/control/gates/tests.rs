use std::collections::VecDeque;

use super::*;
use crate::control::requests::on_time;
use standstill_interface::{Leg, Phase, Sampling};

const CARRIER: Nanos = Nanos::from_micros(100);

fn requests(command: &Command<f64>, leg: usize) -> Vec<(u64, Gate)> {
    let start = Nanos(1000);
    let then = command.then.unwrap_or(Stage { legs: command.stage.legs, duration: Nanos::ZERO });
    let ends = [start + command.stage.duration, start + command.duration()];
    let tasks = [command.stage, then].map(|stage| Task::new(stage.legs.0[leg], CARRIER));
    let mut plan = LegPlan::new(tasks, start, ends, CARRIER);
    std::iter::from_fn(|| plan.take()).map(|(at, gate)| (at.0, gate)).collect()
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
    let rises_and_falls = [
        (1000, Gate::Low),
        (26_000, Gate::High),
        (76_000, Gate::Low),
        (126_000, Gate::High),
        (176_000, Gate::Low),
    ];
    assert_eq!(requests(&command, 0), rises_and_falls);
    let (mut lines, mut gates) =
        (GateSequencer::new([GateTiming::default(); 3], true), Legs::<f64>::idle(false, false));
    lines.begin(&mut gates, 0, &command, Nanos(1000), CARRIER);
    for (at, expected) in [
        (1000, Gate::Off),
        (26_000, Gate::Low),
        (26_001, Gate::High),
        (76_000, Gate::High),
        (76_001, Gate::Low),
        (201_000, Gate::Low),
    ] {
        assert_eq!(lines.requested(Nanos(at))[0], expected, "{at}");
    }
    assert_eq!(requests(&command, 1), [(1000, Gate::Low)]);
    assert_eq!(requests(&command, 2), [(1000, Gate::High)]);
}

/// A gate driver as in hardware: it gets each request at its time, switches off, and after the dead time switches on.
#[derive(Default)]
struct Driver {
    timing: GateTiming,
    requested: Gate,
    gate: Gate,
    edges: VecDeque<(Nanos, Gate)>,
}

impl Driver {
    fn request(&mut self, at: Nanos, wanted: Gate) {
        if wanted == self.requested {
            return;
        }
        self.requested = wanted;
        let off_at = at + self.timing.turn_off_delay;
        // Cancels a turn-on that would come after this turn-off: a pulse shorter than the dead time is lost.
        while self.edges.back().is_some_and(|(edge, _)| *edge >= off_at) {
            self.edges.pop_back();
        }
        self.edges.push_back((off_at, Gate::Off));
        if wanted != Gate::Off {
            let on_at = (at + self.timing.dead_time + self.timing.turn_on_delay).max(off_at);
            self.edges.push_back((on_at, wanted));
        }
    }

    fn advance(&mut self, now: Nanos) {
        while let Some((_, gate)) = self.edges.front().filter(|(at, _)| *at <= now) {
            self.gate = *gate;
            self.edges.pop_front();
        }
    }
}

/// Returns all requests of a command to a leg, also those that change nothing, with their times.
fn all_requests(command: &Command<f64>, leg: usize, start: Nanos) -> Vec<(Nanos, Gate)> {
    let mut seen = Vec::new();
    let mut begin = start;
    for stage in [Some(command.stage), command.then].into_iter().flatten() {
        let end = begin + stage.duration;
        match stage.legs.0[leg] {
            Leg::Off => seen.push((begin, Gate::Off)),
            // A change at the begin of the stage: the leg does not switch within it.
            Leg::Low | Leg::Fall(Nanos::ZERO) => seen.push((begin, Gate::Low)),
            Leg::High | Leg::Rise(Nanos::ZERO) => seen.push((begin, Gate::High)),
            Leg::Rise(after) => {
                seen.extend([(begin, Gate::Low), (begin + after, Gate::High)]);
                seen.retain(|(at, _)| *at < end || *at == begin);
            }
            Leg::Fall(after) => {
                seen.extend([(begin, Gate::High), (begin + after, Gate::Low)]);
                seen.retain(|(at, _)| *at < end || *at == begin);
            }
            Leg::Duty(duty) => {
                let on = on_time(duty, CARRIER);
                let idle = Nanos((CARRIER.0 - on.0) / 2);
                let (outer, inner) = (
                    if idle == Nanos::ZERO { Gate::High } else { Gate::Low },
                    if on == Nanos::ZERO { Gate::Low } else { Gate::High },
                );
                seen.push((begin, outer));
                let mut period = begin;
                while period < end {
                    let parts = [(period, outer), (period + idle, inner), (period + idle + on, outer)];
                    seen.extend(parts.into_iter().filter(|(at, _)| *at < end));
                    period = period + CARRIER;
                }
            }
        }
        begin = end;
    }
    seen
}

/// Random numbers below `n`, enough to shuffle test cases.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    fn leg(&mut self) -> Leg<f64> {
        match self.below(10) {
            0 => Leg::Off,
            1 => Leg::Low,
            2 => Leg::High,
            3 => Leg::Duty(0.0),
            4 => Leg::Duty(1.0),
            // Pulses and gaps around the delays and the dead time.
            5 => Leg::Duty(self.below(6000) as f64 * 1e-5),
            // A single change of the leg, also at the begin or at the end of a stage.
            8 => Leg::Rise(Nanos(self.below(30) * 1000)),
            9 => Leg::Fall(Nanos(self.below(300_000))),
            6 => Leg::Duty(1.0 - self.below(6000) as f64 * 1e-5),
            _ => Leg::Duty(self.below(1000) as f64 * 1e-3),
        }
    }

    fn stage(&mut self) -> Stage<f64> {
        let duration = match self.below(4) {
            0 => Nanos(self.below(8) * 1000),
            1 => CARRIER * self.below(3),
            _ => Nanos(self.below(300_000)),
        };
        Stage { legs: Abc::new(self.leg(), self.leg(), self.leg()), duration }
    }
}

/// The gates equal at all times those of drivers that get every request at its time, for random commands.
#[test]
fn law_gates_as_numbers_are_those_of_every_request_at_its_time() {
    let mut dice = Dice(1);
    let mut edges = 0;
    for case in 0..400 {
        let dead = [0, 2000, 500][case % 3];
        let timings = std::array::from_fn(|_| GateTiming {
            turn_off_delay: Nanos(dice.below(4) * 100),
            turn_on_delay: Nanos(dice.below(400)),
            dead_time: Nanos(dead),
        });
        let (mut lines, mut legs) = (GateSequencer::new(timings, true), Legs::<f64>::idle(false, false));
        let mut drivers = timings.map(|timing| Driver { timing, ..Driver::default() });
        let mut requested = [Gate::Off; 3];
        let mut changed = [None; 3];
        let mut now = Nanos(dice.below(1000));
        let mut known = [0.0; 3];
        for _ in 0..12 {
            let then = (dice.below(2) == 0).then(|| dice.stage());
            let command = Command { stage: dice.stage(), then, sampling: Sampling::NONE, threshold: None };
            let (start, end) = (now, now + command.duration());
            if end == start {
                continue;
            }
            lines.begin(&mut legs, 0, &command, start, CARRIER);
            assert_eq!(lines.requested(start), requested, "case {case}");
            known = std::array::from_fn(|leg| {
                legs.gates[leg].next_edge(start.0 as f64, false, false, false).min(known[leg])
            });
            let requests: [_; 3] = std::array::from_fn(|leg| all_requests(&command, leg, start));
            let mut given = [0; 3];
            while now < end {
                let time = now.0 as f64;
                assert_eq!(lines.changed(now), changed, "case {case} at {now:?}");
                for leg in 0..3 {
                    while let Some((at, gate)) = requests[leg].get(given[leg])
                        && *at <= now
                    {
                        given[leg] += 1;
                        if requested[leg] != *gate {
                            changed[leg] = Some(*at);
                        }
                        requested[leg] = *gate;
                        drivers[leg].request(now, *gate);
                    }
                    let before = drivers[leg].gate;
                    drivers[leg].advance(now);
                    if drivers[leg].gate != before {
                        edges += 1;
                        // The edge was announced before, so that no step would have gone beyond it.
                        assert!(now == start || known[leg] <= time, "case {case} at {now:?}: {}", known[leg]);
                    }
                    // One executed request is replaced, as while a current flows; at the begin of a command, all are.
                    let mut again = true;
                    while again && legs.gates[leg].is_carried_out(0, time, 0.0, false) {
                        lines.carry_out(&mut legs, 0, leg);
                        again = now == start;
                    }
                    assert_eq!(legs.gates[leg].of(0, time), drivers[leg].gate, "case {case} at {now:?}");
                    known[leg] = legs.gates[leg].next_edge(time, false, false, false);
                    assert!(known[leg] >= time, "case {case} at {now:?}: {} is over", known[leg]);
                }
                now = (0..3)
                    .flat_map(|leg| {
                        let next = legs.gates[leg].next_of(0, time).0;
                        // A time that never comes is left out.
                        let ours = (next < 1e15).then(|| Nanos::from_seconds(next * 1e-9));
                        let theirs = drivers[leg].edges.front().map(|(at, _)| *at);
                        [
                            requests[leg].get(given[leg]).map(|(at, _)| *at),
                            theirs,
                            ours.filter(|at| *at > now),
                        ]
                    })
                    .flatten()
                    .fold(end, Nanos::min);
            }
        }
    }
    assert!(edges > 20_000, "{edges}");
}
