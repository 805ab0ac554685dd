//! Standstill for Python: commands carried out in a thread while the interpreter is free, and their results as columns that
//! NumPy and Arrow share.

mod command;
mod detector;
mod given;
mod table;

use pyo3::prelude::*;

pyo3::create_exception!(
    standstill,
    Error,
    pyo3::exceptions::PyValueError,
    "What is wrong, in the line that the command line would print."
);

/// The module.
#[pymodule]
fn _standstill(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Error", module.py().get_type::<Error>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<table::Table>()?;
    module.add_function(wrap_pyfunction!(command::command, module)?)?;
    module.add_function(wrap_pyfunction!(keywords, module)?)?;
    module.add_function(wrap_pyfunction!(choices, module)?)?;
    Ok(())
}

/// A message of the command line with keywords for options.
#[pyfunction]
fn keywords(message: &str) -> String {
    standstill_cli::keywords(message)
}

/// The values that an option of a command can have.
#[pyfunction]
fn choices(command: &str, option: &str) -> Vec<String> {
    standstill_cli::choices(command, option)
}
