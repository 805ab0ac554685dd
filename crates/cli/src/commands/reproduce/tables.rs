//! Tables 1 and 2 of the paper, with simulated beside published values, and the audit of the published values.

use standstill_analysis::paper::{Finding, SimulatedRow, TABLE_1, TABLE_2};
use standstill_interface::Abc;
use standstill_plant::rotor_angle_from_lines;
use standstill_report::page::{Column, Table};
use standstill_scenario::Verdict;

use crate::answer::{Record, Records};
use crate::shell::table::Print as _;
use crate::shell::terminal::paragraph;

/// Returns the audit's notes on published values that disagree with the paper's equations. `place` selects one place of the paper, such as
/// `Table 1, row 2`.
fn disagreements(findings: &[Finding], place: &str) -> String {
    let notes: Vec<&str> =
        findings.iter().filter(|f| f.place == place && !f.agrees).map(|f| f.note.as_str()).collect();
    notes.join("; ")
}

/// Builds table 1 as rows for its file and as a table to print. `rows` contains the simulated positions, and `findings` the results of the
/// audit.
pub fn table_1(rows: &[SimulatedRow; 5], findings: &[Finding]) -> (Records, Table) {
    let build = |(k, row): (usize, &SimulatedRow)| {
        let published = TABLE_1[k].lines_mh;
        let twice_published = TABLE_1[k].twice_deg;
        let recomputed = 2.0 * rotor_angle_from_lines(Abc(published), -1.0).to_degrees();
        let ideal = row.ideal_lines.0.map(|l| l * 1e3);
        let simulated = row.record.findings().line_inductance.map(|Abc(lines)| lines.map(|l| l * 1e3));
        let twice = row.record.axis_deg().map(|axis| 2.0 * axis);
        let twice_true = (2.0 * row.angle_deg).rem_euclid(360.0);
        let lines = |record: Record, name: &str, lines: Option<[f64; 3]>| {
            ["ab", "bc", "ca"].iter().enumerate().fold(record, |record, (k, line)| {
                record.with(&format!("l_{line}_{name}_mh"), lines.map(|lines| lines[k]))
            })
        };
        let record = Record::default().with("position", k + 1).with("resolver_angle_deg", row.angle_deg);
        let record = lines(record, "published", Some(published))
            .with("twice_theta_published_deg", twice_published)
            .with("twice_theta_recomputed_deg", recomputed);
        let record = lines(lines(record, "equation_4", Some(ideal)), "simulated", simulated)
            .with("twice_theta_simulated_deg", twice)
            .with("twice_theta_true_deg", twice_true)
            .with("disagreements", disagreements(findings, &format!("Table 1, row {}", k + 1)));
        let three = |lines: [Option<f64>; 3]| lines.map(|l| number(l, 1)).join(" ");
        let cells = vec![
            (k + 1).to_string(),
            three(published.map(Some)),
            three(ideal.map(Some)),
            three(std::array::from_fn(|k| simulated.map(|lines| lines[k]))),
            format!("{twice_published:.1}"),
            format!("{recomputed:.1}"),
            number(twice, 1),
            format!("{twice_true:.1}"),
        ];
        (record, cells)
    };
    let (records, cells): (Vec<_>, Vec<_>) = rows.iter().enumerate().map(build).unzip();
    let titles =
        ["", "published", "equation (4)", "simulated", "2θ publ.", "2θ recomp.", "2θ simul.", "2θ true"];
    (Records(records), Table::new(titles.map(Column::number)).rows(cells))
}

/// Builds table 2 as rows for its file and as a table to print. `rows` contains the simulated positions, and `findings` the results of the
/// audit.
pub fn table_2(rows: &[SimulatedRow; 5], findings: &[Finding]) -> (Records, Table) {
    let build = |(k, row): (usize, &SimulatedRow)| {
        let published = TABLE_2[k];
        let currents = row.record.findings().polarity.map(|p| [p.along, p.against]);
        let current = |k: usize| currents.map(|currents| currents[k]);
        let (identified, apart) = (row.record.estimated_angle_deg(), row.error_to_resolver_deg());
        let record = Record::default()
            .with("position", k + 1)
            .with("candidate_1_published_deg", published.candidates_deg[0])
            .with("candidate_2_published_deg", published.candidates_deg[1])
            .with("i_d_1_published_a", published.current_a[0])
            .with("i_d_2_published_a", published.current_a[1])
            .with("identified_published_deg", published.identified_deg)
            .with("measured_published_deg", published.measured_deg)
            .with("error_published_deg", published.error_deg)
            .with("candidate_1_simulated_deg", row.record.axis_deg())
            .with("candidate_2_simulated_deg", row.record.axis_deg().map(|axis| axis + 180.0))
            .with("i_d_1_simulated_a", current(0))
            .with("i_d_2_simulated_a", current(1))
            .with("identified_simulated_deg", identified)
            .with("resolver_simulated_deg", row.resolver_deg)
            .with("error_to_resolver_simulated_deg", apart)
            .with("error_to_true_simulated_deg", row.record.error_deg())
            .with("pole_correct_simulated", row.record.pole_correct())
            .with("outcome_simulated", row.record.verdict().name())
            .with("disagreements", disagreements(findings, &format!("Table 2, row {}", k + 1)));
        let named = match row.record.verdict() {
            Verdict::Found => number(identified, 1),
            verdict => verdict.name().to_owned(),
        };
        let cells = vec![
            (k + 1).to_string(),
            format!("{:.1}", published.measured_deg),
            format!("{:.1}", row.resolver_deg),
            published.current_a.map(|current| format!("{current:.2}")).join(" "),
            [0, 1].map(|k| number(current(k), 2)).join(" "),
            format!("{:.1}", published.identified_deg),
            named,
            format!("{:+.1}", published.error_deg),
            apart.map_or_else(|| "–".to_owned(), |error| format!("{error:+.1}")),
        ];
        (record, cells)
    };
    let (records, cells): (Vec<_>, Vec<_>) = rows.iter().enumerate().map(build).unzip();
    let titles = [
        "",
        "measured publ.",
        "simul.",
        "i_d publ.",
        "i_d simul.",
        "θ publ.",
        "θ simul.",
        "error publ.",
        "error simul.",
    ];
    (Records(records), Table::new(titles.map(Column::number)).rows(cells))
}

/// Returns the text of the audit: published values that disagree with the paper's equations.
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

/// Returns the text of both tables.
pub fn tables_text(first: &Table, second: &Table) -> String {
    format!("{}{}\n{}{}\n", paragraph("", FIRST), first.text(), paragraph("", SECOND), second.text())
}

const FIRST: &str = "Table 1, line inductances L_AB L_BC L_CA in mH and 2θ in degrees. The simulated rotor stands where the \
     paper's resolver read; recomputed is equation (7) on the published inductances.";

const SECOND: &str = "Table 2, i_d in A with the vector at the first and the second candidate, angles in degrees; errors against \
     the angle that the resolver measured, simulated with an error of its own.";
