//! Fisher information and standard deviation of the angle, from sensitivities and noise.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use standstill_numeric::{ROWS, dots};
use standstill_sim::{Adc, SensorSettings};

use super::replay::{CHANNELS, LINK, Readings, Sample, TERMINAL, TIME};

/// Threshold below which a number counts as zero: an eigenvalue of the information matrix (scaled to a unit diagonal), or the share of the
/// angle's information that the other parameters leave. It is the square of the relative error of the difference quotients.
const RANK: f64 = 1e-9;

/// Largest threshold that may replace [`RANK`] if difference quotients are less exact.
const MOST_RANK: f64 = 1e-3;

/// Sensitivities of the readings to one parameter.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// Derivatives ∂/∂p of the values of each sample by the parameter p, in the unit of the value per unit of p.
    pub slope: Vec<Sample>,
    /// Numerical error of a sample's derivative, one for each channel.
    pub error: Sample,
}

impl Sensitivity {
    /// Returns true if the effect of the parameter on the readings exceeds the numerical error.
    fn responds(&self) -> bool {
        let count = self.slope.len() as f64;
        let square = |k: usize| self.slope.iter().map(|slope| slope[k] * slope[k]).sum::<f64>();
        (0..CHANNELS).any(|k| square(k) > self.error[k] * self.error[k] * count)
    }

    /// Returns the square of the relative error of the captured times' derivatives. Zero if the captured times do not depend on the
    /// parameter.
    fn error_of_times(&self) -> f64 {
        let times = self.slope.iter().map(|slope| slope[TIME] * slope[TIME]).filter(|square| *square > 0.0);
        let (count, squares) = times.fold((0.0, 0.0), |(count, sum), square| (count + 1.0, sum + square));
        if squares > 0.0 { self.error[TIME] * self.error[TIME] * count / squares } else { 0.0 }
    }
}

/// Gaussian prior of a parameter.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Index of the parameter among the columns.
    pub place: usize,
    /// Standard deviation of the prior, in the parameter's unit.
    pub deviation: f64,
}

/// The nominal readings and the parameters of their noise.
#[derive(Clone, Debug)]
pub struct Noise {
    readings: Readings,
    /// Variance of a reading in each channel, from noise and quantization. The variances of captured times are in `of_time` instead.
    variance: Sample,
    /// Variance in s² of each sample's captured time.
    of_time: Vec<f64>,
    /// Variance of the sampling instant in s².
    jitter: f64,
    /// Time derivatives of the values at each sample, in the unit of the value per s. Empty without jitter.
    slope: Vec<Sample>,
}

/// Returns the variance of a reading that is the mean of this number of conversions. `noise` is the standard deviation of one conversion's
/// noise. The quantization of the converter `adc` adds to the variance.
fn variance_of(noise: f64, adc: Option<Adc>, conversions: f64) -> f64 {
    let mut variance = noise * noise / conversions;
    if let Some(adc) = adc.filter(|adc| adc.rounds()) {
        // Equal codes have equal rounding errors: only noise of at least half a code makes the errors in a mean independent.
        let independent = if noise >= 0.5 * adc.step() { conversions } else { 1.0 };
        variance += adc.step() * adc.step() / 12.0 / independent;
    }
    variance
}

impl Noise {
    /// Makes the noise model of these sensors. `dwell` is the sensitivity of each captured time to the threshold in s/A. A value outside
    /// the range of its converter does not count as a reading.
    pub fn new(sensors: &SensorSettings, mut readings: Readings, slope: Vec<Sample>, dwell: &[f64]) -> Self {
        let current = variance_of(sensors.noise, sensors.adc, f64::from(sensors.oversampling.max(1)));
        let terminal = sensors.terminal.map_or(0.0, |of| variance_of(of.noise, of.adc, 1.0));
        let mut variance = [current; CHANNELS];
        variance[TERMINAL..TIME].fill(terminal);
        let converters =
            [(0..LINK + 1, sensors.adc), (TERMINAL..TIME, sensors.terminal.and_then(|of| of.adc))];
        for (channels, adc) in converters {
            let Some(adc) = adc else { continue };
            for (measured, value) in readings.measured.iter_mut().zip(&readings.value) {
                for k in channels.clone() {
                    measured[k] &= (adc.low..adc.high).contains(&value[k]);
                }
            }
        }
        let comparator = &sensors.comparator;
        // Noise with a bandwidth trips at its first crossing, which scatters less than its deviation by an unknown factor.
        let noise = if comparator.noise_bandwidth > 0.0 { 0.0 } else { comparator.noise };
        let tick = comparator.timer * comparator.timer / 12.0;
        let of_time = |sample: usize| {
            let late = noise * dwell.get(sample).copied().unwrap_or(0.0);
            tick + late * late
        };
        let of_time = (0..readings.value.len()).map(of_time).collect();
        let jitter = sensors.jitter.seconds();
        Self { readings, variance, of_time, jitter: jitter * jitter / 3.0, slope }
    }

