//! Conversion between readings and the samples of the C interface.

use super::Sample;
use crate::{Abc, Capture, Counts, Nanos, Phase, Reading, Real, Sensed};

/// Returns the code of `enum sts_sensed`.
pub const fn sensed_code(sensed: Sensed) -> u8 {
    match sensed {
        Sensed::Measured => 0,
        Sensed::Derived => 1,
        Sensed::Clipped => 2,
        Sensed::Hidden => 3,
    }
}

/// Returns the inverse of [`sensed_code`]; an unknown code is [`Sensed::Hidden`].
pub const fn sensed_of(code: u8) -> Sensed {
    match code {
        0 => Sensed::Measured,
        1 => Sensed::Derived,
        2 => Sensed::Clipped,
        _ => Sensed::Hidden,
    }
}

impl Sample {
    /// A sample of a drive without any sensor.
    pub const HIDDEN: Self = {
        let hidden = sensed_code(Sensed::Hidden);
        Self {
            time_ns: 0,
            current: [0.0; 3],
            dc_link: 0.0,
            current_count: [0; 3],
            dc_link_count: 0,
            sensed: [hidden; 3],
            dc_link_clipped: 0,
            half: 0,
            link_sensed: hidden,
            captured: 0,
            comparator: 0,
            link_current: 0.0,
            link_current_count: 0,
            terminal: [0.0; 3],
            terminal_count: [0; 3],
            terminal_sensed: [hidden; 3],
            reserved: 0,
            capture_ticks: 0,
        }
    };

    /// Makes the C form of a reading, in single precision. `before`: time to be added to the reading's time; `half`:
    /// see the header.
    #[inline]
    pub fn of<T: Real>(reading: &Reading<T>, before: Nanos, half: u8) -> Self {
        let of = |value: T| short(value.to_double());
        let (Abc([a, b, c]), Abc([x, y, z])) = (reading.current, reading.terminal);
        let (ticks, comparator) = reading.capture.map_or((0, 0), |of| (of.ticks, of.comparator as u8));
        Self {
            time_ns: (before + reading.at).0,
            current: [of(a), of(b), of(c)],
            dc_link: of(reading.dc_link),
            current_count: reading.counts.current.0,
            dc_link_count: reading.counts.dc_link,
            sensed: reading.sensed.0.map(sensed_code),
            dc_link_clipped: reading.dc_link_clipped.into(),
            half,
            link_sensed: sensed_code(reading.link_sensed),
            captured: reading.capture.is_some().into(),
            comparator,
            link_current: of(reading.link_current),
            link_current_count: reading.counts.link_current,
            terminal: [of(x), of(y), of(z)],
            terminal_count: reading.counts.terminal.0,
            terminal_sensed: reading.terminal_sensed.0.map(sensed_code),
            reserved: 0,
            capture_ticks: ticks,
        }
    }

    /// Returns the reading of a sample.
    pub fn reading(&self) -> Reading<f32> {
        let comparator = Phase::ALL[usize::from(self.comparator.min(2))];
        Reading {
            at: Nanos(self.time_ns),
            current: Abc(self.current),
            sensed: Abc(self.sensed.map(sensed_of)),
            dc_link: self.dc_link,
            dc_link_clipped: self.dc_link_clipped != 0,
            counts: Counts {
                current: Abc(self.current_count),
                dc_link: self.dc_link_count,
                link_current: self.link_current_count,
                terminal: Abc(self.terminal_count),
            },
            link_current: self.link_current,
            link_sensed: sensed_of(self.link_sensed),
            terminal: Abc(self.terminal),
            terminal_sensed: Abc(self.terminal_sensed.map(sensed_of)),
            capture: (self.captured != 0).then_some(Capture { ticks: self.capture_ticks, comparator }),
        }
    }
}

/// Returns a firmware's own numbers.
#[allow(clippy::cast_possible_truncation, reason = "single precision is what the header has")]
const fn short(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_reading_comes_back_from_its_sample_in_single_precision() {
        // Each kind at each place, by the numbers of `enum sts_sensed`.
        let kinds = [Sensed::Measured, Sensed::Derived, Sensed::Clipped, Sensed::Hidden];
        for (code, sensed) in (0_u8..).zip(kinds) {
            let reading = Reading::<f64> {
                at: Nanos(40),
                current: Abc([1.3, -0.7, -0.6]),
                sensed: Abc([sensed, Sensed::Measured, Sensed::Hidden]),
                dc_link: 549.9,
                dc_link_clipped: code == 2,
                counts: Counts {
                    current: Abc([11, 12, 13]),
                    dc_link: 14,
                    link_current: 15,
                    terminal: Abc([16, 17, 18]),
                },
                link_current: 0.1,
                link_sensed: sensed,
                terminal: Abc([549.1, 0.9, 275.0]),
                terminal_sensed: Abc([Sensed::Derived, sensed, Sensed::Clipped]),
                capture: (code > 0).then_some(Capture { ticks: 77, comparator: Phase::B }),
            };
            let sample = Sample::of(&reading, Nanos(60), 1);
            assert_eq!((sample.time_ns, sample.half), (100, 1));
            assert_eq!((sample.sensed, sample.link_sensed), ([code, 0, 3], code));
            assert_eq!(sample.terminal_sensed, [1, code, 2]);
            let back = sample.reading();
            assert_eq!(back, Reading { at: Nanos(100), ..reading.cast() });
            // What fits into single precision loses nothing.
            assert_eq!(Sample::of(&back, Nanos(0), 1).reading(), back);
        }
        assert_eq!(sensed_of(4), Sensed::Hidden, "what a later header may add is nothing to rely on");
    }
}
