//! Conversion of points in any order to a rectangular grid in the rotor's axes, and its checks.

mod axis;

use nalgebra::DMatrix;
use standstill_interface::Dq;
use standstill_numeric::{Symmetric, atan2, sin};

use self::axis::{bracket, distinct, nearest, one_sided};
use super::MapAxes;
use standstill_files::{MapError, MapPoint, MapSamples, Place};
use standstill_quantity::{short, significant};

/// Fluxes over a rectangle of currents; the first index of a matrix is that of i_d.
pub(super) struct Grid {
    pub(super) d: Vec<f64>,
    pub(super) q: Vec<f64>,
    pub(super) psi_d: DMatrix<f64>,
    pub(super) psi_q: DMatrix<f64>,
    places: Vec<Place>,
}

/// Share of the largest flux below which one counts as none: the magnet of a reluctance motor, ψ_q on the d-axis. The one
/// place that decides whether a map has a magnet: see [`crate::FluxMap::has_magnet`].
const NO_FLUX: f64 = 0.02;

/// Smallest number of values of each current from which a map shows saturation.
const LEAST_VALUES: usize = super::spline::LEAST_SITES;
/// Largest number of values of each current in a file.
const MOST_VALUES: usize = 1024;

/// Largest step of an axis over its smallest one. By experiment: at 20 the inductances of a smooth map are within 0.1 %, at
/// 40 within 1 % where noise is added, and at 80 splines through the points swing until nothing is left of them.
const UNEVEN: f64 = 20.0;

/// Largest angle in degrees between a magnet's flux and the axis of its map, about the error of finding that axis. The
/// angle is not corrected, because a rotated rectangle of currents is not a grid; errors of the detected rotor angle
/// include it.
const OFF_AXIS: f64 = 1.0;

/// Share of the largest flux below which a flux off the axis counts as noise: the accuracy of measured maps.
const FLUX_NOISE: f64 = 1e-3;

impl Grid {
    pub(super) fn assemble(samples: &MapSamples) -> Result<(Self, MapAxes, [bool; 2]), MapError> {
        let file = &samples.file;
        let raw = Self::rectangle(file, &samples.points, MOST_VALUES)?;
        raw.check_steps(file)?;
        let axes = raw.axes(file)?;
        let mut points = samples.points.clone();
        if let MapAxes::Turned(quarters) = axes {
            for point in &mut points {
                for _ in 0..quarters {
                    (point.i_d, point.i_q) = (point.i_q, -point.i_d);
                    (point.psi_d, point.psi_q) = (point.psi_q, -point.psi_d);
                }
            }
        }
        let mut mirrored = [false; 2];
        let turned = Self::rectangle(file, &points, MOST_VALUES)?;
        let mut mirror = |axis: &[f64], of: fn(&MapPoint) -> f64, twin: fn(&MapPoint) -> MapPoint| {
            let twins = points.iter().filter(|point| axis[nearest(axis, of(point))] != 0.0).map(twin);
            points = twins.chain(points.iter().cloned()).collect();
        };
        if one_sided(&turned.q) && turned.is_odd_in_q() {
            mirrored[1] = true;
            mirror(&turned.q, |p| p.i_q, |p| MapPoint { i_q: -p.i_q, psi_q: -p.psi_q, ..p.clone() });
        }
        if axes == MapAxes::NoMagnet && one_sided(&turned.d) && turned.is_odd_in_d() {
            mirrored[0] = true;
            mirror(&turned.d, |p| p.i_d, |p| MapPoint { i_d: -p.i_d, psi_d: -p.psi_d, ..p.clone() });
        }
        // What symmetry adds is not the file's.
        let grid = Self::rectangle(file, &points, 2 * MOST_VALUES)?;
        for (name, axis) in [("i_d", &grid.d), ("i_q", &grid.q)] {
            if axis.len() < LEAST_VALUES {
                let found = format!("only {} values of {name}", axis.len());
                let needed = format!(
                    "at least {LEAST_VALUES} of each current, or the saturation cannot be determined"
                );
                return Err(MapError::new(file, None, found, needed));
            }
        }
        Ok((grid, axes, mirrored))
    }

