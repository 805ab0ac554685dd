//! The archive: description, documentation, icon, resources, and a binary for each kind of machine.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::io::{self, Cursor, Write as _};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::model::{Model, Part, Version};

/// The shared library of this crate for one kind of machine. An FMU has one or several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binary {
    bytes: Vec<u8>,
    machine: Machine,
}

/// A kind of machine that importers run on, by the header of its libraries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Machine {
    /// Folder of the machine's binaries by FMI 3.0.
    name: &'static str,
    /// Folder by FMI 2.0; none for machines that this version does not name.
    two: Option<&'static str>,
    suffix: &'static str,
}

const fn machine(name: &'static str, two: Option<&'static str>, suffix: &'static str) -> Machine {
    Machine { name, two, suffix }
}

const LINUX: Machine = machine("x86_64-linux", Some("linux64"), ".so");
const LINUX_ARM: Machine = machine("aarch64-linux", None, ".so");
const WINDOWS: Machine = machine("x86_64-windows", Some("win64"), ".dll");
const WINDOWS_ARM: Machine = machine("aarch64-windows", None, ".dll");
const MAC: Machine = machine("x86_64-darwin", Some("darwin64"), ".dylib");
const MAC_ARM: Machine = machine("aarch64-darwin", Some("darwin64"), ".dylib");

/// Mark by which the shared library of this version is known.
#[allow(unsafe_code, reason = "a linker keeps only what is exported, and no other crate exports this name")]
#[unsafe(no_mangle)]
pub static STANDSTILL_FMU: &str = concat!("standstill_fmu=", env!("CARGO_PKG_VERSION"), ";");

/// Some of the functions that importers call.
const FUNCTIONS: [&str; 2] = ["fmi2DoStep", "fmi3DoStep"];

/// The bit of a Windows file's header by which it is a library.
const DLL: u32 = 0x2000;

/// The folder beside the program with libraries for other kinds of machines, which `scripts/fmu-binaries.sh` fills.
const OTHERS: &str = "fmu-binaries";

impl Machine {
    /// Finds the kind of machine from the header of a shared library.
    fn of(bytes: &[u8]) -> Result<Self, String> {
        let number = |at: usize| {
            bytes.get(at..at + 4).map_or(0, |four| u32::from_le_bytes([four[0], four[1], four[2], four[3]]))
        };
        if bytes.starts_with(b"\x7fELF") {
            return match number(18) & 0xffff {
                62 => Ok(LINUX),
                183 => Ok(LINUX_ARM),
                other => Err(format!("a library for Linux on machine {other}, needed x86-64 or 64-bit Arm")),
            };
        }
        if bytes.starts_with(b"MZ") {
            let header = number(0x3c) as usize;
            return match (number(header), number(header + 4) & 0xffff, number(header + 22) & DLL) {
                (0x4550, 0x8664, DLL) => Ok(WINDOWS),
                (0x4550, 0xaa64, DLL) => Ok(WINDOWS_ARM),
                (0x4550, _, 0) => Err("a program for Windows, needed a library".to_owned()),
                (0x4550, other, _) => {
                    Err(format!("a library for Windows on machine {other}, needed x86-64 or 64-bit Arm"))
                }
                _ => Err("a damaged file of Windows".to_owned()),
            };
        }
        match (number(0), number(4)) {
            (0xfeed_facf, 0x0100_0007) => Ok(MAC),
            (0xfeed_facf, 0x0100_000c) => Ok(MAC_ARM),
            _ => Err("no library: the file does not begin as one".to_owned()),
        }
    }

    /// Returns the folder in an archive; none if the version does not name this kind of machine.
    fn folder(self, version: Version) -> Option<&'static str> {
        match version {
            Version::Two => self.two,
            Version::Three => Some(self.name),
        }
    }
}

