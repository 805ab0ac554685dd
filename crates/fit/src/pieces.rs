//! Cuts a record into pieces that begin at rest, so that each can be simulated by itself.

use super::record::{CHANNELS, Record, Request, Row};

/// An edge: a change of the legs' requests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Time in s of the record: in the middle between the last row before and the first row after the edge, which was anywhere
    /// between them.
    pub at: f64,
    /// Standard deviation of the time in s.
    pub deviation: f64,
    /// Requests of the legs from the edge on.
    pub legs: [Request; 3],
}

/// Rows of a record that begin at rest.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Rows of the piece in order of time.
    pub rows: Vec<Row>,
    /// Edges (changes of the legs' requests) in order of time; the first one begins at rest.
    pub edges: Vec<Edge>,
    /// Requests of the legs at the first row.
    pub first: [Request; 3],
    /// Mean voltage of the DC link in V while a leg is high and another low.
    pub link: f64,
    /// Index of the piece's record.
    pub record: usize,
    /// Angle in rad by which the rotor stands further than in the first record.
    pub turn: f64,
}

impl Piece {
    /// Keeps the first and the last row and each row whose number is a multiple of `every`. The edges were found from all rows
    /// before.
    pub fn thin(&mut self, every: usize) {
        let last = self.rows.len() - 1;
        let mut number = 0..=last;
        self.rows.retain(|_| number.next().is_some_and(|k| k % every == 0 || k == last));
    }

    /// Returns the edge that begins the first pulse, and the last row before that pulse ends.
    pub fn first_pulse(&self) -> Option<(&Edge, &Row)> {
        let from = self.edges.iter().position(|edge| drives(edge.legs))?;
        let edge = &self.edges[from];
        let end = self.edges.get(from + 1).map_or(f64::INFINITY, |next| next.at);
        let is_read = |row: &&Row| row.current.iter().any(|i| i.is_finite());
        let row = self.rows.iter().rev().filter(is_read).find(|row| row.time > edge.at && row.time < end)?;
        Some((edge, row))
    }
}

/// Returns the longest time in s between two edges while the link's voltage is across the motor; zero without such a pulse that ends.
pub fn longest_pulse(pieces: &[Piece]) -> f64 {
    let pairs = pieces.iter().flat_map(|piece| piece.edges.windows(2)).filter(|pair| drives(pair[0].legs));
    pairs.map(|pair| pair[1].at - pair[0].at).fold(0.0, f64::max)
}

/// Returns true if these requests put the link's voltage across the motor.
pub fn drives(legs: [Request; 3]) -> bool {
    legs.contains(&Request::High) && legs.contains(&Request::Low)
}

/// Statistics of a channel's readings while no current flows.
#[derive(Clone, Copy)]
pub struct Rest {
    /// Mean reading in A.
    pub mean: f64,
    /// Standard deviation of a single reading in A.
    pub noise: f64,
    /// Number of readings.
    pub count: f64,
    /// Largest deviation of a reading from the mean, in A.
    reach: f64,
}

/// Returns statistics of each channel's readings at rest, from the rows before the first pulse.
pub fn resting(record: &Record) -> [Rest; CHANNELS] {
    let before = record.rows.iter().position(|row| drives(row.legs)).unwrap_or(1).max(1);
    std::array::from_fn(|k| {
        let rest = || record.rows[..before].iter().map(|row| row.current[k]).filter(|i| !i.is_nan());
        let count = rest().count() as f64;
        let mean = rest().sum::<f64>() / count;
        let noise = (rest().map(|i| (i - mean) * (i - mean)).sum::<f64>() / count).sqrt();
        let off = record.rows.iter().map(|row| (row.current[k] - mean).abs());
        Rest { mean, noise, count, reach: off.filter(|x| x.is_finite()).fold(0.0, f64::max) }
    })
}

/// Least number of rows without visible current before a record is cut.
const LEAST_STILL: usize = 8;

/// Largest current that a reading at rest may have, as a share of the largest current.
const STILL_SHARE: f64 = 0.02;

/// Largest current that the mean of many readings at rest may have besides their noise, as a share of the largest current.
const MEAN_SHARE: f64 = 0.005;

/// Time with all legs off, in times for which lines were driven before, after which no current flows even where no reading shows that.
const UNREAD_REST: f64 = 1.5;

