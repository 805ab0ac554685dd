//! Whether channels are on other phases than their columns say, or the wrong way round.
//!
//! What the first pulse of each piece raises lies along its voltage, but for what saliency turns it by: 37° where L_q is four
//! times L_d. Exchanged phases turn it by 60° or more, and a clamp that is the wrong way round makes a sum of it that is not zero.

use std::fmt;

use standstill_numeric::hypot;

use super::pieces::Piece;
use super::record::{COLUMNS, Request};

/// Which phase each column is of, and which columns count the other way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// The phase of each column, from 0.
    pub phase: [usize; 3],
    /// Whether it counts currents out of the motor.
    pub reversed: [bool; 3],
    /// Which columns there are.
    pub channels: [bool; 3],
}

/// The cosine between current and voltage below which they do not suit each other, and from which on they do: 45° and 32°.
const SUITS: [f64; 2] = [0.7, 0.85];

/// Currents below this share of the largest say nothing.
const LEAST_CURRENT: f64 = 0.2;

/// Phases of the columns, those that exchange fewer first.
const PHASES: [[usize; 3]; 6] = [[0, 1, 2], [1, 0, 2], [2, 1, 0], [0, 2, 1], [1, 2, 0], [2, 0, 1]];

/// What the first pulse of a piece drives the phases with, and what the columns read.
type Pulse = ([f64; 3], [f64; 3]);

impl Wiring {
    /// The smallest cosine between current and voltage of all pulses, wired so.
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

    /// How much is wrong with it.
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

/// How channels are wired if not as their columns say, and the readings then suit the legs; `rest` is what they read without
/// current, in A.
pub fn miswired(pieces: &[Piece], channels: [bool; 3], rest: [f64; 3]) -> Option<Wiring> {
    let mut pulses: Vec<Pulse> = Vec::new();
    for piece in pieces {
        let Some((edge, row)) = piece.first_pulse() else { continue };
        let on = edge.legs.map(|leg| f64::from(u8::from(leg == Request::High)));
        // A leg that is off has half the link's voltage while the two others are high and low.
        let potential: [f64; 3] =
            std::array::from_fn(|k| if edge.legs[k] == Request::Off { 0.5 } else { on[k] });
        let star = potential.iter().sum::<f64>() / 3.0;
        let read = std::array::from_fn(|k| row.current[k] - rest[k]);
        pulses.push((potential.map(|u| u - star), read));
    }
    let size = |(_, read): &Pulse| length(read.map(|i| if i.is_nan() { 0.0 } else { i }));
    let largest = pulses.iter().map(size).fold(0.0, f64::max);
    pulses.retain(|pulse| size(pulse) > LEAST_CURRENT * largest);
    let straight = Wiring { phase: PHASES[0], reversed: [false; 3], channels };
    if pulses.is_empty() || straight.suits(&pulses) >= SUITS[0] {
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
