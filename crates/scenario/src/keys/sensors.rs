//! The keys of the sensors.

use standstill_detect::Method;
use standstill_quantity::Quantity;
use standstill_quantity::unit::{Ampere, AmperePerSecond, Degree, Hertz, Ohm, One, Second, Share, Volt};
use standstill_sim::{Adc, Arrangement, Comparators, Purpose, TerminalSensor};

use super::{NOT_NEGATIVE, POSITIVE, Range, SHARE, TIME, Usual, number, table};
use crate::Scenario;
use crate::named::Named;

const SPREAD: Range = Range::new(
    0.0,
    0.9,
    "a share from 0 to 0.9: a corner frequency is more than zero",
    "a corner frequency is more than zero",
);
const BITS: Range =
    Range::new(0.0, 24.0, "a whole number from 0 to 24", "converters have up to 24 bits").whole();
const SKEW: &str = "from 0 to 100 us: the next sample waits until all phases are converted";
const SETTLE: &str = "from 0 to 1 ms: amplifiers of shunts settle within microseconds";
const DECAY: &str = "from 1 ns to 100 us: what rings longer is no pick-up of an edge";
const RINGING: &str = "from 0 to 1000 MHz: samples are taken in whole nanoseconds";

const SLEW: &str = "0, or from 1000 A/s to 1e15 A/s: amplifiers follow the current of a winding";
const ACQUISITION: &str = "0, or from 1 ns to 100 us: a capacitor follows a sensor faster than a pulse lasts";

const LOAD: &str = "0, or from 1 Ω to 1 TΩ: less would carry a motor's current";

/// Range of all draws of a purpose, for purposes with one draw per sample.
const EACH: std::ops::Range<usize> = 0..usize::MAX;

/// Returns whether the drive has current sensors.
fn reads_currents<M>(scenario: &Scenario<M>) -> bool {
    scenario.sensors.arrangement != Arrangement::None
}

/// Returns whether the drive's current sensors have filters.
fn has_filters<M>(scenario: &Scenario<M>) -> bool {
    reads_currents(scenario) && scenario.sensors.bandwidth.is_some()
}

/// Returns whether the drive has dividers at its terminals.
fn has_dividers(scenario: &Scenario<Method<f64>>) -> bool {
    scenario.sensors.terminal.is_some()
}

/// Returns a number of the dividers; none if the drive has no dividers.
fn of_dividers(scenario: &Scenario<Method<f64>>, of: fn(&TerminalSensor) -> f64) -> Option<toml::Value> {
    scenario.sensors.terminal.as_ref().map(|terminal| number(of(terminal)))
}

const TICK: Range =
    Range::new(0.0, 1e-3, "from 0 to 1 ms: a pulse lasts several ticks", "a pulse lasts several ticks");
const CLOCK: Range =
    Range::new(0.0, 0.1, "a share from 0 to 0.1", "clocks without a crystal are off by a few per cent");
const DELAY: Range = Range::new(
    0.0,
    1e-4,
    "from 0 to 100 us: a comparator is faster than the pulse that it ends",
    "a comparator is faster than the pulse that it ends",
);

/// Returns whether the drive has comparators.
fn watches<M>(scenario: &Scenario<M>) -> bool {
    scenario.sensors.comparator.any()
}

/// Returns whether the drive has a timer that captures the comparators' trips.
fn captures<M>(scenario: &Scenario<M>) -> bool {
    scenario.sensors.comparator.timer > 0.0
}

/// Returns whether a D/A converter of finite resolution sets the comparators' threshold.
fn coarse<M>(scenario: &Scenario<M>) -> bool {
    captures(scenario) && scenario.sensors.comparator.bits > 0
}

fn bits(adc: Option<Adc>) -> toml::Value {
    number(adc.map_or(0.0, |adc| adc.bits.into()))
}

