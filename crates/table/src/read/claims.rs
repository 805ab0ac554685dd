//! Checks of a Parquet file's claims about its sizes, before the library believes them.
//!
//! The library allocates memory for as many columns, bytes and values as a file claims, and descends into its schema to
//! any depth: a hundred bytes can demand gigabytes. The footer and the heads of pages are structures in Thrift's
//! compact form. They are parsed here first, and files whose claims exceed their size are refused. Format:
//! <https://github.com/apache/parquet-format>.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;

/// Number of a file's last bytes that hold the length of the footer and four letters.
const TAIL: u64 = 8;

/// Bytes of a footer. That of a hundred million trials has some 4 MB, and the scenario may have 4 MiB.
const MOST_FOOTER: u64 = 16 << 20;

/// Columns of a table, and metadata.
const MOST_COLUMNS: i64 = 1 << 12;

/// Bytes of a page: those of most writers have 1 MiB.
const MOST_PAGE: i64 = 16 << 20;

/// Largest size in bytes of a page's head; statistics take most of it.
const MOST_HEAD: usize = 1 << 16;

/// Bytes of a page's head that are read first: most heads are shorter.
const LIKELY_HEAD: usize = 256;

/// Snappy copies 64 bytes with three at best.
const MOST_UNPACKED: i64 = 22;

/// Structures and lists within each other; the format has about ten.
const DEEPEST: usize = 16;

/// The format's names of its encodings, by their numbers.
const ENCODINGS: [&str; 10] = [
    "PLAIN",
    "GROUP_VAR_INT",
    "PLAIN_DICTIONARY",
    "RLE",
    "BIT_PACKED",
    "DELTA_BINARY_PACKED",
    "DELTA_LENGTH_BYTE_ARRAY",
    "DELTA_BYTE_ARRAY",
    "RLE_DICTIONARY",
    "BYTE_STREAM_SPLIT",
];

/// Last element of the path to the number of elements of a list. A path consists of the numbers of the fields that lead
/// to a value; for the number of elements it is that of the list, followed by this constant.
const COUNT: i16 = -1;

/// A message about the file, without its name.
type Claim = String;

/// Reader of a structure in Thrift's compact form.
struct Walk<'a> {
    bytes: &'a [u8],
    /// Fields in which it is.
    path: Vec<i16>,
    /// Structures and lists in which it is.
    depth: usize,
}

impl Walk<'_> {
    /// Goes through a structure and names each whole number in it; none if it is none, or one that no Parquet file has.
    fn structure(&mut self, each: &mut dyn FnMut(&[i16], i64)) -> Option<()> {
        let mut last = 0_i16;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            last = match i16::from(head >> 4) {
                0 => i16::try_from(self.signed()?).ok()?,
                more => last.checked_add(more)?,
            };
            self.path.push(last);
            self.value(head & 15, each)?;
            self.path.pop();
        }
    }

    fn value(&mut self, kind: u8, each: &mut dyn FnMut(&[i16], i64)) -> Option<()> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return None;
        }
        self.inner(kind, each)?;
        self.depth -= 1;
        Some(())
    }

    fn inner(&mut self, kind: u8, each: &mut dyn FnMut(&[i16], i64)) -> Option<()> {
        match kind {
            // The two values of a flag are kinds of their own.
            1 | 2 => Some(()),
            3 => self.skip(1),
            4..=6 => {
                let number = self.signed()?;
                each(&self.path, number);
                Some(())
            }
            7 => self.skip(8),
            8 => {
                let length = self.varint()?;
                self.skip(length)
            }
            9 | 10 => {
                let head = self.byte()?;
                let count = if head >> 4 == 15 { self.varint()? } else { u64::from(head >> 4) };
                // Flags in a list take no bytes for some readers; no list of the format has any.
                if matches!(head & 15, 1 | 2) || count > self.bytes.len() as u64 {
                    return None;
                }
                self.path.push(COUNT);
                each(&self.path, i64::try_from(count).ok()?);
                self.path.pop();
                (0..count).try_for_each(|_| self.value(head & 15, each))
            }
            12 => self.structure(each),
            13 => self.skip(16),
            // Maps are not in the format.
            _ => None,
        }
    }

    fn byte(&mut self) -> Option<u8> {
        let (byte, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(*byte)
    }

    fn skip(&mut self, count: u64) -> Option<()> {
        self.bytes = self.bytes.get(usize::try_from(count).ok()?..)?;
        Some(())
    }

    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return Some(number);
            }
        }
        None
    }

    fn signed(&mut self) -> Option<i64> {
        let number = self.varint()?;
        Some((number >> 1).cast_signed() ^ -(number & 1).cast_signed())
    }
}

/// Walks through a structure; gives its length.
fn walk(bytes: &[u8], each: &mut dyn FnMut(&[i16], i64)) -> Option<usize> {
    let mut walk = Walk { bytes, path: Vec::new(), depth: 0 };
    walk.structure(each)?;
    Some(bytes.len() - walk.bytes.len())
}

