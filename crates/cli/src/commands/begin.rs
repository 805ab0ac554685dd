//! `standstill` without a command, on a terminal: asks what the user has, and begins with the matching command.

use std::io::{self, BufRead, IsTerminal as _, Write};

use crate::shell::command_line::quoted;

/// A file or question that a new user may have, and the first command to run for it.
struct Begin {
    have: &'static str,
    /// Question that asks for a file name, and the default file for an empty answer.
    file: Option<(&'static str, &'static str)>,
    /// Words of the command; `FILE` stands for the file's name.
    command: &'static str,
    /// Hint on the step after this command; it is printed below the command line.
    next: &'static str,
}

const BEGINS: [Begin; 6] = [
    Begin {
        have: "a nameplate or a data sheet of a motor",
        file: Some(("File to fill in", "mine.toml")),
        command: "init --motor FILE",
        next: "numbers that your sheet gives otherwise: standstill convert --help",
    },
    Begin {
        have: "flux maps, from finite elements or measured",
        file: Some(("File of the map (.csv, .mat, .npz)", "")),
        command: "magnetics FILE",
        next: "docs/own-motor-map.md: a data sheet with [map], then standstill check",
    },
    Begin {
        have: "a drive and a scope: records of pulses",
        file: Some(("File of a record (.csv)", "")),
        command: "fit FILE",
        next: "the data sheet that it writes goes to standstill check",
    },
    Begin {
        have: "firmware in C that detects the rotor's position",
        file: Some(("Scenario file to write", "scenario.toml")),
        command: "init FILE",
        next: "compile your interrupt (docs/firmware.md), then standstill run FILE --detector ./mine.so",
    },
    Begin {
        have: "a scenario file",
        file: Some(("Its name", "scenario.toml")),
        command: "run FILE",
        next: "standstill odds, faults, budget, require and tune ask more of it",
    },
    Begin {
        have: "nothing yet: show me",
        file: None,
        command: "trace --method bipolar --angle 43.2 --out trace",
        next: "the picture is trace/waveform.png; then standstill check paper-5k5, or standstill lab",
    },
];

/// Asks on the terminal which command to run first, and returns the words of this command. The list is empty if the user chose nothing.
/// `None` if there is no terminal.
pub fn asked() -> Option<Vec<String>> {
    if !io::stdin().is_terminal() || !io::stdout().is_terminal() {
        return None;
    }
    choose(&mut io::stdin().lock(), &mut io::stdout()).ok()
}

/// Asks for one of [`BEGINS`] and for its file. Returns the words of the command. The list is empty if the user leaves without a choice or
/// names no file.
fn choose(answers: &mut impl BufRead, out: &mut impl Write) -> io::Result<Vec<String>> {
    writeln!(out, "What do you have? (standstill --help lists all commands)\n")?;
    for (k, begin) in BEGINS.iter().enumerate() {
        writeln!(out, "  {}  {}", k + 1, begin.have)?;
    }
    let chosen = loop {
        match ask(answers, out, &format!("\n1 to {}, or nothing to leave: ", BEGINS.len()))?.as_str() {
            "" => return Ok(Vec::new()),
            answer => match answer.parse::<usize>().ok().and_then(|k| BEGINS.get(k.wrapping_sub(1))) {
                Some(begin) => break begin,
                None => writeln!(out, "found `{answer}`, needed a number from 1 to {}", BEGINS.len())?,
            },
        }
    };
    let mut file = String::new();
    if let Some((question, default)) = chosen.file {
        let shown = if default.is_empty() { String::new() } else { format!(" [{default}]") };
        file = ask(answers, out, &format!("{question}{shown}: "))?;
        if file.is_empty() {
            default.clone_into(&mut file);
        }
        if file.is_empty() {
            return Ok(Vec::new());
        }
        // The parser would take a name that begins with `-` for an option.
        if file.starts_with('-') {
            file.insert_str(0, "./");
        }
    }
    let words: Vec<String> = chosen
        .command
        .split(' ')
        .map(|word| if word == "FILE" { file.clone() } else { word.to_owned() })
        .collect();
    let shown: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    writeln!(
        out,
        "\n$ standstill {}\n(after it: {})\n",
        shown.join(" "),
        chosen.next.replace("FILE", &file)
    )?;
    Ok(words)
}

/// Asks a question and returns the answer without leading and trailing blanks. The answer is empty at the end of the input.
fn ask(answers: &mut impl BufRead, out: &mut impl Write, question: &str) -> io::Result<String> {
    write!(out, "{question}")?;
    out.flush()?;
    let mut line = String::new();
    answers.read_line(&mut line)?;
    Ok(line.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(answers: &str) -> (Vec<String>, String) {
        let mut out = Vec::new();
        let words = choose(&mut answers.as_bytes(), &mut out).expect("in memory");
        (words, String::from_utf8(out).expect("text"))
    }

    #[test]
    fn law_each_answer_begins_with_a_command_that_there_is() {
        for k in 1..=BEGINS.len() {
            let (words, said) = chosen(&format!("{k}\nmy file.toml\n"));
            let line = std::iter::once("standstill".into()).chain(words.iter().map(Into::into));
            assert!(crate::arguments(line.collect::<Vec<std::ffi::OsString>>()).is_ok(), "{words:?}");
            assert!(said.contains("(after it: "), "{said}");
        }
        assert_eq!(chosen("1\n\n").0, ["init", "--motor", "mine.toml"]);
        assert_eq!(chosen("3\nrecord of 12 V.csv\n").0, ["fit", "record of 12 V.csv"]);
        assert!(chosen("3\nrecord of 12 V.csv\n").1.contains("$ standstill fit 'record of 12 V.csv'"));
    }

    #[test]
    fn law_no_answer_leaves_and_a_wrong_one_is_asked_again() {
        for answers in ["", "\n", "2\n\n", "2\n"] {
            assert!(chosen(answers).0.is_empty(), "{answers:?}");
        }
        let (words, said) = chosen("0\nseven\n6\n");
        assert_eq!(words[0], "trace");
        assert_eq!(said.matches("needed a number from 1 to 6").count(), 2, "{said}");
    }
}
