//! From the solution to what is reported: uncertainties over the combinations, and calibrations of the robot before and after
//! mastering.

use nalgebra::{DMatrix, DVector};

use super::scene::{Movable, Scene};
use super::search::{Change, Search, Solution, not_finite, spread};
use super::{Changed, Earlier, Moved, RecoveryError, WorstTouch, ZeroChange};
use calibench::identify::calibration::{Calibration, Estimate, MeasuredSetup};
use calibench::identify::fit::Outcome;
use calibench::identify::problem::{Parameter, Prior, Setup};
use calibench::identify::{FittedRows, Model};
use calibench::math::ScaledCholesky;
use calibench::math::{Observability, rms};
use calibench::measure::dataset::NamedDataset;

/// Ratio of the variance of the touches to the stated one up to which noise is not a reason to doubt the result: a noise is
/// stated from a data sheet.
pub(super) const NOISE_ALLOWED: f64 = 4.0;

/// The changes of the best combination, as sure as all combinations that hold them are.
pub(super) struct Average<'a> {
    scene: &'a Scene,
    best: &'a Solution,
    found: &'a [Solution],
}

impl<'a> Average<'a> {
    pub fn new(scene: &'a Scene, found: &'a [Solution], best: &'a Solution) -> Self {
        Average { scene, best, found }
    }

    /// The change of a parameter in the best solution, with the scatter over all solutions that move it too.
    fn of(&self, parameter: usize, holds: &dyn Fn(&Moved) -> bool) -> Option<Changed> {
        let change = |s: &Solution| -> Option<Change> { s.changes.iter().find(|c| c.parameter == parameter).copied() };
        let own = change(self.best)?;
        let top = self.best.weighed.ln;
        let (mut sum, mut variance) = (0.0, 0.0);
        for s in self.found.iter().filter(|s| holds(&s.weighed.moved)) {
            let (Some(its), weight) = (change(s), (s.weighed.ln - top).exp()) else { continue };
            let sigma = its.sigma * self.scene.scale(s.squares);
            sum += weight;
            variance += weight * (sigma.powi(2) + (its.value - own.value).powi(2));
        }
        let sigma = if sum > 0.0 { (variance / sum).sqrt() } else { own.sigma };
        Some(Changed { change: own.value, sigma })
    }

    /// The zeros that changed.
    pub fn zeros(&self) -> Vec<ZeroChange> {
        let of = |&joint: &usize| {
            let place = self.scene.zeros.get(joint - 1)?.parameter;
            let Changed { change, sigma } = self.of(place, &|m| m.zeros.contains(&joint))?;
            Some(ZeroChange { joint, change, sigma })
        };
        self.best.weighed.moved.zeros.iter().filter_map(of).collect()
    }

    /// The change of the TCP.
    pub fn tool(&self) -> Option<[Changed; 3]> {
        let all: Vec<Changed> = self.scene.tool.iter().filter_map(|m| self.of(m.parameter, &|moved| moved.tool)).collect();
        all.try_into().ok().filter(|_| self.best.weighed.moved.tool)
    }
}

/// Standard uncertainty with which the touches show the zero of each joint alone, near the broad solution.
pub(super) fn shown(scene: &Scene, search: &Search) -> Result<Vec<f64>, RecoveryError> {
    let near = scene.near(&search.broad.values);
    let one = |zero: &Movable| -> Result<f64, RecoveryError> {
        let mut covariance = scene.covariance.clone();
        for open in scene.tool.iter().chain(&scene.base) {
            covariance[(open.parameter, open.parameter)] += open.sigma.powi(2);
        }
        let noise = spread(&near.jacobian, &covariance);
        let column = near.jacobian.column(zero.parameter).into_owned();
        let column = DMatrix::from_column_slice(column.len(), 1, column.as_slice());
        let information = ScaledCholesky::of(&noise).map_err(not_finite)?.half(column).norm_squared();
        Ok(if information > 0.0 { information.sqrt().recip() } else { f64::INFINITY })
    };
    scene.zeros.iter().map(one).collect()
}

/// The touch that is furthest from a solution.
pub(super) fn worst(scene: &Scene, best: &Solution) -> WorstTouch {
    let mut worst = WorstTouch { id: String::new(), residual: 0.0, sigmas: -1.0 };
    scene.problem.for_each_sample(best.values.as_slice(), &mut |at| {
        let sigmas = (at.whitener * at.residual).norm() / (at.height as f64).sqrt();
        if sigmas > worst.sigmas {
            let id = scene.problem.sample_ids().get(at.place).cloned().unwrap_or_default();
            worst = WorstTouch { id, residual: at.residual.norm(), sigmas };
        }
    });
    worst
}

