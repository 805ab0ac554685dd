//! Messages for a host whose commands are Python functions: keyword arguments replace options, and calls replace
//! command lines.

use std::fmt::Write as _;

use clap::CommandFactory;

use crate::arguments::Arguments;
use crate::shell::command_line::words;

/// An option of the command line, to be named as a Python keyword argument.
struct Keyword {
    /// Name of the option without the two dashes.
    option: String,
    /// Placeholder of the option's value, such as `KEY=VALUE`; none for a flag.
    placeholder: Option<String>,
    /// The values that the option can have, if they are a fixed list.
    choices: Vec<String>,
}

impl Keyword {
    /// Returns the name of the argument in Python.
    fn name(&self) -> String {
        match self.option.as_str() {
            "no-witness" => "witness".to_owned(),
            option => option.replace('-', "_"),
        }
    }

    /// Returns the argument as written in a Python call, such as `trials=5`. If a needed value is missing, returns only the argument's
    /// name.
    fn argument(&self, value: Option<&str>) -> String {
        let name = self.name();
        match (value, &self.placeholder) {
            (None, None) if self.option == "no-witness" => format!("{name}=False"),
            (None, None) => format!("{name}=True"),
            (None, Some(_)) => name,
            (Some(value), placeholder) => {
                let value = value.trim_matches(['\'', '"']);
                let pair =
                    placeholder.as_ref().filter(|of| of.contains('=')).and_then(|_| value.split_once('='));
                match pair {
                    Some((key, value)) => format!("{name}={{\"{key}\": \"{value}\"}}"),
                    None => format!("{name}={}", literal(value)),
                }
            }
        }
    }

    /// Returns true if the word after the option in a sentence is the option's value. Otherwise, it is just the next word of the sentence.
    fn has(&self, word: &str) -> bool {
        let bare = word.trim_matches(['\'', '"', '`', ',', ';', ')']).trim_end_matches(['.', ':']);
        let is_value = |c: char| c.is_ascii_digit() || "=:/._".contains(c);
        self.choices.iter().any(|choice| choice == bare)
            || word.starts_with(['\'', '"'])
            || !bare.is_empty() && bare.chars().all(|c| c.is_ascii_uppercase())
            || bare.contains(is_value)
    }
}

/// Returns a value as Python source. Numbers and placeholders of one letter stay unchanged, and all other values become quoted strings.
fn literal(value: &str) -> String {
    let number = value.parse::<f64>().is_ok_and(f64::is_finite);
    let of_number = value.len() == 1 && value.chars().all(|c| c.is_ascii_uppercase());
    if number || of_number { value.to_owned() } else { format!("\"{value}\"") }
}

/// Returns the options of all commands without repetitions.
fn all() -> Vec<Keyword> {
    let arguments = Arguments::command();
    let mut all: Vec<Keyword> = Vec::new();
    for argument in arguments.get_subcommands().flat_map(clap::Command::get_arguments) {
        let Some(option) = argument.get_long() else { continue };
        let values = argument.get_possible_values();
        let choices = values.iter().map(|value| value.get_name().to_owned());
        let takes = argument.get_action().takes_values();
        let placeholder =
            takes.then(|| argument.get_value_names().map_or("", |names| names[0].as_str()).to_owned());
        match all.iter_mut().find(|known| known.option == option) {
            // An option that is a flag of one command may take a value in another.
            Some(known) => {
                known.choices.extend(choices);
                known.placeholder = known.placeholder.take().or(placeholder);
            }
            None => all.push(Keyword { option: option.to_owned(), placeholder, choices: choices.collect() }),
        }
    }
    all
}

/// Translates a message for Python. Options become keywords, such as `force=True` for `--force`. Command lines in backquotes become calls.
///
/// ```
/// let said = "a/run.journal: needed --resume to go on with it, another --out, or `standstill run SCENARIO --rows none`";
/// let needed = "a/run.journal: needed resume=True to go on with it, another out, or `standstill.run(\"SCENARIO\", rows=\"none\")`";
/// assert_eq!(standstill_cli::keywords(said), needed);
/// ```
pub fn keywords(message: &str) -> String {
    if !message.contains("-s ") && !message.contains("--") && !message.contains("`standstill ") {
        return message.to_owned();
    }
    let all = all();
    // Split at backquotes, the quoted spans have odd indices.
    let spans: Vec<&str> = message.split('`').collect();
    let closed = spans.len() % 2 == 1;
    let spans = spans
        .iter()
        .enumerate()
        .map(|(k, span)| if k % 2 == 1 && closed { code(span, &all) } else { prose(span, &all) });
    spans.collect::<Vec<_>>().join("`")
}

