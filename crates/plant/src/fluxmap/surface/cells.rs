//! Cells along one axis of a surface, and the B-splines of degree 5 on them.
//!
//! Cells are narrow where the energy bends and wide elsewhere. A saturating core goes from one inductance to another
//! within a hundredth of its flux; equal cells would have to be that narrow everywhere.

use standstill_numeric::whole;

/// Functions that differ from zero in a cell.
pub(super) const WIDTH: usize = 6;

const DEGREE: usize = WIDTH - 1;

/// Approximate smallest width of a cell, as a share of the width of equal cells.
const NARROWEST: f64 = 1.0 / 32.0;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    start: f64,
    end: f64,
    /// Reciprocal of the width, in 1/Wb.
    per_width: f64,
}

/// Functions of a cell as polynomials in the place t within it, 0 to 1: coefficients of each power, of each function.
pub(super) type Powers = [[f64; WIDTH]; WIDTH];

/// A place on an axis.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// The cell, and the first function that differs from zero there.
    pub(super) cell: usize,
    /// The place in it, 0 to 1.
    pub(super) t: f64,
    /// Slope of t over the flux, in 1/Wb.
    pub(super) per_width: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cells {
    /// The ends of cells, and [`DEGREE`] more beyond either end.
    knots: Vec<f64>,
    spans: Vec<Cell>,
    /// Polynomials of the functions within each cell.
    powers: Vec<Powers>,
    /// The axis in equal parts, none wider than a cell: the cell in which each begins.
    parts: Vec<u16>,
    low: f64,
    high: f64,
    parts_per_flux: f64,
}

impl Cells {
    /// Makes `count` cells over fluxes from `low` to `high` in Wb, with one extra cell on either side. `density`:
    /// density of cells in equal parts of the range.
    pub(super) fn new([low, high]: [f64; 2], density: &[f64], count: usize) -> Self {
        let equal = (high - low) / density.len() as f64;
        let inner = count - 2;
        let whole: f64 = density.iter().sum();
        let most = whole / density.len() as f64 / NARROWEST;
        let density: Vec<f64> = density.iter().map(|one| one.min(most)).collect();
        let share = density.iter().sum::<f64>() / inner as f64;
        let mut ends = vec![low];
        let mut sum = 0.0;
        for (part, one) in density.iter().enumerate() {
            while ends.len() < inner && sum + one > share * ends.len() as f64 {
                let within = (share * ends.len() as f64 - sum) / one;
                ends.push(low + equal * (part as f64 + within));
            }
            sum += one;
        }
        ends.push(high);
        let (first, last) = (ends[1] - ends[0], high - ends[ends.len() - 2]);
        let before = (1..=WIDTH).rev().map(|k| low - first * k as f64);
        let after = (1..=WIDTH).map(|k| high + last * k as f64);
        let knots: Vec<f64> = before.chain(ends).chain(after).collect();
        let (cells, powers): (Vec<Cell>, Vec<Powers>) = (DEGREE..DEGREE + count)
            .map(|k| {
                let (start, end) = (knots[k], knots[k + 1]);
                (Cell { start, end, per_width: 1.0 / (end - start) }, powers(&knots, k))
            })
            .unzip();
        let narrowest = cells.iter().map(|cell| cell.end - cell.start).fold(f64::INFINITY, f64::min);
        let (low, high) = (cells[0].start, cells[count - 1].end);
        // Rounding must not make a part wider than a cell.
        let parts_per_flux = 1.01 / narrowest;
        let begins = |part: usize| low + part as f64 / parts_per_flux;
        let mut at = 0;
        let mut parts = Vec::new();
        while begins(parts.len()) < high {
            while at + 1 < count && begins(parts.len()) >= cells[at].end {
                at += 1;
            }
            // At most some hundreds.
            #[allow(clippy::cast_possible_truncation)]
            parts.push(at as u16);
        }
        Self { knots, spans: cells, powers, parts, low, high, parts_per_flux }
    }

    /// Returns the number of cells.
    pub(super) fn count(&self) -> usize {
        self.spans.len()
    }

    /// Returns the number of spline functions.
    pub(super) fn functions(&self) -> usize {
        self.spans.len() + DEGREE
    }

    /// Returns the nearest flux that a cell contains.
    #[inline]
    pub(super) fn inside(&self, flux: f64) -> f64 {
        flux.clamp(self.low, self.high)
    }

    /// Finds the cell of a flux within the range, and the place in it.
    #[inline]
    pub(super) fn find(&self, flux: f64) -> Spot {
        // Never negative, and not beyond the last part.
        let part = whole::<usize>((flux - self.low) * self.parts_per_flux).min(self.parts.len() - 1);
        let begins = usize::from(self.parts[part]);
        let cell = (begins + usize::from(flux >= self.spans[begins].end)).min(self.spans.len() - 1);
        let Cell { start, per_width, .. } = self.spans[cell];
        Spot { cell, t: (flux - start) * per_width, per_width }
    }

    /// Returns the functions of a cell.
    pub(super) fn powers(&self, cell: usize) -> &Powers {
        &self.powers[cell]
    }

