//! Assessment of a calibration: position errors at poses that it was not fitted to, the views of its residuals, and the
//! effects that it is missing.

mod adaptive;
mod advice;
mod at_new_poses;
mod background;
mod check;
mod comparison;
mod copied;
mod cross_validation;
mod curve_families;
mod detectability;
mod diagnosis;
mod evidence;
mod exact_alias;
mod examination;
mod explanation;
mod fit_scores;
mod fitted_model;
mod heat_map;
mod helper;
mod hold_out;
mod hypotheses;
mod ladder;
mod ladder_step;
mod level;
mod library;
mod look;
mod lost_motion;
mod misfit;
mod next;
mod noise;
mod noise_floor;
mod objections;
mod outside_range;
mod posterior;
mod projection;
mod recommend;
mod relevance;
mod repeatability;
mod residual_views;
mod runs;
mod shifts;
mod sweep;
mod symptoms;
mod unexplained;
mod validation;
mod verdict;
mod withdrawal;
mod workspace;
mod workspace_map;

pub use adaptive::{Adaptive, LOOKS, Reached};
pub use advice::{Advice, ToDo};
pub use check::{
    Chart, ChartPoint, Charts, CheckError, CheckReference, Closest, Condition, Elementary, FALSE_ALARM, Judged, Looked,
    NOISE_ALIKE, NoiseOf, Power, PowerAt, Quantity, RUN_LENGTH, RobotCheck, SHOWN, Shown, Smallest, choose_sentinels,
    power_of_check, rows_again,
};
pub use comparison::{Comparison, FitRelation, LackOfFit, SIGNIFICANCE, Standout, Subject};
pub use curve_families::CurveFamily;
pub use detectability::{Detectability, Sight, noncentrality};
pub use diagnosis::{Contribution, Diagnosis, Explained, Finding, FoundParameter, Scatter, diagnose, diagnose_examined};
pub use exact_alias::exact_aliases;
pub use examination::Examination;
pub use fit_scores::{FitScores, SessionError};
pub use fitted_model::{FittedModel, needs_diagnosis, step_gains};
pub use heat_map::{Cell, Curve, HeatMap, Variable};
pub use helper::{Helper, employ};
pub use hold_out::{Check, HoldOut, NotJudged};
pub use hypotheses::{Hypothesis, Moment, Place, Unplaced, place};
pub use ladder::{Climb, Ladder, Next, READILY, StopReason, best_step, ladder};
pub use ladder_step::{LadderStep, add, ladder_step, step};
pub use library::{Candidate, Library, Untestable};
pub use look::Look;
pub use lost_motion::{Arrivals, LostMotion};
pub use misfit::{Cause, DataFit, Misfit, NominalFit, SlipTried, Unbelievable, data_fit, unbelievable};
pub use next::{
    Action, CellLayout, Criterion, Designer, Forecast, Kind, NotOffered, Offer, Planned, Pool, Proposal, Prospect, Rival,
    STEPS, Step, actions, planned_for, propose,
};
pub use noise::{
    JointScatter, JointSteps, LagCorrelation, REPEATS_ALARM, RepeatScatter, SERIAL_LEVEL, SUSPECT_DEVIATION, SerialCorrelation,
    Suspect, suspects,
};
pub use noise_floor::{CONFIDENCE, NoiseFloor, NoiseLevel, NoiseSource, Replicates};
pub use objections::Objection;
pub use outside_range::{Extrapolation, OutsideRange};
pub use posterior::help;
pub use recommend::{Choice, Division, Gain, Kind as ChoiceKind, Lack, Recommendation, recommend};
pub use relevance::Relevance;
pub use repeatability::{PoseRepeatability, Repeatability, StationRepeatability};
pub use residual_views::SeenSample;
pub use residual_views::{
    BallView, JointBin, JointCurve, JointOffset, JointVariable, SampleResidual, SetupView, ToolView, ViewTest, WorldView,
    WorstSample,
};
pub use runs::{
    DAYS_A_MONTH, Difference, Drift, EffectInRuns, EffectStatus, LeftOut, ParameterInRuns, ParameterStatus, Pattern,
    RUNS_FALSE_ALARM, Run, RunOfRobot, RunsComparison, RunsError, RunsQuestion, RunsTest, RunsVerdict, set_suspects_aside,
};
pub use shifts::{Shift, Shifted, Shifts, shift_of};
pub use symptoms::Symptom;
pub use unexplained::{noise_left, unexplained};
pub use validation::{HistogramBin, OrientationErrors, Validation};
pub use verdict::Verdict;
pub use withdrawal::Contradiction;
pub use workspace::{
    Banded, ExpectedError, PoseSource, WORKSPACE_POSES, WorkspaceError, WorkspacePoses, undetermined, workspace_poses,
};
pub use workspace_map::{MapCell, WorkspaceMap};

pub use crate::effects::Unphysical;
