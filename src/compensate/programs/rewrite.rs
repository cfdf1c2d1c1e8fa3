//! The positions of programs, compensated, in the places of the old ones.

use super::configuration::{Meant, posture_of};
use super::numbers::{Edit, Meaning, meaning, turns_change};
use super::program::{Dialect, Program};
use super::scan::{Configuration, Frame, Layout, Position, Remark, Scan, Setting};
use crate::compensate::conditions::Conditions;
use crate::compensate::{Compensator, Desired, Fake, Target};
use crate::robot::FramePose;
use crate::units::{DEG, MM};

/// Read back, a position leads to its joints to this angle, rad.
const SAME_JOINTS: f64 = 1e-6 * DEG;

/// Frames of a program nearer to each other than this (m, rad) are the same: programs have three decimals.
const SAME_FRAME: [f64; 2] = [0.05 * MM, 0.02 * DEG];

/// Changes that are permitted in a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Permissions {
    /// Joint positions of FANUC's programs count joints as the robot file does: joint 3 by itself, not with joint 2.
    pub joints_as_in_robot_file: bool,
}

/// A position with its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Rewritten {
    /// Line, counted from 1.
    pub line: usize,
    /// Its name, or the instruction that has it.
    pub name: String,
    /// The desired position.
    pub target: Target,
    /// The target commanded instead.
    pub fake: Fake,
}

/// A program with its positions compensated.
#[derive(Debug, Clone, PartialEq)]
pub struct RewrittenProgram {
    /// The content of the file: the old one, with other numbers.
    pub bytes: Vec<u8>,
    /// Number of positions found.
    pub positions: usize,
    /// Those that were rewritten.
    pub rewritten: Vec<Rewritten>,
    /// Statements that were not rewritten, or are right only under a condition, by line.
    pub remarks: Vec<Remark>,
    /// Assumptions made, one sentence each.
    pub assumed: Vec<String>,
}

impl RewrittenProgram {
    /// True if no position stays uncompensated.
    pub fn is_whole(&self) -> bool {
        !self.remarks.iter().any(|remark| remark.blocks)
    }
}

/// Rewrites programs that belong together, all of one dialect.
pub fn rewrite_programs(
    programs: &[Program],
    compensator: &mut Compensator<'_>,
    permissions: &Permissions,
) -> Vec<RewrittenProgram> {
    let Some(dialect) = programs.first().map(|p| p.dialect) else { return Vec::new() };
    let scans = dialect.scan(programs, permissions.joints_as_in_robot_file);
    programs.iter().zip(scans).map(|(program, scan)| rewrite(program, scan, compensator)).collect()
}

fn rewrite(program: &Program, mut scan: Scan, compensator: &mut Compensator<'_>) -> RewrittenProgram {
    let settings = std::mem::take(&mut scan.settings);
    settings.iter().for_each(|setting| check_frame(setting, compensator, &mut scan));
    let positions = std::mem::take(&mut scan.positions);
    let (mut edits, mut rewritten, mut unmapped) = (Vec::new(), Vec::new(), Vec::new());
    for position in &positions {
        match compensate(position, compensator, &mut unmapped) {
            Ok((target, fake)) => {
                let new = position.edits(&fake);
                check_back(position, &new, &fake, compensator, &mut scan);
                edits.extend(new);
                rewritten.push(Rewritten { line: position.line, name: position.name.clone(), target, fake });
            }
            Err((reason, remedy)) => scan.refuse(position.line, position.name.as_str(), &reason, remedy),
        }
    }
    scan.remarks.sort_by_key(|remark| remark.line);
    let joints = positions.iter().any(|p| matches!(p.layout, Layout::Degrees | Layout::Radians));
    RewrittenProgram {
        bytes: replaced(&program.bytes, edits),
        positions: positions.len() + scan.unread,
        rewritten,
        assumed: assumed(program.dialect, joints, &settings, &unmapped),
        remarks: scan.remarks,
    }
}

fn assumed(dialect: Dialect, joints: bool, settings: &[Setting], unmapped: &[usize]) -> Vec<String> {
    let mut sentences = Vec::new();
    let set = |frame| settings.iter().any(|s| s.frame == frame);
    if !set(Frame::Tool) {
        sentences.push("every position is of the tool above".to_owned());
    }
    if !set(Frame::Base) {
        sentences.push("every pose is in the base frame above".to_owned());
    }
    if joints {
        sentences.push("joint positions count joints as the robot file does, in zero and direction".to_owned());
    }
    if matches!(dialect, Dialect::Krl | Dialect::Rapid) {
        sentences.push("external axes carry neither the robot nor the work".to_owned());
    }
    if let Some(first) = unmapped.first() {
        let count = unmapped.len();
        sentences.push(format!(
            "of {count} positions (the first in line {first}) the posture is the one nearest to the position before, because their configuration says nothing that this arm has"
        ));
    }
    sentences
}

