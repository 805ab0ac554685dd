//! Tables of NumPy and MATLAB, taken apart by what their formats say.

use std::io::{Cursor, Read};

use standstill_table::{Cell, Column, Format, Kind, TableError, Writer};

use super::{columns, metadata, text, write};

fn rows() -> Vec<Vec<Cell<'static>>> {
    vec![
        vec![Cell::Whole(7), Cell::Number(-0.25), Cell::Flag(true), text("größer")],
        vec![Cell::Whole(8), Cell::Empty, Cell::Empty, Cell::Empty],
        vec![Cell::Whole(9), Cell::Number(f64::INFINITY), Cell::Flag(false), text("so")],
    ]
}

fn doubles(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|cell| f64::from_le_bytes(cell.try_into().expect("eight"))).collect()
}

/// NaN as none.
fn finite(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().map(|value| (!value.is_nan()).then_some(*value)).collect()
}

#[test]
fn law_a_numpy_archive_has_an_array_for_each_column() {
    let bytes = write(Format::Npz, &rows(), &metadata());
    assert_eq!(bytes, write(Format::Npz, &rows(), &metadata()), "equal tables, equal bytes");
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("a zip");
    let mut array = |name: &str| {
        let mut file = archive.by_name(&format!("{name}.npy")).expect("there");
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).expect("whole");
        assert_eq!(bytes[..8], *b"\x93NUMPY\x01\x00");
        let cells = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((cells % 64, bytes[cells - 1]), (0, b'\n'));
        (String::from_utf8_lossy(&bytes[10..cells]).trim().to_owned(), bytes[cells..].to_vec())
    };
    let header = |kind: &str, shape: &str| {
        format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}")
    };
    let (head, cells) = array("trial");
    assert_eq!((head, cells), (header("<i8", "(3,)"), [7_i64, 8, 9].map(i64::to_le_bytes).concat()));
    let (head, cells) = array("error_deg");
    assert_eq!((head, finite(&doubles(&cells))), (header("<f8", "(3,)"), vec![Some(-0.25), None, None]));
    let (_, cells) = array("pole_correct");
    assert_eq!(finite(&doubles(&cells)), [Some(1.0), None, Some(0.0)]);
    let (head, cells) = array("reason");
    assert_eq!((head, cells.len()), (header("<U6", "(3,)"), 3 * 6 * 4));
    assert_eq!(cells[8..12], u32::from('ö').to_le_bytes());
    assert!(cells[24..48].iter().all(|byte| *byte == 0));
    assert!(array("run").0.ends_with("'shape': (), }"));
}

#[test]
fn law_a_matlab_file_has_a_variable_for_each_column() {
    let bytes = write(Format::Mat, &rows(), &metadata());
    assert!(bytes.starts_with(b"MATLAB 5.0 MAT-file") && bytes[124..128] == *b"\x00\x01IM");
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    let mut variables = Vec::new();
    let mut at = 128;
    while at < bytes.len() {
        assert_eq!(word(at), 14);
        let end = at + 8 + word(at + 4) as usize;
        let class = word(at + 16);
        let size = [word(at + 32), word(at + 36)];
        let length = word(at + 44) as usize;
        let name = String::from_utf8_lossy(&bytes[at + 48..at + 48 + length]).into_owned();
        let cells = at + 48 + length.next_multiple_of(8);
        assert_eq!(cells + 8 + (word(cells + 4) as usize).next_multiple_of(8), end);
        variables.push((name, class, size, bytes[cells + 8..end].to_vec()));
        at = end;
    }
    let names: Vec<&str> = variables.iter().map(|(name, ..)| name.as_str()).collect();
    assert_eq!(names, ["trial", "error_deg", "pole_correct", "reason", "run"]);
    assert_eq!((variables[0].1, variables[0].2, doubles(&variables[0].3)), (6, [3, 1], vec![7.0, 8.0, 9.0]));
    assert_eq!(finite(&doubles(&variables[1].3)), [Some(-0.25), None, None]);
    // Rows of characters, stored column by column: the first letters of the three texts come first.
    let letters: Vec<u16> =
        variables[3].3.chunks_exact(2).map(|two| u16::from_le_bytes([two[0], two[1]])).collect();
    assert_eq!((variables[3].1, variables[3].2), (4, [3, 6]));
    assert_eq!(letters[..6], ['g', ' ', 's', 'r', ' ', 'o'].map(|letter| letter as u16));
}

#[test]
fn law_names_that_matlab_cannot_have_become_others_that_differ() {
    let names = ["sensors.noise", "sensors_noise", "3rd", "run "];
    let columns = names.map(|name| Column::new(name, Kind::Number)).to_vec();
    let mut bytes = Vec::new();
    Writer::new(&mut bytes, Format::Mat, columns, &[]).and_then(Writer::finish).expect("written");
    for name in ["sensors_noise", "sensors_noise_2", "x_3rd", "run_"] {
        assert!(bytes.windows(name.len()).any(|part| part == name.as_bytes()), "{name}");
    }
}

#[test]
fn law_a_row_that_does_not_fit_is_refused_in_memory_too() {
    for format in [Format::Npz, Format::Mat] {
        let mut file = Vec::new();
        let mut writer = Writer::new(&mut file, format, columns(), &[]).expect("columns");
        assert!(matches!(writer.row(&[Cell::Whole(1)]), Err(TableError::Row { row: 1, .. })));
        writer.row(&rows()[0]).expect("fits");
        assert!(writer.finish().is_ok());
    }
}
