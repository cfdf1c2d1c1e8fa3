//! The JSON documents of the program as types; a document written by one version is read by that version and by others.
//!
//! Keys and format tags are a contract; docs/schema holds the JSON Schema of every document. Lengths are in mm or um, angles
//! in deg or urad, as the key says; a number that these data do not determine is null.

mod calibration;
mod check;
mod comparison;
mod comparison_of;
mod compensation;
mod diagnosis;
mod discovery;
mod fleet;
mod heat_map;
mod import;
mod intervention;
mod judged;
mod ladder;
mod misfit;
mod next;
mod recovery;
mod run;
mod runs;
mod scatter;
mod schema;
mod shifts;
mod side_by_side;
mod step;
mod validation;
mod workspace;

use std::path::Path;

use calibench::effects::EffectId;
use calibench::files::{FileError, read_text};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use self::calibration::{Calibration, CalibrationFormat, ObservabilityIndices, Parameter, StatedParameter};
pub use self::check::{
    ChangedBy, Check, CheckFormat, CheckedCondition, ClosestChange, ConditionPower, Look, PowerAtSize, SizeOfChange,
};
pub use self::comparison::{
    BallResiduals, Comparison, ComparisonFormat, CurveBin, JointCurve, JointOffset, Place, SetupResiduals, Standout, ToolShift,
    ViewTest, WorldShift, WorstSample,
};
pub use self::compensation::{
    CompensatedProgram, CompensatedPrograms, CompensatedTarget, CompensatedTargets, Compensation, CompensationFormat, Fake,
    Frame, NotRewritten, PositionShift, RigidPart, TargetOutcome,
};
pub use self::diagnosis::{
    Advised, Contribution, CurveFamily, Diagnosis, DiagnosisFormat, Explained, Finding, FindingPlace, FoundParameter,
    RefusedEffect, Unbelievable,
};
pub use self::discovery::{
    DiscoveredLaw, Discovery, DiscoveryFormat, LawDoubt, LawRival, LawTerm, LawVariable, TellingPosture,
};
pub use self::fleet::{Fleet, FleetFormat, FleetParameter, FleetUsed};
pub use self::heat_map::{BestCurve, CurvePoint, HeatMap, HeatMapCell};
pub use self::import::{ExcludedRest, ImportFormat, ImportReport, ImportedLog, NominalFit};
pub use self::intervention::Intervention;
pub use self::judged::{BeforeAndAfter, ExpectedAt, Judged, JudgedFormat, StateErrors};
pub use self::ladder::{Choice, Ladder, LadderFormat, Recommended, Stopped, TriedStep};
pub use self::misfit::{Correction, Misfit, MisfitFormat, MisfitResidual, Slip};
pub use self::next::{
    Action, Detectability, DetectabilityFormat, EffectDetectability, Next, NextFormat, NotOffered, PlannedStep, Rival,
};
pub use self::recovery::{RecoveredTool, RecoveredZero, Recovery, RecoveryEntry, RecoveryFormat, RecoveryRival};
pub use self::run::{
    BeforeCalibration, CompensationErrors, Expectations, ExpectedCheck, HiddenEffect, HiddenParameter, Named, PaperErrors, Run,
    RunFormat, RunMethod, ScoredParameter,
};
pub use self::runs::{
    ChangedParameter, DifferenceOfRuns, DriftOfParameter, EffectOfRuns, ErrorsLeftOut, LeftOutErrors, ParameterOfRuns,
    RunOfRuns, Runs, RunsFormat, TestOfRuns,
};
pub use self::scatter::{
    JointScatter, JointSteps, LagCorrelation, RepeatScatter, Replicates, Scatter, SerialCorrelation, Suspect,
};
pub use self::schema::schemas;
pub use self::shifts::{ShiftOfNumber, ShiftedParameter, Shifts};
pub use self::side_by_side::{DifferenceOfErrors, DistanceApart, JudgedCalibration, SideBySide, SideBySideFormat};
pub use self::step::{
    AddedParameter, CheckErrors, EffectNote, ErrorSummary, Gain, LadderStep, Moment, SessionErrors, Step, StepFormat,
};
pub use self::validation::{HistogramBin, OrientationErrors, Quantiles, Validated, Validation, ValidationFormat};
pub use self::workspace::{ExpectedPart, JointOutside, MapCell, OutsideRange, Workspace, WorkspaceMap};

/// Declares the format tag of a document: a type with a single value, so that another tag is refused on reading.
macro_rules! format_tag {
    ($name:ident, $tag:literal) => {
        #[doc = concat!("The format tag `", $tag, "`.")]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        pub enum $name {
            #[doc = concat!("`", $tag, "`.")]
            #[default]
            #[serde(rename = $tag)]
            Current,
        }
    };
}
use format_tag;

/// An effect that these data cannot test.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Untestable {
    /// Id of the effect.
    pub effect: String,
    /// The missing column.
    pub needs: String,
}

impl Untestable {
    fn all(untestable: &[calibench::diagnosis::library::Untestable]) -> Vec<Self> {
        untestable.iter().map(|u| Untestable { effect: u.effect.to_string(), needs: u.needs.to_string() }).collect()
    }
}

/// Ids as text.
fn ids(ids: &[EffectId]) -> Vec<String> {
    ids.iter().map(ToString::to_string).collect()
}

/// The number, or `None` if it is infinite or not a number: JSON knows neither.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// The ids of the effects of one step, in one text.
pub(crate) fn joined(effects: &[EffectId]) -> String {
    effects.join(" and ")
}

/// A document as a JSON value, keys in alphabetical order.
#[must_use]
pub fn to_value(document: &impl Serialize) -> Value {
    // Documents have text keys and no fallible serialiser, so this cannot fail.
    serde_json::to_value(document).unwrap_or(Value::Null)
}

/// Reads a document from a file; `remedy` says how to get a correct one.
///
/// # Errors
/// If the file cannot be read, is not JSON, or holds another document; the error names the line.
pub fn read<T: DeserializeOwned>(path: &Path, remedy: &str) -> Result<T, FileError> {
    let text = read_text(path)?;
    serde_json::from_str(&text).map_err(|e| {
        let whole = FileError::whole(path, e.to_string(), remedy);
        if e.line() == 0 { whole } else { FileError { line: Some(e.line()), ..whole } }
    })
}
