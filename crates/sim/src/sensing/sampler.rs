//! Sampling: from physical values to the drive's readings.

use standstill_interface::{Abc, Nanos, Reading, Real, Sensed};
use standstill_inverter::Gate;

use super::dividers::Dividers;
use super::misread::Misread;
use super::{Arrangement, Channels, Sensors};
use crate::{Draws, Faults, Purpose, Streams};

/// The sampler of one run: converts physical values to readings.
#[derive(Clone, Debug)]
pub struct Sampler<'t> {
    arrangement: Arrangement,
    /// Largest deviation and delay of a trigger in ns.
    late: [u64; 2],
    /// Whether there is noise in the phases' channels, and in the link's.
    noisy: [bool; 2],
    channels: Channels<4>,
    noise: Draws<'t>,
    link_noise: Draws<'t>,
    jitter: Draws<'t>,
    dividers: Option<Dividers<'t>>,
    misread: Option<Misread>,
}

/// Physical values at the instant of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Instant {
    /// Time in ns since the start of the run.
    pub time: f64,
    /// Currents in A through the sensors, after the filters if there are any: see [`super::SensorSettings::seen`].
    pub current: [f64; 3],
    /// Voltage of the DC link in V, after its sensor's filter if there is one.
    pub dc_link: f64,
    /// Voltages of the terminals in V, after their filters if there are any; unused if the drive does not read its
    /// terminals.
    pub terminal: [f64; 3],
    /// The request to each leg just before the trigger's nominal time.
    pub requested: [Gate; 3],
    /// Whether the drive takes the amplifier of each leg's shunt to have settled by that time.
    pub settled: [bool; 3],
}

impl<'t> Sampler<'t> {
    pub fn new(sensors: &Sensors, faults: Faults, streams: Streams<'t>) -> Self {
        let [noise, link_noise, jitter] =
            streams.open_together([Purpose::CurrentNoise, Purpose::LinkNoise, Purpose::Jitter]);
        let dividers = Dividers::new(sensors, streams);
        let settings = &sensors.settings;
        Self {
            arrangement: settings.arrangement,
            late: [settings.jitter.0, settings.sample_delay.0],
            noisy: [settings.noise > 0.0, settings.dc_link.noise > 0.0],
            channels: Channels::of(sensors),
            noise,
            link_noise,
            jitter,
            dividers,
            misread: Misread::of(faults),
        }
    }

    /// Returns the actual sampling instant of a trigger at `nominal`, with delay and jitter, limited to its command.
    pub fn instant(&mut self, nominal: Nanos, command_start: Nanos, command_end: Nanos) -> Nanos {
        let [jitter, delay] = self.late;
        let late = nominal.0 + delay;
        let moved =
            if jitter == 0 { late } else { (late + self.jitter.integer(2 * jitter)).saturating_sub(jitter) };
        Nanos(moved.clamp(command_start.0, command_end.0))
    }

