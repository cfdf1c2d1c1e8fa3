//! Whether what was measured at the rests follows the arm at all, and as a point of its tool or as a place that its tool sees: a test
//! that knows no base and no tool.

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
/// What is off by less than this share of how far it spreads goes with the arm: the nominal arm is a hundredth off, and what stands in
/// the room, or moves otherwise, is off by all of it.
const GOES: f64 = 0.5;

/// Postures of the rests in which a track states something, and what it states.
#[derive(Debug, Clone, Default)]
pub(crate) struct AtRests {
    pub postures: Vec<Vec<f64>>,
    pub rows: Vec<Vec<f64>>,
}

/// What the measured coordinates are of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Seen {
    /// A point of the tool, seen from the room.
    Tool,
    /// A place in the room, seen from the tool.
    Room,
}

/// How far the columns that follow the arm best are off from a point of a rigid tool in an unknown base (or from a place seen from the
/// tool), in parts of how far they spread; `None` of too few rests.
pub(crate) fn misfit(robot: &Robot, rests: &AtRests, seen: Seen) -> Option<f64> {
    let AtRests { postures, rows } = rests;
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
    let features = features(robot, postures, seen);
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

/// Of each posture the numbers of which every coordinate is a sum, where a place of a rigid tool is seen in a rigid room: the flange's
/// place, its rotation, and one.
pub(crate) fn features(robot: &Robot, postures: &[Vec<f64>], seen: Seen) -> DMatrix<f64> {
    let mut features = DMatrix::from_element(postures.len(), UNKNOWNS, 1.0);
    for (r, q) in postures.iter().enumerate() {
        let flange = world_from_tool(robot, &FramePose::default(), &FramePose::default(), q);
        let flange = if seen == Seen::Room { flange.inverse() } else { flange };
        let turn = flange.rotation.matrix();
        for c in 0..3 {
            features[(r, c)] = flange.translation.vector[c];
        }
        for (k, value) in turn.iter().enumerate() {
            features[(r, 3 + k)] = *value;
        }
    }
    features
}

/// Which of several places with orientations a row may hold together, and what is said of the others. Points of one tool share its
/// orientation; of places that the tool sees each has its own, and a row has room for that of one: the one that most rests show.
pub(crate) fn together(robot: &Robot, names: &[&str], all: &[AtRests]) -> (Vec<usize>, Vec<String>) {
    let places = all.iter().map(|AtRests { postures, rows }| AtRests {
        postures: postures.clone(),
        rows: rows.iter().map(|row| row[..COORDINATES].to_vec()).collect(),
    });
    let off: Vec<[Option<f64>; 2]> = places.map(|rests| [Seen::Tool, Seen::Room].map(|by| misfit(robot, &rests, by))).collect();
    let is_of_tool = |n: &usize| matches!(off[*n], [Some(tool), Some(room)] if tool < room.min(GOES));
    let of_tool: Vec<usize> = (0..all.len()).filter(is_of_tool).collect();
    // Of too few rests nothing is known.
    let goes = |n: usize| off[n].iter().all(Option::is_none) || off[n].iter().flatten().any(|off| *off < GOES);
    let best = (0..all.len()).rev().max_by_key(|&n| (goes(n), all[n].rows.len())).unwrap_or(0);
    let used = if of_tool.is_empty() { vec![best] } else { of_tool };
    let rests = |n: usize| format!("{} ({} rests)", names[n], all[n].rows.len());
    let kept: Vec<String> = used.iter().map(|&n| rests(n)).collect();
    let kept = kept.join(", ");
    let said = (0..all.len()).filter(|n| !used.contains(n)).map(|n| {
        format!(
            "{} is not used: it is not seen to be a further point of the tool, and a row holds the orientation of one, {kept}; to use it instead: --measured '{}' alone",
            rests(n),
            names[n]
        )
    });
    (used.clone(), said.collect())
}
