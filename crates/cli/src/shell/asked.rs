//! The question that the results in a folder answer. Results of another question are replaced only on request.
//!
//! The JSON of runs and of the answers of `odds`, `budget`, `require` and `tune` contains the identity of their
//! question. The files of other commands are tables and figures without a place for it; a note beside them contains it.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use standstill_campaign::NUMERICS;
use standstill_files::read_text;
use standstill_plant::Digest;

use crate::error::Error;
use crate::shell::output::{replace, turn};

/// File name of the note; the leading dot hides it from lists of results.
pub const NOTE: &str = ".standstill-asked.json";

/// The question of a command that is stored in a note.
#[derive(Clone, Debug)]
pub struct NotedQuestion {
    command: &'static str,
    question: Note,
    force: bool,
}

/// The stored form of a question. It contains a text and a digest of everything on which the results depend.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Note {
    said: String,
    digest: String,
    /// Files that answer the question, each with its digest. The digest is written as `NEW` or, until the new file has replaced an old one,
    /// as `NEW; OLD`. Another command may have replaced a file later.
    files: BTreeMap<String, String>,
}

impl NotedQuestion {
    /// Makes the question of a command about `of`. `said` is the question as text for people. If `force` is true, results of another
    /// question are replaced.
    pub fn new(command: &'static str, said: String, of: &dyn Debug, force: bool) -> Self {
        let all = format!("{} {NUMERICS} {said} {of:?}", env!("CARGO_PKG_VERSION"));
        Self { command, question: Note { said, digest: digest(&all), files: BTreeMap::new() }, force }
    }

    /// Makes the question of a command about a folder or file. Only the text identifies the question, so it stays the same if the content
    /// of the folder or file changes.
    pub fn place(command: &'static str, said: String, force: bool) -> Self {
        let question = Note { digest: digest(&said), said, files: BTreeMap::new() };
        Self { command, question, force }
    }

    /// Refuses to replace files of these names in a folder unless they answer this question, or replacement is
    /// requested.
    ///
    /// # Errors
    /// A file answers another question.
    pub fn guard(&self, folder: &Path, names: &[&str]) -> Result<(), Error> {
        let there: Vec<&str> = names.iter().copied().filter(|name| folder.join(name).is_file()).collect();
        let Some(mut first) = there.first().copied().filter(|_| !self.force) else { return Ok(()) };
        let difference = match kept(folder).remove(self.command) {
            Some(question) if question.digest == self.question.digest => {
                let own = |name: &&str| {
                    let content = content(&folder.join(name));
                    question.files.get(*name).zip(content).is_some_and(|(of, content)| has(of, &content))
                };
                let Some(other) = there.iter().find(|name| !own(name)) else { return Ok(()) };
                first = other;
                "it was written by something else since".to_owned()
            }
            Some(question) if question.said == self.question.said => {
                format!("of {} too, but with other settings, files or another program", question.said)
            }
            Some(question) => format!("of {} there and of {} here", question.said, self.question.said),
            None => format!("nothing says that they are of `standstill {}`", self.command),
        };
        Err(Error::another("run", folder.join(first), &difference))
    }

    /// Returns the new content of the folder's note ([`NOTE`]). It is the present content, with this question and the digests of the named
    /// files added. `staged` returns the path of a file before it is moved to the folder.
    ///
    /// # Errors
    /// A file cannot be read. The error contains the file's name.
    pub fn note(
        &self,
        folder: &Path,
        names: &[String],
        staged: impl Fn(&str) -> PathBuf,
    ) -> Result<Vec<u8>, (String, std::io::Error)> {
        let mut all = kept(folder);
        let mut question = self.question.clone();
        // The same question may have written files of another format there.
        if let Some(same) = all.remove(self.command).filter(|same| same.digest == question.digest) {
            question.files = same.files;
        }
        for name in names {
            let new = match Digest::of_file(&staged(name)) {
                Ok(digest) => digest.to_string(),
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
                Err(error) => return Err((name.clone(), error)),
            };
            let present = content(&folder.join(name));
            let own = |present: &String| question.files.get(name).is_some_and(|of| has(of, present));
            question.files.insert(name.clone(), newest(new, present.filter(own)));
        }
        all.insert(self.command.to_owned(), question);
        // The note consists of strings: writing it as JSON cannot fail.
        Ok(serde_json::to_vec_pretty(&all).unwrap_or_default())
    }
}

/// Returns size and checksum of a file as text.
fn content(path: &Path) -> Option<String> {
    Some(Digest::of_file(path).ok()?.to_string())
}

