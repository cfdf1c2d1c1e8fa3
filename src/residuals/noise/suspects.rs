//! Samples that disagree with all others, found by a Student-t fit (nu = 4, iteratively reweighted) linearised about the
//! least-squares fit. Whole postures are judged first, then single samples: a bad posture hides a bad sample of several targets.
//! Postures that follow each other in time may be of one accident, and hide each other: the run without which all others fit
//! best is looked into as well.
//!
//! With Gaussian noise, a campaign has a suspect with a probability of less than 1e-3.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::accidents::{accidents, in_time, stand_together};
use super::{Row, Unit, rows};
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::{Fit, fit};
use crate::identify::problem::{Problem, Use};
use crate::math::CHI2_MEDIAN;
use crate::math::linalg::{self, LinalgError};
use crate::math::positive_definite;
use crate::measure::dataset::{NamedDataset, Sample};
use crate::measure::poses::Postures;
use crate::residuals::noise_floor::chi2_chance;

/// A posture or sample that deviates from all others by more than this, in robust one-sigmas, may be a suspect.
pub(crate) const SUSPECT_DEVIATION: f64 = 6.0;

/// Significance level, for all samples together, at which the least-squares fit of the others confirms a suspect.
const FALSE_ALARM: f64 = 1e-3;

/// Largest share of the postures that may be suspects: more of them, and more than [`ALWAYS_ALLOWED`], are not accidents but
/// indicate an effect that the model lacks.
const MOST: f64 = 0.05;
/// Number of suspects that are allowed however few the postures.
const ALWAYS_ALLOWED: usize = 2;

/// The same of suspects that deviate by more than [`GROSS_DEVIATION`] and stand apart: errors of an arm are of neighbours, too.
const MOST_GROSS: f64 = 0.12;
/// Deviation, in robust one-sigmas, of such a suspect.
const GROSS_DEVIATION: f64 = 15.0;

/// Largest share of the postures that may be suspects where they follow each other: one accident spoils whatever is measured until
/// it is noticed.
const MOST_IN_RUNS: f64 = 0.15;
/// Longest run that is sought; such a run may hide itself, since each of it is predicted by the others.
const LONGEST_RUN: usize = 8;
/// Probability by chance at which a run is looked into, of all runs together.
const RUN_ALARM: f64 = 1e-6;
/// With more postures than this, no few of them hide each other, and runs are not sought.
const MOST_FOR_RUNS: usize = 400;

/// Degrees of freedom of the Student-t fit.
const NU: f64 = 4.0;
/// Largest number of iterations of that fit.
const ROUNDS: usize = 30;
/// Change of a weight at which the iterations stop, dimensionless.
const SETTLED: f64 = 1e-4;

/// Largest leverage taken into account: a sample that alone determines a parameter cannot be judged.
const MOST_LEVERAGE: f64 = 0.9;

/// With more rows than this, no single one has a leverage of more than a per cent or two, and leverages are not
/// computed.
const MANY_ROWS: usize = 3000;

/// A sample that disagrees with all others.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// Index of its dataset.
    pub dataset: usize,
    /// Name of the sample.
    pub sample: String,
    /// Its index among the samples of the problem.
    pub place: usize,
    /// Deviation from the prediction of the others, in one-sigmas of their scatter.
    pub deviation: f64,
    /// Probability that Gaussian noise causes so large a deviation in any sample of this campaign.
    pub chance: f64,
}

