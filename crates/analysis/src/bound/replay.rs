//! Records a detector's commands and replays them on other plants.

use standstill_interface::{
    Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Sensed, Step,
};
use standstill_sim::{Case, Ended, NoProbe, RunError, run};

/// Detector that records each command of an inner detector.
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

/// Detector that replays commands and keeps their readings.
struct Player<'a> {
    commands: std::slice::Iter<'a, Command<f64>>,
    readings: Readings,
}

/// Phase currents of all samples, in the order of their triggers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// Currents of the three phases in A.
    pub current: Vec<[f64; 3]>,
    /// True for each phase whose current a sensor measured.
    pub measured: Vec<[bool; 3]>,
}

impl Detector<f64> for Player<'_> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        for reading in readings {
            self.readings.current.push(reading.current.0);
            self.readings.measured.push(reading.sensed.0.map(|sensed| sensed == Sensed::Measured));
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

/// Records the commands that a detector gives, whatever its conclusion is.
pub fn record(case: &Case, detector: impl Detector<f64>) -> Result<Vec<Command<f64>>, RunError> {
    let mut recorder = Recorder { detector, commands: Vec::new() };
    match run(case, &mut recorder, false, &mut NoProbe).ended {
        Ended::Outcome(_) => Ok(recorder.commands),
        Ended::Error(error) => Err(error),
    }
}

/// Replays commands on a plant and returns the readings.
pub fn replay(case: &Case, commands: &[Command<f64>]) -> Result<Readings, RunError> {
    let mut player = Player { commands: commands.iter(), readings: Readings::default() };
    match run(case, &mut player, false, &mut NoProbe).ended {
        Ended::Outcome(_) => Ok(player.readings),
        Ended::Error(error) => Err(error),
    }
}

/// Returns true if a leg has a duty cycle.
pub fn has_pwm(command: &Command<f64>) -> bool {
    [Some(command.stage), command.then]
        .iter()
        .flatten()
        .any(|stage| stage.legs.0.iter().any(|leg| matches!(leg, Leg::Duty(_))))
}

/// Returns these commands with samples at all whole multiples of `interval` since the beginning of the first command.
pub fn every(commands: &[Command<f64>], interval: Nanos) -> Vec<Command<f64>> {
    let interval = Nanos(interval.0.max(1));
    let mut start = Nanos::ZERO;
    let resample = |command: &Command<f64>| {
        let first = start.0.next_multiple_of(interval.0) - start.0;
        let duration = command.duration();
        start = start + duration;
        // A sample at the end is the first of the next command.
        let count = (duration.0.saturating_sub(first)).div_ceil(interval.0);
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        let sampling =
            if count == 0 { Sampling::NONE } else { Sampling { first: Nanos(first), interval, count } };
        Command { sampling, ..*command }
    };
    commands.iter().map(resample).collect()
}

/// Returns the slopes of the currents in A/s about each sample, from the readings `reach` before and `reach` after. A sample that
/// would leave its command stays at its instant, as the sampler keeps it; half a slope is then slightly less than what the
/// clipped jitter makes.
pub fn slope(
    case: &Case,
    commands: &[Command<f64>],
    nominal: &Readings,
    reach: Nanos,
) -> Result<Vec<[f64; 3]>, RunError> {
    let (mut early, mut late) = (commands.to_vec(), commands.to_vec());
    // Of each sample, whether it can be earlier and whether it can be later.
    let mut free = Vec::with_capacity(nominal.current.len());
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
    let (early, late) = (replay(case, &early)?.current, replay(case, &late)?.current);
    let (mut early, mut late) = (early.iter(), late.iter());
    let mut take = |(at, (before, after)): (&[f64; 3], &(bool, bool))| {
        let from = if *before { early.next()? } else { at };
        let to = if *after { late.next()? } else { at };
        Some(std::array::from_fn(|k| (to[k] - from[k]) / (2.0 * reach.seconds())))
    };
    Ok(nominal.current.iter().zip(&free).map_while(&mut take).collect())
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
