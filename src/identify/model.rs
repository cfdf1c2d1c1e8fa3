//! Which effects the identifier may use.

use std::collections::BTreeMap;

use crate::effects::{EffectId, Family, OwnEffect, Registry, Role, Subject};
use crate::measure::Dataset;
use crate::robot::Robot;

/// At which posture the joint torques of the model are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TorquePosture {
    /// At rest in the posture that the identified model gives, evaluated anew until it settles: the gearbox "is modeled
    /// iteratively" (paper, section 5).
    #[default]
    Identified,
    /// In the posture of the drawing, once: cheaper, and some thousandths of the deflection wrong.
    Drawn,
}

/// The model: a list of effect ids, and where joint torques come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Effect ids, in the order in which their parameters are preferred.
    pub effects: Vec<String>,
    /// Effects of the user's own, by whose names `effects` may call them; those that it does not call are offered to the diagnosis.
    pub own: Vec<OwnEffect>,
    /// Use the dataset's `tau1_nm` ... columns in place of link masses. Their sign is that of the load about +z.
    pub measured_torques: bool,
    /// Where torques are evaluated.
    pub torque_posture: TorquePosture,
    /// How large an effect may be, one-sigma, in plausible sizes of the catalogue. Effects not named here are held to
    /// [`ORDINARY_WIDTH`], but for those of [`Role::Baseline`], which no prior holds.
    pub width: BTreeMap<String, f64>,
    /// The families that `effects` are built from.
    pub registry: Registry,
}

/// Ids of the families of [`Role::Baseline`] in the catalogue: the paper's model.
pub const FREELY_FITTED: [&str; 3] = ["base_frame", "mdh", "joint_compliance"];

/// One-sigma, in plausible sizes, of an effect that was added to the model: an ordinary one is not shrunk by a tenth, an absurd one is.
pub const ORDINARY_WIDTH: f64 = 3.0;

impl Model {
    /// One-sigma in plausible sizes to which an effect is held; infinite when nothing holds it.
    pub fn width_of(&self, effect: &str) -> f64 {
        let ordinary = if self.is_freely_fitted(effect) { f64::INFINITY } else { ORDINARY_WIDTH };
        self.width.get(effect).copied().unwrap_or(ordinary)
    }

    /// Whether nothing holds the size of an effect, as of those that belong to every model.
    pub fn is_freely_fitted(&self, effect: &str) -> bool {
        self.family(effect).is_some_and(|f| f.role == Role::Baseline)
    }

    /// Whether an ordinary robot is expected to have a little of an effect.
    pub fn is_ordinary(&self, effect: &str) -> bool {
        self.family(effect).is_none_or(|f| f.role == Role::Cause || f.role == Role::AnyShape)
    }

    /// The family of an effect; `None` of one of the user's own.
    pub fn family(&self, effect: &str) -> Option<&'static Family> {
        self.registry.family(effect)
    }

    /// Whether it holds an effect, by its id or as a member of a whole family.
    pub fn holds(&self, effect: &str) -> bool {
        let family = EffectId::new(effect).family();
        self.effects.iter().any(|e| e == effect || e == family)
    }

    /// What the effects of this model act on: a robot, and the balls of an artifact in their order.
    pub fn subject<'a>(&'a self, robot: &'a Robot, balls: &'a [String]) -> Subject<'a> {
        Subject { own: &self.own, registry: &self.registry, ..Subject::new(robot, balls) }
    }

    /// The same model with one more effect.
    pub fn with(&self, effect: &str) -> Self {
        let mut model = self.clone();
        model.effects.push(effect.into());
        model
    }

    /// The same model with one effect less.
    pub fn without(&self, effect: &str) -> Self {
        let mut model = self.clone();
        model.effects.retain(|e| e != effect);
        model.width.remove(effect);
        model
    }

    /// A model of these effects.
    pub fn of(effects: &[&str]) -> Self {
        Model {
            effects: effects.iter().map(|e| (*e).into()).collect(),
            own: Vec::new(),
            measured_torques: false,
            torque_posture: TorquePosture::default(),
            width: BTreeMap::new(),
            registry: Registry::default(),
        }
    }

    /// The model that a dataset gets when none is named: the paper's, without joint compliance where no link mass is known.
    pub fn default_for(dataset: &Dataset) -> Self {
        if dataset.robot.has_masses() { Model::paper() } else { Model::of(&["base_frame", "mdh"]) }
    }

    /// The paper's model: base, links, joint compliance. On the KR6 with a known tool it has 31 independent parameters.
    pub fn paper() -> Self {
        Model::of(&["base_frame", "mdh", "joint_compliance"])
    }
}

impl Default for Model {
    fn default() -> Self {
        Model::paper()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::CATALOGUE;

    #[test]
    fn what_is_freely_fitted_is_what_the_families_say() {
        let baseline: Vec<&str> = CATALOGUE.iter().filter(|f| f.role == Role::Baseline).map(|f| f.id).collect();
        assert_eq!(baseline, FREELY_FITTED);
        let model = Model::paper();
        assert!(model.is_freely_fitted("joint_compliance:3") && !model.is_freely_fitted("harmonic1:2"));
        assert!(model.holds("joint_compliance:3") && !model.holds("harmonic1:2"));
        assert_eq!((model.width_of("mdh"), model.width_of("harmonic1:2")), (f64::INFINITY, ORDINARY_WIDTH));
    }
}
