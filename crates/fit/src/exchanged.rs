//! Finds pulses whose stated legs do not raise their currents: two exchanged pulses, or one with the legs of another vector.
//!
//! The volt-seconds of a pulse of constant legs are L Δi, with one symmetric matrix L for all pulses: three numbers, found by
//! least squares. Saturation, voltage drops and dead time change the length of L Δi by a third at most; another vector turns it
//! by 60° or more.

use std::fmt;

use nalgebra::{Matrix3, Vector3};
use standstill_interface::Abc;
use standstill_numeric::hypot;
use standstill_quantity::Quantity;
use standstill_quantity::unit::Second;

use super::pieces::{Piece, Rest, drives};
use super::record::{CHANNELS, Record, Request, Row};

/// A pulse with wrong legs, and the legs that match its currents.
#[derive(Clone, Debug, PartialEq)]
pub struct Mislabelled {
    /// File of the record.
    pub file: String,
    /// Beginning of the pulse in s, in the time of its record.
    pub time: f64,
    /// Legs that the record states.
    pub stated: [Request; 3],
    /// Legs that match the currents.
    pub suiting: [Request; 3],
}

/// Pulses whose legs do not match their currents: two are exchanged, or one is wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchanged(pub Vec<Mislabelled>);

/// Limits of |u t − L Δi| / |u t|: legs and currents match below the first, and do not match above the second.
const SUITS: [f64; 2] = [0.35, 0.4];

/// Largest share of the sum of squares that may be left with other legs.
const MUCH_BETTER: f64 = 0.25;

/// Least volt-seconds of a pulse that is used, as a share of the largest.
const LEAST_FLUX: f64 = 0.2;

/// Least change of a current in a record that is used, in standard deviations of the readings at rest.
const LEAST_NOISES: f64 = 20.0;

/// Least number of pulses: with fewer, some L matches any legs.
const LEAST_PULSES: usize = 4;

/// Largest number of pulses that are checked.
const MOST_PULSES: usize = 120;

/// A pulse with constant legs.
struct Pulse {
    number: usize,
    time: f64,
    legs: [Request; 3],
    /// Link voltage times duration, in V s.
    flux: f64,
    /// Change of the currents in A, as a vector in the stator's plane.
    change: [f64; 2],
}

/// Returns the voltage vector of legs in the stator's plane as a share of the link's voltage; for a pulse across two phases, that
/// along their axis.
fn voltage(legs: [Request; 3]) -> [f64; 2] {
    let plane = Abc(legs.map(|leg| match leg {
        Request::Low => 0.0,
        Request::Off => 0.5,
        Request::High => 1.0,
    }))
    .clarke();
    [plane.alpha, plane.beta]
}

/// Fits L to pulses with these legs; returns the residual of each pulse in V s, and whether L is that of a motor.
fn residuals(pulses: &[Pulse], legs: &[[Request; 3]]) -> (Vec<f64>, bool) {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let mut add = |row: Vector3<f64>, value: f64| {
        matrix += row * row.transpose();
        right += row * value;
    };
    for (pulse, legs) in pulses.iter().zip(legs) {
        let ([x, y], [u, v]) = (pulse.change, voltage(*legs));
        let rows = [Vector3::new(x, y, 0.0), Vector3::new(0.0, x, y)];
        if legs.contains(&Request::Off) {
            let size = hypot(u, v);
            add((rows[0] * u + rows[1] * v) / size, pulse.flux * size);
        } else {
            add(rows[0], pulse.flux * u);
            add(rows[1], pulse.flux * v);
        }
    }
    let Some(inverse) = matrix.try_inverse() else { return (Vec::new(), false) };
    let l = inverse * right;
    let one = |(pulse, legs): (&Pulse, &[Request; 3])| {
        let ([x, y], [u, v]) = (pulse.change, voltage(*legs));
        let off = [pulse.flux * u - l[0] * x - l[1] * y, pulse.flux * v - l[1] * x - l[2] * y];
        let size = hypot(u, v);
        let share = if legs.contains(&Request::Off) {
            // What the open leg's terminal has is its own: along the line counts, and that no current flows beside it.
            let along = (off[0] * u + off[1] * v) / size;
            let beside = 0.5 * (l[0] + l[2]) * (y * u - x * v) / size;
            hypot(along, beside)
        } else {
            hypot(off[0], off[1])
        };
        share / (pulse.flux * size)
    };
    (pulses.iter().zip(legs).map(one).collect(), l[0] > 0.0 && l[0] * l[2] > l[1] * l[1])
}

