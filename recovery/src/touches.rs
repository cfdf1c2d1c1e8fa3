//! Touches to make: postures that tell zeros and tool apart best, and the one that tells two combinations apart.

use nalgebra::{DMatrix, DVector, Unit, Vector3};

use super::scene::{Movable, Scene};
use super::search::{Solution, not_finite};
use super::{Earlier, RecoveryError};
use calibench::identify::problem::{Parameter, Problem, Use};
use calibench::math::ScaledCholesky;
use calibench::measure::dataset::{Ball, Dataset, Measured, NamedDataset, Sample};
use calibench::measure::poses::free_poses::{FreePosesRequest, free_poses};
use calibench::measure::poses::pool::{PoolError, PoolRequest, ProbedBall, feasible_pool};
use calibench::planning::pool::CellLayout;
use calibench::robot::kinematics::world_from_tool;

/// Postures from which touches are chosen: twice as many lower the worst uncertainty by a few per cent.
const CANDIDATES: usize = 240;

/// Postures tried to tell two combinations apart.
const TRIED: usize = 60;

/// Displacement of a touch, in units of its noise, from which it tells two combinations apart.
const TOLD_APART: f64 = 3.0;

/// Wanted standard uncertainty of a zero, rad: it displaces a TCP a metre away as far as that of the tool.
const WANTED_ZERO: f64 = 5e-5;

/// Wanted standard uncertainty of a coordinate of the TCP, m: half of what old programs are to be right to (docs/after-a-crash.md).
const WANTED_TOOL: f64 = 5e-5;

/// Direction in which a gauge leaves a ball, in the tool's axes.
const RETREAT: [f64; 3] = [1.0, 1.0, 1.0];

/// A posture for a touch.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedTouch {
    /// Joints, rad (N).
    pub q: Vec<f64>,
    /// The ball or pin, by index; `None` for a point of a tracker.
    pub ball: Option<usize>,
    /// Joints clear of the ball, rad (N); empty for a point of a tracker.
    pub approach: Vec<f64>,
}

/// Chooses `count` postures in the cell of a dataset whose touches show the zeros of all joints, and the tool, best: of its balls or
/// pins if it has any, of a tracker's points otherwise. Its samples are not used. The robot and the balls alone are kept clear of.
///
/// # Errors
/// When no posture reaches a ball, or the set-up does not belong to what was known.
pub fn plan_touches(
    earlier: Earlier<'_>,
    cell: NamedDataset<'_>,
    count: usize,
    instrument_moved: bool,
    seed: u64,
) -> Result<Vec<PlannedTouch>, RecoveryError> {
    let pool = candidates(cell.dataset, CANDIDATES, seed)?;
    let chosen = telling_most(earlier, cell, &pool, count, instrument_moved)?;
    Ok(chosen.into_iter().map(|k| pool[k].clone()).collect())
}

/// Chooses `count` of the samples of a campaign whose touches show the zeros of all joints, and the tool, best: the arm has been
/// there. Returns their indices.
///
/// # Errors
/// When the campaign does not belong to what was known.
pub fn choose_touches(
    earlier: Earlier<'_>,
    campaign: NamedDataset<'_>,
    count: usize,
    instrument_moved: bool,
) -> Result<Vec<usize>, RecoveryError> {
    let touch = |s: &Sample| {
        let ball = match s.measured {
            Measured::Ball { ball, .. } => Some(ball),
            _ => None,
        };
        PlannedTouch { q: s.q.clone(), ball, approach: Vec::new() }
    };
    let pool: Vec<PlannedTouch> = campaign.dataset.samples.iter().map(touch).collect();
    telling_most(earlier, campaign, &pool, count, instrument_moved)
}

/// The touches of a pool, by index, that together tell most.
fn telling_most(
    earlier: Earlier<'_>,
    cell: NamedDataset<'_>,
    pool: &[PlannedTouch],
    count: usize,
    instrument_moved: bool,
) -> Result<Vec<usize>, RecoveryError> {
    let data = as_samples(cell.dataset, pool);
    let scene = Scene::new(&earlier, NamedDataset::new(cell.name, &data), instrument_moved)?;
    let near = scene.near(&scene.mean);
    let mut covariance = scene.covariance.clone();
    let sought: Vec<Movable> = {
        let zero = |m: &Movable| Movable { sigma: WANTED_ZERO, ..*m };
        let tool = |m: &Movable| Movable { sigma: WANTED_TOOL, ..*m };
        scene.zeros.iter().map(zero).chain(scene.tool.iter().map(tool)).collect()
    };
    for m in scene.zeros.iter().chain(&scene.tool) {
        covariance[(m.parameter, m.parameter)] += m.sigma.powi(2);
    }
    let mut rows = Vec::with_capacity(pool.len());
    scene.problem.for_each_sample(scene.mean.as_slice(), &mut |at| {
        rows.push(near.jacobian.rows(at.first_row, at.rows).into_owned());
    });
    let mut chosen: Vec<usize> = Vec::with_capacity(count);
    while chosen.len() < count.min(pool.len()) {
        let mut best: Option<(usize, f64, Update)> = None;
        for k in (0..pool.len()).filter(|k| !chosen.contains(k)) {
            let update = Update::of(&rows[k], &covariance)?;
            let worth = |m: &Movable| {
                let left = covariance[(m.parameter, m.parameter)] - update.half.column(m.parameter).norm_squared();
                (left / (m.sigma * m.sigma)).max(0.0).ln_1p()
            };
            let left: f64 = sought.iter().map(worth).sum();
            if best.as_ref().is_none_or(|(_, least, _)| left < *least) {
                best = Some((k, left, update));
            }
        }
        let Some((k, _, update)) = best else { break };
        covariance -= update.half.tr_mul(&update.half);
        chosen.push(k);
    }
    Ok(chosen)
}

