//! Effects that a diagnosis proposes to add to a model: of the catalogue, of the user, or of a shape found in the data.

use super::Examination;
use super::heat_map::{Curve, Variable};
use super::surfaces::Surface;
use crate::effects::EffectId;
use crate::effects::own::OwnEffect;
use crate::identify::Model;
use crate::identify::fit::FitError;
use crate::robot::Robot;

/// An effect that may be added to a model.
///
/// ```
/// use calibench::diagnosis::additions::Addition;
/// use calibench::effects::EffectId;
/// use calibench::identify::Model;
///
/// let addition = Addition::from(EffectId::new("harmonic1:2"));
/// assert!(!addition.is_shape() && addition.added_to(&Model::paper()).lists("harmonic1:2"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Addition {
    /// As the verb `add` takes it: `harmonic1:2`, `curve:3:q2`, `curve:3:q2:q4`.
    pub id: String,
    /// As a model lists it: `harmonic1:2`, `curve_3_q2`, `curve_3_q2_q4`.
    pub name: EffectId,
    /// The terms of a shape.
    own: Option<OwnEffect>,
}

impl Addition {
    /// The error of a joint, counted from 0, as a function of one variable or two; `None` if one does not vary in the data.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn shape(examination: &Examination, joint: usize, over: Over) -> Result<Option<Self>, FitError> {
        Ok(match over {
            Over::One(variable) => Curve::of(examination, joint, variable)?.as_ref().map(Addition::from),
            Over::Two(variables) => Surface::of(examination, joint, variables)?.as_ref().map(Addition::from),
        })
    }

    /// True if it is the shape of a joint's error that was found in the data, and not an effect with a cause.
    #[must_use]
    pub fn is_shape(&self) -> bool {
        self.own.is_some()
    }

    /// The model with it; a shape has a prior of the size estimated from the data.
    #[must_use]
    pub fn added_to(&self, model: &Model) -> Model {
        self.known_to(model).with(&self.name)
    }

    /// The model that knows it without containing it.
    pub(crate) fn known_to(&self, model: &Model) -> Model {
        let mut with = model.clone();
        if let Some(own) = &self.own {
            with.own.retain(|o| o.name != own.name);
            with.own.push(own.clone());
            with.width.insert(own.name.clone(), 1.0);
        }
        with
    }
}

/// What a joint's error may follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// One variable.
    One(Variable),
    /// Two at once.
    Two([Variable; 2]),
}

impl Over {
    /// Parses `q2`, `tau3`, `q2:q4`; `None` of anything else, and of a variable with itself.
    ///
    /// ```
    /// use calibench::diagnosis::additions::Over;
    /// use calibench::robot::built_in;
    ///
    /// let robot = built_in("ur5").ok_or("built in")?;
    /// assert!(matches!(Over::parse("q2:q4", &robot), Some(Over::Two(_))));
    /// assert!(matches!(Over::parse("tau2", &robot), Some(Over::One(_))));
    /// assert_eq!(Over::parse("q2:q2", &robot), None);
    /// # Ok::<(), &str>(())
    /// ```
    #[must_use]
    pub fn parse(text: &str, robot: &Robot) -> Option<Self> {
        match text.split_once(':') {
            None => Variable::parse(text, robot).map(Over::One),
            Some((one, other)) => {
                let pair = [Variable::parse(one, robot)?, Variable::parse(other, robot)?];
                (pair[0] != pair[1]).then_some(Over::Two(pair))
            }
        }
    }
}

impl std::fmt::Display for Over {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Over::One(variable) => f.write_str(&variable.name()),
            Over::Two([one, other]) => write!(f, "{}:{}", one.name(), other.name()),
        }
    }
}

impl From<EffectId> for Addition {
    fn from(id: EffectId) -> Self {
        Addition { id: id.to_string(), name: id, own: None }
    }
}

impl From<&Curve> for Addition {
    fn from(curve: &Curve) -> Self {
        let own = curve.own_effect();
        Addition { id: curve.id(), name: EffectId::new(&own.name), own: Some(own) }
    }
}

impl From<&Surface> for Addition {
    fn from(surface: &Surface) -> Self {
        let own = surface.own_effect();
        Addition { id: surface.id(), name: EffectId::new(&own.name), own: Some(own) }
    }
}
