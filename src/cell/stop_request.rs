//! Requests to stop the robot.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A request to stop, made on any thread and obeyed by the one that moves the robot; it cannot be withdrawn.
#[derive(Debug, Clone, Default)]
pub struct StopRequest(Arc<AtomicBool>);

impl StopRequest {
    /// Requests the stop.
    pub fn make(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// True if a stop was requested.
    pub fn is_made(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
