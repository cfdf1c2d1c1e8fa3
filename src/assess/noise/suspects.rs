//! Samples that disagree with all others, found by a Student-t fit (nu = 4, iteratively reweighted) linearised about the least-squares
//! fit. Whole postures are judged first, then single samples: where several targets are seen from one posture, a bad posture hides a bad
//! sample.
//!
//! On Gaussian noise a campaign has a suspect with a chance of less than 1e-3.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::{Row, rows};
use crate::identify::{Fit, IdentifyError, Model, Problem, Use, fit};
use crate::math::linalg;
use crate::measure::{Dataset, Postures};

/// A posture or sample further than this from what all others say, in robust one-sigmas, may be a suspect.
pub const SUSPECT_DEVIATION: f64 = 6.0;

/// Chance, of all samples together, at which one is believed to be a suspect by the least-squares fit of the others.
const FALSE_ALARM: f64 = 1e-3;

/// More suspects than this share of the postures, and more than [`ALWAYS_ALLOWED`], are no accidents but something that the model lacks.
const MOST: f64 = 0.05;
const ALWAYS_ALLOWED: usize = 2;

/// Degrees of freedom of the Student-t fit, rounds, and the change of a weight at which it ends.
const NU: f64 = 4.0;
const ROUNDS: usize = 30;
const SETTLED: f64 = 1e-4;

/// Leverage counts up to here: a sample that determines a parameter alone cannot be judged.
const MOST_LEVERAGE: f64 = 0.9;

/// With more rows than this no single one pulls on the fit by more than a per cent or two, and leverages are not worth their time.
const MANY_ROWS: usize = 3000;

/// A sample that disagrees with all others.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// Its dataset, by place.
    pub dataset: usize,
    /// Its name.
    pub sample: String,
    /// Its place among the samples of the problem.
    pub place: usize,
    /// How far it is off what the others say, in one-sigmas of their scatter.
    pub deviation: f64,
    /// Chance that Gaussian noise makes any sample of this campaign so bad.
    pub chance: f64,
}

/// The samples of set `fit` that disagree with all others under `model`; none where they are so many that the model is to blame.
///
/// # Errors
/// When data and model do not go together, or do not determine the unknowns.
pub fn suspects(datasets: &[(&str, &Dataset)], model: &Model) -> Result<Vec<Suspect>, IdentifyError> {
    let problem = Problem::new(datasets, model, Use::Fit)?;
    let fit = fit(&problem)?;
    Ok(suspects_of(datasets, &problem, &fit))
}

/// The same of a fitted problem.
pub(crate) fn suspects_of(datasets: &[(&str, &Dataset)], problem: &Problem, fit: &Fit) -> Vec<Suspect> {
    let rows = rows(problem, &fit.values);
    let postures = Postures::of(datasets, |s| Use::Fit.takes(s));
    if postures.of_samples().len() != rows.len() {
        return Vec::new();
    }
    let near = Near::new(problem, fit);
    let all_of = |members: &[usize]| -> Unit {
        Unit {
            samples: members.to_vec(),
            rows: members.iter().flat_map(|&i| rows[i].first_row..rows[i].first_row + rows[i].height).collect(),
        }
    };
    let members = postures.members();
    let by_posture: Vec<Unit> = members.iter().map(|m| all_of(m)).collect();
    let stated = problem.noise_stated();
    let most = ALWAYS_ALLOWED.max((MOST * members.len() as f64) as usize);
    let bad = near.far_off(&by_posture, &[], stated);
    if bad.len() > most {
        return Vec::new();
    }
    let mut found: Vec<(usize, f64, f64)> = Vec::new();
    let bad_units: Vec<Unit> = bad.iter().map(|&u| by_posture[u].clone()).collect();
    found.extend(near.confirmed(&bad_units, by_posture.len(), stated));
    if members.len() < rows.len() {
        let aside: Vec<usize> = found.iter().map(|f| f.0).collect();
        let by_sample: Vec<Unit> = (0..rows.len()).filter(|i| !aside.contains(i)).map(|i| all_of(&[i])).collect();
        let aside_rows: Vec<usize> = aside.iter().flat_map(|&i| all_of(&[i]).rows).collect();
        let bad = near.far_off(&by_sample, &aside_rows, stated);
        if bad.len() <= most {
            let mut units: Vec<Unit> = bad.iter().map(|&u| by_sample[u].clone()).collect();
            units.extend(bad_units.iter().cloned());
            let more = near.confirmed(&units, by_sample.len(), stated);
            found.extend(more.into_iter().filter(|(i, ..)| !aside.contains(i)));
        }
    }
    named(datasets, &rows, found)
}

