//! The place in which the simulation differs from the readings, which shows the cause to look for and the next measurement.

use super::{Fit, MISFIT};

/// Place of the difference between simulation and readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// At large currents: iron that saturates in another way than the model's.
    LargeCurrents {
        /// Current in A that separates small from large currents.
        above: f64,
        /// Rms of the difference above that current divided by the rms below it.
        ratio: f64,
        /// Duration in s of pulses whose currents stay so small that the iron's law hardly matters.
        pulse: f64,
        /// Largest current in A of such pulses.
        below: f64,
    },
    /// In one pulse.
    OnePulse {
        /// Number of the pulse, from 1.
        number: usize,
        /// Share of the squared difference that is in it.
        share: f64,
    },
    /// Everywhere.
    Everywhere,
}

/// Number of rows whose mean residual is taken: noise averages out, a difference stays.
const BLOCK: usize = 16;

/// Share of the largest current above which currents count as large. Saturation of order n grows with its n-th power.
const LARGE: f64 = 0.6;

/// Share of the largest current up to which shorter pulses are asked for. At 0.6 eight bits show no difference any more that still shifts
/// L_q of a steep core by two half widths of its interval; at 0.4 it is one.
const SHORT: f64 = 0.4;

/// Least ratio of the differences above and below that counts as saturation.
const GROWS: f64 = 2.0;

/// Least share of the squared difference that makes one pulse the cause, of pulses that each would have an equal share.
const MOST: f64 = 0.6;

/// Mean residual and current of a block of rows.
struct Block {
    pulse: usize,
    square: f64,
    current: f64,
}

impl Fit {
    /// Returns where the simulation differs from the readings; none if it describes them.
    pub fn misfit(&self) -> Option<Misfit> {
        if self.widened < MISFIT {
            return None;
        }
        let blocks = self.blocks();
        let total: f64 = blocks.iter().map(|block| block.square).sum();
        let of_pulse = |pulse: usize| {
            let own = blocks.iter().filter(|block| block.pulse == pulse);
            own.map(|block| block.square).sum::<f64>() / total
        };
        let shares: Vec<f64> = (0..self.traces.len()).map(of_pulse).collect();
        let worst = (0..shares.len()).max_by(|a, b| shares[*a].total_cmp(&shares[*b]))?;
        if shares.len() > 2 && shares[worst] > MOST {
            return Some(Misfit::OnePulse { number: worst + 1, share: shares[worst] });
        }
        let above = LARGE * self.reach;
        let rms = |large: bool| {
            let side: Vec<f64> = blocks
                .iter()
                .filter(|block| (block.current > above) == large)
                .map(|block| block.square)
                .collect();
            (side.iter().sum::<f64>() / side.len().max(1) as f64).sqrt()
        };
        let ratio = rms(true) / rms(false).max(1e-3 * rms(true));
        let rise = self.longest_rise();
        Some(match rise {
            Some(rise) if ratio > GROWS => {
                Misfit::LargeCurrents { above, ratio, pulse: SHORT * rise, below: SHORT * self.reach }
            }
            _ => Misfit::Everywhere,
        })
    }

    /// Returns the blocks of all phases and pulses, with the largest phase current of each.
    fn blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        for (pulse, trace) in self.traces.iter().enumerate() {
            let rest = trace.simulated.first().copied().unwrap_or_default();
            for (read, shown) in trace.measured.chunks_exact(BLOCK).zip(trace.simulated.chunks_exact(BLOCK)) {
                let current =
                    shown.iter().flat_map(|row| (0..3).map(|k| (row[k] - rest[k]).abs())).fold(0.0, f64::max);
                for k in 0..3 {
                    let off: f64 = read.iter().zip(shown).map(|(read, shown)| read[k] - shown[k]).sum();
                    let mean = off / BLOCK as f64;
                    if mean.is_finite() {
                        blocks.push(Block { pulse, square: mean * mean, current });
                    }
                }
            }
        }
        blocks
    }

    /// Returns the longest time in s from rest to the largest current of a pulse.
    fn longest_rise(&self) -> Option<f64> {
        let rise = |trace: &super::Trace| {
            let rest = *trace.simulated.first()?;
            let size = |row: &[f64; 3]| (0..3).map(|k| (row[k] - rest[k]).abs()).fold(0.0, f64::max);
            let sizes: Vec<f64> = trace.simulated.iter().map(size).collect();
            let peak = (0..sizes.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]))?;
            let begins = sizes.iter().position(|size| *size > 0.02 * sizes[peak])?;
            Some(trace.time[peak] - trace.time[begins])
        };
        self.traces.iter().filter_map(rise).reduce(f64::max).filter(|rise| *rise > 0.0)
    }
}
