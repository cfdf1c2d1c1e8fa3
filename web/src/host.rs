//! What the page does for the program.

use calibench::prediction::worker::Worker;

/// The page that runs the program.
#[derive(Debug, Clone, Copy)]
pub struct Host {
    /// Receives what is being done.
    pub tell: fn(&str),
    /// Another worker of the page.
    pub worker: Option<&'static dyn Worker>,
}

impl Host {
    /// Says what is being done.
    pub fn tell(&self, line: &str) {
        (self.tell)(line);
    }
}
