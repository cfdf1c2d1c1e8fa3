//! The effects that the identifier may use.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::RunChange;
use super::fleet_prior::FleetPrior;
use crate::effects::catalogue::{set_aside_by, setting_aside};
use crate::effects::error_field::ErrorField;
use crate::effects::facts::Role;
use crate::effects::family::Family;
use crate::effects::own::OwnEffect;
use crate::effects::registry::Registry;
use crate::effects::{EffectId, Subject};
use crate::measure::dataset::Dataset;
use crate::robot::Robot;

/// The posture at which the joint torques of the model are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TorquePosture {
    /// At rest in the posture given by the identified model, evaluated repeatedly until it converges: the gearbox "is
    /// modeled iteratively" (paper, section 5).
    #[default]
    Identified,
    /// In the nominal posture, once: cheaper, with an error of some thousandths of the deflection.
    Drawn,
}

/// The model: a list of effect ids, and the source of joint torques.
///
/// ```
/// use calibench::identify::Model;
///
/// let model = Model::paper().with("harmonic:2:17");
/// assert!(model.holds("harmonic:2:17") && model.holds("joint_compliance:3"));
/// // Lengths and zeros have no prior; what is added has three plausible sizes.
/// assert_eq!((model.width_of("mdh"), model.width_of("harmonic:2:17")), (f64::INFINITY, 3.0));
/// assert_eq!(model.without("harmonic:2:17"), Model::paper());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Effect ids; their order means nothing.
    pub effects: Vec<EffectId>,
    /// User-defined effects, to which `effects` may refer by name; those it does not list are offered to the diagnosis.
    pub own: Vec<OwnEffect>,
    /// Use the dataset's `tau1_nm` ... columns instead of link masses. Their sign is that of the load about +z.
    pub measured_torques: bool,
    /// Leave orientations out where the noise of the positions beside them is not stated: the ratio of the two is then a guess.
    pub only_weighed_orientations: bool,
    /// The posture for evaluating torques.
    pub torque_posture: TorquePosture,
    /// Prior width (1 sigma) of an effect, in plausible sizes of the catalogue. Effects not named here get
    /// [`BACKGROUND_WIDTH`], except those of [`Role::Baseline`], which have no prior.
    pub width: BTreeMap<String, f64>,
    /// Parameters that differ between datasets: runs of one robot in which something moved.
    pub changes: Vec<RunChange>,
    /// Prior of the arm from robots of this type; `None` without one.
    pub fleet: Option<Arc<FleetPrior>>,
    /// The field of joint errors that the effect `error_field` adds; `None` without one.
    pub field: Option<Arc<ErrorField>>,
    /// The families from which `effects` are built.
    pub registry: Registry,
}

/// Prior width (1 sigma, in plausible sizes) of an effect added to the model: shrinks an ordinary size by less than a
/// tenth, but an absurd one noticeably (decision 0011).
pub const BACKGROUND_WIDTH: f64 = 3.0;

/// Width of an excluded sample: however far off, it hardly pulls; and of a distance, of which one direction of three is seen, the
/// others are held.
const EXCLUDED_WIDTH: f64 = 30.0;

impl Model {
    /// Prior width (1 sigma) of an effect in plausible sizes; infinite if it has no prior.
    pub fn width_of(&self, effect: &str) -> f64 {
        let ordinary = match set_aside_by(effect) {
            Some(_) => EXCLUDED_WIDTH,
            None if self.is_unregularised(effect) => f64::INFINITY,
            None => BACKGROUND_WIDTH,
        };
        self.width.get(effect).copied().unwrap_or(ordinary)
    }

    /// True if an effect has no prior on its size, like those that belong to every model.
    pub fn is_unregularised(&self, effect: &str) -> bool {
        self.family(effect).is_some_and(|f| f.role == Role::Baseline)
    }

    /// True if an ordinary robot is expected to have some amount of an effect.
    pub fn is_background_width(&self, effect: &str) -> bool {
        self.family(effect).is_none_or(|f| f.role == Role::Cause || f.role == Role::AnyShape)
    }