impl Binary {
    /// Makes a binary from the bytes of a file, for any kind of machine.
    ///
    /// # Errors
    /// The file is not this crate as a shared library; the error describes it.
    pub fn of(bytes: Vec<u8>) -> Result<Self, String> {
        let has = |text: &str| bytes.windows(text.len()).any(|there| there == text.as_bytes());
        let machine = Machine::of(&bytes)?;
        // Of this machine's kind, the table of exported functions is read; of others, names are looked for.
        let own = if cfg!(target_arch = "x86_64") { LINUX } else { LINUX_ARM };
        let lacks = if cfg!(target_os = "linux") && machine == own {
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
        Ok(Self { bytes, machine })
    }

    /// Returns the kind of machine that it runs on, by its name in FMI 3.0, such as `x86_64-windows`.
    pub fn machine(&self) -> &'static str {
        self.machine.name
    }

    /// Returns the name that Cargo gives the library.
    pub fn name() -> String {
        format!("{DLL_PREFIX}standstill_fmu{DLL_SUFFIX}")
    }

    /// Returns the possible paths of the library beside a program: in its folder, or in the folder of Cargo's
    /// dependencies.
    pub fn beside(program: &Path) -> [PathBuf; 2] {
        let folder = program.parent().unwrap_or_else(|| Path::new(""));
        [folder.join(Self::name()), folder.join("deps").join(Self::name())]
    }

    /// Returns the libraries for other kinds of machines, from the folder `fmu-binaries` beside a program, in order of
    /// their names.
    pub fn others(program: &Path) -> Vec<PathBuf> {
        let folder = program.parent().unwrap_or_else(|| Path::new("")).join(OTHERS);
        let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let is = |path: &PathBuf| {
            path.extension()
                .is_some_and(|suffix| [".so", ".dll", ".dylib"].iter().any(|of| &of[1..] == suffix))
        };
        let mut files: Vec<PathBuf> = files.filter(|path| is(path)).collect();
        files.sort();
        files
    }
}

/// Returns the bytes of an FMU. Equal models and binaries give equal bytes. Binaries for machines that FMI 2.0 does not
/// name are left out of an FMU of that version.
///
/// # Errors
/// There is no binary for a machine that the version names, or there are two for one kind of machine.
pub fn pack(model: &Model, version: Version, binaries: &[Binary]) -> io::Result<Vec<u8>> {
    let mut placed: Vec<(&'static str, &Binary)> = Vec::new();
    for binary in binaries {
        let Some(folder) = binary.machine.folder(version) else { continue };
        if placed.iter().any(|(there, _)| *there == folder) {
            return Err(io::Error::other(format!("found two libraries for {folder}, needed one")));
        }
        placed.push((folder, binary));
    }
    if placed.is_empty() {
        let machines: Vec<&str> = binaries.iter().map(Binary::machine).collect();
        let machines = machines.join(" and ");
        return Err(io::Error::other(format!(
            "FMI 2.0 has no name for {machines}; needed: --fmi 3, or another machine's library by --binary"
        )));
    }
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let plain = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default());
    let mut file = |name: &str, content: &[u8], options: SimpleFileOptions| {
        zip.start_file(name, options)?;
        zip.write_all(content)
    };
    file("modelDescription.xml", model.description(version).as_bytes(), plain)?;
    let icon: &[u8] = match model.part {
        Part::Drive => include_bytes!("icons/drive.png"),
        Part::Motor => include_bytes!("icons/motor.png"),
    };
    let place = if version == Version::Two { "model.png" } else { "terminalsAndIcons/icon.png" };
    file(place, icon, plain)?;
    let machines: Vec<&str> = placed.iter().map(|(_, binary)| binary.machine()).collect();
    file("documentation/index.html", model.documentation(version, &machines).as_bytes(), plain)?;
    file("documentation/licenses/license.txt", LICENCE.as_bytes(), plain)?;
    file("documentation/licenses/third-party.txt", include_bytes!("third-party.txt"), plain)?;
    file(&format!("resources/{}", model.part.resource()), model.packed.text.as_bytes(), plain)?;
    for (name, content) in &model.packed.files {
        file(&format!("resources/{name}"), content, plain)?;
    }
    for (folder, binary) in placed {
        let library = format!("binaries/{folder}/{}{}", model.part.name(), binary.machine.suffix);
        file(&library, &binary.bytes, plain.unix_permissions(0o755))?;
    }
    Ok(zip.finish()?.into_inner())
}

/// The licence of the content except the data sheet, which belongs to the user.
const LICENCE: &str = include_str!("licence.txt");
