//! A column map proposed for an unknown table: what the columns are called and how large they are, decided by what fits the
//! nominal arm best.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::column_map::ColumnMap;
use super::generic::by_map;
use super::unknown_table::{Table, TableColumn};
use super::{ImportError, ImportOptions, ImportReport, finished};
use crate::files::FileError;
use crate::measure::dataset::{Dataset, Measured};
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, JointKind, Robot};
use crate::units::MM;

/// Number of unused columns that are named.
const MOST_NAMED: usize = 12;

/// Number of rows that are shown.
const SHOWN: usize = 3;

/// Residual of a nominal arm, m, below which positions were not measured but computed from its joints: the best arms are some
/// ten micrometres off (docs/importing.md).
const COMPUTED: f64 = 0.015 * MM;

/// Residual of a nominal arm, m, at which the proposal is settled: the worst arm that was seen leaves some ten millimetres.
const FITS: f64 = 20.0 * MM;

/// Fewest rows from which base and tool are found.
const FEWEST: usize = 4;

/// Fewest rows from which computed positions are distinguished from measured ones: base and tool absorb half of their numbers.
const TELLING: usize = 6;

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

/// Proposes a column map for a table of joint angles and measured positions of a robot, which the map names by `reference`.
///
/// # Errors
/// If the file cannot be read, or holds no such columns.
pub fn guess(path: &Path, robot: &Robot, reference: &str) -> Result<Guess, ImportError> {
    let table = Table::read(path)?;
    let mut reasons = vec![table.words()];
    let (joints, why) = table.joints(robot).ok_or_else(|| no_columns(path, &table, robot))?;
    reasons.push(why);
    let triples = table.triples(&joints);
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
    let are_targets = triples.iter().all(|triple| table.is_target(triple[0]));
    for triple in triples {
        let plain = Proposal {
            table: &table,
            robot,
            reference,
            joints: &joints,
            joint_unit: "deg",
            points: triple,
            point_unit: "mm",
            minus: None,
            commanded: None,
        };
        let is_target = table.is_target(triple[0]);
        let mut found = if is_target { None } else { plain.best(path) };
        if found.is_none() && !is_target && refused.is_none() {
            refused = plain.read(path).err();
        }
        // Of few rows, base and tool take up whatever was measured.
        if let Some(computed) = found.take_if(|found| table.rows >= TELLING && found.residual <= COMPUTED) {
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
            found = tried.min_by(|a, b| a.residual.total_cmp(&b.residual));
        }
        let fits = found.as_ref().is_some_and(|found| found.residual < FITS);
        best = [best, found].into_iter().flatten().min_by(|a, b| a.residual.total_cmp(&b.residual));
        // What is called a position and fits is one: commanded positions fit better still.
        if fits {
            break;
        }
    }
    let Some(Tried { residual, mut proposal, mut dataset }) = best else {
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
    let is_used =
        |triple: &[usize; 3]| *triple == proposal.points || [proposal.minus, proposal.commanded].contains(&Some(*triple));
    let other = all.iter().filter(|triple| !is_used(triple));
    for triple in other.filter(|triple| !triple.iter().any(|k| proposal.points.contains(k))) {
        let named = table.titles(triple);
        reasons.push(format!(
            "left out, though they may be positions too: {named}; if they are the measured ones, correct the map"
        ));
    }
    reasons.extend(proposal.not_used());
    Ok(Guess { map: proposal.map(), shown: shown(&dataset), reasons, residual, dataset })
}

/// A proposal and its fit.
struct Tried<'a> {
    /// Residual of the nominal arm, rms, m.
    residual: f64,
    proposal: Proposal<'a>,
    dataset: Dataset,
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

/// Units to try: that of the title, or all that are possible.
fn units(table: &Table, columns: &[usize], known: &[&'static str]) -> Vec<&'static str> {
    let stated = columns.iter().find_map(|&k| table.columns[k].unit).filter(|unit| known.contains(unit) || *unit == "um");
    stated.map_or_else(|| known.to_vec(), |unit| vec![unit])
}

/// Assumptions about a table.
#[derive(Clone)]
struct Proposal<'a> {
    table: &'a Table,
    robot: &'a Robot,
    reference: &'a str,
    joints: &'a [usize],
    joint_unit: &'static str,
    points: [usize; 3],
    point_unit: &'static str,
    /// Columns subtracted from the positions.
    minus: Option<[usize; 3]>,
    /// Commanded positions.
    commanded: Option<[usize; 3]>,
}

impl<'a> Proposal<'a> {
    /// The same in the units that fit best; `None` if its rows cannot be read in any.
    fn best(&self, path: &Path) -> Option<Tried<'a>> {
        let joint_units = units(self.table, self.joints, &["deg", "rad"]);
        let point_units = units(self.table, &self.points, &["mm", "m"]);
        let all =
            joint_units.iter().flat_map(|&joint_unit| point_units.iter().map(move |&point_unit| (joint_unit, point_unit)));
        let tried = all.filter_map(|(joint_unit, point_unit)| {
            let proposal = Proposal { joint_unit, point_unit, ..self.clone() };
            let (residual, dataset) = proposal.residual(path)?;
            Some(Tried { residual, proposal, dataset })
        });
        tried.min_by(|a, b| a.residual.total_cmp(&b.residual))
    }

    fn map(&self) -> String {
        let Table { delimiter, decimal, header, .. } = self.table;
        let delimiter = if *delimiter == b'\t' { "\\t".to_owned() } else { char::from(*delimiter).to_string() };
        let mut map = format!(
            "format = \"calibench-import/1\"\ndelimiter = \"{delimiter}\"\ndecimal = \"{decimal}\"\nheader = {header}\n\n[columns]\n"
        );
        for (i, &k) in self.joints.iter().enumerate() {
            _ = writeln!(map, "q{} = {{ column = {}, unit = \"{}\" }}", i + 1, self.table.named(k), self.unit_of_joint(i, k));
        }
        for (i, axis) in ["x", "y", "z"].iter().enumerate() {
            let minus = self.minus.map_or(String::new(), |minus| format!(", minus = {}", self.table.named(minus[i])));
            let column = self.table.named(self.points[i]);
            _ = writeln!(map, "{axis} = {{ column = {column}, unit = \"{}\"{minus} }}", self.point_unit);
        }
        for (i, axis) in ["x", "y", "z"].iter().enumerate() {
            if let Some(commanded) = self.commanded {
                let column = self.table.named(commanded[i]);
                _ = writeln!(map, "{axis}cmd = {{ column = {column}, unit = \"{}\" }}", self.point_unit);
            }
        }
        if let Some(c) = self.temperature() {
            _ = writeln!(map, "temp = {{ column = {}, unit = \"c\", optional = true }}", self.table.named(c.place - 1));
        }
        if let Some(c) = self.set() {
            _ = writeln!(map, "set = {{ column = {} }}", self.table.named(c.place - 1));
        }
        _ = write!(
            map,
            "\n[dataset]\nrobot = \"{}\"\n\n# The target measured, in the frame of the flange: fitted, from 0, 0, 0.\n[dataset.tool]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 0.0\nfree = true\n",
            self.reference
        );
        map
    }

    fn temperature(&self) -> Option<&TableColumn> {
        self.table.columns.iter().find(|c| c.stem.contains("temp") && c.largest.is_some_and(|v| v < 100.0))
    }

    /// The column that says which rows are for validation.
    fn set(&self) -> Option<&TableColumn> {
        self.table.columns.iter().find(|c| c.is_set)
    }

    /// The columns that the map leaves out.
    fn not_used(&self) -> Option<String> {
        let of_map = [self.temperature(), self.set()].into_iter().flatten().map(|c| c.place - 1);
        let used: Vec<usize> = self
            .joints
            .iter()
            .chain(&self.points)
            .chain([self.minus, self.commanded].iter().flatten().flatten())
            .copied()
            .chain(of_map)
            .collect();
        let left: Vec<usize> = (0..self.table.columns.len()).filter(|k| !used.contains(k)).collect();
        let named: Vec<String> = left.iter().take(MOST_NAMED).map(|&k| self.table.title(k)).collect();
        let rest = if left.len() > MOST_NAMED { format!(" and {} more", left.len() - MOST_NAMED) } else { String::new() };
        (!left.is_empty()).then(|| format!("not used: {}{rest}", named.join(", ")))
    }

    /// Unit of joint `i` in column `k`: that of a prismatic joint is in its title, or else that of the positions.
    fn unit_of_joint(&self, i: usize, k: usize) -> &'static str {
        let stated = self.table.columns[k].unit.filter(|unit| ["mm", "m", "um"].contains(unit));
        match self.robot.kind(i) {
            JointKind::Revolute => self.joint_unit,
            JointKind::Prismatic => stated.unwrap_or(self.point_unit),
        }
    }

    /// The rows, read so.
    fn read(&self, path: &Path) -> Result<Dataset, ImportError> {
        let (map, dataset) = ColumnMap::parse(Path::new("map"), &self.map(), Path::new(""))?;
        Ok(by_map(&map, dataset, &[path.to_path_buf()], &ImportOptions::default().sets)?.0)
    }

    /// Residual of the nominal arm with base and tool fitted, rms, m, and the dataset; `None` if the rows cannot be read so.
    fn residual(&self, path: &Path) -> Option<(f64, Dataset)> {
        let dataset = self.read(path).ok()?;
        let misses = dataset.samples.iter().filter_map(|s| {
            let Measured::Point(point) = s.measured else { return None };
            Some(
                (world_from_tool(&dataset.robot, &dataset.base, &dataset.tool, &s.q).translation.vector - point).norm_squared(),
            )
        });
        let misses: Vec<f64> = misses.collect();
        // The tool is somewhere on the flange: positions in m that are taken for mm fit a tool of any length.
        let believable = FramePose::default() != dataset.base && dataset.tool.xyz.iter().all(|v| v.abs() < 1.5);
        let mean = misses.iter().sum::<f64>() / misses.len().max(1) as f64;
        (believable && mean.is_finite()).then(|| (mean.sqrt(), dataset))
    }

    fn reasons(&self, residual: f64) -> [String; 3] {
        let named = |columns: [usize; 3]| self.table.titles(&columns);
        let points = match self.minus {
            None => format!("positions: {}", named(self.points)),
            Some(minus) => format!(
                "positions: {} minus {}, if these are target minus measured; the fit is as good if they are measured minus target, so check which",
                named(self.points),
                named(minus)
            ),
        };
        // Units in the titles are taken at their word; others are tried.
        let by = |columns: &[usize], of: &[&'static str]| match units(self.table, columns, of).len() {
            1 => ", as the titles say",
            _ => ", which fit the nominal arm best",
        };
        let (joints, points_by) = (by(self.joints, &["deg", "rad"]), by(&self.points, &["mm", "m"]));
        [
            points,
            format!("units: joints in {}{}, positions in {}{}", self.joint_unit, joints, self.point_unit, points_by),
            format!("with base and tool fitted, the nominal arm leaves {:.3} mm rms", residual / MM),
        ]
    }
}

/// The first rows in the units of a dataset.
fn shown(dataset: &Dataset) -> Vec<String> {
    let row = |s: &crate::measure::dataset::Sample| {
        let joint = |(q, kind): (&f64, JointKind)| match kind {
            JointKind::Revolute => format!("{:.3}", q.to_degrees()),
            JointKind::Prismatic => format!("{:.3} mm", q / MM),
        };
        let q: Vec<String> = s.q.iter().zip(dataset.robot.kinds()).map(joint).collect();
        let Measured::Point(p) = s.measured else { return String::new() };
        format!("{}: joints {} deg; position {:.3}, {:.3}, {:.3} mm", s.id, q.join(", "), p.x / MM, p.y / MM, p.z / MM)
    };
    dataset.samples.iter().take(SHOWN).map(row).collect()
}
