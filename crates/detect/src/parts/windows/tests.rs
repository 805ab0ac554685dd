use super::*;
use crate::nameplate::Sensing;
use crate::testing::{Noise, PLATE};

const PWM: ModulationSettings<f64> = ModulationSettings {
    carrier_period: Nanos::from_micros(100),
    dead_time: Nanos::ZERO,
    drop: 0.0,
    inductance: 10e-3,
    fade: 1e-6,
};

const WINDOWS: WindowSettings<f64> = WindowSettings {
    length: Nanos::from_micros(8),
    averaged: Nanos::from_micros(1),
    shortest: Nanos::from_micros(8),
    dc_link: 500.0,
    binds: Bind::Settle,
};

/// Whether a leg is high at a time of a command of two stages.
fn is_high(command: &Command<f64>, phase: Phase, time: Nanos) -> bool {
    let first = command.stage;
    let (leg, time) = if time < first.duration {
        (first.legs[phase], time)
    } else {
        (command.then.expect("two halves").legs[phase], time - first.duration)
    };
    match leg {
        Leg::High => true,
        Leg::Low => false,
        Leg::Rise(at) => time >= at,
        Leg::Fall(at) => time < at,
        other => panic!("{other:?}"),
    }
}

/// Integral in V s of the voltage vector from the begin of a command to a time in it, in steps of a nanosecond.
fn charge(command: &Command<f64>, until: Nanos) -> AlphaBeta<f64> {
    let on = Phase::ALL.map(|phase| {
        (0..until.0).filter(|time| is_high(command, phase, Nanos(*time))).count() as f64
            * 1e-9
            * WINDOWS.dc_link
    });
    Abc(on).clarke()
}

fn period(voltage: AlphaBeta<f64>, mirrored: bool) -> Command<f64> {
    WINDOWS.period(&PWM, voltage, WINDOWS.dc_link, [Abc([0.0; 3]); 2], mirrored)
}

/// The last conversions of samples.
fn later(sampling: Sampling) -> Sampling {
    Sampling { first: sampling.first + WINDOWS.averaged, ..sampling }
}

fn directions() -> impl Iterator<Item = AlphaBeta<f64>> {
    (0..12)
        .map(|n| (f64::from(n) * 0.53).sin_cos())
        .flat_map(|(sin, cos)| [0.0, 0.5, 30.0, 70.0].map(|volts| AlphaBeta::new(cos * volts, sin * volts)))
}

#[test]
fn law_each_sample_lies_in_a_vector_of_one_leg_that_has_settled() {
    for voltage in directions() {
        let order = order(voltage);
        for mirrored in [false, true] {
            let command = period(voltage, mirrored);
            assert_eq!(command.duration(), PWM.carrier_period);
            let mut samples = [0, 1].map(|n| command.sampling.trigger(n));
            if mirrored {
                samples.reverse();
            }
            for (sample, alone, high) in [(samples[0], order[0], true), (samples[1], order[2], false)] {
                // From the last edge on by which the amplifier settles, to the end of the window: 3.5 us, 1 us of conversions, 3.5 us.
                for time in (sample.0 - 3_500..sample.0 + 4_500).map(Nanos) {
                    for phase in Phase::ALL {
                        let wanted = (phase == alone) == high;
                        assert_eq!(
                            is_high(&command, phase, time),
                            wanted,
                            "{voltage:?} {mirrored} {phase:?} {time:?}"
                        );
                    }
                }
            }
        }
    }
}

/// Returns Γ, in 1/H, times an integral of voltage in V s: a current in A, of a salient motor turned by 25°, without
/// resistance.
fn gamma(of: AlphaBeta<f64>) -> AlphaBeta<f64> {
    let (sin, cos) = 50_f64.to_radians().sin_cos();
    let (mean, change) = (80.0, 20.0);
    AlphaBeta::new(
        (mean + change * cos) * of.alpha + change * sin * of.beta,
        change * sin * of.alpha + (mean - change * cos) * of.beta,
    )
}

#[test]
fn analytic_the_mean_voltage_is_as_ordered_and_mirrored_samples_show_the_middle() {
    let begin = AlphaBeta::new(0.7, -0.4);
    let mut ripple = 0.0_f64;
    for voltage in directions() {
        let order = order(voltage);
        let [first, second] = [false, true].map(|mirrored| period(voltage, mirrored));
        let whole = charge(&first, PWM.carrier_period);
        // A leg's time is in whole nanoseconds, of both halves.
        let ordered = voltage * PWM.carrier_period.seconds();
        assert!((whole - ordered).norm() < 2e-9 * WINDOWS.dc_link, "{voltage:?}: {whole:?}");
        assert!((charge(&second, PWM.carrier_period) - whole).norm() < 1e-12);
        let middle = begin + gamma(whole);
        let at = |command: &Command<f64>, begin: AlphaBeta<f64>| {
            [0, 1].map(|n| (begin + gamma(charge(command, command.sampling.trigger(n)))).phases())
        };
        // A conversion at the trigger, or in the mirrored period at the end of its span.
        let second = Command { sampling: later(second.sampling), ..second };
        let [one, two] = [at(&first, begin), at(&second, middle)];
        let found = phases(
            [(one[0][order[0]] + two[1][order[0]]) / 2.0, (one[1][order[2]] + two[0][order[2]]) / 2.0],
            order,
        );
        ripple = ripple.max((one[0][order[0]] - middle.phases()[order[0]]).abs());
        assert!(
            (found.clarke() - middle).norm() < 2e-9 * WINDOWS.dc_link * 100.0,
            "{voltage:?}: {found:?} {middle:?}"
        );
    }
    // By one sample alone it would be off by the ripple.
    assert!(ripple > 0.1, "{ripple} A");
}

