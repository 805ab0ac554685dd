//! `standstill completions` and `standstill man`: shell completions and manual pages of the command line.

use clap::CommandFactory as _;

use crate::arguments::{Arguments, Completions, Man};
use crate::error::Error;
use crate::shell::Report;
use crate::shell::output::{Output, file_list};

pub fn completions(options: &Completions) -> Report {
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut Arguments::command(), "standstill", &mut script);
    Report { text: String::from_utf8_lossy(&script).into_owned(), code: 0 }
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
