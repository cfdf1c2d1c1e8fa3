//! The keys of `dataset.toml`, and the conversion of a dataset to them.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{Anchor, Ball, Dataset, ToolTarget};
use crate::robot::statics::Payload;
use crate::robot::{FramePose, JointKind};
use crate::units::{ARCSEC, DEG, MM, UM, readable};

/// The format this version reads and writes.
pub(super) const FORMAT: &str = "calibench-dataset/1";

/// The values of `share`.
pub(super) const SHAREABLE: [&str; 2] = ["base", "tool"];

/// A campaign but for its samples: the robot, and what it was measured with.
//
// Without its format, also a table of the same keys in an import map.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DatasetToml {
    /// Name and version of this format.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(extend("const" = FORMAT)))]
    pub(super) format: String,
    /// A built-in robot, or a robot file or URDF relative to this file.
    pub(super) robot: String,
    /// Gravity in the world frame, m/s²; [0, 0, -9.81] if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) gravity_m_s2: Option<[f64; 3]>,
    /// True if the controller's own absolute-accuracy option was on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) absolute_accuracy: Option<bool>,
    /// True if the base was found from the rows, and nobody stated it: how the robot was as delivered is then unknown.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) base_found: bool,
    /// Frames common to all sessions: `base`, `tool`, or both.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "schema", schemars(extend("items" = serde_json::json!({"type": "string", "enum": SHAREABLE}))))]
    pub(super) share: Vec<String>,
    /// Nominal base of the robot in the world, `Tr Rz Ry Rx`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) base: Option<FrameToml>,
    /// The TCP in the flange, `Tr Rz Ry Rx`.
    pub(super) tool: ToolToml,
    /// Payloads of the flange; the first is the default.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) payload: Vec<PayloadToml>,
    /// Balls, in the world frame.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) ball: Vec<PlaceToml>,
    /// Further points of the tool that are measured, relative to the TCP, axes of the tool.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) target: Vec<PlaceToml>,
    /// Known distances between balls.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) ball_distance: Vec<BallDistanceToml>,
    /// Points from which distances are measured, in the world frame.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) anchor: Vec<AnchorToml>,
    /// Stated noise of the measurements.
    #[serde(default)]
    pub(super) noise: NoiseToml,
    /// Origin of the data; kept verbatim.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    #[cfg_attr(feature = "schema", schemars(with = "std::collections::BTreeMap<String, serde_json::Value>"))]
    pub(super) provenance: toml::Table,
}

/// The schema of this file.
#[cfg(feature = "schema")]
pub(crate) fn dataset_schema() -> schemars::Schema {
    crate::schema::of_file::<DatasetToml>("Dataset", &["format", "base"])
}

impl DatasetToml {
    /// True if the base is given.
    pub fn has_base(&self) -> bool {
        self.base.is_some()
    }
}

/// A frame, `Tr Rz Ry Rx`.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct FrameToml {
    /// Position along x, mm.
    pub x_mm: f64,
    /// Position along y, mm.
    pub y_mm: f64,
    /// Position along z, mm.
    pub z_mm: f64,
    /// Rotation about z, deg.
    #[serde(default)]
    pub a_deg: f64,
    /// Then about the rotated y, deg.
    #[serde(default)]
    pub b_deg: f64,
    /// Then about the rotated x, deg.
    #[serde(default)]
    pub c_deg: f64,
}

impl FrameToml {
    /// The frame in SI units.
    pub fn frame(&self) -> FramePose {
        frame([self.x_mm, self.y_mm, self.z_mm], [self.a_deg, self.b_deg, self.c_deg])
    }
}

/// A frame in SI units.
pub(super) fn frame(xyz_mm: [f64; 3], abc_deg: [f64; 3]) -> FramePose {
    FramePose { xyz: xyz_mm.map(|v| v * MM), rz_ry_rx: abc_deg.map(|v| v * DEG) }
}

