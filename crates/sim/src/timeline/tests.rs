use super::*;
use standstill_interface::{Phase, Sampling};

const CARRIER: Nanos = Nanos::from_micros(100);

fn plan(command: &Command<f64>, leg: usize, start: Nanos) -> LegPlan {
    let mut line = Timeline::new([GateTiming::default(); 3]);
    line.begin(command, start, CARRIER);
    let ends = line.lines[leg].plan.ends;
    LegPlan::new(line.lines[leg].plan.tasks, start, ends, CARRIER)
}

fn requests(command: &Command<f64>, leg: usize) -> Vec<(u64, Gate)> {
    let mut plan = plan(command, leg, Nanos(1000));
    let mut seen = Vec::new();
    while plan.at < NEVER {
        seen.push((plan.at.0, plan.gate));
        plan.advance();
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
    let rises_and_falls = [
        (1000, Gate::Low),
        (26_000, Gate::High),
        (76_000, Gate::Low),
        (126_000, Gate::High),
        (176_000, Gate::Low),
    ];
    assert_eq!(requests(&command, 0), rises_and_falls);
    let mut line = Timeline::new([GateTiming::default(); 3]);
    line.begin(&command, Nanos(1000), CARRIER);
    for (at, expected) in [
        (1000, Gate::Off),
        (26_000, Gate::Low),
        (26_001, Gate::High),
        (76_000, Gate::High),
        (76_001, Gate::Low),
        (201_000, Gate::Low),
    ] {
        assert_eq!(line.told(Nanos(at))[0], expected, "{at}");
    }
    assert_eq!(requests(&command, 1), [(1000, Gate::Low)]);
    assert_eq!(requests(&command, 2), [(1000, Gate::High)]);
}

/// All requests of a command one by one, those that change nothing too.
fn all_requests(command: &Command<f64>, leg: usize, start: Nanos) -> Vec<(Nanos, Gate)> {
    let mut seen = Vec::new();
    let mut begin = start;
    for stage in [Some(command.stage), command.then].into_iter().flatten() {
        let end = begin + stage.duration;
        match stage.legs.0[leg] {
            Leg::Off => seen.push((begin, Gate::Off)),
            Leg::Low => seen.push((begin, Gate::Low)),
            Leg::High => seen.push((begin, Gate::High)),
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
        match self.below(8) {
            0 => Leg::Off,
            1 => Leg::Low,
            2 => Leg::High,
            3 => Leg::Duty(0.0),
            4 => Leg::Duty(1.0),
            // Pulses and gaps around the delays and the dead time.
            5 => Leg::Duty(self.below(6000) as f64 * 1e-5),
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

/// Against what visits every request at its time: the same edges at the same times, whatever was told when.
#[test]
fn law_looking_ahead_gives_the_edges_of_every_request_at_its_time() {
    let mut dice = Dice(1);
    let mut edges = 0;
    for case in 0..400 {
        let dead = [0, 2000, 500][case % 3];
        let timings = std::array::from_fn(|_| GateTiming {
            turn_off_delay: Nanos(dice.below(4) * 100),
            turn_on_delay: Nanos(dice.below(400)),
            dead_time: Nanos(dead),
        });
        let mut timeline = Timeline::new(timings);
        let mut drivers = timings.map(GateDriver::new);
        let mut requested = [Gate::Off; 3];
        let mut now = Nanos(dice.below(1000));
        for _ in 0..12 {
            let then = (dice.below(2) == 0).then(|| dice.stage());
            let command = Command { stage: dice.stage(), then, sampling: Sampling::NONE };
            let (start, end) = (now, now + command.duration());
            if end == start {
                continue;
            }
            timeline.begin(&command, start, CARRIER);
            assert_eq!(timeline.told(start), requested, "case {case}");
            let requests: [_; 3] = std::array::from_fn(|leg| all_requests(&command, leg, start));
            let mut given = [0; 3];
            while now < end {
                let mut changes = [None; 3];
                for leg in 0..3 {
                    while let Some((at, gate)) = requests[leg].get(given[leg])
                        && *at <= now
                    {
                        given[leg] += 1;
                        requested[leg] = *gate;
                        drivers[leg].request(now, *gate);
                    }
                    if drivers[leg].advance(now) {
                        changes[leg] = Some(drivers[leg].gate());
                    }
                }
                let found = if timeline.next() <= now { timeline.take(now) } else { [None; 3] };
                assert_eq!(found, changes, "case {case} at {now:?}");
                edges += changes.iter().flatten().count();
                now = (0..3)
                    .flat_map(|leg| {
                        [requests[leg].get(given[leg]).map(|(at, _)| *at), drivers[leg].next_edge()]
                    })
                    .flatten()
                    .fold(end, Nanos::min);
                assert!(timeline.next() >= now, "case {case}: an edge too early");
            }
        }
    }
    assert!(edges > 20_000, "{edges}");
}
