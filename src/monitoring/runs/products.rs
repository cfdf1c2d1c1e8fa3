//! The inner products of every run, from which all questions about the runs are answered.

use nalgebra::{DMatrix, DVector};

use super::base::{Base, Part, Solved};
use crate::diagnosis::Examination;
use crate::diagnosis::examination::Span;
use crate::identify::calibration::IdentifyError;
use crate::math::linalg;
use crate::measure::poses::Postures;
use crate::selection::recommend::curves::shrunk;

/// Rounds in which the noise of each run and the sizes of the error curves are estimated in turn.
const ROUNDS: usize = 3;

/// A run with fewer degrees of freedom of its own than this takes the noise of all runs together.
const OWN_NOISE_FROM: f64 = 15.0;

/// Number of parts of a run: the halves of its postures in joint space, between which the robot has certainly not changed
/// (decision 0039).
const PARTS: usize = 2;

/// A run is halved only if it has so many scalar residuals for each parameter of the arm.
const HALVED_FROM: f64 = 4.0;

/// Seed of the division in halves: the same data give the same halves.
const SEED: u64 = 0x0ca1_1bf0;

/// Below this fraction of its squared norm, the residual of a column is rounding error.
const SEEN: f64 = 1e-7;

/// The examined fit, reduced to the inner products of each run: of the fitted columns, the candidates and the residuals.
pub(super) struct Products {
    of_run: Vec<DMatrix<f64>>,
    /// The same of each half of every run.
    of_part: Vec<DMatrix<f64>>,
    /// Of rows that belong to no sample: known distances between balls.
    others: DMatrix<f64>,
    /// Number of scalar residuals of each run that count as independent.
    counts: Vec<f64>,
    /// Number of fitted columns.
    fitted: usize,
    /// Prior information of the fitted columns, and its pull.
    information: Vec<f64>,
    pull: Vec<f64>,
    /// Number of fitted columns without a prior.
    flat: f64,
    /// Error curves among the candidates: what every arm has, and no model holds.
    curves: Vec<Span>,
}

/// Columns of every run after projection onto the complement of what the runs share and of their set-ups.
pub(super) struct Reduced {
    runs: usize,
    /// Number of scalar residuals of each run.
    counts: Vec<f64>,
    /// Inner products of these columns, half by half (column x half), before and after reduction.
    raw: Vec<DMatrix<f64>>,
    left: DMatrix<f64>,
    /// Inner products with the residual.
    along: DVector<f64>,
    /// Sum of squares of the residual, and its degrees of freedom.
    pub squares: f64,
    pub dof: f64,
    /// Correction of each fitted parameter, SI, and the covariance of these before scaling by the noise.
    pub correction: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Noise of each run, in units of that by which its rows are whitened.
    pub noise: Vec<f64>,
}

/// Reduction of chi-square by some differences between runs.
#[derive(Debug, Clone)]
pub(super) struct Explained {
    /// Sum of squares.
    pub squares: f64,
    /// Number of directions seen.
    pub directions: f64,
    /// Best coefficients, in the order of the directions requested, and their covariance before scaling by the noise.
    pub coefficients: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

impl Products {
    /// From an examination; `run_of_setup` is the run of each set-up, `curves` the candidates that are error curves.
    pub fn new(examination: &Examination, run_of_setup: &[usize], curves: std::ops::Range<usize>) -> Products {
        let Examination { rows, fitted, contexts, problem, fit, .. } = examination;
        let runs = run_of_setup.iter().max().map_or(0, |r| r + 1);
        let mut of: Vec<Vec<usize>> = vec![Vec::new(); PARTS * runs + 1];
        let mut part_of = vec![PARTS * runs; rows.ncols()];
        for run in 0..runs {
            let own: Vec<_> = contexts.iter().filter(|at| run_of_setup[at.setup] == run).collect();
            let joints: Vec<&[f64]> = own.iter().map(|at| at.q.as_slice()).collect();
            let postures = Postures::of_joints(&joints, &vec![0; own.len()]);
            let halves = postures.blocks(&joints, PARTS, SEED);
            for (at, &posture) in own.iter().zip(postures.of_samples()) {
                let part = PARTS * run + halves[posture].min(PARTS - 1);
                (at.first_row..at.first_row + at.height).for_each(|k| part_of[k] = part);
            }
        }
        part_of.iter().enumerate().for_each(|(k, &part)| of[part].push(k));
        let product = |own: &Vec<usize>| {
            let mut out = DMatrix::zeros(rows.nrows(), rows.nrows());
            linalg::normal_matrix(&rows.select_columns(own), &mut out);
            out
        };
        let mut of_part: Vec<DMatrix<f64>> = of.iter().map(product).collect();
        let others = of_part.pop().unwrap_or_else(|| unreachable!("one more than there are halves"));
        let of_run = of_part.chunks(PARTS).map(|parts| parts.iter().sum()).collect();
        let weight2 = examination.noise_scale.weight().powi(2);
        let prior = |p: &usize| weight2 * problem.information(*p);
        let information: Vec<f64> = fit.kept.iter().map(prior).collect();
        Products {
            counts: of[..PARTS * runs]
                .chunks(PARTS)
                .map(|parts| parts.iter().map(Vec::len).sum::<usize>() as f64 / examination.noise_scale.repetition)
                .collect(),
            of_run,
            of_part,
            others,
            fitted: fitted.len(),
            pull: fit.kept.iter().zip(&information).map(|(&p, i)| -i * fit.values[p]).collect(),
            flat: information.iter().filter(|i| **i == 0.0).count() as f64,
            information,
            curves: examination.spans[curves].to_vec(),
        }
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.of_run.len()
    }

