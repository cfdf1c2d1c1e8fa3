//! Outputs are never inputs: a file that a command reads, or writes already, is not overwritten by another of its outputs.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use calibench::files::disk::full_path;
use calibench::files::streams::is_standard_output;
use calibench::measure::dataset::file::DATASET_TOML;
use calibench::robot::robot_file::RobotReference;
use calibench_report::documents::Run;
use clap::{ArgMatches, Command};
use toml::{Table, Value};

use super::{report, run};
use crate::arguments::data::MODEL;

/// Arguments that name what is written; all other paths are read. A history is both.
const WRITTEN: [&str; 12] =
    ["film", "history", "mdh", "mjcf", "out", "output", "page", "parquet", "plots", "report", "ur_kinematics", "urdf"];

/// Those that name folders to which files are added: they may be the folders of the data.
const ADDED_TO: [&str; 2] = ["rows", "save_to"];

/// The argument that names a robot by its file and links, and is not a path.
const ROBOT: &str = "urdf_of";

/// Keys under which a TOML file names others.
const NAMING: [&str; 6] = ["dataset", "extends", "robot", "robots", "scenario", "scene"];

/// Files of a dataset.
const DATASET: [&str; 2] = [DATASET_TOML, "samples.csv"];

/// An output of a command.
struct Output {
    /// The argument as it is written on the command line.
    said: String,
    path: PathBuf,
    /// The file, or the folder and the files that are replaced in it.
    places: Vec<PathBuf>,
}

impl Output {
    fn of(command: &Command, id: &str, path: PathBuf) -> Self {
        let argument = command.get_arguments().find(|argument| argument.get_id().as_str() == id);
        let option = argument.and_then(|argument| match (argument.get_short(), argument.get_long()) {
            (Some(short), _) => Some(format!("-{short} ")),
            (None, long) => Some(format!("--{} ", long?)),
        });
        let within = DATASET.into_iter().map(|name| path.join(name));
        let places = std::iter::once(path.clone()).chain(within).map(|place| full_path(&place)).collect();
        Output { said: format!("{}{}", option.unwrap_or_default(), path.display()), path, places }
    }

    fn has(&self, file: &Path) -> bool {
        self.places.iter().any(|place| place == file)
    }
}

/// The reason to refuse a command line: an output of it is one of its inputs, or two of its outputs are one file.
pub fn problem(command: &Command, matches: &ArgMatches) -> Option<String> {
    let mut written: Vec<Output> = Vec::new();
    let mut read: Vec<PathBuf> = Vec::new();
    let mut level = Some((command, matches));
    while let Some((command, matches)) = level {
        for id in matches.ids().map(|id| id.as_str()) {
            let named = paths(matches, id);
            if WRITTEN.contains(&id) {
                let kept = named.into_iter().filter(|path| can_be_overwritten(path));
                written.extend(kept.map(|path| Output::of(command, id, path)));
            } else if !ADDED_TO.contains(&id) {
                read.extend(named);
            }
        }
        level = matches.subcommand().and_then(|(verb, matches)| Some((command.find_subcommand(verb)?, matches)));
    }
    if written.is_empty() {
        return None;
    }
    let read = everything_read(read);
    for (k, output) in written.iter().enumerate() {
        if let Some(other) = written[..k].iter().find(|other| other.places.iter().any(|place| output.has(place))) {
            return Some(format!("{} and {}: are one file; name two", other.said, output.said));
        }
        if read.iter().any(|file| output.has(file)) {
            let what = if output.path.is_dir() { "folder" } else { "file" };
            return Some(format!("{}: is read by this command; name another {what}", output.said));
        }
    }
    None
}

/// The paths that an argument names.
fn paths(matches: &ArgMatches, id: &str) -> Vec<PathBuf> {
    // Groups and arguments of other types are not paths.
    match (matches.try_get_many::<PathBuf>(id), id) {
        (Ok(Some(paths)), _) => paths.cloned().collect(),
        (_, ROBOT) => matches.try_get_one::<String>(id).ok().flatten().map(PathBuf::from).into_iter().collect(),
        _ => Vec::new(),
    }
}

