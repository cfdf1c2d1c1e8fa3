//! The fake targets as a KRL program: `NAME.src` moves to them, `NAME.dat` holds them as taught points.
//!
//! Motion is by joints, which needs neither tool nor base nor status and turn, or in straight lines from one fake pose to
//! the next.

use std::fmt::Write;

use thiserror::Error;

use super::Fake;
use crate::robot::{FramePose, Pose};
use crate::units::{DEG, MM, decimal};

/// Type of motion to a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Point to point, by joints.
    Ptp,
    /// In a straight line, by pose; by joints to the first target and wherever the status changes, which no straight line
    /// can do.
    Lin,
}

/// The reason why no program can be written.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum KrlError {
    /// The name is not valid in KRL.
    #[error("'{name}' is not a name for a KRL module: {problem}; use a letter, then letters, digits and `_`, 24 at most")]
    Name {
        /// As given.
        name: String,
        /// The problem.
        problem: &'static str,
    },
    /// The arm does not have six joints with a spherical wrist.
    #[error("KRL's E6AXIS and status are of six joints with a spherical wrist, and this arm has another build")]
    Arm,
}

/// Longest name of a module (KUKA System Software).
const LONGEST_NAME: usize = 24;

/// Words that cannot name a module.
const RESERVED: [&str; 14] =
    ["AND", "BAS", "CIRC", "DEF", "DEFDAT", "DEFFCT", "END", "EXIT", "FOR", "IF", "LIN", "LOOP", "PTP", "WHILE"];

/// A program over fake targets.
///
/// ```
/// use calibench::compensate::krl::{KrlError, KrlProgram, Motion};
/// use calibench::robot::Pose;
///
/// let frame = Pose::identity();
/// let program = KrlProgram::new("weld", Motion::Ptp, &frame, &frame, [])?;
/// assert!(program.src().contains("DEF weld ( )") && program.dat().contains("DEFDAT weld PUBLIC"));
/// // A name begins with a letter.
/// let refused = KrlProgram::new("7th", Motion::Ptp, &frame, &frame, []);
/// assert!(refused.is_err_and(|e| matches!(e, KrlError::Name { .. })));
/// # Ok::<(), KrlError>(())
/// ```
#[derive(Debug, Clone)]
pub struct KrlProgram<'a> {
    name: &'a str,
    motion: Motion,
    base: FramePose,
    tool: FramePose,
    targets: Vec<(String, &'a Fake)>,
}

impl<'a> KrlProgram<'a> {
    /// Creates a program from targets with their ids, in that order, with the controller's base frame and tool.
    ///
    /// # Errors
    /// When the name is not valid, or the arm has no status and turn.
    pub fn new(
        name: &'a str,
        motion: Motion,
        base_link_from_work: &Pose,
        flange_from_tool: &Pose,
        targets: impl IntoIterator<Item = (&'a str, &'a Fake)>,
    ) -> Result<Self, KrlError> {
        check_name(name).map_err(|problem| KrlError::Name { name: name.into(), problem })?;
        let targets: Vec<(String, &Fake)> = targets.into_iter().map(|(id, fake)| (comment(id), fake)).collect();
        if targets.iter().any(|(_, fake)| fake.status_turn.is_none()) {
            return Err(KrlError::Arm);
        }
        let (base, tool) = (FramePose::from_pose(base_link_from_work), FramePose::from_pose(flange_from_tool));
        Ok(KrlProgram { name, motion, base, tool, targets })
    }