/// The robot as it is, and as it will be when the zeros found are entered.
pub(super) fn calibrations(
    scene: &Scene,
    earlier: &Earlier<'_>,
    touches: NamedDataset<'_>,
    best: &Solution,
) -> (Calibration, Calibration) {
    let now = calibration(scene, earlier, touches, best, &best.values);
    let mut values = best.values.clone();
    let zeros = best.weighed.moved.zeros.iter().filter_map(|&j| scene.zeros.get(j - 1));
    for zero in zeros.filter(|_| best.weighed.moved.bent.is_none()) {
        let change = best.changes.iter().find(|c| c.parameter == zero.parameter);
        values[zero.parameter] -= change.map_or(0.0, |c| c.value);
    }
    let mastered = calibration(scene, earlier, touches, best, &values);
    (now, mastered)
}

fn calibration(
    scene: &Scene,
    earlier: &Earlier<'_>,
    touches: NamedDataset<'_>,
    best: &Solution,
    values: &DVector<f64>,
) -> Calibration {
    let parameters = scene.problem.parameters();
    let variance = |p: usize| best.covariance[(p, p)];
    let changed = |p: usize| scene.is_estimated[p] || best.changes.iter().any(|c| c.parameter == p);
    let known: Vec<usize> = (0..parameters.len()).filter(|&p| changed(p) && variance(p) > 0.0).collect();
    let scale = scene.scale(best.squares);
    let estimate = |p: usize| {
        let parameter: &Parameter = &parameters[p];
        let sigma = scale * variance(p).sqrt();
        Estimate {
            name: parameter.name.clone(),
            effect: parameter.effect.clone(),
            unit: parameter.spec.unit,
            value: parameter.start + values[p],
            sigma,
            sigma_noise: sigma,
            nominal: parameter.spec.nominal,
            stated_sigma: match parameter.knowledge {
                Prior::Certified(sigma) => Some(sigma),
                _ => None,
            },
        }
    };
    let estimates: Vec<Estimate> = known.iter().map(|&p| estimate(p)).collect();
    let correlation = DMatrix::from_fn(known.len(), known.len(), |r, c| {
        let (p, q) = (known[r], known[c]);
        let both = 0.5 * (best.covariance[(p, q)] + best.covariance[(q, p)]);
        if r == c { 1.0 } else { (both / (variance(p) * variance(q)).sqrt()).clamp(-1.0, 1.0) }
    });
    let NamedDataset { dataset, .. } = touches;
    let setup = |s: &Setup| MeasuredSetup {
        label: s.label.clone(),
        dataset: s.dataset.clone(),
        session: s.session.clone(),
        base: s.start,
        tool: s.tool,
        gravity: s.gravity,
        payloads: dataset.payloads.clone(),
        duration_s: s.duration_s,
    };
    let plain = || Calibration {
        robot: dataset.robot.clone(),
        robot_reference: dataset.robot_reference.clone(),
        model: Model::default(),
        estimates: Vec::new(),
        correlation: DMatrix::zeros(0, 0),
        unresolved: Vec::new(),
        setups: Vec::new(),
        outcome: Some(Outcome::Converged),
        samples: dataset.samples.len(),
        rms: rms(&scene.problem.residuals(best.values.as_slice())),
        rms_orientation: None,
        chi2_per_dof: 1.0,
        dof: scene.rows(),
        rank: known.len(),
        condition: 1.0,
        observability: Observability { o1: 0.0, o2: 0.0, o3: 0.0, o4: 0.0, o5: 0.0 },
        noise_stated: true,
        iterations: 0,
        joint_ranges: scene.problem.joint_ranges(),
        dataset_hashes: vec![dataset.hash.clone()],
        fitted_rows: FittedRows::of(&[touches]),
        absolute_accuracy: dataset.absolute_accuracy,
        fleet_robots: None,
        misfit: None,
    };
    let before = match earlier {
        Earlier::Campaign(calibration) => (*calibration).clone(),
        _ => plain(),
    };
    let mut unresolved = before.unresolved.clone();
    unresolved.retain(|group| group.first().is_some_and(|name| !estimates.iter().any(|e| e.name == *name)));
    Calibration {
        model: scene.model.clone(),
        estimates,
        correlation,
        unresolved,
        setups: scene.problem.setups().iter().map(setup).collect(),
        ..before
    }
}
