//! Fisher information and standard deviation of the angle, from sensitivities and noise.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use standstill_sim::SensorSettings;

use super::replay::Readings;

/// Relative threshold, with the diagonal scaled to one, below which an eigenvalue or the angle's remaining information is zero:
/// the square of the differences' error.
const RANK: f64 = 1e-9;

/// Sensitivities of the readings to one parameter.
#[derive(Clone, Debug)]
pub struct Column {
    /// ∂i/∂p of the three phases at each sample, in A per unit of the parameter.
    pub slope: Vec<[f64; 3]>,
    /// Numerical error of `slope`, in A per unit of the parameter and per sample.
    pub error: f64,
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
    /// Variance of one phase's reading in A²: noise and quantization.
    variance: f64,
    /// Variance of the sampling instant in s².
    jitter: f64,
    /// Slopes of the phase currents in A/s at each sample; empty without jitter.
    slope: Vec<[f64; 3]>,
}

impl Noise {
    /// Takes the noise of these sensors. A current outside of the converter's range does not count as a reading.
    pub fn new(sensors: &SensorSettings, mut readings: Readings, slope: Vec<[f64; 3]>) -> Self {
        let conversions = f64::from(sensors.oversampling.max(1));
        let mut variance = sensors.noise * sensors.noise / conversions;
        if let Some(adc) = sensors.adc {
            if adc.rounds() {
                // Equal codes have equal errors: only noise of half a code or more makes those of a mean independent.
                let independent = if sensors.noise >= 0.5 * adc.step() { conversions } else { 1.0 };
                variance += adc.step() * adc.step() / 12.0 / independent;
            }
            for (measured, current) in readings.measured.iter_mut().zip(&readings.current) {
                for (measured, current) in measured.iter_mut().zip(current) {
                    *measured &= (adc.low..adc.high).contains(current);
                }
            }
        }
        let jitter = sensors.jitter.seconds();
        Self { readings, variance, jitter: jitter * jitter / 3.0, slope }
    }

    /// Returns true if there is no additive noise. Jitter alone has no effect on a difference of two phases.
    pub fn is_none(&self) -> bool {
        self.variance == 0.0
    }

    /// Returns the sensitivity ∂i/∂g to a sensor's gain.
    pub fn gain(&self, phase: usize) -> Column {
        let slope = self.readings.current.iter().map(|current| only(phase, current[phase])).collect();
        Column { slope, error: 0.0 }
    }

    /// Returns the sensitivity ∂i/∂o to a sensor's offset.
    pub fn offset(&self, phase: usize) -> Column {
        Column { slope: vec![only(phase, 1.0); self.readings.current.len()], error: 0.0 }
    }
}

fn only(phase: usize, value: f64) -> [f64; 3] {
    std::array::from_fn(|k| if k == phase { value } else { 0.0 })
}

/// Fisher information matrix; the angle is the first parameter.
#[derive(Clone, Debug)]
pub struct Information {
    matrix: DMatrix<f64>,
}

impl Information {
    /// Computes the information matrix J from the sensitivities, for noise of 1 A if the sensors have none. The row of a parameter is
    /// zero if no reading depends on it.
    pub fn new(noise: &Noise, columns: &[Column]) -> Self {
        let n = columns.len();
        let Readings { measured, .. } = &noise.readings;
        let (variance, jitter) = if noise.is_none() { (1.0, 0.0) } else { (noise.variance, noise.jitter) };
        let responds = |column: &Column| {
            let squares = column.slope.iter().flatten().map(|g| g * g).sum::<f64>();
            squares > column.error * column.error * column.slope.len() as f64
        };
        let live: Vec<bool> = columns.iter().map(responds).collect();
        let mut matrix = DMatrix::zeros(n, n);
        let mut along = vec![0.0; n];
        let mut rows = vec![[0.0; 3]; n];
        for (sample, measured) in measured.iter().enumerate() {
            for ((row, column), live) in rows.iter_mut().zip(columns).zip(&live) {
                let g = column.slope[sample];
                *row = std::array::from_fn(|k| if *live && measured[k] { g[k] } else { 0.0 });
            }
            let slope = noise.slope.get(sample).copied().unwrap_or_default();
            let slope: [f64; 3] = std::array::from_fn(|k| if measured[k] { slope[k] } else { 0.0 });
            // C⁻¹ of σ² I + τ² s sᵀ, by Sherman and Morrison.
            let shared = jitter / (variance + jitter * dot(slope, slope));
            for (along, row) in along.iter_mut().zip(&rows) {
                *along = dot(*row, slope);
            }
            for x in 0..n {
                for y in 0..=x {
                    matrix[(x, y)] += (dot(rows[x], rows[y]) - shared * along[x] * along[y]) / variance;
                }
            }
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        Self { matrix }
    }

    /// Returns the standard deviation of the angle in rad, with prior knowledge of some parameters; infinite if the readings do
    /// not determine the angle. Directions of the other parameters to which no reading responds are left out.
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
        // What of the angle's information the others leave, as a share: Schur's complement.
        let eigen = SymmetricEigen::new(among);
        let taken: f64 = eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
            .filter(|(value, _)| **value > RANK)
            .map(|(value, vector)| {
                let along = vector.dot(&shared);
                along * along / value
            })
            .sum();
        let left = 1.0 - taken;
        if left > RANK { 1.0 / (whole * left).sqrt() } else { f64::INFINITY }
    }
}

fn dot(x: [f64; 3], y: [f64; 3]) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    fn noise(variance: f64, jitter: f64, slope: Vec<[f64; 3]>, samples: usize) -> Noise {
        let readings = Readings { current: vec![[1.0; 3]; samples], measured: vec![[true; 3]; samples] };
        Noise { readings, variance, jitter, slope }
    }

    fn column(slope: &[[f64; 3]]) -> Column {
        Column { slope: slope.to_vec(), error: 0.0 }
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
        // The same column twice is one unknown; the angle's own is its end.
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
        let noise = noise(0.04, 0.01, vec![slope], 1);
        let g = [1.0, 0.3, -1.3];
        let s = nalgebra::Vector3::from(slope);
        let covariance = Matrix3::identity() * 0.04 + s * s.transpose() * 0.01;
        let g_vector = nalgebra::Vector3::from(g);
        let information = g_vector.dot(&(covariance.try_inverse().expect("positive") * g_vector));
        let got = Information::new(&noise, &[column(&[g])]).deviation(&[]);
        assert!((got.powi(-2) / information - 1.0).abs() < 1e-12);
    }
}
