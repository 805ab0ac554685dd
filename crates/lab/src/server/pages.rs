//! The page's files, compiled in.

const SCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! assets {
    ($($name:literal: $kind:expr),* $(,)?) => {
        /// Returns the kind and the text of a file of the page; the page itself has no name.
        pub(super) fn find(name: &str) -> Option<(&'static str, &'static str)> {
            match name {
                "" => find("index.html"),
                $($name => Some(($kind, include_str!(concat!("../../page/", $name)))),)*
                _ => None,
            }
        }
    };
}

assets! {
    "index.html": "text/html; charset=utf-8",
    "lab.css": "text/css; charset=utf-8",
    "icon.svg": "image/svg+xml",
    "main.mjs": SCRIPT,
    "advice.mjs": SCRIPT,
    "convert.mjs": SCRIPT,
    "faults.mjs": SCRIPT,
    "keyboard.mjs": SCRIPT,
    "link.mjs": SCRIPT,
    "engine.mjs": SCRIPT,
    "server.mjs": SCRIPT,
    "decode.mjs": SCRIPT,
    "state.mjs": SCRIPT,
    "theme.mjs": SCRIPT,
    "controls.mjs": SCRIPT,
    "rotor.mjs": SCRIPT,
    "waves.mjs": SCRIPT,
    "cloud.mjs": SCRIPT,
    "plot.mjs": SCRIPT,
    "folder.mjs": SCRIPT,
    "results.mjs": SCRIPT,
    "words.mjs": SCRIPT,
}

#[cfg(test)]
mod tests {
    use standstill_quantity::any_quantity;

    /// A page that writes a prefix that scenarios do not take, or another power, would hand out commands that do not run.
    #[test]
    fn law_the_page_has_the_prefixes_that_scenarios_take() {
        let (_, words) = super::find("words.mjs").expect("a file of the page");
        let table = words.lines().find(|line| line.starts_with("const PREFIXES")).expect("its table");
        let mut page: Vec<(String, f64)> = table
            .split('[')
            .filter_map(|entry| entry.split_once(", '"))
            .map(|(factor, rest)| {
                let symbol = rest.split('\'').next().expect("a symbol");
                (symbol.to_owned(), factor.parse().expect("a factor"))
            })
            .collect();
        let symbols =
            ('a'..='z').chain('A'..='Z').chain(['µ']).filter(|symbol| *symbol != 'u').map(String::from);
        let mut taken: Vec<(String, f64)> = symbols
            .chain([String::new()])
            .filter_map(|symbol| any_quantity(&format!("1 {symbol}H")).map(|value| (symbol, value.0)))
            .collect();
        page.sort_by(|a, b| a.1.total_cmp(&b.1));
        taken.sort_by(|a, b| a.1.total_cmp(&b.1));
        assert_eq!(page, taken);
    }
}
