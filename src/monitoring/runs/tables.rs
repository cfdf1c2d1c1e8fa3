//! Results of the runs for every parameter and effect, and for each run.

use nalgebra::DMatrix;

use super::Difference;
use super::drift::Drift;
use super::left_out::LeftOut;
use super::look::Look;
use super::units::{CHANGE, Pattern, Unit, UnitKind};
use crate::diagnosis::Examination;
use crate::effects::EffectId;
use crate::identify::RunChange;
use crate::identify::calibration::{Calibration, Estimate};
use crate::math::positive_definite::inverse;
use crate::math::rms;
use crate::measure::dataset::NamedDataset;
use crate::measure::poses::Postures;

/// A parameter is not determined if the one-sigma of its change is at least this, in plausible sizes.
const NOT_SEEN: f64 = 3.0;

/// Standard deviations from which an effect is significant.
const THERE: f64 = 3.0;

/// A run with less than this share of the information of all runs about an effect cannot show it.
const SHARE: f64 = 0.02;

/// Outcome for a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterStatus {
    /// It is the same in all runs.
    Stayed,
    /// It is not.
    Moved,
    /// The runs cannot tell.
    Unseen,
}

impl ParameterStatus {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            ParameterStatus::Stayed => "stayed",
            ParameterStatus::Moved => "moved",
            ParameterStatus::Unseen => "unseen",
        }
    }
}

/// A parameter of the arm in all runs.
#[derive(Debug, Clone)]
pub struct ParameterInRuns {
    /// Its value in the first run, with its uncertainty.
    pub first: Estimate,
    /// Its value in the last run.
    pub last: f64,
    /// Its change in every run since the first: as the differences named have it, if it moved, and else as if it alone were free
    /// beside them; value and one sigma, SI; `None` where a run does not show it.
    pub changes: Vec<Option<[f64; 2]>>,
    /// Outcome for the parameter.
    pub status: ParameterStatus,
    /// Its drift; `None` without dates, or if the runs do not show it.
    pub drift: Option<Drift>,
}

/// Outcome for an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffectStatus {
    /// It is there, and the same in all runs.
    Stayed,
    /// It is there, with other sizes.
    Moved,
    /// It is there in one run, by index, and not in the others, which would show it.
    OnlyIn(usize),
    /// It is there in one run, by index, and the others cannot show it.
    RestsOn(usize),
    /// It is not there.
    NotThere,
}

impl EffectStatus {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            EffectStatus::Stayed => "stayed",
            EffectStatus::Moved => "moved",
            EffectStatus::OnlyIn(_) => "one_run_only",
            EffectStatus::RestsOn(_) => "rests_on_one_run",
            EffectStatus::NotThere => "not_there",
        }
    }

    /// True if it does not belong into a model of the robot.
    pub fn is_refused(self) -> bool {
        matches!(self, EffectStatus::OnlyIn(_))
    }
}

/// An effect of the model in all runs.
#[derive(Debug, Clone)]
pub struct EffectInRuns {
    /// Its id.
    pub effect: EffectId,
    /// Its parameters, all runs together.
    pub parameters: Vec<Estimate>,
    /// For every run: its size there in sigmas, all its parameters together, and the share of what all runs say of it.
    pub in_runs: Vec<[f64; 2]>,
    /// Outcome for the effect.
    pub status: EffectStatus,
}

/// A run of the robot.
#[derive(Debug, Clone)]
pub struct RunOfRobot {
    /// Its name.
    pub name: String,
    /// Number of samples that were fitted.
    pub samples: usize,
    /// Number of their postures.
    pub postures: usize,
    /// Root mean square of its residuals under the robot that the runs share, m.
    pub residual: f64,
    /// Noise of one axis that remains when error curves are allowed for, m.
    pub noise: f64,
    /// Errors there of the robot of the others, with the model given and with error curves, or the reason why there are none;
    /// `None` if they were not requested.
    pub from_others: Option<[Result<LeftOut, String>; 2]>,
}

/// Inputs of the tables.
pub(super) struct Tables<'a> {
    pub look: &'a Look,
    pub named: &'a [NamedDataset<'a>],
    pub differences: &'a [Difference],
}

