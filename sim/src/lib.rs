//! sim

pub mod cmm;
pub mod contact;
pub mod gauge;
pub mod plunger;
pub mod random;
pub mod tracker;
