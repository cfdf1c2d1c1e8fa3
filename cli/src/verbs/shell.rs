//! `completions SHELL` and `man`: what a shell and a manual need to know of the program.

use std::path::PathBuf;

use calibench::files::disk::write_whole;
use clap_complete::Shell;

use super::command;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print_answer, print_bytes};

#[derive(clap::Args)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(clap::Args)]
pub struct Man {
    /// Folder for the pages, one for the program and one for each verb and each verb in it; existing files are replaced
    #[arg(short, long, visible_alias = "out", value_name = "DIR")]
    output: PathBuf,
}

/// Prints the script that completes verbs, options and values.
pub fn completions(arguments: &Completions) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command(), "calibench", &mut script);
    print_bytes(&script)?;
    Ok(Outcome::Done)
}

/// Writes the manual pages.
pub fn man(arguments: &Man) -> Result<Outcome, Failure> {
    let mut whole = command();
    whole.build();
    let pages = pages(whole, "calibench");
    for page in &pages {
        let name = page.get_display_name().unwrap_or_else(|| page.get_name()).to_owned();
        let mut text = Vec::new();
        clap_mangen::Man::new(page.clone()).title(name.clone()).render(&mut text)?;
        write_whole(&arguments.output.join(format!("{name}.1")), &text)?;
    }
    print_answer(format!("{} pages in {}", pages.len(), arguments.output.display()))?;
    Ok(Outcome::Done)
}

/// A verb and the verbs in it, each with the name of its page.
fn pages(verb: clap::Command, name: &str) -> Vec<clap::Command> {
    let inner = verb.get_subcommands().filter(|inner| inner.get_name() != "help");
    let inner: Vec<_> = inner.flat_map(|inner| pages(inner.clone(), &format!("{name}-{}", inner.get_name()))).collect();
    std::iter::once(verb.display_name(name)).chain(inner).collect()
}
