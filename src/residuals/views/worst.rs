//! The samples that fit worst, with remarks on what is special about them.

use nalgebra::Vector3;

use super::{SeenSample, ViewTest};
use crate::measure::dataset::Measured;
use crate::robot::{JointKind, Robot};
use crate::units::{MM, UM};

/// Number of samples shown.
pub(crate) const MOST_WORST: usize = 5;

/// A value is special if no more than this share of the samples is more extreme.
const EXTREME: f64 = 0.01;

/// Largest number of remarks per sample.
const MOST_REMARKS: usize = 3;

/// A sample that fits badly.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstSample {
    /// Name of the sample.
    pub id: String,
    /// Index of its set-up.
    pub setup: usize,
    /// Measured minus predicted, world axes, m.
    pub residual: Vector3<f64>,
    /// Root mean square of its components in units of the noise remaining after the fit.
    pub normalised: f64,
    /// Significance of so large a deviation among this number of samples.
    pub test: ViewTest,
    /// Remarks on what is special about it.
    pub remarks: Vec<String>,
}

/// Describes what is special about a sample among all.
pub(crate) fn remarks(robot: &Robot, all: &[SeenSample<'_>], place: usize) -> Vec<String> {
    let own = &all[place];
    let joints = own.joint_columns.len();
    let mut found: Vec<(f64, String)> = Vec::new();
    let mut look = |name: &str,
                    unit: &str,
                    scale: f64,
                    lowest: Option<&str>,
                    highest: &str,
                    of: &dyn Fn(&SeenSample<'_>) -> Option<f64>| {
        let Some(value) = of(own) else { return };
        let values = || all.iter().filter_map(of);
        let count = values().count() as f64;
        let share = |more: usize| more as f64 / count;
        // Ties count as more extreme, so they are not special.
        let (above, below) =
            (share(values().filter(|&v| v >= value).count() - 1), share(values().filter(|&v| v <= value).count() - 1));
        let shown = format!("{name} {} {unit}", significant(value / scale));
        if above <= EXTREME && count > 2.0 {
            found.push((above, format!("{shown}, {}{highest}", rank(above))));
        } else if let Some(lowest) = lowest.filter(|_| below <= EXTREME && count > 2.0) {
            found.push((below, format!("{shown}, {}{lowest}", rank(below))));
        }
    };
    for j in 0..joints {
        let unit = robot.kind(j).unit();
        look(&format!("q{}", j + 1), unit.symbol, unit.si, Some("lowest"), "highest", &|s| Some(s.sample.q[j]));
    }
    for j in 0..joints {
        let unit = if robot.kind(j) == JointKind::Prismatic { "N" } else { "N·m" };
        look(&format!("tau{}", j + 1), unit, 1.0, None, "largest", &|s| s.tau.get(j).map(|t| t.abs()));
    }
    look("reach", "mm", MM, Some("shortest"), "longest", &|s| Some(s.from_base.norm()));
    look("residual reading", "µm", UM, None, "largest", &|s| match &s.sample.measured {
        Measured::Ball { reading, .. } => reading.map(|r| r.norm()),
        Measured::Point(_) | Measured::Distance { .. } => None,
    });
    look("time", "s", 1.0, Some("first"), "last", &|s| s.sample.time_s);
    look("temperature", "°C", 1.0, Some("lowest"), "highest", &|s| s.sample.temp_c);
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(MOST_REMARKS);
    found.into_iter().map(|(_, words)| words).collect()
}

fn rank(share: f64) -> &'static str {
    if share == 0.0 { "the " } else { "among the " }
}

/// Formats with four significant digits.
fn significant(x: f64) -> String {
    let before = if x == 0.0 { 1 } else { x.abs().log10().floor() as i32 + 1 };
    format!("{x:.*}", (4 - before).clamp(0, 4) as usize)
}
