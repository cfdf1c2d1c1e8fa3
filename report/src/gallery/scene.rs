//! The samples of a fit: the residual of each, and the part of it that an effect would explain.

use calibench::identify::calibration::IdentifyError;
use calibench::identify::fit::fit;
use calibench::identify::problem::{Problem, Use};
use calibench::identify::{BACKGROUND_WIDTH, Model};
use calibench::measure::dataset::{NamedDataset, Sample};
use calibench::residuals::views::SeenSample;
use nalgebra::{Rotation3, Vector3};

/// Shortest usable lever, as a share of the joint's longest in these data: with a shorter one, noise would look like a large
/// angle.
const SHORTEST_LEVER: f64 = 0.2;

/// Lever at or below which a joint's axis is taken to pass through the TCP, m/rad.
const LEAST_LEVER: f64 = 5e-3;

/// One sample.
pub struct Row<'a> {
    pub sample: &'a Sample,
    /// Name of the ball probed.
    pub ball: Option<&'a str>,
    /// Moments of the load about the joints, N·m.
    pub tau: Vec<f64>,
    /// Mass on the flange, kg.
    pub payload: f64,
    /// Joint angles of the sample before, in the order of measurement, rad.
    pub before: Option<&'a [f64]>,
    /// Displacement of the TCP per angle of each joint, world, m/rad; zero where the lever is too short to tell an angle.
    pub levers: Vec<Vector3<f64>>,
    pub world_from_tool: Rotation3<f64>,
    /// Measured minus predicted, world axes, m.
    pub residual: Vector3<f64>,
    /// Its change when the effect is fitted too and everything else is re-fitted.
    pub taken: Vector3<f64>,
    /// The same of the measured orientation, rad, in the axes of the tool.
    pub turn: Option<[Vector3<f64>; 2]>,
}

/// All samples.
pub struct Scene<'a> {
    pub rows: Vec<Row<'a>>,
    /// Number of joints.
    pub joints: usize,
    /// Names of the balls, in the order of the artifact.
    pub balls: Vec<String>,
    /// The masses on the flange, ascending, kg.
    pub payloads: Vec<f64>,
}

impl<'a> Scene<'a> {
    /// Fits `model` without and with `effect` to the rows of set `fit`; the effect may be as large as `times` its plausible
    /// size.
    ///
    /// # Errors
    /// If the data do not determine either.
    pub fn new(datasets: &[NamedDataset<'a>], model: &Model, effect: &str, times: f64) -> Result<Self, IdentifyError> {
        let problem = Problem::new(datasets, model, Use::Fit)?;
        let fitted = fit(&problem)?;
        let mut with = model.with(effect);
        if !with.is_unregularised(effect) {
            with.width.insert(effect.to_owned(), BACKGROUND_WIDTH * times.max(1.0));
        }
        let wider = Problem::new(datasets, &with, Use::Fit)?;
        let with = fit(&wider)?;
        let after = wider.residuals(&with.values);
        let turns = [problem.orientation_residuals(&fitted.values), wider.orientation_residuals(&with.values)];
        let samples: Vec<&Sample> =
            datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s))).collect();
        let joints = problem.robot().joints();
        let seen = SeenSample::all(&problem, &fitted.values, &samples, datasets);
        let longest = |j: usize| seen.iter().map(|s| s.joint_columns[j].norm()).fold(0.0, f64::max);
        let shortest: Vec<f64> = (0..joints).map(|j| (SHORTEST_LEVER * longest(j)).max(LEAST_LEVER)).collect();
        let usable = |(j, lever): (usize, &Vector3<f64>)| if lever.norm() > shortest[j] { *lever } else { Vector3::zeros() };
        let mut payloads: Vec<f64> = seen.iter().map(|s| s.payload).collect();
        payloads.sort_by(f64::total_cmp);
        payloads.dedup();
        let rows = seen.into_iter().zip(after).enumerate().map(|(k, (s, after))| Row {
            ball: s.ball().map(|b| datasets[s.dataset].dataset.balls[b].id.as_str()),
            before: before(&samples, k),
            levers: s.joint_columns.iter().enumerate().map(usable).collect(),
            world_from_tool: s.world_from_tool,
            residual: s.residual,
            taken: s.residual - after,
            turn: turns[0].get(k).copied().flatten().zip(turns[1].get(k).copied().flatten()).map(|(a, b)| [a, a - b]),
            tau: s.tau,
            payload: s.payload,
            sample: s.sample,
        });
        Ok(Scene {
            payloads,
            rows: rows.collect(),
            joints,
            balls: datasets.first().map_or_else(Vec::new, |NamedDataset { dataset: d, .. }| d.ball_ids()),
        })
    }
}

/// The joint angles of the sample that was measured just before sample `k` of the same session.
fn before<'a>(samples: &[&'a Sample], k: usize) -> Option<&'a [f64]> {
    let this = samples[k];
    let time = this.time_s?;
    let earlier = samples.iter().filter(|s| s.session == this.session && s.time_s.is_some_and(|t| t < time));
    earlier.max_by(|a, b| a.time_s.partial_cmp(&b.time_s).unwrap_or(std::cmp::Ordering::Equal)).map(|s| s.q.as_slice())
}
