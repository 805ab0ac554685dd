//! The sensors: the drive's measurements of the currents, the DC link and the rotor.

mod acquiring;
mod comparator;
mod converter;
mod divided;
mod dividers;
mod filters;
mod low_pass;
mod misread;
mod oversampling;
mod pick_up;
mod sampler;
mod sensed;

use standstill_interface::{Nanos, choice};
use standstill_inverter::Modes;

pub(crate) use comparator::Input;
pub use comparator::{Comparator, ComparatorSettings, Comparators};
pub use converter::Adc;
use converter::{Channels, Converted};
pub(crate) use low_pass::LowPass;
pub use pick_up::PickUp;
pub(crate) use sampler::{Instant, Sampler};
pub(crate) use sensed::Sensed;

use crate::{Purpose, Streams};

choice! {
    /// Arrangement of a drive's current sensors: where they measure.
    pub enum Arrangement {
        /// One sensor in each phase.
        ThreeInLine = "three-in-line",
        /// Sensors in phases a and b; the current of phase c is minus their sum.
        TwoInLine = "two-in-line",
        /// A shunt below each leg, which carries the leg's current only while the leg's lower device conducts. The current of
        /// a leg whose upper switch is on is derived from the other two legs; if two or more upper switches are on, the
        /// currents of their legs are hidden. With both switches off, a current into the motor, through the lower
        /// diode, is read; a current out of the motor, through the upper diode, reads as zero.
        LowSideShunts = "low-side-shunts",
        /// One shunt between link capacitor and bridge. It carries the sum of the currents of the legs whose upper device
        /// conducts: the current of the only leg that is high, or minus the current of the only leg that is low. After
        /// all switches have opened, diodes return current to the link, which is negative in the shunt. While all legs
        /// are low or all are high, the shunt carries no current.
        DcLinkShunt = "dc-link-shunt",
        /// No current sensors: no current is read.
        None = "none",
    }
}

impl Arrangement {
    /// Returns the number of current sensors.
    pub const fn sensors(self) -> usize {
        match self {
            Self::None => 0,
            Self::DcLinkShunt => 1,
            Self::TwoInLine => 2,
            Self::ThreeInLine | Self::LowSideShunts => 3,
        }
    }

    /// Returns whether the current through a sensor depends on which devices conduct.
    pub const fn follows_legs(self) -> bool {
        matches!(self, Self::LowSideShunts | Self::DcLinkShunt)
    }
}

/// The sensor of the DC link's voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VoltageSensor {
    /// Standard deviation of the sensor's relative gain error.
    pub gain_error: f64,
    /// Standard deviation of the sensor's offset in V.
    pub offset: f64,
    /// Noise of each sample in V rms.
    pub noise: f64,
    /// Corner frequency of the sensor's first-order filter in Hz. None for a sensor without a filter.
    pub bandwidth: Option<f64>,
    /// The sensor's converter. None for exact readings.
    pub adc: Option<Adc>,
}

/// Voltage dividers from each terminal to the negative rail, with their filters and converters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TerminalSensor {
    /// Standard deviation of each divider's relative gain error.
    pub gain_error: f64,
    /// Standard deviation of each divider's offset in V.
    pub offset: f64,
    /// Noise of each sample in V rms.
    pub noise: f64,
    /// Corner frequency of the dividers' first-order filters in Hz. None for dividers without filters.
    pub bandwidth: Option<f64>,
    /// The converters of the dividers. None for exact readings.
    pub adc: Option<Adc>,
    /// Resistance in Ω of each divider. None if the dividers draw no current. A divider pulls an idle terminal to the negative rail and
    /// discharges the terminal's capacitance C, if there is one. The oscillation of C with the winding must stay underdamped: |R_t/L −
    /// 1/(R C)| < 2/√(L C), where L is the winding's inductance and R_t is its resistance at the oscillation's frequency.
    pub resistance: Option<f64>,
}

impl TerminalSensor {
    /// Dividers without errors that draw no current.
    pub const IDEAL: Self =
        Self { gain_error: 0.0, offset: 0.0, noise: 0.0, bandwidth: None, adc: None, resistance: None };
}

/// The resolver, an angle sensor. Its reading is the "measured angle" with which the detector's result is compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resolver {
    /// Standard deviation of the resolver's error in rad electrical.
    pub error: f64,
}