/// Returns the pulses of all pieces.
fn pulses(pieces: &[Piece], rest: &[Rest; CHANNELS]) -> Vec<Pulse> {
    let mut pulses = Vec::new();
    for piece in pieces {
        for (k, edge) in piece.edges.iter().enumerate().filter(|(_, edge)| drives(edge.legs)) {
            let end = piece.edges.get(k + 1).map_or(f64::INFINITY, |next| next.at);
            // A link's current shows nothing beside the legs' own direction.
            let shows = |row: &&Row| row.current[..3].iter().filter(|i| !i.is_nan()).count() >= 2;
            let rows = piece.rows.iter().filter(|row| row.time > edge.at && row.time < end);
            let mut rows = rows.filter(shows);
            let (Some(first), Some(last)) = (rows.next(), rows.next_back()) else { continue };
            let current = |row: &Row| {
                let mut read: [f64; 3] = std::array::from_fn(|k| row.current[k] - rest[k].mean);
                if let Some(missing) = read.iter().position(|i| i.is_nan()) {
                    read[missing] = -read.iter().filter(|i| !i.is_nan()).sum::<f64>();
                }
                Abc(read).clarke()
            };
            let change = current(last) - current(first);
            let flux = piece.link * (last.time - first.time);
            let change = [change.alpha, change.beta];
            pulses.push(Pulse { number: piece.record, time: edge.at, legs: edge.legs, flux, change });
        }
    }
    let largest = pulses.iter().map(|pulse| pulse.flux).fold(0.0, f64::max);
    pulses.retain(|pulse| pulse.flux > LEAST_FLUX * largest);
    pulses.truncate(MOST_PULSES);
    pulses
}

/// Finds pulses whose currents contradict their legs while the currents of all other pulses fit. Returns `None` if every pulse fits.
pub fn exchanged(records: &[Record], pieces: &[Piece], rest: &[Rest; CHANNELS]) -> Option<Exchanged> {
    let pulses = pulses(pieces, rest);
    let noise = rest.iter().map(|rest| rest.noise).filter(|noise| noise.is_finite()).fold(0.0, f64::max);
    let largest = pulses.iter().map(|pulse| hypot(pulse.change[0], pulse.change[1])).fold(0.0, f64::max);
    if pulses.len() < LEAST_PULSES || largest < LEAST_NOISES * noise {
        return None;
    }
    let stated: Vec<[Request; 3]> = pulses.iter().map(|pulse| pulse.legs).collect();
    let squares = |shares: &[f64]| shares.iter().map(|share| share * share).sum::<f64>();
    let (shares, _) = residuals(&pulses, &stated);
    let wrong: Vec<usize> = (0..shares.len()).filter(|k| shares[*k] > SUITS[0]).collect();
    if wrong.is_empty() {
        return None;
    }
    let mut best = (MUCH_BETTER * squares(&shares), None);
    let mut look = |legs: Vec<[Request; 3]>| {
        let (shares, is_motor) = residuals(&pulses, &legs);
        let (sum, worst) = (squares(&shares), shares.iter().copied().fold(0.0, f64::max));
        if is_motor && worst < SUITS[1] && sum < best.0 {
            best = (sum, Some(legs));
        }
        best.1.is_some()
    };
    let mut found = false;
    for &i in &wrong {
        for j in (0..pulses.len()).filter(|j| stated[*j] != stated[i]) {
            let mut legs = stated.clone();
            legs.swap(i, j);
            found = look(legs);
        }
    }
    for &i in wrong.iter().filter(|_| !found) {
        let all = (0..27).map(|number| [9, 3, 1].map(|place| Request::ALL[number / place % 3]));
        for other in all.filter(|legs| drives(*legs)) {
            let mut legs = stated.clone();
            legs[i] = other;
            look(legs);
        }
    }
    let suiting = best.1?;
    let mislabelled = |k: usize| Mislabelled {
        file: records[pulses[k].number].file.clone(),
        time: pulses[k].time,
        stated: stated[k],
        suiting: suiting[k],
    };
    Some(Exchanged((0..pulses.len()).filter(|k| stated[*k] != suiting[*k]).map(mislabelled).collect()))
}