/// Returns the values that an option of a command can have, such as `csv` for `--format`. Returns an empty list if the option has no fixed
/// list of values.
///
/// ```
/// assert_eq!(standstill_cli::choices("run", "rows"), ["all", "none"]);
/// assert!(standstill_cli::choices("run", "trials").is_empty() && standstill_cli::choices("fly", "rows").is_empty());
/// ```
pub fn choices(command: &str, option: &str) -> Vec<String> {
    let all = Arguments::command();
    let of = all.get_subcommands().filter(|known| known.get_name() == command);
    let argument = of.flat_map(clap::Command::get_arguments).find(|known| known.get_long() == Some(option));
    let taken = argument.filter(|argument| argument.get_action().takes_values());
    let values = taken.map(clap::Arg::get_possible_values).unwrap_or_default();
    values.iter().map(|value| value.get_name().to_owned()).collect()
}

/// Returns the option that a word names, and its value if the word has the form `--option=value`.
fn option_of<'a, 'w>(word: &'w str, all: &'a [Keyword]) -> Option<(&'a Keyword, Option<&'w str>)> {
    let word = word.strip_prefix("--")?;
    let (option, value) = word.split_once('=').map_or((word, None), |(option, value)| (option, Some(value)));
    Some((all.iter().find(|known| known.option == option)?, value))
}

/// Translates the text between two backquotes: a command line, an option with its value, or anything else.
fn code(span: &str, all: &[Keyword]) -> String {
    let words = words(span);
    let name =
        Some(&words[..]).filter(|words| words.len() > 1 && words[0] == "standstill").map(|words| words[1]);
    let is_command =
        |name: &&str| Arguments::command().get_subcommands().any(|known| known.get_name() == *name);
    let name = name.filter(is_command);
    let mut arguments = Vec::new();
    let mut set = Vec::new();
    let mut rest = words[if name.is_some() { 2 } else { 0 }..].iter();
    while let Some(word) = rest.next() {
        if *word == "-s" {
            set.extend(rest.next().map(|pair| pair.trim_matches(['\'', '"'])));
        } else if let Some((keyword, value)) = option_of(word, all) {
            let value = value.or_else(|| keyword.placeholder.as_ref().and_then(|_| rest.next().copied()));
            arguments.push(keyword.argument(value));
        } else if name.is_some() {
            arguments.push(format!("\"{}\"", word.trim_matches(['\'', '"'])));
        } else {
            // `standstill` without a command of these stays as it is.
            return if words[0] == "standstill" { span.to_owned() } else { prose(span, all) };
        }
    }
    if !set.is_empty() {
        let scenario =
            if name.is_some() && !arguments.is_empty() { arguments.remove(0) } else { "…".to_owned() };
        arguments.insert(0, scenario_of(&scenario, &set, name.is_some()));
    }
    match name {
        Some(name) if words.len() == 2 => format!("standstill.{name}"),
        Some(name) => format!("standstill.{name}({})", arguments.join(", ")),
        None => arguments.join(", "),
    }
}

/// Formats a scenario and the keys that are set as a Python call of `scenario`. If `whole` is true, the call contains the module's name.
fn scenario_of(scenario: &str, set: &[&str], whole: bool) -> String {
    let mut text = format!("{}scenario({scenario}", if whole { "standstill." } else { "" });
    for pair in set {
        let (key, value) = pair.split_once('=').unwrap_or((pair, "VALUE"));
        let value = literal(value);
        let _ = if key.contains('.') {
            write!(text, ", **{{\"{key}\": {value}}}")
        } else {
            write!(text, ", {key}={value}")
        };
    }
    text + ")"
}

