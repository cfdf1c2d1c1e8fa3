//! The touches laid out under what was known before: means and covariance of every parameter, and the parameters that a crash
//! may have moved.

use nalgebra::{DMatrix, DVector};

use super::{Earlier, RecoveryError};
use calibench::effects::{EffectId, Owner};
use calibench::identify::Model;
use calibench::identify::calibration::Calibration;
use calibench::identify::problem::{Parameter, Prior, Problem, Use};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::robot::JointKind;
use calibench::robot::sites::Axis6;
use calibench::units::{DEG, MM, Unit};

/// One-sigma of a frame or a pin of which nothing is known but where it roughly is, m and rad: as far as a tape measure is off.
const ANYWHERE: [f64; 2] = [300.0 * MM, 0.3];

/// One-sigma per axis of what a model without a campaign lacks beside its geometry and gears, m: runout, backlash, bearings
/// (docs/validation-studies.md).
const NEVER_MEASURED: f64 = 0.05 * MM;

/// One-sigma of the growth of the whole arm since the campaign: two or three kelvin of steel, as a share.
const GROWTH: f64 = 30e-6;

/// One-sigma of a zero that was lost, rad: a tooth of a belt is some degrees, a slipped clamp tenths.
const ZERO: f64 = 3.0 * DEG;

/// One-sigma of each coordinate of a TCP that was hit, m.
const TOOL: f64 = 5.0 * MM;

/// One-sigma of a base or an artifact that was pushed, m and rad.
const BASE: [f64; 2] = [5.0 * MM, 0.3 * DEG];

/// One-sigma of a link that was bent, m and rad.
const LINK: [f64; 2] = [1.0 * MM, 0.3 * DEG];

/// A parameter that may have moved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Movable {
    /// Its place among the parameters of the problem.
    pub parameter: usize,
    /// One-sigma of its change, SI.
    pub sigma: f64,
}

/// The touches under what was known before.
pub(super) struct Scene {
    pub problem: Problem,
    /// The model: the earlier one with the frames and the links, which a crash may have changed.
    pub model: Model,
    /// Deviation of every parameter from its start before the crash, SI.
    pub mean: DVector<f64>,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
    /// The zero of each joint.
    pub zeros: Vec<Movable>,
    /// The TCP; empty if nothing is known of it before.
    pub tool: Vec<Movable>,
    /// Base or artifact; empty if its place is not known before, or defines the world.
    pub base: Vec<Movable>,
    /// Rigid displacement within the link behind each joint but the last.
    pub links: Vec<Vec<Movable>>,
    /// Number of parameters of which nothing was known.
    pub open: usize,
    /// True of each parameter that was known to some uncertainty: it is part of a calibration.
    pub is_estimated: Vec<bool>,
    /// Factor of the whitened residuals: what the model lacks beside the stated noise.
    factors: Vec<f64>,
}

/// The whitened touches near some values of the parameters.
pub(super) struct Near {
    /// Whitened residuals of the parameters as known before, to first order about these values.
    pub residuals: DVector<f64>,
    /// Amount that one SI unit of each parameter subtracts from them.
    pub jacobian: DMatrix<f64>,
}

impl Scene {
    /// Lays the touches out.
    ///
    /// # Errors
    /// When they do not fit the robot or the model, or their noise is not stated.
    pub fn new(earlier: &Earlier<'_>, touches: NamedDataset<'_>, instrument_moved: bool) -> Result<Self, RecoveryError> {
        let model = model(earlier, touches);
        let problem = Problem::new(&[touches], &model, Use::All)?;
        if problem.setups().len() > 1 {
            return Err(RecoveryError::Sessions);
        }
        if !problem.noise_stated() {
            return Err(RecoveryError::NoNoise);
        }
        let count = problem.parameters().len();
        let mut scene = Scene {
            mean: DVector::zeros(count),
            covariance: DMatrix::zeros(count, count),
            zeros: Vec::new(),
            tool: Vec::new(),
            base: Vec::new(),
            links: Vec::new(),
            open: 0,
            is_estimated: Vec::new(),
            factors: Vec::new(),
            problem,
            model,
        };
        scene.remember(earlier, touches, instrument_moved);
        scene.is_estimated = scene.covariance.diagonal().iter().map(|v| *v > 0.0).collect();
        scene.warm();
        scene.find_movable();
        scene.weigh(earlier);
        Ok(scene)
    }

