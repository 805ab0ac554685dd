//! The table of the prefixes of units.

/// A prefix of units.
#[derive(Debug)]
pub(crate) struct Prefix {
    /// Printed symbol.
    pub symbol: &'static str,
    /// Other spellings; the first one is for plain keyboards.
    aliases: &'static [&'static str],
    /// Power of ten of the prefix.
    pub power: i32,
}

const fn prefix(symbol: &'static str, aliases: &'static [&'static str], power: i32) -> Prefix {
    Prefix { symbol, aliases, power }
}

/// All of them, from small to large. The two µ are the micro sign U+00B5 and the Greek letter U+03BC.
pub(crate) static PREFIXES: [Prefix; 7] = [
    prefix("p", &[], -12),
    prefix("n", &[], -9),
    prefix("\u{b5}", &["u", "\u{3bc}"], -6),
    prefix("m", &[], -3),
    prefix("", &[], 0),
    prefix("k", &[], 3),
    prefix("M", &[], 6),
];

impl Prefix {
    /// Returns all prefixes, from small to large.
    pub(crate) fn all() -> impl Iterator<Item = &'static Self> {
        PREFIXES.iter()
    }

    /// Returns the power of ten of a prefix in any spelling.
    pub(crate) fn power_of(text: &str) -> Option<i32> {
        PREFIXES.iter().find(|prefix| prefix.spellings().any(|spelling| spelling == text)).map(|p| p.power)
    }

    fn spellings(&self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.symbol).chain(self.aliases.iter().copied())
    }

    /// Returns its spelling for plain keyboards.
    fn typed(&self) -> &'static str {
        self.aliases.first().unwrap_or(&self.symbol)
    }
}

/// Returns the prefixes as one types them, with blanks between.
pub(crate) fn typed() -> String {
    let typed: Vec<_> = PREFIXES.iter().map(Prefix::typed).filter(|prefix| !prefix.is_empty()).collect();
    typed.join(" ")
}

/// Returns all spellings of all prefixes, each one character.
pub(crate) fn spellings() -> String {
    PREFIXES.iter().flat_map(Prefix::spellings).collect()
}
