//! The order in which the residuals are looked at: what would make every later picture misleading comes first.

use super::views::JointVariable;
use crate::effects::facts::{Follows, Period};
use crate::effects::family::Family;

/// A step of the order: one kind of picture, and what can be ruled out once it shows nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Look {
    /// The length of every residual, in the order of measurement.
    Samples,
    /// Over time.
    Time,
    /// In the axes of the room and of the tool, set-up by set-up.
    SetUps,
    /// Ball by ball.
    Balls,
    /// Against torque and payload.
    Load,
    /// Against the side of approach, the last move, the command and the readings.
    Arrival,
    /// Against the angles of the joints.
    Angles,
    /// Folded onto one period of a joint.
    Folded,
}

impl Look {
    /// In their order.
    pub const ALL: [Look; 8] =
        [Look::Samples, Look::Time, Look::SetUps, Look::Balls, Look::Load, Look::Arrival, Look::Angles, Look::Folded];

    /// The picture, as in a heading.
    pub fn picture(self) -> &'static str {
        match self {
            Look::Samples => "The length of every residual, in the order of measurement",
            Look::Time => "The residuals over time, in the axes of the room and of the tool",
            Look::SetUps => "All residuals in the axes of the room, and in those of the tool",
            Look::Balls => "The residuals ball by ball",
            Look::Load => "Each joint against its torque, and against the payload",
            Look::Arrival => {
                "Each joint against the side from which it came, its last move and its command; the tool against the readings"
            }
            Look::Angles => "Each joint against its own angle",
            Look::Folded => "Each joint folded onto the period of its gear",
        }
    }

    /// Causes that are ruled out if the picture shows nothing.
    pub fn rules_out(self) -> &'static str {
        match self {
            Look::Samples => "a wrong ball, a bad contact, a mistyped row",
            Look::Time => "a bump, a slip, a drift, heat",
            Look::SetUps => "a wrong base, a wrong tool, a wrong zero of an indicator, a tracker that is registered wrongly",
            Look::Balls => "a ball or an artifact that is not as certified",
            Look::Load => {
                "everything that gives way: gears, bearings, links, the pedestal; and everything of another mass than entered"
            }
            Look::Arrival => "lost motion, plungers that stick, an arm that was read before it came to rest",
            Look::Angles => "gears and encoders that run out of true, wrong ratios",
            Look::Folded => "the ripple of teeth and of wave generators",
        }
    }

    /// The reason why it stands at its place in the order.
    pub fn because(self) -> &'static str {
        match self {
            Look::Samples => {
                "One bad sample bends a fit of thirty parameters, and with it every picture that follows; it costs one more measurement to be sure."
            }
            Look::Time => {
                "A campaign with an event in it is two campaigns of two robots: joined in one fit, the step appears in every view against angle or load as scatter."
            }
            Look::SetUps => {
                "A constant in the room or in the tool is one number with one cause, and the cheapest remedy of all."
            }
            Look::Balls => {
                "Each ball is probed in postures of its own, so a displaced ball looks like an error of whichever joint stands differently there."
            }
            Look::Load => {
                "Sag is the largest error of most arms that are geometrically right, and it bends the views against angle, because torque follows angle."
            }
            Look::Arrival => "Two clouds of points look like scatter in every other view.",
            Look::Angles => "What remains now belongs to one joint and depends on where it stands.",
            Look::Folded => {
                "Last, because only here does a search over many periods begin, and a search finds something in everything that the steps before have not cleared away."
            }
        }
    }

    /// The step at which a family of effects is met.
    ///
    /// ```
    /// use calibench::effects::registry::Registry;
    /// use calibench::residuals::Look;
    ///
    /// let hysteresis = Registry::catalogue().family("hysteresis").ok_or("in the catalogue")?;
    /// assert_eq!(Look::of(hysteresis), Look::Arrival);
    /// assert!(Look::Samples < Look::Arrival);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn of(family: &Family) -> Self {
        let first = family.follows.iter().map(|f| Look::at(*f));
        let event = first.clone().filter(|look| *look <= Look::Time).min();
        let ripple = family.period == Period::LastArgument;
        event.or(ripple.then_some(Look::Folded)).or_else(|| first.clone().next()).unwrap_or(Look::Angles)
    }

    fn at(follows: Follows) -> Self {
        match follows {
            Follows::Sample => Look::Samples,
            Follows::Time | Follows::Temperature => Look::Time,
            Follows::World | Follows::Tool | Follows::Point => Look::SetUps,
            Follows::Ball | Follows::PlaceInArtifact => Look::Balls,
            Follows::JointTorque | Follows::OtherTorque | Follows::Load | Follows::Payload => Look::Load,
            Follows::Approach | Follows::Commanded | Follows::LastMove | Follows::Reading | Follows::Plunger => Look::Arrival,
            Follows::JointAngle | Follows::JointAngleInProportion | Follows::OtherAngles => Look::Angles,
        }
    }

    /// The step at which a joint is drawn against a variable.
    pub(crate) fn at_variable(variable: JointVariable) -> Self {
        match variable {
            JointVariable::Time | JointVariable::Temperature => Look::Time,
            JointVariable::Torque(_) | JointVariable::Payload => Look::Load,
            JointVariable::Approach(_) | JointVariable::Lag(_) => Look::Arrival,
            JointVariable::Angle(_) => Look::Angles,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::registry::Registry;

    #[test]
    fn every_family_is_met_where_a_mechanic_would_meet_it() {
        for (id, look) in [
            ("outlier", Look::Samples),
            ("ball_step", Look::Time),
            ("base_drift", Look::Time),
            ("thermal_growth", Look::Time),
            ("tool_frame", Look::SetUps),
            ("ball", Look::Balls),
            ("pedestal", Look::Load),
            ("stiffening", Look::Load),
            ("hysteresis", Look::Arrival),
            ("harmonic1", Look::Angles),
            ("harmonic", Look::Folded),
        ] {
            assert_eq!(Look::of(Registry::catalogue().family(id).unwrap()), look, "{id}");
        }
        assert!(Look::ALL.is_sorted());
    }
}
