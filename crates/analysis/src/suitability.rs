//! Is a motor suited to the detection of its rotor's position at standstill?
//!
//! The verdict is one of trials: candidates are set up for the motor as for any other, and each must find the axis, must
//! not name a wrong pole and must leave a free rotor where it is. What stands beside it explains it: the saliency against
//! the sensors' noise (as the Cramér–Rao limit), the poles' difference against what the drive gets wrong.

use standstill_detect::{Method, MethodName, Signature};
use standstill_plant::{PolarityPoint, PoleKnowledge};

use crate::bound::{Bound, BoundError};
use standstill_campaign::{Campaign, CampaignError, Statistics, Summary};
use standstill_scenario::{Document, FileError, Origin};
use standstill_scenario::{Rotor, Scenario};

/// What the start of a motor demands of a detection.
///
/// ```
/// use standstill_analysis::Demands;
///
/// // A lift that must not roll back.
/// let demands = Demands { movement_deg: 0.2, ..Demands::default() };
/// assert_eq!(demands.error_deg, 5.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demands {
    /// Error of the axis in electrical degrees that 95 of 100 detections must not exceed.
    pub error_deg: f64,
    /// How far a free rotor may move, in electrical degrees.
    pub movement_deg: f64,
    /// Share of detections that may end without an angle.
    pub without_angle: f64,
}

impl Default for Demands {
    /// 5°, 1° and one in a hundred.
    fn default() -> Self {
        Self { error_deg: 5.0, movement_deg: 1.0, without_angle: 0.01 }
    }
}

/// The methods that are tried: those that need no separate bench and finish within a fraction of a second.
pub const CANDIDATES: [MethodName; 5] = [
    MethodName::MaximumLikelihood,
    MethodName::MaximumLikelihoodAdaptive,
    MethodName::Bipolar,
    MethodName::LineInductanceFast,
    MethodName::HfiRotating,
];

/// A method as it did.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The method.
    pub method: MethodName,
    /// Its settings for this motor.
    pub settings: Method<f64>,
    /// With the rotor locked.
    pub locked: Summary,
    /// With the rotor free.
    pub free: Summary,
    /// Why it does not suit the motor; empty: it does.
    pub objections: Vec<String>,
    /// How many times better than demanded, in error and in movement, whichever is less; 1 is just enough, 0 without any
    /// angle.
    pub margin: f64,
}

/// All that is known of a motor's suitability.
#[derive(Clone, Debug, PartialEq)]
pub struct Suitability {
    /// |L_B| / L_A without current, from the data sheet.
    pub saliency_ratio: f64,
    /// The Cramér–Rao limit of the maximum-likelihood method's pulses on this drive, rms over the angles. None if they
    /// cannot be set up.
    pub limit: Option<Bound>,
    /// Whether the motor has poles to tell apart.
    pub has_magnet: bool,
    /// What is known of which pole draws more current. Where that is too little, the poles cannot be judged, and no method is
    /// blamed for what it says of them.
    pub pole: PoleKnowledge,
    /// Which pole draws more current: near rated current, and in pulses of half of it.
    pub signature: [Signature; 2],
    /// By what share, near rated current.
    pub polarity_difference: f64,
    /// The same at half of it.
    pub pulse_difference: f64,
    /// The methods tried, in the order of [`CANDIDATES`].
    pub candidates: Vec<Candidate>,
}

/// A verdict that could not be reached.
#[derive(Debug)]
pub enum SuitabilityError {
    /// The scenario cannot be.
    File(FileError),
    /// The trials could not run.
    Campaign(CampaignError),
    /// The limit could not be computed.
    Bound(BoundError),
}

