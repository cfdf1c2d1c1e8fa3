//! The positions of programs, compensated, in the places of the old ones.

use super::configuration::{Meant, posture_of};
use super::frames::{Frames, Given, Lacks, Place};
use super::frames_file::NamedFrames;
use super::numbers::{Edit, Meaning, meaning, turns_change};
use super::program::{Dialect, Program};
use super::read_back::Draft;
use super::rewritten::{Rewritten, RewrittenProgram};
use super::scan::{Configuration, Position, Scan, is_of_name};
use super::stretches::{Step, Stretches, step};
use super::world::{stand, tell_height};
use calibench::compensate::conditions::Conditions;
use calibench::compensate::{Compensator, Desired, Fake, Target, Warnings};
use calibench::robot::FramePose;
use calibench::units::{DEG, MM};

/// Read back, a position leads to its joints to this angle, rad.
const SAME_JOINTS: f64 = 1e-6 * DEG;

/// What is permitted in a program, and what is known of its tools and bases.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Permissions {
    /// Joint positions of FANUC's programs count joints as the robot file does: joint 3 by itself, not with joint 2.
    pub joints_as_in_robot_file: bool,
    /// External axes carry neither the robot nor the work, wherever they stand.
    pub external_axes_apart: bool,
    /// The tool of the task is the one that the programs name, whatever they call it; otherwise only where they name none.
    pub tool_given: bool,
    /// The same of the base.
    pub base_given: bool,
    /// Frames that programs name, from elsewhere.
    pub frames: NamedFrames,
}

/// Rewrites programs that belong together, all of one dialect: every position in the tool and the base that it has.
pub fn rewrite_programs(
    programs: &[Program],
    compensator: &mut Compensator<'_>,
    permissions: &Permissions,
) -> Vec<RewrittenProgram> {
    let Some(dialect) = programs.first().map(|p| p.dialect) else { return Vec::new() };
    let mut scans = scanned(dialect, programs, permissions);
    let own = [compensator.flange_from_tool(), compensator.base_link_from_work()];
    let is = [permissions.tool_given, permissions.base_given];
    let mut given = Given { is, own, listed: permissions.frames.settings() };
    stand(&mut scans, &mut given);
    let mut frames = Frames::of(&scans, given);
    let (idle, sentences) = (frames.idle(), frames.sentences());
    if let Some(first) = scans.first_mut() {
        for (word, reason) in idle {
            first.refuse(1, word, &reason, "leave it out, and give the others by the files that have them or by --frames FILE");
        }
    }
    tell_height(dialect, &mut scans, &frames, compensator);
    let mut benches = Benches { own: compensator, others: Vec::new() };
    let drafts: Vec<Draft> = (programs.iter().zip(scans).enumerate())
        .map(|(file, (program, scan))| rewrite(program, scan, file, &mut frames, &mut benches))
        .collect();
    let mut results = read_back(dialect, programs, drafts, permissions);
    for (file, remarks) in frames.remarks {
        if let Some(result) = results.get_mut(file) {
            result.remarks.extend(remarks);
        }
    }
    for result in &mut results {
        result.remarks.sort_by_key(|remark| remark.line);
        result.assumed.splice(0..0, sentences.iter().cloned());
        result.assumed.extend(dialect.assumed().map(str::to_owned));
        if dialect.has_external_axes() && permissions.external_axes_apart {
            result.assumed.push("external axes carry neither the robot nor the work".to_owned());
        }
    }
    results
}

/// The programs as they are read.
fn scanned(dialect: Dialect, programs: &[Program], permissions: &Permissions) -> Vec<Scan> {
    let mut scans = dialect.scan(programs, permissions.joints_as_in_robot_file);
    if !permissions.external_axes_apart {
        scans.iter_mut().for_each(leave_external);
    }
    scans
}

/// Reads the rewritten programs again, and withdraws each that would not be read as it was written.
fn read_back(dialect: Dialect, programs: &[Program], drafts: Vec<Draft>, permissions: &Permissions) -> Vec<RewrittenProgram> {
    let new = |(program, draft): (&Program, &Draft)| Program { bytes: draft.program.bytes.clone(), ..program.clone() };
    let new: Vec<Program> = programs.iter().zip(&drafts).map(new).collect();
    let read = scanned(dialect, &new, permissions);
    let judged = |((program, draft), read): ((&Program, Draft), &Scan)| match draft.lost(read) {
        Some(line) if !draft.written.is_empty() => draft.withdrawn(&program.bytes, line),
        _ => draft.program,
    };
    programs.iter().zip(drafts).zip(&read).map(judged).collect()
}

