//! Line pulses in both directions that calibrate the current sensors on the way.
//!
//! `L = mean over ± of U t1 / i2` per line cancels the saturation's effect to first order; the gain mismatch of the
//! sensors is measured (see [`crate::train`]) and divided out; then equations (5)–(7). The difference of the forward and
//! the backward inductance of each line points along the magnet: the pole comes from the same pulses.

#[cfg(test)]
mod tests;

use standstill_interface::{Abc, AlphaBeta, Detector, Fault, Findings, Nanos, Outcome, Reading, Real, Step};

use crate::commissioning::Correction;
use crate::lines::{SaliencySign, line_directions};
use crate::nameplate::Nameplate;
use crate::polarity::{Pointer, Pole, Signature};
use crate::settings::{Settings, SettingsError, require, require_error, require_share};
use crate::settle::link;
use crate::train::{GainComparison, PulseTrainSettings, Slot, Train, pole_variance};

/// Settings of the bipolar method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BipolarSettings<T> {
    /// Its pulses.
    pub train: PulseTrainSettings<T>,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// Standard deviation of the sensors' gains, relative; zero: taken as equal.
    pub gain_tolerance: T,
    /// What a commissioning run learnt of motor and sensors.
    pub correction: Correction<T>,
    /// Which pole draws more current in pulses like these.
    pub signature: Signature,
    /// Probability of a wrong pole that is allowed.
    pub pole_error: T,
    /// Standard deviation of the relative difference between forward and backward pulses that repetition does not
    /// reveal: offsets, delays of the legs.
    pub pole_floor: T,
}

impl<T: Real> BipolarSettings<T> {
    /// For this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        // Four samples in the pulse: enough to compare the sensors.
        let pulse = drive.line_pulse(T::of(0.5));
        Self {
            train: PulseTrainSettings::suited(drive, Nanos(pulse.0 / 4)),
            saliency: drive.saliency(),
            least_saliency: T::of(0.005),
            gain_tolerance: drive.gain_tolerance,
            correction: Correction::none(),
            signature: drive.pulse_signature,
            pole_error: T::of(1e-6),
            pole_floor: T::of(0.0015),
        }
    }

    fn check(&self) -> Result<(), SettingsError> {
        self.train.check()?;
        require(self.train.rounds >= 2, "rounds", "at least 2, to see how the pulses scatter")?;
        require_share(self.least_saliency, "least_saliency")?;
        let tolerance = self.gain_tolerance;
        require(tolerance >= T::zero() && tolerance < T::one(), "gain_tolerance", "from 0 to below 1")?;
        require_error(self.pole_error, "pole_error")?;
        require_share(self.pole_floor, "pole_floor")
    }
}

/// The pulses of one line in one direction.
#[derive(Clone, Copy, Debug)]
struct Sums<T> {
    pulses: T,
    /// Mean inductance in H, and the sum of the squares of what is away from it in H².
    mean: T,
    squares: T,
}

impl<T: Real> Sums<T> {
    /// In this way the squares keep their digits in single precision.
    fn add(&mut self, inductance: T) {
        self.pulses = self.pulses + T::one();
        let apart = inductance - self.mean;
        self.mean = self.mean + apart / self.pulses;
        self.squares = self.squares + apart * (inductance - self.mean);
    }
}

/// The bipolar detector.
#[derive(Clone, Debug)]
pub struct Bipolar<T> {
    settings: BipolarSettings<T>,
    train: Train<T>,
    /// By line; backward, forward.
    sums: [[Sums<T>; 2]; 3],
    gains: GainComparison<T>,
    findings: Findings<T>,
}

impl<T: Real> Bipolar<T> {
    /// A detector, ready for its first step.
    ///
    /// # Errors
    /// A setting with which the method cannot work.
    pub fn new(settings: BipolarSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let none = Sums { pulses: T::zero(), mean: T::zero(), squares: T::zero() };
        Ok(Self {
            settings,
            train: Train::new(settings.train),
            sums: [[none; 2]; 3],
            gains: GainComparison::new(),
            findings: Findings::default(),
        })
    }