impl std::fmt::Display for SuitabilityError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(error) => error.fmt(f),
            Self::Campaign(error) => error.fmt(f),
            Self::Bound(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SuitabilityError {}

impl From<FileError> for SuitabilityError {
    fn from(error: FileError) -> Self {
        Self::File(error)
    }
}

impl From<CampaignError> for SuitabilityError {
    fn from(error: CampaignError) -> Self {
        Self::Campaign(error)
    }
}

impl From<BoundError> for SuitabilityError {
    fn from(error: BoundError) -> Self {
        Self::Bound(error)
    }
}

/// Angles of the limit; as many as show a harmonic of the winding.
const ANGLES: usize = 16;

impl Suitability {
    /// Tries the candidates under the conditions of a scenario file, whatever its method and its rotor's state. A method that
    /// lacks a setting of the scenario is no candidate; one that was set beside the file is the only one.
    ///
    /// # Errors
    /// A scenario that cannot be, or that suits no candidate.
    pub fn of(
        document: &Document,
        demands: &Demands,
        mut progress: impl FnMut(MethodName),
    ) -> Result<Self, SuitabilityError> {
        let motor = document.motor()?;
        let scenario = |method: MethodName, rotor: Rotor| {
            let mut document = document.clone();
            document.set("detector.method", method.name(), Origin::CommandLine)?;
            document.set("rotor.state", rotor.name(), Origin::CommandLine)?;
            if rotor == Rotor::Locked {
                // No load moves it.
                document.remove("rotor.load");
            }
            document.unchecked_scenario_of(&motor)
        };
        let mut candidates = Vec::new();
        let mut unsuitable = None;
        let mut tried = None;
        // One that is set beside the scenario is the only one.
        let only = document.origin("detector.method").map(|_| document.load()).transpose()?;
        let methods = only.map_or(CANDIDATES.to_vec(), |file| vec![file.detector.method.0]);
        for method in methods {
            progress(method);
            let (locked, free) = match (scenario(method, Rotor::Locked), scenario(method, Rotor::Free)) {
                (Err(error), _) | (_, Err(error)) if error.is_foreign_setting() => {
                    unsuitable = Some(error);
                    continue;
                }
                (locked, free) => (locked?, free?),
            };
            candidates.push(Candidate::of(method, &locked, &free, demands)?);
            tried.get_or_insert(locked);
        }
        let Some(tried) = tried else {
            return Err(
                unsuitable.map_or_else(|| unreachable!("there are candidates"), SuitabilityError::File)
            );
        };
        // What the trials met, not what the drive was told.
        let known = tried.nameplate();
        Ok(Self {
            saliency_ratio: (motor.winding.saliency / motor.winding.mean_inductance).abs(),
            limit: if tried.check().is_ok() { Bound::or_reason(&tried, ANGLES, None)?.0 } else { None },
            has_magnet: motor.has_magnet(),
            pole: motor.pole_knowledge(),
            signature: [known.signature, known.pulse_signature],
            polarity_difference: known.polarity_difference,
            // Where a map ends before, nothing is known.
            pulse_difference: PolarityPoint::of(&tried.motor.magnetics, 0.5 * tried.motor.rated_current)
                .map_or(0.0, |point| point.difference()),
            candidates,
        })
    }

    /// Whether there are poles to tell apart of which too little is known to judge it.
    pub fn pole_is_open(&self) -> bool {
        self.has_magnet && self.pole.is_open()
    }

    /// The method to be recommended: of those without objection the one with the largest margin.
    pub fn recommended(&self) -> Option<&Candidate> {
        let suited = self.candidates.iter().filter(|candidate| candidate.objections.is_empty());
        suited.max_by(|a, b| a.margin.total_cmp(&b.margin))
    }
}

impl Candidate {
    /// Tries a method. One whose settings cannot work for this motor is no reason to give up on the others.
    fn of(
        method: MethodName,
        locked: &Scenario<Method<f64>>,
        free: &Scenario<Method<f64>>,
        demands: &Demands,
    ) -> Result<Self, CampaignError> {
        let settings = free.detector;
        if let Err(error) = free.check() {
            let none = Statistics::default().summary();
            let objections = vec![format!("it cannot be set up: {error}")];
            return Ok(Self { method, settings, locked: none.clone(), free: none, objections, margin: 0.0 });
        }
        let has_pole = free.motor.has_magnet() && !free.motor.pole_knowledge().is_open();
        let (locked, free) = (summary(locked, method)?, summary(free, method)?);
        let objections = objections(&locked, &free, demands, has_pole);
        let worst = locked.p95_deg.value.max(free.p95_deg.value);
        let margin = if worst.is_nan() {
            0.0
        } else {
            (demands.error_deg / worst).min(demands.movement_deg / free.max_moved_deg)
        };
        Ok(Self { method, settings, locked, free, objections, margin })
    }
}

/// Trials of a candidate under one condition.
const TRIALS: u64 = 200;
/// The same of an injection, which takes a hundred times as long.
const FEW_TRIALS: u64 = 24;

fn summary(scenario: &Scenario<Method<f64>>, method: MethodName) -> Result<Summary, CampaignError> {
    let trials = if method == MethodName::HfiRotating { FEW_TRIALS } else { TRIALS };
    Campaign { scenario, trials, threads: None }.summary()
}

fn objections(locked: &Summary, free: &Summary, demands: &Demands, has_pole: bool) -> Vec<String> {
    let mut objections = Vec::new();
    for (state, summary) in [("locked", locked), ("free", free)] {
        let all = summary.trials as f64;
        let unexpected = summary.failed + summary.errors;
        if unexpected as f64 > demands.without_angle * all {
            let reason =
                summary.reasons.iter().max_by_key(|(_, times)| times.count).map_or("", |(name, _)| name);
            objections.push(format!("{unexpected} of {all} without an angle, rotor {state}: {reason}"));
            continue;
        }
        if summary.p95_deg.value > demands.error_deg {
            objections.push(format!(
                "95 of 100 errors within {:.2}°, rotor {state}, where {}° are demanded",
                summary.p95_deg.value, demands.error_deg
            ));
        }
        if has_pole && summary.wrong_poles > 0 {
            objections.push(format!("{} wrong poles in {all}, rotor {state}", summary.wrong_poles));
        }
        if has_pole && summary.undetermined as f64 > demands.without_angle * all {
            let count = summary.undetermined;
            objections.push(format!("pole undetermined in {count} of {all}, rotor {state}"));
        }
    }
    if free.max_moved_deg > demands.movement_deg {
        objections.push(format!(
            "a free rotor moves by {:.2}° where {}° are allowed",
            free.max_moved_deg, demands.movement_deg
        ));
    }
    objections
}
