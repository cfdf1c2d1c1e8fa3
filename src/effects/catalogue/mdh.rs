//! `mdh`: link geometry that deviates from nominal. Every entry of every MDH row is proposed, and Hayati's beta if two axes
//! are nominally parallel; aliased parameters are found from the rank of the Jacobian, not listed here.
//!
//! Subscripts are the paper's: alpha_{i-1}, a_{i-1}, beta_{i-1} are in the row of joint i (Eq. 1).

use crate::effects::facts::{
    Alias, CurveShape, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::constant;
use crate::effects::{EffectId, ParameterSpec};
use crate::robot::sites::{MdhEntry, Site};
use crate::robot::{JointKind, NEARLY_PARALLEL, Robot};
use crate::units::{DEG, MM, Unit};

impl EffectId {
    /// The geometry of the links, which the description of the robot states.
    pub const MDH: &str = "mdh";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::MDH,
    arguments: "",
    name: "link geometry",
    what: "link geometry differs from the nominal one",
    equation: "alpha, a, d, theta, beta += deviation",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[],
    role: Role::Baseline,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Sizes(40.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "lengths and zeros of the arm differ from the nominal ones",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The residual changes smoothly with posture and is the same whenever the arm comes back to it.",
            "Against the angles of the joints it is slow swings, never a ripple.",
            "It is largest where the arm is stretched out and does not change with the payload.",
        ],
        parted_by: "Postures spread over the whole range of every joint; the same postures with another payload, which leave geometry as it is and move everything elastic.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, subject| {
        id.at_most(0)?;
        let sites = sites(subject.robot);
        let parameters = sites.iter().map(|&(i, entry)| describe(subject.robot, i, entry)).collect();
        let terms = sites.iter().enumerate().map(|(k, &(i, entry))| (k, Site::mdh(i, entry), 1.0)).collect();
        constant(id, parameters, terms).built()
    },
};

/// Name, nominal value and unit of an MDH entry of link `i` (counted from 0).
fn describe(robot: &Robot, i: usize, entry: MdhEntry) -> ParameterSpec {
    let mdh = &robot.links[i].mdh;
    let (name, nominal, unit, prior) = match entry {
        MdhEntry::Alpha => (format!("alpha{i}"), mdh.alpha, Unit::DEG, 0.05 * DEG),
        MdhEntry::A => (format!("a{i}"), mdh.a, Unit::MM, 0.3 * MM),
        MdhEntry::Beta => (format!("beta{i}"), mdh.beta, Unit::DEG, 0.05 * DEG),
        MdhEntry::Theta => (format!("theta{}", i + 1), mdh.theta, Unit::DEG, 0.05 * DEG),
        MdhEntry::D => (format!("d{}", i + 1), mdh.d, Unit::MM, 0.3 * MM),
    };
    ParameterSpec { name, unit, nominal, prior }
}

/// The proposed entries, in the order of Table 8: twists, lengths, offsets, joint offsets, skews. The position of a prismatic
/// axis is known from the next rows, its direction aside: its length comes last, and is only left to those data that need it.
fn sites(robot: &Robot) -> Vec<(usize, MdhEntry)> {
    let parallel = |i: usize| i > 0 && robot.links[i].mdh.alpha.sin().abs() < NEARLY_PARALLEL.sin();
    let entries = [MdhEntry::Alpha, MdhEntry::A, MdhEntry::D, MdhEntry::Theta, MdhEntry::Beta];
    let all = entries.into_iter().flat_map(|entry| (0..robot.joints()).map(move |i| (i, entry)));
    let of_slide = |&(i, entry): &(usize, MdhEntry)| entry == MdhEntry::A && robot.kind(i) == JointKind::Prismatic;
    let (last, mut first): (Vec<_>, Vec<_>) =
        all.filter(|&(i, entry)| entry != MdhEntry::Beta || parallel(i)).partition(of_slide);
    first.extend(last);
    first
}
