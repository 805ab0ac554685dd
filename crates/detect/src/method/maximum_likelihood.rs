//! The maximum-likelihood rotor angle, from all samples of line pulses in both directions.
//!
//! ```text
//!   zero ─► train of pulses ─► fit of L_k, c_k, t_s ─► sensors' gains ─► axis (7), pole D ─► certain enough? ─► answer
//!              ▲                                                                             │ no
//!              └──────────────────────────── longer pulses ◄──────────────────────────────────┘
//! ```
//! `Z = Σ L_k e^{j2φ_k}` gives the axis, `D = Σ c_k e^{jφ_k}` points along the magnet: the pole comes from the same
//! data. With [`Adaptive`] settings the pulses begin short and grow until angle and pole are certain enough, so that a
//! motor with a large saliency is hardly disturbed.

mod combination;
pub(crate) mod likelihood;
mod rounds;
mod settings;
#[cfg(test)]
mod tests;

use standstill_interface::{Abc, AlphaBeta, Fault, Findings, Nanos, Reading, Real, Step};

use crate::checks::Check;
use crate::method::Sequence;
use crate::nameplate::Place;
use crate::parts::lines::{Saliency, line_directions};
use crate::parts::margin::Margin;
use crate::parts::polarity::{Pointer, Pole, Signature};
use crate::parts::settle::link;
use crate::parts::train::{GainComparison, LINES, Slot, Train};
use crate::parts::{instant, significance, turning};
use crate::settings::SettingsError;
use combination::{Combined, Said};
use likelihood::{Curves, Fit, LineParameters, PulseModel, fit};
use rounds::{Rounds, Shown};
use settings::lengthened;
pub use settings::{Adaptive, MaximumLikelihoodSettings};

/// Samples of one pulse and its decay that are kept at most.
pub const MOST_SAMPLES: usize = 112;

/// Ratio of the standard deviation of D across the magnet, over the rotor's positions, to the one computed from the
/// residuals of the fits: 1.3 to 1.45 on two motors with the errors `default` and `field`.
const SCATTER: f64 = 1.4;

/// The maximum-likelihood detector. Most of its size are the samples, averaged over the rounds.
#[derive(Clone, Debug)]
pub struct MaximumLikelihood<T> {
    settings: MaximumLikelihoodSettings<T>,
    train: Train<T>,
    /// Sums of the currents in A over the rounds, scaled to the first link voltage; by line; backward, forward.
    curves: [[[T; MOST_SAMPLES]; 2]; 3],
    gains: GainComparison<T>,
    /// Link in V to which the currents are scaled, and the sum of the links over the pulses' decays.
    dc_link: T,
    combined: Combined<T>,
    /// The largest current in A of the last train.
    peak: T,
    rounds: Rounds<T>,
    findings: Findings<T>,
}

/// The pole; the standard deviation of the angle in rad; the saliency with the square of the ratio that its errors
/// require; and whether it is significant, with its margin, which later trains may still improve.
type Answer<T> = (Pole<T>, T, (Saliency<T>, T), (Margin<T>, Result<(), Fault<T>>));

