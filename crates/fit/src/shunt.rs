//! One shunt in the DC link: which of its readings tell a current of the motor, and what records of it alone cannot tell.
//!
//! The shunt carries the sum of the currents of all legs whose upper device conducts: with one leg high that leg's, with two high the third
//! one's with the other sign, and with all legs off, while diodes return the currents, minus those of the pulse before. It is what the
//! simulation has as [`Snapshot::link_current`](standstill_sim::Snapshot::link_current). With all legs alike it carries nothing, whatever
//! flows in the motor.
//!
//! In a pulse along the unit vector y from rest it carries yᵀ Γ y ψ, with ψ the pulse's volt-seconds: one number of the matrix Γ, which
//! has three. So pulses along three axes are needed.

use std::borrow::Cow;

use super::pieces::{Piece, drives, resting};
use super::record::{LINK, Record, Request, Row};
use super::{FitError, Start};

/// Dead times after a change of the legs in which the current may still jump: the stated one may be half of the real one.
const DEAD_TIMES: f64 = 2.0;

/// Least current against the pulses' direction, as a share of the largest along it, of an amplifier that reads both.
const BOTH_WAYS: f64 = 0.1;

/// Least number of axes that pulses must have.
const LEAST_AXES: usize = 3;

/// Returns the records without those readings of a shunt that tell no current: the amplifier's while it follows a jump, from the row before a
/// change of the legs until [`Start::settle`] after it; and, of an amplifier that reads currents of one direction, those while diodes return
/// the currents.
pub fn readable<'a>(records: &'a [Record], start: &Start) -> Cow<'a, [Record]> {
    if !records.iter().any(|record| record.channels[LINK]) {
        return Cow::Borrowed(records);
    }
    let mut records = records.to_vec();
    for record in records.iter_mut().filter(|record| record.channels[LINK]) {
        leave_out_jumps(&mut record.rows, start);
        if is_one_way(record) {
            let drive = record.rows.iter().position(|row| drives(row.legs)).unwrap_or(0);
            let idle = record.rows[drive..].iter_mut().filter(|row| row.legs == [Request::Off; 3]);
            idle.for_each(|row| row.current[LINK] = f64::NAN);
        }
    }
    Cow::Owned(records)
}

fn leave_out_jumps(rows: &mut [Row], start: &Start) {
    let settle = start.settle + DEAD_TIMES * start.dead_time;
    let mut until = f64::NEG_INFINITY;
    for k in 1..rows.len() {
        if rows[k].legs != rows[k - 1].legs {
            rows[k - 1].current[LINK] = f64::NAN;
            until = rows[k].time + settle;
        }
        if rows[k].time <= until {
            rows[k].current[LINK] = f64::NAN;
        }
    }
}

/// Returns true if the shunt's amplifier shows no current against the pulses' direction, as one for one direction.
fn is_one_way(record: &Record) -> bool {
    let rest = resting(record)[LINK].mean;
    let read = || record.rows.iter().map(|row| row.current[LINK] - rest).filter(|i| i.is_finite());
    -read().fold(0.0, f64::min) < BOTH_WAYS * read().fold(0.0, f64::max)
}

/// Returns the low end in A of the range of a shunt's amplifier that reads one direction, where it was reached: readings at rest are
/// clipped there.
pub fn floor(records: &[Record]) -> f64 {
    let of_link = || records.iter().filter(|record| record.channels[LINK]);
    if !of_link().all(is_one_way) {
        return f64::NEG_INFINITY;
    }
    let read = of_link().flat_map(|record| &record.rows).map(|row| row.current[LINK]);
    read.filter(|i| i.is_finite()).reduce(f64::min).unwrap_or(f64::NEG_INFINITY)
}

/// Refuses records of a shunt alone that cannot tell a motor.
///
/// # Errors
/// Pulses without a settled reading, a shunt with the other sign, or pulses along fewer than three axes.
pub fn check(records: &[Record], pieces: &[Piece], start: &Start) -> Result<(), FitError> {
    if records.iter().any(|record| record.channels[..LINK].contains(&true)) {
        return Ok(());
    }
    let rests: Vec<f64> = records.iter().map(|record| resting(record)[LINK].mean).collect();
    let mut axes: Vec<[i8; 3]> = Vec::new();
    let mut current = 0.0;
    for piece in pieces {
        let read = piece.rows.iter().filter(|row| drives(row.legs) && row.current[LINK].is_finite());
        for row in read {
            current += row.current[LINK] - rests[piece.record];
            let axis = axis(row.legs);
            if !axes.contains(&axis) {
                axes.push(axis);
            }
        }
    }
    if axes.is_empty() {
        return Err(FitError::Unsettled(start.settle + DEAD_TIMES * start.dead_time));
    }
    if current < 0.0 {
        return Err(FitError::LinkReversed);
    }
    if axes.len() < LEAST_AXES {
        return Err(FitError::FewAxes(axes.len()));
    }
    Ok(())
}

