//! `plan.toml`: the poses to probe, in their order.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::PlannedPose;
use super::ways::{HomeWays, MasteringPlace, Way};
use crate::files::disk::write_whole;
use crate::files::{FileError, field_error, parse_toml, read_text};
use crate::measure::dataset::Dataset;
use crate::units::{DEG, MM};

/// Format tag.
pub const PLAN_FORMAT: &str = "calibench-plan/1";

/// The poses to be probed, and the ways between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProbingPlan {
    /// The poses, in their order; reserves after them.
    pub poses: Vec<PlannedPose>,
    /// The ways from home; `None` if the bodies in the cell are unknown.
    pub ways: Option<HomeWays>,
}

impl ProbingPlan {
    /// Number of poses without reserves.
    pub fn wanted(&self) -> usize {
        self.poses.iter().filter(|pose| !pose.reserve).count()
    }

    /// The plan of some of its poses alone, by their ids, in this order; from one to the next by way of home.
    ///
    /// # Errors
    /// The first id that no pose has.
    pub fn of_poses<'a>(&self, ids: &'a [String]) -> Result<ProbingPlan, &'a str> {
        let mut poses: Vec<PlannedPose> = Vec::with_capacity(ids.len());
        for id in ids {
            let pose = self.poses.iter().find(|p| p.id == *id).ok_or(id.as_str())?;
            let via = match (&self.ways, poses.last()) {
                (Some(ways), Some(before)) if before.payload == pose.payload => ways.between(&before.id, id),
                (Some(ways), _) => ways.from_home(id).to_vec(),
                (None, _) => Vec::new(),
            };
            // The gap of the plan is that of another path.
            poses.push(PlannedPose { via, clearance: None, reserve: false, reverses: None, ..pose.clone() });
        }
        let mut ways = self.ways.clone();
        if let Some(ways) = &mut ways {
            ways.to.retain(|id, _| ids.contains(id));
        }
        Ok(ProbingPlan { poses, ways })
    }
}

/// Poses to probe, in their order, and the ways between them.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct PlanToml {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = PLAN_FORMAT)))]
    format: String,
    /// The robot: its name, which a robot file gives inside.
    robot: String,
    /// Joints at which all ways start, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    home_deg: Option<Vec<f64>>,
    /// Joints at which the gauge is mastered, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mastering_deg: Option<Vec<f64>>,
    /// The poses, in their order; reserves after them.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(length(min = 1)))]
    pose: Vec<PoseToml>,
    /// The ways from home: one to each pose, and one to `mastering` if there is such a place.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    way: Vec<WayToml>,
}

/// The schema of this file.
#[cfg(feature = "schema")]
pub(crate) fn plan_schema() -> schemars::Schema {
    crate::schema::of_file::<PlanToml>("Plan", &["pose"])
}

/// Names of the ends of ways that are not poses.
const HOME: &str = "home";
const MASTERING: &str = "mastering";

/// A way from home.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct WayToml {
    /// `home`: ways serve in both directions.
    #[cfg_attr(feature = "schema", schemars(extend("const" = HOME)))]
    from: String,
    /// Id of a pose, or `mastering`.
    to: String,
    /// Joints on the way, deg.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    via_deg: Vec<Vec<f64>>,
}

/// A pose to probe.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct PoseToml {
    /// Name of the pose.
    id: String,
    /// Id of the ball; none where a point is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ball: Option<String>,
    /// Name of the payload.
    payload: String,
    /// Joints with the ball centred, deg; none where a point is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contact_deg: Option<Vec<f64>>,
    /// Joints from which the ball is approached, and to which the arm retreats, or at which the point is measured, deg.
    approach_deg: Vec<f64>,
    /// Probed only in place of a pose on the same ball that failed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    reserve: bool,
    /// Arrives in the direction opposite to that of this earlier pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reverses: Option<String>,
    /// Joints through which the arm moves from the approach of the pose before, deg; for the first pose of a payload and a
    /// reserve, from home.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    via_deg: Vec<Vec<f64>>,
    /// The least gap on that path and on the approach, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    clearance_mm: Option<f64>,
}

