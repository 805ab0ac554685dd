//! Command lines for repeating a command, and messages in one line.

use std::path::Path;

/// Returns the command line that resumes the work of this process.
pub fn to_resume() -> String {
    let mut command: Vec<String> = std::env::args_os().map(|word| quoted(&word.to_string_lossy())).collect();
    if !command.iter().any(|word| word == "--resume") {
        command.push("--resume".to_owned());
    }
    command.join(" ")
}

/// Quotes a word for a shell if necessary.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+%@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Returns true if a line consists of words as [`quoted`] writes them, so that a shell reads nothing but words.
pub fn is_quoted(line: &str) -> bool {
    let meant = |word: &str| {
        let inner = word.strip_prefix('\'').and_then(|rest| rest.strip_suffix('\''));
        inner.map_or_else(|| word.to_owned(), |inner| inner.replace(r"'\''", "'"))
    };
    split(line).iter().all(|word| quoted(&meant(word)) == *word) && !line.chars().any(char::is_control)
}

/// Returns the command-line option that sets a key, with a leading space.
pub fn set(key: &str, value: &str) -> String {
    set_pair(&format!("{key}={value}"))
}

/// Returns the command-line option for `KEY=VALUE`, with a leading space.
pub fn set_pair(pair: &str) -> String {
    format!(" -s {}", quoted(pair))
}

/// Returns a command line in which each key is set once. Of several options `-s KEY=VALUE` with the same key, the last one stays: a command
/// refuses a key that is set twice.
pub fn once(command: &str) -> String {
    let words = split(command);
    let key_at = |place: usize| {
        let word = words.get(place + 1).filter(|_| words[place] == "-s")?;
        word.trim_start_matches('\'').split('=').next()
    };
    let keys: Vec<Option<&str>> = (0..words.len()).map(key_at).collect();
    let is_last = |place: usize| keys[place].is_none_or(|key| !keys[place + 1..].contains(&Some(key)));
    let is_kept = |place: &usize| is_last(*place) && place.checked_sub(1).is_none_or(is_last);
    (0..words.len()).filter(is_kept).map(|place| words[place]).collect::<Vec<_>>().join(" ")
}

/// Splits a command line at its spaces, but not within quotes. The words keep their quotes.
fn split(command: &str) -> Vec<&str> {
    let (mut words, mut start, mut quote, mut is_escaped) = (Vec::new(), 0, None, false);
    for (place, c) in command.char_indices() {
        match c {
            _ if is_escaped => is_escaped = false,
            '\\' if quote.is_none() => is_escaped = true,
            '\'' | '"' if quote.is_none() => quote = Some(c),
            c if quote == Some(c) => quote = None,
            ' ' if quote.is_none() => {
                words.push(&command[start..place]);
                start = place + 1;
            }
            _ => {}
        }
    }
    words.push(&command[start..]);
    words
}

/// Returns the words of a line, split at spaces outside quotes.
pub fn words(line: &str) -> Vec<&str> {
    split(line).into_iter().filter(|word| !word.is_empty()).collect()
}

/// Returns this process's command line, quoted for a shell. Returns an empty text in a host program.
pub fn typed() -> String {
    typed_of(None)
}

