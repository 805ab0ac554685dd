//! Checks whether a motor suits the detection of its rotor position at standstill, and with which settings.
//!
//! ```text
//!   each method: most current that is allowed ─► looks at pulses and rounds ─► best settings ─► 200 starts each way
//!                                                                     │ the best method
//!   suited, suited if ... ◄─ holds on fresh starts, by 95 % ◄──────────┘
//!        not suited       ◄─ none holds: a brake, more current, a finer converter are tried
//! ```
//! The verdict comes from trials. A method must find the axis, must find no wrong pole and must leave a free rotor where it is, with no
//! more current and time than allowed. Two comparisons explain the verdict: the saliency against the sensors' noise (as the Cramér–Rao
//! limit), and the difference of the poles' currents against the drive's errors.

mod advice;
mod bench;
mod candidate;
mod changes;
mod condition;
mod confirm;
mod demands;
mod error;
mod margins;
mod poles;
mod relaxed;
mod search;
mod standing;
mod starts;
#[cfg(test)]
mod tests;
mod turning;
mod work;

use standstill_detect::{MethodName, Signature};
use standstill_interface::choice;
use standstill_plant::{Motor, PolarityPoint, PoleKnowledge};
use standstill_scenario::{Document, FileError, Origin, Rotor, pole_signature};

pub use advice::{Advice, Alternative, Way};
pub use bench::Setting;
pub use candidate::{CANDIDATES, Candidate, LeftOut};
pub use condition::Condition;
pub use confirm::{COUNTED, Confirmed, Wanting};
pub use demands::Demands;
pub use error::SuitabilityError;
pub use margins::{Demand, Margins};
pub use standing::standing;
pub use standstill_odds::subset::Effort;
pub use turning::TurningSpeeds;
pub use work::most as most_work;

use crate::bound::{Bound, Bounds};
use bench::Bench;
use search::Found;
use work::Allowance;