/// Writes a plan for the cell that `cell` describes, whole or not at all.
///
/// # Errors
/// When the file cannot be written.
pub fn write_plan(path: &Path, plan: &ProbingPlan, cell: &Dataset) -> Result<(), FileError> {
    if let Some(problem) = slides(cell) {
        return Err(FileError::whole(path, problem, ONLY_TURNING));
    }
    let degrees = |q: &[f64]| -> Vec<f64> { q.iter().map(|v| v / DEG).collect() };
    let all = |via: &[Vec<f64>]| via.iter().map(|q| degrees(q)).collect();
    let pose = plan
        .poses
        .iter()
        .map(|p| PoseToml {
            id: p.id.clone(),
            ball: p.ball.and_then(|ball| cell.balls.get(ball)).map(|b| b.id.clone()),
            payload: cell.payloads.get(p.payload).map(|l| l.name.clone()).unwrap_or_default(),
            contact_deg: p.ball.map(|_| degrees(&p.contact)),
            approach_deg: degrees(&p.approach),
            reserve: p.reserve,
            reverses: p.reverses.clone(),
            via_deg: all(&p.via),
            // Rounded to the micrometre, finer than any gap is kept.
            clearance_mm: p.clearance.map(|gap| (gap / MM * 1e3).round() / 1e3),
        })
        .collect();
    let way = |(to, way): (&str, &Way)| WayToml { from: HOME.into(), to: to.into(), via_deg: all(&way.via) };
    let mastering = plan.ways.as_ref().and_then(|ways| ways.mastering.as_ref());
    let to_poses = plan.ways.iter().flat_map(|ways| ways.to.iter().map(|(id, way)| (id.as_str(), way)));
    let plan = PlanToml {
        format: PLAN_FORMAT.into(),
        robot: cell.robot.name.clone(),
        home_deg: plan.ways.as_ref().map(|ways| degrees(&ways.home)),
        mastering_deg: mastering.map(|place| degrees(&place.q)),
        pose,
        way: mastering.map(|place| (MASTERING, &place.way)).into_iter().chain(to_poses).map(way).collect(),
    };
    let text = toml::to_string(&plan).map_err(|e| FileError::whole(path, e.to_string(), "report this as a defect"))?;
    write_whole(path, text.as_bytes())
}

/// Reads a plan for the cell that `cell` describes.
///
/// # Errors
/// One error that names file, line, key and remedy: another robot, an unknown ball or payload, joints outside their limits, a
/// pose without a way where others have one.
pub fn read_plan(path: &Path, cell: &Dataset) -> Result<ProbingPlan, FileError> {
    let text = read_text(path)?;
    let plan: PlanToml = parse_toml(path, &text)?;
    let reading = Reading { path, text: &text, cell };
    if plan.format != PLAN_FORMAT {
        let problem = format!("is '{}', not '{PLAN_FORMAT}'", plan.format);
        return Err(reading.wrong("format", problem, "make the plan again"));
    }
    // An older plan names the robot's file, which has another name in each folder.
    if ![&cell.robot.name, &cell.robot_reference].contains(&&plan.robot) {
        let problem = format!("is '{}', but the cell's robot is '{}'", plan.robot, cell.robot.name);
        return Err(reading.wrong("robot", problem, "use a plan made for this cell"));
    }
    if let Some(problem) = slides(cell) {
        return Err(reading.wrong("robot", problem, ONLY_TURNING));
    }
    if plan.pose.is_empty() {
        return Err(reading.wrong("pose", "there is none", "give at least one [[pose]]"));
    }
    let mut poses: Vec<PlannedPose> = Vec::new();
    for (k, pose) in plan.pose.iter().enumerate() {
        let pose = reading.pose(k, pose, &poses)?;
        poses.push(pose);
    }
    let ways = reading.ways(&plan, &poses)?;
    Ok(ProbingPlan { poses, ways })
}

const ONLY_TURNING: &str = "measure the arm by other means, and give its samples";

/// The problem with the robot, if a plan cannot hold its joints.
fn slides(cell: &Dataset) -> Option<String> {
    let joint = cell.robot.first_prismatic()?;
    Some(format!("joint {} of the robot is prismatic, and plans are of arms whose joints turn", joint + 1))
}

struct Reading<'a> {
    path: &'a Path,
    text: &'a str,
    cell: &'a Dataset,
}