#[test]
fn law_without_room_the_key_is_named() {
    assert!(WINDOWS.check(&PWM, 60.0).is_ok());
    // 50 us, of which the leg in the middle leaves a share of 0.5 - 30/500: 22 us.
    let [fits, not] = [21, 23].map(|micros| WindowSettings { length: Nanos::from_micros(micros), ..WINDOWS });
    assert!(fits.check(&PWM, 60.0).is_ok());
    assert_eq!(not.check(&PWM, 60.0).map_err(|error| error.setting), Err("window"));
    let short = WindowSettings { length: Nanos::from_micros(7), ..WINDOWS };
    let refused = short.check(&PWM, 60.0).expect_err("no time to settle");
    assert!(refused.setting == "window" && refused.needed.contains("sensors.settle"));
    assert!(WINDOWS.check(&PWM, 260.0).is_err());
    // Dead time and drops take 9 % of a period at an edge, twice: of a half, 32 % are left beside what the other windows take.
    let slow = ModulationSettings { dead_time: Nanos::from_micros(8), drop: 5.0, ..PWM };
    let room = |micros| WindowSettings { length: Nanos::from_micros(micros), ..WINDOWS }.room(&slow);
    assert!((room(4) - 0.32 * 500.0).abs() < 1e-9);
    assert!((room(14) - 2.0 * (0.32 - 0.28) * 500.0).abs() < 1e-9 && room(17) < 0.0);
}

#[test]
fn law_the_key_that_binds_is_blamed() {
    let micros = Nanos::from_micros;
    let none = Sensing::<f64> { place: Place::InLink, ..Sensing::default() };
    let plate = |sensing| Nameplate { sensing, dead_time: micros(2), ..PLATE };
    for (sensing, key) in [
        (none, "inverter.dead_time"),
        (Sensing { settle: micros(1), ..none }, "inverter.dead_time"),
        (Sensing { settle: micros(4), ..none }, "sensors.settle"),
        (Sensing { settle: micros(4), pick_up: [0.1, 1e-6], ..none }, "sensors.pick_up_decay"),
        (Sensing { settle: micros(4), averaged: micros(8), ..none }, "sensors.settle"),
        (Sensing { settle: micros(4), averaged: micros(9), ..none }, "sensors.oversampling"),
    ] {
        let windows = WindowSettings::suited(&plate(sensing)).expect("one shunt");
        let short = WindowSettings { length: windows.length - Nanos(1), ..windows };
        let long = WindowSettings { length: micros(50), ..windows };
        for refused in [short, long].map(|windows| windows.check(&PWM, 60.0).expect_err("does not fit")) {
            assert!(refused.needed.contains(key), "{sensing:?}: {refused}");
            let others = Bind::ALL.iter().filter(|other| other.name() != key);
            assert!(others.into_iter().all(|other| !refused.needed.contains(other.name())), "{refused}");
        }
    }
}

/// The current in A at the samples of a command and at its end, of legs in which a switch closes `dead_time` after the other was told to
/// open: meanwhile the current's direction decides over the potential.
fn driven(
    command: &Command<f64>,
    dead_time: Nanos,
    begin: AlphaBeta<f64>,
) -> ([AlphaBeta<f64>; 2], AlphaBeta<f64>) {
    let samples = [0, 1].map(|n| command.sampling.trigger(n));
    let (mut current, mut shown) = (begin, [begin; 2]);
    let (mut told, mut waits) = ([false; 3], [0; 3]);
    for time in 0..command.duration().0 {
        for (sample, shown) in samples.iter().zip(&mut shown) {
            if sample.0 == time {
                *shown = current;
            }
        }
        let currents = current.phases();
        let volts = Phase::ALL.map(|phase| {
            let k = phase as usize;
            let high = is_high(command, phase, Nanos(time));
            if high != told[k] {
                (told[k], waits[k]) = (high, dead_time.0);
            }
            let waiting = waits[k] > 0;
            waits[k] = waits[k].saturating_sub(1);
            if waiting && currents[phase] > 0.0 || !waiting && !high { 0.0 } else { WINDOWS.dc_link }
        });
        current = current + gamma(Abc(volts).clarke() * 1e-9);
    }
    (shown, current)
}

const DEAD_TIME: Nanos = Nanos::from_micros(2);

