//! The keys of `dataset.toml`, and the conversion of a dataset to them.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{Anchor, Ball, Dataset, ToolTarget};
use crate::robot::{FramePose, JointKind, Payload};
use crate::units::{ARCSEC, DEG, MM, UM, readable};

/// The format this version reads and writes.
pub(super) const FORMAT: &str = "calibench-dataset/1";

/// The values of `share`.
pub(super) const SHAREABLE: [&str; 2] = ["base", "tool"];

/// The whole file; without its format, also a table of the same keys in an import map.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DatasetToml {
    #[serde(default)]
    pub(super) format: String,
    pub(super) robot: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) gravity_m_s2: Option<[f64; 3]>,
    /// True if the controller's own absolute-accuracy option was on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) absolute_accuracy: Option<bool>,
    /// What all sessions have in common: `base`, `tool`, or both.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) share: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) base: Option<FrameToml>,
    pub(super) tool: ToolToml,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) payload: Vec<PayloadToml>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) ball: Vec<PlaceToml>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) target: Vec<PlaceToml>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) ball_distance: Vec<BallDistanceToml>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) anchor: Vec<AnchorToml>,
    #[serde(default)]
    pub(super) noise: NoiseToml,
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub(super) provenance: toml::Table,
}

impl DatasetToml {
    /// True if the base is given.
    pub fn has_base(&self) -> bool {
        self.base.is_some()
    }
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrameToml {
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(default)]
    pub a_deg: f64,
    #[serde(default)]
    pub b_deg: f64,
    #[serde(default)]
    pub c_deg: f64,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolToml {
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(default)]
    pub a_deg: f64,
    #[serde(default)]
    pub b_deg: f64,
    #[serde(default)]
    pub c_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_um: Option<f64>,
    /// One-sigma of the axes of measured orientations about those of the tool.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_deg: Option<f64>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub free: bool,
    /// Force of the three plungers on the tool when a ball is centred, tool axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_force_n: Option<[f64; 3]>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PayloadToml {
    pub name: String,
    pub mass_kg: f64,
    pub com_mm: [f64; 3],
}

/// A named place: of a ball in the world, or of a target relative to the TCP, axes of the tool.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaceToml {
    pub id: String,
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_um: Option<f64>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub free: bool,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BallDistanceToml {
    pub between: [String; 2],
    pub d_mm: f64,
    pub sigma_um: f64,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnchorToml {
    pub id: String,
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
}

#[derive(Deserialize, Serialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseToml {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ball_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_um: Option<f64>,
    /// One-sigma about each axis of one measured orientation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation_deg: Option<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_arcsec: Vec<f64>,
    /// Of prismatic joints; 0 for those that turn.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_um: Vec<f64>,
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
        },
        provenance: dataset.provenance.clone(),
    }
}

/// Position in mm and angles in deg.
fn shown(frame: &FramePose) -> ([f64; 3], [f64; 3]) {
    (frame.xyz.map(|v| readable(v, MM)), frame.rz_ry_rx.map(|v| readable(v, DEG)))
}
