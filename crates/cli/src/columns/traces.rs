//! The tables of a trace: waveform and events, with the columns of their CSV files.

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use standstill_interface::{Phase, Sensed};
use standstill_sim::{Event, Health, Snapshot, Trace};
use standstill_table::{Cell, Column, Format, Kind, TableError};

/// Function that receives the rows of a table, one after the other.
type Sink<'a> = &'a mut dyn FnMut(&[Cell<'_>]) -> Result<(), TableError>;

/// A column of a trace: its name, and how text files round its numbers. The number `parts` rounds to multiples of 1 / `parts`: 1e6 rounds
/// to 1e-6 of the unit. None for columns of text.
type Head = (Cow<'static, str>, Option<f64>);

/// Makes a column with this name and rounding.
const fn head(name: &'static str, parts: Option<f64>) -> Head {
    (Cow::Borrowed(name), parts)
}

const MICRO: Option<f64> = Some(1e6);
const NANO: Option<f64> = Some(1e9);
const PICO: Option<f64> = Some(1e12);

/// A table of a trace, with functions for its columns and its rows.
pub struct TraceTable {
    pub name: &'static str,
    columns: fn(&Trace) -> Vec<Head>,
    rows: fn(&Trace, Sink<'_>) -> Result<(), TableError>,
}

impl TraceTable {
    /// All tables: the waveform, the events, and the channels that a user's detector records.
    pub const ALL: [Self; 3] = [
        Self { name: "waveform", columns: waveform_columns, rows: waveform },
        Self { name: "events", columns: event_columns, rows: events },
        Self { name: "channels", columns: channel_columns, rows: channels },
    ];

    /// Returns the tables of this trace. The table of channels is included only if the detector has channels.
    pub fn of(trace: &Trace) -> impl Iterator<Item = Self> {
        let shows = !trace.own.names.is_empty();
        Self::ALL.into_iter().filter(move |table| shows || table.name != "channels")
    }

    /// Returns the table's columns for this trace. Sensors that the drive lacks have no column.
    pub fn columns(&self, trace: &Trace) -> Vec<Column> {
        let kind = |parts: Option<f64>| parts.map_or(Kind::Text, |_| Kind::Number);
        (self.columns)(trace).into_iter().map(|(name, parts)| Column::new(name, kind(parts))).collect()
    }

    /// Writes the table's rows. In CSV times are rounded to 1 ps, currents to 1 nA and voltages to 1 µV.
    pub fn rows(&self, trace: &Trace, format: Format, to: Sink<'_>) -> Result<(), TableError> {
        let columns = (self.columns)(trace);
        let mut rounded = |row: &[Cell<'_>]| {
            let mut row = row.to_vec();
            for (value, (_, parts)) in row.iter_mut().zip(&columns) {
                if let (Cell::Number(number), Some(parts)) = (value, parts) {
                    *number = round(*number, *parts);
                }
            }
            to(&row)
        };
        if format == Format::Csv { (self.rows)(trace, &mut rounded) } else { (self.rows)(trace, to) }
    }
}

/// Rounds a number to a multiple of 1 / `parts`. −0 becomes 0, because it would be printed as a negative number.
fn round(number: f64, parts: f64) -> f64 {
    (number * parts).round() / parts + 0.0
}

/// Function from a snapshot to its cell in a column.
type Value = fn(&Snapshot) -> Cell<'static>;

/// Columns that every waveform has, with their values. Voltages in V refer to the negative rail. Currents in A are of three kinds: in the
/// winding, from each leg's devices to the motor, and from the DC link into the bridge.
const WAVEFORM: [(Head, Value); 18] = [
    (head("t_s", PICO), |s| Cell::Number(s.time)),
    (head("i_a_A", NANO), |s| current(s.current[0])),
    (head("i_b_A", NANO), |s| current(s.current[1])),
    (head("i_c_A", NANO), |s| current(s.current[2])),
    (head("v_a_V", MICRO), |s| Cell::Number(s.potential[0])),
    (head("v_b_V", MICRO), |s| Cell::Number(s.potential[1])),
    (head("v_c_V", MICRO), |s| Cell::Number(s.potential[2])),
    (head("theta_deg", NANO), |s| Cell::Number(s.angle.to_degrees())),
    (head("mode_a", None), |s| s.modes[0].to_string().into()),
    (head("mode_b", None), |s| s.modes[1].to_string().into()),
    (head("mode_c", None), |s| s.modes[2].to_string().into()),
    (head("u_dc_V", MICRO), |s| Cell::Number(s.dc_link)),
    (head("omega_electrical_rad_per_s", NANO), |s| Cell::Number(s.speed)),
    (head("torque_Nm", NANO), |s| Cell::Number(s.torque)),
    (head("i_leg_a_A", NANO), |s| current(s.leg_current()[0])),
    (head("i_leg_b_A", NANO), |s| current(s.leg_current()[1])),
    (head("i_leg_c_A", NANO), |s| current(s.leg_current()[2])),
    (head("i_link_A", NANO), |s| current(s.link_current())),
];

/// Additional column for drives with comparators.
const COMPARATOR: Head = head("comparator", None);

/// Returns whether the drive has comparators.
fn has_comparators(trace: &Trace) -> bool {
    trace.snapshots.first().is_some_and(|snapshot| snapshot.comparator.is_some())
}

fn waveform_columns(trace: &Trace) -> Vec<Head> {
    let heads = WAVEFORM.into_iter().map(|(head, _)| head);
    heads.chain(has_comparators(trace).then_some(COMPARATOR)).collect()
}

/// Rounds a current to whole nanoamperes, as in all files, so that rounding errors of the integrator become zero.
fn current(current: f64) -> Cell<'static> {
    Cell::Number(round(current, 1e9))
}

fn waveform(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    for s in &trace.snapshots {
        let mut row: Vec<Cell<'_>> = WAVEFORM.iter().map(|(_, value)| value(s)).collect();
        row.extend(s.comparator.map(|state| Cell::Text(state.to_string().into())));
        to(&row)?;
    }
    Ok(())
}

/// Columns that every table of events has. Their currents and their voltage are the drive's readings.
const EVENTS: [Head; 8] = [
    head("t_s", PICO),
    head("event", None),
    head("phase", None),
    head("to", None),
    head("i_a_A", NANO),
    head("i_b_A", NANO),
    head("i_c_A", NANO),
    head("u_dc_V", MICRO),
];

/// Additional columns for drives that read their terminals.
const TERMINALS: [Head; 3] = [head("v_a_V", MICRO), head("v_b_V", MICRO), head("v_c_V", MICRO)];

/// Additional column for drives with a shunt in the DC link.
const LINK: Head = head("i_link_A", NANO);

/// Additional column for drives that capture the trips of their comparators.
const TICKS: Head = head("capture_ticks", NANO);

/// Returns the columns of the table of channels: the time in s, then each channel in the detector's own unit.
fn channel_columns(trace: &Trace) -> Vec<Head> {
    let names = trace.own.names.iter().map(|name| (Cow::Owned(name.clone()), PICO));
    [head("t_s", PICO)].into_iter().chain(names).collect()
}

fn channels(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    for (time, values) in &trace.own.rows {
        let row: Vec<Cell<'_>> = [time].into_iter().chain(values).map(|value| Cell::Number(*value)).collect();
        to(&row)?;
    }
    Ok(())
}

/// Returns three flags of the drive: it reads its terminals, it has a shunt in the DC link, and it captures the trips of its comparators.
/// The flags are inferred from the readings of the trace.
fn reads(trace: &Trace) -> [bool; 3] {
    let mut reads = [false; 3];
    for (_, event) in &trace.events {
        if let Event::Sample(reading) = event {
            reads[0] |= reading.terminal_sensed.0 != [Sensed::Hidden; 3];
            reads[1] |= reading.link_sensed != Sensed::Hidden;
            reads[2] |= reading.capture.is_some();
        }
    }
    reads
}

/// Returns the columns of the events. Columns of sensors that the drive does not have, or that never saw a value, are
/// left out.
fn event_columns(trace: &Trace) -> Vec<Head> {
    let [terminals, link, captures] = reads(trace);
    let mut columns = EVENTS.to_vec();
    columns.extend(TERMINALS.into_iter().filter(|_| terminals));
    columns.extend(link.then_some(LINK));
    columns.extend(captures.then_some(TICKS));
    columns
}

/// Returns the cell of a reading. The cell is empty if no sensor measured the value.
fn seen(value: f64, sensed: Sensed) -> Cell<'static> {
    if sensed == Sensed::Hidden { Cell::Empty } else { Cell::Number(value) }
}

fn letter(phase: Phase) -> Cell<'static> {
    phase.letter().to_string().into()
}

fn events(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    let columns = event_columns(trace).len();
    let [terminals, link, captures] = reads(trace);
    let mut log = trace.own.log.iter().peekable();
    let mut said = |until: f64, to: &mut dyn FnMut(&[Cell<'_>]) -> Result<(), TableError>| {
        while let Some((time, line)) = log.next_if(|(time, _)| *time < until) {
            let text = Cell::Text(line.as_str().into());
            let mut row = vec![Cell::Number(*time), "log".into(), Cell::Empty, text];
            row.resize(columns, Cell::Empty);
            to(&row)?;
        }
        Ok(())
    };
    for (time, event) in &trace.events {
        said(*time, to)?;
        let mut row = vec![Cell::Number(*time)];
        let word = |text: String| Cell::Text(text.into());
        let (name, phase, end) = match event {
            Event::Command => ("command", Cell::Empty, Cell::Empty),
            Event::Gate(phase, gate) => ("gate", letter(*phase), word(format!("{gate:?}").to_lowercase())),
            Event::Conduction(phase, mode) => ("conduction", letter(*phase), word(mode.to_string())),
            Event::LeftMap => ("left_map", Cell::Empty, Cell::Empty),
            Event::Motion(motion) => ("motion", Cell::Empty, word(format!("{motion:?}").to_lowercase())),
            Event::Sample(of) => {
                ("sample", of.capture.map_or(Cell::Empty, |capture| letter(capture.comparator)), Cell::Empty)
            }
            Event::Fault(broken, health) => {
                let is = if *health == Health::Whole { "whole again: " } else { "" };
                ("fault", Cell::Empty, word(format!("{is}{broken}")))
            }
            Event::Trip(phase) => ("trip", letter(*phase), Cell::Empty),
        };
        row.extend([name.into(), phase, end]);
        if let Event::Sample(of) = event {
            row.extend(Phase::ALL.map(|phase| seen(of.current[phase], of.sensed[phase])));
            row.push(Cell::Number(of.dc_link));
            if terminals {
                row.extend(Phase::ALL.map(|phase| seen(of.terminal[phase], of.terminal_sensed[phase])));
            }
            row.extend(link.then(|| seen(of.link_current, of.link_sensed)));
            let ticks = of.capture.map_or(Cell::Empty, |capture| Cell::Number(capture.ticks.into()));
            row.extend(captures.then_some(ticks));
        }
        row.resize(columns, Cell::Empty);
        to(&row)?;
    }
    said(f64::INFINITY, to)
}
