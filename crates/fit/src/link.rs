//! How far the DC link moves while legs drive, of which each piece's mean is simulated.

use standstill_numeric::beta;

use super::pieces::{Piece, drives};

/// Swing of the DC link's voltage within a pulse or a train of pulses, whose mean is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Index of the record, in the order in which the records were given.
    pub record: usize,
    /// Lowest and highest voltage in V while legs drive, by straight lines through the readings; the mean of all readings twice without a spread.
    pub ends: [f64; 2],
    /// Half of a straight sag in each pulse, as a share of the mean: √3 times the rms deviation of straight lines through the readings of
    /// each pulse from the mean, without the part of the readings' noise. Zero if noise that is independent from row to row explains the lines, or if too few readings show how large it is.
    pub spread: f64,
    /// Number of changes of the legs to requests that drive: 1 for a single pulse.
    pub pulses: usize,
}

/// Share of all fits with a stiff link of which noise is taken for a swing.
const FALSE_SWINGS: f64 = 1e-3;

/// Number of lines through a long pulse, so that a link that dips and recovers is no steady one, and the least number of rows of each.
const LINES: usize = 4;
const ROWS: usize = 8;

/// Number of rows from which on a pulse has lines of its own. Of shorter pulses the first rows of all have one, and so have the second ones.
const OWN_LINE: usize = 3;

/// Share of its mean above which a link that moves is named in an answer: below it, the link has moved the resistance by less than that share.
const NOTED: f64 = 0.02;

/// Share of its mean above which a link that moves asks for other records.
const SOFT: f64 = 0.05;

/// Share of its mean above which a link may be why more than half of the currents are left: a swing leaves about its own share of them, other
/// errors the rest.
const MAY_LEAVE_HALF: f64 = 0.3;

impl Swing {
    /// Returns the largest swing in these pieces; none without a row in which legs drive.
    pub(super) fn largest(pieces: &[Piece]) -> Option<Self> {
        let swings = pieces.iter().filter_map(|piece| Self::of(piece, FALSE_SWINGS / pieces.len() as f64));
        swings.max_by(|a, b| a.spread.total_cmp(&b.spread))
    }

    /// `chance`: probability with which noise makes a swing.
    fn of(piece: &Piece, chance: f64) -> Option<Self> {
        let pulses = piece.rows.chunk_by(|a, b| a.legs == b.legs).filter(|pulse| drives(pulse[0].legs));
        let (mut own, mut short) = (Vec::new(), [const { Vec::new() }; OWN_LINE - 1]);
        for pulse in pulses {
            let links: Vec<f64> = pulse.iter().map(|row| row.link).collect();
            if links.len() < OWN_LINE {
                short.iter_mut().zip(links).for_each(|(place, link)| place.push(link));
            } else {
                own.extend(links.chunks(links.len().div_ceil(LINES).max(ROWS)).map(<[f64]>::to_vec));
            }
        }
        own.extend(short.into_iter().filter(|place| !place.is_empty()));
        let all: Vec<f64> = own.iter().flatten().copied().collect();
        if all.is_empty() {
            return None;
        }
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let lines: Vec<Line> = own.iter().map(|links| Line::through(links, mean)).collect();
        let spread = (3.0 * mean_square_of_motion(&lines, chance)).sqrt() / mean;
        let pulses = piece.edges.iter().filter(|edge| drives(edge.legs)).count();
        let ends = lines.iter().filter(|_| spread > 0.0).flat_map(|line| line.ends);
        let ends = ends.fold([mean; 2], |[low, high], end| [low.min(end), high.max(end)]);
        Some(Self { record: piece.record, ends, spread, pulses })
    }

    /// Returns true if the link moves so far within a pulse or train that an answer names it: by more than 2 % of its mean.
    pub fn is_noted(&self) -> bool {
        self.spread > NOTED
    }

    /// Returns true if the link moves so far within a pulse or train that its mean is not enough: by more than 5 % of it.
    pub fn is_soft(&self) -> bool {
        self.spread > SOFT
    }

