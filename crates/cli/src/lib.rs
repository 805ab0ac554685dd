//! The commands of `standstill`: of its program ([`main`]), and of other programs that carry them out ([`Host`]).

#![cfg_attr(
    not(feature = "program"),
    allow(dead_code, unused_imports, reason = "what commands of the program alone use")
)]

mod arguments;
mod asked;
mod columns;
mod commands;
mod doubts;
mod error;
#[allow(clippy::disallowed_methods, reason = "pictures may differ by a shade from one machine to the next")]
mod figures;
mod host;
mod interrupt;
mod log;
mod output;
mod progress;
mod scenario;
mod summary;
mod table;
mod terminal;
mod text;
mod units;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use arguments::{Arguments, Command};
use error::Error;

pub use commands::run::by_host::{Hosted, Stopped, Trial};
pub use host::Host;

/// What a command leaves to say, and the code it ends with.
#[derive(Debug)]
pub struct Report {
    /// What it prints.
    pub text: String,
    /// 0: all is well; 1: the answer is no, or a trial could not be simulated; 130: interrupted.
    pub code: u8,
}

/// The program: carries out the command line of this process.
#[cfg(feature = "program")]
pub fn main() -> ExitCode {
    #[cfg(target_os = "linux")]
    standstill_foreign::keep_output();
    let outcome = arguments(std::env::args_os()).and_then(|arguments| {
        let for_programs = prints_for_programs(&arguments.command);
        let report = command(arguments)?;
        // No prose begins with a brace, all JSON does.
        let text = if for_programs || report.text.starts_with('{') {
            report.text
        } else {
            terminal::for_reading(report.text)
        };
        print(&text).map(|()| report.code)
    });
    ExitCode::from(outcome.unwrap_or_else(|error| {
        // `eprintln!` would panic where standard error cannot be written.
        let line = format!("standstill: {}\n", text::one_line(&error.to_string()));
        let _ = write!(std::io::stderr(), "{}", terminal::for_reading_of_errors(line));
        2
    }))
}

/// Whether what a command prints is for a program: a script, a schema, a page of the manual, a file to go on with.
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
        Command::Motors(options) => commands::motors::run(&options),
        Command::Run(options) => commands::run::run(&options),
        Command::Sweep(options) => commands::run::sweep(&options),
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
        Command::Completions(options) => Ok(commands::shell::completions(&options)),
        #[cfg(feature = "program")]
        Command::Man(options) => commands::shell::man(&options),
        Command::Worker if cfg!(feature = "program") => commands::run::isolated::worker(),
        // A host is no program that could be started again as a worker.
        Command::Worker => {
            Err(Error::Arguments("a worker is a process of the program `standstill`".to_owned()))
        }
        #[cfg(feature = "program")]
        Command::Schema => Ok(commands::init::schema()),
    }
}

/// Writes to standard output. Whoever reads it may stop reading (`| head`); that is no error.
pub(crate) fn print(text: &str) -> Result<(), Error> {
    match write(text) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::Write("standard output".into(), error))
        }
        _ => Ok(()),
    }
}

/// Writes to standard output, or where it went when a library was loaded, which may print there what it likes.
pub(crate) fn write(text: &str) -> std::io::Result<()> {
    #[cfg(target_os = "linux")]
    if let Some(mut output) = standstill_foreign::output() {
        return output.write_all(text.as_bytes());
    }
    let mut output = std::io::stdout();
    output.write_all(text.as_bytes()).and_then(|()| output.flush())
}

/// A command line, beginning with the program's name; mistakes in one line.
fn arguments(words: impl IntoIterator<Item = OsString>) -> Result<Arguments, Error> {
    Arguments::try_parse_from(words).map_err(|error| match error.kind() {
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
            if host::current().is_none() =>
        {
            error.exit()
        }
        _ => Error::Arguments(text::one_line(&error.render().to_string())),
    })
}
