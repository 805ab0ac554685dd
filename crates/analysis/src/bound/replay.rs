//! Records a detector's commands and replays them on other plants.

use standstill_interface::{
    Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Sensed, Step,
};
use standstill_sim::{Case, Ended, NoProbe, RunError, Trace, referee, run};

/// Detector that passes each reading on to another detector, and records the commands of that detector.
struct Recorder<D> {
    detector: D,
    commands: Vec<Command<f64>>,
}

impl<D: Detector<f64>> Detector<f64> for Recorder<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let step = self.detector.step(readings);
        if let Step::Drive(command) = &step {
            self.commands.push(*command);
        }
        step
    }
}

/// Detector that replays commands and stores their readings.
struct Player<'a> {
    commands: std::slice::Iter<'a, Command<f64>>,
    /// Tick of the timer in s.
    tick: f64,
    readings: Readings,
}

/// Number of channels of a sample.
pub const CHANNELS: usize = 8;
/// Channel of the DC link's current. The phase currents have channels 0 to 2.
pub const LINK: usize = 3;
/// Channel of the voltage of terminal a. The voltages of terminals b and c have the next two channels.
pub const TERMINAL: usize = 4;
/// Channel of the captured time.
pub const TIME: usize = 7;

/// One value for each channel: three phase currents in A, the DC link's current in A, three terminal voltages in V, and
/// the time in s until a comparator tripped.
pub type Sample = [f64; CHANNELS];

/// Readings of all samples, in the order of their triggers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// Values of each sample.
    pub value: Vec<Sample>,
    /// True for each value that is an independent reading, and false for a value that is derived from others, repeated or missing.
    pub measured: Vec<[bool; CHANNELS]>,
}

impl Readings {
    /// Adds a sample. `tick` is the tick of the timer in s; none if the captured time already counts with an earlier sample.
    fn add(&mut self, reading: &Reading<f64>, tick: Option<f64>) {
        let Reading { current: phase, link_current, terminal, link_sensed, .. } = reading;
        let is_measured = |sensed: &Sensed| *sensed == Sensed::Measured;
        let time = reading.capture.and_then(|capture| Some(f64::from(capture.ticks) * tick?));
        let [a, b, c] = phase.0;
        let [x, y, z] = terminal.0;
        self.value.push([a, b, c, *link_current, x, y, z, time.unwrap_or(0.0)]);
        // With a shunt in the DC link, a phase current is the same reading as the link's current.
        let own = *link_sensed == Sensed::Hidden;
        let [a, b, c] = reading.sensed.0.map(|sensed| own && is_measured(&sensed));
        let [x, y, z] = reading.terminal_sensed.0.map(|sensed| is_measured(&sensed));
        self.measured.push([a, b, c, is_measured(link_sensed), x, y, z, time.is_some()]);
    }
}

impl Detector<f64> for Player<'_> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        // All samples after a trip show the captured time; it counts once.
        let mut tick = Some(self.tick);
        for reading in readings {
            self.readings.add(reading, tick);
            tick = tick.filter(|_| reading.capture.is_none());
        }
        match self.commands.next() {
            Some(command) => Step::Drive(*command),
            None => Step::Done(Outcome::Failed {
                fault: Fault::UnexpectedReadings,
                findings: Findings::default(),
            }),
        }
    }
}

/// Runs a detector on a plant and returns its commands, whatever the detector's outcome. An error means that the simulation could not
/// continue.
pub fn record(case: &Case, detector: impl Detector<f64>) -> Result<Vec<Command<f64>>, RunError> {
    let mut recorder = Recorder { detector, commands: Vec::new() };
    let ended = run(case, &mut recorder, false, &mut NoProbe).ended;
    of_whole(&ended, recorder.commands)
}

fn player<'a>(case: &Case, commands: &'a [Command<f64>]) -> Player<'a> {
    let tick = case.sensors.comparator.tick;
    Player { commands: commands.iter(), tick, readings: Readings::default() }
}

/// Returns `what` if the run reached its end, else the error that stopped the run.
fn of_whole<T>(ended: &Ended<f64>, what: T) -> Result<T, RunError> {
    match ended {
        Ended::Outcome(_) => Ok(what),
        Ended::Error(error) => Err(*error),
    }
}

/// Replays commands on a plant and returns the readings.
pub fn replay(case: &Case, commands: &[Command<f64>]) -> Result<Readings, RunError> {
    let mut player = player(case, commands);
    let ended = run(case, &mut player, false, &mut NoProbe).ended;
    of_whole(&ended, player.readings)
}

/// Replays commands with the referee's integrator and returns the readings.
pub fn replay_refereed(case: &Case, commands: &[Command<f64>]) -> Result<Readings, RunError> {
    let mut player = player(case, commands);
    let ended = referee(case, &mut player, false, &mut NoProbe).ended;
    of_whole(&ended, player.readings)
}

/// Replays commands on a plant and returns the trace of the simulation's events, such as changes of conduction.
pub fn watched(case: &Case, commands: &[Command<f64>]) -> Trace {
    let mut trace = Trace::new(f64::INFINITY);
    run(case, &mut player(case, commands), false, &mut trace);
    trace
}

/// Returns true if a command drives a leg by a duty cycle.
pub fn has_pwm(command: &Command<f64>) -> bool {
    [Some(command.stage), command.then]
        .iter()
        .flatten()
        .any(|stage| stage.legs.0.iter().any(|leg| matches!(leg, Leg::Duty(_))))
}

