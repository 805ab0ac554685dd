//! Analogue-to-digital converters: several channels are computed side by side.

use super::Sensors;
use crate::Misreading;

/// An analogue-to-digital converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adc {
    /// Resolution in bits. Zero means that values are limited to the range, but not rounded.
    pub bits: u8,
    /// Lower end of the converter's range, in the unit measured.
    pub low: f64,
    /// Upper end of the converter's range, in the unit measured.
    pub high: f64,
}

impl Adc {
    /// Number of bits with which a converter without rounding is computed. Its steps are negligible: 19 nA in a range of ±20 A.
    const FINE: u8 = 31;

    /// Returns the converter's number of codes.
    fn codes(self) -> f64 {
        f64::from(1_u32 << if self.bits == 0 { Self::FINE } else { self.bits })
    }

    /// Returns the distance between two codes (1 LSB) in the unit measured.
    pub fn step(self) -> f64 {
        (self.high - self.low) / self.codes()
    }

    /// Returns whether readings are rounded.
    pub const fn rounds(self) -> bool {
        self.bits > 0
    }
}

/// Channels side by side. A channel is a sensor with its converter, such as those of the three phases and of the link. All values of a
/// sample are computed without branches that depend on a value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channels<const N: usize> {
    gain: [f64; N],
    offset: [f64; N],
    /// Standard deviation of the noise of a sample.
    noise: [f64; N],
    /// Whether each channel has a converter.
    converts: [bool; N],
    low: [f64; N],
    /// Distance between two codes (1 LSB) in the unit measured.
    step: [f64; N],
    /// Highest code.
    last: [f64; N],
    /// Bit mask for the reported code of each channel. All bits are set if the converter rounds, else none.
    counted: [u32; N],
}

impl Channels<4> {
    /// Makes the channels of the three phases and of the link.
    pub(super) fn of(sensors: &Sensors) -> Self {
        let Sensors { settings, gain: [a, b, c], offset: [x, y, z], .. } = *sensors;
        let link = settings.dc_link;
        Self::new(
            [a, b, c, sensors.dc_link_gain],
            [x, y, z, sensors.dc_link_offset],
            [settings.noise, settings.noise, settings.noise, link.noise],
            [settings.adc, settings.adc, settings.adc, link.adc],
        )
    }
}

impl<const N: usize> Channels<N> {
    pub(super) fn new(gain: [f64; N], offset: [f64; N], noise: [f64; N], adcs: [Option<Adc>; N]) -> Self {
        Self {
            gain,
            offset,
            noise,
            converts: adcs.map(|adc| adc.is_some()),
            low: adcs.map(|adc| adc.map_or(0.0, |adc| adc.low)),
            step: adcs.map(|adc| adc.map_or(1.0, Adc::step)),
            last: adcs.map(|adc| adc.map_or(0.0, |adc| adc.codes() - 1.0)),
            counted: adcs.map(|adc| if adc.is_some_and(Adc::rounds) { u32::MAX } else { 0 }),
        }
    }

    /// Multiplies gain, offset and noise of each channel by a factor. A converter reference that is too low by this factor has the same
    /// effect.
    pub(super) fn grow(&mut self, by: [f64; N]) {
        for k in 0..N {
            self.gain[k] *= by[k];
            self.offset[k] *= by[k];
            self.noise[k] *= by[k];
        }
    }

    /// Changes gain, offset and noise of a channel such that they describe a fault of its sensor. Frozen sensors and stuck bits cannot be
    /// described in this way and change nothing here.
    pub(super) fn misread(&mut self, k: usize, how: Misreading) {
        let (gain, offset, noise) = (&mut self.gain[k], &mut self.offset[k], &mut self.noise[k]);
        match how {
            Misreading::Dead => (*gain, *noise) = (0.0, 0.0),
            Misreading::Stuck(value) => (*gain, *offset, *noise) = (0.0, value, 0.0),
            Misreading::Gain(factor) => *gain *= factor,
            Misreading::Offset(more) => *offset += more,
            Misreading::Frozen | Misreading::Bit(..) => {}
        }
    }

