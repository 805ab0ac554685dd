//! Is a motor suited to the detection of its rotor's position at standstill, and with which settings?
//!
//! ```text
//!   each method: most current that is allowed ─► looks at pulses and rounds ─► best settings ─► 200 starts each way
//!                                                                     │ the best method
//!   suited, suited if ... ◄─ holds on fresh starts, by 95 % ◄──────────┘
//!        not suited       ◄─ none holds: a brake, more current, a finer converter are tried
//! ```
//! The verdict is one of trials: a method must find the axis, must name no wrong pole and must leave a free rotor where it is, with
//! no more current and time than allowed. What stands beside it explains it: the saliency against the sensors' noise (as the
//! Cramér–Rao limit), the poles' difference against what the drive gets wrong.

mod advice;
mod bench;
mod candidate;
mod condition;
mod confirm;
mod margins;
mod search;
mod starts;
#[cfg(test)]
mod tests;

use standstill_campaign::{CampaignError, Summary};
use standstill_detect::{Method, MethodName, Signature};
use standstill_plant::{Motor, PolarityPoint, PoleKnowledge};
use standstill_scenario::{Document, FileError, Origin, Rotor};

pub use advice::Advice;
pub use bench::Setting;
pub use condition::Condition;
pub use confirm::Confirmed;
pub use margins::{Demand, Margins};

use crate::bound::{Bound, BoundError};
use bench::Bench;
use thiserror::Error;

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
    /// Share of detections that may end without an angle, and share that may end without a pole.
    pub without_angle: f64,
    /// Share of detections that may name the wrong pole.
    pub wrong_poles: f64,
    /// Largest phase current in A; none: the motor's rated one.
    pub current_a: Option<f64>,
    /// Longest time of a detection in s.
    pub time_s: f64,
}

impl Default for Demands {
    /// 5°, 1°, one in a hundred, one in ten thousand, rated current and a second.
    fn default() -> Self {
        Self {
            error_deg: 5.0,
            movement_deg: 1.0,
            without_angle: 0.01,
            wrong_poles: 1e-4,
            current_a: None,
            time_s: 1.0,
        }
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

/// A method at the best settings that were found for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The method with its keys.
    pub setting: Setting,
    /// All its settings for this motor.
    pub settings: Method<f64>,
    /// With the rotor locked; of no starts where that is not judged.
    pub locked: Summary,
    /// With the rotor free, or in the one state that is judged; likewise.
    pub free: Summary,
    /// Why it does not suit the motor; empty: it does.
    pub objections: Vec<String>,
    /// By how much the demands are kept; none where it cannot be set up.
    pub margins: Option<Margins>,
    /// The demand that binds: of a method that suits the motor the one that is kept least, of another the one that keeps its settings
    /// from being stronger. None where no demand does: the link drives no more current.
    pub binding: Option<Demand>,
    /// Settings that were looked at.
    pub looks: usize,
}

impl Candidate {
    /// The method.
    pub const fn method(&self) -> MethodName {
        self.setting.method
    }

    /// How many times better than demanded, in error and in movement, whichever is less; 1 is just enough, 0 without any
    /// angle.
    pub fn margin(&self) -> f64 {
        self.margins.map_or(0.0, |margins| margins.spare())
    }
}

/// What is being done, and what is known by then.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// Settings of a method are looked for.
    Method(MethodName),
    /// What was found of it.
    Found(&'a Candidate),
    /// Settings are tried on fresh starts.
    Confirming(&'a Setting),
    /// Whether the motor would be suited if L_d fell by this share at rated current.
    Saturation(f64),
    /// Whether a change would help.
    Change(&'a str),
}

/// What the answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suited {
    /// Suited.
    Yes,
    /// Suited if [`Suitability::condition`] holds.
    If,
    /// Not suited with any settings.
    No,
}

impl Suited {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Yes => "suited",
            Self::If => "suited-if",
            Self::No => "not-suited",
        }
    }
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
    /// What the motor's data say of which pole draws more current. Where that is too little, see [`Suitability::condition`].
    pub pole: PoleKnowledge,
    /// Which pole draws more current: near rated current, and in pulses of half of it.
    pub signature: [Signature; 2],
    /// By what share, near rated current.
    pub polarity_difference: f64,
    /// The same at half of it.
    pub pulse_difference: f64,
    /// Largest phase current in A that was allowed.
    pub most_current_a: f64,
    /// The methods tried, in the order of [`CANDIDATES`].
    pub candidates: Vec<Candidate>,
    /// Which of them is recommended, with what fresh starts showed of it.
    pub recommended: Option<(usize, Confirmed)>,
    /// What must hold of the motor beside its data.
    pub condition: Option<Condition>,
    /// What was tried where no settings suffice.
    pub advice: Vec<Advice>,
}