impl Tables<'_> {
    /// Every parameter of the arm.
    pub fn parameters(&self) -> Vec<ParameterInRuns> {
        let of_arm = |unit: &&Unit| unit.kind == UnitKind::Parameter;
        self.look.units.all.iter().filter(of_arm).map(|unit| self.parameter(unit)).collect()
    }

    fn parameter(&self, unit: &Unit) -> ParameterInRuns {
        let Look { reduced, months, dated, .. } = self.look;
        let runs = months.len();
        let column = unit.columns[0];
        let variance = self.look.variance();
        let changes = (0..runs).map(|run| {
            if run == 0 {
                return Some([0.0, 0.0]);
            }
            let free: Vec<_> = (1..runs).map(|r| vec![(column, r, 1.0)]).collect();
            let found = reduced.explained(&free);
            let sigma = (variance * found.covariance[(run - 1, run - 1)]).sqrt();
            let plausible = self.plausible(&unit.parameters[0]);
            let seen = reduced.energy(column, run);
            (seen[1] > 1e-7 * seen[0] && sigma > 0.0 && sigma < NOT_SEEN * plausible)
                .then(|| [found.coefficients[run - 1], sigma])
        });
        let changes: Vec<Option<[f64; 2]>> = changes.collect();
        let all = self.look.estimates_of(&unit.effect);
        let first = all.into_iter().find(|e| e.name == unit.parameters[0]);
        let first = first.unwrap_or_else(|| unreachable!("a unit is of a fitted parameter"));
        let moved: Vec<&Difference> = self.differences.iter().filter(|d| self.is_of(d, &first.name)).collect();
        let names: Vec<&str> = self.named.iter().map(|d| d.name).collect();
        let weight = |d: &Difference, run: usize| unit.change(&d.pattern, &names, months).weight(names[run]);
        let size = |d: &Difference| d.parameters.first().map_or(0.0, |e| e.value);
        let by = |run: usize| -> f64 { moved.iter().map(|d| weight(d, run) * size(d)).sum() };
        let since_first = |(run, free): (usize, Option<[f64; 2]>)| {
            let weights: Vec<f64> = moved.iter().map(|d| weight(d, run) - weight(d, 0)).collect();
            // Where it has not moved yet, or no longer, it is judged as every other.
            if weights.iter().any(|w| *w != 0.0) { Some([by(run) - by(0), self.sigma_of(&moved, &weights)]) } else { free }
        };
        let changes: Vec<_> = changes.into_iter().enumerate().map(since_first).collect();
        let base = first.value;
        let status = match () {
            () if !moved.is_empty() => ParameterStatus::Moved,
            () if changes[1..].iter().all(Option::is_none) => ParameterStatus::Unseen,
            () => ParameterStatus::Stayed,
        };
        let drift = if *dated && runs > 2 { Drift::of(reduced, self.look.variance(), column, months) } else { None };
        ParameterInRuns { last: base + by(runs - 1), first: Estimate { value: base + by(0), ..first }, changes, status, drift }
    }

    /// Standard uncertainty of a sum of differences of one parameter, which were fitted together.
    fn sigma_of(&self, differences: &[&Difference], weights: &[f64]) -> f64 {
        let Examination { problem, fit, .. } = &self.look.examination;
        let column = |d: &&Difference| {
            let name = &d.parameters.first()?.name;
            fit.kept.iter().position(|&p| problem.parameters()[p].name == *name)
        };
        let columns: Vec<Option<usize>> = differences.iter().map(column).collect();
        let covariance = DMatrix::from_fn(columns.len(), columns.len(), |r, c| match (columns[r], columns[c]) {
            (Some(r), Some(c)) => self.look.variance() * self.look.reduced.covariance[(r, c)],
            _ => 0.0,
        });
        let weights = nalgebra::DVector::from_column_slice(weights);
        (covariance * &weights).dot(&weights).max(0.0).sqrt()
    }

    fn is_of(&self, difference: &Difference, parameter: &str) -> bool {
        let prefix = format!("{parameter} ");
        !difference.missing
            && difference.set_up_of.is_none()
            && difference.parameters.iter().any(|p| p.name.starts_with(&prefix))
    }

    fn plausible(&self, name: &str) -> f64 {
        let parameters = self.look.examination.problem().parameters();
        parameters.iter().find(|p| p.spec.name == name).map_or(f64::INFINITY, |p| p.spec.prior)
    }

    /// Every effect of the model beside geometry and compliance.
    pub fn effects(&self) -> Vec<EffectInRuns> {
        let of_model = |unit: &&Unit| unit.kind == UnitKind::Effect;
        self.look.units.all.iter().filter(of_model).map(|unit| self.effect(unit)).collect()
    }

    fn effect(&self, unit: &Unit) -> EffectInRuns {
        let Look { reduced, examination, months, .. } = self.look;
        let runs = months.len();
        let parameters = self.look.estimates_of(&unit.effect);
        let Examination { problem, fit, .. } = examination;
        let own: Vec<usize> =
            (0..fit.kept.len()).filter(|&c| problem.parameters()[fit.kept[c]].effect == unit.effect).collect();
        let variance = self.look.variance();
        let covariance =
            |from: &[usize]| DMatrix::from_fn(from.len(), from.len(), |r, c| variance * reduced.covariance[(from[r], from[c])]);
        let shared = nalgebra::DVector::from_iterator(parameters.len(), parameters.iter().map(|e| e.value - e.nominal));
        let sigmas = |size: &nalgebra::DVector<f64>, covariance: DMatrix<f64>| {
            // A run that does not determine every parameter of the effect does not show it.
            inverse(covariance).map_or(0.0, |inverse| (&inverse * size).dot(size).max(0.0).sqrt())
        };
        let whole = covariance(&own);
        let energies: Vec<f64> =
            (0..runs).map(|run| unit.columns.iter().map(|&c| reduced.energy(c, run)[1]).sum::<f64>()).collect();
        let total: f64 = energies.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let in_runs: Vec<[f64; 2]> = (0..runs)
            .map(|run| {
                let found = reduced.explained(&unit.directions(&Pattern::Only(run), months));
                let size = &shared + &found.coefficients;
                // The size in a run of its own: what it adds to that of all runs has its own uncertainty.
                let seen = energies[run] > 1e-7 * total;
                [if seen { sigmas(&size, &found.covariance * variance) } else { 0.0 }, energies[run] / total]
            })
            .collect();
        let named: Vec<&Difference> =
            self.differences.iter().filter(|d| d.effect == unit.effect && d.set_up_of.is_none()).collect();
        let there = sigmas(&shared, whole);
        let only = named.iter().find_map(|d| match d.pattern {
            // The others have what is shared.
            Pattern::Only(run) if there < THERE => Some(run),
            Pattern::Since(run) if there < THERE && run == runs - 1 => Some(run),
            Pattern::Since(1) if self.vanishes_since(d, &shared) => Some(0),
            _ => None,
        });
        let showing: Vec<usize> = (0..runs).filter(|&run| in_runs[run][1] >= SHARE).collect();
        let status = match (only, named.is_empty(), there >= THERE) {
            (Some(run), ..) => EffectStatus::OnlyIn(run),
            (None, false, _) => EffectStatus::Moved,
            (None, true, false) => EffectStatus::NotThere,
            (None, true, true) if showing.len() == 1 => EffectStatus::RestsOn(showing[0]),
            (None, true, true) => EffectStatus::Stayed,
        };
        EffectInRuns { effect: unit.effect.clone(), parameters, in_runs, status }
    }

    /// True if a change takes away what there was in the first run.
    fn vanishes_since(&self, difference: &Difference, first: &nalgebra::DVector<f64>) -> bool {
        let pairs = difference.parameters.iter().zip(first.iter());
        pairs.clone().count() == first.len() && pairs.map(|(e, x)| (e.value + x).abs() / e.sigma).all(|z| z < THERE)
    }

    /// The runs, without what others say of them.
    pub fn runs(&self) -> Vec<RunOfRobot> {
        let Examination { problem, fit, .. } = &self.look.examination;
        let residuals = problem.residuals(&fit.values);
        let contexts = &self.look.examination.contexts;
        let of = |(k, NamedDataset { name, dataset }): (usize, &NamedDataset<'_>)| {
            let own: Vec<_> = contexts
                .iter()
                .zip(&residuals)
                .filter(|(at, _)| problem.setups()[at.setup].dataset == *name)
                .map(|(_, r)| *r)
                .collect();
            let judged = Postures::of(&[NamedDataset::new(name, dataset)], |s| crate::identify::problem::Use::Fit.takes(s));
            let weight = self.look.examination.noise_scale.weight();
            let unit = (self.look.examination.mean_variance() / 3.0).sqrt() / weight;
            RunOfRobot {
                name: (*name).into(),
                samples: own.len(),
                postures: judged.count(),
                residual: rms(&own),
                noise: self.look.reduced.noise[k] * unit,
                from_others: None,
            }
        };
        self.named.iter().enumerate().map(of).collect()
    }
}

