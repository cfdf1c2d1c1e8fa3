//! A fit of all unknowns: which the data tell apart, their values and uncertainties, and what the fit says of the data.
//!
//! Columns that the data cannot tell from earlier ones are found first and left at their drawing values; so are those of the arm that
//! the data see so faintly that their estimates would be far beyond anything plausible.

use nalgebra::DMatrix;
use thiserror::Error;

use super::linalg::{self, LinalgError, OrderedRank};
use super::problem::{Linearised, Workspace};
use super::{Adjustment, Knowledge, Observability, Parameter, Problem};
use crate::effects::Owner;

/// A column whose part outside the span of earlier columns is shorter than this fraction of it is taken as dependent: far above
/// rounding (1e-13 after column scaling), far below what any measurement could resolve.
const RANK_TOLERANCE: f64 = 1e-6;

/// A parameter of the arm is left at its drawing value when its plausible size (one sigma of [`ParameterSpec::prior`]) would move the
/// whitened residuals by less than this, all others free to follow: its estimate would be uncertain by more than three plausible
/// sizes. It would tell nothing, drag others far from the drawing with it (wrist offsets by centimetres, where the TCP is within half
/// a millimetre of the last axis), and do harm elsewhere, where its column is no longer what the others can make up. What the drawing
/// leaves open (bases, free tools and balls) has no plausible size and is judged by [`RANK_TOLERANCE`] alone. Where the noise is not
/// stated, the residuals stand in for it.
///
/// [`ParameterSpec::prior`]: crate::effects::ParameterSpec::prior
const FAINT: f64 = 0.3;

/// The same for the base and the link on it, where both are sought. Of a robot on a wall, Ry near 90 deg, Rz and Rx turn about one axis;
/// apart by less than a third of a degree they would run away against each other, while the first joint's offset does what they cannot.
const LOCKED: f64 = 5e-3;

/// Columns are judged anew after a fit that moved a tool or a ball by more plausible sizes than this: they are not what they were.
const FAR: f64 = 100.0;

/// How often the columns are judged; on measured data the third time has agreed with the second.
const MOST_JUDGEMENTS: usize = 4;

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// At a minimum: the gradient is nothing in units of the uncertainty.
    Converged,
    /// No step lowers chi-square any more, although its gradient says that one should.
    Stalled,
    /// The allowed number of steps was used.
    IterationLimit,
    /// Some correction is larger than what the linear effects of the model can mean.
    LeftLinearRange,
}

impl Outcome {
    /// All, as files name them.
    pub const ALL: [(Outcome, &'static str); 4] = [
        (Outcome::Converged, "converged"),
        (Outcome::Stalled, "stalled"),
        (Outcome::IterationLimit, "iteration_limit"),
        (Outcome::LeftLinearRange, "left_linear_range"),
    ];

    /// As in files and JSON.
    pub fn name(self) -> &'static str {
        Outcome::ALL[self as usize].1
    }

    /// What the fit did, for a sentence.
    pub fn in_words(self) -> &'static str {
        match self {
            Outcome::Converged => "converged",
            Outcome::Stalled => "stalled: no step lowers chi-square, although its gradient says that one should",
            Outcome::IterationLimit => "used up its steps before it converged",
            Outcome::LeftLinearRange => "left the linear range of the model: a correction is larger than its effect can mean",
        }
    }
}

/// Share of chi-square, and its amount, by which a larger model may fit worse: what is left of loads that follow the posture.
const NESTED: f64 = 1e-6;

/// Why there is no fit.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum FitError {
    /// No residual is left over to judge the unknowns by.
    #[error("{rows} residuals are too few for {unknowns} unknowns; measure more poses or use a smaller model")]
    TooFewRows {
        /// Scalar residuals.
        rows: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// Residual or Jacobian is not a number.
    #[error("the residuals are not finite at the start of the fit; check joint angles and positions for absurd values")]
    NotFinite,
    /// The normal matrix could not be factored.
    #[error("the normal equations are singular although the columns are independent; the data are too badly scaled")]
    Singular,
    /// A model with more effects fits worse than the one without them.
    #[error(
        "calibench found itself inconsistent: a larger model leaves chi-square {after:.6e} where a smaller one leaves {before:.6e}; report this with the data and the model"
    )]
    WorseThanSmaller {
        /// Of the smaller model.
        before: f64,
        /// Of the larger one.
        after: f64,
    },
    /// A decomposition failed.
    #[error(transparent)]
    Linalg(#[from] LinalgError),
}

