//! Rows of two measurements that are the same rows.

use std::collections::HashSet;

/// Share of the rows of the smaller of two measurements that may agree by chance: an instrument of coarse steps reads the same
/// again now and then.
pub(crate) const BY_CHANCE: f64 = 0.2;

/// Number of rows that are in both, by their numbers; `None` if they are no more than chance has it. The measurements have so
/// many rows.
pub(crate) fn in_both(rows: [&HashSet<Vec<u64>>; 2], counts: [usize; 2]) -> Option<usize> {
    let same = rows[0].intersection(rows[1]).count();
    (same as f64 > BY_CHANCE * counts[0].min(counts[1]) as f64).then_some(same)
}
