//! Figures of one detection: the whole detection, and close-ups of its pulses.

use std::collections::BTreeSet;

use standstill_interface::{Phase, Reading, Sensed};
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_sim::{Comparators, Event, Snapshot, Trace};

use super::parts::Window;

/// Share of the trace's largest current above which a snapshot belongs to a pulse.
const CARRIES: f64 = 0.03;

/// Length in s of the close-up of a pulse with PWM. The close-up is longer if the first [`GATES`] gate edges take longer.
const LONGEST: f64 = 400e-6;
/// Largest number of gate edges of a pulse without PWM.
const GATES: usize = 12;
/// Time in s that a close-up shows before and after the pulse.
const BEFORE: f64 = 20e-6;

/// Largest number of samples that are drawn as marks.
const MOST_SAMPLES: usize = 400;

/// A period with current, from `from` to `to` in s. `phases` are the two phases with the largest currents at the peak.
struct Pulse {
    from: f64,
    to: f64,
    phases: BTreeSet<usize>,
}

/// Adds whole turns to the detector's angle so that the sum is nearest to the rotor's angle. All angles are in rad.
fn near(estimate: f64, angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    estimate + turn * ((angle - estimate) / turn).round()
}

fn largest(snapshot: &Snapshot) -> f64 {
    snapshot.current.iter().fold(0.0, |largest: f64, current| largest.max(current.abs()))
}

/// Returns all pulses that carry current.
fn pulses(trace: &Trace) -> Vec<Pulse> {
    let peak = trace.snapshots.iter().map(largest).fold(0.0, f64::max);
    let carries = |snapshot: &Snapshot| largest(snapshot) > CARRIES * peak;
    let runs = trace.snapshots.chunk_by(|a, b| carries(a) == carries(b));
    let pulse = |run: &[Snapshot]| {
        let top = run.iter().max_by(|a, b| largest(a).total_cmp(&largest(b)))?;
        let mut phases = [0, 1, 2];
        phases.sort_by(|a, b| top.current[*b].abs().total_cmp(&top.current[*a].abs()));
        // The last gate edge before the current.
        let gate = |(time, event): &(f64, Event)| matches!(event, Event::Gate(..)).then_some(*time);
        let began = trace.events.iter().filter_map(gate).take_while(|time| *time <= run[0].time).last();
        let from = began.unwrap_or(run[0].time).max(run[0].time - LONGEST);
        // Without PWM the run is one pulse, which is shown whole.
        let switched = trace.events.iter().filter_map(gate).filter(|time| *time >= from).nth(GATES);
        let most = switched.map_or(f64::INFINITY, |time| (time - from).max(LONGEST));
        let to = run[run.len() - 1].time.min(from + most);
        Some(Pulse { from, to, phases: BTreeSet::from([phases[0], phases[1]]) })
    };
    runs.filter(|run| carries(&run[0])).filter_map(pulse).collect()
}

/// Function that returns one value of a reading. Returns none if no sensor measures the value.
type Value<'a> = &'a dyn Fn(&Reading<f64>) -> Option<f64>;

/// Returns the current of a phase in a reading, in A. Returns none if no sensor measures this current.
fn seen(reading: &Reading<f64>, phase: Phase) -> Option<f64> {
    (reading.sensed[phase] != Sensed::Hidden).then_some(reading.current[phase])
}

