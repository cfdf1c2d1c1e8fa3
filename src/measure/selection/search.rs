//! DETMAX from one start: excursions from the design at home, those kept that come back with a larger determinant.

use super::candidates::{Field, LANES, Lanes};
use super::design::Design;
use super::{Plan, SelectionError};

/// An excursion must gain this much in `ln det M`, well above rounding (1e-12) and 1e-11 of O1, to count.
const GAIN: f64 = 1e-9;

/// Accepted excursions between two computations from the poses alone.
const REFRESH: usize = 64;

/// A start under way: the design at home, and the field of the pool that goes with it.
pub(super) struct Search<'a> {
    plan: &'a Plan<'a>,
    pub home: Design<'a>,
    field: Field,
    /// The field on an excursion.
    away: Field,
    /// Room for which candidates may be added.
    open: Vec<Lanes>,
    pub moves: usize,
}

impl<'a> Search<'a> {
    /// Of a plan, with these poses to begin with.
    pub fn new(plan: &'a Plan<'a>, beginning: &[usize]) -> Result<Self, SelectionError> {
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
    pub fn fill(&mut self) -> Result<(), SelectionError> {
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

    /// Goes on longer and longer excursions until the longest fails.
    pub fn improve(&mut self) -> Result<(), SelectionError> {
        let mut accepted = 0;
        while self.too_many() || self.too_few() {
            accepted += 1;
            if accepted % REFRESH == 0 {
                self.home.refresh(&mut self.field)?;
            }
        }
        Ok(())
    }

    /// Excursions that first take poses too many. Whether one succeeded; home is then where it ended.
    fn too_many(&mut self) -> bool {
        let mut out = self.home.clone();
        for length in 1..=self.plan.request.excursion {
            let field = if length == 1 { &mut self.field } else { &mut self.away };
            let Some(best) = out.best_addition(field, |_| true, &mut self.open) else {
                return false;
            };
            if length == 1 {
                self.away.copy_from(&self.field);
                self.home.told();
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

    /// Excursions that first give poses away.
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
