//! The tables of a trace: waveform and events, with the columns of their CSV files.

use standstill_inverter::Conduction;
use standstill_sim::{Event, Snapshot, Trace};
use standstill_table::{Column, Kind, TableError, Value};

/// Takes rows.
type Sink<'a> = &'a mut dyn FnMut(&[Value<'_>]) -> Result<(), TableError>;

/// A table of a trace: its name, its columns and its rows.
pub struct TraceTable {
    pub name: &'static str,
    columns: &'static [(&'static str, Kind)],
    pub rows: fn(&Trace, Sink<'_>) -> Result<(), TableError>,
}

impl TraceTable {
    /// Both tables.
    pub const ALL: [Self; 2] = [
        Self { name: "waveform", columns: &WAVEFORM, rows: waveform },
        Self { name: "events", columns: &EVENTS, rows: events },
    ];

    pub fn columns(&self) -> Vec<Column> {
        self.columns.iter().map(|(name, kind)| Column::new(*name, *kind)).collect()
    }
}

const WAVEFORM: [(&str, Kind); 14] = [
    ("t_s", Kind::Number),
    ("i_a_A", Kind::Number),
    ("i_b_A", Kind::Number),
    ("i_c_A", Kind::Number),
    ("v_a_V", Kind::Number),
    ("v_b_V", Kind::Number),
    ("v_c_V", Kind::Number),
    ("theta_deg", Kind::Number),
    ("mode_a", Kind::Text),
    ("mode_b", Kind::Text),
    ("mode_c", Kind::Text),
    ("u_dc_V", Kind::Number),
    ("omega_electrical_rad_per_s", Kind::Number),
    ("torque_Nm", Kind::Number),
];

/// The currents into the motor as files have them. A blocked leg carries none; what the integrator leaves of it is not one.
pub fn currents(s: &Snapshot) -> [f64; 3] {
    std::array::from_fn(|k| {
        let digits = (s.current[k] * 1e9).round() / 1e9;
        // Adding zero turns −0 into 0, which would otherwise print as a negative current.
        if s.modes[k] == Conduction::Blocked { 0.0 } else { digits + 0.0 }
    })
}

/// Voltages against the negative rail, currents into the motor.
fn waveform(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    for s in &trace.snapshots {
        let number = |value: f64| Value::Number(value);
        let [a, b, c] = currents(s).map(number);
        let [va, vb, vc] = s.potential.map(number);
        let [ma, mb, mc] = s.modes.map(|mode| Value::Text(mode.to_string().into()));
        let angle = number(s.angle.to_degrees());
        let end = [s.dc_link, s.speed, s.torque].map(number);
        let [link, speed, torque] = end;
        to(&[number(s.time), a, b, c, va, vb, vc, angle, ma, mb, mc, link, speed, torque])?;
    }
    Ok(())
}

const EVENTS: [(&str, Kind); 8] = [
    ("t_s", Kind::Number),
    ("event", Kind::Text),
    ("phase", Kind::Text),
    ("to", Kind::Text),
    ("i_a_A", Kind::Number),
    ("i_b_A", Kind::Number),
    ("i_c_A", Kind::Number),
    ("u_dc_V", Kind::Number),
];

fn events(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    for (time, event) in &trace.events {
        let mut row = [const { Value::Empty }; 8];
        row[0] = Value::Number(*time);
        row[1] = match event {
            Event::Command => "command",
            Event::Gate(..) => "gate",
            Event::Conduction(..) => "conduction",
            Event::LeftMap => "left_map",
            Event::Motion(_) => "motion",
            Event::Sample(..) => "sample",
        }
        .into();
        match event {
            Event::Gate(phase, gate) => {
                row[2] = phase.letter().to_string().into();
                row[3] = format!("{gate:?}").to_lowercase().into();
            }
            Event::Conduction(phase, mode) => {
                row[2] = phase.letter().to_string().into();
                row[3] = mode.to_string().into();
            }
            Event::Motion(motion) => row[3] = format!("{motion:?}").to_lowercase().into(),
            Event::Sample(currents, link) => {
                for (cell, value) in row[4..].iter_mut().zip(currents.iter().chain([link])) {
                    *cell = Value::Number(*value);
                }
            }
            Event::Command | Event::LeftMap => {}
        }
        to(&row)?;
    }
    Ok(())
}
