//! MATLAB files of version 7.3.

use hdf5_pure::{Dataset, File};

use super::Variables;
use crate::import::arrays::{Array, MOST_POINTS};

/// The chunks of an array may unpack to this many bytes together. Those of the largest map have 8 MiB; chunks reach beyond
/// the ends of an array.
const MOST_BYTES: u64 = 1 << 25;

pub(super) struct Hdf5 {
    file: File,
}

/// The signature stands at the beginning or behind MATLAB's 512 bytes of text.
pub(super) fn is_one(bytes: &[u8]) -> bool {
    [0, 512].iter().any(|at| bytes.get(*at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n")))
}

impl Hdf5 {
    pub(super) fn open(bytes: Vec<u8>) -> Result<Self, String> {
        File::from_bytes(bytes).map(|file| Self { file }).map_err(|error| error.to_string())
    }
}

impl Variables for Hdf5 {
    fn array(&self, path: &str) -> Result<Option<Array>, String> {
        // A missing dataset and one that is a group look alike; both are not the array sought.
        let Ok(dataset) = self.file.dataset(&path.replace('.', "/")) else { return Ok(None) };
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

/// Whether what a dataset unpacks to is no more than its numbers ask for: a small file may name numbers of gigabytes, or
/// chunks of them, or pack what is packed once more.
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
}