/// Returns the axis of legs: their potentials less the mean, times six, the first that differs from zero positive.
fn axis(legs: [Request; 3]) -> [i8; 3] {
    let potential = legs.map(|leg| match leg {
        Request::Low => 0,
        Request::Off => 3,
        Request::High => 6,
    });
    let mean = potential.iter().sum::<i8>() / 3;
    let axis = potential.map(|u| u - mean);
    let is_negative = axis.iter().find(|u| **u != 0).is_some_and(|u| *u < 0);
    if is_negative { axis.map(|u| -u) } else { axis }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PULSES: [[Request; 3]; 6] = {
        let [l, h] = [Request::Low, Request::High];
        [[h, l, l], [l, h, h], [l, h, l], [h, l, h], [l, l, h], [h, h, l]]
    };

    /// Pulses of 40 µs in rows of 1 µs, the current returned after each.
    fn record(pulses: &[[Request; 3]], sign: f64, lowest: f64) -> Record {
        let rows = (0..200 * pulses.len()).map(|k| {
            let (place, legs) = ((k % 200) as f64, pulses[k / 200]);
            let (current, legs) = match place {
                50.0..90.0 => (place - 50.0, legs),
                90.0..130.0 => (place - 130.0, [Request::Off; 3]),
                _ => (0.0, [Request::Off; 3]),
            };
            let nan = f64::NAN;
            Row {
                time: 1e-6 * k as f64,
                current: [nan, nan, nan, (sign * current).max(lowest)],
                link: 24.0,
                legs,
            }
        });
        Record {
            file: String::new(),
            rows: rows.collect(),
            channels: [false, false, false, true],
            angle: None,
        }
    }

    fn start(settle: f64) -> Start {
        let devices = standstill_inverter::Devices {
            kind: standstill_inverter::DeviceKind::Mosfet,
            switch_drop: 0.0,
            switch_resistance: 1e-3,
            diode_drop: 0.7,
            diode_resistance: 1e-3,
        };
        Start { motor: None, devices, dead_time: 1e-6, stated: Vec::new(), most_used: 1000, settle }
    }

    fn checked(record: Record, settle: f64) -> Result<(), FitError> {
        let start = start(settle);
        let records = readable(&[record], &start).into_owned();
        check(&records, &super::super::pieces::pieces(0, &records[0]), &start)
    }

    #[test]
    fn law_readings_that_follow_a_jump_are_left_out_and_no_others() {
        let whole = record(&PULSES, 1.0, f64::NEG_INFINITY);
        let left = &readable(std::slice::from_ref(&whole), &start(3e-6))[0];
        for (k, (row, before)) in left.rows.iter().zip(&whole.rows).enumerate() {
            let place = k % 200;
            // From the row before a change to 3 µs and two dead times after it.
            let jumps = (49..=55).contains(&place) || (89..=95).contains(&place);
            assert_eq!(row.current[LINK].is_nan(), jumps, "{place}");
            assert!(jumps || row.current[LINK] == before.current[LINK]);
        }
    }

    #[test]
    fn law_an_amplifier_for_one_direction_tells_nothing_while_diodes_return_the_current() {
        let one_way = record(&PULSES, 1.0, 0.0);
        let records = readable(&[one_way], &start(3e-6)).into_owned();
        let idle = |row: &&Row| row.legs == [Request::Off; 3];
        assert!(records[0].rows[50..].iter().filter(idle).all(|row| row.current[LINK].is_nan()));
        assert!(records[0].rows[..49].iter().all(|row| row.current[LINK] == 0.0));
        assert_eq!(floor(&records), 0.0);
        // What is cut is at rest all the same: the currents need as long to go as they took to come.
        assert_eq!(super::super::pieces::pieces(0, &records[0]).len(), 6);
        assert_eq!(floor(&[record(&PULSES, 1.0, f64::NEG_INFINITY)]), f64::NEG_INFINITY);
    }

    #[test]
    fn law_records_that_tell_no_motor_are_refused_by_name() {
        let both_ways = f64::NEG_INFINITY;
        assert_eq!(checked(record(&PULSES, 1.0, both_ways), 3e-6), Ok(()));
        assert_eq!(checked(record(&PULSES[..2], 1.0, both_ways), 3e-6), Err(FitError::FewAxes(1)));
        assert_eq!(checked(record(&PULSES[..3], 1.0, both_ways), 3e-6), Err(FitError::FewAxes(2)));
        assert_eq!(checked(record(&PULSES, -1.0, both_ways), 3e-6), Err(FitError::LinkReversed));
        let unsettled = checked(record(&PULSES, 1.0, both_ways), 50e-6);
        assert!(matches!(unsettled, Err(FitError::Unsettled(_))), "{unsettled:?}");
    }
}
