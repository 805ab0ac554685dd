//! The terminal of a command: its width and its colours.

use std::fmt::Write as _;
use std::io::Write as _;
use std::sync::OnceLock;

use console::{Style, Term, measure_text_width};
use standstill_report::page::Tone;

use super::host::{self, keywords::keywords};
use super::wrap::wrapped;
use crate::error::Error;

/// Width in characters if there is no terminal.
pub const USUAL: usize = 80;

/// Largest width of prose in characters; longer lines are hard to read.
const LONGEST_LINE: usize = 100;

/// Returns the width of the terminal in characters. Without a terminal, returns the value of `COLUMNS` or, if that is not set, [`USUAL`].
pub fn width() -> usize {
    static WIDTH: OnceLock<usize> = OnceLock::new();
    if host::current().is_some() {
        return USUAL;
    }
    *WIDTH.get_or_init(|| {
        let terminal = Term::stdout().size_checked().map(|(_, columns)| usize::from(columns));
        let variable = || std::env::var("COLUMNS").ok().and_then(|columns| columns.trim().parse().ok());
        terminal.or_else(variable).filter(|columns| *columns > 0).unwrap_or(USUAL).max(20)
    })
}

/// Returns the width of prose in characters.
pub fn prose_width() -> usize {
    width().min(LONGEST_LINE)
}

/// Returns true if verdicts are coloured. In a host program they never are. Otherwise, they are coloured if `CLICOLOR_FORCE` is set, or on
/// a terminal with colours unless `NO_COLOR` is set or `CLICOLOR` is 0.
pub fn colours() -> bool {
    host::current().is_none() && console::colors_enabled()
}

/// Returns a word in the colour of its tone, if colours are used. The colour only repeats the meaning of the word.
pub fn painted(tone: Tone, word: &str) -> String {
    paint(tone, word, colours())
}

/// Returns a word of this tone, with or without colours.
pub fn paint(tone: Tone, word: &str, colours: bool) -> String {
    let style = Style::new().force_styling(colours);
    match tone {
        Tone::Good => style.green().apply_to(word).to_string(),
        Tone::Warning => style.yellow().apply_to(word).to_string(),
        Tone::Bad => style.red().bold().apply_to(word).to_string(),
        Tone::Neutral => word.to_owned(),
    }
}

/// The sequences of [`paint`] and of the help: the colours of its tones, bold, underlined, and their end.
const COLOURS: [&str; 6] = ["\u{1b}[31m", "\u{1b}[32m", "\u{1b}[33m", "\u{1b}[1m", "\u{1b}[4m", "\u{1b}[0m"];

/// Escapes control characters of a text, because names and titles of files must not control the terminal. Line ends and tabs stay, and the
/// sequences of [`paint`] if colours are used.
fn visible(text: &str, colours: bool) -> String {
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if let Some(colour) = COLOURS.iter().find(|colour| rest.starts_with(**colour)).filter(|_| colours) {
            shown.push_str(colour);
            rest = &rest[colour.len()..];
            continue;
        }
        if c.is_control() && !matches!(c, '\n' | '\t') {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
        rest = &rest[c.len_utf8()..];
    }
    shown
}

/// Writes to standard output. A reader that stops reading (`| head`) does not cause an error.
pub fn print(text: &str) -> Result<(), Error> {
    match write(&visible(text, colours())) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::Write("standard output".into(), error))
        }
        _ => Ok(()),
    }
}

/// Writes to standard output. After a detector library was loaded, writes to a copy of standard output that was made before, to separate
/// this text from text that the library prints.
pub fn write(text: &str) -> std::io::Result<()> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if let Some(mut output) = standstill_foreign::output() {
        return output.write_all(text.as_bytes());
    }
    let mut output = std::io::stdout();
    output.write_all(text.as_bytes()).and_then(|()| output.flush())
}

/// Writes a line to standard error and ignores failures.
pub fn tell(line: &str) {
    let line = if host::current().is_some() { keywords(line) } else { line.to_owned() };
    let _ = std::io::Write::write_fmt(
        &mut std::io::stderr(),
        format_args!("{}", for_reading_of_errors(format!("standstill: {line}\n"))),
    );
}

