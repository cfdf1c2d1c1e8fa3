//! The keys of `station.toml`.

use calibench::units::{MM, UM};
use serde::Deserialize;

use crate::joints::JointUnit;

/// Where joints and points of a measurement come from.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct StationToml {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = super::STATION_FORMAT)))]
    pub format: String,
    /// Where the joints come from. Not read where a plan drives the robot: its cell file names the controller.
    pub controller: ControllerToml,
    /// Where the points come from; without `address` and `listen` they are typed.
    #[serde(default)]
    pub instrument: InstrumentToml,
    /// When the arm counts as still.
    #[serde(default)]
    pub still: StillToml,
}

/// The kinds of controllers.
#[derive(Deserialize, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub(super) enum ControllerKind {
    /// The page of current positions of a FANUC controller.
    Fanuc,
    /// Robot Web Services of an ABB controller.
    Abb,
    /// A variable server on a KUKA controller.
    Kuka,
    /// Real-time data exchange of a Universal Robot.
    Ur,
    /// Lines of text.
    Text,
    /// Typed or pasted.
    Typed,
}

/// A controller, read only.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct ControllerToml {
    /// What it is.
    pub kind: ControllerKind,
    /// Where it answers: `HOST` or `HOST:PORT` of `fanuc` and `abb`, `HOST:PORT` of the others.
    pub address: Option<String>,
    /// `HOST:PORT` of this computer at which a controller of kind `text` connects, in place of `address`.
    pub listen: Option<String>,
    /// User of its web server; `Default User` of `abb`.
    pub user: Option<String>,
    /// Password of its web server; `robotics` of `abb`.
    pub password: Option<String>,
    /// Motion group of `fanuc`; 1 if not given.
    pub group: Option<usize>,
    /// False if joint 3 of `fanuc` counts from the link before it; true, from the horizontal, if not given. It is written as from
    /// the link before.
    pub coupled: Option<bool>,
    /// Mechanical unit of `abb`, or a task that begins with `T_`; `ROB_1` if not given.
    pub unit: Option<String>,
    /// What to send to `text` for a line, with `\n`, `\r`, `\t` and `\0`; nothing if it sends by itself.
    pub ask: Option<String>,
    /// The line of `text`, with `{q1}`, `{q2}` and so on where the joints are and `{}` where something else is.
    pub line: Option<String>,
    /// Longest wait for a line of `text`, s; 2 if not given.
    pub timeout_s: Option<f64>,
    /// Number of joints that are typed; 6 if not given.
    pub joints: Option<usize>,
    /// Unit of each joint; deg, of a Universal Robot rad, where none is given.
    pub units: Option<Vec<JointUnit>>,
}

/// An instrument.
#[derive(Deserialize, Default)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(super) struct InstrumentToml {
    /// `HOST:PORT` at which it answers.
    pub address: Option<String>,
    /// `HOST:PORT` of this computer at which it connects, in place of `address`.
    pub listen: Option<String>,
    /// What to send for a point, with `\n`, `\r`, `\t` and `\0`; nothing if it is triggered otherwise, or streams.
    pub trigger: Option<String>,
    /// The line of a point, with `{x}`, `{y}`, `{z}`, perhaps `{name}`, and `{}` where something else is; `{x},{y},{z}` if not
    /// given.
    pub line: Option<String>,
    /// Unit of its points, typed or sent; mm if not given.
    pub unit: Option<LengthUnit>,
    /// Points are averaged over this time, s; the first alone if it is 0, as it is if not given.
    pub average_s: Option<f64>,
    /// Largest distance of an averaged point from their mean, mm; 0.1 if not given.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub scatter_mm: Option<f64>,
    /// Longest wait for a point, s; 30 if not given.
    pub timeout_s: Option<f64>,
}

/// Units of lengths.
#[derive(Deserialize, Clone, Copy, Default)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub(super) enum LengthUnit {
    /// Millimetres.
    #[default]
    Mm,
    /// Metres.
    M,
    /// Micrometres.
    Um,
    /// Inches.
    In,
}

impl LengthUnit {
    /// One of it, m.
    pub fn si(self) -> f64 {
        match self {
            LengthUnit::Mm => MM,
            LengthUnit::M => 1.0,
            LengthUnit::Um => UM,
            LengthUnit::In => 25.4 * MM,
        }
    }
}

/// When the arm counts as still.
#[derive(Deserialize, Default)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(super) struct StillToml {
    /// No joint may move for this long, s; 1 if not given.
    pub wait_s: Option<f64>,
    /// Largest range of a turning joint meanwhile, deg; 0.02 if not given.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub within_deg: Option<f64>,
    /// Largest range of a sliding joint meanwhile, mm; 0.02 if not given.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub within_mm: Option<f64>,
    /// True if every new posture is measured by itself, without Enter.
    pub automatic: bool,
}

/// The JSON Schema of a station file; only with the feature `schema`.
#[cfg(feature = "schema")]
#[must_use]
pub fn station_schema() -> schemars::Schema {
    calibench::schema::of_file::<StationToml>("Station", &[])
}
