//! `calibench-recovery/1`, printed by `keep recover`.

use calibench::compensate::flange::flange_frame;
use calibench::robot::Robot;
use calibench::units::{DEG, MM};
use calibench_recovery::mastering::MasteringEntry;
use calibench_recovery::{FALSE_ALARM, Moved, Verdict};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::format_tag;
use crate::effect_names::enumerated;
use crate::figures::COVERS_95;

format_tag!(RecoveryFormat, "calibench-recovery/1");

/// What a crash moved, and what to enter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Recovery {
    /// `calibench-recovery/1`.
    pub format: RecoveryFormat,
    /// `nothing_moved`, `moved`, `bent_link` (do not re-master) or `unexplained`.
    pub verdict: String,
    /// What moved, in words.
    pub words: String,
    /// What to do.
    #[serde(rename = "do")]
    pub to_do: String,
    /// Share of the probability of all changes that this combination has.
    pub probability: f64,
    /// Average likelihood ratio of all changes to none; something is reported from one over `false_alarm`.
    pub ratio: f64,
    /// Probability of a report where nothing moved.
    pub false_alarm: f64,
    /// The zeros that changed.
    pub zeros: Vec<RecoveredZero>,
    /// Change of the TCP in the last frame; null if it did not move.
    pub tool: Option<RecoveredTool>,
    /// The joint behind which the link is bent, counted from 1; null if none is.
    pub bent_behind_joint: Option<usize>,
    /// True if the base, the artifact or the instrument moved.
    pub base_moved: bool,
    /// Other combinations that these touches allow.
    pub rivals: Vec<RecoveryRival>,
    /// Residual, 3-D rms, mm, if only pin, artifact or instrument stand elsewhere than before (`--instrument-moved`); not there if
    /// that does not explain the touches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elsewhere_mm: Option<f64>,
    /// Joints, counted from 1, whose zeros these touches do not show.
    pub unseen_joints: Vec<usize>,
    /// Number of touches.
    pub touches: usize,
    /// Residual of the touches under what was known before, 3-D rms, mm.
    pub before_mm: f64,
    /// The same with what moved, mm.
    pub residual_mm: f64,
}

/// A zero that changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecoveredZero {
    /// The joint, counted from 1.
    pub joint: usize,
    /// To be added to the angle that the controller shows, deg; mm of a sliding joint.
    pub change: f64,
    /// Half of its 95 % interval.
    pub within_95: f64,
    /// `deg` or `mm`.
    pub unit: String,
    /// What to enter; null without a controller.
    pub enter: Option<RecoveryEntry>,
}

/// What to enter for a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecoveryEntry {
    /// The name in the controller.
    pub name: String,
    /// The new value, or what is to be added to the present one.
    pub value: f64,
    /// Half of its 95 % interval.
    pub within_95: f64,
    /// Its unit.
    pub unit: String,
    /// True if `value` is the new value.
    pub is_new_value: bool,
    /// What the controller shows where the joint truly stands at zero, deg.
    pub shown_at_zero_deg: f64,
}

/// Change of the TCP.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecoveredTool {
    /// x, y, z in the last frame, mm.
    pub change_mm: [f64; 3],
    /// Half of their 95 % intervals, mm.
    pub within_95_mm: [f64; 3],
    /// The new TCP in the last frame, mm.
    #[serde(default)]
    pub tcp_mm: [f64; 3],
    /// The new TCP on the manufacturer's flange, mm, as the controller has it.
    #[serde(default)]
    pub on_flange_mm: [f64; 3],
}

/// Another combination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecoveryRival {
    /// In words.
    pub words: String,
    /// Its share of the probability of all changes.
    pub probability: f64,
    /// Joints of a further touch that would tell it from what is reported, deg or mm; null if none does.
    pub touch: Option<Vec<f64>>,
}