    /// The family of an effect; `None` for a user-defined one.
    pub fn family(&self, effect: &str) -> Option<&'static Family> {
        self.registry.family(effect)
    }

    /// True if `effects` lists this id.
    pub fn lists(&self, effect: &str) -> bool {
        self.effects.iter().any(|e| e == effect)
    }

    /// True if a sample is excluded: it has a place of its own, and no longer counts.
    pub fn excludes(&self, sample: &str) -> bool {
        self.lists(&setting_aside(sample))
    }

    /// The ids of its effects, as in files.
    pub fn ids(&self) -> Vec<String> {
        self.effects.iter().map(|e| e.whole().to_owned()).collect()
    }

    /// Its effects in the order of the catalogue, which is that of the columns and of preference where the data cannot tell
    /// effects apart: the list may have any order and leaves the same results, to the last bit.
    pub(super) fn in_order(&self) -> Vec<&EffectId> {
        let place = |id: &EffectId| self.registry.families().position(|f| f.id == id.family()).unwrap_or(usize::MAX);
        let mut effects: Vec<&EffectId> = self.effects.iter().collect();
        effects.sort_by(|a, b| place(a).cmp(&place(b)).then_with(|| by_arguments(a, b)));
        effects
    }

    /// True if the model contains an effect, by its id or as a member of a whole family.
    pub fn holds(&self, effect: &str) -> bool {
        let id = EffectId::new(effect);
        self.effects.iter().any(|e| *e == id || e == id.family())
    }

    /// The subject for building the effects of this model: a robot, and the balls of an artifact in their order.
    pub fn subject<'a>(&'a self, robot: &'a Robot, balls: &'a [String]) -> Subject<'a> {
        Subject { own: &self.own, registry: &self.registry, field: self.field.as_ref(), ..Subject::new(robot, balls) }
    }

    /// The same model with an effect added.
    pub fn with(&self, effect: &str) -> Self {
        let mut model = self.clone();
        model.effects.push(effect.into());
        model
    }

    /// The same model with an effect removed.
    pub fn without(&self, effect: &str) -> Self {
        let mut model = self.clone();
        model.effects.retain(|e| e != effect);
        model.width.remove(effect);
        model
    }

    /// A model with these effects.
    pub fn of(effects: &[&str]) -> Self {
        Model {
            effects: effects.iter().map(|e| EffectId::new(e)).collect(),
            own: Vec::new(),
            measured_torques: false,
            only_weighed_orientations: false,
            torque_posture: TorquePosture::default(),
            width: BTreeMap::new(),
            changes: Vec::new(),
            fleet: None,
            field: None,
            registry: Registry::default(),
        }
    }

    /// The default model of a dataset: the paper's, without joint compliance if no link mass is known.
    pub fn default_for(dataset: &Dataset) -> Self {
        if dataset.robot.has_masses() { Model::paper() } else { Model::geometry() }
    }

    /// The paper's model: base, links, joint compliance. On the KR6 with a known tool it has 31 independent parameters.
    pub fn paper() -> Self {
        Model::geometry().with(EffectId::JOINT_COMPLIANCE)
    }

    /// The geometry alone: base and links.
    pub fn geometry() -> Self {
        Model::of(&[EffectId::BASE_FRAME, EffectId::MDH])
    }
}

/// The order of two ids of one family: argument by argument, numbers by their size and before texts.
fn by_arguments(a: &EffectId, b: &EffectId) -> Ordering {
    let number = |text: &str| text.parse::<f64>().ok();
    let pairs = a.split(':').zip(b.split(':'));
    let orders = pairs.map(|(a, b)| match (number(a), number(b)) {
        (Some(a), Some(b)) => a.total_cmp(&b),
        (Some(_), None) => Ordering::Less,
        (None, Some(_)) => Ordering::Greater,
        (None, None) => a.cmp(b),
    });
    { orders }.find(|order| order.is_ne()).unwrap_or_else(|| a.cmp(b))
}

impl Default for Model {
    fn default() -> Self {
        Model::paper()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::catalogue::CATALOGUE;

    #[test]
    fn what_is_freely_fitted_is_what_the_families_say() {
        let baseline: Vec<&str> = CATALOGUE.iter().filter(|f| f.role == Role::Baseline).map(|f| f.id).collect();
        assert_eq!(baseline, ["base_frame", "mdh", "joint_compliance"], "the paper's model");
        let model = Model::paper();
        assert!(model.is_unregularised("joint_compliance:3") && !model.is_unregularised("harmonic1:2"));
        assert!(model.holds("joint_compliance:3") && !model.holds("harmonic1:2"));
        assert_eq!((model.width_of("mdh"), model.width_of("harmonic1:2")), (f64::INFINITY, BACKGROUND_WIDTH));
    }
}
