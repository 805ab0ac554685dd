//! Errors of the inductances of a map: from noise, from a coarse grid, and from the surface that is simulated.

use std::sync::Arc;

use standstill_interface::Dq;
use standstill_numeric::{Symmetric, hypot};

use super::banded::Factor;
use super::co_energy::CoEnergy;
use super::grid::Grid;
use super::project::{self, Fit, MOST_SITES, spread};
use crate::{FluxMap, Magnetics};

/// Places along each axis at which the errors are computed; between them they are interpolated.
const PLACES: usize = 25;

/// Half of the points must still make a map, and one that is known on either side of zero.
const LEAST_VALUES: usize = 9;

/// Half the number of splines, used if there are more points than splines.
const FEWER_SITES: usize = MOST_SITES / 2 + 1;

/// Largest relative difference in inductance between a map and the map of every second point. Beyond it, the map is too
/// coarse for its saturation.
pub(super) const COARSE: f64 = 0.05;

/// A fit, and the data for its errors.
pub(super) struct Known<'a> {
    pub(super) co_energy: &'a CoEnergy,
    pub(super) factor: &'a Factor,
    /// Noise in Wb of independent points.
    pub(super) noise: f64,
    /// The surface that is simulated in its place.
    pub(super) simulated: &'a FluxMap,
}

/// Standard errors of the inductances along the axes of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct InductanceErrors {
    /// Along i_d (at i_q = 0) and along i_q (at i_d = 0): current in A, standard errors of L_dd, L_dq, L_qq in H.
    along: [Vec<(f64, [f64; 3])>; 2],
    coarseness: Option<f64>,
}

impl InductanceErrors {
    pub(super) fn of(known: &Known, grid: &Grid) -> Self {
        let coarse = grid.every_second(LEAST_VALUES).and_then(|grid| {
            let smoothing = project::smoothing(&grid)?;
            Some(Fit::new(&grid, FEWER_SITES).co_energy(smoothing.lambda)?.0)
        });
        let mut coarseness = coarse.is_some().then_some(0.0);
        let mut axis = |currents: Vec<Dq<f64>>, places: Vec<f64>| {
            let chance =
                |current: &Dq<f64>| project::errors(known.co_energy, known.factor, known.noise, *current);
            let chance: Vec<[f64; 3]> = currents.iter().map(chance).collect();
            let coarse = coarse.as_ref();
            let off = |current: &Dq<f64>| {
                coarse.map_or([0.0; 3], |coarse| differences(known.co_energy, coarse, *current))
            };
            let off: Vec<[f64; 3]> = currents.iter().map(off).collect();
            for ((current, chance), off) in currents.iter().zip(&chance).zip(&off) {
                let own = known.co_energy.at(*current).inductance;
                for (k, own) in [(0, own.xx), (2, own.yy)] {
                    // What chance does not explain: of two fits, one with half of the points.
                    let beyond = (off[k] - 4.0 * chance[k]).max(0.0) / own.abs();
                    coarseness = coarseness.map(|most| beyond.max(most));
                }
            }
            // The two fits also cross each other, where they are both wrong: what counts is the difference around a place.
            let around = |at: usize, k: usize| {
                off[at.saturating_sub(1)..(at + 2).min(off.len())]
                    .iter()
                    .map(|off| off[k])
                    .fold(0.0, f64::max)
            };
            let lost: Vec<[f64; 3]> = currents.iter().map(|current| lost(known, *current)).collect();
            let error =
                |at: usize| std::array::from_fn(|k| hypot(chance[at][k], around(at, k)) + lost[at][k]);
            places.into_iter().enumerate().map(|(at, place)| (place, error(at))).collect()
        };
        let (d, q) = (places(&grid.d), places(&grid.q));
        let along = [
            axis(d.iter().map(|i| Dq::new(*i, 0.0)).collect(), d),
            axis(q.iter().map(|i| Dq::new(0.0, *i)).collect(), q),
        ];
        Self { along, coarseness }
    }

    /// Returns the standard errors in H of L_dd, L_dq and L_qq at a current in A on the d-axis (`[i_d, 0]`) or the
    /// q-axis. They contain the noise of the data, the difference from the map of every second point, and the error of
    /// the simulated surface.
    pub fn at(&self, [i_d, i_q]: [f64; 2]) -> [f64; 3] {
        let (axis, i) = if i_q == 0.0 { (&self.along[0], i_d) } else { (&self.along[1], i_q) };
        let after = axis.partition_point(|(x, _)| *x < i).clamp(1, axis.len() - 1);
        let ((low, before), (high, after)) = (axis[after - 1], axis[after]);
        let share = ((i - low) / (high - low)).clamp(0.0, 1.0);
        std::array::from_fn(|k| before[k] + share * (after[k] - before[k]))
    }

    /// Returns the largest relative difference in L_d along the d-axis, or L_q along the q-axis, from the map of every
    /// second point with half of the splines, less the part that noise explains. None if too few points would be left.
    pub const fn coarseness(&self) -> Option<f64> {
        self.coarseness
    }

    /// Returns true if the map is too coarse for its saturation: every second point gives inductances that differ by
    /// more than 5 %.
    pub fn too_coarse(&self) -> bool {
        self.coarseness.is_some_and(|coarseness| coarseness > COARSE)
    }

    /// Returns the caveat for results; none unless the map is too coarse.
    pub(super) fn note(&self) -> Option<Arc<str>> {
        let coarseness = self.coarseness.filter(|_| self.too_coarse())?;
        Some(
            format!(
                "too coarse for its saturation: taken half as finely, an inductance differs by {:.0} %, {:.0} % are allowed; more points where it bends",
                100.0 * coarseness,
                100.0 * COARSE
            )
            .into(),
        )
    }
}

/// Returns the differences in H of L_dd, L_dq and L_qq between the simulated surface and the map's energy.
fn lost(known: &Known, current: Dq<f64>) -> [f64; 3] {
    let Ok(flux) = known.simulated.flux_at(current) else { return [f64::INFINITY; 3] };
    let own = known.co_energy.at(current).inductance;
    apart(known.simulated.current_and_inverse_inductance(flux).1.inverse(), own)
}

fn apart(one: Symmetric, other: Symmetric) -> [f64; 3] {
    [one.xx - other.xx, one.xy - other.xy, one.yy - other.yy].map(f64::abs)
}

/// Returns the differences in H of L_dd, L_dq and L_qq between two maps at a current in A.
fn differences(one: &CoEnergy, other: &CoEnergy, current: Dq<f64>) -> [f64; 3] {
    apart(one.at(current).inductance, other.at(current).inductance)
}

/// Returns some currents of an axis, with zero.
fn places(axis: &[f64]) -> Vec<f64> {
    let mut places = spread(axis, axis.len().min(PLACES));
    if let Err(at) = places.binary_search_by(|x| x.total_cmp(&0.0)) {
        places.insert(at, 0.0);
    }
    places
}
