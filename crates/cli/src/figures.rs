//! The figures: what is drawn, from records and traces.

use standstill_campaign::Statistics;
use standstill_interface::{Abc, Angle, Phase};
use standstill_inverter::Conduction;
use standstill_plant::{OperatingPoint, PolarityPoint, Survey};
use standstill_report::figure::{Axis, Figure, Lane, Layer, Panel, Style};
use standstill_report::study::{self, ErrorCloud};
use standstill_sim::{Event, Snapshot, Trace};

use crate::log::Entry;

mod budget;
mod comparison;
mod detection;
mod fit;
mod odds;
mod require;
mod tune;

pub use budget::{Bar, over_angle, shares};
pub use comparison::comparison;
pub use detection::{detection, overlaid};
pub use fit::fit;
pub use odds::odds;
pub use require::{Judged, require, tradeoff};
pub use tune::tune;

const WIDTH: u32 = 900;

fn curve(label: &str, points: Vec<(f64, f64)>, style: Style) -> Layer {
    Layer::Line { label: Some(label.to_owned()), points, style }
}

/// A waveform between two times in s, over ms or µs.
struct Window<'a> {
    trace: &'a Trace,
    from: f64,
    to: f64,
    /// Time of the axis's zero in s, and its unit in s.
    origin: f64,
    unit: f64,
}