/// Returns the questions in a folder's note, by command. Returns an empty map if there is no note.
fn kept(folder: &Path) -> BTreeMap<String, Note> {
    let text = read_text(&folder.join(NOTE)).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// Returns size and checksum of a text.
pub fn digest(text: &str) -> String {
    Digest::of(text.as_bytes()).to_string()
}

/// Replaces the content of a file. If the old content still was as its command wrote it, also updates the file's digest in the note.
///
/// # Errors
/// The note cannot be written.
pub fn rewrite(folder: &Path, name: &str, content: &[u8]) -> Result<(), Error> {
    let _turn = turn(folder);
    let (path, mut all) = (folder.join(name), kept(folder));
    let before = self::content(&path);
    let known = all.values_mut().filter_map(|question| question.files.get_mut(name));
    let mut changed = false;
    for digests in known.filter(|digests| before.as_ref().is_some_and(|before| has(digests, before))) {
        *digests = newest(Digest::of(content).to_string(), before.clone());
        changed = true;
    }
    // The note goes first, with both digests: if the process is killed before the second step, the old file still
    // matches.
    if changed {
        replace(&folder.join(NOTE), &serde_json::to_vec_pretty(&all).unwrap_or_default())?;
    }
    replace(&path, content)
}

/// Returns the text with a file's digests: the digest of the new content and, until the file is replaced, the digest of the present
/// content.
fn newest(new: String, present: Option<String>) -> String {
    match present.filter(|present| *present != new) {
        Some(present) => format!("{new}{OR}{present}"),
        None => new,
    }
}

/// Separates two digests of one file.
const OR: &str = "; ";

/// Returns true if a text of digests contains this digest.
fn has(digests: &str, digest: &str) -> bool {
    digests.split(OR).any(|known| known == digest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_results_are_replaced_by_the_same_question_or_with_leave() {
        let folder = tempfile::tempdir().expect("a folder");
        let asked = |command, of: f64, force| NotedQuestion::new(command, format!("motor {of}"), &of, force);
        let first = asked("compare", 1.0, false);
        // Nothing there, or nothing of these names.
        assert!(first.guard(folder.path(), &["a.csv"]).is_ok());
        std::fs::write(folder.path().join("a.csv"), "1").expect("written");
        assert!(first.guard(folder.path(), &["b.csv"]).is_ok());
        // A file that no note mentions.
        let said = first.guard(folder.path(), &["a.csv"]).expect_err("in the way").to_string();
        assert!(
            said.contains("a.csv: found the results of another run") && said.contains("--force"),
            "{said}"
        );
        let note = |asked: &NotedQuestion, names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            let note = asked.note(folder.path(), &names, |name| folder.path().join(name)).expect("readable");
            std::fs::write(folder.path().join(NOTE), note).expect("written");
        };
        note(&first, &["a.csv"]);
        assert!(first.guard(folder.path(), &["a.csv"]).is_ok());
        let said =
            asked("compare", 2.0, false).guard(folder.path(), &["a.csv"]).expect_err("other").to_string();
        assert!(said.contains("of motor 1 there and of motor 2 here"), "{said}");
        assert!(asked("compare", 2.0, true).guard(folder.path(), &["a.csv"]).is_ok());
        // A note of another command does not vouch for this one's files, and stays.
        let other = asked("magnetics", 1.0, false);
        assert!(other.guard(folder.path(), &["a.csv"]).is_err());
        note(&other, &["m.svg"]);
        assert!(first.guard(folder.path(), &["a.csv"]).is_ok());
        // The same question in another format has both files.
        std::fs::write(folder.path().join("a.npz"), "1").expect("written");
        note(&first, &["a.npz"]);
        assert!(first.guard(folder.path(), &["a.csv", "a.npz"]).is_ok());
        // A note does not vouch for what somebody else has put there since.
        std::fs::write(folder.path().join("a.csv"), "2").expect("written");
        let said = first.guard(folder.path(), &["a.csv"]).expect_err("not its own").to_string();
        assert!(said.contains("written by something else since"), "{said}");
        assert!(first.guard(folder.path(), &["a.npz"]).is_ok());
        // While a file is being replaced, its old and its new content count as the command's own; any other content
        // does not.
        let path = folder.path().join("a.npz");
        for (content, own) in [("marked", true), ("1", true), ("3", false)] {
            std::fs::write(&path, "1").expect("written");
            note(&first, &["a.npz"]);
            rewrite(folder.path(), "a.npz", b"marked").expect("written");
            std::fs::write(&path, content).expect("written");
            assert_eq!(first.guard(folder.path(), &["a.npz"]).is_ok(), own, "{content}");
        }
    }
}