    /// Eliminates what the runs share, with the error curves at the sizes that the evidence gives them, from `columns` (by index
    /// among fitted columns and candidates) taken run by run. `drifts` are parameters that may drift: (column, variance of each
    /// increment from one run to the next).
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn reduced(&self, columns: &[usize], drifts: &[(usize, Vec<f64>)]) -> Result<Reduced, IdentifyError> {
        let runs = self.runs();
        let mut noise = vec![1.0; runs];
        let mut curve_information = Vec::new();
        let mut all = None;
        for _ in 0..ROUNDS {
            let base = self.base(&noise, drifts);
            curve_information = self.curve_information(&base, drifts)?;
            let solved = Solved::new(&base, self.base_information(&curve_information, drifts), &self.base_pull(drifts))?;
            let found = self.noise_of_runs(&base, &solved, &noise);
            all = Some((base, solved));
            noise = found;
        }
        let base = self.base(&noise, drifts);
        let information = self.base_information(&curve_information, drifts);
        drop(all);
        let solved = Solved::new(&base, information, &self.base_pull(drifts))?;
        let parts = PARTS * runs;
        let mut cross = DMatrix::zeros(base.normal.nrows(), columns.len() * parts);
        let mut along = DVector::zeros(columns.len() * parts);
        let mut raw = Vec::with_capacity(parts);
        for (place, product) in self.of_part.iter().enumerate() {
            let run = place / PARTS;
            let weight = noise[run].powi(-2);
            let last = product.nrows() - 1;
            for (c, &column) in columns.iter().enumerate() {
                let at = c * parts + place;
                for (b, part) in base.parts.iter().enumerate() {
                    cross[(b, at)] = part.weight(run) * weight * product[(part.column, column)];
                }
                along[at] = weight * product[(last, column)];
            }
            raw.push(DMatrix::from_fn(columns.len(), columns.len(), |r, c| weight * product[(columns[r], columns[c])]));
        }
        along -= cross.tr_mul(&solved.solution);
        let half = solved.factor.half(cross);
        let mut left = -linalg::product_of_transposed(&half, &half);
        for (place, own) in raw.iter().enumerate() {
            for r in 0..columns.len() {
                for c in 0..columns.len() {
                    left[(r * parts + place, c * parts + place)] += own[(r, c)];
                }
            }
        }
        let (squares, dof) = (solved.squares, (self.counts.iter().sum::<f64>() - self.flat).max(1.0));
        let covariance = solved.inverse.view((0, 0), (self.fitted, self.fitted)).into_owned();
        let correction = solved.solution.rows(0, self.fitted).into_owned();
        Ok(Reduced { runs, counts: self.counts.clone(), raw, left, along, squares, dof, correction, covariance, noise })
    }

    /// The columns that all hypotheses share: fitted ones, error curves, declared drifts.
    fn base(&self, noise: &[f64], drifts: &[(usize, Vec<f64>)]) -> Base {
        let runs = self.runs();
        let mut parts: Vec<Part> = (0..self.fitted).map(Part::everywhere).collect();
        parts.extend(self.curves.iter().flat_map(|span| span.range()).map(|k| Part::everywhere(self.fitted + k)));
        for (column, variances) in drifts {
            parts.extend((0..variances.len()).map(|k| Part { column: *column, from: k + 1 }));
        }
        let n = parts.len();
        let last = self.others.nrows() - 1;
        let (mut normal, mut gradient, mut squares) = (DMatrix::zeros(n, n), DVector::zeros(n), self.others[(last, last)]);
        let mut add = |product: &DMatrix<f64>, run: Option<usize>, weight: f64| {
            let seen = |part: &Part| run.map_or(part.from == 0, |run| part.weight(run) > 0.0);
            let own: Vec<(usize, usize)> =
                parts.iter().enumerate().filter(|(_, p)| seen(p)).map(|(k, p)| (k, p.column)).collect();
            for &(c, from_c) in &own {
                for &(r, from_r) in &own {
                    normal[(r, c)] += weight * product[(from_r, from_c)];
                }
                gradient[c] += weight * product[(last, from_c)];
            }
        };
        (0..runs).for_each(|run| add(&self.of_run[run], Some(run), noise[run].powi(-2)));
        add(&self.others, None, 1.0);
        squares += (0..runs).map(|run| self.of_run[run][(last, last)] * noise[run].powi(-2)).sum::<f64>();
        Base { parts, normal, gradient, squares }
    }

