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

/// Returns the slope of the flux along d in µH at this current in A.
fn slope(sheet: &str, current: f64) -> Result<f64, PaperError> {
    let document = Document::parse(
        "paper.toml".as_ref(),
        &format!("[motor]\n{}", sheet.replace("[nameplate]", "[motor.nameplate]")),
    )?;
    let survey = Survey::of(&document.motor()?.magnetics, current.abs(), 1, 0.0).map_err(PaperError::Core)?;
    Ok(1e6 * survey.along_d[if current > 0.0 { 2 } else { 0 }].l_dd)
}

fn statements(_: &AtomicBool) -> Result<Vec<Statement>, PaperError> {
    let motors = [
        (
            "Teknic 2310P",
            include_str!("mathworks-teknic.toml"),
            &[
                (-5.145, 189.0),
                (-4.48, 186.0),
                (-3.45, 181.0),
                (-2.77, 178.0),
                (2.775, 171.0),
                (3.4625, 169.0),
                (4.485, 167.0),
            ][..],
            &[(-0.525, 210.0), (0.535, 210.0)][..],
        ),
        (
            "Adlee BM-180E",
            include_str!("mathworks-adlee.toml"),
            &[(-10.105, 176.0), (-6.305, 175.0), (6.505, 173.0), (10.44, 172.0)],
            &[(1.57, 259.0)],
        ),
    ];
    let mut found = Vec::new();
    for (name, sheet, predicted, small) in motors {
        let of = |current: f64, theirs: f64| {
            let ours = slope(sheet, current)?;
            let what = format!("{name}: L_d at {current} A");
            Ok::<_, PaperError>(Statement::new(&what, "simulator's iron", "µH", [theirs, ours], 0.03))
        };
        for (current, theirs) in predicted {
            found.push(of(*current, *theirs)?);
        }
        for (current, theirs) in small {
            found.push(of(*current, *theirs)?.because(SMALL));
        }
    }
    // How much less inductance north has than south, of their mean.
    let [south, north] = [slope(motors[0].1, -3.4625)?, slope(motors[0].1, 3.4625)?];
    let apart = 100.0 * (south - north) / (0.5 * (south + north));
    found.push(Statement::new(
        "Teknic 2310P: poles differ at 3.46 A",
        "simulator's iron",
        "%",
        [6.9, apart],
        0.25,
    ));
    Ok(found)
}