impl Window<'_> {
    /// Returns one value of each of the drive's samples within the window, with the sample's time in the window's unit.
    fn samples(&self, value: Value<'_>) -> Vec<(f64, f64)> {
        let within = |(time, event): &(f64, Event)| match event {
            Event::Sample(reading) if (self.from..=self.to).contains(time) => {
                Some((self.place(*time), value(reading)?))
            }
            _ => None,
        };
        self.trace.events.iter().filter_map(within).collect()
    }

    /// Adds one value of the samples to a panel as marks. Adds nothing if no sensor measured the value, or if there are more than
    /// [`MOST_SAMPLES`] samples.
    fn with_read(&self, panel: Panel, name: &str, style: Style, value: Value<'_>) -> Panel {
        let points = self.samples(value);
        if points.is_empty() || points.len() > MOST_SAMPLES {
            return panel;
        }
        panel.with(Layer::points(&format!("{name} as it is read"), style, points))
    }

    /// Adds the sampled currents of the phases and of the DC link.
    fn with_samples(&self, mut panel: Panel) -> Panel {
        for (k, phase) in Phase::ALL.into_iter().enumerate() {
            let name = format!("i_{}", phase.letter());
            panel = self.with_read(panel, &name, Style::PHASES[k], &|reading| seen(reading, phase));
        }
        self.with_read(panel, "out of the DC link", Style::Orange, &|reading| {
            (reading.link_sensed != Sensed::Hidden).then_some(reading.link_current)
        })
    }

    /// Adds each trip of a comparator to the curve of the monitored current. A line at the comparator's level extends from the begin of the
    /// command to the trip.
    fn with_trips(&self, mut panel: Panel, comparators: Comparators) -> Panel {
        let (mut command, mut trips) = (self.from, Vec::new());
        for (time, event) in &self.trace.events {
            match event {
                Event::Command => command = *time,
                Event::Trip(phase) if (self.from..=self.to).contains(time) => {
                    let there = self.snapshots().take_while(|at| at.time <= *time + 1e-12).last();
                    let watched = there.map(|at| match comparators {
                        Comparators::Common => at.link_current(),
                        Comparators::PerLeg => at.current[*phase as usize],
                    });
                    trips.extend(watched.map(|level| (command.max(self.from), *time, level)));
                }
                _ => {}
            }
        }
        for (from, to, level) in &trips {
            let ends = vec![(self.place(*from), *level), (self.place(*to), *level)];
            panel = panel.with(Layer::line("level of the comparator", Style::Green, ends));
        }
        if trips.is_empty() {
            return panel;
        }
        let marks = trips.iter().map(|(_, time, level)| (self.place(*time), *level));
        panel.with(Layer::points("comparator trips", Style::Green, marks))
    }

    /// Adds the current out of the DC link: the sum of the currents of the legs whose upper device conducts.
    fn with_link(&self, panel: Panel) -> Panel {
        // The first layer, so that the phase currents lie above it: it equals one of them or a sum of two.
        let mut panel = panel;
        panel
            .layers
            .insert(0, Layer::line("out of the DC link", Style::Orange, self.points(Snapshot::link_current)));
        panel
    }
}

/// Draws a whole detection and close-ups. Each pair of phases has one close-up, which shows the first pulse with current on this pair.
/// `conditions` names motor, method and errors. `comparators` states which current the comparators monitor. `estimate` is the detector's
/// angle in rad, if one was found.
pub fn detection(
    trace: &Trace,
    title: &str,
    conditions: &str,
    comparators: Comparators,
    estimate: Option<f64>,
) -> Figure {
    let end = trace.snapshots.last().map_or(1e-3, |s| s.time);
    let whole = Window { trace, from: 0.0, to: end, origin: 0.0, unit: 1e-3 };
    let time = || whole.axis("time");
    let mut panels = vec![whole.currents(time())];
    panels.push(angles(&whole, time(), estimate));
    panels.push(whole.modes(time()));
    let mut seen: Vec<BTreeSet<usize>> = Vec::new();
    for pulse in pulses(trace) {
        if seen.contains(&pulse.phases) || seen.len() == 3 {
            continue;
        }
        let to = pulse.to + BEFORE;
        let near = Window { trace, from: pulse.from - BEFORE, to, origin: pulse.from, unit: 1e-6 };
        let names: Vec<String> = pulse.phases.iter().map(|k| Phase::ALL[*k].letter().to_string()).collect();
        let close = || near.axis(&format!("phases {}: time from the pulse's gate edge", names.join(" and ")));
        let currents = near.with_trips(near.with_samples(near.currents(close())), comparators);
        let currents = near.with_link(currents);
        if seen.is_empty() {
            panels.extend([potentials(&near, close()), currents, near.modes(close())]);
        } else {
            panels.push(Panel { legend: false, ..currents });
        }
        seen.push(pulse.phases);
    }
    Figure::new(
        format!("One detection: {title}"),
        format!(
            "{conditions}; above: from start to end; below: the first pulse, and the first of each other line"
        ),
        1000 + 230 * u32::try_from(seen.len().saturating_sub(1)).unwrap_or(0),
        panels,
    )
}

/// Draws the rotor's angle, and the detector's estimate (in rad) if there is one.
fn angles(whole: &Window<'_>, axis: Axis, estimate: Option<f64>) -> Panel {
    let panel = Panel { weight: 0.8, ..Panel::new(axis, Axis::new("electrical angle (°)")) };
    let angle = whole.points(|s| s.angle.to_degrees());
    let last = whole.snapshots().last().map_or(0.0, |s| s.angle);
    let panel = panel.with(Layer::line("rotor", Style::Blue, angle));
    match estimate.map(|estimate| near(estimate, last).to_degrees()) {
        Some(found) => {
            let ends = vec![(whole.place(whole.from), found), (whole.place(whole.to), found)];
            panel.with(Layer::line("as it was found", Style::Vermilion, ends))
        }
        None => panel,
    }
}

