//! Showing results: tables for people, JSON for programs.

mod comparison_json;
mod comparison_plots;
mod comparison_tables;
mod json;
mod tables;

pub use comparison_json::comparison_json;
pub use comparison_plots::write_comparison_plots;
pub use comparison_tables::comparison_text;
pub use json::{calibration_json, validation_json};
pub use tables::{histogram, parameter_table, plain_table, unresolved_sentences, validation_row, validation_table};
