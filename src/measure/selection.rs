//! Choosing the poses to measure: k of a pool of candidates, so that the parameters are seen as well as possible (largest O1).
//!
//! O1 orders designs as det M does, `M = sum A_i^T A_i`, with A_i the three rows of candidate i (D-optimality; Sun & Hollerbach
//! 2008). DETMAX (Mitchell 1974, Technometrics 16, 203) goes on excursions: it takes a few poses too many, those that add most
//! (`det(I + G_i)`, `G_i = A_i M^-1 A_i^T`), and gives back those that are missed least (`det(I - G_i)`), or the other way round;
//! an excursion that comes home with a larger determinant is kept, one that fails is followed by a longer one. A move changes
//! M by rank three, so neither M^-1 nor the G_i of the pool are ever computed anew but against the rounding.

mod candidates;
mod design;
mod search;

pub use candidates::Candidates;

use design::Design;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use search::Search;
use thiserror::Error;

use crate::identify::Observability;
use crate::identify::linalg::{LinalgError, singular_values};

/// How many poses, from where, and how hard to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// How many poses the design has, those already chosen included.
    pub poses: Quota,
    /// Candidates already chosen, that stay.
    pub fixed: Vec<usize>,
    /// Independent starts; the best is taken.
    pub starts: usize,
    /// Seed: start s draws from stream s of it, so its outcome depends on nothing else.
    pub seed: u64,
    /// Poses too many, or too few, at the far end of the longest excursion.
    pub excursion: usize,
}

/// How many poses to choose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Quota {
    /// In all, of whatever groups.
    Free(usize),
    /// Of each group; none of the groups beyond.
    PerGroup(Vec<usize>),
}

impl Request {
    /// Ten starts, excursions of up to ten poses: what 80 of 5,000 need to come within 0.2 % of the largest O1 there is.
    pub fn new(poses: Quota) -> Self {
        Request { poses, fixed: Vec::new(), starts: 10, seed: 0, excursion: 10 }
    }
}

/// A design found.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Places of the poses in the pool, ascending.
    pub poses: Vec<usize>,
    /// Observability index O1 of them, SI.
    pub o1: f64,
    /// Which start found it.
    pub start: usize,
    /// What each start found.
    pub starts: Vec<Start>,
    /// The seed of the request.
    pub seed: u64,
}

/// The outcome of one start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Observability index O1, SI.
    pub o1: f64,
    /// Poses added or taken away until no excursion helped.
    pub moves: usize,
}

/// Why there is no design.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum SelectionError {
    /// The array does not fit.
    #[error("{numbers} numbers are not 3 rows of {parameters} columns for each of {candidates} candidates")]
    Shape {
        /// Numbers given.
        numbers: usize,
        /// Groups given.
        candidates: usize,
        /// Columns asked for.
        parameters: usize,
    },
    /// A row holds an infinity or what is not a number.
    #[error("column {column} of candidate {candidate} is not finite")]
    NotFinite {
        /// Place in the pool.
        candidate: usize,
        /// Parameter.
        column: usize,
    },
    /// No candidate sees this parameter.
    #[error("no candidate sees parameter {column}")]
    Unseen {
        /// Parameter.
        column: usize,
    },
    /// A group has fewer candidates than poses are wanted of it.
    #[error("{wanted} poses are wanted of group {group}, which has {available} candidates")]
    TooFewCandidates {
        /// Group; 0 where groups do not matter.
        group: usize,
        /// Poses wanted.
        wanted: usize,
        /// Candidates there are.
        available: usize,
    },
    /// Fewer equations than parameters.
    #[error("{poses} poses give {} equations for {parameters} parameters", 3 * poses)]
    TooFewPoses {
        /// Poses wanted.
        poses: usize,
        /// Parameters.
        parameters: usize,
    },
    /// A fixed candidate that cannot stay.
    #[error("fixed candidate {candidate} is not in the pool, is named twice, or exceeds the quota of its group")]
    Fixed {
        /// Place in the pool.
        candidate: usize,
    },
    /// The best poses there are cannot tell the parameters apart.
    #[error("the poses found cannot tell all parameters apart (condition number {condition:.1e}); leave out what is redundant")]
    NotIdentifiable {
        /// Of the Jacobian of the poses, columns at equal scale.
        condition: f64,
    },
    /// A factorisation failed.
    #[error(transparent)]
    Linalg(#[from] LinalgError),
}

/// Singular values below this share of the largest, of columns at equal scale, are rounding (1e-16) rather than information.
const LEAST_SEEN: f64 = 1e-10;
/// Share of the poses drawn at random, that makes the starts differ; the others are the best to add, which spares half the moves.
const DRAWN: f64 = 0.3;

