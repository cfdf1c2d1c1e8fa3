//! The JSON Schemas of the files that this library reads, each derived from the type that reads the file.
//!
//! Only with the feature `schema`: `docs/formats` holds what it gives.

use schemars::Schema;

/// Name and schema of each file.
#[must_use]
pub fn schemas() -> [(&'static str, Schema); 7] {
    [
        ("robot", crate::robot::robot_schema()),
        ("dataset", crate::measure::dataset::description::dataset_schema()),
        ("samples", crate::measure::dataset::samples_schema::samples_schema()),
        ("model", crate::identify::model_schema()),
        ("calibration", crate::identify::calibration_schema()),
        ("plan", crate::measure::poses::plan_schema()),
        ("cell", crate::measure::campaign::cell::cell_schema()),
    ]
}
