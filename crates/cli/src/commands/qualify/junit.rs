//! Verdicts as JUnit XML, which build servers read. A failed requirement is a failure, and a requirement that was not
//! shown is an error, so that neither is displayed as passed.

use std::fmt::Write as _;

use standstill_analysis::qualify::Verdict;

use super::words::Words;

/// Returns the verdicts on the requirements as a test suite in the XML format of JUnit.
pub fn suite(words: &Words<'_>) -> String {
    let of = |verdict| words.asked.iter().filter(|number| words.found.verdict(**number) == verdict).count();
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"0\"",
        words.asked.len() + words.silent.len(),
        of(Verdict::Failed) + words.silent.len(),
        of(Verdict::NotShown)
    );
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"standstill qualify\" {counts}>\n  <testsuite name=\"requirements\" {counts}>\n"
    );
    for number in words.asked {
        let requirement = &words.found.requirements.list[*number];
        let (shown, _) = words.evidence(*number);
        let (next, command) = words.advice(*number);
        let [id, limit, said, shown] =
            [&requirement.id, &requirement.limit, &requirement.text, &shown].map(|text| escaped(text));
        let verdict = words.found.verdict(*number);
        let _ = writeln!(text, "    <testcase classname=\"requirements\" name=\"{id}\">");
        let kind = match verdict {
            Verdict::Passed => None,
            Verdict::Failed => Some("failure"),
            Verdict::NotShown => Some("error"),
        };
        if let Some(kind) = kind {
            let next = escaped(&[next, command.unwrap_or_default()].join(" "));
            let _ = writeln!(
                text,
                "      <{kind} type=\"{}\" message=\"{limit}: {shown}\">{next}</{kind}>",
                verdict.name()
            );
        }
        let _ = writeln!(text, "      <system-out>{said}: {limit}: {shown}</system-out>\n    </testcase>");
    }
    for witness in &words.silent {
        let claim = escaped(&witness.claim);
        let _ = writeln!(
            text,
            "    <testcase classname=\"witnesses\" name=\"{claim}\">\n      <failure type=\"witness\" message=\"does not hold on this machine\">standstill witness</failure>\n    </testcase>"
        );
    }
    text + "  </testsuite>\n</testsuites>\n"
}

/// Escapes a text for XML elements and attributes. Replaces characters that XML does not allow.
fn escaped(text: &str) -> String {
    const ENTITIES: [(&str, &str); 8] = [
        ("&", "&amp;"),
        ("<", "&lt;"),
        (">", "&gt;"),
        ("\"", "&quot;"),
        ("'", "&apos;"),
        ("\t", "&#9;"),
        ("\n", "&#10;"),
        ("\r", "&#13;"),
    ];
    let text = ENTITIES.iter().fold(text.to_owned(), |text, (of, entity)| text.replace(of, entity));
    text.replace(|c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'), "\u{fffd}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_any_text_comes_back_from_the_xml() {
        for text in ["a & b < c > \"d\" 'e'", "two\nlines\tand ]]> more", "<!-- -->&amp;", "µ° ≤ 日本"]
        {
            let xml = format!("<t a=\"{0}\">{0}</t>", escaped(text));
            let document = roxmltree::Document::parse(&xml).expect(text);
            let root = document.root_element();
            assert_eq!((root.attribute("a"), root.text()), (Some(text), Some(text)));
        }
        let xml = format!("<t>{}</t>", escaped("bell \u{7} and \u{0}"));
        assert!(roxmltree::Document::parse(&xml).is_ok());
    }
}
