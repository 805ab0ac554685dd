//! How far the DC link moves while legs drive, of which each piece's mean is simulated.

use super::pieces::{Piece, drives};
use super::record::Row;

/// Swing of the DC link's voltage within a pulse or a train of pulses, whose mean is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Index of the record, in the order in which the records were given.
    pub record: usize,
    /// Lowest and highest voltage in V while legs drive: means over an eighth of a pulse. Both are the mean of all readings if these means
    /// do not differ significantly, or if no part has two readings, which show how large the noise is.
    pub ends: [f64; 2],
    /// Largest deviation of these means from the mean of all, as a share of it.
    pub spread: f64,
    /// Number of changes of the legs to requests that drive: 1 for a single pulse.
    pub pulses: usize,
}

/// Number of parts of a pulse whose means are taken: of a straight sag they show seven eighths, of one in few rows less (two thirds of 4 rows).
const PARTS: usize = 8;

/// Largest excess of the parts' sum of squares over the one expected from their noise, in standard deviations.
const STEADY: f64 = 3.0;

/// Share of its mean above which a link that moves asks for other records.
const SOFT: f64 = 0.05;

impl Swing {
    /// Returns the largest swing in these pieces; none without a row in which legs drive.
    pub(super) fn largest(pieces: &[Piece]) -> Option<Self> {
        pieces.iter().filter_map(Self::of).max_by(|a, b| a.spread.total_cmp(&b.spread))
    }

    fn of(piece: &Piece) -> Option<Self> {
        let (mut all, mut parts) = (Vec::new(), Vec::new());
        for pulse in piece.rows.chunk_by(|a, b| drives(a.legs) == drives(b.legs)) {
            if drives(pulse[0].legs) {
                let links: Vec<f64> = pulse.iter().map(|row: &Row| row.link).collect();
                parts.extend(links.chunks(links.len().div_ceil(PARTS).max(2)).map(Part::of));
                all.extend(links);
            }
        }
        if all.is_empty() {
            return None;
        }
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        // The noise of one reading, by what is left within parts: not a number, and no swing, if each part has one reading.
        let noise = parts.iter().map(|part| part.squares).sum::<f64>() / (all.len() - parts.len()) as f64;
        let squares: f64 =
            parts.iter().map(|part| part.count * (part.mean - mean) * (part.mean - mean)).sum();
        let others = parts.len() as f64 - 1.0;
        let ends = if squares > noise * (others + STEADY * (2.0 * others).sqrt()) {
            let means = parts.iter().map(|part| part.mean);
            means.fold([mean; 2], |[low, high], mean| [low.min(mean), high.max(mean)])
        } else {
            [mean; 2]
        };
        let pulses = piece.edges.iter().filter(|edge| drives(edge.legs)).count();
        Some(Self { record: piece.record, ends, spread: (ends[1] - mean).max(mean - ends[0]) / mean, pulses })
    }

    /// Returns true if the link moves so far within a pulse or train that its mean is not enough: by more than 5 % of it.
    pub fn is_soft(&self) -> bool {
        self.spread > SOFT
    }

    /// Returns which records have a steadier link.
    pub const fn steadier(&self) -> &'static str {
        if self.pulses > 1 {
            "record one pulse per file, from rest until its current is gone (each file then has a mean link voltage of its own), or with more \
             capacitance at the bridge"
        } else {
            "record shorter pulses, or with more capacitance at the bridge"
        }
    }
}

/// Readings of a part of a pulse.
struct Part {
    count: f64,
    mean: f64,
    /// Sum of the squares of the readings' deviations from the mean.
    squares: f64,
}

