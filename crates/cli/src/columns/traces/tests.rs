//! Tests of the rows of a trace: their values, and that the tables agree with one another.

use std::path::Path;

use standstill_detect::MethodName;
use standstill_interface::Nanos;
use standstill_scenario::{Document, Plan};
use standstill_sim::{Case, run};

use super::*;

/// The numbers of a row in columns of these names.
fn numbers<const N: usize>(row: &[Cell<'_>], names: [&str; N]) -> [f64; N] {
    names.map(|name| {
        let place = WAVEFORM.iter().position(|((known, _), _)| *known == name).expect("a column");
        let Cell::Number(number) = row[place] else { panic!("{name}: no number") };
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
        // Each method switches within the first 12 ms.
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
                    let upper = (0..3)
                        .filter(|k| matches!(&row[8 + k], Cell::Text(mode) if mode.starts_with("upper")));
                    let [link] = numbers(row, ["i_link_A"]);
                    let expected: f64 = upper.map(|k| leg[k]).sum();
                    assert!((link - expected).abs() < 2e-9, "{}, {errors}: {link} {leg:?}", method.name());
                    for k in 0..3 {
                        let blocked = row[8 + k] == Cell::Text("blocked".into());
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
fn rows(table: &TraceTable, trace: &Trace) -> Vec<Vec<(String, Cell<'static>)>> {
    let columns = table.columns(trace);
    let mut rows = Vec::new();
    let kept = |value: &Cell<'_>| match value {
        Cell::Number(number) => Cell::Number(*number),
        Cell::Text(text) => Cell::Text(text.to_string().into()),
        _ => Cell::Empty,
    };
    table
        .rows(trace, Format::Npz, &mut |row| {
            assert_eq!(row.len(), columns.len(), "{}", table.name);
            rows.push(
                columns.iter().zip(row).map(|(column, value)| (column.name.clone(), kept(value))).collect(),
            );
            Ok(())
        })
        .expect("rows");
    rows
}

fn cell<'a>(row: &'a [(String, Cell<'static>)], name: &str) -> &'a Cell<'static> {
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
        let (Cell::Number(time), Cell::Number(read)) = (cell(&row, "t_s"), cell(&row, "i_link_A")) else {
            continue;
        };
        let there = waveform
            .iter()
            .find(|row| matches!(cell(row, "t_s"), Cell::Number(at) if (at - time).abs() < 1e-13));
        let Cell::Number(link) = cell(there.expect("a row"), "i_link_A") else { panic!("no number") };
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
        let of = all.iter().filter(|row| *cell(row, name) == Cell::Text(state.to_owned().into()));
        of.map(|row| if let Cell::Number(number) = cell(row, at) { *number } else { panic!("{at}") })
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
    // The comparator watches from the begin of each pulse to its trip, and is tripped from then to the end of the
    // command.
    let (watching, tripped) =
        (rows_of("comparator", "watching", "t_s"), rows_of("comparator", "tripped", "t_s"));
    for time in watching {
        assert!(trips.iter().zip(&commands).any(|(trip, begin)| (*begin..=*trip).contains(&time)), "{time}");
    }
    assert!(tripped.iter().all(|time| trips.iter().any(|trip| time >= trip)) && tripped.len() > 100);
    // The table also has the readings of a drive without phase sensors, such as its terminals' potentials.
    let all = rows(&events, &trace);
    let sample = all.iter().find(|row| *cell(row, "event") == Cell::Text("sample".into())).expect("a sample");
    assert!(matches!(cell(sample, "v_a_V"), Cell::Number(volts) if volts.is_finite()));
}
