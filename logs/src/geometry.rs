//! Whether what was measured at the rests follows the arm at all: a test of a shift between clocks that knows no base and no tool.

use nalgebra::{DMatrix, DVector};

use calibench::robot::FramePose;
use calibench::robot::Robot;
use calibench::robot::kinematics::world_from_tool;

/// Joints nearer than this are the same posture, rad or m: a cycle of few postures fits itself at any shift.
const SAME: f64 = 0.01;
/// Fewest postures by which a shift is judged: a point of the tool has thirteen unknowns.
const FEWEST: usize = 20;
/// Numbers of a flange pose of which a measured coordinate is a sum: a place, a rotation and a constant.
const UNKNOWNS: usize = 13;
/// Columns by which it is judged: a point has three coordinates, and other columns of a table may have nothing to do with it.
const COORDINATES: usize = 3;
/// Relative size of a singular value that counts as zero.
const NONE: f64 = 1e-9;

/// How far the columns that follow the arm best are off from a point of a rigid tool in an unknown base, in parts of how far they
/// spread; `None` of too few rests.
pub(crate) fn misfit(robot: &Robot, postures: &[Vec<f64>], rows: &[Vec<f64>]) -> Option<f64> {
    let mut different: Vec<&Vec<f64>> = Vec::new();
    for posture in postures {
        let is_near = |other: &&Vec<f64>| other.iter().zip(posture).all(|(a, b)| (a - b).abs() < SAME);
        if different.len() < FEWEST && !different.iter().any(is_near) {
            different.push(posture);
        }
    }
    if different.len() < FEWEST {
        return None;
    }
    let mut features = DMatrix::from_element(postures.len(), UNKNOWNS, 1.0);
    for (r, q) in postures.iter().enumerate() {
        let flange = world_from_tool(robot, &FramePose::default(), &FramePose::default(), q);
        let turn = flange.rotation.matrix();
        for c in 0..3 {
            features[(r, c)] = flange.translation.vector[c];
        }
        for (k, value) in turn.iter().enumerate() {
            features[(r, 3 + k)] = *value;
        }
    }
    let width = rows.first().map_or(0, Vec::len);
    let svd = features.clone().svd(true, true);
    let mut off: Vec<f64> = (0..width)
        .filter_map(|c| {
            let column = DVector::from_iterator(rows.len(), rows.iter().map(|row| row[c]));
            let mean = column.mean();
            let spread = column.iter().map(|v| (v - mean).powi(2)).sum::<f64>().sqrt();
            let largest = column.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            if !spread.is_finite() || spread <= NONE * largest {
                return None;
            }
            let solved = svd.solve(&column, NONE * svd.singular_values.max()).ok()?;
            Some((&column - &features * solved).norm() / spread)
        })
        .collect();
    off.sort_unstable_by(f64::total_cmp);
    off.truncate(COORDINATES);
    (off.len() == COORDINATES).then(|| off.iter().sum::<f64>() / COORDINATES as f64)
}
