//! The tables of a trace: waveform and events, with the columns of their CSV files.

use standstill_sim::{Event, Trace};
use standstill_table::{Column, Format, Kind, TableError, Value};

/// Receiver of a table's rows.
type Sink<'a> = &'a mut dyn FnMut(&[Value<'_>]) -> Result<(), TableError>;

/// A column of a trace: its name, and for numbers in text the number of parts into which the unit is divided.
type Head = (&'static str, Option<f64>);

const MICRO: Option<f64> = Some(1e6);
const NANO: Option<f64> = Some(1e9);
const PICO: Option<f64> = Some(1e12);

/// A table of a trace: its name, its columns and its rows.
pub struct TraceTable {
    pub name: &'static str,
    columns: fn(&Trace) -> &'static [Head],
    rows: fn(&Trace, Sink<'_>) -> Result<(), TableError>,
}

impl TraceTable {
    /// The two tables: waveform and events.
    pub const ALL: [Self; 2] = [
        Self { name: "waveform", columns: |_| &WAVEFORM, rows: waveform },
        Self { name: "events", columns: event_columns, rows: events },
    ];

    /// Returns the columns of this trace: a sensor that the drive does not have has none.
    pub fn columns(&self, trace: &Trace) -> Vec<Column> {
        let kind = |parts: Option<f64>| parts.map_or(Kind::Text, |_| Kind::Number);
        (self.columns)(trace).iter().map(|(name, parts)| Column::new(*name, kind(*parts))).collect()
    }

    /// Writes the table's rows. In CSV times are rounded to 1 ps, currents to 1 nA and voltages to 1 µV.
    pub fn rows(&self, trace: &Trace, format: Format, to: Sink<'_>) -> Result<(), TableError> {
        let mut rounded = |row: &[Value<'_>]| {
            let mut row = row.to_vec();
            for (value, (_, parts)) in row.iter_mut().zip((self.columns)(trace)) {
                if let (Value::Number(number), Some(parts)) = (value, parts) {
                    *number = round(*number, *parts);
                }
            }
            to(&row)
        };
        if format == Format::Csv { (self.rows)(trace, &mut rounded) } else { (self.rows)(trace, to) }
    }
}

/// Rounds a number to the nearest of `parts` parts of one; −0 becomes 0, which would otherwise print as a negative
/// number.
fn round(number: f64, parts: f64) -> f64 {
    (number * parts).round() / parts + 0.0
}

const WAVEFORM: [Head; 17] = [
    ("t_s", PICO),
    ("i_a_A", NANO),
    ("i_b_A", NANO),
    ("i_c_A", NANO),
    ("v_a_V", MICRO),
    ("v_b_V", MICRO),
    ("v_c_V", MICRO),
    ("theta_deg", NANO),
    ("mode_a", None),
    ("mode_b", None),
    ("mode_c", None),
    ("u_dc_V", MICRO),
    ("omega_electrical_rad_per_s", NANO),
    ("torque_Nm", NANO),
    ("i_leg_a_A", NANO),
    ("i_leg_b_A", NANO),
    ("i_leg_c_A", NANO),
];

/// Rounds currents to whole nanoamperes, as in all files, so that the integrator's rounding of a zero current becomes
/// zero.
fn currents(current: [f64; 3]) -> [Value<'static>; 3] {
    current.map(|current| Value::Number(round(current, 1e9)))
}

/// Writes the rows of the waveform: voltages in V against the negative rail, currents in A of the winding and of each
/// leg's devices, towards the motor.
fn waveform(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    for s in &trace.snapshots {
        let number = |value: f64| Value::Number(value);
        let [a, b, c] = currents(s.current);
        let [leg_a, leg_b, leg_c] = currents(s.leg_current());
        let [va, vb, vc] = s.potential.map(number);
        let [ma, mb, mc] = s.modes.map(|mode| Value::Text(mode.to_string().into()));
        let angle = number(s.angle.to_degrees());
        let end = [s.dc_link, s.speed, s.torque].map(number);
        let [link, speed, torque] = end;
        let time = number(s.time);
        to(&[time, a, b, c, va, vb, vc, angle, ma, mb, mc, link, speed, torque, leg_a, leg_b, leg_c])?;
    }
    Ok(())
}

const EVENTS: [Head; 11] = [
    ("t_s", PICO),
    ("event", None),
    ("phase", None),
    ("to", None),
    ("i_a_A", NANO),
    ("i_b_A", NANO),
    ("i_c_A", NANO),
    ("u_dc_V", MICRO),
    ("v_a_V", MICRO),
    ("v_b_V", MICRO),
    ("v_c_V", MICRO),
];

/// Returns the columns of the events: those of the terminals' voltages as they are read where the drive reads them.
fn event_columns(trace: &Trace) -> &'static [Head] {
    let reads_terminals = trace.events.iter().any(|(_, event)| matches!(event, Event::Terminals(_)));
    if reads_terminals { &EVENTS } else { &EVENTS[..8] }
}

fn events(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    let columns = event_columns(trace).len();
    let mut events = trace.events.iter().peekable();
    while let Some((time, event)) = events.next() {
        let mut row = [const { Value::Empty }; EVENTS.len()];
        row[0] = Value::Number(*time);
        row[1] = match event {
            Event::Command => "command",
            Event::Gate(..) => "gate",
            Event::Conduction(..) => "conduction",
            Event::LeftMap => "left_map",
            Event::Motion(_) => "motion",
            Event::Sample(..) | Event::Terminals(_) => "sample",
            Event::Trip(_) => "trip",
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
                // The sample's readings of the terminals come with the next event.
                let next = events.next_if(|(_, next)| matches!(next, Event::Terminals(_)));
                let terminals = next.map_or(&[][..], |(_, next)| match next {
                    Event::Terminals(voltages) => voltages,
                    _ => &[],
                });
                let read = currents.iter().chain([link]).chain(terminals);
                for (cell, value) in row[4..].iter_mut().zip(read) {
                    *cell = Value::Number(*value);
                }
            }
            Event::Trip(phase) => row[2] = phase.letter().to_string().into(),
            Event::Command | Event::LeftMap | Event::Terminals(_) => {}
        }
        to(&row[..columns])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use standstill_detect::MethodName;
    use standstill_interface::Nanos;
    use standstill_scenario::{Document, Plan};
    use standstill_sim::{Case, run};

    use super::*;

    /// The numbers of a row in columns of these names.
    fn numbers<const N: usize>(row: &[Value<'_>], names: [&str; N]) -> [f64; N] {
        names.map(|name| {
            let place = WAVEFORM.iter().position(|(known, _)| *known == name).expect("a column");
            let Value::Number(number) = row[place] else { panic!("{name}: no number") };
            number
        })
    }

    #[test]
    fn law_phase_currents_sum_to_zero_and_only_conducting_legs_carry_any() {
        for (method, errors) in
            MethodName::ALL.into_iter().flat_map(|method| [(method, "default"), (method, "field")])
        {
            let text = format!(
                "motor = \"paper-5k5\"\nerrors = \"{errors}\"\nsensors.terminals = true\ndetector.method = \"{}\"\n",
                method.name()
            );
            let document = Document::parse(Path::new("scenario"), &text).expect("a scenario");
            let single = Plan::new(document).expect("a plan").single(0, 0).expect("a trial");
            // The beginning: each method has switched by then.
            let case = Case { time_limit: Nanos::from_micros(12_000), ..single.case() };
            let mut trace = Trace::new(5e-6);
            run(&case, &mut single.scenario.detector_for(&case).expect("a detector"), false, &mut trace);
            let mut charging = 0.0_f64;
            for format in [Format::Csv, Format::Npz] {
                let [waveform, _] = TraceTable::ALL;
                waveform
                    .rows(&trace, format, &mut |row| {
                        let phase = numbers(row, ["i_a_A", "i_b_A", "i_c_A"]);
                        let leg = numbers(row, ["i_leg_a_A", "i_leg_b_A", "i_leg_c_A"]);
                        let sum: f64 = phase.iter().sum();
                        assert!(sum.abs() < 2e-9, "{}, {errors}: {phase:?}", method.name());
                        for k in 0..3 {
                            let blocked = row[8 + k] == Value::Text("blocked".into());
                            assert_eq!(leg[k], if blocked { 0.0 } else { phase[k] });
                            charging = charging.max((phase[k] - leg[k]).abs());
                        }
                        Ok(())
                    })
                    .expect("rows");
            }
            // Without a capacitance nothing flows where nothing conducts.
            let has_capacitance = errors == "field";
            assert!(
                if has_capacitance { charging > 0.1 } else { charging == 0.0 },
                "{}: {charging} A",
                method.name()
            );
        }
    }
}
