//! The sensors: what the drive sees of the currents, the DC link and the rotor.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use standstill_interface::{Abc, Nanos, Reading, Real, Sensed};
use standstill_inverter::{Gate, Modes};

use crate::{Purpose, Streams};

/// Where the current sensors sit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// One in each phase.
    ThreeInLine,
    /// In phases a and b; c follows from the sum.
    TwoInLine,
    /// A shunt below each leg, which sees the leg only while its lower device conducts. A leg whose upper switch
    /// is on is derived from the other two; if two or more are, they are hidden. A leg with both switches off
    /// shows only current that its lower diode carries into the motor: current out of the motor, through the
    /// upper diode, reads as zero.
    LowSideShunts,
}

/// An analogue-to-digital converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adc {
    /// Resolution.
    pub bits: u8,
    /// Lowest value it can read, in the unit measured.
    pub low: f64,
    /// End of its range.
    pub high: f64,
}

impl Adc {
    /// Rounds to the nearest code; true if that was the first or the last.
    fn convert(&self, value: f64) -> (f64, bool) {
        let last = f64::from((1_u32 << self.bits) - 1);
        let step = (self.high - self.low) / (last + 1.0);
        let code = ((value - self.low) / step).round().clamp(0.0, last);
        (self.low + code * step, code == 0.0 || code == last)
    }
}

/// The DC-link sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VoltageSensor {
    /// Standard deviation of its gain error, as a share.
    pub gain_error: f64,
    /// Standard deviation of its offset in V.
    pub offset: f64,
    /// Noise of each sample in V rms.
    pub noise: f64,
    /// Corner frequency of its first-order filter in Hz; none: no filter.
    pub bandwidth: Option<f64>,
    /// Its converter; none: exact.
    pub adc: Option<Adc>,
}

/// The resolver that stands for "measured angle".
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resolver {
    /// Standard deviation of its error in rad electrical.
    pub error: f64,
}

/// The sensors as a type: what their errors are drawn from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSettings {
    /// Where the current sensors sit.
    pub arrangement: Arrangement,
    /// Standard deviation of each phase's gain error, as a share.
    pub gain_error: f64,
    /// Standard deviation of each phase's residual offset in A.
    pub offset: f64,
    /// Noise of each sample in A rms.
    pub noise: f64,
    /// Corner frequency of their first-order filters in Hz; none: no filter.
    pub bandwidth: Option<f64>,
    /// Their converter; none: exact.
    pub adc: Option<Adc>,
    /// Each ADC trigger is off by up to this much, uniformly, either way; never out of its command.
    pub jitter: Nanos,
    /// All triggers are late by this much; never out of their command.
    pub sample_delay: Nanos,
    /// The DC-link sensor.
    pub dc_link: VoltageSensor,
    /// The resolver.
    pub resolver: Resolver,
}

impl SensorSettings {
    /// Which phase currents flow through a sensor: all of them in line, those of the conducting lower devices
    /// through shunts.
    pub fn seen(&self, current: [f64; 3], modes: Modes) -> [f64; 3] {
        match self.arrangement {
            Arrangement::ThreeInLine | Arrangement::TwoInLine => current,
            Arrangement::LowSideShunts => {
                std::array::from_fn(|k| if modes[k].is_lower() { current[k] } else { 0.0 })
            }
        }
    }

    /// Sensors without any error.
    pub const IDEAL: Self = Self {
        arrangement: Arrangement::ThreeInLine,
        gain_error: 0.0,
        offset: 0.0,
        noise: 0.0,
        bandwidth: None,
        adc: None,
        jitter: Nanos::ZERO,
        sample_delay: Nanos::ZERO,
        dc_link: VoltageSensor { gain_error: 0.0, offset: 0.0, noise: 0.0, bandwidth: None, adc: None },
        resolver: Resolver { error: 0.0 },
    };
}

/// One drive's sensors: the settings, and the errors this specimen has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// What they were drawn from; noise, jitter and converters still apply to each sample.
    pub settings: SensorSettings,
    /// Gains of the phases' sensors.
    pub gain: [f64; 3],
    /// Offsets in A.
    pub offset: [f64; 3],
    /// Gain of the DC-link sensor.
    pub dc_link_gain: f64,
    /// Its offset in V.
    pub dc_link_offset: f64,
    /// Error of the resolver in rad electrical.
    pub resolver_error: f64,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

impl Sensors {
    /// Sensors that are exactly as their settings' mean.
    pub const fn nominal(settings: SensorSettings) -> Self {
        Self {
            settings,
            gain: [1.0; 3],
            offset: [0.0; 3],
            dc_link_gain: 1.0,
            dc_link_offset: 0.0,
            resolver_error: 0.0,
        }
    }

