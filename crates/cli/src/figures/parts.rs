//! Parts that several figures use.

use standstill_interface::Phase;
use standstill_inverter::Conduction;
use standstill_report::figure::{Axis, Lane, Layer, Panel, Style};
use standstill_sim::{Snapshot, Trace};

/// Returns the smallest and the largest of the finite numbers.
pub fn ends(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    let usable = numbers.filter(|number| number.is_finite());
    usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// A window of a waveform between two times in s. The time axis is in ms or µs.
pub struct Window<'a> {
    pub trace: &'a Trace,
    pub from: f64,
    pub to: f64,
    /// Time in s at the zero of the axis. The next field, `unit`, is the unit of the axis in s.
    pub origin: f64,
    pub unit: f64,
}

impl Window<'_> {
    pub fn snapshots(&self) -> impl Iterator<Item = &Snapshot> {
        self.trace.snapshots.iter().filter(|s| s.time >= self.from - 1e-9 && s.time <= self.to + 1e-9)
    }

    pub fn place(&self, time: f64) -> f64 {
        (time - self.origin) / self.unit
    }

    pub fn points(&self, value: impl Fn(&Snapshot) -> f64) -> Vec<(f64, f64)> {
        self.snapshots().map(|s| (self.place(s.time), value(s))).collect()
    }

    pub fn axis(&self, label: &str) -> Axis {
        let unit = if self.unit < 1e-4 { "µs" } else { "ms" };
        Axis::new(format!("{label} ({unit})")).range(self.place(self.from), self.place(self.to))
    }

    pub fn currents(&self, axis: Axis) -> Panel {
        Phase::ALL.into_iter().enumerate().fold(
            Panel { weight: 1.5, ..Panel::new(axis, Axis::new("current (A)")) },
            |panel, (k, phase)| {
                let label = format!("i_{}", phase.letter());
                panel.with(Layer::line(&label, Style::PHASES[k], self.points(|s| s.current[k])))
            },
        )
    }

    pub fn modes(&self, axis: Axis) -> Panel {
        let lanes = Phase::ALL
            .into_iter()
            .enumerate()
            .map(|(k, phase)| Lane { label: format!("leg {}", phase.letter()), spans: self.spans(k) })
            .collect();
        let categories = self.categories().iter().map(|mode| mode.to_string().replace('_', " ")).collect();
        Panel { weight: 0.7, ..Panel::new(axis, Axis::new("")) }.with(Layer::Lanes { lanes, categories })
    }

    /// Returns all conduction modes for the legend. Omits the reverse modes if no leg has them in this window. Only MOSFETs have reverse
    /// modes, because their channel conducts in both directions.
    pub fn categories(&self) -> Vec<Conduction> {
        let seen = |mode: &Conduction| self.snapshots().any(|s| s.modes.contains(mode));
        let backwards =
            |mode: &Conduction| matches!(mode, Conduction::UpperReverse | Conduction::LowerReverse);
        Conduction::ALL.into_iter().filter(|mode| !backwards(mode) || seen(mode)).collect()
    }

    /// Returns the intervals of time in which leg `k` keeps one conduction mode. Each entry contains the begin and the end in the unit of
    /// the axis, and the mode's index in [`Window::categories`].
    pub fn spans(&self, k: usize) -> Vec<(f64, f64, usize)> {
        let categories = self.categories();
        let category = |mode| categories.iter().position(|known| *known == mode).unwrap_or(0);
        let mut spans: Vec<(f64, f64, usize)> = Vec::new();
        for s in self.snapshots() {
            let (at, category) = (self.place(s.time), category(s.modes[k]));
            match spans.last_mut() {
                Some(last) if last.2 == category => last.1 = at,
                Some(last) => {
                    last.1 = at;
                    spans.push((at, at, category));
                }
                None => spans.push((at, at, category)),
            }
        }
        spans
    }
}
