//! The archive: description, resources and binary.

use std::env::consts::{ARCH, DLL_PREFIX, DLL_SUFFIX, OS};
use std::io::{self, Cursor, Write as _};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::model::{Model, Version};

/// The shared library of this crate, which goes into every FMU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binary(pub Vec<u8>);

/// Mark by which the shared library of this version is known.
#[allow(unsafe_code, reason = "a linker keeps only what is exported, and no other crate exports this name")]
#[unsafe(no_mangle)]
pub static STANDSTILL_FMU: &str = concat!("standstill_fmu=", env!("CARGO_PKG_VERSION"), ";");

/// Some of the functions that importers call.
const FUNCTIONS: [&str; 2] = ["fmi2DoStep", "fmi3DoStep"];

impl Binary {
    /// From a file's bytes.
    ///
    /// # Errors
    /// Description of the file, where it is not this crate as a shared library.
    pub fn of(bytes: Vec<u8>) -> Result<Self, String> {
        let has = |text: &str| bytes.windows(text.len()).any(|there| there == text.as_bytes());
        let lacks = if cfg!(target_os = "linux") {
            let exported = standstill_foreign::exported(&bytes)?;
            FUNCTIONS.into_iter().find(|name| !exported.iter().any(|there| there == name))
        } else {
            FUNCTIONS.into_iter().find(|name| !has(name))
        };
        if let Some(name) = lacks {
            return Err(format!("a library without {name}"));
        }
        if !has(STANDSTILL_FMU) {
            return Err("the library of another program, or of another version of this one".to_owned());
        }
        Ok(Self(bytes))
    }

    /// Its name as Cargo builds it.
    pub fn name() -> String {
        format!("{DLL_PREFIX}standstill_fmu{DLL_SUFFIX}")
    }

    /// Where it may be beside a program: in its folder, or in the folder where Cargo puts what it builds for it.
    pub fn beside(program: &Path) -> [PathBuf; 2] {
        let folder = program.parent().unwrap_or_else(|| Path::new(""));
        [folder.join(Self::name()), folder.join("deps").join(Self::name())]
    }

    /// The folder of this machine's binaries; none where the standard has no name for it.
    fn platform(version: Version) -> Option<&'static str> {
        Some(match (version, OS, ARCH) {
            (Version::Two, "linux", "x86_64") => "linux64",
            (Version::Two, "macos", _) => "darwin64",
            (Version::Two, "windows", "x86_64") => "win64",
            (Version::Three, "linux", "x86_64") => "x86_64-linux",
            (Version::Three, "linux", "aarch64") => "aarch64-linux",
            (Version::Three, "macos", "x86_64") => "x86_64-darwin",
            (Version::Three, "macos", "aarch64") => "aarch64-darwin",
            (Version::Three, "windows", "x86_64") => "x86_64-windows",
            _ => return None,
        })
    }
}

/// The FMU as a file has it. The same model gives the same bytes.
///
/// # Errors
/// A machine that the standard has no name for.
pub fn pack(model: &Model, version: Version, binary: &Binary) -> io::Result<Vec<u8>> {
    let platform = Binary::platform(version).ok_or_else(|| {
        io::Error::other(format!("FMI has no name for {OS} on {ARCH}; needed: --fmi 3, or another machine"))
    })?;
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let plain = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default());
    let mut file = |name: &str, content: &[u8], options: SimpleFileOptions| {
        zip.start_file(name, options)?;
        zip.write_all(content)
    };
    file("modelDescription.xml", model.description(version).as_bytes(), plain)?;
    file(&format!("resources/{}", model.part.resource()), model.packed.text.as_bytes(), plain)?;
    for (name, content) in &model.packed.files {
        file(&format!("resources/{name}"), content, plain)?;
    }
    let library = format!("binaries/{platform}/{}{DLL_SUFFIX}", model.part.name());
    file(&library, &binary.0, plain.unix_permissions(0o755))?;
    Ok(zip.finish()?.into_inner())
}