/// Finds the samples of set `fit` that disagree with all others under `model`; none if there are so many that the model
/// must be wrong.
///
/// ```
/// use calibench::identify::Model;
/// # use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
/// use calibench::residuals::noise::suspects;
/// # use calibench::robot::kinematics::world_from_tool;
/// # use calibench::robot::{FramePose, built_in};
/// use calibench::units::{MM, UM};
/// # let robot = std::sync::Arc::new(built_in("ur5").ok_or("built in")?);
/// # let sample = |k: usize| {
/// #     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
/// #     let fraction = |i: usize| (((k + 7) * (i + 3)) as f64 * 0.414).fract();
/// #     let noise = calibench::nalgebra::Vector3::from_fn(|i, _| 40.0 * UM * (fraction(i) - 0.5));
/// #     let seen = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &q).translation.vector;
/// #     Sample::new(format!("p{k}"), q, Measured::Point(seen + noise))
/// # };
/// # let samples = (0..40).map(sample).collect();
/// # let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
/// # let mut data = Dataset { robot: robot.clone(), noise, samples, ..Dataset::default() };
///
/// // Forty points, one of which was mistyped by a millimetre.
/// if let Measured::Point(point) = &mut data.samples[7].measured {
///     point.x += 1.0 * MM;
/// }
/// let found = suspects(&[NamedDataset::new("campaign", &data)], &Model::of(&["base_frame"]))?;
/// assert_eq!(found.iter().map(|s| s.sample.as_str()).collect::<Vec<_>>(), ["p7"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the data do not fit the model, or do not determine the unknowns.
pub fn suspects(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Vec<Suspect>, IdentifyError> {
    let problem = Problem::new(datasets, model, Use::Fit)?;
    let fit = fit(&problem)?;
    Ok(suspects_of(datasets, &problem, &fit))
}

/// As [`suspects`], for a fitted problem.
pub(crate) fn suspects_of(datasets: &[NamedDataset<'_>], problem: &Problem, fit: &Fit) -> Vec<Suspect> {
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
    let q: Vec<&[f64]> = samples(datasets).map(|(_, s)| s.q.as_slice()).collect();
    // Of an accident all that deviate do so grossly; of an arm the gross ones are the peak of others.
    let gross = |units: &[Unit], aside: &[usize], all: &[usize]| {
        let bad = near.far_off(units, aside, GROSS_DEVIATION, stated);
        let of: Vec<&[f64]> = units.iter().map(|u| q[u.samples[0]]).collect();
        let is_few = bad.len() as f64 <= MOST_GROSS * units.len() as f64;
        if is_few && 5 * bad.len() >= 4 * all.len() && !stand_together(&of, all) { bad } else { Vec::new() }
    };
    let most = ALWAYS_ALLOWED.max((MOST * members.len() as f64) as usize);
    let mut bad = near.far_off(&by_posture, &[], SUSPECT_DEVIATION, stated);
    let order = in_time(datasets, &members);
    bad.extend(near.run(&by_posture, &order, stated));
    bad.sort_unstable();
    bad.dedup();
    let most_in_runs = most.max((MOST_IN_RUNS * members.len() as f64) as usize);
    if accidents(&bad, &order) > most || bad.len() > most_in_runs {
        // A posture with several measurements is bad by one of them.
        bad = if members.len() == rows.len() { gross(&by_posture, &[], &bad) } else { Vec::new() };
    }
    let mut found: Vec<(usize, f64, f64)> = Vec::new();
    let bad_units: Vec<Unit> = bad.iter().map(|&u| by_posture[u].clone()).collect();
    found.extend(near.confirmed(&bad_units, by_posture.len(), stated));
    if members.len() < rows.len() {
        let aside: Vec<usize> = found.iter().map(|f| f.0).collect();
        let by_sample: Vec<Unit> = (0..rows.len()).filter(|i| !aside.contains(i)).map(|i| all_of(&[i])).collect();
        let aside_rows: Vec<usize> = aside.iter().flat_map(|&i| all_of(&[i]).rows).collect();
        let few = near.far_off(&by_sample, &aside_rows, SUSPECT_DEVIATION, stated);
        let bad = if few.len() <= most { few } else { gross(&by_sample, &aside_rows, &few) };
        if !bad.is_empty() {
            let mut units: Vec<Unit> = bad.iter().map(|&u| by_sample[u].clone()).collect();
            units.extend(bad_units.iter().cloned());
            let more = near.confirmed(&units, by_sample.len(), stated);
            found.extend(more.into_iter().filter(|(i, ..)| !aside.contains(i)));
        }
    }
    // Orientations apart from positions: the errors of both need not be of the size in which they were stated.
    let aside: Vec<usize> = found.iter().map(|f| f.0).collect();
    let turned: Vec<Unit> = (0..rows.len())
        .filter(|&i| rows[i].rows > rows[i].height && !aside.contains(&i))
        .map(|i| Unit {
            samples: vec![i],
            rows: (rows[i].first_row + rows[i].height..rows[i].first_row + rows[i].rows).collect(),
        })
        .collect();
    let aside_rows: Vec<usize> = aside.iter().flat_map(|&i| rows[i].first_row..rows[i].first_row + rows[i].rows).collect();
    let bad = near.far_off(&turned, &aside_rows, SUSPECT_DEVIATION, stated);
    if bad.len() <= most {
        let units: Vec<Unit> = bad.iter().map(|&u| turned[u].clone()).collect();
        found.extend(near.confirmed(&units, turned.len(), stated));
    }
    named(datasets, &rows, found)
}

/// The samples of set `fit`, with the index of their dataset.
fn samples<'a>(datasets: &[NamedDataset<'a>]) -> impl Iterator<Item = (usize, &'a Sample)> {
    let all = datasets.iter().enumerate().flat_map(|(d, of)| of.dataset.samples.iter().map(move |s| (d, s)));
    all.filter(|(_, s)| Use::Fit.takes(s))
}

