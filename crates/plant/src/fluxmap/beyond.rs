//! Continuation of maps of one side of the d-axis: finite elements are mostly run for i_d ≤ 0 only, where machines
//! operate.
//!
//! The data do not determine the other side. A core that fits one side well may be wrong about the other: an iron
//! bridge that saturates under positive currents leaves no trace under negative ones. The best-fitting core therefore
//! continues the map for the simulation, and all cores that fit about as well are asked for the difference between the
//! poles. If they agree, the difference is assumed; otherwise the map does not determine it.

mod fit;

use serde::Serialize;
use standstill_interface::Dq;

use super::FluxMap;
use super::grid::Grid;
use crate::{Algebraic, Magnetics};
use standstill_files::{MapError, Place};
use standstill_quantity::short;

pub use fit::FittedCore;
use fit::{Data, Point};

/// Points along an axis that cores are fitted to: they have a dozen numbers.
const SITES: usize = 21;

/// Distance of a core's currents from the map's, over its largest current, beyond which it does not describe the machine.
const FARTHEST: f64 = 0.05;

/// Largest ratio of a core's distance from the map to the best core's distance at which the core counts as fitting as
/// well.
const ALIKE: f64 = 1.5;
/// Distance from the map up to which every core counts as fitting as well: no machine is exactly such a core, and no map
/// is known better.
const EQUAL: f64 = 2e-3;

/// Difference of the poles' currents below which a core counts as not telling them apart.
const NO_DIFFERENCE: f64 = 2e-3;

/// Largest ratio between the largest and the smallest difference of the poles at which cores agree. Beyond it, some
/// cores have hardly any difference.
const AGREED: f64 = 10.0;

/// How a side of a map that is missing in its file was continued.
#[derive(Clone, Debug, PartialEq)]
pub struct Continuation {
    /// Range of i_d in A that the file has.
    pub measured: [f64; 2],
    /// Cores that fit the file, those without iron bridges first, each kind from the best to the worst.
    pub cores: Vec<FittedCore>,
}

/// Difference of the poles by cores of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoleSpread {
    /// Whether they have iron bridges.
    pub bridged: bool,
    /// Number of those cores.
    pub cores: usize,
    /// The distance of the best one's currents from the map's, over its largest current.
    pub distance: f64,
    /// Least and largest relative difference of the poles: `i_N/i_S − 1` for the currents of north and south at the
    /// same change of the flux.
    pub difference: [f64; 2],
}

/// Knowledge of which pole draws more current, by the data sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoleKnowledge {
    /// The data have both sides of the d-axis.
    Known,
    /// The motor has no saturation data, without which poles cannot be distinguished.
    NotGiven,
    /// The map lacks one side, and all cores that fit the other side agree.
    Assumed,
    /// The map lacks one side, and cores that fit the other side disagree.
    NotDetermined,
}

impl PoleKnowledge {
    /// Returns whether too little is known to judge a pole.
    pub const fn is_open(self) -> bool {
        matches!(self, Self::NotGiven | Self::NotDetermined)
    }

    /// Returns the caveat for a verdict on the pole; none if the data have both sides.
    pub const fn note(self) -> Option<&'static str> {
        match self {
            Self::Known => None,
            Self::NotGiven => Some("saturation is not given: the pole cannot be judged"),
            Self::Assumed => Some(
                "the pole is assumed: its map has one side of the d-axis only, and all cores that fit it agree",
            ),
            Self::NotDetermined => Some(
                "the pole is not determined by this map: it has one side of the d-axis only, and cores that fit it do not say the same",
            ),
        }
    }
}

impl Continuation {
    /// Returns the grid with the side that is missing, up to the current of the other one; none if both are there.
    pub(super) fn of(grid: &Grid, file: &str) -> Result<Option<(Grid, Self)>, MapError> {
        let (low, high) = (grid.d[0], grid.d[grid.d.len() - 1]);
        let reach = high.max(-low);
        let sign = if high < -low { 1.0 } else { -1.0 };
        let covered = high.min(-low);
        let mut missing: Vec<f64> = grid
            .d
            .iter()
            .map(|i| i.abs())
            .filter(|i| *i > covered + 0.5 * reach / grid.d.len() as f64)
            .collect();
        missing.sort_by(f64::total_cmp);
        if covered > reach * (1.0 - 1e-6) || missing.is_empty() {
            return Ok(None);
        }
        let error = |found: String| {
            let needed =
                "a map that algebraic cores describe (docs/maps.md), or one of both sides".to_owned();
            MapError::new(file, None, found, needed)
        };
        let mut cores = fitting(&points(grid));
        if cores.is_empty() {
            let found = format!(
                "fluxes that no algebraic core fits to {} % of the largest current: nothing tells how they go on beyond i_d = {} A",
                100.0 * FARTHEST,
                short(covered * sign)
            );
            return Err(error(found));
        }
        let by_distance = |a: &&FittedCore, b: &&FittedCore| a.distance.total_cmp(&b.distance);
        let mut tried: Vec<FittedCore> = cores.clone();
        tried.sort_by(|a, b| by_distance(&a, &b));
        let side: Vec<f64> = missing.iter().map(|i| sign * i).collect();
        let whole = tried.iter().find_map(|fitted| continued(grid, &side, fitted));
        let Some(whole) = whole else {
            return Err(error("fluxes that go on as no convex energy does".to_owned()));
        };
        cores.sort_by_key(|fitted| fitted.core.bridge.is_some());
        Ok(Some((whole, Self { measured: [low, high], cores })))
    }

