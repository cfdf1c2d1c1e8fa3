//! The order of poses at run time: those planned, then the reserves called in for those that failed.

use std::collections::VecDeque;

use super::PlannedPose;

/// The poses still to probe.
#[derive(Clone)]
pub(crate) struct Queue<'a> {
    poses: &'a [PlannedPose],
    waiting: VecDeque<usize>,
    reserves: Vec<usize>,
    /// Poses taken, and not given back.
    pub done: usize,
    /// Poses skipped in a row.
    pub skipped: usize,
    /// State before the first of them.
    before: Option<Box<Queue<'a>>>,
}

impl<'a> Queue<'a> {
    /// A queue of all planned poses, in their order.
    pub fn new(poses: &'a [PlannedPose]) -> Self {
        let (reserves, waiting): (Vec<usize>, Vec<usize>) = (0..poses.len()).partition(|&k| poses[k].reserve);
        Queue { poses, waiting: waiting.into(), reserves, done: 0, skipped: 0, before: None }
    }

    /// The poses not taken yet, by their indices in the plan.
    pub fn waiting(&self) -> impl Iterator<Item = usize> {
        self.waiting.iter().copied()
    }

    /// Takes the pose at this place among those waiting. Returns its index in the plan; `None` if there is none.
    pub fn take(&mut self, at: usize) -> Option<usize> {
        if self.skipped == 0 {
            self.before = None;
            self.before = Some(Box::new(self.clone()));
        }
        let place = self.waiting.remove(at)?;
        self.done += 1;
        Some(place)
    }

    /// Records that the pose was centred.
    pub fn centred(&mut self) {
        self.skipped = 0;
    }

    /// Records that the pose failed for good; a reserve on the same ball is called in, if there is one.
    pub fn skip(&mut self, place: usize) {
        self.skipped += 1;
        if let Some(k) = self.reserves.iter().position(|&r| self.poses[r].ball == self.poses[place].ball) {
            self.waiting.push_back(self.reserves.remove(k));
        }
    }

    /// Returns the pose to the queue, to be probed as if it never had been.
    pub fn give_back(&mut self, place: usize) {
        self.waiting.push_front(place);
        self.done -= 1;
    }

    /// Returns all poses skipped in this row to the queue, to be probed as if they never had been.
    pub fn give_back_skipped(&mut self) {
        if let Some(before) = self.before.take() {
            *self = *before;
        }
    }

    /// Poses not taken yet.
    pub fn left(&self) -> usize {
        self.waiting.len()
    }
}
