//! `plan.toml`: the poses to probe, in their order.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Dataset, PlannedPose};
use crate::files::{FileError, field_error, parse_toml, read_text, write_whole};
use crate::units::DEG;

/// Format tag.
pub const PLAN_FORMAT: &str = "calibench-plan/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanToml {
    format: String,
    robot: String,
    #[serde(default)]
    pose: Vec<PoseToml>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PoseToml {
    id: String,
    ball: String,
    payload: String,
    contact_deg: Vec<f64>,
    approach_deg: Vec<f64>,
    /// Probed only in place of a pose on the same ball that failed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    reserve: bool,
    /// Arrives from the side opposite to that of this earlier pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reverses: Option<String>,
}

/// Writes a plan for the cell that `cell` describes, whole or not at all.
///
/// # Errors
/// When the file cannot be written.
pub fn write_plan(path: &Path, poses: &[PlannedPose], cell: &Dataset) -> Result<(), FileError> {
    let degrees = |q: &[f64]| q.iter().map(|v| v / DEG).collect();
    let pose = poses
        .iter()
        .map(|p| PoseToml {
            id: p.id.clone(),
            ball: cell.balls.get(p.ball).map(|b| b.id.clone()).unwrap_or_default(),
            payload: cell.payloads.get(p.payload).map(|l| l.name.clone()).unwrap_or_default(),
            contact_deg: degrees(&p.contact),
            approach_deg: degrees(&p.approach),
            reserve: p.reserve,
            reverses: p.reverses.clone(),
        })
        .collect();
    let plan = PlanToml { format: PLAN_FORMAT.into(), robot: cell.robot_reference.clone(), pose };
    let text = toml::to_string(&plan).map_err(|e| FileError::whole(path, e.to_string(), "report this as a defect"))?;
    write_whole(path, text.as_bytes())
}

/// Reads a plan for the cell that `cell` describes.
///
/// # Errors
/// One error that names file, line, key and remedy: another robot, an unknown ball or payload, joints outside their limits.
pub fn read_plan(path: &Path, cell: &Dataset) -> Result<Vec<PlannedPose>, FileError> {
    let text = read_text(path)?;
    let plan: PlanToml = parse_toml(path, &text)?;
    let wrong = |key: &str, problem: String, remedy: &str| Err(field_error(path, &text, key, problem, remedy));
    if plan.format != PLAN_FORMAT {
        return wrong(
            "format",
            format!("is '{}', not '{PLAN_FORMAT}'", plan.format),
            "make the plan anew with `calibench plan`",
        );
    }
    if plan.robot != cell.robot_reference {
        let problem = format!("is '{}', but the cell's robot is '{}'", plan.robot, cell.robot_reference);
        return wrong("robot", problem, "use a plan made for this cell");
    }
    if plan.pose.is_empty() {
        return wrong("pose", "there is none".into(), "give at least one [[pose]]");
    }
    let mut poses: Vec<PlannedPose> = Vec::new();
    for (k, p) in plan.pose.into_iter().enumerate() {
        let key = |field: &str| format!("pose[{k}].{field}");
        if poses.iter().any(|other| other.id == p.id) {
            return wrong(&key("id"), format!("'{}' stands twice", p.id), "give every pose its own id");
        }
        let Some(ball) = cell.balls.iter().position(|b| b.id == p.ball) else {
            return wrong(&key("ball"), format!("there is no ball '{}'", p.ball), "name a ball of the cell");
        };
        let Some(payload) = cell.payloads.iter().position(|l| l.name == p.payload) else {
            return wrong(&key("payload"), format!("there is no payload '{}'", p.payload), "name a payload of the cell");
        };
        for (field, list) in [("contact_deg", &p.contact_deg), ("approach_deg", &p.approach_deg)] {
            let q: Vec<f64> = list.iter().map(|v| v * DEG).collect();
            if q.len() != cell.robot.joints() {
                let remedy = format!("give one for each of the {} joints", cell.robot.joints());
                return wrong(&key(field), format!("has {} numbers", q.len()), &remedy);
            }
            // Not a number is outside as well.
            if let Some(joint) = cell.robot.outside_limits(&q, 0.0) {
                return wrong(&key(field), format!("joint {} is outside its limits", joint + 1), "make the plan anew");
            }
        }
        if p.reverses.as_ref().is_some_and(|id| poses.iter().all(|other| other.id != *id)) {
            return wrong(&key("reverses"), "is not an earlier pose".into(), "name a pose that comes before it");
        }
        let radians = |list: &[f64]| list.iter().map(|v| v * DEG).collect();
        let (contact, approach) = (radians(&p.contact_deg), radians(&p.approach_deg));
        poses.push(PlannedPose { id: p.id, ball, payload, contact, approach, reserve: p.reserve, reverses: p.reverses });
    }
    Ok(poses)
}
