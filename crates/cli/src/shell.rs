//! Facilities that commands share: terminal, folders of results, command lines, formatting of values.

pub mod asked;
pub mod command_line;
pub mod host;
pub mod interrupt;
pub mod output;
pub mod progress;
pub mod setup;
pub mod table;
pub mod terminal;
pub mod values;

/// The text that a command prints, with its exit code.
#[derive(Debug)]
pub struct Report {
    /// Text for standard output.
    pub text: String,
    /// Exit code: 0 for success; 1 if the answer is no or a trial could not be simulated; 130 if interrupted.
    pub code: u8,
}