    fn variance(&self, sample: usize, channel: usize) -> f64 {
        if channel == TIME { self.of_time[sample] } else { self.variance[channel] }
    }

    /// Returns the reciprocals of the variances of a sample's readings. Zero for a channel that has no reading or no noise.
    fn weights(&self, (sample, measured): (usize, &[bool; CHANNELS])) -> Sample {
        std::array::from_fn(|k| {
            let variance = self.variance(sample, k);
            if measured[k] && variance > 0.0 { variance.recip() } else { 0.0 }
        })
    }

    /// Returns three rows for a parameter p, from which the information matrix J is computed. The first row has ∂x/∂p times the weight of
    /// each reading x. The second has the weighted sum of ∂x/∂p ∂x/∂t over the channels of each sample. The third has this sum times the
    /// sample's factor for jitter, `shared`.
    fn rows(&self, weights: &[Sample], shared: &[f64], column: &Sensitivity) -> [Vec<f64>; 3] {
        let flat = weights.as_flattened().iter().zip(column.slope.as_flattened());
        let weighted = flat.map(|(weight, slope)| weight * slope).collect();
        let over_time = weights.iter().zip(&column.slope).zip(&self.slope);
        let along: Vec<f64> = over_time.map(|((weight, slope), time)| dot(weight, slope, time)).collect();
        let times_shared = along.iter().zip(shared).map(|(along, shared)| along * shared).collect();
        [weighted, along, times_shared]
    }

    /// Returns two flags. The first is true if any reading has no additive noise (noise or quantization), the second if all readings have
    /// none. Jitter of the sampling instant does not count as noise. It shifts all channels of a sample alike, so combinations of two
    /// phases are free of it.
    pub fn exact(&self) -> [bool; 2] {
        let measured = self.readings.measured.iter().enumerate();
        let each = measured.flat_map(|(sample, measured)| {
            (0..CHANNELS).filter(|k| measured[*k]).map(move |k| self.variance(sample, k) == 0.0)
        });
        each.fold([false, true], |[any, all], exact| [any || exact, all && exact])
    }

    /// Returns a noise model that has only the readings without noise. Their variance is set to 1.
    pub fn of_exact(&self) -> Self {
        let mut alone = self.clone();
        for (sample, measured) in alone.readings.measured.iter_mut().enumerate() {
            for (k, measured) in measured.iter_mut().enumerate() {
                *measured &= self.variance(sample, k) == 0.0;
            }
        }
        alone.variance = [1.0; CHANNELS];
        alone.of_time.fill(1.0);
        alone.jitter = 0.0;
        alone
    }

    /// Returns true if any sample has a reading of a channel.
    pub fn has(&self, channel: usize) -> bool {
        self.readings.measured.iter().any(|measured| measured[channel])
    }

    /// Returns the sensitivity of a channel to the relative gain error of its sensor. For captured times, it is the sensitivity to the
    /// relative error of the timer's clock.
    pub fn gain(&self, channel: usize) -> Sensitivity {
        let slope = self.readings.value.iter().map(|value| only(channel, value[channel])).collect();
        Sensitivity { slope, error: [0.0; CHANNELS] }
    }

    /// Returns the sensitivity of a channel to the offset of its sensor.
    pub fn offset(&self, channel: usize) -> Sensitivity {
        Sensitivity { slope: vec![only(channel, 1.0); self.readings.value.len()], error: [0.0; CHANNELS] }
    }
}

fn only(channel: usize, value: f64) -> Sample {
    std::array::from_fn(|k| if k == channel { value } else { 0.0 })
}

/// Fisher information matrix; the angle is the first parameter.
#[derive(Clone, Debug)]
pub struct Information {
    matrix: DMatrix<f64>,
    /// Threshold below which a number counts as zero, see [`RANK`]. It is larger if difference quotients of captured times are less exact.
    rank: f64,
}

