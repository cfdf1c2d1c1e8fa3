//! Tables of the verbs, as text.

pub mod hidden;
pub mod repeatability;
pub mod study;
