#![allow(clippy::large_types_passed_by_value, reason = "settings are made for each test")]

use super::*;
use crate::{Adc, SensorSettings};
use standstill_inverter::Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};
use standstill_inverter::Modes;

#[allow(clippy::large_types_passed_by_value, reason = "settings are made for each test")]
fn sampler(settings: SensorSettings) -> Sampler<'static> {
    Sampler::new(&Sensors::nominal(settings), Faults::default(), Streams::new(1, 0), Vec::new())
}

/// Takes one sample and reads it.
#[allow(clippy::large_types_passed_by_value, reason = "an instant is made for each sample")]
fn read(sampler: &mut Sampler<'_>, there: Instant) -> Reading<f64> {
    let mut readings = Vec::new();
    sampler.take(there);
    sampler.convert::<f64>(&mut readings);
    readings[0]
}

/// Returns a function that reads a value through a converter behind a sensor without errors.
fn converter(adc: Adc) -> impl Fn(f64) -> (f64, bool, u32) {
    let dc_link = crate::VoltageSensor { adc: Some(adc), ..SensorSettings::IDEAL.dc_link };
    let settings = SensorSettings { adc: Some(adc), dc_link, ..SensorSettings::IDEAL };
    let channels = Channels::of(&Sensors::nominal(settings));
    move |value| {
        let read = channels.read([value; 4], [0.0; 4]);
        let bits = |k: usize| (read.value[k].to_bits(), read.at_end[k], read.code[k]);
        assert!((1..4).all(|k| bits(k) == bits(0)));
        read.of(0)
    }
}

fn there(modes: Modes, requested: [Gate; 3]) -> Instant {
    let terminal = [550.0, 0.0, 275.0];
    Instant { terminal, requested, ..Instant::new(Nanos(0), 0.0, [1.5, -1.5, 0.0], 550.0) }
        .through(SensorSettings::IDEAL, modes)
}

impl Instant {
    #[allow(clippy::large_types_passed_by_value, reason = "settings are made for each test")]
    fn through(self, settings: SensorSettings, modes: Modes) -> Self {
        Self { current: settings.seen(self.current, modes), ..self }
    }
}

const PULSE: ([Gate; 3], Modes) = ([Gate::High, Gate::Low, Gate::Off], [UpperSwitch, LowerSwitch, Blocked]);

#[test]
fn analytic_adc_rounds_and_clips() {
    let convert = converter(Adc { bits: 12, low: -20.0, high: 20.0 });
    let step = 40.0 / 4096.0;
    assert_eq!(convert(0.6 * step), (step, false, 2049));
    assert_eq!(convert(25.0), (20.0 - step, true, 4095));
    assert_eq!(convert(-25.0), (-20.0, true, 0));
}

#[test]
fn law_without_bits_nothing_is_rounded_and_the_range_stays() {
    let convert = converter(Adc { bits: 0, low: -20.0, high: 20.0 });
    for value in [-19.999, -1.234_567_891, 0.0, 1e-6, 7.3, 19.999] {
        let (read, clipped, count) = convert(value);
        assert!((read - value).abs() < 1e-8 && !clipped && count == 0, "{read}, not {value}");
    }
    for (beyond, end) in [(25.0, 20.0), (-25.0, -20.0), (f64::INFINITY, 20.0)] {
        let (read, clipped, _) = convert(beyond);
        assert!((read - end).abs() < 2e-8 && clipped, "{read} of {beyond}");
    }
}

#[test]
fn law_codes_are_rounded_as_the_library_rounds() {
    for adc in [Adc { bits: 12, low: -20.0, high: 20.0 }, Adc { bits: 3, low: 0.0, high: 8.0 }] {
        let (last, convert) = (f64::from((1_u32 << adc.bits) - 1), converter(adc));
        let step = (adc.high - adc.low) / (last + 1.0);
        for n in -3000..40_000 {
            let value = adc.low + f64::from(n) * step * 0.125;
            for value in [value.next_down(), value, value.next_up()] {
                let code = ((value - adc.low) / step).round().clamp(0.0, last);
                let (read, clipped, count) = convert(value);
                assert_eq!((read, clipped), (adc.low + code * step, code == 0.0 || code == last), "{value}");
                assert_eq!(f64::from(count), code);
            }
        }
        assert!(convert(f64::NAN).0.is_nan());
        assert_eq!(convert(f64::INFINITY).0, adc.low + last * step);
    }
}

