//! Cache of Cramér–Rao limits. Computing a limit may take minutes, and equal scenarios have equal limits.
//!
//! A cache entry contains everything that the limit depends on: the program including its build, the version of its
//! numerics, the angles, and the whole scenario. An entry is therefore never outdated: an entry of another program or
//! scenario is not used. A checksum precedes it: an entry with other bytes is not used either.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::time::UNIX_EPOCH;

use standstill_analysis::Bound;
use standstill_campaign::NUMERICS;
use standstill_detect::Method;
use standstill_files::read_at_most;
use standstill_plant::Digest;
use standstill_scenario::Scenario;

use crate::shell::host;
use crate::shell::output::{remove_stale, unfinished_prefix};

/// A cache entry: the text of [`identity`] and the limit. The text contains everything on which the limit depends. The limit is none if the
/// method has no limit.
type Kept = (String, Option<Bound>);

/// Largest size of a cache entry in bytes. The scenario takes most of it.
const MOST_BYTES: u64 = 1 << 20;

/// Returns the folder of the cache, which is in the user's cache folder. None if there is no such folder. Also none if another program
/// calls this crate as a library, because its build is unknown.
fn folder() -> Option<PathBuf> {
    if host::current().is_some() {
        return None;
    }
    let set = |name: &str| std::env::var_os(name).filter(|path| !path.is_empty()).map(PathBuf::from);
    let base = set("XDG_CACHE_HOME")
        .or_else(|| set("HOME").map(|home| home.join(".cache")))
        .or_else(|| set("LOCALAPPDATA"))?;
    Some(base.join("standstill").join("limits"))
}

/// Returns a text that identifies a limit: program, scenario and number of angles. None if the program's file cannot be read.
fn identity(scenario: &Scenario<Method<f64>>, angles: usize) -> Option<String> {
    let program = fs::metadata(std::env::current_exe().ok()?).ok()?;
    let built = program.modified().ok()?.duration_since(UNIX_EPOCH).ok()?.as_nanos();
    let (version, length) = (env!("CARGO_PKG_VERSION"), program.len());
    Some(format!("{version} {NUMERICS} {length} {built}, {angles} angles: {scenario:?}"))
}

/// Returns the limit of a scenario from the cache. If the cache does not have the limit, computes it and stores it if possible.
pub fn limit<E>(
    scenario: &Scenario<Method<f64>>,
    angles: usize,
    compute: impl FnOnce() -> Result<(Option<Bound>, Option<standstill_sim::RunError>), E>,
) -> Result<(Option<Bound>, Option<standstill_sim::RunError>), E> {
    let place = folder().zip(identity(scenario, angles)).map(|(folder, of)| {
        // The checksum only names the file. Whether an entry is used is decided by the identity inside it.
        let Digest { bytes, crc32 } = Digest::of(of.as_bytes());
        let name = format!("{crc32:08x}-{bytes}.limit");
        (folder.join(name), of)
    });
    if let Some((path, of)) = &place
        && let Ok(bytes) = read_at_most(path, MOST_BYTES)
        && let Some((known, bound)) = unpacked(&bytes)
        && known == *of
    {
        return Ok((bound, None));
    }
    let found = compute()?;
    if let (Some((path, of)), (found, None)) = (place, &found) {
        // A limit that cannot be stored is computed again the next time.
        let _ = write(&path, &(of, *found));
    }
    Ok(found)
}

/// Writes a cache entry in one step, so that another process never reads an incomplete entry.
fn write(path: &std::path::Path, kept: &Kept) -> std::io::Result<()> {
    let folder = path.parent().unwrap_or(path);
    fs::create_dir_all(folder)?;
    remove_stale(folder);
    let mut file = tempfile::Builder::new().prefix(&unfinished_prefix()).tempfile_in(folder)?;
    file.write_all(&packed(kept).map_err(std::io::Error::other)?)?;
    file.persist(path)?;
    Ok(())
}

/// Returns the bytes of an entry behind their checksum.
fn packed(kept: &Kept) -> Result<Vec<u8>, postcard::Error> {
    let bytes = postcard::to_stdvec(kept)?;
    let mut all = Digest::of(&bytes).crc32.to_le_bytes().to_vec();
    all.extend(bytes);
    Ok(all)
}

/// Reads the bytes of an entry. None if they are not as they were written.
fn unpacked(all: &[u8]) -> Option<Kept> {
    let (sum, bytes) = all.split_first_chunk::<4>()?;
    (Digest::of(bytes).crc32.to_le_bytes() == *sum).then(|| postcard::from_bytes(bytes).ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_limit_survives_with_what_is_not_finite() {
        let all = Bound {
            scheme_deg: 0.1,
            all_deg: Some(f64::INFINITY),
            hybrid_deg: None,
            hybrid_all_deg: Some(0.3),
        };
        let kept: Kept = (String::new(), Some(all));
        let bytes = packed(&kept).expect("bytes");
        assert_eq!(unpacked(&bytes), Some(kept));
        for bit in 0..8 * bytes.len() {
            let mut changed = bytes.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(unpacked(&changed), None, "bit {bit}");
        }
    }
}