    /// Returns the values and first derivatives over the flux of the functions at a place.
    pub(super) fn weights(&self, Spot { cell, t, per_width }: Spot) -> [[f64; WIDTH]; 2] {
        let (mut value, mut slope) = ([0.0; WIDTH], [0.0; WIDTH]);
        for powers in self.powers[cell].iter().rev() {
            for k in 0..WIDTH {
                slope[k] = slope[k] * t + value[k];
                value[k] = value[k] * t + powers[k];
            }
        }
        [value, slope.map(|slope| slope * per_width)]
    }

    /// Returns the weights that make the third derivative of coefficients `first` to `first + 3`, times the third
    /// power of a cell's width.
    pub(super) fn third_derivative(&self, first: usize) -> [f64; 4] {
        let mut factors = [[0.0; 4]; 4];
        for (k, factors) in factors.iter_mut().enumerate() {
            factors[k] = 1.0;
        }
        // Coefficient k of a function of degree p has the knots from k on.
        for order in 1..=3 {
            for k in (order..4).rev() {
                let i = first + k;
                let width = (self.knots[i + WIDTH - order] - self.knots[i]) / (WIDTH - order) as f64;
                let (before, own) = (factors[k - 1], factors[k]);
                factors[k] = std::array::from_fn(|m| (own[m] - before[m]) / width);
            }
        }
        let width = (self.knots[first + WIDTH] - self.knots[first + 3]) / 3.0;
        factors[3].map(|factor| factor * width * width * width)
    }

    /// Returns the mean width of a cell in Wb.
    pub(super) fn width(&self) -> f64 {
        (self.high - self.low) / self.spans.len() as f64
    }
}

/// Returns the functions between knots k and k + 1, by the recursion of Cox and de Boor.
fn powers(knots: &[f64], k: usize) -> Powers {
    let (start, width) = (knots[k], knots[k + 1] - knots[k]);
    // Functions of a degree in the order of their knots, the last one begins at knot k.
    let mut functions = vec![[0.0; WIDTH]];
    functions[0][0] = 1.0;
    for degree in 1..=DEGREE {
        let mut next = vec![[0.0; WIDTH]; degree + 1];
        for (m, lower) in functions.iter().enumerate() {
            // It begins at this knot and adds to function m with a falling factor, to m + 1 with a rising one.
            let i = k + 1 + m - degree;
            let support = knots[i + degree] - knots[i];
            let (at, rise) = ((start - knots[i]) / support, width / support);
            for power in 0..degree {
                next[m + 1][power] += at * lower[power];
                next[m + 1][power + 1] += rise * lower[power];
                next[m][power] += (1.0 - at) * lower[power];
                next[m][power + 1] -= rise * lower[power];
            }
        }
        functions = next;
    }
    std::array::from_fn(|power| std::array::from_fn(|function| functions[function][power]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven() -> Cells {
        let density: Vec<f64> =
            (0..200).map(|k| 1.0 + 30.0 / (1.0 + f64::from((k - 60) * (k - 60)))).collect();
        Cells::new([-0.3, 0.9], &density, 24)
    }

    #[test]
    fn analytic_functions_sum_to_one_and_their_derivatives_are_those_of_polynomials() {
        let cells = uneven();
        assert_eq!(cells.functions(), 29);
        let widths = || cells.spans.iter().map(|cell| cell.end - cell.start);
        let (least, most) = (widths().fold(f64::INFINITY, f64::min), widths().fold(0.0, f64::max));
        assert!(least < 0.3 * most, "{least} {most}");
        // Blossoms: coefficients of x² are the symmetric sums of the knots within a function.
        let square = |i: usize| {
            let knots = &cells.knots[i + 1..i + 1 + DEGREE];
            let pairs = (0..DEGREE).flat_map(|a| (0..a).map(move |b| knots[a] * knots[b]));
            pairs.sum::<f64>() / 10.0
        };
        for step in 0..=1000 {
            let x = cells.low + (cells.high - cells.low) * f64::from(step) / 1000.0;
            let spot = cells.find(cells.inside(x));
            let weights = cells.weights(spot);
            let sum = |order: usize, of: &dyn Fn(usize) -> f64| -> f64 {
                (0..WIDTH).map(|k| weights[order][k] * of(spot.cell + k)).sum()
            };
            assert!((sum(0, &|_| 1.0) - 1.0).abs() < 1e-14, "{x}");
            assert!((sum(0, &square) - x * x).abs() < 1e-13, "{x}");
            assert!((sum(1, &square) - 2.0 * x).abs() < 1e-11, "{x}");
            assert!(weights[0].iter().all(|weight| *weight > -1e-16), "{x}");
        }
        // A polynomial of degree 2 has no third derivative.
        for first in 0..cells.functions() - 3 {
            let third = cells.third_derivative(first);
            let sum: f64 = (0..4).map(|k| third[k] * square(first + k)).sum();
            assert!(sum.abs() < 1e-14, "{first}: {sum}");
        }
    }

    #[test]
    fn law_every_flux_is_in_the_cell_that_is_found_for_it() {
        let cells = uneven();
        let mut fluxes: Vec<f64> = cells.spans.iter().flat_map(|cell| [cell.start, cell.end]).collect();
        fluxes.extend((0..10_000).map(|k| cells.low + (cells.high - cells.low) * f64::from(k) / 9_999.0));
        for flux in fluxes {
            let cell = &cells.spans[cells.find(cells.inside(flux)).cell];
            assert!(cell.start <= flux + 1e-15 && flux <= cell.end + 1e-15, "{flux}");
        }
    }
}
