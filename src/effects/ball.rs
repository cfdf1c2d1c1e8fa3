//! `ball:B`: a ball of the artifact moved or was mis-measured. Three numbers, in the world.

use super::{Effect, EffectError, Family, Id, Needs, Owner, ParameterSpec, Situation, Subject};
use crate::robot::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family =
    Family { id: "ball", arguments: ":B", what: "a ball moved or was mis-measured", equation: "ball_B += (x, y, z)", build };

struct Ball {
    id: String,
    ball: usize,
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    let name = id.arguments.join(":");
    let ball = subject
        .balls
        .iter()
        .position(|b| *b == name)
        .ok_or_else(|| id.wrong(format!("names a ball after the colon, one of: {}", subject.balls.join(", "))))?;
    let parameters =
        ["x", "y", "z"].iter().map(|axis| ParameterSpec::new(format!("ball:{name}.{axis}"), Unit::MM, 0.04 * MM)).collect();
    Ok(Box::new(Ball { id: id.whole.into(), ball, parameters }))
}

impl Effect for Ball {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn owner(&self) -> Owner {
        Owner::Artifact
    }

    fn needs(&self) -> &[Needs] {
        &[Needs::Balls]
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64)) {
        if at.ball == Some(self.ball) {
            for k in 0..3 {
                emit(k, Site::Target(k), 1.0);
            }
        }
    }
}