    /// Means and covariance of the parameters before.
    fn remember(&mut self, earlier: &Earlier<'_>, touches: NamedDataset<'_>, instrument_moved: bool) {
        let Dataset { tool_free, tool_sigma, .. } = *touches.dataset;
        let mut estimates = vec![None; self.mean.len()];
        let mut unseen: Vec<usize> = Vec::new();
        if let Earlier::Campaign(calibration) = earlier {
            let (values, open) = calibration.values_for(&self.problem);
            self.mean = DVector::from_vec(values);
            unseen = open;
            let place = |p: &Parameter| {
                let name = calibration.name_for(p, &self.problem)?;
                calibration.estimates.iter().position(|e| e.name == name)
            };
            estimates = self.problem.parameters().iter().map(place).collect();
            self.correlate(calibration, &estimates);
        }
        for (p, parameter) in self.problem.parameters().iter().enumerate() {
            if parameter.defines_world {
                continue;
            }
            let is_base = parameter.effect == EffectId::BASE_FRAME;
            let is_known = estimates[p].is_some() && !(is_base && instrument_moved);
            let sigma = match (parameter.owner, earlier) {
                _ if is_known => continue,
                (Owner::Robot, Earlier::Campaign(_)) => continue,
                (Owner::Robot, Earlier::Fleet(fleet)) if fleet.parameter(&parameter.spec.name).is_some() => {
                    let about = fleet.parameter(&parameter.spec.name);
                    self.mean[p] = about.map_or(0.0, |about| about.mean);
                    about.map_or(0.0, |about| about.sigma)
                }
                (Owner::Robot, _) => parameter.spec.prior,
                _ if is_base && instrument_moved => anywhere(parameter),
                // A stated TCP is taken as stated.
                _ if parameter.effect == EffectId::TOOL_FRAME && !tool_free => tool_sigma,
                _ => match parameter.knowledge {
                    Prior::Certified(sigma) | Prior::Plausible(sigma) if !is_base => sigma,
                    _ if unseen.contains(&p) => anywhere(parameter),
                    // A pose that the campaign left as stated.
                    _ if matches!(earlier, Earlier::Campaign(_)) => continue,
                    _ => anywhere(parameter),
                },
            };
            if sigma >= anywhere(parameter) {
                self.open += 1;
            }
            self.covariance.row_mut(p).fill(0.0);
            self.covariance.column_mut(p).fill(0.0);
            self.covariance[(p, p)] = sigma * sigma;
        }
    }

    /// Covariances of the estimates of a campaign.
    fn correlate(&mut self, calibration: &Calibration, estimates: &[Option<usize>]) {
        let known: Vec<[usize; 2]> = { estimates.iter().enumerate() }.filter_map(|(p, e)| Some([p, (*e)?])).collect();
        for &[p, e] in &known {
            for &[q, f] in &known {
                let [one, other] = [e, f].map(|k| calibration.estimates[k].sigma);
                self.covariance[(p, q)] = calibration.correlation[(e, f)] * one * other;
            }
        }
    }

    /// The arm is as warm as it happens to be: all its lengths have grown in proportion.
    fn warm(&mut self) {
        let of = |p: &Parameter| {
            let is_length = p.effect == EffectId::MDH && p.spec.unit == Unit::MM;
            if is_length { GROWTH * p.spec.nominal } else { 0.0 }
        };
        let grown = DVector::from_iterator(self.mean.len(), self.problem.parameters().iter().map(of));
        self.covariance += &grown * grown.transpose();
    }

