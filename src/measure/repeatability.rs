//! Going back to a ball again and again: what a robot repeats, and what each joint loses on reversal.
//!
//! The ball is centred once, and the joints read there become the target. From then on the arm is only sent back to that target; it is
//! not centred before it is read, which would undo what is measured. The three readings are the ball's centre in the tool frame, so
//! their scatter is that of the attained position. ISO 9283 (1998), 7.2 asks for 30 cycles on one path.

use nalgebra::Vector3;

use super::{CenteringController, Centred, CentringFailure, Iteration, Phase, PlannedPose, ProbingFailure};
use crate::cell::{Indicator, Manipulator};
use crate::robot::{FramePose, MdhEntry, Posture, Robot, Site, SiteIndex};
use crate::units::{DEG, MM};

/// How often the arm goes back, and from how far a joint arrives.
#[derive(Debug, Clone, PartialEq)]
pub struct RepeatabilitySettings {
    /// Returns from the approach, at least 2. 30: ISO 9283.
    pub returns: usize,
    /// Arrivals of every joint from each side, at least 2. 10: the interval is then 1.15 times as wide as with endless ones of the
    /// same scatter and number.
    pub reversals: usize,
    /// Readings without any motion, at least 2: what the gauge itself scatters by.
    pub readings_at_rest: usize,
    /// How far the TCP is moved by the joint that arrives from a side, m. 2 mm: inside the flat of the tips and the safe range, and at
    /// the end of a 1 m arm ten times the lost motion of a poor joint.
    pub aside: f64,
    /// The most a joint steps aside, rad: one on whose axis the TCP lies would otherwise turn for ever.
    pub most_aside: f64,
}

impl Default for RepeatabilitySettings {
    fn default() -> Self {
        RepeatabilitySettings { returns: 30, reversals: 10, readings_at_rest: 30, aside: 2.0 * MM, most_aside: 0.5 * DEG }
    }
}

/// A posture on a ball to go back to.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// Where it is and how it is approached.
    pub pose: PlannedPose,
    /// What one radian of each joint (N) moves the TCP by, tool axes, m, of the nominal arm.
    pub levers: Vec<Vector3<f64>>,
}

impl Station {
    /// The station at a planned pose of the nominal arm.
    pub fn new(robot: &Robot, base: &FramePose, tool: &FramePose, pose: PlannedPose) -> Self {
        let mut posture = Posture::new(robot);
        posture.set(robot, base, tool, &pose.contact, &vec![0.0; SiteIndex::new(robot.joints()).len()]);
        let tool_from_world = posture.world_from_tool(tool).rotation.inverse();
        let lever = |i: usize| tool_from_world * posture.column(Site::mdh(i, MdhEntry::Theta));
        Station { levers: (0..robot.joints()).map(lever).collect(), pose }
    }

    /// How far joint `i` steps aside, rad.
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

/// One joint arriving from both sides, the others standing.
#[derive(Debug, Clone, PartialEq)]
pub struct Reversal {
    /// Counted from 0.
    pub joint: usize,
    /// Arrived with growing angle.
    pub upwards: Return,
    /// Arrived with falling angle.
    pub downwards: Return,
}

/// What was measured at one station.
#[derive(Debug, Clone, PartialEq)]
pub struct StationRecord {
    /// The station.
    pub station: Station,
    /// Joints that the arm was sent back to, rad (N).
    pub target: Vec<f64>,
    /// Back from the approach, every joint from the same side each time.
    pub returns: Vec<Return>,
    /// The ball centred after each return, as a campaign would.
    pub centred: Vec<Centred>,
    /// Arrivals from both sides: joint after joint, and again.
    pub reversals: Vec<Reversal>,
    /// Read again and again without a motion, m.
    pub at_rest: Vec<Vector3<f64>>,
    /// How long it took on the cell's clock, s.
    pub duration_s: f64,
}

impl<M: Manipulator, I: Indicator> CenteringController<M, I> {
    /// Measures the repeatability and the lost motion of the arm at one station; `note` hears of every stop.
    ///
    /// # Errors
    /// When a probing there would fail: the ball is not met or lost, an indicator or the robot fails. The arm then stands at the
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

    /// Does something on the ball, and goes back to the approach pose whatever comes of it.
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

    /// From the approach back to the target, read; then centred.
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

    /// Every joint from both sides, one at a time; then the gauge read at rest.
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
                // Which side comes first changes from cycle to cycle: a drift then cancels in the mean.
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

    /// Goes to these joints with the ball in the gauge, and reads.
    fn arrive_at(&mut self, target: &[f64], note: &mut dyn FnMut(&Iteration)) -> Result<Return, CentringFailure> {
        self.stop(Phase::Centring, &[target.to_vec()], note, |cell, at, reading| {
            let reading = reading?;
            cell.contact(&reading)?;
            Ok(Return { joints: at.joints.clone(), reading })
        })
    }
}
