//! MATLAB files of version 7.3.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use hdf5_pure::{Dataset, File, FormatError, Source};

use super::Variables;
use crate::import::arrays::{Array, MOST_POINTS};

/// The chunks of an array may unpack to this many bytes together. Those of the largest map have 8 MiB; chunks reach beyond
/// the ends of an array.
const MOST_BYTES: u64 = 1 << 25;

/// Allowance in bytes for data around the arrays; in total, at most twice the size of the file plus this is read.
const MOST_READ: u64 = 1 << 26;

/// Largest number of reads; each chunk and each part of a header takes one.
const MOST_READS: u64 = 1 << 22;

const AGAIN_AND_AGAIN: &str = "references that lead to the same parts again and again";

pub(super) struct Hdf5 {
    file: File,
    left: Arc<Left>,
}

/// Budget of bytes and reads. Headers and trees refer to their parts by place, and thirty parts that each refer to the next one
/// twice are a thousand million ways; the library bounds how deep they go, not how many they are.
struct Left {
    bytes: AtomicU64,
    reads: AtomicU64,
}

impl Left {
    /// Takes a read of so many bytes; whether that much was left.
    fn take(&self, bytes: u64) -> bool {
        let less = |of: &AtomicU64, by: u64| {
            of.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(by)).is_ok()
        };
        less(&self.reads, 1) && less(&self.bytes, bytes)
    }

    /// Returns whether something was not read because too little was left.
    fn is_gone(&self) -> bool {
        self.reads.load(Ordering::Relaxed) == 0
    }
}

/// A file in memory of which no more is read than is left.
struct Bounded {
    bytes: Vec<u8>,
    left: Arc<Left>,
}

impl Source for Bounded {
    fn len(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), FormatError> {
        if !self.left.take(buffer.len() as u64) {
            self.left.reads.store(0, Ordering::Relaxed);
            return Err(FormatError::Source(AGAIN_AND_AGAIN.to_owned()));
        }
        let place = usize::try_from(offset).ok();
        let there = place.and_then(|place| self.bytes.get(place..place.checked_add(buffer.len())?));
        let there = there.ok_or_else(|| FormatError::Source("a place beyond the file's end".to_owned()))?;
        buffer.copy_from_slice(there);
        Ok(())
    }
}

