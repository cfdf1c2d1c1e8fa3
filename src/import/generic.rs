//! `generic`: any delimited table, through a map of its columns (see `docs/importing.md`).

use std::path::{Path, PathBuf};

use super::column_map::ColumnMap;
use super::initial_setup::{check_base, check_orientations, fit_base_and_tool};
use super::source::joined;
use super::table::{TableFile, read_table};
use super::{ImportError, ImportOptions, ImportReport};
use crate::files::streams::is_standard_input;
use crate::files::{FileError, read_bytes, read_text};
use crate::measure::dataset::columns::Column;
use crate::measure::dataset::{Dataset, SampleSet};

/// What is to be known of joints that nobody read.
const SUPPOSED: &str =
    "the joints are a supposition: those of the nominal arm at the pose of the flange, in the posture nearest to near_deg";

/// Imports files through the map of the options.
pub(super) fn import(files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    let path = options.map.as_ref().ok_or(ImportError::NoMap)?;
    let text = read_text(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (map, dataset) = ColumnMap::parse(path, &text, folder)?;
    if map.has_base
        && let Some(folder) = &options.set_up_of
    {
        check_base(&dataset, folder)?;
    }
    by_map(&map, dataset, files, &options.sets)
}

/// Refuses a file whose bytes are those of another: its rows would count twice, and be fitted and held out at once.
fn refuse_copies(files: &[PathBuf]) -> Result<(), FileError> {
    let length = |path: &PathBuf| path.metadata().map(|m| m.len()).ok();
    for (k, file) in files.iter().enumerate() {
        let same_length = files[..k].iter().filter(|earlier| length(earlier).is_some() && length(earlier) == length(file));
        for earlier in same_length {
            if earlier == file || read_bytes(earlier)? == read_bytes(file)? {
                let problem = format!("holds the same bytes as {}", earlier.display());
                return Err(FileError::whole(file, problem, "give each table once"));
            }
        }
    }
    Ok(())
}

/// Imports files through a map; `sets` has one entry for each file, or none.
pub(super) fn by_map(
    map: &ColumnMap,
    mut dataset: Dataset,
    files: &[PathBuf],
    sets: &[SampleSet],
) -> Result<(Dataset, ImportReport), ImportError> {
    let mut report = ImportReport::default();
    if map.join.is_none() {
        refuse_copies(files)?;
    }
    if map.join.is_some() && !sets.is_empty() {
        return Err(ImportError::SetsOfJoined);
    }
    let joined = map.join.as_ref().map(|by| joined(files, map.layout(), by, &mut report)).transpose()?;
    let files = if joined.is_some() { &files[..1] } else { files };
    for (k, (file, label)) in files.iter().zip(labels(files)).enumerate() {
        let mut constants = vec![(Column::Kind, map.kind.clone())];
        if map.session_per_file {
            constants.push((Column::Session, label.clone()));
        }
        if sets.get(k) == Some(&SampleSet::Validation) {
            constants.push((Column::Set, "validation".into()));
        }
        let table = TableFile { path: file, label: &label, constants: &constants, joined: joined.as_deref() };
        read_table(&table, map, &mut dataset, &mut report)?;
    }
    if map.flange.is_some() {
        report.notes.push(SUPPOSED.into());
        dataset.provenance.insert("joints".into(), SUPPOSED.into());
    }
    report.notes.extend(dataset.whole_turns_undone());
    report.notes.extend(dataset.beyond_limits().iter().map(ToString::to_string));
    if let Some(rows) = map.rows {
        rows.apply(&mut dataset.samples, &mut report);
    }
    if !map.has_base {
        check_orientations(&dataset)?;
        fit_base_and_tool(&mut dataset);
        dataset.base_found = true;
    }
    Ok((dataset, report))
}

/// A name for each file: that of its folder if that is unique, else its own, else both.
fn labels(files: &[PathBuf]) -> Vec<String> {
    let folder = |p: &Path| p.parent().and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    // Names of rows stay words: what comes by standard input has no name of a file.
    let stem = |p: &Path| match p.file_stem() {
        _ if is_standard_input(p) => "input".to_owned(),
        name => name.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
    };
    let distinct = |names: &[String]| (0..names.len()).all(|k| !names[k].is_empty() && !names[..k].contains(&names[k]));
    let by_folder: Vec<String> = files.iter().map(|p| folder(p)).collect();
    let by_name: Vec<String> = files.iter().map(|p| stem(p)).collect();
    if files.len() > 1 && distinct(&by_folder) {
        by_folder
    } else if distinct(&by_name) {
        by_name
    } else {
        files.iter().enumerate().map(|(k, p)| format!("{}-{}-{}", k + 1, folder(p), stem(p))).collect()
    }
}
