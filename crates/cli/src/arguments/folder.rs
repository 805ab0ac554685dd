//! The default folder of a command's results.

use std::path::{Path, PathBuf};

use super::Command;
use super::values::{FOLDERS, OUT};

/// Returns the default output folder of a command. `of` is the scenario file or the motor. Without `of`, the folder is named after the
/// command only.
///
/// Different scenarios have different folders, as have different commands.
pub fn default_folder(of: Option<&Path>, command: &str) -> PathBuf {
    let name = of.and_then(Path::file_stem).map(|stem| format!("{}-", stem.to_string_lossy()));
    Path::new(FOLDERS).join(name.unwrap_or_default() + command)
}

impl Command {
    /// Replaces the placeholder [`OUT`] with the default folder of the command.
    pub fn name_folder(&mut self) {
        let motor = |motor: &Option<String>| motor.as_ref().map(PathBuf::from);
        let (out, of, command) = match self {
            #[cfg(feature = "program")]
            Self::Reproduce(options) => {
                let of = options.source.scenario.clone().or_else(|| motor(&options.setup.motor));
                (&mut options.out, of, "reproduce")
            }
            Self::Trace(options) => {
                let of = options.source.scenario.clone().or_else(|| motor(&options.setup.motor));
                (&mut options.out, of, "trace")
            }
            Self::Compare(options) => {
                let of = options.source.scenario.clone().or_else(|| motor(&options.motor));
                (&mut options.out, of, "compare")
            }
            Self::Magnetics(options) => (&mut options.out, Some((&options.motor).into()), "magnetics"),
            Self::Fit(options) => (&mut options.out, options.traces.first().cloned(), "fit"),
            Self::Run(options) => (&mut options.results.out, Some(options.scenario.clone()), "run"),
            Self::Sweep(options) => {
                (&mut options.run.results.out, Some(options.run.scenario.clone()), "sweep")
            }
            Self::Merge(options) => (&mut options.results.out, options.shards.first().cloned(), "merge"),
            #[cfg(feature = "program")]
            Self::Slurm(options) => (&mut options.out, Some(options.scenario.clone()), "run"),
            _ => return,
        };
        if out.as_path() == Path::new(OUT) {
            *out = default_folder(of.as_deref(), command);
        }
    }
}