/// A verdict that could not be reached.
#[derive(Debug, Error)]
pub enum SuitabilityError {
    /// The scenario cannot be.
    #[error(transparent)]
    File(#[from] FileError),
    /// The trials could not run.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The limit could not be computed.
    #[error(transparent)]
    Bound(#[from] BoundError),
}

impl Suitability {
    /// Looks for settings of each candidate under the conditions of a scenario file, whatever its method and its rotor's state.
    /// Settings of the detector that the scenario has stay as they are. A method that lacks one of them is no candidate; one
    /// that was set beside the file is the only one, and so is a state of the rotor.
    ///
    /// # Errors
    /// A scenario that cannot be, or that suits no candidate.
    pub fn of(
        document: &Document,
        demands: &Demands,
        mut progress: impl FnMut(Progress<'_>),
    ) -> Result<Self, SuitabilityError> {
        let motor = document.motor()?;
        let methods = methods(document, &motor, demands)?;
        let hear: &mut dyn FnMut(Progress<'_>) = &mut progress;
        let open = motor.has_magnet() && motor.pole_knowledge().is_open();
        if open && condition::saturating(document, 0.1).is_some() {
            let methods = condition::quick(&methods);
            for most in condition::LARGEST {
                if let Some(found) = Self::with_saturation(document, demands, &methods, most, hear)? {
                    return Ok(found);
                }
            }
        }
        let bench = Bench::new(document, &motor, demands);
        let mut found = Self::judged(&bench, &methods, hear)?;
        if found.recommended.is_none() {
            found.advice = advice::tried(&bench, &methods, hear)?;
        }
        found.condition = open.then_some(Condition::Pole);
        Ok(found)
    }

    /// A motor whose saturation is not given, with the least that suffices beside `most`; none where `most` does not.
    fn with_saturation(
        document: &Document,
        demands: &Demands,
        methods: &[MethodName],
        most: f64,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Option<Self>, SuitabilityError> {
        let Some(mut least) = condition::least_saturation(document, demands, methods, most, hear)? else {
            return Ok(None);
        };
        // What few starts let pass may need a little more on many.
        for _ in 0..5 {
            let range = [least, most];
            let found = condition::with_range(document, demands, range, |bench| {
                let found = Self::judged(bench, methods, hear)?;
                Ok((found, condition::minus_d(bench.document)?))
            })?;
            let Some((mut found, minus_d)) = found else { return Ok(None) };
            if found.recommended.is_some() {
                found.pole = PoleKnowledge::NotGiven;
                found.condition = Some(Condition::Saturation { least, most, minus_d });
                return Ok(Some(found));
            }
            least = condition::rounded_up(1.12 * least).min(most);
        }
        Ok(None)
    }

    fn judged(
        bench: &Bench<'_>,
        methods: &[MethodName],
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Self, SuitabilityError> {
        let mut candidates = Vec::new();
        let mut found = Vec::new();
        for method in methods {
            hear(Progress::Method(*method));
            let of_method = bench.search(*method)?;
            let candidate = bench.candidate(*method, &of_method)?;
            hear(Progress::Found(&candidate));
            candidates.push(candidate);
            found.push(of_method);
        }
        let recommended = bench.recommended(&mut candidates, &found, hear)?;
        let plain = bench.scenario(&Setting::plain(methods[0]), Rotor::Locked)?;
        let known = plain.nameplate();
        let tried = candidates.first().map_or_else(|| Setting::plain(methods[0]), |of| of.setting.clone());
        let tried = bench.scenario(&tried, Rotor::Locked)?;
        let motor = bench.motor;
        Ok(Self {
            saliency_ratio: (motor.winding.saliency / motor.winding.mean_inductance).abs(),
            limit: if tried.check().is_ok() { Bound::or_reason(&tried, ANGLES, None)?.0 } else { None },
            has_magnet: motor.has_magnet(),
            pole: motor.pole_knowledge(),
            signature: [known.signature, known.pulse_signature],
            polarity_difference: known.polarity_difference,
            // Where a map ends before, nothing is known.
            pulse_difference: PolarityPoint::of(&plain.motor.magnetics, 0.5 * plain.motor.rated_current)
                .map_or(0.0, |point| point.difference()),
            most_current_a: bench.most_current,
            candidates,
            recommended,
            condition: None,
            advice: Vec::new(),
        })
    }

    /// The answer.
    pub const fn suited(&self) -> Suited {
        match (&self.recommended, &self.condition) {
            (None, _) => Suited::No,
            (Some(_), Some(_)) => Suited::If,
            (Some(_), None) => Suited::Yes,
        }
    }

    /// Whether there are poles to tell apart of which too little is known to judge it: the axis alone was judged.
    pub fn pole_is_open(&self) -> bool {
        self.condition == Some(Condition::Pole)
    }

    /// The method to be recommended with its settings.
    pub fn recommended(&self) -> Option<&Candidate> {
        self.recommended.as_ref().map(|(number, _)| &self.candidates[*number])
    }

    /// What fresh starts showed of it.
    pub fn confirmed(&self) -> Option<&Confirmed> {
        self.recommended.as_ref().map(|(_, confirmed)| confirmed)
    }

    /// The document with what is recommended, ready to be run; none where nothing is. Where a saturation is the condition, the motor has
    /// it.
    ///
    /// # Errors
    /// A key that cannot be set.
    pub fn document(&self, document: &Document) -> Result<Option<Document>, FileError> {
        let Some(candidate) = self.recommended() else { return Ok(None) };
        let mut document = document.clone();
        if let Some(Condition::Saturation { least, .. }) = self.condition {
            let share = format!("{} %", standstill_quantity::rounded(least, 2));
            document.set_value(condition::KEY, share.into(), Origin::CommandLine)?;
        }
        candidate.setting.set_in(&mut document)?;
        if document.origin("rotor.state").is_none() {
            document.set("rotor.state", Rotor::Free.name(), Origin::CommandLine)?;
        }
        Ok(Some(document))
    }
}

/// The candidates of a document.
fn methods(
    document: &Document,
    motor: &Motor,
    demands: &Demands,
) -> Result<Vec<MethodName>, SuitabilityError> {
    if document.origin("detector.method").is_some() {
        return Ok(vec![document.load()?.detector.method()]);
    }
    let bench = Bench::new(document, motor, demands);
    let (mut methods, mut unsuitable) = (Vec::new(), None);
    for method in CANDIDATES {
        for rotor in &bench.rotors {
            match bench.scenario(&Setting::plain(method), *rotor) {
                Err(error) if error.is_foreign_setting() => unsuitable = Some(error),
                Err(error) => return Err(error.into()),
                Ok(_) if methods.last() == Some(&method) => {}
                Ok(_) => methods.push(method),
            }
        }
    }
    match unsuitable {
        Some(error) if methods.is_empty() => Err(error.into()),
        _ => Ok(methods),
    }
}

/// Angles of the limit; as many as show a harmonic of the winding.
const ANGLES: usize = 16;