/// Settings of the sensors of a type of drive. The errors of each specimen are drawn from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSettings {
    /// Arrangement of the current sensors.
    pub arrangement: Arrangement,
    /// Standard deviation of the relative gain error of each phase's current sensor.
    pub gain_error: f64,
    /// Standard deviation in A of the residual offset of each phase's current sensor.
    pub offset: f64,
    /// Noise of each current sample in A rms.
    pub noise: f64,
    /// Nominal corner frequency of the current sensors' first-order filters in Hz. None for sensors without filters.
    pub bandwidth: Option<f64>,
    /// Largest deviation that all corner frequencies of a specimen have in common, as a share of the nominal one. The deviation is
    /// uniformly distributed in both directions.
    pub bandwidth_tolerance: f64,
    /// Largest additional deviation of each phase's corner frequency, as a share of the nominal one. The deviation is uniformly
    /// distributed in both directions.
    pub bandwidth_mismatch: f64,
    /// Largest rate of change of the shunt amplifiers' outputs (slew rate) in A/s. Zero means no limit. It applies only if
    /// [`Arrangement::follows_legs`].
    pub slew: f64,
    /// Time constant of acquisition in s. With it, each channel's sampling capacitor follows the sensor between conversions, through the
    /// resistance before the converter. Zero means that the capacitor follows immediately. It cannot be combined with a slew rate.
    pub acquisition: f64,
    /// The current sensors' converter. None for exact readings.
    pub adc: Option<Adc>,
    /// Skew: time between conversions of one sample. The converter takes phase a together with the DC link, then phase b, then phase c. A
    /// conversion that would fall after the end of the command is taken at its end.
    pub skew: Nanos,
    /// Number of conversions in each sample. The value of a reading is the mean of the conversions. Its code is the sum of their codes.
    pub oversampling: u8,
    /// Time between successive conversions of one channel within a sample. It is at least twice `skew`. A conversion that would fall
    /// after the end of the command is taken at its end.
    pub conversion: Nanos,
    /// Pick-up of switching edges in all current readings. It is added after the filters. None for readings without pick-up.
    pub pick_up: Option<PickUp>,
    /// Jitter: largest deviation of each ADC trigger from its time. The deviation is uniformly distributed in both directions, but a
    /// sample never leaves its command.
    pub jitter: Nanos,
    /// Delay of all ADC triggers after their commanded times. A sample never leaves its command.
    pub sample_delay: Nanos,
    /// Settling time that the drive assumes for a shunt's amplifier. After each request to the shunt's leg, the reading is hidden during
    /// the dead time and this time. The shunt in the DC link is hidden after requests to any leg.
    pub settle: Nanos,
    /// The DC-link sensor.
    pub dc_link: VoltageSensor,
    /// The dividers at the terminals. None if the drive does not read its terminals. They are converted together with the DC link.
    pub terminal: Option<TerminalSensor>,
    /// The resolver.
    pub resolver: Resolver,
    /// The comparators, and the timer that captures the times of their trips.
    pub comparator: ComparatorSettings,
}

impl SensorSettings {
    /// Returns whether shunts have amplifiers with a slew rate.
    pub fn slews(&self) -> bool {
        self.slew > 0.0 && self.arrangement.follows_legs()
    }

    /// Returns whether the dividers have filters with continuous inputs. `capacitive` says whether the terminals have a capacitance.
    /// Without a capacitance the potentials of the terminals jump with the gates, and the inputs are not continuous.
    pub fn divides(&self, capacitive: bool) -> bool {
        capacitive && self.terminal.is_some_and(|of| of.bandwidth.is_some())
    }

    /// Returns the resistance in Ω of the dividers. None if they draw no current from the terminals.
    pub fn load(&self) -> Option<f64> {
        self.terminal.and_then(|of| of.resistance)
    }

    /// Returns the time from the first to the last conversion of one channel in a sample. The skew is not included.
    pub fn averaged(&self) -> Nanos {
        self.conversion.max(self.skew * 2) * (u64::from(self.oversampling.max(1)) - 1)
    }

    /// Returns the currents in A through the sensors of the three phases. Sensors in line carry the phase currents. Low-side shunts carry
    /// the currents of conducting lower devices. For a shunt in the DC link, the first value is the shunt's current.
    pub fn seen(&self, current: [f64; 3], modes: Modes) -> [f64; 3] {
        match self.arrangement {
            Arrangement::ThreeInLine | Arrangement::TwoInLine => current,
            Arrangement::None => [0.0; 3],
            Arrangement::LowSideShunts => {
                std::array::from_fn(|k| if modes[k].is_lower() { current[k] } else { 0.0 })
            }
            Arrangement::DcLinkShunt => {
                let upper = (0..3).filter(|k| modes[*k].is_upper());
                [upper.map(|k| current[k]).sum(), 0.0, 0.0]
            }
        }
    }

    /// Draws the corner frequencies of a specimen's three phase sensors, as shares of the nominal corner frequency.
    fn corners(&self, streams: Streams) -> [f64; 3] {
        let (common, own) = (self.bandwidth_tolerance, self.bandwidth_mismatch);
        // Sensors without tolerances take no draws.
        if self.bandwidth.is_none() || common == 0.0 && own == 0.0 {
            return [1.0; 3];
        }
        let mut draws = streams.open(Purpose::Bandwidth);
        let mut off = |width: f64| 1.0 + width * draws.uniform_in(-1.0..1.0);
        let all = off(common);
        [(); 3].map(|()| all * off(own))
    }

