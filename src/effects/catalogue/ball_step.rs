//! `ball_step:B:T`: a ball was knocked once, T seconds into the session: `ball_B += (x, y, z)` after T, in the world.

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
    /// The ball that was knocked.
    pub const BALL_STEP: &str = "ball_step";

    /// The ball of the id, wherever it stands or is knocked: `B` of `ball:B` and of `ball_step:B:T`.
    pub fn ball_of(&self) -> Option<&str> {
        // A ball's name may contain colons: the time is the part after the last one.
        let knocked = self.rest().filter(|_| self.family() == EffectId::BALL_STEP);
        self.ball_name().or_else(|| Some(knocked?.rsplit_once(':')?.0))
    }
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::BALL_STEP,
    arguments: ":B:T",
    name: "ball {name} knocked {time}",
    what: "a ball was knocked once",
    equation: "ball_B += (x, y, z) after T",
    origin: Origin::Artifact,
    scan: Scan::Time,
    follows: &[Follows::Ball, Follows::Time],
    role: Role::Event,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.1),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "one ball was knocked in the course of the campaign",
        intervention: Intervention {
            work: Work::Artifact,
            act: "look at that ball: a loose seat, a collision; measure it again, or leave out what was probed on it before",
            verify: "the ball probed again agrees with its certificate",
        },
    },
    signature: Signature {
        looks: [
            "One ball is right in the first part of the campaign and off in the second.",
            "Drawn over time, the samples on that ball lie on two shelves and all others on one.",
            "Before and after, the ball agrees with itself.",
        ],
        parted_by: "That ball probed again, and one neighbour: if the neighbour has moved too it was the artifact.",
    },
    stray: Stray::Moment,
    alias: Alias::OfOnlySample,
    members: each_ball,
    build: |id, subject| {
        // A ball's name may contain colons: the time is the part after the last one.
        let (ball, time) = id.rest().and_then(|rest| rest.rsplit_once(':')).ok_or_else(|| id.wrong(FORM))?;
        let unknown = || id.wrong(format!("{FORM}, the ball being one of: {}", subject.balls.join(", ")));
        let ball = subject.balls.iter().position(|b| b == ball).ok_or_else(unknown)?;
        let time = EffectId::new(&format!("ball_step:{time}")).time(0).map_err(|_| id.wrong(FORM))?;
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.1 * MM), move |at, emit| {
            if at.ball() == Some(ball) && at.is_after(time) {
                (0..3).for_each(|k| emit(k, Site::target(k), 1.0));
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Time, Needs::Balls])
        .built()
    },
};

const FORM: &str = "names a ball, and after another colon seconds since the session began";
