//! A run whose trials a host program carries out, for example with its own detector. The results have the form of those
//! of `standstill run`.

use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use rayon::prelude::*;
use standstill_campaign::store::{Row, Shard, Sweep as Trials};
use standstill_detect::Method;
use standstill_interface::PoleEvidence;
use standstill_scenario::{Plan, Scenario};
use standstill_table::{Cell, Column, Columns, Kind};

use super::results::{Points, Results};
use crate::arguments::{Arguments, Command, Run};
use crate::error::Error;
use crate::shell::host::Host;
use crate::shell::{command_line, progress, workers};

/// Number of trials, per thread, that are begun together.
const BLOCK: u64 = 16;

/// Function that carries out a trial. It receives the scenario with the trial's draws, and the trial's number.
pub type Trial<'a, E> = &'a (dyn Fn(&Scenario<Method<f64>>, u64) -> Result<Hosted, E> + Sync);

/// Results of a trial that a host program carried out.
#[derive(Debug)]
pub struct Hosted {
    /// Row of the trial, as in a file of trials.
    pub row: Row,
    /// Evidence for the pole, if the method measures it.
    pub evidence: Option<PoleEvidence<f64>>,
}

/// Additional columns after those of a trial; their names are those in the `result.json` of a trace.
const EVIDENCE: [&str; 2] = ["pole_evidence_deviations", "pole_evidence_needed"];

/// Reason why a run in a host program has no results.
#[derive(Debug)]
pub enum Stopped<E> {
    /// The run's command line or scenario is wrong; the message has one line.
    Wrong(String),
    /// A trial could not be carried out: the number of the first such trial, and its error.
    Trial(u64, E),
    /// The host requested the end of the run by [`Host::stop`].
    Asked,
}

impl<E> From<Error> for Stopped<E> {
    fn from(error: Error) -> Self {
        Self::Wrong(command_line::one_line(&error.to_string()))
    }
}

impl Host {
    /// Carries out a command line `run …` whose trials `trial` computes. Its detector is `class`
    /// (`module.Class@digest`): the run's record names this class, and only a host program can continue that record.
    /// Returns the summary as JSON; the rows are in [`Host::tables`].
    ///
    /// # Errors
    /// The scenario has a mistake, a record of another class exists, or a trial failed; the error is that of the first
    /// such trial.
    pub fn trials<E: Send>(
        self: &Arc<Self>,
        words: impl IntoIterator<Item = OsString>,
        class: &str,
        trial: Trial<'_, E>,
    ) -> Result<String, Stopped<E>> {
        self.run(|| {
            let words = std::iter::once("standstill".into()).chain(words);
            let Arguments { command: Command::Run(options) } = crate::arguments(words)? else {
                return Err(Stopped::Wrong("not a command line of `run`".to_owned()));
            };
            self.carry_out(&options, class, trial)
        })
    }

    fn carry_out<E: Send>(
        &self,
        options: &Run,
        class: &str,
        trial: Trial<'_, E>,
    ) -> Result<String, Stopped<E>> {
        let mut document = super::document_of(options)?;
        document.host(class).map_err(Error::from)?;
        let plan = Plan::new(document).map_err(Error::from)?;
        let threads = options.threads.map(usize::from);
        let sweep = Trials { plan: &plan, shard: Shard::WHOLE, threads };
        let identity = sweep.identity().map_err(Error::from)?;
        let pool = workers(threads)?;
        let mut points = Points::of(&identity)?;
        let evidence = EVIDENCE.into_iter().map(|name| Column::new(name, Kind::Number));
        let mut table = Columns::new(points.columns().chain(evidence).collect());
        let bar = progress::bar(identity.rows());
        let stop = self.flag();
        for point in 0..plan.points().len() {
            let scenario = plan.scenario(point).map_err(Error::from)?;
            let one = |number: u64| {
                if stop.load(Ordering::Relaxed) {
                    return Err(Stopped::Asked);
                }
                let run =
                    |scenario: &_| trial(scenario, number).map_err(|error| Stopped::Trial(number, error));
                if plan.has_tolerances() {
                    run(&plan.single(point, number).map_err(Error::from)?.scenario)
                } else {
                    run(&scenario)
                }
            };
            let mut done = 0;
            while done < identity.trials {
                let end = (done + BLOCK * pool.current_num_threads() as u64).min(identity.trials);
                let rows: Vec<Result<Hosted, Stopped<E>>> =
                    pool.install(|| (done..end).into_par_iter().map(one).collect());
                for row in rows {
                    let Hosted { row, evidence } = row?;
                    let mut cells = points.cells(point, &row);
                    let evidence = evidence.map(|of| [of.deviations, of.needed].map(Cell::Number));
                    cells.extend(evidence.unwrap_or([Cell::Empty, Cell::Empty]));
                    table.row(&cells).map_err(Error::Table)?;
                    points.add(point, &row);
                }
                bar.inc(end - done);
                done = end;
            }
        }
        bar.finish_and_clear();
        points.close();
        let results = Results::finish(&options.results, None, &identity, points, None)?;
        self.keep("trials", table);
        Ok(results.json)
    }
}
