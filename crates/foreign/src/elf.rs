//! Properties of a shared library, read before anything of it runs: its kind, its writable memory, the libraries that it needs.

use std::path::PathBuf;

use object::read::elf::{
    Dyn as _, FileHeader as _, ProgramHeader as _, Rela as _, SectionHeader as _, SectionTable, Sym as _,
};
use object::{Endianness, elf, elf::FileHeader64};

/// Contents of an ELF file that matter for loading it.
#[derive(Clone, Debug, Default)]
pub struct Elf {
    /// Address ranges of writable memory, relative to the load address, without memory that is read-only after loading.
    pub writable: Vec<[u64; 2]>,
    /// Bytes of thread-local memory.
    pub thread_local: u64,
    /// Functions and variables that it takes from elsewhere.
    pub undefined: Vec<String>,
    /// Whether it exports `sts_entry`.
    pub has_entry: bool,
    /// Functions and variables that it has for others.
    pub exported: Vec<String>,
    /// Libraries that it needs.
    pub needed: Vec<String>,
    /// Folders in which it has these looked for first, with `$ORIGIN` for its own; and whether they come before
    /// `LD_LIBRARY_PATH`.
    pub folders: Vec<String>,
    pub folders_first: bool,
    /// Functions that run when it is loaded: `DT_INIT`, and where those of `DT_INIT_ARRAY` are listed.
    pub init: Option<u64>,
    pub init_array: [u64; 2],
    /// Addresses at which the loader puts that of a function or variable from elsewhere, with its name.
    pub taken: Vec<(u64, String)>,
    /// Places in the file at which a copy differs.
    pub places: Places,
}

/// Places in a file at which copies in memory differ from it, in bytes from its beginning.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// Places and names of required libraries; a name may occur several times.
    pub names: Vec<(usize, String)>,
    /// Entries of functions that run when the library is loaded and unloaded.
    pub runs: Vec<usize>,
    /// Entry with the library's own name.
    pub own_name: Option<usize>,
    /// Bindings of variables that exist once in the program, however often the library is loaded.
    pub unique: Vec<usize>,
    /// Address of its table of strings.
    pub strings: u64,
}

/// Returns the functions and variables that a shared library of Linux exports.
///
/// # Errors
/// The file is not a shared library for this machine; the error contains its kind.
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

/// Number of bytes of a symbol.
const SYMBOL: usize = 24;
/// Index of the byte of a symbol that has its binding in the upper four bits.
const BINDING: usize = 4;

/// Kinds of places that the loader fills with the address of a function or variable.
#[cfg(target_arch = "aarch64")]
const TAKES: [u32; 3] = [elf::R_AARCH64_ABS64.0, elf::R_AARCH64_GLOB_DAT.0, elf::R_AARCH64_JUMP_SLOT.0];
#[cfg(not(target_arch = "aarch64"))]
const TAKES: [u32; 3] = [elf::R_X86_64_64.0, elf::R_X86_64_GLOB_DAT.0, elf::R_X86_64_JUMP_SLOT.0];

fn usize_of(offset: u64) -> usize {
    usize::try_from(offset).unwrap_or(usize::MAX)
}

