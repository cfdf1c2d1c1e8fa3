//! `wrist_coupling`: the last three joints are driven through one another, and the ratios differ from those compensated by
//! the controller: `theta_5 += k q_4`, `theta_6 += k q_4`, `theta_6 += k q_5` on an arm with six joints.

use crate::effects::ParameterSpec;
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, theta};
use crate::robot::{JointKind, Robot};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "wrist_coupling",
    arguments: "",
    name: "coupling of the wrist joints",
    what: "joints of the wrist turn those after them",
    equation: "theta_K += k q_J, the last three",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::OtherAngles],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.02),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "turning one wrist joint drags the next ones along",
        intervention: Intervention {
            work: Work::Setting,
            act: "check the coupling of the wrist entered in the controller",
            verify: "one wrist joint turned alone: the reading of the next stays",
        },
    },
    signature: Signature {
        looks: [
            "A wrist joint errs although it was not moved itself.",
            "Against the angle of the wrist joint before it the points follow a line, of which the fit has levelled the middle part.",
            "Moving the big joints changes nothing.",
        ],
        parted_by: "Wrist postures in which one joint is turned through its range while the next one stands still.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: |subject| if turning_wrist(subject.robot) { alone(subject) } else { Vec::new() },
    build: |id, subject| {
        id.at_most(0)?;
        let n = subject.robot.joints();
        if !turning_wrist(subject.robot) {
            return Err(id.wrong("needs an arm whose last three joints turn"));
        }
        let pairs = [(n - 3, n - 2), (n - 3, n - 1), (n - 2, n - 1)];
        let unit = Unit::URAD_PER_RAD;
        let name = |(from, to): (usize, usize)| format!("wrist_coupling.q{}_at_{}", from + 1, to + 1);
        let parameters = pairs.map(|pair| ParameterSpec::new(name(pair), unit, unit.to_si(100.0))).to_vec();
        Shape::new(id, parameters, move |at, emit| {
            for (k, (from, to)) in pairs.into_iter().enumerate() {
                emit(k, theta(to), at.q[from]);
            }
        })
        .built()
    },
};

/// True if the last joints are a wrist.
fn turning_wrist(robot: &Robot) -> bool {
    let n = robot.joints();
    n >= WRIST && (n - WRIST..n).all(|j| robot.kind(j) == JointKind::Revolute)
}

/// Joints of a wrist.
const WRIST: usize = 3;
