//! The arm and its residuals in space: its joints at every drawn sample, and the mean residual by region.
//!
//! Everything is in the axes of the robot's base: several set-ups have different worlds, and one robot.

use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};

use super::{short, shorts};
use calibench::identify::problem::Problem;
use calibench::units::{MM, UM};

/// Distance below which two neighbouring joints are drawn as one point, m.
const ONE_POINT: f64 = 1.0 * MM;

/// Number of cells of a map along the longer side of the data.
const CELLS: f64 = 6.0;

/// The arm at one sample, in the axes of the robot's base; m.
pub(super) struct ArmPose {
    /// Origins of the joints' frames from the base on, and the TCP.
    chain: Vec<Vector3<f64>>,
    /// Measured minus predicted.
    residual: Vector3<f64>,
}

impl ArmPose {
    /// The arm at every sample of a problem at `values` of its parameters.
    pub fn all(problem: &Problem, values: &[f64]) -> Vec<Self> {
        let joints = problem.robot().joints();
        let mut all = Vec::with_capacity(problem.sample_count());
        problem.for_each_sample(values, &mut |posed| {
            let base = posed.posture.frame(0);
            let world_from_base = Matrix3::from_columns(&[base.x, base.y, base.z]);
            let seen = |point: Vector3<f64>| world_from_base.tr_mul(&(point - base.o));
            let frames = (0..=joints).map(|k| seen(posed.posture.frame(k).o));
            let chain = frames.chain([seen(posed.posture.tcp())]).collect();
            all.push(ArmPose { chain, residual: world_from_base.tr_mul(&posed.residual) });
        });
        all
    }

    /// The TCP, m.
    fn tcp(&self) -> Vector3<f64> {
        self.chain[self.chain.len() - 1]
    }
}

/// The residuals of the drawn samples as arrows, um, three numbers each.
pub(super) fn arrows(stances: &[ArmPose], shown: &[usize]) -> Value {
    shown.iter().map(|&i| shorts((0..3).map(|k| (stances[i].residual[k] / UM * 10.0).round() / 10.0))).collect()
}

/// What a picture in space shows: the arm of every drawn sample, the arrows, the balls, and the maps of all samples. `ball_of` is the
/// index of a sample's ball.
pub(super) fn space(stances: &[ArmPose], shown: &[usize], ball_of: impl Fn(usize) -> Option<usize>) -> Value {
    let points = stances.first().map_or(0, |s| s.chain.len());
    // A joint that never leaves its neighbour is not drawn twice.
    let apart = |k: usize| stances.iter().any(|s| (s.chain[k] - s.chain[k - 1]).norm() > ONE_POINT);
    let kept: Vec<usize> = (0..points).filter(|&k| k == 0 || apart(k)).collect();
    let whole = |x: f64| (x / MM).round();
    let arm = |&i: &usize| -> Value {
        kept.iter().flat_map(|&k| stances[i].chain[k].iter().map(|x| json!(whole(*x) as i64)).collect::<Vec<_>>()).collect()
    };
    let mut balls: Vec<(Vector3<f64>, usize)> = Vec::new();
    for (i, stance) in stances.iter().enumerate() {
        let Some(ball) = ball_of(i) else { continue };
        balls.resize(balls.len().max(ball + 1), (Vector3::zeros(), 0));
        balls[ball].0 += stance.tcp() + stance.residual;
        balls[ball].1 += 1;
    }
    let mean = |(sum, n): &(Vector3<f64>, usize)| {
        if *n == 0 { Value::Null } else { shorts(sum.iter().map(|x| whole(x / *n as f64))) }
    };
    json!({
        "arms_mm": shown.iter().map(arm).collect::<Vec<_>>(),
        "arrows_um": arrows(stances, shown),
        "balls_mm": balls.iter().map(mean).collect::<Vec<_>>(),
        "maps": maps(stances),
    })
}

/// The mean length of the residual by region: from the side (distance from axis 1, height), and from above (x, y).
pub(super) fn maps(stances: &[ArmPose]) -> Value {
    let length = |s: &ArmPose| s.residual.norm();
    let side = |s: &ArmPose| [s.tcp().xy().norm(), s.tcp().z];
    let top = |s: &ArmPose| [s.tcp().x, s.tcp().y];
    json!({
        "side": map(stances.iter().map(|s| (side(s), length(s))).collect()),
        "top": map(stances.iter().map(|s| (top(s), length(s))).collect()),
    })
}

/// Square cells with the mean of the values in them; a cell in which nothing was measured is absent. Each is
/// `[from, to, from, to, mean, n]`, mm.
fn map(values: Vec<([f64; 2], f64)>) -> Value {
    let range = |axis: usize| {
        let of_axis = values.iter().map(|(at, _)| at[axis]);
        of_axis.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let ranges = [range(0), range(1)];
    let widest = ranges.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
    if !widest.is_finite() {
        return json!([]);
    }
    let side = round_length(widest / CELLS);
    let mut cells: std::collections::BTreeMap<[i64; 2], (f64, usize)> = std::collections::BTreeMap::new();
    for (at, value) in &values {
        let cell = cells.entry(at.map(|x| (x / side).floor() as i64)).or_default();
        cell.0 += value;
        cell.1 += 1;
    }
    let edges = |k: i64| [k as f64 * side / MM, (k + 1) as f64 * side / MM];
    let one = |([a, b], (sum, n)): ([i64; 2], (f64, usize))| -> Value {
        edges(a).into_iter().chain(edges(b)).map(short).chain([short(sum / n as f64 / MM), json!(n)]).collect()
    };
    cells.into_iter().map(one).collect()
}

/// The next larger length of 1, 2 or 5 times a power of ten, m; at least a millimetre.
fn round_length(x: f64) -> f64 {
    let x = x.max(MM);
    let power = 10f64.powf(x.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= x * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_tells_means_where_something_was_measured_and_nothing_elsewhere() {
        let values = vec![([0.01, 0.01], 2.0 * MM), ([0.09, 0.05], 4.0 * MM), ([0.51, 0.31], 1.0 * MM)];
        let map = map(values);
        assert_eq!(map, json!([[0.0, 100.0, 0.0, 100.0, 3.0, 2], [500.0, 600.0, 300.0, 400.0, 1.0, 1]]));
    }

    #[test]
    fn a_map_of_one_point_or_none_does_not_fail() {
        assert_eq!(super::map(vec![([0.1, 0.2], MM)]).as_array().map(Vec::len), Some(1));
        assert_eq!(super::map(Vec::new()), json!([]));
    }

    #[test]
    fn lengths_are_round() {
        assert_eq!([0.03, 0.05, 0.06, 0.11].map(|x| (round_length(x) * 1000.0).round()), [50.0, 50.0, 100.0, 200.0]);
    }
}
