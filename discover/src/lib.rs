//! Laws that nobody wrote down.
//!
//! [`discover`] takes what a model leaves of the measurements, and searches for the function that it follows: an error of a joint,
//! a link, the tool or the base, as a product of one to three simple functions of angles, loads, gravity, directions, previous
//! moves, time and temperature. What a fit absorbs is taken from every candidate before, and so is a background of ordinary size of
//! all effects of the catalogue: a law must be significant against what every robot has.

mod catalogue;
mod data;
mod discovery;
mod factors;
mod false_laws;
mod field;
mod law;
mod metric;
mod rivals;
mod samples;
mod scan;
mod score;
mod search;
mod variables;

pub use discovery::{Discovery, FALSE_LAW_RATE, LargerModel, discover};
pub use law::{Apart, Doubt, Law, LawTerm, Rival, SeenRange};
pub use rivals::TELLS;
