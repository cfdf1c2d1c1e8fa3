//! By what measurements are chosen.

/// By what measurements are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// What tells the rivals apart.
    Discrimination,
    /// What lowers the error predicted over the workspace.
    Accuracy,
    /// What determines the fitted model (D-optimality).
    Determination,
    /// Chance, by that seed.
    Random(u64),
}
