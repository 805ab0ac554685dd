//! Lelli et al. (2024): a flux map measured on a permanent-magnet synchronous reluctance motor, and a core that was fitted to it.

use std::sync::atomic::AtomicBool;

use standstill_numeric::atan2;
use standstill_plant::{Survey, built_in};

use super::{Paper, PaperError, Statement};

pub(super) const PAPER: Paper = Paper {
    name: "lelli-2024",
    citation: "L. Lelli, M. Hinkkanen, F. Giulii Capponi, \"A saturation model based on a simplified equivalent magnetic circuit for \
               permanent magnet machines\", ICEM 2024, doi 10.1109/ICEM60801.2024.10700403; measured map and core as in \
               github.com/Aalto-Electric-Drives/motulator (MIT)",
    assumed: &[
        "currents are peak values; the map is of 400 rpm and not of standstill",
        "measured inductances are chords from the map's point without current, its axis a central difference over ±2 A, ours a slope",
        "the core is that of the motor pm-reluctance; the paper itself was not read",
    ],
    statements,
};

const WHY: &str = "the core is a fit of eleven numbers to fluxes up to 26 A; near no current it is 7 % off in flux and up to 29 % in an inductance";

fn statements(_: &AtomicBool) -> Result<Vec<Statement>, PaperError> {
    let motor = built_in("pm-reluctance").expect("built in");
    let survey = |reach| Survey::of(&motor.magnetics, reach, 1, 0.0).map_err(PaperError::Core);
    // The points without current, and at ± the current along d.
    let six = survey(6.0)?;
    let rest = six.along_d[1].psi_d;
    let chord = |point: usize| 1e3 * (six.along_d[point].psi_d - rest) / six.along_d[point].i_d;
    // The direction of the smallest inductance for small signals at a current along q.
    let axis = |current: f64| {
        let point = survey(current)?.along_q[2];
        Ok::<_, PaperError>(0.5 * atan2(2.0 * point.l_dq, point.l_qq - point.l_dd).to_degrees())
    };
    let core = "the published core";
    let south = f64::from(u8::from(chord(2) > chord(0)));
    Ok(vec![
        Statement::new("axis of small signals at i_q = 12 A", core, "°", [-13.08, axis(12.0)?], 0.05),
        Statement::new("axis of small signals at i_q = 8 A", core, "°", [-1.29, axis(8.0)?], 0.03)
            .because(WHY, -6.643),
        Statement::new("axis of small signals at i_q = 4 A", core, "°", [2.81, axis(4.0)?], 0.03)
            .because(WHY, -0.9316),
        Statement::new("south draws more current at 6 A (1: yes)", core, "", [1.0, south], 0.0),
        Statement::new("flux along d without current", core, "mWb", [444.1, 1e3 * rest], 0.03)
            .because(WHY, 476.7),
        Statement::new("inductance along d to +6 A", core, "mH", [39.06, chord(2)], 0.03).because(WHY, 30.81),
        Statement::new("inductance along d to -6 A", core, "mH", [19.83, chord(0)], 0.03).because(WHY, 25.58),
    ])
}
