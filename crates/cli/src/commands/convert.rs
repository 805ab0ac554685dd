//! `standstill convert`: a motor's numbers in the forms that other data sheets and controllers use.

use serde_json::json;
use standstill_plant::{DataSheet, EqualNumber};
use standstill_report::page::{Column, Table};

use crate::arguments::Convert;
use crate::error::Error;
use crate::shell::Report;
use crate::shell::table::Print as _;

pub fn run(options: &Convert) -> Result<Report, Error> {
    let twice = options
        .numbers
        .iter()
        .enumerate()
        .find(|(k, (key, _))| options.numbers[..*k].iter().any(|(of, _)| of == key));
    if let Some((_, (key, _))) = twice {
        return Err(Error::Arguments(format!("`{key}` is given twice: keep one of them")));
    }
    let given = options.numbers.iter().map(|(key, value)| (key.as_str(), value.as_str()));
    let all = DataSheet::equal_numbers(given).map_err(Error::Motor)?;
    if options.json {
        return Ok(Report { text: format!("{:#}\n", json!(all)), code: 0 });
    }
    let is_given = |number: &EqualNumber| options.numbers.iter().any(|(key, _)| number.key == Some(key));
    let stated = |number: &EqualNumber| {
        let given = options.numbers.iter().find(|(key, _)| number.key == Some(key));
        given.map(|(_, value)| value.as_str()).filter(|value| value.parse::<f64>().is_err())
    };
    let rows = all.iter().map(|number| {
        let key = number.key.map_or_else(|| "–".to_owned(), str::to_owned);
        let meaning = number.meaning.to_owned() + if is_given(number) { " (given)" } else { "" };
        vec![stated(number).unwrap_or(&number.text).to_owned(), key, meaning]
    });
    let columns = [Column::word("value"), Column::word("key"), Column::prose("meaning")];
    let text = Table::new(columns).rows(rows).text()
        + "\n\nOne way of giving each number goes into [nameplate] of a data sheet; where there is –, that way has no key. Go on with\n  \
           standstill init --motor mine.toml\nwrite these numbers in place of the template's, then\n  standstill check mine.toml\n";
    Ok(Report { text, code: 0 })
}
