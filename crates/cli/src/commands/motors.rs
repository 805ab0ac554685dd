//! `standstill motors`.

use std::fmt::Write as _;

use standstill_plant::built_in_names;

use crate::Report;
use crate::arguments::Motors;
use crate::error::Error;
use crate::text;

pub fn run(options: &Motors) -> Result<Report, Error> {
    let names: Vec<&str> = match &options.name {
        Some(name) => vec![name],
        None => built_in_names().collect(),
    };
    let mut out = String::new();
    for name in names {
        let sheet = super::sheet(name)?;
        // A sheet that is no motor is not shown as one.
        sheet.motor().map_err(Error::Motor)?;
        let _ = writeln!(out, "{name}: {}\n", sheet.title());
        out += &text::fill(sheet.notes(), 100, "  ");
        let rows = sheet
            .entries()
            .into_iter()
            .map(|entry| vec![entry.key, entry.value, entry.source.to_string(), entry.reason]);
        out += &text::table(&["key", "value", "source", "reason"], rows, false);
        out.push('\n');
    }
    Ok(Report { text: out, code: 0 })
}