#[test]
fn law_two_sensors_derive_the_third() {
    let mut sampler =
        sampler(SensorSettings { arrangement: Arrangement::TwoInLine, ..SensorSettings::IDEAL });
    let mut point = there(PULSE.1, PULSE.0);
    point.current = [1.5, -1.0, -0.5];
    let reading: Reading<f64> = read(&mut sampler, point);
    assert_eq!(reading.current.0, [1.5, -1.0, -0.5]);
    assert_eq!(reading.sensed.0, [Sensed::Measured, Sensed::Measured, Sensed::Derived]);
}

#[test]
fn law_shunts_see_only_lower_devices() {
    let shunts = SensorSettings { arrangement: Arrangement::LowSideShunts, ..SensorSettings::IDEAL };
    let mut sampler = sampler(shunts);
    // One leg high: derived. Two legs high: hidden. All off: only a current through a lower diode is read.
    let mut read =
        |modes, gates| -> Reading<f64> { read(&mut sampler, there(modes, gates).through(shunts, modes)) };
    let reading = read(PULSE.1, PULSE.0);
    assert_eq!(reading.current.0, [1.5, -1.5, 0.0]);
    assert_eq!(reading.sensed.0[0], Sensed::Derived);
    let reading = read([UpperSwitch, LowerSwitch, UpperSwitch], [Gate::High, Gate::Low, Gate::High]);
    assert_eq!(reading.sensed.0, [Sensed::Hidden, Sensed::Measured, Sensed::Hidden]);
    let reading = read([LowerDiode, UpperDiode, Blocked], [Gate::Off; 3]);
    assert_eq!(reading.current.0, [1.5, 0.0, 0.0]);
}

#[test]
fn law_a_shunt_in_the_link_shows_the_leg_that_is_alone() {
    let shunt = SensorSettings { arrangement: Arrangement::DcLinkShunt, ..SensorSettings::IDEAL };
    let mut sampler = sampler(shunt);
    let mut read = |current, modes, gates, settled| -> Reading<f64> {
        let there = Instant { current, settled: [settled; 3], ..there(modes, gates) };
        read(&mut sampler, there.through(shunt, modes))
    };
    let (high, low, off) = (Gate::High, Gate::Low, Gate::Off);
    let [measured, hidden] = [Sensed::Measured, Sensed::Hidden];
    // One leg high: its current. One leg low: minus its current. With a leg off, the current cannot be assigned to a phase.
    let reading = read([2.0, -1.5, -0.5], [UpperSwitch, LowerSwitch, LowerSwitch], [high, low, low], true);
    assert_eq!((reading.link_current, reading.link_sensed), (2.0, measured));
    assert_eq!((reading.current.0[0], reading.sensed.0), (2.0, [measured, hidden, hidden]));
    let reading = read([1.5, -2.0, 0.5], [UpperSwitch, LowerSwitch, UpperSwitch], [high, low, high], true);
    assert_eq!((reading.link_current, reading.current.0[1]), (2.0, -2.0));
    assert_eq!(reading.sensed.0, [hidden, measured, hidden]);
    let reading = read([1.5, -1.5, 0.0], PULSE.1, PULSE.0, true);
    assert_eq!((reading.link_current, reading.sensed.0), (1.5, [hidden; 3]));
    // Diodes return the current to the link: it is negative, and the drive cannot assign it to a phase.
    let reading = read([1.5, -1.5, 0.0], [LowerDiode, UpperDiode, Blocked], [off; 3], true);
    assert_eq!((reading.link_current, reading.link_sensed), (-1.5, measured));
    assert_eq!(reading.sensed.0, [hidden; 3]);
    // All low: no current in the link. If the amplifier has not settled, no current is read.
    let reading = read([1.5, -1.0, -0.5], [LowerSwitch; 3], [low; 3], true);
    assert_eq!((reading.link_current, reading.link_sensed), (0.0, measured));
    let reading = read([1.5, -1.5, 0.0], PULSE.1, PULSE.0, false);
    assert_eq!((reading.link_sensed, reading.sensed.0), (hidden, [hidden; 3]));
}

