//! The page's modules: what one uses of another it imports.

use std::collections::BTreeMap;

/// The names in `{ … }` behind a word.
fn braced<'a>(line: &'a str, word: &str) -> Vec<&'a str> {
    let inside = line.strip_prefix(word).and_then(|rest| rest.trim().strip_prefix('{')?.split('}').next());
    inside
        .into_iter()
        .flat_map(|names| names.split(','))
        .map(|name| name.rsplit(" as ").next().unwrap_or(name).trim())
        .collect()
}

/// The name that a line exports.
fn exported(line: &str) -> Option<&str> {
    let rest = line.strip_prefix("export ")?;
    let rest = rest.strip_prefix("async ").unwrap_or(rest);
    let rest = ["function ", "const ", "class "].iter().find_map(|kind| rest.strip_prefix(kind))?;
    rest.split(|c: char| !c.is_alphanumeric()).next()
}

/// Whether a text calls this name, as a function or behind `new`, and not as a method of something.
fn calls(text: &str, name: &str) -> bool {
    text.match_indices(&format!("{name}(")).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        before.is_none_or(|c| !c.is_alphanumeric() && !"._#$".contains(c))
    })
}

#[test]
fn law_each_module_of_the_page_imports_what_it_uses_of_the_others() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/page");
    let files = std::fs::read_dir(folder).expect("the page").map(|entry| entry.expect("an entry").path());
    let modules: BTreeMap<String, String> = files
        .filter(|path| path.extension().is_some_and(|extension| extension == "mjs"))
        .map(|path| {
            (
                path.file_name().expect("a file has a name").to_string_lossy().into_owned(),
                std::fs::read_to_string(&path).expect("a module is text"),
            )
        })
        .collect();
    let all: Vec<(&String, &str)> = modules
        .iter()
        .flat_map(|(file, text)| text.lines().filter_map(exported).map(move |name| (file, name)))
        .collect();
    assert!(all.len() > 20, "{all:?}");
    for (file, text) in &modules {
        let code: String = text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .fold(String::new(), |code, line| code + line + "\n");
        let imported: Vec<&str> = text.lines().flat_map(|line| braced(line, "import ")).collect();
        for (other, name) in all.iter().filter(|(other, _)| *other != file) {
            // Bound by the module itself: its own function, a constant, a parameter, a field.
            let own = [
                "function @(",
                "const @ ",
                " @ =>",
                "#@(",
                "\n  @(",
                "async @(",
                "{ @ ",
                "{ @,",
                ", @ }",
                ", @)",
                "(@)",
            ];
            let used = calls(&code, name) && !own.iter().any(|own| code.contains(&own.replace('@', name)));
            assert!(
                !used || imported.contains(name),
                "{file} calls {name} of {other} and does not import it"
            );
        }
    }
}
