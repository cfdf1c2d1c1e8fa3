//! DETMAX from one start: excursions from the current design; those that return with a larger determinant are kept.

use super::candidates::{Field, LANES, Lanes};
use super::design::Design;
use super::error::SelectionError;
use super::plan::Plan;
use crate::math::Observability;
use crate::math::linalg::singular_values;

/// Smallest gain in `ln det M` that counts, well above rounding (1e-12) and equal to 1e-11 of O1.
const GAIN: f64 = 1e-9;

/// Accepted excursions between two recomputations from the poses alone.
const REFRESH: usize = 64;

/// Singular values below this share of the largest, of columns at equal scale, are rounding (1e-16) rather than information.
const LEAST_SEEN: f64 = 1e-10;

/// The outcome of one start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Observability index O1, SI.
    pub o1: f64,
    /// Poses added or removed until no excursion gave an improvement.
    pub moves: usize,
}

impl Plan<'_> {
    /// A design that no excursion improves, from the random beginning of this start.
    pub fn run(&self, start: usize) -> Result<(Vec<usize>, Start), SelectionError> {
        let mut search = Search::new(self, &self.beginning(start))?;
        search.fill()?;
        search.improve()?;
        let poses: Vec<usize> = search.home.poses().collect();
        Ok((poses, Start { o1: self.o1(&search.home)?, moves: search.moves }))
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

/// State of a start: the current design, and the field of the pool for it.
struct Search<'a> {
    plan: &'a Plan<'a>,
    home: Design<'a>,
    field: Field,
    /// The field on an excursion.
    away: Field,
    /// Buffer for the candidates that may be added.
    open: Vec<Lanes>,
    moves: usize,
}

impl<'a> Search<'a> {
    /// Creates the search for a plan, with these poses to begin with.
    fn new(plan: &'a Plan<'a>, beginning: &[usize]) -> Result<Self, SelectionError> {
        let Plan { candidates, groups, quotas, .. } = plan;
        let mut field = Field::new(candidates);
        Ok(Search {
            plan,
            home: Design::new(candidates, groups, quotas, beginning, &mut field)?,
            away: field.clone(),
            field,
            open: vec![[0.0; LANES]; candidates.len().div_ceil(LANES)],
            moves: 0,
        })
    }

    /// Adds the best poses until every quota is met.
    fn fill(&mut self) -> Result<(), SelectionError> {
        let quotas = &self.plan.quotas;
        loop {
            let short: Vec<bool> = self.home.counts().iter().zip(quotas).map(|(count, quota)| count < quota).collect();
            let best = if short.contains(&true) {
                self.home.best_addition(&mut self.field, |g| short[g], &mut self.open)
            } else {
                None
            };
            let Some(best) = best else { break };
            self.home.add(best.candidate);
            self.moves += 1;
        }
        Ok(self.home.refresh(&mut self.field)?)
    }

    /// Makes longer and longer excursions until the longest fails.
    fn improve(&mut self) -> Result<(), SelectionError> {
        let mut accepted = 0;
        while self.too_many() || self.too_few() {
            accepted += 1;
            if accepted % REFRESH == 0 {
                self.home.refresh(&mut self.field)?;
            }
        }
        Ok(())
    }

    /// Excursions that first add surplus poses. Returns true if one succeeded; its result is then the current design.
    fn too_many(&mut self) -> bool {
        let mut out = self.home.clone();
        for length in 1..=self.plan.request.excursion {
            let field = if length == 1 { &mut self.field } else { &mut self.away };
            let Some(best) = out.best_addition(field, |_| true, &mut self.open) else {
                return false;
            };
            if length == 1 {
                self.away.copy_from(&self.field);
                self.home.mark_up_to_date();
            }
            out.add(best.candidate);
            let mut back = out.clone();
            let Plan { groups, quotas, fixed, .. } = self.plan;
            for _ in 0..length {
                let counts = back.counts().to_vec();
                let Some(pose) = back.least_missed(|c| !fixed[c] && counts[groups[c]] > quotas[groups[c]]) else {
                    return false;
                };
                back.remove(pose);
            }
            if self.keep(back, 2 * length) {
                std::mem::swap(&mut self.field, &mut self.away);
                return true;
            }
        }
        false
    }

    /// Excursions that first remove poses.
    fn too_few(&mut self) -> bool {
        let mut out = self.home.clone();
        for length in 1..=self.plan.request.excursion {
            let Plan { quotas, fixed, .. } = self.plan;
            let Some(pose) = out.least_missed(|c| !fixed[c]) else {
                return false;
            };
            out.remove(pose);
            let mut back = out.clone();
            self.away.copy_from(&self.field);
            for _ in 0..length {
                let counts = back.counts().to_vec();
                let Some(best) = back.best_addition(&mut self.away, |g| counts[g] < quotas[g], &mut self.open) else {
                    return false;
                };
                back.add(best.candidate);
            }
            if self.keep(back, 2 * length) {
                std::mem::swap(&mut self.field, &mut self.away);
                return true;
            }
        }
        false
    }

    fn keep(&mut self, back: Design<'a>, moves: usize) -> bool {
        let better = back.log_det() > self.home.log_det() + GAIN;
        if better {
            self.home = back;
            self.moves += moves;
        }
        better
    }
}
