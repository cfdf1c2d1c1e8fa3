//! A proposed map: the assumptions, the map as a file, and its fit.

use std::fmt::Write;
use std::path::Path;

use nalgebra::Vector3;

use super::COLUMNS;
use crate::import::column_map::ColumnMap;
use crate::import::generic::by_map;
use crate::import::initial_setup::fit_base_and_tool;
use crate::import::rotation::RotationForm;
use crate::import::unknown_table::{Table, TableColumn};
use crate::import::{ImportError, ImportOptions};
use crate::math::nearest_rank;
use crate::measure::dataset::{Dataset, Measured, Sample};
use crate::residuals::misfit::reach;
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, JointKind, Robot};
use crate::units::{DEG, MM, UM};

/// Number of unused columns that are named.
const MOST_NAMED: usize = 12;

/// Number of rows that are shown.
const SHOWN: usize = 3;

/// Noise of an orientation that a map states before the ratio of the residuals gives its weight, deg.
const WEIGHT_DEG: f64 = 0.05;

/// An orientation of a proposal.
#[derive(Clone)]
pub(super) struct Turned {
    pub form: RotationForm,
    pub columns: Vec<usize>,
    /// Unit of its angles.
    pub unit: &'static str,
    /// True if the rows state the world in the tool: a camera on the flange that sees a fixed board.
    pub inverse: bool,
}

/// Assumptions about a table.
#[derive(Clone)]
pub(super) struct Proposal<'a> {
    pub table: &'a Table,
    pub robot: &'a Robot,
    pub reference: &'a str,
    pub joints: &'a [usize],
    pub joint_unit: &'static str,
    pub points: [usize; 3],
    pub point_unit: &'static str,
    /// Columns subtracted from the positions.
    pub minus: Option<[usize; 3]>,
    /// Commanded positions.
    pub commanded: Option<[usize; 3]>,
    /// Positions of further points of the tool, with their names.
    pub targets: Vec<(String, [usize; 3])>,
    /// Orientation beside the position.
    pub rotation: Option<Turned>,
}

/// A proposal and its fit.
pub(super) struct Tried<'a> {
    /// Residual of the nominal arm, rms, m.
    pub residual: f64,
    /// The same in parts of how far the positions are apart: in a smaller unit every residual is small.
    pub share: f64,
    pub proposal: Proposal<'a>,
    pub dataset: Dataset,
}

impl Turned {
    /// The part of a map that states it.
    pub fn map(&self, table: &Table) -> String {
        let unit = if self.form.has_angles() { format!(", unit = \"{}\"", self.unit) } else { String::new() };
        let columns: Vec<String> = self.columns.iter().map(|&k| format!("{{ column = {}{unit} }}", table.named(k))).collect();
        let mut map = format!("\n[rotation]\nform = \"{}\"\ncolumns = [{}]\n", self.form.name(), columns.join(", "));
        if self.inverse {
            _ = writeln!(map, "inverse = true");
        }
        map
    }

    /// The noise that a map of poses states.
    pub fn noise() -> String {
        format!(
            "\n# A weight beside the positions, until their noise is stated.\n[dataset.noise]\norientation_deg = {WEIGHT_DEG}\n"
        )
    }
}

/// What computed positions leave with all digits, m: the joints of a recording are the means of encoders that are read at other times
/// than the pose. No arm repeats so well.
const LEAST: f64 = 1e-6;

/// Size of a unit of a proposal, SI.
fn size(unit: &str) -> f64 {
    match unit {
        "deg" => DEG,
        "mm" => MM,
        "um" => UM,
        _ => 1.0,
    }
}

/// Rows that are farther off than this multiple of the median are left out of a fit to most rows.
const FAR: f64 = 3.0;
/// Number of times that rows are left out anew.
const ROUNDS: usize = 4;