impl Reading<'_> {
    fn wrong(&self, key: &str, problem: impl Into<String>, remedy: &str) -> FileError {
        field_error(self.path, self.text, key, problem, remedy)
    }

    /// Converts joint angles as written, deg, to rad.
    fn joints(&self, key: &str, list: &[f64]) -> Result<Vec<f64>, FileError> {
        let q: Vec<f64> = list.iter().map(|v| v * DEG).collect();
        let robot = &self.cell.robot;
        if q.len() != robot.joints() {
            let remedy = format!("give one for each of the {} joints", robot.joints());
            return Err(self.wrong(key, format!("has {} numbers", q.len()), &remedy));
        }
        // NaN is outside as well.
        match robot.outside_limits(&q, 0.0) {
            Some(joint) => Err(self.wrong(key, format!("joint {} is outside its limits", joint + 1), "make the plan again")),
            None => Ok(q),
        }
    }

    fn via(&self, key: &str, via: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, FileError> {
        via.iter().enumerate().map(|(n, q)| self.joints(&format!("{key}[{n}]"), q)).collect()
    }

    /// Reads pose `k`, which follows `before`.
    fn pose(&self, k: usize, p: &PoseToml, before: &[PlannedPose]) -> Result<PlannedPose, FileError> {
        let key = |field: &str| format!("pose[{k}].{field}");
        if before.iter().any(|other| other.id == p.id) {
            return Err(self.wrong(&key("id"), format!("'{}' appears twice", p.id), "give every pose its own id"));
        }
        // They would rewrite the lists in which people look for a motion.
        let is_mark = |c: char| c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        if p.id.contains(is_mark) {
            return Err(self.wrong(&key("id"), "contains characters that are not printed", "give the pose another id"));
        }
        if [HOME, MASTERING].contains(&p.id.as_str()) {
            return Err(self.wrong(&key("id"), format!("'{}' is an end of ways", p.id), "give the pose another id"));
        }
        let ball = match &p.ball {
            Some(id) => match self.cell.balls.iter().position(|b| b.id == *id) {
                None => return Err(self.wrong(&key("ball"), format!("there is no ball '{id}'"), "name a ball of the cell")),
                ball => ball,
            },
            None if p.contact_deg.is_some() => {
                return Err(self.wrong(&key("ball"), "is missing", "name the ball of the contact"));
            }
            None => None,
        };
        if ball.is_some() && p.contact_deg.is_none() {
            return Err(self.wrong(&key("contact_deg"), "is missing", "add `contact_deg`"));
        }
        let Some(payload) = self.cell.payloads.iter().position(|l| l.name == p.payload) else {
            let problem = format!("there is no payload '{}'", p.payload);
            return Err(self.wrong(&key("payload"), problem, "name a payload of the cell"));
        };
        let approach = self.joints(&key("approach_deg"), &p.approach_deg)?;
        let contact = match &p.contact_deg {
            Some(contact) => self.joints(&key("contact_deg"), contact)?,
            None => approach.clone(),
        };
        let via = self.via(&key("via_deg"), &p.via_deg)?;
        if p.clearance_mm.is_some_and(|gap| !gap.is_finite()) {
            return Err(self.wrong(&key("clearance_mm"), "is not a finite number", "make the plan again"));
        }
        if p.reverses.as_ref().is_some_and(|id| before.iter().all(|other| other.id != *id)) {
            return Err(self.wrong(&key("reverses"), "is not an earlier pose", "name a pose that comes before it"));
        }
        Ok(PlannedPose {
            id: p.id.clone(),
            ball,
            payload,
            contact,
            approach,
            reserve: p.reserve,
            reverses: p.reverses.clone(),
            via,
            clearance: p.clearance_mm.map(|gap| gap * MM),
        })
    }

    /// Reads the ways from home, all or none.
    fn ways(&self, plan: &PlanToml, poses: &[PlannedPose]) -> Result<Option<HomeWays>, FileError> {
        let Some(home) = &plan.home_deg else {
            if plan.way.is_empty() && plan.mastering_deg.is_none() && poses.iter().all(|p| p.via.is_empty()) {
                return Ok(None);
            }
            return Err(self.wrong("home_deg", "is missing", "say where the ways begin, or make the plan again"));
        };
        let home = self.joints("home_deg", home)?;
        let mut to = BTreeMap::new();
        for (k, way) in plan.way.iter().enumerate() {
            let key = |field: &str| format!("way[{k}].{field}");
            if way.from != HOME {
                let remedy = "give ways from `home`; they serve both ways";
                return Err(self.wrong(&key("from"), format!("is '{}'", way.from), remedy));
            }
            if way.to != MASTERING && poses.iter().all(|p| p.id != way.to) {
                let remedy = "name a pose of the plan, or `mastering`";
                return Err(self.wrong(&key("to"), format!("there is no pose '{}'", way.to), remedy));
            }
            let via = self.via(&key("via_deg"), &way.via_deg)?;
            if to.insert(way.to.clone(), Way { via, narrowest: None }).is_some() {
                return Err(self.wrong(&key("to"), format!("'{}' appears twice", way.to), "give one way to each pose"));
            }
        }
        let mastering = match (&plan.mastering_deg, to.remove(MASTERING)) {
            (Some(q), Some(way)) => Some(MasteringPlace { q: self.joints("mastering_deg", q)?, way }),
            (None, None) => None,
            (Some(_), None) => {
                return Err(self.wrong("mastering_deg", "has no way", "give a [[way]] from `home` to `mastering`"));
            }
            (None, Some(_)) => {
                return Err(self.wrong("way", "one leads to `mastering`, which is nowhere", "give `mastering_deg`"));
            }
        };
        if let Some(pose) = poses.iter().find(|p| !to.contains_key(&p.id)) {
            return Err(self.wrong("way", format!("none leads to pose '{}'", pose.id), "give each pose a [[way]] from `home`"));
        }
        Ok(Some(HomeWays { home, mastering, to }))
    }
}
