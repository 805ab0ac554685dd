//! Texts: quantities, scenarios with their faults, data sheets, requirements, records of a scope.

use std::path::Path;

use standstill_analysis::qualify::Requirements;
use standstill_fit::record::Record;
use standstill_plant::DataSheet;
use standstill_quantity::{Dimension, any_quantity, si_value, split};
use standstill_scenario::{Document, FileError, Plan};

use crate::{refused, text};

const FILE: &str = "given.toml";

/// A quantity is finite, and its text in the field's own words has the same value, to the twelve digits of such texts.
pub fn units(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    let (number, unit) = split(text);
    assert!(number.len() + unit.len() <= text.len());
    let Some((value, symbol)) = any_quantity(text) else { return };
    assert!(value.is_finite(), "{text:?}: {value}");
    let dimension = Dimension::of_symbol(symbol).expect("a dimension of its symbol");
    let written = dimension.text(value);
    let read = si_value(&written).unwrap_or_else(|| panic!("{text:?}, written as {written:?}"));
    assert!((read - value).abs() <= 5.1e-12 * value.abs(), "{text:?}, written as {written:?}, is {read:e}");
    assert_eq!(dimension.text(read), written, "{text:?}");
}

/// A scenario has a text that reads as the same scenario, and either a plan or an error that names its file.
pub fn scenario(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    let parsed = |text: &str| {
        let mut document = Document::parse(Path::new(FILE), text)?;
        document.fence(None)?;
        document.load().map(|file| (document, file))
    };
    let (document, loaded) = match parsed(text) {
        Err(error) => return refused(error, FILE),
        Ok(both) => both,
    };
    let written = loaded.text().expect("a text of what was read");
    let (_, again) =
        parsed(&written).unwrap_or_else(|error| panic!("{error} in what was written:\n{written}"));
    assert_eq!(again.text().expect("a text"), written);
    match loaded.point_count() {
        Err(error) => return refused(document.locate(error), FILE),
        Ok(points) if points > MOST_POINTS => return,
        Ok(_) => {}
    }
    match Plan::new(document).and_then(|plan| plan.scenario(0).map(|_| plan)) {
        // What is wrong with a motor may stand in its own data sheet: that is named.
        Err(FileError::Motor(error)) => refused(error, ": "),
        Err(error) => refused(error, FILE),
        Ok(plan) => assert!(Document::parse(Path::new(FILE), &plan.text().expect("a text")).is_ok()),
    }
}

/// Points of a scenario whose plan is made: a plan of many is slow for what it is, and no fault.
const MOST_POINTS: usize = 4;

/// A data sheet makes a motor of finite numbers.
pub fn sheet(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    match DataSheet::parse(FILE, text).and_then(|sheet| sheet.motor()) {
        Err(error) => refused(error, FILE),
        Ok(motor) => {
            let numbers = format!("{motor:?}");
            assert!(!numbers.contains("NaN") && !numbers.contains("inf"), "{numbers}");
        }
    }
}

/// Requirements have shares between 0 and 1 and limits of finite numbers.
pub fn requirements(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    match Requirements::parse(Path::new(FILE), text) {
        Err(error) => refused(error, FILE),
        Ok(all) => {
            assert!(!all.list.is_empty());
            assert!([all.confidence, all.unanswered].iter().all(|share| *share > 0.0 && *share < 1.0));
        }
    }
}

/// A record of a scope has finite numbers in ascending order of time.
pub fn record(bytes: &[u8]) {
    const FILE: &str = "given.csv";
    let Some(text) = text(bytes) else { return };
    match Record::parse(FILE, text) {
        Err(error) => refused(error, FILE),
        Ok(record) => {
            assert!(record.rows.windows(2).all(|rows| rows[0].time < rows[1].time));
            for row in &record.rows {
                assert!(row.time.is_finite() && row.link.is_finite(), "{row:?}");
                let read = row.current.iter().zip(record.channels);
                assert!(read.clone().all(|(current, _)| !current.is_infinite()), "{row:?}");
                assert!(read.clone().all(|(current, there)| there || current.is_nan()), "{row:?}");
            }
        }
    }
}