fn potentials(near: &Window<'_>, axis: Axis) -> Panel {
    Phase::ALL.into_iter().enumerate().fold(
        Panel::new(axis, Axis::new("potential (V)")),
        |panel, (k, phase)| {
            let label = format!("v_{} against the negative rail", phase.letter());
            let panel = panel.with(Layer::line(&label, Style::PHASES[k], near.points(|s| s.potential[k])));
            let name = format!("v_{}", phase.letter());
            near.with_read(panel, &name, Style::PHASES[k], &|reading| {
                (reading.terminal_sensed[phase] != Sensed::Hidden).then_some(reading.terminal[phase])
            })
        },
    )
}

/// Ratio of the longest to the shortest detection above which each panel has its own time axis.
const UNLIKE: f64 = 4.0;

/// Draws detections with several settings. Each detection has a panel with its currents, and all these panels have the same scale. Common
/// panels show the movement of the rotor, if it moved, and close-ups of each detection's first pulse. A close-up begins at the pulse's gate
/// edge and contains the drive's samples.
pub fn overlaid(runs: &[(String, Trace)], title: &str, subtitle: &str) -> Figure {
    let ends = || runs.iter().filter_map(|(_, trace)| trace.snapshots.last()).map(|s| s.time);
    let (longest, shortest) = (ends().fold(0.0, f64::max), ends().fold(f64::INFINITY, f64::min));
    let window = |trace, to| Window { trace, from: 0.0, to, origin: 0.0, unit: 1e-3 };
    let all = runs.iter().flat_map(|(_, trace)| &trace.snapshots).flat_map(|s| s.current);
    let (least, most) = all.fold((0.0f64, 0.0f64), |(low, high), i| (low.min(i), high.max(i)));
    let margin = 0.06 * (most - least).max(1e-9);
    let mut panels = Vec::new();
    for (name, trace) in runs {
        let end = trace.snapshots.last().map_or(longest, |s| s.time);
        let whole = window(trace, if longest > UNLIKE * shortest { end } else { longest });
        let mut panel = whole.currents(whole.axis("time")).titled(name);
        panel.y = panel.y.range(least - margin, most + margin);
        (panel.weight, panel.legend) = (1.0, panels.is_empty());
        panels.push(panel);
    }
    let moved = |trace: &Trace, s: &Snapshot| (s.angle - trace.snapshots[0].angle).to_degrees();
    if runs.iter().any(|(_, trace)| trace.snapshots.iter().any(|s| moved(trace, s).abs() > 1e-3)) {
        let axis = runs
            .first()
            .map_or_else(|| Axis::new("time (ms)"), |(_, trace)| window(trace, longest).axis("time"));
        let panel = Panel::new(axis, Axis::new("rotor moved (°)"));
        panels.push(runs.iter().enumerate().fold(panel, |panel, (k, (name, trace))| {
            panel.with(Layer::line(name, Style::nth(k), window(trace, longest).points(|s| moved(trace, s))))
        }));
    }
    panels.extend(first_pulses(runs).map(|panel| Panel { weight: 1.6, ..panel }));
    let height = 200 + 190 * u32::try_from(panels.len()).unwrap_or(3);
    Figure::new(title, subtitle, height, panels)
}

/// Draws the first pulse of each run as a curve with marks. The curve shows the phase with the largest current in the first run.
fn first_pulses(runs: &[(String, Trace)]) -> Option<Panel> {
    let firsts: Vec<(usize, Pulse)> = runs
        .iter()
        .enumerate()
        .filter_map(|(k, (_, trace))| Some((k, pulses(trace).into_iter().next()?)))
        .collect();
    let phase = *firsts.first()?.1.phases.first()?;
    let length = firsts.iter().map(|(_, pulse)| pulse.to - pulse.from).fold(0.0, f64::max);
    let letter = Phase::ALL[phase].letter();
    let near = |k: usize, pulse: &Pulse| Window {
        trace: &runs[k].1,
        from: pulse.from - BEFORE,
        to: pulse.from + length + BEFORE,
        origin: pulse.from,
        unit: 1e-6,
    };
    let axis = near(firsts[0].0, &firsts[0].1).axis("first pulse: time from its gate edge");
    let label = format!("i_{letter} (A), marks as read");
    let panel =
        firsts.iter().fold(Panel::new(axis, Axis::new(label)), |panel, (k, pulse)| {
            let (name, near) = (&runs[*k].0, near(*k, pulse));
            let samples = near.samples(&|reading| seen(reading, Phase::ALL[phase]));
            panel
                .with(Layer::line(name, Style::nth(*k), near.points(|s| s.current[phase])))
                .with(Layer::points(name, Style::nth(*k), samples))
        });
    Some(panel)
}

#[cfg(test)]
mod tests;