    /// The text of `NAME.src`.
    pub fn src(&self) -> String {
        let mut lines: Vec<String> = HEAD.iter().map(|line| (*line).to_owned()).collect();
        lines.push(format!("DEF {} ( )", self.name));
        lines.extend(INITIALISED.iter().map(|line| (*line).to_owned()));
        lines.push(format!("$BASE = {{FRAME: {}}}", pose_text(&self.base)));
        lines.push(format!("$TOOL = {{FRAME: {}}}", pose_text(&self.tool)));
        let mut before = None;
        for (id, fake) in &self.targets {
            let status = fake.status_turn.map(|s| s.status);
            let straight = self.motion == Motion::Lin && before == status;
            before = status;
            lines.push(if straight {
                format!("LIN {{{}}} ; {id}", pose_text(&FramePose::from_pose(&fake.pose)))
            } else {
                format!("PTP {{{}}} ; {id}", axes_text(&fake.q))
            });
        }
        lines.push("END".into());
        text(&lines)
    }

    /// The text of `NAME.dat`.
    pub fn dat(&self) -> String {
        let mut lines: Vec<String> = HEAD.iter().map(|line| (*line).to_owned()).collect();
        lines.push(format!("DEFDAT {} PUBLIC", self.name));
        for (k, (id, fake)) in self.targets.iter().enumerate() {
            let (status, turn) = fake.status_turn.map_or((0, 0), |s| (s.status, s.turn));
            let pose = pose_text(&FramePose::from_pose(&fake.pose));
            let outer = (1..=6).fold(String::new(), |mut text, k| {
                _ = write!(text, ",E{k} 0.0");
                text
            });
            lines.push(format!("; {id}"));
            lines.push(format!("DECL E6POS XP{}={{{pose},S {status},T {turn}{outer}}}", k + 1));
        }
        lines.push("ENDDAT".into());
        text(&lines)
    }
}

/// Header of every module.
const HEAD: [&str; 4] =
    ["&ACCESS RVP", "&REL 1", "&PARAM TEMPLATE = C:\\KRC\\Roboter\\Template\\vorgabe", "&PARAM EDITMASK = *"];

/// Slow, exact stops: accurate points must not be approximated. Without the initialisation a PTP motion faults.
const INITIALISED: [&str; 12] = [
    ";FOLD INI",
    "BAS (#INITMOV,0 )",
    ";ENDFOLD (INI)",
    "$BWDSTART = FALSE",
    "PDAT_ACT = {VEL 10,ACC 100,APO_DIST 0}",
    "BAS (#PTP_DAT)",
    "FDAT_ACT = {TOOL_NO 0,BASE_NO 0,IPO_FRAME #BASE}",
    "BAS (#FRAMES)",
    "BAS (#VEL_PTP,10)",
    "$VEL.CP = 0.05",
    "$ADVANCE = 0",
    "PTP $AXIS_ACT ; block coincidence",
];

fn check_name(name: &str) -> Result<(), &'static str> {
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Err("it does not begin with a letter");
    }
    if name.chars().any(|c| !c.is_ascii_alphanumeric() && c != '_') {
        return Err("it holds something other than letters, digits and `_`");
    }
    if name.len() > LONGEST_NAME {
        return Err("it is too long");
    }
    if RESERVED.contains(&name.to_ascii_uppercase().as_str()) {
        return Err("it is a word of the language");
    }
    Ok(())
}

/// An id as a comment: on one line, in characters that a controller displays.
fn comment(id: &str) -> String {
    id.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '_' }).collect()
}

/// Joins lines with the line endings of KUKA's editor.
fn text(lines: &[String]) -> String {
    lines.iter().map(|line| format!("{line}\r\n")).collect()
}

/// A KRL real has 24 bits: 0.06 um in a metre; more decimals would be dropped.
fn pose_text(frame: &FramePose) -> String {
    let ([x, y, z], [a, b, c]) = (frame.xyz.map(|v| decimal(v / MM, 4)), frame.rz_ry_rx.map(|v| decimal(v / DEG, 5)));
    format!("X {x},Y {y},Z {z},A {a},B {b},C {c}")
}

fn axes_text(q: &[f64]) -> String {
    let axes: Vec<String> = q.iter().enumerate().map(|(i, q)| format!("A{} {}", i + 1, decimal(q / DEG, 5))).collect();
    axes.join(",")
}
