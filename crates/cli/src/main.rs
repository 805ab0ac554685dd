//! `standstill`: a test bench for initial rotor position detection of permanent-magnet synchronous motors.

mod arguments;
mod columns;
mod commands;
mod error;
#[allow(clippy::disallowed_methods, reason = "pictures may differ by a shade from one machine to the next")]
mod figures;
mod interrupt;
mod log;
mod output;
mod progress;
mod scenario;
mod summary;
mod text;
mod units;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use arguments::{Arguments, Command};
use error::Error;

/// What a command leaves to say, and the code it ends with.
struct Report {
    text: String,
    code: u8,
}

fn main() -> ExitCode {
    let report = arguments().and_then(|arguments| match arguments.command {
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
        Command::Report(options) => commands::report::run(&options),
        Command::Merge(options) => commands::merge::run(&options),
        Command::Init(options) => commands::init::run(&options),
        Command::Completions(options) => Ok(commands::shell::completions(&options)),
        Command::Man(options) => commands::shell::man(&options),
        Command::Schema => Ok(commands::init::schema()),
    });
    let outcome = report.and_then(|report| print(&report.text).map(|()| report.code));
    ExitCode::from(outcome.unwrap_or_else(|error| {
        // `eprintln!` would panic where standard error cannot be written.
        let _ = writeln!(std::io::stderr(), "standstill: {}", text::one_line(&error.to_string()));
        2
    }))
}

/// Writes to standard output. Whoever reads it may stop reading (`| head`); that is no error.
fn print(text: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::Write("standard output".into(), error))
        }
        _ => Ok(()),
    }
}

/// The command line; mistakes in one line.
fn arguments() -> Result<Arguments, Error> {
    Arguments::try_parse().map_err(|error| match error.kind() {
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => error.exit(),
        _ => Error::Arguments(text::one_line(&error.render().to_string())),
    })
}
