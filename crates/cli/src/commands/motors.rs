//! `standstill motors`: the built-in motors and the origin of their numbers.

use std::fmt::Write as _;

use serde_json::{Value, json};
use standstill_plant::{Entry, built_in_names};

use crate::arguments::Motors;
use crate::error::Error;
use crate::shell::Report;
use crate::shell::table::Print as _;
use crate::shell::terminal::{paragraph, tell};
use standstill_report::page::{Column, Table};
use standstill_scenario::doubts;

pub fn run(options: &Motors) -> Result<Report, Error> {
    let mut out = String::new();
    let Some(name) = &options.name else {
        if options.json {
            let title = |name: &str| Ok((name.to_owned(), super::sheet(name)?.title().into()));
            let motors: serde_json::Map<String, Value> =
                built_in_names().map(title).collect::<Result<_, Error>>()?;
            return Ok(Report { text: format!("{:#}\n", Value::Object(motors)), code: 0 });
        }
        let width = built_in_names().map(str::len).max().unwrap_or_default();
        for name in built_in_names() {
            let _ = writeln!(out, "{name:width$}  {}", super::sheet(name)?.title());
        }
        out += "\n`standstill motors NAME` shows one of them, or a data sheet, with each number and where it comes from.\n";
        return Ok(Report { text: out, code: 0 });
    };
    let sheet = super::sheet(name)?;
    // A data sheet that does not describe a valid motor is refused.
    let motor = sheet.motor().map_err(Error::Motor)?;
    if let Some(doubt) = doubts::of_motor(&motor) {
        tell(&format!("warning: {doubt}"));
    }
    if options.json {
        let entry = |entry: Entry| json!({ "key": entry.key, "value": entry.value, "source": entry.source.to_string(), "reason": entry.reason });
        let entries: Vec<Value> = sheet.entries().into_iter().map(entry).collect();
        let json = json!({ "name": name, "title": sheet.title(), "notes": sheet.notes().trim(), "entries": entries });
        return Ok(Report { text: format!("{json:#}\n"), code: 0 });
    }
    let _ = writeln!(out, "{name}: {}\n", sheet.title());
    if !sheet.notes().trim().is_empty() {
        out += &paragraph("  ", sheet.notes());
    }
    let rows = sheet
        .entries()
        .into_iter()
        .map(|entry| vec![entry.key, entry.value, entry.source.to_string(), entry.reason]);
    let columns =
        [Column::word("key"), Column::prose("value"), Column::word("source"), Column::prose("reason")];
    out += &Table::new(columns).rows(rows).text();
    Ok(Report { text: out, code: 0 })
}
