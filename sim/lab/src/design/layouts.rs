//! Artifacts in the cell: the postures in which they can be probed, and the uncertainty to expect from a plan of all of them.

use calibench::files::FileError;
use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::PlannedPose;
use calibench::measure::poses::free_poses::{FreePosesRequest, free_poses};

use super::artifact::{Artifact, Workshop};
use super::judged::{Full, Judged};
use super::place_information::{Sought, Workspace};
use calibench_sim::planning::{layout, plan, pool};

/// Artifacts in the cell.
pub struct Layouts<'a> {
    /// The components of the artifacts.
    pub workshop: &'a Workshop,
    /// Seed.
    pub seed: u64,
}

impl Layouts<'_> {
    /// The cell with the postures found at one ball of an artifact as samples, and no other ball; `None` if there are none.
    pub fn postures(&self, artifact: &Artifact, ball: usize) -> Result<Option<Dataset>, FileError> {
        let scenario = self.workshop.document(artifact, 1)?.scenario()?;
        let Ok(found) = pool(&scenario, &[ball], self.workshop.design.pool_per_place, self.seed) else { return Ok(None) };
        let mut cell = scenario.dataset();
        cell.balls = vec![cell.balls[ball].clone()];
        cell.samples = found
            .into_iter()
            .enumerate()
            .map(|(k, c)| Sample::new(k.to_string(), c.q, Measured::Ball { ball: 0, reading: None }))
            .collect();
        Ok(Some(cell))
    }

    /// Postures throughout the workspace, clear of everything that stays when the artifact is removed, rad.
    pub fn workspace(&self) -> Result<Vec<Vec<f64>>, FileError> {
        let scenario = &self.workshop.scenario;
        let (cell, layout) = (scenario.dataset(), layout(scenario));
        free_poses(&FreePosesRequest {
            robot: &cell.robot,
            base: &cell.base,
            tool: &cell.tool,
            surroundings: &layout.without_artifact,
            margins: layout.margins,
            facing: None,
            count: self.workshop.design.workspace_poses,
            seed: self.seed,
        })
        .map_err(|e| scenario.locate_plan(&e.into()))
    }

    /// Plans an artifact in full, every posture clear of all of it; `None` if it cannot be planned or leaves something
    /// undetermined.
    pub fn judged(&self, artifact: &Artifact, name: &str, sought: &Sought, workspace: &Workspace) -> Option<Judged> {
        let balls = artifact.kept.len() + artifact.placed.len();
        let document = self.workshop.document(artifact, self.workshop.design.poses_per_ball(balls)).ok()?;
        let scenario = document.scenario().ok()?;
        let plan = plan(&scenario, self.seed).ok()?;
        let probed = plan.probing.poses.iter().filter(|p| !p.reserve).filter_map(PlannedPose::nominal_sample);
        let cell = Dataset { samples: probed.collect(), ..scenario.dataset() };
        let predicted = workspace.predicted(&sought.information(&cell, &scenario.model).ok()??)?;
        Some(Judged {
            name: name.into(),
            balls: self.workshop.balls(artifact),
            probings: plan.wanted(),
            worst_um: predicted.worst().0,
            mean_um: predicted.mean(),
            mass_kg: self.workshop.mass_kg(artifact),
            size_mm: self.workshop.size_mm(artifact),
            verified: None,
            full: Some(Full { document, scenario, plan, predicted }),
        })
    }
}
