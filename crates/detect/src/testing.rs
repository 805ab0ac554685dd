//! A motor and noise for tests.

extern crate std;
use std::vec::Vec;

use standstill_interface::{AlphaBeta, Angle, Command, Leg, Nanos, Outcome, Phase, Reading, Real};

use crate::method::likelihood::{LineParameters, PulseModel};
use crate::nameplate::{Comparing, Dividers, Nameplate, Place, Sensing};
use crate::parts::lines::line_directions;
use crate::parts::polarity::Signature;
use crate::parts::train::LINES;

/// A motor and drive like the paper's.
pub(crate) const PLATE: Nameplate<f64> = Nameplate {
    rated_current: 7.0,
    resistance: 1.2,
    d_axis_inductance: 10e-3,
    q_axis_inductance: 18e-3,
    magnet_flux: 0.5,
    signature: Signature::Normal,
    pulse_signature: Signature::Normal,
    polarity_difference: 0.1,
    cross_saturation: 0.0,
    rated_pulse: Nanos::from_micros(300),
    gain_tolerance: 0.005,
    dc_link: 540.0,
    dead_time: Nanos(2000),
    delay_mismatch: 0.0,
    carrier_period: Nanos::from_micros(100),
    switch_drop: [1.0, 0.01],
    diode_drop: [1.0, 0.01],
    reverse_drop: [1.0, 0.01],
    sensing: Sensing {
        bandwidth: None,
        bandwidth_mismatch: 0.0,
        skew: Nanos::ZERO,
        averaged: Nanos::ZERO,
        pick_up: [0.0; 2],
        place: Place::InLine,
        settle: Nanos::ZERO,
        link_noise: 0.0,
        comparator: NO_COMPARATOR,
    },
    dividers: Dividers { gain_tolerance: 0.005, offset: 0.5, bandwidth: None },
};

const NO_COMPARATOR: Comparing<f64> = Comparing {
    tick: 0.0,
    delay: 0.0,
    own: false,
    offset: 0.0,
    delay_spread: 0.0,
    noise: 0.0,
    blanking: 0.0,
    highest: 0.0,
    clock_error: 0.0,
};

