//! The list of commands that `standstill --help` prints, grouped by purpose.

use std::fmt::Write as _;
use std::sync::LazyLock;

use clap::Subcommand as _;

use super::Command;

/// Commands grouped by purpose, in the order in which most people need them.
pub const GROUPS: [(&str, &[&str]); 6] = [
    ("Is my motor suited?", &["check", "lab", "init", "motors", "convert"]),
    ("My motor's numbers", &["fit", "magnetics"]),
    ("Starts, one or many", &["trace", "compare", "run", "sweep", "report", "explain"]),
    ("Questions to a scenario", &["odds", "faults", "qualify", "budget", "require", "tune", "bounds"]),
    ("Other tools and clusters", &["fmu", "slurm", "status", "merge"]),
    ("About this program", &["reproduce", "witness", "schema", "completions", "man", "help"]),
];

/// Width of the list of commands in columns.
const WIDTH: usize = 100;
/// Column at which the description of a command begins.
const INDENT: usize = 15;

/// The template of the program's help, which lists the commands in groups.
pub static HELP: LazyLock<String> = LazyLock::new(|| {
    let mut text = "{before-help}{about-with-newline}\n{usage-heading} {usage}\n".to_owned();
    let all = Command::augment_subcommands(clap::Command::new("standstill"));
    for (title, names) in GROUPS {
        let _ = write!(text, "\n{title}\n");
        for name in names {
            let about = all.get_subcommands().find(|command| command.get_name() == *name);
            let about = about.and_then(clap::Command::get_about).map(ToString::to_string);
            let help = || (*name == "help").then(|| "This text, or the help of a command".to_owned());
            // A program without a feature lacks commands.
            let Some(about) = about.or_else(help) else { continue };
            for (k, line) in crate::shell::wrap::wrapped(&about, WIDTH - INDENT).iter().enumerate() {
                let name = if k == 0 { name } else { "" };
                let _ = writeln!(text, "  {name:<width$}{line}", width = INDENT - 2);
            }
        }
    }
    text + "\nOptions:\n{options}\n\n`standstill COMMAND --help` has the options of a command.\nWithout a command, on a terminal, the program asks what you have.{after-help}"
});

#[cfg(all(test, feature = "program"))]
mod tests {
    use super::*;

    #[test]
    fn law_each_command_stands_in_one_group() {
        let all = Command::augment_subcommands(clap::Command::new("standstill"));
        let mut listed: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        for command in all.get_subcommands().filter(|command| !command.is_hide_set()) {
            let before = listed.len();
            listed.retain(|name| *name != command.get_name());
            assert_eq!(before - listed.len(), 1, "{}", command.get_name());
        }
        assert_eq!(listed, ["help"]);
        assert!(
            HELP.lines()
                .all(|line| line.chars().count() <= WIDTH || line.contains('{') || line.starts_with('`'))
        );
    }
}
