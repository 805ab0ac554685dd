//! A page to print on A4 and to sign: facts, a table of verdicts, notes and fields for signatures.

use maud::{DOCTYPE, PreEscaped, html};

/// A page with fields for signatures. All texts are escaped.
///
/// ```
/// use standstill_report::page::Sheet;
///
/// let rows = vec![["START-1", "It does not start backwards.", "P < 1e-6", "0 of 20,000,000", "passed"].map(str::to_owned)];
/// let sheet = Sheet { title: "Qualification".to_owned(), columns: ["Id", "Text", "Limit", "Shown", "Verdict"], rows, ..Sheet::default() };
/// assert!(sheet.html().contains("START-1"));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// Heading.
    pub title: String,
    /// The result in a line.
    pub headline: String,
    /// Names and values of the facts on which the result is based.
    pub facts: Vec<(String, String)>,
    /// Titles of the table's columns, the last of which is a verdict.
    pub columns: [&'static str; 5],
    /// Rows of the table.
    pub rows: Vec<[String; 5]>,
    /// Sentences below the table.
    pub notes: Vec<String>,
    /// Who signs, each with fields for name, date and signature.
    pub signatures: Vec<String>,
}

const STYLE: &str = "@page{size:A4;margin:14mm}*{box-sizing:border-box}\
body{font:8.5pt/1.3 system-ui,sans-serif;color:#111;background:#fff;max-width:182mm;margin:8mm auto}\
h1{font-size:17pt;margin:0}.headline{font-size:12pt;font-weight:600;margin:1mm 0 4mm}\
table{border-collapse:collapse;width:100%}td,th{text-align:left;vertical-align:top;padding:.7mm 2mm .7mm 0;overflow-wrap:anywhere}\
.facts td:first-child{width:26mm;color:#444}\
.rows{margin-top:4mm}.rows th{border-bottom:.5mm solid #111}.rows td{border-bottom:.2mm solid #999}.rows tr{break-inside:avoid}\
.rows td:first-child{width:20mm}.rows td:nth-child(2){width:43mm}.rows td:nth-child(3){width:36mm}.rows td:last-child{width:17mm;font-weight:600}\
.failed{color:#a00000}.open{color:#7a4b00}p{margin:3mm 0 0}\
.sign{margin-top:5mm;break-inside:avoid}.sign th{font-weight:600}.sign td{height:13mm;padding:.7mm 1.5mm;border:.2mm solid #111;width:33%;color:#444;font-size:8pt}\
footer{margin-top:4mm;color:#444;font-size:8pt}@media print{body{margin:0;max-width:none}}";

/// Nothing may be fetched, and no script runs.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

impl Sheet {
    /// Returns the page as one HTML file.
    pub fn html(&self) -> String {
        let class = |verdict: &str| match verdict {
            "failed" => Some("failed"),
            "not shown" => Some("open"),
            _ => None,
        };
        let document = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (self.title) }
                    div.headline { (self.headline) }
                    table.facts { @for (name, value) in &self.facts { tr { td { (name) } td { (value) } } } }
                    table.rows {
                        thead { tr { @for column in self.columns { th { (column) } } } }
                        tbody {
                            @for row in &self.rows {
                                tr {
                                    @for (k, cell) in row.iter().enumerate() {
                                        td class=[(k + 1 == row.len()).then(|| class(cell)).flatten()] { (cell) }
                                    }
                                }
                            }
                        }
                    }
                    @for note in &self.notes { p { (note) } }
                    @for who in &self.signatures {
                        table.sign {
                            tr { th colspan="3" { (who) } }
                            tr { td { "Name" } td { "Date" } td { "Signature" } }
                        }
                    }
                    footer { "Standstill " (env!("CARGO_PKG_VERSION")) ". This page states no level of integrity." }
                }
            }
        };
        super::printable(document.into_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_sheet_shows_any_text_as_it_is_and_fetches_nothing() {
        let hostile = "<script>alert(1)</script>&\"'";
        let rows = vec![[hostile, hostile, "rms <= 1 deg", "…", "failed"].map(str::to_owned)];
        let sheet = Sheet {
            title: hostile.to_owned(),
            headline: hostile.to_owned(),
            facts: vec![(hostile.to_owned(), hostile.to_owned())],
            columns: ["Id", "Text", "Limit", "Shown", "Verdict"],
            rows,
            notes: vec![hostile.to_owned()],
            signatures: vec!["Prepared by".to_owned()],
        };
        let html = sheet.html();
        assert!(
            !html.contains("<script") && !html.contains("http://") && !html.contains("https://"),
            "{html}"
        );
        assert_eq!(html.matches("&lt;script&gt;").count(), 8);
        assert!(html.contains("<td class=\"failed\">failed</td>") && html.contains("rms &lt;= 1 deg"));
        for field in ["Name", "Date", "Signature", "Prepared by"] {
            assert!(html.contains(field), "{field}");
        }
    }
}
