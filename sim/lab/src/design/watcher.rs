//! Progress of a design.

/// Observer of a design's progress.
pub trait Watcher: Sync {
    /// A stage begins, with its number of steps if known.
    fn stage(&self, what: &'static str, steps: u64);
    /// One step is done.
    fn step(&self);
}

impl Watcher for () {
    fn stage(&self, _: &'static str, _: u64) {}
    fn step(&self) {}
}
