//! sim

pub mod contact;
pub mod random;
