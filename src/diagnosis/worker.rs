//! A helper, which computes a part of a judgement on another processor where threads cannot be had.
//!
//! The workers of a web page share no memory. What the helper is to compute is handed over as bytes, and comes back as bytes;
//! it is the same program, so that the result is the same to the last bit.

use std::sync::OnceLock;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// The way to a helper.
pub trait Helper: Send + Sync {
    /// True if somebody is there.
    fn is_there(&self) -> bool;
    /// Hands over a job, which `help` computes.
    fn begin(&self, job: &[u8]);
    /// Waits for the result of the job that was handed over last; `None` if there is none.
    fn result(&self) -> Option<Vec<u8>>;
}

static HELPER: OnceLock<Box<dyn Helper>> = OnceLock::new();

/// Hands parts of judgements to this helper from now on. There is one for the life of the program: a second is not taken.
pub fn employ(helper: impl Helper + 'static) {
    // The first stays.
    let _ = HELPER.set(Box::new(helper));
}

/// A job that was handed over.
pub(crate) struct Begun(&'static dyn Helper);

/// Hands a job to the helper; `None` if there is nobody.
pub(crate) fn begin(job: &impl Serialize) -> Option<Begun> {
    let helper = HELPER.get().filter(|helper| helper.is_there())?;
    helper.begin(&postcard::to_allocvec(job).ok()?);
    Some(Begun(helper.as_ref()))
}

impl Begun {
    /// Waits for the result; `None` if the helper has none.
    pub fn result<T: DeserializeOwned>(self) -> Option<T> {
        postcard::from_bytes(&self.0.result()?).ok()
    }
}