/// Refuses a program that sets another tool or base than the one compensated for.
fn check_frame(setting: &Setting, compensator: &Compensator<'_>, scan: &mut Scan) {
    let (name, option, own) = match setting.frame {
        Frame::Tool => ("tool", "--tool", compensator.flange_from_tool()),
        Frame::Base => ("base", "--base", compensator.base_link_from_work()),
    };
    let apart = own.inverse() * setting.pose;
    let [position, angle] = SAME_FRAME;
    if apart.translation.vector.norm() > position || apart.rotation.angle() > angle {
        let FramePose { xyz, rz_ry_rx } = FramePose::from_pose(&setting.pose);
        let numbers = xyz.map(|v| v / MM).into_iter().chain(rz_ry_rx.map(|v| v / DEG));
        let numbers: Vec<String> = numbers.map(|v| format!("{}", (v * 1e6).round() / 1e6 + 0.0)).collect();
        let reason = format!("the program sets another {name} than the one compensated for");
        let remedy = format!("give {option}={}, if all positions are in it; otherwise split the program", numbers.join(","));
        scan.refuse(setting.line, name, &reason, &remedy);
    }
}

type Refused = (String, &'static str);

fn compensate(
    position: &Position,
    compensator: &mut Compensator<'_>,
    unmapped: &mut Vec<usize>,
) -> Result<(Target, Fake), Refused> {
    const CHECK: &str = "check the position, the robot, --tool and --base";
    let meaning = position.meaning().map_err(|reason| (reason.to_owned(), "correct its numbers"))?;
    let joints = compensator.calibration().robot.joints();
    let desired = match meaning {
        Meaning::Joints(q) if q.len() != joints => {
            let reason = format!("it has {} joints, and the robot {joints}", q.len());
            return Err((reason, "check that this is the robot of the calibration"));
        }
        Meaning::Joints(q) => Desired::Joints(q),
        Meaning::Pose(pose) => {
            let meant = posture_of(compensator, &pose, &position.configuration);
            let near = match meant.map_err(|refusal| (refusal.to_string(), CHECK))? {
                Meant::Joints(q) => Some(q).filter(|q| q.len() == joints),
                Meant::Default => None,
                Meant::Unmapped => {
                    unmapped.push(position.line);
                    None
                }
            };
            Desired::Pose { pose, near, status: None, turn: None }
        }
    };
    let target = Target { id: position.name.clone(), desired, payload: None, conditions: Conditions::default() };
    match compensator.compensate(&target).outcome {
        // Makers' manuals and other programs disagree on the joints that the three numbers count; zeros are right for all of them.
        Ok(fake) if turns_change(&position.configuration, &fake.q) => Err((
            "a joint turns over 180 deg where it is compensated, and which of the turn numbers counts it depends on the controller".into(),
            "teach it away from the half turn",
        )),
        Ok(fake) => Ok((target, fake)),
        Err(refusal) => Err((refusal.to_string(), CHECK)),
    }
}

/// Reads the new numbers back and warns if the controller would find other joints.
fn check_back(position: &Position, new: &[Edit], fake: &Fake, compensator: &mut Compensator<'_>, scan: &mut Scan) {
    let values: Vec<f64> = new.iter().take(position.numbers.len()).filter_map(|(_, text)| text.parse().ok()).collect();
    let found = match meaning(position.layout, &values) {
        Ok(Meaning::Pose(pose)) => {
            let bits = fake.status_turn.filter(|_| matches!(position.configuration, Configuration::Kuka { .. }));
            compensator.controller_joints(&pose, bits, &fake.q).ok()
        }
        Ok(Meaning::Joints(q)) => Some(q),
        Err(_) => None,
    };
    let off = found.map(|q| q.iter().zip(&fake.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
    if off.is_none_or(|off| off > SAME_JOINTS) {
        let reason = "near a singularity: the numbers written lead to other joints than those computed, by more than 1e-6 deg";
        scan.warn(position.line, position.name.as_str(), reason, "give a joint position there");
    }
}

/// The file with some of its bytes replaced.
fn replaced(bytes: &[u8], mut edits: Vec<Edit>) -> Vec<u8> {
    edits.sort_by_key(|(at, _)| at.start);
    let mut new = Vec::with_capacity(bytes.len() + 8 * edits.len());
    let mut end = 0;
    for (at, text) in edits {
        new.extend_from_slice(&bytes[end..at.start]);
        new.extend_from_slice(text.as_bytes());
        end = at.end;
    }
    new.extend_from_slice(&bytes[end..]);
    new
}