    /// Makes a grid of at most `most` values of each current.
    fn rectangle(file: &str, points: &[MapPoint], most: usize) -> Result<Self, MapError> {
        let (d, q) = (distinct(points.iter().map(|p| p.i_d)), distinct(points.iter().map(|p| p.i_q)));
        for (name, axis) in [("i_d", &d), ("i_q", &q)] {
            if axis.len() < 3 {
                let found = format!("only {} value(s) of {name}", axis.len());
                return Err(MapError::new(file, None, found, "at least 3 of each current".to_owned()));
            }
            if axis[0] > 0.0 || axis[axis.len() - 1] < 0.0 {
                let found = format!("{name} from {} to {} A", short(axis[0]), short(axis[axis.len() - 1]));
                return Err(MapError::new(file, None, found, "a range that contains 0 A".to_owned()));
            }
        }
        // Before anything of that size is made: currents that only nearly repeat make a grid of their square.
        if let Some((name, axis)) = [("i_d", &d), ("i_q", &q)].into_iter().find(|(_, axis)| axis.len() > most)
        {
            let found = format!("{} values of {name} in {} points", axis.len(), points.len());
            let needed = format!(
                "at most {most} of each current, each repeated to 1e-6 of its range: a rectangular grid"
            );
            return Err(MapError::new(file, None, found, needed));
        }
        let mut places: Vec<Option<Place>> = vec![None; d.len() * q.len()];
        let (mut psi_d, mut psi_q) = (DMatrix::zeros(d.len(), q.len()), DMatrix::zeros(d.len(), q.len()));
        for point in points {
            let (a, b) = (nearest(&d, point.i_d), nearest(&q, point.i_q));
            let cell = &mut places[a * q.len() + b];
            if let Some(first) = cell {
                let [i_d, i_q] = [point.i_d, point.i_q].map(short);
                let found = format!("a second point at i_d = {i_d} A, i_q = {i_q} A, after {first}");
                return Err(MapError::new(file, Some(&point.place), found, "each pair of currents once"));
            }
            *cell = Some(point.place.clone());
            (psi_d[(a, b)], psi_q[(a, b)]) = (point.psi_d, point.psi_q);
        }
        let missing = places.iter().filter(|place| place.is_none()).count();
        if let Some(first) = places.iter().position(Option::is_none) {
            let (i_d, i_q) = (short(d[first / q.len()]), short(q[first % q.len()]));
            let found = format!(
                "no point at i_d = {i_d} A, i_q = {i_q} A; {missing} of the {} × {} grid are missing",
                d.len(),
                q.len()
            );
            return Err(MapError::new(file, None, found, "a full rectangle of currents".to_owned()));
        }
        Ok(Self { d, q, psi_d, psi_q, places: places.into_iter().flatten().collect() })
    }

    fn check_steps(&self, file: &str) -> Result<(), MapError> {
        for (name, axis) in [("i_d", &self.d), ("i_q", &self.q)] {
            let step = |pair: &&[f64]| pair[1] - pair[0];
            let by_size = |a: &&[f64], b: &&[f64]| step(a).total_cmp(&step(b));
            let steps = || axis.windows(2);
            let (Some(least), Some(most)) = (steps().min_by(by_size), steps().max_by(by_size)) else {
                continue;
            };
            let ratio = step(&most) / step(&least);
            if ratio > UNEVEN {
                let words = |pair: &[f64]| {
                    let [width, low, high] =
                        [step(&pair), pair[0], pair[1]].map(|current| significant(current, 6));
                    format!("{width} A (from {low} to {high} A)")
                };
                let found =
                    format!("steps of {name} from {} to {}, {ratio:.0} : 1", words(least), words(most));
                let needed = format!(
                    "at most {UNEVEN} : 1, or splines through the points swing: more values within the large step, or fewer around the small one"
                );
                return Err(MapError::new(file, None, found, needed));
            }
        }
        Ok(())
    }

    /// Returns the grid of every second value of either current, with both ends and the value closest to zero; none if
    /// an axis would have fewer values than `least`.
    pub(super) fn every_second(&self, least: usize) -> Option<Self> {
        if self.d.len() < least || self.q.len() < least {
            return None;
        }
        let chosen = |axis: &[f64]| -> Vec<usize> {
            let (zero, last) = (nearest(axis, 0.0), axis.len() - 1);
            (0..=last).filter(|k| k.abs_diff(zero).is_multiple_of(2) || *k == 0 || *k == last).collect()
        };
        let (rows, columns) = (chosen(&self.d), chosen(&self.q));
        let of = |psi: &DMatrix<f64>| {
            DMatrix::from_fn(rows.len(), columns.len(), |a, b| psi[(rows[a], columns[b])])
        };
        Some(Self {
            d: rows.iter().map(|k| self.d[*k]).collect(),
            q: columns.iter().map(|k| self.q[*k]).collect(),
            psi_d: of(&self.psi_d),
            psi_q: of(&self.psi_q),
            places: rows.iter().flat_map(|a| columns.iter().map(|b| self.place(*a, *b).clone())).collect(),
        })
    }

