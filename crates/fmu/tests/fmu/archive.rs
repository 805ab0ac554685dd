//! The archive: what importers look for in it, and the libraries that it may hold.

use std::io::Read as _;

use standstill_fmu::{Binary, Kind, Part, Version, pack};

use super::FIELD;
use super::importer::{binary, unpacked};

#[test]
fn law_the_archive_has_what_importers_look_for_and_is_the_same_each_time() {
    let model = unpacked(FIELD, Part::Drive).model;
    let library = Binary::of(std::fs::read(binary()).expect("there")).expect("ours");
    for (version, [linux, windows, icon]) in [
        (Version::Two, ["linux64", "win64", "model.png"]),
        (Version::Three, ["x86_64-linux", "x86_64-windows", "terminalsAndIcons/icon.png"]),
    ] {
        if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
            continue;
        }
        let libraries = [library.clone(), made_up(WINDOWS)];
        let bytes = pack(&model, version, &libraries).expect("packed");
        assert_eq!(bytes, pack(&model, version, &libraries).expect("packed"));
        let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).expect("an archive");
        let names: Vec<String> = archive.file_names().map(|name| name.expect("UTF-8").into_owned()).collect();
        let binary = format!("binaries/{linux}/standstill_drive.so");
        let other = format!("binaries/{windows}/standstill_drive.dll");
        let licence = "documentation/licenses/license.txt";
        for name in
            ["modelDescription.xml", "resources/standstill_drive.toml", &binary, &other, icon, licence]
        {
            assert!(names.iter().any(|there| there == name), "{name}: {names:?}");
        }
        assert!(archive.by_name(&binary).expect("there").size() > 100_000);
        let mut read = |name: &str| {
            let mut bytes = Vec::new();
            archive.by_name(name).expect("there").read_to_end(&mut bytes).expect("whole");
            bytes
        };
        assert!(read(icon).starts_with(b"\x89PNG"));
        let page = String::from_utf8(read("documentation/index.html")).expect("UTF-8");
        for variable in model.variables.iter().filter(|of| of.kind != Kind::Clock && of.name != "time") {
            assert!(page.contains(&format!("<code>{}</code>", variable.name)), "{}", variable.name);
        }
        for says in ["x86_64-linux, x86_64-windows", "80 µs", "8e-5", "<td>3</td><td>duty</td>"] {
            assert!(page.contains(says), "{says}");
        }
        let root = include_str!("../../../../LICENSE-MIT");
        assert!(
            String::from_utf8(read(licence)).expect("UTF-8").ends_with(root),
            "the licence is the repository's"
        );
        let texts = String::from_utf8(read("documentation/licenses/third-party.txt")).expect("UTF-8");
        let inside = include_str!("../../../../THIRD-PARTY.md").lines().filter(|line| line.starts_with("| "));
        for row in inside.skip(1) {
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            let name = format!("{} {}", cells[1], cells[2]);
            let told = texts.lines().any(|line| line == name || line.starts_with(&format!("{name}: ")));
            assert!(told, "{name}: no text of its licence");
        }
    }
}

#[test]
fn law_only_this_crate_s_library_of_this_version_is_a_binary() {
    let library = std::fs::read(binary()).expect("there");
    let ours = Binary::of(library.clone()).expect("ours");
    if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        assert_eq!(ours.machine(), "x86_64-linux");
    }
    let of = |bytes: &[u8]| Binary::of(bytes.to_vec()).expect_err("refused");
    if cfg!(target_os = "linux") {
        assert_eq!(of(b"trials = 3"), "no library: the file does not begin as one");
        // A library of Rust, and a program: this test.
        let test = std::fs::read(std::env::current_exe().expect("a test")).expect("there");
        assert_eq!(of(&test), "a library without fmi2DoStep");
        assert!(of(&library[..library.len() / 2]).starts_with("a damaged library"));
        assert_eq!(of(&headed(PROGRAM)), "a program for Windows, needed a library");
        assert_eq!(of(b"MZ, and no more"), "a damaged file of Windows");
        assert!(of(&headed(OLD_WINDOWS)).starts_with("a library for Windows on machine 332"));
    }
    let mark = format!("standstill_fmu={};", env!("CARGO_PKG_VERSION"));
    let place = library.windows(mark.len()).position(|there| there == mark.as_bytes()).expect("marked");
    let mut other = library;
    other[place + mark.len() - 2] ^= 1;
    assert_eq!(of(&other), "the library of another program, or of another version of this one");
}

/// Machine and whether it is a library, of a file of Windows.
const WINDOWS: (u16, bool) = (0x8664, true);
const WINDOWS_ARM: (u16, bool) = (0xaa64, true);
const OLD_WINDOWS: (u16, bool) = (0x14c, true);
const PROGRAM: (u16, bool) = (0x8664, false);

/// A file with a header of Windows and what is looked for in a library.
fn headed((machine, library): (u16, bool)) -> Vec<u8> {
    let mut bytes = vec![0; 0x100];
    bytes[..2].copy_from_slice(b"MZ");
    bytes[0x3c] = 0x80;
    bytes[0x80..0x82].copy_from_slice(b"PE");
    bytes[0x84..0x86].copy_from_slice(&machine.to_le_bytes());
    bytes[0x97] = if library { 0x20 } else { 0 };
    bytes.extend_from_slice(
        concat!("fmi2DoStep fmi3DoStep standstill_fmu=", env!("CARGO_PKG_VERSION"), ";").as_bytes(),
    );
    bytes
}

fn made_up(header: (u16, bool)) -> Binary {
    Binary::of(headed(header)).expect("taken by its header")
}

/// One library for each kind of machine; FMI 2.0 has no name for Windows on Arm.
#[test]
fn law_an_fmu_has_one_library_for_each_kind_of_machine() {
    let model = unpacked(FIELD, Part::Drive).model;
    let (intel, arm) = (made_up(WINDOWS), made_up(WINDOWS_ARM));
    assert_eq!([intel.machine(), arm.machine()], ["x86_64-windows", "aarch64-windows"]);
    let names = |version, binaries: &[Binary]| {
        let bytes = pack(&model, version, binaries).map_err(|error| error.to_string())?;
        let archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).expect("an archive");
        let names = archive.file_names().map(|name| name.expect("UTF-8").into_owned());
        Ok::<_, String>(names.filter(|name| name.starts_with("binaries/")).collect::<Vec<_>>())
    };
    let both = [intel.clone(), arm.clone()];
    assert_eq!(names(Version::Two, &both).expect("packed"), ["binaries/win64/standstill_drive.dll"]);
    assert_eq!(names(Version::Three, &both).expect("packed").len(), 2);
    let said = names(Version::Two, &[arm]).expect_err("refused");
    assert_eq!(
        said,
        "FMI 2.0 has no name for aarch64-windows; needed: --fmi 3, or another machine's library by --binary"
    );
    let said = names(Version::Two, &[intel.clone(), intel]).expect_err("refused");
    assert_eq!(said, "found two libraries for win64, needed one");
}
