//! `standstill completions` and `standstill man`: shell completions and manual pages of the command line.

use std::fmt::Write as _;

use clap::CommandFactory as _;
use clap_complete::Shell;
use standstill_plant::built_in_names;
use standstill_scenario::{Values, keys};

use crate::arguments::{Arguments, Completions, Man};
use crate::error::Error;
use crate::shell::Report;
use crate::shell::command_line::filled;
use crate::shell::output::{Output, file_list};

pub fn completions(options: &Completions) -> Report {
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut Arguments::command(), "standstill", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    let text = match options.shell {
        Shell::Bash => script + &bash(),
        Shell::Zsh => zsh(&script),
        Shell::Fish => fish(&script),
        _ => script,
    };
    Report { text, code: 0 }
}

/// Returns the settings that `-s` accepts, each with its description. A setting with named values is listed as `KEY=VALUE` for each value.
/// Any other setting is listed as `KEY=`.
fn settings() -> Vec<(String, &'static str)> {
    let of = |key: &'static standstill_scenario::Key| -> Vec<(String, &'static str)> {
        let named = |values: Vec<(&'static str, &'static str)>| {
            values.into_iter().map(|(value, about)| (format!("{}={value}", key.path), about)).collect()
        };
        match key.values() {
            Values::Choice(values) => named(values),
            Values::Flag => named(vec![("true", key.about), ("false", key.about)]),
            _ => vec![(format!("{}=", key.path), key.about)],
        }
    };
    let motors = built_in_names().map(|name| (format!("motor={name}"), "A motor of the library"));
    keys().flat_map(of).chain(motors).collect()
}

/// Returns the names of the built-in motors.
fn motors() -> String {
    built_in_names().collect::<Vec<_>>().join(" ")
}

/// Returns the names of the commands whose argument is a scenario file or a motor.
fn of_scenarios() -> Vec<String> {
    let command = Arguments::command();
    let takes = |command: &&clap::Command| {
        let mut ids = command.get_positionals().map(|argument| argument.get_id().as_str());
        ids.any(|id| ["scenario", "motor"].contains(&id))
    };
    command.get_subcommands().filter(takes).map(|command| command.get_name().to_owned()).collect()
}

/// Encloses a text in single quotes, so that every shell takes it literally. Single quotes in the text are removed.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', ""))
}

/// Fills in the template of a completion script. `line` formats the name and the description of a setting or key as a line. If `line` is
/// none, the names are separated by blanks.
fn script(template: &str, line: Option<fn(&str, &str) -> String>) -> String {
    let list = |all: Vec<(String, &'static str)>| match line {
        Some(line) => all.iter().map(|(name, about)| line(name, about) + "\n").collect(),
        None => all.into_iter().map(|(name, _)| name).collect::<Vec<_>>().join(" "),
    };
    let keys = keys().map(|key| (key.path.to_owned(), key.about)).collect();
    let values = [
        ("settings", list(settings())),
        ("keys", list(keys)),
        ("motors", motors()),
        ("commands", of_scenarios().join(" ")),
    ];
    filled(template, &values)
}

/// Returns the part of bash's script that completes settings and motors. Bash splits words at `=`, so the words before a value are needed
/// to complete it. If no motor's name fits, bash completes file names with its own quoting.
fn bash() -> String {
    script(include_str!("completions/bash.sh"), None)
}

/// Placeholders in `--help` for the arguments of options that set or vary a key.
const SETTINGS: [&str; 3] = ["KEY=VALUE", "KEY=VALUES", "KEY=LOW:HIGH"];

/// Returns the completion script of zsh. It completes settings and motors and shows their descriptions.
fn zsh(generated: &str) -> String {
    let line = |name: &str, about: &str| format!("        {}", quoted(&format!("{name}:{about}")));
    let lists = script(include_str!("completions/zsh.zsh"), Some(line));
    let motor = |line: &str| {
        [":scenario -- ", ":motor -- "].iter().any(|id| line.contains(id)) || line.contains(":MOTOR:_default")
    };
    let mut text = String::new();
    for line in generated.lines() {
        // In zsh's script a colon ends the placeholder, unless it is escaped.
        let line = SETTINGS.into_iter().fold(line.to_owned(), |line, value| {
            let escaped = value.replace(':', r"\:");
            line.replace(&format!(":{value}:_default"), &format!(":{escaped}:_standstill_settings"))
        });
        let line = line.replace(":KEY:_default", ":KEY:_standstill_keys");
        let line = if motor(&line) {
            line.replace(":_files'", ":_standstill_motors'").replace(":_default'", ":_standstill_motors'")
        } else {
            line
        };
        text += &line;
        text.push('\n');
        if line.starts_with("autoload") {
            text += &lists;
        }
    }
    text
}

/// Returns the completion script of fish. It completes settings and motors and shows their descriptions.
fn fish(generated: &str) -> String {
    let line =
        |name: &str, about: &str| format!("    printf '%s\\t%s\\n' {} {}", quoted(name), quoted(about));
    let mut text = script(include_str!("completions/fish.fish"), Some(line));
    let motors = motors();
    for line in generated.lines() {
        text += line;
        if [" -s s -l set ", " -l vary "].iter().any(|option| line.contains(option)) {
            text += " -f -a '(__standstill_settings)'";
        } else if line.contains(" -l key ") {
            text += " -f -a '(__standstill_keys)'";
        } else if line.contains(" -l motor ") && !line.contains("_subcommand init") {
            let _ = write!(text, " -a '{motors}'");
        }
        text.push('\n');
    }
    for command in of_scenarios() {
        let _ = writeln!(
            text,
            "complete -c standstill -n '__fish_standstill_using_subcommand {command}' -a '{motors}' -d 'A motor of the library'"
        );
    }
    text
}

/// Writes one manual page for each command, as `git` does.
pub fn man(options: &Man) -> Result<Report, Error> {
    let mut command = Arguments::command().disable_help_subcommand(true);
    command.build();
    let mut pages = vec![("standstill.1".to_owned(), command.clone())];
    for sub in command.get_subcommands() {
        pages.push((format!("standstill-{}.1", sub.get_name()), sub.clone()));
    }
    let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
    let mut output = Output::create(&options.out, &names)?;
    for (name, command) in &pages {
        let mut page = Vec::new();
        let rendered = clap_mangen::Man::new(command.clone()).render(&mut page);
        rendered.map_err(|error| Error::Write(options.out.join(name), error))?;
        output.file(name, &page)?;
    }
    let files = output.finish()?;
    let folder = options.out.display();
    let text = format!("{}Read them with  man {folder}/standstill.1\n", file_list(&options.out, &files));
    Ok(Report { text, code: 0 })
}