    /// Settings of sensors without any error.
    pub const IDEAL: Self = Self {
        arrangement: Arrangement::ThreeInLine,
        gain_error: 0.0,
        offset: 0.0,
        noise: 0.0,
        bandwidth: None,
        bandwidth_tolerance: 0.0,
        bandwidth_mismatch: 0.0,
        slew: 0.0,
        acquisition: 0.0,
        adc: None,
        skew: Nanos::ZERO,
        oversampling: 1,
        conversion: Nanos::from_micros(1),
        pick_up: None,
        jitter: Nanos::ZERO,
        sample_delay: Nanos::ZERO,
        settle: Nanos::ZERO,
        dc_link: VoltageSensor { gain_error: 0.0, offset: 0.0, noise: 0.0, bandwidth: None, adc: None },
        terminal: None,
        resolver: Resolver { error: 0.0 },
        comparator: ComparatorSettings {
            arrangement: Comparators::Common,
            timer: 0.0,
            timer_error: 0.0,
            offset: 0.0,
            delay: 0.0,
            delay_spread: 0.0,
            noise: 0.0,
            noise_bandwidth: 0.0,
            blanking: Nanos::ZERO,
            bits: 0,
            range: 0.0,
            trip: 0.0,
        },
    };
}

/// The sensors of one specimen (one drive), with the settings of its type and the errors drawn from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Settings from which the errors were drawn. They also determine noise, jitter and conversion of each sample.
    pub settings: SensorSettings,
    /// Gains of the phases' sensors.
    pub gain: [f64; 3],
    /// Offsets of the phases' sensors in A.
    pub offset: [f64; 3],
    /// Corner frequencies of the phases' sensors as shares of the nominal one.
    pub corner: [f64; 3],
    /// Gain of the DC-link sensor.
    pub dc_link_gain: f64,
    /// Offset of the DC-link sensor in V.
    pub dc_link_offset: f64,
    /// Gains of the dividers at the terminals.
    pub terminal_gain: [f64; 3],
    /// Offsets of the dividers at the terminals in V.
    pub terminal_offset: [f64; 3],
    /// Error of the resolver in rad electrical.
    pub resolver_error: f64,
    /// The comparators.
    pub comparator: Comparator,
}

impl Sensors {
    /// Makes sensors without random errors. Each value is the mean of its distribution.
    pub const fn nominal(settings: SensorSettings) -> Self {
        Self {
            settings,
            gain: [1.0; 3],
            offset: [0.0; 3],
            corner: [1.0; 3],
            dc_link_gain: 1.0,
            dc_link_offset: 0.0,
            terminal_gain: [1.0; 3],
            terminal_offset: [0.0; 3],
            resolver_error: 0.0,
            comparator: Comparator::nominal(&settings.comparator),
        }
    }

    /// Draws the sensors of one specimen.
    ///
    /// ```
    /// use standstill_sim::{SensorSettings, Sensors, Streams};
    ///
    /// let settings = SensorSettings { gain_error: 0.005, ..SensorSettings::IDEAL };
    /// let specimen = Sensors::draw(settings, Streams::new(1, 7));
    /// assert!(specimen.gain.iter().all(|gain| (gain - 1.0).abs() < 0.05));
    /// // The same trial of the same seed is the same specimen.
    /// assert_eq!(specimen, Sensors::draw(settings, Streams::new(1, 7)));
    /// ```
    pub fn draw(settings: SensorSettings, streams: Streams) -> Self {
        let [mut gains, mut offsets, mut link, mut resolver] = streams.open_together([
            Purpose::CurrentGain,
            Purpose::CurrentOffset,
            Purpose::LinkError,
            Purpose::Resolver,
        ]);
        let [mut terminal_gain, mut terminal_offset] = [[1.0; 3], [0.0; 3]];
        if let Some(of) = settings.terminal {
            let [mut gains, mut offsets] =
                streams.open_together([Purpose::TerminalGain, Purpose::TerminalOffset]);
            terminal_gain = std::array::from_fn(|_| 1.0 + of.gain_error * gains.normal());
            terminal_offset = std::array::from_fn(|_| of.offset * offsets.normal());
        }
        Self {
            settings,
            gain: std::array::from_fn(|_| 1.0 + settings.gain_error * gains.normal()),
            offset: std::array::from_fn(|_| settings.offset * offsets.normal()),
            corner: settings.corners(streams),
            dc_link_gain: 1.0 + settings.dc_link.gain_error * link.normal(),
            dc_link_offset: settings.dc_link.offset * link.normal(),
            terminal_gain,
            terminal_offset,
            resolver_error: settings.resolver.error * resolver.normal(),
            comparator: Comparator::draw(&settings.comparator, streams),
        }
    }
}
