//! Witnesses: checks against closed forms, conservation laws and stored results, computed by this program on the
//! present machine.
//!
//! Each witness compares a figure that is known independently, or was stored earlier, with the figure computed now. The witnesses are the
//! part of `docs/validation.md` that needs no other program; the test suite asserts the same figures with more cases.

mod broken;
mod chance;
pub mod forms;
mod runs;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_campaign::digests::{self, DigestError, Kept};
use standstill_plant::{Motor, built_in};
use standstill_sim::RunError;
use thiserror::Error;

/// A figure that is known from theory or from stored results, and the same figure as computed now.
#[derive(Clone, Debug, PartialEq)]
pub enum Figure {
    /// Two numbers with a unit. They agree if they differ by at most a tolerance.
    Number {
        /// The known number.
        known: f64,
        /// The number computed now.
        here: f64,
        /// Largest allowed difference.
        tolerance: f64,
        /// Unit of both numbers.
        unit: &'static str,
    },
    /// Two digests of results. They agree if they are equal.
    Digest {
        /// The stored digest.
        known: String,
        /// The digest computed now.
        here: String,
    },
}

/// A claim about the program, with a known figure and a computed figure that show whether it holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Witness {
    /// The claim that is checked, in words.
    pub claim: String,
    /// Origin of the known figure: a closed form, a conservation law, another method of computation, or stored results.
    pub from: &'static str,
    /// The known figure and the computed one.
    pub figure: Figure,
}

impl Witness {
    /// Makes a witness of two numbers.
    pub(crate) fn number(
        claim: impl Into<String>,
        from: &'static str,
        [known, here]: [f64; 2],
        tolerance: f64,
        unit: &'static str,
    ) -> Self {
        Self { claim: claim.into(), from, figure: Figure::Number { known, here, tolerance, unit } }
    }

    /// Makes a witness whose known number is a closed form. `figures` has the known and the computed number.
    pub(crate) fn closed(
        claim: impl Into<String>,
        figures: [f64; 2],
        tolerance: f64,
        unit: &'static str,
    ) -> Self {
        Self::number(claim, "closed form", figures, tolerance, unit)
    }

    fn kept(of: Kept) -> Self {
        let claim = format!("results of {}, every bit of every trial", of.name);
        Self { claim, from: "kept digest", figure: Figure::Digest { known: of.kept, here: of.here } }
    }

    /// Returns true if the figures agree.
    pub fn holds(&self) -> bool {
        match &self.figure {
            // False if a figure is not a number.
            Figure::Number { known, here, tolerance, .. } => (here - known).abs() <= *tolerance,
            Figure::Digest { known, here } => !known.is_empty() && known == here,
        }
    }
}

/// Error of witnesses that could not be computed.
#[derive(Debug, Error)]
pub enum WitnessError {
    /// A run could not continue.
    #[error("a run of the witness could not go on: {0}")]
    Run(#[from] RunError),
    /// A motor, a scenario or a detector could not be made.
    #[error("{0}")]
    Setting(String),
    /// Digests of results could not be computed.
    #[error(transparent)]
    Digest(#[from] DigestError),
}

/// Computes all witnesses. The trials for the digests are written to files in `folder`. `hear` is called with the name of each group before
/// the group is computed.
///
/// # Errors
/// The folder cannot be written, a run could not continue, or the computation was stopped.
pub fn all(
    folder: &Path,
    stop: &AtomicBool,
    mut hear: impl FnMut(&'static str),
) -> Result<Vec<Witness>, WitnessError> {
    hear("closed forms");
    let mut found = forms::all()?;
    found.extend(broken::all()?);
    hear("conservation laws and the referee");
    found.extend(runs::all()?);
    hear("chance");
    found.extend(chance::all());
    hear("kept results of all methods");
    found.extend(digests::methods(folder, stop)?.into_iter().map(Witness::kept));
    hear("kept results of all effects");
    found.extend(digests::effects(folder, stop)?.into_iter().map(Witness::kept));
    Ok(found)
}

/// Returns a built-in motor.
fn motor(name: &str) -> Result<Motor, WitnessError> {
    built_in(name).ok_or_else(|| WitnessError::Setting(format!("there is no built-in motor {name}")))
}

#[cfg(test)]
mod tests {
    use standstill_inverter::OpenLeg;

    use super::*;

    #[test]
    fn law_every_witness_but_the_kept_ones_holds_and_each_would_notice_a_wrong_figure() {
        let found = [forms::all(), broken::all(), runs::all(), Ok(chance::all())];
        let found: Vec<Witness> = found.into_iter().flat_map(|part| part.expect("runs")).collect();
        assert!(found.len() >= 15, "{}", found.len());
        for witness in found {
            assert!(witness.holds(), "{witness:?}");
            let Figure::Number { known, here, tolerance, unit } = witness.figure else { panic!("a number") };
            // A tolerance must be smaller than the figure, or a zero would pass.
            assert!(
                known == 0.0 || tolerance < 0.2 * known.abs(),
                "{}: {known} within {tolerance}",
                witness.claim
            );
            // A reference that is off by three tolerances, and a program that computes nothing.
            for (known, here) in
                [(here + 3.0 * tolerance, here), (known, f64::NAN), (known, known + 3.0 * tolerance)]
            {
                let figure = Figure::Number { known, here, tolerance, unit };
                assert!(!Witness { figure, ..witness.clone() }.holds(), "{}", witness.claim);
            }
        }
    }

    /// The diode of the third leg conducts while the lower switches short the line: an open leg carries nothing there.
    #[test]
    fn cross_currents_of_ngspice_need_the_diode_of_the_third_leg() {
        let holds = |open_leg| -> Vec<bool> {
            forms::ngspice(open_leg).expect("runs").iter().map(Witness::holds).collect()
        };
        assert_eq!(holds(OpenLeg::Diodes), [true; 4]);
        assert_eq!(holds(OpenLeg::Open), [true, true, true, false]);
    }

    #[test]
    fn law_a_digest_holds_if_it_is_kept_and_the_same() {
        let of = |kept: &str, here: &str| {
            Witness::kept(Kept { name: "bipolar".to_owned(), kept: kept.to_owned(), here: here.to_owned() })
                .holds()
        };
        assert!(of("1539a0b7", "1539a0b7"));
        assert!(!of("1539a0b7", "1539a0b8") && !of("", "") && !of("", "1539a0b7"));
    }
}