impl Tried<'_> {
    /// What positions computed from the joints would leave, m: the digits that are not written, of joints at the end of the arm and
    /// of positions; what leaves more was measured.
    pub fn rounding(&self) -> f64 {
        /// Square of a digit, in the variance of what is left out after it, which is spread evenly over the digit.
        const SQUARED: f64 = 12.0;
        let Proposal { table, robot, joints, points, point_unit, .. } = &self.proposal;
        let digit = |k: usize, unit: &str| table.columns[k].last_digit * size(unit);
        let reach = reach(robot);
        let of_joint = |(i, &k): (usize, &usize)| match robot.kind(i) {
            JointKind::Revolute => reach * digit(k, self.proposal.unit_of_joint(i, k)),
            JointKind::Prismatic => digit(k, self.proposal.unit_of_joint(i, k)),
        };
        let joints = joints.iter().enumerate().map(of_joint);
        let all = joints.chain(points.iter().map(|&k| digit(k, point_unit)));
        LEAST + (all.map(|digit| digit * digit).sum::<f64>() / SQUARED).sqrt()
    }

    /// The same with the residual of most rows, median, and base and tool fitted to them.
    pub fn of_most_rows(mut self) -> Self {
        let spread = self.residual / self.share;
        let mut most = self.dataset.clone();
        for _ in 0..ROUNDS {
            let off = misses(&most, &self.dataset);
            let middle = nearest_rank(off.clone(), 0.5);
            self.residual = middle;
            let near = self.dataset.samples.iter().zip(&off).filter(|(_, off)| **off <= FAR * middle);
            most.samples = near.map(|(sample, _)| sample.clone()).collect();
            fit_base_and_tool(&mut most);
        }
        self.share = self.residual / spread;
        (self.dataset.base, self.dataset.tool) = (most.base, most.tool);
        self
    }
}

/// Distance of each measured point of `rows` from the nominal arm with base and tool of `set_up`, m.
fn misses(set_up: &Dataset, rows: &Dataset) -> Vec<f64> {
    let at = |q: &[f64]| world_from_tool(&set_up.robot, &set_up.base, &set_up.tool, q).translation.vector;
    let of = |s: &Sample| match s.measured {
        Measured::Point(point) => (at(&s.q) - point).norm(),
        _ => 0.0,
    };
    rows.samples.iter().map(of).collect()
}

