//! Two computations at the same time, where there are threads.

use std::thread;

/// Runs `beside` on a thread of its own while `here` runs on this one; one after the other where no thread can be had, as in a
/// browser. The second result is an error if `beside` panics.
pub(super) fn both<A, B: Send>(here: impl FnOnce() -> A, beside: impl Fn() -> B + Send + Sync) -> (A, thread::Result<B>) {
    thread::scope(|scope| match thread::Builder::new().spawn_scoped(scope, &beside) {
        Ok(running) => (here(), running.join()),
        Err(_) => (here(), Ok(beside())),
    })
}