/// The TCP, `Tr Rz Ry Rx`, and how well it is known.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct ToolToml {
    /// Position along x, mm.
    pub x_mm: f64,
    /// Position along y, mm.
    pub y_mm: f64,
    /// Position along z, mm.
    pub z_mm: f64,
    /// Rotation about z, deg.
    #[serde(default)]
    pub a_deg: f64,
    /// Then about the rotated y, deg.
    #[serde(default)]
    pub b_deg: f64,
    /// Then about the rotated x, deg.
    #[serde(default)]
    pub c_deg: f64,
    /// One-sigma of the position, each axis, um; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub sigma_um: Option<f64>,
    /// One-sigma of the axes of measured orientations about those of the tool, deg; they are the same if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub sigma_deg: Option<f64>,
    /// True if the position is unknown and identified, and so are the axes of orientations, where they are measured.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub free: bool,
    /// Force of the three plungers on the tool when a ball is centred, tool axes, N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_force_n: Option<[f64; 3]>,
}

/// A load on the flange.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct PayloadToml {
    /// Name, as in the column `payload`.
    pub name: String,
    /// Mass, kg.
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub mass_kg: f64,
    /// Its centre in the last frame of the arm, mm.
    pub com_mm: [f64; 3],
}

/// A named place: of a ball in the world, or of a target relative to the TCP, axes of the tool.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct PlaceToml {
    /// Name, as in the column `ball` or `target`.
    pub id: String,
    /// Position along x, mm.
    pub x_mm: f64,
    /// Position along y, mm.
    pub y_mm: f64,
    /// Position along z, mm.
    pub z_mm: f64,
    /// One-sigma of the position, each axis, um; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub sigma_um: Option<f64>,
    /// True if the position is unknown, and identified.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub free: bool,
}

/// A known distance between two balls.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct BallDistanceToml {
    /// Ids of the two balls.
    pub between: [String; 2],
    /// Distance of their centres, mm.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub d_mm: f64,
    /// One-sigma of it, um.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub sigma_um: f64,
}

/// A point from which distances are measured.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct AnchorToml {
    /// Name, as in the column `anchor`.
    pub id: String,
    /// Position along x, mm.
    pub x_mm: f64,
    /// Position along y, mm.
    pub y_mm: f64,
    /// Position along z, mm.
    pub z_mm: f64,
}

/// Noise of the measurement; what is not stated is estimated from the residuals.
#[derive(Deserialize, Serialize, Default)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseToml {
    /// One-sigma per axis of one centring, um.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub ball_um: Option<f64>,
    /// One-sigma per axis of one measured point, um.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub point_um: Option<f64>,
    /// One-sigma about each axis of one measured orientation, deg.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub orientation_deg: Option<f64>,
    /// One-sigma lost motion that the encoders do not see, one for every joint, 0 for prismatic ones, arc seconds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = 0.0))))]
    pub joint_arcsec: Vec<f64>,
    /// The same of prismatic joints, one for every joint, 0 for those that turn, um.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = 0.0))))]
    pub joint_um: Vec<f64>,
    /// True if the tool saw the world in samples of kind `pose`, as a camera on the hand sees a board: `point_um` and
    /// `orientation_deg` are then of the world's frame in the axes of the tool.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub seen_from_tool: bool,
}

/// The noise of the joints of one kind, 0 for others; empty if it is not known of any.
fn joint_noise(dataset: &Dataset, kind: JointKind, unit: f64) -> Vec<f64> {
    let joints = dataset.noise.joint.iter().zip(dataset.robot.kinds());
    if joints.clone().all(|(_, of)| of != kind) {
        return Vec::new();
    }
    joints.map(|(v, of)| if of == kind { readable(*v, unit) } else { 0.0 }).collect()
}