    /// Returns the grid extended by the values `side` of i_d, which are all on one side of the grid. `flux` takes the
    /// indices of i_d in `side` and of i_q.
    pub(super) fn with_side(
        &self,
        side: &[f64],
        flux: impl Fn(usize, usize) -> Dq<f64>,
        place: &Place,
    ) -> Self {
        let mut order: Vec<(f64, Result<usize, usize>)> = self
            .d
            .iter()
            .copied()
            .zip((0..).map(Ok))
            .chain(side.iter().copied().zip((0..).map(Err)))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |a: usize, b: usize| match order[a].1 {
            Ok(own) => Dq::new(self.psi_d[(own, b)], self.psi_q[(own, b)]),
            Err(new) => flux(new, b),
        };
        let places = order.iter().flat_map(|(_, row)| {
            (0..self.q.len()).map(|b| row.map_or_else(|_| place.clone(), |own| self.place(own, b).clone()))
        });
        let size = (order.len(), self.q.len());
        Self {
            d: order.iter().map(|(i_d, _)| *i_d).collect(),
            q: self.q.clone(),
            psi_d: DMatrix::from_fn(size.0, size.1, |a, b| at(a, b).d),
            psi_q: DMatrix::from_fn(size.0, size.1, |a, b| at(a, b).q),
            places: places.collect(),
        }
    }

    /// Returns the flux in Wb without current, between the points next to it.
    fn at_rest(&self) -> Dq<f64> {
        let ((a, x), (b, y)) = (bracket(&self.d), bracket(&self.q));
        let between = |m: &DMatrix<f64>| {
            (1.0 - x) * ((1.0 - y) * m[(a, b)] + y * m[(a, b + 1)])
                + x * ((1.0 - y) * m[(a + 1, b)] + y * m[(a + 1, b + 1)])
        };
        Dq::new(between(&self.psi_d), between(&self.psi_q))
    }

    pub(super) fn largest_flux(&self) -> f64 {
        self.psi_d.amax().max(self.psi_q.amax())
    }

    pub(super) fn range(&self) -> [[f64; 2]; 2] {
        [&self.d, &self.q].map(|axis| [axis[0], axis[axis.len() - 1]])
    }

    /// Returns the angle in degrees from +d to the flux without current.
    pub(super) fn off_axis(&self) -> f64 {
        let rest = self.at_rest();
        atan2(rest.q, rest.d).to_degrees()
    }

    fn axes(&self, file: &str) -> Result<MapAxes, MapError> {
        let rest = self.at_rest();
        if rest.norm() < NO_FLUX * self.largest_flux() {
            return Ok(MapAxes::NoMagnet);
        }
        let angle = atan2(rest.q, rest.d).to_degrees();
        let quarters = (angle / 90.0).round();
        let off = angle - 90.0 * quarters;
        if off.abs() > OFF_AXIS
            && rest.norm() * sin(off.to_radians()).abs() > FLUX_NOISE * self.largest_flux()
        {
            let found = format!("flux without current at {angle:.2}° from d");
            let needed = format!(
                "within {OFF_AXIS}° of +d (magnet axis = d), or of another axis: a map in axes turned by {off:.2}°"
            );
            return Err(MapError::new(file, None, found, needed));
        }
        Ok(match quarters.rem_euclid(4.0) {
            q if q < 0.5 => MapAxes::Magnet,
            q if q < 1.5 => MapAxes::Turned(1),
            q if q < 2.5 => MapAxes::Turned(2),
            _ => MapAxes::Turned(3),
        })
    }

    fn is_odd_in_q(&self) -> bool {
        let zero = nearest(&self.q, 0.0);
        self.psi_q.column(zero).amax() < NO_FLUX * self.psi_q.amax()
    }

    fn is_odd_in_d(&self) -> bool {
        let zero = nearest(&self.d, 0.0);
        self.psi_d.row(zero).amax() < NO_FLUX * self.psi_d.amax()
    }

    fn place(&self, a: usize, b: usize) -> &Place {
        &self.places[a * self.q.len() + b]
    }

