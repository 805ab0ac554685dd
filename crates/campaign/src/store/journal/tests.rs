//! Journals keep their rows; damaged ones are cut.

use std::collections::BTreeMap;

use super::super::walk::tests::row;
use super::*;
use standstill_scenario::StopTable;

fn identity() -> Identity {
    Identity {
        version: "1".to_owned(),
        numerics: 1,
        seed: 1,
        points: 1,
        trials: 100,
        stop_at: StopTable::default(),
        shard: Shard::WHOLE,
        scenario: "seed = 1\ntrials = 100\n".to_owned(),
        pole_note: None,
        pole_is_open: false,
        map_note: None,
        motor_note: None,
        library_note: None,
        files: BTreeMap::new(),
    }
}

fn all(path: &Path) -> Vec<Row> {
    let mut rows = Rows::open(path).expect("a journal");
    let blocks = std::iter::from_fn(|| rows.block().expect("readable"));
    blocks.flatten().map(|(_, row)| row).collect()
}

fn resume(path: &Path) -> Result<Journal, JournalError> {
    Journal::resume(path, &identity(), |_, _| {})
}

/// promise: resumed-bytes
#[test]
fn law_what_is_written_is_read_and_a_torn_block_is_cut_off_at_every_byte() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    let mut journal = Journal::create(&path, &identity()).expect("writable");
    let rows: Vec<Row> = (0..12).map(|trial| row(trial, 0.1)).collect();
    let header = std::fs::metadata(&path).expect("there").len();
    journal.append(&rows[..5]).expect("written");
    journal.sync().expect("written");
    let first = std::fs::metadata(&path).expect("there").len();
    journal.append(&rows[5..]).expect("written");
    drop(journal);
    assert_eq!(all(&path), rows);
    let bytes = std::fs::read(&path).expect("there");
    // From a file of no bytes on: a process may be killed while it writes the header.
    for cut in 0..bytes.len() {
        std::fs::write(&path, &bytes[..cut]).expect("written");
        let mut seen = 0;
        let mut journal =
            Journal::resume(&path, &identity(), |_, row| seen += 1 + row.trial).expect("the same run");
        let there = if (cut as u64) < first { 0 } else { 5 };
        assert_eq!((journal.walk().left(), seen), (100 - there, there * (there + 1) / 2), "{cut}");
        if there == 0 {
            journal.append(&rows[..5]).expect("written");
        }
        journal.append(&rows[5..]).expect("written");
        drop(journal);
        assert_eq!(std::fs::read(&path).expect("there"), bytes, "{cut}");
    }
    // A block with a flipped bit is none, nor is what follows it, nor are zeros that a power cut left.
    for place in [header, first] {
        let place = usize::try_from(place).expect("small");
        let mut damaged = bytes.clone();
        damaged[place + 20] ^= 1;
        let zeros = [&bytes[..place], &[0; 64]].concat();
        for damaged in [damaged, zeros] {
            std::fs::write(&path, damaged).expect("written");
            assert_eq!(all(&path), rows[..if place as u64 == header { 0 } else { 5 }]);
        }
    }
    // What is damaged and not only cut off is put aside, not thrown away.
    let mut damaged = bytes.clone();
    damaged[usize::try_from(header).expect("small") + 20] ^= 1;
    std::fs::write(&path, &damaged).expect("written");
    let journal = resume(&path).expect("the same run");
    let aside = journal.damaged().expect("put aside").to_owned();
    assert_eq!(journal.walk().left(), 100);
    assert_eq!(std::fs::read(aside).expect("there"), damaged[usize::try_from(header).expect("small")..]);
}

/// promise: other-runs-refused
#[test]
fn law_the_journal_of_another_run_is_refused_with_the_difference() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    drop(Journal::create(&path, &identity()).expect("writable"));
    let other = [
        (Identity { seed: 2, ..identity() }, "the seed is 1 there and 2 here"),
        (Identity { version: "2".to_owned(), ..identity() }, "version is 1 there and 2 here"),
        (Identity { numerics: 2, ..identity() }, "numerics is 1 there and 2 here"),
        (Identity { trials: 50, ..identity() }, "trials is 100 there and 50 here"),
        (Identity { shard: Shard { index: 1, count: 2 }, ..identity() }, "shard is 1/1 there and 1/2 here"),
        (
            Identity { scenario: "seed = 1\ntrials = 100\nx = 1\n".to_owned(), ..identity() },
            "`x` is not set there and 1 here",
        ),
        (
            Identity { scenario: "seed = 1\ntrials = 101\n".to_owned(), ..identity() },
            "`trials` is 100 there and 101 here",
        ),
        (
            // A table that comes in between shifts all lines behind it.
            Identity {
                scenario: "seed = 1\ntrials = 100\n[detector]\npulse = \"40 us\"\n".to_owned(),
                ..identity()
            },
            "`detector.pulse` is not set there and \"40 us\" here",
        ),
    ];
    for (identity, part) in other {
        let error = Journal::resume(&path, &identity, |_, _| {}).expect_err("another run").to_string();
        assert!(error.contains(part), "{error}");
    }
    std::fs::write(&path, "something else").expect("written");
    assert!(matches!(resume(&path), Err(JournalError::Foreign(_))));
}

