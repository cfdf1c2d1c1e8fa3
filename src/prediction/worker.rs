//! A worker computes a part of a prediction on another processor where threads cannot be had.
//!
//! The workers of a web page share no memory. What a worker is to compute is handed over as bytes, and comes back as bytes;
//! it is the same program, so that the result is the same to the last bit.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// The way to a worker.
pub trait Worker: Debug + Send + Sync {
    /// True if it is there.
    fn is_there(&self) -> bool;
    /// Hands over a job, which [`help`](super::posterior::help) computes.
    fn begin(&self, job: &[u8]);
    /// Waits for the result of the job that was handed over last; `None` if there is none.
    fn result(&self) -> Option<Vec<u8>>;
}

/// A job that was handed over.
pub(crate) struct Begun<'a>(&'a dyn Worker);

/// Hands a job to the worker; `None` if it is not there.
pub(crate) fn begin<'a>(worker: Option<&'a dyn Worker>, job: &impl Serialize) -> Option<Begun<'a>> {
    let worker = worker.filter(|worker| worker.is_there())?;
    worker.begin(&postcard::to_allocvec(job).ok()?);
    Some(Begun(worker))
}

impl Begun<'_> {
    /// Waits for the result; `None` if the worker has none.
    pub fn result<T: DeserializeOwned>(self) -> Option<T> {
        postcard::from_bytes(&self.0.result()?).ok()
    }
}
