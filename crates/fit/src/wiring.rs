//! Checks whether channels are on other phases than their columns state, or reversed.
//!
//! The current that the first pulse of each piece raises is parallel to its voltage, except for a turn by saliency: 37° if L_q is
//! four times L_d, 60° if it is fourteen times. Exchanged phases turn at least one of several directions by far more, and a
//! reversed clamp makes the currents' sum differ from zero.

use std::fmt;

use standstill_numeric::hypot;

use super::pieces::{Piece, Rest};
use super::record::{CHANNELS, COLUMNS, Request};

/// Assignment of columns to phases, with reversed columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// Phase of each column, from 0.
    pub phase: [usize; 3],
    /// True for each column that counts currents out of the motor as positive.
    pub reversed: [bool; 3],
    /// True for each column that exists.
    pub channels: [bool; 3],
}

/// Cosines between current and voltage: below the first they do not match (60°), from the second on they match (32°).
const SUITS: [f64; 2] = [0.5, 0.85];

/// Least cosine between two voltages that count as one direction.
const ONE_DIRECTION: f64 = 0.9;

/// Least current that is used, as a share of the largest.
const LEAST_CURRENT: f64 = 0.2;

/// Least current that is used, in standard deviations of the readings at rest.
const LEAST_NOISES: f64 = 20.0;

/// Permutations of the phases; those that exchange fewer phases come first.
const PHASES: [[usize; 3]; 6] = [[0, 1, 2], [1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]];

/// Voltages that the first pulse of a piece puts on the phases, and readings of the columns.
type Pulse = ([f64; 3], [f64; 3]);

impl Wiring {
    /// Returns the smallest cosine between current and voltage over all pulses with this wiring.
    fn suits(&self, pulses: &[Pulse]) -> f64 {
        let cosine = |(voltage, read): &Pulse| {
            let mut current = [f64::NAN; 3];
            for k in (0..3).filter(|k| self.channels[*k]) {
                current[self.phase[k]] = if self.reversed[k] { -read[k] } else { read[k] };
            }
            // Without one, all of them sum to zero.
            if let Some(missing) = current.iter().position(|i| i.is_nan()) {
                current[missing] = -current.iter().filter(|i| !i.is_nan()).sum::<f64>();
            }
            let dot: f64 = voltage.iter().zip(current).map(|(u, i)| u * i).sum();
            dot / (length(*voltage) * length(current))
        };
        pulses.iter().map(cosine).fold(1.0, f64::min)
    }

    /// Returns the number of changes against the stated wiring.
    fn changes(&self) -> usize {
        let count = self.reversed.iter().filter(|reversed| **reversed).count();
        // All of them: one convention is another.
        let present = self.channels.iter().filter(|present| **present).count();
        let moved = (0..3).filter(|k| self.phase[*k] != *k).count();
        moved.saturating_sub(1) + if count == present { 1 } else { count }
    }
}

fn length([a, b, c]: [f64; 3]) -> f64 {
    hypot(hypot(a, b), c)
}

/// Returns the wiring of the channels if it differs from what the columns state and makes the readings match the legs; none
/// otherwise, and if all pulses have one direction. `rest` has the readings without current.
pub fn miswired(pieces: &[Piece], channels: [bool; CHANNELS], rest: &[Rest; CHANNELS]) -> Option<Wiring> {
    let [a, b, c, _] = channels;
    let (channels, rest) = ([a, b, c], &rest[..3]);
    let mut pulses: Vec<Pulse> = Vec::new();
    for piece in pieces {
        let Some((edge, row)) = piece.first_pulse() else { continue };
        let on = edge.legs.map(|leg| f64::from(u8::from(leg == Request::High)));
        // A leg that is off has half the link's voltage while the two others are high and low.
        let potential: [f64; 3] =
            std::array::from_fn(|k| if edge.legs[k] == Request::Off { 0.5 } else { on[k] });
        let star = potential.iter().sum::<f64>() / 3.0;
        let read = std::array::from_fn(|k| row.current[k] - rest[k].mean);
        pulses.push((potential.map(|u| u - star), read));
    }
    let size = |(_, read): &Pulse| length(read.map(|i| if i.is_nan() { 0.0 } else { i }));
    let largest = pulses.iter().map(size).fold(0.0, f64::max);
    let noise = rest.iter().map(|rest| rest.noise).filter(|noise| noise.is_finite()).fold(0.0, f64::max);
    pulses.retain(|pulse| size(pulse) > (LEAST_CURRENT * largest).max(LEAST_NOISES * noise));
    let straight = Wiring { phase: PHASES[0], reversed: [false; 3], channels };
    let &(first, _) = pulses.first()?;
    let across = |(voltage, _): &Pulse| {
        let dot: f64 = first.iter().zip(voltage).map(|(u, v)| u * v).sum();
        dot.abs() < ONE_DIRECTION * length(first) * length(*voltage)
    };
    if !pulses.iter().any(across) || straight.suits(&pulses) >= SUITS[0] {
        return None;
    }
    let all = PHASES.into_iter().flat_map(|phase| {
        (0..8_u8).map(move |bits| {
            let reversed = std::array::from_fn(|k| channels[k] && bits >> k & 1 == 1);
            Wiring { phase, reversed, channels }
        })
    });
    all.filter(|wiring| wiring.suits(&pulses) >= SUITS[1]).min_by_key(Wiring::changes)
}

