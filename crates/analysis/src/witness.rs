//! Witnesses: closed forms, conservation laws and kept results, computed anew by this program on this machine.
//!
//! Each is a figure that is known without this program, or that was kept from it, beside the figure that it computes here. They are the
//! part of `docs/validation.md` that takes no other program; the test suite asserts the same figures with more cases.

mod chance;
pub mod forms;
mod runs;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_campaign::digests::{self, DigestError, Kept};
use standstill_sim::RunError;
use thiserror::Error;

/// A figure that is known, and the same as it was computed here.
#[derive(Clone, Debug, PartialEq)]
pub enum Figure {
    /// Numbers of a unit, at most a tolerance apart.
    Number {
        /// The known number.
        known: f64,
        /// The number computed here.
        here: f64,
        /// Largest difference.
        tolerance: f64,
        /// Their unit.
        unit: &'static str,
    },
    /// Digests, equal to the last bit.
    Digest {
        /// The digest that is kept.
        known: String,
        /// The digest computed here.
        here: String,
    },
}

/// A claim about the program, with its figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Witness {
    /// The claim that is checked.
    pub claim: String,
    /// Where the known figure comes from: a closed form, a conservation law, another method, or results that are kept.
    pub from: &'static str,
    /// The figures.
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

    /// Makes a witness of a closed form: its number and the one computed here.
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
            // Of what is not a number nothing holds.
            Figure::Number { known, here, tolerance, .. } => (here - known).abs() <= *tolerance,
            Figure::Digest { known, here } => !known.is_empty() && known == here,
        }
    }
}

/// Why witnesses could not be heard.
#[derive(Debug, Error)]
pub enum WitnessError {
    /// A run that could not go on.
    #[error("a run of the witness could not go on: {0}")]
    Run(#[from] RunError),
    /// A motor, a scenario or a detector that cannot be made.
    #[error("{0}")]
    Setting(String),
    /// Results that could not be computed.
    #[error(transparent)]
    Digest(#[from] DigestError),
}

/// Hears all witnesses; `folder` takes files of theirs, `hear` gets each group's name before it is computed.
///
/// # Errors
/// A folder that cannot be written; a run that could not go on; a stop.
pub fn all(
    folder: &Path,
    stop: &AtomicBool,
    mut hear: impl FnMut(&'static str),
) -> Result<Vec<Witness>, WitnessError> {
    hear("closed forms");
    let mut found = forms::all()?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_every_witness_but_the_kept_ones_holds_and_each_would_notice_a_wrong_figure() {
        let found = [forms::all(), runs::all(), Ok(chance::all())];
        let found: Vec<Witness> = found.into_iter().flat_map(|part| part.expect("runs")).collect();
        assert!(found.len() >= 12, "{}", found.len());
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
