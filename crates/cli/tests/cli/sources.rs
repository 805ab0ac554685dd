//! Rules for all sources: no file is read past the one door, and `unsafe` stands only where ARCHITECTURE.md allows it.

use std::fs;
use std::path::{Path, PathBuf};

use crate::pages::ROOT;

pub fn below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() && entry.file_name() != "target" {
            below(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

/// Returns whether a line has an `unsafe` block, function or implementation; the type of a C function does not count.
fn is_unsafe(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    ["unsafe {", "unsafe fn", "unsafe impl", "unsafe trait", "#[unsafe("]
        .iter()
        .any(|begin| code.contains(begin))
        || code.contains("unsafe extern")
            && !code.contains("fn(")
            && !code.contains("= unsafe extern")
            && !code.contains(": unsafe extern")
}

/// The places that ARCHITECTURE names, as they begin paths below `crates/`.
fn allowed() -> Vec<String> {
    let text = fs::read_to_string(Path::new(ROOT).join("ARCHITECTURE.md")).expect("there");
    let list = text
        .split("`unsafe` is allowed in ")
        .nth(1)
        .and_then(|rest| rest.split(" alone.").next())
        .expect("the list");
    list.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// promise: unsafe-where-needed
#[test]
fn law_unsafe_stands_where_architecture_says_and_nowhere_else_and_each_place_has_its_reason() {
    let (crates, allowed) = (Path::new(ROOT).join("crates"), allowed());
    assert!(allowed.len() >= 5, "{allowed:?}");
    let mut found = Vec::new();
    for entry in fs::read_dir(&crates).expect("crates").flatten() {
        for folder in ["src", "wasm/src"].map(|name| entry.path().join(name)) {
            if folder.is_dir() {
                below(&folder, &mut found);
            }
        }
    }
    let mut used = vec![false; allowed.len()];
    for path in found {
        let name = path.strip_prefix(&crates).expect("below").to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(&path).expect("text");
        if !text.lines().any(is_unsafe) {
            continue;
        }
        let place = allowed.iter().position(|place| name == *place || name.starts_with(&format!("{place}/")));
        let place = place
            .unwrap_or_else(|| panic!("crates/{name}: `unsafe`, which ARCHITECTURE.md does not allow there"));
        used[place] = true;
    }
    for (place, used) in allowed.iter().zip(used) {
        assert!(used, "ARCHITECTURE.md allows `unsafe` in {place}, which has none");
        // Clippy refuses a block without its reason.
        let mut manifest = crates.join(place.split("/src").next().expect("a crate"));
        manifest.push("Cargo.toml");
        let lints = fs::read_to_string(&manifest).expect("a manifest");
        assert!(lints.contains("undocumented_unsafe_blocks = "), "{}: needed the lint", manifest.display());
    }
}

/// promise: detector-sees-no-plant
#[test]
fn law_what_detects_is_built_without_what_it_detects() {
    let manifest = |name: &str| {
        let text =
            fs::read_to_string(Path::new(ROOT).join(format!("crates/{name}/Cargo.toml"))).expect("there");
        text.parse::<toml::Table>().expect("TOML")
    };
    let own = |name: &str| -> Vec<String> {
        let table = manifest(name);
        let all = table.get("dependencies").and_then(|of| of.as_table()).into_iter().flat_map(|of| of.keys());
        all.filter(|name| name.starts_with("standstill")).cloned().collect()
    };
    assert_eq!(own("detect"), ["standstill-interface"]);
    assert!(own("interface").is_empty());
    for name in ["numeric", "plant", "inverter", "sim"] {
        assert!(!own(name).contains(&"standstill-detect".to_owned()), "{name} knows no method");
    }
    // A reading says what sensors read: no angle and no flux.
    let reading = fs::read_to_string(Path::new(ROOT).join("crates/interface/src/reading.rs")).expect("there");
    let fields = reading
        .split("pub struct Reading<T> {")
        .nth(1)
        .and_then(|rest| rest.split("\n}").next())
        .expect("the type");
    for word in ["angle", "theta", "flux", "position"] {
        assert!(!fields.lines().any(|line| line.trim().starts_with("pub ") && line.contains(word)), "{word}");
    }
}

/// The folders below `crates/` or the root in which the tests of a documented command stand.
fn places(package: Option<&str>, target: Option<&str>, is_unit: bool) -> Vec<PathBuf> {
    let root = Path::new(ROOT);
    let base = match package {
        None => root.to_owned(),
        Some("standstill") => root.join("crates/cli"),
        Some("standstill-fuzz") => root.join("tests/fuzz"),
        Some(name) => {
            root.join("crates").join(name.strip_prefix("standstill-").expect("a crate of this workspace"))
        }
    };
    match target {
        Some(target) => {
            vec![base.join("tests").join(target), base.join("tests").join(format!("{target}.rs"))]
        }
        None if is_unit => vec![base.join("src")],
        None => vec![base.join("src"), base.join("tests"), base.join("crates")],
    }
}

/// `cargo test` ends with 0 where no test has the name that it is given.
#[test]
fn law_each_documented_command_of_tests_names_a_test_that_exists() {
    let root = Path::new(ROOT);
    let (mut commands, mut wrong) = (0, Vec::new());
    for page in ["docs", "docs/guide", "docs/notes"].into_iter().flat_map(crate::pages::pages_in) {
        let text = fs::read_to_string(root.join(&page)).expect("readable");
        for command in text.split("cargo test ").skip(1) {
            let command = command.split(['`', '\n', '(', ';', '&', '|', '#']).next().unwrap_or_default();
            let (mut package, mut target, mut filters, mut is_unit) = (None, None, Vec::new(), false);
            let mut words = command.split_whitespace();
            while let Some(word) = words.next() {
                match word {
                    "-p" => package = words.next(),
                    "--test" => target = words.next(),
                    "--features" | "--config" => drop(words.next()),
                    "--lib" => is_unit = true,
                    word if word.starts_with('-') => {}
                    // NAME stands for any.
                    filter if filter.chars().any(char::is_lowercase) => filters.push(filter),
                    _ => {}
                }
            }
            let mut files = Vec::new();
            for place in places(package, target, is_unit) {
                if place.is_dir() {
                    below(&place, &mut files);
                } else if place.exists() {
                    files.push(place);
                }
            }
            if files.is_empty() {
                wrong.push(format!("{}: cargo test {command}: no such tests", page.display()));
            }
            for filter in &filters {
                let names = |file: &PathBuf| {
                    let below = file.strip_prefix(root).expect("of this project").with_extension("");
                    // The folders down to `src` or `tests` are no part of a test's name.
                    let parts = below.iter().map(|part| part.to_string_lossy());
                    let parts = parts.skip_while(|part| !["src", "tests"].contains(&&**part)).skip(1);
                    let module = parts.collect::<Vec<_>>().join("::");
                    let text = fs::read_to_string(file).expect("text");
                    let mut tests = text.split("#[test]").skip(1).filter_map(|rest| rest.split("fn ").nth(1));
                    // The file is a module of the test's path.
                    tests.any(|name| {
                        format!("{module}::{}", name.split('(').next().unwrap_or_default()).contains(filter)
                    })
                };
                assert!(
                    files.iter().any(names),
                    "{}: cargo test {command}: no test has {filter}",
                    page.display()
                );
            }
            commands += 1;
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(commands > 50, "{commands}");
}
