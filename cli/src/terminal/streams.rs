//! `-` for standard input and standard output, where a verb takes or writes one file.

use std::path::{Path, PathBuf};

use calibench::files::streams::{STANDARD_INPUT, STANDARD_OUTPUT, is_standard_input, is_standard_output};
use clap::ArgMatches;
use clap::builder::{PathBufValueParser, TypedValueParser};

/// The sign on the command line.
const SIGN: &str = "-";

/// A file to be read, or `-`.
pub fn input() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(|path| named(path, STANDARD_INPUT))
}

/// A file to be written, or `-`.
pub fn output() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(|path| named(path, STANDARD_OUTPUT))
}

fn named(path: PathBuf, stream: &str) -> PathBuf {
    if path == Path::new(SIGN) { stream.into() } else { path }
}

/// Use of the standard streams by the arguments of a verb.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Streams {
    /// Arguments that are read from standard input.
    inputs: Vec<String>,
    /// Arguments that are written to standard output.
    outputs: Vec<String>,
    /// Arguments for which `-` has no meaning.
    senseless: Vec<String>,
    /// One JSON document is to be printed.
    json: bool,
}

impl Streams {
    /// Those of a command line, with the verbs inside verbs.
    pub fn of(matches: &ArgMatches) -> Self {
        let mut all = Streams::default();
        let mut level = Some(matches);
        while let Some(matches) = level {
            for id in matches.ids() {
                let name = id.as_str();
                all.json |= name == "json" && matches!(matches.try_get_one::<bool>(name), Ok(Some(true)));
                // Groups and arguments of other types are not paths.
                let Ok(Some(paths)) = matches.try_get_many::<PathBuf>(name) else { continue };
                for path in paths {
                    let among = match path {
                        path if is_standard_input(path) => &mut all.inputs,
                        path if is_standard_output(path) => &mut all.outputs,
                        path if path == Path::new(SIGN) => &mut all.senseless,
                        _ => continue,
                    };
                    among.push(name.replace('_', "-"));
                }
            }
            level = matches.subcommand().map(|(_, matches)| matches);
        }
        all
    }

    /// The reason why these arguments contradict each other, if they do.
    pub fn problem(&self) -> Option<String> {
        if let Some(name) = self.senseless.first() {
            return Some(format!(
                "{name}: `-` stands for standard input or output, which can be one file that needs no other beside it; give a path (./- for a file of that name)"
            ));
        }
        if let [first, second, ..] = self.inputs.as_slice() {
            return Some(format!("{first} and {second}: both are `-`, and standard input can be read once; name one of them"));
        }
        match (self.outputs.as_slice(), self.json) {
            ([first, second, ..], _) => {
                Some(format!("{first} and {second}: both are `-`, and standard output can hold one of them; name the other"))
            }
            ([first], true) => {
                Some(format!("{first}: `-` and --json both write to standard output; name a file, or leave --json out"))
            }
            _ => None,
        }
    }

    /// True if standard output holds a file: what is told then goes to standard error.
    pub fn holds_a_file(&self) -> bool {
        !self.outputs.is_empty()
    }
}
