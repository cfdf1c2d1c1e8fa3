//! A request together with its pool.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::candidates::Candidates;
use super::error::SelectionError;
use super::request::{Quota, Request};

/// Fraction of the poses selected at random, so that the starts differ; the others are the best to add, which saves half the
/// moves.
const DRAWN: f64 = 0.3;

/// A request that has been checked against its pool.
pub(super) struct Plan<'a> {
    pub candidates: &'a Candidates,
    pub request: &'a Request,
    /// Group of each candidate; all in one group if groups are ignored.
    pub groups: Vec<usize>,
    /// Poses of each group.
    pub quotas: Vec<usize>,
    /// True for candidates that must be kept.
    pub fixed: Vec<bool>,
}

impl<'a> Plan<'a> {
    pub fn new(candidates: &'a Candidates, request: &'a Request) -> Result<Self, SelectionError> {
        let (groups, quotas) = match &request.poses {
            Quota::Free(poses) => (vec![0; candidates.len()], vec![*poses]),
            Quota::PerGroup(quotas) => (candidates.groups().to_vec(), quotas.clone()),
        };
        let mut available = vec![0; quotas.len()];
        groups.iter().filter(|&&g| g < quotas.len()).for_each(|&g| available[g] += 1);
        if let Some(group) = (0..quotas.len()).find(|&g| available[g] < quotas[g]) {
            return Err(SelectionError::TooFewCandidates { group, requested: quotas[group], available: available[group] });
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

    /// The fixed candidates and a random fraction of the others.
    pub fn beginning(&self, start: usize) -> Vec<usize> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.request.seed);
        rng.set_stream(start as u64);
        let mut order: Vec<usize> =
            (0..self.candidates.len()).filter(|&c| !self.fixed[c] && self.groups[c] < self.quotas.len()).collect();
        order.shuffle(&mut rng);
        let mut poses = self.request.fixed.clone();
        let mut room = self.quotas.clone();
        poses.iter().for_each(|&c| room[self.groups[c]] -= 1);
        let left = room.iter().sum::<usize>() as f64;
        let requested = poses.len() + (DRAWN * left).ceil() as usize;
        for candidate in order {
            if poses.len() == requested {
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
}
