//! Tests name the manual's promises. This module makes `docs/promises.md` of the promises and these tests.
//!
//! A promise stands in a page, in the readme, in ARCHITECTURE or in rustdoc: a sentence, and behind it the comment `promise: NAME` in the form of
//! HTML, with several names where it promises several things. A test names what it holds in a line of its own above `#[test]`: `/// promise: NAME`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::pages::ROOT;

const PAGE: &str = "docs/promises.md";
/// Begins the comment behind a promise.
const MARK: &str = "<!-- promise: ";

/// Files below these folders with one of these endings, by their paths from the root, in order.
fn files(folders: &[&str], endings: &[&str]) -> Vec<(String, String)> {
    fn below(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            if path.is_dir() && name != "target" && name != "node_modules" {
                below(&path, found);
            } else if path.is_file() {
                found.push(path);
            }
        }
    }
    let root = Path::new(ROOT);
    let mut found = Vec::new();
    for folder in folders {
        if root.join(folder).is_file() {
            found.push(root.join(folder));
        } else {
            below(&root.join(folder), &mut found);
        }
    }
    found.sort();
    let relative = |path: &Path| path.strip_prefix(root).expect("below").to_string_lossy().replace('\\', "/");
    found
        .iter()
        .filter(|path| path.extension().is_some_and(|of| endings.iter().any(|ending| of == *ending)))
        .map(|path| (relative(path), fs::read_to_string(path).expect("text")))
        .collect()
}

/// Names behind a mark, separated by commas.
fn named(list: &str) -> impl Iterator<Item = &str> {
    list.split(',').map(str::trim)
}

fn is_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

/// The sentence that ends where `text` does: since the full stop, the cell, the item or the paragraph before.
fn sentence(text: &str) -> String {
    let lines = text.lines().rev().take_while(|line| !line.trim().is_empty());
    let mut lines: Vec<&str> = lines.map(|line| line.trim_start_matches(['/', '!', ' '])).collect();
    if let Some(item) = lines.iter().position(|line| line.starts_with(['*', '-', '|', '#'])) {
        lines.truncate(item + 1);
    }
    lines.reverse();
    let whole = lines.join(" ").split_whitespace().collect::<Vec<_>>().join(" ");
    // A sentence that ended at an earlier promise does not belong to this one.
    let whole = whole.rsplit("-->").next().unwrap_or_default().trim();
    let whole = whole.trim_end_matches('.');
    let begin = [". ", "? ", ".) ", "| "]
        .iter()
        .filter_map(|end| whole.rfind(end).map(|at| at + end.len()))
        .max()
        .unwrap_or(0);
    whole[begin..]
        .trim_start_matches(['*', '-', ' '])
        .replace("**", "")
        .trim_end_matches([' ', ':', ';'])
        .to_owned()
}

/// Promises by their names: the page, and the sentence.
fn promises() -> BTreeMap<String, (String, String)> {
    let mut all = BTreeMap::new();
    let mut texts = files(&["README.md", "ARCHITECTURE.md", "docs"], &["md"]);
    texts.retain(|(path, _)| path != PAGE);
    let sources = files(&["crates"], &["rs"]).into_iter();
    texts.extend(sources.filter(|(path, _)| !path.contains("/tests/") && !path.ends_with("/tests.rs")));
    for (path, text) in texts {
        for (at, _) in text.match_indices(MARK) {
            let list = text[at + MARK.len()..].split("-->").next().expect("a piece");
            for name in named(list) {
                assert!(
                    is_name(name),
                    "{path}: found the promise `{name}`, needed small letters and hyphens"
                );
                let there = all.insert(name.to_owned(), (path.clone(), sentence(&text[..at])));
                assert!(
                    there.is_none(),
                    "{path}: the promise `{name}` stands in {} too",
                    there.expect("there").0
                );
            }
        }
    }
    all
}

