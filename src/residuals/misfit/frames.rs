//! Robust fit of bases, free tools and free balls to the nominal arm, in spite of a few gross rows.
//!
//! Start in closed form (Kabsch), Student-t weights (nu 4) by Levenberg-Marquardt, then least squares without the rows
//! excluded.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Translation3, Vector3};

use super::campaign::{Campaign, Seen};
use super::row_blocks::RowBlocks;
use crate::math::CHI2_MEDIAN;
use crate::math::positive_definite::cholesky;
use crate::math::rigid_fit;
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, Pose, Robot};

/// Degrees of freedom of the t distribution.
pub(super) const NU: f64 = 4.0;
/// A row is excluded if its residual exceeds this many standard deviations per axis.
const SET_ASIDE: f64 = 10.0;
/// Smallest standard deviation per axis, m: rounding in files.
const FINEST: f64 = 1e-8;
/// Largest number of steps of the robust fit.
const STEPS: usize = 25;
/// Largest number of steps of the least squares after it.
const LAST_STEPS: usize = 4;
/// A fit ends at a step shorter than this, m and rad.
const AT_REST: f64 = 1e-8;
/// Share of the rows kept for a trimmed start.
const TRIMMED: f64 = 0.7;

/// Poses of the bases, positions of tools, balls and anchors.
#[derive(Debug, Clone)]
pub(super) struct Frames {
    pub bases: Vec<Pose>,
    pub tools: Vec<Vector3<f64>>,
    pub balls: Vec<Vector3<f64>>,
    pub anchors: Vec<Vector3<f64>>,
}

/// Fitted frames and their residuals.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub frames: Frames,
    /// Length of the residual of each row, then of each known distance between balls, m.
    pub misses: Vec<f64>,
    /// Rms in 3-D of the rows not excluded, m.
    pub robust: f64,
    /// The same of all rows, m.
    pub plain: f64,
    /// Number of scalar residuals minus number of unknowns.
    pub dof: isize,
    /// Number of unknowns.
    pub unknowns: usize,
}

/// Index of the first unknown of each frame; `None` if the frame is not fitted.
struct Unknowns {
    base: Vec<Option<usize>>,
    tool: Vec<Option<usize>>,
    ball: Vec<Option<usize>>,
    anchor: Vec<Option<usize>>,
    count: usize,
}

impl Unknowns {
    fn of(campaign: &Campaign) -> Unknowns {
        let mut count = 0;
        let mut take = |wanted: bool, size: usize| {
            wanted.then(|| {
                count += size;
                count - size
            })
        };
        let base = campaign.places.iter().map(|p| take(p.base_free, 6)).collect();
        let tool = campaign.places.iter().map(|p| take(p.tool_free, 3)).collect();
        let ball = (0..campaign.balls.len()).map(|b| take(campaign.balls[b].free && campaign.probes(b), 3)).collect();
        let anchor = campaign.anchors.iter().map(|a| take(a.free, 3)).collect();
        Unknowns { base, tool, ball, anchor, count }
    }
}

/// Flange poses of the nominal arm relative to its base.
pub(super) fn flanges(robot: &Robot, campaign: &Campaign) -> Vec<Pose> {
    let origin = FramePose::default();
    campaign.shots.iter().map(|shot| world_from_tool(robot, &origin, &origin, &shot.q)).collect()
}

/// Lengths of the residuals of a campaign at given frames, m.
pub(super) fn misses(campaign: &Campaign, frames: &Frames) -> Vec<f64> {
    let flanges = flanges(&campaign.robot, campaign);
    FrameFit::new(campaign, &flanges).misses(frames)
}

/// A fit of the frames to flange poses.
pub(super) struct FrameFit<'a> {
    campaign: &'a Campaign,
    flanges: &'a [Pose],
    unknowns: Unknowns,
    tool_turns: Vec<Rotation3<f64>>,
}

impl<'a> FrameFit<'a> {
    pub fn new(campaign: &'a Campaign, flanges: &'a [Pose]) -> Self {
        let turn = |p: &super::campaign::Place| FramePose { xyz: [0.0; 3], ..p.tool }.pose().rotation;
        let tool_turns = campaign.places.iter().map(turn).collect();
        FrameFit { campaign, flanges, unknowns: Unknowns::of(campaign), tool_turns }
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.unknowns.count
    }

