//! The keys of a scenario's `[design]`: available parts of an artifact, and possible places of its balls.

use serde::Deserialize;

/// The keys under `[design]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct DesignToml {
    /// Balls of the artifact, 3 to 8, fixed ones included.
    pub balls: usize,
    /// Ids of the scenario's balls that keep their positions; the others are removed.
    #[serde(default)]
    pub fixed: Vec<String>,
    /// Names of solids that are removed with them; when no ball is fixed, everything `on_artifact` is removed.
    #[serde(default)]
    pub without: Vec<String>,
    /// Lower corner of the box in which a ball's centre may lie, world frame; the grid begins here, mm.
    pub min_mm: [f64; 3],
    /// Upper corner, mm.
    pub max_mm: [f64; 3],
    /// Step of the grid in x and y, mm.
    pub step_mm: f64,
    /// Heights of the available blocks, lowest first, mm.
    pub riser_heights_mm: Vec<f64>,
    /// Height of the table that carries them, world frame, mm.
    pub table_mm: f64,
    /// Side of a block; blocks do not overlap, mm.
    #[serde(default = "riser_side")]
    pub riser_side_mm: f64,
    /// Distance from the top of the block to the ball's centre, mm.
    #[serde(default = "stem")]
    pub stem_mm: f64,
    /// Radius of the stem, mm.
    #[serde(default = "stem_radius")]
    pub stem_radius_mm: f64,
    /// Base plate, per area, kg/m².
    #[serde(default)]
    pub plate_kg_per_m2: f64,
    /// A block of zero height, kg.
    #[serde(default)]
    pub riser_kg: f64,
    /// Additional mass per height of the block, kg/m.
    #[serde(default)]
    pub riser_kg_per_m: f64,
    /// Ball and stem, kg.
    #[serde(default)]
    pub ball_kg: f64,
    /// Largest mass of an artifact, kg.
    pub most_kg: Option<f64>,
    /// Total number of probings, distributed evenly over the balls, rounded up.
    #[serde(default = "probings")]
    pub probings: usize,
    /// Feasible poses searched for at each place.
    #[serde(default = "pool_per_place")]
    pub pool_per_place: usize,
    /// Poses at which the uncertainty is judged, uniform in the joints.
    #[serde(default = "workspace_poses")]
    pub workspace_poses: usize,
    /// Random starts of the exchange of places.
    #[serde(default = "starts")]
    pub starts: usize,
    /// Layouts that are planned in full, with every pose clear of the whole artifact; the best of them is selected.
    #[serde(default = "finalists")]
    pub finalists: usize,
    /// Shares of the box, above 0 and up to 1, in which the best artifact is also searched for: accuracy against size.
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
