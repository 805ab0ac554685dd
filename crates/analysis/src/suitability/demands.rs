//! The demands by which settings and finished runs are judged.

use serde::Serialize;

/// Demands that a drive makes on the detection of the rotor position.
///
/// ```
/// use standstill_analysis::Demands;
///
/// // A lift that must not roll back.
/// let demands = Demands { movement_deg: 0.2, ..Demands::default() };
/// assert_eq!(demands.error_deg, 5.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Demands {
    /// Largest allowed axis error of 95 of 100 detections, in electrical degrees.
    pub error_deg: f64,
    /// Largest allowed movement of a free rotor, in electrical degrees.
    pub movement_deg: f64,
    /// Largest allowed share of detections without an angle. The share of detections without a pole has the same limit.
    pub without_angle: f64,
    /// Largest allowed share of detections with a wrong pole.
    pub wrong_poles: f64,
    /// Largest allowed phase current in A. None stands for the motor's rated current.
    #[serde(rename = "current_A")]
    pub current_a: Option<f64>,
    /// Longest allowed time of a detection in s.
    pub time_s: f64,
}

impl Demands {
    /// The default demands: an error of 5°, a movement of 1°, one in a hundred without an angle, one in ten thousand wrong poles, the rated
    /// current, and 1 s.
    pub const DEFAULT: Self = Self {
        error_deg: 5.0,
        movement_deg: 1.0,
        without_angle: 0.01,
        wrong_poles: 1e-4,
        current_a: None,
        time_s: 1.0,
    };
}

impl Default for Demands {
    fn default() -> Self {
        Self::DEFAULT
    }
}
