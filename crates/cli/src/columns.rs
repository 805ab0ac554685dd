//! The files' columns.

use std::io::Write;

use serde::Serialize;
use standstill_campaign::Record;
use standstill_inverter::Conduction;
use standstill_sim::{Event, Snapshot, Trace};

/// A row of `trials.csv`.
#[derive(Debug, Serialize)]
pub struct TrialRow {
    trial: u64,
    true_angle_deg: f64,
    estimated_angle_deg: Option<f64>,
    error_deg: Option<f64>,
    outcome: &'static str,
    pole_correct: Option<bool>,
    rotor_moved_deg: f64,
    duration_s: f64,
    axis_deg: Option<f64>,
    start_angle_deg: f64,
    peak_current_a: f64,
    reason: String,
}

impl From<&Record> for TrialRow {
    fn from(record: &Record) -> Self {
        Self {
            trial: record.trial,
            true_angle_deg: record.true_angle_deg(),
            estimated_angle_deg: record.estimated_angle_deg(),
            error_deg: record.error_deg(),
            outcome: record.verdict().name(),
            pole_correct: record.pole_correct(),
            rotor_moved_deg: record.rotor_moved_deg(),
            duration_s: record.run.duration.seconds(),
            axis_deg: record.axis_deg(),
            start_angle_deg: record.start_angle_deg(),
            peak_current_a: record.run.peak_current,
            reason: record.reason(),
        }
    }
}

/// Rows as CSV with a header.
pub fn csv(rows: impl IntoIterator<Item = impl Serialize>) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(std::io::Error::from)?;
    }
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

/// `waveform.csv`: voltages against the negative rail, currents into the motor.
pub fn waveform(trace: &Trace, to: &mut impl Write) -> std::io::Result<()> {
    writeln!(
        to,
        "t_s,i_a_A,i_b_A,i_c_A,v_a_V,v_b_V,v_c_V,theta_deg,mode_a,mode_b,mode_c,u_dc_V,omega_electrical_rad_per_s,torque_Nm"
    )?;
    for s in &trace.snapshots {
        let Snapshot { time, potential: [va, vb, vc], modes: [ma, mb, mc], .. } = s;
        // A blocked leg carries no current; what the integrator leaves of it is not one.
        let [ia, ib, ic] = std::array::from_fn(|k| {
            let digits = (s.current[k] * 1e9).round() / 1e9;
            // Adding zero turns −0 into 0, which would otherwise print as a negative current.
            if s.modes[k] == Conduction::Blocked { 0.0 } else { digits + 0.0 }
        });
        let theta = s.angle.to_degrees();
        writeln!(
            to,
            "{time:.12},{ia:.9},{ib:.9},{ic:.9},{va:.6},{vb:.6},{vc:.6},{theta:.9},{ma},{mb},{mc},{:.6},{:.9},{:.9}",
            s.dc_link, s.speed, s.torque
        )?;
    }
    Ok(())
}

/// `events.csv`.
pub fn events(trace: &Trace, to: &mut impl Write) -> std::io::Result<()> {
    writeln!(to, "t_s,event,phase,to,i_a_A,i_b_A,i_c_A,u_dc_V")?;
    for (time, event) in &trace.events {
        match event {
            Event::Command => writeln!(to, "{time:.12},command,,,,,,")?,
            Event::Gate(phase, gate) => {
                writeln!(
                    to,
                    "{time:.12},gate,{},{},,,,",
                    phase.letter(),
                    format!("{gate:?}").to_lowercase()
                )?;
            }
            Event::Conduction(phase, mode) => {
                writeln!(to, "{time:.12},conduction,{},{mode},,,,", phase.letter())?;
            }
            Event::LeftMap => writeln!(to, "{time:.12},left_map,,,,,,")?,
            Event::Motion(motion) => {
                writeln!(to, "{time:.12},motion,,{},,,,", format!("{motion:?}").to_lowercase())?;
            }
            Event::Sample([a, b, c], u) => {
                writeln!(to, "{time:.12},sample,,,{a:.9},{b:.9},{c:.9},{u:.6}")?;
            }
        }
    }
    Ok(())
}
