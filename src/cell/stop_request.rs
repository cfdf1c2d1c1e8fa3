//! Somebody wants the robot to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A request to stop, made on any thread and heeded by the one that moves the robot; once made it stands.
#[derive(Debug, Clone, Default)]
pub struct StopRequest(Arc<AtomicBool>);

impl StopRequest {
    /// Asks for the stop.
    pub fn make(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether it was asked for.
    pub fn is_made(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
