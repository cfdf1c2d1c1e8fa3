//! Showing results: tables for people, JSON for programs.

mod comparison_json;
mod comparison_plots;
mod comparison_tables;
mod diagnosis;
mod json;
mod ladder;
mod next;
mod tables;

pub use comparison_json::comparison_json;
pub use comparison_plots::write_comparison_plots;
pub use comparison_tables::comparison_text;
pub use diagnosis::{diagnosis_json, diagnosis_text, sentences};
pub use json::{calibration_json, validation_json};
pub use ladder::{ladder_json, objection_sentence, rung_json, rung_table};
pub use next::{detectability_json, detectability_text, next_json, next_sentences, next_table};
pub use tables::{histogram, parameter_table, plain_table, unresolved_sentences, validation_row, validation_table};