impl Window<'_> {
    fn snapshots(&self) -> impl Iterator<Item = &Snapshot> {
        self.trace.snapshots.iter().filter(|s| s.time >= self.from - 1e-9 && s.time <= self.to + 1e-9)
    }

    fn place(&self, time: f64) -> f64 {
        (time - self.origin) / self.unit
    }

    fn points(&self, value: impl Fn(&Snapshot) -> f64) -> Vec<(f64, f64)> {
        self.snapshots().map(|s| (self.place(s.time), value(s))).collect()
    }

    fn axis(&self, label: &str) -> Axis {
        let unit = if self.unit < 1e-4 { "µs" } else { "ms" };
        Axis::new(format!("{label} ({unit})")).range(self.place(self.from), self.place(self.to))
    }

    fn currents(&self, axis: Axis) -> Panel {
        Phase::ALL.into_iter().enumerate().fold(
            Panel { weight: 1.5, ..Panel::new(axis, Axis::new("current (A)")) },
            |panel, (k, phase)| {
                let label = format!("i_{}", phase.letter());
                panel.with(curve(&label, self.points(|s| s.current[k]), Style::PHASES[k]))
            },
        )
    }

    fn modes(&self, axis: Axis) -> Panel {
        let lanes = Phase::ALL
            .into_iter()
            .enumerate()
            .map(|(k, phase)| Lane { label: format!("leg {}", phase.letter()), spans: self.spans(k) })
            .collect();
        let categories = self.categories().iter().map(|mode| mode.to_string().replace('_', " ")).collect();
        Panel { weight: 0.7, ..Panel::new(axis, Axis::new("")) }.with(Layer::Lanes { lanes, categories })
    }

    /// The modes that legs of this kind have: a MOSFET's channel conducts both ways, an IGBT never backwards.
    fn categories(&self) -> Vec<Conduction> {
        let seen = |mode: &Conduction| self.snapshots().any(|s| s.modes.contains(mode));
        let backwards =
            |mode: &Conduction| matches!(mode, Conduction::UpperReverse | Conduction::LowerReverse);
        Conduction::ALL.into_iter().filter(|mode| !backwards(mode) || seen(mode)).collect()
    }

    /// Stretches of one conduction mode of leg `k`.
    fn spans(&self, k: usize) -> Vec<(f64, f64, usize)> {
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

/// Fig. 5 of the paper: voltage and current of the lines a-b and b-c.
pub fn line_pulses(trace: &Trace, entries: &[Entry], subtitle: String) -> Figure {
    let mut panels = Vec::new();
    for (first, second) in [(Phase::A, Phase::B), (Phase::B, Phase::C)] {
        let mut pulses = entries.iter().filter(|entry| entry.line() == Some(first));
        let Some(begin) = pulses.next() else { continue };
        let end = pulses.next_back().unwrap_or(begin).end();
        let from = begin.start.seconds();
        let window = Window { trace, from, to: end.seconds(), origin: from, unit: 1e-3 };
        let (f, s) = (first as usize, second as usize);
        let letters = (first.letter(), second.letter());
        let time = || window.axis("time from the line's first pulse");
        panels.push(Panel::new(time(), Axis::new(format!("voltage {}-{} (V)", letters.0, letters.1))).with(
            curve(
                &format!("v_{} − v_{}", letters.0, letters.1),
                window.points(|snapshot| snapshot.potential[f] - snapshot.potential[s]),
                Style::Blue,
            ),
        ));
        panels.push(Panel::new(time(), Axis::new("current (A)")).with(curve(
            &format!("i_{}, line {}-{}", letters.0, letters.0, letters.1),
            window.points(|snapshot| snapshot.current[f]),
            Style::PHASES[f],
        )));
    }
    Figure {
        title: "Line pulses and their currents (Fig. 5 of the paper)".to_owned(),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 860,
        panels,
    }
}

/// The two voltage vectors of the polarity test: i_d in the direction of each.
pub fn polarity(trace: &Trace, entries: &[Entry], axis_deg: f64, subtitle: String) -> Figure {
    let mut panel = Panel::new(
        Axis::new("time from the start of the vector (ms)"),
        Axis::new("current along the vector (A)"),
    );
    let names = ["vector at θ_e", "vector at θ_e + 180°"];
    for (k, entry) in entries.iter().filter(|entry| entry.is_vector()).take(2).enumerate() {
        let from = entry.start.seconds();
        let end = entry.end().seconds();
        let window = Window { trace, from, to: end + 0.05e-3, origin: from, unit: 1e-3 };
        let angle = Angle::from_degrees(axis_deg + 180.0 * k as f64);
        let along = |current: [f64; 3]| Abc(current).clarke().park(angle).d;
        let points = window.points(|s| along(s.current));
        panel = panel.with(curve(names[k], points, Style::nth(k)));
        let samples = trace.events.iter().filter_map(|(time, event)| match event {
            Event::Sample(current, _) if (time - end).abs() < 5e-6 => {
                Some((window.place(*time), along(*current)))
            }
            _ => None,
        });
        let label = format!("as the drive samples it at {}", ["θ_e", "θ_e + 180°"][k]);
        panel =
            panel.with(Layer::Points { label: Some(label), points: samples.collect(), style: Style::nth(k) });
    }
    Figure {
        title: "Polarity test: the larger current points north".to_owned(),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 440,
        panels: vec![panel],
    }
}

/// Error over the true angle as pages have it, with the paper's bound.
pub fn error_over_angle(cloud: &ErrorCloud, subtitle: String) -> Figure {
    let mut figure = study::error_over_angle("", Some(subtitle), cloud);
    for panel in &mut figure.panels {
        for y in [Statistics::LIMIT_DEG, -Statistics::LIMIT_DEG] {
            panel.layers.push(Layer::level(&format!("{y:+.0}°").replace('-', "−"), y));
        }
    }
    figure
}

/// Inductances over current, and what the polarity test sees.
pub fn magnetics(survey: &Survey, motor: &str) -> Figure {
    let over_d = |inductance: fn(&OperatingPoint) -> f64| {
        survey.along_d.iter().map(|p| (p.i_d, inductance(p) * 1e3)).collect()
    };
    let over_q = |inductance: fn(&OperatingPoint) -> f64| {
        survey.along_q.iter().map(|p| (p.i_q, inductance(p) * 1e3)).collect()
    };
    let inductances = Panel::new(Axis::new("current along the axis named (A)"), Axis::new("inductance (mH)"))
        .with(curve("L_d over i_d", over_d(|p| p.l_dd), Style::Blue))
        .with(curve("L_q over i_d", over_d(|p| p.l_qq), Style::Vermilion))
        .with(curve("L_d over i_q", over_q(|p| p.l_dd), Style::Black))
        .with(curve("L_q over i_q", over_q(|p| p.l_qq), Style::Green));
    let flux = Panel::new(Axis::new("current along the axis named (A)"), Axis::new("flux linkage (Wb)"))
        .with(curve("ψ_d over i_d", survey.along_d.iter().map(|p| (p.i_d, p.psi_d)).collect(), Style::Blue))
        .with(curve(
            "ψ_q over i_q",
            survey.along_q.iter().map(|p| (p.i_q, p.psi_q)).collect(),
            Style::Vermilion,
        ));
    let average = |inductance: fn(&PolarityPoint) -> f64| {
        survey.polarity.iter().map(|p| (p.current, inductance(p) * 1e3)).collect()
    };
    let polarity = Panel::new(
        Axis::new("current along the d-axis, either way (A)"),
        Axis::new("average inductance (mH)"),
    )
    .with(curve("towards north", average(|p| p.north), Style::Blue))
    .with(curve("towards south", average(|p| p.south), Style::Vermilion));
    Figure {
        title: format!("Magnetics of {motor}"),
        subtitle: Some("flux; incremental inductances; what a polarity test sees".to_owned()),
        width: WIDTH,
        height: 1000,
        panels: vec![flux, inductances, polarity],
    }
}
