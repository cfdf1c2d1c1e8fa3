//! Touches of balls in an unknown table: joints beside a column that names the ball, and no position.

use std::fmt::Write;
use std::path::Path;

use nalgebra::Vector3;

use super::proposal::{shown, units};
use super::{FITS, Guess};
use crate::identify::problem::Use;
use crate::import::ImportOptions;
use crate::import::column_map::ColumnMap;
use crate::import::generic::by_map;
use crate::import::initial_setup::flanges;
use crate::import::unknown_table::Table;
use crate::measure::dataset::{Dataset, Measured, NamedDataset};
use crate::residuals::misfit::data_fit;
use crate::robot::{JointKind, Robot};
use crate::units::MM;

/// Words for what is touched.
const NAMES: [&str; 9] = ["ball", "sphere", "hole", "socket", "nest", "pin", "target", "point", "seat"];
/// Fewest touches of a ball.
const TOUCHES: usize = 4;

/// Proposes a map for touches of balls; `None` if the table does not show them, or they do not fit.
pub(super) fn guess(path: &Path, table: &Table, robot: &Robot, reference: &str, joints: &[usize]) -> Option<Guess> {
    let is_name = |stem: &str| NAMES.iter().any(|word| stem.contains(word));
    let repeated = |k: &usize| {
        let labels = &table.columns[*k].labels;
        !labels.is_empty() && labels.len() * TOUCHES <= table.rows
    };
    let ball = (0..table.columns.len()).filter(repeated).find(|&k| !joints.contains(&k) && is_name(&table.columns[k].stem))?;
    let touches = Touches { table, robot, reference, joints, ball };
    let of_unit = |unit: &'static str| {
        let start = touches.map(unit, None);
        let read = |text: &str| {
            let (map, dataset) = ColumnMap::parse(Path::new("map"), text, Path::new("")).ok()?;
            by_map(&map, dataset, &[path.to_path_buf()], &ImportOptions::default().sets).ok().map(|(dataset, _)| dataset)
        };
        let places = places(&read(&start)?);
        let text = touches.map(unit, Some(&places));
        let dataset = read(&text)?;
        let residual = data_fit(&[NamedDataset::new("", &dataset)], Use::All).first()?.nominal.residual;
        // An arm that hardly moves leaves little.
        let share = residual / spread(&dataset).max(f64::MIN_POSITIVE);
        Some((share, residual, text, dataset, unit))
    };
    let tried = units(table, joints, &["deg", "rad"]).into_iter().filter_map(of_unit);
    let (_, residual, map, dataset, unit) = tried.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|t| t.1 < FITS)?;
    let by =
        if units(table, joints, &["deg", "rad"]).len() == 1 { "as the titles say" } else { "which fit the nominal arm best" };
    let reasons = vec![
        format!("balls: {} of them, named by {}; nothing is known of where they are", dataset.balls.len(), table.title(ball)),
        format!("units: joints in {unit}, {by}"),
        format!("with tool and balls fitted, the nominal arm leaves {:.3} mm rms", residual / MM),
    ];
    Some(Guess { map, reasons, shown: shown(&dataset), residual, dataset })
}

/// Columns of touches.
struct Touches<'a> {
    table: &'a Table,
    robot: &'a Robot,
    reference: &'a str,
    joints: &'a [usize],
    /// The column that names the ball.
    ball: usize,
}

impl Touches<'_> {
    /// The map, with the balls at these places, m.
    fn map(&self, unit: &str, places: Option<&[Vector3<f64>]>) -> String {
        let &Touches { table, robot, reference, joints, ball } = self;
        let mut map = table.layout();
        map.push_str("kind = \"ball\"\n\n[columns]\n");
        for (i, &k) in joints.iter().enumerate() {
            let slide = table.columns[k].unit.filter(|unit| ["mm", "m", "um"].contains(unit)).unwrap_or("m");
            let unit = if robot.kind(i) == JointKind::Revolute { unit } else { slide };
            _ = writeln!(map, "q{} = {{ column = {}, unit = \"{unit}\" }}", i + 1, table.named(k));
        }
        _ = writeln!(map, "ball = {{ column = {} }}", table.named(ball));
        _ = write!(
            map,
            "\n[dataset]\nrobot = \"{reference}\"\n\n[dataset.base]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 0.0\n\n# The tip, in the frame of the flange: fitted, from 0, 0, 0.\n[dataset.tool]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 0.0\nfree = true\n"
        );
        for (k, label) in table.columns[ball].labels.iter().enumerate() {
            let at = places.and_then(|p| p.get(k)).copied().unwrap_or_default() / MM;
            let id = label.replace('\\', "\\\\").replace('"', "\\\"");
            _ = write!(
                map,
                "\n[[dataset.ball]]\nid = \"{id}\"\nx_mm = {:.1}\ny_mm = {:.1}\nz_mm = {:.1}\nfree = true\n",
                at.x, at.y, at.z
            );
        }
        map
    }
}

/// Mean place of the flange while each ball is touched, m.
fn places(dataset: &Dataset) -> Vec<Vector3<f64>> {
    let mut sums = vec![(Vector3::zeros(), 0.0); dataset.balls.len()];
    for (sample, flange) in dataset.samples.iter().zip(flanges(dataset)) {
        if let Measured::Ball { ball, .. } = sample.measured {
            sums[ball].0 += flange.translation.vector;
            sums[ball].1 += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { sum }).collect()
}

/// Rms distance of the flange from its mean, m.
fn spread(dataset: &Dataset) -> f64 {
    let all: Vec<Vector3<f64>> = flanges(dataset).map(|flange| flange.translation.vector).collect();
    let count = all.len().max(1) as f64;
    let mean = all.iter().sum::<Vector3<f64>>() / count;
    (all.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / count).sqrt()
}
