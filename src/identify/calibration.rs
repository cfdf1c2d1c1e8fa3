//! A calibration: every parameter with its value and uncertainty, and the quality of the fit.

pub use self::found_frames::FoundFrame;
pub use super::calibration_file::{FORMAT as CALIBRATION_FORMAT, read_calibration, write_calibration};

mod carry_over;
mod found_frames;

use std::sync::Arc;

use nalgebra::{DMatrix, Vector3};
use thiserror::Error;

use super::Model;
use super::fit::covariance_with_model_error;
use super::fit::fit_some;
use super::fit_result::{Fit, FitError, Outcome};
use super::fitted_rows::FittedRows;
use super::prediction::{Application, Prediction};
use super::problem::UNSTATED_SIGMA;
use super::problem::{Parameter, Prior, Problem, ProblemError, Setup, Use};
use crate::effects::EffectId;
use crate::math::Observability;
use crate::measure::dataset::NamedDataset;
use crate::robot::statics::Payload;
use crate::robot::{FramePose, Robot};
use crate::units::Unit;

/// One estimated parameter; values in SI, `value` and `nominal` absolute (not deviations).
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Unique name, e.g. `a2`, `base_x`, `base_x@A`.
    pub name: String,
    /// Effect to which it belongs.
    pub effect: EffectId,
    /// Unit for people and files.
    pub unit: Unit,
    /// Estimate.
    pub value: f64,
    /// Standard uncertainty due to noise and model discrepancy.
    pub sigma: f64,
    /// Standard uncertainty due to noise alone.
    pub sigma_noise: f64,
    /// Nominal value.
    pub nominal: f64,
    /// Standard uncertainty stated beforehand, for a certified ball or TCP.
    pub stated_sigma: Option<f64>,
}

/// A measured set-up: the base and tool that its parameters describe, and the payloads carried.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredSetup {
    /// Suffix of its parameter names after `@`; empty if it is the only one.
    pub label: String,
    /// Dataset.
    pub dataset: String,
    /// Session.
    pub session: String,
    /// Starting base of the fit: components the data could not determine kept these values.
    pub base: FramePose,
    /// TCP frame in the last frame, as certified.
    pub tool: FramePose,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// Payloads; the first is the default.
    pub payloads: Vec<Payload>,
    /// Longest time of its samples, s; `None` if times were not recorded.
    pub duration_s: Option<f64>,
}

/// The identified model of one robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The nominal robot.
    pub robot: Arc<Robot>,
    /// Reference to the robot in files.
    pub robot_reference: String,
    /// Effects and torques used.
    pub model: Model,
    /// Estimates, in the order of the model.
    pub estimates: Vec<Estimate>,
    /// Correlations of the errors described by the estimates' `sigma` (square, symmetric, unit diagonal).
    pub correlation: DMatrix<f64>,
    /// Groups of parameters that the data cannot separate; the first of each was left at its nominal value.
    pub unresolved: Vec<Vec<String>>,
    /// Measured set-ups.
    pub setups: Vec<MeasuredSetup>,
    /// Outcome of the fit; `None` if a file does not state it.
    pub outcome: Option<Outcome>,
    /// Number of samples fitted.
    pub samples: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// Root mean square of the angles by which measured orientations deviate, rad; `None` if none were measured.
    pub rms_orientation: Option<f64>,
    /// Whitened sum of squares per degree of freedom.
    pub chi2_per_dof: f64,
    /// Residuals minus independent parameters.
    pub dof: usize,
    /// Number of independent parameters.
    pub rank: usize,
    /// Condition number of the column-scaled Jacobian.
    pub condition: f64,
    /// Observability indices, SI.
    pub observability: Observability,
    /// True if the uncertainties rest on stated noise, false if on the residuals.
    pub noise_stated: bool,
    /// Number of Gauss-Newton steps.
    pub iterations: usize,
    /// Smallest and largest joint angle in the data, rad (N).
    pub joint_ranges: Vec<[f64; 2]>,
    /// SHA-256 of each dataset.
    pub dataset_hashes: Vec<String>,
    /// The rows that were fitted, to recognise them.
    pub fitted_rows: FittedRows,
    /// State of the controller's own absolute-accuracy option; `None` if not stated.
    pub absolute_accuracy: Option<bool>,
    /// Number of robots of the fleet whose prior was used; `None` without one.
    pub fleet_robots: Option<usize>,
    /// The sentence by which its data were refused, where the fit was forced.
    pub misfit: Option<String>,
}

