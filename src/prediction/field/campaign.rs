//! What the field sees of an examined fit: whitened rows, their levers, and the model's columns with their priors.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::FieldError;
use super::basis::{Basis, JointFacts};
use super::rows::{Groups, Rows};
use crate::diagnosis::Examination;
use crate::diagnosis::folds::postures;
use crate::effects::{EffectId, Owner};
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::FitError;
use crate::identify::problem::{Parameter, Prior, SampleContext};
use crate::math::positive_definite::inverse;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::prediction::at_new_poses::AtNewPoses;
use crate::prediction::level::is_noise_overstated;
use crate::prediction::poses::{SEED, at_poses};
use crate::residuals::noise::JointSteps;
use crate::robot::JointKind;
use crate::robot::kinematics::world_from_tool;
use crate::robot::sites::Axis6;
use crate::units::{MM, MRAD, Unit};

/// Fewest postures of a field: fewer were never studied.
const LEAST_POSTURES: usize = 20;

/// Largest number of samples by which sizes are found; of more, only every k-th is.
const MOST_SAMPLES: usize = 400;

/// Most postures of a campaign that say how the arm stands as a whole.
const MOST_OF_DATUM: usize = 200;

/// A TCP nearer than this to where a ball was probed is on that ball, m.
const SAME_BALL: f64 = 10.0 * MM;

/// Singular values below this are nothing.
const LEAST_SINGULAR: f64 = 1e-9;

/// Prior one-sigma about nominal of the tilt between two axes (alpha, beta), rad.
const TILT: f64 = 4.0 * MRAD;

/// Prior one-sigma about nominal of a joint's zero (theta), rad.
const ZERO: f64 = 20.0 * MRAD;

/// Prior one-sigma about nominal of a length (a, d), m.
const LENGTH: f64 = 2.0 * MM;

/// Prior one-sigma of a joint's twist under its largest torque, rad.
const TWIST: f64 = 2.0 * MRAD;

/// Prior one-sigma of what has no other, in plausible sizes.
const FREE: f64 = 4.0;

/// Prior one-sigma about the fit of a free frame or ball: practically free, and no number is lost beside micrometres.
const FREE_LENGTH: f64 = 10.0 * MM;
/// The same of an angle, rad.
const FREE_ANGLE: f64 = 10.0 * MRAD;

/// Prior of a fitted parameter: one-sigma and mean of its deviation from the fit, SI.
fn prior_about_nominal(parameter: &Parameter, value: f64, torques: &[f64]) -> [f64; 2] {
    let spec = &parameter.spec;
    let sigma = match (parameter.knowledge, EffectId::new(&parameter.effect).family()) {
        (Prior::Certified(sigma) | Prior::Plausible(sigma), _) => sigma,
        // It is among the rows.
        (Prior::Fleet(_), _) => return [if spec.unit == Unit::MM { FREE_LENGTH } else { FREE_ANGLE }, 0.0],
        (Prior::Uninformative, _) if parameter.owner != Owner::Robot => {
            return [if spec.unit == Unit::MM { FREE_LENGTH } else { FREE_ANGLE }, 0.0];
        }
        (Prior::Uninformative, EffectId::MDH) if spec.unit == Unit::MM => LENGTH,
        (Prior::Uninformative, EffectId::MDH) if spec.name.starts_with("theta") => ZERO,
        (Prior::Uninformative, EffectId::MDH) => TILT,
        (Prior::Uninformative, EffectId::JOINT_COMPLIANCE) => {
            let torque = parameter.link.and_then(|j| torques.get(j)).copied().unwrap_or(0.0);
            if torque > 0.0 { TWIST / torque } else { FREE * spec.prior }
        }
        (Prior::Uninformative, _) => FREE * spec.prior,
    };
    [sigma, -value]
}

