//! The reasons why a target was not compensated, in words and as named in files; what one that was is warned of.

/// The reason why a target was not compensated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// No posture of the arm reaches it.
    #[error("no posture of the arm reaches it")]
    Unreachable,
    /// Postures that reach it exceed a joint's limit.
    #[error("it is reached only beyond the limit of {}", .joint.map_or("a joint".into(), |j| format!("joint {}", j + 1)))]
    JointLimit {
        /// The joint, counted from 0, if it is a single one.
        joint: Option<usize>,
    },
    /// It can be reached, but not with the requested status and turn.
    #[error("no posture inside the limits has the status and turn requested")]
    NoSuchConfiguration,
    /// Compensation would change the arm's configuration, or turn a joint far round.
    #[error("compensated, the arm would stand in another configuration")]
    ConfigurationFlip,
    /// The search did not converge.
    #[error("the search did not end")]
    NotConverged,
    /// It lies inside the arm.
    #[error("it lies in the robot's own body: {body}")]
    OwnBody {
        /// The body.
        body: String,
    },
    /// An effect has no value there.
    #[error("effect '{effect}' has no value there")]
    NoValue {
        /// The effect.
        effect: String,
    },
}

impl Refusal {
    /// The name in files.
    pub fn name(&self) -> &'static str {
        match self {
            Refusal::Unreachable => "unreachable",
            Refusal::JointLimit { .. } => "joint_limit",
            Refusal::NoSuchConfiguration => "no_such_configuration",
            Refusal::ConfigurationFlip => "configuration_flip",
            Refusal::NotConverged => "not_converged",
            Refusal::OwnBody { .. } => "own_body",
            Refusal::NoValue { .. } => "no_value",
        }
    }
}

/// Warnings about a compensated target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Warnings {
    /// A joint is outside the range covered by the calibration.
    pub out_of_range: bool,
    /// Small motions of the tool require large ones of the joints; the threshold is [`NEAR_SINGULAR`](super::NEAR_SINGULAR).
    pub near_singular: bool,
}

impl Warnings {
    /// The names in files.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let named = [(self.out_of_range, "out_of_range"), (self.near_singular, "near_singular")];
        named.into_iter().filter_map(|(is, name)| is.then_some(name))
    }
}
