//! A column map proposed for an unknown table: what the columns are called and how large they are, decided by what fits the
//! nominal arm best.

mod balls;
mod further;
mod orientation;
mod proposal;

use std::path::{Path, PathBuf};

use toml_edit::{DocumentMut, Item, value};

use self::proposal::{Proposal, Tried, shown};
use super::column_map::ColumnMap;
use super::generic::by_map;
use super::joint_names::names_of;
use super::unknown_table::Table;
use super::{ImportError, ImportOptions, ImportReport, finished};
use crate::files::FileError;
use crate::measure::dataset::{Dataset, Noise};
use crate::robot::Robot;
use crate::units::{DEG, MM, UM};

/// Residual of a nominal arm, m, up to which positions may have been computed from its joints: the best arms are some ten
/// micrometres off (docs/importing.md). An arm that is described as it was calibrated leaves as little where it is measured well.
const COMPUTED: f64 = 0.015 * MM;

/// Residual of a nominal arm, m, at which the proposal is settled: the worst arm that was seen leaves some ten millimetres.
const FITS: f64 = 20.0 * MM;

/// The same in parts of how far the positions are apart: arms of service robots are a twentieth off.
const FITS_OF_SPREAD: f64 = 0.1;

/// Rows that fit in no way are those of a world seen from the tool if they leave at most this share of what they leave otherwise:
/// something else is wrong with them, and it is named after they are read so.
const FAR_LESS: f64 = 0.5;

/// Fewest rows from which base and tool are found.
const FEWEST: usize = 4;

/// Fewest rows from which computed positions are distinguished from measured ones: base and tool absorb half of their numbers.
const TELLING: usize = 6;

/// The line of a map below which columns are assigned.
pub(super) const COLUMNS: &str = "[columns]\n";

/// A proposed map.
#[derive(Debug, Clone)]
pub struct Guess {
    /// The map, as a file for the format `generic`.
    pub map: String,
    /// The reason for each decision.
    pub reasons: Vec<String>,
    /// The first rows as understood.
    pub shown: Vec<String>,
    /// Residual of the nominal arm with base and tool fitted, rms, m.
    pub residual: f64,
    /// The table as understood.
    pub dataset: Dataset,
}

impl Guess {
    /// The same, with a map that says that the rows stand in the order of measurement, one every so many seconds.
    #[must_use]
    pub fn every(self, interval_s: f64) -> Self {
        let map = format!("{}\n[rows]\ninterval_s = {interval_s}\n", self.map);
        Guess { map, ..self }
    }

    /// The same, with a map that reads further columns, each a line such as `time = { column = "t_s", unit = "s" }`.
    #[must_use]
    pub fn with_columns(self, lines: &str) -> Self {
        let map = self.map.replacen(COLUMNS, &format!("{COLUMNS}{lines}"), 1);
        Guess { map, ..self }
    }

    /// The map, with this noise in place of a weight.
    #[must_use]
    pub fn map_with(&self, noise: &Noise) -> String {
        let Ok(mut map) = self.map.parse::<DocumentMut>() else { return self.map.clone() };
        let mut table = toml_edit::Table::new();
        let stated = [("point_um", noise.point, UM), ("orientation_deg", noise.orientation, DEG)];
        for (name, size, unit) in stated {
            if let Some(size) = size {
                table[name] = value((size / unit * 1e9).round() / 1e9);
            }
        }
        map["dataset"]["noise"] = Item::Table(table);
        map.to_string()
    }

    /// Imports files of the kind of the table through the proposed map.
    ///
    /// # Errors
    /// As [`import`](super::import).
    pub fn import(&self, files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
        let (map, dataset) = ColumnMap::parse(Path::new("map"), &self.map, Path::new(""))?;
        let (dataset, report) = by_map(&map, dataset, files, &options.sets)?;
        finished(dataset, report, options)
    }
}