/// Normally distributed numbers, the same each time.
pub(crate) struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Returns a uniform number in (0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 12) as f64 + 0.5) / (1_u64 << 52) as f64
    }

    /// Returns a normal number with mean 0 and variance 1 (Box and Muller).
    pub fn gauss(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (core::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A motor whose line inductances follow equation (4) and fall with the current along the magnet, and its sensors.
pub(crate) struct LineMotor {
    /// Angle in rad of the north pole.
    pub angle: f64,
    /// L_A and L_B in H, and c in H/A of a line along the magnet.
    pub mean: f64,
    pub saliency: f64,
    pub slope: f64,
    pub dc_link: f64,
    /// Noise in A rms, offsets in A and gains of the sensors.
    pub deviation: f64,
    pub offset: [f64; 3],
    pub gain: [f64; 3],
    /// Resistance in Ω of each phase's contact.
    pub contact: [f64; 3],
    /// τ in s of each sensor.
    pub lag: [f64; 3],
    /// How much later in s each phase is converted than the one before.
    pub skew: f64,
    /// Amplitude in A, time constant in s and frequency in Hz of what the end of a pulse adds to all readings.
    pub pick_up: [f64; 3],
    /// Where the sensors are: in the phases or below the legs.
    pub place: Place,
    pub noise: Noise,
    /// Length in s and peak current in A of each pulse so far.
    pub pulses: Vec<(f64, f64)>,
}

impl LineMotor {
    pub const DEAD_TIME: f64 = 2e-6;
    pub const RESISTANCE: f64 = 1.2;
    /// Drop of two devices in V.
    pub const DROP: f64 = 2.0;

    /// Returns a motor like the paper's, with the rotor at this angle.
    pub fn at(degrees: f64) -> Self {
        Self {
            angle: degrees.to_radians(),
            mean: 9.2e-3,
            saliency: -2.1e-3,
            slope: 1e-4,
            dc_link: 540.0,
            deviation: 0.0,
            offset: [0.0; 3],
            gain: [1.0; 3],
            contact: [0.0; 3],
            lag: [0.0; 3],
            skew: 0.0,
            pick_up: [0.0, 1.0, 0.0],
            place: Place::InLine,
            noise: Noise::new(7),
            pulses: Vec::new(),
        }
    }

    pub fn line(&self, line: usize) -> LineParameters<f64> {
        let third = core::f64::consts::TAU / 3.0;
        let shift = [-third, 0.0, third][line];
        let north = AlphaBeta::new(self.angle.cos(), self.angle.sin());
        LineParameters {
            inductance: 3.0 * self.mean - 3.0 * self.saliency * (2.0 * self.angle + shift).cos(),
            slope: self.slope * line_directions::<f64>()[line].dot(north),
            delay: Self::DEAD_TIME,
            lag: 0.0,
            late: 0.0,
        }
    }

    /// Readings of the sensors during a command of line pulses.
    pub fn readings<T: Real>(&mut self, command: &Command<T>) -> Vec<Reading<T>> {
        let count = usize::try_from(command.sampling.count).expect("few");
        let mut currents = std::vec![[0.0; 3]; count];
        let leg = |wanted: Leg<T>| Phase::ALL.into_iter().find(|phase| command.stage.legs[*phase] == wanted);
        if let (Some(from), Some(to)) = (leg(Leg::High), leg(Leg::Low)) {
            let forward = LINES.contains(&(from, to));
            let pair = if forward { (from, to) } else { (to, from) };
            let line = LINES.into_iter().position(|line| line == pair).expect("a line");
            let model = PulseModel {
                on: self.dc_link - Self::DROP,
                off: self.dc_link + Self::DROP,
                resistance: 2.0 * Self::RESISTANCE + self.contact[from as usize] + self.contact[to as usize],
                pulse: command.stage.duration.seconds(),
                interval: command.sampling.interval.seconds(),
                blank: 0.0,
                before_end: 0.0,
            };
            let lead = model.interval - command.sampling.first.seconds();
            let mut peak: f64 = 0.0;
            for (phase, sign) in [(from, 1.0), (to, -1.0)] {
                let late = self.skew * f64::from(phase as u8) - lead;
                let seen = LineParameters { lag: self.lag[phase as usize], late, ..self.line(line) };
                model.one_way(&seen, forward, count, |k, current, _| {
                    currents[k][phase as usize] = sign * current;
                    peak = peak.max(current);
                });
            }
            let [amplitude, decay, frequency] = self.pick_up;
            for (n, currents) in currents.iter_mut().enumerate() {
                for (phase, current) in currents.iter_mut().enumerate() {
                    let since =
                        model.interval * (n + 1) as f64 - lead + self.skew * phase as f64 - model.pulse;
                    if since > -1e-12 {
                        let ringing = (core::f64::consts::TAU * frequency * since).cos();
                        *current += amplitude * (-since / decay).exp() * ringing;
                    }
                }
            }
            if self.place == Place::BelowLegs {
                for (n, currents) in currents.iter_mut().enumerate() {
                    // The upper switch of one leg, and then the upper diode of the other.
                    let above = if command.sampling.trigger(u32::try_from(n).expect("few"))
                        > command.stage.duration
                    {
                        to
                    } else {
                        from
                    };
                    currents[above as usize] = 0.0;
                }
            }
            self.pulses.push((model.pulse, peak));
        }
        let mut read = |k: usize, current: f64| {
            T::of(current * self.gain[k] + self.offset[k] + self.deviation * self.noise.gauss())
        };
        let reading = |(n, currents): (usize, [f64; 3])| {
            Reading::measured(
                command.sampling.trigger(u32::try_from(n).expect("few")),
                core::array::from_fn(|k| read(k, currents[k])),
                T::of(self.dc_link),
            )
        };
        currents.into_iter().enumerate().map(reading).collect()
    }

    /// Returns this motor with noise of this rms value in A, drawn for another trial.
    pub fn with_noise(mut self, deviation: f64, trial: u32) -> Self {
        (self.deviation, self.noise) = (deviation, Noise::new(u64::from(trial) + 1));
        self
    }

    /// Returns the evidence of an outcome for the motor's north pole, found or not, in standard deviations.
    pub fn evidence(&self, outcome: &Outcome<f64>) -> f64 {
        outcome.evidence_for(Angle::from_radians(self.angle)).expect("evidence")
    }

    /// Returns the angle in degrees from the motor's angle to this one.
    pub fn error<T: Real>(&self, found: Angle<T>) -> f64 {
        let found = Angle::from_radians(found.radians().to_double());
        found.difference(Angle::from_radians(self.angle)).to_degrees()
    }
}

/// Mean and standard deviation.
pub(crate) fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt())
}