    fn find_movable(&mut self) {
        let parameters = self.problem.parameters();
        let known = |p: usize| self.covariance[(p, p)].sqrt() < anywhere(&parameters[p]);
        let movable = |name: &str, [length, angle]: [f64; 2]| {
            let parameter = parameters.iter().position(|p| p.spec.name == name)?;
            let sigma = if is_angle(&parameters[parameter]) { angle } else { length };
            Some(Movable { parameter, sigma })
        };
        let joints = self.problem.robot().joints();
        let zero = |j: usize| match self.problem.robot().kind(j - 1) {
            JointKind::Revolute => format!("theta{j}"),
            JointKind::Prismatic => format!("d{j}"),
        };
        let zeros: Vec<Movable> = (1..=joints).filter_map(|j| movable(&zero(j), [TOOL, ZERO])).collect();
        let link = |j: usize| -> Vec<Movable> {
            let next = j + 1;
            let entries = [format!("alpha{j}"), format!("a{j}"), format!("beta{j}")];
            let ends = [format!("d{j}"), format!("d{next}"), format!("theta{j}"), format!("theta{next}")];
            entries.iter().chain(&ends).filter_map(|name| movable(name, LINK)).collect()
        };
        let links = (1..joints).map(link).collect();
        let of_frame = |names: Vec<String>, sizes: [f64; 2]| -> Vec<Movable> {
            let all: Vec<Movable> = names.iter().filter_map(|name| movable(name, sizes)).collect();
            let is_fixed = |m: &Movable| parameters[m.parameter].defines_world || !known(m.parameter);
            if all.iter().any(is_fixed) { Vec::new() } else { all }
        };
        let tool = of_frame(["x", "y", "z"].map(|axis| format!("tool_{axis}")).to_vec(), [TOOL, 0.0]);
        let base = of_frame(Axis6::ALL.map(|axis| format!("base_{}", axis.name())).to_vec(), BASE);
        (self.zeros, self.links, self.tool, self.base) = (zeros, links, tool, base);
    }

    /// What the model lacks, beside the noise of each touch.
    fn weigh(&mut self, earlier: &Earlier<'_>) {
        let lacking = match earlier {
            Earlier::Campaign(c) if c.noise_stated && c.chi2_per_dof.is_finite() => {
                c.rms.powi(2) / 3.0 * (1.0 - 1.0 / c.chi2_per_dof.max(1.0))
            }
            Earlier::Campaign(_) => 0.0,
            _ => NEVER_MEASURED.powi(2),
        };
        let mut factors = vec![1.0; self.problem.row_count()];
        self.problem.for_each_sample(self.mean.as_slice(), &mut |at| {
            let noise = at.variance / at.height.max(1) as f64;
            let factor = (noise / (noise + lacking)).sqrt();
            factors[at.first_row..at.first_row + at.rows].iter_mut().for_each(|f| *f = factor);
        });
        self.factors = factors;
    }

    /// The touches near `values` (deviations, SI).
    pub fn near(&self, values: &DVector<f64>) -> Near {
        let all: Vec<usize> = (0..values.len()).collect();
        let mut whitened = self.problem.whitened(values.as_slice(), &all);
        for (mut column, factor) in whitened.column_iter_mut().zip(&self.factors) {
            column *= *factor;
        }
        let last = whitened.nrows() - 1;
        let jacobian = whitened.rows(0, last).transpose();
        let here = whitened.row(last).transpose();
        Near { residuals: here + &jacobian * (values - &self.mean), jacobian }
    }

    /// Number of scalar residuals that are free of what is open.
    pub fn rows(&self) -> usize {
        self.problem.row_count().saturating_sub(self.open).max(1)
    }
}

/// The earlier model with all that a crash may change.
fn model(earlier: &Earlier<'_>, NamedDataset { dataset, .. }: NamedDataset<'_>) -> Model {
    let mut model = match earlier {
        Earlier::Campaign(calibration) => Model { fleet: None, changes: Vec::new(), ..calibration.model.clone() },
        _ => Model::default_for(dataset),
    };
    for effect in [EffectId::BASE_FRAME, EffectId::MDH, EffectId::TOOL_FRAME] {
        if !model.lists(effect) {
            model = model.with(effect);
        }
    }
    model
}

fn is_angle(parameter: &Parameter) -> bool {
    parameter.spec.unit == Unit::DEG
}

/// One-sigma of a parameter of which nothing is known, SI.
fn anywhere(parameter: &Parameter) -> f64 {
    ANYWHERE[usize::from(is_angle(parameter))]
}
