//! An artifact planned in full, and its performance figures.

use calibench_sim::planning::Plan;
use calibench_sim::scenario::{Document, Scenario};
use serde::Serialize;

use super::place_information::Predicted;
use super::trials::Verified;

/// An artifact planned in full and judged.
#[derive(Debug, Clone, Serialize)]
pub struct Judged {
    /// Its name.
    pub name: String,
    /// Names and centres of its balls, world, mm.
    pub balls: Vec<(String, [f64; 3])>,
    /// Total number of probings.
    pub probings: usize,
    /// One-sigma of the TCP position at the worst pose of the workspace, um.
    pub worst_um: f64,
    /// Mean over the poses, um.
    pub mean_um: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Length along x, width along y, and height over the table, mm.
    pub size_mm: [f64; 3],
    /// Trials on the simulated cell.
    pub verified: Option<Verified>,
    #[serde(skip)]
    pub(super) full: Option<Full>,
}

impl Judged {
    /// The scenario that contains this artifact.
    pub fn document(&self) -> Option<&Document> {
        self.full.as_ref().map(|f| &f.document)
    }
}

/// An artifact with everything its trials need.
#[derive(Clone)]
pub(super) struct Full {
    pub document: Document,
    pub scenario: Scenario,
    pub plan: Plan,
    pub predicted: Predicted,
}

impl std::fmt::Debug for Full {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Full({})", self.scenario.name)
    }
}