impl<T: Real> MaximumLikelihood<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: MaximumLikelihoodSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = T::zero();
        let sensing = &settings.pulses.sensing;
        let mut train = Train::new(settings.pulses.train);
        train.spoilt_end = sensing.place.switches()
            || sensing.skew + sensing.averaged > Nanos::ZERO
            || sensing.blank() > zero;
        Ok(Self {
            settings,
            train,
            curves: [[[zero; MOST_SAMPLES]; 2]; 3],
            gains: GainComparison::new(),
            dc_link: zero,
            combined: Combined::new(),
            peak: zero,
            rounds: Rounds::new(),
            findings: Findings::default(),
        })
    }

    fn add(&mut self, slot: Slot, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let on = self.train.settings.samples_on();
        let whole = on - 1 - usize::from(self.train.spoilt_end && on > 1);
        self.settings.pulses.check_pulse(&mut self.train, slot, &readings[whole])?;
        let mut volts = T::zero();
        for reading in &readings[..on] {
            volts = volts + link(reading)?;
        }
        let volts = volts / T::of(on as f64);
        if self.dc_link <= T::zero() {
            self.dc_link = volts;
        }
        // The current is proportional to the link but for the drops, which are a few thousandths of it.
        let scale = self.dc_link / volts;
        let curve = &mut self.curves[slot.line][usize::from(slot.forward)];
        let train = &self.train.settings;
        let compares = self.settings.pulses.sensing.compares(train.pulse);
        let below = train.place == Place::BelowLegs;
        let (mut end, mut moment, mut square) = (T::zero(), T::zero(), T::zero());
        for (n, (sum, reading)) in curve.iter_mut().zip(readings).enumerate() {
            let (from, to) = self.train.both(slot, reading)?;
            *sum = *sum + (from + to) / T::of(2.0) * scale;
            if !below && compares(train.interval * (n as u64 + 1)) {
                self.gains.add(slot, (from, to));
            }
            self.peak = self.peak.max((from + to) / T::of(2.0));
            if n <= whole {
                let time = T::of(n as f64 + 1.0);
                end = (from + to) / T::of(2.0) * scale;
                (moment, square) = (moment + time * end, square + time * time);
            }
        }
        self.rounds.add(slot, Shown { end, slope: moment / square, volts, times: volts / self.dc_link });
        if below && let Some(both) = self.train.at_edge(slot, readings, &self.settings.pulses.sensing)? {
            self.gains.add(slot, both);
        }
        Ok(())
    }

    /// Converts the curves to those of sensors with the line's mean gain, converted at the mean of both times. With
    /// low-side shunts, the shunt below the leg that the current leaves shows the pulse, and the one below the leg that
    /// it enters shows the decay.
    fn equalize(&mut self) {
        let (ratios, noise) = self.train.gains_at_edge(&self.gains);
        let (ratios, _) = GainComparison::known(ratios, noise, self.settings.pulses.gain_tolerance);
        let (on, n) = (self.train.settings.samples_on(), self.train.settings.samples());
        let sensing = &self.settings.pulses.sensing;
        let interval = T::of(self.train.settings.interval.seconds());
        for (k, (line, ratio)) in self.curves.iter_mut().zip(ratios).enumerate() {
            let (first, second) = LINES[k];
            let early = (sensing.late_of(second) - sensing.late_of(first)) / T::of(2.0) / interval;
            // By the first phase's sensor and by the second's.
            let shown = [((-ratio / T::of(2.0)).exp(), early), ((ratio / T::of(2.0)).exp(), -early)];
            for (forward, curve) in line.iter_mut().enumerate() {
                let (pulse, decay) = curve[..n].split_at_mut(on);
                equal(pulse, shown[forward]);
                equal(decay, shown[1 - forward]);
            }
        }
    }

    /// Fits the train that has just ended.
    fn fit(&mut self) -> Result<Fit<T>, Fault<T>> {
        let s = self.train.settings;
        let n = s.samples();
        let rounds = T::of(f64::from(s.rounds));
        for curve in self.curves.iter_mut().flatten() {
            for sum in &mut curve[..n] {
                *sum = *sum / rounds;
            }
        }
        if s.place == Place::BelowLegs {
            self.equalize();
        }
        let curves: Curves<'_, T> =
            core::array::from_fn(|k| self.curves[k].each_ref().map(|curve| &curve[..n]));
        let model = PulseModel {
            on: self.dc_link - s.on_drop,
            off: self.dc_link + s.off_drop,
            resistance: s.resistance * T::of(2.0),
            pulse: T::of(s.pulse.seconds()),
            interval: T::of(s.interval.seconds()),
            blank: self.settings.pulses.sensing.blank(),
            before_end: if s.place.switches() { T::of(s.interval.seconds() / 2.0) } else { T::zero() },
        };
        let delay = T::of(s.dead_time.seconds());
        let lag = self.settings.pulses.sensing.lag();
        // The last sample that no jitter takes beyond the end of the pulse, where shunts show something else.
        let end = s.samples_on() - if s.place.switches() { 2 } else { 1 };
        let risen = if s.place.switches() { model.pulse - model.interval } else { model.pulse };
        let start = core::array::from_fn(|k| {
            let [back, forward] = curves[k];
            // The sensors show what flowed earlier, by their lag; not more than half a pulse, of which something would be left.
            let rise = risen - delay - lag.min(model.pulse / T::of(2.0));
            LineParameters {
                inductance: model.on * rise * T::of(2.0) / (back[end] + forward[end]),
                slope: T::zero(),
                delay,
                lag,
                late: self.settings.pulses.sensing.late(k, self.train.derived),
            }
        });
        let found = fit(&curves, &model, start).filter(|fit| fit.inductance.iter().all(|l| *l > T::zero()));
        // Which line is at fault is unknown; the first stands for all.
        found.ok_or(Fault::NotInductive(LINES[0].0))
    }

    /// Concludes a train: returns the answer so far, and the factor by which the next pulses should be longer; none if
    /// everything is certain enough.
    fn conclude(&mut self) -> Result<(Pole<T>, Option<T>), Fault<T>> {
        let fit = self.fit()?;
        let s = self.settings.pulses;
        let rounds = T::of(f64::from(self.train.settings.rounds));
        let (one, two) = (T::one(), T::of(2.0));
        // The fitted current is the mean of two sensors over the rounds; the comparison is of single readings.
        let (ratios, ratio_noise) = if self.train.settings.place == Place::BelowLegs {
            self.train.gains_at_edge(&self.gains)
        } else {
            self.gains.measured(fit.variance * rounds * two)
        };

        let plain = Saliency::from_lines(Abc(fit.inductance), s.saliency);
        let shift = fit.lag_slope.map(|slope| slope * self.settings.pulses.sensing.lag_deviation());
        let mut covariance = fit.inductance_covariance;
        for (k, shift) in shift.into_iter().enumerate() {
            covariance[k][k] = covariance[k][k] + shift * shift;
        }
        let variance = plain.axis_variance(&covariance, s.saliency);
        // What a slope makes of the inductance at the peak of the pulse.
        let pulse = T::of(self.train.settings.pulse.seconds());
        let relative = self.dc_link * pulse / (plain.mean * plain.mean * T::of(9.0));
        let both = fit.inductance.map(|inductance| [inductance; 2]);
        let train = self.train.settings;
        s.plausibility.inductances(&mut self.train.margin, both, train.pulse, train.resistance)?;
        let mut pointer = AlphaBeta::new(T::zero(), T::zero());
        let mut pointer_variance = T::zero();
        for (k, direction) in line_directions().into_iter().enumerate() {
            pointer = pointer + direction * fit.slope[k];
            pointer_variance = pointer_variance + fit.slope_variance[k];
        }
        // In each component of the sum over three directions, as far as they are alike.
        let pointer_variance = pointer_variance / two;
        let (_, unknown) = GainComparison::known(ratios, ratio_noise, s.gain_tolerance);
        let floor = s.pole_variance(self.train.derived, unknown);
        // Nor can what the model does not explain be separated from saturation; relative to the current at the peak.
        let peak = self.dc_link * pulse / (plain.mean * T::of(3.0));
        let floor = (T::of(1.5) * (floor + fit.misfit / (peak * peak))).sqrt() / relative;

        // What is no axis may point anywhere: each line is read by two sensors.
        let gains = significance::of_lines(s.gain_tolerance * s.gain_tolerance / two);
        let spread = plain.most_variance(&covariance) + gains;
        let (train, margin) = (self.train.settings, &mut self.train.margin);
        if s.plausibility.checks.has(Check::Turning) {
            let moved = self.combined.check_movement(margin, plain.axis, variance, s.saliency);
            moved.or_else(|fault| {
                s.check_saliency(margin, &plain, significance::known(spread), &train).and(Err(fault))
            })?;
        }
        self.combined.add(&Said {
            lines: fit.inductance,
            variance,
            covariance: fit.inductance_covariance,
            shift,
            ratios,
            ratio_noise,
            direction: pointer,
            noise: pointer_variance,
            floor,
            instants: self.train.instants(),
        });

        let (pole, deviation, (saliency, errors), is_salient) = self.answer()?;
        let growth =
            self.settings.adaptive.filter(|adaptive| self.combined.trains < adaptive.most_trains).and_then(
                |adaptive| {
                    // The angle's deviation falls with the length to the power of 3/2, the pole's share of it at least with the
                    // length itself: the current on the one hand, the samples on the other.
                    let angle = (deviation / adaptive.deviation).powf(T::of(2.0 / 3.0));
                    let sure = pole.undetermined.is_none() || s.signature == Signature::None;
                    let certainty =
                        pole.error.map_or(one, |error| (two * error.max(T::min_positive_value())).ln());
                    let pole = if sure { one } else { (two * s.pole_error).ln() / certainty };
                    (!sure || angle > one).then(|| angle.max(pole.abs().sqrt()))
                },
            );
        if growth.is_none() {
            let (margin, is_salient) = is_salient;
            self.train.margin.and(margin);
            is_salient?;
            let pointer = self.combined.pointer();
            let pointer = Pointer {
                direction: pointer.direction * relative,
                deviation: pointer.deviation * relative * T::of(SCATTER),
            };
            // A slope goes with the square of its line's inductance, and lines across the magnet have more than the mean, or less.
            let square = T::of(9.0) * plain.mean * plain.mean;
            let more = line_directions().into_iter().zip(fit.inductance).fold(
                T::zero(),
                |sum, (line, inductance)| {
                    let across = line.park(pole.angle).q;
                    sum + across * across * inductance * inductance / square
                },
            );
            let volts = (turning::BY_SLOPE, self.dc_link / (more * T::of(2.0 / 3.0)));
            self.check_rounds((peak, plain.ratio()), volts, &pointer, (pole.angle, deviation))?;
            let train = self.train.settings;
            s.check_sheet(&mut self.train.margin, &saliency, errors, &train)?;
        }
        Ok((pole, growth))
    }

    /// Computes the answer from all trains so far.
    fn answer(&mut self) -> Result<Answer<T>, Fault<T>> {
        let s = &self.settings.pulses;
        let c = &self.combined;
        let derived = self.train.derived;
        let (ratios, variances) = c.ratios(s.gain_tolerance);
        let (lines, saliency) = s.saliency(c.lines, ratios, derived, &mut self.findings);
        let mut covariance = c.covariance();
        for (k, of_ratio) in variances.into_iter().enumerate() {
            let gain = GainComparison::line_gain_slopes(k, derived);
            let change: [T; 3] = core::array::from_fn(|l| lines[l] * gain[l]);
            for (row, a) in covariance.iter_mut().zip(change) {
                for (entry, b) in row.iter_mut().zip(change) {
                    *entry = *entry + a * b * of_ratio;
                }
            }
        }
        let deviation = saliency.axis_variance(&covariance, s.saliency).max(T::zero()).sqrt();
        self.findings.angle_deviation = Some(deviation);
        let instant = instant::of_lines(saliency.axis, c.instants);
        self.findings.age = Some(instant::age(self.train.clock, instant));
        let ratio = saliency.ratio();
        significance::check(&mut self.train.margin, ratio, T::zero(), s.least_saliency)?;
        let spread = saliency.most_variance(&covariance);
        let (mut margin, square) = (Margin::new(), significance::known(spread));
        let is_salient = s.check_saliency(&mut margin, &saliency, square, &self.train.settings);
        Ok((s.pole(&saliency, &c.pointer()), deviation, (saliency, square), (margin, is_salient)))
    }

    /// Pulses so many times longer, for the next train; at least by a quarter and at most three times.
    fn lengthen(&mut self, times: T) {
        let Some(adaptive) = self.settings.adaptive else { return };
        let train = self.train.settings;
        // A not-a-number becomes the least.
        let percent = (times * T::of(110.0)).max(T::of(125.0)).min(T::of(300.0));
        let percent = percent.min(T::of(100.0) * adaptive.most_current / self.peak).max(T::of(100.0));
        self.peak = T::zero();
        let grown = Nanos(train.pulse.0 / 100 * percent.to_u64().unwrap_or(100));
        let longer = lengthened(train, grown.min(adaptive.longest), train.rounds);
        // Pulses of a few nanoseconds, or with a rest of their own, are rounded to others.
        let works = longer.pulse >= train.pulse && longer.check().is_ok();
        self.train.restart(if works { longer } else { train });
        self.curves = [[[T::zero(); MOST_SAMPLES]; 2]; 3];
        self.gains = GainComparison::new();
        self.rounds = Rounds::new();
    }
}

/// Samples with another gain, and later by a share of the interval between them: along the straight line from the sample before, which no
/// edge spoils and in which the current has not yet ended.
fn equal<T: Real>(samples: &mut [T], (gain, later): (T, T)) {
    let [first, second, ..] = *samples else { return };
    let mut before = first - (second - first);
    for sample in samples {
        let here = *sample;
        *sample = (here + (here - before) * later) * gain;
        before = here;
    }
}

impl<T: Real> Sequence<T> for MaximumLikelihood<T> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        if let Some(slot) = self.train.take(readings)? {
            self.add(slot, readings)?;
            if self.train.ends_round() {
                self.rounds.end(self.settings.pulses.saliency);
            }
        }
        if let Some(command) = self.train.next() {
            return Ok(Step::Drive(command));
        }
        let (pole, growth) = self.conclude()?;
        let Some(times) = growth else {
            return Ok(Step::Done(pole.outcome(self.findings)));
        };
        self.lengthen(times);
        // A train has at least one pulse.
        self.train.next().map(Step::Drive).ok_or(Fault::UnexpectedReadings)
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        (&self.findings, self.train.margin)
    }
}
