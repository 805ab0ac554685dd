//! Maps over amplitude and angle of the current: brought to a rectangle within their circle, by cubic interpolation.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, TAU};

use standstill_numeric::{atan2, hypot};

use super::csv::point;
use super::{MapError, MapPoint, Place};

/// Angles that differ by less are one, in rad.
const SAME: f64 = 1e-6;

/// Fluxes over amplitudes (rows) and angles.
struct Table {
    amplitudes: Vec<f64>,
    angles: Vec<f64>,
    /// The angles go all around.
    closed: bool,
    fluxes: Vec<[f64; 2]>,
}

/// Returns the points of a rectangle of currents from lines of amplitude, angle, ψ_d and ψ_q; the angle from +d, or
/// from +q towards −d.
pub(super) fn points(
    file: &str,
    rows: &[(usize, [f64; 4])],
    from_q: bool,
) -> Result<Vec<MapPoint>, MapError> {
    let error = |found: String, needed: &str| MapError::new(file, None, found, needed.to_owned());
    let angle = |angle: f64| {
        let from_d = if from_q { angle + FRAC_PI_2 } else { angle };
        let wrapped = from_d.rem_euclid(TAU);
        if wrapped > TAU - SAME { 0.0 } else { wrapped }
    };
    let table = Table::of(rows, angle)
        .map_err(|found| error(found, "each amplitude at each angle, four or more of both"))?;
    let reach = table.amplitudes[table.amplitudes.len() - 1];
    // The largest rectangle along the axes that all of the circle, its upper half or a quadrant contains.
    let side = reach * FRAC_1_SQRT_2;
    let covers = |angle: f64| table.covers(angle);
    let range = |low: bool, high: bool| [if low { -side } else { 0.0 }, if high { side } else { 0.0 }];
    let quadrants = [0.5, 1.5, 2.5, 3.5].map(|quarter| covers(quarter * FRAC_PI_2));
    let d = range(quadrants[1] || quadrants[2], quadrants[0] || quadrants[3]);
    let q = range(quadrants[2] || quadrants[3], quadrants[0] || quadrants[1]);
    let count = table.amplitudes.len().clamp(8, 64);
    let axis = |[low, high]: [f64; 2]| {
        let count = if low < 0.0 && high > 0.0 { 2 * count } else { count };
        (0..=count).map(move |k| {
            let whole = low + (high - low) * k as f64 / count as f64;
            // Zero is one of them, exactly.
            if whole.abs() < 1e-9 * (high - low) { 0.0 } else { whole }
        })
    };
    let mut points = Vec::new();
    for i_d in axis(d) {
        for i_q in axis(q) {
            let flux = table.at(hypot(i_d, i_q), atan2(i_q, i_d).rem_euclid(TAU)).ok_or_else(|| {
                let found = format!("no angle near {:.0}°", atan2(i_q, i_d).to_degrees());
                error(found, "angles that cover whole quadrants, with their ends")
            })?;
            points.push(point([i_d, i_q, flux[0], flux[1]], Place::Element(points.len() + 1)));
        }
    }
    Ok(points)
}

impl Table {
    fn of(rows: &[(usize, [f64; 4])], angle: impl Fn(f64) -> f64) -> Result<Self, String> {
        let distinct = |values: &mut dyn Iterator<Item = f64>, close: f64| {
            let mut values: Vec<f64> = values.collect();
            values.sort_by(f64::total_cmp);
            values.dedup_by(|next, kept| *next - *kept < close);
            values
        };
        if rows.iter().any(|(_, row)| row[0] < 0.0) {
            return Err("a negative amplitude".to_owned());
        }
        let largest = rows.iter().map(|(_, row)| row[0]).fold(0.0, f64::max);
        let amplitudes = distinct(&mut rows.iter().map(|(_, row)| row[0]), 1e-6 * largest);
        // At no current, all angles are one point: a file may have it once.
        let angles =
            distinct(&mut rows.iter().filter(|(_, row)| row[0] > 0.0).map(|(_, row)| angle(row[1])), SAME);
        let (n, m) = (amplitudes.len(), angles.len());
        if n < 4 || m < 4 || n * m > 2 * rows.len() {
            return Err(format!("{n} amplitudes and {m} angles in {} points", rows.len()));
        }
        let near = |values: &[f64], value: f64, close: f64| {
            values.partition_point(|x| *x < value - close).min(values.len() - 1)
        };
        let mut fluxes = vec![[f64::NAN; 2]; n * m];
        for (_, [amplitude, at, psi_d, psi_q]) in rows {
            let a = near(&amplitudes, *amplitude, 1e-6 * largest);
            if *amplitude == 0.0 {
                fluxes[..m].fill([*psi_d, *psi_q]);
            } else {
                fluxes[a * m + near(&angles, angle(*at), SAME)] = [*psi_d, *psi_q];
            }
        }
        if amplitudes[0] > 0.0 {
            return Err(format!("amplitudes from {} A on", amplitudes[0]));
        }
        if let Some(missing) = fluxes.iter().position(|flux| flux[0].is_nan()) {
            let (amplitude, angle) = (amplitudes[missing / m], angles[missing % m].to_degrees());
            return Err(format!("no point of {amplitude} A at {angle:.2}° from d"));
        }
        let gap = angles.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let closed = angles[0] + TAU - angles[m - 1] < 1.5 * gap;
        Ok(Self { amplitudes, angles, closed, fluxes })
    }

    fn covers(&self, angle: f64) -> bool {
        self.closed || (self.angles[0] - SAME..=self.angles[self.angles.len() - 1] + SAME).contains(&angle)
    }

    /// Returns ψ_d and ψ_q, by cubic polynomials through four amplitudes and four angles; none between the last angle
    /// and the first.
    fn at(&self, amplitude: f64, angle: f64) -> Option<[f64; 2]> {
        let m = self.angles.len();
        // A zero angle may be the end of the last turn.
        let angle = if self.covers(angle) { angle } else { angle + TAU };
        if !self.covers(angle) && amplitude > 0.0 {
            return None;
        }
        let rows = weights(&self.amplitudes, amplitude);
        let columns: Vec<(usize, f64)> = if self.closed {
            // Three of the neighbours on either side of the turn's end.
            let long: Vec<f64> = (0..m + 6)
                .map(|k| self.angles[(k + m - 3) % m] + TAU * ((k + m - 3) / m) as f64 - TAU)
                .collect();
            weights(&long, angle).map(|(k, weight)| ((k + m - 3) % m, weight)).to_vec()
        } else {
            weights(&self.angles, angle).to_vec()
        };
        let mut flux = [0.0; 2];
        for (a, along) in rows {
            for (b, across) in &columns {
                for (sum, value) in flux.iter_mut().zip(self.fluxes[a * m + b]) {
                    *sum += along * across * value;
                }
            }
        }
        Some(flux)
    }
}

/// Returns the four sites around a place and their weights in Lagrange's polynomial.
fn weights(sites: &[f64], x: f64) -> [(usize, f64); 4] {
    let first = sites.partition_point(|site| *site <= x).saturating_sub(2).min(sites.len() - 4);
    [0, 1, 2, 3].map(|i| {
        let others = (0..4).filter(|j| *j != i);
        let weight = others.map(|j| (x - sites[first + j]) / (sites[first + i] - sites[first + j])).product();
        (first + i, weight)
    })
}
