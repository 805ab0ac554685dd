//! Journals of rows and of statistics, notes: as the bytes are, and with lengths and checksums made right, behind which
//! no change of a single byte would come.

use std::path::Path;

use standstill_campaign::store::{Identity, Journal, Keep as _, Notes, Rows, Tallied, head};

use crate::{file, refused};

/// Returns the bytes with the length and checksum of each block made right.
fn mended(bytes: &[u8]) -> Vec<u8> {
    let (magic, mut rest) = bytes.split_at(bytes.len().min(8));
    let mut all = magic.to_vec();
    while let Some((length, behind)) = rest.split_first_chunk() {
        let length = usize::try_from(u32::from_le_bytes(*length)).unwrap_or(usize::MAX).min(behind.len());
        let (block, behind) = behind.split_at(length);
        all.extend(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
        all.extend_from_slice(block);
        all.extend(crc32fast::hash(block).to_le_bytes());
        rest = behind.get(4..).unwrap_or_default();
    }
    all
}

fn either(bytes: &[u8], name: &str, with: impl Fn(&Path, &str)) {
    with(&file(name, bytes), name);
    with(&file(name, &mended(bytes)), name);
}

fn rows(path: &Path) -> Result<(Identity, Vec<(usize, standstill_campaign::store::Row)>), String> {
    let mut rows = Rows::open(path).map_err(|error| error.to_string())?;
    let mut all = Vec::new();
    while let Some(block) = rows.block().map_err(|error| error.to_string())? {
        all.extend(block);
    }
    assert!(rows.walk().left() <= rows.identity().rows());
    Ok((rows.identity().clone(), all))
}

/// A journal of rows: a run that goes on with it has the rows that a reader finds, and leaves them there.
pub fn journal(bytes: &[u8]) {
    either(bytes, "given.journal", |path, name| {
        let (identity, all) = match rows(path) {
            Err(error) => return refused(error, name),
            Ok(found) => found,
        };
        assert_eq!(identity.difference(&identity), None);
        let mut seen = Vec::new();
        let resumed = Journal::resume(path, &identity, |point, row| seen.push((point, row.clone())));
        let resumed = resumed.unwrap_or_else(|error| panic!("{error}"));
        // Not-a-number is unlike itself: the texts are compared.
        assert_eq!(format!("{seen:?}"), format!("{all:?}"));
        assert!(resumed.walk().ahead(3).len() <= 3);
        drop(resumed);
        let (_, again) = rows(path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(format!("{again:?}"), format!("{all:?}"));
    });
}

/// A journal of statistics: each point has a summary.
pub fn tally(bytes: &[u8]) {
    either(bytes, "given.tally", |path, name| match Tallied::read(path) {
        Err(error) => refused(error, name),
        Ok(tallied) => {
            assert!(tallied.walk.left() <= tallied.identity.rows());
            for statistics in tallied.points.values() {
                let summary = statistics.summary();
                assert!(serde_json::to_string(&summary).is_ok());
                let mut twice = statistics.clone();
                twice.merge(statistics);
            }
        }
    });
}

/// Notes: a question that goes on with them finds what a reader finds, and one note more.
pub fn notes(bytes: &[u8]) {
    either(bytes, "given.notes", |path, name| {
        // The head of notes is that of a journal with another magic word.
        let Some(rest) = std::fs::read(path).ok().and_then(|bytes| Some(bytes.get(8..)?.to_vec())) else {
            return;
        };
        let as_rows = file("head.journal", &[b"stdstil1".as_slice(), &rest].concat());
        let Ok(identity) = head(&as_rows) else { return };
        let mut notes = match Notes::resume(path, &identity) {
            Err(error) => return refused(error, name),
            Ok(notes) => notes,
        };
        let before = notes.get("key").map(<[u8]>::to_vec);
        notes.add("a further note", b"its bytes").expect("written");
        drop(notes);
        let again = Notes::resume(path, &identity).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again.get("key").map(<[u8]>::to_vec), before);
        assert_eq!(again.get("a further note"), Some(b"its bytes".as_slice()));
    });
}