/// Tests by the promises that they hold: the file, the test, and whether it runs only where it is asked for.
fn tests() -> BTreeMap<String, Vec<(String, String, bool)>> {
    let mut all: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for (path, text) in files(&["crates", "tests"], &["rs"]) {
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        for (k, line) in lines.iter().enumerate() {
            let Some(list) = line.strip_prefix("/// promise: ") else { continue };
            let attributes =
                lines[k + 1..].iter().take_while(|line| line.starts_with("#[") || line.starts_with("//"));
            let attributes: Vec<&&str> = attributes.collect();
            assert!(
                attributes.iter().any(|line| **line == "#[test]"),
                "{path}, line {}: behind it is no test",
                k + 1
            );
            let test =
                lines[k + 1 + attributes.len()].strip_prefix("fn ").and_then(|rest| rest.split('(').next());
            let test = test.unwrap_or_else(|| panic!("{path}, line {}: needed a function", k + 1));
            let asked = attributes.iter().any(|line| line.starts_with("#[ignore"));
            for name in named(list) {
                all.entry(name.to_owned()).or_default().push((path.clone(), test.to_owned(), asked));
            }
        }
    }
    all
}

/// With `STANDSTILL_WRITE=1` it writes the page.
#[test]
fn golden_each_promise_has_a_test_and_each_test_its_promise() {
    let (promises, tests) = (promises(), tests());
    for (name, (path, sentence)) in &promises {
        assert!(sentence.len() > 20, "{path}: the promise `{name}` says \"{sentence}\"");
        let held = tests.get(name).is_some_and(|tests| tests.iter().any(|(_, _, asked)| !asked));
        assert!(held, "{path}: no test that always runs names the promise `{name}`: \"{sentence}\"");
    }
    for (name, tests) in &tests {
        let (path, test, _) = &tests[0];
        assert!(
            promises.contains_key(name),
            "{path}: {test} names the promise `{name}`, which no page makes"
        );
    }
    let mut page = format!(
        "# Promises\n\nThe manual makes {} promises, and {} tests hold them; a test may hold a part of its sentence. `cargo test --workspace NAME` runs one. The suite fails where a \
         promise has no test, and where a test names a promise that no page makes. `STANDSTILL_WRITE=1 cargo test -p standstill --test cli promise` writes this page. \
         [Validation](validation.md) says how close each comparison is.\n\n| promise | held by |\n|---|---|\n",
        promises.len(),
        tests.values().map(Vec::len).sum::<usize>(),
    );
    for (name, (path, sentence)) in &promises {
        let link = path.strip_prefix("docs/").map_or_else(|| format!("../{path}"), str::to_owned);
        // Links of the sentence lead from its own page.
        let plain: String = sentence
            .split('[')
            .map(|part| {
                part.split_once("](").map_or_else(
                    || part.to_owned(),
                    |(text, rest)| text.to_owned() + rest.split_once(')').map_or("", |(_, rest)| rest),
                )
            })
            .collect();
        let mut held = Vec::new();
        for (file, test, asked) in &tests[name] {
            let place = file.strip_prefix("crates/").unwrap_or(file);
            let place = place.split('/').next().expect("a part");
            held.push(format!(
                "`{test}` ({place}{})",
                if *asked { ", `scripts/test-all.sh long`" } else { "" }
            ));
        }
        let _ = writeln!(
            page,
            "| **{name}**: {plain} ([{}]({link})) | {} |",
            path.rsplit('/').next().expect("a name"),
            held.join(", ")
        );
    }
    let path = Path::new(ROOT).join(PAGE);
    if std::env::var_os("STANDSTILL_WRITE").is_some() {
        fs::write(path, page).expect("writable");
        return;
    }
    assert_eq!(fs::read_to_string(path).expect("the page"), page, "{PAGE}");
}

#[test]
fn analytic_a_sentence_ends_where_its_mark_stands() {
    let of = |text: &str| sentence(text);
    assert_eq!(of("One thing. The same seed\ngives the same bytes."), "The same seed gives the same bytes");
    assert_eq!(of("Before.\n\n* **Files** have\n  one door."), "Files have one door");
    assert_eq!(of("| `i_a_A` | currents; they sum to zero"), "currents; they sum to zero");
    assert_eq!(of("a first. <!-- promise: x --> And a second."), "And a second");
    assert_eq!(of("/// A first.\n/// Files are read\n/// once."), "Files are read once");
}
