//! Which effects the identifier may use.

use crate::effects::OwnEffect;
use crate::measure::Dataset;

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
}

impl Model {
    /// A model of these effects.
    pub fn of(effects: &[&str]) -> Self {
        Model {
            effects: effects.iter().map(|e| (*e).into()).collect(),
            own: Vec::new(),
            measured_torques: false,
            torque_posture: TorquePosture::default(),
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
