//! Repeated returns to a ball: the robot's repeatability, and the lost motion of each joint on reversal.
//!
//! The ball is centred once, and the joints read there become the target. From then on the arm is only commanded back to that
//! target; it is not centred before it is read, which would undo the effect measured. The three readings are the ball's centre
//! in the tool frame, so their scatter is that of the attained position. ISO 9283 (1998), 7.2 requires 30 cycles on one path.

use nalgebra::Vector3;

use crate::cell::{Indicator, Manipulator};
use crate::measure::centring::{CenteringController, Centred, CentringFailure, Iteration, Phase, ProbingFailure};
use crate::measure::poses::PlannedPose;
use crate::robot::kinematics::Posture;
use crate::robot::sites::SiteIndex;
use crate::robot::{FramePose, Robot};
use crate::units::{DEG, MM};

/// Numbers of returns and arrivals, and size of the excursions.
#[derive(Debug, Clone, PartialEq)]
pub struct RepeatabilitySettings {
    /// Returns from the approach, at least 2. 30: ISO 9283.
    pub returns: usize,
    /// Arrivals of every joint from each side, at least 2. 10: the interval is then 1.15 times as wide as with infinite degrees
    /// of freedom, at the same scatter and number.
    pub reversals: usize,
    /// Readings without any motion, at least 2: the scatter of the gauge itself.
    pub readings_at_rest: usize,
    /// Excursion of the TCP by the joint that arrives from a side, m. 2 mm: inside the flat of the tips and the safe range, and
    /// at the end of a 1 m arm ten times the lost motion of a poor joint.
    pub aside: f64,
    /// Largest excursion of a joint, rad: one with the TCP on its axis would otherwise turn without limit.
    pub most_aside: f64,
}

impl Default for RepeatabilitySettings {
    fn default() -> Self {
        RepeatabilitySettings { returns: 30, reversals: 10, readings_at_rest: 30, aside: 2.0 * MM, most_aside: 0.5 * DEG }
    }
}

/// A posture on a ball, for repeated returns.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// The pose and its approach.
    pub pose: PlannedPose,
    /// Motion of the TCP per radian, or metre, of each joint (N), tool axes, m, of the nominal arm.
    pub levers: Vec<Vector3<f64>>,
}

impl Station {
    /// Creates the station at a planned pose of the nominal arm.
    pub fn new(robot: &Robot, base: &FramePose, tool: &FramePose, pose: PlannedPose) -> Self {
        let mut posture = Posture::new(robot);
        posture.set(robot, base, tool, &pose.contact, &vec![0.0; SiteIndex::new(robot.joints()).len()]);
        let tool_from_world = posture.world_from_tool(tool).rotation.inverse();
        let lever = |i: usize| tool_from_world * posture.motion(i);
        Station { levers: (0..robot.joints()).map(lever).collect(), pose }
    }

    /// Excursion of joint `i`, rad.
    fn aside(&self, i: usize, settings: &RepeatabilitySettings) -> f64 {
        (settings.aside / self.levers[i].norm().max(f64::MIN_POSITIVE)).min(settings.most_aside)
    }
}

/// The arm back at its target.
#[derive(Debug, Clone, PartialEq)]
pub struct Return {
    /// Joints read back, rad (N).
    pub joints: Vec<f64>,
    /// The ball's centre in the tool frame, m.
    pub reading: Vector3<f64>,
}

/// One joint arriving from both sides, the others at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Reversal {
    /// Joint, counted from 0.
    pub joint: usize,
    /// Arrival with increasing angle.
    pub upwards: Return,
    /// Arrival with decreasing angle.
    pub downwards: Return,
}

/// The measurements at one station.
#[derive(Debug, Clone, PartialEq)]
pub struct StationRecord {
    /// The station.
    pub station: Station,
    /// Joints to which the arm was commanded back, rad (N).
    pub target: Vec<f64>,
    /// Returns from the approach, with every joint from the same side each time.
    pub returns: Vec<Return>,
    /// The ball centred after each return, as in a campaign.
    pub centred: Vec<Centred>,
    /// Arrivals from both sides: joint after joint, repeated.
    pub reversals: Vec<Reversal>,
    /// Repeated readings without a motion, m.
    pub at_rest: Vec<Vector3<f64>>,
    /// Duration on the cell's clock, s.
    pub duration_s: f64,
}

