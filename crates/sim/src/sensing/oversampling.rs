//! Readings that are the mean of several conversions.

use standstill_interface::{Abc, Reading, Sensed};

/// The conversions that a sample has so far. The reading of the sample is the mean of all its conversions.
#[derive(Clone, Copy, Debug)]
pub struct Mean {
    /// Number of conversions of each sample.
    count: u8,
    /// Number of conversions added so far, and their sum. None before the first conversion.
    sum: Option<(u8, Reading<f64>)>,
}

impl Mean {
    /// Makes means of `count` conversions each.
    pub fn of(count: u8) -> Self {
        Self { count, sum: None }
    }

    /// Drops the conversions of an incomplete sample.
    pub fn clear(&mut self) {
        self.sum = None;
    }

    /// Replaces the single conversions in `readings`, from index `first` on, by the means of complete samples. Conversions of an
    /// incomplete sample are kept for the next call.
    pub fn replace(&mut self, readings: &mut Vec<Reading<f64>>, first: usize) {
        if self.count > 1 {
            let mut known = first;
            for n in first..readings.len() {
                if let Some(mean) = self.with(&readings[n]) {
                    readings[known] = mean;
                    known += 1;
                }
            }
            readings.truncate(known);
        }
    }

    /// Adds one conversion of all channels. If it is the last conversion of the sample, returns the mean.
    fn with(&mut self, reading: &Reading<f64>) -> Option<Reading<f64>> {
        let (summed, sum) = match &self.sum {
            None => (1, *reading),
            Some((summed, sum)) => (summed + 1, plus(sum, reading)),
        };
        self.sum = Some((summed, sum)).filter(|_| summed < self.count);
        if self.sum.is_some() {
            return None;
        }
        let n = f64::from(self.count);
        Some(Reading {
            current: sum.current.map(|value| value / n),
            dc_link: sum.dc_link / n,
            link_current: sum.link_current / n,
            terminal: sum.terminal.map(|value| value / n),
            ..sum
        })
    }
}

/// Adds the values and codes of two conversions. Each value of the sum has the worse of the two statuses, in the order hidden, clipped,
/// derived, measured. All other fields are those of the second conversion.
fn plus(a: &Reading<f64>, b: &Reading<f64>) -> Reading<f64> {
    let worse = |a: Sensed, b: Sensed| {
        let order = [Sensed::Hidden, Sensed::Clipped, Sensed::Derived];
        order.into_iter().find(|of| *of == a || *of == b).unwrap_or(Sensed::Measured)
    };
    let each = |of: fn(&Reading<f64>) -> Abc<f64>| Abc(std::array::from_fn(|k| of(a).0[k] + of(b).0[k]));
    let sensed =
        |of: fn(&Reading<f64>) -> Abc<Sensed>| Abc(std::array::from_fn(|k| worse(of(a).0[k], of(b).0[k])));
    let counted = |of: fn(&Reading<f64>) -> Abc<u32>| {
        Abc(std::array::from_fn(|k| of(a).0[k].saturating_add(of(b).0[k])))
    };
    let mut sum = *b;
    sum.current = each(|of| of.current);
    sum.sensed = sensed(|of| of.sensed);
    sum.dc_link = a.dc_link + b.dc_link;
    sum.dc_link_clipped = a.dc_link_clipped || b.dc_link_clipped;
    sum.link_current = a.link_current + b.link_current;
    sum.link_sensed = worse(a.link_sensed, b.link_sensed);
    sum.terminal = each(|of| of.terminal);
    sum.terminal_sensed = sensed(|of| of.terminal_sensed);
    sum.counts.current = counted(|of| of.counts.current);
    sum.counts.dc_link = a.counts.dc_link.saturating_add(b.counts.dc_link);
    sum.counts.link_current = a.counts.link_current.saturating_add(b.counts.link_current);
    sum.counts.terminal = counted(|of| of.counts.terminal);
    sum
}