/// The whitened problem of a campaign, and what is known of its samples.
pub(super) struct Campaign {
    pub basis: Basis,
    pub groups: Groups,
    pub rows: Rows,
    /// Whitened residuals, the model's parameters at the means of their priors.
    pub y: DVector<f64>,
    /// Variance of the noise in whitened units, if it is known.
    pub stated: Option<f64>,
    /// One-sigma of the noise per axis by which the rows are whitened, m.
    pub noise_m: f64,
    /// For each sample, metres per whitened unit.
    pub back: Vec<Matrix3<f64>>,
    pub contexts: Vec<SampleContext>,
    /// The samples, by their index in the examination.
    pub chosen: Vec<usize>,
    /// One-sigma and mean of the prior of each fitted parameter, as a deviation from the fit, SI.
    pub priors: Vec<[f64; 2]>,
}

/// Rows of the campaign's coefficients elsewhere, m.
pub(super) struct There {
    pub rows: Rows,
}

/// Levers and functions of these samples; `height` rows of each are of its position.
fn moved(basis: &Basis, at: &[SampleContext], count: usize, first: impl Fn(usize) -> usize) -> [Vec<DMatrix<f64>>; 2] {
    let lever = |joint: usize| {
        let mut lever = DMatrix::zeros(count, 1);
        for (s, c) in at.iter().enumerate() {
            (0..c.height).for_each(|k| lever[(first(s) + k, 0)] = c.joints[joint][k]);
        }
        lever
    };
    let functions = basis.joints.iter().map(|groups| {
        let mut transposed = DMatrix::zeros(groups.width(), at.len());
        for (mut to, c) in transposed.column_iter_mut().zip(at) {
            basis.write(groups, &c.q, &c.tau, to.as_mut_slice());
        }
        transposed.transpose()
    });
    [basis.joints.iter().map(|groups| lever(groups.joint)).collect(), functions.collect()]
}

fn columns(levers: Vec<DMatrix<f64>>) -> Vec<DVector<f64>> {
    levers.into_iter().map(|lever| lever.column(0).into_owned()).collect()
}

/// Rows and residuals of the samples `chosen`, and of what is no sample.
fn laid_out(examination: &Examination, basis: &Basis, priors: &[[f64; 2]], chosen: &[usize]) -> (Rows, DVector<f64>) {
    let all = &examination.rows;
    let contexts: Vec<SampleContext> = chosen.iter().map(|&s| examination.contexts[s].clone()).collect();
    // Known distances and what a fleet knows are no samples: their rows come after those.
    let end = examination.contexts.iter().map(|c| c.first_row + c.height).max().unwrap_or(0);
    let places: Vec<usize> =
        contexts.iter().flat_map(|c| c.first_row..c.first_row + c.height).chain(end..all.ncols()).collect();
    let mut first = 0;
    let samples: Vec<_> = contexts
        .iter()
        .map(|c| {
            first += c.height;
            first - c.height..first
        })
        .collect();
    let (m, count) = (priors.len(), examination.columns.len());
    let of_row = |r: usize, k: usize| all[(k, places[r])];
    let smooth = DMatrix::from_fn(places.len(), m, |r, k| of_row(r, k) * priors[k][0]);
    let effects = DMatrix::from_fn(places.len(), count, |r, k| of_row(r, m + k));
    let residual = |r: usize| of_row(r, m + count) - (0..m).map(|k| of_row(r, k) * priors[k][1]).sum::<f64>();
    let y = DVector::from_fn(places.len(), |r, _| residual(r));
    let [levers, functions] = moved(basis, &contexts, places.len(), |s| samples[s].start);
    let rows = Rows { samples, smooth, effects, levers: columns(levers), functions };
    (rows, y)
}