/// Formats a paragraph in the width of prose. The first line begins with `first`. All other lines are indented by the width of `first`.
pub fn paragraph(first: &str, text: &str) -> String {
    let indent = measure_text_width(first);
    let mut filled = String::new();
    for (k, line) in wrapped(text, prose_width().saturating_sub(indent)).iter().enumerate() {
        if k == 0 {
            let _ = writeln!(filled, "{first}{line}");
        } else {
            let _ = writeln!(filled, "{:indent$}{line}", "");
        }
    }
    filled
}

/// Wraps a command's text to [`width`] on a terminal, or if `COLUMNS` is set. Otherwise the text stays unwrapped, for programs that search
/// its lines.
pub fn for_reading(text: String) -> String {
    if Term::stdout().is_term() || std::env::var_os("COLUMNS").is_some() {
        folded(&text, width())
    } else {
        text
    }
}

/// Wraps text for standard error to the width of the terminal. In a pipe, the text stays unwrapped even if `COLUMNS` is set.
pub fn for_reading_of_errors(text: String) -> String {
    match Term::stderr().size_checked() {
        Some((_, columns)) if Term::stderr().is_term() => folded(&text, usize::from(columns).max(20)),
        _ => text,
    }
}

/// Wraps text at spaces. If a line begins with a label that ends with two spaces, continuation lines are aligned with the text after the
/// label. Otherwise, they are indented further than the line.
fn folded(text: &str, width: usize) -> String {
    let mut folded = String::with_capacity(text.len());
    for line in text.lines() {
        if measure_text_width(line) <= width {
            folded += line;
            folded.push('\n');
            continue;
        }
        let body = line.trim_start_matches(' ');
        let begin = line.len() - body.len();
        let label = body.find("  ").map(|end| begin + end);
        let label = label.map(|end| end + (line[end..].len() - line[end..].trim_start_matches(' ').len()));
        let (head, indent) = match label.map(|end| (&line[..end], measure_text_width(&line[..end]))) {
            Some((head, columns)) if columns <= width / 2 => (head, columns),
            _ => (&line[..begin], begin + 2),
        };
        let rest = &line[head.len()..];
        for (k, part) in wrapped(rest, width.saturating_sub(indent)).iter().enumerate() {
            let _ = if k == 0 {
                writeln!(folded, "{head}{part}")
            } else {
                writeln!(folded, "{:indent$}{part}", "")
            };
        }
    }
    folded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_only_own_sequences_reach_the_terminal() {
        let own = paint(Tone::Bad, "wrong", true) + "\n\tnext";
        assert_eq!(visible(&own, true), own);
        // Hidden, cleared, a window's title; and none where nothing is coloured.
        for foreign in ["\u{1b}[8m", "\u{1b}[2J", "\u{1b}]0;x\u{7}", "\u{85}", "\u{1b}[38;5;1m"] {
            assert!(!visible(foreign, true).contains(char::is_control), "{foreign:?}");
        }
        assert!(!visible(&own, false).contains('\u{1b}'));
    }

    #[test]
    fn law_folded_lines_fit_and_keep_their_words() {
        let text = "paper-5k5: a line without a label that is longer than there is room for\n\n  \
                    largest              1.625°, exceeded by at most 16.85 % (97.5 % sure)\n  \
                    furthest from their means: gain of c +2.3 σ, switch-off delay of a -1.6 σ\nshort\n";
        for width in 30..90 {
            let folded = folded(text, width);
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            assert_eq!(words(&folded), words(text));
            assert!(folded.lines().all(|line| measure_text_width(line) <= width), "{width}:\n{folded}");
        }
        assert_eq!(folded(text, 200), text);
        let narrow = folded(text, 60);
        assert!(narrow.contains("\n                       (97.5 % sure)\n"), "{narrow}");
    }

    #[test]
    fn law_colours_add_nothing_to_the_words() {
        for tone in [Tone::Good, Tone::Warning, Tone::Bad, Tone::Neutral] {
            assert_eq!(paint(tone, "suited", false), "suited");
            let coloured = paint(tone, "suited", true);
            assert_eq!(console::strip_ansi_codes(&coloured), "suited");
            assert_eq!(coloured == "suited", tone == Tone::Neutral);
            assert_eq!(measure_text_width(&coloured), 6);
        }
    }

    #[test]
    fn law_wrapped_lines_are_no_wider_and_lose_no_word() {
        let text = "no method can know the axis better than 0.033° rms from these line pulses";
        for width in 1..80 {
            let lines = wrapped(text, width);
            assert_eq!(lines.join(" "), text);
            assert!(lines.iter().all(|line| line.chars().count() <= width || !line.contains(' ')));
        }
    }
}
