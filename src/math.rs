//! Mathematics independent of robots: dense linear algebra, observability, SIMD registers, and sines and cosines.

pub(crate) mod linalg;
mod observability;
pub(crate) mod positive_definite;
mod rms;
pub(crate) mod simd;
pub(crate) mod sincos;

pub use linalg::LinalgError;
pub use observability::Observability;
pub use rms::rms;
