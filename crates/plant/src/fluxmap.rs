//! Flux maps: cores known from finite elements or measurement, as ψ_d and ψ_q over a rectangle of currents.
//!
//! ```text
//! file ─► samples ─► rectangular grid ─► nearest map that has an energy ─► W(ψ), smooth and fast
//!         (import)   (grid: axes, gaps,  (project: splines of the         (surface: splines of the energy)
//!                     order)              co-energy, smoothed as the
//!                                         noise asks for)
//! ```
//! Fluxes from measurements or finite elements are not exactly the gradient of an energy: ∂ψ_d/∂i_q and ∂ψ_q/∂i_d
//! differ by some per cent. A simulation on such data would create or destroy energy. The simulation therefore uses the
//! nearest map that has an energy; the [`MapReport`] contains its distance from the data.

mod banded;
mod beyond;
mod co_energy;
mod convex;
mod errors;
mod grid;
mod project;
mod spline;
mod surface;
#[cfg(test)]
mod tests;

use std::fmt;
use std::sync::Arc;

use standstill_interface::Dq;

use standstill_files::{MapError, MapSamples};

pub use beyond::{Continuation, FittedCore, PoleKnowledge, PoleSpread};
use co_energy::CoEnergy;
pub use errors::InductanceErrors;
pub use surface::FluxMap;

/// Orientation of a file's axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapAxes {
    /// The magnet's flux is along +d, as everywhere here.
    Magnet,
    /// The magnet's flux was along another axis, such as −q in the convention of synchronous reluctance motors. The map
    /// was rotated by this number of quarter turns.
    Turned(u8),
    /// The motor has no magnet: the axes are those of the file.
    NoMagnet,
}

impl MapAxes {
    /// Returns a remark for messages that name a current or a flux of a rotated map; empty if the map was not rotated.
    const fn note(self) -> &'static str {
        match self {
            Self::Turned(_) => {
                " (d and q of the rotor: the file has its magnet along another axis and was turned)"
            }
            Self::Magnet | Self::NoMagnet => "",
        }
    }
}

impl fmt::Display for MapAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Magnet => "magnet along d",
            Self::Turned(1) => "magnet along +q in the file (reluctance axes), turned onto d",
            Self::Turned(2) => "magnet along -d in the file, turned onto d",
            Self::Turned(_) => "magnet along -q in the file (reluctance axes), turned onto d",
            Self::NoMagnet => "no magnet, axes as in the file",
        })
    }
}

/// Report on a map that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct MapReport {
    /// Path of the file.
    pub file: String,
    /// Points in the file.
    pub points: usize,
    /// Values of i_d and of i_q on the grid, mirrored ones included.
    pub size: [usize; 2],
    /// Range of i_d and of i_q in A.
    pub range: [[f64; 2]; 2],
    /// Orientation of the file's axes.
    pub axes: MapAxes,
    /// Angle in degrees from d to the flux without current, 1° at most; zero without a magnet.
    pub off_axis: f64,
    /// Whether the map was continued to negative i_d, i_q by its symmetry.
    pub mirrored: [bool; 2],
    /// How a side that the file lacks was continued; none if no continuation was requested or no side is missing.
    pub continued: Option<Arc<Continuation>>,
    /// Reciprocity error of the data: rms of ∂ψ_d/∂i_q − ∂ψ_q/∂i_d over the rms of their mean; zero without
    /// cross-coupling.
    pub reciprocity_error: f64,
    /// rms of that mean in H.
    pub cross_inductance: f64,
    /// rms and largest distance in Wb of the data from the map that is simulated.
    pub distance: [f64; 2],
    /// The largest flux in the data, in Wb.
    pub largest_flux: f64,
    /// Currents i_d and i_q in A at the largest distance.
    pub furthest: [f64; 2],
    /// rms noise of the data in Wb: the part that no energy explains, even a rough one. A systematic curl counts as
    /// noise, too.
    pub noise: f64,
    /// Effective number of parameters of the smoothed fit: at most one per flux.
    pub free: f64,
    /// Spline functions of the simulated map along i_d and i_q.
    pub splines: [usize; 2],
    /// Errors of the inductances.
    pub errors: InductanceErrors,
    /// rms distance in Wb of the simulated map from the nearest one that has an energy, where that is not convex.
    pub convexity: Option<f64>,
    /// Largest difference in A between the simulated current and the current of the projected map, within the map's
    /// range.
    pub evaluation_error: f64,
}

/// rms distance of a map from the nearest one with a convex energy, over its largest flux, beyond which it is none of a
/// motor. Measured ones are within a thousandth or two.
const FARTHEST: f64 = 0.03;

/// Largest difference of the simulated current from that of the map's energy, over the largest current: a refusal beyond.
const OFF: f64 = 0.01;

/// Why no map is simulated, and the current in A at which.
enum Bent {
    /// The search found no convex energy near the data.
    Energy(Dq<f64>),
    /// The energy is convex, but the surface that is to follow it is not.
    Surface(Dq<f64>),
}

