//! `ball:B`: a ball of the artifact moved or was mis-measured. Three parameters, in the world.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::each_ball;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

impl EffectId {
    /// The position of a ball, which a dataset states.
    pub const BALL: &str = "ball";

    /// The position of this ball.
    pub fn of_ball(name: &str) -> Self {
        EffectId::member(EffectId::BALL, name)
    }

    /// Name of the ball whose position it is.
    pub fn ball_name(&self) -> Option<&str> {
        self.rest().filter(|_| self.family() == EffectId::BALL)
    }
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::BALL,
    arguments: ":B",
    name: "position of ball {name}",
    what: "a ball moved or was mis-measured",
    equation: "ball_B += (x, y, z)",
    origin: Origin::Artifact,
    scan: Scan::None,
    follows: &[Follows::Ball],
    role: Role::Cause,
    offered: Offered::OnKnownBalls,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.1),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "one ball is not where it was certified to be",
        intervention: Intervention {
            work: Work::Artifact,
            act: "look at that ball: dirt, a loose seat, a damaged thread; measure it again",
            verify: "the ball, cleaned and tightened, probed from three postures",
        },
    },
    signature: Signature {
        looks: [
            "All samples on one ball are off in the same direction; on the other balls hardly anything is wrong.",
            "Drawn ball by ball, one lies apart from the rest.",
            "The fit spreads a part of it over the others, so the displaced ball looks less displaced than it is.",
        ],
        parted_by: "That ball on the coordinate measuring machine once more, or more postures on it; a second place of the artifact distinguishes a ball from a part of the workspace.",
    },
    stray: Stray::None,
    alias: Alias::OfOnlySample,
    members: each_ball,
    build: |id, subject| {
        let ball = id.ball(subject)?;
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.04 * MM), move |at, emit| {
            if at.ball() == Some(ball) {
                (0..3).for_each(|k| emit(k, Site::target(k), 1.0));
            }
        })
        .owner(Owner::Artifact)
        .needs(&[Needs::Balls])
        .built()
    },
};
