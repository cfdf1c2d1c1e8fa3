//! Taking the data: [`poses`] to probe, [`centring`] on one ball, the whole [`campaign`], and the [`dataset`] that it leaves.

pub mod campaign;
pub mod centring;
pub mod dataset;
pub mod poses;
