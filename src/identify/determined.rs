//! Unknowns that the data can separate, and how well they are determined.
//!
//! Columns that the data cannot separate from earlier ones are found first and left at their nominal values; so are those
//! of the arm with such low detectability that their estimates would be far beyond any plausible size.

use nalgebra::DMatrix;

use super::fit_result::{FitError, Unresolved};
use super::problem::{Linearised, Workspace};
use super::problem::{Parameter, Prior, Problem};
use crate::effects::{EffectId, Owner};
use crate::math::Observability;
use crate::math::linalg::{self, OrderedRank};
use crate::robot::JointKind;

/// A column whose part outside the span of earlier columns is shorter than this fraction of it is treated as dependent: far
/// above rounding (1e-13 after column scaling), far below the resolution of any measurement.
const RANK_TOLERANCE: f64 = 1e-6;

/// A parameter of the arm is left at its nominal value if its plausible size (1 sigma of [`ParameterSpec::prior`]) would
/// change the whitened residuals by less than this, all others being free to follow: its estimate would be uncertain by
/// more than three plausible sizes. It would carry no information, drag others far from nominal with it (wrist offsets by
/// centimetres, where the TCP is within half a millimetre of the last axis), and do harm at other postures, where the
/// others no longer compensate its column. Where the residuals say that parameters were wrongly left out so, they are asked
/// again ([`asked_again`]). Parameters left open by the nominal model (bases, free tools and balls) have no
/// plausible size and are judged by [`RANK_TOLERANCE`] alone. If the noise is not stated, the residuals replace it (decision
/// 0009).
///
/// [`ParameterSpec::prior`]: crate::effects::ParameterSpec::prior
/// [`asked_again`]: super::asked_again::asked_again
const FAINT: f64 = 0.3;

/// The same for the base and the link on it if both are unknown. For a robot on a wall, with Ry near 90 deg, Rz and Rx
/// rotate about the same axis; separated by less than a third of a degree they would diverge against each other, while the
/// first joint's offset covers their common effect.
const LOCKED: f64 = 5e-3;

/// Weights of parameters that move the TCP alike are distinguished to a millionth of the largest, dimensionless.
const ALIKE: f64 = 1e6;

/// Parameters that the data determine, and those that they do not.
pub(super) struct Determined {
    /// Parameters to estimate, ascending.
    pub kept: Vec<usize>,
    pub unresolved: Vec<Unresolved>,
}

/// All parameters.
pub(super) fn all(problem: &Problem) -> Vec<usize> {
    (0..problem.parameters().len()).collect()
}

/// The parameters to estimate (ascending), i.e. the flat ones that the data can separate and those with a prior; and those
/// left out.
pub(super) fn determined(problem: &Problem, start: &[f64], free: &[usize], noise: f64) -> Result<Determined, FitError> {
    determined_with(problem, start, free, noise, &[])
}

/// The same, of which those in `trusted` are not left out for their plausible size.
pub(super) fn determined_with(
    problem: &Problem,
    start: &[f64],
    free: &[usize],
    noise: f64,
    trusted: &[usize],
) -> Result<Determined, FitError> {
    let Determined { mut kept, unresolved } = ordered_rank(problem, start, free, noise, trusted)?;
    let flat = kept.len();
    kept.extend(free.iter().filter(|&&p| problem.parameters()[p].knowledge != Prior::Uninformative));
    kept.sort_unstable();
    // As many independent columns as rows: further unknowns were left out for lack of rows, and no row is left to check the
    // others.
    if problem.row_count() <= flat {
        return Err(FitError::TooFewRows { rows: problem.row_count(), unknowns: flat + unresolved.len() });
    }
    Ok(Determined { kept, unresolved })
}

/// The flat parameters that the problem's samples can separate at its start, ascending.
///
/// # Errors
/// When a value is not finite.
pub fn independent_parameters(problem: &Problem) -> Result<Vec<usize>, FitError> {
    let start = problem.start();
    Ok(ordered_rank(problem, &start, &all(problem), problem.noise_at(&start), &[])?.kept)
}

