//! The header of `samples.csv`: the columns present, and their positions.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::Dataset;
use super::columns::{Column, of_other_kind};
use crate::files::{FileError, Record, name_remedy, nearest_name};

/// Prefix of a free column.
pub(super) const EXTRA: &str = "extra_";

/// Positions of the columns.
pub(crate) struct Header {
    pub(super) names: Vec<String>,
    pub(super) place: HashMap<Column, usize>,
    pub(super) extra: Vec<(String, usize)>,
}

impl Header {
    /// A header of known columns, followed by free ones.
    pub fn new(columns: &[Column], extra: &[String]) -> Header {
        let names = columns.iter().map(|c| c.name()).chain(extra.iter().cloned()).collect();
        let place = columns.iter().enumerate().map(|(place, column)| (*column, place)).collect();
        let extra = extra.iter().enumerate().map(|(k, name)| (name.clone(), columns.len() + k)).collect();
        Header { names, place, extra }
    }

    /// Parses the first line of a file.
    pub(super) fn parse(path: &Path, titles: &Record, dataset: &Dataset) -> Result<Header, FileError> {
        let robot = &dataset.robot;
        let joints = robot.joints();
        let error = |field: &str, problem: String, remedy: String| titles.wrong(path, field, problem, remedy);
        let otherwise = "separate them by commas and write decimal points, or import the file by a column map";
        let names = titles.titles(path, otherwise)?;
        let known = Column::all(robot);
        let known_names: Vec<String> = known.iter().map(|c| c.name()).collect();
        let known_texts: Vec<&str> = known_names.iter().map(String::as_str).collect();
        let mut seen = HashSet::new();
        let mut header = Header { names: names.clone(), place: HashMap::new(), extra: Vec::new() };
        for (place, name) in names.iter().enumerate() {
            if name.is_empty() {
                return Err(error("", format!("column {} has no name", place + 1), "name it, or remove it".into()));
            }
            if !seen.insert(name) {
                return Err(error(name, "appears twice in the header".into(), "keep one of them".into()));
            }
            if let Some(k) = known_names.iter().position(|n| n == name) {
                header.place.insert(known[k], place);
            } else if name.starts_with(EXTRA) && name.len() > EXTRA.len() {
                header.extra.push((name.clone(), place));
            } else if let Some((problem, remedy)) = of_other_kind(name, robot) {
                return Err(error(name, problem, remedy));
            } else {
                let remedy = match nearest_name(name, known_texts.iter().copied()) {
                    Some(_) => name_remedy(name, &known_texts),
                    None => format!("a free column is written `{EXTRA}{name}`; this robot has {joints} joints"),
                };
                return Err(error(name, "there is no such column".into(), remedy));
            }
        }
        for column in [Column::Id, Column::Kind] {
            if !header.place.contains_key(&column) {
                return Err(error(&column.name(), "this required column is missing".into(), "add it".into()));
            }
        }
        for (k, quantity) in Column::quantities(robot).into_iter().enumerate() {
            let count = quantity.len();
            let (there, missing): (Vec<Column>, Vec<Column>) = quantity.into_iter().partition(|c| header.place.contains_key(c));
            let required = k == 0;
            if let Some(first) = missing.first()
                && (required || !there.is_empty())
            {
                let problem = if required {
                    "this required column is missing"
                } else {
                    "this column is missing while its fellows are there"
                };
                return Err(error(&first.name(), problem.into(), format!("the robot needs all {count} of them")));
            }
        }
        Ok(header)
    }
}
