//! `reproduce --paper`: statements of papers beside ours.

use standstill_analysis::paper::Paper;

use super::{folder, standstill};

#[test]
fn law_each_paper_says_which_statements_are_reproduced_and_why_others_are_not() {
    let folder = folder();
    let at = folder.path();
    for paper in Paper::ALL {
        let output = standstill(&["reproduce", "--paper", paper.name], at);
        let said = String::from_utf8(output.stdout).expect("text");
        assert_eq!(output.status.code(), Some(0), "{}: {said}", paper.name);
        let authors = paper.citation.split(',').next().expect("an author");
        assert!(said.contains(authors) && said.contains("statements are reproduced"), "{said}");
        // Each statement that is not reproduced has its reason.
        assert_eq!(said.contains(" NO\n"), said.contains("not reproduced;"), "{said}");
        assert!(!said.contains("no reason is known"), "{said}");
    }
    let said = standstill(&["reproduce", "--paper", "wu-2021"], at).stdout;
    let said = String::from_utf8(said).expect("text");
    assert!(said.contains("4 of 5 statements are reproduced") && said.contains("4.05 °"), "{said}");
}

#[test]
fn regress_a_paper_that_is_not_there_and_keys_beside_a_paper_are_refused() {
    let folder = folder();
    let refused = |words: &[&str]| {
        let output = standstill(words, folder.path());
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        String::from_utf8(output.stderr).expect("text")
    };
    let said = refused(&["reproduce", "--paper", "wu"]);
    assert!(said.contains("wu-2021"), "{said}");
    for other in [&["--trials", "5"][..], &["-s", "errors=none"], &["--motor", "outrunner"], &["s.toml"]] {
        let said = refused(&[&["reproduce", "--paper", "wu-2021"], other].concat());
        assert!(said.contains("--paper"), "{said}");
    }
}
