//! Every reading that a method gets, against what the hardware shows: which sensors there are, which device carries a current at that
//! instant, and when an amplifier has settled. The definition stands here once more, from the machine's snapshots and gates alone.

use std::cell::RefCell;
use std::path::Path;

use standstill_detect::{Method, MethodName, Settings as _};
use standstill_interface::{Command, Detector, Phase, Reading, Sensed, Step};
use standstill_inverter::{Conduction, Gate};
use standstill_scenario::{Document, Origin, Plan, Scenario};
use standstill_sim::{Arrangement, Comparators, Ended, Event, Probe, Snapshot, run};

/// Settling time in s of shunts' amplifiers.
const SETTLE: f64 = 2e-6;

/// What a run did, as far as readings depend on it.
#[derive(Default)]
struct Course {
    /// The last snapshot, and the last one that is earlier.
    now: Option<Snapshot>,
    before: Option<Snapshot>,
    /// The last change of each gate and the one before: to what, and when in s.
    gates: [[(Option<Gate>, f64); 2]; 3],
    /// Begin in s of the command under way, and its threshold in A.
    command: f64,
    threshold: Option<f64>,
    /// The trip within the command: its time in s, and the machine there.
    trip: Option<(f64, Phase, Snapshot)>,
    samples: Vec<Reading<f64>>,
    /// Valid values so far: of phases, of the link, of terminals, captures.
    valid: [usize; 4],
}

/// The detector and the probe of a run, with what both see.
struct Watched<'a, D>(D, &'a RefCell<Course>);

impl<D: Detector<f64>> Detector<f64> for Watched<'_, D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        // What it gets is what was sampled, and was looked at there.
        let samples = std::mem::take(&mut self.1.borrow_mut().samples);
        assert_eq!(readings, samples);
        let step = self.0.step(readings);
        if let Step::Drive(Command { threshold, .. }) = &step {
            self.1.borrow_mut().threshold = *threshold;
        }
        step
    }
}

struct Looking<'a>(&'a Scenario<Method<f64>>, &'a RefCell<Course>);

impl Probe for Looking<'_> {
    fn resolution(&self) -> Option<f64> {
        Some(1.0)
    }

    fn snapshot(&mut self, snapshot: &Snapshot) {
        let mut course = self.1.borrow_mut();
        if course.now.is_some_and(|now| now.time < snapshot.time) {
            course.before = course.now;
        }
        course.now = Some(*snapshot);
    }

    fn event(&mut self, time: f64, event: Event) {
        let mut course = self.1.borrow_mut();
        match event {
            Event::Command => (course.command, course.trip) = (time, None),
            Event::Gate(phase, gate) => {
                let [last, _] = course.gates[phase as usize];
                course.gates[phase as usize] = [(Some(gate), time), last];
            }
            Event::Trip(phase) => {
                let now = course.now.expect("a snapshot at the trip");
                course.trip = Some((time, phase, now));
            }
            Event::Sample(reading) => {
                look(self.0, &mut course, time, &reading);
                course.samples.push(reading);
            }
            _ => {}
        }
    }
}

/// What a sensor shows of a leg's current in A.
fn shown(arrangement: Arrangement, mode: Conduction, current: f64) -> f64 {
    let lower = matches!(mode, Conduction::LowerSwitch | Conduction::LowerDiode);
    if arrangement != Arrangement::LowSideShunts || lower { current } else { 0.0 }
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9 * (1.0 + b.abs())
}

