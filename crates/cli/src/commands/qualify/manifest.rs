//! Manifest of a qualification (program, files, machine), and its annexes.

use std::path::Path;

use serde_json::{Value, json};
use standstill_analysis::qualify::{NOT_MODELLED, Qualification};
use standstill_analysis::witness::Witness;
use standstill_campaign::NUMERICS;
use standstill_foreign::ABI;
use standstill_plant::{Digest, Entry};
use standstill_report::page::{Block, Column, Section, Table};
use standstill_scenario::Plan;

use super::words::{case, percent};
use crate::commands::question::Identity;
use crate::commands::witness;
use crate::error::Error;
use crate::shell::values::each_once;

/// Returns the manifest as JSON. Its digests detect mix-ups of files, but do not protect against forgery. `requirements` is the path of the
/// file of requirements, and `digest` is the digest of this file.
pub fn of(plan: &Plan, requirements: &Path, digest: &str, identity: &Identity) -> Result<Value, Error> {
    let program = std::env::current_exe().ok();
    let of_program = program.as_ref().and_then(|path| Digest::of_file(path).ok());
    let text = plan.text()?;
    Ok(json!({
        "program": {
            "name": "standstill",
            "version": env!("CARGO_PKG_VERSION"),
            "digest": of_program.map(|digest| digest.to_string()),
            "numerics": NUMERICS,
            "abi": ABI,
        },
        "scenario": { "text": text, "digest": Digest::of(text.as_bytes()).to_string() },
        "files": identity.of.files,
        "requirements": { "file": requirements, "digest": digest },
        "seed": plan.file().seed,
        "machine": { "processor": processor(), "architecture": std::env::consts::ARCH, "system": std::env::consts::OS },
        "digests": "length and CRC-32: they tell files apart, and are no proof against forgery",
    }))
}

/// Returns the name of the processor. If the system does not provide the name, returns the architecture.
fn processor() -> String {
    let told = standstill_files::read_text(Path::new("/proc/cpuinfo")).ok();
    let name = told.as_deref().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    name.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// Returns the sentence on the witnesses, which are computations with known results. It states for how many of them this machine computes
/// the known result.
pub fn heard(witnesses: Option<&[Witness]>) -> String {
    match witnesses {
        None => "not heard (--no-witness); `standstill witness` hears them".to_owned(),
        Some(all) => {
            let holding = all.iter().filter(|witness| witness.holds()).count();
            format!("{holding} of {} hold on this machine", all.len())
        }
    }
}

/// Returns the values that data sheets mark as assumed, without duplicates. Each row has motor, key, value and reason.
fn assumed(found: &Qualification) -> Vec<[String; 4]> {
    each_once(found.cases.iter().flat_map(|of| {
        let row =
            |entry: &Entry| [of.motor.clone(), entry.key.clone(), entry.value.clone(), entry.reason.clone()];
        of.assumed.iter().map(row)
    }))
}

/// Returns the conditions in which rare events happen, without duplicates. Each row has the case, the event, the sector of the rotor angle
/// with its share of the event, and the random errors.
fn triggers(found: &Qualification) -> Vec<[String; 4]> {
    let mut rows = Vec::new();
    for of in &found.cases {
        for rare in of.claims.iter().filter_map(|claim| claim.rare.as_ref()) {
            for sector in &rare.triggers {
                let draws =
                    sector.draws.iter().take(6).map(|draw| format!("{} {:+.1} σ", draw.name, draw.mean));
                let (from, to) = sector.angles_deg;
                let row = [
                    case(of),
                    rare.event.to_string(),
                    format!("{from:.0}° to {to:.0}°, {} of it", percent(sector.share)),
                    draws.collect::<Vec<_>>().join(", "),
                ];
                rows.push(row);
            }
        }
    }
    each_once(rows)
}

/// Returns the annexes of the evidence as JSON.
pub fn annex(found: &Qualification, witnesses: Option<&[Witness]>) -> Value {
    let assumed = assumed(found);
    let assumed: Vec<Value> = assumed
        .iter()
        .map(|[motor, key, value, reason]| json!({ "motor": motor, "key": key, "value": value, "reason": reason }))
        .collect();
    let triggers = triggers(found);
    let triggers: Vec<Value> = triggers
        .iter()
        .map(|[case, event, angles, draws]| json!({ "case": case, "event": event, "angles": angles, "draws": draws }))
        .collect();
    json!({
        "not_modelled": NOT_MODELLED,
        "assumed": assumed,
        "triggering_conditions": triggers,
        "witnesses": witnesses.map(witness::json),
    })
}

/// Returns the annexes of the evidence as sections of the page.
pub fn sections(found: &Qualification, witnesses: Option<&[Witness]>) -> Vec<Section> {
    let list = NOT_MODELLED.map(str::to_owned).to_vec();
    let mut sections = vec![Section::new("What is not modelled", [Block::List(list)])];
    let rows = assumed(found);
    let blocks = if rows.is_empty() {
        vec![Block::Text("The data sheets mark no value as assumed.".to_owned())]
    } else {
        let columns =
            [Column::word("motor"), Column::word("key"), Column::prose("value"), Column::prose("reason")];
        vec![Block::Table(Table::new(columns).rows(rows.into_iter().map(|row| row.to_vec())))]
    };
    sections.push(Section::new("What of the motors is assumed", blocks));
    let rows = triggers(found);
    if !rows.is_empty() {
        let columns = [
            Column::word("case"),
            Column::word("event"),
            Column::word("angles"),
            Column::prose("draws, mean in standard deviations"),
        ];
        let text = "Where and with which draws the events happen that odds were asked for.".to_owned();
        let table = Table::new(columns).rows(rows.into_iter().map(|row| row.to_vec()));
        sections.push(Section::new(
            "Conditions that trigger rare events",
            [Block::Text(text), Block::Table(table)],
        ));
    }
    let blocks = match witnesses {
        Some(all) => vec![Block::Text(heard(witnesses)), Block::Table(witness::table(all, "known by"))],
        None => vec![Block::Text(heard(None))],
    };
    sections.push(Section::new("Witnesses", blocks));
    sections
}
