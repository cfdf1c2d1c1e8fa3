//! The field of joint errors in words: whether it is used, and of what it consists.

use calibench::effects::registry::Registry;
use calibench::prediction::field::{Condition, FieldPart, FieldShare, Gate, Matter, Parting};
use calibench::selection::recommend::FieldChoice;
use calibench::units::MM;

use super::effect_names::called;

/// Parts of a correction that are named.
const NAMED: usize = 3;

/// Share of a correction below which a part is not named.
const WORTH_A_WORD: f64 = 0.05;

/// A condition that does not hold, in a clause.
fn failing(condition: &Condition) -> String {
    let Condition { found, limit, .. } = *condition;
    let parts = |parting: Parting| format!("{} {}", parting.count, parting.division.words());
    match condition.matter {
        Matter::OwnRatio => {
            format!(
                "by its own uncertainty it would leave {found:.2} of the error at these poses, and less than {limit:.2} is required"
            )
        }
        Matter::Sigmas(parting) if found.is_nan() => format!("there are too few postures for {}", parts(parting)),
        Matter::Sigmas(parting) => {
            format!("the gain in {} is {found:.1} standard errors, and more than {limit:.0} is required", parts(parting))
        }
        Matter::Gain(parting) => format!(
            "in {}, which are as far from each other as these poses are from the data, it makes the squared error {:.0} % larger",
            parts(parting),
            -100.0 * found
        ),
        Matter::Leverage => format!(
            "these poses are too far from the data: the uncertainty of the prediction there is {found:.1} times the noise, and at most {limit:.0} times is allowed"
        ),
        Matter::ChanceOfHarm => {
            format!(
                "it would make the error larger there with a probability of {:.0} %, and at most {:.0} % is allowed",
                100.0 * found,
                100.0 * limit
            )
        }
        Matter::DrawnRatio => {
            format!("it is expected to leave {found:.2} of the error there, and at most {limit:.2} is allowed")
        }
        _ => "a condition does not hold".into(),
    }
}

/// The reason why a field is not used, with the measurement that may change that; `None` if it is used.
pub(super) fn unused_sentence(gate: &Gate) -> Option<String> {
    let why = gate.conditions.iter().find(|condition| !condition.holds())?;
    Some(format!(
        "A field of joint errors was tried and is not used: {}. A few measured postures where the robot is to work may change that.",
        failing(why)
    ))
}

fn part(registry: &Registry, part: &FieldPart) -> String {
    match part {
        FieldPart::Effect(effect) => called(registry, effect),
        FieldPart::Curve { joint } => format!("joint {} by its own angle", joint + 1),
        FieldPart::Angles { joint, of: [a, b] } => {
            format!("joint {} by the angles of joints {} and {}", joint + 1, a + 1, b + 1)
        }
        FieldPart::Load { joint, angle } => format!("joint {} by its load and the angle of joint {}", joint + 1, angle + 1),
        _ => "another part".into(),
    }
}

/// What a field consists of, the largest parts first.
pub(super) fn shares_sentence(registry: &Registry, field: &FieldChoice) -> String {
    let of = |share: &FieldShare| format!("{} ({:.0} %)", part(registry, &share.part), 100.0 * share.share);
    let named: Vec<String> = field.shares.iter().take(NAMED).filter(|s| s.share > WORTH_A_WORD).map(of).collect();
    let [before, after] = field.expected.map(|x| x / MM);
    let parts = if named.is_empty() { "many small parts".into() } else { named.join(", ") };
    format!(
        "At these poses {before:.3} mm are expected without it and {after:.3} mm with it, noise included; it consists mainly of {parts}."
    )
}
