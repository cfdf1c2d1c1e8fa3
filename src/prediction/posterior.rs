//! Deviations of the robot from the fitted model: draws of everything that is compatible with the data.
//!
//! The fitted parameters, the candidates of the catalogue, curves of every joint's angle and smooth functions of two
//! variables are sampled together with the noise. White scatter beyond the instrument noise is attributed to the robot
//! and sampled independently at every pose.

mod joint_errors;
mod linear_model;
mod sampler;
mod solver;

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use self::joint_errors::JointErrors;
use self::linear_model::{Group, Kind, LinearModel, NoisePrior, Outer, Size};
use self::sampler::Draw;
pub use self::sampler::help;
use super::at_new_poses::AtNewPoses;
use super::level::is_noise_overstated;
use super::worker::Worker;
use crate::diagnosis::Examination;
use crate::diagnosis::examination::Span;
use crate::effects::Owner;
use crate::effects::facts::Role;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::identify::problem::{Parameter, Prior};
use crate::math::linalg;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::residuals::noise::JointSteps;

/// Largest number of samples used; of more, only every k-th is.
const MOST: usize = 200;

/// Prior one-sigma of parameters that the fit does not regularise (links and compliances), in plausible sizes; at least
/// this (decision 0026).
const FREE: f64 = 4.0;

/// Prior one-sigma of frames, in plausible sizes: practically unconstrained (decision 0026).
const ANYWHERE: f64 = 1e3;

/// Degrees of freedom that a stated noise is worth: an error of a third is not unusual.
const STATED_NOISE: f64 = 10.0;

/// Fixed seed: the same data give the same draws.
const SEED: u64 = 0x0ca1_1be1;

/// Draws of the robot's deviations.
pub(crate) struct Posterior {
    draws: Vec<Draw>,
    /// Unit of each fitted parameter (SI) and candidate (plausible sizes), and the centre of its prior in that unit.
    unit: Vec<f64>,
    centre: Vec<f64>,
    shapes: JointErrors,
    /// One-sigma per axis of the noise by which the residuals are whitened, m.
    noise_m: f64,
    /// Variance of the instrument noise in units of `noise_m` squared; `None` if all apparent noise may come from the
    /// robot.
    known: Option<f64>,
}

/// Prior of a fitted parameter: its size, its unit (SI), and its centre in that unit.
fn drawn(parameter: &Parameter, value: f64, model: &Model) -> (Size, f64, f64) {
    let plausible = parameter.spec.prior;
    let from_nothing = -value / plausible;
    match parameter.knowledge {
        Prior::Certified(sigma) => (Size::Known(1.0), sigma, -value / sigma),
        Prior::Uninformative if parameter.owner != Owner::Robot => (Size::Known(ANYWHERE * ANYWHERE), plausible, 0.0),
        Prior::Uninformative if model.is_unregularised(&parameter.effect) => {
            (Size::Known(FREE.max(2.0 * from_nothing.abs()).powi(2)), plausible, from_nothing)
        }
        // It is among the rows.
        Prior::Fleet(_) => (Size::Known(ANYWHERE * ANYWHERE), plausible, 0.0),
        Prior::Uninformative | Prior::Plausible(_) => (Size::Drawn(Kind::Catalogue), plausible, from_nothing),
    }
}

