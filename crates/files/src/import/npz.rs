//! Maps as NumPy archives: `i_d_A`, `i_q_A`, `psi_d_Wb`, `psi_q_Wb`, also without the units; or, as motulator writes them, the complex
//! `i_s_dq` and `psi_s_dq`, d + j q.
//!
//! An `.npz` is a zip of `.npy` files, and an `.npy` a line of Python before the plain numbers. The crates that read
//! that line bring a parser generator and a stack in assembly with them; the few words that can stand in it are
//! read here.

use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::arrays::{self, Array, MOST_POINTS, Rows, listed, points};
use super::{MapError, MapSamples};

const NAMES: [[&str; 2]; 4] =
    [["i_d_A", "i_d"], ["i_q_A", "i_q"], ["psi_d_Wb", "psi_d"], ["psi_q_Wb", "psi_q"]];

/// Complex arrays, whose real parts are along d and imaginary parts along q.
const COMPLEX: [&str; 2] = ["i_s_dq", "psi_s_dq"];

pub(super) fn read(file: &str, bytes: &[u8]) -> Result<MapSamples, MapError> {
    let error = |found: String, needed: &str| MapError::new(file, None, found, needed.to_owned());
    let mut archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|failure| error(failure.to_string(), "a NumPy .npz archive"))?;
    let has = |archive: &ZipArchive<_>, name: &str| archive.index_for_name(&format!("{name}.npy")).is_some();
    let mut arrays = Vec::new();
    if COMPLEX.iter().all(|name| has(&archive, name)) {
        for name in COMPLEX {
            arrays.extend(member(&mut archive, name).map_err(|(found, needed)| error(found, &needed))?);
        }
    } else {
        for names in NAMES {
            let Some(name) = names.iter().find(|name| has(&archive, name)) else {
                let found = format!("the arrays {}", listed(archive.file_names().flatten()));
                let (real, [i, psi]) = (NAMES.map(|names| names[0]).join("`, `"), COMPLEX);
                let needed = format!("an array `{}`: `{real}`, or the complex `{i}` and `{psi}`", names[0]);
                return Err(error(found, &needed));
            };
            let of = member(&mut archive, name).map_err(|(found, needed)| error(found, &needed))?;
            if of.len() > 1 {
                let found = format!("`{name}`: complex numbers");
                return Err(error(found, "real floating-point numbers or integers"));
            }
            arrays.extend(of);
        }
    }
    let [a, b, c, d]: [Array; 4] =
        arrays.try_into().map_err(|_| error("fewer arrays".to_owned(), "four arrays"))?;
    points(file, &[a, b, c, d], Rows::Direct)
}

/// Found value and requirement, in words.
type Fault = (String, String);

/// Reads an array of the archive; of complex numbers the real and the imaginary parts.
fn member(archive: &mut ZipArchive<Cursor<&[u8]>>, name: &str) -> Result<Vec<Array>, Fault> {
    let broken =
        |failure: &dyn std::fmt::Display| (format!("`{name}`: {failure}"), "a readable archive".to_owned());
    let mut entry = archive.by_name(&format!("{name}.npy")).map_err(|failure| broken(&failure))?;
    let mut content = Vec::new();
    // At most sixteen bytes a number and a header; a size in the archive's own words is not trusted.
    let limit = 16 * MOST_POINTS as u64 + 65_536;
    let read = entry.by_ref().take(limit).read_to_end(&mut content);
    read.map_err(|failure| broken(&failure))?;
    parts(name, &content).map_err(|(found, needed)| (format!("`{name}`: {found}"), needed))
}

fn parts(name: &str, content: &[u8]) -> Result<Vec<Array>, Fault> {
    let fault = |found: &str, needed: &str| (found.to_owned(), needed.to_owned());
    let broken = || fault("no header of the .npy format", "an array as NumPy saves it");
    let rest = content.strip_prefix(b"\x93NUMPY").ok_or_else(broken)?;
    let (length, start) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 4),
        [2 | 3, _, a, b, c, d, ..] => {
            (usize::try_from(u32::from_le_bytes([*a, *b, *c, *d])).unwrap_or(usize::MAX), 6)
        }
        _ => return Err(broken()),
    };
    let end = start + length.min(rest.len());
    let header = rest.get(start..end).and_then(|bytes| std::str::from_utf8(bytes).ok()).ok_or_else(broken)?;
    let data = &rest[end..];
    let kind = value_of(header, "descr").ok_or_else(broken)?.trim_matches(['\'', '"']).to_owned();
    let by_columns = value_of(header, "fortran_order").ok_or_else(broken)? == "True";
    let shape: Vec<usize> = value_of(header, "shape")
        .and_then(|text| {
            text.trim_matches(['(', ')'])
                .split(',')
                .map(str::trim)
                .filter(|n| !n.is_empty())
                .map(|n| n.parse().ok())
                .collect()
        })
        .ok_or_else(broken)?;
    let (rows, columns) = match shape[..] {
        [n] => (1, n),
        [n, m] => (n, m),
        _ => return Err(fault(&format!("{} dimensions", shape.len()), "one or two dimensions")),
    };
    let count = rows.checked_mul(columns).filter(|count| (1..=MOST_POINTS).contains(count));
    let count =
        count.ok_or_else(|| fault(&format!("{rows} × {columns} numbers"), "1 to 1,048,576 numbers"))?;
    // A complex number is two floating-point numbers.
    let (each, kind_of_each) = match kind.split_once('c') {
        Some((order, "16")) => (2, format!("{order}f8")),
        Some((order, "8")) => (2, format!("{order}f4")),
        _ => (1, kind.clone()),
    };
    let values = numbers(&kind_of_each, data, each * count)
        .ok_or_else(|| fault(&format!("numbers of type `{kind}`"), "floating-point numbers or integers"))?;
    if values.len() < each * count {
        let found = format!("{} of {count} numbers", values.len() / each);
        return Err(fault(&found, "a complete array"));
    }
    let part = |of: usize| -> Array {
        let values: Vec<f64> = values.iter().skip(of).step_by(each).take(count).copied().collect();
        if by_columns && shape.len() == 2 {
            Array::from_columns(name.to_owned(), rows, columns, &values)
        } else {
            Array { name: name.to_owned(), rows, columns, values }
        }
    };
    Ok((0..each).map(part).collect())
}

/// Returns the value of a key in the header, a literal of a Python dictionary.
fn value_of<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let from = header.find(&format!("'{key}'"))? + key.len() + 2;
    let text = header[from..].trim_start().strip_prefix(':')?.trim_start();
    let end = if text.starts_with('(') { text.find(')')? + 1 } else { text.find([',', '}'])? };
    Some(text[..end].trim())
}

/// Returns the numbers of a NumPy type, at least `count` if there are so many; none for a type without real numbers.
fn numbers(kind: &str, data: &[u8], count: usize) -> Option<Vec<f64>> {
    let (order, name) = kind.split_at_checked(1)?;
    let big = match order {
        "<" | "|" | "=" => false,
        ">" => true,
        _ => return None,
    };
    arrays::numbers(name, data.get(..8 * count).unwrap_or(data), big)
}
