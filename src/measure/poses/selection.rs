//! Selection of the poses to measure: k of a pool of candidates, for the best observability of the parameters (largest O1).
//!
//! O1 orders designs as det M does, `M = sum A_i^T A_i`, with A_i the three rows of candidate i (D-optimality; Sun & Hollerbach
//! 2008). DETMAX (Mitchell 1974, Technometrics 16, 203) makes excursions: it adds a few surplus poses, those that contribute
//! most (`det(I + G_i)`, `G_i = A_i M^-1 A_i^T`), and removes those that contribute least (`det(I - G_i)`), or the reverse; an
//! excursion that returns with a larger determinant is kept, one that fails is followed by a longer one. A move changes M by
//! rank three, so M^-1 and the G_i of the pool are updated, and recomputed only to limit rounding errors.

mod candidates;
mod design;
mod error;
mod plan;
mod request;
mod search;

pub use candidates::Candidates;
pub use error::SelectionError;
pub use request::{Quota, Request};
pub use search::Start;

use plan::Plan;
use rayon::prelude::*;

/// The design found.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Indices of the poses in the pool, ascending.
    pub poses: Vec<usize>,
    /// Observability index O1 of them, SI.
    pub o1: f64,
    /// The start that found it.
    pub start: usize,
    /// Result of each start.
    pub starts: Vec<Start>,
    /// The seed of the request.
    pub seed: u64,
}