    /// Returns true if the link moves so far that it may be why a simulation with its mean leaves half of the currents.
    pub(super) fn may_leave_half(&self) -> bool {
        self.spread > MAY_LEAVE_HALF
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

/// Straight line through readings at equal distances, by least squares; through one or two of them exactly.
struct Line {
    count: f64,
    /// Its values in V at the first and at the last reading.
    ends: [f64; 2],
    /// Number of its parameters.
    parameters: usize,
    /// Sum of the squares of its deviations from the mean of all lines' readings, at the readings.
    moved: f64,
    /// Sum of the squares of the readings' deviations from it.
    left: f64,
}

impl Line {
    /// `mean`: of the readings of all lines.
    fn through(links: &[f64], mean: f64) -> Self {
        let count = links.len() as f64;
        let level = links.iter().sum::<f64>() / count;
        let places = || (0..links.len()).map(|k| k as f64 - (count - 1.0) / 2.0);
        let squares = places().map(|k| k * k).sum::<f64>();
        let product = places().zip(links).map(|(k, u)| k * (u - level)).sum::<f64>();
        let slope = if links.len() > 1 { product / squares } else { 0.0 };
        let off = |(k, u): (f64, &f64)| u - level - slope * k;
        Self {
            count,
            ends: [-0.5, 0.5].map(|side| level + side * slope * (count - 1.0)),
            parameters: links.len().min(2),
            moved: count * (level - mean) * (level - mean) + slope * slope * squares,
            left: places().zip(links).map(off).map(|off| off * off).sum(),
        }
    }
}

/// Returns the mean square of these lines' deviations from the mean, without the part of the readings' noise; zero if noise makes such lines more
/// often than `chance`, by the F test of the lines against one mean.
fn mean_square_of_motion(lines: &[Line], chance: f64) -> f64 {
    let parameters: usize = lines.iter().map(|line| line.parameters).sum();
    let count = lines.iter().map(|line| line.count).sum::<f64>();
    let [others, freedom] = [parameters as f64 - 1.0, count - parameters as f64];
    let moved = lines.iter().map(|line| line.moved).sum::<f64>();
    if others == 0.0 || freedom == 0.0 || moved == 0.0 {
        return 0.0;
    }
    let noise = lines.iter().map(|line| line.left).sum::<f64>() / freedom;
    // P(F > moved/others/noise) (Abramowitz and Stegun, 26.6.2).
    let by_noise = beta(freedom / 2.0, others / 2.0, freedom * noise / (freedom * noise + moved));
    if by_noise < chance { (moved - others * noise).max(0.0) / count } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, Normal};

    use super::super::FitError;
    use super::super::pieces::{pieces, tests::record};
    use super::super::record::{Record, Request, Row};
    use super::*;

    /// The two pulses of 40 and of 100 rows with a link that has this voltage in each row.
    fn swing(link: impl Fn(usize) -> f64) -> Swing {
        let mut record = record(Request::Off, |_| 0.0);
        for (k, row) in record.rows.iter_mut().enumerate() {
            row.link = link(k);
        }
        Swing::largest(&pieces(0, &record)).expect("pieces")
    }

    /// Twelve volts that sag to nine in the second pulse alone, which is named; rows in which no leg drives do not count.
    #[test]
    fn analytic_the_largest_swing_of_the_link_is_that_while_legs_drive() {
        let sagging = |k: usize| match k {
            0..20 => 20.0,
            200.. => 12.0 - 3.0 * (k - 200) as f64 / 99.0,
            _ => 12.0,
        };
        let found = swing(sagging);
        // Of 100 rows the rms deviation times √3 is √(101/99) times half of the difference between the first and the last row.
        assert!(found.ends.iter().zip([9.0, 12.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
        assert!(
            (found.spread - 1.5 / 10.5 * (101.0_f64 / 99.0).sqrt()).abs() < 1e-9 && found.is_soft(),
            "{found:?}"
        );
        // Named beside an error that it may explain, and beside no other.
        let rows = record(Request::Off, |_| 0.0);
        let records = [Record { file: "soft.csv".to_owned(), ..rows }];
        let said = FitError::NoPlant.beside(Some(found), &records).to_string();
        assert!(said.contains("soft.csv moves between 9.0 and 12.0 V while legs drive"), "{said}");
        assert!(said.ends_with("record shorter pulses, or with more capacitance at the bridge"), "{said}");
        assert_eq!(FitError::NoCurrent.beside(Some(found), &records), FitError::NoCurrent);
        let far_off = FitError::FarOff { share: 0.6, file: "soft.csv".to_owned(), time: 0.0 };
        for (error, limit) in [(FitError::NoPlant, 0.05), (FitError::NoResistance, 0.05), (far_off, 0.3)] {
            let named =
                |spread: f64| error.clone().beside(Some(Swing { spread, ..found }), &records) != error;
            assert!(!named(limit - 1e-3) && named(limit + 1e-3), "{error}");
        }
        assert!(!Swing { spread: 0.019, ..found }.is_noted() && Swing { spread: 0.021, ..found }.is_noted());
        // A link that never moves has no spread. A link that dips and recovers has one.
        assert_eq!(swing(|_| 12.0).spread, 0.0);
        let dip = swing(|k| 12.0 - 2.4 * (1.0 - (k as f64 - 249.5).abs() / 50.0).max(0.0));
        assert!(dip.is_soft() && (dip.ends[0] - 9.6).abs() < 0.1, "{dip:?}");
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

    /// Pulses of so many rows each, in a train, with a link that has this voltage in the row `k` of the pulse `n`.
    fn train(pulses: usize, rows: usize, mut link: impl FnMut(usize, usize) -> f64) -> Piece {
        let record = record(Request::Off, |_| 0.0);
        let first = record.rows.iter().position(|row| drives(row.legs)).expect("a pulse");
        let mut piece = pieces(0, &record).swap_remove(0);
        piece.rows = (0..pulses)
            .flat_map(|n| (0..=rows).map(move |k| (n, k)))
            .map(|(n, k)| match k.checked_sub(1) {
                None => Row { link: 20.0, ..record.rows[0] },
                Some(k) => Row { link: link(n, k), ..record.rows[first] },
            })
            .collect();
        piece
    }

    /// Noise of 4 % makes a swing in one fit of a thousand, however many pulses of however few rows it has, alone or among other pieces.
    #[test]
    fn law_noise_of_the_link_is_no_swing() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let normal = Normal::new(12.0, 0.48).expect("valid");
        for (pieces, pulses, rows) in
            [(1, 1, 3), (1, 1, 16), (1, 30, 2), (1, 30, 3), (1, 30, 16), (1, 1, 100), (30, 1, 16)]
        {
            let swings = (0..1000).filter(|_| {
                let noisy: Vec<Piece> =
                    (0..pieces).map(|_| train(pulses, rows, |_, _| normal.sample(&mut random))).collect();
                Swing::largest(&noisy).expect("pulses").spread > 0.0
            });
            // Six or more of one that is expected: in one case of 1,700.
            assert!(swings.count() < 6, "{pieces} pieces of {pulses} pulses of {rows} rows");
        }
    }

    /// A link sags straight by a tenth, with noise of 4 %: in one pulse, or in each pulse of a train of few rows each. The spread is √3 times the rms
    /// deviation. Of n rows that is √((n + 1)/(n − 1)) times half of the difference between the first and the last row.
    #[test]
    fn law_a_sag_below_noise_has_its_size() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let normal = Normal::new(0.0, 0.48).expect("valid");
        for (pulses, rows) in [(1, 300_u32), (30, 10), (300, 2)] {
            let spreads = (0..200).map(|_| {
                let sag = |k: usize| 1.2 * k as f64 / f64::from(rows - 1);
                let sagging = train(pulses, rows as usize, |_, k| 12.0 - sag(k) + normal.sample(&mut random));
                Swing::of(&sagging, FALSE_SWINGS).expect("pulses").spread
            });
            let mean = spreads.sum::<f64>() / 200.0;
            let expected = 0.6 / 11.4 * (f64::from(rows + 1) / f64::from(rows - 1)).sqrt();
            assert!((mean / expected - 1.0).abs() < 0.03, "{pulses} {rows}: {mean} for {expected}");
        }
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
        assert_eq!((found.spread, found.ends), (0.0, [12.0; 2]));
        piece.rows.retain(|row| !drives(row.legs));
        assert_eq!(Swing::largest(&[piece]), None);
    }
}
