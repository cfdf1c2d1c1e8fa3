//! Mathematics independent of robots: dense linear algebra, rigid motions, observability, SIMD registers, and sines and cosines.

pub(crate) mod linalg;
mod observability;
pub(crate) mod positive_definite;
mod rigid_fit;
pub(crate) mod simd;
pub(crate) mod sincos;
mod statistics;

pub use linalg::LinalgError;
pub use observability::Observability;
pub use positive_definite::ScaledCholesky;
pub(crate) use rigid_fit::nearest_rotation;
pub use rigid_fit::rigid_fit;
pub(crate) use statistics::{CHI2_MEDIAN, quantile};
pub use statistics::{nearest_rank, rms};