/// The reason why there is no calibration.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The samples belong to a different arm than the calibration.
    #[error(
        "the calibration is of '{calibrated}' and the samples are of '{measured}', another arm; judge it on samples of its own"
    )]
    OtherRobot {
        /// Robot of the calibration.
        calibrated: String,
        /// Robot of the samples.
        measured: String,
    },
    /// Data and model do not match.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The data do not determine the unknowns.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The fit creeps along a valley that the data hardly determine.
    #[error("its fit does not converge within {steps} steps: the data hardly determine it")]
    Slow {
        /// Steps after which it was given up.
        steps: usize,
    },
    /// The calibration as read back does not reproduce the residual of its fit.
    #[error(
        "calibench found itself inconsistent: the fit leaves {fitted_mm:.9} mm, and the calibration as read back leaves {read_mm:.9} mm on the same rows; report this with the data and the model"
    )]
    Inconsistent {
        /// Residual of the fit, mm.
        fitted_mm: f64,
        /// Residual of the calibration, mm.
        read_mm: f64,
    },
}

impl Calibration {
    /// The noise of orientations, rad, that is to the noise assumed of positions without a stated one as the residuals of both;
    /// `None` if no orientation was measured.
    pub fn balanced_orientation(&self) -> Option<f64> {
        self.rms_orientation.map(|turned| turned / self.rms * UNSTATED_SIGMA)
    }

    /// Outcome of the fit if it did not converge: none of its results is then valid.
    pub fn unconverged(&self) -> Option<Outcome> {
        self.outcome.filter(|outcome| *outcome != Outcome::Converged)
    }

    /// Names of the base and tool parameters that the data did not determine although they contain known positions in the
    /// world.
    pub fn undetermined_set_up(&self) -> Vec<&str> {
        let is_set_up = |name: &str| name.starts_with("base_") || name.starts_with("tool_");
        // Free balls get their positions in the world from the base: there it is a matter of definition.
        let by_definition = |group: &[String]| group.is_empty() || group.iter().any(|name| name.starts_with(EffectId::BALL));
        let open = self.unresolved.iter().filter_map(|group| Some((group.first()?.as_str(), group.get(1..)?)));
        open.filter(|(name, with)| is_set_up(name) && !by_definition(with)).map(|(name, _)| name).collect()
    }