/// True for a file or a folder, be it there or not; pipes and devices are written to.
fn can_be_overwritten(path: &Path) -> bool {
    !is_standard_output(path) && !fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// All that is read where these paths are given: of a folder its data, of a file what it names.
fn everything_read(mut paths: Vec<PathBuf>) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    while let Some(path) = paths.pop() {
        // The links of a URDF follow its name.
        let file = path.to_str().map_or(path.as_path(), |text| Path::new(RobotReference::parse(text).name));
        if (file.is_file() || file.is_dir()) && found.insert(full_path(file)) {
            paths.extend(data_in(file));
            paths.extend(named_in(file));
        }
    }
    found
}

/// The files and folders that a dataset or a run may hold; of a dataset of a run, its model too.
fn data_in(folder: &Path) -> Vec<PathBuf> {
    let is_run = folder.join(Run::FILE).is_file();
    let of_run = run::FILES.iter().copied().filter(|name| is_run && *name != report::FILE);
    let model = folder.parent().filter(|run| run.join(Run::FILE).is_file()).map(|run| run.join(MODEL));
    DATASET.into_iter().chain(of_run).map(|name| folder.join(name)).chain(model).collect()
}

/// Files named in a TOML file, relative to it: the parent of a scenario, the robot of a dataset, the dataset of a cell.
fn named_in(file: &Path) -> Vec<PathBuf> {
    if file.extension().is_none_or(|extension| extension != "toml") {
        return Vec::new();
    }
    let root: Option<Table> = fs::read_to_string(file).ok().and_then(|text| text.parse().ok());
    let root = root.unwrap_or_default();
    let folder = file.parent().unwrap_or(Path::new(""));
    let tables = std::iter::once(&root).chain(root.values().filter_map(Value::as_table));
    let values = tables.flat_map(|table| NAMING.into_iter().filter_map(move |key| table.get(key)));
    values.flat_map(texts).map(|text| folder.join(text)).collect()
}

fn texts(value: &Value) -> Vec<&str> {
    match value {
        Value::String(text) => vec![text.as_str()],
        Value::Array(list) => list.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use std::any::TypeId;

    use clap::CommandFactory;

    use super::super::Arguments;
    use super::*;

    /// The paths of a verb and of the verbs in it: where they are, what they are called, whether their help says that they are
    /// written.
    fn of(command: &Command, found: &mut Vec<(String, String, bool)>) {
        for argument in command.get_arguments() {
            if argument.get_value_parser().type_id() == TypeId::of::<PathBuf>() {
                let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
                let says = ["Output", "Write ", "Folder for ", "History file"].iter().any(|begin| help.starts_with(begin));
                found.push((command.get_name().to_owned(), argument.get_id().as_str().to_owned(), says));
            }
        }
        command.get_subcommands().for_each(|inner| of(inner, found));
    }

    #[test]
    fn every_path_of_every_verb_is_known_as_input_or_output() {
        let mut found = Vec::new();
        of(&Arguments::command(), &mut found);
        assert!(found.len() > 60, "{}", found.len());
        for (verb, id, says) in &found {
            let is_written = WRITTEN.contains(&id.as_str()) || ADDED_TO.contains(&id.as_str());
            assert_eq!(is_written, *says, "{verb}: {id}");
        }
        for id in WRITTEN.iter().chain(&ADDED_TO) {
            assert!(found.iter().any(|(_, known, _)| known == id), "no verb has {id}");
        }
    }

    #[test]
    fn what_a_file_names_is_read_too() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for (name, text) in [
            ("cell.toml", "dataset = \"campaign/dataset.toml\"\nscenario = \"s.toml\"\n[robot]\nkind = \"kuka\"\n"),
            ("s.toml", "extends = \"base.toml\"\n[suite]\nrobots = [\"other.toml\", \"nowhere.toml\"]\n"),
            ("base.toml", "robot = \"arm.urdf#base:tool\"\nextends = \"s.toml\"\n"),
            ("other.toml", "no TOML"),
            ("arm.urdf", "<robot/>"),
            ("arm.toml", "name = \"arm\"\n"),
            ("campaign/dataset.toml", "robot = \"../arm.toml\"\n"),
        ] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), text).unwrap();
        }
        let read = everything_read(vec![at("cell.toml")]);
        let mut all = ["arm.toml", "arm.urdf", "base.toml", "campaign/dataset.toml", "cell.toml", "other.toml", "s.toml"]
            .map(|name| full_path(&at(name)))
            .to_vec();
        all.sort();
        assert_eq!(read.into_iter().collect::<Vec<_>>(), all);
    }
}
