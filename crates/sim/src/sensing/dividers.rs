//! Dividers at the terminals: the drive's readings of its terminal voltages.

use standstill_interface::Sensed;

use super::misread::Misread;
use super::{Channels, Converted, Sensors};
use crate::{Draws, Purpose, Streams};

/// The dividers of one drive and their converters.
#[derive(Clone, Debug)]
pub struct Dividers<'t> {
    channels: Channels<3>,
    is_noisy: bool,
    noise: Draws<'t>,
    /// The last conversion, if the converters have a fault. None before the first one.
    last: Option<Converted<3>>,
}

impl<'t> Dividers<'t> {
    /// Makes the dividers of these sensors. None if the drive has no dividers.
    pub fn new(sensors: &Sensors, streams: Streams<'t>) -> Option<Self> {
        let of = sensors.settings.terminal?;
        Some(Self {
            channels: Channels::new(
                sensors.terminal_gain,
                sensors.terminal_offset,
                [of.noise; 3],
                [of.adc; 3],
            ),
            is_noisy: of.noise > 0.0,
            noise: streams.open(Purpose::TerminalNoise),
            last: None,
        })
    }

    /// Reads the terminals' true voltages `there` in V at `time` in ns, with the faults of all converters. For each terminal it returns the
    /// reading in V, the status of the reading, and the converter's code.
    pub fn read(&mut self, there: [f64; 3], misread: Option<&Misread>, time: f64) -> [(f64, Sensed, u32); 3] {
        let mut noise = [0.0; 3];
        if self.is_noisy {
            self.noise.normals(&mut noise);
        }
        let read = match misread {
            None => self.channels.read(there, noise),
            Some(misread) => {
                let mut channels = self.channels;
                channels.grow([misread.grown(time); 3]);
                let read = channels.read(there, noise);
                let before = self.last.replace(read);
                if misread.is_stale(time) { before.unwrap_or(read) } else { read }
            }
        };
        [0, 1, 2].map(|k| {
            let (value, at_end, code) = read.of(k);
            (value, if at_end { Sensed::Clipped } else { Sensed::Measured }, code)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Adc, SensorSettings, TerminalSensor};

    fn read(of: TerminalSensor, there: [f64; 3]) -> [(f64, Sensed, u32); 3] {
        let settings = SensorSettings { terminal: Some(of), ..SensorSettings::IDEAL };
        let streams = Streams::new(1, 0);
        Dividers::new(&Sensors::draw(settings, streams), streams).expect("dividers").read(there, None, 0.0)
    }

    #[test]
    fn law_a_divider_shows_its_error_its_range_and_its_code() {
        let there = [550.0, 0.0, 275.0];
        assert_eq!(read(TerminalSensor::IDEAL, there).map(|(value, ..)| value), there);
        let adc = Some(Adc { bits: 12, low: 0.0, high: 500.0 });
        let [a, b, c] = read(TerminalSensor { adc, ..TerminalSensor::IDEAL }, there);
        let step = 500.0 / 4096.0;
        assert_eq!(a, (4095.0 * step, Sensed::Clipped, 4095));
        assert_eq!(b, (0.0, Sensed::Clipped, 0));
        assert_eq!(c, (2253.0 * step, Sensed::Measured, 2253));
        // Each divider of a specimen has its own errors.
        let [a, b, c] = read(TerminalSensor { gain_error: 0.01, ..TerminalSensor::IDEAL }, [100.0; 3]);
        assert!(a.0 != b.0 && b.0 != c.0 && (a.0 - 100.0).abs() < 5.0, "{a:?} {b:?} {c:?}");
        let [a, b, _] = read(TerminalSensor { offset: 1.0, ..TerminalSensor::IDEAL }, [0.0; 3]);
        assert!(a.0 != b.0 && a.0 != 0.0, "{a:?} {b:?}");
        let none = Sensors::nominal(SensorSettings::IDEAL);
        assert!(Dividers::new(&none, Streams::new(1, 0)).is_none());
    }

    #[test]
    fn law_noise_of_dividers_has_the_stated_size() {
        let of = TerminalSensor { noise: 0.5, ..TerminalSensor::IDEAL };
        let settings = SensorSettings { terminal: Some(of), ..SensorSettings::IDEAL };
        let mut dividers = Dividers::new(&Sensors::nominal(settings), Streams::new(1, 0)).expect("dividers");
        let squares: f64 =
            (0..8000).flat_map(|_| dividers.read([0.0; 3], None, 0.0)).map(|(value, ..)| value * value).sum();
        let rms = (squares / 24_000.0).sqrt();
        assert!((rms / 0.5 - 1.0).abs() < 0.02, "{rms}");
    }
}
