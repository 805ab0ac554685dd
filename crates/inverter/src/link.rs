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
}

impl DcLink {
    /// A stiff link without ripple.
    pub const fn stiff(voltage: f64) -> Self {
        Self { voltage, ripple: 0.0, ripple_frequency: 300.0, ripple_phase: 0.0, sag: None, storage: None }
    }

    /// The source's voltage in V at time t in s.
    pub fn source(&self, t: f64) -> f64 {
        self.source_at(t, self.ripple_phase)
    }

    /// The same of links that differ in the phase of their ripple in rad, at a time each.
    #[inline(always)]
    pub fn source_at<T: Lane>(&self, t: T, ripple_phase: T) -> T {
        let mut relative = T::of(1.0);
        if self.ripple != 0.0 {
            let (sin, _) = sin_cos(t * (TAU * self.ripple_frequency) + ripple_phase);
            relative = relative + sin * self.ripple;
        }
        if let Some(sag) = self.sag {
            let share = (t - sag.start) * (1.0 / sag.duration);
            let (zero, one) = (T::of(0.0), T::of(1.0));
            let dip = (one - sin_cos(share * TAU).1) * (sag.depth / 2.0);
            let before_end = T::choose(one.above(share), dip, zero);
            relative = relative - T::choose(share.above(zero), before_end, zero);
        }
        relative * self.voltage
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