    /// Takes one sample; `at`: the trigger's nominal time after the start of its command.
    #[inline(always)]
    pub fn read<T: Real>(&mut self, at: Nanos, there: &Instant) -> Reading<T> {
        let mut noise = [0.0; 4];
        let [phases_are_noisy, link_is_noisy] = self.noisy;
        if phases_are_noisy {
            self.noise.normals(&mut noise[..3]);
        }
        if link_is_noisy {
            noise[3] = self.link_noise.normal();
        }
        let [a, b, c] = there.current;
        let values = [a, b, c, there.dc_link];
        let raw = match &mut self.misread {
            None => self.channels.read(values, noise),
            Some(misread) => misread.read(&self.channels, values, noise, there.time),
        };
        let of_end = |at_end| if at_end { Sensed::Clipped } else { Sensed::Measured };
        let measured = |k: usize| (raw.value[k], of_end(raw.at_end[k]), raw.code[k]);
        let mut reading = Reading::measured(at, [0, 1, 2].map(|k| T::of(raw.value[k])), T::of(raw.value[3]));
        reading.dc_link_clipped = raw.at_end[3];
        reading.counts.dc_link = raw.code[3];
        if self.arrangement == Arrangement::ThreeInLine {
            reading.sensed = Abc([0, 1, 2].map(|k| of_end(raw.at_end[k])));
            reading.counts.current = Abc([0, 1, 2].map(|k| raw.code[k]));
        } else {
            let mut link_current = HIDDEN;
            if self.arrangement == Arrangement::DcLinkShunt && there.settled == [true; 3] {
                link_current = measured(0);
                reading.link_current = T::of(link_current.0);
                reading.link_sensed = link_current.1;
                reading.counts.link_current = link_current.2;
            }
            let phases = self.phases(there, measured, link_current);
            reading.current = Abc(phases.map(|(value, ..)| T::of(value)));
            reading.sensed = Abc(phases.map(|(_, sensed, _)| sensed));
            reading.counts.current = Abc(phases.map(|(.., code)| code));
        }
        if let Some(dividers) = &mut self.dividers {
            let terminals = dividers.read(there.terminal);
            reading.terminal = Abc(terminals.map(|(value, ..)| T::of(value)));
            reading.terminal_sensed = Abc(terminals.map(|(_, sensed, _)| sensed));
            reading.counts.terminal = Abc(terminals.map(|(.., code)| code));
        }
        reading
    }

    /// Returns the phase currents as a drive without three sensors in line sees them. `measured`: the reading of each channel; `link`:
    /// the current through the shunt in the DC link.
    #[inline(never)]
    fn phases(&self, there: &Instant, measured: impl Fn(usize) -> Shown, link: Shown) -> [Shown; 3] {
        let derived = |k: usize| {
            let (x, y) = (measured((k + 1) % 3), measured((k + 2) % 3));
            let clipped = x.1 == Sensed::Clipped || y.1 == Sensed::Clipped;
            (-(x.0 + y.0), if clipped { Sensed::Clipped } else { Sensed::Derived }, 0)
        };
        let shown = |k: usize| there.requested[k] != Gate::High && there.settled[k];
        match self.arrangement {
            Arrangement::None => [HIDDEN; 3],
            Arrangement::ThreeInLine => [measured(0), measured(1), measured(2)],
            Arrangement::TwoInLine => [measured(0), measured(1), derived(2)],
            Arrangement::LowSideShunts => {
                [0, 1, 2].map(|k| match (shown(k), shown((k + 1) % 3), shown((k + 2) % 3)) {
                    (true, ..) => measured(k),
                    (false, true, true) => derived(k),
                    _ => HIDDEN,
                })
            }
            Arrangement::DcLinkShunt => {
                // Diodes of a leg whose gates are off may carry a part of the current that the drive does not know.
                let active = !there.requested.contains(&Gate::Off);
                let alone = |gate, k: usize| {
                    active
                        && there.requested[k] == gate
                        && there.requested.iter().filter(|of| **of == gate).count() == 1
                };
                [0, 1, 2].map(|k| match link {
                    (_, Sensed::Hidden, _) => HIDDEN,
                    of if alone(Gate::High, k) => of,
                    (value, sensed, code) if alone(Gate::Low, k) => (-value, sensed, code),
                    _ => HIDDEN,
                })
            }
        }
    }
}

/// A value in A as the drive sees it, its origin, and its converter's code.
type Shown = (f64, Sensed, u32);

/// A value that the drive does not see.
const HIDDEN: Shown = (0.0, Sensed::Hidden, 0);

