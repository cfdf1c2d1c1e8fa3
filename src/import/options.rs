//! Options of an import.

use std::path::PathBuf;

use crate::measure::dataset::SampleSet;

/// Names of the formats.
pub const FORMATS: &[&str] = &["ur10-ipa", "ur5-jacobi", "mukca", "generic"];

/// Options of an import.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// Use of the rows of each file, in the order of the files; if empty, the format decides.
    pub sets: Vec<SampleSet>,
    /// Fraction of the rows to keep for validation, at random.
    pub holdout: Option<Holdout>,
    /// The column map of `generic`.
    pub map: Option<PathBuf>,
    /// For `mukca`: the robot that was measured (a built-in, or a file), if it is not the Panda.
    pub robot: Option<PathBuf>,
    /// For `mukca`: distance between neighbouring sockets of a place, m, if it is not 50 mm.
    pub sockets_apart: Option<f64>,
    /// A dataset that was measured on the same set-up: base, tool and targets are taken from it, not found from the rows.
    pub set_up_of: Option<PathBuf>,
}

/// How the postures kept for validation are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HoldoutChoice {
    /// One by one, at random: all have neighbours that are fitted.
    #[default]
    Postures,
    /// By blocks of neighbours in joint space, at random: a harder judge, and nearer to what the robot meets at its work.
    Blocks,
}

/// Rows kept for validation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holdout {
    /// Fraction of the rows that would be fitted, between 0 and 1.
    pub fraction: f64,
    /// Seed of the draw: the same seed keeps the same rows.
    pub seed: u64,
    /// How postures are chosen.
    pub choice: HoldoutChoice,
}