/// Messages about the progress of the check.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// The search for settings of this method begins.
    Method(MethodName),
    /// The search of a method ended with this candidate.
    Found(&'a Candidate),
    /// The trial of these settings on fresh simulated motor starts begins.
    Confirming(&'a Setting),
    /// The trial of a motor begins whose L_d falls by this share at rated current.
    Saturation(f64),
    /// The trial of a change of drive or demands begins. The text describes the change.
    Change(&'a str),
}

choice! {
    /// Answer to whether a motor is suited.
    pub enum Suited {
        /// The motor is suited.
        Yes = "suited",
        /// The motor is suited if [`Suitability::condition`] holds.
        If = "suited-if",
        /// The motor is not suited with any settings.
        No = "not-suited",
        /// No settings were found with the work that the check may do, and not all were tried.
        Undecided = "not-decided",
        /// The data sheet gives both axes the same inductance, as sheets do that give one: there is no axis to judge.
        Unknown = "cannot-be-judged",
    }
}

/// Verdict on a motor's suitability, and its explanation.
#[derive(Clone, Debug, PartialEq)]
pub struct Suitability {
    /// Saliency ratio |L_B| / L_A at zero current, from the data sheet.
    pub saliency_ratio: f64,
    /// Cramér–Rao limit of the axis error, as rms over the rotor angles. It is computed for the pulses of the first candidate and the
    /// drive's sensors. None if the method cannot be set up, or if the drive does not measure its phase currents.
    pub limit: Option<Bound>,
    /// True if the motor has a magnet, so that the north pole must be distinguished from the south pole.
    pub has_magnet: bool,
    /// States whether the motor's data determine which pole draws more current. If they do not, see [`Suitability::condition`].
    pub pole: PoleKnowledge,
    /// The pole that draws more current. The first entry is valid near rated current, the second in pulses of half of the rated current.
    pub signature: [Signature; 2],
    /// Difference of the two poles' currents near rated current, as a share of the current.
    pub polarity_difference: f64,
    /// Current of the north pole minus that of the south pole in pulses of half of the rated current, as a share of the latter.
    pub pulse_difference: f64,
    /// The pole that draws more current at the largest allowed current, and the difference of the two currents as a share. None if the
    /// motor's flux map ends below this current.
    pub strongest: Option<(Signature, f64)>,
    /// Largest compared current in A, up to three times the allowed one, if both poles draw the same at all compared currents; else none.
    pub alike_up_to_a: Option<f64>,
    /// Largest allowed phase current in A.
    pub most_current_a: f64,
    /// Largest current in A that the current sensors read, if it limits the allowed current. None if the demands or the motor limit it.
    pub read_up_to_a: Option<f64>,
    /// The only judged state of the rotor, if an override sets it. None if the check judges a locked and a free rotor.
    pub rotor: Option<Rotor>,
    /// The tried methods, in the order of [`CANDIDATES`].
    pub candidates: Vec<Candidate>,
    /// The methods that were not tried because they lack a setting of the detector that the scenario sets.
    pub left_out: Vec<LeftOut>,
    /// Rotor speed in the scenario's file, as written there, which the check ignores: see [`standing`]. None if it ignores no speed.
    pub left_speed: Option<String>,
    /// Rotor angle in the scenario, as written there. The check ignores it, because it judges all angles. None if none is set.
    pub left_angle: Option<String>,
    /// Index of the recommended candidate, with its results on fresh starts; none if no candidate suits the motor.
    pub recommended: Option<(usize, Confirmed)>,
    /// Speed limits of the recommended method if the rotor turns during a start. None without such a method, or if no judged rotor may turn.
    pub turning: Option<TurningSpeeds>,
    /// Condition under which the verdict is valid, if the motor's data do not show whether it holds.
    pub condition: Option<Condition>,
    /// Changes of drive or demands that were tried because no settings suit the motor and drive as they are.
    pub advice: Vec<Advice>,
    /// Other ways to start the motor. They are tried if no change suffices.
    pub alternatives: Vec<Alternative>,
    /// Descriptions of the parts of the check that were left out because the allowed work was used up. A higher [`Effort`] includes them.
    pub untried: Vec<String>,
    /// True if the motor as it is may be suited with settings that were not tried.
    pub is_undecided: bool,
    /// Work of the check, in evaluations of the machine's equations. It exceeds [`most_work`] by at most one simulated motor start.
    pub work: u64,
}

impl Suitability {
    /// Searches settings of each candidate method under the conditions of a scenario file. The method and the state of the rotor in the
    /// file are ignored; if an override sets them, only this method and this state are judged. The detector's settings in the file are
    /// kept. A method that lacks one of these settings is not a candidate.
    ///
    /// `effort` limits the work. Work is counted, not timed, so the answer does not depend on the computer.
    ///
    /// # Errors
    /// The scenario is invalid, or no method is a candidate.
    pub fn of(
        document: &Document,
        demands: &Demands,
        effort: Effort,
        mut progress: impl FnMut(Progress<'_>),
    ) -> Result<Self, SuitabilityError> {
        Self::within(document, demands, most_work(effort), &mut progress)
    }

    /// Carries out the check with at most the work `most`.
    fn within(
        document: &Document,
        demands: &Demands,
        most: u64,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Self, SuitabilityError> {
        let (document, [left_speed, left_angle]) = standing::anywhere(document);
        let motor = document.motor()?;
        let work = Allowance::new(most);
        let (methods, left_out) = candidate::methods(&document, &motor, demands, &work)?;
        let found = Self::by(&methods, &document, &motor, demands, &work, hear)?;
        Ok(Self { left_out, left_speed, left_angle, work: work.done(), ..found })
    }

    /// Carries out the check with these methods.
    fn by(
        methods: &[MethodName],
        document: &Document,
        motor: &Motor,
        demands: &Demands,
        work: &Allowance,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Self, SuitabilityError> {
        let mut untried = Vec::new();
        let open = motor.has_magnet() && motor.pole_knowledge().is_open();
        let is_salient = saliency_ratio(motor) >= LEAST_SALIENCY;
        if open && is_salient && condition::saturating(document, 0.1).is_some() {
            let methods = condition::quick(methods);
            let kept = FOR_THE_AXIS * work.left() as f64;
            for most in condition::upper_ends(motor) {
                // A range whose search ends early leaves its work to the next one.
                let (found, cut) = work.within_all_but(kept, LEAST_OF_A_RANGE, || {
                    Self::with_saturation(document, demands, work, &methods, most, hear)
                });
                if let Some(mut found) = found? {
                    if found.is_undecided {
                        // A larger range is not tried: the smaller one suffices on few starts.
                        found
                            .untried
                            .push(format!("other ranges of saturation than up to {:.0} %", 100.0 * most));
                        found.untried.push("changes of drive and demands".to_owned());
                    }
                    return Ok(found);
                }
                if cut {
                    untried.push(format!("a saturation of up to {:.0} %", 100.0 * most));
                }
            }
        }
        let bench = Bench::new(document, motor, demands, work);
        let (mut found, searched) = Self::judged(&bench, methods, None, hear)?;
        untried.append(&mut found.untried);
        // If a candidate lacks only starts, no change of the drive is tried.
        if found.recommended.is_none() && found.open().is_none() {
            let methods: Vec<_> = methods.iter().copied().zip(&searched).collect();
            found.advice = advice::tried(&bench, &methods, &found, &mut untried, hear)?;
            if found.advice.iter().all(|advice| advice.helps.is_none()) {
                let (alternatives, cut) = work.within(1.0, || advice::alternatives(&bench, &methods));
                found.alternatives = alternatives?;
                if cut {
                    untried.push("other ways to start".to_owned());
                }
            }
        }
        found.condition = open.then_some(Condition::Pole);
        Ok(Self { untried, ..found })
    }

    /// Judges the best settings of each method. `likely` has settings that suffice on few starts. If the search may need more work than is
    /// left, they are confirmed before it.
    fn judged(
        bench: &Bench<'_>,
        methods: &[MethodName],
        likely: Option<&Setting>,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<(Self, Vec<Found>), SuitabilityError> {
        let mut untried = Vec::new();
        let first = match likely {
            Some(setting) if bench.is_dear(setting)? => bench.confirmed_first(setting, hear)?,
            _ => None,
        };
        let (candidates, found, recommended) = if let Some((candidate, looks, confirmed)) = first {
            let own = candidate.method();
            let others: Vec<_> = methods.iter().copied().filter(|method| *method != own).collect();
            untried.push(format!("more settings of {own}"));
            let (searched, _) = bench.work.within(SEARCH, || bench.searched(&others, &mut untried, hear));
            let (mut candidates, mut found) = searched?;
            let place = methods.iter().position(|method| *method == own).unwrap_or(0);
            candidates.insert(place, candidate);
            found.insert(place, looks);
            (candidates, found, Some((place, confirmed)))
        } else {
            let (searched, _) = bench.work.within(SEARCH, || bench.searched(methods, &mut untried, hear));
            let (mut candidates, found) = searched?;
            // No changes are tried while the saturation is unknown, so the confirmation may use all the work that is left.
            let share = if likely.is_some() { 1.0 } else { CONFIRMATION };
            let (recommended, cut) =
                bench.work.within(share, || bench.recommended(&mut candidates, &found, hear));
            let recommended = recommended?;
            if recommended.is_none() && cut {
                untried.push("more fresh starts of what was found".to_owned());
            }
            (candidates, found, recommended)
        };
        let turning = match &recommended {
            Some((place, _)) => {
                let (turning, cut) = bench.work.within(1.0, || bench.turning(&candidates[*place]));
                if cut {
                    untried.push("speeds of a rotor that turns".to_owned());
                }
                turning?
            }
            None => None,
        };
        let plain = bench.scenario(&Setting::plain(methods[0]), Rotor::Locked)?;
        let known = plain.nameplate();
        let tried = candidates.first().map_or_else(|| Setting::plain(methods[0]), |of| of.setting.clone());
        let tried = bench.scenario(&tried, Rotor::Locked)?;
        let motor = bench.motor;
        // The limit takes as long as a method, so it is left out for a range of saturation in which no settings suffice.
        let is_answer = recommended.is_some() || bench.upper_end.is_none();
        let is_bounded = is_answer && tried.check().is_ok();
        let bounds = Bounds { interval: None, ..Bounds::of_method(&tried) };
        let suitability = Self {
            saliency_ratio: saliency_ratio(motor),
            limit: if is_bounded { Bound::or_reason(bounds, ANGLES)?.0 } else { None },
            has_magnet: motor.has_magnet(),
            pole: motor.pole_knowledge(),
            signature: [known.signature, known.pulse_signature],
            polarity_difference: known.polarity_difference,
            // Zero if the flux map ends below this current.
            pulse_difference: PolarityPoint::of(&plain.motor.magnetics, 0.5 * plain.motor.rated_current)
                .map_or(0.0, |point| point.difference()),
            strongest: pole_signature(motor, bench.most_current),
            alike_up_to_a: poles::alike_up_to(bench),
            most_current_a: bench.most_current,
            read_up_to_a: bench.read_up_to,
            rotor: bench.rotors.first().copied().filter(|_| bench.rotors.len() == 1),
            is_undecided: recommended.is_none()
                && !(untried.is_empty() && candidates.iter().all(|of| of.wanting.is_none())),
            candidates,
            left_out: Vec::new(),
            left_speed: None,
            left_angle: None,
            recommended,
            turning,
            condition: None,
            advice: Vec::new(),
            alternatives: Vec::new(),
            untried,
            work: 0,
        };
        Ok((suitability, found))
    }

    /// Returns the answer to whether the motor is suited.
    pub fn suited(&self) -> Suited {
        match (&self.recommended, &self.condition) {
            (None, _) if !self.has_saliency() => Suited::Unknown,
            // More settings cannot help where the poles are alike.
            (None, _) if self.is_undecided && !self.poles_are_alike() => Suited::Undecided,
            (None, _) => Suited::No,
            (Some(_), Some(_)) => Suited::If,
            (Some(_), None) => Suited::Yes,
        }
    }

    /// Returns true if the inductances of the two axes differ, so that there is an axis to find.
    pub fn has_saliency(&self) -> bool {
        self.saliency_ratio >= LEAST_SALIENCY
    }

    /// Returns true if both poles are known to draw the same current up to three times the allowed current. Then no test at standstill with
    /// such currents distinguishes them.
    pub const fn poles_are_alike(&self) -> bool {
        self.alike_up_to_a.is_some()
    }

    /// Returns true if only the axis was judged, because the motor's data do not suffice to judge its poles.
    pub fn pole_is_open(&self) -> bool {
        self.condition == Some(Condition::Pole)
    }

    /// Returns the recommended method with its settings.
    pub fn recommended(&self) -> Option<&Candidate> {
        self.recommended.as_ref().map(|(number, _)| &self.candidates[*number])
    }

    /// Returns the best candidate that met all demands on its fresh starts, but had too few of them to show it. None without such a
    /// candidate.
    pub fn open(&self) -> Option<&Candidate> {
        let open = self.candidates.iter().filter(|of| of.wanting.is_some());
        open.max_by(|a, b| a.margin().total_cmp(&b.margin()))
    }

    /// Returns the results of the recommended method on fresh starts.
    pub fn confirmed(&self) -> Option<&Confirmed> {
        self.recommended.as_ref().map(|(_, confirmed)| confirmed)
    }

    /// Returns the document with the recommended settings, ready to be run. None without a recommendation. If the verdict holds only for a
    /// range of saturation, the motor in the document has the smallest saturation of this range.
    ///
    /// # Errors
    /// A key cannot be set.
    pub fn document(&self, document: &Document) -> Result<Option<Document>, FileError> {
        let Some(candidate) = self.recommended() else { return Ok(None) };
        let mut document = document.clone();
        document.remove(standing::ANGLE);
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

fn saliency_ratio(motor: &Motor) -> f64 {
    (motor.winding.saliency / motor.winding.mean_inductance).abs()
}

/// Saliency ratio |L_B| / L_A below which both axes count as having the same inductance.
const LEAST_SALIENCY: f64 = 1e-3;

/// Share of the whole work that the trials of ranges of saturation leave for judging the axis alone.
const FOR_THE_AXIS: f64 = 0.1;
/// Smallest share of the remaining work that the trial of one range of saturation may use.
const LEAST_OF_A_RANGE: f64 = 0.4;
/// Share of the remaining work for the search of settings. The rest is for their confirmation.
const SEARCH: f64 = 0.5;
/// Share of the remaining work for the confirmation of settings. The rest is for the trial of changes.
const CONFIRMATION: f64 = 0.7;

/// Number of rotor angles for the Cramér–Rao limit. It shares no factor with six, so that all angles differ modulo 60°, the period of the
/// line inductances. With a flux map, the rms differs by up to about 6 % from that over twice as many angles. With the error set `field`,
/// an angle takes as long as some hundred starts.
const ANGLES: usize = 7;
