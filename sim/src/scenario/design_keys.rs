//! The keys of a scenario's `[design]`: available parts of an artifact, and possible places of its balls.

use serde::Deserialize;

/// The keys under `[design]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct DesignToml {
    pub balls: usize,
    #[serde(default)]
    pub fixed: Vec<String>,
    #[serde(default)]
    pub without: Vec<String>,
    pub min_mm: [f64; 3],
    pub max_mm: [f64; 3],
    pub step_mm: f64,
    pub riser_heights_mm: Vec<f64>,
    pub table_mm: f64,
    #[serde(default = "riser_side")]
    pub riser_side_mm: f64,
    #[serde(default = "stem")]
    pub stem_mm: f64,
    #[serde(default = "stem_radius")]
    pub stem_radius_mm: f64,
    #[serde(default)]
    pub plate_kg_per_m2: f64,
    #[serde(default)]
    pub riser_kg: f64,
    #[serde(default)]
    pub riser_kg_per_m: f64,
    #[serde(default)]
    pub ball_kg: f64,
    pub most_kg: Option<f64>,
    #[serde(default = "probings")]
    pub probings: usize,
    #[serde(default = "pool_per_place")]
    pub pool_per_place: usize,
    #[serde(default = "workspace_poses")]
    pub workspace_poses: usize,
    #[serde(default = "starts")]
    pub starts: usize,
    #[serde(default = "finalists")]
    pub finalists: usize,
    #[serde(default)]
    pub scales: Vec<f64>,
}

fn riser_side() -> f64 {
    80.0
}

fn stem() -> f64 {
    50.0
}

fn stem_radius() -> f64 {
    5.0
}

fn probings() -> usize {
    80
}

fn pool_per_place() -> usize {
    150
}

fn workspace_poses() -> usize {
    200
}

fn starts() -> usize {
    8
}

fn finalists() -> usize {
    3
}

impl DesignToml {
    /// Number of grid places along each axis of the table.
    pub fn columns(&self) -> [usize; 2] {
        [0, 1].map(|i| ((self.max_mm[i] - self.min_mm[i]) / self.step_mm + 1e-9).floor() as usize + 1)
    }

    /// Number of probings of each ball, so that the total is at least as stated.
    pub fn poses_per_ball(&self, balls: usize) -> usize {
        self.probings.div_ceil(balls)
    }
}