fn named(datasets: &[(&str, &Dataset)], rows: &[Row], mut found: Vec<(usize, f64, f64)>) -> Vec<Suspect> {
    let taken = datasets.iter().enumerate().flat_map(|(d, (_, data))| data.samples.iter().map(move |s| (d, s)));
    let samples: Vec<(usize, &str)> = taken.filter(|(_, s)| Use::Fit.takes(s)).map(|(d, s)| (d, s.id.as_str())).collect();
    found.retain(|(i, ..)| *i < rows.len());
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let suspect = |(place, deviation, chance): (usize, f64, f64)| {
        let (dataset, sample) = samples[place];
        Suspect { dataset, sample: sample.to_owned(), place, deviation, chance }
    };
    found.into_iter().map(suspect).collect()
}

/// Rows that are judged as one.
#[derive(Clone)]
struct Unit {
    samples: Vec<usize>,
    rows: Vec<usize>,
}

impl Unit {
    /// Independent numbers in it: a posture tells three, however many targets and repeats it has.
    fn numbers(&self) -> usize {
        self.rows.len().clamp(1, 3)
    }
}

/// Median of chi-square with one, two, three degrees of freedom.
const MEDIAN: [f64; 3] = [0.4549, 1.3863, 2.3660];

/// The whitened problem near its fit, transposed: columns of the parameters, then the residual.
struct Near {
    rows: DMatrix<f64>,
    parameters: usize,
    /// Information known beforehand, and what it pulls towards.
    information: Vec<(f64, f64)>,
}

/// A weighted fit of such rows.
struct Fitted {
    residuals: Vec<f64>,
    /// Of each row, if its weight were one.
    leverages: Vec<f64>,
}

impl Near {
    fn new(problem: &Problem, fit: &Fit) -> Self {
        let mut rows = problem.whitened(&fit.values, &fit.kept);
        let parameters = fit.kept.len();
        // Columns of unit length, so that millimetres and radians weigh alike.
        let scales: Vec<f64> = (0..parameters).map(|k| 1.0 / rows.row(k).norm().max(f64::MIN_POSITIVE)).collect();
        scales.iter().enumerate().for_each(|(k, s)| rows.row_mut(k).scale_mut(*s));
        let known = fit.kept.iter().zip(&scales).map(|(&p, s)| {
            let information = problem.parameters()[p].knowledge.information();
            (information * s * s, -information * fit.values[p] * s)
        });
        Near { information: known.collect(), rows, parameters }
    }

    /// A weighted fit: what it leaves of every row, and what a row of unit weight pulls on it.
    fn fitted(&self, weights: &[f64]) -> Option<Fitted> {
        let m = self.parameters;
        let mut weighted = self.rows.clone();
        weighted.column_iter_mut().zip(weights).for_each(|(mut c, w)| c *= w.sqrt());
        let mut products = DMatrix::zeros(m + 1, m + 1);
        linalg::normal_matrix(&weighted, &mut products);
        let mut normal = products.view((0, 0), (m, m)).into_owned();
        let mut step: Vec<f64> = (0..m).map(|k| products[(k, m)]).collect();
        for (k, (information, pull)) in self.information.iter().enumerate() {
            normal[(k, k)] += information + 1e-12;
            step[k] += pull;
        }
        let mut factor = linalg::Cholesky::new(m);
        factor.factor(&normal).ok()?;
        factor.solve_in_place(&mut step);
        let step = DVector::from_vec(step);
        let residuals = self.rows.column_iter().map(|c| c[m] - c.rows(0, m).dot(&step)).collect();
        if self.rows.ncols() > MANY_ROWS {
            return Some(Fitted { residuals, leverages: vec![0.0; self.rows.ncols()] });
        }
        let mut root = DMatrix::zeros(m, m);
        factor.inverse_root(&mut root);
        // A row of zeros for the residual.
        let pulls = linalg::product_of_transposed(&root.insert_row(m, 0.0), &self.rows);
        Some(Fitted { residuals, leverages: pulls.column_iter().map(|c| c.norm_squared()).collect() })
    }

