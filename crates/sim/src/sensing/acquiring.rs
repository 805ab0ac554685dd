//! The converters' sampling capacitors, which follow the outputs of the sensors' filters; for machines side by side.

use standstill_numeric::Wide;

use super::filters::Filters;

/// The converters' sampling capacitors with time constant ρ, in series with the sensors' filters with time constant τ. The output of the
/// series is `(τ x − ρ y)/(τ − ρ)`. Here x is the output of the filter τ alone, and y is the output of a filter ρ alone with the same
/// input. So the series is as exact as two single filters.
#[derive(Clone, Copy, Debug, Default)]
pub struct Acquiring<V> {
    /// The filters with the capacitors' time constant ρ alone. Their output is y.
    pub filters: Filters<V>,
    /// The factor τ/(τ − ρ) of the filters' output x, for each phase. Zero without filters.
    pub of_sensors: [V; 3],
}

/// Smallest difference between ρ and τ, as a share of τ. A smaller difference is increased to this value, because the formula divides by
/// the difference.
const APART: f64 = 1e-4;

impl<V: Wide> Acquiring<V> {
    /// Puts sampling capacitors with the time constant `own` in s into a lane. `filters` contains the time constants in s of the filters
    /// before them; none without filters.
    pub fn put(&mut self, lane: usize, own: f64, filters: Option<[f64; 3]>) {
        let mut owns = [own; 3];
        for k in 0..3 {
            let of_filter = filters.map_or(0.0, |all| all[k]);
            if (of_filter - owns[k]).abs() < APART * of_filter {
                owns[k] = of_filter * (1.0 + APART);
            }
            self.of_sensors[k].put(lane, of_filter / (of_filter - owns[k]));
        }
        self.filters.put(lane, owns.map(|own| 1.0 / (std::f64::consts::TAU * own)));
    }
}
