//! What the program says to the terminal, and how it ends: output, colour, width, progress, questions, failures.

pub mod failure;
pub mod fitting;
pub mod help;
pub mod operator;
pub mod output;
pub mod palette;
pub mod progress;
pub mod streams;