/// Compares a reading with the machine at that instant.
fn look(scenario: &Scenario<Method<f64>>, course: &mut Course, time: f64, reading: &Reading<f64>) {
    let sensors = &scenario.sensors;
    let arrangement = sensors.arrangement;
    let now = course.now.expect("snapshots");
    assert!((now.time - time).abs() < 1e-12, "a snapshot at {} of a sample at {time}", now.time);
    // A sample comes before the edges of its instant.
    let modes = course.before.map_or([Conduction::Blocked; 3], |before| before.modes);
    let change = |k: usize| {
        let [last, earlier] = course.gates[k];
        if last.1 < time - 1e-12 { last } else { earlier }
    };
    let gate = |k: usize| change(k).0.unwrap_or(Gate::Off);
    let settled = |k: usize| !arrangement.follows_legs() || time - change(k).1 > SETTLE - 1e-12;
    let all_settled = (0..3).all(settled);
    let seen: [f64; 3] = std::array::from_fn(|k| shown(arrangement, modes[k], now.current[k]));
    let drawn: f64 = (0..3).filter(|k| modes[*k].is_upper()).map(|k| now.current[k]).sum();
    let place = format!("{arrangement:?} at {time}: {reading:?} of {modes:?} {:?}", course.gates);
    for (k, phase) in Phase::ALL.into_iter().enumerate() {
        let (value, sensed) = (reading.current[phase], reading.sensed[phase]);
        let [x, y] = [(k + 1) % 3, (k + 2) % 3];
        if sensed == Sensed::Hidden {
            assert_eq!(value, 0.0, "{place}");
            continue;
        }
        course.valid[0] += 1;
        match arrangement {
            Arrangement::ThreeInLine => {
                assert!(sensed == Sensed::Measured && same(value, now.current[k]), "{place}");
            }
            Arrangement::TwoInLine => {
                let wanted = if k < 2 { Sensed::Measured } else { Sensed::Derived };
                assert!(sensed == wanted && same(value, now.current[k]), "{place}");
            }
            Arrangement::LowSideShunts if sensed == Sensed::Measured => {
                assert!(gate(k) != Gate::High && settled(k) && same(value, seen[k]), "{place}");
            }
            Arrangement::LowSideShunts => {
                assert_eq!(sensed, Sensed::Derived, "{place}");
                let both = [x, y].into_iter().all(|k| gate(k) != Gate::High && settled(k));
                assert!(both && same(value, -seen[x] - seen[y]), "{place}");
            }
            Arrangement::DcLinkShunt => {
                let (high, low) = (|k: usize| gate(k) == Gate::High, |k: usize| gate(k) == Gate::Low);
                let alone_high = high(k) && low(x) && low(y);
                let alone_low = low(k) && high(x) && high(y);
                assert!(all_settled && (alone_high || alone_low), "{place}");
                assert!(same(value, if alone_high { drawn } else { -drawn }), "{place}");
                assert!(same(value, now.current[k]), "{place}");
            }
            Arrangement::None => panic!("{place}"),
        }
    }
    if reading.link_sensed == Sensed::Hidden {
        assert_eq!(reading.link_current, 0.0, "{place}");
    } else {
        course.valid[1] += 1;
        let there = arrangement == Arrangement::DcLinkShunt && all_settled;
        assert!(there && same(reading.link_current, drawn), "{place}");
    }
    for (k, phase) in Phase::ALL.into_iter().enumerate() {
        if reading.terminal_sensed[phase] == Sensed::Hidden {
            assert!(sensors.terminal.is_none() && reading.terminal[phase] == 0.0, "{place}");
        } else {
            course.valid[2] += 1;
            assert!(sensors.terminal.is_some(), "{place}");
            let conducts = modes[k] != Conduction::Blocked;
            // Where a leg floats, what holds it may change with the edge of this instant.
            let wanted = course
                .before
                .filter(|_| conducts)
                .map(|_| if modes[k].is_upper() { now.dc_link } else { 0.0 });
            assert!(wanted.is_none_or(|wanted| (reading.terminal[phase] - wanted).abs() < 1e-6), "{place}");
        }
    }
    assert!(same(reading.dc_link, now.dc_link) && !reading.dc_link_clipped, "{place}");
    look_at_capture(scenario, course, reading, &place);
}