/// What a touch takes off the covariance of the parameters.
struct Update {
    /// Rows of the touch x parameters: its square is what is taken off.
    half: DMatrix<f64>,
}

impl Update {
    fn of(rows: &DMatrix<f64>, covariance: &DMatrix<f64>) -> Result<Self, RecoveryError> {
        let gain = covariance * rows.transpose();
        let mut seen = rows * &gain;
        (0..seen.nrows()).for_each(|k| seen[(k, k)] += 1.0);
        Ok(Update { half: ScaledCholesky::of(&seen).map_err(not_finite)?.half(gain.transpose()) })
    }
}

/// Postures in which the touches of a dataset's cell can be made, spread at random.
fn candidates(cell: &Dataset, count: usize, seed: u64) -> Result<Vec<PlannedTouch>, PoolError> {
    let layout = CellLayout::of_dataset(cell);
    let (robot, base, tool, margins) = (&cell.robot, &cell.base, &cell.tool, layout.margins);
    if cell.balls.is_empty() {
        let (surroundings, facing) = (&layout.surroundings, None);
        let found = free_poses(&FreePosesRequest { robot, base, tool, surroundings, margins, facing, count, seed })?;
        return Ok(found.into_iter().map(|q| PlannedTouch { q, ball: None, approach: Vec::new() }).collect());
    }
    let ball = |(b, outward): (&Ball, &Unit<Vector3<f64>>)| ProbedBall {
        id: b.id.clone(),
        centre: b.position,
        outward: *outward,
        body: None,
    };
    let balls: Vec<ProbedBall> = cell.balls.iter().zip(&layout.outward).map(ball).collect();
    let found = feasible_pool(&PoolRequest {
        robot,
        base,
        tool,
        balls: &balls,
        approach: Unit::new_normalize(Vector3::from(RETREAT)),
        approach_length: layout.retreat,
        cone: layout.cone,
        surroundings: &layout.without_artifact,
        margins,
        count_per_ball: count.div_ceil(balls.len()),
        seed,
    })?;
    Ok(found.into_iter().map(|c| PlannedTouch { q: c.q, ball: Some(c.ball), approach: c.q_approach }).collect())
}

/// The samples that a nominal robot would give in these postures.
fn as_samples(cell: &Dataset, touches: &[PlannedTouch]) -> Dataset {
    let sample = |(k, touch): (usize, &PlannedTouch)| {
        let measured = match touch.ball {
            Some(ball) => Measured::Ball { ball, reading: None },
            None => {
                let there = world_from_tool(&cell.robot, &cell.base, &cell.tool, &touch.q);
                Measured::Point(there.translation.vector)
            }
        };
        let like = cell.samples.first();
        Sample {
            payload: like.map_or(0, |s| s.payload),
            session: like.and_then(|s| s.session.clone()),
            sigma: like.and_then(|s| s.sigma),
            temp_c: like.and_then(|s| s.temp_c),
            time_s: like.and_then(|s| s.time_s),
            ..Sample::new(format!("t{:02}", k + 1), touch.q.clone(), measured)
        }
    };
    Dataset { samples: touches.iter().enumerate().map(sample).collect(), hash: String::new(), ..cell.clone() }
}

/// The posture whose touch tells two solutions apart best, if any does.
pub(super) fn telling(scene: &Scene, touches: NamedDataset<'_>, one: &Solution, other: &Solution) -> Option<Vec<f64>> {
    let used =
        |b: usize| touches.dataset.samples.iter().any(|s| matches!(s.measured, Measured::Ball { ball, .. } if ball == b));
    let pool: Vec<PlannedTouch> =
        candidates(touches.dataset, TRIED, 1).ok()?.into_iter().filter(|t| t.ball.is_none_or(used)).collect();
    let data = as_samples(touches.dataset, &pool);
    let there = Problem::new(&[NamedDataset::new(touches.name, &data)], &scene.model, Use::All).ok()?;
    let values = |solution: &Solution| -> DVector<f64> {
        let of = |p: &Parameter| {
            let here = scene.problem.parameters().iter().position(|q| q.name == p.name);
            here.map_or(0.0, |k| solution.values[k] + scene.problem.parameters()[k].start - p.start)
        };
        DVector::from_iterator(there.parameters().len(), there.parameters().iter().map(of))
    };
    let [a, b] = [one, other].map(|s| there.residuals(values(s).as_slice()));
    let mut noise = Vec::with_capacity(pool.len());
    there.for_each_sample(values(one).as_slice(), &mut |at| noise.push((at.variance / at.height.max(1) as f64).sqrt()));
    let apart = |k: usize| (a[k] - b[k]).norm() / noise[k];
    let best = (0..pool.len().min(a.len())).max_by(|&x, &y| apart(x).total_cmp(&apart(y)))?;
    (apart(best) >= TOLD_APART).then(|| pool[best].q.clone())
}
