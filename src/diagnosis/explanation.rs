//! Up to three effects that together explain the residual of a model: greedy selection with exchange, by evidence.

use nalgebra::{DMatrix, DVector};

use super::evidence::{SIZES, Seen, ln_sum_exp};
use super::examination::Examination;
use crate::identify::fit::FitError;
use crate::math::positive_definite::cholesky;

/// Largest number of effects in an explanation.
const MOST: usize = 3;

/// An effect is added if the data are this many times likelier with it, multiplied by the number of candidates.
const ODDS: f64 = 20.0;

/// Width of the prior in the joint fit, plausible sizes: practically free.
const FREE: f64 = 30.0;

/// A set of candidates of an examination.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Explanation {
    /// Indices of the candidates; the one that explains most comes first.
    pub members: Vec<usize>,
    /// Sum of squares that each explains in their joint fit, and that all explain together.
    pub takes: Vec<f64>,
    pub together: f64,
    /// Number of coefficients of all members together.
    pub coefficients: usize,
}

impl Explanation {
    /// Selects among the candidates of an examination that `allowed` admits; `among` is the number of effects tested in
    /// all.
    ///
    /// # Errors
    /// When an inner product is not finite.
    pub fn of(examination: &Examination, allowed: &[bool], among: usize) -> Result<Self, FitError> {
        let candidates: Vec<usize> = (0..examination.spans.len()).filter(|&k| allowed[k]).collect();
        let evidence = |set: &[usize]| joint(examination, set).0.ln_evidence(&examination.remainder, &SIZES);
        let mut set: Vec<usize> = Vec::new();
        let mut reached = 0.0;
        let asked = (ODDS * among.max(1) as f64).ln();
        while set.len() < MOST {
            let Some((with, ln)) = best(&candidates, &set, None, &evidence) else { break };
            if ln - reached < asked {
                break;
            }
            set = with;
            reached = ln;
            // After a member is added, another candidate may fit better than an earlier member.
            let mut exchanged = true;
            while exchanged && set.len() > 1 {
                exchanged = false;
                for out in 0..set.len() {
                    if let Some((other, ln)) = best(&candidates, &set, Some(out), &evidence)
                        && ln > reached + 1e-9
                    {
                        (set, reached, exchanged) = (other, ln, true);
                    }
                }
            }
        }
        Explanation::joint(examination, set)
    }

    /// Evaluates a given set.
    ///
    /// # Errors
    /// When an inner product is not finite: with a prior, the precision is positive definite.
    pub fn joint(examination: &Examination, set: Vec<usize>) -> Result<Self, FitError> {
        let (seen, columns, gram, z) = joint(examination, &set);
        let (together, coefficients) = seen.explained();
        let n = columns.len();
        let unit = examination.remainder.unit();
        let precision = &gram / unit + DMatrix::identity(n, n) / (FREE * FREE);
        let mean = cholesky(precision)?.solve(&(&z / unit));
        let mut first = 0;
        let mut takes = Vec::new();
        for &k in &set {
            let count = examination.spans[k].count;
            let own = mean.rows(first, count);
            takes.push((gram.view((first, first), (count, count)) * own).dot(&own));
            first += count;
        }
        let mut order: Vec<usize> = (0..set.len()).collect();
        order.sort_by(|&a, &b| takes[b].total_cmp(&takes[a]).then(a.cmp(&b)));
        Ok(Explanation {
            members: order.iter().map(|&i| set[i]).collect(),
            takes: order.iter().map(|&i| takes[i]).collect(),
            together,
            coefficients,
        })
    }
}

/// Probability of each candidate as one of the effects of an explanation: given its other members, against each other candidate
/// in that place and against none there, each as probable before as any of the `among` effects tested; the place in which it
/// does best counts. `None` for an explanation by one effect, which has no company.
pub(crate) fn in_company(
    examination: &Examination,
    explanation: &Explanation,
    allowed: &[bool],
    among: usize,
) -> Option<Vec<f64>> {
    let set = &explanation.members;
    if set.len() < 2 {
        return None;
    }
    let evidence = |set: &[usize]| joint(examination, set).0.ln_evidence(&examination.remainder, &SIZES);
    let mut probabilities = vec![0.0f64; allowed.len()];
    for member in set {
        let others: Vec<usize> = set.iter().copied().filter(|k| k != member).collect();
        let place: Vec<usize> = (0..allowed.len()).filter(|&k| allowed[k] && !others.contains(&k)).collect();
        let with = |&k: &usize| evidence(&[&others[..], &[k]].concat()) - (among.max(1) as f64).ln();
        let each: Vec<f64> = place.iter().map(with).collect();
        let whole = ln_sum_exp(each.iter().copied().chain([evidence(&others)]));
        for (&k, ln) in place.iter().zip(&each) {
            probabilities[k] = probabilities[k].max((ln - whole).exp());
        }
    }
    Some(probabilities)
}

/// The best set with one more candidate, or with one in place of the member `out`.
fn best(
    candidates: &[usize],
    set: &[usize],
    out: Option<usize>,
    evidence: &dyn Fn(&[usize]) -> f64,
) -> Option<(Vec<usize>, f64)> {
    let kept: Vec<usize> = set.iter().enumerate().filter(|(i, _)| Some(*i) != out).map(|(_, k)| *k).collect();
    let mut best: Option<(Vec<usize>, f64)> = None;
    for &candidate in candidates.iter().filter(|c| !set.contains(c)) {
        let with: Vec<usize> = kept.iter().copied().chain([candidate]).collect();
        let ln = evidence(&with);
        if ln.is_finite() && best.as_ref().is_none_or(|(_, b)| ln > *b) {
            best = Some((with, ln));
        }
    }
    best
}

/// The columns of several candidates as one candidate.
fn joint(examination: &Examination, set: &[usize]) -> (Seen, Vec<usize>, DMatrix<f64>, DVector<f64>) {
    let columns: Vec<usize> = set.iter().flat_map(|&k| examination.spans[k].range()).collect();
    let gram = examination.gram.select_columns(&columns).select_rows(&columns);
    let z = examination.z.select_rows(&columns);
    let seen =
        if columns.is_empty() { Seen::new(DMatrix::zeros(1, 1), &DVector::zeros(1)) } else { Seen::new(gram.clone(), &z) };
    (seen, columns, gram, z)
}