    fn curve_columns(&self) -> usize {
        self.curves.iter().map(|span| span.count).sum()
    }

    /// Prior information of every column of the error curves.
    fn curve_information(&self, base: &Base, drifts: &[(usize, Vec<f64>)]) -> Result<Vec<f64>, IdentifyError> {
        let n = self.fitted + self.curve_columns();
        if self.curves.is_empty() {
            return Ok(Vec::new());
        }
        // Drifts come first here: the groups of the curves end the list.
        let drifting: usize = drifts.iter().map(|(_, v)| v.len()).sum();
        let order: Vec<usize> = (0..self.fitted).chain(n..n + drifting).chain(self.fitted..n).collect();
        let all = base.parts.len();
        let products = DMatrix::from_fn(all + 1, all + 1, |r, c| match (order.get(r), order.get(c)) {
            (Some(&r), Some(&c)) => base.normal[(r, c)],
            (Some(&r), None) => base.gradient[r],
            (None, Some(&c)) => base.gradient[c],
            (None, None) => base.squares,
        });
        let mut information = self.information.clone();
        information.extend(drifts.iter().flat_map(|(_, v)| v.iter().map(|v| 1.0 / v.max(f64::MIN_POSITIVE))));
        let first = self.fitted + drifting;
        let mut groups = Vec::with_capacity(self.curves.len());
        let mut next = first;
        for span in &self.curves {
            groups.push(Span { first: next, count: span.count });
            next += span.count;
        }
        let rows = self.counts.iter().sum::<f64>();
        let variances = shrunk(&products, first, &information, &groups, rows as usize)?;
        let each = self.curves.iter().zip(variances).flat_map(|(span, v)| std::iter::repeat_n(1.0 / v, span.count));
        Ok(each.collect())
    }

    fn base_information(&self, curves: &[f64], drifts: &[(usize, Vec<f64>)]) -> Vec<f64> {
        let of_drifts = drifts.iter().flat_map(|(_, v)| v.iter().map(|v| 1.0 / v.max(f64::MIN_POSITIVE)));
        self.information.iter().copied().chain(curves.iter().copied()).chain(of_drifts).collect()
    }

    fn base_pull(&self, drifts: &[(usize, Vec<f64>)]) -> DVector<f64> {
        let further = self.curve_columns() + drifts.iter().map(|(_, v)| v.len()).sum::<usize>();
        DVector::from_iterator(self.fitted + further, self.pull.iter().copied().chain(std::iter::repeat_n(0.0, further)))
    }

    /// The noise of each run, from the residuals of its fit.
    fn noise_of_runs(&self, base: &Base, solved: &Solved, noise: &[f64]) -> Vec<f64> {
        let runs = self.runs();
        let left: Vec<[f64; 2]> = (0..runs)
            .map(|run| {
                let product = &self.of_run[run];
                let last = product.nrows() - 1;
                let own: Vec<(usize, usize)> =
                    base.parts.iter().enumerate().filter(|(_, p)| p.weight(run) > 0.0).map(|(k, p)| (k, p.column)).collect();
                let (mut squares, mut taken) = (product[(last, last)], 0.0);
                for &(c, from_c) in &own {
                    let x = solved.solution[c];
                    squares -= 2.0 * x * product[(last, from_c)];
                    for &(r, from_r) in &own {
                        let inner = product[(from_r, from_c)];
                        squares += x * solved.solution[r] * inner;
                        taken += solved.inverse[(r, c)] * inner;
                    }
                }
                [squares.max(0.0), self.counts[run] - taken * noise[run].powi(-2)]
            })
            .collect();
        let (squares, dof) = left.iter().fold((0.0, 0.0), |(s, d), [squares, dof]| (s + squares, d + dof.max(0.0)));
        let together = (squares / dof.max(1.0)).max(f64::MIN_POSITIVE).sqrt();
        let own = |[squares, dof]: &[f64; 2]| if *dof >= OWN_NOISE_FROM { (squares / dof).sqrt() } else { together };
        left.iter().map(|l| own(l).max(1e-3 * together)).collect()
    }
}

impl Reduced {
    /// Reduction by differences along `directions`: each a list of (column under test, run, weight).
    pub fn explained(&self, directions: &[Vec<(usize, usize, f64)>]) -> Explained {
        let of_run = |&(column, run, weight): &(usize, usize, f64)| (0..PARTS).map(move |k| (column, PARTS * run + k, weight));
        self.explained_by_parts(&directions.iter().map(|all| all.iter().flat_map(of_run).collect()).collect::<Vec<_>>())
    }

