//! Measured inductances over i_d of two motors, from the data file of a vendor's example.

use std::sync::atomic::AtomicBool;

use standstill_plant::Survey;
use standstill_scenario::Document;

use super::{Paper, PaperError, Statement};

pub(super) const PAPER: Paper = Paper {
    name: "mathworks-ipmsm",
    citation: "The MathWorks, Motor Control Blockset, example \"Estimate Initial Rotor Position Using Pulsating High-Frequency and \
               Dual-Pulse Methods\", mcb_ipmsm_pos_est_f28379d_data.m (2021-2022); no doi",
    assumed: &[
        "three numbers of each motor are taken from its table (L_d where no voltage is lost, the falls at the largest currents); the rest is predicted",
        "its inductances are slopes, as the file does not say; chords would be 3 % higher along +d",
    ],
    statements,
};

const SMALL: &str = "below 1.3 A and 1.6 A both motors rise alike with both signs, as a lost voltage would make it (dead time, L = U t/i); the \
                     file does not say so";

const TEKNIC: &str = include_str!("mathworks-teknic.toml");
const ADLEE: &str = include_str!("mathworks-adlee.toml");

/// Returns the slope of the flux along d in µH at this current in A.
fn slope(sheet: &str, current: f64) -> Result<f64, PaperError> {
    let document = Document::parse(
        "paper.toml".as_ref(),
        &format!("[motor]\n{}", sheet.replace("[nameplate]", "[motor.nameplate]")),
    )?;
    let survey = Survey::of(&document.motor()?.magnetics, current.abs(), 1, 0.0).map_err(PaperError::Core)?;
    Ok(1e6 * survey.along_d[if current > 0.0 { 2 } else { 0 }].l_dd)
}

/// Small currents in A and the table's inductances in µH there.
const LEAST: [(&str, &str, f64, f64); 3] = [
    ("Teknic 2310P: L_d at -0.525 A", TEKNIC, -0.525, 210.0),
    ("Teknic 2310P: L_d at 0.535 A", TEKNIC, 0.535, 210.0),
    ("Adlee BM-180E: L_d at 1.57 A", ADLEE, 1.57, 259.0),
];

/// Currents in A and by how many per cent of their mean the table's inductances against the magnet and along it differ there.
const APART: [(f64, f64); 3] = [(3.46, 6.9), (4.48, 10.8), (5.13, 13.0)];

fn statements(_: &AtomicBool) -> Result<Vec<Statement>, PaperError> {
    let by = "the simulator's iron";
    let apart = |current: f64| {
        let [south, north] = [slope(TEKNIC, -current)?, slope(TEKNIC, current)?];
        Ok::<_, PaperError>(100.0 * (south - north) / (0.5 * (south + north)))
    };
    let mut found = Vec::new();
    for (current, theirs) in APART {
        let what = format!("Teknic 2310P: poles differ at {current} A");
        found.push(Statement::new(&what, by, "%", [theirs, apart(current)?], 0.2));
    }
    let dip = "its 178 µH at -2.77 A lie below both neighbours, 180 and 181 µH: the table is no smooth curve";
    let ours = apart(2.77)?;
    found.push(
        Statement::new("Teknic 2310P: poles differ at 2.77 A", by, "%", [4.0, ours], 0.2).because(dip, 6.4),
    );
    for (what, sheet, current, theirs) in LEAST {
        let ours = slope(sheet, current)?;
        let then = if sheet == ADLEE { 174.6 } else { 176.0 };
        found.push(Statement::new(what, by, "µH", [theirs, ours], 0.03).because(SMALL, then));
    }
    Ok(found)
}
