//! Judging a calibration: position errors on poses that it has not seen, where it fails, and what it is missing.

mod background;
mod comparison;
mod cross_validation;
mod detectability;
mod diagnosis;
mod elsewhere;
mod evidence;
mod examination;
mod heat_map;
mod hypotheses;
mod ladder;
mod library;
mod next;
mod noise_floor;
mod relevance;
mod residual_views;
mod sweep;
mod validation;
mod workspace;

pub use detectability::{Detectability, Sight, noncentrality};
pub use comparison::{Comparison, LackOfFit, SIGNIFICANCE, Standing, Standout, Subject};
pub use diagnosis::{Contribution, Diagnosis, Finding, FoundParameter, Verdict, diagnose, diagnose_examined};
pub use examination::Examination;
pub use heat_map::{Cell, Curve, HeatMap, Variable};
pub use hypotheses::{Hypothesis, Place};
pub use ladder::{Ladder, Objection, Rung, SessionError, Top, add, ladder, rung, whole_library};
pub use library::{Candidate, Library, Untestable};
pub use next::{
    Action, CellLayout, Criterion, Designer, Kind, NotOffered, Offer, Outlook, Pool, Proposal, Rival, STEPS, Step, actions, propose,
};
pub use noise_floor::{CONFIDENCE, NoiseFloor, NoiseLevel, NoiseSource, Replicates};
pub use relevance::Relevance;
pub use residual_views::{
    BallView, JointBin, JointCurve, JointOffset, JointVariable, SampleResidual, SetupView, ToolView, ViewTest, WorldView,
    WorstSample,
};
pub use validation::{HistogramBin, Validation};
pub use workspace::{Banded, ExpectedError, WORKSPACE_POSES, WorkspaceError, workspace_poses};