    fn add(&mut self, slot: Slot, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let s = &self.settings.train;
        for reading in readings {
            let both = self.train.both(slot, reading)?;
            self.gains.add(slot, both);
        }
        let end = &readings[s.samples_on() - 1];
        let current = self.train.current(slot, end)?;
        let seconds = T::of((s.pulse - s.dead_time).seconds());
        let inductance = (link(end)? - s.on_drop) * seconds / current;
        // As with a link below the drops of the switches.
        if inductance <= T::zero() || !inductance.is_finite() {
            return Err(Fault::NotInductive(slot.phases().0));
        }
        self.sums[slot.line][usize::from(slot.forward)].add(inductance);
        Ok(())
    }

    fn answer(&mut self) -> Result<Pole<T>, Fault<T>> {
        let s = &self.settings;
        let n = T::of(f64::from(s.train.rounds));
        // With equal gains assumed to within a percent the noise of the comparison does not matter.
        let (ratios, noise) = self.gains.measured(T::zero());
        let (ratios, _) = GainComparison::known(ratios, noise, s.gain_tolerance);
        let gains = GainComparison::line_gains(ratios, self.train.derived);
        let half = T::of(0.5);
        let mut lines = [T::zero(); 3];
        let mut pointer = AlphaBeta::new(T::zero(), T::zero());
        let mut scatter = T::zero();
        for (k, (line, direction)) in self.sums.iter().zip(line_directions()).enumerate() {
            let [back, forward] = line.map(|sums| sums.mean);
            let mean = (forward + back) * half;
            lines[k] = mean * gains[k].exp();
            // Less inductance forward than backward: forward leads towards the pole that draws more.
            let difference = (back - forward) / mean;
            pointer = pointer + direction * difference;
            for sums in line {
                scatter = scatter + sums.squares / (mean * mean);
            }
        }
        // Pulses both ways leave nothing of saturation that depends on the pole.
        let saliency = s.correction.apply(Abc(lines), s.saliency, None);
        self.findings.line_inductance = Some(Abc(lines));
        self.findings.mean_inductance = Some(saliency.mean);
        self.findings.saliency = Some(saliency.amplitude);
        self.findings.sensor_gain = Some(GainComparison::gains(ratios));
        let (ratio, needed) = (saliency.ratio(), s.least_saliency);
        if ratio < needed || !ratio.is_finite() {
            return Err(Fault::NoSaliency { ratio, needed });
        }
        // Variance of a mean over n pulses' relative inductances, pooled.
        let freedom = (n - T::one()).max(T::one()) * T::of(6.0);
        let one = scatter / freedom / n;
        // Of the mean of a line's two directions; equation (7) on relative errors: 0.408 ε / (|L_B|/L_A).
        self.findings.angle_deviation = Some((one * half).sqrt() * T::of(1.0 / 6.0).sqrt() / ratio);
        // Of a difference of two means, in each component of the sum over three directions.
        let floor = pole_variance(s.pole_floor, s.gain_tolerance, self.train.derived);
        let deviation = (T::of(1.5) * (T::of(2.0) * one + floor)).sqrt();
        let pointer = Pointer { direction: pointer, deviation };
        Ok(pointer.read(saliency.axis, s.signature, s.pole_error))
    }

    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        if let Some(slot) = self.train.take(readings)? {
            self.add(slot, readings)?;
        }
        Ok(match self.train.next() {
            Some(command) => Step::Drive(command),
            None => Step::Done(self.answer()?.outcome(self.findings)),
        })
    }
}

impl<T: Real> Detector<T> for Bipolar<T> {
    fn step(&mut self, readings: &[Reading<T>]) -> Step<T> {
        let step = self.next(readings);
        step.unwrap_or_else(|fault| Step::Done(Outcome::Failed { fault, findings: self.findings }))
    }
}

impl<T: Real> Settings<T> for BipolarSettings<T> {
    type Detector = Bipolar<T>;

    fn detector(&self) -> Result<Self::Detector, SettingsError> {
        Bipolar::new(*self)
    }

    fn carrier_period(&self) -> Option<Nanos> {
        None
    }
}
