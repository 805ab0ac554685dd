//! The answer of a qualification on a machine that computes other numbers.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_analysis::witness::Figure;
use standstill_scenario::{Document, Plan};

use super::*;
use crate::arguments::Question;

#[derive(clap::Parser)]
struct Line {
    #[command(flatten)]
    question: Question,
}

#[test]
fn law_a_witness_that_does_not_hold_fails_the_qualification_though_all_requirements_passed() {
    let document =
        Document::parse(Path::new("s.toml"), "detector.method = \"bipolar\"\n").expect("a scenario");
    let plan = Plan::new(document.clone()).expect("a plan");
    let list =
        "odds = \"off\"\n[[requirement]]\nid = \"A\"\ntext = \"the angle\"\nlimit = \"p95 <= 10 deg\"\n";
    let requirements = Requirements::parse(Path::new("r.toml"), list).expect("a requirement");
    let mut found = Qualification::new(requirements, &plan, &document).expect("a case");
    found.judge(&AtomicBool::new(false), &|_| true, |_, _| {}).expect("runs");
    let witnesses = |here: f64| {
        let figure = Figure::Number { known: 1.33627, here, tolerance: 1e-9, unit: "A" };
        vec![Witness { claim: "a <pulse>".to_owned(), from: "closed form", figure }]
    };
    let Line { question } = clap::Parser::parse_from(["qualify", "s.toml"]);
    for (here, code) in [(1.33627, 0), (1.3363, FAILED)] {
        let heard = witnesses(here);
        let silent: Vec<_> = heard.iter().filter(|witness| !witness.holds()).collect();
        let number = silent.len();
        let words = Words {
            found: &found,
            asked: &[0],
            question: &question,
            requirements: Path::new("r.toml"),
            silent,
        };
        let answer = answer(&words, String::new(), serde_json::json!({}), Some(&heard));
        assert_eq!(answer.code, code);
        let text = answer.text();
        assert!(text.contains("1 of 1 requirements passed, 0 failed"), "{text}");
        assert_eq!(text.contains("a witness does not hold"), number == 1, "{text}");
        let (_, junit) = answer.files.iter().find(|(name, _)| *name == "qualify-junit.xml").expect("JUnit");
        let junit = String::from_utf8(junit.clone()).expect("text");
        assert!(junit.contains(&format!("tests=\"{}\" failures=\"{number}\"", 1 + number)), "{junit}");
        assert_eq!(junit.contains("name=\"a &lt;pulse&gt;\""), number == 1, "{junit}");
    }
}
