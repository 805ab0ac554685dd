//! The commands of `standstill`, for its own program ([`main`]) and for other programs that carry them out ([`Host`]).

#![cfg_attr(
    not(feature = "program"),
    allow(dead_code, unused_imports, reason = "what commands of the program alone use")
)]

mod answer;
mod arguments;
mod columns;
mod commands;
mod doubts;
mod error;
#[allow(clippy::disallowed_methods, reason = "pictures may differ by a shade from one machine to the next")]
mod figures;
mod log;
mod results;
mod scenario;
mod shell;
mod summary;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser};

use arguments::{Arguments, Command, FOLDERS};
use error::Error;

pub use shell::Report;
pub use shell::host::Host;
pub use shell::host::keywords::{choices, keywords};
use shell::{command_line, host, terminal};

/// Runs the program with the command line of this process.
#[cfg(feature = "program")]
pub fn main() -> ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    standstill_foreign::keep_output();
    let mut words: Vec<OsString> = std::env::args_os().collect();
    if words.len() == 1
        && let Some(chosen) = commands::begin::asked()
    {
        if chosen.is_empty() {
            return ExitCode::SUCCESS;
        }
        words.extend(chosen.into_iter().map(OsString::from));
    }
    let outcome = in_free_folder(&words).and_then(|(report, for_programs)| {
        // No prose begins with a brace, all JSON does.
        let text = if for_programs || report.text.starts_with('{') {
            report.text
        } else {
            terminal::for_reading(report.text)
        };
        terminal::print(&text).map(|()| report.code)
    });
    ExitCode::from(outcome.unwrap_or_else(|error| {
        // `eprintln!` would panic where standard error cannot be written.
        let line = format!("standstill: {}\n", command_line::one_line(&error.to_string()));
        let _ = write!(std::io::stderr(), "{}", terminal::for_reading_of_errors(line));
        2
    }))
}

/// Carries out a command. If its default folder has the results of another run or question, the command gets a folder of its own: the
/// default one with the first free number from 2 on, or with the number of the same run or question. Also returns whether the output is
/// meant for programs.
#[cfg(feature = "program")]
fn in_free_folder(words: &[OsString]) -> Result<(Report, bool), Error> {
    let mut arguments = self::arguments(words.iter().cloned())?;
    let for_programs = prints_for_programs(&arguments.command);
    let is_named = |word: &OsString| {
        let word = word.to_string_lossy();
        ["--out", "--resume", "--force"].iter().any(|option| word.split('=').next() == Some(*option))
    };
    let may_move = !words.iter().any(is_named);
    let mut moved: Option<(std::path::PathBuf, u32)> = None;
    loop {
        let outcome = command(arguments);
        let folder = match &outcome {
            Err(Error::Another { path, .. }) if may_move => path.parent().map(ToOwned::to_owned),
            _ => None,
        };
        let Some(folder) = folder.filter(|folder| folder.starts_with(FOLDERS)) else {
            return outcome.map(|report| (report, for_programs));
        };
        let (first, number) = moved.map_or((folder, 2), |(first, number)| (first, number + 1));
        let mut name = first.clone().into_os_string();
        name.push(format!("-{number}"));
        terminal::tell(&format!(
            "{} has the results of another question or run: going on in {}",
            first.display(),
            name.display()
        ));
        arguments = self::arguments(words.iter().cloned().chain(["--out".into(), name]))?;
        moved = Some((first, number));
    }
}

/// Returns true if a command's output is meant for programs, such as a script, a schema, a manual page or an example file.
#[cfg(feature = "program")]
fn prints_for_programs(command: &Command) -> bool {
    matches!(
        command,
        Command::Completions(_)
            | Command::Man(_)
            | Command::Schema
            | Command::Slurm(_)
            | Command::Init(_)
            | Command::Worker
    )
}

impl Host {
    /// Carries out a command line, without the program's name, in this thread. Returns the text that the program would
    /// print.
    ///
    /// # Errors
    /// The error message that `standstill` would print after its name, as one line, with [`keywords()`] for its options.
    pub fn command(self: &Arc<Self>, words: impl IntoIterator<Item = OsString>) -> Result<Report, String> {
        self.run(|| arguments(std::iter::once("standstill".into()).chain(words)).and_then(command))
            .map_err(|error| keywords(&command_line::one_line(&error.to_string())))
    }
}

