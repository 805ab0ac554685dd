//! The tables of a trace: waveform and events, with the columns of their CSV files.

use std::borrow::Cow;

use standstill_interface::{Phase, Sensed};
use standstill_sim::{Event, Trace};
use standstill_table::{Column, Format, Kind, TableError, Value};

/// Receiver of a table's rows.
type Sink<'a> = &'a mut dyn FnMut(&[Value<'_>]) -> Result<(), TableError>;

/// A column of a trace: its name, and for numbers in text the number of parts into which the unit is divided.
type Head = (Cow<'static, str>, Option<f64>);

/// A column of this name.
const fn head(name: &'static str, parts: Option<f64>) -> Head {
    (Cow::Borrowed(name), parts)
}

const MICRO: Option<f64> = Some(1e6);
const NANO: Option<f64> = Some(1e9);
const PICO: Option<f64> = Some(1e12);

/// A table of a trace: its name, its columns and its rows.
pub struct TraceTable {
    pub name: &'static str,
    columns: fn(&Trace) -> Vec<Head>,
    rows: fn(&Trace, Sink<'_>) -> Result<(), TableError>,
}

impl TraceTable {
    /// The tables: waveform, events, and channels of a detector of one's own.
    pub const ALL: [Self; 3] = [
        Self { name: "waveform", columns: waveform_columns, rows: waveform },
        Self { name: "events", columns: event_columns, rows: events },
        Self { name: "channels", columns: channel_columns, rows: channels },
    ];

    /// Returns the tables that this trace has: channels only of a detector that shows some.
    pub fn of(trace: &Trace) -> impl Iterator<Item = Self> {
        let shows = !trace.own.names.is_empty();
        Self::ALL.into_iter().filter(move |table| shows || table.name != "channels")
    }

    /// Returns the columns of this trace: a sensor that the drive does not have has none.
    pub fn columns(&self, trace: &Trace) -> Vec<Column> {
        let kind = |parts: Option<f64>| parts.map_or(Kind::Text, |_| Kind::Number);
        (self.columns)(trace).into_iter().map(|(name, parts)| Column::new(name, kind(parts))).collect()
    }

    /// Writes the table's rows. In CSV times are rounded to 1 ps, currents to 1 nA and voltages to 1 µV.
    pub fn rows(&self, trace: &Trace, format: Format, to: Sink<'_>) -> Result<(), TableError> {
        let columns = (self.columns)(trace);
        let mut rounded = |row: &[Value<'_>]| {
            let mut row = row.to_vec();
            for (value, (_, parts)) in row.iter_mut().zip(&columns) {
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

/// Columns of every waveform.
const WAVEFORM: [Head; 18] = [
    head("t_s", PICO),
    head("i_a_A", NANO),
    head("i_b_A", NANO),
    head("i_c_A", NANO),
    head("v_a_V", MICRO),
    head("v_b_V", MICRO),
    head("v_c_V", MICRO),
    head("theta_deg", NANO),
    head("mode_a", None),
    head("mode_b", None),
    head("mode_c", None),
    head("u_dc_V", MICRO),
    head("omega_electrical_rad_per_s", NANO),
    head("torque_Nm", NANO),
    head("i_leg_a_A", NANO),
    head("i_leg_b_A", NANO),
    head("i_leg_c_A", NANO),
    head("i_link_A", NANO),
];

/// Column of a drive with comparators.
const COMPARATOR: Head = head("comparator", None);

/// Returns whether the drive has comparators.
fn has_comparators(trace: &Trace) -> bool {
    trace.snapshots.first().is_some_and(|snapshot| snapshot.comparator.is_some())
}

fn waveform_columns(trace: &Trace) -> Vec<Head> {
    WAVEFORM.into_iter().chain(has_comparators(trace).then_some(COMPARATOR)).collect()
}

/// Rounds currents to whole nanoamperes, as in all files, so that the integrator's rounding of a zero current becomes
/// zero.
fn currents(current: [f64; 3]) -> [Value<'static>; 3] {
    current.map(|current| Value::Number(round(current, 1e9)))
}

/// Writes the rows of the waveform: voltages in V against the negative rail, currents in A of the winding and of each
/// leg's devices, towards the motor, and from the DC link into the bridge.
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
        let into_bridge = number(round(s.link_current(), 1e9));
        let mut row = vec![
            time,
            a,
            b,
            c,
            va,
            vb,
            vc,
            angle,
            ma,
            mb,
            mc,
            link,
            speed,
            torque,
            leg_a,
            leg_b,
            leg_c,
            into_bridge,
        ];
        row.extend(s.comparator.map(|state| Value::Text(state.to_string().into())));
        to(&row)?;
    }
    Ok(())
}

/// Columns of all events; the currents and the voltage are those that the drive read.
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

/// Columns of a drive that reads its terminals.
const TERMINALS: [Head; 3] = [head("v_a_V", MICRO), head("v_b_V", MICRO), head("v_c_V", MICRO)];

/// Column of a drive with a shunt in the DC link.
const LINK: Head = head("i_link_A", NANO);

/// Column of a drive that captures the trips of its comparators.
const TICKS: Head = head("capture_ticks", NANO);

/// Returns the columns of a detector's channels, whose units are its own.
fn channel_columns(trace: &Trace) -> Vec<Head> {
    let names = trace.own.names.iter().map(|name| (Cow::Owned(name.clone()), PICO));
    [head("t_s", PICO)].into_iter().chain(names).collect()
}

fn channels(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    for (time, values) in &trace.own.rows {
        let row: Vec<Value<'_>> =
            [time].into_iter().chain(values).map(|value| Value::Number(*value)).collect();
        to(&row)?;
    }
    Ok(())
}

/// Returns whether the drive reads terminals, has a shunt in the link, and captures trips, by what it has read.
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

/// Returns the columns of the events: those of a sensor that the drive does not have, or that saw nothing, are left out.
fn event_columns(trace: &Trace) -> Vec<Head> {
    let [terminals, link, captures] = reads(trace);
    let mut columns = EVENTS.to_vec();
    columns.extend(TERMINALS.into_iter().filter(|_| terminals));
    columns.extend(link.then_some(LINK));
    columns.extend(captures.then_some(TICKS));
    columns
}

/// A reading of a sensor; empty if none sees the value.
fn seen(value: f64, sensed: Sensed) -> Value<'static> {
    if sensed == Sensed::Hidden { Value::Empty } else { Value::Number(value) }
}

fn letter(phase: Phase) -> Value<'static> {
    phase.letter().to_string().into()
}

fn events(trace: &Trace, to: Sink<'_>) -> Result<(), TableError> {
    let columns = event_columns(trace).len();
    let [terminals, link, captures] = reads(trace);
    let mut log = trace.own.log.iter().peekable();
    let mut said = |until: f64, to: &mut dyn FnMut(&[Value<'_>]) -> Result<(), TableError>| {
        while let Some((time, line)) = log.next_if(|(time, _)| *time < until) {
            let text = Value::Text(line.as_str().into());
            let mut row = vec![Value::Number(*time), "log".into(), Value::Empty, text];
            row.resize(columns, Value::Empty);
            to(&row)?;
        }
        Ok(())
    };
    for (time, event) in &trace.events {
        said(*time, to)?;
        let mut row = vec![Value::Number(*time)];
        let word = |text: String| Value::Text(text.into());
        let (name, phase, end) = match event {
            Event::Command => ("command", Value::Empty, Value::Empty),
            Event::Gate(phase, gate) => ("gate", letter(*phase), word(format!("{gate:?}").to_lowercase())),
            Event::Conduction(phase, mode) => ("conduction", letter(*phase), word(mode.to_string())),
            Event::LeftMap => ("left_map", Value::Empty, Value::Empty),
            Event::Motion(motion) => ("motion", Value::Empty, word(format!("{motion:?}").to_lowercase())),
            Event::Sample(of) => (
                "sample",
                of.capture.map_or(Value::Empty, |capture| letter(capture.comparator)),
                Value::Empty,
            ),
            Event::Trip(phase) => ("trip", letter(*phase), Value::Empty),
        };
        row.extend([name.into(), phase, end]);
        if let Event::Sample(of) = event {
            row.extend(Phase::ALL.map(|phase| seen(of.current[phase], of.sensed[phase])));
            row.push(Value::Number(of.dc_link));
            if terminals {
                row.extend(Phase::ALL.map(|phase| seen(of.terminal[phase], of.terminal_sensed[phase])));
            }
            row.extend(link.then(|| seen(of.link_current, of.link_sensed)));
            let ticks = of.capture.map_or(Value::Empty, |capture| Value::Number(capture.ticks.into()));
            row.extend(captures.then_some(ticks));
        }
        row.resize(columns, Value::Empty);
        to(&row)?;
    }
    said(f64::INFINITY, to)
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
                let [waveform, ..] = TraceTable::ALL;
                waveform
                    .rows(&trace, format, &mut |row| {
                        let phase = numbers(row, ["i_a_A", "i_b_A", "i_c_A"]);
                        let leg = numbers(row, ["i_leg_a_A", "i_leg_b_A", "i_leg_c_A"]);
                        let sum: f64 = phase.iter().sum();
                        assert!(sum.abs() < 2e-9, "{}, {errors}: {phase:?}", method.name());
                        let upper = (0..3).filter(
                            |k| matches!(&row[8 + k], Value::Text(mode) if mode.starts_with("upper")),
                        );
                        let [link] = numbers(row, ["i_link_A"]);
                        let expected: f64 = upper.map(|k| leg[k]).sum();
                        assert!(
                            (link - expected).abs() < 2e-9,
                            "{}, {errors}: {link} {leg:?}",
                            method.name()
                        );
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
    /// The trace of a scenario's first trial.
    fn traced(text: &str) -> Trace {
        let document = Document::parse(Path::new("scenario"), text).expect("a scenario");
        let single = Plan::new(document).expect("a plan").single(0, 0).expect("a trial");
        single.scenario.watched(&single.case(), false, f64::INFINITY).expect("a detector").2
    }

    /// All rows of a table, by the names of its columns.
    fn rows(table: &TraceTable, trace: &Trace) -> Vec<Vec<(String, Value<'static>)>> {
        let columns = table.columns(trace);
        let mut rows = Vec::new();
        let kept = |value: &Value<'_>| match value {
            Value::Number(number) => Value::Number(*number),
            Value::Text(text) => Value::Text(text.to_string().into()),
            _ => Value::Empty,
        };
        table
            .rows(trace, Format::Npz, &mut |row| {
                assert_eq!(row.len(), columns.len(), "{}", table.name);
                rows.push(
                    columns
                        .iter()
                        .zip(row)
                        .map(|(column, value)| (column.name.clone(), kept(value)))
                        .collect(),
                );
                Ok(())
            })
            .expect("rows");
        rows
    }

    fn cell<'a>(row: &'a [(String, Value<'static>)], name: &str) -> &'a Value<'static> {
        &row.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("no {name}")).1
    }

    /// Without errors a shunt in the link reads what the waveform has there just before the edges of that instant.
    #[test]
    fn law_a_shunt_without_errors_reads_the_current_of_the_link() {
        let trace = traced(
            "motor = \"paper-5k5\"\nerrors = \"none\"\nsensors.arrangement = \"dc-link-shunt\"\ndetector.method = \"bipolar\"\n",
        );
        let [waveform, events, _] = TraceTable::ALL;
        let (waveform, mut seen, mut largest, mut returned) = (rows(&waveform, &trace), 0, 0.0_f64, 0.0_f64);
        for row in rows(&events, &trace) {
            let (Value::Number(time), Value::Number(read)) = (cell(&row, "t_s"), cell(&row, "i_link_A"))
            else {
                continue;
            };
            let there = waveform
                .iter()
                .find(|row| matches!(cell(row, "t_s"), Value::Number(at) if (at - time).abs() < 1e-13));
            let Value::Number(link) = cell(there.expect("a row"), "i_link_A") else { panic!("no number") };
            assert!((link - read).abs() < 2e-9, "{time} s: {link} A, read as {read} A");
            (seen, largest, returned) = (seen + 1, largest.max(*read), returned.min(*read));
        }
        assert!(seen > 20 && largest > 2.0, "{seen} readings, up to {largest} A, down to {returned} A");
    }

    #[test]
    fn law_a_trace_tells_what_comparators_do_and_what_the_timer_captured() {
        let trace = traced(
            "motor = \"paper-5k5\"\nerrors = \"none\"\nsensors.timer = \"0.32 us\"\nsensors.comparators = \"common\"\n\
             sensors.terminals = true\ndetector.method = \"six-pulse\"\n",
        );
        let [waveform, events, _] = TraceTable::ALL;
        let rows_of = |name: &str, state: &str, at: &str| -> Vec<f64> {
            let table = if name == "comparator" { &waveform } else { &events };
            let all = rows(table, &trace);
            let of = all.iter().filter(|row| *cell(row, name) == Value::Text(state.to_owned().into()));
            of.map(|row| if let Value::Number(number) = cell(row, at) { *number } else { panic!("{at}") })
                .collect()
        };
        let (trips, samples) = (rows_of("event", "trip", "t_s"), rows_of("event", "sample", "capture_ticks"));
        let commands = rows_of("event", "command", "t_s");
        assert_eq!((trips.len(), samples.len(), commands.len()), (6, 6, 6));
        for ((trip, ticks), begin) in trips.iter().zip(&samples).zip(&commands) {
            // Whole ticks from the begin of the command to the trip: the comparator has no delay, and the timer starts up to half a
            // tick before or after the pulse.
            assert!((-0.5..1.5).contains(&((trip - begin) / 0.32e-6 - ticks)), "{trip} {begin} {ticks}");
        }
        // It watches from the begin of each pulse to its trip, and has tripped from then to the end of the command.
        let (watching, tripped) =
            (rows_of("comparator", "watching", "t_s"), rows_of("comparator", "tripped", "t_s"));
        for time in watching {
            assert!(
                trips.iter().zip(&commands).any(|(trip, begin)| (*begin..=*trip).contains(&time)),
                "{time}"
            );
        }
        assert!(tripped.iter().all(|time| trips.iter().any(|trip| time >= trip)) && tripped.len() > 100);
        // What a drive without phase sensors would read is there beside it: a terminal at each rail.
        let all = rows(&events, &trace);
        let sample =
            all.iter().find(|row| *cell(row, "event") == Value::Text("sample".into())).expect("a sample");
        assert!(matches!(cell(sample, "v_a_V"), Value::Number(volts) if volts.is_finite()));
    }
}
