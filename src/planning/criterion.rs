//! Criterion by which measurements are chosen.

/// Criterion by which measurements are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// Best discrimination between the rivals.
    Discrimination,
    /// Smallest error predicted over the workspace.
    Accuracy,
    /// Best determination of the fitted model (D-optimality).
    Determination,
    /// Random choice with this seed.
    Random(u64),
}