impl Information {
    /// Computes the information matrix J from the sensitivities in `columns`. Readings without noise are left out; [`Noise::of_exact`]
    /// serves for them. A parameter's row is zero if no reading depends on the parameter.
    pub fn new(noise: &Noise, columns: &[Sensitivity]) -> Self {
        let n = columns.len();
        let live: Vec<bool> = columns.iter().map(Sensitivity::responds).collect();
        let errors =
            columns.iter().zip(&live).filter(|(_, live)| **live).map(|(column, _)| column.error_of_times());
        let rank = errors.fold(RANK, f64::max).min(MOST_RANK);
        let weights: Vec<Sample> =
            noise.readings.measured.iter().enumerate().map(|of| noise.weights(of)).collect();
        // C⁻¹ of D + τ² s sᵀ with D diagonal, by Sherman and Morrison.
        let shared: Vec<f64> = weights
            .iter()
            .zip(&noise.slope)
            .map(|(weight, slope)| noise.jitter / (1.0 + noise.jitter * dot(weight, slope, slope)))
            .collect();
        // Three rows for each parameter, see `Noise::rows`.
        let rows: Vec<[Vec<f64>; 3]> = columns
            .iter()
            .zip(&live)
            .map(
                |(column, live)| {
                    if *live { noise.rows(&weights, &shared, column) } else { Default::default() }
                },
            )
            .collect();
        // A parameter to which no reading responds has a row of zeros.
        let responds: Vec<usize> = (0..n).filter(|k| live[*k]).collect();
        let places: Vec<(usize, usize)> =
            responds.iter().flat_map(|x| responds.iter().map(|y| (*x, *y)).filter(|(x, y)| y <= x)).collect();
        let mut matrix = DMatrix::zeros(n, n);
        for places in places.chunks(ROWS) {
            // The last pairs may be fewer than are computed side by side.
            let at = |k: usize| places[k.min(places.len() - 1)];
            let slopes =
                [0, 1, 2, 3].map(at).map(|(x, y)| (&rows[x][0][..], columns[y].slope.as_flattened()));
            let jitter = [0, 1, 2, 3].map(at).map(|(x, y)| (&rows[x][1][..], &rows[y][2][..]));
            let (slopes, jitter) = (dots(slopes), dots(jitter));
            for (k, place) in places.iter().enumerate() {
                matrix[*place] = slopes[k] - jitter[k];
            }
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        Self { matrix, rank }
    }

    /// Returns the standard deviation of the angle in rad, given priors of some parameters. Infinite if the readings do not determine the
    /// angle. Combinations of the other parameters that do not affect any reading are left out.
    pub fn deviation(&self, priors: &[Prior]) -> f64 {
        let mut matrix = self.matrix.clone();
        for prior in priors {
            matrix[(prior.place, prior.place)] += 1.0 / (prior.deviation * prior.deviation);
        }
        let whole = matrix[(0, 0)];
        if whole <= 0.0 {
            return f64::INFINITY;
        }
        let live: Vec<usize> = (1..matrix.nrows()).filter(|k| matrix[(*k, *k)] > 0.0).collect();
        if live.is_empty() {
            return 1.0 / whole.sqrt();
        }
        let scale = |k: usize| matrix[(k, k)].sqrt();
        let among = DMatrix::from_fn(live.len(), live.len(), |x, y| {
            matrix[(live[x], live[y])] / (scale(live[x]) * scale(live[y]))
        });
        let shared =
            DVector::from_fn(live.len(), |x, _| matrix[(live[x], 0)] / (scale(live[x]) * whole.sqrt()));
        // Share of the angle's information that the other unknown parameters leave: Schur's complement.
        let eigen = SymmetricEigen::new(among);
        let taken: f64 = eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
            .filter(|(value, _)| **value > self.rank)
            .map(|(value, vector)| {
                let along = vector.dot(&shared);
                along * along / value
            })
            .sum();
        let left = 1.0 - taken;
        if left > self.rank { 1.0 / (whole * left).sqrt() } else { f64::INFINITY }
    }
}

fn dot(weight: &Sample, x: &Sample, y: &Sample) -> f64 {
    (0..CHANNELS).map(|k| weight[k] * x[k] * y[k]).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    /// Makes the noise of phase currents with this variance in A².
    fn noise(variance: f64, jitter: f64, slope: Vec<Sample>, samples: usize) -> Noise {
        let phases = std::array::from_fn(|k| k < LINK);
        let readings = Readings { value: vec![[1.0; CHANNELS]; samples], measured: vec![phases; samples] };
        Noise { readings, variance: [variance; CHANNELS], of_time: vec![0.0; samples], jitter, slope }
    }

    fn sample([a, b, c]: [f64; 3]) -> Sample {
        [a, b, c, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn column(slope: &[[f64; 3]]) -> Sensitivity {
        Sensitivity { slope: slope.iter().map(|slope| sample(*slope)).collect(), error: [0.0; CHANNELS] }
    }

    #[test]
    fn analytic_two_parameters_and_a_prior() {
        let noise = noise(0.25, 0.0, Vec::new(), 2);
        let angle = column(&[[1.0, 0.0, 2.0], [0.0, 3.0, 0.0]]);
        let other = column(&[[2.0, 0.0, 0.0], [0.0, 1.0, 1.0]]);
        // J = [14, 5; 5, 6] / 0.25.
        let information = Information::new(&noise, &[angle.clone(), other.clone()]);
        let variance = |other: f64| 0.25 * other / (14.0 * other - 25.0);
        assert!((information.deviation(&[]).powi(2) - variance(6.0)).abs() < 1e-15);
        let prior = Prior { place: 1, deviation: 0.5 };
        assert!((information.deviation(&[prior]).powi(2) - variance(6.0 + 0.25 * 4.0)).abs() < 1e-15);
        // Two equal columns count as one unknown. If a further column equals the column of the angle, no information on the angle is left.
        let twice = Information::new(&noise, &[angle.clone(), other.clone(), other]);
        assert!((twice.deviation(&[]).powi(2) - variance(6.0)).abs() < 1e-12);
        assert!(Information::new(&noise, &[angle.clone(), angle.clone()]).deviation(&[]).is_infinite());
        let silent = column(&[[0.0; 3]; 2]);
        let alone = Information::new(&noise, &[angle.clone(), silent.clone()]).deviation(&[]);
        assert!((alone.powi(2) - 0.25 / 14.0).abs() < 1e-15);
        assert!(Information::new(&noise, &[silent, angle]).deviation(&[]).is_infinite());
    }

    #[test]
    fn analytic_jitter_is_one_for_all_phases() {
        let slope = [3.0, -2.0, 0.5];
        let noise = noise(0.04, 0.01, vec![sample(slope)], 1);
        let g = [1.0, 0.3, -1.3];
        let s = nalgebra::Vector3::from(slope);
        let covariance = Matrix3::identity() * 0.04 + s * s.transpose() * 0.01;
        let g_vector = nalgebra::Vector3::from(g);
        let information = g_vector.dot(&(covariance.try_inverse().expect("positive") * g_vector));
        let got = Information::new(&noise, &[column(&[g])]).deviation(&[]);
        assert!((got.powi(-2) / information - 1.0).abs() < 1e-12);
    }

    #[test]
    fn analytic_readings_of_all_kinds_add_their_information() {
        // A current with 0.5 A of noise, a terminal with 2 V and a time with 1 µs, each in a sample of its own or together.
        let all = [(0, 0.25, 3.0), (TERMINAL, 4.0, 10.0), (TIME, 1e-12, 4e-6)];
        let expected: f64 = all.iter().map(|(_, variance, slope)| slope * slope / variance).sum();
        for samples in [1, 3] {
            let mut readings = Readings {
                value: vec![[0.0; CHANNELS]; samples],
                measured: vec![[false; CHANNELS]; samples],
            };
            let mut angle = Sensitivity { slope: vec![[0.0; CHANNELS]; samples], error: [0.0; CHANNELS] };
            let mut variance = [0.0; CHANNELS];
            for (place, (channel, of, slope)) in all.into_iter().enumerate() {
                let sample = if samples == 1 { 0 } else { place };
                readings.measured[sample][channel] = true;
                angle.slope[sample][channel] = slope;
                variance[channel] = of;
            }
            let noise =
                Noise { readings, variance, of_time: vec![1e-12; samples], jitter: 0.0, slope: Vec::new() };
            assert_eq!(noise.exact(), [false, false]);
            let deviation = Information::new(&noise, &[angle]).deviation(&[]);
            assert!((deviation.powi(-2) / expected - 1.0).abs() < 1e-12, "{deviation}");
        }
    }
}
