//! What a library keeps from one trial to the next: nothing, whatever it is.

use std::path::Path;
use std::process::Command;

use crate::libraries::{angles, asking};
use crate::{built, plan, records};
use standstill_scenario::Note;
use tempfile::TempDir;

const IN_C: [&str; 15] = [
    "global",
    "local",
    "heap-at-load",
    "heap-at-call",
    "grown",
    "table",
    "rounding",
    "exceptions",
    "numbers",
    "token",
    "errno",
    "locale",
    "at-exit",
    "printed",
    "lines",
];

const IN_CPP: [&str; 7] = ["vector", "string", "map", "static", "template", "caught", "stream"];

fn source(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign").join(name)
}

/// A folder with the library of `states.cpp`.
fn in_cpp() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = Command::new("c++")
        .args(["-O1", "-shared", "-fPIC", "-I"])
        .arg(root.join("../foreign/include"))
        .arg("-o")
        .args([folder.path().join("mine.so"), source("states.cpp")])
        .output()
        .expect("a C++ compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
}

/// Each kind of state is in each of some trials, in lanes, what it is in the first. What is said of the library.
fn is_set_back(folder: &TempDir, kinds: &[&str]) -> Option<String> {
    let mut note = None;
    for kind in kinds {
        let plan = plan(folder, &asking(kind)).expect("valid");
        for angle in angles(&records(&plan, 0..24)) {
            assert!((angle - 0.1).abs() < 1e-6, "{kind}: {angle}");
        }
        note = plan.note(Note::Libraries);
    }
    note
}

/// promise: libraries-set-back
#[test]
fn law_all_state_of_a_library_is_set_back() {
    let (folder, _) = built(&source("states.c"), &[]);
    assert_eq!(is_set_back(&folder, &IN_C), None);
    // Pages that the loader makes read-only hold the addresses of functions; the compiler checks what is printed.
    let (folder, _) = built(&source("states.c"), &["-Wl,-z,relro,-z,now", "-D_FORTIFY_SOURCE=2"]);
    is_set_back(&folder, &["heap-at-load", "grown", "printed", "lines"]);
    // A library that says it is reentrant keeps its variables; random numbers are still those of the trial.
    let (folder, _) = built(&source("states.c"), &["-DFLAGS=STS_REENTRANT"]);
    assert_eq!(is_set_back(&folder, &["numbers", "errno", "rounding"]), None);
    // The program rounds as before, whatever a library has set.
    assert_eq!((std::hint::black_box(1.0_f64) / std::hint::black_box(3.0)).to_bits(), 0x3FD5_5555_5555_5555);
}

#[test]
fn law_all_state_of_a_library_in_cpp_is_set_back() {
    assert_eq!(is_set_back(&in_cpp(), &IN_CPP), None);
}

#[test]
fn law_a_file_that_stays_open_is_said() {
    let (folder, _) = built(&source("states.c"), &["-DOPENS"]);
    let note = plan(&folder, &asking("file")).expect("valid").note(Note::Libraries).expect("said");
    assert!(note.contains("it opens files (fopen)") && note.contains("not set back"), "{note}");
}

#[test]
fn regress_a_library_that_is_loaded_takes_back_what_the_image_gave_it() {
    let other = tempfile::tempdir().expect("a folder");
    let source_of_other = other.path().join("other.c");
    let text = "#include <stdlib.h>\nvoid take(void *block);\nvoid *lengthen(void *block, size_t size);\n\
                void take(void *block) { free(block); }\n\
                void *lengthen(void *block, size_t size) { return realloc(block, size); }\n";
    std::fs::write(&source_of_other, text).expect("written");
    let (_kept, library) = built(&source_of_other, &[]);
    let (folder, _) = built(&source("states.c"), &[&format!("-DLOADS=\"{}\"", library.display()), "-ldl"]);
    let note = is_set_back(&folder, &["given"]).expect("said");
    assert!(note.contains("it loads "), "{note}");
}
