//! A campaign of points: the robot goes through the poses of a plan by itself, and an instrument measures a point in each.

use calibench::cell::{Manipulator, ManipulatorError, StopRequest};
use calibench::files::FileError;
use calibench::math::rigid_fit;
use calibench::measure::campaign::{CampaignSettings, LastMotion};
use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::ways::ArmAt;
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench::robot::FramePose;
use calibench::robot::kinematics::world_from_tool;
use calibench::units::{DEG, MM};
use nalgebra::{Point3, Vector3};
use thiserror::Error;

use crate::ReadoutError;
use crate::journal::{Journal, Row, now_s};
use crate::points::Instrument;

/// Motion of a joint while a point is measured that is too much, rad.
const STILL: f64 = 0.01 * DEG;
/// Attempts at a point.
const TRIES: usize = 2;
/// Poses in succession without a point after which something is wrong that going on does not mend.
const MOST_MISSED: usize = 3;
/// Points after which they are compared with the arm: five determine the base, and show whether anything fits.
const JUDGED: usize = 5;
/// Distance from the nominal arm that a target somewhere on the flange does not explain, m, rms.
const FAR_OFF: f64 = 0.3;

/// Why a campaign of points stopped.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CampaignStop {
    /// The robot did not do what it was told.
    #[error(transparent)]
    Robot(#[from] ManipulatorError),
    /// Several poses in succession had no point.
    #[error("no point in {MOST_MISSED} poses in succession; of the last: {0}")]
    Instrument(#[source] ReadoutError),
    /// The points are not those of this arm, wherever its base is.
    #[error(
        "the first {points} points lie {apart_mm:.0} mm (rms) from those of the arm of the cell: correct `unit` and `line` of the station, the robot or the tool, and begin again"
    )]
    Nonsense {
        /// Number of points.
        points: usize,
        /// Distance from the nominal arm with its base fitted, rms, mm.
        apart_mm: f64,
    },
    /// The journal cannot be written.
    #[error(transparent)]
    Journal(#[from] FileError),
}

/// What a campaign of points tells while it runs.
pub trait CampaignWatcher {
    /// The arm goes to a pose.
    fn goes_to(&mut self, pose: &PlannedPose);
    /// A point was measured.
    fn measured(&mut self, pose: &PlannedPose, row: &Row);
    /// A pose was left without a point.
    fn missed(&mut self, pose: &PlannedPose, why: &str);
}

/// A campaign of points.
pub struct PointCampaign<'a> {
    /// The poses, and the ways between them.
    pub plan: &'a ProbingPlan,
    /// The cell: robot, base, tool.
    pub cell: &'a Dataset,
    /// A request to stop.
    pub stop: StopRequest,
    /// Where the arm is.
    pub stands: ArmAt,
}