    /// Point in the last frame that a row brings to its target: the TCP, or the centre of the ball according to the
    /// reading.
    fn tip(&self, shot: usize, tools: &[Vector3<f64>]) -> Vector3<f64> {
        let of = &self.campaign.shots[shot];
        match of.seen {
            Seen::Ball { reading, .. } => tools[of.setup] + self.tool_turns[of.setup] * reading,
            _ => tools[of.setup],
        }
    }

    /// Fits the frames, starting from these tool positions, and with bases turned by this about their own axes.
    pub fn from(&self, tools: Vec<Vector3<f64>>, turn: Rotation3<f64>) -> Fitted {
        let mut frames = self.start(tools);
        frames.bases.iter_mut().for_each(|base| base.rotation *= turn);
        self.robust(&mut frames);
        let kept = self.kept(&self.misses(&frames));
        self.least_squares(&mut frames, &kept);
        self.fitted(frames, &kept)
    }

    fn fitted(&self, frames: Frames, kept: &[bool]) -> Fitted {
        let misses = self.misses(&frames);
        let rms = |takes: &dyn Fn(usize) -> bool| {
            let squares: Vec<f64> = (0..misses.len()).filter(|&k| takes(k)).map(|k| misses[k].powi(2)).collect();
            (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
        };
        let (robust, plain) = (rms(&|k| kept[k]), rms(&|_| true));
        let height = |shot: &super::campaign::Shot| if matches!(shot.seen, Seen::Distance { .. }) { 1 } else { 3 };
        let rows: usize = self.campaign.shots.iter().map(height).sum::<usize>() + self.campaign.ties.len();
        let unknowns = self.unknowns.count;
        Fitted { frames, misses, robust, plain, dof: rows as isize - unknowns as isize, unknowns }
    }

    /// Starting values: bases in closed form, tools as given, free balls at the mean position found by the arm.
    fn start(&self, tools: Vec<Vector3<f64>>) -> Frames {
        let campaign = self.campaign;
        let mut placed: Vec<Option<Vector3<f64>>> = campaign.balls.iter().map(|b| (!b.free).then_some(b.position)).collect();
        let mut bases = Vec::with_capacity(campaign.places.len());
        for (s, place) in campaign.places.iter().enumerate() {
            let of_setup: Vec<usize> = (0..campaign.shots.len()).filter(|&k| campaign.shots[k].setup == s).collect();
            let tcp = |k: usize| self.flanges[k].transform_point(&self.tip(k, &tools).into()).coords;
            let pair = |&k: &usize| match campaign.shots[k].seen {
                Seen::Point(point) => Some((tcp(k), point)),
                Seen::Ball { ball, .. } => placed[ball].map(|at| (tcp(k), at)),
                Seen::Distance { .. } => None,
            };
            let pairs: Vec<_> = of_setup.iter().filter_map(pair).collect();
            let fitted = if place.base_free { trimmed_rigid_fit(&pairs) } else { None };
            let base = fitted.unwrap_or_else(|| place.base.pose());
            let mut sums: Vec<(Vector3<f64>, f64)> = vec![(Vector3::zeros(), 0.0); campaign.balls.len()];
            for &k in &of_setup {
                if let Seen::Ball { ball, .. } = campaign.shots[k].seen {
                    sums[ball].0 += base.transform_point(&tcp(k).into()).coords;
                    sums[ball].1 += 1.0;
                }
            }
            for (at, (sum, count)) in placed.iter_mut().zip(sums) {
                if at.is_none() && count > 0.0 {
                    *at = Some(sum / count);
                }
            }
            bases.push(base);
        }
        let balls = placed.iter().zip(&campaign.balls).map(|(at, b)| at.unwrap_or(b.position)).collect();
        let anchors = campaign.anchors.iter().map(|a| a.position).collect();
        Frames { bases, tools, balls, anchors }
    }

    /// Derivatives and residual of a row, or, with an index beyond the rows, of a known distance between balls.
    pub fn row(&self, k: usize, frames: &Frames) -> RowBlocks {
        let Unknowns { base, tool, ball, anchor, .. } = &self.unknowns;
        let Some(shot) = self.campaign.shots.get(k) else {
            let tie = &self.campaign.ties[k - self.campaign.shots.len()];
            let [a, b] = tie.between;
            let apart = frames.balls[a] - frames.balls[b];
            let mut row = RowBlocks::new(Vector3::zeros());
            for (place, sign) in [(ball[a], 1.0), (ball[b], -1.0)] {
                place.into_iter().for_each(|p| row.add(p, Matrix3::identity() * sign));
            }
            row.along(&apart.normalize(), tie.distance - apart.norm());
            return row;
        };
        let s = shot.setup;
        let held = frames.bases[s] * self.flanges[k];
        let tcp = held.transform_point(&self.tip(k, &frames.tools).into()).coords;
        let target = match shot.seen {
            Seen::Ball { ball, .. } => frames.balls[ball],
            Seen::Point(point) => point,
            Seen::Distance { anchor: a, .. } => frames.anchors[a],
        };
        let mut row = RowBlocks::new(target - tcp);
        if let Some(place) = base[s] {
            row.add(place, Matrix3::identity());
            row.add(place + 3, -(tcp - frames.bases[s].translation.vector).cross_matrix());
        }
        tool[s].into_iter().for_each(|place| row.add(place, *held.rotation.matrix()));
        match shot.seen {
            Seen::Ball { ball: b, .. } => ball[b].into_iter().for_each(|place| row.add(place, -Matrix3::identity())),
            Seen::Point(_) => {}
            Seen::Distance { anchor: a, distance } => {
                anchor[a].into_iter().for_each(|place| row.add(place, -Matrix3::identity()));
                let sight = tcp - target;
                row.along(&sight.normalize(), distance - sight.norm());
            }
        }
        row
    }

    fn rows(&self) -> usize {
        self.campaign.shots.len() + self.campaign.ties.len()
    }

    /// Length of the residual of each row, m. The one residual of a distance is treated as a length in space.
    pub fn misses(&self, frames: &Frames) -> Vec<f64> {
        let miss = |k: usize| self.row(k, frames).residual.norm();
        (0..self.rows()).map(miss).collect()
    }

    fn robust(&self, frames: &mut Frames) {
        let mut damping = 1e-9;
        for _ in 0..STEPS {
            let misses = self.misses(frames);
            let variance = scale(&misses);
            let cost = |misses: &[f64]| misses.iter().map(|d| (d * d / (NU * variance)).ln_1p()).sum::<f64>();
            let before = cost(&misses);
            let weights: Vec<f64> = misses.iter().map(|d| (NU + 3.0) / (NU + d * d / variance)).collect();
            let mut moved = None;
            for _ in 0..6 {
                let Some(step) = self.step(frames, &weights, damping) else { break };
                let next = self.moved(frames, &step);
                if cost(&self.misses(&next)) <= before {
                    damping = (damping * 0.1).max(1e-12);
                    moved = Some((next, step.norm()));
                    break;
                }
                damping = (damping * 30.0).max(1e-6);
            }
            let Some((next, length)) = moved else { return };
            *frames = next;
            if length < AT_REST {
                return;
            }
        }
    }

    fn least_squares(&self, frames: &mut Frames, kept: &[bool]) {
        let weights: Vec<f64> = kept.iter().map(|k| f64::from(u8::from(*k))).collect();
        let squares = |frames: &Frames| self.misses(frames).iter().zip(&weights).map(|(d, w)| w * d * d).sum::<f64>();
        for _ in 0..LAST_STEPS {
            let Some(step) = self.step(frames, &weights, 1e-12) else { return };
            let next = self.moved(frames, &step);
            if squares(&next) > squares(frames) {
                return;
            }
            *frames = next;
            if step.norm() < AT_REST {
                return;
            }
        }
    }

    /// For each row, true if it is not excluded.
    fn kept(&self, misses: &[f64]) -> Vec<bool> {
        let most = SET_ASIDE * scale(misses).sqrt().max(FINEST);
        misses.iter().map(|d| *d <= most).collect()
    }

    /// A damped Gauss-Newton step; `None` if it is not finite.
    fn step(&self, frames: &Frames, weights: &[f64], damping: f64) -> Option<DVector<f64>> {
        let n = self.unknowns.count;
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (k, &w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let row = self.row(k, frames);
            for (i, (at, a)) in row.blocks[..row.used].iter().enumerate() {
                let weighted = a.transpose() * w;
                let mut part = right.fixed_rows_mut::<3>(*at);
                part += weighted * row.residual;
                for (to, b) in &row.blocks[..=i] {
                    let block = weighted * b;
                    let (low, high, block) = if at >= to { (*at, *to, block) } else { (*to, *at, block.transpose()) };
                    let mut cells = normal.fixed_view_mut::<3, 3>(low, high);
                    cells += block;
                }
            }
        }
        // Directions that the data do not determine remain unchanged.
        let size = normal.diagonal().max().max(f64::MIN_POSITIVE);
        for k in 0..n {
            normal[(k, k)] = normal[(k, k)] * (1.0 + damping) + 1e-13 * size;
        }
        let step = cholesky(normal).ok()?.solve(&right);
        step.iter().all(|x| x.is_finite()).then_some(step)
    }

    /// Frames after a step of the unknowns; what follows those in the step is left out.
    pub fn moved(&self, frames: &Frames, step: &DVector<f64>) -> Frames {
        let Unknowns { base, tool, ball, anchor, .. } = &self.unknowns;
        let mut moved = frames.clone();
        for (pose, place) in moved.bases.iter_mut().zip(base) {
            if let Some(at) = *place {
                let shift = Vector3::new(step[at], step[at + 1], step[at + 2]);
                let turn = Rotation3::new(Vector3::new(step[at + 3], step[at + 4], step[at + 5]));
                *pose = Pose::from_parts(Translation3::from(pose.translation.vector + shift), turn * pose.rotation);
            }
        }
        let points = moved.tools.iter_mut().zip(tool).chain(moved.balls.iter_mut().zip(ball));
        for (xyz, place) in points.chain(moved.anchors.iter_mut().zip(anchor)) {
            if let Some(at) = *place {
                *xyz += Vector3::new(step[at], step[at + 1], step[at + 2]);
            }
        }
        moved
    }
}

/// Variance per axis, estimated from the median, m².
pub(super) fn scale(misses: &[f64]) -> f64 {
    let mut squares: Vec<f64> = misses.iter().map(|d| d * d).collect();
    if squares.is_empty() {
        return FINEST * FINEST;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / CHI2_MEDIAN[2]).max(FINEST * FINEST)
}

/// Rigid motion between pairs, refitted without the pairs of largest residual.
fn trimmed_rigid_fit(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Pose> {
    let mut pose = rigid_fit(pairs)?;
    for _ in 0..3 {
        let mut misses: Vec<(f64, usize)> = pairs
            .iter()
            .enumerate()
            .map(|(k, (from, to))| ((pose.rotation * from + pose.translation.vector - to).norm_squared(), k))
            .collect();
        misses.sort_by(|a, b| a.0.total_cmp(&b.0));
        misses.truncate((TRIMMED * pairs.len() as f64).ceil() as usize);
        let kept: Vec<_> = misses.iter().map(|&(_, k)| pairs[k]).collect();
        let Some(next) = rigid_fit(&kept) else { return Some(pose) };
        pose = next;
    }
    Some(pose)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::identify::problem::Use;
    use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
    use crate::robot::built_in;

    #[test]
    fn frames_are_found_beside_gross_rows() {
        let robot = built_in("ur5").expect("built in");
        let base = FramePose { xyz: [1.2, -0.4, 0.3], rz_ry_rx: [2.0, 0.3, -0.7] };
        let tool = FramePose { xyz: [0.03, -0.05, 0.11], ..FramePose::default() };
        let mut dataset = Dataset { robot: Arc::new(robot), tool_free: true, ..Dataset::default() };
        for k in 0..40 {
            let q: Vec<f64> = (0..6).map(|j| ((k * (2 * j + 3)) as f64).sin()).collect();
            let mut point = world_from_tool(&dataset.robot, &base, &tool, &q).translation.vector;
            if k % 8 == 3 {
                point.x += 0.4;
            }
            dataset.samples.push(Sample::new(k.to_string(), q, Measured::Point(point)));
        }
        let campaign = Campaign::of(&[NamedDataset::new("d", &dataset)], Use::All).expect("rows");
        let fitted = super::super::starts::fit(&campaign);
        assert!((fitted.frames.tools[0] - Vector3::from(tool.xyz)).norm() < 1e-7, "{:?}", fitted.frames.tools);
        assert!(fitted.robust < 1e-7 && (fitted.plain - 0.4 / 8f64.sqrt()).abs() < 1e-6, "{} {}", fitted.robust, fitted.plain);
    }
}
