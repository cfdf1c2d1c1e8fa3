//! Showing results: tables for people, JSON for programs.

mod diagnosis;
mod json;
mod tables;

pub use diagnosis::{diagnosis_json, diagnosis_text, sentences};
pub use json::{calibration_json, validation_json};
pub use tables::{histogram, parameter_table, plain_table, unresolved_sentences, validation_row, validation_table};
