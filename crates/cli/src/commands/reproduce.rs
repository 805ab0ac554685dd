//! `standstill reproduce`: the tables and figures of the paper by Chen and Tao (2019), audited and simulated.

mod papers;
mod tables;

use std::fmt::Write as _;

use standstill_analysis::paper::{self, TABLE_2};
use standstill_campaign::store::Row;
use standstill_campaign::{Campaign, Statistics};
use standstill_detect::{Method, MethodName, Settings};
use standstill_quantity::{Quantity, count};
use standstill_report::page::{Block, Section};
use standstill_report::study::ErrorCloud;
use standstill_scenario::{Document, Record, Scenario, ScenarioFile, Specimen};
use standstill_sim::{Trace, run as simulate};
use standstill_table::{Format, TableError, Writer};

use crate::arguments::Reproduce;
use crate::columns::{self, trial_columns, trial_values};
use crate::error::Error;
use crate::log::Logged;
use crate::scenario::{self, Shipped, Shorthands};
use crate::shell::asked::NotedQuestion;
use crate::shell::interrupt::{self, INTERRUPTED};
use crate::shell::output::{Output, file_list};
use crate::shell::setup::in_words;
use crate::shell::{Report, progress};
use crate::{answer, figures, summary};

const FILES: [&str; 11] = [
    "audit.csv",
    "table1.csv",
    "table2.csv",
    "trials.csv",
    "summary.json",
    "error_over_angle.svg",
    "error_over_angle.png",
    "line_pulses.svg",
    "line_pulses.png",
    "polarity.svg",
    "polarity.png",
];

pub fn run(options: &Reproduce) -> Result<Report, Error> {
    if let Some(paper) = options.paper.as_deref().and_then(paper::Paper::named) {
        return papers::run(&paper);
    }
    let shorthands = Shorthands::default().setup(&options.setup).decay(options.decay).trials(options.trials);
    let document = scenario::document(&options.source, Shipped::Paper, shorthands)?;
    let study = Study::new(&document)?;
    let Study { file, scenario, .. } = &study;
    let said = format!("{}, seed {}, {} trials", study.setting, scenario.seed, file.trials);
    let asked = NotedQuestion::new("reproduce", said, &(file.limit, scenario), options.force.force);
    let stop = interrupt::flag();
    let mut output = Output::answering(asked, &options.out, &FILES)?;
    let mut text = study.heading();

    let findings = paper::audit();
    let rows = paper::simulate(scenario)?;
    write(&mut output, "audit.csv", columns::csv(&findings))?;
    let (records_1, table_1) = tables::table_1(&rows, &findings);
    let (records_2, table_2) = tables::table_2(&rows, &findings);
    write(&mut output, "table1.csv", records_1.csv())?;
    write(&mut output, "table2.csv", records_2.csv())?;
    text += &tables::audit_text(&findings);
    text += &tables::tables_text(&table_1, &table_2);

    let limit = file.limit.map_or(Statistics::LIMIT_DEG, Quantity::value);
    let mut statistics = Statistics::with_limit(limit);
    let mut cloud = ErrorCloud::default();
    let mut rows_to = output.begin("trials.csv")?;
    let bar = progress::bar(file.trials);
    let campaign = Campaign { scenario, trials: file.trials, threads: options.threads.map(usize::from) };
    let path = options.out.join("trials.csv");
    let failed = |error: TableError| Error::table(&path, error);
    let mut trials =
        Writer::new(&mut rows_to, Format::Csv, trial_columns(false).collect(), &[]).map_err(failed)?;
    let done = campaign.run(&stop, |record| {
        let row = Row::from(record);
        statistics.add_row(&row);
        cloud.add(record.true_angle_deg(), record.axis_error_deg(), record.error_deg());
        trials.row(&trial_values(&row, false).collect::<Vec<_>>()).map_err(failed)?;
        bar.inc(1);
        if record.trial % 512 == 511 {
            bar.set_message(format!("rms {}°", statistics.rms().alone()));
        }
        Ok::<(), Error>(())
    })?;
    bar.finish_and_clear();
    if done == 0 {
        // No file is written, and the files of an earlier run remain.
        return Ok(Report {
            text: "Interrupted before the first trials were done.\n".to_owned(),
            code: INTERRUPTED,
        });
    }
    trials.finish().map_err(failed)?;
    output.close("trials.csv", rows_to)?;

    let figures = statistics.summary();
    let interrupted = done < file.trials;
    text += &answer::sections(&[Section::new("Results", [Block::Table(summary::figures(&figures, false))])]);
    let json = serde_json::json!({
        "setup": super::setup_json(file, &scenario.motor),
        "trials_asked_for": file.trials,
        "interrupted": interrupted,
        "summary": figures,
    });
    output.file("summary.json", format!("{json:#}\n").as_bytes())?;
    study.draw(&mut output, &cloud)?;
    let files = output.finish()?;
    text += &file_list(&options.out, &files);
    if interrupted {
        let _ = writeln!(text, "\nInterrupted: {done} of {} trials are in these files.", file.trials);
        return Ok(Report { text, code: INTERRUPTED });
    }
    Ok(Report { text, code: u8::from(figures.errors > 0) })
}