/// Takes out the positions at which an external axis is away from zero: it may carry the robot or the work.
fn leave_external(scan: &mut Scan) {
    let (away, stay): (Vec<Position>, Vec<Position>) =
        std::mem::take(&mut scan.positions).into_iter().partition(|p| p.external.is_some());
    scan.positions = stay;
    if let Some(Position { line, name, external: Some(axis), .. }) = away.first() {
        let count = if away.len() > 1 { format!(", here and at {} positions more", away.len() - 1) } else { String::new() };
        let reason = format!("{axis}: an external axis, which may carry the robot or the work, is away from zero{count}");
        scan.refuse(*line, name.as_str(), &reason, "give --external-axes-apart, if external axes carry neither");
    }
    scan.left.extend(away);
}

/// Compensators, one for each pair of tool and base.
struct Benches<'b, 'a> {
    own: &'b mut Compensator<'a>,
    others: Vec<([Place; 2], Compensator<'a>)>,
}

impl<'a> Benches<'_, 'a> {
    /// The compensator of this tool and base, which goes on from where the last position was.
    fn of(&mut self, places: &[Place; 2], near: Option<&[f64]>) -> Result<&mut Compensator<'a>, String> {
        let there = if *places == [Place::Own, Place::Own] {
            &mut *self.own
        } else {
            let known = self.others.iter().position(|(other, _)| other == places);
            let at = match known {
                Some(at) => at,
                None => {
                    let frame = |place: &Place| match place {
                        Place::Own => None,
                        Place::At(pose) => Some(FramePose::from_pose(pose)),
                    };
                    let other = self.own.in_frames(frame(&places[0]), frame(&places[1])).map_err(|e| e.to_string())?;
                    self.others.push((places.clone(), other));
                    self.others.len() - 1
                }
            };
            &mut self.others[at].1
        };
        if let Some(near) = near {
            there.seek_near(near);
        }
        Ok(there)
    }
}

fn rewrite(program: &Program, mut scan: Scan, file: usize, frames: &mut Frames<'_>, benches: &mut Benches<'_, '_>) -> Draft {
    let positions = std::mem::take(&mut scan.positions);
    let (mut edits, mut rewritten, mut unmapped) = (Vec::new(), Vec::<Rewritten>::new(), Vec::new());
    let mut written = Vec::new();
    let mut stretches = Stretches::default();
    let mut before: Option<[Place; 2]> = None;
    for (index, position) in positions.iter().enumerate() {
        let places = match frames.places(position, file) {
            Ok(places) => places,
            Err(Lacks::Told) => continue,
            Err(Lacks::Because(reason, _)) if position.spare => {
                stays(position, &reason, &mut scan);
                continue;
            }
            Err(Lacks::Because(reason, remedy)) => {
                stretches.tell(index, position, &reason, remedy, true);
                continue;
            }
        };
        let near = rewritten.last().map(|one| one.fake.q.as_slice());
        let compensator = match benches.of(&places, near) {
            Ok(compensator) => compensator,
            Err(reason) => {
                stretches.tell(index, position, &reason, CHECK, true);
                continue;
            }
        };
        match compensate(position, compensator, &mut unmapped) {
            Ok((target, fake, warnings)) => {
                let new = position.edits(&fake);
                if leads_elsewhere(position, &fake, compensator) {
                    stretches.tell(index, position, ELSEWHERE, "give a joint position there", false);
                } else if warnings.near_singular {
                    stretches.tell(
                        index,
                        position,
                        SINGULAR,
                        "lay the path farther from it, or cross it by a motion of joints",
                        false,
                    );
                }
                edits.extend(new);
                let one = Rewritten { line: position.line, name: position.name.clone(), target, fake, warnings };
                let last = rewritten.last().filter(|_| before.as_ref() == Some(&places));
                if let Some(Step { size, joint, angle }) = last.and_then(|last| step(last, &one)) {
                    let reason = format!(
                        "the compensation steps by {:.3} mm from the position before, where the program has no step: joint {} turns by {:.1} deg",
                        size / MM,
                        joint + 1,
                        angle / DEG
                    );
                    stretches.tell(
                        index,
                        position,
                        &reason,
                        "give the configuration of both positions, or lay the path elsewhere",
                        false,
                    );
                }
                rewritten.push(one);
                written.push(index);
                before = Some(places);
            }
            Err((reason, _)) if position.spare => stays(position, &reason, &mut scan),
            Err((reason, remedy)) => stretches.tell(index, position, &reason, remedy, true),
        }
    }
    scan.remarks.extend(stretches.remarks());
    for position in &scan.left {
        // What is not known of their frames is told once, as of all others.
        _ = frames.places(position, file);
    }
    let joints = positions.iter().any(Position::is_joints);
    let program = RewrittenProgram {
        bytes: replaced(&program.bytes, edits),
        positions: positions.len() + scan.left.len() + scan.unread,
        rewritten,
        assumed: assumed(joints, &unmapped),
        remarks: scan.remarks,
    };
    Draft { program, positions, written }
}