impl fmt::Display for Wiring {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |k: usize| COLUMNS[1 + k];
        let mut parts = Vec::new();
        for k in (0..3).filter(|k| self.channels[*k] && self.phase[*k] != *k) {
            parts.push(format!("{} as {}", name(k), name(self.phase[k])));
        }
        for k in (0..3).filter(|k| self.reversed[*k]) {
            parts.push(format!("{} with the other sign", name(k)));
        }
        f.write_str(&parts.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::super::pieces::{pieces, resting};
    use super::super::record::{Record, Row};
    use super::*;

    /// Two pulses from rest, along a and along b, of a motor with its d-axis at an angle; without a voltage if there is no `link`.
    fn record(angle_deg: f64, ratio: f64, noise: f64, link: f64) -> Record {
        let axes = [0.0_f64, 120.0, 240.0].map(f64::to_radians);
        let (sin, cos) = standstill_numeric::sin_cos(angle_deg.to_radians());
        let rows = (0..240_u32).map(|k| {
            let (place, along) = (f64::from(k % 120), (k / 120) as usize);
            let on = (40.0..80.0).contains(&place);
            let (x, y) = standstill_numeric::sin_cos(axes[along]);
            // d: 1, q: the ratio.
            let (d, q) = (y * cos + x * sin, (x * cos - y * sin) / ratio);
            let (alpha, beta) = (d * cos - q * sin, d * sin + q * cos);
            let ramp = if on { link * (place - 40.0) } else { 0.0 };
            let current: [f64; 3] = std::array::from_fn(|n| {
                let (s, c) = standstill_numeric::sin_cos(axes[n]);
                let hash =
                    f64::from((k * 7919 + 104_729 * u32::try_from(n).expect("three")) % 1000) / 500.0 - 1.0;
                ramp * (alpha * c + beta * s) + noise * hash
            });
            let mut legs = [Request::Off; 3];
            if on {
                legs = [Request::Low; 3];
                legs[along] = Request::High;
            }
            let [a, b, c] = current;
            Row { time: f64::from(k) * 1e-6, current: [a, b, c, f64::NAN], link: 24.0, legs }
        });
        Record { file: String::new(), rows: rows.collect(), channels: [true, true, true, false], angle: None }
    }

    fn wiring_of(record: &Record) -> Option<Wiring> {
        miswired(&pieces(0, record), record.channels, &resting(record))
    }

    #[test]
    fn law_neither_saliency_nor_noise_is_taken_for_exchanged_channels() {
        for angle in (0..360).step_by(10).map(f64::from) {
            for ratio in [1.0, 5.0, 10.0] {
                assert_eq!(wiring_of(&record(angle, ratio, 0.01, 0.2)), None, "{angle}° {ratio}");
            }
            assert_eq!(wiring_of(&record(angle, 2.0, 0.02, 0.0)), None, "noise alone");
            // Exchanged they are seen.
            let mut exchanged = record(angle, 2.0, 0.01, 0.2);
            exchanged.rows.iter_mut().for_each(|row| row.current.swap(1, 2));
            assert!(wiring_of(&exchanged).is_some_and(|wiring| wiring.phase == [0, 2, 1]), "{angle}°");
        }
    }
}