/// Parameters that the data cannot tell apart: the one left at its drawing value, then those that can take its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Unresolved {
    /// The parameter that was left out.
    pub parameter: usize,
    /// Parameters that move the same way, strongest first; empty when nothing measured moves at all.
    pub with: Vec<usize>,
}

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Deviation of every parameter from where the fit starts, SI; zero for those left out.
    pub values: Vec<f64>,
    /// Parameters that were estimated, ascending.
    pub kept: Vec<usize>,
    /// Covariance of the kept parameters, SI (kept x kept).
    pub covariance: DMatrix<f64>,
    /// What could not be told apart.
    pub unresolved: Vec<Unresolved>,
    /// Root mean square of the 3-D residual over samples, m.
    pub rms: f64,
    /// Whitened sum of squares, stated parameters included.
    pub chi2: f64,
    /// Residuals minus flat unknowns.
    pub dof: usize,
    /// Whether `covariance` rests on stated noise; if not it is scaled by chi2/dof.
    pub noise_stated: bool,
    /// Gauss-Newton steps taken.
    pub iterations: usize,
    /// How it ended.
    pub outcome: Outcome,
    /// Observability indices of the flat parameters at the solution, in SI.
    pub observability: Observability,
    /// Condition number of their column-scaled Jacobian.
    pub condition: f64,
}

impl Fit {
    /// One-sigma of a parameter, SI; `None` when it was left out.
    pub fn sigma(&self, parameter: usize) -> Option<f64> {
        let k = self.kept.binary_search(&parameter).ok()?;
        Some(self.covariance[(k, k)].max(0.0).sqrt())
    }

    /// Number of flat parameters estimated.
    pub fn rank(&self, parameters: &[Parameter]) -> usize {
        self.kept.iter().filter(|&&p| parameters[p].knowledge == Knowledge::Flat).count()
    }
}

/// Fits all unknowns of the problem from its start.
///
/// # Errors
/// When there are fewer residuals than unknowns or the numbers are not finite.
pub fn fit(problem: &Problem) -> Result<Fit, FitError> {
    let start = problem.start();
    fit_some(problem, &start, &all(problem))
}

/// Fits the parameters listed in `free` (ascending) and leaves the others at `start` (deviations, SI).
///
/// # Errors
/// As [`fit`].
pub fn fit_some(problem: &Problem, start: &[f64], free: &[usize]) -> Result<Fit, FitError> {
    fit_judged(problem, start, start, free)
}

/// Fits all unknowns from the solution of a smaller model of the same samples; what the data tell apart is judged at the nominal start, as
/// [`fit`] does.
///
/// # Errors
/// As [`fit`].
pub fn fit_from(problem: &Problem, smaller: &Problem, solution: &Fit) -> Result<Fit, FitError> {
    let mut start = problem.start();
    for (value, parameter) in start.iter_mut().zip(problem.parameters()) {
        let twin = smaller.parameters().iter().position(|p| p.name == parameter.name && p.effect == parameter.effect);
        if let Some(p) = twin {
            *value = smaller.parameters()[p].start + solution.values[p] - parameter.start;
        }
    }
    fit_judged(problem, &problem.start(), &start, &all(problem))
}

/// Fits all unknowns of a model that holds more than a smaller one whose fit is known: from the nominal start, and where that ends worse
/// than the smaller one, from the smaller one's solution.
///
/// # Errors
/// As [`fit`]; [`FitError::WorseThanSmaller`] when it still fits worse.
pub fn fit_larger(problem: &Problem, smaller: &Problem, solution: &Fit) -> Result<Fit, FitError> {
    let larger = fit(problem)?;
    if check_nested(solution, &larger).is_ok() {
        return Ok(larger);
    }
    let larger = fit_from(problem, smaller, solution)?;
    check_nested(solution, &larger)?;
    Ok(larger)
}

