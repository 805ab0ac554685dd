//! The place in which the simulation differs from the readings, which shows the cause to look for and the next measurement.

use super::record::CHANNELS;
use super::{Fit, Trace};

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
    /// In one of several files: its rotor stood elsewhere, or its legs or channels are others.
    OneFile {
        /// Index of the file's record.
        record: usize,
        /// Rms of the difference in it divided by the largest rms in any other file.
        ratio: f64,
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

/// Least ratio of the rms of the difference in one file to that in each other file that makes it the cause. Where the saliency is small, a
/// rotor elsewhere leaves less than that and is not named.
const STANDS_OUT: f64 = 2.0;

/// Mean residual and current of a block of rows.
struct Block {
    record: usize,
    pulse: usize,
    square: f64,
    current: f64,
}

impl Fit {
    /// Returns where the simulation differs from the readings; none if it describes them.
    pub fn misfit(&self) -> Option<Misfit> {
        let readings = Readings { traces: &self.traces, clip: &self.clip, reach: self.reach };
        (!self.describes()).then(|| readings.misfit())
    }
}

/// Measured and simulated currents.
struct Readings<'a> {
    traces: &'a [Trace],
    /// Ends of the channels' ranges in A.
    clip: &'a [[f64; 2]; CHANNELS],
    /// Largest current in A.
    reach: f64,
}

