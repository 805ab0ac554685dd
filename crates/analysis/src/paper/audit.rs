//! Audit of the published tables against the paper's own equations: each statement is recomputed from the printed data
//! and listed, whether it agrees or not.

use serde::Serialize;
use standstill_interface::{Abc, Phase};
use standstill_plant::{Winding, rotor_angle_from_lines};

use super::{TABLE_1, TABLE_2};

/// One statement of the paper, and whether the audit confirms it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Place of the statement in the paper.
    pub place: String,
    /// Quantity that is compared.
    pub quantity: String,
    /// Value as printed.
    pub printed: String,
    /// Value recomputed from the printed data.
    pub recomputed: String,
    /// True if both values agree within the rounding of the printed number.
    pub agrees: bool,
    /// Explanation of the disagreement; empty if the values agree.
    pub note: String,
}

fn finding(
    place: &str,
    quantity: &str,
    printed: String,
    recomputed: String,
    note: Option<String>,
) -> Finding {
    let (place, quantity) = (place.to_owned(), quantity.to_owned());
    Finding { place, quantity, printed, recomputed, agrees: note.is_none(), note: note.unwrap_or_default() }
}

/// Returns 2θ in degrees from three line inductances, in the range [0, 360)°. The saliency has the sign of interior magnets.
fn twice_angle(lines: [f64; 3]) -> f64 {
    2.0 * rotor_angle_from_lines(Abc(lines), -1.0).to_degrees()
}

/// Returns the angle `a` minus the angle `b` in degrees, in the range (−180, 180]°.
fn way(a: f64, b: f64) -> f64 {
    let way = (a - b).rem_euclid(360.0);
    if way > 180.0 { way - 360.0 } else { way }
}

/// Audits the paper's equations, tables and power rating.
pub fn audit() -> Vec<Finding> {
    [equations(), table_1(), vec![relabelling()], table_2(), vec![rating()]].concat()
}

fn table_1() -> Vec<Finding> {
    let sums = TABLE_1.map(|row| row.lines_mh.iter().sum::<f64>());
    let mean = sums.iter().sum::<f64>() / 5.0;
    let rows = TABLE_1.iter().zip(sums).zip(1..).flat_map(|((row, sum), number)| {
        let place = format!("Table 1, row {number}");
        let twice = twice_angle(row.lines_mh);
        let difference = way(row.twice_deg, twice);
        // A tenth of a millihenry of rounding in each inductance moves 2θ by up to 0.6°.
        let angle = (difference.abs() > 0.6).then(|| {
            format!("equation (7) with L_B < 0 gives {twice:.1}°, {difference:+.1}° from the printed angle")
        });
        let (off, share) = (sum - mean, 100.0 * (sum - mean) / mean);
        // Three inductances rounded to 0.1 mH, and the mean of five such sums.
        let constant = (off.abs() > 0.15 + 0.15).then(|| {
            format!("equation (5) makes the sum 9 L_A for every angle; this row is {share:+.1} % off")
        });
        let [printed, own] = [row.twice_deg, twice].map(|angle| format!("{angle:.1}"));
        let [sum, mean] = [format!("{sum:.1}"), format!("{mean:.1} (mean of the rows)")];
        [
            finding(&place, "2θ in degrees, equation (7)", printed, own, angle),
            finding(&place, "L_AB + L_BC + L_CA in mH, equation (5)", sum, mean, constant),
        ]
    });
    rows.collect()
}

/// Searches for an explanation of the printed angles: an order of the rows and columns, a sign of the saliency, a direction of rotation and
/// a constant offset.
fn relabelling() -> Finding {
    let mut best = (f64::INFINITY, String::new());
    for columns in orders(3) {
        for sign in [-1.0, 1.0] {
            let twice = TABLE_1.map(|row| {
                let lines = Abc([0, 1, 2].map(|k| row.lines_mh[columns[k]]));
                2.0 * rotor_angle_from_lines(lines, sign).to_degrees()
            });
            for direction in [1.0, -1.0] {
                for rows in orders(5) {
                    let errors: Vec<f64> = (0..5)
                        .map(|k| (TABLE_1[k].twice_deg - direction * twice[rows[k]]).rem_euclid(360.0))
                        .collect();
                    let worst = half_arc(errors);
                    if worst < best.0 {
                        let names: Vec<&str> = columns.iter().map(|k| ["L_AB", "L_BC", "L_CA"][*k]).collect();
                        let rows: Vec<String> = rows.iter().map(|row| (row + 1).to_string()).collect();
                        best = (worst, format!("columns {}, rows {}", names.join(" "), rows.join(" ")));
                    }
                }
            }
        }
    }
    let note = "no order of rows and columns, sign, direction and constant offset explains the five angles";
    let found = format!("best: {}, still {:.1}° off", best.1, best.0);
    let note = (best.0 > 0.6).then(|| note.to_owned());
    finding("Table 1", "2θ by any relabelling of rows and columns", "five angles".to_owned(), found, note)
}