    /// Returns the cell of a current in A, for messages: where its nearest corner stands in the file, and its sides.
    pub(super) fn cell(&self, current: Dq<f64>) -> (&Place, String) {
        let sides = |axis: &[f64], i: f64| {
            let after = axis.partition_point(|x| *x <= i).clamp(1, axis.len() - 1);
            [axis[after - 1], axis[after]].map(|current| significant(current, 6))
        };
        let ([d_low, d_high], [q_low, q_high]) = (sides(&self.d, current.d), sides(&self.q, current.q));
        let place = self.place(nearest(&self.d, current.d), nearest(&self.q, current.q));
        (place, format!("i_d = {d_low} to {d_high} A, i_q = {q_low} to {q_high} A"))
    }

    /// Returns whether ψ_d grows with i_q rather than i_d, and ψ_q with i_d.
    fn looks_transposed(&self) -> bool {
        let along_d = |m: &DMatrix<f64>| (m.row(m.nrows() - 1) - m.row(0)).norm() / (m.ncols() as f64).sqrt();
        let along_q =
            |m: &DMatrix<f64>| (m.column(m.ncols() - 1) - m.column(0)).norm() / (m.nrows() as f64).sqrt();
        along_q(&self.psi_d) > 2.0 * along_d(&self.psi_d) && along_d(&self.psi_q) > 2.0 * along_q(&self.psi_q)
    }

    /// Checks that the flux grows with the current along each axis and that inductances are positive definite.
    /// Decreases below 2 % of the largest flux between neighbouring points count as noise, which the projection
    /// removes.
    pub(super) fn check(&self, file: &str, axes: MapAxes) -> Result<(), MapError> {
        let name = |a: usize, b: usize| format!("i_d = {} A, i_q = {} A", short(self.d[a]), short(self.q[b]));
        let error = |a, b, found: String, needed: &str| {
            let hint = if self.looks_transposed() {
                "; psi_d grows with i_q and psi_q with i_d: the fluxes look transposed, or exchanged"
            } else {
                ""
            };
            let needed = format!("{needed}{hint}{}", axes.note());
            Err(MapError::new(file, Some(self.place(a, b)), found, needed))
        };
        let slack = NO_FLUX * self.largest_flux();
        for a in 0..self.d.len() {
            for b in 0..self.q.len() {
                let before_d = (a.saturating_sub(1), b);
                let before_q = (a, b.saturating_sub(1));
                for (axis, psi, before) in [("d", &self.psi_d, before_d), ("q", &self.psi_q, before_q)] {
                    if before != (a, b) && psi[(a, b)] <= psi[before] - slack {
                        let [now, then] = [psi[(a, b)], psi[before]].map(short);
                        let (here, there) = (name(a, b), name(before.0, before.1));
                        let found = format!("psi_{axis} = {now} Wb at {here}, after {then} Wb at {there}");
                        let needed = format!("more flux along {axis} with more current along {axis}");
                        return error(a, b, found, &needed);
                    }
                }
            }
        }
        for a in 0..self.d.len() - 1 {
            for b in 0..self.q.len() - 1 {
                let l = self.inductance(a, b);
                let side = (self.d[a + 1] - self.d[a]).min(self.q[b + 1] - self.q[b]);
                if !l.is_positive_definite() && l.smaller_eigenvalue() * side < -slack {
                    let found = format!(
                        "inductances L_dd = {:.4e}, L_dq = {:.4e}, L_qq = {:.4e} H beside {}, not convex",
                        l.xx,
                        l.xy,
                        l.yy,
                        name(a, b)
                    );
                    return error(a, b, found, "a positive definite inductance matrix");
                }
            }
        }
        Ok(())
    }

    /// Returns the incremental inductances in H of the cell that begins at (a, b).
    fn inductance(&self, a: usize, b: usize) -> Symmetric {
        let along_d = |m: &DMatrix<f64>| {
            (m[(a + 1, b)] - m[(a, b)] + m[(a + 1, b + 1)] - m[(a, b + 1)])
                / 2.0
                / (self.d[a + 1] - self.d[a])
        };
        let along_q = |m: &DMatrix<f64>| {
            (m[(a, b + 1)] - m[(a, b)] + m[(a + 1, b + 1)] - m[(a + 1, b)])
                / 2.0
                / (self.q[b + 1] - self.q[b])
        };
        let cross = (along_q(&self.psi_d) + along_d(&self.psi_q)) / 2.0;
        Symmetric::new(along_d(&self.psi_d), cross, along_q(&self.psi_q))
    }
}