impl Posterior {
    /// Draws from the posterior of an examined fit, with the help of the worker if there is one.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of(
        datasets: &[NamedDataset<'_>],
        examination: &Examination,
        worker: Option<&dyn Worker>,
    ) -> Result<Self, IdentifyError> {
        let Examination { rows, fitted, columns, spans, contexts, problem, fit, model, noise_scale, .. } = examination;
        let (m, n) = (fitted.len(), columns.len());
        let parameters: Vec<&Parameter> = fit.kept.iter().map(|&p| &problem.parameters()[p]).collect();
        let mut groups: Vec<Group> = Vec::new();
        let (mut unit, mut centre) = (Vec::with_capacity(m + n), Vec::with_capacity(m + n));
        for (k, (parameter, &p)) in parameters.iter().zip(&fit.kept).enumerate() {
            let (size, own, about) = drawn(parameter, fit.values[p], model);
            unit.push(own);
            centre.push(about);
            // Parameters of one effect share one size.
            let joins = k > 0 && matches!(size, Size::Drawn(_)) && parameters[k - 1].effect == parameter.effect;
            match groups.last_mut().filter(|group| joins && group.size == size) {
                Some(group) => group.columns.end = k + 1,
                None => groups.push(Group { columns: k..k + 1, size }),
            }
        }
        let of_candidate = |s: &Span| Group { columns: m + s.first..m + s.first + s.count, size: Size::Drawn(Kind::Catalogue) };
        groups.extend(spans.iter().map(of_candidate));
        unit.resize(m + n, 1.0);
        centre.resize(m + n, 0.0);

        let step = contexts.len().div_ceil(MOST).max(1);
        let taken: Vec<_> = contexts.iter().step_by(step).cloned().collect();
        let has_curves = model.effects.iter().any(|e| model.family(e).is_some_and(|f| f.role == Role::AnyShape));
        let shapes = JointErrors::of(&taken, has_curves);
        let mut first = m + n;
        for (kind, count) in shapes.groups() {
            groups.push(Group { columns: first..first + count, size: Size::Drawn(kind) });
            first += count;
        }
        // Known distances have rows of their own, after those of the samples.
        let samples_end = contexts.iter().map(|c| c.first_row + c.height).max().unwrap_or(0);
        let mut samples = Vec::new();
        let mut places = Vec::new();
        for stretch in
            taken.iter().map(|c| c.first_row..c.first_row + c.height).chain((samples_end..rows.ncols()).map(|r| r..r + 1))
        {
            samples.push(places.len()..places.len() + stretch.len());
            places.extend(stretch);
        }
        let mut x = DMatrix::zeros(places.len(), first);
        let mut y = DVector::zeros(places.len());
        for (to, &from) in places.iter().enumerate() {
            let row = rows.column(from);
            for k in 0..m + n {
                x[(to, k)] = row[k] * unit[k];
            }
            y[to] = row[m + n] - (0..m).map(|k| x[(to, k)] * centre[k]).sum::<f64>();
        }
        let outers = shapes.factors(&taken, m + n, y.len());
        outers.iter().for_each(|outer| outer.write(&samples, &mut x));
        let units = examination.squared_units();
        let noise_m = (units.iter().sum::<f64>() / units.len().max(1) as f64).sqrt();
        // The rounding of joint angles is part of the instrument noise.
        let rounding = JointSteps::of(datasets, problem, &fit.values).map_or(0.0, |steps| steps.per_axis);
        let is_known = noise_scale.is_known() && !is_noise_overstated(fit);
        let known = is_known.then(|| 1.0 + (rounding / noise_m).powi(2));
        let noise = known.map(|known| NoisePrior { variance: known, freedom: STATED_NOISE });
        let draws = LinearModel { x, y, samples, outers, groups, noise }.draws(SEED, worker)?;
        Ok(Posterior { draws, unit, centre, shapes, noise_m, known })
    }

    /// Computes errors of the fitted model at the samples of `there`, which are points: three rows per sample (m), one
    /// column per draw.
    ///
    /// # Errors
    /// When there is no sample.
    pub fn errors(
        &self,
        there: &Dataset,
        examination: &Examination,
        random: &mut ChaCha8Rng,
    ) -> Result<DMatrix<f64>, IdentifyError> {
        let there = AtNewPoses::of_the_arm(there, examination)?;
        let fields = there.fields();
        let known = self.unit.len();
        let of = |k: usize, draw: usize| self.unit[k] * (self.centre[k] + self.draws[draw].b[k]);
        let mut all = linalg::product(&fields, &DMatrix::from_fn(known, self.draws.len(), of));
        let contexts = there.plain_contexts();
        for Outer { lever, shapes, columns } in self.shapes.factors(&contexts, known, fields.nrows()) {
            let of = |k: usize, draw: usize| self.draws[draw].b[columns[k]];
            let turned = linalg::product(&shapes, &DMatrix::from_fn(columns.len(), self.draws.len(), of));
            for (mut error, turned) in all.column_iter_mut().zip(turned.column_iter()) {
                for (p, angle) in turned.iter().enumerate() {
                    error.fixed_rows_mut::<3>(3 * p).axpy(*angle, &lever.fixed_rows::<3>(3 * p), 1.0);
                }
            }
        }
        for (mut error, draw) in all.column_iter_mut().zip(&self.draws) {
            let excess = self.known.map_or(1.0, |known| 1.0 - known / draw.mean_square());
            let share = self.noise_m * excess.max(0.0).sqrt();
            for p in 0..fields.nrows() / 3 {
                for (k, e) in draw.noise_of_sample(3, random).iter().enumerate() {
                    error[3 * p + k] += share * e;
                }
            }
        }
        Ok(all)
    }
}