/// Returns true for HDF5: its signature is at the beginning or after MATLAB's 512 bytes of text.
pub(super) fn is_one(bytes: &[u8]) -> bool {
    [0, 512].iter().any(|at| bytes.get(*at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n")))
}

impl Hdf5 {
    pub(super) fn open(bytes: Vec<u8>) -> Result<Self, String> {
        let most = 2 * bytes.len() as u64 + MOST_READ;
        let left = Arc::new(Left { bytes: AtomicU64::new(most), reads: AtomicU64::new(MOST_READS) });
        let source = Bounded { bytes, left: Arc::clone(&left) };
        File::from_source(source).map(|file| Self { file, left }).map_err(|error| error.to_string())
    }
}

impl Variables for Hdf5 {
    fn array(&self, path: &str) -> Result<Option<Array>, String> {
        // A missing dataset and one that is a group look alike; both are not the array sought.
        let Ok(dataset) = self.file.dataset(&path.replace('.', "/")) else {
            return if self.left.is_gone() { Err(AGAIN_AND_AGAIN.to_owned()) } else { Ok(None) };
        };
        let shape = dataset.shape().map_err(|error| error.to_string())?;
        // HDF5 has the transposed shape of what MATLAB shows.
        let (rows, columns) = match shape[..] {
            [m, n] => (n, m),
            [n] => (1, n),
            _ => return Err(format!("{} dimensions", shape.len())),
        };
        let count = rows.checked_mul(columns).filter(|count| (1..=MOST_POINTS as u64).contains(count));
        let Some(count) = count else {
            return Err(format!("{rows} × {columns} numbers, 1 to 1,048,576 are possible"));
        };
        within_bounds(&dataset, &shape)?;
        let values = dataset.read_f64().map_err(|error| error.to_string())?;
        let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
        if values.len() != size(count) {
            return Err(format!("{} of {count} numbers", values.len()));
        }
        Ok(Some(Array::from_columns(path.to_owned(), size(rows), size(columns), &values)))
    }

    fn names(&self) -> Vec<String> {
        let root = self.file.root();
        let (groups, datasets) = (root.groups().unwrap_or_default(), root.datasets().unwrap_or_default());
        datasets.into_iter().chain(groups).filter(|name| !name.starts_with('#')).collect()
    }
}

/// Checks that the unpacked size of a dataset is in proportion to its shape. A small file may claim gigabytes of
/// numbers or chunks, or be compressed several times.
fn within_bounds(dataset: &Dataset, shape: &[u64]) -> Result<(), String> {
    let size = dataset.element_size().map_err(|error| error.to_string())?;
    if size > 8 {
        return Err(format!("numbers of {size} bytes, 8 at most are possible"));
    }
    let mut filters = dataset.filters();
    let count = filters.len();
    filters.sort_unstable();
    filters.dedup();
    if filters.len() < count {
        return Err("chunks that are packed twice".to_owned());
    }
    let chunk = dataset.chunk_shape().map_err(|error| error.to_string())?;
    let Some(chunk) = chunk else { return Ok(()) };
    let covered = |(n, step): (&u64, &u64)| n.div_ceil((*step).max(1)).checked_mul(*step);
    let bytes = shape
        .iter()
        .zip(&chunk)
        .map(covered)
        .try_fold(size.max(1), |product, along| product.checked_mul(along?));
    if bytes.is_none_or(|bytes| bytes > MOST_BYTES) {
        let chunk = chunk.iter().map(u64::to_string).collect::<Vec<_>>().join(" × ");
        return Err(format!("chunks of {chunk} numbers, which unpack to more than {} MiB", MOST_BYTES >> 20));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use hdf5_pure::FileBuilder;

    use super::*;

    #[test]
    fn regress_chunks_that_unpack_to_more_than_a_map_needs_are_refused() {
        let array = |side: u64, chunk: [u64; 2]| {
            let mut builder = FileBuilder::new();
            let count = usize::try_from(side * side).expect("small");
            let dataset = builder.create_dataset("Id");
            dataset.with_f64_data(&vec![0.5; count]).with_shape(&[side, side]).with_chunks(&chunk);
            dataset.with_deflate(9);
            let bytes = builder.finish().expect("written");
            let length = bytes.len();
            (Hdf5::open(bytes).expect("a file").array("Id"), length)
        };
        let (largest, _) = array(1024, [100, 100]);
        assert_eq!(largest.expect("readable").expect("there").values, vec![0.5; 1 << 20]);
        // Two chunks of 32 MiB each way round a few numbers, packed a thousand times.
        let (bomb, length) = array(3, [2, 1 << 22]);
        let message = bomb.expect_err("must be refused");
        assert_eq!(message, "chunks of 2 × 4194304 numbers, which unpack to more than 32 MiB");
        assert!(length < 1 << 20, "{length}");
    }

    #[test]
    fn regress_parts_that_are_referred_to_in_many_ways_are_not_read_in_all_of_them() {
        let word = |x: u64| x.to_le_bytes().to_vec();
        // Superblock of version 0; its root group has a header at byte 96.
        let mut bytes = b"\x89HDF\r\n\x1a\n".to_vec();
        bytes.extend([0, 0, 0, 0, 0, 8, 8, 0, 4, 0, 16, 0, 0, 0, 0, 0]);
        for x in [0, u64::MAX, 4096, u64::MAX, 0, 96, 0, 0, 0] {
            bytes.extend(word(x));
        }
        assert_eq!(bytes.len(), 96);
        // Version 1, so many messages, in 48 bytes: two that say that the header goes on at the next part.
        bytes.extend([1, 0, 0xff, 0xff, 1, 0, 0, 0, 48, 0, 0, 0, 0, 0, 0, 0]);
        for part in 0..30_u64 {
            for _ in 0..2 {
                bytes.extend([0x10, 0, 16, 0, 0, 0, 0, 0]);
                bytes.extend([word(112 + 48 * (part + 1)), word(48)].concat());
            }
        }
        // The last part: two messages of nothing.
        bytes.extend([0, 0, 16, 0, 0, 0, 0, 0].iter().chain(&[0; 16]).copied().cycle().take(48));
        bytes.resize(4096, 0);
        let begin = std::time::Instant::now();
        let found = Hdf5::open(bytes).and_then(|file| file.array("Id").map(|_| ()));
        assert!(found.expect_err("must be refused").contains("references that lead to the same parts"));
        assert!(begin.elapsed().as_secs() < 30, "{:?}", begin.elapsed());
    }
}