/// Returns all permutations of the indices 0 to `n` − 1.
fn orders(n: usize) -> Vec<Vec<usize>> {
    if n == 0 {
        return vec![Vec::new()];
    }
    let within = |shorter: Vec<usize>| {
        (0..n).map(move |place| [&shorter[..place], &[n - 1], &shorter[place..]].concat())
    };
    orders(n - 1).into_iter().flat_map(within).collect()
}

/// Returns half of the shortest arc that contains all `angles`, which are in [0, 360)°. It is the largest error that remains after the best
/// constant offset is removed.
fn half_arc(mut angles: Vec<f64>) -> f64 {
    angles.sort_unstable_by(f64::total_cmp);
    let around = angles.first().zip(angles.last()).map_or(360.0, |(first, last)| first + 360.0 - last);
    let gap = angles.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max);
    (360.0 - gap) / 2.0
}

/// Audits the paper's equations for the inferred winding, at the first resolver angle.
fn equations() -> Vec<Finding> {
    let winding = Winding { mean_inductance: 9.2e-3, saliency: -2.1e-3, leakage: 0.0 };
    let angle = TABLE_2[0].measured_deg.to_radians();
    let l = winding.inductance_matrix(angle);
    let mismatch = (l[(0, 0)] - 2.0 * l[(0, 1)]) * 1e3;
    let line = winding.line_inductance(Phase::A, Phase::B, angle) - winding.line_inductances(angle).0[0];
    let printed = TABLE_1[0].twice_deg;
    let sign = 2.0 * rotor_angle_from_lines(Abc(TABLE_1[0].lines_mh), 1.0).to_degrees();
    let first = (mismatch.abs() > 1e-6 && line.abs() < 1e-12).then(|| {
        format!(
            "as printed L_AA − 2 M_AB would be zero, it is {mismatch:.1} mH; with L_BB equation (4) follows"
        )
    });
    let signs =
        "as a four-quadrant arctangent the printed signs hold for L_B > 0; interior magnets have L_B < 0";
    let signs = (way(sign, printed).abs() > 0.6).then(|| signs.to_owned());
    let [stands, needed] = ["L_AA + L_AB", "L_AA + L_BB"].map(|sum| format!("L_AB = {sum} − 2 M_AB"));
    let [printed, sign] = [printed, sign].map(|angle| format!("{angle:.1}"));
    vec![
        finding("Equation (3)", "first line", stands, needed, first),
        finding(
            "Equation (7)",
            "row 1 of Table 1 with the signs as printed, in degrees",
            printed,
            sign,
            signs,
        ),
    ]
}

