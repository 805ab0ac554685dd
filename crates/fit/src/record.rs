//! A record of an oscilloscope or a drive: currents of phases or of a shunt in the DC link, the link's voltage, and the legs' requests.

use std::fmt;

use standstill_interface::choice;
use standstill_quantity::Quantity;
use standstill_quantity::unit::Second;
use standstill_scenario::quoted;

use super::pieces::drives;
use super::stated::Turned;

/// Names of a record's columns, which may stand in any order. The last one may be missing.
pub const COLUMNS: [&str; 10] =
    ["t_s", "i_a_A", "i_b_A", "i_c_A", "i_link_A", "u_dc_V", "leg_a", "leg_b", "leg_c", "angle_deg"];

/// Number of channels of currents: the three phases, then the DC link.
pub const CHANNELS: usize = 4;

/// Index of the channel of the current from the DC link into the bridge.
pub const LINK: usize = 3;

/// Index in [`COLUMNS`] of the first channel.
const FIRST_CHANNEL: usize = 1;

/// Index in [`COLUMNS`] of the link's voltage.
const VOLTAGE: usize = FIRST_CHANNEL + CHANNELS;

/// Index in [`COLUMNS`] of the first leg.
const FIRST_LEG: usize = VOLTAGE + 1;

/// Index in [`COLUMNS`] of the rotor's angle.
const ANGLE: usize = FIRST_LEG + 3;

/// Largest number of rows of a record, and of all records together: more would take minutes and give no better result.
pub const MOST_ROWS: usize = 500_000;

/// Longest time between two rows, as a multiple of the median.
const LONGEST_GAP: f64 = 1000.0;

/// Least number of rows of a record.
const LEAST_ROWS: usize = 20;

choice! {
    /// Request to a leg of the inverter.
    #[derive(Default)]
    pub enum Request {
        /// Both switches off.
        Off = "off" default,
        /// Lower switch on.
        Low = "low",
        /// Upper switch on.
        High = "high",
    }
}

impl Request {
    fn read(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|request| request.name().eq_ignore_ascii_case(text))
    }
}

/// One row of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time in s.
    pub time: f64,
    /// Phase currents, then the current from the DC link into the bridge, in A; NaN where a channel has no reading.
    pub current: [f64; CHANNELS],
    /// DC-link voltage in V.
    pub link: f64,
    /// Requests of the legs from this row on.
    pub legs: [Request; 3],
}

/// A record of one or several pulses that begins at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// File of the record.
    pub file: String,
    /// Rows in ascending order of time.
    pub rows: Vec<Row>,
    /// True for each channel of the record.
    pub channels: [bool; CHANNELS],
    /// Electrical angle in rad from the axis of phase a to the magnet's north pole, as an encoder or an alignment states it, from −π to
    /// π; none if the record states none.
    pub angle: Option<f64>,
}

/// Error of a text that is no valid record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordError {
    /// File of the record.
    pub file: String,
    /// Line of the text, from 1, if the error has one.
    pub line: Option<usize>,
    /// Column, if the error has one.
    pub column: Option<&'static str>,
    /// Text that was found.
    pub found: String,
    /// Values that are allowed.
    pub needed: String,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ", column {column}")?;
        }
        write!(f, ": found {}; needed: {}", self.found, self.needed)
    }
}

impl std::error::Error for RecordError {}

/// Position in the text for messages.
struct Place<'a> {
    file: &'a str,
    line: Option<usize>,
}

impl Place<'_> {
    fn error(
        &self,
        column: Option<&'static str>,
        found: impl Into<String>,
        needed: impl Into<String>,
    ) -> RecordError {
        RecordError {
            file: self.file.to_owned(),
            line: self.line,
            column,
            found: found.into(),
            needed: needed.into(),
        }
    }
}

/// Largest number of characters of a field in messages.
const LONGEST: usize = 40;

