//! A pool of postures as seen by the model, and the poses chosen from it.

use calibench::effects;
use calibench::identify::Model;
use calibench::identify::fit::{independent_parameters, observability_of};
use calibench::identify::problem::{Problem, Use, missing};
use calibench::math::Observability;
use calibench::measure::dataset::{Dataset, NamedDataset, Sample};
use calibench::measure::poses::selection::{Candidates, Selection};
use nalgebra::DMatrix;

use super::error::PlanError;

/// Poses chosen from a pool.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// Feasible poses found.
    pub pool: usize,
    /// Parameters that the pool can distinguish.
    pub parameters: Vec<String>,
    /// Observability of the chosen poses, SI.
    pub observability: Observability,
    /// O1 of each start of the search.
    pub starts: Vec<f64>,
}

/// The model without the effects that require data missing from these samples: of poses in a pool only joints and ball are
/// known, not the time or the direction of approach.
pub fn shown(model: &Model, dataset: &Dataset) -> Model {
    let balls = dataset.ball_ids();
    let subject = model.subject(&dataset.robot, &balls);
    let shows =
        |id: &str| effects::build(id, &subject).map_or(true, |e| missing(e.as_ref(), dataset, model, Use::Fit).is_none());
    Model { effects: model.effects.iter().filter(|id| shows(id)).cloned().collect(), ..model.clone() }
}

/// A pool as seen by the model: the parameters that it can distinguish, and the contribution of each pose.
pub(crate) struct PoolDesign {
    parameters: Vec<String>,
    jacobian: DMatrix<f64>,
    candidates: Candidates,
}

impl PoolDesign {
    pub(crate) fn new(cell: &Dataset, samples: Vec<Sample>, groups: Vec<usize>, model: &Model) -> Result<Self, PlanError> {
        // Only parameters without a prior count: certified balls and tools are taken as known.
        let mut certain = Dataset { samples, tool_sigma: 0.0, ..cell.clone() };
        certain.balls.iter_mut().for_each(|b| b.sigma = 0.0);
        let problem = Problem::new(&[NamedDataset::new("pool", &certain)], &shown(model, &certain), Use::Fit)?;
        let kept = independent_parameters(&problem)?;
        let jacobian = problem.plain_jacobian(&problem.start(), &kept);
        let row_major: Vec<f64> = jacobian.transpose().iter().copied().collect();
        let candidates = Candidates::new(&row_major, kept.len(), groups)?;
        let parameters = kept.iter().map(|&p| problem.parameters()[p].name.clone()).collect();
        Ok(PoolDesign { parameters, jacobian, candidates })
    }

    /// Candidates for a selection.
    pub(crate) fn candidates(&self) -> &Candidates {
        &self.candidates
    }

    pub(crate) fn chosen(&self, selection: &Selection) -> Result<Chosen, PlanError> {
        let poses = &selection.poses;
        let rows =
            DMatrix::from_fn(3 * poses.len(), self.parameters.len(), |r, c| self.jacobian[(3 * poses[r / 3] + r % 3, c)]);
        Ok(Chosen {
            pool: self.jacobian.nrows() / 3,
            parameters: self.parameters.clone(),
            observability: observability_of(&rows, poses.len())?,
            starts: selection.starts.iter().map(|s| s.o1).collect(),
        })
    }
}
