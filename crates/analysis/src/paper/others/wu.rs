//! Wu et al. (2021): twelve voltage vectors 30° apart, then half the step around the best one.

use std::sync::atomic::AtomicBool;

use standstill_numeric::{atan2, exp, sin_cos};

use super::{Paper, PaperError, Statement, mean_error, records};

pub(super) const PAPER: Paper = Paper {
    name: "wu-2021",
    citation: "X. Wu, Z. Lv, Z. Ling, X. Zhang, G. Tan, \"An Improved Pulse Voltage Injection Based Initial Rotor Position Estimation \
               Method for PMSM\", IEEE Access 9 (2021) 121906-121915, doi 10.1109/ACCESS.2021.3109092",
    assumed: &[
        "flux 0.2185 Wb, which follows from its two torques",
        "dead time 2.5 µs",
        "saturation of 38 % along the magnet and -45 % against it at 95 A, fitted by hand to the twelve currents of its figure 18",
        "angles drawn at random in place of its twelve",
    ],
    statements,
};

/// The paper's motor: L_d and L_q in H, resistance in Ω. Its pulses: voltage in V, time in s.
const L: [f64; 2] = [0.95e-3, 2.05e-3];
const R: f64 = 0.1;
const U: f64 = 100.0;
const T: f64 = 1e-3;

const SCENARIO: &str = include_str!("wu-2021.toml");

fn statements(stop: &AtomicBool) -> Result<Vec<Statement>, PaperError> {
    // Current of a step of voltage along an axis, and by how much that along d exceeds that along q.
    let current = |inductance: f64| U / R * (1.0 - exp(-R * T / inductance));
    let apart = current(L[0]) - current(L[1]);
    let (sine, cosine) = sin_cos(5f64.to_radians());
    // The arc sine of the root of 2 ΔI/Δi.
    let share = 2.0 * 0.5 / apart;
    let largest = atan2(share.sqrt(), (1.0 - share).sqrt()).to_degrees();
    let records = records(SCENARIO, stop)?;
    let wrong = records.iter().filter(|record| record.pole_correct() == Some(false)).count();
    let closed = "closed form";
    Ok(vec![
        Statement::new("fall of i_d with the vector 5° off", closed, "A", [0.4, apart * sine * sine], 0.03),
        Statement::new("rise of i_q with the vector 5° off", closed, "A", [4.58, apart * sine * cosine], 0.03),
        Statement::new("largest error of the largest i_d with ±0.5 A", closed, "°", [8.0, largest], 0.03),
        Statement::new("mean error of the largest i_d", "subdivision", "°", [4.05, mean_error(&records)], 0.1).because(
            "no set of errors that the paper states gives more than 1.9°; four of its readings at one angle differ by 0.12 A, not by \
             ±1 A, and its largest i_d and its zero of i_q lie 2° beside its encoder's angle on the same side, as noise does not",
            1.84,
        ),
        Statement::new("wrong poles", "subdivision", "", [0.0, f64::from(u32::try_from(wrong).unwrap_or(u32::MAX))], 0.0),
    ])
}