/// Bytes of a file from a place on, fewer at its end.
fn bytes_at(mut file: &File, at: u64, count: u64) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    file.take(count).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Checks that the footer is that of a flat table of limited size. The library finds other errors.
pub(super) fn footer(file: &File, length: u64) -> io::Result<Result<(), Claim>> {
    let tail = bytes_at(file, length.saturating_sub(TAIL), TAIL)?;
    let &[a, b, c, d, b'P', b'A', b'R', b'1'] = tail.as_slice() else { return Ok(Ok(())) };
    let size = u64::from(u32::from_le_bytes([a, b, c, d]));
    let Some(start) = (length - TAIL).checked_sub(size) else { return Ok(Ok(())) };
    if size > MOST_FOOTER {
        return Ok(Err(format!("a footer of {size} bytes, {MOST_FOOTER} at most are possible")));
    }
    let bytes = bytes_at(file, start, size)?;
    let (mut groups, mut most) = (0, 0);
    let whole = walk(&bytes, &mut |path, number| match path {
        // How many columns are within an element of the schema: in the first, which is the table, all.
        [2, 5] if number != 0 => {
            groups += 1;
            most = most.max(number);
        }
        // Elements of the schema, metadata.
        [2 | 5, COUNT] => most = most.max(number - 1),
        _ => {}
    });
    Ok(if whole.is_none() {
        Err("a damaged footer".to_owned())
    } else if groups > 1 {
        Err("columns within columns; a flat table is needed".to_owned())
    } else if most > MOST_COLUMNS {
        Err(format!("{most} columns or metadata, {MOST_COLUMNS} at most are possible"))
    } else {
        Ok(())
    })
}

/// Limits of a column's part of a row group.
pub(super) struct Part {
    /// Position of the column's pages.
    pub(super) place: Range<u64>,
    /// Rows of the group.
    pub(super) rows: i64,
    /// Smallest number of bytes of a value in a dictionary; none without a dictionary.
    pub(super) least: Option<i64>,
    /// Encodings of values that do not make much of little.
    pub(super) encodings: &'static [i64],
}

/// Fields of a page's head.
#[derive(Default)]
struct Head {
    kind: Option<i64>,
    unpacked: Option<i64>,
    packed: Option<i64>,
    /// Numbers of values: of a page of values, of a dictionary, of a page of values of version 2.
    counts: [Option<i64>; 3],
    encodings: [Option<i64>; 3],
    /// True if a field occurs twice.
    twice: bool,
}

impl Head {
    fn note(&mut self, path: &[i16], number: i64) {
        let slot = match path {
            [1] => &mut self.kind,
            [2] => &mut self.unpacked,
            [3] => &mut self.packed,
            [5, 1] => &mut self.counts[0],
            [7, 1] => &mut self.counts[1],
            [8, 1] => &mut self.counts[2],
            [5, 2] => &mut self.encodings[0],
            [7, 2] => &mut self.encodings[1],
            [8, 4] => &mut self.encodings[2],
            _ => return,
        };
        self.twice |= slot.replace(number).is_some();
    }
}

/// Returns whether the pages of a part unpack to no more than their bytes can hold, and have a value for each row.
pub(super) fn pages(file: &File, part: &Part) -> io::Result<Result<(), Claim>> {
    let (mut at, mut rows) = (part.place.start, 0_i64);
    while at < part.place.end {
        let left = part.place.end - at;
        let mut found = None;
        for size in [LIKELY_HEAD, MOST_HEAD] {
            let bytes = bytes_at(file, at, left.min(size as u64))?;
            let mut head = Head::default();
            let length = walk(&bytes, &mut |path, number| head.note(path, number));
            found = length.map(|length| (length as u64, head));
            if found.is_some() {
                break;
            }
        }
        let Some((length, head)) = found else { return Ok(Err("a damaged head of a page".to_owned())) };
        match page(part, &head, left - length) {
            Ok((packed, more)) => {
                at += length + packed;
                rows = rows.saturating_add(more);
            }
            Err(claim) => return Ok(Err(claim)),
        }
    }
    Ok(if rows == part.rows { Ok(()) } else { Err(format!("{rows} values in {} rows", part.rows)) })
}

/// Bytes and rows of a page of which this is the head.
fn page(part: &Part, head: &Head, left: u64) -> Result<(u64, i64), Claim> {
    let (Some(kind), Some(unpacked), Some(packed), false) =
        (head.kind, head.unpacked, head.packed, head.twice)
    else {
        return Err("a damaged head of a page".to_owned());
    };
    if !(0..=MOST_PAGE).contains(&packed) || packed.cast_unsigned() > left {
        return Err(format!("a page of {packed} bytes, where there are {left}"));
    }
    if !(0..=MOST_PAGE.min(MOST_UNPACKED * packed + 64)).contains(&unpacked) {
        return Err(format!("a page of {packed} bytes that unpacks to {unpacked}"));
    }
    // 0: values; 2: dictionary; 3: values, after version 2; 1, an index, is not read.
    let which = match kind {
        0 => 0,
        1 => return Ok((packed.cast_unsigned(), 0)),
        2 => 1,
        3 => 2,
        _ => return Err(format!("a page of type {kind}")),
    };
    let (Some(count), Some(encoding)) = (head.counts[which], head.encodings[which]) else {
        return Err("a damaged head of a page".to_owned());
    };
    if which == 1 {
        let room = part.least.is_some_and(|least| count <= unpacked / least);
        return if count >= 0 && room {
            Ok((packed.cast_unsigned(), 0))
        } else {
            Err(format!("a dictionary of {count} values in {unpacked} bytes"))
        };
    }
    if !part.encodings.contains(&encoding) {
        let name = |encoding: &i64| {
            let known = usize::try_from(*encoding).ok().and_then(|place| ENCODINGS.get(place));
            known.map_or_else(|| format!("number {encoding}"), |name| (*name).to_owned())
        };
        let needed = part.encodings.iter().map(name).collect::<Vec<_>>().join(", ");
        return Err(format!("values in the encoding {}, needed one of {needed}", name(&encoding)));
    }
    if (0..=part.rows).contains(&count) {
        Ok((packed.cast_unsigned(), count))
    } else {
        Err(format!("a page of {count} values in a group of {} rows", part.rows))
    }
}
