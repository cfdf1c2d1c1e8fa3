//! Taking the data: [`poses`] to probe, [`centring`] on one ball, the whole [`campaign`], the resulting [`dataset`],
//! and the [`session`] at a real cell.

pub mod campaign;
pub mod centring;
pub mod dataset;
pub mod poses;
pub mod session;
