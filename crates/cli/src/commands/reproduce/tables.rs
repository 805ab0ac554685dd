//! Tables 1 and 2, simulated beside published, and the audit.

use serde::Serialize;
use standstill_analysis::paper::{Finding, SimulatedRow, TABLE_1, TABLE_2};
use standstill_interface::Abc;
use standstill_plant::rotor_angle_from_lines;
use standstill_scenario::Verdict;

use super::disagreements;
use crate::shell::table::Print as _;
use crate::shell::terminal::paragraph;
use standstill_report::page::{Column, Table};

/// A row of `table1.csv`.
#[derive(Debug, Serialize)]
pub struct Table1Csv {
    position: usize,
    resolver_angle_deg: f64,
    l_ab_published_mh: f64,
    l_bc_published_mh: f64,
    l_ca_published_mh: f64,
    twice_theta_published_deg: f64,
    twice_theta_recomputed_deg: f64,
    l_ab_equation_4_mh: f64,
    l_bc_equation_4_mh: f64,
    l_ca_equation_4_mh: f64,
    l_ab_simulated_mh: Option<f64>,
    l_bc_simulated_mh: Option<f64>,
    l_ca_simulated_mh: Option<f64>,
    twice_theta_simulated_deg: Option<f64>,
    twice_theta_true_deg: f64,
    disagreements: String,
}

/// A row of `table2.csv`.
#[derive(Debug, Serialize)]
pub struct Table2Csv {
    position: usize,
    candidate_1_published_deg: f64,
    candidate_2_published_deg: f64,
    i_d_1_published_a: f64,
    i_d_2_published_a: f64,
    identified_published_deg: f64,
    measured_published_deg: f64,
    error_published_deg: f64,
    candidate_1_simulated_deg: Option<f64>,
    candidate_2_simulated_deg: Option<f64>,
    i_d_1_simulated_a: Option<f64>,
    i_d_2_simulated_a: Option<f64>,
    identified_simulated_deg: Option<f64>,
    resolver_simulated_deg: f64,
    error_to_resolver_simulated_deg: Option<f64>,
    error_to_true_simulated_deg: Option<f64>,
    pole_correct_simulated: Option<bool>,
    outcome_simulated: &'static str,
    disagreements: String,
}

/// Table 1.
pub fn table_1(rows: &[SimulatedRow; 5], findings: &[Finding]) -> Vec<Table1Csv> {
    let build = |(k, row): (usize, &SimulatedRow)| {
        let [ab, bc, ca] = TABLE_1[k].lines_mh;
        let [ab4, bc4, ca4] = row.ideal_lines.0.map(|l| l * 1e3);
        let simulated = row.findings.line_inductance.map(|Abc(lines)| lines.map(|l| l * 1e3));
        Table1Csv {
            position: k + 1,
            resolver_angle_deg: row.angle_deg,
            l_ab_published_mh: ab,
            l_bc_published_mh: bc,
            l_ca_published_mh: ca,
            twice_theta_published_deg: TABLE_1[k].twice_deg,
            twice_theta_recomputed_deg: 2.0 * rotor_angle_from_lines(Abc([ab, bc, ca]), -1.0).to_degrees(),
            l_ab_equation_4_mh: ab4,
            l_bc_equation_4_mh: bc4,
            l_ca_equation_4_mh: ca4,
            l_ab_simulated_mh: simulated.map(|l| l[0]),
            l_bc_simulated_mh: simulated.map(|l| l[1]),
            l_ca_simulated_mh: simulated.map(|l| l[2]),
            twice_theta_simulated_deg: row.axis_deg().map(|axis| 2.0 * axis),
            twice_theta_true_deg: (2.0 * row.angle_deg).rem_euclid(360.0),
            disagreements: disagreements(findings, &format!("Table 1, row {}", k + 1)),
        }
    };
    rows.iter().enumerate().map(build).collect()
}

