//! The converters' sampling capacitors behind the sensors' filters, of machines side by side.

use standstill_numeric::Wide;

use super::filters::Filters;

/// The converters' sampling capacitors, of time constant ρ, behind the sensors' filters, of time constant τ. The two in
/// series have the output `(τ x − ρ y)/(τ − ρ)`, where x is the output of the filter alone and y that of a filter with
/// ρ alone. Both have the same input, so the combination is as exact as each of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Acquiring<V> {
    /// Filters with the capacitors' time constants alone.
    pub filters: Filters<V>,
    /// The factor τ/(τ − ρ) of the sensors' filters; zero without filters.
    pub of_sensors: [V; 3],
}

/// Least difference of the two time constants, as a share of the larger one; a smaller difference is replaced by this
/// one.
const APART: f64 = 1e-4;

impl<V: Wide> Acquiring<V> {
    /// Puts sampling capacitors with the time constant `own` in s into a lane; `filters`: time constants in s of the
    /// filters before them, if there are any.
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