/// Returns the case with a very short timer tick: a billionth of the longest pulse with a threshold. Rounding to whole ticks then does not
/// disturb the difference quotients of captured times.
pub fn finely_timed<'a>(case: &Case<'a>, commands: &[Command<f64>]) -> Case<'a> {
    let mut case = case.clone();
    let longest = commands.iter().filter(|command| command.threshold.is_some());
    if let Some(longest) = longest.map(|command| command.stage.duration).max() {
        case.sensors.comparator.tick = longest.seconds() * 1e-9;
    }
    case
}

/// Returns the commands with new sampling instants: all whole multiples of `interval` since the beginning of the first command. A command
/// with a threshold has no new ones, because its samples depend on when the comparator trips.
pub fn every(commands: &[Command<f64>], interval: Nanos) -> Vec<Command<f64>> {
    let interval = Nanos(interval.0.max(1));
    let mut start = Nanos::ZERO;
    let resample = |command: &Command<f64>| {
        let first = start.0.next_multiple_of(interval.0) - start.0;
        let duration = command.duration();
        start = start + duration;
        if command.threshold.is_some() {
            return Command { sampling: Sampling::NONE, ..*command };
        }
        // A sample at the end is the first of the next command.
        let count = (duration.0.saturating_sub(first)).div_ceil(interval.0);
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        let sampling =
            if count == 0 { Sampling::NONE } else { Sampling { first: Nanos(first), interval, count } };
        Command { sampling, ..*command }
    };
    commands.iter().map(resample).collect()
}

/// Returns the time derivative of each value at each sample, in the unit of the value per s. It is the central difference of two replays:
/// one samples earlier by `reach`, the other later by `reach`. A sample that would leave its command is not moved, because the sampler
/// clips jitter at the command's ends. The derivative of such a sample is half the one-sided difference quotient, whose effect is slightly
/// smaller than that of the clipped jitter.
pub fn slope(
    case: &Case,
    commands: &[Command<f64>],
    nominal: &Readings,
    reach: Nanos,
) -> Result<Vec<Sample>, RunError> {
    let (mut early, mut late) = (commands.to_vec(), commands.to_vec());
    // For each sample: whether it can be earlier, and whether it can be later.
    let mut free = Vec::with_capacity(nominal.value.len());
    for (early, late) in early.iter_mut().zip(&mut late) {
        let Sampling { first, interval, count } = early.sampling;
        let Some(last) = early.sampling.last() else { continue };
        let (early_cut, late_cut) = (first < reach, last + reach > early.duration());
        free.extend((0..count).map(|n| (!(early_cut && n == 0), !(late_cut && n == count - 1))));
        early.sampling.first = if early_cut { first + interval - reach } else { first - reach };
        early.sampling.count -= u32::from(early_cut);
        late.sampling.first = first + reach;
        late.sampling.count -= u32::from(late_cut);
    }
    let (early, late) = (replay(case, &early)?.value, replay(case, &late)?.value);
    let (mut early, mut late) = (early.iter(), late.iter());
    let mut take = |(at, (before, after)): (&Sample, &(bool, bool))| {
        let from = if *before { early.next()? } else { at };
        let to = if *after { late.next()? } else { at };
        // A captured time does not depend on the instant of the sample.
        let of = |k: usize| if k == TIME { 0.0 } else { (to[k] - from[k]) / (2.0 * reach.seconds()) };
        Some(std::array::from_fn(of))
    };
    Ok(nominal.value.iter().zip(&free).map_while(&mut take).collect())
}

#[cfg(test)]
mod tests {
    use standstill_detect::MethodName;
    use standstill_interface::{Phase, Stage};
    use standstill_plant::built_in;
    use standstill_sim::RotorState;

    use super::*;
    use standstill_scenario::{ErrorSet, Scenario, Specimen};

    #[test]
    fn law_every_multiple_is_sampled_once() {
        let durations = [7, 13, 3, 25, 10, 2, 40].map(Nanos);
        let commands: Vec<Command<f64>> =
            durations.iter().map(|duration| Command::hold(Stage::off(*duration), Sampling::NONE)).collect();
        let mut start = Nanos::ZERO;
        let mut instants = Vec::new();
        for command in every(&commands, Nanos(5)) {
            instants.extend((0..command.sampling.count).map(|n| (start + command.sampling.trigger(n)).0));
            start = start + command.duration();
        }
        assert_eq!(instants, (0..100).step_by(5).collect::<Vec<u64>>());
    }

    #[test]
    fn analytic_slope_of_a_pulse() {
        let mut motor = built_in("paper-5k5").expect("built in").linearised();
        motor.resistance = 0.0;
        let name = MethodName::MaximumLikelihood;
        let scenario = Scenario::of_method(name, motor, ErrorSet::None, RotorState::Locked, 1);
        let case = scenario.case_at(0.4, Specimen { drive: 0, noise: 0 });
        let slope_on = 550.0 / scenario.motor.winding.line_inductance(Phase::A, Phase::B, 0.4);
        let sampling = Sampling { first: Nanos::ZERO, interval: Nanos::from_micros(10), count: 5 };
        let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(40));
        let commands = [Command::hold(pulse, sampling)];
        let nominal = replay(&case, &commands).expect("simulated");
        let slope = slope(&case, &commands, &nominal, Nanos(500)).expect("simulated");
        for (got, share) in slope.iter().zip([0.5, 1.0, 1.0, 1.0, 0.5]) {
            assert!((got[0] / slope_on - share).abs() < 1e-6 && got[2].abs() < 1e-3, "{got:?} {slope_on}");
        }
    }
}