/// Table 2.
pub fn table_2(rows: &[SimulatedRow; 5], findings: &[Finding]) -> Vec<Table2Csv> {
    let build = |(k, row): (usize, &SimulatedRow)| {
        let published = TABLE_2[k];
        Table2Csv {
            position: k + 1,
            candidate_1_published_deg: published.candidates_deg[0],
            candidate_2_published_deg: published.candidates_deg[1],
            i_d_1_published_a: published.current_a[0],
            i_d_2_published_a: published.current_a[1],
            identified_published_deg: published.identified_deg,
            measured_published_deg: published.measured_deg,
            error_published_deg: published.error_deg,
            candidate_1_simulated_deg: row.axis_deg(),
            candidate_2_simulated_deg: row.axis_deg().map(|axis| axis + 180.0),
            i_d_1_simulated_a: row.findings.polarity.map(|p| p.along),
            i_d_2_simulated_a: row.findings.polarity.map(|p| p.against),
            identified_simulated_deg: row.record.estimated_angle_deg(),
            resolver_simulated_deg: row.resolver_deg,
            error_to_resolver_simulated_deg: row.error_to_resolver_deg(),
            error_to_true_simulated_deg: row.record.error_deg(),
            pole_correct_simulated: row.record.pole_correct(),
            outcome_simulated: row.record.verdict().name(),
            disagreements: disagreements(findings, &format!("Table 2, row {}", k + 1)),
        }
    };
    rows.iter().enumerate().map(build).collect()
}

/// The audit in words: what does not agree.
pub fn audit_text(findings: &[Finding]) -> String {
    let agree = findings.iter().filter(|f| f.agrees).count();
    let rows = findings
        .iter()
        .filter(|f| !f.agrees)
        .map(|f| vec![f.place.clone(), f.printed.clone(), f.recomputed.clone(), f.note.clone()]);
    format!(
        "Audit of the published tables: {agree} of {} statements agree with the paper's equations; these do not:\n{}\n",
        findings.len(),
        Table::new(["place", "printed", "recomputed", "disagreement"].map(Column::prose)).rows(rows).text()
    )
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

/// Both tables in words.
pub fn tables_text(rows: &[SimulatedRow; 5], findings: &[Finding]) -> String {
    let first = table_1(rows, findings).into_iter().map(|row| {
        let (l1, l2, l3) = (row.l_ab_simulated_mh, row.l_bc_simulated_mh, row.l_ca_simulated_mh);
        vec![
            row.position.to_string(),
            format!("{:.1} {:.1} {:.1}", row.l_ab_published_mh, row.l_bc_published_mh, row.l_ca_published_mh),
            format!(
                "{:.1} {:.1} {:.1}",
                row.l_ab_equation_4_mh, row.l_bc_equation_4_mh, row.l_ca_equation_4_mh
            ),
            format!("{} {} {}", number(l1, 1), number(l2, 1), number(l3, 1)),
            format!("{:.1}", row.twice_theta_published_deg),
            format!("{:.1}", row.twice_theta_recomputed_deg),
            number(row.twice_theta_simulated_deg, 1),
            format!("{:.1}", row.twice_theta_true_deg),
        ]
    });
    let second = rows.iter().zip(table_2(rows, findings)).map(|(simulated, row)| {
        let named = match simulated.record.verdict() {
            Verdict::Found => number(row.identified_simulated_deg, 1),
            verdict => verdict.name().to_owned(),
        };
        vec![
            row.position.to_string(),
            format!("{:.1}", row.measured_published_deg),
            format!("{:.1}", row.resolver_simulated_deg),
            format!("{:.2} {:.2}", row.i_d_1_published_a, row.i_d_2_published_a),
            format!("{} {}", number(row.i_d_1_simulated_a, 2), number(row.i_d_2_simulated_a, 2)),
            format!("{:.1}", row.identified_published_deg),
            named,
            format!("{:+.1}", row.error_published_deg),
            row.error_to_resolver_simulated_deg
                .map_or_else(|| "–".to_owned(), |error| format!("{error:+.1}")),
        ]
    });
    format!(
        "{}{}\n{}{}\n",
        paragraph("", FIRST),
        Table::new(
            ["", "published", "equation (4)", "simulated", "2θ publ.", "2θ recomp.", "2θ simul.", "2θ true"]
                .map(Column::number)
        )
        .rows(first)
        .text(),
        paragraph("", SECOND),
        Table::new(
            [
                "",
                "measured publ.",
                "simul.",
                "i_d publ.",
                "i_d simul.",
                "θ publ.",
                "θ simul.",
                "error publ.",
                "error simul.",
            ]
            .map(Column::number)
        )
        .rows(second)
        .text()
    )
}

const FIRST: &str = "Table 1, line inductances L_AB L_BC L_CA in mH and 2θ in degrees. The simulated rotor stands where the \
     paper's resolver read; recomputed is equation (7) on the published inductances.";

const SECOND: &str = "Table 2, i_d in A with the vector at the first and the second candidate, angles in degrees; errors against \
     the angle that the resolver measured, simulated with an error of its own.";