    /// Returns the difference of the poles by cores of each kind, up to a current in A along d.
    pub fn spread(&self, map: &FluxMap, current: f64) -> Vec<PoleSpread> {
        [false, true].into_iter().filter_map(|bridged| self.spread_of(map, current, bridged)).collect()
    }

    fn spread_of(&self, map: &FluxMap, current: f64, bridged: bool) -> Option<PoleSpread> {
        let kind: Vec<_> =
            self.cores.iter().filter(|fitted| fitted.core.bridge.is_some() == bridged).collect();
        let difference = kind.iter().filter_map(|fitted| self.difference(map, &fitted.core, current));
        let difference =
            difference.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        Some(PoleSpread { bridged, cores: kind.len(), distance: kind.first()?.distance, difference })
    }

    /// Returns `i_N/i_S − 1` for the currents of north and south at the same change of the flux, the larger about
    /// `current` in A. The map gives one side, the core the other. See [`crate::PolarityPoint`].
    fn difference(&self, map: &FluxMap, core: &Algebraic, current: f64) -> Option<f64> {
        let zero = Dq::new(0.0, 0.0);
        let known = if self.measured[1] < -self.measured[0] { -1.0 } else { 1.0 };
        let (map_rest, core_rest) = (map.flux_at(zero).ok()?, core.flux_at(zero).ok()?);
        let at = |side: f64| Dq::new(side * current, 0.0);
        let of_map = (map.flux_at(at(known)).ok()? - map_rest).d.abs();
        let of_core = (core.flux_at(at(-known)).ok()? - core_rest).d.abs();
        let change = Dq::new(known * of_map.min(of_core), 0.0);
        let (measured, assumed) =
            (map.current(map_rest + change).d.abs(), core.current(core_rest - change).d.abs());
        let [north, south] = if known < 0.0 { [assumed, measured] } else { [measured, assumed] };
        Some(north / south - 1.0)
    }

    /// Returns the knowledge of the poles up to a current in A along d: near it and at half of it, where pulses are.
    pub fn pole(&self, map: &FluxMap, current: f64) -> PoleKnowledge {
        if self.measured[1].min(-self.measured[0]) >= current * (1.0 - 1e-6) {
            return PoleKnowledge::Known;
        }
        let agreed = [0.5 * current, current].into_iter().all(|current| {
            let spread = self.spread(map, current);
            let low = spread.iter().map(|kind| kind.difference[0]).fold(f64::INFINITY, f64::min);
            let high = spread.iter().map(|kind| kind.difference[1]).fold(f64::NEG_INFINITY, f64::max);
            let (least, most) = if low > 0.0 { (low, high) } else { (-high, -low) };
            least > NO_DIFFERENCE && most <= AGREED * least && most.is_finite()
        });
        if agreed { PoleKnowledge::Assumed } else { PoleKnowledge::NotDetermined }
    }
}

/// Returns some of the grid's points, evenly chosen, with its ends.
fn points(grid: &Grid) -> Vec<Point> {
    let chosen = |count: usize| -> Vec<usize> {
        let sites = count.min(SITES);
        (0..sites).map(|k| k * (count - 1) / (sites - 1)).collect()
    };
    let (rows, columns) = (chosen(grid.d.len()), chosen(grid.q.len()));
    let point =
        |a: usize, b: usize| (Dq::new(grid.psi_d[(a, b)], grid.psi_q[(a, b)]), Dq::new(grid.d[a], grid.q[b]));
    rows.iter().flat_map(|a| columns.iter().map(|b| point(*a, *b))).collect()
}

/// Cores that fit the points, each kind from the best to the worst.
fn fitting(points: &[Point]) -> Vec<FittedCore> {
    let Some(data) = Data::new(points) else { return Vec::new() };
    let mut cores = data.plain();
    cores.extend(data.bridged());
    cores.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let most = cores.first().map_or(0.0, |best| (ALIKE * best.distance).clamp(EQUAL, FARTHEST));
    // Two that differ by less are one, met twice.
    cores.dedup_by(|next, kept| next.core == kept.core);
    cores.retain(|fitted| fitted.distance <= most);
    cores
}

/// Returns the grid extended by these currents along d, with the fluxes of a core, shifted such that they join the data
/// at the edge.
fn continued(grid: &Grid, side: &[f64], fitted: &FittedCore) -> Option<Grid> {
    let edge = if side[0] > 0.0 { grid.d.len() - 1 } else { 0 };
    let mut columns = Vec::new();
    for (b, i_q) in grid.q.iter().enumerate() {
        let at = |i_d: f64| fitted.core.flux_at(Dq::new(i_d, *i_q)).ok();
        let off = Dq::new(grid.psi_d[(edge, b)], grid.psi_q[(edge, b)]) - at(grid.d[edge])?;
        let fluxes: Option<Vec<_>> = side.iter().map(|i_d| at(*i_d).map(|flux| flux + off)).collect();
        columns.push(fluxes?);
    }
    let whole = grid.with_side(side, |a, b| columns[b][a], &Place::Continued);
    whole.check("", super::MapAxes::Magnet).is_ok().then_some(whole)
}