    /// Draws one specimen.
    pub fn draw(settings: SensorSettings, streams: Streams) -> Self {
        let mut gains = streams.open(Purpose::CurrentGain);
        let mut offsets = streams.open(Purpose::CurrentOffset);
        let mut link = streams.open(Purpose::LinkError);
        let mut resolver = streams.open(Purpose::Resolver);
        Self {
            settings,
            gain: std::array::from_fn(|_| 1.0 + settings.gain_error * normal(&mut gains)),
            offset: std::array::from_fn(|_| settings.offset * normal(&mut offsets)),
            dc_link_gain: 1.0 + settings.dc_link.gain_error * normal(&mut link),
            dc_link_offset: settings.dc_link.offset * normal(&mut link),
            resolver_error: settings.resolver.error * normal(&mut resolver),
        }
    }
}

/// A first-order low-pass filter, exact up to rounding for an input that is a cubic over the step.
#[derive(Clone, Copy, Debug)]
pub struct LowPass {
    time_constant: f64,
    output: f64,
}

impl LowPass {
    pub fn new(bandwidth: f64, output: f64) -> Self {
        Self { time_constant: 1.0 / (std::f64::consts::TAU * bandwidth), output }
    }

    pub fn output(&self) -> f64 {
        self.output
    }

    /// Advances over `h` seconds of input with values `x` at 0, h/3, 2h/3 and h.
    pub fn advance(&mut self, h: f64, x: [f64; 4]) {
        let r = h / self.time_constant;
        if r < 0.01 {
            // On short steps the powers of τ/h below would blow up rounding. The 3/8 rule on the convolution
            // with the filter's response is exact there to r⁵.
            let [a, b, c, d] = x;
            let ends = a * (-r).exp() + 3.0 * b * (-2.0 * r / 3.0).exp() + 3.0 * c * (-r / 3.0).exp() + d;
            self.output = self.output * (-r).exp() + r / 8.0 * ends;
            return;
        }
        // The cubic's derivatives at both ends; the filter follows x − τ x' + τ² x'' − τ³ x''' plus a transient.
        let [a, b, c, d] = x;
        let third = (d - 3.0 * c + 3.0 * b - a) * 27.0;
        let second = [9.0 * (2.0 * a - 5.0 * b + 4.0 * c - d), 9.0 * (2.0 * d - 5.0 * c + 4.0 * b - a)];
        let first = [-5.5 * a + 9.0 * b - 4.5 * c + d, 5.5 * d - 9.0 * c + 4.5 * b - a];
        let ratio = self.time_constant / h;
        let follow = |x: f64, end: usize| x - ratio * (first[end] - ratio * (second[end] - ratio * third));
        let transient = self.output - follow(a, 0);
        self.output = follow(d, 1) + transient * (-h / self.time_constant).exp();
    }
}

/// Takes the samples of one run.
#[derive(Debug)]
pub struct Sampler {
    sensors: Sensors,
    noise: ChaCha8Rng,
    link_noise: ChaCha8Rng,
    jitter: ChaCha8Rng,
}

/// What is physically there at the instant of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Instant {
    /// Currents in A through the sensors, behind their filters if they have any.
    pub current: [f64; 3],
    /// DC link in V, likewise.
    pub dc_link: f64,
    /// What each leg was told just before the trigger's nominal time.
    pub requested: [Gate; 3],
}

impl Sampler {
    pub fn new(sensors: Sensors, streams: Streams) -> Self {
        Self {
            sensors,
            noise: streams.open(Purpose::CurrentNoise),
            link_noise: streams.open(Purpose::LinkNoise),
            jitter: streams.open(Purpose::Jitter),
        }
    }

    /// When a trigger at `nominal` really samples, within its command.
    pub fn instant(&mut self, nominal: Nanos, command_start: Nanos, command_end: Nanos) -> Nanos {
        let jitter = self.sensors.settings.jitter.0;
        let late = nominal.0 + self.sensors.settings.sample_delay.0;
        let moved = if jitter == 0 {
            late
        } else {
            (late + self.jitter.random_range(0..=2 * jitter)).saturating_sub(jitter)
        };
        Nanos(moved.clamp(command_start.0, command_end.0))
    }