impl Campaign {
    /// Lays out an examined fit.
    ///
    /// # Errors
    /// When there are too few postures, no joint turns, or the model lacks the arm's own parameters.
    pub fn of(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Self, FieldError> {
        let Examination { spans, problem, fit, model, noise_scale, .. } = examination;
        let taken = examination.contexts.len();
        let found = postures(&examination.contexts).count();
        if found < LEAST_POSTURES {
            return Err(FieldError::TooFewPostures { found, least: LEAST_POSTURES });
        }
        if let Some(effect) = [EffectId::BASE_FRAME, EffectId::MDH].into_iter().find(|effect| !model.holds(effect)) {
            return Err(FieldError::WithoutColumns { effect });
        }
        // An excluded sample says nothing of the size of anything.
        let counts = |s: &usize| !model.excludes(&problem.sample_ids()[*s]);
        let step = taken.div_ceil(MOST_SAMPLES).max(1);
        let chosen: Vec<usize> = (0..taken).filter(counts).step_by(step).collect();
        let contexts: Vec<SampleContext> = chosen.iter().map(|&s| examination.contexts[s].clone()).collect();
        let robot = problem.robot();
        let n = contexts.len() as f64;
        let facts = (0..robot.joints()).map(|j| JointFacts {
            turns: robot.kind(j) == JointKind::Revolute,
            lever: (contexts.iter().map(|c| c.joints[j].norm_squared()).sum::<f64>() / n).sqrt(),
            load: (contexts.iter().map(|c| c.tau[j] * c.tau[j]).sum::<f64>() / n).sqrt(),
        });
        let basis = Basis::of(&facts.collect::<Vec<_>>());
        if basis.joints.is_empty() {
            return Err(FieldError::NoJointTurns { robot: robot.name.clone() });
        }
        let groups = Groups::of(&basis, &spans.iter().map(|s| s.count).collect::<Vec<_>>());

        let torque = |j: usize| contexts.iter().map(|c| c.tau[j].abs()).fold(0.0, f64::max);
        let torques: Vec<f64> = (0..robot.joints()).map(torque).collect();
        let priors: Vec<[f64; 2]> =
            fit.kept.iter().map(|&p| prior_about_nominal(&problem.parameters()[p], fit.values[p], &torques)).collect();
        let (rows, y) = laid_out(examination, &basis, &priors, &chosen);

        let units = examination.squared_units();
        let noise_m = (units.iter().sum::<f64>() / units.len().max(1) as f64).sqrt();
        // The rounding of joint angles is part of the instrument noise.
        let rounding = JointSteps::of(datasets, problem, &fit.values).map_or(0.0, |steps| steps.per_axis);
        let is_known = noise_scale.is_known() && !is_noise_overstated(fit);
        let stated = is_known.then(|| 1.0 + (rounding / noise_m).powi(2));
        let mut unwhitened = Vec::with_capacity(taken);
        problem.for_each_sample(&fit.values, &mut |s| {
            unwhitened.push(match s.sight {
                Some(_) => Ok(Matrix3::from_diagonal_element(s.variance.sqrt())),
                None => inverse(s.whitener),
            });
        });
        let unwhitened = unwhitened.into_iter().collect::<Result<Vec<_>, _>>().map_err(FitError::from)?;
        let back = chosen.iter().map(|&s| unwhitened[s] / noise_scale.weight()).collect();
        Ok(Campaign { basis, groups, rows, y, stated, noise_m, back, contexts, chosen, priors })
    }

    /// Rows and residuals of a stretch of the examination's samples, whether they are among the chosen or not.
    pub fn stretch(&self, examination: &Examination, samples: std::ops::Range<usize>) -> (Rows, DVector<f64>) {
        laid_out(examination, &self.basis, &self.priors, &samples.collect::<Vec<_>>())
    }

    /// Rows and residuals of all samples of the examination, of the model alone.
    pub fn of_model(&self, examination: &Examination) -> (Rows, DVector<f64>) {
        let without = Basis { joints: Vec::new(), load: Vec::new() };
        let all: Vec<usize> = (0..examination.contexts.len()).collect();
        let (rows, y) = laid_out(examination, &without, &self.priors, &all);
        (rows.of_model(), y)
    }

    /// Rows of the arm at the points of `there`.
    ///
    /// # Errors
    /// When there is no sample.
    pub fn there(&self, there: &Dataset, examination: &Examination) -> Result<There, IdentifyError> {
        let at = AtNewPoses::of_the_arm(there, examination)?;
        let mut fields = at.fields();
        relative_to_campaign(&mut fields, there, examination)?;
        let contexts = at.plain_contexts();
        let (m, count) = (self.priors.len(), examination.columns.len());
        let mut smooth = fields.columns(0, m).into_owned();
        for (mut column, [sigma, _]) in smooth.column_iter_mut().zip(&self.priors) {
            column *= *sigma;
        }
        let effects = fields.columns(m, count).into_owned();
        let [levers, functions] = moved(&self.basis, &contexts, fields.nrows(), |s| 3 * s);
        let samples = (0..contexts.len()).map(|s| 3 * s..3 * s + 3).collect();
        Ok(There { rows: Rows { samples, smooth, effects, levers: columns(levers), functions } })
    }
}

/// Where nothing in the world is known, a motion of the arm as a whole is no error: takes from the columns `fields` at the points
/// of `there` the motion of the base that comes nearest to each of them at the postures of the campaign (S-transformation). At a
/// ball whose place only the arm has told, an error is one from the place that it has told.
fn relative_to_campaign(fields: &mut DMatrix<f64>, there: &Dataset, examination: &Examination) -> Result<(), IdentifyError> {
    let setup = &examination.problem.setups()[0];
    if setup.datum_freedoms.is_empty() {
        return Ok(());
    }
    let step = examination.contexts.len().div_ceil(MOST_OF_DATUM).max(1);
    let measured: Vec<&SampleContext> = examination.contexts.iter().step_by(step).collect();
    let joints: Vec<Vec<f64>> = measured.iter().map(|c| c.q.clone()).collect();
    let own = at_poses(there, examination, &joints, &mut ChaCha8Rng::seed_from_u64(SEED));
    let mut of_own = AtNewPoses::of_the_arm(&own, examination)?.fields();
    let [arms, arms_there] = [&own, there].map(|cell| {
        let tcp = |q: &[f64]| world_from_tool(&cell.robot, &cell.base, &cell.tool, q).translation.vector;
        cell.samples.iter().map(|s| tcp(&s.q) - Vector3::from(setup.start.xyz)).collect::<Vec<Vector3<f64>>>()
    });
    let motions = motions(&arms, &setup.datum_freedoms);
    let nearest = motions.clone().svd(true, true).solve(&of_own, LEAST_SINGULAR);
    let Ok(nearest) = nearest else { return Ok(()) };
    *fields -= self::motions(&arms_there, &setup.datum_freedoms) * &nearest;
    of_own -= motions * nearest;
    for ball in measured.iter().filter_map(|c| c.free_ball).collect::<std::collections::BTreeSet<usize>>() {
        let on: Vec<usize> = (0..measured.len()).filter(|&s| measured[s].free_ball == Some(ball)).collect();
        let count = on.len() as f64;
        let place = on.iter().map(|&s| arms[s]).sum::<Vector3<f64>>() / count;
        let mut mean = DMatrix::zeros(3, of_own.ncols());
        on.iter().for_each(|&s| mean += of_own.rows(3 * s, 3) / count);
        for p in (0..arms_there.len()).filter(|&p| (arms_there[p] - place).norm() < SAME_BALL) {
            let mut rows = fields.rows_mut(3 * p, 3);
            rows -= &mean;
        }
    }
    Ok(())
}

/// What each of these motions of the base does at points (m) from its origin.
fn motions(arms: &[Vector3<f64>], axes: &[Axis6]) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(3 * arms.len(), axes.len());
    for (mut column, axis) in all.column_iter_mut().zip(axes) {
        for (p, arm) in arms.iter().enumerate() {
            let moved = match axis {
                Axis6::X => Vector3::x(),
                Axis6::Y => Vector3::y(),
                Axis6::Z => Vector3::z(),
                Axis6::Rz => Vector3::z().cross(arm),
                Axis6::Ry => Vector3::y().cross(arm),
                Axis6::Rx => Vector3::x().cross(arm),
            };
            column.fixed_rows_mut::<3>(3 * p).copy_from(&moved);
        }
    }
    all
}