/// That a model with more effects fits no worse than the one without them, to the samples of both.
///
/// # Errors
/// [`FitError::WorseThanSmaller`].
pub fn check_nested(before: &Fit, after: &Fit) -> Result<(), FitError> {
    if after.chi2 <= before.chi2 * (1.0 + NESTED) + NESTED {
        return Ok(());
    }
    Err(FitError::WorseThanSmaller { before: before.chi2, after: after.chi2 })
}

fn all(problem: &Problem) -> Vec<usize> {
    (0..problem.parameters().len()).collect()
}

/// Fits from `start` what of `free` the data tell apart at `judged`; the others have the values there.
fn fit_judged(problem: &Problem, judged: &[f64], start: &[f64], free: &[usize]) -> Result<Fit, FitError> {
    let begin = |adjustment: &Adjustment, from: &[f64]| {
        let mut begin = judged.to_vec();
        adjustment.kept().iter().for_each(|&p| begin[p] = from[p]);
        begin
    };
    let mut adjustment = Adjustment::new(problem, judged, free)?;
    let from = begin(&adjustment, start);
    adjustment.adjust(problem, &from)?;
    adjustment.confirm(problem, &from)?;
    let mut iterations = adjustment.iterations();
    for _ in 1..MOST_JUDGEMENTS {
        let values = adjustment.values();
        let set_up = |p: usize| problem.parameters()[p].owner != Owner::Robot;
        // Not the base: where the robot stands changes nothing within the arm.
        let guessed = |p: usize| set_up(p) && problem.parameters()[p].effect != "base_frame";
        let far = |&p: &usize| guessed(p) && (values[p] - judged[p]).abs() > FAR * problem.parameters()[p].spec.prior;
        if problem.noise_stated() && !adjustment.kept().iter().any(far) {
            break;
        }
        // The arm as drawn, set up as found: links that the fit has turned a little would tell apart what no drawing does.
        let mut at = judged.to_vec();
        adjustment.kept().iter().filter(|&&p| set_up(p)).for_each(|&p| at[p] = values[p]);
        let determined = determined(problem, &at, free, problem.noise_at(values))?;
        if determined.kept == adjustment.kept() {
            break;
        }
        let warm = start != judged;
        let values = values.to_vec();
        adjustment = Adjustment::of(problem, determined);
        let from = begin(&adjustment, if warm { &values } else { &at });
        adjustment.adjust(problem, &from)?;
        adjustment.confirm(problem, &from)?;
        iterations += adjustment.iterations();
    }
    Ok(Fit { iterations, ..adjustment.into_fit(problem)? })
}

/// The parameters to estimate (ascending): the flat ones that the data tell apart, and those stated; and what is left out.
pub(super) fn determined(problem: &Problem, start: &[f64], free: &[usize], noise: f64) -> Result<Determined, FitError> {
    let Determined { mut kept, unresolved } = ordered_rank(problem, start, free, noise)?;
    let flat = kept.len();
    kept.extend(free.iter().filter(|&&p| problem.parameters()[p].knowledge != Knowledge::Flat));
    kept.sort_unstable();
    // As many independent columns as rows: further unknowns were left out for want of rows, and nothing tells how good the others are.
    if problem.row_count() <= flat {
        return Err(FitError::TooFewRows { rows: problem.row_count(), unknowns: flat + unresolved.len() });
    }
    Ok(Determined { kept, unresolved })
}

/// The flat parameters that the problem's samples can tell apart at its start, ascending.
///
/// # Errors
/// When the numbers are not finite.
pub fn independent_parameters(problem: &Problem) -> Result<Vec<usize>, FitError> {
    let start = problem.start();
    Ok(ordered_rank(problem, &start, &all(problem), problem.noise_at(&start))?.kept)
}