/// The flat parameters that the data can separate, preferring earlier effects, and among links those nearer to the tool:
/// the base takes what it shares with link 1, and of two parallel axes the farther one keeps its offset, as in the paper. The zero
/// of a prismatic joint comes before all links: a controller can correct it.
fn ordered_rank(
    problem: &Problem,
    start: &[f64],
    free: &[usize],
    noise: f64,
    trusted: &[usize],
) -> Result<Determined, FitError> {
    let parameters = problem.parameters();
    let mut order: Vec<usize> = free.iter().copied().filter(|&p| parameters[p].knowledge == Prior::Uninformative).collect();
    let mut effects: Vec<&EffectId> = Vec::new();
    for p in parameters {
        if !effects.contains(&&p.effect) {
            effects.push(&p.effect);
        }
    }
    let rank_of_effect = |p: &usize| effects.iter().position(|e| **e == parameters[*p].effect);
    let is_zero_of_slide = |p: &usize| {
        let Parameter { effect, link, spec, .. } = &parameters[*p];
        let slides = |i: &usize| problem.robot().kind(*i) == JointKind::Prismatic && spec.name == format!("d{}", i + 1);
        effect == EffectId::MDH && link.as_ref().is_some_and(slides)
    };
    order.sort_by_key(|p| (rank_of_effect(p), !is_zero_of_slide(p), std::cmp::Reverse(parameters[*p].link)));
    let mut near = Linearised::new(problem, &order);
    problem.linearise(start, &problem.load_state(start), &mut Workspace::new(problem.robot()), &mut near);
    if !near.transposed.iter().all(|v| v.is_finite()) {
        return Err(FitError::NotFinite);
    }
    let columns = near.jacobian();
    let first_link = order.iter().any(|&p| parameters[p].link == Some(0) && parameters[p].effect == EffectId::MDH);
    let tolerance = |(k, &p): (usize, &usize)| {
        let Parameter { owner, effect, link, spec, .. } = &parameters[p];
        let near_lock = first_link && (effect == EffectId::BASE_FRAME || effect == EffectId::MDH && *link == Some(0));
        let is_sized = *owner == Owner::Robot && !trusted.contains(&p);
        let faint = if is_sized { FAINT * noise / (spec.prior * columns.column(k).norm()) } else { 0.0 };
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
            let largest = with.iter().map(|(_, weight)| weight.abs()).fold(0.0, f64::max);
            // Alike but for their last bits, which are not those of another processor, they keep their order.
            with.sort_by_key(|(k, weight)| (std::cmp::Reverse((ALIKE * weight.abs() / largest).round() as u64), *k));
            Unresolved { parameter: order[d.column], with: with.into_iter().map(|(k, _)| order[k]).collect() }
        })
        .collect();
    // Parameters that define the world were included so that link 1, which could substitute for the base, does not float
    // instead.
    let of_artifact = |home: Option<usize>| {
        let of_world = |p: usize| parameters[p].effect.family() != EffectId::TARGET;
        let unknown = move |p: &usize| parameters[*p].owner == Owner::Artifact && parameters[*p].setup == home && of_world(*p);
        order.iter().copied().filter(unknown).collect()
    };
    unresolved.extend(definition.into_iter().map(|p| Unresolved { parameter: p, with: of_artifact(parameters[p].setup) }));
    unresolved.sort_by_key(|u| u.parameter);
    Ok(Determined { kept, unresolved })
}

/// Observability indices of a Jacobian (3 x poses rows, SI).
///
/// ```
/// use calibench::identify::fit::observability_of;
/// use calibench::nalgebra::DMatrix;
///
/// // One pose in which a parameter moves the point by 2 along x, another by 8 along y.
/// let jacobian = DMatrix::from_row_slice(3, 2, &[2.0, 0.0, 0.0, 8.0, 0.0, 0.0]);
/// let o = observability_of(&jacobian, 1)?;
/// assert!((o.o1 - 4.0).abs() < 1e-14 && (o.o3 - 2.0).abs() < 1e-14);
/// # Ok::<(), calibench::identify::fit::FitError>(())
/// ```
///
/// # Errors
/// When it cannot be decomposed.
pub fn observability_of(jacobian: &DMatrix<f64>, poses: usize) -> Result<Observability, FitError> {
    Ok(Observability::new(&linalg::singular_values(jacobian)?, poses))
}

/// Observability of the flat parameters at `values`, in SI, and the condition number of their columns scaled to unit
/// length.
pub(super) fn observability_at(problem: &Problem, values: &[f64], flat: &[usize]) -> Result<(Observability, f64), FitError> {
    // An orthogonal factor does not change singular values: the triangle replaces the tall matrix, also after column
    // scaling.
    let mut triangle = linalg::triangle(problem.plain_jacobian(values, flat));
    let observability = observability_of(&triangle, problem.sample_count())?;
    for mut column in triangle.column_iter_mut() {
        let norm = column.norm();
        column /= norm;
    }
    Ok((observability, observability_of(&triangle, problem.sample_count())?.condition()))
}