fn write(output: &mut Output, name: &str, content: std::io::Result<Vec<u8>>) -> Result<(), Error> {
    let content = content.map_err(|error| Error::Write(name.into(), error))?;
    output.file(name, &content)
}

/// The reproduced study: the paper's method under the conditions of a scenario.
struct Study {
    file: ScenarioFile,
    scenario: Scenario<Method<f64>>,
    /// Motor and conditions as text.
    setting: String,
}

impl Study {
    fn new(document: &Document) -> Result<Self, Error> {
        let file = document.load_single()?;
        let method = file.detector.method();
        if let Some(library) = &file.detector.library {
            let needed = "a method whose tables these are";
            return Err(document.refuse("detector.library", &format!("\"{library}\""), needed).into());
        }
        let Some(decay) = super::decay(method) else {
            let [slow, fast] = [MethodName::LineInductance, MethodName::LineInductanceFast];
            let needed = format!("\"{slow}\" or \"{fast}\", whose tables these are");
            return Err(document.refuse("detector.method", &format!("\"{method}\""), &needed).into());
        };
        let scenario = document.scenario_of(&document.motor()?)?;
        let setting = format!(
            "{}, {}, {} decay, rotor {}",
            scenario.motor.name,
            in_words(file.errors.0),
            decay.name(),
            file.rotor.state().name()
        );
        Ok(Self { file, scenario, setting })
    }

    fn heading(&self) -> String {
        format!(
            "Initial rotor position by line inductances (Chen and Tao 2019)\n{}, seed {}\n\n",
            self.setting, self.scenario.seed
        )
    }

    fn draw(&self, output: &mut Output, cloud: &ErrorCloud) -> Result<(), Error> {
        let Self { scenario, setting, .. } = self;
        // The first rotor position of the paper's table 2.
        let angle = TABLE_2[0].measured_deg;
        let case = scenario.case_at(angle.to_radians(), Specimen { drive: 0, noise: 0 });
        let mut detector = Logged::new(scenario.detector.detector()?);
        let mut trace = Trace::new(2e-6);
        let run = simulate(&case, &mut detector, false, &mut trace);
        let axis = Record { trial: 0, run }.axis_deg().unwrap_or(angle);
        let place = format!("{setting}, θ = {angle}°");
        let over_angle = figures::error_over_angle(cloud, format!("{setting}, {} axes", count(cloud.axes())));
        let figures = [
            ("error_over_angle", over_angle),
            ("line_pulses", figures::line_pulses(&trace, &detector.entries, place.clone())),
            ("polarity", figures::polarity(&trace, &detector.entries, axis, place)),
        ];
        for (name, figure) in figures {
            output.figure(name, &figure)?;
        }
        Ok(())
    }
}