    /// Whitened squares of a unit as of its independent numbers, its own pull on the fit counted out.
    fn squares(unit: &Unit, fitted: &Fitted, weights: &[f64]) -> f64 {
        let count = unit.rows.len().max(1) as f64;
        let mean = unit.rows.iter().map(|&r| fitted.residuals[r].powi(2)).sum::<f64>() / count;
        let pull = unit.rows.iter().map(|&r| weights[r] * fitted.leverages[r]).sum::<f64>() / count;
        unit.numbers() as f64 * mean / (1.0 - pull.min(MOST_LEVERAGE))
    }

    /// Units that a Student-t fit leaves far off; rows `aside` have no weight.
    fn far_off(&self, units: &[Unit], aside: &[usize], stated: bool) -> Vec<usize> {
        let mut weights = vec![1.0; self.rows.ncols()];
        aside.iter().for_each(|&r| weights[r] = 0.0);
        let mut ratios = Vec::new();
        for _ in 0..ROUNDS {
            let Some(fitted) = self.fitted(&weights) else { return Vec::new() };
            let squares: Vec<f64> = units.iter().map(|u| Near::squares(u, &fitted, &weights)).collect();
            let mut sorted: Vec<f64> = squares.iter().zip(units).map(|(s, u)| s / MEDIAN[u.numbers() - 1]).collect();
            sorted.sort_by(f64::total_cmp);
            let Some(&median) = sorted.get(sorted.len() / 2) else { return Vec::new() };
            // Noise that is stated is no smaller than it is stated.
            let unit = if stated { median.max(1.0) } else { median.max(f64::MIN_POSITIVE) };
            ratios = squares.iter().map(|s| s / unit).collect();
            let mut change = 0.0_f64;
            for (u, ratio) in units.iter().zip(&ratios) {
                let weight = (NU + u.numbers() as f64) / (NU + ratio);
                for &r in &u.rows {
                    change = change.max((weights[r] - weight).abs());
                    weights[r] = weight;
                }
            }
            if change < SETTLED {
                break;
            }
        }
        let limit = upper_chance(SUSPECT_DEVIATION * SUSPECT_DEVIATION, 3);
        (0..units.len()).filter(|&u| upper_chance(ratios[u], units[u].numbers()) < limit).collect()
    }

    /// Of units that seem far off, the samples that are so by the least-squares fit of all others: place, deviation, chance.
    fn confirmed(&self, units: &[Unit], of: usize, stated: bool) -> Vec<(usize, f64, f64)> {
        if units.is_empty() {
            return Vec::new();
        }
        let mut weights = vec![1.0; self.rows.ncols()];
        units.iter().flat_map(|u| &u.rows).for_each(|&r| weights[r] = 0.0);
        let Some(Fitted { residuals, leverages }) = self.fitted(&weights) else { return Vec::new() };
        let squares: f64 = residuals.iter().zip(&weights).map(|(r, w)| w * r * r).sum();
        let dof = weights.iter().sum::<f64>() - self.parameters as f64;
        if dof < 3.0 {
            return Vec::new();
        }
        let unit = if stated { (squares / dof).max(1.0) } else { (squares / dof).max(f64::MIN_POSITIVE) };
        let mut found = Vec::new();
        for u in units {
            let numbers = u.numbers() as f64;
            let count = u.rows.len().max(1) as f64;
            let mean = u.rows.iter().map(|&r| residuals[r].powi(2)).sum::<f64>() / count;
            // Predicted by the others: their uncertainty adds to the noise.
            let spread = 1.0 + u.rows.iter().map(|&r| leverages[r]).sum::<f64>() / count;
            let ratio = mean / (unit * spread);
            let tail = FisherSnedecor::new(numbers, dof).map_or(1.0, |d| d.sf(ratio));
            let chance = (tail * of as f64).min(1.0);
            if chance < FALSE_ALARM {
                found.extend(u.samples.iter().map(|&i| (i, (numbers * ratio).sqrt(), chance)));
            }
        }
        found
    }
}

fn upper_chance(squares: f64, numbers: usize) -> f64 {
    ChiSquared::new(numbers as f64).map_or(1.0, |d| d.sf(squares.max(0.0)))
}