fn named(datasets: &[NamedDataset<'_>], rows: &[Row], mut found: Vec<(usize, f64, f64)>) -> Vec<Suspect> {
    let samples: Vec<(usize, &str)> = samples(datasets).map(|(d, s)| (d, s.id.as_str())).collect();
    found.retain(|(i, ..)| *i < rows.len());
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let suspect = |(place, deviation, chance): (usize, f64, f64)| {
        let (dataset, sample) = samples[place];
        Suspect { dataset, sample: sample.to_owned(), place, deviation, chance }
    };
    found.into_iter().map(suspect).collect()
}

/// The whitened problem, linearised at its fit and transposed: one row per parameter, then the residuals.
struct Near {
    rows: DMatrix<f64>,
    parameters: usize,
    /// For each row, whether it is of an orientation.
    of_orientation: Vec<bool>,
    /// Prior information of each parameter, and its contribution to the gradient.
    information: Vec<(f64, f64)>,
}

/// Result of a weighted fit.
struct Fitted {
    residuals: Vec<f64>,
    /// Leverage of each row at unit weight.
    leverages: Vec<f64>,
}

impl Near {
    fn new(problem: &Problem, fit: &Fit) -> Self {
        let mut rows = problem.whitened(&fit.values, &fit.kept);
        let parameters = fit.kept.len();
        // Parameters are scaled to unit norm, as millimetres and radians differ in size.
        let scales: Vec<f64> = (0..parameters).map(|k| 1.0 / rows.row(k).norm().max(f64::MIN_POSITIVE)).collect();
        scales.iter().enumerate().for_each(|(k, s)| rows.row_mut(k).scale_mut(*s));
        let known = fit.kept.iter().zip(&scales).map(|(&p, s)| {
            let information = problem.information(p);
            (information * s * s, -information * fit.values[p] * s)
        });
        let mut of_orientation = vec![false; rows.ncols()];
        problem.for_each_sample(&fit.values, &mut |s| {
            of_orientation[s.first_row + s.height..s.first_row + s.rows].fill(true);
        });
        Near { information: known.collect(), rows, parameters, of_orientation }
    }

    /// Fits with weights. Returns the residual of every row and its leverage at unit weight.
    ///
    /// # Errors
    /// When the weighted rows do not determine the parameters.
    fn fitted(&self, weights: &[f64]) -> Result<Fitted, LinalgError> {
        let (residuals, root) = self.solved(weights)?;
        if self.rows.ncols() > MANY_ROWS {
            return Ok(Fitted { residuals, leverages: vec![0.0; self.rows.ncols()] });
        }
        let leverages = self.pulls(root).column_iter().map(|c| c.norm_squared()).collect();
        Ok(Fitted { residuals, leverages })
    }

    /// The parameters by which each row is drawn, in their one-sigmas: inner products of its columns are leverages.
    fn pulls(&self, root: DMatrix<f64>) -> DMatrix<f64> {
        // A row of zeros for the residual.
        linalg::product_of_transposed(&root.insert_row(self.parameters, 0.0), &self.rows)
    }

    /// The residual of every row of a weighted fit, and the root of the inverse of its normal matrix.
    ///
    /// # Errors
    /// When the weighted rows do not determine the parameters.
    fn solved(&self, weights: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), LinalgError> {
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
        factor.factor(&normal)?;
        factor.solve_in_place(&mut step);
        let step = DVector::from_vec(step);
        let residuals = self.rows.column_iter().map(|c| c[m] - c.rows(0, m).dot(&step)).collect();
        let mut root = DMatrix::zeros(m, m);
        factor.inverse_root(&mut root);
        Ok((residuals, root))
    }

    /// The run of units, in this order, without which the others fit best, if chance does not explain by how much; empty if none
    /// does, or the rows do not determine the parameters.
    fn run(&self, units: &[Unit], order: &[usize], stated: bool) -> Vec<usize> {
        let longest = LONGEST_RUN.min((MOST_IN_RUNS * order.len() as f64) as usize);
        let dof = self.rows.ncols() as f64 - self.parameters as f64;
        if longest < 2 || order.len() > MOST_FOR_RUNS || self.rows.ncols() > MANY_ROWS || dof < 1.0 {
            return Vec::new();
        }
        let Ok((residuals, root)) = self.solved(&vec![1.0; self.rows.ncols()]) else { return Vec::new() };
        let pulls = self.pulls(root);
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        let runs = (2..=longest).flat_map(|length| order.windows(length));
        let count = runs.clone().count() as f64;
        let judged = runs.filter_map(|run| {
            let rows: Vec<usize> = run.iter().flat_map(|&u| units[u].rows.iter().copied()).collect();
            let left = dof - rows.len() as f64;
            if left < 3.0 {
                return None;
            }
            // Deleted together: r' (I - H)^-1 r is what the squares lose.
            let own = pulls.select_columns(&rows);
            let free = DMatrix::identity(rows.len(), rows.len()) - own.transpose() * &own;
            let r = DVector::from_iterator(rows.len(), rows.iter().map(|&row| residuals[row]));
            // A run that alone determines a parameter cannot be left out.
            let gain = r.dot(&(positive_definite::inverse(free).ok()? * &r));
            let rest = (squares - gain).max(0.0) / left;
            let unit = if stated { rest.max(1.0) } else { rest.max(f64::MIN_POSITIVE) };
            let ratio = gain / rows.len() as f64 / unit;
            let chance = FisherSnedecor::new(rows.len() as f64, left).map_or(1.0, |law| law.sf(ratio));
            Some((chance * count, ratio, run))
        });
        let best = judged.min_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
        best.filter(|(chance, ..)| *chance < RUN_ALARM).map_or_else(Vec::new, |(.., run)| run.to_vec())
    }

    /// Whitened sum of squares of a unit, as if of its independent components, with its own leverage removed.
    fn squares(unit: &Unit, fitted: &Fitted, weights: &[f64]) -> f64 {
        let count = unit.rows.len().max(1) as f64;
        let mean = unit.rows.iter().map(|&r| fitted.residuals[r].powi(2)).sum::<f64>() / count;
        let pull = unit.rows.iter().map(|&r| weights[r] * fitted.leverages[r]).sum::<f64>() / count;
        unit.numbers() as f64 * mean / (1.0 - pull.min(MOST_LEVERAGE))
    }

    /// Units with a larger deviation than this, in robust one-sigmas, from a Student-t fit; rows `aside` have weight zero. None where the rows, with the weights that
    /// the fit gives them, do not determine the parameters: of a model of as many effects as rows, each row has its own.
    fn far_off(&self, units: &[Unit], aside: &[usize], deviation: f64, stated: bool) -> Vec<usize> {
        let mut weights = vec![1.0; self.rows.ncols()];
        aside.iter().for_each(|&r| weights[r] = 0.0);
        let mut ratios = Vec::new();
        for _ in 0..ROUNDS {
            let Ok(fitted) = self.fitted(&weights) else { return Vec::new() };
            let squares: Vec<f64> = units.iter().map(|u| Near::squares(u, &fitted, &weights)).collect();
            let mut sorted: Vec<f64> = squares.iter().zip(units).map(|(s, u)| s / CHI2_MEDIAN[u.numbers() - 1]).collect();
            sorted.sort_by(f64::total_cmp);
            let Some(&median) = sorted.get(sorted.len() / 2) else { return Vec::new() };
            // Stated noise is a lower limit.
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
        let chance = |squares: f64, numbers: usize| chi2_chance(squares, numbers as f64).unwrap_or(1.0);
        let limit = chance(deviation * deviation, 3);
        (0..units.len()).filter(|&u| chance(ratios[u], units[u].numbers()) < limit).collect()
    }

    /// Of units that seem far off, the samples confirmed by the least-squares fit of all others: index, deviation,
    /// probability.
    fn confirmed(&self, units: &[Unit], of: usize, stated: bool) -> Vec<(usize, f64, f64)> {
        if units.is_empty() {
            return Vec::new();
        }
        let mut weights = vec![1.0; self.rows.ncols()];
        units.iter().flat_map(|u| &u.rows).for_each(|&r| weights[r] = 0.0);
        // Units that alone determine a parameter cannot be confirmed by the others.
        let Ok(Fitted { residuals, leverages }) = self.fitted(&weights) else { return Vec::new() };
        // By rows of the same kind.
        let is_turn = units.iter().flat_map(|u| &u.rows).any(|&r| self.of_orientation[r]);
        let kin = || weights.iter().zip(&self.of_orientation).map(|(w, turn)| if *turn == is_turn { *w } else { 0.0 });
        let squares: f64 = residuals.iter().zip(kin()).map(|(r, w)| w * r * r).sum();
        let all = weights.iter().sum::<f64>();
        let dof = (all - self.parameters as f64) * (kin().sum::<f64>() / all);
        if dof < 3.0 {
            return Vec::new();
        }
        let unit = if stated { (squares / dof).max(1.0) } else { (squares / dof).max(f64::MIN_POSITIVE) };
        let mut found = Vec::new();
        for u in units {
            let numbers = u.numbers() as f64;
            let count = u.rows.len().max(1) as f64;
            let mean = u.rows.iter().map(|&r| residuals[r].powi(2)).sum::<f64>() / count;
            // The uncertainty of the others' prediction adds to the noise.
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
