//! What is told of positions one after another: joint limits, singularities and steps by the stretch of a path on which they are.

use std::collections::HashMap;

use super::rewritten::Rewritten;
use super::scan::{Position, Remark};
use calibench::compensate::Desired;
use calibench::robot::rotation_vector;
use calibench::units::{DEG, MM, UM};

/// Neighbouring positions of a path are nearer to each other than this, m and rad.
const NEIGHBOURS: [f64; 2] = [10.0 * MM, 5.0 * DEG];

/// Largest step of the compensation between neighbours that is not told, m.
const STEP: f64 = 10.0 * UM;

/// Change of the compensation along a path that identified deviations cause, m per m, and m per rad: a hundredth of the way, and
/// of half a metre from the wrist.
const GRADIENT: [f64; 2] = [0.01, 0.005];

/// A stretch of positions of which the same is told.
struct Stretch {
    first: String,
    last: String,
    last_line: usize,
    /// Index of the last position among those of the file.
    last_index: usize,
    count: usize,
    remark: Remark,
}

/// Remarks on the positions of a file, in their order.
#[derive(Default)]
pub(super) struct Stretches {
    stretches: Vec<Stretch>,
    /// The latest stretch of each reason.
    latest: HashMap<String, usize>,
}

impl Stretches {
    /// Tells of a position, by its index among those of the file; with the one before, where the same was told of it.
    pub fn tell(&mut self, index: usize, position: &Position, reason: &str, remedy: &str, blocks: bool) {
        let (line, name) = (position.line, position.name.clone());
        let latest = self.latest.get(reason).and_then(|at| self.stretches.get_mut(*at));
        if let Some(stretch) =
            latest.filter(|s| s.last_index + 1 == index && s.remark.remedy == remedy && s.remark.blocks == blocks)
        {
            (stretch.last, stretch.last_line, stretch.last_index) = (name, line, index);
            stretch.count += 1;
            return;
        }
        let remark = Remark { line, what: name.clone(), reason: reason.into(), remedy: remedy.into(), blocks };
        self.latest.insert(reason.into(), self.stretches.len());
        self.stretches.push(Stretch { first: name.clone(), last: name, last_line: line, last_index: index, count: 1, remark });
    }

    /// One remark a stretch.
    pub fn remarks(self) -> impl Iterator<Item = Remark> {
        self.stretches.into_iter().map(|stretch| {
            let Stretch { first, last, last_line, count, mut remark, .. } = stretch;
            if count > 1 {
                remark.what = if first == last { first } else { format!("{first} to {last}") };
                remark.reason = format!("{} ({count} positions, to line {last_line})", remark.reason);
            }
            remark
        })
    }
}

/// The step of the compensation from a position to its neighbour, m, with the joint that turns most and its angle, rad; `None`
/// where there is none, or where the program has one itself.
pub(super) struct Step {
    /// Change of the compensation, m.
    pub size: f64,
    /// Index of the joint.
    pub joint: usize,
    /// Its angle, rad.
    pub angle: f64,
}

/// The step from one position to the next, in one tool and base.
pub(super) fn step(from: &Rewritten, to: &Rewritten) -> Option<Step> {
    let (Desired::Pose { pose: a, .. }, Desired::Pose { pose: b, .. }) = (&from.target.desired, &to.target.desired) else {
        return None;
    };
    let apart = a.inverse() * b;
    let (way, turn) = (apart.translation.vector.norm(), rotation_vector(&apart.rotation).norm());
    let [[near, narrow], [per_m, per_rad]] = [NEIGHBOURS, GRADIENT];
    if way > near || turn > narrow {
        return None;
    }
    let [ax, ay, az] = from.shift()?;
    let [bx, by, bz] = to.shift()?;
    let size = ((bx - ax).powi(2) + (by - ay).powi(2) + (bz - az).powi(2)).sqrt();
    let turned = from.fake.q.iter().zip(&to.fake.q).map(|(a, b)| (b - a).abs()).enumerate();
    let (joint, angle) = turned.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (size > STEP + per_m * way + per_rad * turn).then_some(Step { size, joint, angle })
}