/// Tells of a position that need not hold: its numbers are set at run time, or no motion goes there.
fn stays(position: &Position, reason: &str, scan: &mut Scan) {
    let reason = format!("{reason}; the program sets it at run time or never goes there, and it is left as it is");
    scan.warn(position.line, position.name.as_str(), &reason, "check that it is a placeholder");
}

fn assumed(joints: bool, unmapped: &[usize]) -> Vec<String> {
    let mut sentences = Vec::new();
    if joints {
        sentences.push("joint positions count joints as the robot file does, in zero and direction".to_owned());
    }
    if let Some(first) = unmapped.first() {
        let count = unmapped.len();
        sentences.push(format!(
            "of {count} positions (the first in line {first}) the posture is the one nearest to the position before, because their configuration says nothing that this arm has"
        ));
    }
    sentences
}

/// The remedy of a position that cannot be reached.
const CHECK: &str = "check the position, the robot, --tool and --base";

type Refused = (String, &'static str);

fn compensate(
    position: &Position,
    compensator: &mut Compensator<'_>,
    unmapped: &mut Vec<usize>,
) -> Result<(Target, Fake, Warnings), Refused> {
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
    let compensated = compensator.compensate(&target);
    match compensated.outcome {
        Ok(fake) if turns_change(&position.configuration, &fake.q) && matches!(position.configuration, Configuration::Yaskawa { .. }) => Err((
            "a joint passes the border of a flag of its RCONF where it is compensated, and the header holds for other positions too".into(),
            "teach it away from the border, or give it a header RCONF of its own",
        )),
        // Makers' manuals and other programs disagree on the joints that the three numbers count; zeros are right for all of them.
        Ok(fake) if turns_change(&position.configuration, &fake.q) => Err((
            "a joint turns over 180 deg where it is compensated, and which of the turn numbers counts it depends on the controller".into(),
            "teach it away from the half turn",
        )),
        Ok(fake) => Ok((target, fake, compensated.warnings)),
        Err(refusal) => Err((refusal.to_string(), CHECK)),
    }
}

/// Told of a position whose numbers lead to other joints.
const ELSEWHERE: &str =
    "near a singularity: the numbers written lead to other joints than those computed, by more than 1e-6 deg";

/// Told of a position near a singularity.
const SINGULAR: &str =
    "near a singularity: small motions of the tool are large ones of the joints, and the path may be left between positions";

/// Reads the new numbers back; true if the controller would find other joints.
fn leads_elsewhere(position: &Position, fake: &Fake, compensator: &mut Compensator<'_>) -> bool {
    let values: Vec<f64> = position.texts(fake).iter().filter_map(|text| text.parse().ok()).collect();
    let found = match meaning(position.layout, &values) {
        Ok(Meaning::Pose(pose)) => {
            let bits = fake.status_turn.filter(|_| matches!(position.configuration, Configuration::Kuka { .. }));
            compensator.controller_joints(&pose, bits, &fake.q).ok()
        }
        Ok(Meaning::Joints(q)) => Some(q),
        Err(_) => None,
    };
    let off = found.map(|q| q.iter().zip(&fake.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
    off.is_none_or(|off| off > SAME_JOINTS)
}

/// The file with some of its bytes replaced. A number in place of `A-90` keeps apart from its key: `A90` is a name.
fn replaced(bytes: &[u8], mut edits: Vec<Edit>) -> Vec<u8> {
    edits.sort_by_key(|(at, _)| at.start);
    let mut new = Vec::with_capacity(bytes.len() + 8 * edits.len());
    let mut end = 0;
    for (at, text) in edits {
        new.extend_from_slice(&bytes[end..at.start]);
        if new.last().is_some_and(|byte| is_of_name(*byte)) && text.starts_with(|c: char| c.is_ascii_digit()) {
            new.push(b' ');
        }
        new.extend_from_slice(text.as_bytes());
        end = at.end;
    }
    new.extend_from_slice(&bytes[end..]);
    new
}