/// Returns the energy itself where its surface is convex, or the nearest one whose surface is; the last that was
/// tried if none is.
fn convex(
    fit: &project::Fit,
    lambda: f64,
    own: &CoEnergy,
    grid: &grid::Grid,
    magnet: bool,
) -> (CoEnergy, Result<(FluxMap, f64), Bent>) {
    let surface = |energy: &CoEnergy| FluxMap::of(energy.clone(), grid, magnet).map_err(Bent::Surface);
    let first = fit.bent_at(own).map_or_else(|| surface(own), |current| Err(Bent::Energy(current)));
    let mut tried = (own.clone(), first);
    for share in convex::FLOORS {
        if tried.1.is_ok() {
            break;
        }
        let Some(found) = convex::nearest(fit, lambda, own, share) else { break };
        if fit.bent_at(&found).is_none() {
            let made = surface(&found);
            tried = (found, made);
        }
    }
    tried
}

impl FluxMap {
    /// Returns the map that the samples of a file make.
    pub fn new(samples: &MapSamples) -> Result<(Self, MapReport), MapError> {
        Self::made(samples, false)
    }

    /// Returns a map continued by algebraic cores that were fitted to it, where its file has one side of the d-axis
    /// only.
    pub fn continued(samples: &MapSamples) -> Result<(Self, MapReport), MapError> {
        Self::made(samples, true)
    }

    fn made(samples: &MapSamples, continued: bool) -> Result<(Self, MapReport), MapError> {
        let (grid, axes, mirrored) = grid::Grid::assemble(samples)?;
        grid.check(&samples.file, axes)?;
        let more = if continued { Continuation::of(&grid, &samples.file)? } else { None };
        let (grid, continued) =
            more.map_or((grid, None), |(whole, continuation)| (whole, Some(Arc::new(continuation))));
        let numbers = || {
            let needed = "currents and fluxes of one order of magnitude along each axis".to_owned();
            MapError::new(&samples.file, None, "fluxes that no splines fit".to_owned(), needed)
        };
        let smoothing = project::smoothing(&grid).ok_or_else(numbers)?;
        let fit = project::Fit::new(&grid, project::MOST_SITES);
        let (own, factor) = fit.co_energy(smoothing.lambda).ok_or_else(numbers)?;
        // Points made by symmetry are no new data.
        let copies = mirrored.iter().filter(|mirrored| **mirrored).count();
        let noise = fit.noise(&own).map_or(smoothing.noise, |noise| noise.min(smoothing.noise));
        let independent = noise * f64::from(1_u8 << copies).sqrt();
        let magnet = axes != MapAxes::NoMagnet;
        let (co_energy, surface) = convex(&fit, smoothing.lambda, &own, &grid, magnet);
        let convexity = (co_energy != own).then(|| own.apart(&co_energy, &grid));
        let (distance, furthest) = co_energy.distance(&grid);
        if distance[0] > FARTHEST * grid.largest_flux() {
            let found = format!(
                "that the nearest map with a convex energy is {:.2e} Wb rms away, {:.1} % of the largest flux, most at i_d = {:.4} A, i_q = {:.4} A",
                distance[0],
                100.0 * distance[0] / grid.largest_flux(),
                furthest[0],
                furthest[1]
            );
            let needed = format!(
                "at most {} %: inductances must be positive definite{}",
                100.0 * FARTHEST,
                axes.note()
            );
            return Err(MapError::new(&samples.file, None, found, needed));
        }
        let refusal = |bent: Bent| {
            let (Bent::Energy(current) | Bent::Surface(current)) = bent;
            let (place, cell) = grid.cell(current);
            let (found, needed) = match bent {
                Bent::Energy(_) => (
                    format!(
                        "that the nearest map with an energy, {:.2e} Wb rms away, is not convex in the cell {cell}",
                        distance[0]
                    ),
                    format!(
                        "data that are smoother or closer together there (noise of all: {noise:.2e} Wb rms): inductances must be positive definite"
                    ),
                ),
                Bent::Surface(_) => (
                    format!(
                        "inductances that are positive definite, but that the {0} × {0} cells of the simulated map cannot follow in the cell {cell}",
                        surface::CELLS[1]
                    ),
                    "a smaller range of currents: this is no fault of the data".to_owned(),
                ),
            };
            MapError::new(&samples.file, Some(&format!("near {place}")), found, needed + axes.note())
        };
        let [curl, cross, along] = fit.reciprocity();
        let (map, evaluation_error) = surface.map_err(refusal)?;
        if evaluation_error > OFF * map.reach() {
            let found = format!(
                "that the {0} × {0} cells of the simulated map are off its energy by up to {evaluation_error:.2e} A",
                surface::CELLS[1]
            );
            let needed = format!(
                "at most {} % of the largest current, by a smaller range of currents: this is no fault of the data",
                100.0 * OFF
            );
            return Err(MapError::new(&samples.file, None, found, needed));
        }
        let known = errors::Known { co_energy: &own, factor: &factor, noise: independent, simulated: &map };
        let errors = InductanceErrors::of(&known, &grid);
        let map = map.noted(errors.note());
        let map = map.continued_by(continued.clone());
        let report = MapReport {
            file: samples.file.clone(),
            points: samples.points.len(),
            size: [grid.d.len(), grid.q.len()],
            range: grid.range(),
            axes,
            off_axis: if axes == MapAxes::NoMagnet { 0.0 } else { grid.off_axis() },
            mirrored,
            continued,
            // Below a ten-thousandth of the axes' own inductances it is the last digits of the file.
            reciprocity_error: if cross < 1e-4 * along { 0.0 } else { curl / cross },
            cross_inductance: cross,
            distance,
            largest_flux: grid.largest_flux(),
            furthest,
            noise,
            free: smoothing.free,
            splines: fit.functions(),
            errors,
            convexity,
            evaluation_error,
        };
        Ok((map, report))
    }
}
