//! What a release consists of: names of archives in recipes, workflow and `cargo binstall` are those of `scripts/release.sh`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::folder;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn release(arguments: &[&str]) -> (bool, String) {
    let output =
        Command::new("bash").arg(root().join("scripts/release.sh")).args(arguments).output().expect("bash");
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    (output.status.success(), said)
}

fn names() -> BTreeSet<String> {
    let (done, said) = release(&["--names"]);
    assert!(done, "{said}");
    said.lines().map(str::to_owned).collect()
}

/// The targets by the names of their archives.
fn targets() -> BTreeSet<String> {
    let start = format!("standstill-{}-", env!("CARGO_PKG_VERSION"));
    let target = |name: &String| {
        let rest = name.strip_prefix(&start).unwrap_or_else(|| panic!("{name} begins with {start}"));
        rest.trim_end_matches(".tar.gz").trim_end_matches(".zip").to_owned()
    };
    names().iter().map(target).collect()
}

/// The address that `cargo binstall` makes for a target is an archive of the release.
#[test]
fn law_binstall_finds_an_archive_for_each_target() {
    let text = fs::read_to_string(root().join("crates/cli/Cargo.toml")).expect("there");
    let manifest: toml::Table = text.parse().expect("TOML");
    let of = |table: &toml::Table, key: &str| table.get(key).and_then(toml::Value::as_str).map(str::to_owned);
    let table = |path: &[&str]| {
        let mut at = &manifest;
        for key in path {
            at = at.get(*key)?.as_table()?;
        }
        Some(at)
    };
    let all = table(&["package", "metadata", "binstall"]).expect("the metadata");
    let mut found = BTreeSet::new();
    for target in targets().iter().map(String::as_str).chain(["x86_64-pc-windows-msvc"]) {
        let own = table(&["package", "metadata", "binstall", "overrides", target]);
        let value = |key| own.and_then(|own| of(own, key)).or_else(|| of(all, key)).expect("one");
        let filled = |text: String| {
            text.replace("{ version }", env!("CARGO_PKG_VERSION"))
                .replace("{ target }", target)
                .replace("{ bin }", "standstill")
        };
        let (url, folder) = (filled(value("pkg-url")), filled(value("bin-dir")));
        let name = url.rsplit('/').next().expect("a name").to_owned();
        assert!(names().contains(&name), "{target}: {name}");
        let ending = if value("pkg-fmt") == "zip" { "zip" } else { "gz" };
        assert_eq!(Path::new(&name).extension().and_then(std::ffi::OsStr::to_str), Some(ending), "{target}");
        let inside = name.trim_end_matches(".tar.gz").trim_end_matches(".zip");
        assert_eq!(folder, format!("{inside}/standstill{{ binary-ext }}"));
        found.insert(name);
    }
    assert_eq!(found, names(), "each archive is that of a target");
}

