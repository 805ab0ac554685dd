//! `standstill motors`.

use std::fmt::Write as _;

use standstill_plant::{DataSheet, built_in_names};

use crate::Report;
use crate::arguments::Motors;
use crate::error::Error;
use crate::text;

pub fn run(options: &Motors) -> Result<Report, Error> {
    if let Some(name) = &options.name
        && built_in_names().all(|known| known != name)
    {
        return Err(Error::UnknownMotor(name.clone()));
    }
    let mut out = String::new();
    for name in built_in_names().filter(|known| options.name.as_deref().is_none_or(|name| name == *known)) {
        let Some(sheet) = DataSheet::built_in(name) else { continue };
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
