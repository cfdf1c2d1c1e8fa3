//! Tables of the verbs, as text.

pub mod design;
pub mod hidden;
pub mod precision;
pub mod repeatability;
pub mod study;
pub mod suite;
