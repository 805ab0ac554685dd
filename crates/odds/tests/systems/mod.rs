//! Events whose probability has a closed form.

use std::convert::Infallible;

use standstill_numeric::erfc;
use standstill_odds::System;
use standstill_sim::{Purpose, Streams, Tape};

/// P(x > z) of a standard normal.
pub fn upper_tail(z: f64) -> f64 {
    0.5 * erfc(z / 2.0_f64.sqrt())
}

/// The z beyond which a standard normal is with this probability.
pub fn deviations(probability: f64) -> f64 {
    let (mut low, mut high) = (-10.0, 40.0);
    for _ in 0..200 {
        let middle = (low + high) / 2.0;
        if upper_tail(middle) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// A polarity test by two vectors: currents that differ by `margin` between the poles, each read with noise of one. The
/// wrong pole has the larger reading with Q(margin/√2).
#[derive(Clone, Copy, Debug)]
pub struct TwoVectors {
    pub margin: f64,
}

impl TwoVectors {
    #[allow(dead_code, reason = "not of all that take this file")]
    pub fn of(probability: f64) -> Self {
        Self { margin: 2.0_f64.sqrt() * deviations(probability) }
    }
}

impl System for TwoVectors {
    type Error = Infallible;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Infallible> {
        let value = |tape| {
            let mut noise = Streams::taped(tape).open(Purpose::CurrentNoise);
            let [along, against] = [self.margin + noise.normal(), noise.normal()];
            against - along
        };
        Ok(tapes.iter().map(value).collect())
    }
}

/// A gain that errs to either side, and noise: two modes, of weights Q(above) and Q(below).
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "not of all that take this file")]
pub struct TwoModes {
    pub above: f64,
    pub below: f64,
}

#[allow(dead_code, reason = "not of all that take this file")]
impl TwoModes {
    /// What decides, with the draws of one tape.
    pub fn error(tape: &Tape) -> f64 {
        let streams = Streams::taped(tape);
        let gain = streams.open(Purpose::CurrentGain).normal();
        let mut noise = streams.open(Purpose::CurrentNoise);
        // A mean of sixteen samples has a quarter of a sample's noise.
        let noise = (0..16).map(|_| noise.normal()).sum::<f64>() / 4.0;
        0.8 * gain + 0.6 * noise
    }

    pub fn probability(&self) -> f64 {
        upper_tail(self.above) + upper_tail(self.below)
    }
}

impl System for TwoModes {
    type Error = Infallible;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Infallible> {
        let value = |tape| {
            let error = Self::error(tape);
            (error - self.above).max(-error - self.below)
        };
        Ok(tapes.iter().map(value).collect())
    }
}

/// Two modes of which the rare one needs a path that the levels leave: it is likelier far out, but further from the middle.
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "not of all that take this file")]
pub struct Hidden;

#[allow(dead_code, reason = "not of all that take this file")]
impl Hidden {
    pub fn probability() -> f64 {
        upper_tail(4.5) + upper_tail(6.2)
    }
}

impl System for Hidden {
    type Error = Infallible;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, Infallible> {
        let value = |tape| {
            let mut draws = Streams::taped(tape).open(Purpose::CurrentGain);
            let [x, y] = [draws.normal(), draws.normal()];
            // Along x the values rise early and end beyond six deviations; along y they rise late, to an event at 4.5.
            let early = x - 6.2;
            let late = if y > 3.9 { 10.0 * (y - 4.5) } else { f64::NEG_INFINITY };
            early.max(late)
        };
        Ok(tapes.iter().map(value).collect())
    }
}