/// Up to numerics 10 the error of a sector was counted from its middle: a mean over both would be of neither.
#[test]
fn regress_a_run_whose_sectors_were_judged_by_their_middles_is_not_continued() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    let sectors = "seed = 1\ntrials = 100\n[detector]\nmethod = \"six-pulse\"\nsector = 60\n";
    let before = Identity { numerics: 10, scenario: sectors.to_owned(), ..identity() };
    let mut journal = Journal::create(&path, &before).expect("writable");
    journal.append(&[row(0, 21.0)]).expect("written");
    drop(journal);
    let now = Identity { numerics: crate::NUMERICS, ..before.clone() };
    let refused = Journal::resume(&path, &now, |_, _| {}).expect_err("other errors").to_string();
    let difference = format!("the number of the program's numerics is 10 there and {} here", crate::NUMERICS);
    for part in [difference.as_str(), "with another --out, or begin anew with --force in place of --resume"] {
        assert!(refused.contains(part), "{refused}");
    }
    // Nor are its rows the first ones of a longer run, in whichever file they are.
    let longer = Identity { trials: 200, ..now.clone() };
    assert!(!before.begins(&longer) && now.begins(&longer));
}

/// promise: one-writer
#[test]
fn law_a_journal_has_one_writer() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    let mut journal = Journal::create(&path, &identity()).expect("writable");
    journal.append(&[row(0, 0.1)]).expect("written");
    assert!(matches!(resume(&path), Err(JournalError::Busy(_))));
    assert!(matches!(Journal::create(&path, &identity()), Err(JournalError::Busy(_))));
    // Rows out of order are refused before they are written.
    assert!(journal.append(&[row(2, 0.1)]).is_err());
    drop(journal);
    assert_eq!(all(&path).len(), 1);
    resume(&path).expect("free again");
}

#[test]
fn law_a_journal_is_read_on_while_it_grows_without_a_row_lost_to_a_torn_block() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    let mut journal = Journal::create(&path, &identity()).expect("writable");
    let rows: Vec<Row> = (0..30).map(|trial| row(trial, 0.1)).collect();
    for rows in rows.chunks(7) {
        journal.append(rows).expect("written");
    }
    journal.sync().expect("written");
    let bytes = std::fs::read(&path).expect("there");
    // Somebody else's journal, of which every time some bytes more have come.
    let growing = folder.path().join("growing");
    let begin = bytes.len() / 3;
    std::fs::write(&growing, &bytes[..begin]).expect("written");
    let mut reader = Rows::open(&growing).expect("a journal");
    let (mut seen, mut empty) = (Vec::new(), 0);
    for end in begin..=bytes.len() {
        std::fs::write(&growing, &bytes[..end]).expect("written");
        match reader.block().expect("readable") {
            Some(block) => seen.extend(block.into_iter().map(|(_, row)| row)),
            None => empty += 1,
        }
    }
    while let Some(block) = reader.block().expect("readable") {
        seen.extend(block.into_iter().map(|(_, row)| row));
    }
    assert_eq!(seen, rows);
    assert!(empty > 20, "the blocks came torn: {empty}");
}

#[test]
fn regress_a_length_of_gigabytes_is_damage_even_where_the_file_has_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    drop(Journal::create(&path, &identity()).expect("writable"));
    let mut file = OpenOptions::new().append(true).open(&path).expect("there");
    file.write_all(&u32::MAX.to_le_bytes()).expect("written");
    // A sparse file: it takes no room on the disk.
    file.set_len(5 << 30).expect("room");
    let begin = Instant::now();
    let mut rows = Rows::open(&path).expect("its header is whole");
    assert!(rows.block().expect("readable").is_none() && rows.is_damaged());
    assert!(begin.elapsed() < Duration::from_secs(1), "{:?}", begin.elapsed());
    assert!(block(&vec![0; 65 << 20]).is_err(), "nor is one written that could not be read");
}

#[test]
fn law_what_is_behind_rows_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal");
    let mut journal = Journal::create(&path, &identity()).expect("writable");
    let half = |trial: u64| [None, Some(30.0), Some(15.0)][(trial % 3) as usize];
    let mut rows: Vec<Row> =
        (0..12).map(|trial| Row { half_sector_deg: half(trial), ..row(trial, 0.1) }).collect();
    for row in &mut rows {
        row.age_s = (row.trial % 4 > 0).then_some(1e-3 * row.trial as f64);
        row.error_at_instant_deg = row.age_s.map(|age| 7.0 * age);
    }
    journal.append(&rows[..5]).expect("written");
    // A block with nothing behind it is one as before.
    let plain = Row { half_sector_deg: None, age_s: None, error_at_instant_deg: None, ..rows[5].clone() };
    journal.append(std::slice::from_ref(&plain)).expect("written");
    journal.append(&rows[6..]).expect("written");
    drop(journal);
    let mut expected = rows;
    expected[5] = plain;
    assert_eq!(all(&path), expected);
}
