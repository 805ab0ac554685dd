//! The command that is being carried out.

use standstill_interface::{Abc, Nanos, Reading, Sampling, Sensed};

/// Progress of the command that is being carried out.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// Time at which the command began, since the start of the run.
    pub start: Nanos,
    /// Time at which the command ends, since the start of the run.
    pub end: Nanos,
    /// Instants at which the command asks for samples.
    pub sampling: Sampling,
    /// Number of the next trigger after the pending one.
    pub number: u32,
    /// The pending trigger: its nominal time since the begin of the command, and its actual time since the start of the
    /// run, with delay and jitter.
    pub pending: Option<(Nanos, Nanos)>,
    /// Number of phases of the pending sample that the converter has already taken.
    pub taken: usize,
    /// Phase currents in A of the pending sample; valid for the phases that are already converted.
    pub current: [f64; 3],
    /// Voltage in V of the DC link in the pending sample.
    pub dc_link: f64,
    /// Voltages of the terminals in V, which are converted together with the DC link's.
    pub terminal: [f64; 3],
    /// Number of conversions of the pending sample so far.
    pub conversions: u8,
    /// Time of the first phase's conversion, since the start of the run.
    pub converted_at: Nanos,
    /// Sum of the conversions of the pending sample so far; none before the first one.
    pub sum: Option<Reading<f64>>,
}

impl Course {
    /// Progress before the first command.
    pub const NONE: Self = Self {
        start: Nanos::ZERO,
        end: Nanos::ZERO,
        sampling: Sampling::NONE,
        number: 0,
        pending: None,
        taken: 0,
        current: [0.0; 3],
        dc_link: 0.0,
        terminal: [0.0; 3],
        conversions: 0,
        converted_at: Nanos::ZERO,
        sum: None,
    };

    /// Converts the present values: all phases at once without skew, else one phase per call, `skew` apart. Returns
    /// the currents in A and the DC link's voltage in V once the sample is complete.
    pub fn converted(&mut self, current: [f64; 3], dc_link: f64, skew: Nanos) -> Option<([f64; 3], f64)> {
        if let (0, Some((_, at))) = (self.taken, self.pending) {
            self.converted_at = at;
        }
        if skew == Nanos::ZERO {
            return Some((current, dc_link));
        }
        if self.taken == 0 {
            self.dc_link = dc_link;
        }
        self.current[self.taken] = current[self.taken];
        self.taken += 1;
        if self.taken < 3 {
            self.pending = self.pending.map(|(nominal, at)| (nominal, (at + skew).min(self.end)));
            return None;
        }
        self.taken = 0;
        Some((self.current, self.dc_link))
    }

    /// Adds one conversion of all phases to a sample that averages `count` conversions. The next conversion is due
    /// `apart` later, or as soon as the present one is complete. Returns the mean once all conversions are done.
    pub fn averaged(&mut self, reading: Reading<f64>, count: u8, apart: Nanos) -> Option<Reading<f64>> {
        let sum = self.sum.map_or(reading, |sum| plus(&sum, &reading));
        self.conversions += 1;
        if self.conversions < count {
            self.sum = Some(sum);
            let next = self.converted_at + apart;
            self.pending = self.pending.map(|(nominal, at)| (nominal, next.max(at).min(self.end)));
            return None;
        }
        (self.conversions, self.sum) = (0, None);
        let n = f64::from(count);
        Some(Reading {
            current: sum.current.map(|value| value / n),
            dc_link: sum.dc_link / n,
            link_current: sum.link_current / n,
            terminal: sum.terminal.map(|value| value / n),
            ..sum
        })
    }
}

/// Adds the values and codes of two conversions. The sum has the worse status of both, and the capture of the later
/// one.
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
