//! What a run reads, and that it reads nothing else.

use std::path::{Path, PathBuf};

use super::{Document, Plan};

/// Rust files below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let below = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
    paths.flat_map(below).collect()
}

#[test]
fn law_what_a_run_reads_is_read_through_one_door() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut doors = Vec::new();
    for folder in ["src", "../files/src", "../plant/src", "../campaign/src"].map(|folder| own.join(folder)) {
        for path in sources(&folder) {
            let text = std::fs::read_to_string(&path).expect("readable");
            let name = path.strip_prefix(&folder).expect("below").display().to_string();
            // Journals are what a run writes; tests read what they like.
            let reads = ["fs::read(", "read_to_string(", "File::open(", "OpenOptions"];
            if reads.iter().any(|call| text.contains(call)) && !name.contains("tests") {
                doors.push(name);
            }
        }
    }
    doors.sort();
    let known = ["files.rs", "store/journal.rs", "store/notes.rs", "store/survey.rs", "store/tally.rs"];
    assert_eq!(doors, known, "read files through `standstill_files::Files`");
}

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
    // What becomes of the files later changes no trial.
    let before: Vec<_> = (0..3).map(|point| plan.scenario(point).expect("valid")).collect();
    assert_eq!(before[1].motor.name, "surface-magnet");
    std::fs::write(at("a.toml"), sheet("surface-magnet")).expect("written");
    std::fs::remove_file(at("b.toml")).expect("removed");
    let after: Vec<_> = (0..3).map(|point| plan.scenario(point).expect("valid")).collect();
    assert_eq!(before, after);
}
