//! Finding the numbers: what the measurements can tell, and how well.

pub mod linalg;
mod observability;

pub use observability::Observability;
