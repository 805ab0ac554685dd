//! The figures of commands, drawn from records and traces.

use standstill_campaign::Statistics;
use standstill_interface::{Abc, Angle, Phase};
use standstill_plant::{OperatingPoint, PolarityPoint, Survey};
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_report::study::{self, ErrorCloud};
use standstill_sim::{Event, Trace};

use self::parts::Window;
use crate::log::Entry;

mod budget;
mod comparison;
mod detection;
mod fit;
mod odds;
mod parts;
mod require;
#[cfg(test)]
pub mod tests;
mod tune;

pub use budget::{Bar, over_angle, shares};
pub use comparison::comparison;
pub use detection::{detection, overlaid};
pub use fit::fit;
pub use odds::odds;
pub use require::{require, tradeoff};
pub use tune::tune;

/// Draws Fig. 5 of the paper: voltage and current of the lines a-b and b-c.
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
            Layer::line(
                &format!("v_{} − v_{}", letters.0, letters.1),
                Style::Blue,
                window.points(|snapshot| snapshot.potential[f] - snapshot.potential[s]),
            ),
        ));
        panels.push(Panel::new(time(), Axis::new("current (A)")).with(Layer::line(
            &format!("i_{}, line {}-{}", letters.0, letters.0, letters.1),
            Style::PHASES[f],
            window.points(|snapshot| snapshot.current[f]),
        )));
    }
    Figure::new("Line pulses and their currents (Fig. 5 of the paper)", subtitle, 860, panels)
}

/// Draws the polarity test. Two curves over time show the current along each of the two voltage vectors.
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
        panel = panel.with(Layer::line(names[k], Style::nth(k), points));
        let samples = trace.events.iter().filter_map(|(time, event)| match event {
            Event::Sample(reading) if (time - end).abs() < 5e-6 => {
                Some((window.place(*time), along(reading.current.0)))
            }
            _ => None,
        });
        let label = format!("as the drive samples it at {}", ["θ_e", "θ_e + 180°"][k]);
        panel =
            panel.with(Layer::Points { label: Some(label), points: samples.collect(), style: Style::nth(k) });
    }
    Figure::new("Polarity test: the larger current points north", subtitle, 440, [panel])
}

/// Draws the angle error over the true angle, as on report pages, and the paper's bound of ± [`Statistics::LIMIT_DEG`].
pub fn error_over_angle(cloud: &ErrorCloud, subtitle: String) -> Figure {
    let mut figure = study::error_over_angle("", Some(subtitle), cloud);
    for panel in &mut figure.panels {
        for y in [Statistics::LIMIT_DEG, -Statistics::LIMIT_DEG] {
            panel.layers.push(Layer::level(&format!("{y:+.0}°").replace('-', "−"), y));
        }
    }
    figure
}

/// Draws flux linkages and incremental inductances over current, and the average inductances of a polarity test towards
/// north and south.
pub fn magnetics(survey: &Survey, motor: &str) -> Figure {
    let over_d = |inductance: fn(&OperatingPoint) -> f64| {
        survey.along_d.iter().map(move |p| (p.i_d, inductance(p) * 1e3))
    };
    let over_q = |inductance: fn(&OperatingPoint) -> f64| {
        survey.along_q.iter().map(move |p| (p.i_q, inductance(p) * 1e3))
    };
    let inductances = Panel::new(Axis::new("current along the axis named (A)"), Axis::new("inductance (mH)"))
        .with(Layer::line("L_d over i_d", Style::Blue, over_d(|p| p.l_dd)))
        .with(Layer::line("L_q over i_d", Style::Vermilion, over_d(|p| p.l_qq)))
        .with(Layer::line("L_d over i_q", Style::Black, over_q(|p| p.l_dd)))
        .with(Layer::line("L_q over i_q", Style::Green, over_q(|p| p.l_qq)));
    let flux = Panel::new(Axis::new("current along the axis named (A)"), Axis::new("flux linkage (Wb)"))
        .with(Layer::line("ψ_d over i_d", Style::Blue, survey.along_d.iter().map(|p| (p.i_d, p.psi_d))))
        .with(Layer::line("ψ_q over i_q", Style::Vermilion, survey.along_q.iter().map(|p| (p.i_q, p.psi_q))));
    let average = |inductance: fn(&PolarityPoint) -> f64| {
        survey.polarity.iter().map(move |p| (p.current, inductance(p) * 1e3))
    };
    let polarity = Panel::new(
        Axis::new("current along the d-axis, either way (A)"),
        Axis::new("average inductance (mH)"),
    )
    .with(Layer::line("towards north", Style::Blue, average(|p| p.north)))
    .with(Layer::line("towards south", Style::Vermilion, average(|p| p.south)));
    Figure::new(
        format!("Magnetics of {motor}"),
        "flux; incremental inductances; what a polarity test sees",
        1000,
        [flux, inductances, polarity],
    )
}
