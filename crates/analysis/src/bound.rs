//! The Cramér–Rao bound: the smallest error of the angle that an unbiased method can have with the readings of an excitation.
//!
//! ```text
//!   J = Σ over samples  Gᵀ C⁻¹ G,   G = ∂(readings)/∂p,   σ_θ² = [J⁻¹]_θθ
//! ```
//! The unknowns are p = (θ, L_A, L_B, R, V_D), with the angle θ at the start. The readings are those of the drive: currents of phases or of
//! the DC link, voltages of terminals, and times that a timer captured at a comparator's trip. Their noise is Gaussian with covariance C
//! (Kay, *Fundamentals of Statistical Signal Processing: Estimation Theory*, 1993, section 3.9).
//!
//! The commands are those that the detector gives on the nominal plant. The same commands are then replayed on plants with one parameter
//! changed, up and down, which gives G as difference quotients. The hybrid bound has the errors of a specimen (its gains, offsets and
//! delays) as further unknowns with Gaussian priors, whose information is added to J (Van Trees, *Detection, Estimation, and Modulation
//! Theory*, part I, 1968, section 2.4).
//!
//! C contains the noise variance σ² of each channel, its converter's quantization variance q²/12, and the effect of sampling jitter,
//! uniform in ±j, on values with slopes s: `diag(σ² + q²/12) + j²/3 s sᵀ`, because all channels are sampled at one instant. The variance of
//! a captured time is q²/12 for the timer's tick q plus (σ ∂t/∂X)² for the comparator's noise σ at the threshold X. Where the slope changes
//! its sign within the jitter, s is too small, and so is the bound, which remains valid. The ripple of the DC link, and all errors of the
//! DC-link sensor except its gain, are taken as known. If captured times are the only readings, resistance and diodes are taken as known,
//! too: without saturation, opposite directions give equal times, so six times are only three numbers and cannot determine four unknowns.

mod batch;
mod information;
mod plant;
pub(crate) mod replay;

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use standstill_campaign::in_parallel;
use standstill_detect::{Settings, SettingsError};
use standstill_interface::{Command, Nanos};
use standstill_inverter::{DcLink, GateTiming, Inverter};
use standstill_sim::{
    Arrangement, Case, ComparatorSettings, RunError, SensorSettings, Sensors, Streams, TerminalSensor,
    VoltageSensor,
};

use batch::Batches;
use information::{Information, Noise, Prior, Sensitivity};
use plant::Parameter;
use replay::{LINK, TERMINAL, TIME, record};
use standstill_scenario::{Scenario, Specimen};
use thiserror::Error;

pub use plant::Unknown;

/// The commands of a detection that count for the bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counted {
    /// All commands of the detector, including the commands of its polarity test.
    #[default]
    All,
    /// The commands before the first command with PWM. For methods with line pulses, these are the pulses before the polarity test.
    BeforePwm,
}

/// Computes the Cramér–Rao bounds of a scenario.
///
/// ```
/// use standstill_analysis::Bounds;
/// use standstill_detect::Decay;
/// use standstill_plant::built_in;
/// use standstill_scenario::{ErrorSet, Scenario};
/// use standstill_sim::RotorState;
///
/// let motor = built_in("paper-5k5").ok_or("not built in")?;
/// let scenario = Scenario::paper(motor, ErrorSet::Default, Decay::Fast, RotorState::Locked, 1);
/// let bound = Bounds::new(&scenario).at(0.5)?.ok_or("a method that turns the rotor")?;
/// // From more samples more could be known.
/// assert!(bound.all_deg.is_some_and(|all| all < bound.scheme_deg));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Bounds<'a, S> {
    /// Motor, drive, sensors and method. In the nominal plant the DC link has no ripple, and all random values are at their means.
    pub scenario: &'a Scenario<S>,
    /// Unknown parameters of the motor besides the angle.
    pub unknown: &'a [Unknown],
    /// Commands that count for the bound.
    pub counted: Counted,
    /// Interval between the further samples for [`Bound::all_deg`]; none if that bound is not computed. A sample takes about 1 kB of memory.
    pub interval: Option<Nanos>,
    /// Number of the trial whose noise is added while the commands are recorded; none: no noise. A method that repeats until its readings
    /// are certain enough needs noise here, because without noise it would stop earlier than in its trials.
    pub noise: Option<u64>,
    /// Factor by which the default steps of the difference quotients are multiplied.
    pub step: f64,
    /// Number of threads; none: as many as there are cores.
    pub threads: Option<usize>,
}