/// The current in A that a pair of periods shows, and that in its middle and at its end, of legs with [`DEAD_TIME`].
fn pair(
    pwm: &ModulationSettings<f64>,
    voltage: AlphaBeta<f64>,
    begin: AlphaBeta<f64>,
) -> [AlphaBeta<f64>; 3] {
    let order = order(voltage);
    let rise = voltage * (pwm.carrier_period.seconds() / pwm.inductance);
    let ends = [begin, begin + rise, begin + rise * 2.0].map(AlphaBeta::phases);
    let ordered = |ends: [Abc<f64>; 2], mirrored| {
        let command = WINDOWS.period(pwm, voltage, WINDOWS.dc_link, ends, mirrored);
        Command { sampling: if mirrored { later(command.sampling) } else { command.sampling }, ..command }
    };
    let (one, middle) = driven(&ordered([ends[0], ends[1]], false), DEAD_TIME, begin);
    let (two, end) = driven(&ordered([ends[1], ends[2]], true), DEAD_TIME, middle);
    let [one, two] = [one, two].map(|shown| shown.map(AlphaBeta::phases));
    let of_legs = [(one[0][order[0]] + two[1][order[0]]) / 2.0, (one[1][order[2]] + two[0][order[2]]) / 2.0];
    [phases(of_legs, order).clarke(), middle, end]
}

/// Largest error in A because times are whole nanoseconds: three edges each way.
const ROUNDING: f64 = 6e-9 * WINDOWS.dc_link * 100.0;

/// Dead time delays the rises of legs whose current flows out of them and the falls of the others. Compensated at each
/// edge, it changes neither the mean voltage, nor the mirrored period, nor the current in the middle; compensated by a
/// mean it would.
#[test]
fn analytic_dead_time_that_is_made_good_at_each_edge_leaves_the_middle_as_it_is() {
    // Currents that no ripple turns back.
    for begin in [AlphaBeta::new(3.0, 0.6), AlphaBeta::new(-3.0, -0.6)] {
        let mut off = 0.0_f64;
        for voltage in directions().filter(|voltage| voltage.norm() < 60.0) {
            let [shown, middle, end] =
                pair(&ModulationSettings { dead_time: DEAD_TIME, ..PWM }, voltage, begin);
            let expected = begin + gamma(voltage * PWM.carrier_period.seconds());
            assert!((middle - expected).norm() < ROUNDING, "{voltage:?}: {middle:?} {expected:?}");
            assert!((end - middle * 2.0 + begin).norm() < ROUNDING, "{voltage:?}: {end:?}");
            assert!((shown - middle).norm() < ROUNDING, "{voltage:?}: {shown:?} {middle:?}");
            let [_, lost, _] = pair(&PWM, voltage, begin);
            off = off.max((lost - expected).norm());
        }
        // Two microseconds of 500 V, 4/3 of it as a vector: 0.1 A.
        assert!(off > 0.09, "{off} A");
    }
    // Phase a turns from -0.12 A to 0.16 A between its rise and its fall, which are then both on time.
    for sign in [1.0, -1.0] {
        let (voltage, begin) = (AlphaBeta::new(30.0 * sign, 0.0), AlphaBeta::new(-0.12 * sign, 2.0));
        let [_, middle, _] = pair(&ModulationSettings { dead_time: DEAD_TIME, ..PWM }, voltage, begin);
        let expected = begin + gamma(voltage * PWM.carrier_period.seconds());
        assert!((middle - expected).norm() < ROUNDING, "{sign}: {middle:?} {expected:?}");
        assert!(begin.alpha * middle.alpha < 0.0);
    }
}

/// A current of three readings has 2/3 of a reading's variance in each direction, and so has that of one shunt's four readings in the mean
/// over the directions, but it is three times as large across the voltage as along it.
#[test]
fn analytic_noise_of_four_readings_through_one_shunt() {
    let mut noise = Noise::new(5);
    for degrees in [30.0_f64, 90.0, 210.0, 47.0] {
        let along = AlphaBeta::new(degrees.to_radians().cos(), degrees.to_radians().sin());
        let across = AlphaBeta::new(-along.beta, along.alpha);
        let [least, most] = [along, across].map(|direction| variance(along, direction));
        assert!((least + most - 4.0 / 3.0).abs() < 1e-12);
        if degrees != 47.0 {
            // In the middle of a sector.
            assert!((most - 1.0).abs() < 1e-12, "{most}");
        }
        let trials = 20_000;
        let mut squares = [0.0; 2];
        for _ in 0..trials {
            let of_legs = [(); 2].map(|()| (noise.gauss() + noise.gauss()) / 2.0);
            let current = phases(of_legs, order(along)).clarke();
            squares[0] += current.dot(along).powi(2) / f64::from(trials);
            squares[1] += current.dot(across).powi(2) / f64::from(trials);
        }
        assert!(
            (squares[0] / least - 1.0).abs() < 0.04 && (squares[1] / most - 1.0).abs() < 0.04,
            "{squares:?}"
        );
    }
}