impl Part {
    fn of(links: &[f64]) -> Self {
        let count = links.len() as f64;
        let mean = links.iter().sum::<f64>() / count;
        Self { count, mean, squares: links.iter().map(|u| (u - mean) * (u - mean)).sum() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::FitError;
    use super::super::pieces::{pieces, tests::record};
    use super::super::record::{Record, Request};
    use super::*;

    /// The two pulses of 40 and of 100 rows with a link that has this voltage in each row.
    fn swing(link: impl Fn(usize) -> f64) -> Swing {
        let mut record = record(Request::Off, |_| 0.0);
        for (k, row) in record.rows.iter_mut().enumerate() {
            row.link = link(k);
        }
        Swing::largest(&pieces(0, &record)).expect("pieces")
    }

    /// Twelve volts that sag to nine in the second pulse alone, which is named; rows in which no leg drives do not count. The first of eight
    /// parts, of 13 of 100 rows, has a mean of 6 of 99 of the sag, the last, of 9 rows, one of 95 of 99.
    #[test]
    fn analytic_the_largest_swing_of_the_link_is_that_while_legs_drive() {
        let sagging = |k: usize| match k {
            0..20 => 20.0,
            200.. => 12.0 - 3.0 * (k - 200) as f64 / 99.0,
            _ => 12.0,
        };
        let found = swing(sagging);
        let ends = [12.0 - 3.0 * 95.0 / 99.0, 12.0 - 3.0 * 6.0 / 99.0];
        assert!(found.ends.iter().zip(ends).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        assert!((found.spread - (10.5 - ends[0]) / 10.5).abs() < 1e-9 && found.is_soft(), "{found:?}");
        // Named beside an error that it may explain, and beside no other.
        let rows = record(Request::Off, |_| 0.0);
        let records = [Record { file: "soft.csv".to_owned(), ..rows }];
        let said = FitError::NoPlant.beside(Some(found), &records).to_string();
        assert!(said.contains("soft.csv moves between 9.1 and 11.8 V while legs drive"), "{said}");
        assert!(said.ends_with("record shorter pulses, or with more capacitance at the bridge"), "{said}");
        assert_eq!(FitError::NoCurrent.beside(Some(found), &records), FitError::NoCurrent);
        let stiff = Swing { spread: 0.02, ..found };
        assert_eq!(FitError::NoPlant.beside(Some(stiff), &records), FitError::NoPlant);
        let train = Swing { pulses: 2, ..found };
        let said = FitError::NoResistance.beside(Some(train), &records).to_string();
        assert!(said.contains("record one pulse per file, from rest"), "{said}");
        // Shorter pulses steady the link, but show no resistance.
        let said = FitError::NoResistance.beside(Some(found), &records).to_string();
        assert!(said.ends_with("record with more capacitance at the bridge"), "{said}");
        assert!(!said.contains("pulses so long") && !said.contains("shorter"), "{said}");
        // A swing of a record that is not among these is left out.
        assert_eq!(FitError::NoPlant.beside(Some(found), &[]), FitError::NoPlant);
    }

    /// Readings up and down by a tenth of the voltage are no swing; on a sag of a tenth they are.
    #[test]
    fn regress_noise_of_the_link_is_no_swing() {
        let noise = |k: usize| 1.2 * [1.0, -0.6, 0.3, -1.0, 0.8, -0.4, 0.1, -0.9, 0.7][(k * k + k / 7) % 9];
        let noisy = swing(|k| 12.0 + noise(k));
        assert!(noisy.spread < 1e-9 && (noisy.ends[0] - 12.0).abs() < 0.3, "{noisy:?}");
        let sagging = swing(|k| 12.0 + noise(k) - if k < 200 { 0.0 } else { 1.2 * (k - 200) as f64 / 99.0 });
        assert!((0.03..0.12).contains(&sagging.spread), "{sagging:?}");
        assert_eq!(swing(|_| 12.0).spread, 0.0);
    }

    /// Pulses with one row each show no noise, so no swing, but they have a mean; without a row in which legs drive there is none.
    #[test]
    fn regress_pulses_of_one_row_have_the_mean_of_their_link() {
        let rows = record(Request::Off, |_| 0.0).rows;
        let first = rows.iter().position(|row| drives(row.legs)).expect("a pulse");
        let mut piece = pieces(0, &record(Request::Off, |_| 0.0)).swap_remove(0);
        let row = |k: usize, link: f64| Row { link, ..rows[k] };
        piece.rows = vec![row(0, 20.0), row(first, 11.0), row(0, 20.0), row(first, 13.0)];
        let found = Swing::largest(std::slice::from_ref(&piece)).expect("a swing");
        assert_eq!((found.ends, found.spread), ([12.0; 2], 0.0));
        piece.rows.retain(|row| !drives(row.legs));
        assert_eq!(Swing::largest(&[piece]), None);
    }
}