/// Cramér–Rao bounds on the standard deviation of the angle, in electrical degrees. A bound is zero if the sensors have no noise,
/// quantization or jitter. It is infinite if the readings do not determine the angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    /// Bound from the samples that the commands request.
    pub scheme_deg: f64,
    /// Bound from these samples and those at every [`Bounds::interval`] during the same commands. None without an interval.
    pub all_deg: Option<f64>,
    /// Like `scheme_deg`, but gains, offsets and delays of drive and sensors are known only within tolerances. None for sensors without
    /// noise, whose infinite information cannot be added to that of the tolerances.
    pub hybrid_deg: Option<f64>,
    /// Like `all_deg`, but gains, offsets and delays are known only within tolerances.
    pub hybrid_all_deg: Option<f64>,
}

/// Reason why a bound could not be computed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum BoundError {
    /// The detector cannot work with its settings.
    #[error(transparent)]
    Settings(SettingsError),
    /// The nominal plant, or a plant with a changed parameter, could not be simulated.
    #[error(transparent)]
    Run(RunError),
    /// The operating system could not start threads.
    #[error("no worker threads")]
    Threads,
}

impl Bound {
    /// Returns the root of the mean variance, which is a lower bound of the rms error over the angles of `bounds`. NaN for an empty slice.
    ///
    /// ```
    /// use standstill_analysis::Bound;
    ///
    /// let bound = |deg| Bound { scheme_deg: deg, all_deg: None, hybrid_deg: None, hybrid_all_deg: None };
    /// assert_eq!(Bound::rms(&[bound(1.0), bound(7.0)]).scheme_deg, 5.0);
    /// ```
    pub fn rms(bounds: &[Self]) -> Self {
        let n = bounds.len() as f64;
        let known = |of: fn(&Self) -> Option<f64>| {
            let squares: Option<f64> = bounds.iter().map(|bound| of(bound).map(|deg| deg * deg)).sum();
            squares.map(|squares| (squares / n).sqrt())
        };
        Self {
            scheme_deg: known(|bound| Some(bound.scheme_deg)).unwrap_or(f64::NAN),
            all_deg: known(|bound| bound.all_deg),
            hybrid_deg: known(|bound| bound.hybrid_deg),
            hybrid_all_deg: known(|bound| bound.hybrid_all_deg),
        }
    }
}

impl<S> Clone for Bounds<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

// A copy only borrows the scenario, so its settings `S` need not be `Copy`.
impl<S> Copy for Bounds<'_, S> {}

impl<'a, S: Settings<f64>> Bounds<'a, S> {
    /// Sets up the bounds: all parameters of the motor are unknown, all commands count, and samples are 10 µs apart.
    pub fn new(scenario: &'a Scenario<S>) -> Self {
        Self {
            scenario,
            unknown: &Unknown::ALL,
            counted: Counted::All,
            interval: Some(Nanos::from_micros(10)),
            noise: None,
            step: 1.0,
            threads: None,
        }
    }

    /// Returns the bounds at an electrical angle in rad. None for a method that turns the rotor, as it estimates no initial angle.
    ///
    /// # Errors
    /// The detector cannot work with its settings, or a plant cannot be simulated.
    pub fn at(&self, angle: f64) -> Result<Option<Bound>, BoundError> {
        if self.scenario.detector.turns_rotor() {
            return Ok(None);
        }
        let case = self.nominal(angle);
        let commands = self.commands(&case)?;
        let (scheme, hybrid) = self.deviations(&case, &commands, None)?;
        let every = |interval| self.deviations(&case, &commands, Some(interval));
        let all = self.interval.map(every).transpose()?;
        Ok(Some(Bound {
            scheme_deg: scheme.to_degrees(),
            all_deg: all.map(|(all, _)| all.to_degrees()),
            hybrid_deg: hybrid.map(f64::to_degrees),
            hybrid_all_deg: all.and_then(|(_, hybrid)| hybrid).map(f64::to_degrees),
        }))
    }

