//! Maps as CSV: a header `i_d_A,i_q_A,psi_d_Wb,psi_q_Wb`, then one line a point, in any order.

use super::{MapError, MapPoint, MapSamples, Place};

const COLUMNS: [&str; 4] = ["i_d_A", "i_q_A", "psi_d_Wb", "psi_q_Wb"];

pub(super) fn read(file: &str, bytes: &[u8]) -> Result<MapSamples, MapError> {
    let error = |line: usize, found: String, needed: String| {
        MapError::new(file, Some(&Place::Line(line)), found, needed)
    };
    let text = std::str::from_utf8(bytes).map_err(|failure| {
        let line = bytes[..failure.valid_up_to()].split(|byte| *byte == b'\n').count();
        error(line, "bytes that are not UTF-8".to_owned(), "a text".to_owned())
    })?;
    // Split here rather than by a CSV library: numbers are never quoted, and every line keeps its number past comments
    // and blank lines.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let needed = || format!("a header with the columns {}", COLUMNS.join(","));
    let (first, header) =
        lines.next().ok_or_else(|| MapError::new(file, None, "an empty file".to_owned(), needed()))?;
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let mut order = [0; 4];
    for (column, place) in COLUMNS.iter().zip(&mut order) {
        let mut at = names.iter().enumerate().filter(|(_, name)| *name == column).map(|(at, _)| at);
        *place = at.next().ok_or_else(|| {
            error(first, format!("no column `{column}` in `{}`", shortened(header)), needed())
        })?;
        if at.next().is_some() {
            return Err(error(first, format!("the column `{column}` twice"), needed()));
        }
    }
    if let Some(unknown) = names.iter().find(|name| !COLUMNS.contains(name)) {
        return Err(error(first, format!("the column `{unknown}`"), needed()));
    }
    let mut points = Vec::new();
    for (line, text) in lines {
        let fields: Vec<&str> = text.split(',').map(str::trim).collect();
        if fields.len() != COLUMNS.len() {
            let found = format!("{} field(s) in `{}`", fields.len(), shortened(text));
            return Err(error(line, found, format!("{} as in the header", COLUMNS.len())));
        }
        let number = |k: usize| {
            let text = fields[order[k]];
            let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| {
                error(line, format!("{} = `{}`", COLUMNS[k], shortened(text)), "a finite number".to_owned())
            })
        };
        points.push(MapPoint {
            i_d: number(0)?,
            i_q: number(1)?,
            psi_d: number(2)?,
            psi_q: number(3)?,
            place: Place::Line(line),
        });
    }
    if points.is_empty() {
        let needed = "a rectangle of currents with their fluxes".to_owned();
        return Err(MapError::new(file, None, "no point".to_owned(), needed));
    }
    Ok(MapSamples { file: file.to_owned(), points, pole_pairs: None, resistance: None })
}

/// For messages: the beginning of a text that may be a whole binary file.
fn shortened(text: &str) -> String {
    if text.chars().count() <= 60 {
        text.to_owned()
    } else {
        text.chars().take(60).chain("…".chars()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_csv_is_read_in_any_order_and_its_faults_are_named() {
        let text =
            "\u{feff}psi_d_Wb, i_d_A,i_q_A,psi_q_Wb\r\n# measured\r\n0.45,-1,2,0.03\r\n\r\n0.5, 1,2,0.04\r\n";
        let samples = read("m.csv", text.as_bytes()).expect("a map");
        assert_eq!(samples.points.len(), 2);
        let first = MapPoint { i_d: -1.0, i_q: 2.0, psi_d: 0.45, psi_q: 0.03, place: Place::Line(3) };
        assert_eq!(samples.points[0], first);
        assert_eq!(samples.points[1].place, Place::Line(5));
        let header = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n";
        for (text, expected) in [
            (
                format!("{header}0,0,NaN,0\n"),
                "m.csv: line 2: found psi_d_Wb = `NaN`; needed: a finite number",
            ),
            (format!("{header}0,0,1\n"), "m.csv: line 2: found 3 field(s) in `0,0,1`; needed: 4"),
            (format!("{header}0,0,x,0\n"), "psi_d_Wb = `x`"),
            (header.to_owned(), "no point"),
            (String::new(), "an empty file; needed: a header"),
            ("i_d_mA,i_q_A,psi_d_Wb,psi_q_Wb\n".to_owned(), "no column `i_d_A` in `i_d_mA,"),
            ("i_d_A;i_q_A;psi_d_Wb;psi_q_Wb\n".to_owned(), "needed: a header with the columns i_d_A,i_q_A"),
            ("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb,T_Nm\n".to_owned(), "the column `T_Nm`"),
            ("i_d_A,i_q_A,i_q_A,psi_d_Wb,psi_q_Wb\n".to_owned(), "`i_q_A` twice"),
        ] {
            let error = read("m.csv", text.as_bytes()).expect_err("must be refused").to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