/// Translates a sentence: options and the values that follow them become keywords.
fn prose(text: &str, all: &[Keyword]) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("--").into_iter().chain(rest.find("-s ")).min() {
        let (before, from) = rest.split_at(at);
        out += before;
        let begins = before
            .chars()
            .next_back()
            .or(out.chars().next_back())
            .is_none_or(|c| !c.is_alphanumeric() && c != '-');
        if let Some(pair) = from.strip_prefix("-s ").filter(|_| begins) {
            let end = pair.find([' ', ',', ';', ')', '\'']).unwrap_or(pair.len());
            out += &scenario_of("…", &[&pair[..end]], false);
            rest = &pair[end..];
            continue;
        }
        let length = from.trim_start_matches('-').find(|c: char| !(c.is_ascii_lowercase() || c == '-'));
        let end =
            length.map_or(from.len(), |length| length + from.len() - from.trim_start_matches('-').len());
        let known = all.iter().find(|known| begins && from.get(2..end) == Some(&known.option));
        let Some(keyword) = known else {
            out += &from[..end.max(2)];
            rest = &from[end.max(2)..];
            continue;
        };
        rest = &from[end..];
        // Messages of the parser have options in quotes, with placeholders.
        if let Some(placeholder) = rest.strip_prefix(" <") {
            out += &keyword.name();
            rest = placeholder.split_once('>').map_or(rest, |(_, after)| after);
            continue;
        }
        if out.ends_with('\'') {
            out += &keyword.name();
            continue;
        }
        let next = rest.strip_prefix([' ', '=']).filter(|_| keyword.placeholder.is_some());
        let value = next.and_then(|next| words(next).first().copied()).filter(|word| keyword.has(word));
        let Some(word) = value else {
            out += &keyword.argument(None);
            continue;
        };
        let value = word.trim_end_matches([',', ';', ':', ')', '.']);
        out += &keyword.argument(Some(value));
        rest = &rest[1 + value.len()..];
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_no_message_in_keywords_has_an_option() {
        let all = all();
        assert!(all.len() > 60, "{} options", all.len());
        for known in &all {
            let (option, name) = (&known.option, known.name());
            for message in [
                format!("a: found b, needed another --{option}, or --{option} to go on"),
                format!("the argument '--{option}' cannot be used with '--{option} <X>'"),
                format!("--{option}: needed one (--{option})"),
                format!("--{option} 3 and --{option} N, or `--{option} A`; `standstill run S --{option} 5`"),
            ] {
                let said = keywords(&message);
                assert!(!said.contains("--") && said.matches(&name).count() > 1, "{message}: {said}");
            }
        }
    }

    #[test]
    fn law_options_become_arguments_with_their_values() {
        for (message, needed) in [
            ("another --out, or --force to replace them", "another out, or force=True to replace them"),
            (
                "with --format csv or parquet and --rows all",
                "with format=\"csv\" or parquet and rows=\"all\"",
            ),
            ("with --force --out a/b: `run` in it", "with force=True out=\"a/b\": `run` in it"),
            ("--trial 7: needed from 0 to 4", "trial=7: needed from 0 to 4"),
            ("--point: needed from 0 to 4", "point: needed from 0 to 4"),
            ("needed --between FROM:TO", "needed between=\"FROM:TO\""),
            ("needed --vary KEY=FROM:TO:N or", "needed vary={\"KEY\": \"FROM:TO:N\"} or"),
            ("--worst K for the largest errors, or --trial N", "worst=K for the largest errors, or trial=N"),
            ("invalid value '0' for '--trials <N>'", "invalid value '0' for 'trials'"),
            ("repeat the run with --resume: the", "repeat the run with resume=True: the"),
            ("`--event wrong-pole`: found", "`event=\"wrong-pole\"`: found"),
            (
                "run `standstill qualify S R --no-witness`",
                "run `standstill.qualify(\"S\", \"R\", witness=False)`",
            ),
            (
                "`standstill run S -s sensors.noise=0.1 --trials 5`",
                "`standstill.run(standstill.scenario(\"S\", **{\"sensors.noise\": 0.1}), trials=5)`",
            ),
            ("a key such as -s errors=default, or", "a key such as scenario(…, errors=\"default\"), or"),
            ("`-s trials=N` says how many", "`scenario(…, trials=N)` says how many"),
            ("as `standstill run` writes it", "as `standstill.run` writes it"),
            // Two dashes that begin no option stay.
            (
                "a well--known dash -- and `sensors.noise`: found -5",
                "a well--known dash -- and `sensors.noise`: found -5",
            ),
            ("the file my--out, and --nothing", "the file my--out, and --nothing"),
        ] {
            assert_eq!(keywords(message), needed);
        }
    }
}