impl<M: Manipulator, I: Indicator> CenteringController<M, I> {
    /// Measures the repeatability and the lost motion of the arm at one station; `note` is called at every stop.
    ///
    /// # Errors
    /// When a probing there would fail: the ball is not met or lost, an indicator or the robot fails. The arm is then at the
    /// approach pose, if it obeys.
    pub fn revisit(
        &mut self,
        station: &Station,
        settings: &RepeatabilitySettings,
        note: &mut dyn FnMut(&Iteration),
    ) -> Result<StationRecord, ProbingFailure> {
        let started_s = self.robot.clock_s();
        let pose = &station.pose;
        let first = self.probe(pose, note).outcome?;
        let mut record = StationRecord {
            station: station.clone(),
            target: first.joints,
            returns: Vec::with_capacity(settings.returns),
            centred: Vec::with_capacity(settings.returns),
            reversals: Vec::with_capacity(settings.reversals * station.levers.len()),
            at_rest: Vec::with_capacity(settings.readings_at_rest),
            duration_s: 0.0,
        };
        for _ in 0..settings.returns {
            self.out_and_back(pose, note, |cell, note| cell.return_and_centre(&mut record, note))?;
        }
        self.out_and_back(pose, note, |cell, note| cell.reverse_all(&mut record, settings, note))?;
        record.duration_s = self.robot.clock_s() - started_s;
        Ok(record)
    }

    /// Runs a procedure on the ball, and moves back to the approach pose whatever its result.
    fn out_and_back(
        &mut self,
        pose: &PlannedPose,
        note: &mut dyn FnMut(&Iteration),
        act: impl FnOnce(&mut Self, &mut dyn FnMut(&Iteration)) -> Result<(), CentringFailure>,
    ) -> Result<(), ProbingFailure> {
        let done = act(self, note);
        if let Err(reason) = &done
            && !reason.robot_obeys()
        {
            return Err(ProbingFailure { reason: reason.clone(), backed_off: false });
        }
        let (backed_off, free) = self.retreat(pose, note);
        done.and(free).map_err(|reason| ProbingFailure { reason, backed_off })
    }

    /// Moves from the approach back to the target and reads; then centres.
    fn return_and_centre(
        &mut self,
        record: &mut StationRecord,
        note: &mut dyn FnMut(&Iteration),
    ) -> Result<(), CentringFailure> {
        let back = self.arrive_at(&record.target, note)?;
        record.returns.push(back);
        record.centred.push(self.centre_at(&[], note)?);
        Ok(())
    }

    /// Moves every joint from both sides, one at a time; then reads the gauge at rest.
    fn reverse_all(
        &mut self,
        record: &mut StationRecord,
        settings: &RepeatabilitySettings,
        note: &mut dyn FnMut(&Iteration),
    ) -> Result<(), CentringFailure> {
        self.arrive_at(&record.target, note)?;
        for cycle in 0..settings.reversals {
            for joint in 0..record.station.levers.len() {
                let aside = record.station.aside(joint, settings);
                let target = record.target.clone();
                let mut arrive = |direction: f64| {
                    let mut beside = target.clone();
                    beside[joint] -= direction * aside;
                    self.arrive_at(&beside, note)?;
                    self.arrive_at(&target, note)
                };
                // The order of the sides alternates from cycle to cycle: a drift then cancels in the mean.
                let (upwards, downwards) = if cycle % 2 == 0 {
                    let upwards = arrive(1.0)?;
                    (upwards, arrive(-1.0)?)
                } else {
                    let downwards = arrive(-1.0)?;
                    (arrive(1.0)?, downwards)
                };
                record.reversals.push(Reversal { joint, upwards, downwards });
            }
        }
        for _ in 0..settings.readings_at_rest {
            let reading = self.stop(Phase::Centring, &[], note, |cell, _, reading| {
                let reading = reading?;
                cell.contact(&reading)?;
                Ok(reading)
            })?;
            record.at_rest.push(reading);
        }
        Ok(())
    }

    /// Moves to these joints with the ball in the gauge, and reads.
    fn arrive_at(&mut self, target: &[f64], note: &mut dyn FnMut(&Iteration)) -> Result<Return, CentringFailure> {
        self.stop(Phase::Centring, &[target.to_vec()], note, |cell, at, reading| {
            let reading = reading?;
            cell.contact(&reading)?;
            Ok(Return { joints: at.joints.clone(), reading })
        })
    }
}
