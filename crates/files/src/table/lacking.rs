//! All keys that a table lacks, and not only the first of them.

use toml::{Table, Value};

use super::keyed::TableError;

/// Returns placeholders for a missing key; with one of them, the reader reaches the next missing key.
fn fillers() -> [Value; 4] {
    [
        Value::Float(0.0),
        Value::String("none".to_owned()),
        Value::Table(Table::new()),
        Value::Array(Vec::new()),
    ]
}

/// Returns the error of a table that lacks a key, with all other missing keys of this table. `read` reads a table and
/// returns its error.
pub fn all(first: &TableError, table: Table, read: impl Fn(&Table) -> Option<TableError>) -> TableError {
    let mut tried = table;
    let (mut keys, mut tables) = (Vec::new(), Vec::new());
    // Paths of what was filled in. A table filled in is empty and lacks keys of its own: they are filled in too, but not named.
    let mut filled: Vec<String> = Vec::new();
    let mut found = Some(first.clone());
    while let Some(error) = found.take() {
        let own = error.key == first.key;
        let known = own || filled.contains(&error.key);
        let Some(key) = error.lacks().filter(|_| known) else { break };
        let path = if error.key.is_empty() { key.to_owned() } else { format!("{}.{key}", error.key) };
        // Each turn adds a key that was not there: there are only so many.
        if below(&mut tried, &error.key).is_none_or(|place| place.contains_key(key)) {
            break;
        }
        let mut kind = None;
        for filler in fillers() {
            let Some(place) = below(&mut tried, &error.key) else { break };
            place.insert(key.to_owned(), filler.clone());
            let next = read(&tried);
            kind = Some(filler);
            if next.as_ref().is_none_or(|next| next.key != path || next.lacks().is_some()) {
                found = next;
                break;
            }
        }
        if own {
            match kind {
                Some(Value::Table(_)) => tables.push(format!("[{path}]")),
                _ => keys.push(format!("`{key}`")),
            }
        }
        filled.push(path);
    }
    let message = match (listed(&keys), listed(&tables)) {
        (Some(keys), None) if keys.contains(' ') => format!("missing fields {keys}"),
        (Some(keys), None) => format!("missing field {keys}"),
        (keys, Some(tables)) => {
            let keys = keys.map_or_else(String::new, |keys| format!("{keys} and "));
            let many = if tables.contains(' ') { "tables" } else { "table" };
            // A nameplate takes their place, and that of the rotor where there is none.
            let short =
                if first.key.is_empty() { ", or [nameplate] with what a motor's owner knows" } else { "" };
            format!("missing {keys}the {many} {tables}{short}")
        }
        (None, None) => return first.clone(),
    };
    TableError { message, ..first.clone() }
}

fn listed(names: &[String]) -> Option<String> {
    match names {
        [] => None,
        [one] => Some(one.clone()),
        [rest @ .., last] => Some(format!("{} and {last}", rest.join(", "))),
    }
}

/// Returns the table at a path within another; an empty path is that itself.
fn below<'a>(table: &'a mut Table, path: &str) -> Option<&'a mut Table> {
    path.split('.').filter(|part| !part.is_empty()).try_fold(table, |table, part| match table.get_mut(part) {
        Some(Value::Table(below)) => Some(below),
        _ => None,
    })
}