fn table_2() -> Vec<Finding> {
    let mut findings = Vec::new();
    for (k, row) in TABLE_2.iter().enumerate() {
        let place = format!("Table 2, row {}", k + 1);
        let mut add = |quantity: &str, printed: String, recomputed: String, note: Option<String>| {
            findings.push(finding(&place, quantity, printed, recomputed, note));
        };
        let (first, half) = (row.candidates_deg[0], TABLE_1[k].twice_deg / 2.0);
        let off = first - half;
        let note = (off.abs() > 0.101).then(|| format!("{off:+.2}° from half the printed 2θ"));
        let quantity = "first candidate: half of Table 1's 2θ, in degrees";
        add(quantity, format!("{first:.1}"), format!("{half:.2}"), note);
        let larger = usize::from(row.current_a[0] <= row.current_a[1]);
        let (by_current, declared) = (row.candidates_deg[larger], row.identified_deg);
        let note = (way(by_current, declared).abs() > 0.05).then(|| {
            let current = row.current_a[larger];
            format!("the larger i_d, {current:.2} A, is at {by_current:.1}°, but {declared:.1}° is declared")
        });
        let quantity = "angle by the larger i_d, in degrees";
        add(quantity, format!("{declared:.1}"), format!("{by_current:.1}"), note);
        let (error, printed) = (way(declared, row.measured_deg), row.error_deg);
        let note =
            ((error - printed).abs() > 0.051).then(|| "the printed error is not the difference".to_owned());
        let quantity = "error: declared minus measured, in degrees";
        add(quantity, format!("{printed:+.1}"), format!("{error:+.1}"), note);
        let note = (error.abs() > 2.0).then(|| "outside the ±2° that the paper states".to_owned());
        add("error within ±2°", "yes".to_owned(), format!("{error:+.1}°"), note);
        let difference = (row.current_a[0] - row.current_a[1]).abs();
        let note = (difference < 0.3).then(|| "less than the paper states".to_owned());
        add("difference of the two i_d, in A", "0.3 or more".to_owned(), format!("{difference:.2}"), note);
    }
    let rms = |errors: [f64; 5]| (errors.iter().map(|e| e * e).sum::<f64>() / 5.0).sqrt();
    let printed = rms(TABLE_2.map(|row| row.error_deg));
    let own = rms(TABLE_2.map(|row| way(row.identified_deg, row.measured_deg)));
    let note = ((printed - own).abs() > 0.005).then(|| "row 5 makes the difference".to_owned());
    let [printed, own] = [printed, own].map(|rms| format!("{rms:.2}"));
    findings.push(finding("Table 2", "rms of the five errors in degrees", printed, own, note));
    findings
}

/// Audits the paper's rating of 5.5 kW at 8 A. Without overmodulation, a 550 V link gives a line voltage of 550/√2 V rms.
fn rating() -> Finding {
    let apparent = 3.0_f64.sqrt() * 550.0 / 2.0_f64.sqrt() * 8.0 / 1000.0;
    let note = "beyond the apparent power of linear modulation, whatever the power factor";
    let note = (apparent < 5.5).then(|| note.to_owned());
    let quantity = "5.5 kW at 8 A rms from 550 V, in kVA";
    finding("Section 2", quantity, "5.5".to_owned(), format!("{apparent:.2}"), note)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disagreements(place: &str) -> Vec<String> {
        audit().into_iter().filter(|f| f.place == place && !f.agrees).map(|f| f.quantity).collect()
    }

    #[test]
    fn analytic_only_row_1_of_table_1_follows_from_equation_7() {
        let twice: Vec<f64> = TABLE_1.iter().map(|row| twice_angle(row.lines_mh)).collect();
        for (got, expected) in twice.iter().zip([83.8, 43.3, 287.2, 43.6, 335.7]) {
            assert!((got - expected).abs() < 0.06, "{twice:?}");
        }
        let angle = "2θ in degrees, equation (7)".to_owned();
        assert!(!disagreements("Table 1, row 1").contains(&angle));
        for row in 2..=5 {
            assert!(disagreements(&format!("Table 1, row {row}")).contains(&angle));
        }
        assert_eq!(disagreements("Table 1").len(), 1, "no relabelling explains the table");
        assert_eq!(disagreements("Equation (3)").len() + disagreements("Equation (7)").len(), 2);
    }

    #[test]
    fn analytic_a_relabelling_would_be_found() {
        assert_eq!(orders(5).len(), 120);
        assert!((half_arc(vec![359.0, 1.0, 3.0]) - 2.0).abs() < 1e-12);
        assert!((half_arc(vec![10.0, 40.0]) - 15.0).abs() < 1e-12);
    }

    #[test]
    fn analytic_table_2_disagrees_in_rows_4_and_5() {
        for row in 1..=3 {
            assert!(disagreements(&format!("Table 2, row {row}")).is_empty());
        }
        assert_eq!(
            disagreements("Table 2, row 4"),
            ["first candidate: half of Table 1's 2θ, in degrees", "angle by the larger i_d, in degrees"]
        );
        assert_eq!(
            disagreements("Table 2, row 5"),
            ["error: declared minus measured, in degrees", "error within ±2°"]
        );
        assert_eq!(disagreements("Section 2").len(), 1);
    }
}
