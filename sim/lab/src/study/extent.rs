//! A range of trials of a study.

/// A range of trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// First trial, from 0.
    pub first: u64,
    /// Number of trials at each point.
    pub trials: u64,
}

impl Extent {
    /// Upper bound of trial numbers: arithmetic on them stays far from integer overflow.
    pub const END: u64 = 1 << 62;
}
