//! Which source files of the command line use which: no circle is above three files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::pages::ROOT;
use crate::sources::below;

/// A module, by the names of its path below the crate.
type Module = Vec<String>;

/// The paths that each file names. `exported` has the names that a module passes on from others.
#[derive(Default)]
struct Sources {
    named: BTreeMap<Module, Vec<Module>>,
    exported: BTreeMap<(Module, String), Module>,
}

fn segments(path: &str) -> Module {
    path.split("::").map(str::to_owned).collect()
}

/// Lists the paths of a tree such as `a::{b, c::{d, e}}`.
fn listed(tree: &str, paths: &mut Vec<Module>) {
    let Some((before, inner)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default().trim();
        if !path.is_empty() {
            paths.push(segments(path));
        }
        return;
    };
    let inner = inner.trim_end().strip_suffix('}').expect("a closed tree");
    let mut depth = 0;
    let parts = inner.split(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0 && c == ','
    });
    for part in parts.filter(|part| !part.trim().is_empty()) {
        listed(&format!("{}{}", before.trim(), part.trim()), paths);
    }
}

impl Sources {
    /// Reads a file without its comments and its tests, which stand at its end.
    fn read(&mut self, module: Module, text: &str) {
        let lines = text.lines().map(str::trim).filter(|line| !line.starts_with("//"));
        let code: Vec<&str> = lines.take_while(|line| !line.starts_with("#[cfg(test)]")).collect();
        let mut paths = Vec::new();
        for statement in code.join(" ").split(';') {
            // In a statement, attributes or the end of an item may precede the word `use`.
            let begin =
                statement.rfind("use ").filter(|at| *at == 0 || statement[..*at].ends_with([' ', '}']));
            let Some(at) = begin else {
                let words = statement.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
                paths.extend(words.filter(|word| word.contains("::") && !word.ends_with(':')).map(segments));
                continue;
            };
            let mut used = Vec::new();
            listed(statement[at + 4..].trim(), &mut used);
            if statement[..at].trim_end().ends_with("pub") {
                let name = |path: &Module| path.last().cloned().unwrap_or_default();
                self.exported.extend(used.iter().map(|path| ((module.clone(), name(path)), path.clone())));
            }
            paths.extend(used);
        }
        self.named.insert(module, paths);
    }

    /// Returns the module in which the item of a path stands. None outside the crate.
    fn home(&self, from: &Module, path: &[String]) -> Option<Module> {
        let (mut at, mut rest) = match path.first()?.as_str() {
            "crate" => (Module::new(), &path[1..]),
            "self" => (from.clone(), &path[1..]),
            "super" => (from[..from.len().checked_sub(1)?].to_vec(), &path[1..]),
            child => {
                self.named.get(&[&from[..], &[child.to_owned()]].concat())?;
                (from.clone(), path)
            }
        };
        while let Some((next, after)) = rest.split_first() {
            let below = [&at[..], std::slice::from_ref(next)].concat();
            match (next.as_str(), self.named.contains_key(&below)) {
                ("super", _) => drop(at.pop()),
                (_, true) => at = below,
                _ => break,
            }
            rest = after;
        }
        let passed_on = rest.first().and_then(|name| self.exported.get(&(at.clone(), name.clone())));
        passed_on.and_then(|path| self.home(&at, path)).or(Some(at))
    }

    /// Returns the circles: the sets of files of which each uses each other, directly or by way of others.
    fn circles(&self) -> BTreeSet<BTreeSet<&Module>> {
        let uses = |(from, paths): (&Module, &Vec<Module>)| {
            let homes: BTreeSet<Module> = paths.iter().filter_map(|path| self.home(from, path)).collect();
            (from.clone(), homes)
        };
        let uses: BTreeMap<Module, BTreeSet<Module>> = self.named.iter().map(uses).collect();
        let reached = |from: &Module| {
            let (mut reached, mut next) = (BTreeSet::new(), vec![from]);
            while let Some(module) = next.pop() {
                next.extend(
                    uses.get(module).into_iter().flatten().filter(|to| reached.insert((*to).clone())),
                );
            }
            reached
        };
        let reached: BTreeMap<&Module, BTreeSet<Module>> =
            self.named.keys().map(|of| (of, reached(of))).collect();
        let each = |a: &Module, b: &Module| reached[a].contains(b) && reached[b].contains(a);
        self.named.keys().map(|of| self.named.keys().filter(|to| each(of, to)).collect()).collect()
    }
}

#[test]
fn law_no_circle_of_the_command_lines_files_is_above_three() {
    let folder = Path::new(ROOT).join("crates/cli/src");
    let (mut files, mut sources) = (Vec::new(), Sources::default());
    below(&folder, &mut files);
    for path in files {
        let name = path
            .strip_prefix(&folder)
            .expect("below")
            .with_extension("")
            .to_string_lossy()
            .replace('\\', "/");
        let module = if name == "lib" { Module::new() } else { segments(&name.replace('/', "::")) };
        let last = module.last().map(String::as_str).unwrap_or_default();
        if last != "tests" && last != "main" && !name.starts_with("bin/") {
            sources.read(module, &fs::read_to_string(&path).expect("text"));
        }
    }
    assert!(sources.named.len() > 100, "{}", sources.named.len());
    for circle in sources.circles() {
        assert!(circle.len() <= 3, "each of these files uses each other, if by way of others: {circle:?}");
    }
}

#[test]
fn law_a_circle_is_found_through_trees_paths_and_names_that_are_passed_on() {
    let mut sources = Sources::default();
    let files = [
        ("", "mod a; mod b; mod c; mod d;"),
        ("a", "pub mod inner;\npub use self::inner::{One, two as three};"),
        ("a::inner", "use crate::{b::{self, Other}, c};\nstruct One;"),
        ("b", "// use crate::d::x;\nfn f() { crate::c::g() }\n#[cfg(test)]\nmod tests { use crate::d::x; }"),
        ("c", "#[rustfmt::skip] use super::a::One;"),
        ("d", "use crate::a::One;\nuse std::fmt::Write as _;"),
    ];
    for (module, text) in files {
        sources.read(if module.is_empty() { Module::new() } else { segments(module) }, text);
    }
    let circles: Vec<Vec<String>> = sources
        .circles()
        .into_iter()
        .map(|circle| circle.into_iter().map(|module| module.join("::")).collect())
        .filter(|circle: &Vec<String>| !circle.is_empty())
        .collect();
    assert_eq!(circles, [["a::inner", "b", "c"]]);
}