/// Carries out a command.
fn command(arguments: Arguments) -> Result<Report, Error> {
    match arguments.command {
        #[cfg(feature = "program")]
        Command::Reproduce(options) => commands::reproduce::run(&options),
        Command::Trace(options) => commands::trace::run(&options),
        Command::Compare(options) => commands::compare::run(&options),
        Command::Check(options) => commands::check::run(&options),
        Command::Fit(options) => commands::fit::run(&options),
        Command::Magnetics(options) => commands::magnetics::run(&options),
        Command::Convert(options) => commands::convert::run(&options),
        Command::Motors(options) => commands::motors::run(&options),
        Command::Run(options) => commands::run::run(&options),
        Command::Sweep(options) => commands::run::sweep(&options),
        Command::Faults(options) => commands::faults::run(&options),
        Command::Qualify(options) => commands::qualify::run(&options),
        Command::Witness(options) => commands::witness::run(&options),
        Command::Budget(options) => commands::budget::run(&options),
        Command::Require(options) => commands::require::run(&options),
        Command::Explain(options) => commands::explain::run(&options),
        Command::Tune(options) => commands::tune::run(&options),
        Command::Odds(options) => commands::odds::run(&options),
        #[cfg(feature = "program")]
        Command::Report(options) => commands::report::run(&options),
        #[cfg(feature = "program")]
        Command::Lab(options) => commands::lab::run(&options),
        #[cfg(feature = "program")]
        Command::Fmu(options) => commands::fmu::run(&options),
        Command::Merge(options) => commands::merge::run(&options),
        #[cfg(feature = "program")]
        Command::Slurm(options) => commands::slurm::run(&options),
        Command::Status(options) => commands::status::run(&options),
        Command::Bounds(options) => commands::bounds::run(&options),
        #[cfg(feature = "program")]
        Command::Init(options) => commands::init::run(&options),
        #[cfg(feature = "program")]
        Command::Completions(options) => Ok(commands::completions::completions(&options)),
        #[cfg(feature = "program")]
        Command::Man(options) => commands::completions::man(&options),
        Command::Worker if cfg!(feature = "program") => commands::run::isolated::worker(),
        // A host is no program that could be started again as a worker.
        Command::Worker => {
            Err(Error::Arguments("a worker is a process of the program `standstill`".to_owned()))
        }
        #[cfg(feature = "program")]
        Command::Schema => Ok(commands::init::schema()),
    }
}

/// Parses a command line that begins with the program's name. Error messages have one line.
fn arguments(words: impl IntoIterator<Item = OsString>) -> Result<Arguments, Error> {
    let parsed = Arguments::try_parse_from(words).map(|mut arguments| {
        arguments.command.name_folder();
        arguments
    });
    parsed.map_err(|error| match error.kind() {
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
            if host::current().is_none() =>
        {
            if error.use_stderr() {
                error.exit()
            }
            match error.print().and_then(|()| std::io::stdout().flush()) {
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    Error::Write("standard output".into(), error)
                }
                _ => std::process::exit(0),
            }
        }
        _ => Error::Arguments(
            as_key(&error).unwrap_or_else(|| command_line::one_line(&error.render().to_string())),
        ),
    })
}

/// Returns the message for an option that only other commands have, with the key that `-s` can set instead, and for `--axis`, whose option
/// is `--vary`. Returns none for other errors and for options without a key.
fn as_key(error: &clap::Error) -> Option<String> {
    let ContextValue::String(option) = error.get(ContextKind::InvalidArg)? else { return None };
    let long = option.strip_prefix("--").filter(|_| error.kind() == ErrorKind::UnknownArgument)?;
    if long == "axis" {
        return Some("unexpected argument '--axis' found; an axis is `--vary KEY=VALUES`".to_owned());
    }
    let all = Arguments::command();
    let mut options = all.get_subcommands().flat_map(clap::Command::get_arguments);
    let key = options.find_map(|other| {
        let help = other.get_help().filter(|_| other.get_long() == Some(long))?.to_string();
        Some(help.split_once("[key: ")?.1.split([';', ']']).next()?.to_owned())
    })?;
    Some(format!("unexpected argument '{option}' found; this command sets its key: `-s {key}=VALUE`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_an_option_of_other_commands_is_refused_with_its_key() {
        let refused = |words: &[&str]| {
            let words = std::iter::once("standstill").chain(words.iter().copied()).map(OsString::from);
            arguments(words).expect_err("refused").to_string()
        };
        let said = refused(&["run", "a.toml", "--errors", "field"]);
        assert!(said.ends_with("`-s errors=VALUE`") && !said.contains("tip"), "{said}");
        assert!(refused(&["odds", "a.toml", "--rotor", "free"]).ends_with("`-s rotor.state=VALUE`"));
        assert!(refused(&["run", "a.toml", "--shart", "1"]).contains("--shard"));
        assert!(refused(&["sweep", "a.toml", "--axis", "k=1,2"]).ends_with("`--vary KEY=VALUES`"));
    }
}
