//! The published tables of the paper, their audit and their simulation. The paper is: Chen Cheng and Tao Ze'an, *On-Line Detection Method
//! for Initial Rotor Position Angle of Permanent Magnet Synchronous Motor*, 2019, article 1673-6540(2019)06-0102-04.

mod audit;
mod others;
mod simulate;

pub use audit::{Finding, audit};
pub use others::{Paper, PaperError, Statement};
pub use simulate::{SimulatedRow, simulate};

/// One row of the paper's Table 1 as printed. It has the line inductances and the angle that the paper computed from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table1Row {
    /// Line inductances L_AB, L_BC, L_CA in mH.
    pub lines_mh: [f64; 3],
    /// Twice the electrical rotor angle, 2θ, in degrees.
    pub twice_deg: f64,
}

/// One row of the paper's Table 2 as printed. It has the polarity test and the error. All angles are electrical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table2Row {
    /// The two candidates for the rotor angle in degrees.
    pub candidates_deg: [f64; 2],
    /// Current i_d in A that the voltage vector causes at each candidate.
    pub current_a: [f64; 2],
    /// Rotor angle in degrees that the paper's method found.
    pub identified_deg: f64,
    /// Rotor angle in degrees that the paper's resolver measured.
    pub measured_deg: f64,
    /// Error of the found angle as printed, in degrees.
    pub error_deg: f64,
}

/// Table 1 of the paper, with the line inductances and the angle computed from them.
pub const TABLE_1: [Table1Row; 5] = [
    Table1Row { lines_mh: [33.6, 27.6, 18.8], twice_deg: 83.8 },
    Table1Row { lines_mh: [28.7, 31.3, 22.5], twice_deg: 120.4 },
    Table1Row { lines_mh: [21.6, 30.2, 32.8], twice_deg: 170.6 },
    Table1Row { lines_mh: [29.1, 32.2, 21.5], twice_deg: 242.3 },
    Table1Row { lines_mh: [25.3, 34.0, 28.9], twice_deg: 306.4 },
];

const fn row(
    candidates_deg: [f64; 2],
    current_a: [f64; 2],
    [identified_deg, measured_deg, error_deg]: [f64; 3],
) -> Table2Row {
    Table2Row { candidates_deg, current_a, identified_deg, measured_deg, error_deg }
}

/// Table 2 of the paper, with the polarity test and the error. Its rows have the order of Table 1.
pub const TABLE_2: [Table2Row; 5] = [
    row([41.9, 221.9], [8.17, 7.68], [41.9, 43.2, -1.3]),
    row([60.2, 240.2], [8.14, 8.49], [240.2, 241.6, -1.4]),
    row([85.3, 265.3], [8.21, 7.85], [85.3, 84.5, 0.8]),
    row([121.7, 301.7], [8.64, 8.28], [301.7, 300.5, 1.2]),
    row([153.2, 333.2], [8.33, 7.95], [153.2, 155.4, -1.1]),
];
