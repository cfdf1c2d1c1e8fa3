//! JSON Schema of every document.

use schemars::{Schema, schema_for};

use super::{
    Calibration, Check, Comparison, Compensation, Detectability, Diagnosis, Discovery, Fleet, ImportReport, Judged, Ladder,
    Misfit, Next, Recovery, Run, Runs, SideBySide, Step, Validated,
};

/// The schemas by name of the document, e.g. `calibench-run`.
#[must_use]
pub fn schemas() -> Vec<(&'static str, Schema)> {
    vec![
        ("calibench-calibration", schema_for!(Calibration)),
        ("calibench-check", schema_for!(Check)),
        ("calibench-comparison", schema_for!(Comparison)),
        ("calibench-compensation", schema_for!(Compensation)),
        ("calibench-detectability", schema_for!(Detectability)),
        ("calibench-diagnosis", schema_for!(Diagnosis)),
        ("calibench-discovery", schema_for!(Discovery)),
        ("calibench-fleet", schema_for!(Fleet)),
        ("calibench-import-report", schema_for!(ImportReport)),
        ("calibench-judgement", schema_for!(Judged)),
        ("calibench-ladder", schema_for!(Ladder)),
        ("calibench-misfit", schema_for!(Misfit)),
        ("calibench-next", schema_for!(Next)),
        ("calibench-recovery", schema_for!(Recovery)),
        ("calibench-run", schema_for!(Run)),
        ("calibench-runs", schema_for!(Runs)),
        ("calibench-side-by-side", schema_for!(SideBySide)),
        ("calibench-step", schema_for!(Step)),
        ("calibench-validation", schema_for!(Validated)),
    ]
}