impl Readings<'_> {
    /// Returns where the simulation differs from the readings.
    fn misfit(&self) -> Misfit {
        let blocks = self.blocks();
        if let Some((record, ratio)) = self.one_file(&blocks) {
            return Misfit::OneFile { record, ratio };
        }
        if let Some((pulse, share)) = self.one_pulse(&blocks) {
            return Misfit::OnePulse { number: pulse + 1, share };
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
        match self.short_pulse() {
            Some(pulse) if ratio > GROWS => {
                Misfit::LargeCurrents { above, ratio, pulse, below: SHORT * self.reach }
            }
            _ => Misfit::Everywhere,
        }
    }

    /// Returns the index of the record whose difference is by far the largest, and the ratio of its rms to the next; none of fewer than three
    /// records, of which either of two may be the one that is off. As in [`Self::one_pulse`] only currents that a second file reaches count.
    fn one_file(&self, blocks: &[Block]) -> Option<(usize, f64)> {
        let count = self.traces.iter().map(|trace| trace.record + 1).max()?;
        let mut peaks = vec![0.0_f64; count];
        for trace in self.traces {
            peaks[trace.record] = peaks[trace.record].max(Sizes::of(trace).peak());
        }
        peaks.sort_unstable_by(|a, b| b.total_cmp(a));
        let most = *peaks.get(1)?;
        let rms = |record: usize| {
            let own = blocks.iter().filter(|block| block.record == record && block.current <= most);
            let squares: Vec<f64> = own.map(|block| block.square).collect();
            (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
        };
        let mut sorted: Vec<(usize, f64)> = (0..count).map(|record| (record, rms(record))).collect();
        sorted.sort_unstable_by(|(_, a), (_, b)| b.total_cmp(a));
        let [(worst, of_worst), (_, next), _, ..] = sorted[..] else { return None };
        (of_worst > STANDS_OUT * next).then(|| (worst, of_worst / next.max(1e-3 * of_worst)))
    }

    /// Returns the pulse that has most of the squared difference, and its share. A pulse that goes higher in current than all others
    /// differs there from a core of another law, and says nothing of its legs or the rotor: only currents that a second pulse reaches
    /// count.
    fn one_pulse(&self, blocks: &[Block]) -> Option<(usize, f64)> {
        let mut peaks: Vec<f64> = self.traces.iter().map(|trace| Sizes::of(trace).peak()).collect();
        peaks.sort_unstable_by(|a, b| b.total_cmp(a));
        let most = *peaks.get(1)?;
        let common = || blocks.iter().filter(|block| block.current <= most);
        let total: f64 = common().map(|block| block.square).sum();
        let of_pulse = |pulse: usize| common().filter(|b| b.pulse == pulse).map(|b| b.square).sum::<f64>();
        let shares: Vec<f64> = (0..self.traces.len()).map(|pulse| of_pulse(pulse) / total).collect();
        let worst = (0..shares.len()).max_by(|a, b| shares[*a].total_cmp(&shares[*b]))?;
        (shares.len() > 2 && shares[worst] > MOST).then_some((worst, shares[worst]))
    }

    /// Returns the blocks of all channels and pulses, with the largest phase current of each. A block with a clipped reading is none: that
    /// reading only tells how large the current is at least.
    fn blocks(&self) -> Vec<Block> {
        let is_clipped = |k: usize, i: f64| i <= self.clip[k][0] || i >= self.clip[k][1];
        let mut blocks = Vec::new();
        for (pulse, trace) in self.traces.iter().enumerate() {
            let sizes = Sizes::of(trace);
            let rows = trace.measured.chunks_exact(BLOCK).zip(trace.simulated.chunks_exact(BLOCK));
            for ((read, shown), sizes) in rows.zip(sizes.0.chunks_exact(BLOCK)) {
                let current = sizes.iter().copied().fold(0.0, f64::max);
                for k in (0..CHANNELS).filter(|k| !read.iter().any(|read| is_clipped(*k, read[*k]))) {
                    let off: f64 = read.iter().zip(shown).map(|(read, shown)| read[k] - shown[k]).sum();
                    let mean = off / BLOCK as f64;
                    if mean.is_finite() {
                        blocks.push(Block { record: trace.record, pulse, square: mean * mean, current });
                    }
                }
            }
        }
        blocks
    }

    /// Returns the longest duration in s after which the currents of no pulse exceed [`SHORT`] of the largest, taking each to rise to its
    /// peak in a straight line.
    fn short_pulse(&self) -> Option<f64> {
        let one = |trace: &Trace| {
            let sizes = Sizes::of(trace);
            let peak = sizes.peak();
            let at = sizes.0.iter().position(|size| *size == peak)?;
            let begins = sizes.0.iter().position(|size| *size > 0.02 * peak)?;
            let rise = trace.time[at] - trace.time[begins];
            (rise > 0.0).then_some(rise * SHORT * self.reach / peak)
        };
        self.traces.iter().filter_map(one).reduce(f64::min)
    }
}

/// Largest magnitude in A of a simulated phase current in each row of a trace, offsets removed.
struct Sizes(Vec<f64>);

impl Sizes {
    fn of(trace: &Trace) -> Self {
        let rest = trace.simulated.first().copied().unwrap_or_default();
        let size = |row: &[f64; CHANNELS]| (0..3).map(|k| (row[k] - rest[k]).abs()).fold(0.0, f64::max);
        Self(trace.simulated.iter().map(size).collect())
    }

    fn peak(&self) -> f64 {
        self.0.iter().copied().fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::super::reading::NO_CLIP;
    use super::*;

    /// A pulse along phase a of 1 A per µs up to `peak` and down again, in rows of 0.1 µs, with readings that differ by `off` at each
    /// current in A.
    fn pulse(peak: f64, off: impl Fn(f64) -> f64) -> Trace {
        let time: Vec<f64> = (0..1600).map(|k| 1e-7 * f64::from(k)).collect();
        let current = |t: f64| (t * 1e6 - 5.0).min(2.0 * peak + 5.0 - t * 1e6).max(0.0);
        let phases = |i: f64| [i, -0.5 * i, -0.5 * i, f64::NAN];
        let simulated: Vec<[f64; CHANNELS]> = time.iter().map(|t| phases(current(*t))).collect();
        let measured = simulated.iter().map(|i| phases(i[0] + off(i[0]))).collect();
        Trace { record: 0, time, measured, simulated }
    }

    fn misfit(traces: &[Trace], clip: [f64; 2]) -> Misfit {
        Readings { traces, clip: &[clip, NO_CLIP, NO_CLIP, NO_CLIP], reach: 50.0 }.misfit()
    }

    /// Iron of another law in all pulses alike: the one that goes higher is no pulse with other legs.
    #[test]
    fn regress_a_pulse_of_larger_current_is_not_blamed_for_its_legs() {
        let iron = |i: f64| 1e-7 * i.powi(4);
        let traces: Vec<Trace> = [25.0, 25.0, 25.0, 50.0].map(|peak| pulse(peak, iron)).into();
        let found = misfit(&traces, NO_CLIP);
        assert!(matches!(found, Misfit::LargeCurrents { .. }), "{found:?}");
        // A pulse with other legs differs at the currents of the others, too, however high it goes.
        for peak in [25.0, 50.0] {
            let mut traces = traces[..3].to_vec();
            traces.push(pulse(peak, |i| 0.2 * i));
            let found = misfit(&traces, NO_CLIP);
            assert!(matches!(found, Misfit::OnePulse { number: 4, share } if share > 0.9), "{found:?}");
        }
    }

    /// A file is named if its difference is three times that of each other file. Of two files none is named: either may be the wrong one.
    #[test]
    fn analytic_a_file_of_another_position_is_named() {
        let traces = |off: &[f64]| -> Vec<Trace> {
            let of = |(record, off): (usize, &f64)| Trace { record, ..pulse(50.0, |i| off * i) };
            off.iter().enumerate().map(of).collect()
        };
        let found = misfit(&traces(&[0.02, -0.01, 0.06, 0.02]), NO_CLIP);
        assert!(
            matches!(found, Misfit::OneFile { record: 2, ratio } if (ratio - 3.0).abs() < 1e-6),
            "{found:?}"
        );
        for off in [&[0.02, 0.06][..], &[0.06, 0.02, -0.05]] {
            assert!(!matches!(misfit(&traces(off), NO_CLIP), Misfit::OneFile { .. }), "{off:?}");
        }
    }

    /// A range that ends at 40 A: readings there are no differences.
    #[test]
    fn regress_clipped_readings_are_no_differences() {
        let mut traces: Vec<Trace> = [50.0, 50.0, 50.0].map(|peak| pulse(peak, |_| 0.1)).into();
        let read = traces.iter_mut().flat_map(|trace| &mut trace.measured);
        read.for_each(|read| read[0] = read[0].min(40.0));
        let clipped = |clip| match misfit(&traces, clip) {
            Misfit::LargeCurrents { ratio, .. } => ratio,
            _ => 1.0,
        };
        assert!(clipped(NO_CLIP) > 10.0 && clipped([f64::NEG_INFINITY, 40.0]) < GROWS);
    }

    /// A pulse of the fast axis reaches 50 A in 50 µs, one of the slow axis 25 A in 100 µs: at 0.4 of 50 A the fast one is after 20 µs.
    #[test]
    fn regress_the_short_pulse_is_that_of_the_axis_whose_current_rises_first() {
        let iron = |i: f64| 1e-7 * i.powi(4);
        let mut slow = pulse(25.0, iron);
        slow.time.iter_mut().for_each(|time| *time *= 4.0);
        let traces = [pulse(50.0, iron), slow, pulse(50.0, iron)];
        let Misfit::LargeCurrents { pulse, below, .. } = misfit(&traces, NO_CLIP) else {
            panic!("{:?}", misfit(&traces, NO_CLIP))
        };
        assert!((19e-6..20e-6).contains(&pulse) && (below - 20.0).abs() < 1e-9, "{pulse} {below}");
    }
}