impl PointCampaign<'_> {
    /// Measures the poses of the plan that are not in the journal, and goes home. Returns the ids of those without a point.
    ///
    /// # Errors
    /// Why it stopped before the end; what was measured is in the journal.
    pub fn run(
        &mut self,
        robot: &mut dyn Manipulator,
        instrument: &mut Instrument,
        journal: &mut Journal,
        watcher: &mut dyn CampaignWatcher,
    ) -> Result<Vec<String>, CampaignStop> {
        let plan = self.plan;
        let done: Vec<String> = journal.rows().iter().filter_map(|row| row.pose.clone()).collect();
        let (mut missed, mut in_succession) = (Vec::new(), 0);
        for pose in plan.poses.iter().filter(|pose| !pose.reserve && !done.contains(&pose.id)) {
            watcher.goes_to(pose);
            robot.move_along(&self.way_to(pose))?;
            self.stands = ArmAt::Approach(pose.id.clone());
            match self.point_at(pose, robot, instrument)? {
                Ok(row) => {
                    journal.add(row)?;
                    in_succession = 0;
                    if let Some(row) = journal.rows().last() {
                        watcher.measured(pose, row);
                    }
                    if let Some(apart) = self.nonsense(journal.rows()) {
                        self.go_home(robot)?;
                        return Err(CampaignStop::Nonsense { points: journal.rows().len(), apart_mm: apart / MM });
                    }
                }
                Err(why) => {
                    watcher.missed(pose, &why.to_string());
                    missed.push(pose.id.clone());
                    in_succession += 1;
                    if in_succession == MOST_MISSED {
                        self.go_home(robot)?;
                        return Err(CampaignStop::Instrument(why));
                    }
                }
            }
        }
        self.go_home(robot)?;
        Ok(missed)
    }

    /// The distance of the points from the nominal arm, its base fitted, m, rms; if it is more than an arm and a target that
    /// nobody has measured explain.
    fn nonsense(&self, rows: &[Row]) -> Option<f64> {
        if rows.len() != JUDGED {
            return None;
        }
        let pairs = pairs(self.cell, rows);
        let moved = rigid_fit(&pairs)?;
        let off = |(from, to): &(Vector3<f64>, Vector3<f64>)| (moved * Point3::from(*from) - Point3::from(*to)).norm_squared();
        let apart = (pairs.iter().map(off).sum::<f64>() / pairs.len() as f64).sqrt();
        (apart > FAR_OFF).then_some(apart)
    }

    /// The joints through which the arm goes to a pose, its own at the end, rad.
    fn way_to(&self, pose: &PlannedPose) -> Vec<Vec<f64>> {
        let poses = &self.plan.poses;
        let before = poses.iter().position(|p| p.id == pose.id).and_then(|k| poses.get(k.checked_sub(1)?));
        let via = match (&self.stands, &self.plan.ways) {
            (ArmAt::Approach(at), _) if *at == pose.id => Vec::new(),
            (ArmAt::Approach(at), _) if before.is_some_and(|b| b.id == *at && b.payload == pose.payload) => pose.via.clone(),
            (ArmAt::Approach(at), Some(ways)) => ways.between(at, &pose.id),
            (ArmAt::Home, Some(ways)) => ways.from_home(&pose.id).to_vec(),
            _ => Vec::new(),
        };
        [via, vec![pose.approach.clone()]].concat()
    }

    fn go_home(&mut self, robot: &mut dyn Manipulator) -> Result<(), ManipulatorError> {
        let (Some(ways), ArmAt::Approach(at)) = (&self.plan.ways, &self.stands) else { return Ok(()) };
        robot.move_along(&ways.home_from(at))?;
        self.stands = ArmAt::Home;
        Ok(())
    }

    /// The point of a pose in which the arm stands, or why there is none.
    fn point_at(
        &self,
        pose: &PlannedPose,
        robot: &mut dyn Manipulator,
        instrument: &mut Instrument,
    ) -> Result<Result<Row, ReadoutError>, ManipulatorError> {
        let stopped = || ManipulatorError::Stopped { reason: "a stop was requested".into() };
        let mut why = None;
        for _ in 0..TRIES {
            let q = robot.joints()?;
            let point = match instrument.point(&mut || !self.stop.is_made()) {
                Ok(Some(point)) => point,
                Ok(None) => return Err(stopped()),
                Err(error) => {
                    why = Some(error);
                    continue;
                }
            };
            let after = robot.joints()?;
            if let Some(joint) = q.iter().zip(&after).position(|(q, after)| (q - after).abs() > STILL) {
                let problem = format!("joint {} moved while the point was taken", joint + 1);
                why = Some(ReadoutError::new("robot", problem, "see why the arm does not stand still"));
                continue;
            }
            return Ok(Ok(Row {
                time_s: now_s(),
                q: after,
                point_m: [point.position.x, point.position.y, point.position.z],
                name: point.name,
                pose: Some(pose.id.clone()),
                q_commanded: robot.commanded(),
                temp_c: robot.temperature_c(),
                tau: robot.torques(),
            }));
        }
        Ok(Err(why.unwrap_or_else(|| ReadoutError::new("instrument", "no point", "see whether it measures"))))
    }
}

/// Where the nominal arm has the points of these rows, and where they were measured, m.
fn pairs(cell: &Dataset, rows: &[Row]) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let nominal = |row: &Row| world_from_tool(&cell.robot, &cell.base, &cell.tool, &row.q).translation.vector;
    rows.iter().map(|row| (nominal(row), Vector3::from(row.point_m))).collect()
}

/// The dataset of a journal: the description of the cell, with the base where the points say that it is.
///
/// The instrument's frame is anybody's choice: the base is the one that brings the nominal arm closest to its points. It is found,
/// not stated.
pub fn dataset_of(cell: &Dataset, plan: &ProbingPlan, rows: &[Row]) -> Dataset {
    let began = rows.first().map_or(0.0, |row| row.time_s);
    let mut motion = LastMotion::new(CampaignSettings::default().joint_motion);
    let samples = rows.iter().enumerate().map(|(k, row)| {
        motion.rest_at(&row.q);
        let pose = row.pose.as_ref().and_then(|id| plan.poses.iter().find(|pose| pose.id == *id));
        let id = row.pose.clone().unwrap_or_else(|| format!("p{:03}", k + 1));
        Sample {
            payload: pose.map_or(0, |pose| pose.payload),
            time_s: Some(row.time_s - began),
            temp_c: row.temp_c,
            tau: row.tau.clone(),
            q_commanded: row.q_commanded.clone(),
            approach: Some(motion.signs().to_vec()),
            ..Sample::new(id, row.q.clone(), Measured::Point(Vector3::from(row.point_m)))
        }
    });
    let samples = samples.collect();
    match rigid_fit(&pairs(cell, rows)) {
        Some(moved) => {
            let base = FramePose::from_pose(&(moved * cell.base.pose()));
            // It pulls as it did before, seen from the arm.
            let gravity = moved.rotation * cell.gravity;
            Dataset { base, base_found: true, gravity, samples, ..cell.clone() }
        }
        None => Dataset { samples, ..cell.clone() },
    }
}