/// Recipes name archives by their targets, and `--finish` fills in what they are.
#[test]
fn law_recipes_have_the_names_and_checksums_of_the_archives_and_a_wrong_one_is_noticed() {
    let folder = folder();
    let path = folder.path();
    let out = path.to_str().expect("UTF-8");
    for (place, name) in names().iter().enumerate() {
        fs::write(path.join(name), format!("content of {place}")).expect("written");
    }
    let (done, said) = release(&[out, "--finish"]);
    assert!(
        done && said.contains("versions, names and checksums") && !said.contains("not complete"),
        "{said}"
    );
    let sums = fs::read_to_string(path.join("SHA256SUMS")).expect("there");
    assert_eq!(sums.lines().count(), names().len());
    let mut used = BTreeSet::new();
    for recipe in ["Containerfile", "homebrew/standstill.rb", "winget/Standstill.Standstill.installer.yaml"] {
        let text = fs::read_to_string(path.join("recipes").join(recipe)).expect("there");
        assert!(
            text.contains(env!("CARGO_PKG_VERSION"))
                && !text.contains("@SHA256")
                && !text.contains("@ARCHIVE"),
            "{text}"
        );
        for line in sums.lines() {
            let (sum, name) = line.split_once("  ").expect("two");
            assert_eq!(text.contains(sum), text.contains(name), "{recipe}: {name}");
            if text.contains(sum) {
                used.insert(name.to_owned());
            }
        }
    }
    assert!(used.len() >= 5, "{used:?}");
    // A checksum that is another archive's, and an archive that was built again.
    let recipe = path.join("recipes/homebrew/standstill.rb");
    let text = fs::read_to_string(&recipe).expect("there");
    let [first, second] =
        [0, 1].map(|line| sums.lines().nth(line).expect("one").split_once("  ").expect("two").0);
    let wrong = if text.contains(first) { text.replace(first, second) } else { text.replace(second, first) };
    assert_ne!(wrong, text);
    fs::write(&recipe, wrong).expect("written");
    let (done, said) = release(&[out, "--check"]);
    assert!(!done && said.contains("standstill.rb: found"), "{said}");
    fs::write(&recipe, text).expect("written");
    assert!(release(&[out, "--check"]).0);
    fs::write(path.join(names().first().expect("one")), "other").expect("written");
    let (done, said) = release(&[out, "--check"]);
    assert!(!done && said.contains("a checksum of SHA256SUMS is not its file's"), "{said}");
}

/// What the workflow and the manual name is what there is.
#[test]
fn law_the_workflow_uses_what_the_script_has() {
    let read =
        |name: &str| fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let script = read("scripts/release.sh");
    for name in ["ci", "release", "site"] {
        let text = read(&format!(".github/workflows/{name}.yml"));
        for word in text
            .split_whitespace()
            .filter(|word| word.starts_with("scripts/") || word.starts_with("packaging/"))
        {
            let word = word.trim_matches(|c: char| !c.is_ascii_alphanumeric());
            assert!(word.contains('*') || root().join(word).exists(), "{name}.yml: {word}");
        }
        for (place, _) in text.match_indices("scripts/release.sh ") {
            let line = text[place..].lines().next().expect("one");
            for option in line.split_whitespace().filter(|word| word.starts_with("--")) {
                let option = option.trim_end_matches('"');
                assert!(script.contains(option), "{name}.yml: {option}");
            }
        }
    }
}

/// Releases stand by their numbers and not by their letters; what is no release is the latest only where there is none.
#[test]
fn law_the_site_knows_its_versions_and_which_is_the_latest() {
    let folder = folder();
    let path = folder.path().join("site");
    let site = |arguments: &[&str]| {
        let script = root().join("scripts/site.sh");
        let output = Command::new("bash").arg(script).arg(&path).args(arguments).output().expect("bash");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_ne!(site(&["--versions"]).0, Some(0), "a site without a version");
    for (added, all) in [
        ("main", vec!["main"]),
        ("0.9.0", vec!["0.9.0", "main"]),
        ("0.10.0", vec!["0.10.0", "0.9.0", "main"]),
        ("0.2.11", vec!["0.10.0", "0.9.0", "0.2.11", "main"]),
    ] {
        fs::create_dir(path.join(added)).expect("made");
        fs::write(path.join(added).join("index.html"), added).expect("written");
        assert_eq!(site(&["--versions"]), (Some(0), String::new()));
        let list = fs::read_to_string(path.join("versions.json")).expect("there");
        let list: serde_json::Value = serde_json::from_str(&list).expect("JSON");
        assert_eq!(list, serde_json::json!({ "latest": all[0], "versions": all }));
        assert_eq!(fs::read_to_string(path.join("latest/index.html")).expect("there"), all[0]);
        assert!(fs::read_to_string(path.join("index.html")).expect("there").contains("latest/"));
    }
    for wrong in [&["--version", "latest"][..], &["--version", "../x"], &["--version"], &["--rustdoc"]] {
        assert_eq!(site(wrong).0, Some(2), "{wrong:?}");
    }
    fs::remove_file(path.join(".standstill-site")).expect("there");
    let (code, said) = site(&["--versions"]);
    assert!(code == Some(2) && said.contains("not a site of before"), "{said}");
}