impl Recovery {
    /// From a result, with what to enter for each zero, in their order, if the controller is known.
    #[must_use]
    pub fn of(found: &calibench_recovery::Recovery, entries: &[Option<MasteringEntry>]) -> Self {
        let robot = &found.now.robot;
        let zero = |(k, z): (usize, &calibench_recovery::ZeroChange)| {
            let is_turn = robot.kind(z.joint - 1) == calibench::robot::JointKind::Revolute;
            let size = if is_turn { DEG } else { MM };
            RecoveredZero {
                joint: z.joint,
                change: z.change / size,
                within_95: COVERS_95 * z.sigma / size,
                unit: if is_turn { "deg" } else { "mm" }.into(),
                enter: entries.get(k).copied().flatten().map(|e| RecoveryEntry {
                    name: e.quantity.name(e.joint),
                    value: e.value,
                    within_95: COVERS_95 * e.sigma,
                    unit: e.quantity.unit().into(),
                    is_new_value: e.is_new_value,
                    shown_at_zero_deg: e.shown_at_zero,
                }),
            }
        };
        let rival = |r: &calibench_recovery::RivalCombination| RecoveryRival {
            words: moved_words(&r.moved),
            probability: r.probability,
            touch: r.posture.as_ref().map(|q| robot.in_columns(q)),
        };
        Recovery {
            format: RecoveryFormat::Current,
            verdict: verdict_name(found.verdict).into(),
            words: moved_words(&found.moved),
            to_do: to_do(found).into(),
            probability: found.probability,
            ratio: found.ratio,
            false_alarm: FALSE_ALARM,
            zeros: found.zeros.iter().enumerate().map(zero).collect(),
            tool: found.tool.map(|tool| RecoveredTool {
                change_mm: tool.map(|c| c.change / MM),
                within_95_mm: tool.map(|c| COVERS_95 * c.sigma / MM),
                tcp_mm: found.tcp().map(|x| x / MM),
                on_flange_mm: on_flange(robot, found.tcp()).map(|x| x / MM),
            }),
            bent_behind_joint: found.moved.bent,
            base_moved: found.moved.base,
            rivals: found.rivals.iter().map(rival).collect(),
            elsewhere_mm: found.elsewhere.map(|left| left / MM),
            unseen_joints: found.unseen(),
            touches: found.touches,
            before_mm: found.before / MM,
            residual_mm: found.after / MM,
        }
    }
}

/// A point of the last frame, m, on the manufacturer's flange, m.
fn on_flange(robot: &Robot, point: [f64; 3]) -> [f64; 3] {
    flange_frame(robot).pose().inverse().transform_point(&point.into()).coords.into()
}

/// The verdict as it stands in files.
fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingMoved => "nothing_moved",
        Verdict::Moved => "moved",
        Verdict::BentLink => "bent_link",
        _ => "unexplained",
    }
}

/// What moved, in words.
fn moved_words(moved: &Moved) -> String {
    let joints: Vec<String> = moved.zeros.iter().map(ToString::to_string).collect();
    let mut all = Vec::new();
    match joints.as_slice() {
        [] => {}
        [one] => all.push(format!("joint {one} lost its zero")),
        several => all.push(format!("joints {} lost their zeros", enumerated(several))),
    }
    if moved.tool {
        all.push("the tool moved on the flange, or was bent".into());
    }
    if moved.base {
        all.push("the base, the artifact or the instrument moved".into());
    }
    if let Some(joint) = moved.bent {
        all.push(format!("the link between joints {joint} and {} is bent", joint + 1));
    }
    if all.is_empty() { "nothing moved".into() } else { all.join("; ") }
}

/// What to do.
fn to_do(found: &calibench_recovery::Recovery) -> &'static str {
    match found.verdict {
        Verdict::BentLink | Verdict::Unexplained if found.elsewhere.is_some() => {
            "make sure first that pin, artifact and instrument stand where they stood: if one does not, nothing else moved, and nothing is to be entered; say so with --instrument-moved"
        }
        Verdict::NothingMoved => "go on with the robot as it is",
        Verdict::Moved if found.zeros.is_empty() => "enter the new TCP or frame; no joint is to be mastered",
        Verdict::Moved => "enter these zeros, and the new TCP if the tool moved; then make three touches again",
        Verdict::BentLink => "do not re-master: look at that link, and calibrate the robot again when it was mended",
        _ => "enter nothing: make the furthest touch again, or calibrate the robot again",
    }
}