/// Cuts the record with index `number` into pieces: where a pulse begins after all legs were off and no current flowed for a
/// while. With legs on, a current decays with the winding's time constant and never ends.
pub fn pieces(number: usize, record: &Record) -> Vec<Piece> {
    let rest = resting(record);
    let rows = &record.rows;
    let quiet = |row: &Row| {
        let is_quiet = |k: usize| {
            let most = (STILL_SHARE * rest[k].reach).max(5.0 * rest[k].noise).max(1e-12);
            row.current[k].is_nan() || (row.current[k] - rest[k].mean).abs() <= most
        };
        row.legs == [Request::Off; 3] && (0..CHANNELS).all(is_quiet)
    };
    // The mean of the rows, too, is that of rest.
    let at_rest = |rows: &[Row]| {
        (0..CHANNELS).all(|k| {
            let read = || rows.iter().map(|row| row.current[k]).filter(|i| !i.is_nan());
            let count = read().count() as f64;
            let mean = read().sum::<f64>() / count;
            let most = MEAN_SHARE * rest[k].reach + 5.0 * rest[k].noise / count.sqrt();
            mean.is_nan() || (mean - rest[k].mean).abs() <= most
        })
    };
    // Rows in a row without current and without a driven line.
    let mut still = 0_usize;
    let mut cuts = vec![0];
    let mut driven = false;
    // For how long lines were driven since the last cut, and for how long all legs have been off, in s.
    let (mut drove, mut off) = (0.0, 0.0);
    for k in 1..rows.len() {
        let (before, time) = (&rows[k - 1], rows[k].time - rows[k - 1].time);
        off = if before.legs == [Request::Off; 3] { off + time } else { 0.0 };
        // Without a reading: diodes have the link take back the fluxes at least as fast as it raised them.
        let is_read = before.current.iter().any(|i| !i.is_nan());
        still = if quiet(before) && (is_read || off > UNREAD_REST * drove) { still + 1 } else { 0 };
        if drives(before.legs) {
            (driven, drove) = (true, drove + time);
        }
        let begins = drives(rows[k].legs) && !drives(rows[k - 1].legs);
        if begins && driven && still >= LEAST_STILL && at_rest(&rows[k - still / 2..k]) {
            // Half of the rest belongs to the pulse that comes.
            cuts.push(k - still / 2);
            (driven, drove) = (false, 0.0);
        }
    }
    cuts.push(rows.len());
    let mut pieces: Vec<Piece> = cuts.windows(2).map(|cut| piece(number, &rows[cut[0]..cut[1]])).collect();
    even_links(&mut pieces);
    pieces
}

/// Returns the pieces of all records as far as a fit uses them, and the step between used rows. The time of a fit grows with the rows,
/// and neighbouring rows tell nearly the same. `origin`: angle in rad from which turns count.
pub fn used(records: &[Record], origin: Option<f64>, most: usize) -> (Vec<Piece>, usize) {
    let rows: usize = records.iter().map(|record| record.rows.len()).sum();
    let mut all: Vec<Piece> = records.iter().enumerate().flat_map(|(k, record)| pieces(k, record)).collect();
    let every = rows.div_ceil(most.max(1));
    for piece in &mut all {
        piece.turn = records[piece.record].angle.zip(origin).map_or(0.0, |(angle, origin)| angle - origin);
        if every > 1 {
            piece.thin(every);
        }
    }
    (all, every)
}

/// Largest excess of the links' sum of squares over the one expected from their noise, in standard deviations.
const LINKS_ALIKE: f64 = 3.0;

/// Sets the DC links of a record's pieces to their common mean if they differ by no more than the noise of their readings makes. The
/// mean of a single pulse has an error that all its currents share, which a fine converter shows: noise of 0.05 % in each of 160
/// readings makes 0.004 %.
fn even_links(pieces: &mut [Piece]) {
    let variance = |piece: &Piece| {
        let driven = || piece.rows.iter().filter(|row| drives(row.legs)).map(|row| row.link - piece.link);
        let n = driven().count() as f64;
        driven().map(|off| off * off).sum::<f64>() / (n * (n - 1.0))
    };
    let weights: Vec<f64> = pieces.iter().map(|piece| 1.0 / variance(piece)).collect();
    if pieces.len() < 2 || !weights.iter().all(|weight| weight.is_finite()) {
        return;
    }
    let sum = |value: fn(&Piece) -> f64| -> f64 {
        pieces.iter().zip(&weights).map(|(piece, weight)| weight * value(piece)).sum()
    };
    let mean = sum(|piece| piece.link) / sum(|_| 1.0);
    let square = |piece: &Piece| (piece.link - mean) * (piece.link - mean);
    let squares: f64 = pieces.iter().zip(&weights).map(|(piece, weight)| weight * square(piece)).sum();
    let freedom = pieces.len() as f64 - 1.0;
    if squares < freedom + LINKS_ALIKE * (2.0 * freedom).sqrt() {
        for piece in pieces {
            piece.link = mean;
        }
    }
}