#[cfg(test)]
#[allow(clippy::large_types_passed_by_value, reason = "settings are made for each test")]
mod tests {
    use super::*;
    use crate::{Adc, SensorSettings};
    use standstill_inverter::Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};
    use standstill_inverter::Modes;

    #[allow(clippy::large_types_passed_by_value, reason = "settings are made for each test")]
    fn sampler(settings: SensorSettings) -> Sampler<'static> {
        Sampler::new(&Sensors::nominal(settings), Faults::default(), Streams::new(1, 0))
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
        Instant {
            time: 0.0,
            current: [1.5, -1.5, 0.0],
            dc_link: 550.0,
            terminal: [550.0, 0.0, 275.0],
            requested,
            settled: [true; 3],
        }
        .through(SensorSettings::IDEAL, modes)
    }

    impl Instant {
        #[allow(clippy::large_types_passed_by_value, reason = "settings are made for each test")]
        fn through(self, settings: SensorSettings, modes: Modes) -> Self {
            Self { current: settings.seen(self.current, modes), ..self }
        }
    }

    const PULSE: ([Gate; 3], Modes) =
        ([Gate::High, Gate::Low, Gate::Off], [UpperSwitch, LowerSwitch, Blocked]);

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
                    assert_eq!(
                        (read, clipped),
                        (adc.low + code * step, code == 0.0 || code == last),
                        "{value}"
                    );
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
        let reading: Reading<f64> = sampler.read(Nanos(0), &point);
        assert_eq!(reading.current.0, [1.5, -1.0, -0.5]);
        assert_eq!(reading.sensed.0, [Sensed::Measured, Sensed::Measured, Sensed::Derived]);
    }

    #[test]
    fn law_shunts_see_only_lower_devices() {
        let shunts = SensorSettings { arrangement: Arrangement::LowSideShunts, ..SensorSettings::IDEAL };
        let mut sampler = sampler(shunts);
        // One leg up: derived. Two up: hidden. All off: only what a lower diode carries.
        let mut read = |modes, gates| -> Reading<f64> {
            sampler.read(Nanos(0), &there(modes, gates).through(shunts, modes))
        };
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
            sampler.read(Nanos(0), &there.through(shunt, modes))
        };
        let (high, low, off) = (Gate::High, Gate::Low, Gate::Off);
        let [measured, hidden] = [Sensed::Measured, Sensed::Hidden];
        // One leg high: its own. One low: its own, with the other sign. With a leg open: nobody knows whose.
        let reading =
            read([2.0, -1.5, -0.5], [UpperSwitch, LowerSwitch, LowerSwitch], [high, low, low], true);
        assert_eq!((reading.link_current, reading.link_sensed), (2.0, measured));
        assert_eq!((reading.current.0[0], reading.sensed.0), (2.0, [measured, hidden, hidden]));
        let reading =
            read([1.5, -2.0, 0.5], [UpperSwitch, LowerSwitch, UpperSwitch], [high, low, high], true);
        assert_eq!((reading.link_current, reading.current.0[1]), (2.0, -2.0));
        assert_eq!(reading.sensed.0, [hidden, measured, hidden]);
        let reading = read([1.5, -1.5, 0.0], PULSE.1, PULSE.0, true);
        assert_eq!((reading.link_current, reading.sensed.0), (1.5, [hidden; 3]));
        // Diodes return the current to the link: it turns its sign, and the drive cannot say whose it is.
        let reading = read([1.5, -1.5, 0.0], [LowerDiode, UpperDiode, Blocked], [off; 3], true);
        assert_eq!((reading.link_current, reading.link_sensed), (-1.5, measured));
        assert_eq!(reading.sensed.0, [hidden; 3]);
        // All low: nothing flows in the link. An amplifier that has not settled: nothing is read.
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
            sampler.read(Nanos(0), &there.through(shunts, modes))
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
            let reading: Reading<f64> = Sampler::new(&sensors, Faults::default(), Streams::new(1, 0))
                .read(Nanos(0), &there(PULSE.1, PULSE.0));
            reading
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
                let reading: Reading<f64> = sampler.read(Nanos(0), &there(PULSE.1, PULSE.0));
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
}
