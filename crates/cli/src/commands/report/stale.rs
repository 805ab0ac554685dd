//! Pages that are older than the data beside them.

use std::path::Path;

use crate::error::Error;

/// What a page says of itself once the run beside it has been replaced by another.
const NOTE: &str = "<p class=\"verdict bad\" role=\"alert\"><strong>This page is older than the data beside it: they are of another run by \
                    now. <code>standstill report</code> makes it anew.</strong></p>";

/// Where it stands: before all else that is read.
const BEFORE: &str = "<header class=\"top\">";

/// Writes into the page of a run's folder that it is of other data; returns whether there is such a page.
///
/// # Errors
/// A page that cannot be written.
pub fn mark(folder: &Path) -> Result<bool, Error> {
    let path = folder.join("report/report.html");
    let Ok(page) = std::fs::read_to_string(&path) else { return Ok(false) };
    if !page.contains(NOTE) {
        let marked = page.replacen(BEFORE, &format!("{NOTE}{BEFORE}"), 1);
        std::fs::write(&path, marked).map_err(Error::writing(&path))?;
    }
    Ok(true)
}