/// A calibration with changes as the robot is in one run: each parameter at its value there. Set-ups in which the arm was another
/// one are left out.
pub(super) fn as_in(calibration: &Calibration, run: &str) -> Calibration {
    let model = &calibration.model;
    let m = calibration.estimates.len();
    let is_change = |e: &Estimate| e.effect.starts_with(CHANGE);
    let kept: Vec<usize> = (0..m).filter(|&k| !is_change(&calibration.estimates[k])).collect();
    // Each kept parameter plus its changes in that run.
    let mut sum = DMatrix::zeros(kept.len(), m);
    for (row, &k) in kept.iter().enumerate() {
        sum[(row, k)] = 1.0;
        for change in &model.changes {
            let name = change.parameter_name(&calibration.estimates[k].name);
            let own = calibration.estimates.iter().position(|e| e.effect == change.id() && e.name == name);
            if let Some(own) = own {
                sum[(row, own)] = change.weight(run);
            }
        }
    }
    let sigma: Vec<f64> = calibration.estimates.iter().map(|e| e.sigma).collect();
    let noise: Vec<f64> = calibration.estimates.iter().map(|e| e.sigma_noise).collect();
    let turned = |sigma: &[f64]| {
        let covariance = DMatrix::from_fn(m, m, |r, c| calibration.correlation[(r, c)] * sigma[r] * sigma[c]);
        &sum * covariance * sum.transpose()
    };
    let (covariance, of_noise) = (turned(&sigma), turned(&noise));
    let estimate = |(row, &k): (usize, &usize)| {
        let e = &calibration.estimates[k];
        let changed: f64 = (0..m).filter(|&c| c != k).map(|c| sum[(row, c)] * calibration.estimates[c].value).sum();
        Estimate {
            value: e.value + changed,
            sigma: covariance[(row, row)].max(0.0).sqrt(),
            sigma_noise: of_noise[(row, row)].max(0.0).sqrt(),
            ..e.clone()
        }
    };
    let estimates: Vec<Estimate> = kept.iter().enumerate().map(estimate).collect();
    let correlation = DMatrix::from_fn(kept.len(), kept.len(), |r, c| match r == c {
        true => 1.0,
        false => covariance[(r, c)] / (estimates[r].sigma * estimates[c].sigma).max(f64::MIN_POSITIVE),
    });
    // What is not of the robot in any run is of no set-up that the calibration may describe.
    let then = |change: &RunChange| if model.lists(&change.effect) { change.weight(run) } else { 0.0 };
    let like_then = |dataset: &str| model.changes.iter().all(|change| (change.weight(dataset) - then(change)).abs() < 1e-9);
    let mut out = calibration.clone();
    out.setups.retain(|setup| like_then(&setup.dataset));
    let left: Vec<&str> = out.setups.iter().map(|s| s.label.as_str()).collect();
    let stays = |name: &str| name.split_once('@').is_none_or(|(_, label)| left.contains(&label));
    let of_kept: Vec<usize> = (0..estimates.len()).filter(|&k| stays(&estimates[k].name)).collect();
    out.correlation = correlation.select_rows(&of_kept).select_columns(&of_kept);
    out.estimates = of_kept.iter().map(|&k| estimates[k].clone()).collect();
    out.unresolved.retain(|group| group.iter().all(|name| !name.contains(' ') && stays(name)));
    out.model.changes.clear();
    out
}