/// Observability indices of a Jacobian (3 x poses rows, SI).
///
/// # Errors
/// When it cannot be decomposed.
pub fn observability_of(jacobian: &DMatrix<f64>, poses: usize) -> Result<Observability, FitError> {
    Ok(Observability::new(&linalg::singular_values(jacobian)?, poses))
}

/// Observability of the flat parameters at `values`, in SI, and the condition number of their columns scaled to unit length.
pub(super) fn observability_at(problem: &Problem, values: &[f64], flat: &[usize]) -> Result<(Observability, f64), FitError> {
    // An orthogonal factor changes no singular value: the triangle is as good as the tall matrix, and so are its scaled columns.
    let mut triangle = linalg::triangle(problem.plain_jacobian(values, flat));
    let observability = observability_of(&triangle, problem.sample_count())?;
    for mut column in triangle.column_iter_mut() {
        let norm = column.norm();
        column /= norm;
    }
    Ok((observability, observability_of(&triangle, problem.sample_count())?.condition()))
}

/// What the data can tell.
pub(super) struct Determined {
    /// Parameters to estimate, ascending.
    pub kept: Vec<usize>,
    pub unresolved: Vec<Unresolved>,
}

/// Which flat parameters the data can tell apart, preferring earlier effects, and among links those nearer to the tool: the
/// base takes what it shares with link 1, and of two parallel axes the farther one keeps its offset, as in the paper.
fn ordered_rank(problem: &Problem, start: &[f64], free: &[usize], noise: f64) -> Result<Determined, FitError> {
    let parameters = problem.parameters();
    let mut order: Vec<usize> = free.iter().copied().filter(|&p| parameters[p].knowledge == Knowledge::Flat).collect();
    let mut effects: Vec<&str> = Vec::new();
    for p in parameters {
        if !effects.contains(&p.effect.as_str()) {
            effects.push(&p.effect);
        }
    }
    let rank_of_effect = |p: &usize| effects.iter().position(|e| *e == parameters[*p].effect);
    order.sort_by_key(|p| (rank_of_effect(p), std::cmp::Reverse(parameters[*p].link)));
    let mut near = Linearised::new(problem, &order);
    problem.linearise(start, &problem.load_state(start), &mut Workspace::new(problem.robot()), &mut near);
    if !near.transposed.iter().all(|v| v.is_finite()) {
        return Err(FitError::NotFinite);
    }
    let columns = near.jacobian();
    let first_link = order.iter().any(|&p| parameters[p].link == Some(0) && parameters[p].effect == "mdh");
    let tolerance = |(k, &p): (usize, &usize)| {
        let Parameter { owner, effect, link, spec, .. } = &parameters[p];
        let near_lock = first_link && (effect == "base_frame" || effect == "mdh" && *link == Some(0));
        let faint = if *owner == Owner::Robot { FAINT * noise / (spec.prior * columns.column(k).norm()) } else { 0.0 };
        faint.max(if near_lock { LOCKED } else { RANK_TOLERANCE })
    };
    let tolerances: Vec<f64> = order.iter().enumerate().map(tolerance).collect();
    let OrderedRank { kept, dependent } = linalg::ordered_independent_columns(&columns, &tolerances);
    let (definition, mut kept): (Vec<usize>, Vec<usize>) =
        kept.into_iter().map(|k| order[k]).partition(|&p| parameters[p].defines_world);
    kept.sort_unstable();
    let mut unresolved: Vec<Unresolved> = dependent
        .into_iter()
        .map(|d| {
            let mut with = d.combination;
            with.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            Unresolved { parameter: order[d.column], with: with.into_iter().map(|(k, _)| order[k]).collect() }
        })
        .collect();
    // What defines the world took part so that link 1, which could stand in for the base, does not float in its place.
    let of_artifact = |home: Option<usize>| {
        let unknown = move |p: &usize| parameters[*p].owner == Owner::Artifact && parameters[*p].setup == home;
        order.iter().copied().filter(unknown).collect()
    };
    unresolved.extend(definition.into_iter().map(|p| Unresolved { parameter: p, with: of_artifact(parameters[p].setup) }));
    unresolved.sort_by_key(|u| u.parameter);
    Ok(Determined { kept, unresolved })
}
