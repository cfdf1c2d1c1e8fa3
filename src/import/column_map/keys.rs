//! The keys of a column map.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::import::row_order::RowOrder;
use crate::measure::dataset::description::{DatasetToml, FrameToml};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapToml {
    pub format: String,
    #[serde(default = "comma")]
    pub delimiter: char,
    #[serde(default = "point")]
    pub decimal: char,
    #[serde(default = "yes")]
    pub header: bool,
    #[serde(default)]
    pub skip_lines: usize,
    #[serde(default)]
    pub session_per_file: bool,
    pub sheet: Option<String>,
    pub join: Option<String>,
    #[serde(default = "point_kind")]
    pub kind: String,
    pub columns: BTreeMap<String, Source>,
    /// By name of the target.
    #[serde(default)]
    pub targets: BTreeMap<String, PointSource>,
    pub rotation: Option<RotationSource>,
    pub flange: Option<FlangeSource>,
    pub rows: Option<RowOrder>,
    pub dataset: DatasetToml,
}

/// Source of the orientation of the tool.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotationSource {
    pub form: String,
    /// True if the table states the world in the tool: a camera on the flange that sees a fixed board.
    #[serde(default)]
    pub inverse: bool,
    /// One for each number of the form.
    pub columns: Vec<Source>,
}

/// Source of the position of a further measured point of the tool, in the same row as the TCP's.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSource {
    pub x: Source,
    pub y: Source,
    pub z: Source,
}

/// Source of the pose of the flange in the robot's base, in place of the joints.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlangeSource {
    pub x: Source,
    pub y: Source,
    pub z: Source,
    pub rotation: RotationSource,
    /// The TCP in the flange, if the pose is that of the TCP.
    pub tool: Option<FrameToml>,
    /// Joints in the middle of those of the rows, deg.
    pub near_deg: Vec<f64>,
}

fn comma() -> char {
    ','
}

fn point() -> char {
    '.'
}

fn yes() -> bool {
    true
}

fn point_kind() -> String {
    "point".into()
}

/// Source of a quantity: `scale * column + offset - minus`, in `unit`.
#[derive(Deserialize, Debug, Clone)]
#[serde(deny_unknown_fields)]
pub struct Source {
    pub column: ColumnName,
    pub unit: Option<String>,
    #[serde(default = "one")]
    pub scale: f64,
    #[serde(default)]
    pub offset: f64,
    pub minus: Option<ColumnName>,
    /// True if the column may be missing from a file.
    #[serde(default)]
    pub optional: bool,
}

fn one() -> f64 {
    1.0
}

/// A column of the source: by its title, or by its position, counted from 1.
#[derive(Deserialize, Debug, Clone, PartialEq)]
#[serde(untagged)]
pub enum ColumnName {
    Title(String),
    Place(usize),
}
