//! A calibration: every parameter with its value and uncertainty, and what the fit says of the data.

use std::sync::Arc;

use nalgebra::DMatrix;
use thiserror::Error;

use super::fit::{Fit, FitError, fit_some};
use super::{Knowledge, Model, Observability, Parameter, Problem, ProblemError, Setup, Use, fit};
use crate::effects::Owner;
use crate::measure::Dataset;
use crate::robot::Robot;
use crate::units::Unit;

/// One estimated parameter; values in SI, `value` and `nominal` absolute (not deviations).
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Unique name, e.g. `a2`, `base_x`, `base_x@A`.
    pub name: String,
    /// Effect that it belongs to.
    pub effect: String,
    /// Unit for people and files.
    pub unit: Unit,
    /// Estimate.
    pub value: f64,
    /// One-sigma.
    pub sigma: f64,
    /// On the drawing.
    pub nominal: f64,
    /// One-sigma that was stated beforehand, for a certified ball or TCP.
    pub stated_sigma: Option<f64>,
}

/// Which base and tool the set-up parameters describe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SetupName {
    /// What parameter names end in after `@`; empty for the only one.
    pub label: String,
    /// Dataset.
    pub dataset: String,
    /// Session.
    pub session: String,
}

/// The identified model of one robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The robot as drawn.
    pub robot: Arc<Robot>,
    /// How files name it.
    pub robot_reference: String,
    /// Effects and torques used.
    pub model: Model,
    /// Estimates, in the order of the model.
    pub estimates: Vec<Estimate>,
    /// Correlations between them (square, symmetric, unit diagonal).
    pub correlation: DMatrix<f64>,
    /// Groups that the data cannot tell apart; the first of each was left at its drawing value.
    pub unresolved: Vec<Vec<String>>,
    /// Set-ups measured.
    pub setups: Vec<SetupName>,
    /// Samples fitted.
    pub samples: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
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
    /// Whether the uncertainties rest on stated noise, or on the residuals themselves.
    pub noise_stated: bool,
    /// Gauss-Newton steps.
    pub iterations: usize,
    /// Smallest and largest joint angle in the data, rad (N).
    pub joint_ranges: Vec<[f64; 2]>,
    /// SHA-256 of each dataset.
    pub dataset_hashes: Vec<String>,
    /// Whether the controller's own absolute-accuracy option was on; `None` when not said.
    pub absolute_accuracy: Option<bool>,
}

/// Why there is no calibration.
#[derive(Debug, Error)]
pub enum IdentifyError {
    /// Data and model do not fit together.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The numbers do not determine the unknowns.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Identifies the robot from the rows of set `fit` of named datasets.
///
/// # Errors
/// When data and model do not fit together, or do not determine the unknowns.
pub fn identify(datasets: &[(&str, &Dataset)], model: &Model) -> Result<Calibration, IdentifyError> {
    let mut problem = Problem::new(datasets, model, Use::Fit)?;
    let fit = fit(&mut problem)?;
    Ok(Calibration::of(datasets, model, &problem, &fit))
}

impl Calibration {
    /// Puts a fit into words.
    pub fn of(datasets: &[(&str, &Dataset)], model: &Model, problem: &Problem, fit: &Fit) -> Self {
        let parameters = problem.parameters();
        let name = |p: usize| parameters[p].name.clone();
        let estimates = fit
            .kept
            .iter()
            .map(|&p| Estimate {
                name: name(p),
                effect: parameters[p].effect.clone(),
                unit: parameters[p].spec.unit,
                value: parameters[p].start + fit.values[p],
                sigma: fit.sigma(p).unwrap_or(0.0),
                nominal: parameters[p].spec.nominal,
                stated_sigma: match parameters[p].knowledge {
                    Knowledge::Flat => None,
                    Knowledge::Stated(sigma) => Some(sigma),
                },
            })
            .collect();
        let sigma: Vec<f64> = (0..fit.kept.len()).map(|k| fit.covariance[(k, k)].sqrt()).collect();
        let correlation = DMatrix::from_fn(sigma.len(), sigma.len(), |r, c| {
            if r == c { 1.0 } else { fit.covariance[(r, c)] / (sigma[r] * sigma[c]) }
        });
        let groups =
            fit.unresolved.iter().map(|u| std::iter::once(u.parameter).chain(u.with.iter().copied()).map(name).collect());
        Calibration {
            robot: problem.robot().clone(),
            robot_reference: datasets.first().map(|(_, d)| d.robot_reference.clone()).unwrap_or_default(),
            model: model.clone(),
            estimates,
            correlation,
            unresolved: groups.collect(),
            setups: problem
                .setups()
                .iter()
                .map(|s| SetupName { label: s.label.clone(), dataset: s.dataset.clone(), session: s.session.clone() })
                .collect(),
            samples: problem.sample_count(),
            rms: fit.rms,
            chi2_per_dof: if fit.dof > 0 { fit.chi2 / fit.dof as f64 } else { f64::NAN },
            dof: fit.dof,
            rank: fit.rank(parameters),
            condition: fit.condition,
            observability: fit.observability,
            noise_stated: fit.noise_stated,
            iterations: fit.iterations,
            joint_ranges: problem.joint_ranges(),
            dataset_hashes: datasets.iter().map(|(_, d)| d.hash.clone()).collect(),
            absolute_accuracy: datasets.iter().find_map(|(_, d)| d.absolute_accuracy),
        }
    }

