//! A record in pieces that begin at rest: each can be simulated by itself.

use super::record::{Record, Request, Row};

/// A change of what the legs are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// In s, as time counts in the record: in the middle between the last row before and the first one after it, for it
    /// was anywhere between them.
    pub at: f64,
    /// Standard deviation of that place in s.
    pub deviation: f64,
    /// What the legs are asked for from there on.
    pub legs: [Request; 3],
}

/// Rows from rest on.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The rows.
    pub rows: Vec<Row>,
    /// Changes of the legs, the first one from rest.
    pub edges: Vec<Edge>,
    /// What the legs are asked for at first.
    pub first: [Request; 3],
    /// Mean voltage of the DC link in V while a leg is high and another low.
    pub link: f64,
    /// Spread of it, as a share.
    pub spread: f64,
}

/// Whether these requests put the link's voltage across the motor.
pub fn drives(legs: [Request; 3]) -> bool {
    legs.contains(&Request::High) && legs.contains(&Request::Low)
}

/// Current in A below which a channel shows none: a hundredth of what it shows at most.
fn resting(record: &Record) -> [(f64, f64); 3] {
    let before = record.rows.iter().position(|row| drives(row.legs)).unwrap_or(1).max(1);
    std::array::from_fn(|k| {
        let mut rest: Vec<f64> = record.rows[..before].iter().map(|row| row.current[k]).collect();
        rest.sort_unstable_by(f64::total_cmp);
        let middle = rest[rest.len() / 2];
        let reach = record
            .rows
            .iter()
            .map(|row| (row.current[k] - middle).abs())
            .filter(|x| x.is_finite())
            .fold(0.0, f64::max);
        (middle, 0.02 * reach)
    })
}

/// Mean of each channel before the first pulse, in A.
pub fn rest_of(record: &Record) -> [f64; 3] {
    resting(record).map(|(middle, _)| middle)
}

/// The pieces of a record: it is cut where a pulse begins while the currents have been gone for a while.
pub fn pieces(record: &Record) -> Vec<Piece> {
    let rest = resting(record);
    let rows = &record.rows;
    let quiet = |row: &Row| {
        (0..3).all(|k| row.current[k].is_nan() || (row.current[k] - rest[k].0).abs() <= rest[k].1.max(1e-12))
    };
    // Rows in a row without current and without a driven line.
    let mut still = 0_usize;
    let mut cuts = vec![0];
    let mut driven = false;
    for k in 1..rows.len() {
        still = if quiet(&rows[k - 1]) && !drives(rows[k - 1].legs) { still + 1 } else { 0 };
        driven |= drives(rows[k - 1].legs);
        let begins = drives(rows[k].legs) && !drives(rows[k - 1].legs);
        if begins && driven && still >= 8 {
            // Half of the rest belongs to the pulse that comes.
            cuts.push(k - still / 2);
            driven = false;
        }
    }
    cuts.push(rows.len());
    cuts.windows(2).map(|cut| piece(&rows[cut[0]..cut[1]])).collect()
}

fn piece(rows: &[Row]) -> Piece {
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
    let spread = links.iter().map(|u| (u - link).abs()).fold(0.0, f64::max) / link;
    Piece { rows: rows.to_vec(), edges, first: rows[0].legs, link, spread }
}