impl<'a> Proposal<'a> {
    /// The same in the units that fit best; `None` if its rows cannot be read in any.
    pub fn best(&self, path: &Path) -> Option<Tried<'a>> {
        let joint_units = units(self.table, self.joints, &["deg", "rad"]);
        let point_units = units(self.table, &self.points, &["mm", "m", "um"]);
        let all =
            joint_units.iter().flat_map(|&joint_unit| point_units.iter().map(move |&point_unit| (joint_unit, point_unit)));
        let tried = all.filter_map(|(joint_unit, point_unit)| {
            let proposal = Proposal { joint_unit, point_unit, ..self.clone() };
            proposal.tried(path)
        });
        // In a unit too small, positions are one place, which every arm misses by little; a title is taken at its word.
        let tried = tried.filter(|t| point_units.len() == 1 || t.proposal.point_unit != "um" || t.share <= 1.0);
        tried.min_by(|a, b| a.share.total_cmp(&b.share))
    }

    pub fn map(&self) -> String {
        let mut map = self.table.layout();
        if self.rotation.is_some() {
            map.push_str("kind = \"pose\"\n");
        }
        map.push('\n');
        map.push_str(COLUMNS);
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
        for (name, columns) in &self.targets {
            _ = writeln!(map, "\n[targets.\"{name}\"]");
            for (axis, &k) in ["x", "y", "z"].iter().zip(columns) {
                _ = writeln!(map, "{axis} = {{ column = {}, unit = \"{}\" }}", self.table.named(k), self.point_unit);
            }
        }
        map.extend(self.rotation.iter().map(|turned| turned.map(self.table)));
        _ = write!(
            map,
            "\n[dataset]\nrobot = \"{}\"\n\n# The target measured, in the frame of the flange: fitted, from 0, 0, 0.\n[dataset.tool]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 0.0\nfree = true\n",
            self.reference
        );
        map.extend(self.rotation.iter().map(|_| Turned::noise()));
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
    pub fn not_used(&self) -> Option<String> {
        let of_map = [self.temperature(), self.set()].into_iter().flatten().map(|c| c.place - 1);
        let used: Vec<usize> = self
            .joints
            .iter()
            .chain(&self.points)
            .chain([self.minus, self.commanded].iter().flatten().flatten())
            .chain(self.targets.iter().flat_map(|(_, columns)| columns))
            .chain(self.rotation.iter().flat_map(|turned| &turned.columns))
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
    pub fn read(&self, path: &Path) -> Result<Dataset, ImportError> {
        let (map, dataset) = ColumnMap::parse(Path::new("map"), &self.map(), Path::new(""))?;
        Ok(by_map(&map, dataset, &[path.to_path_buf()], &ImportOptions::default().sets)?.0)
    }

    /// The fit of the nominal arm with base and tool; `None` if the rows cannot be read so.
    pub fn tried(self, path: &Path) -> Option<Tried<'a>> {
        let dataset = self.read(path).ok()?;
        let points: Vec<(Vector3<f64>, &[f64])> = dataset
            .samples
            .iter()
            .filter(|s| s.tool_target.is_none())
            .filter_map(|s| match s.measured {
                Measured::Point(point) => Some((point, s.q.as_slice())),
                _ => None,
            })
            .collect();
        let count = points.len().max(1) as f64;
        let mean = points.iter().map(|(p, _)| p).sum::<Vector3<f64>>() / count;
        let spread = (points.iter().map(|(p, _)| (p - mean).norm_squared()).sum::<f64>() / count).sqrt();
        let at = |q: &[f64]| world_from_tool(&dataset.robot, &dataset.base, &dataset.tool, q).translation.vector;
        let residual = (points.iter().map(|(p, q)| (at(q) - p).norm_squared()).sum::<f64>() / count).sqrt();
        // The tool is somewhere on the flange: positions in m that are taken for mm fit a tool of any length.
        let believable = FramePose::default() != dataset.base && dataset.tool.xyz.iter().all(|v| v.abs() < 1.5);
        let share = residual / spread.max(f64::MIN_POSITIVE);
        (believable && residual.is_finite()).then_some(Tried { residual, share, proposal: self, dataset })
    }

    pub fn reasons(&self, residual: f64) -> [String; 3] {
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
        let (joints, points_by) = (by(self.joints, &["deg", "rad"]), by(&self.points, &["mm", "m", "um"]));
        [
            points,
            format!("units: joints in {}{}, positions in {}{}", self.joint_unit, joints, self.point_unit, points_by),
            format!("with base and tool fitted, the nominal arm leaves {:.3} mm rms", residual / MM),
        ]
    }
}

/// The first rows in the units of a dataset.
pub(super) fn shown(dataset: &Dataset) -> Vec<String> {
    let row = |s: &crate::measure::dataset::Sample| {
        let joint = |(q, kind): (&f64, JointKind)| match kind {
            JointKind::Revolute => format!("{:.3}", q.to_degrees()),
            JointKind::Prismatic => format!("{:.3} mm", q / MM),
        };
        let q: Vec<String> = s.q.iter().zip(dataset.robot.kinds()).map(joint).collect();
        let Measured::Point(p) = s.measured else { return String::new() };
        let turned = s.orientation.map(|o| o.rotation / DEG);
        let turned = turned.map(|r| format!("; turned by the rotation vector {:.3}, {:.3}, {:.3} deg", r.x, r.y, r.z));
        let at = format!("position {:.3}, {:.3}, {:.3} mm", p.x / MM, p.y / MM, p.z / MM);
        format!("{}: joints {} deg; {at}{}", s.id, q.join(", "), turned.unwrap_or_default())
    };
    dataset.samples.iter().take(SHOWN).map(row).collect()
}

/// Units to try: that of the title, or all that are possible.
pub(super) fn units(table: &Table, columns: &[usize], known: &[&'static str]) -> Vec<&'static str> {
    let stated = columns.iter().find_map(|&k| table.columns[k].unit).filter(|unit| known.contains(unit) || *unit == "um");
    stated.map_or_else(|| known.to_vec(), |unit| vec![unit])
}
