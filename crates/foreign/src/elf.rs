//! What a shared library is, before anything of it runs: its kind, its writable memory, what it needs.

use object::elf;
use object::read::elf::{Dyn as _, FileHeader as _, ProgramHeader as _, SectionHeader as _, Sym as _};
use object::{Endianness, elf::FileHeader64};

/// What a file says of itself.
#[derive(Debug, Default)]
pub struct Elf {
    /// Writable memory by addresses from where the library is loaded, without what becomes read-only after loading.
    pub writable: Vec<[u64; 2]>,
    /// Bytes of thread-local memory.
    pub thread_local: u64,
    /// Functions and variables that it takes from elsewhere.
    pub undefined: Vec<String>,
    /// Variables of which there is one in the whole program, however often the library is loaded.
    pub unique: Vec<String>,
    /// Address of `sts_entry`.
    pub entry: Option<u64>,
    /// Functions and variables that it has for others.
    pub exported: Vec<String>,
    /// Libraries that it needs.
    pub needed: Vec<String>,
}

/// The functions and variables that a shared library of Linux has for others.
///
/// # Errors
/// What the file is instead of a shared library for this machine.
pub fn exported(library: &[u8]) -> Result<Vec<String>, String> {
    Elf::parse(library).map(|elf| elf.exported)
}

/// The machine that this program runs on: its number in a file's header, and its name.
#[cfg(target_arch = "x86_64")]
const HERE: u16 = elf::EM_X86_64.0;
#[cfg(target_arch = "aarch64")]
const HERE: u16 = elf::EM_AARCH64.0;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const HERE: u16 = 0;

fn machine(number: u16) -> String {
    let known = [
        (elf::EM_X86_64, "x86-64"),
        (elf::EM_AARCH64, "64-bit Arm"),
        (elf::EM_ARM, "32-bit Arm"),
        (elf::EM_386, "32-bit x86"),
        (elf::EM_RISCV, "RISC-V"),
    ];
    known
        .iter()
        .find(|(known, _)| known.0 == number)
        .map_or_else(|| format!("machine {number}"), |(_, name)| (*name).to_owned())
}

impl Elf {
    /// Of a file's bytes; what it is instead of a shared library for this machine.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        if !bytes.starts_with(b"\x7fELF") {
            return Err("no library: the file does not begin as one".to_owned());
        }
        let number = |at: usize| bytes.get(at..at + 2).map(|two| u16::from_le_bytes([two[0], two[1]]));
        let (kind, arch) = (number(16).unwrap_or(0), number(18).unwrap_or(0));
        if kind == elf::ET_REL.0 {
            return Err("an object file, not yet linked to a library".to_owned());
        }
        if arch != HERE {
            return Err(format!("a library for {}", machine(arch)));
        }
        if kind != elf::ET_DYN.0 {
            return Err("a program, not a library".to_owned());
        }
        Self::read(bytes).map_err(|error| format!("a damaged library: {error}"))
    }

    fn read(bytes: &[u8]) -> object::read::Result<Self> {
        let header = FileHeader64::<Endianness>::parse(bytes)?;
        let endian = header.endian()?;
        let mut found = Self::default();
        let segments = header.program_headers(endian, bytes)?;
        let relro = segments.iter().find(|segment| segment.p_type(endian) == elf::PT_GNU_RELRO);
        // The loader protects whole pages.
        let relro = relro.map(|segment| {
            let from = segment.p_vaddr(endian);
            [from, (from + segment.p_memsz(endian)) & !0xfff]
        });
        for segment in segments {
            match segment.p_type(endian) {
                elf::PT_LOAD if segment.p_flags(endian).contains(elf::PF_W) => {
                    let from = segment.p_vaddr(endian);
                    found.add_writable([from, from + segment.p_memsz(endian)], relro);
                }
                elf::PT_TLS => found.thread_local += segment.p_memsz(endian),
                _ => {}
            }
        }
        let sections = header.sections(endian, bytes)?;
        let symbols = sections.symbols(endian, bytes, elf::SHT_DYNSYM)?;
        for symbol in symbols.iter() {
            let name = String::from_utf8_lossy(symbol.name(endian, symbols.strings())?).into_owned();
            let (binding, is_here) = (symbol.st_bind(), symbol.st_shndx(endian) != elf::SHN_UNDEF);
            if !is_here && binding == elf::STB_GLOBAL && !name.is_empty() {
                found.undefined.push(name);
            } else if is_here && binding == elf::STB_GNU_UNIQUE {
                found.unique.push(name);
            } else if is_here {
                if name == "sts_entry" {
                    found.entry = Some(symbol.st_value(endian));
                }
                found.exported.push(name);
            }
        }
        for section in sections.iter() {
            if let Some((entries, link)) = section.dynamic(endian, bytes)? {
                let strings = sections.strings(endian, bytes, link)?;
                for entry in entries.iter().filter(|entry| entry.tag(endian) == elf::DT_NEEDED) {
                    let name = entry.string(endian, strings)?;
                    found.needed.push(String::from_utf8_lossy(name).into_owned());
                }
            }
        }
        Ok(found)
    }

    fn add_writable(&mut self, [from, to]: [u64; 2], relro: Option<[u64; 2]>) {
        let parts = match relro {
            Some([low, high]) if low < to && high > from => [[from, low.max(from)], [high.min(to), to]],
            _ => [[from, to], [to, to]],
        };
        self.writable.extend(parts.into_iter().filter(|[from, to]| from < to));
    }
}
