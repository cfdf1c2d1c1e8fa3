//! `lumped_gravity:J`: joint J deflects under gravity, the masses of the links being unknown: `theta_J += sum_{k >= J} z_J
//! . ((a_k x_k + b_k y_k) x g/|g|)`, x_k and y_k being axes of frame k.
//!
//! The first moment of everything carried by joint J is a sum of vectors, each constant in the frame of one link from J on.
//! A component along an axis z_k is also constant in the preceding frame, and counted there: two parameters per link
//! remain, and these are independent on any arm.

use crate::effects::ParameterSpec;
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
};
use crate::effects::family::each_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, theta};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "lumped_gravity",
    arguments: ":J",
    name: "deflection of {joint} under gravity, masses unknown",
    what: "a joint gives way, masses unknown",
    equation: "theta_J += z_J . (moments x g), by link",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Load],
    role: Role::Event,
    offered: Offered::WithoutMasses,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.01),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "a gearbox gives way to the weight of what hangs on it, as far as that can be known without the masses of the links",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The tool hangs low where the arm reaches out, as if a joint were soft.",
            "Against the angle of the joint it is one swing per turn, highest where the link lies level.",
            "It is the substitute for compliance when the masses of the links are unknown.",
        ],
        parted_by: "Known link masses in the robot's description, or a second payload whose mass is known.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: each_joint,
    build: |id, subject| {
        id.at_most(1)?;
        let (j, n) = (id.joint(0, subject)?, subject.robot.joints());
        let plausible = |k: usize| if 2 * j < n { LARGE } else { SMALL } * 0.5f64.powi((k - j) as i32);
        let name = |k: usize, axis: &str| format!("{}.link{}_{axis}", id.whole(), k + 1);
        let parameters =
            (j..n).flat_map(|k| ["x", "y"].map(|axis| ParameterSpec::new(name(k, axis), Unit::URAD, plausible(k))));
        Shape::new(id, parameters.collect(), move |at, emit| {
            let (axis, _) = at.posture.joint_axis(j);
            let Some(down) = at.gravity.try_normalize(0.0) else { return };
            for k in j..n {
                let frame = at.posture.frame(k + 1);
                for (p, arm) in [frame.x, frame.y].iter().enumerate() {
                    emit(2 * (k - j) + p, theta(j), axis.dot(&arm.cross(&down)));
                }
            }
        })
        .built()
    },
};

/// Plausible size, rad: deflection of a joint of the first half of the arm under its own link held horizontally; each link
/// further out counts half.
const LARGE: f64 = 300.0 * URAD;
/// The same of a joint of the wrist, rad.
const SMALL: f64 = 80.0 * URAD;
