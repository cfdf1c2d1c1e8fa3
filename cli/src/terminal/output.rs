//! Printing and output files of a verb.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::OnceLock;

use calibench::files::FileError;
use calibench::files::disk::check_output_file;
use calibench_report::Printout;

use super::failure::Failure;
use super::fitting::fitted;
use super::palette::{When, painted};

/// Checks that every requested file can be written, before the work that produces it.
pub fn check_outputs<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), FileError> {
    files.into_iter().try_for_each(|file| check_output_file(file))
}

/// Amount of output, in increasing order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The result alone; of what goes to standard error only what ends the verb.
    Silent,
    /// The result alone, with warnings.
    Quiet,
    /// Everything that a verb has to say.
    Plain,
    /// That, and how it came about.
    Verbose,
}

impl Level {
    /// The level of so many `-q` and `-v`.
    pub fn of(quiet: u8, verbose: u8) -> Self {
        match (quiet, verbose) {
            (0, 0) => Level::Plain,
            (0, _) => Level::Verbose,
            (1, _) => Level::Quiet,
            _ => Level::Silent,
        }
    }
}

/// Settings of the output.
#[derive(Debug, Clone, Copy)]
pub struct Manner {
    /// Columns that text may have; `None` for any number.
    pub columns: Option<usize>,
    /// Amount of output.
    pub level: Level,
    /// Use of colour.
    pub colour: When,
    /// Standard output holds a file, so that text goes to standard error.
    pub beside: bool,
}

/// Output outside a program: everything, in lines of any width.
const PLAIN: Manner = Manner { columns: None, level: Level::Plain, colour: When::Never, beside: false };

/// Set once, before the verb runs.
static MANNER: OnceLock<Manner> = OnceLock::new();

fn manner() -> Manner {
    MANNER.get().copied().unwrap_or(PLAIN)
}

/// Prints in this manner from now on.
pub fn print_in(manner: Manner) {
    MANNER.get_or_init(|| manner);
}

/// True if messages in addition to the result are requested.
pub fn is_told() -> bool {
    manner().level >= Level::Plain
}

/// True if details of the computation are requested.
pub fn is_detailed() -> bool {
    manner().level >= Level::Verbose
}

/// Prints a message in addition to the result: not with `-q`.
pub fn print(text: impl Into<Printout>) -> Result<(), Failure> {
    if is_told() { print_answer(text) } else { Ok(()) }
}

/// Prints what was requested, as wide as the terminal; into a closed pipe, nothing.
pub fn print_answer(text: impl Into<Printout>) -> Result<(), Failure> {
    let Manner { columns, colour, beside, .. } = manner();
    if beside {
        tell(text);
        return Ok(());
    }
    let text = laid_out(&text.into(), columns);
    print_as_it_is(&if colour.for_stream(&std::io::stdout()) { painted(&text) } else { text })
}

/// Prints how a result came about on standard error: with `-v` only.
pub fn print_detail(text: impl Into<Printout>) {
    if is_detailed() {
        tell(text);
    }
}

/// Says that a file was written, with `-v` only: a verb says of itself where its main result is.
pub fn print_written(path: &std::path::Path) {
    print_detail(format!("written: {}", path.display()));
}

/// Prints a remark on standard error: not with `-q`.
pub fn note(text: &str) {
    if is_told() {
        tell(text);
    }
}

/// Prints a warning on standard error: not with `-qq`.
pub fn warn(text: &str) {
    if manner().level >= Level::Quiet {
        tell(text);
    }
}

/// Prints the reason why a verb ends, or ends otherwise than hoped.
pub fn tell(text: impl Into<Printout>) {
    let Manner { columns, colour, .. } = manner();
    // COLUMNS counts for what a person reads; logs keep their lines.
    let text = laid_out(&text.into(), columns.filter(|_| std::io::stderr().is_terminal()));
    let text = if colour.for_stream(&std::io::stderr()) { painted(&text) } else { text };
    drop(writeln!(std::io::stderr(), "{text}"));
}

fn laid_out(text: &Printout, columns: Option<usize>) -> String {
    columns.map_or_else(|| text.to_string(), |columns| fitted(text, columns))
}

/// A closed pipe is not an error: its reader needs no more, and the exit code is that of the verb.
fn print_as_it_is(text: &str) -> Result<(), Failure> {
    match std::io::stdout().lock().write_all(format!("{text}\n").as_bytes()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(e.into()),
        _ => Ok(()),
    }
}

/// Writes bytes to standard output as they are.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    std::io::stdout().lock().write_all(bytes)?;
    Ok(())
}

/// Prints one JSON document, keys in alphabetical order.
pub fn print_json(document: &impl serde::Serialize) -> Result<(), Failure> {
    print_as_it_is(&serde_json::to_string_pretty(&serde_json::to_value(document)?)?)
}
