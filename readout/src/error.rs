//! Why a controller or an instrument was not read.

use thiserror::Error;

/// A controller or an instrument did not give what it was asked for.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
#[error("{whom}: {problem}; {remedy}")]
pub struct ReadoutError {
    /// What was read, and where: `FANUC at 192.168.1.10:80`.
    pub whom: String,
    /// What happened.
    pub problem: String,
    /// What to do about it.
    pub remedy: String,
}

impl ReadoutError {
    /// An error of `whom`.
    pub(crate) fn new(whom: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        ReadoutError { whom: whom.into(), problem: problem.into(), remedy: remedy.into() }
    }

    /// Nobody answers at an address.
    pub(crate) fn no_connection(whom: &str, error: &std::io::Error) -> Self {
        ReadoutError::new(
            whom,
            format!("no connection ({error})"),
            "check the address, the cable and the network of this computer",
        )
    }
}