/// Returns a field as messages show it.
fn shown(text: &str) -> String {
    format!("`{}`", text.chars().take(LONGEST).collect::<String>())
}

impl Record {
    /// Parses a text: a header with the names of [`COLUMNS`], of which the angle may be missing, and one phase current, or the link's, or
    /// all phase currents; then one row per line, separated by commas. Blank lines and lines that begin with `#` are skipped.
    ///
    /// # Errors
    /// The first error, with its line and column.
    pub fn parse(file: &str, text: &str) -> Result<Self, RecordError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(k, line)| (k + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let nowhere = Place { file, line: None };
        let header = || format!("a header with the columns {}", COLUMNS[..ANGLE].join(", "));
        let Some((number, first)) = lines.next() else {
            return Err(nowhere.error(None, "no line", header()));
        };
        let columns = columns(&Place { file, line: Some(number) }, first)?;
        let mut rows: Vec<Row> = Vec::new();
        let mut numbers = Vec::new();
        let mut turned = Turned::default();
        for (number, line) in lines {
            let place = Place { file, line: Some(number) };
            if rows.len() == MOST_ROWS {
                let needed = format!("at most {MOST_ROWS} rows; fewer samples, or fewer pulses, will do");
                return Err(place.error(None, "one more row", needed));
            }
            let (row, angle) = row(&place, line, &columns)?;
            numbers.push(number);
            if let Some(angle) = angle {
                turned
                    .add(angle)
                    .map_err(|(found, needed)| place.error(Some(COLUMNS[ANGLE]), found, needed))?;
            }
            match rows.last() {
                Some(before) if row.time <= before.time => {
                    let needed = format!("more than {} of the row before", before.time);
                    return Err(place.error(Some("t_s"), row.time.to_string(), needed));
                }
                None if drives(row.legs) => {
                    let needed = "a record that begins before its first pulse, without current: all legs off, or all low";
                    return Err(place.error(None, "legs that drive a current in the first row", needed));
                }
                _ => rows.push(row),
            }
        }
        if rows.len() < LEAST_ROWS {
            let found = format!("{} rows", rows.len());
            return Err(nowhere.error(None, found, format!("at least {LEAST_ROWS}")));
        }
        if let Some((k, gap, most)) = gap(&rows) {
            let place = Place { file, line: Some(numbers[k]) };
            let needed = format!(
                "at most {}, {LONGEST_GAP} times the usual interval; what lies apart belongs in files of its own",
                Quantity::<Second>::si(most)
            );
            return Err(place.error(
                Some("t_s"),
                format!("{} after the row before", Quantity::<Second>::si(gap)),
                needed,
            ));
        }
        if !rows.iter().any(|row| drives(row.legs)) {
            let needed = "a pulse: rows in which one leg is high and another low";
            return Err(nowhere.error(None, "no such row", needed));
        }
        let channels = std::array::from_fn(|k| columns.contains(&(FIRST_CHANNEL + k)));
        Ok(Self { file: file.to_owned(), rows, channels, angle: turned.mean() })
    }
}

/// Returns the first row that is too late after the row before, the time between them in s and the longest allowed one: that time
/// would be simulated with the resolution of the rows.
fn gap(rows: &[Row]) -> Option<(usize, f64, f64)> {
    let interval = |k: usize| rows[k].time - rows[k - 1].time;
    let mut intervals: Vec<f64> = (1..rows.len()).map(interval).collect();
    intervals.sort_unstable_by(f64::total_cmp);
    let most = LONGEST_GAP * intervals[intervals.len() / 2];
    (1..rows.len()).find(|k| interval(*k) > most).map(|k| (k, interval(k), most))
}

