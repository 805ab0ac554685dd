//! Rows: stored results of trials.

use serde::{Deserialize, Serialize};

use standstill_scenario::{Record, Verdict};

/// A trial in its stored form: plain values, without the run from which they come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Number of the trial.
    pub trial: u64,
    /// True angle in degrees: see [`Record::true_angle_deg`].
    pub true_angle_deg: f64,
    /// Start angle in degrees: see [`Record::start_angle_deg`].
    pub start_angle_deg: f64,
    /// Found angle in degrees: see [`Record::estimated_angle_deg`].
    pub estimated_angle_deg: Option<f64>,
    /// Error of the angle in degrees: see [`Record::error_deg`].
    pub error_deg: Option<f64>,
    /// Found axis in degrees: see [`Record::axis_deg`].
    pub axis_deg: Option<f64>,
    /// Error of the axis in degrees: see [`Record::axis_error_deg`].
    pub axis_error_deg: Option<f64>,
    /// How the trial ended.
    pub verdict: Verdict,
    /// Half the sector's width in degrees: see [`Record::half_sector_deg`]. Journals store it behind their rows, see
    /// `store/block.rs`.
    #[serde(skip)]
    pub half_sector_deg: Option<f64>,
    /// Age of the angle in s: see [`Record::age_s`]. Stored as `half_sector_deg`.
    #[serde(skip)]
    pub age_s: Option<f64>,
    /// Error in degrees at the instant for which the angle holds: see [`Record::error_at_instant_deg`]. Stored as `half_sector_deg`.
    #[serde(skip)]
    pub error_at_instant_deg: Option<f64>,
    /// Whether the pole is right: see [`Record::pole_correct`].
    pub pole_correct: Option<bool>,
    /// Movement of the rotor in degrees: see [`Record::rotor_moved_deg`].
    pub rotor_moved_deg: f64,
    /// Time that the detection took, in s.
    pub duration_s: f64,
    /// Largest phase current in A.
    pub peak_current_a: f64,
    /// Reason why there is no angle; empty if there is one.
    pub reason: String,
    /// Name of the reason; empty if there is an angle.
    pub kind: String,
}

impl Row {
    /// Returns the numbers that journals store behind their rows.
    pub(super) fn behind(&mut self) -> [&mut Option<f64>; 3] {
        [&mut self.half_sector_deg, &mut self.age_s, &mut self.error_at_instant_deg]
    }
}

impl From<&Record> for Row {
    fn from(record: &Record) -> Self {
        Self {
            trial: record.trial,
            true_angle_deg: record.true_angle_deg(),
            start_angle_deg: record.start_angle_deg(),
            estimated_angle_deg: record.estimated_angle_deg(),
            error_deg: record.error_deg(),
            axis_deg: record.axis_deg(),
            axis_error_deg: record.axis_error_deg(),
            half_sector_deg: record.half_sector_deg(),
            age_s: record.age_s(),
            error_at_instant_deg: record.error_at_instant_deg(),
            verdict: record.verdict(),
            pole_correct: record.pole_correct(),
            rotor_moved_deg: record.rotor_moved_deg(),
            duration_s: record.run.duration.seconds(),
            peak_current_a: record.run.peak_current,
            reason: record.reason(),
            kind: record.reason_name().unwrap_or_default(),
        }
    }
}