    /// The estimate of that name.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.estimates.iter().find(|e| e.name == name)
    }

    /// The same robot as drawn: every parameter at its nominal value.
    pub fn as_drawn(&self) -> Self {
        let mut drawn = self.clone();
        drawn.estimates.iter_mut().for_each(|e| e.value = e.nominal);
        drawn
    }

    /// Errors of the calibrated model on samples, m: three a sample.
    ///
    /// What belongs to a set-up that the calibration has not seen (its base, a free tool, a free ball) is fitted to these samples
    /// first, and named in the result: the robot is being judged, not where it stands.
    ///
    /// # Errors
    /// When the data do not go with the model, or do not determine the set-up.
    pub fn predict(&self, datasets: &[(&str, &Dataset)], which: Use) -> Result<Prediction, IdentifyError> {
        let mut problem = Problem::new(datasets, &self.model, which)?;
        let mut values = problem.start();
        let mut unseen = Vec::new();
        for (p, parameter) in problem.parameters().iter().enumerate() {
            match self.value_for(parameter, &problem) {
                Some(value) => values[p] = value - parameter.start,
                None => unseen.push(p),
            }
        }
        let flat = |p: &usize| problem.parameters()[*p].knowledge == Knowledge::Flat;
        unseen.retain(flat);
        // Twice: the second weighing sees the arm deflected, and leaves a millionth of the deflection.
        problem.reweigh(&values);
        problem.reweigh(&values);
        if !unseen.is_empty() {
            values = fit_some(&mut problem, &values, &unseen)?.values;
        }
        Ok(Prediction {
            sample_ids: problem.sample_ids().to_vec(),
            residuals: problem.residuals(&values),
            refitted: unseen.iter().map(|&p| problem.parameters()[p].name.clone()).collect(),
        })
    }

    /// The calibrated (or drawing) value of a parameter of another problem; `None` when it belongs to a set-up or a ball not seen here.
    fn value_for(&self, parameter: &Parameter, problem: &Problem) -> Option<f64> {
        let plain = parameter.spec.name.as_str();
        let (name, may_be_unseen) = match parameter.owner {
            Owner::Robot => (plain.to_owned(), false),
            Owner::Artifact => (parameter.name.clone(), true),
            Owner::Session => {
                let seen = self.seen(&problem.setups()[parameter.setup?])?;
                (if seen.label.is_empty() { plain.to_owned() } else { format!("{plain}@{}", seen.label) }, false)
            }
        };
        let found = self.estimate(&name).or_else(|| self.estimate(plain)).map(|e| e.value);
        let left_out = || self.unresolved.iter().any(|group| group.first() == Some(&name));
        found.or_else(|| (!may_be_unseen || left_out()).then_some(parameter.start))
    }

    /// The set-up of this calibration that a set-up of other samples is: the one of the same session; where sessions are not
    /// named, the one of the same dataset, or the only one.
    fn seen(&self, setup: &Setup) -> Option<&SetupName> {
        let named = |s: &&SetupName| !s.session.is_empty() && s.session == setup.session;
        let unnamed = |s: &&SetupName| {
            (s.session.is_empty() || setup.session.is_empty()) && (self.setups.len() == 1 || s.dataset == setup.dataset)
        };
        self.setups.iter().find(named).or_else(|| self.setups.iter().find(unnamed))
    }
}

/// What the calibrated model says of samples.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// Names of the samples.
    pub sample_ids: Vec<String>,
    /// Measured minus predicted, m.
    pub residuals: Vec<nalgebra::Vector3<f64>>,
    /// Parameters of unseen set-ups that were fitted to these samples.
    pub refitted: Vec<String>,
}