/// Returns the index in [`COLUMNS`] of each field of the header.
fn columns(place: &Place, header: &str) -> Result<Vec<usize>, RecordError> {
    let (mut columns, mut unknown) = (Vec::new(), Vec::new());
    for name in header.split(',').map(str::trim) {
        let Some(k) = COLUMNS.iter().position(|column| *column == name) else {
            unknown.push(quoted(&name.chars().take(LONGEST).collect::<String>(), COLUMNS));
            continue;
        };
        if columns.contains(&k) {
            return Err(place.error(Some(COLUMNS[k]), "the column twice", "it once"));
        }
        columns.push(k);
    }
    let missing: Vec<&str> =
        (0..COLUMNS.len()).filter(|k| !columns.contains(k)).map(|k| COLUMNS[k]).collect();
    let is_channel = |k: &usize| (FIRST_CHANNEL..FIRST_CHANNEL + CHANNELS).contains(k);
    let phases = columns.iter().filter(|k| is_channel(k) && **k != FIRST_CHANNEL + LINK).count();
    // The phase currents sum to zero: two of them are all of them.
    let is_enough = phases >= 2 || columns.contains(&(FIRST_CHANNEL + LINK));
    let is_needed = |name: &&str| *name != COLUMNS[ANGLE] && (!is_enough || !name.starts_with("i_"));
    let missing: Vec<&str> = missing.into_iter().filter(is_needed).collect();
    if missing.is_empty() && unknown.is_empty() {
        return Ok(columns);
    }
    let mut found = Vec::new();
    if !missing.is_empty() {
        found.push(format!("no column {}", missing.join(", ")));
    }
    if !unknown.is_empty() {
        // A file of another kind may have thousands.
        let more = unknown.len().saturating_sub(ANGLE);
        unknown.truncate(ANGLE);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        found.push(format!("the unknown {}{more}", unknown.join(", ")));
    }
    let needed = format!(
        "all of {} and no others but {}, the rotor's electrical angle; of the currents two phases, or i_link_A of a shunt in the DC link, will do",
        COLUMNS[..ANGLE].join(", "),
        COLUMNS[ANGLE]
    );
    Err(place.error(None, found.join(", but "), needed))
}