impl fmt::Display for Exchanged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, pulse) in self.0.iter().enumerate() {
            let time = Quantity::<Second>::si((pulse.time * 1e8).round() / 1e8);
            write!(
                f,
                "{}{}, pulse at {time}: legs {}, but currents as of {}",
                if k == 0 { "" } else { "; " },
                pulse.file,
                pulse.stated.map(Request::name).join(","),
                pulse.suiting.map(Request::name).join(",")
            )?;
        }
        if self.0.len() == 2 { f.write_str("; the legs of the two pulses look exchanged") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::pieces::{pieces, resting};
    use super::*;

    /// Pulses of these vectors one after the other, without rest between them, of a motor with L_q 1.6 times L_d at 25° that saturates
    /// by a tenth.
    fn record(vectors: &[[Request; 3]], driven: &[[Request; 3]]) -> Record {
        let (sin, cos) = standstill_numeric::sin_cos(25_f64.to_radians());
        let (mut i, mut rows) = ([0.0, 0.0], Vec::new());
        let mut row = |i: [f64; 2], legs| {
            let k = rows.len();
            let half = 0.866_025_403_784_438_6 * i[1];
            let current = [i[0], -0.5 * i[0] + half, -0.5 * i[0] - half, f64::NAN];
            rows.push(Row { time: k as f64 * 1e-6, current, link: 12.0, legs });
        };
        (0..20).for_each(|_| row([0.0; 2], [Request::Off; 3]));
        for (stated, driven) in vectors.iter().zip(driven) {
            let [u, v] = voltage(*driven);
            for _ in 0..40 {
                row(i, *stated);
                let [d, q] = [u * cos + v * sin, (v * cos - u * sin) / 1.6];
                let d = if d > 0.0 { 1.1 * d } else { d };
                i = [i[0] + d * cos - q * sin, i[1] + d * sin + q * cos];
            }
            // All low: the current decays a little.
            for _ in 0..20 {
                row(i, [Request::Low; 3]);
                i = i.map(|i| 0.99 * i);
            }
        }
        Record { file: "p.csv".to_owned(), rows, channels: [true, true, true, false], angle: None }
    }

    #[test]
    fn regress_exchanged_and_wrong_vectors_are_named_from_any_pulse() {
        let legs = |legs: [usize; 3]| legs.map(|leg| [Request::Low, Request::Off, Request::High][leg]);
        let of = [[2, 0, 0], [0, 2, 2], [0, 2, 0], [2, 0, 2], [0, 0, 2], [2, 2, 0]];
        let driven: Vec<[Request; 3]> = of.map(legs).to_vec();
        let found = |stated: &[[Request; 3]]| {
            let record = record(stated, &driven);
            let rest = resting(&record);
            exchanged(std::slice::from_ref(&record), &pieces(0, &record), &rest)
        };
        assert_eq!(found(&driven), None);
        for (i, j) in [(0, 1), (1, 2), (2, 5), (4, 5), (3, 0)] {
            let mut stated = driven.clone();
            stated.swap(i, j);
            let Exchanged(said) = found(&stated).expect("exchanged");
            let suiting: Vec<_> = said.iter().map(|pulse| (pulse.stated, pulse.suiting)).collect();
            let mut expected = [(driven[i], driven[j]), (driven[j], driven[i])];
            if i < j {
                expected.reverse();
            }
            assert_eq!(suiting, expected, "{i} {j}");
        }
        let mut stated = driven.clone();
        stated[4] = legs([2, 2, 0]);
        let said = found(&stated).expect("wrong").to_string();
        assert_eq!(said, "p.csv, pulse at 259.5 µs: legs high,high,low, but currents as of low,low,high");
    }
}
