//! Maps as SyR-e keeps them in MATLAB files: `Id`, `Iq`, `Fd`, `Fq`, either by themselves or in
//! `motorModel.FluxMap_dq`, with pole pairs and resistance in `motorModel.data`.
//!
//! Two formats have the same ending: HDF5 (saved with `-v7.3`) and what came before it.

mod hdf5;
mod level5;

use super::arrays::{Array, Rows, listed, points};
use super::{MapError, MapSamples};

const NAMES: [&str; 4] = ["Id", "Iq", "Fd", "Fq"];

/// Where the four arrays may be, the first place that has them wins.
const PLACES: [&str; 3] = ["", "motorModel.FluxMap_dq.", "FluxMap_dq."];

/// A MATLAB file of either format.
trait Variables {
    /// The numeric array at a dotted path, or none; an error for one that cannot be read.
    fn array(&self, path: &str) -> Result<Option<Array>, String>;

    /// Names at the top, for messages.
    fn names(&self) -> Vec<String>;
}

pub(super) fn read(file: &str, bytes: Vec<u8>) -> Result<MapSamples, MapError> {
    let error = |found: String, needed: &str| MapError::new(file, None, found, needed.to_owned());
    let variables: Box<dyn Variables> = if hdf5::is_one(&bytes) {
        Box::new(hdf5::Hdf5::open(bytes).map_err(|found| error(found, "a MATLAB file of version 7.3"))?)
    } else {
        Box::new(level5::Level5::open(&bytes).map_err(|found| {
            error(found, "a MATLAB file of version 5 to 7.3, as `save` writes with -v6, -v7 or -v7.3")
        })?)
    };
    let array = |path: &str| {
        variables
            .array(path)
            .map_err(|found| error(format!("`{path}`: {found}"), "a full matrix of real numbers"))
    };
    for place in PLACES {
        let mut arrays = Vec::new();
        for name in NAMES {
            arrays.extend(array(&format!("{place}{name}"))?);
        }
        if arrays.is_empty() {
            continue;
        }
        let Ok(arrays) = <[Array; 4]>::try_from(arrays) else {
            let names = NAMES.map(|name| format!("{place}{name}"));
            return Err(error(format!("only some of {}", names.join(", ")), "all four"));
        };
        let mut samples = points(file, &arrays, Rows::Quadrature)?;
        let number = |path: &str| Ok(array(path)?.and_then(|array| array.values.first().copied()));
        let pole_pairs = number("motorModel.data.p")?;
        samples.pole_pairs = (1..=200).find(|p| Some(f64::from(*p)) == pole_pairs);
        samples.resistance = number("motorModel.data.Rs")?.filter(|r| (1e-9..=1e6).contains(r));
        return Ok(samples);
    }
    let names = variables.names();
    let found = format!("the variables {}", listed(names.iter()));
    let needed = "Id, Iq, Fd, Fq, or motorModel.FluxMap_dq with these, as SyR-e saves them";
    // The names of the other formats.
    let others = ["i_d_A", "i_q_A", "psi_d_Wb", "psi_q_Wb"];
    if others.iter().any(|other| names.iter().any(|name| name == other)) {
        return Err(error(found, &format!("{needed}; {} are for .csv and .npz files", others.join(", "))));
    }
    Err(error(found, needed))
}