    /// One sample; `at` is the trigger's nominal time after the start of its command.
    pub fn read<T: Real>(&mut self, at: Nanos, there: &Instant) -> Reading<T> {
        let s = self.sensors.settings;
        let noise: [f64; 3] =
            std::array::from_fn(|_| if s.noise > 0.0 { s.noise * normal(&mut self.noise) } else { 0.0 });
        let raw: [(f64, bool); 3] = std::array::from_fn(|k| {
            let value = self.sensors.gain[k] * there.current[k] + self.sensors.offset[k] + noise[k];
            s.adc.map_or((value, false), |adc| adc.convert(value))
        });
        let measured = |k: usize| (raw[k].0, if raw[k].1 { Sensed::Clipped } else { Sensed::Measured });
        let derived = |k: usize| {
            let (x, y) = (raw[(k + 1) % 3], raw[(k + 2) % 3]);
            (-(x.0 + y.0), if x.1 || y.1 { Sensed::Clipped } else { Sensed::Derived })
        };
        let upper = there.requested.iter().filter(|gate| **gate == Gate::High).count();
        let phase = |k: usize| match s.arrangement {
            Arrangement::TwoInLine if k == 2 => derived(2),
            Arrangement::LowSideShunts if there.requested[k] == Gate::High => {
                if upper == 1 {
                    derived(k)
                } else {
                    (0.0, Sensed::Hidden)
                }
            }
            _ => measured(k),
        };
        let phases = [phase(0), phase(1), phase(2)];

        let mut dc_link = self.sensors.dc_link_gain * there.dc_link + self.sensors.dc_link_offset;
        if s.dc_link.noise > 0.0 {
            dc_link += s.dc_link.noise * normal(&mut self.link_noise);
        }
        let mut dc_link_clipped = false;
        if let Some(adc) = s.dc_link.adc {
            (dc_link, dc_link_clipped) = adc.convert(dc_link);
        }
        Reading {
            at,
            current: Abc(phases.map(|(value, _)| T::of(value))),
            sensed: Abc(phases.map(|(_, sensed)| sensed)),
            dc_link: T::of(dc_link),
            dc_link_clipped,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standstill_inverter::Conduction::{Blocked, LowerDiode, LowerSwitch, UpperDiode, UpperSwitch};

    fn sampler(settings: SensorSettings) -> Sampler {
        Sampler::new(Sensors::nominal(settings), Streams::new(1, 0))
    }

    fn there(modes: Modes, requested: [Gate; 3]) -> Instant {
        Instant { current: [1.5, -1.5, 0.0], dc_link: 550.0, requested }.through(SensorSettings::IDEAL, modes)
    }

    impl Instant {
        fn through(self, settings: SensorSettings, modes: Modes) -> Self {
            Self { current: settings.seen(self.current, modes), ..self }
        }
    }

    const PULSE: ([Gate; 3], Modes) =
        ([Gate::High, Gate::Low, Gate::Off], [UpperSwitch, LowerSwitch, Blocked]);

    #[test]
    fn analytic_adc_rounds_and_clips() {
        let adc = Adc { bits: 12, low: -20.0, high: 20.0 };
        let step = 40.0 / 4096.0;
        assert_eq!(adc.convert(0.6 * step), (step, false));
        assert_eq!(adc.convert(25.0), (20.0 - step, true));
        assert_eq!(adc.convert(-25.0), (-20.0, true));
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
    fn law_each_error_shows_in_its_place() {
        let read = |change: fn(&mut Sensors)| {
            let mut sensors = Sensors::nominal(SensorSettings::IDEAL);
            change(&mut sensors);
            let reading: Reading<f64> =
                Sampler::new(sensors, Streams::new(1, 0)).read(Nanos(0), &there(PULSE.1, PULSE.0));
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

    #[test]
    fn analytic_low_pass_of_a_ramp_lags_by_its_time_constant() {
        let mut filter = LowPass::new(1.0 / (std::f64::consts::TAU * 1e-6), 0.0);
        // x = t in one long step, then compare with t − τ (1 − e^{−t/τ}).
        filter.advance(5e-6, [0.0, 5e-6 / 3.0, 10e-6 / 3.0, 5e-6]);
        let exact = 5e-6 - 1e-6 * (1.0 - (-5.0_f64).exp());
        assert!((filter.output() - exact).abs() < 1e-18);
        // Steps of no length change nothing, however short.
        let mut settled = LowPass::new(1e3, 1.0);
        for h in [1e-9, 1e-11, 1e-13, 1e-15] {
            settled.advance(h, [1.0, 1.0 + 1e-15, 1.0 - 1e-15, 1.0]);
        }
        assert!((settled.output() - 1.0).abs() < 1e-12, "{}", settled.output());
        // Just below and just above the change of method: the same ramp.
        for h in [0.0099e-6, 0.0101e-6] {
            let mut filter = LowPass::new(1.0 / (std::f64::consts::TAU * 1e-6), 0.0);
            filter.advance(h, [0.0, h / 3.0, 2.0 * h / 3.0, h]);
            let exact = h + 1e-6 * (-h / 1e-6).exp_m1();
            assert!((filter.output() - exact).abs() < 1e-7 * exact, "{} {exact}", filter.output());
        }
        // A cubic in two steps is a cubic in one.
        let cubic = |t: f64| 1.0 + t - 2.0 * t * t + 0.5 * t * t * t;
        let advance = |filter: &mut LowPass, from: f64, h: f64| {
            filter.advance(h, [0.0, 1.0, 2.0, 3.0].map(|k| cubic(from + k * h / 3.0)));
        };
        let (mut one, mut two) = (LowPass::new(0.3, 0.0), LowPass::new(0.3, 0.0));
        advance(&mut one, 0.0, 2.0);
        advance(&mut two, 0.0, 0.7);
        advance(&mut two, 0.7, 1.3);
        assert!((one.output() - two.output()).abs() < 1e-13);
    }
}