/// Returns this process's command line without the options `--resume` and `--force`.
pub fn begun() -> String {
    let words = std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy()));
    let words = words.filter(|word| !["--resume", "--force"].contains(&word.as_str()));
    std::iter::once("standstill".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Returns this process's command line, in which `scenario.toml` replaces the path of `scenario`. Returns an empty text in a host program.
pub fn typed_of(scenario: Option<&Path>) -> String {
    if super::host::current().is_some() {
        return String::new();
    }
    let words = std::env::args_os().skip(1).map(|word| match scenario {
        Some(path) if path.as_os_str() == word => "scenario.toml".to_owned(),
        _ => quoted(&word.to_string_lossy()),
    });
    std::iter::once("standstill".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Prefix of an entry's name if the entry's value is the digest of an option's file. [`command`] omits such entries.
pub const DIGEST_OF: &str = "digest of ";

/// Makes a command line of this program from a question's record of options and values. Several values of an option, joined by commas,
/// repeat the option. An entry without a leading dash is the path of a further file. Its value is a digest, which is omitted. Entries that
/// begin with [`DIGEST_OF`] are omitted, too.
pub fn command<'a>(name: &str, options: impl IntoIterator<Item = (&'a String, &'a String)>) -> String {
    let mut words = vec![format!("standstill {name} scenario.toml")];
    for (option, values) in options.into_iter().filter(|(option, _)| !option.starts_with(DIGEST_OF)) {
        if !option.starts_with('-') {
            words.push(quoted(option));
            continue;
        }
        let several = ["--key", "--vary", "--between", "--only"].contains(&option.as_str());
        let values: Vec<&str> = if several { values.split(", ").collect() } else { vec![values] };
        words.extend(values.into_iter().map(|value| format!("{option} {}", quoted(value))));
    }
    words.join(" ")
}

/// Fills in a template: replaces each name between two `§` by its value.
pub fn filled(template: &str, values: &[(&str, String)]) -> String {
    let value = |name: &str| values.iter().find(|(known, _)| *known == name).map_or("", |(_, value)| value);
    template.split('§').enumerate().map(|(k, part)| if k % 2 == 0 { part } else { value(part) }).collect()
}

/// Joins the lines of a message, and removes the usage text that the parser appends. Escapes control characters, because a message can
/// quote a file, whose content must not control the terminal.
pub fn one_line(message: &str) -> String {
    let body = message.split("\n\nUsage:").next().unwrap_or(message);
    let body = body.split("\n\nFor more information").next().unwrap_or(body);
    // The parser's tip is a paragraph of its own.
    let body = body.replace("\n\n  tip:", "; tip:");
    let words: Vec<&str> = body.split_whitespace().collect();
    let line = words.join(" ");
    let visible = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    line.trim_start_matches("error: ").chars().map(visible).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_advice_is_apart_from_the_mistake() {
        let message = "error: unexpected argument '--shart' found\n\n  tip: a similar argument exists: '--shard'\n\nUsage: x\n";
        assert_eq!(
            one_line(message),
            "unexpected argument '--shart' found; tip: a similar argument exists: '--shard'"
        );
    }

    #[test]
    fn regress_control_characters_of_a_file_do_not_drive_the_terminal() {
        let message = "a.csv: found `\u{1b}[2J\0\u{9b}x`\n\tneeded: µ";
        assert_eq!(one_line(message), "a.csv: found `\\u{1b}[2J\\u{0}\\u{9b}x` needed: µ");
    }

    #[test]
    fn regress_parser_messages_become_one_line() {
        let message = "error: invalid value 'x' for '--decay <DECAY>'\n  [possible values: slow, fast]\n\nFor more information, try '--help'.\n";
        assert_eq!(
            one_line(message),
            "invalid value 'x' for '--decay <DECAY>' [possible values: slow, fast]"
        );
    }

    #[test]
    fn law_a_key_that_is_set_twice_has_its_last_value() {
        let set_twice =
            "standstill run 'a b.toml' -s 'noise=30 mA' --seed 4 -s x.y=1 -s 'noise=42 mA' -s 'x=it'\\''s a'";
        let expected = "standstill run 'a b.toml' --seed 4 -s x.y=1 -s 'noise=42 mA' -s 'x=it'\\''s a'";
        assert_eq!(once(set_twice), expected);
        for command in
            [expected, "standstill require s --limit \"rms <= 1 deg, p95 <= 2 deg\"", "standstill run s -s"]
        {
            assert_eq!(once(command), command);
        }
    }

    #[test]
    fn law_words_survive_a_shell() {
        for (word, expected) in [("a=1.5", "a=1.5"), ("noise=20 mA", "'noise=20 mA'"), ("it's", r"'it'\''s'")]
        {
            assert_eq!(quoted(word), expected);
            assert!(is_quoted(&format!("standstill run {expected} -s a=1")), "{expected}");
        }
        for line in [
            "standstill run a; rm -rf b",
            "run $(x)",
            "a | b",
            "a 'b",
            "a\\b",
            "a 'b\u{1b}[2J'",
            "a  b",
            "a `b`",
            "'a'",
        ] {
            assert!(!is_quoted(line), "{line}");
        }
    }
}