/// Compares a captured time with the trip: where the watched current is the threshold, on a drive that has a timer.
fn look_at_capture(
    scenario: &Scenario<Method<f64>>,
    course: &mut Course,
    reading: &Reading<f64>,
    place: &str,
) {
    let comparator = &scenario.sensors.comparator;
    let Some(capture) = reading.capture else {
        assert!(course.trip.is_none(), "a trip that nobody captured: {place}");
        return;
    };
    course.valid[3] += 1;
    let (trip, phase, there) = course.trip.expect("a trip");
    let threshold = course.threshold.expect("a threshold");
    assert!(comparator.timer > 0.0 && capture.comparator == phase, "{place}");
    let watched = match comparator.arrangement {
        Comparators::Common => there.link_current(),
        Comparators::PerLeg => {
            let k = phase as usize;
            shown(scenario.sensors.arrangement, there.modes[k], there.current[k]).abs()
        }
    };
    assert!((watched - threshold).abs() < 1e-6 * threshold, "{watched} A where {threshold} A trip: {place}");
    // Within half a tick by where the timer stood, and one by which it rounds down.
    let ticks = (trip - course.command) / comparator.timer;
    assert!((f64::from(capture.ticks) + 0.5 - ticks).abs() <= 1.0 + 1e-6, "{ticks} ticks: {place}");
}

/// The scenario of a method on a drive; none where the drive is refused for the method.
fn scenario(method: MethodName, arrangement: Arrangement, more: &str) -> Option<Scenario<Method<f64>>> {
    let name = arrangement.name();
    let text = format!("errors = \"none\"\nsensors.arrangement = \"{name}\"\n{more}");
    let mut document = Document::parse(Path::new("s.toml"), &text).expect("TOML");
    document.set("detector.method", method.name(), Origin::CommandLine).expect("a key");
    if method == MethodName::DcAlignment {
        document.set("rotor.state", "free", Origin::CommandLine).expect("a key");
    }
    if arrangement.follows_legs() {
        document.set("sensors.settle", "2 us", Origin::CommandLine).expect("a key");
    }
    match Plan::new(document).and_then(|plan| plan.scenario(0)) {
        Ok(scenario) => Some(scenario),
        Err(error) => {
            let said = error.to_string();
            assert!(said.contains("`detector.method`") && said.contains("needed"), "{said}");
            None
        }
    }
}

/// Valid values of a whole detection.
fn looked_at(scenario: &Scenario<Method<f64>>, trial: u64) -> [usize; 4] {
    let course = RefCell::new(Course::default());
    let mut detector = Watched(scenario.detector.detector().expect("settings"), &course);
    let run = run(&scenario.case(trial), &mut detector, false, &mut Looking(scenario, &course));
    assert!(matches!(run.ended, Ended::Outcome(_)), "{:?}", run.ended);
    course.into_inner().valid
}

#[test]
fn law_a_method_gets_no_reading_that_its_hardware_would_not_have() {
    let drives = [
        "",
        "sensors.terminals = true\nsensors.timer = 1e-7\n",
        "sensors.timer = 1e-7\nsensors.comparators = \"per-leg\"\n",
    ];
    let mut served = 0;
    for method in MethodName::ALL {
        for arrangement in Arrangement::ALL {
            for more in drives {
                let own = more.contains("per-leg");
                let each = [Arrangement::ThreeInLine, Arrangement::LowSideShunts].contains(&arrangement);
                if own && !(each && method == MethodName::SixPulse) {
                    continue;
                }
                let Some(scenario) = scenario(method, arrangement, more) else { continue };
                served += 1;
                let [phases, link, terminals, captures] = looked_at(&scenario, 3);
                let place =
                    format!("{method}, {arrangement:?}, {more}: {phases} {link} {terminals} {captures}");
                // What the drive has was there to look at, and what it lacks was not.
                let timed = scenario.detector.get(&standstill_detect::keys::TIMED)
                    == Some(standstill_detect::Value::Flag(true));
                assert_eq!(captures, if timed { 6 } else { 0 }, "{place}");
                assert_eq!(terminals > 0, more.contains("terminals"), "{place}");
                assert_eq!(link > 0, arrangement == Arrangement::DcLinkShunt, "{place}");
                // With a leg open the drive cannot say whose current the link's is.
                match arrangement {
                    Arrangement::None => assert_eq!(phases, 0, "{place}"),
                    Arrangement::DcLinkShunt => {}
                    _ => assert!(phases > 0, "{place}"),
                }
            }
        }
    }
    // Of 11 methods on 5 arrangements, without and with terminals and timer, and twice with comparators of each leg.
    assert!(served > 60, "{served}");
}