    /// Reduction by differences within runs: `columns` of the arm free in each half of every run that is long enough. Within
    /// one run the robot does not change, so that this is due to model discrepancy alone.
    pub fn within_runs(&self, columns: &[usize]) -> Explained {
        let long = |run: &usize| self.counts[*run] >= HALVED_FROM * columns.len() as f64;
        let of_run = |run: usize| columns.iter().map(move |&column| vec![(column, PARTS * run, 1.0)]);
        self.explained_by_parts(&(0..self.runs).filter(long).flat_map(of_run).collect::<Vec<_>>())
    }

    /// The same for halves of runs: each a list of (column under test, half, weight).
    fn explained_by_parts(&self, directions: &[Vec<(usize, usize, f64)>]) -> Explained {
        let n = directions.len();
        if n == 0 {
            let (coefficients, covariance) = (DVector::zeros(0), DMatrix::zeros(0, 0));
            return Explained { squares: 0.0, directions: 0.0, coefficients, covariance };
        }
        let place = |&(column, part, _): &(usize, usize, f64)| column * PARTS * self.runs + part;
        let mut gram = DMatrix::zeros(n, n);
        let mut whole = DVector::zeros(n);
        let mut along = DVector::zeros(n);
        for (a, from) in directions.iter().enumerate() {
            along[a] = from.iter().map(|t| t.2 * self.along[place(t)]).sum();
            for t in from {
                for u in from.iter().filter(|u| u.1 == t.1) {
                    whole[a] += t.2 * u.2 * self.raw[t.1][(t.0, u.0)];
                }
            }
            for (b, to) in directions.iter().enumerate().skip(a) {
                let inner: f64 =
                    from.iter().map(|t| to.iter().map(|u| t.2 * u.2 * self.left[(place(t), place(u))]).sum::<f64>()).sum();
                (gram[(a, b)], gram[(b, a)]) = (inner, inner);
            }
        }
        // In units of each direction's own energy, so that what is rounding does not depend on its unit.
        let scale = whole.map(|w: f64| if w > 0.0 { w.powf(-0.5) } else { 0.0 });
        let scaled = DMatrix::from_fn(n, n, |r, c| gram[(r, c)] * scale[r] * scale[c]);
        let eigen = scaled.symmetric_eigen();
        let turned = eigen.eigenvectors.tr_mul(&along.component_mul(&scale));
        let (mut squares, mut count) = (0.0, 0.0);
        let mut inverse = DVector::zeros(n);
        for k in 0..n {
            if eigen.eigenvalues[k] > SEEN {
                inverse[k] = 1.0 / eigen.eigenvalues[k];
                squares += turned[k] * turned[k] * inverse[k];
                count += 1.0;
            }
        }
        let back = DMatrix::from_fn(n, n, |r, c| scale[r] * eigen.eigenvectors[(r, c)]);
        let coefficients = &back * turned.component_mul(&inverse);
        let covariance = &back * DMatrix::from_diagonal(&inverse) * back.transpose();
        Explained { squares, directions: count, coefficients, covariance }
    }

    /// Inner products and gradient of one column in increments from run to run, for the size of a drift.
    pub fn increments(&self, column: usize) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.runs.saturating_sub(1);
        let parts = PARTS * self.runs;
        let at = |part: usize| column * parts + part;
        let inner = |a: usize, b: usize| {
            let from = |a: usize| PARTS * (a + 1)..parts;
            from(a).map(|r| from(b).map(|c| self.left[(at(r), at(c))]).sum::<f64>()).sum::<f64>()
        };
        let gradient = |a: usize| (PARTS * (a + 1)..parts).map(|r| self.along[at(r)]).sum::<f64>();
        (DMatrix::from_fn(n, n, inner), DVector::from_fn(n, |a, _| gradient(a)))
    }

    /// Energy of a column in one run, before and after reduction.
    pub fn energy(&self, column: usize, run: usize) -> [f64; 2] {
        let parts = PARTS * run..PARTS * (run + 1);
        let at = |part: usize| column * PARTS * self.runs + part;
        let raw = parts.clone().map(|part| self.raw[part][(column, column)]).sum();
        let left: f64 =
            parts.clone().flat_map(|r| parts.clone().map(move |c| (r, c))).map(|(r, c)| self.left[(at(r), at(c))]).sum();
        [raw, left.max(0.0)]
    }

    /// Variance of the noise in the units of these products.
    pub fn unit(&self) -> f64 {
        self.squares / self.dof
    }
}