    /// Returns the nominal plant at this angle in rad. The sensors have the scenario's arrangement, filters and delays, but no errors.
    fn nominal(&self, angle: f64) -> Case<'a> {
        let Scenario { drive, sensors, tolerance, seed, .. } = self.scenario;
        let drawn = self.scenario.case_at(angle, Specimen { drive: 0, noise: 0 });
        let delay = Nanos::from_seconds(3.0 * drive.delay_mismatch);
        let gate = GateTiming { turn_off_delay: delay, turn_on_delay: delay, dead_time: drive.dead_time };
        let exact = SensorSettings {
            arrangement: sensors.arrangement,
            bandwidth: sensors.bandwidth,
            slew: sensors.slew,
            acquisition: sensors.acquisition,
            sample_delay: sensors.sample_delay,
            skew: sensors.skew,
            oversampling: sensors.oversampling,
            conversion: sensors.conversion,
            settle: sensors.settle,
            terminal: sensors.terminal.map(|of| TerminalSensor {
                bandwidth: of.bandwidth,
                resistance: of.resistance,
                ..TerminalSensor::IDEAL
            }),
            comparator: ComparatorSettings {
                arrangement: sensors.comparator.arrangement,
                timer: sensors.comparator.timer,
                delay: sensors.comparator.delay,
                blanking: sensors.comparator.blanking,
                bits: sensors.comparator.bits,
                range: sensors.comparator.range,
                ..SensorSettings::IDEAL.comparator
            },
            dc_link: VoltageSensor { bandwidth: sensors.dc_link.bandwidth, ..SensorSettings::IDEAL.dc_link },
            ..SensorSettings::IDEAL
        };
        Case {
            inverter: Inverter {
                bridge: drive.bridge,
                gates: [gate; 3],
                link: DcLink { ripple: 0.0, ..drive.link },
                carrier_period: drive.carrier_period,
            },
            sensors: Sensors::nominal(exact),
            streams: Streams::new(*seed, self.noise.unwrap_or(0)),
            // Differences magnify the integrator's error by a thousand.
            tolerance: standstill_sim::Tolerance { flux: tolerance.flux * 0.01 },
            ..drawn
        }
    }

    /// Records the commands that the detector gives on a plant, and returns the commands that count for the bound.
    fn commands(&self, case: &Case) -> Result<Vec<Command<f64>>, BoundError> {
        let mut case = case.clone();
        if self.noise.is_some() {
            case.sensors.settings.noise = self.scenario.sensors.noise;
            case.sensors.settings.adc = self.scenario.sensors.adc;
        }
        let detector = self.scenario.detector_for(&case).map_err(BoundError::Settings)?;
        let mut commands = record(&case, detector).map_err(BoundError::Run)?;
        if self.counted == Counted::BeforePwm
            && let Some(first) = commands.iter().position(replay::has_pwm)
        {
            commands.truncate(first);
        }
        Ok(commands)
    }

    /// Returns two standard deviations of the angle in rad: with unknown parameters of the motor alone, and with unknown errors of the
    /// specimen, too. Readings without noise have no second one. The samples are those that the commands request, and those at every
    /// multiple of an interval, if one is given.
    fn deviations(
        &self,
        case: &Case,
        commands: &[Command<f64>],
        interval: Option<Nanos>,
    ) -> Result<(f64, Option<f64>), BoundError> {
        let case = &replay::finely_timed(case, commands);
        let samples = Batches::new(commands, interval);
        let differ =
            |parameter: Parameter| samples.column(parameter, case, self.step).map_err(BoundError::Run);
        let is_timed = commands.iter().any(|command| command.threshold.is_some());
        let offsets = if is_timed { self.offsets(&differ)? } else { Vec::new() };
        let noise = self.noise_of(case, &samples, &offsets)?;

        let mut columns = vec![differ(Parameter::Angle)?];
        let times_alone = !(0..TIME).any(|channel| noise.has(channel));
        for unknown in self.unknown.iter().filter(|unknown| !times_alone || unknown.is_inductance()) {
            columns.push(differ(Parameter::Motor(*unknown))?);
        }
        let [any_exact, all_exact] = noise.exact();
        if any_exact {
            // Without noise the limit is zero if the readings determine the angle at all.
            let deviation = Information::new(&noise.of_exact(), &columns).deviation(&[]);
            if deviation.is_finite() || all_exact {
                return Ok((if deviation.is_finite() { 0.0 } else { deviation }, None));
            }
        }
        let deviation = Information::new(&noise, &columns).deviation(&[]);
        let mut priors = Vec::new();
        for (column, deviation) in self.of_specimen(&noise, &differ, offsets)? {
            if deviation > 0.0 {
                priors.push(Prior { place: columns.len(), deviation });
                columns.push(column);
            }
        }
        let hybrid = Information::new(&noise, &columns).deviation(&priors);
        Ok((deviation, Some(hybrid)))
    }

    /// Returns the sensitivity of the readings to the offset of each comparator.
    fn offsets(
        &self,
        differ: &dyn Fn(Parameter) -> Result<Sensitivity, BoundError>,
    ) -> Result<Vec<Sensitivity>, BoundError> {
        (0..self.scenario.sensors.comparator.count())
            .map(|number| differ(Parameter::Comparator(number)))
            .collect()
    }

    /// Returns each unknown error of a specimen as two values: the sensitivity of the readings to the error, and its standard deviation.
    /// `offsets` are the sensitivities to the comparators' offsets.
    fn of_specimen(
        &self,
        noise: &Noise,
        differ: &dyn Fn(Parameter) -> Result<Sensitivity, BoundError>,
        offsets: Vec<Sensitivity>,
    ) -> Result<Vec<(Sensitivity, f64)>, BoundError> {
        let Scenario { drive, sensors, .. } = self.scenario;
        let currents = match sensors.arrangement {
            Arrangement::None => 0..0,
            Arrangement::DcLinkShunt => LINK..LINK + 1,
            Arrangement::ThreeInLine | Arrangement::TwoInLine | Arrangement::LowSideShunts => 0..LINK,
        };
        let currents = currents.map(|channel| (channel, sensors.gain_error, sensors.offset));
        let terminals =
            sensors.terminal.iter().flat_map(|of| (TERMINAL..TIME).map(|k| (k, of.gain_error, of.offset)));
        let mut all = Vec::new();
        for (channel, gain, offset) in currents.chain(terminals) {
            all.push((noise.gain(channel), gain));
            all.push((noise.offset(channel), offset));
        }
        if drive.delay_mismatch > 0.0 {
            for phase in 0..3 {
                all.push((differ(Parameter::TurnOn(phase))?, drive.delay_mismatch));
                all.push((differ(Parameter::TurnOff(phase))?, drive.delay_mismatch));
            }
        }
        if sensors.dc_link.gain_error > 0.0 {
            all.push((differ(Parameter::Link)?, sensors.dc_link.gain_error));
        }
        if noise.has(TIME) {
            all.push((noise.gain(TIME), sensors.comparator.timer_error));
            for offset in offsets {
                // A comparator's delay shifts the times of its own trips alone: those that its offset changes.
                let mut delay = noise.offset(TIME);
                for (delay, dwell) in delay.slope.iter_mut().zip(&offset.slope) {
                    delay[TIME] *= f64::from(u8::from(dwell[TIME].abs() > offset.error[TIME]));
                }
                all.push((delay, sensors.comparator.delay_spread));
                all.push((offset, sensors.comparator.offset));
            }
        }
        Ok(all)
    }

    /// Returns the nominal readings and the parameters of their noise. `offsets` are the sensitivities to the comparators' offsets.
    fn noise_of(&self, case: &Case, samples: &Batches, offsets: &[Sensitivity]) -> Result<Noise, BoundError> {
        let sensors = &self.scenario.sensors;
        let (readings, slope) = samples.readings(case, sensors.jitter).map_err(BoundError::Run)?;
        // Each captured time belongs to one comparator, so the sum over all comparators is the effect of a higher threshold.
        let dwell = |sample: usize| offsets.iter().map(|offset| offset.slope[sample][TIME]).sum();
        let dwell = (0..readings.value.len()).map(dwell).collect::<Vec<f64>>();
        Ok(Noise::new(sensors, readings, slope, &dwell))
    }
}

impl<S: Settings<f64> + Sync> Bounds<'_, S> {
    /// Returns the bounds at this number of angles, evenly spaced from zero. None for a method that turns the rotor. Line inductances
    /// repeat every 60°, so a number of angles that shares no factor with six covers more distinct angles.
    ///
    /// # Errors
    /// The detector cannot work with its settings, a plant cannot be simulated, or no threads can be started.
    pub fn over(&self, angles: usize) -> Result<Option<Vec<Bound>>, BoundError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads.unwrap_or(0)).build();
        let pool = pool.map_err(|_| BoundError::Threads)?;
        let at = |number: usize| self.at(TAU * number as f64 / angles as f64);
        let bounds = pool.install(|| in_parallel((0..angles).collect(), &at))?;
        Ok(bounds.into_iter().collect())
    }
}

#[cfg(test)]
mod tests;