/// Chooses the poses.
///
/// The starts run in parallel; the result is the same on any number of threads.
///
/// # Errors
/// When the request cannot be met by the pool, or the poses found leave a combination of parameters undetermined.
pub fn select(candidates: &Candidates, request: &Request) -> Result<Selection, SelectionError> {
    let plan = Plan::new(candidates, request)?;
    let found: Vec<(Vec<usize>, Start)> =
        (0..request.starts.max(1)).into_par_iter().map(|start| plan.run(start)).collect::<Result<_, _>>()?;
    let starts: Vec<Start> = found.iter().map(|(_, start)| *start).collect();
    // The first of equals, so that the answer does not depend on who finished first.
    let start = (0..starts.len()).fold(0, |best, s| if starts[s].o1 > starts[best].o1 { s } else { best });
    let mut poses = found[start].0.clone();
    poses.sort_unstable();
    Ok(Selection { poses, o1: starts[start].o1, start, starts, seed: request.seed })
}

/// A request that has been checked against its pool.
struct Plan<'a> {
    candidates: &'a Candidates,
    request: &'a Request,
    /// Group of each candidate; all of one group where groups do not matter.
    groups: Vec<usize>,
    /// Poses of each group.
    quotas: Vec<usize>,
    /// Which candidates must stay.
    fixed: Vec<bool>,
}

impl<'a> Plan<'a> {
    fn new(candidates: &'a Candidates, request: &'a Request) -> Result<Self, SelectionError> {
        let (groups, quotas) = match &request.poses {
            Quota::Free(poses) => (vec![0; candidates.len()], vec![*poses]),
            Quota::PerGroup(quotas) => (candidates.groups().to_vec(), quotas.clone()),
        };
        let mut available = vec![0; quotas.len()];
        groups.iter().filter(|&&g| g < quotas.len()).for_each(|&g| available[g] += 1);
        if let Some(group) = (0..quotas.len()).find(|&g| available[g] < quotas[g]) {
            return Err(SelectionError::TooFewCandidates { group, wanted: quotas[group], available: available[group] });
        }
        let (poses, parameters) = (quotas.iter().sum::<usize>(), candidates.parameters());
        if 3 * poses < parameters {
            return Err(SelectionError::TooFewPoses { poses, parameters });
        }
        let mut fixed = vec![false; candidates.len()];
        let mut room = quotas.clone();
        for &candidate in &request.fixed {
            let group = groups.get(candidate).copied().filter(|&g| room.get(g).is_some_and(|&r| r > 0) && !fixed[candidate]);
            let Some(group) = group else {
                return Err(SelectionError::Fixed { candidate });
            };
            fixed[candidate] = true;
            room[group] -= 1;
        }
        Ok(Plan { candidates, request, groups, quotas, fixed })
    }

    /// A design that no excursion improves, from the random beginning of this start.
    fn run(&self, start: usize) -> Result<(Vec<usize>, Start), SelectionError> {
        let mut search = Search::new(self, &self.beginning(start))?;
        search.fill()?;
        search.improve()?;
        let poses: Vec<usize> = search.home.poses().collect();
        Ok((poses, Start { o1: self.o1(&search.home)?, moves: search.moves }))
    }

    /// The fixed candidates and, at random, a share of the others.
    fn beginning(&self, start: usize) -> Vec<usize> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.request.seed);
        rng.set_stream(start as u64);
        let mut order: Vec<usize> =
            (0..self.candidates.len()).filter(|&c| !self.fixed[c] && self.groups[c] < self.quotas.len()).collect();
        order.shuffle(&mut rng);
        let mut poses = self.request.fixed.clone();
        let mut room = self.quotas.clone();
        poses.iter().for_each(|&c| room[self.groups[c]] -= 1);
        let left = room.iter().sum::<usize>() as f64;
        let wanted = poses.len() + (DRAWN * left).ceil() as usize;
        for candidate in order {
            if poses.len() == wanted {
                break;
            }
            let room = &mut room[self.groups[candidate]];
            if *room > 0 {
                *room -= 1;
                poses.push(candidate);
            }
        }
        poses
    }

    /// Observability index O1 (SI) of the poses alone.
    fn o1(&self, design: &Design<'_>) -> Result<f64, SelectionError> {
        let scaled = Observability::new(&singular_values(&design.transposed_jacobian())?, design.len());
        if scaled.o2 < LEAST_SEEN {
            return Err(SelectionError::NotIdentifiable { condition: scaled.condition() });
        }
        Ok(scaled.o1 * (self.candidates.log_scale() / self.candidates.parameters() as f64).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::candidates::{Field, LANES};
    use super::*;
    use rand::RngExt;

    fn pool(candidates: usize, parameters: usize, groups: usize, seed: u64) -> (Vec<f64>, Candidates) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rows: Vec<f64> = (0..candidates * 3 * parameters).map(|_| rng.random_range(-1.0..1.0)).collect();
        let candidates = Candidates::new(&rows, parameters, (0..candidates).map(|c| c % groups).collect()).unwrap();
        (rows, candidates)
    }

    /// O1 of the poses from the unscaled rows, by a way of its own.
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
        // 390 moves of designs with determinants far apart; the search computes anew after 64 excursions.
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
        assert_eq!(fails(many), SelectionError::TooFewCandidates { group: 1, wanted: 6, available: 5 });
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