fn piece(record: usize, rows: &[Row]) -> Piece {
    let mut edges = Vec::new();
    for pair in rows.windows(2) {
        if pair[1].legs != pair[0].legs {
            let interval = pair[1].time - pair[0].time;
            edges.push(Edge {
                at: pair[1].time - interval / 2.0,
                deviation: interval / 12.0_f64.sqrt(),
                legs: pair[1].legs,
            });
        }
    }
    let links: Vec<f64> = rows.iter().filter(|row| drives(row.legs)).map(|row| row.link).collect();
    let link = links.iter().sum::<f64>() / links.len().max(1) as f64;
    Piece { rows: rows.to_vec(), edges, first: rows[0].legs, link, record, turn: 0.0 }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Two pulses; between them legs in one state while a current decays.
    pub fn record(between: Request, current: impl Fn(f64) -> f64) -> Record {
        let pulse = [Request::High, Request::Low, Request::Low];
        let rows = (0..300_u32).map(|k| {
            let after = f64::from(k) - 60.0;
            let (i, legs) = match k {
                0..20 => (0.0, [Request::Off; 3]),
                20..60 => (f64::from(k - 20), pulse),
                60..200 => (current(after), [between; 3]),
                _ => (f64::from(k - 200), pulse),
            };
            Row { time: f64::from(k) * 1e-6, current: [i, -0.5 * i, -0.5 * i, 0.0], link: 12.0, legs }
        });
        Record { file: String::new(), rows: rows.collect(), channels: [true, true, true, false], angle: None }
    }

    #[test]
    fn law_thinned_rows_keep_their_ends_and_the_edges_of_all() {
        let mut whole = pieces(0, &record(Request::Off, |_| 0.0)).remove(0);
        let (rows, edges) = (whole.rows.clone(), whole.edges.clone());
        whole.thin(7);
        let last = rows.len() - 1;
        let expected: Vec<Row> = rows
            .into_iter()
            .enumerate()
            .filter(|(k, _)| k % 7 == 0 || *k == last)
            .map(|(_, row)| row)
            .collect();
        assert_eq!((whole.rows, whole.edges), (expected, edges));
    }

    #[test]
    fn law_links_are_one_if_they_differ_by_their_noise_alone() {
        // Readings that go up and down by 0.6 % about 12 V, in the second pulse about 12 V and so much more.
        let links = |more: f64| {
            let mut record = record(Request::Off, |_| 0.0);
            for (k, row) in record.rows.iter_mut().enumerate() {
                row.link += if k % 2 == 0 { 0.07 } else { -0.07 } + if k < 150 { 0.0 } else { more };
            }
            pieces(0, &record).iter().map(|piece| piece.link).collect::<Vec<_>>()
        };
        // Standard errors of 0.07 V by the root of 40 and of 100 readings: 13 mV of the difference.
        let [one, other] = links(0.02)[..] else { panic!("two pulses") };
        assert!(one == other && (12.0..12.02).contains(&one), "{one} {other}");
        let [one, other] = links(0.1)[..] else { panic!("two pulses") };
        assert!((one - 12.0).abs() < 1e-9 && (other - 12.1).abs() < 1e-9, "{one} {other}");
    }

    #[test]
    fn law_a_record_is_cut_only_where_no_current_flows() {
        let gone = |after: f64| (40.0 - 4.0 * after).max(0.0);
        assert_eq!(pieces(0, &record(Request::Off, gone)).len(), 2);
        // All legs low: what is below a fiftieth still flows.
        let decays = |after: f64| 40.0 * (-after / 25.0_f64).exp();
        assert_eq!(pieces(0, &record(Request::Low, decays)).len(), 1);
        assert_eq!(pieces(0, &record(Request::Off, |after| (40.0 - 4.0 * after).max(0.6))).len(), 1);
    }
}
