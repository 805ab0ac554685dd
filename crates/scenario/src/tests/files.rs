//! The files that a run reads, and no others.

use std::path::{Path, PathBuf};

use super::{Document, Plan};

/// Rust files below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let below = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    paths.flat_map(below).filter(|path| path.extension().is_some_and(|ending| ending == "rs")).collect()
}

/// promise: one-door
#[test]
fn law_what_a_run_reads_is_read_through_one_door() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut doors = Vec::new();
    for entry in std::fs::read_dir(&crates).expect("crates") {
        let entry = entry.expect("an entry");
        let (name, folder) = (entry.file_name().to_string_lossy().into_owned(), entry.path().join("src"));
        for path in sources(&folder) {
            let text = std::fs::read_to_string(&path).expect("readable");
            // Tests, at the end of a file, may read any file.
            let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            let below = path.strip_prefix(&folder).expect("below").display().to_string();
            let reads = [
                "fs::read(",
                "read_to_string(",
                "File::open",
                "File::options",
                "OpenOptions",
                "fs::copy(",
                "from_path(",
            ];
            // Imported functions of `std::fs` would hide their calls from this search.
            let hidden = text.lines().any(|line| {
                let line = line.trim_start();
                line.starts_with("use std::fs::")
                    && [" read,", "{read,", "::read;", "::*", "::copy"].iter().any(|name| line.contains(name))
            });
            if (hidden || reads.iter().any(|call| text.contains(call))) && !below.contains("tests") {
                doors.push(format!("{name}/{below}"));
            }
        }
    }
    doors.sort();
    let known = [
        // Journals and their notes: a run writes them, locks them and resumes from them.
        "campaign/store/journal.rs",
        "campaign/store/notes.rs",
        "campaign/store/tally.rs",
        // The scenario file of an earlier `check`, which is overwritten only by the same text.
        "cli/commands/check/file.rs",
        // The folder of the output, opened to synchronise it with the disk or to lock it.
        "cli/shell/output.rs",
        "files/files.rs",
        // The loader's settings, and compilers' runtimes of the system. Parts of a detector's library are read through
        // `Files`.
        "foreign/parts.rs",
        // A library that the library under test has opened itself, to name it in an error.
        "foreign/runtime.rs",
        // Tables are read row by row, from files only and not from pipes; the crate does not depend on
        // `standstill_files`.
        "table/read.rs",
    ];
    assert_eq!(doors, known, "read files through `standstill_files`");
}

/// promise: files-change-nothing-later
#[test]
fn law_a_plan_names_all_files_before_its_first_trial_and_reads_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let sheet = |name: &str| standstill_plant::DataSheet::built_in_text(name).expect("built in");
    std::fs::write(at("a.toml"), sheet("paper-5k5")).expect("written");
    std::fs::write(at("b.toml"), sheet("surface-magnet")).expect("written");
    let text = "[axes]\nmotor = [\"a.toml\", \"b.toml\", \"low-inertia\"]";
    let plan = Plan::new(Document::parse(&at("s.toml"), text).expect("TOML")).expect("valid");
    assert_eq!(plan.files().into_keys().collect::<Vec<_>>(), ["a.toml", "b.toml"]);
    // Later changes of the files change no trial.
    let before: Vec<_> = (0..3).map(|point| plan.scenario(point).expect("valid")).collect();
    assert_eq!(before[1].motor.name, "surface-magnet");
    std::fs::write(at("a.toml"), sheet("surface-magnet")).expect("written");
    std::fs::remove_file(at("b.toml")).expect("removed");
    let after: Vec<_> = (0..3).map(|point| plan.scenario(point).expect("valid")).collect();
    assert_eq!(before, after);
}