/// The content of `dataset.toml`. A ball that is not in the dataset is named by its index.
pub(super) fn describe(dataset: &Dataset) -> DatasetToml {
    let mm = |v: f64| readable(v, MM);
    let um = |v: f64| readable(v, UM);
    let sigma = |v: f64| (v != 0.0).then(|| um(v));
    let ([x_mm, y_mm, z_mm], [a_deg, b_deg, c_deg]) = shown(&dataset.base.then(&dataset.robot.root.inverse()));
    let base = FrameToml { x_mm, y_mm, z_mm, a_deg, b_deg, c_deg };
    let ([x_mm, y_mm, z_mm], [a_deg, b_deg, c_deg]) = shown(&dataset.robot.flange.inverse().then(&dataset.tool));
    let tool = ToolToml {
        x_mm,
        y_mm,
        z_mm,
        a_deg,
        b_deg,
        c_deg,
        sigma_um: sigma(dataset.tool_sigma),
        sigma_deg: (dataset.probe_sigma != 0.0).then(|| readable(dataset.probe_sigma, DEG)),
        free: dataset.tool_free,
        contact_force_n: (dataset.contact_force != Vector3::zeros()).then(|| dataset.contact_force.into()),
    };
    let payload = |p: &Payload| PayloadToml { name: p.name.clone(), mass_kg: p.mass, com_mm: p.com.map(mm).into() };
    let place = |id: &str, at: &Vector3<f64>, one_sigma: f64, free: bool| PlaceToml {
        id: id.into(),
        x_mm: mm(at.x),
        y_mm: mm(at.y),
        z_mm: mm(at.z),
        sigma_um: sigma(one_sigma),
        free,
    };
    let ball = |b: &Ball| place(&b.id, &b.position, b.sigma, b.free);
    let tool_target = |r: &ToolTarget| place(&r.id, &r.position, r.sigma, r.free);
    let ball_id = |k: usize| dataset.balls.get(k).map_or_else(|| format!("#{k}"), |b| b.id.clone());
    let anchor =
        |a: &Anchor| AnchorToml { id: a.id.clone(), x_mm: mm(a.position.x), y_mm: mm(a.position.y), z_mm: mm(a.position.z) };
    DatasetToml {
        format: FORMAT.into(),
        robot: dataset.robot_reference.clone(),
        gravity_m_s2: Some(dataset.gravity.into()),
        absolute_accuracy: dataset.absolute_accuracy,
        base_found: dataset.base_found,
        share: SHAREABLE
            .into_iter()
            .zip([dataset.shared.base, dataset.shared.tool])
            .filter(|(_, is)| *is)
            .map(|(name, _)| name.into())
            .collect(),
        base: Some(base),
        tool,
        payload: if dataset.payloads == [Payload::none()] {
            Vec::new()
        } else {
            dataset.payloads.iter().map(payload).collect()
        },
        ball: dataset.balls.iter().map(ball).collect(),
        target: dataset.tool_targets.iter().map(tool_target).collect(),
        ball_distance: dataset
            .ball_distances
            .iter()
            .map(|d| BallDistanceToml { between: d.between.map(ball_id), d_mm: mm(d.distance), sigma_um: um(d.sigma) })
            .collect(),
        anchor: dataset.anchors.iter().map(anchor).collect(),
        noise: NoiseToml {
            ball_um: dataset.noise.ball.map(um),
            point_um: dataset.noise.point.map(um),
            orientation_deg: dataset.noise.orientation.map(|v| readable(v, DEG)),
            joint_arcsec: joint_noise(dataset, JointKind::Revolute, ARCSEC),
            joint_um: joint_noise(dataset, JointKind::Prismatic, UM),
            seen_from_tool: dataset.noise.seen_from_tool,
        },
        provenance: dataset.provenance.clone(),
    }
}

/// Position in mm and angles in deg.
fn shown(frame: &FramePose) -> ([f64; 3], [f64; 3]) {
    (frame.xyz.map(|v| readable(v, MM)), frame.rz_ry_rx.map(|v| readable(v, DEG)))
}
