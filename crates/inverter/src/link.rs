//! The DC side: a source with ripple and sag, behind a resistance and onto a capacitor, or stiff.

use std::f64::consts::TAU;

use standstill_numeric::{Lane, sin_cos};

/// A dip of the source voltage: a smooth trough (raised cosine), so that nothing in it is an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sag {
    /// Depth as a share of the voltage.
    pub depth: f64,
    /// Begin in s after the start of the run.
    pub start: f64,
    /// Length in s.
    pub duration: f64,
}

/// A link capacitor fed through a resistance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Storage {
    /// In F.
    pub capacitance: f64,
    /// Resistance of the source in Ω.
    pub source_resistance: f64,
}

/// The DC link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DcLink {
    /// Mean voltage of the source in V.
    pub voltage: f64,
    /// Amplitude of its ripple as a share of it.
    pub ripple: f64,
    /// Ripple frequency in Hz.
    pub ripple_frequency: f64,
    /// Phase of the ripple in rad at the start of the run.
    pub ripple_phase: f64,
    /// A dip, if any.
    pub sag: Option<Sag>,
    /// Capacitor and source resistance; without them the link has the source's voltage whatever flows.
    pub storage: Option<Storage>,
    /// Largest current in A that the source delivers into the capacitor; none: no limit. What it takes back has no limit.
    pub most_current: Option<f64>,
}

impl DcLink {
    /// Makes a stiff link without ripple.
    pub const fn stiff(voltage: f64) -> Self {
        Self {
            voltage,
            ripple: 0.0,
            ripple_frequency: 300.0,
            ripple_phase: 0.0,
            sag: None,
            storage: None,
            most_current: None,
        }
    }

    /// Returns the current in A that the source delivers into the capacitor, whose voltage is by `lack` in V lower than the source's. Zero
    /// without a capacitor.
    ///
    /// ```
    /// use standstill_inverter::{DcLink, Storage};
    ///
    /// let storage = Some(Storage { capacitance: 500e-6, source_resistance: 0.2 });
    /// let link = DcLink { storage, most_current: Some(10.0), ..DcLink::stiff(550.0) };
    /// assert_eq!([1.0, 2.0, 50.0, -50.0].map(|lack| link.delivered(lack)), [5.0, 10.0, 10.0, -250.0]);
    /// ```
    pub fn delivered(&self, lack: f64) -> f64 {
        let delivered = self.storage.map_or(0.0, |storage| lack / storage.source_resistance);
        self.most_current.map_or(delivered, |most| delivered.min(most))
    }

    /// Returns the source's voltage in V at time t in s.
    ///
    /// ```
    /// use standstill_inverter::{DcLink, Sag};
    ///
    /// let sag = Sag { depth: 0.1, start: 0.0, duration: 10e-3 };
    /// let link = DcLink { sag: Some(sag), ..DcLink::stiff(550.0) };
    /// // Half way through, a tenth of the voltage is missing; afterwards nothing is.
    /// assert!((link.source(5e-3) - 495.0).abs() < 1e-9);
    /// assert_eq!(link.source(20e-3), 550.0);
    /// ```
    pub fn source(&self, t: f64) -> f64 {
        let ripple = [self.ripple * self.voltage, TAU * self.ripple_frequency, self.ripple_phase];
        let ripple = (self.ripple != 0.0).then_some(ripple);
        let sag = self.sag.map(|sag| [sag.depth * self.voltage / 2.0, sag.start, 1.0 / sag.duration]);
        Source::at(self.voltage, ripple, sag, t).voltage
    }
}

/// A source's voltage.
#[derive(Clone, Copy, Debug, Default)]
pub struct Source<T> {
    /// In V.
    pub voltage: T,
    /// Rate of change of the voltage in V/s.
    pub rise: T,
}

impl<T: Lane> Source<T> {
    /// Makes a source of this mean voltage in V, with a ripple's amplitude in V, frequency in rad/s and phase in rad,
    /// and half the depth in V, start in s and rate in 1/s of a sag.
    #[inline(always)]
    pub fn at(voltage: T, ripple: Option<[T; 3]>, sag: Option<[T; 3]>, t: T) -> Self {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let mut source = Self { voltage, rise: zero };
        if let Some([amplitude, frequency, phase]) = ripple {
            let (sin, cos) = sin_cos(t * frequency + phase);
            source.voltage = source.voltage + sin * amplitude;
            source.rise = cos * (amplitude * frequency);
        }
        if let Some([half, start, rate]) = sag {
            let share = (t - start) * rate;
            let (sin, cos) = sin_cos(share * TAU);
            let (begun, goes_on) = (share.above(zero), one.above(share));
            let dip = T::choose(begun, T::choose(goes_on, (one - cos) * half, zero), zero);
            let fall = T::choose(begun, T::choose(goes_on, sin * (half * (rate * TAU)), zero), zero);
            source.voltage = source.voltage - dip;
            source.rise = source.rise - fall;
        }
        source
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_ripple_and_sag() {
        let mut link = DcLink { ripple: 0.01, ..DcLink::stiff(550.0) };
        assert!((link.source(1.0 / 1200.0) - 555.5).abs() < 1e-9);
        link.ripple = 0.0;
        link.sag = Some(Sag { depth: 0.2, start: 0.01, duration: 0.02 });
        assert_eq!(link.source(0.005), 550.0);
        assert!((link.source(0.02) - 440.0).abs() < 1e-9);
        assert_eq!(link.source(0.04), 550.0);
    }
}