    /// Converts a fit to a calibration, with uncertainties by noise and by model discrepancy, as [`identify`] states them;
    /// by noise alone where the residuals do not tell.
    ///
    /// [`identify`]: super::identify
    pub fn of(datasets: &[NamedDataset<'_>], model: &Model, problem: &Problem, fit: &Fit) -> Self {
        let covariance = covariance_with_model_error(problem, fit).unwrap_or_else(|_| fit.covariance.clone());
        Calibration::with_covariance(datasets, model, problem, fit, &covariance)
    }

    /// Converts a fit to a calibration, the errors of the kept parameters (SI) having the second moments `covariance`.
    pub fn with_covariance(
        datasets: &[NamedDataset<'_>],
        model: &Model,
        problem: &Problem,
        fit: &Fit,
        covariance: &DMatrix<f64>,
    ) -> Self {
        let sigma: Vec<f64> = (0..fit.kept.len()).map(|k| covariance[(k, k)].max(0.0).sqrt()).collect();
        let parameters = problem.parameters();
        let name = |p: usize| parameters[p].name.clone();
        let estimates = fit.kept.iter().zip(&sigma).map(|(&p, &sigma)| estimate(&parameters[p], fit, p, sigma)).collect();
        let correlation =
            DMatrix::from_fn(
                sigma.len(),
                sigma.len(),
                |r, c| {
                    if r == c { 1.0 } else { covariance[(r, c)] / (sigma[r] * sigma[c]) }
                },
            );
        let groups =
            fit.unresolved.iter().map(|u| std::iter::once(u.parameter).chain(u.with.iter().copied()).map(name).collect());
        Calibration {
            robot: problem.robot().clone(),
            robot_reference: datasets.first().map(|d| d.dataset.robot_reference.clone()).unwrap_or_default(),
            model: model.clone(),
            estimates,
            correlation,
            unresolved: groups.collect(),
            setups: problem.setups().iter().map(|s| measured_setup(s, datasets)).collect(),
            outcome: Some(fit.outcome),
            samples: problem.sample_count(),
            rms: fit.rms,
            rms_orientation: fit.rms_orientation,
            chi2_per_dof: if fit.dof > 0 { fit.chi2 / fit.dof as f64 } else { f64::NAN },
            dof: fit.dof,
            rank: fit.rank(parameters),
            condition: fit.condition,
            observability: fit.observability,
            noise_stated: fit.noise_stated,
            iterations: fit.iterations,
            joint_ranges: problem.joint_ranges(),
            dataset_hashes: datasets.iter().map(|d| d.dataset.hash.clone()).collect(),
            fitted_rows: FittedRows::of(datasets),
            absolute_accuracy: datasets.iter().find_map(|d| d.dataset.absolute_accuracy),
            fleet_robots: None,
            misfit: None,
        }
    }

    /// The estimate with this name.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|e| e.name == name)
    }

    /// The same robot with every parameter at its nominal value.
    pub fn nominal(&self) -> Self {
        let mut drawn = self.clone();
        drawn.estimates.iter_mut().for_each(|e| e.value = e.nominal);
        drawn
    }

    /// The calibration without its set-ups: any data it is compared with count as a new set-up.
    pub fn set_up_anew(&self) -> Self {
        Calibration { setups: Vec::new(), ..self.clone() }
    }

    /// Errors of the calibrated model on samples, m: three per sample.
    ///
    /// Parameters of a set-up that the calibration has not seen (its base, a free tool, a free ball) are fitted first, and
    /// named in the result: the robot is being judged, not its position. Validation samples are spared if possible:
    /// whatever rows of set `fit` can determine about their set-up is taken from those.
    ///
    /// ```
    /// use calibench::identify::problem::Use;
    /// use calibench::identify::{Model, identify};
    /// use calibench::math::rms;
    /// # use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
    /// # use calibench::robot::kinematics::world_from_tool;
    /// # use calibench::robot::{FramePose, built_in};
    /// use calibench::units::MM;
    /// # let robot = std::sync::Arc::new(built_in("ur5").ok_or("built in")?);
    /// # let moved = FramePose { xyz: [1.0 * MM, 0.0, 0.0], ..FramePose::default() };
    /// # let sample = |k: usize| {
    /// #     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
    /// #     let seen = world_from_tool(&robot, &moved, &FramePose::default(), &q).translation.vector;
    /// #     Sample::new(format!("p{k}"), q, Measured::Point(seen))
    /// # };
    /// # let samples = (0..20).map(sample).collect();
    /// # let noise = Noise { point: Some(0.02 * MM), ..Noise::default() };
    /// # let data = Dataset { robot: robot.clone(), noise, samples, ..Dataset::default() };
    ///
    /// // A UR5 whose base is 1 mm from where it is stated to be.
    /// let calibration = identify(&[NamedDataset::new("campaign", &data)], &Model::of(&["base_frame"]))?;
    /// let before = calibration.nominal().predict(&[NamedDataset::new("campaign", &data)], Use::Fit)?;
    /// let after = calibration.predict(&[NamedDataset::new("campaign", &data)], Use::Fit)?;
    /// assert!((rms(&before.residuals) - 1.0 * MM).abs() < 1e-9 && rms(&after.residuals) < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the data are of another robot, do not fit the model, or do not determine the set-up.
    pub fn predict(&self, datasets: &[NamedDataset<'_>], which: Use) -> Result<Prediction, IdentifyError> {
        Ok(self.apply(datasets, which)?.prediction())
    }

    /// The predictions of this calibration and of its nominal robot ([`Calibration::nominal`]), as each gives them alone.
    ///
    /// # Errors
    /// As [`Calibration::predict`].
    pub fn predict_beside_nominal(&self, datasets: &[NamedDataset<'_>], which: Use) -> Result<[Prediction; 2], IdentifyError> {
        let nominal = self.nominal();
        let applied = self.apply(datasets, which)?;
        // A set-up fitted to these data is another one under the nominal robot.
        if !applied.refitted.is_empty() || !applied.from_fit_rows.is_empty() {
            return Ok([applied.prediction(), nominal.predict(datasets, which)?]);
        }
        let (values, _) = nominal.values_for(&applied.problem);
        Ok([applied.prediction(), applied.prediction_at(&values)])
    }

    /// Lays out the samples under this calibration, as [`Calibration::predict`] judges them.
    ///
    /// # Errors
    /// As [`Calibration::predict`].
    pub fn apply(&self, datasets: &[NamedDataset<'_>], which: Use) -> Result<Application, IdentifyError> {
        if let Some(NamedDataset { dataset: other, .. }) = datasets.iter().find(|d| !d.dataset.robot.is_same_arm(&self.robot)) {
            return Err(IdentifyError::OtherRobot { calibrated: self.robot.name.clone(), measured: other.robot.name.clone() });
        }
        let mut problem = Problem::new(datasets, &self.model, which)?;
        let (mut values, mut unseen) = self.values_for(&problem);
        let mut from_fit_rows = Vec::new();
        let has_fit_rows = datasets.iter().any(|d| d.dataset.samples.iter().any(|s| Use::Fit.takes(s)));
        if which == Use::Validation && has_fit_rows && !unseen.is_empty() {
            let fitting = Problem::new(datasets, &self.model, Use::Fit)?;
            let (start, sought) = self.values_for(&fitting);
            if !sought.is_empty() {
                let found = fit_some(&fitting, &start, &sought)?;
                let home = |p: Option<usize>, of: &'_ Problem| p.map(|s| of.setups()[s].name().map(str::to_owned));
                let same = |p: &Parameter, q: &Parameter| {
                    let in_one_place = home(p.setup, &problem) == home(q.setup, &fitting);
                    p.spec.name == q.spec.name && (in_one_place || p.shared && q.shared && p.name == q.name)
                };
                let parameters = problem.parameters();
                unseen.retain(|&p| {
                    let twin = sought.iter().find(|&&f| same(&parameters[p], &fitting.parameters()[f]));
                    if let Some(&f) = twin {
                        values[p] = fitting.parameters()[f].start + found.values[f] - parameters[p].start;
                        from_fit_rows.push(p);
                    }
                    twin.is_none()
                });
            }
        }
        if !unseen.is_empty() {
            values = fit_some(&problem, &values, &unseen)?.values;
        }
        problem.update_loads(&values);
        let name = |p: &Parameter| self.name_for(p, &problem);
        let place = |p: &Parameter| name(p).and_then(|n| self.estimates.iter().position(|e| e.name == n));
        let estimates = problem.parameters().iter().map(place).collect();
        Ok(Application { problem, values, estimates, refitted: unseen, from_fit_rows })
    }
}

/// The estimate of parameter `p`, which the fit kept.
fn estimate(parameter: &Parameter, fit: &Fit, p: usize, sigma: f64) -> Estimate {
    Estimate {
        name: parameter.name.clone(),
        effect: parameter.effect.clone(),
        unit: parameter.spec.unit,
        value: parameter.start + fit.values[p],
        sigma,
        sigma_noise: fit.sigma(p).unwrap_or(0.0),
        nominal: parameter.spec.nominal,
        stated_sigma: match parameter.knowledge {
            Prior::Uninformative | Prior::Plausible(_) | Prior::Fleet(_) => None,
            Prior::Certified(sigma) => Some(sigma),
        },
    }
}

/// A set-up, with the payloads of its dataset.
fn measured_setup(setup: &Setup, datasets: &[NamedDataset<'_>]) -> MeasuredSetup {
    let dataset = datasets.iter().find(|d| d.name == setup.dataset);
    MeasuredSetup {
        label: setup.label.clone(),
        dataset: setup.dataset.clone(),
        session: setup.session.clone(),
        base: setup.start,
        tool: setup.tool,
        gravity: setup.gravity,
        payloads: dataset.map(|d| d.dataset.payloads.clone()).unwrap_or_default(),
        duration_s: setup.duration_s,
    }
}