#[test]
fn law_a_leg_whose_amplifier_has_not_settled_follows_from_the_other_two() {
    let shunts = SensorSettings { arrangement: Arrangement::LowSideShunts, ..SensorSettings::IDEAL };
    let mut sampler = sampler(shunts);
    let modes = [LowerSwitch; 3];
    let mut read = |settled| -> Reading<f64> {
        let there = Instant { current: [1.5, -1.0, -0.5], settled, ..there(modes, [Gate::Low; 3]) };
        read(&mut sampler, there.through(shunts, modes))
    };
    let reading = read([true, false, true]);
    assert_eq!(reading.current.0, [1.5, -1.0, -0.5]);
    assert_eq!(reading.sensed.0, [Sensed::Measured, Sensed::Derived, Sensed::Measured]);
    assert_eq!(read([true, false, false]).sensed.0, [Sensed::Measured, Sensed::Hidden, Sensed::Hidden]);
}

#[test]
fn law_each_error_shows_in_its_place() {
    let read = |change: fn(&mut Sensors)| {
        let mut sensors = Sensors::nominal(SensorSettings::IDEAL);
        change(&mut sensors);
        read(
            &mut Sampler::new(&sensors, Faults::default(), Streams::new(1, 0), Vec::new()),
            there(PULSE.1, PULSE.0),
        )
    };
    assert_eq!(read(|s| s.gain[0] = 1.1).current.0[0], 1.5 * 1.1);
    assert_eq!(read(|s| s.offset[2] = 0.2).current.0[2], 0.2);
    assert_eq!(read(|s| s.dc_link_gain = 1.01).dc_link, 550.0 * 1.01);
    assert_eq!(read(|s| s.dc_link_offset = 2.0).dc_link, 552.0);
    assert_ne!(read(|s| s.settings.noise = 0.01).current.0[2], 0.0);
    assert_ne!(read(|s| s.settings.dc_link.noise = 1.0).dc_link, 550.0);
}

#[test]
fn law_noise_has_the_stated_size() {
    let mut sampler = sampler(SensorSettings { noise: 0.01, ..SensorSettings::IDEAL });
    let n = 20_000;
    let sum: f64 = (0..n)
        .map(|_| {
            let reading: Reading<f64> = read(&mut sampler, there(PULSE.1, PULSE.0));
            (reading.current.0[0] - 1.5).powi(2)
        })
        .sum();
    let rms = (sum / f64::from(n)).sqrt();
    assert!((rms / 0.01 - 1.0).abs() < 0.03, "{rms}");
}

#[test]
fn law_jitter_fills_its_range_and_stays_within_the_command() {
    let mut sampler = sampler(SensorSettings { jitter: Nanos(1000), ..SensorSettings::IDEAL });
    let mut instants: Vec<u64> =
        (0..5000).map(|_| sampler.instant(Nanos(80_000), Nanos(0), Nanos(100_000)).0).collect();
    instants.sort_unstable();
    assert!(instants[0] < 79_010 && instants[0] >= 79_000);
    assert!(instants[4999] > 80_990 && instants[4999] <= 81_000);
    assert_eq!(sampler.instant(Nanos(0), Nanos(0), Nanos(5)).0.min(5), 0);
}

#[test]
fn law_readings_do_not_depend_on_how_many_samples_are_converted_together() {
    let adc = Some(Adc { bits: 12, low: -3.0, high: 3.0 });
    let link = crate::VoltageSensor { noise: 0.5, ..SensorSettings::IDEAL.dc_link };
    for oversampling in [1, 3] {
        let settings =
            SensorSettings { noise: 0.01, adc, dc_link: link, oversampling, ..SensorSettings::IDEAL };
        let readings = |together: usize| {
            let (mut sampler, mut readings) = (sampler(settings), Vec::new());
            for n in 0..201_u32 {
                let current = f64::from(n) * 0.02;
                sampler.take(Instant::new(Nanos(n.into()), 0.0, [current, -current, 0.0], 550.0));
                if (n as usize + 1).is_multiple_of(together) {
                    sampler.convert::<f64>(&mut readings);
                }
            }
            sampler.convert::<f64>(&mut readings);
            readings
        };
        let one_by_one = readings(1);
        assert_eq!(one_by_one.len(), 201 / usize::from(oversampling));
        assert!(one_by_one.iter().any(|of| of.sensed.0[0] == Sensed::Clipped));
        let noisy = one_by_one.windows(2).all(|pair| pair[0].dc_link != pair[1].dc_link);
        assert!(noisy, "no two samples have the same noise");
        for together in [2, 7, 8, 9, 64, 300] {
            assert_eq!(readings(together), one_by_one, "{together} at a time");
        }
    }
}