/// Selects the poses.
///
/// The starts run in parallel; the result is the same on any number of threads.
///
/// ```
/// use calibench::measure::poses::selection::{Candidates, Quota, Request, select};
///
/// // Each of four candidates shows one of two parameters, along x; the first two show most.
/// let jacobian = |of_first: f64, of_second: f64| [of_first, of_second, 0.0, 0.0, 0.0, 0.0];
/// let rows = [jacobian(2.0, 0.0), jacobian(0.0, 2.0), jacobian(1.0, 0.0), jacobian(0.0, 1.0)].concat();
/// let candidates = Candidates::new(&rows, 2, vec![0; 4])?;
/// let found = select(&candidates, &Request::new(Quota::Free(2)))?;
/// assert_eq!(found.poses, [0, 1]);
/// // The singular values are 2 and 2, of two poses.
/// assert!((found.o1 - 2.0 / 2f64.sqrt()).abs() < 1e-12);
/// # Ok::<(), calibench::measure::poses::selection::SelectionError>(())
/// ```
///
/// # Errors
/// When the request cannot be met by the pool, or the poses found leave a combination of parameters undetermined.
pub fn select(candidates: &Candidates, request: &Request) -> Result<Selection, SelectionError> {
    let plan = Plan::new(candidates, request)?;
    let found: Vec<(Vec<usize>, Start)> =
        (0..request.starts.max(1)).into_par_iter().map(|start| plan.run(start)).collect::<Result<_, _>>()?;
    let starts: Vec<Start> = found.iter().map(|(_, start)| *start).collect();
    // The first of equals, so that the result does not depend on which finished first.
    let start = (0..starts.len()).fold(0, |best, s| if starts[s].o1 > starts[best].o1 { s } else { best });
    let mut poses = found[start].0.clone();
    poses.sort_unstable();
    Ok(Selection { poses, o1: starts[start].o1, start, starts, seed: request.seed })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::candidates::{Field, LANES};
    use super::design::Design;
    use super::*;

    fn pool(candidates: usize, parameters: usize, groups: usize, seed: u64) -> (Vec<f64>, Candidates) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rows: Vec<f64> = (0..candidates * 3 * parameters).map(|_| rng.random_range(-1.0..1.0)).collect();
        let candidates = Candidates::new(&rows, parameters, (0..candidates).map(|c| c % groups).collect()).unwrap();
        (rows, candidates)
    }

    /// O1 of the poses from the unscaled rows, computed independently.
    fn o1(rows: &[f64], parameters: usize, poses: &[usize]) -> f64 {
        let picked: Vec<f64> = poses.iter().flat_map(|p| &rows[p * 3 * parameters..][..3 * parameters]).copied().collect();
        let j = nalgebra::DMatrix::from_row_slice(3 * poses.len(), parameters, &picked);
        let log: f64 = j.singular_values().iter().map(|s| s.ln()).sum();
        (log / parameters as f64).exp() / (poses.len() as f64).sqrt()
    }

    #[test]
    fn finds_the_best_of_all_designs_where_all_can_be_tried() {
        let (rows, candidates) = pool(12, 5, 1, 1);
        let mut best = 0.0_f64;
        for mask in (0_u32..1 << 12).filter(|mask| mask.count_ones() == 4) {
            let poses: Vec<usize> = (0..12).filter(|p| mask >> p & 1 == 1).collect();
            best = best.max(o1(&rows, 5, &poses));
        }
        let found = select(&candidates, &Request::new(Quota::Free(4))).unwrap();
        assert!((found.o1 - best).abs() < 1e-12 * best, "{} of {best}", found.o1);
        assert!((found.o1 - o1(&rows, 5, &found.poses)).abs() < 1e-12);
    }

    #[test]
    fn quotas_and_fixed_poses_are_kept_and_no_pose_is_taken_twice() {
        let (rows, candidates) = pool(301, 9, 3, 2);
        let fixed = vec![7, 100, 299];
        let request = Request { fixed: fixed.clone(), starts: 3, ..Request::new(Quota::PerGroup(vec![5, 2, 4])) };
        let found = select(&candidates, &request).unwrap();
        assert!(found.poses.windows(2).all(|w| w[0] < w[1]));
        assert!(fixed.iter().all(|f| found.poses.contains(f)));
        let count = |group| found.poses.iter().filter(|&&p| p % 3 == group).count();
        assert_eq!([count(0), count(1), count(2)], [5, 2, 4]);
        assert!((found.o1 - o1(&rows, 9, &found.poses)).abs() < 1e-12);
        let free = select(&candidates, &Request { fixed, starts: 3, ..Request::new(Quota::Free(11)) }).unwrap();
        assert!(free.o1 >= found.o1, "freedom cannot hurt");
    }

    #[test]
    fn the_answer_does_not_depend_on_the_number_of_threads_and_a_start_stands_alone() {
        let (_, candidates) = pool(400, 10, 2, 3);
        let request = Request { starts: 6, seed: 42, ..Request::new(Quota::Free(20)) };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| select(&candidates, &request)).unwrap()
        };
        let (one, four) = (on(1), on(4));
        assert_eq!(one, four);
        let fewer = select(&candidates, &Request { starts: 2, ..request.clone() }).unwrap();
        assert_eq!(fewer.starts, one.starts[..2]);
    }

    #[test]
    fn updates_do_not_drift_from_what_the_poses_say() {
        let (_, candidates) = pool(200, 8, 1, 4);
        let groups = vec![0; 200];
        let mut field = Field::new(&candidates);
        let mut design = Design::new(&candidates, &groups, &[0], &[0, 1, 2, 3, 4], &mut field).unwrap();
        for k in 5..200 {
            design.add(k);
            design.remove(k - 5);
        }
        let (log_det, mut open) = (design.log_det(), vec![[0.0; LANES]; 200_usize.div_ceil(LANES)]);
        let best = design.best_addition(&mut field, |_| true, &mut open).unwrap();
        design.refresh(&mut field).unwrap();
        let fresh = design.best_addition(&mut field, |_| true, &mut open).unwrap();
        // 390 moves of designs with widely different determinants; the search recomputes after 64 excursions.
        assert!((log_det - design.log_det()).abs() < 1e-9);
        assert_eq!(best.candidate, fresh.candidate);
        assert!((best.determinant / fresh.determinant - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_met_says_why() {
        let (mut rows, candidates) = pool(10, 7, 2, 5);
        let fails = |request: Request| select(&candidates, &request).unwrap_err();
        assert_eq!(fails(Request::new(Quota::Free(2))), SelectionError::TooFewPoses { poses: 2, parameters: 7 });
        let many = Request::new(Quota::PerGroup(vec![3, 6]));
        assert_eq!(fails(many), SelectionError::TooFewCandidates { group: 1, requested: 6, available: 5 });
        let twice = Request { fixed: vec![3, 3], ..Request::new(Quota::Free(4)) };
        assert_eq!(fails(twice), SelectionError::Fixed { candidate: 3 });
        let outside = Request { fixed: vec![10], ..Request::new(Quota::Free(4)) };
        assert_eq!(fails(outside), SelectionError::Fixed { candidate: 10 });
        assert!(matches!(Candidates::new(&rows[1..], 7, vec![0; 10]), Err(SelectionError::Shape { .. })));
        rows[3 * 7 + 4] = f64::INFINITY;
        assert_eq!(Candidates::new(&rows, 7, vec![0; 10]).unwrap_err(), SelectionError::NotFinite { candidate: 1, column: 4 });
        rows.iter_mut().skip(4).step_by(7).for_each(|x| *x = 0.0);
        assert_eq!(Candidates::new(&rows, 7, vec![0; 10]).unwrap_err(), SelectionError::Unseen { column: 4 });
        rows.chunks_exact_mut(7).for_each(|row| row[4] = 2.0 * row[1]);
        let dependent = Candidates::new(&rows, 7, vec![0; 10]).unwrap();
        assert!(matches!(select(&dependent, &Request::new(Quota::Free(5))), Err(SelectionError::NotIdentifiable { .. })));
    }
}
