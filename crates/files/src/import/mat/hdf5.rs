//! MATLAB files of version 7.3.

use hdf5_pure::File;

use super::Variables;
use crate::import::arrays::{Array, MOST_POINTS};

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