impl Elf {
    /// Parses the bytes of a file. If it is not a shared library for this machine, the error contains its kind.
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
            [from, from.saturating_add(segment.p_memsz(endian)) & !0xfff]
        });
        for segment in segments {
            match segment.p_type(endian) {
                elf::PT_LOAD if segment.p_flags(endian).contains(elf::PF_W) => {
                    let from = segment.p_vaddr(endian);
                    // A damaged length has no end; the loader refuses such a segment.
                    found.add_writable([from, from.saturating_add(segment.p_memsz(endian))], relro);
                }
                elf::PT_TLS => {
                    found.thread_local = found.thread_local.saturating_add(segment.p_memsz(endian));
                }
                _ => {}
            }
        }
        let sections = header.sections(endian, bytes)?;
        let symbols = sections.symbols(endian, bytes, elf::SHT_DYNSYM)?;
        let table = usize_of(sections.section(symbols.section())?.sh_offset(endian));
        for (index, symbol) in symbols.iter().enumerate() {
            let name = String::from_utf8_lossy(symbol.name(endian, symbols.strings())?).into_owned();
            let (binding, is_here) = (symbol.st_bind(), symbol.st_shndx(endian) != elf::SHN_UNDEF);
            if binding == elf::STB_GNU_UNIQUE {
                found.places.unique.push(table.saturating_add(index * SYMBOL + BINDING));
            }
            if !is_here && binding == elf::STB_GLOBAL && !name.is_empty() {
                found.undefined.push(name);
            } else if is_here {
                found.has_entry |= name == "sts_entry";
                found.exported.push(name);
            }
        }
        for section in sections.iter() {
            let Some((all, _)) = section.rela(endian, bytes)? else { continue };
            for one in all {
                let Some(symbol) = one.symbol(endian, false) else { continue };
                let symbol = symbols.symbol(symbol)?;
                if TAKES.contains(&one.r_type(endian, false).0) && symbol.st_shndx(endian) == elf::SHN_UNDEF {
                    let name = String::from_utf8_lossy(symbol.name(endian, symbols.strings())?).into_owned();
                    found.taken.push((one.r_offset(endian), name));
                }
            }
        }
        found.read_dynamic(&sections, endian, bytes)?;
        Ok(found)
    }

    /// Reads the dynamic section.
    fn read_dynamic(
        &mut self,
        sections: &SectionTable<'_, FileHeader64<Endianness>>,
        endian: Endianness,
        bytes: &[u8],
    ) -> object::read::Result<()> {
        for section in sections.iter() {
            if let Some((mut all, link)) = section.gnu_verneed(endian, bytes)? {
                let (strings, at) = (sections.strings(endian, bytes, link)?, sections.section(link)?);
                while let Some((one, _)) = all.next()? {
                    let name = String::from_utf8_lossy(one.file(endian, strings)?).into_owned();
                    let at = usize_of(at.sh_offset(endian).saturating_add(one.vn_file.get(endian).into()));
                    self.places.names.push((at, name));
                }
            }
            let Some((entries, link)) = section.dynamic(endian, bytes)? else { continue };
            let strings = sections.strings(endian, bytes, link)?;
            let texts = sections.section(link)?.sh_offset(endian);
            for (index, entry) in entries.iter().enumerate() {
                let at = usize_of(section.sh_offset(endian)).saturating_add(index * size_of::<[u64; 2]>());
                let (tag, value) = (entry.tag(endian), entry.val(endian));
                let text =
                    || entry.string(endian, strings).map(|text| String::from_utf8_lossy(text).into_owned());
                match tag {
                    elf::DT_NEEDED => {
                        self.places.names.push((usize_of(texts.saturating_add(value)), text()?));
                        self.needed.push(text()?);
                    }
                    elf::DT_RPATH if self.folders.is_empty() => {
                        self.folders = text()?.split(':').map(str::to_owned).collect();
                        self.folders_first = true;
                    }
                    elf::DT_RUNPATH => {
                        self.folders = text()?.split(':').map(str::to_owned).collect();
                        self.folders_first = false;
                    }
                    elf::DT_SONAME => self.places.own_name = Some(at),
                    elf::DT_STRTAB => self.places.strings = value,
                    elf::DT_INIT => self.init = Some(value),
                    elf::DT_INIT_ARRAY => self.init_array[0] = value,
                    elf::DT_INIT_ARRAYSZ => self.init_array[1] = value,
                    _ => {}
                }
                if [elf::DT_INIT, elf::DT_FINI, elf::DT_INIT_ARRAY, elf::DT_FINI_ARRAY].contains(&tag) {
                    self.places.runs.push(at);
                }
            }
        }
        Ok(())
    }

    /// Returns whether it takes this function from elsewhere.
    pub fn takes(&self, name: &str) -> bool {
        self.undefined.iter().any(|taken| taken == name)
    }

    /// Returns the folders that the file at this path specifies for the search of libraries.
    pub fn folders_of(&self, path: &std::path::Path) -> Vec<PathBuf> {
        let origin = std::path::absolute(path).ok();
        let origin =
            origin.as_deref().and_then(std::path::Path::parent).unwrap_or(path).display().to_string();
        let whole =
            |folder: &String| PathBuf::from(folder.replace("${ORIGIN}", &origin).replace("$ORIGIN", &origin));
        self.folders.iter().filter(|folder| !folder.is_empty()).map(whole).collect()
    }

    fn add_writable(&mut self, [from, to]: [u64; 2], relro: Option<[u64; 2]>) {
        let parts = match relro {
            Some([low, high]) if low < to && high > from => [[from, low.max(from)], [high.min(to), to]],
            _ => [[from, to], [to, to]],
        };
        self.writable.extend(parts.into_iter().filter(|[from, to]| from < to));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Addresses add up beyond the end of memory: such a file is refused, and no number turns over.
    #[test]
    fn regress_a_segment_without_end_is_no_panic() {
        let mut file = vec![0; 64 + 2 * 56];
        file[..7].copy_from_slice(b"\x7fELF\x02\x01\x01");
        let mut put = |at: usize, bytes: &[u8]| file[at..at + bytes.len()].copy_from_slice(bytes);
        put(16, &elf::ET_DYN.0.to_le_bytes());
        put(18, &HERE.to_le_bytes());
        put(20, &1_u32.to_le_bytes());
        // Two program headers of 56 bytes behind the file's own, of 64.
        put(32, &64_u64.to_le_bytes());
        put(52, &[64, 0, 56, 0, 2, 0]);
        for (at, kind) in [(64, elf::PT_LOAD), (120, elf::PT_TLS)] {
            put(at, &kind.0.to_le_bytes());
            put(at + 4, &elf::PF_W.0.to_le_bytes());
            // Its address, and its size in memory.
            put(at + 16, &(u64::MAX - 7).to_le_bytes());
            put(at + 40, &u64::MAX.to_le_bytes());
        }
        // It has no sections.
        let refused = Elf::parse(&file).expect_err("damaged");
        assert!(refused.starts_with("a damaged library: "), "{refused}");
    }
}
