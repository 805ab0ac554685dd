//! The guide: each page has one question, its commands are accepted, and each page stands in the site's contents.

use std::fs;
use std::path::Path;

use super::pages::{ROOT, pages_in};
use super::{folder, standstill};

/// Pages of the guide that answer one question each.
fn guides() -> Vec<(String, String)> {
    let pages = pages_in("docs/guide").into_iter().map(|page| {
        let name = page.file_name().expect("a file").to_string_lossy().into_owned();
        (name, fs::read_to_string(Path::new(ROOT).join(page)).expect("readable"))
    });
    pages.filter(|(name, _)| !["README.md", "faq.md"].contains(&name.as_str())).collect()
}

#[test]
fn law_a_guide_has_a_question_a_command_a_picture_and_what_comes_next() {
    let guides = guides();
    assert!(guides.len() >= 18, "{}", guides.len());
    for (name, page) in guides {
        let title = page.lines().next().expect("a title");
        assert!(title.starts_with("# "), "{name}");
        assert!(title.ends_with('?') || title.starts_with("# My "), "{name}: {title}");
        let places: Vec<usize> = ["\n```", "\n![", "\n## What it means\n", "\n## What next\n"]
            .iter()
            .map(|part| page.find(part).unwrap_or_else(|| panic!("{name} lacks {part:?}")))
            .collect();
        assert!(places.is_sorted(), "{name}: {places:?}");
        // A guide begins with one command, and its picture, where a command makes it, stands beside that command.
        let block = page.split("```").nth(1).expect("a block");
        let commands = block.lines().filter(|line| line.trim_start_matches("$ ").starts_with("standstill "));
        assert_eq!(commands.count(), 1, "{name}: {block}");
        // Two screens: prose of at most 600 words, and a table of what a command prints.
        assert!(page.lines().count() <= 90, "{name}: {} lines", page.lines().count());
        let prose: String = page.split("```").step_by(2).collect();
        assert!(
            prose.split_whitespace().count() <= 600,
            "{name}: {} words",
            prose.split_whitespace().count()
        );
    }
}

/// `scripts/gallery.py` carries the commands out and compares the figures.
#[test]
fn law_a_figure_of_the_gallery_stands_beside_the_command_that_makes_it() {
    let gallery = fs::read_to_string(Path::new(ROOT).join("docs/gallery.md")).expect("the gallery");
    let mut made = Vec::new();
    for part in gallery.split("```sh\n").skip(1) {
        let (commands, after) = part.split_once("```").expect("a block that ends");
        let figure =
            after.split("](gallery/").nth(1).and_then(|link| link.split(')').next()).expect("a figure");
        let first = commands.lines().next().expect("a command");
        let (command, name) = first.split_once(" --out ").unwrap_or_else(|| panic!("{first}: no --out"));
        assert!(figure.starts_with(&format!("{name}-")), "{figure} is not of {first}");
        made.push((figure.to_owned(), command.to_owned()));
    }
    let kept = fs::read_dir(Path::new(ROOT).join("docs/gallery")).expect("figures");
    for file in kept.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()) {
        assert!(made.iter().any(|(figure, _)| *figure == file), "{file} is not on the page");
    }
    let mut of_the_guide = 0;
    for (name, page) in guides() {
        for link in page.split("](../gallery/").skip(1) {
            let link = link.split(')').next().expect("a link");
            let (_, command) =
                made.iter().find(|(figure, _)| figure == link).expect("a figure of the gallery");
            assert!(page.contains(&format!("Made by `{command}`.")), "{name}: {link} is made by {command}");
            of_the_guide += 1;
        }
    }
    assert!(of_the_guide >= 12, "{of_the_guide}");
}

/// The words of a command line, with what stands in quotes as one.
pub fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for letter in line.chars() {
        let last = words.last_mut().expect("a word");
        match (letter, quote) {
            ('"' | '\'', None) => quote = Some(letter),
            (letter, Some(open)) if letter == open => quote = None,
            (' ', None) if last.is_empty() => {}
            (' ', None) => words.push(String::new()),
            ('#', None) if last.is_empty() => break,
            _ => last.push(letter),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn law_each_command_of_the_guide_is_accepted() {
    let folder = folder();
    let mut commands = 0;
    let keys: Vec<String> = standstill_scenario::keys().map(|key| key.path.to_owned()).collect();
    for page in pages_in("docs/guide") {
        let text = fs::read_to_string(Path::new(ROOT).join(&page)).expect("readable");
        let blocks = text.split("```").skip(1).step_by(2).flat_map(str::lines);
        let inline = text.split("```").step_by(2).flat_map(|prose| prose.split('`').skip(1).step_by(2));
        for line in blocks.chain(inline) {
            let Some(line) = line.trim_start_matches("$ ").strip_prefix("standstill ") else { continue };
            if line.contains('…') {
                continue;
            }
            let mut words = words(line);
            for assignment in words.windows(2).filter(|pair| ["-s", "--vary", "--key"].contains(&&*pair[0])) {
                let key = assignment[1].split('=').next().expect("a key");
                let known = keys.iter().any(|of| of == key)
                    || ["motor.", "detector."].iter().any(|of| key.starts_with(of));
                assert!(known, "{}: {line}: no key {key}", page.display());
            }
            // Options and their values are read before `--help` ends the command.
            words.push("--help".to_owned());
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let output = standstill(&words, folder.path());
            assert!(
                output.status.success(),
                "{}: {line}: {}",
                page.display(),
                String::from_utf8_lossy(&output.stderr)
            );
            commands += 1;
        }
    }
    assert!(commands > 50, "{commands}");
}

#[test]
fn law_each_page_stands_in_the_contents_of_the_site() {
    let contents = fs::read_to_string(Path::new(ROOT).join("docs/SUMMARY.md")).expect("the contents");
    for page in ["docs", "docs/guide", "docs/notes"].into_iter().flat_map(pages_in) {
        let name = page.strip_prefix("docs").expect("in docs/").to_string_lossy().replace('\\', "/");
        assert!(name == "SUMMARY.md" || contents.contains(&format!("]({name})")), "{name} is missing");
    }
}
