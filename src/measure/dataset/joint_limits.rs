//! Rows outside the limits of a joint: true as often as not, since limits of a description are rarely those of the controller.

use std::f64::consts::TAU;
use std::fmt;

use super::{Dataset, Sample};
use crate::robot::{JointKind, Link, Robot};
use crate::units::{DEG, MM, Unit};

/// Excess over a limit that is never worth a word, rad.
const MARGIN: f64 = 1.0 * DEG;
/// The same for prismatic joints, m.
const SLIDE_MARGIN: f64 = 10.0 * MM;

/// The rows of a dataset that have one joint beyond its limit.
#[derive(Debug, Clone, PartialEq)]
pub struct BeyondLimit {
    /// Name of the joint's column without its unit: `q6`.
    pub joint: String,
    /// The position farthest beyond, rad or m.
    pub position: f64,
    /// The limit, rad or m.
    pub limit: f64,
    /// Unit in which positions of the joint are shown.
    pub unit: Unit,
    /// Number of such rows.
    pub rows: usize,
}

impl fmt::Display for BeyondLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let BeyondLimit { joint, unit, rows, .. } = self;
        let [position, limit] = [self.position, self.limit].map(|v| shown(v, unit.si));
        let rows = if *rows == 1 { "1 row".to_owned() } else { format!("{rows} rows") };
        write!(f, "{joint} = {position} {}, limit {limit}: {rows}, kept", unit.symbol)
    }
}

impl Dataset {
    /// The joints that are beyond a limit in some rows, each once; such rows are kept.
    pub fn beyond_limits(&self) -> Vec<BeyondLimit> {
        let one = |k: usize| {
            let excess = |s: &&Sample| s.q.get(k).map_or(0.0, |q| beyond(&self.robot.links[k], *q));
            let rows: Vec<&Sample> = self.samples.iter().filter(|s| excess(s) > margin(&self.robot.links[k])).collect();
            let farthest = rows.iter().max_by(|a, b| excess(a).total_cmp(&excess(b)))?;
            let (position, [low, high]) = (farthest.q[k], self.robot.links[k].limits);
            let limit = if position > high { high } else { low };
            Some(BeyondLimit {
                joint: format!("q{}", k + 1),
                position,
                limit,
                unit: self.robot.kind(k).unit(),
                rows: rows.len(),
            })
        };
        (0..self.robot.joints()).filter_map(one).collect()
    }

    /// Turns joints that are beyond their limits by whole turns to where they are within them, where they are: the arm stands
    /// the same. A remark for each such joint.
    pub(crate) fn whole_turns_undone(&mut self) -> Vec<String> {
        let mut remarks = Vec::new();
        for (k, link) in self.robot.links.iter().enumerate().filter(|(_, l)| l.mdh.kind == JointKind::Revolute) {
            let mut first: Option<[f64; 2]> = None;
            let mut rows = 0;
            for sample in &mut self.samples {
                let Some(q) = sample.q.get_mut(k) else { continue };
                let turned = [-TAU, TAU].map(|turn| *q + turn).into_iter().find(|t| beyond(link, *t) <= margin(link));
                if let (true, Some(turned)) = (beyond(link, *q) > margin(link), turned) {
                    first.get_or_insert([*q, turned]);
                    rows += 1;
                    let turn = turned - *q;
                    *q = turned;
                    if let Some(commanded) = sample.q_commanded.as_mut().and_then(|all| all.get_mut(k)) {
                        *commanded += turn;
                    }
                }
            }
            if let Some([from, to]) = first.map(|both| both.map(|q| shown(q, DEG))) {
                remarks.push(format!("q{} of {rows} rows, such as {from} deg, is taken as a whole turn away: {to} deg", k + 1));
            }
        }
        remarks
    }
}

/// The first joint at a position that no controller reports: more than two turns, or farther beyond the end of a rail than the
/// rail is long.
pub(super) fn impossible(robot: &Robot, q: &[f64]) -> Option<usize> {
    let is_impossible = |(link, q): (&Link, &f64)| match link.mdh.kind {
        JointKind::Revolute => q.abs() > 2.0 * TAU && beyond(link, *q) > MARGIN,
        JointKind::Prismatic => beyond(link, *q) > (link.limits[1] - link.limits[0]).max(SLIDE_MARGIN),
    };
    robot.links.iter().zip(q).position(is_impossible)
}

/// A position in its unit, to two decimals: limits in radians are rarely round in degrees.
fn shown(position: f64, unit: f64) -> f64 {
    (position / unit * 100.0).round() / 100.0
}

/// Distance beyond the nearer limit, rad or m; negative within them.
fn beyond(link: &Link, q: f64) -> f64 {
    (link.limits[0] - q).max(q - link.limits[1])
}

fn margin(link: &Link) -> f64 {
    match link.mdh.kind {
        JointKind::Revolute => MARGIN,
        JointKind::Prismatic => SLIDE_MARGIN,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::measure::dataset::Measured;
    use crate::robot::built_in;

    #[test]
    fn a_limit_is_named_once_and_its_rows_are_kept() {
        let mut data = Dataset { robot: Arc::new(built_in("panda").expect("built in")), ..Dataset::default() };
        for (k, q6) in [100.0, 217.7, 216.5].into_iter().enumerate() {
            let q = [0.0, 0.0, 0.0, -90.0, 0.0, q6, 0.0].map(|q: f64| q * DEG).to_vec();
            data.samples.push(Sample::new(k.to_string(), q, Measured::Point(nalgebra::Vector3::zeros())));
        }
        let said: Vec<String> = data.beyond_limits().iter().map(ToString::to_string).collect();
        assert_eq!(said, ["q6 = 217.7 deg, limit 215: 2 rows, kept"]);
    }

    #[test]
    fn a_joint_counted_from_0_to_360_deg_stands_a_whole_turn_away() {
        let mut data = Dataset { robot: Arc::new(built_in("panda").expect("built in")), ..Dataset::default() };
        let q = [306.6, 0.0, 0.0, -90.0, 0.0, 90.0, 0.0].map(|q: f64| q * DEG).to_vec();
        data.samples.push(Sample::new("1", q, Measured::Point(nalgebra::Vector3::zeros())));
        assert_eq!(data.whole_turns_undone(), ["q1 of 1 rows, such as 306.6 deg, is taken as a whole turn away: -53.4 deg"]);
        assert!((data.samples[0].q[0] + 53.4 * DEG).abs() < 1e-12);
        assert_eq!(data.whole_turns_undone(), Vec::<String>::new());
    }
}
