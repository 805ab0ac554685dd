//! Faults of sensors: applies those that are present to the readings.

use super::{Channels, Converted};
use crate::{Broken, Fault, Faults, Misreading};

/// The faults of sensors in one run, and the last readings of their channels.
#[derive(Clone, Debug)]
pub(crate) struct Misread {
    faults: Faults,
    /// The last conversion of all channels, in the order phase a, b, c and link. None before the first conversion.
    last: Option<Converted<4>>,
    /// Last reading of each channel before the channel froze. None before the channel's first reading.
    held: [Option<f64>; 4],
}

impl Misread {
    /// Makes the faulty sensors of a case. None if no fault concerns a sensor.
    pub fn of(faults: Faults) -> Option<Self> {
        let concerns = |broken| {
            matches!(broken, Broken::Sensor(..) | Broken::Exchanged(..) | Broken::Drift(_) | Broken::Stale)
        };
        faults.iter().any(|fault| concerns(fault.broken)).then_some(Self {
            faults,
            last: None,
            held: [None; 4],
        })
    }

    /// Reads the channels at `time` in ns, with the faults present at that time. `values` contains the true values in the units measured.
    /// `normals` contains standard normals for the noise. The result has the form of [`Channels::read`].
    pub fn read(
        &mut self,
        channels: &Channels<4>,
        mut values: [f64; 4],
        normals: [f64; 4],
        time: f64,
    ) -> Converted<4> {
        let (mut channels, mut frozen) = (*channels, [false; 4]);
        for fault in self.faults.iter().filter(|fault| fault.is_there(time)) {
            match fault.broken {
                Broken::Exchanged(a, b) => values.swap(a, b),
                Broken::Sensor(k, Misreading::Frozen) => frozen[k] = true,
                Broken::Sensor(k, misreading) => channels.misread(k, misreading),
                _ => {}
            }
        }
        channels.grow([self.grown(time); 4]);
        for k in 0..4 {
            if let (true, Some(held)) = (frozen[k], self.held[k]) {
                channels.misread(k, Misreading::Stuck(held));
            }
        }
        let mut read = channels.read(values, normals);
        for k in 0..4 {
            if !frozen[k] || self.held[k].is_none() {
                self.held[k] = Some(read.value[k]);
            }
        }
        for broken in self.faults.at(time) {
            if let Broken::Sensor(k, Misreading::Bit(bit, is_set)) = broken {
                read.put(k, channels.with_bit(k, read.of(k), bit, is_set));
            }
        }
        let before = self.last.replace(read);
        if self.is_stale(time) { before.unwrap_or(read) } else { read }
    }

    /// Returns the factor by which the readings of all converters have grown at `time` in ns, because their common reference drifts.
    pub fn grown(&self, time: f64) -> f64 {
        let of = |fault: Fault| match fault.broken {
            Broken::Drift(rate) if fault.is_there(time) => {
                (1.0 + rate * (time - fault.from.0 as f64) * 1e-9).max(0.0)
            }
            _ => 1.0,
        };
        self.faults.iter().map(of).product()
    }

    /// Returns whether the converters repeat the results of the previous sample at `time` in ns.
    pub fn is_stale(&self, time: f64) -> bool {
        self.faults.at(time).any(|broken| broken == Broken::Stale)
    }
}