    /// Returns the reading `read` of a channel after one bit of its code has been set or cleared. The reading is unchanged if the
    /// converter does not round or has no such bit.
    pub(super) fn with_bit(
        &self,
        k: usize,
        read: (f64, bool, u32),
        bit: u8,
        is_set: bool,
    ) -> (f64, bool, u32) {
        if self.counted[k] == 0 || bit > 30 || f64::from(1_u32 << bit) > self.last[k] {
            return read;
        }
        let mask = 1_u32 << bit;
        let code = if is_set { read.2 | mask } else { read.2 & !mask };
        let of = f64::from(code);
        (self.low[k] + of * self.step[k], of == 0.0 || of == self.last[k], code)
    }

    /// Returns the readings of the true values `there`. `normals` contains standard normals for the noise. A channel without a converter
    /// does not round.
    #[inline(always)]
    pub(super) fn read(&self, there: [f64; N], normals: [f64; N]) -> Converted<N> {
        let (mut raw, mut code) = ([0.0; N], [0.0; N]);
        let mut read = Converted { value: [0.0; N], at_end: [false; N], code: [0; N] };
        for k in 0..N {
            raw[k] = self.gain[k] * there[k] + self.offset[k] + self.noise[k] * normals[k];
            code[k] = nearest(within((raw[k] - self.low[k]) / self.step[k], self.last[k]));
            read.value[k] = self.low[k] + code[k] * self.step[k];
        }
        for k in 0..N {
            read.at_end[k] = code[k] == 0.0 || code[k] == self.last[k];
            read.code[k] = whole(code[k]) & self.counted[k];
        }
        if self.converts != [true; N] {
            for k in 0..N {
                if !self.converts[k] {
                    read.put(k, (raw[k], false, 0));
                }
            }
        }
        read
    }
}

/// Readings of sensors side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Converted<const N: usize> {
    /// Values that the converters' codes represent, in the units measured. For channels without a converter the values are not rounded.
    pub value: [f64; N],
    /// Whether each code is at an end of its converter's range, that is, the first or the last code.
    pub at_end: [bool; N],
    /// Codes of the converters; 0 without rounding.
    pub code: [u32; N],
}

impl<const N: usize> Converted<N> {
    /// Returns the value of one channel, whether its code is at an end of the range, and the code.
    pub fn of(&self, k: usize) -> (f64, bool, u32) {
        (self.value[k], self.at_end[k], self.code[k])
    }

    /// Replaces the reading of one channel.
    pub fn put(&mut self, k: usize, (value, at_end, code): (f64, bool, u32)) {
        (self.value[k], self.at_end[k], self.code[k]) = (value, at_end, code);
    }
}

/// 2^52. All floating-point numbers above it are integers.
const WHOLE: f64 = 4_503_599_627_370_496.0;

/// Returns the integer nearest to a value between 0 and 2^32; halves are rounded upwards. Unlike `round`, it needs no library call, no
/// conversion, and no branch that is hard to predict. Not-a-number stays not-a-number.
#[inline(always)]
fn nearest(value: f64) -> f64 {
    // Adding 2^52 rounds, halves to the even number.
    let even = (value + WHOLE) - WHOLE;
    let up = if value - even >= 0.5 { 1.0 } else { 0.0 };
    even + up
}

/// Limits a value to the range from 0 to `last`. Unlike `clamp`, it does not check the limits, so the compiler can compute several values
/// side by side. Not-a-number stays not-a-number.
#[inline(always)]
fn within(value: f64, last: f64) -> f64 {
    let value = if value < 0.0 { 0.0 } else { value };
    if value > last { last } else { value }
}

/// Converts a code from 0 to 2^31 to an integer. No converter has a larger code. Not-a-number becomes 0.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "above 2^52 the low bits are the whole number")]
fn whole(code: f64) -> u32 {
    (code.max(0.0) + WHOLE).to_bits() as u32
}
