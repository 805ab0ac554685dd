//! Maps in MATLAB files. The reader accepts the variables of SyR-e (`Id`, `Iq`, `Fd`, `Fq`, either on their own or in
//! `motorModel.FluxMap_dq`, with pole pairs and resistance in `motorModel.data`), the flux tables of MathWorks'
//! examples (`FEAdata.current`, `FEAdata.flux`) and the parameters of MathWorks' blocks.
//!
//! Two formats have the same extension: HDF5 (saved with `-v7.3`) and the older one.

mod hdf5;
mod level5;

use super::arrays::{Array, Rows, listed, points};
use super::{MapError, MapSamples};

/// Names of a program for the currents and fluxes along d and q, and the current that changes from row to row if the
/// currents are axes.
struct Layout {
    names: [&'static str; 4],
    rows: Rows,
}

const SYRE: [&str; 4] = ["Id", "Iq", "Fd", "Fq"];

/// The first that is there wins.
const LAYOUTS: [Layout; 8] = [
    Layout { names: SYRE, rows: Rows::Quadrature },
    Layout {
        names: [
            "motorModel.FluxMap_dq.Id",
            "motorModel.FluxMap_dq.Iq",
            "motorModel.FluxMap_dq.Fd",
            "motorModel.FluxMap_dq.Fq",
        ],
        rows: Rows::Quadrature,
    },
    Layout {
        names: ["FluxMap_dq.Id", "FluxMap_dq.Iq", "FluxMap_dq.Fd", "FluxMap_dq.Fq"],
        rows: Rows::Quadrature,
    },
    Layout {
        names: ["FEAdata.current.d", "FEAdata.current.q", "FEAdata.flux.d", "FEAdata.flux.q"],
        rows: Rows::Direct,
    },
    Layout { names: ["iD", "iQ", "fluxD", "fluxQ"], rows: Rows::Direct },
    Layout { names: ["iDVec", "iQVec", "fluxD", "fluxQ"], rows: Rows::Direct },
    Layout { names: ["id_index", "iq_index", "lambda_d", "lambda_q"], rows: Rows::Direct },
    Layout { names: ["i_d_A", "i_q_A", "psi_d_Wb", "psi_q_Wb"], rows: Rows::Direct },
];

/// Names of further variables.
const POLE_PAIRS: &str = "motorModel.data.p";
const RESISTANCE: &str = "motorModel.data.Rs";

/// A MATLAB file of either format.
trait Variables {
    /// Returns the numeric array at a dotted path, or none; an error for one that cannot be read.
    fn array(&self, path: &str) -> Result<Option<Array>, String>;

    /// Returns the names at the top, for messages.
    fn names(&self) -> Vec<String>;
}

pub(super) fn read(file: &str, bytes: Vec<u8>) -> Result<MapSamples, MapError> {
    let error = |found: String, needed: &str| MapError::new(file, None, found, needed.to_owned());
    let variables: Box<dyn Variables> = if hdf5::is_one(&bytes) {
        Box::new(hdf5::Hdf5::open(bytes).map_err(|found| error(found, "a MATLAB file of version 7.3"))?)
    } else {
        let paths = LAYOUTS.iter().flat_map(|layout| layout.names);
        let tops: Vec<&str> = paths.map(|path| path.split('.').next().unwrap_or_default()).collect();
        Box::new(level5::Level5::open(&bytes, &tops).map_err(|found| {
            error(found, "a MATLAB file of version 5 to 7.3, as `save` writes with -v6, -v7 or -v7.3")
        })?)
    };
    let array = |path: &str| {
        variables
            .array(path)
            .map_err(|found| error(format!("`{path}`: {found}"), "a full matrix of real numbers"))
    };
    for Layout { names, rows } in LAYOUTS {
        let mut arrays = Vec::new();
        for name in names {
            arrays.extend(array(name)?);
        }
        // A name that layouts share is none of either.
        if arrays.is_empty() || (arrays.len() < 4 && names != SYRE) {
            continue;
        }
        let Ok(arrays) = <[Array; 4]>::try_from(arrays) else {
            return Err(error(format!("only some of {}", names.join(", ")), "all four"));
        };
        let mut samples = points(file, &arrays, rows)?;
        let number = |path: &str| Ok(array(path)?.and_then(|array| array.values.first().copied()));
        let pole_pairs = number(POLE_PAIRS)?;
        samples.pole_pairs = (1..=200).find(|p| Some(f64::from(*p)) == pole_pairs);
        samples.resistance = number(RESISTANCE)?.filter(|r| (1e-9..=1e6).contains(r));
        return Ok(samples);
    }
    let names = variables.names();
    let found = format!("the variables {}", listed(names.iter()));
    let layouts = LAYOUTS.iter().map(|layout| layout.names.join(", ")).collect::<Vec<_>>().join("; or ");
    Err(error(found, &format!("one of these groups: {layouts}")))
}