/// Proposes a column map for a table of joint angles and measured positions or poses of a robot, which the map names by `reference`.
///
/// # Errors
/// If the file cannot be read, or holds no such columns.
pub fn guess(path: &Path, robot: &Robot, reference: &str) -> Result<Guess, ImportError> {
    let table = Table::read(path)?;
    let mut reasons = vec![table.words()];
    let (joints, why) = table.joints(robot, &names_of(reference)).ok_or_else(|| no_columns(path, &table, robot))?;
    reasons.push(why);
    let turned = orientation::columns(&table, &joints);
    let mut triples = table.triples(&joints);
    // What is called an orientation is a position only if nothing else is.
    if triples.iter().any(|triple| !triple.iter().any(|k| turned.contains(k))) {
        triples.retain(|triple| !triple.iter().any(|k| turned.contains(k)));
    }
    if triples.is_empty()
        && let Some(found) = balls::guess(path, &table, robot, reference, &joints)
    {
        return Ok(Guess { reasons: reasons.into_iter().chain(found.reasons).collect(), ..found });
    }
    if triples.is_empty() {
        return Err(no_columns(path, &table, robot).into());
    }
    if table.rows < FEWEST {
        return Err(no_fit(path, &table, robot, &joints).into());
    }
    if let Some(&k) = triples.iter().flatten().find(|&&k| table.columns[k].unit == Some("in")) {
        let problem = format!("holds positions in inches, as {} says, and a map reads mm, m and um", table.title(k));
        return Err(FileError::whole(path, problem, "convert them to mm").into());
    }
    let all = triples.clone();
    let mut best: Option<Tried<'_>> = None;
    let mut computed_triple = None;
    let mut refused = None;
    let fits = |found: &Tried<'_>| found.residual < FITS.max(FITS_OF_SPREAD * found.residual / found.share);
    let are_targets = triples.iter().all(|triple| table.is_target(triple[0]));
    let start = Proposal {
        table: &table,
        robot,
        reference,
        joints: &joints,
        joint_unit: "deg",
        points: triples[0],
        point_unit: "mm",
        minus: None,
        commanded: None,
        targets: Vec::new(),
        rotation: None,
    };
    for triple in triples {
        let plain = Proposal { points: triple, ..start.clone() };
        let is_target = table.is_target(triple[0]);
        let mut found = if is_target { None } else { plain.best(path) };
        if found.is_none() && !is_target && refused.is_none() {
            refused = plain.read(path).err();
        }
        // Deviations stand beside the targets from which they are.
        let has_differences = !table.differences(&triple).is_empty();
        let is_computed =
            |found: &mut Tried<'_>| found.residual <= if has_differences { COMPUTED } else { COMPUTED.min(found.rounding()) };
        // Of few rows, base and tool take up whatever was measured.
        if let Some(computed) = found.take_if(|found| table.rows >= TELLING && is_computed(found)) {
            computed_triple.get_or_insert(triple);
            let leaves = computed.residual / MM;
            reasons.push(format!(
                "{} were computed from the joints: the nominal arm leaves {leaves:.4} mm",
                table.titles(&triple)
            ));
        }
        if found.is_none() {
            let differences = table.differences(&triple).into_iter();
            let tried = differences.filter_map(|minus| Proposal { minus: Some(minus), ..plain.clone() }.best(path));
            found = tried.min_by(|a, b| a.share.total_cmp(&b.share));
        }
        let settled = found.as_ref().is_some_and(fits);
        best = [best, found].into_iter().flatten().min_by(|a, b| a.share.total_cmp(&b.share));
        // What is called a position and fits is one: commanded positions fit better still.
        if settled {
            break;
        }
    }
    if !best.as_ref().is_some_and(fits) {
        let of = |points: [usize; 3]| orientation::seen_from_the_tool(&Proposal { points, ..start.clone() }, path);
        let seen = all.iter().filter_map(|points| of(*points)).min_by(|a, b| a.share.total_cmp(&b.share));
        let known = best.as_ref().map_or(f64::INFINITY, |best| best.share);
        if let Some(tried) = seen.filter(|seen| fits(seen) || seen.share < FAR_LESS * known) {
            reasons.extend(orientation::seen_in_words(&tried));
            best = Some(tried);
        }
    }
    let Some(Tried { residual, mut proposal, mut dataset, .. }) = best else {
        return Err(match reasons.get(2) {
            Some(computed) => {
                let problem = format!("{computed}; nothing measured is left");
                FileError::whole(path, problem, "give the table of the measured positions")
            }
            None => match refused {
                Some(refusal) => return Err(refusal),
                None if are_targets => no_columns(path, &table, robot),
                None => no_fit(path, &table, robot, &joints),
            },
        }
        .into());
    };
    let named_so = || all.iter().copied().find(|triple| table.is_target(triple[0]) && *triple != proposal.points);
    proposal.commanded = computed_triple.or_else(named_so).filter(|triple| Some(*triple) != proposal.minus);
    if let Some(commanded) = proposal.commanded {
        reasons
            .push(format!("commanded: {}; by them the errors of the robot as delivered are known", table.titles(&commanded)));
        dataset = proposal.read(path)?;
    }
    reasons.extend(proposal.reasons(residual));
    if table.rows >= TELLING && residual <= COMPUTED && proposal.minus.is_none() {
        reasons.push(format!(
            "{} agree with the robot's description as those of a calibrated arm do; if they were computed from the joints, give the measured ones",
            table.titles(&proposal.points)
        ));
    }
    if proposal.minus.is_none() {
        reasons.extend(further::add_targets(&mut proposal, &all, &dataset, residual, path));
        dataset = proposal.read(path)?;
    }
    if proposal.rotation.is_none() {
        reasons.extend(orientation::add(&mut proposal, path));
        if proposal.rotation.is_some() {
            dataset = proposal.read(path)?;
        }
    }
    let is_target = |triple: &[usize; 3]| proposal.targets.iter().any(|(_, columns)| columns == triple);
    let is_used = |triple: &[usize; 3]| {
        *triple == proposal.points || is_target(triple) || [proposal.minus, proposal.commanded].contains(&Some(*triple))
    };
    let other = all.iter().filter(|triple| !is_used(triple) && !triple.iter().any(|k| turned.contains(k)));
    for triple in other.filter(|triple| !triple.iter().any(|k| proposal.points.contains(k))) {
        let named = table.titles(triple);
        reasons.push(format!(
            "left out, though they may be positions too: {named}; if they are the measured ones, correct the map"
        ));
    }
    reasons.extend(dataset.beyond_limits().iter().map(ToString::to_string));
    reasons.extend(proposal.not_used());
    Ok(Guess { map: proposal.map(), shown: shown(&dataset), reasons, residual, dataset })
}

fn no_columns(path: &Path, table: &Table, robot: &Robot) -> FileError {
    let titles: Vec<&str> = table.columns.iter().map(|c| c.title.as_str()).filter(|t| !t.is_empty()).collect();
    let problem = format!("shows no {} columns of joint angles beside three of positions", robot.joints());
    let remedy = format!("write a map by hand (docs/importing.md); the columns are {}", titles.join(", "));
    FileError::whole(path, problem, remedy)
}

/// Columns like those of joints and positions, of which nothing makes this robot.
fn no_fit(path: &Path, table: &Table, robot: &Robot, joints: &[usize]) -> FileError {
    if table.rows < FEWEST {
        let problem = format!("has too few rows: {}; a base and a tool are found from {FEWEST} at least", table.rows);
        return FileError::whole(path, problem, "give the table with all its rows");
    }
    let problem = format!(
        "does not fit '{}': with {} as its joints, no columns are its positions, in whatever unit that the titles leave open",
        robot.name,
        table.titles(joints)
    );
    let remedy = "check that it is this robot, and that the units in the titles are those of the numbers; or write a map by hand (docs/importing.md)";
    FileError::whole(path, problem, remedy)
}