/// Returns a row, and the rotor's angle in degrees if there is one.
fn row(place: &Place, line: &str, columns: &[usize]) -> Result<(Row, Option<f64>), RecordError> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    if fields.len() != columns.len() {
        let needed = format!("{}, as in the header", columns.len());
        return Err(place.error(None, format!("{} fields", fields.len()), needed));
    }
    let mut row = Row { time: 0.0, current: [f64::NAN; CHANNELS], link: 0.0, legs: [Request::Off; 3] };
    let mut angle = None;
    for (field, k) in fields.into_iter().zip(columns) {
        let column = Some(COLUMNS[*k]);
        if (FIRST_LEG..ANGLE).contains(k) {
            let Some(request) = Request::read(field) else {
                return Err(place.error(column, shown(field), "off, low or high"));
            };
            row.legs[k - FIRST_LEG] = request;
            continue;
        }
        let (low, high) = match k {
            0 => (-1e6, 1e6),
            &VOLTAGE => (1e-3, 1e5),
            &ANGLE => (-3600.0, 3600.0),
            _ => (-1e5, 1e5),
        };
        let value = field.parse::<f64>().ok().filter(|value| (low..=high).contains(value));
        let Some(value) = value else {
            let needed = format!("a number from {low} to {high}");
            return Err(place.error(column, shown(field), needed));
        };
        match k {
            0 => row.time = value,
            &VOLTAGE => row.link = value,
            &ANGLE => angle = Some(value),
            _ => row.current[k - FIRST_CHANNEL] = value,
        }
    }
    Ok((row, angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(change: impl Fn(usize, String) -> String) -> String {
        let row = |k: usize| {
            let legs = if (5..10).contains(&k) { "high,LOW,off" } else { "off,off,off" };
            format!("{}e-6,0.{k},-0.{k},0,0.{k},550,{legs}", k + 1)
        };
        let rows = (0..30).map(|k| change(k + 2, row(k)) + "\n");
        COLUMNS[..ANGLE].join(",") + "\n" + &rows.collect::<String>()
    }

    fn refused(line: usize, from: &str, to: &str) -> String {
        let changed = |number: usize, row: String| if number == line { row.replace(from, to) } else { row };
        Record::parse("p.csv", &text(changed)).expect_err("wrong").to_string()
    }

    #[test]
    fn analytic_columns_stand_in_any_order_and_one_current_may_be_missing() {
        let whole = Record::parse("p.csv", &text(|_, row| row)).expect("a record");
        assert_eq!(whole.rows.len(), 30);
        assert_eq!(whole.rows[5].legs, [Request::High, Request::Low, Request::Off]);
        assert_eq!(whole.channels, [true; CHANNELS]);
        let other = "# scope\nleg_c,leg_b,leg_a,u_dc_V,i_b_A,i_a_A,t_s\n".to_owned()
            + &(0..30)
                .map(|k| {
                    format!("off,low,high,12,1,2,{k}\n").replace("high", if k == 0 { "low" } else { "high" })
                })
                .collect::<String>();
        let two = Record::parse("p.csv", &other).expect("a record");
        let channels = [true, true, false, false];
        assert_eq!((two.channels, two.rows[3].current[..2].to_vec()), (channels, vec![2.0, 1.0]));
        assert!(two.rows[3].current[2..].iter().all(|i| i.is_nan()));
    }

    #[test]
    fn regress_mistakes_name_line_column_and_what_is_allowed() {
        for (line, from, to, message) in [
            (
                4,
                "550",
                "-1",
                "p.csv, line 4, column u_dc_V: found `-1`; needed: a number from 0.001 to 100000",
            ),
            (5, "3,0", "x", "fields; needed: 9, as in the header"),
            (9, "LOW", "down", "p.csv, line 9, column leg_b: found `down`; needed: off, low or high"),
            (6, "5e-6", "1e-6", "p.csv, line 6, column t_s: found 0.000001; needed: more than 0.000004"),
            (
                2,
                "off,off,off",
                "high,low,off",
                "p.csv, line 2: found legs that drive a current in the first row",
            ),
        ] {
            let found = refused(line, from, to);
            assert!(found.contains(message), "{found}");
        }
        let late = text(|number, row| if number == 31 { row.replace("30e-6", "30e-3") } else { row });
        let parse = |text: &str| Record::parse("p.csv", text).expect_err("wrong").to_string();
        let found = parse(&late);
        assert!(found.contains("p.csv, line 31, column t_s: found 29971 µs after the row before"), "{found}");
        assert!(parse("").contains("found no line; needed: a header with the columns t_s, "));
        let named = parse("time,i_a_A,i_b,u_dc_V,temperature\n");
        let expected = "p.csv, line 1: found no column t_s, i_b_A, i_c_A, i_link_A, leg_a, leg_b, leg_c, but the unknown `time`, \
                        `i_b` (did you mean `i_b_A`?), `temperature`; needed: all of t_s, i_a_A,";
        assert!(named.contains(expected), "{named}");
        let one_more = COLUMNS[..ANGLE].join(",") + ",ch4\n";
        assert!(
            parse(&one_more).contains("found the unknown `ch4`; needed: all of t_s"),
            "{}",
            parse(&one_more)
        );
        assert!(parse(&vec!["x"; 20].join(",")).contains("`x` and 11 more; needed"));
        assert!(
            parse("t_s,i_a_A,u_dc_V,leg_a,leg_b,leg_c\n")
                .contains("found no column i_b_A, i_c_A, i_link_A; ")
        );
        let shunt = "t_s,i_link_A,u_dc_V,leg_a,leg_b,leg_c";
        assert!(parse(shunt).contains("found 0 rows"), "{}", parse(shunt));
        let idle = text(|_, row| row.replace("high", "off"));
        assert!(parse(&idle).contains("found no such row; needed: a pulse"));
    }
}
