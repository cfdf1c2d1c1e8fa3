//! Touches to make: postures that tell zeros and tool apart best, and the one that tells two combinations apart.

use nalgebra::{DMatrix, DVector, Unit, Vector3};

use super::scene::Scene;
use super::search::Solution;
use super::{Earlier, RecoveryError};
use crate::identify::problem::Parameter;
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use crate::measure::poses::free_poses::{FreePosesRequest, free_poses};
use crate::measure::poses::pool::{PoolError, PoolRequest, ProbedBall, feasible_pool};
use crate::planning::pool::CellLayout;

/// Postures from which touches are chosen: twice as many lower the worst uncertainty by a few per cent.
const CANDIDATES: usize = 240;

/// Postures tried to tell two combinations apart.
const TRIED: usize = 60;

/// Displacement of a touch, in units of its noise, from which it tells two combinations apart.
const TOLD_APART: f64 = 3.0;

/// Wanted standard uncertainties: of a zero, rad, and of a coordinate of the TCP, m, which displace a TCP a metre away alike.
const WANTED: [f64; 2] = [5e-5, 5e-5];

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
    let data = as_samples(cell.dataset, &pool);
    let scene = Scene::new(&earlier, NamedDataset::new(cell.name, &data), instrument_moved)?;
    let near = scene.near(&scene.mean);
    let mut covariance = scene.covariance.clone();
    let sought: Vec<(usize, f64)> = scene
        .zeros
        .iter()
        .map(|m| (m.parameter, WANTED[1]))
        .chain(scene.tool.iter().map(|m| (m.parameter, WANTED[0])))
        .collect();
    for m in scene.zeros.iter().chain(&scene.tool) {
        covariance[(m.parameter, m.parameter)] += m.sigma.powi(2);
    }
    let mut rows = Vec::with_capacity(pool.len());
    scene.problem.for_each_sample(scene.mean.as_slice(), &mut |at| {
        rows.push(near.jacobian.rows(at.first_row, at.rows).into_owned());
    });
    let mut chosen: Vec<usize> = Vec::with_capacity(count);
    while chosen.len() < count.min(pool.len()) {
        let left = |k: usize| {
            let (gain, root) = update(&rows[k], &covariance)?;
            let half = root.l().solve_lower_triangular(&gain.transpose())?;
            let worth = |&(p, wanted): &(usize, f64)| {
                ((covariance[(p, p)] - half.column(p).norm_squared()) / (wanted * wanted)).max(1e-9).ln_1p()
            };
            Some((k, sought.iter().map(worth).sum::<f64>()))
        };
        let free = (0..pool.len()).filter(|k| !chosen.contains(k));
        let Some((best, _)) = free.filter_map(left).min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if let Some((gain, root)) = update(&rows[best], &covariance) {
            let taken = &gain * root.solve(&gain.transpose());
            covariance -= taken;
        }
        chosen.push(best);
    }
    Ok(chosen.into_iter().map(|k| pool[k].clone()).collect())
}

/// Covariance of the parameters with the rows of a touch, and the root of the covariance of these.
fn update(rows: &DMatrix<f64>, covariance: &DMatrix<f64>) -> Option<(DMatrix<f64>, nalgebra::Cholesky<f64, nalgebra::Dyn>)> {
    let gain = covariance * rows.transpose();
    let mut seen = rows * &gain;
    (0..seen.nrows()).for_each(|k| seen[(k, k)] += 1.0);
    Some((gain, seen.cholesky()?))
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
    let ball = |(b, outward): (&crate::measure::dataset::Ball, &Unit<Vector3<f64>>)| ProbedBall {
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
                let there = crate::robot::kinematics::world_from_tool(&cell.robot, &cell.base, &cell.tool, &touch.q);
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
    let there = crate::identify::problem::Problem::new(
        &[NamedDataset::new(touches.name, &data)],
        &scene.model,
        crate::identify::problem::Use::All,
    )
    .ok()?;
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