table! {
    /// The sensors. Deviations are between specimens; each trial draws one specimen.
    pub struct SensorsTable = "sensors" of scenario {
        /// Place of the current sensors.
        arrangement: Named<Arrangement> {
            get: |scenario| Some(scenario.sensors.arrangement.name().into()),
            example: "\"three-in-line\"",
        };
        /// Standard deviation of each phase's gain.
        gain_error: Quantity<Share> [scenario.sensors.gain_error] {
            range: Some(SHARE), usual: Some((0.2, Usual::Whole)), draws: Some((Purpose::CurrentGain, 0..3)), drawn: reads_currents,
            example: "\"0.5 %\"",
        };
        /// Standard deviation of each phase's offset.
        offset: Quantity<Ampere> [scenario.sensors.offset] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::RatedCurrent)), draws: Some((Purpose::CurrentOffset, 0..3)),
            drawn: reads_currents, example: "\"20 mA\"",
        };
        /// Noise of each sample, rms.
        noise: Quantity<Ampere> [scenario.sensors.noise] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::RatedCurrent)), draws: Some((Purpose::CurrentNoise, EACH)),
            drawn: reads_currents, example: "\"10 mA\"",
        };
        /// Nominal corner frequency of the current sensors' first-order filters, which the drive knows. 0: no filter.
        bandwidth: Quantity<Hertz> {
            range: Some(NOT_NEGATIVE),
            get: |scenario| Some(number(scenario.sensors.bandwidth.unwrap_or(0.0))),
            set: Some(|scenario, corner| scenario.sensors.bandwidth = (corner > 0.0).then_some(corner)),
            example: "\"200 kHz\"",
        };
        /// Largest deviation that all corner frequencies of a specimen have in common, either way; uniform distribution.
        bandwidth_tolerance: Quantity<Share> [scenario.sensors.bandwidth_tolerance] {
            range: Some(SPREAD), draws: Some((Purpose::Bandwidth, 0..1)), drawn: has_filters,
            example: "\"20 %\"",
        };
        /// Largest deviation of each phase's corner frequency in addition to the common one, either way; uniform distribution.
        bandwidth_mismatch: Quantity<Share> [scenario.sensors.bandwidth_mismatch] {
            range: Some(SPREAD), draws: Some((Purpose::Bandwidth, 1..4)), drawn: has_filters,
            example: "\"3 %\"",
        };
        /// Time from the conversion of phase a to that of phase b, and from b to c.
        skew: Quantity<Second> [scenario.sensors.skew] {
            range: Some(Range::new(0.0, 1e-4, SKEW, "the next sample waits")), example: "\"0.5 us\"",
        };
        /// Number of conversions per sample: a reading is their mean, a code their sum.
        oversampling: Quantity<One> {
            range: Some(Range::new(1.0, 64.0, "a whole number from 1 to 64: converters average no more by themselves", "converters average no more by themselves").whole()),
            get: |scenario| Some(number(scenario.sensors.oversampling.into())), example: "4",
        };
        /// Time from one conversion of a channel to the next one of the same sample, at least twice `skew`.
        conversion: Quantity<Second> [scenario.sensors.conversion] {
            range: Some(Range::new(1e-8, 1e-4, "from 10 ns to 100 us: a sample ends before the next one", "a sample ends before the next one")),
            applies: |scenario| scenario.sensors.oversampling > 1, example: "\"1 us\"",
        };
        /// Settling time of a shunt's amplifier that the drive assumes: it does not read a shunt until the dead time and this time have
        /// passed since the last request to its leg, to any leg for the shunt in the DC link.
        settle: Quantity<Second> [scenario.sensors.settle] {
            range: Some(Range::new(0.0, 1e-3, SETTLE, "amplifiers settle within a millisecond")),
            applies: |scenario| scenario.sensors.arrangement.follows_legs(), example: "\"4 us\"",
        };
        /// Slew rate of the shunts' amplifiers: the fastest change of their output, as a current per time; 0: no limit.
        slew: Quantity<AmperePerSecond> [scenario.sensors.slew] {
            range: Some(Range::new(0.0, 1e15, SLEW, "amplifiers follow the current of a winding").or_from(1e3)),
            applies: |scenario| scenario.sensors.arrangement.follows_legs(), example: "\"5 MA/s\"",
        };
        /// Time constant with which the sampling capacitors of the current converters follow the sensors between conversions, through the
        /// resistance in front of them; 0: they follow at once.
        acquisition: Quantity<Second> [scenario.sensors.acquisition] {
            range: Some(Range::new(0.0, 1e-4, ACQUISITION, "a capacitor follows a sensor faster than a pulse lasts").or_from(1e-9)),
            applies: reads_currents, example: "\"100 ns\"",
        };
        /// Amplitude that an edge of a leg's potential adds to all readings of current.
        pick_up: Quantity<Ampere> {
            range: Some(NOT_NEGATIVE),
            get: |scenario| Some(number(scenario.sensors.pick_up.map_or(0.0, |of| of.amplitude))),
            example: "\"0.2 A\"",
        };
        /// Time constant with which the pick-up of an edge decays.
        pick_up_decay: Quantity<Second> {
            range: Some(Range::new(1e-9, 1e-4, DECAY, "longer ringing is no pick-up of an edge")),
            get: |scenario| scenario.sensors.pick_up.map(|of| number(of.decay)),
            applies: |scenario| scenario.sensors.pick_up.is_some(),
            example: "\"0.5 us\"",
        };
        /// Frequency with which the pick-up of an edge rings.
        pick_up_frequency: Quantity<Hertz> {
            range: Some(Range::new(0.0, 1e9, RINGING, "samples are taken in whole nanoseconds")),
            get: |scenario| scenario.sensors.pick_up.map(|of| number(of.frequency)),
            applies: |scenario| scenario.sensors.pick_up.is_some(),
            example: "\"5 MHz\"",
        };
        /// Lowest current of the current converters' range, for amplifiers of one direction. Default: minus `range`.
        range_low: Quantity<Ampere> {
            range: Some(Range::new(-1e6, 0.0, "from -1e6 A to 0 A", "a reading without current lies within the range")),
            get: |scenario| scenario.sensors.adc.map(|adc| number(adc.low)), example: "\"-0.5 A\"",
        };
        /// Largest current of the current converters' range.
        range: Quantity<Ampere> {
            range: Some(POSITIVE), get: |scenario| scenario.sensors.adc.map(|adc| number(adc.high)), example: "\"20 A\"",
        };
        /// Bits of the current converters; 0: readings are limited to the range, but not rounded.
        bits: Quantity<One> { range: Some(BITS), get: |scenario| Some(bits(scenario.sensors.adc)), example: "12" };
        /// Largest deviation of a trigger's instant, either way; uniform distribution.
        jitter: Quantity<Second> [scenario.sensors.jitter] {
            range: Some(TIME), usual: Some((0.2, Usual::Carrier)), draws: Some((Purpose::Jitter, EACH)), example: "\"50 ns\"",
        };
        /// Delay of all triggers.
        sample_delay: Quantity<Second> [scenario.sensors.sample_delay] {
            range: Some(TIME), usual: Some((0.5, Usual::Carrier)), example: "\"0 us\"",
        };
        /// Standard deviation of the DC-link sensor's gain.
        dc_link_gain_error: Quantity<Share> [scenario.sensors.dc_link.gain_error] {
            range: Some(SHARE), usual: Some((0.2, Usual::Whole)), draws: Some((Purpose::LinkError, 0..1)), example: "\"0.5 %\"",
        };
        /// Standard deviation of the DC-link sensor's offset.
        dc_link_offset: Quantity<Volt> [scenario.sensors.dc_link.offset] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::Link)), draws: Some((Purpose::LinkError, 1..2)), example: "\"1 V\"",
        };
        /// Noise of the DC-link sensor's samples, rms.
        dc_link_noise: Quantity<Volt> [scenario.sensors.dc_link.noise] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::Link)), draws: Some((Purpose::LinkNoise, EACH)), example: "\"0.5 V\"",
        };
        /// Range of the DC link's converter, from zero.
        dc_link_range: Quantity<Volt> {
            range: Some(POSITIVE), get: |scenario| scenario.sensors.dc_link.adc.map(|adc| number(adc.high)), example: "\"1000 V\"",
        };
        /// Bits of the DC link's converter; 0: readings are limited to the range, but not rounded.
        dc_link_bits: Quantity<One> {
            range: Some(BITS), get: |scenario| Some(bits(scenario.sensors.dc_link.adc)), example: "12",
        };
        /// Whether the drive reads the voltages of its terminals, each behind a divider to the negative rail.
        terminals: bool {
            get: |scenario| Some(toml::Value::Boolean(has_dividers(scenario))), example: "true",
        };
        /// Standard deviation of the gain of each divider at a terminal.
        terminal_gain_error: Quantity<Share> {
            range: Some(SHARE), usual: Some((0.2, Usual::Whole)), draws: Some((Purpose::TerminalGain, 0..3)),
            get: |scenario| of_dividers(scenario, |of| of.gain_error), applies: has_dividers,
            set: Some(|scenario, value| if let Some(of) = &mut scenario.sensors.terminal { of.gain_error = value }),
            example: "\"0.5 %\"",
        };
        /// Standard deviation of the offset of each divider at a terminal, as a voltage of the terminal.
        terminal_offset: Quantity<Volt> {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::Link)), draws: Some((Purpose::TerminalOffset, 0..3)),
            get: |scenario| of_dividers(scenario, |of| of.offset), applies: has_dividers,
            set: Some(|scenario, value| if let Some(of) = &mut scenario.sensors.terminal { of.offset = value }),
            example: "\"0.5 V\"",
        };
        /// Noise of each sample of a terminal's voltage, rms.
        terminal_noise: Quantity<Volt> {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::Link)), draws: Some((Purpose::TerminalNoise, EACH)),
            get: |scenario| of_dividers(scenario, |of| of.noise), applies: has_dividers,
            set: Some(|scenario, value| if let Some(of) = &mut scenario.sensors.terminal { of.noise = value }),
            example: "\"0.5 V\"",
        };
        /// Corner frequency of the first-order filter behind each divider. 0: no filter.
        terminal_bandwidth: Quantity<Hertz> {
            range: Some(NOT_NEGATIVE),
            get: |scenario| of_dividers(scenario, |of| of.bandwidth.unwrap_or(0.0)), applies: has_dividers,
            set: Some(|scenario, corner| if let Some(of) = &mut scenario.sensors.terminal {
                of.bandwidth = (corner > 0.0).then_some(corner);
            }),
            example: "\"100 kHz\"",
        };
        /// Range of the converters of the terminals' voltages, from zero.
        terminal_range: Quantity<Volt> {
            range: Some(POSITIVE), applies: has_dividers,
            get: |scenario| scenario.sensors.terminal.and_then(|of| of.adc).map(|adc| number(adc.high)), example: "\"1000 V\"",
        };
        /// Bits of the converters of the terminals' voltages; 0: readings are limited to the range, but not rounded.
        terminal_bits: Quantity<One> {
            range: Some(BITS), applies: has_dividers,
            get: |scenario| scenario.sensors.terminal.map(|of| bits(of.adc)), example: "12",
        };
        /// Resistance of each divider, which loads its terminal: it pulls idle terminals to the negative rail and discharges their capacitance. 0: no load.
        terminal_load: Quantity<Ohm> {
            range: Some(Range::new(0.0, 1e12, LOAD, "less would carry a motor's current").or_from(1.0)),
            get: |scenario| of_dividers(scenario, |of| of.resistance.unwrap_or(0.0)), applies: has_dividers,
            set: Some(|scenario, value| if let Some(of) = &mut scenario.sensors.terminal {
                of.resistance = (value > 0.0).then_some(value);
            }),
            example: "\"1 MΩ\"",
        };
        /// Current that the comparators watch: that of the DC link, or that of each phase.
        comparators: Named<Comparators> {
            get: |scenario| Some(scenario.sensors.comparator.arrangement.name().into()), applies: watches, example: "\"common\"",
        };
        /// Tick of the timer that captures when a comparator trips. 0: no timer.
        timer: Quantity<Second> [scenario.sensors.comparator.timer] {
            // Draw 1 is the position of the timer within a tick when a pulse begins.
            range: Some(TICK), draws: Some((Purpose::CaptureTimer, 1..2)), drawn: captures, example: "\"0.32 us\"",
        };
        /// Standard deviation of the frequency of that timer's clock, as a share.
        timer_error: Quantity<Share> [scenario.sensors.comparator.timer_error] {
            range: Some(CLOCK), draws: Some((Purpose::CaptureTimer, 0..1)), applies: captures, drawn: captures, example: "\"0.3 %\"",
        };
        /// Current at which the comparators switch the drive off for the rest of the run, as an overcurrent trip. 0: no trip.
        trip: Quantity<Ampere> [scenario.sensors.comparator.trip] { range: Some(NOT_NEGATIVE), example: "\"0 A\"" };
        /// Standard deviation of the offset of each comparator.
        comparator_offset: Quantity<Ampere> [scenario.sensors.comparator.offset] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::RatedCurrent)), draws: Some((Purpose::ComparatorOffset, 0..6)),
            applies: watches, drawn: watches, example: "\"40 mA\"",
        };
        /// Mean delay from the crossing of the threshold to gates and timer, which the drive knows.
        comparator_delay: Quantity<Second> [scenario.sensors.comparator.delay] {
            range: Some(DELAY), applies: watches, example: "\"200 ns\"",
        };
        /// Standard deviation of each comparator's delay.
        comparator_delay_spread: Quantity<Second> [scenario.sensors.comparator.delay_spread] {
            range: Some(DELAY), draws: Some((Purpose::ComparatorDelay, 0..6)), applies: watches, drawn: watches, example: "\"20 ns\"",
        };
        /// Noise of the current at a comparator, rms.
        comparator_noise: Quantity<Ampere> [scenario.sensors.comparator.noise] {
            range: Some(NOT_NEGATIVE), usual: Some((0.2, Usual::RatedCurrent)), draws: Some((Purpose::ComparatorNoise, EACH)),
            applies: captures, drawn: captures, example: "\"10 mA\"",
        };
        /// Corner frequency of the noise at a comparator, which trips at the first crossing. 0: the noise has one value for the whole pulse.
        comparator_bandwidth: Quantity<Hertz> [scenario.sensors.comparator.noise_bandwidth] {
            range: Some(Range::new(0.0, 1e7, "from 0 to 10 MHz: a gate switches in whole nanoseconds", "gates switch in whole nanoseconds")),
            applies: captures, drawn: captures, example: "\"1 MHz\"",
        };
        /// Time after the start of each stage for which the comparators are ignored.
        blanking: Quantity<Second> [scenario.sensors.comparator.blanking] {
            range: Some(DELAY), applies: watches, example: "\"1 us\"",
        };
        /// Upper end of the range of the converter that sets the threshold, from zero.
        threshold_range: Quantity<Ampere> [scenario.sensors.comparator.range] {
            range: Some(POSITIVE), applies: coarse, example: "\"20 A\"",
        };
        /// Bits of the converter that sets the threshold. 0: the threshold is exact.
        threshold_bits: Quantity<One> {
            range: Some(BITS), get: |scenario| Some(number(scenario.sensors.comparator.bits.into())), applies: captures, example: "10",
        };
        /// Standard deviation of the resolver whose reading is the "measured angle" in traces.
        resolver_error: Quantity<Degree> {
            range: Some(NOT_NEGATIVE),
            get: |scenario| Some(number(scenario.sensors.resolver.error.to_degrees())),
            example: "\"0.3 deg\"",
        };
    }
}
