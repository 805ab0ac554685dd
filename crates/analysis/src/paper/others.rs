//! Statements of further papers, each beside the same quantity as this program computes it.
//!
//! A statement is reproduced if both numbers agree within the stated tolerance. If they do not, the statement has a reason, as far as one is
//! known: no model is changed to make a number agree.

use std::sync::atomic::AtomicBool;

use standstill_campaign::{Campaign, CampaignError};
use standstill_plant::NoConvergence;
use standstill_scenario::{Document, FileError, Record};
use standstill_sim::RunError;
use thiserror::Error;

use crate::witness::{Figure, Witness};

/// A statement of a paper and the computed number.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// The paper's number (*known*), the number computed here, and the tolerance.
    pub witness: Witness,
    /// Why the statement is not reproduced, as far as it is known. None if it is expected to be reproduced.
    pub because: Option<&'static str>,
    /// The number that was computed here when the reason was written.
    found: Option<f64>,
}

impl Statement {
    /// Makes a statement that counts as reproduced if both numbers differ by at most `share` of the paper's number.
    fn new(what: &str, by: &'static str, unit: &'static str, [theirs, ours]: [f64; 2], share: f64) -> Self {
        // Four digits: no paper states more.
        let power = standstill_quantity::magnitude(ours).unwrap_or(0) - 3;
        let ours = standstill_quantity::rounded(standstill_quantity::rounded(ours, -power).round(), power);
        let witness = Witness::number(what, by, [theirs, ours], share * theirs.abs(), unit);
        Self { witness, because: None, found: None }
    }

    /// Adds the reason why the statement is not reproduced, with the number `found` instead.
    const fn because(mut self, reason: &'static str, found: f64) -> Self {
        (self.because, self.found) = (Some(reason), Some(found));
        self
    }

    /// Returns true if the statement is reproduced as expected, or is not reproduced for a stated reason and the number computed here is
    /// still that of the reason, within 5 %.
    pub fn is_as_expected(&self) -> bool {
        let Figure::Number { here, .. } = self.witness.figure else { return false };
        match self.found {
            None => self.witness.holds(),
            Some(found) => !self.witness.holds() && (here - found).abs() <= 0.05 * found.abs(),
        }
    }
}

/// A paper whose statements are repeated.
#[derive(Clone, Copy, Debug)]
pub struct Paper {
    /// Name on the command line.
    pub name: &'static str,
    /// Authors, title, publication and DOI.
    pub citation: &'static str,
    /// Assumptions on points that the paper does not state.
    pub assumed: &'static [&'static str],
    statements: fn(&AtomicBool) -> Result<Vec<Statement>, PaperError>,
}

/// Error of a paper's statements.
#[derive(Debug, Error)]
pub enum PaperError {
    /// The scenario of a statement is refused.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// The trials of a statement cannot run.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The iron has no such state.
    #[error(transparent)]
    Core(#[from] NoConvergence),
    /// A pulse cannot be simulated.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The computation was interrupted.
    #[error("interrupted")]
    Stopped,
}

impl Paper {
    /// The papers in the order of their years.
    pub const ALL: [Self; 4] = [wu::PAPER, mathworks::PAPER, szalay::PAPER, lelli::PAPER];

    /// Returns the paper of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|paper| paper.name == name)
    }

    /// Computes the paper's statements.
    ///
    /// # Errors
    /// See [`PaperError`].
    pub fn statements(&self, stop: &AtomicBool) -> Result<Vec<Statement>, PaperError> {
        (self.statements)(stop)
    }
}

/// Runs a scenario's trials and returns their records.
fn records(text: &str, stop: &AtomicBool) -> Result<Vec<Record>, PaperError> {
    let document = Document::parse("paper.toml".as_ref(), text)?;
    let trials = document.load_single()?.trials;
    let scenario = document.scenario_of(&document.motor()?)?;
    let mut records = Vec::new();
    let done = Campaign { scenario: &scenario, trials, threads: None }.run(stop, |record| {
        records.push(*record);
        Ok::<(), PaperError>(())
    })?;
    if done < trials { Err(PaperError::Stopped) } else { Ok(records) }
}

/// Returns the mean magnitude of the axis error in degrees.
fn mean_error(records: &[Record]) -> f64 {
    let errors: Vec<f64> =
        records.iter().filter_map(|record| record.axis_error_deg().map(f64::abs)).collect();
    errors.iter().sum::<f64>() / f64::from(u32::try_from(errors.len()).unwrap_or(u32::MAX))
}

mod lelli;
mod mathworks;
mod szalay;
mod wu;

#[cfg(test)]
mod tests {
    use super::*;

    /// promise: papers-repeated
    #[test]
    fn law_statements_of_papers_are_reproduced_or_have_a_reason() {
        let stop = AtomicBool::new(false);
        let mut reproduced = 0;
        for paper in Paper::ALL {
            assert!(
                Paper::named(paper.name).is_some() && paper.citation.contains("doi 10.")
                    || paper.name.starts_with("mathworks"),
                "{}",
                paper.name
            );
            let statements = paper.statements(&stop).expect("statements");
            for statement in &statements {
                assert!(statement.is_as_expected(), "{}: {statement:?}", paper.name);
                reproduced += usize::from(statement.witness.holds());
            }
        }
        assert_eq!(reproduced, 14);
    }
}
