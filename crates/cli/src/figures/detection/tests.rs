//! Tests of the figure of one detection.

use standstill_interface::Nanos;
use standstill_inverter::{Conduction, Gate};

use super::*;

/// Zero vectors in a wait, during which no current flows; from `BEGIN` on a pulse of 100 µs across two phases, up and down; then one
/// across two others, of the same length.
fn trace() -> Trace {
    let mut trace = Trace::new(5e-6);
    let pulse = |from: f64, time: f64| 8.0 * (1.0 - ((time - from) / 100e-6 - 1.0).abs()).max(0.0);
    let times = (0..600).map(|k| f64::from(k) * 5e-6);
    trace.snapshots.extend(times.map(|time| {
        let [first, second] = [BEGIN, BEGIN + 1e-3].map(|from| pulse(from, time));
        Snapshot {
            time,
            current: [first, second - first, -second],
            potential: [0.0; 3],
            dc_link: 550.0,
            angle: 0.0,
            speed: 0.0,
            torque: 0.0,
            modes: [Conduction::Blocked; 3],
            comparator: None,
        }
    }));
    let gate = |time: f64, phase, gate| (time, Event::Gate(phase, gate));
    // In the wait legs are connected and opened again, and the drive reads noise.
    trace.events.extend([
        gate(100e-6, Phase::A, Gate::Low),
        (300e-6, Event::Sample(Reading::measured(Nanos::ZERO, [0.01, -0.01, 0.0], 550.0))),
        gate(400e-6, Phase::A, Gate::Off),
        gate(BEGIN, Phase::A, Gate::High),
        (BEGIN + 100e-6, Event::Sample(Reading::measured(Nanos::ZERO, [7.9, -8.1, 0.1], 550.0))),
        gate(BEGIN + 100e-6, Phase::A, Gate::Off),
        gate(BEGIN + 1e-3, Phase::B, Gate::High),
        (BEGIN + 1.1e-3, Event::Sample(Reading::measured(Nanos::ZERO, [0.1, 7.9, -8.1], 550.0))),
    ]);
    trace
}

const BEGIN: f64 = 1e-3;

/// The points of a panel's curve of this name.
fn points(panel: &Panel, name: &str) -> Vec<(f64, f64)> {
    let named = panel.layers.iter().find_map(|layer| match layer {
        Layer::Line { label: Some(label), points, .. } if label == name => Some(points.clone()),
        _ => None,
    });
    named.unwrap_or_else(|| panic!("no curve {name}"))
}

#[test]
fn law_a_close_up_begins_at_the_gate_of_the_first_pulse_that_carries_current() {
    let figure = detection(&trace(), "a start", "test", Comparators::Common, None);
    // Currents, angle and legs of the whole; potentials, currents and legs of the first pulse; currents of the second.
    assert_eq!(figure.panels.len(), 7);
    for (panel, name, phase) in [(4, "phases a and b", "i_a"), (6, "phases b and c", "i_b")] {
        let panel = &figure.panels[panel];
        assert!(panel.x.label.starts_with(name), "{}", panel.x.label);
        let (low, high) = panel.x.range.expect("a range");
        assert!((low + 20.0).abs() < 1e-6 && (high - 220.0).abs() < 10.0, "{low} to {high} µs");
        // Nothing flows before the gate's edge, and from there on it rises by 8 A in 100 µs.
        for (at, current) in points(panel, phase) {
            let expected = 8.0 * (1.0 - (at / 100.0 - 1.0).abs()).max(0.0);
            assert!((current - expected).abs() < 1e-6, "{at} µs: {current} A");
        }
        // The panel leaves out the readings of the wait and shows those of the pulse.
        let read = panel.layers.iter().filter_map(|layer| match layer {
            Layer::Points { points, .. } => Some(points.clone()),
            _ => None,
        });
        let read: Vec<(f64, f64)> = read.flatten().collect();
        assert!(read.len() == 3 && read.iter().all(|(at, _)| (at - 100.0).abs() < 1e-6), "{read:?}");
    }
}

/// The figure also shows the readings of a drive without phase sensors: the link's current, the terminals, and where a comparator tripped.
#[test]
fn law_a_close_up_shows_link_terminals_and_trips() {
    let mut trace = trace();
    for snapshot in &mut trace.snapshots {
        snapshot.modes = [Conduction::UpperSwitch, Conduction::LowerSwitch, Conduction::LowerSwitch];
    }
    let hidden = standstill_interface::Abc([Sensed::Hidden; 3]);
    let reading = Reading {
        sensed: hidden,
        link_current: 7.7,
        link_sensed: Sensed::Measured,
        terminal: standstill_interface::Abc([540.0, 1.0, 270.0]),
        terminal_sensed: standstill_interface::Abc([Sensed::Measured; 3]),
        ..Reading::measured(Nanos::ZERO, [0.0; 3], 550.0)
    };
    trace.events = vec![
        (BEGIN, Event::Command),
        (BEGIN, Event::Gate(Phase::A, Gate::High)),
        (BEGIN + 50e-6, Event::Trip(Phase::A)),
        (BEGIN + 90e-6, Event::Sample(reading)),
    ];
    let figure = detection(&trace, "a start", "test", Comparators::Common, None);
    let marks = |panel: usize, name: &str| {
        figure.panels[panel].layers.iter().find_map(|layer| match layer {
            Layer::Points { label: Some(label), points, .. } if label == name => Some(points.clone()),
            _ => None,
        })
    };
    let at = |of: Option<Vec<(f64, f64)>>| {
        of.expect("marks")
            .iter()
            .map(|(at, value)| (at.round(), (value * 10.0).round() / 10.0))
            .collect::<Vec<_>>()
    };
    assert_eq!(at(marks(4, "out of the DC link as it is read")), [(90.0, 7.7)]);
    // Half way up, where 4 A flow.
    assert_eq!(at(marks(4, "comparator trips")), [(50.0, 4.0)]);
    let level = points(&figure.panels[4], "level of the comparator");
    assert!(level.len() == 2 && level.iter().all(|(_, value)| (value - 4.0).abs() < 1e-9), "{level:?}");
    for (name, volts) in [("v_a", 540.0), ("v_b", 1.0), ("v_c", 270.0)] {
        assert_eq!(at(marks(3, &format!("{name} as it is read"))), [(90.0, volts)]);
    }
    // No sensor sees a phase: there is no entry for it.
    assert!(marks(4, "i_a as it is read").is_none());
}

#[test]
fn law_first_pulses_of_several_runs_are_laid_over_one_another_from_their_gate_edges_on() {
    let mut late = trace();
    for snapshot in &mut late.snapshots {
        snapshot.time += 0.5e-3;
    }
    for (time, _) in &mut late.events {
        *time += 0.5e-3;
    }
    let runs = [("early".to_owned(), trace()), ("late".to_owned(), late)];
    let figure = overlaid(&runs, "two", "");
    let panel = figure.panels.last().expect("the first pulses");
    let [early, late] = ["early", "late"].map(|name| points(panel, name));
    assert_eq!(early.len(), late.len());
    for (a, b) in early.iter().zip(&late) {
        assert!((a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6, "{a:?} {b:?}");
    }
}
