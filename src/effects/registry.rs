//! The families known to a program: the catalogue, and those added by users of the library.

use std::fmt;

use super::catalogue::CATALOGUE;
use super::family::Family;
use super::{EffectError, Subject};

/// The families of effects available to models, fits and diagnoses: the [catalogue](CATALOGUE) unless others are added.
///
/// An added family is offered, fitted, judged and named like those of the catalogue. A [model](crate::identify::Model)
/// holds the registry from which its effects are built.
///
/// ```
/// use calibench::effects::facts::{
///     Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
/// };
/// use calibench::effects::family::{Family, Origin, Scan};
/// use calibench::effects::registry::Registry;
/// use calibench::effects::situation::Situation;
/// use calibench::effects::{Effect, Emit, ParameterSpec, Subject, build};
/// use calibench::robot::built_in;
/// use calibench::robot::sites::{MdhEntry, Site};
/// use calibench::units::Unit;
///
/// /// `cable_drag`: a cable along the arm pulls joint 1 towards its middle.
/// struct CableDrag(Vec<ParameterSpec>);
///
/// impl Effect for CableDrag {
///     fn id(&self) -> &str {
///         "cable_drag"
///     }
///     fn parameters(&self) -> &[ParameterSpec] {
///         &self.0
///     }
///     fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>) {
///         emit(0, Site::mdh(0, MdhEntry::Theta), at.q[0].tanh());
///     }
/// }
///
/// static FAMILY: Family = Family {
///     id: "cable_drag",
///     arguments: "",
///     name: "cable on joint 1",
///     what: "a cable pulls joint 1",
///     equation: "theta_1 += c tanh(q_1)",
///     origin: Origin::Arm,
///     scan: Scan::None,
///     follows: &[Follows::JointAngle],
///     role: Role::Cause,
///     offered: Offered::Always,
///     physical: Physical::Any,
///     linear_range: LinearRange::Si(5e-3),
///     period: Period::None,
///     curve: CurveShape::None,
///     meaning: Meaning {
///         physics: "a cable pulls the first joint back",
///         intervention: Intervention { work: Work::Service, act: "look at the hose package", verify: "the same postures with the hoses off" },
///     },
///     signature: Signature {
///         looks: ["Joint 1 comes short on both sides.", "Against its angle: a step at zero.", "It does not grow with the load."],
///         parted_by: "The same postures with the hose package off.",
///     },
///     stray: Stray::None,
///     alias: Alias::None,
///     members: |_| vec![String::new()],
///     build: |id, _| {
///         id.at_most(0)?;
///         Ok(Box::new(CableDrag(vec![ParameterSpec::new("cable_drag.c", Unit::URAD, 50e-6)])))
///     },
/// };
///
/// let registry = Registry::default().with(&FAMILY)?;
/// let robot = built_in("kr6_r700").ok_or("built in")?;
/// let subject = Subject { registry: &registry, ..Subject::new(&robot, &[]) };
/// assert_eq!(build("cable_drag", &subject)?.parameters()[0].name, "cable_drag.c");
/// assert!(build("cable_drag", &Subject::new(&robot, &[])).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Default)]
pub struct Registry {
    added: Vec<&'static Family>,
}

static CATALOGUE_ALONE: Registry = Registry { added: Vec::new() };

impl Registry {
    /// The catalogue and nothing else.
    pub fn catalogue() -> &'static Registry {
        &CATALOGUE_ALONE
    }

    /// Adds a family.
    ///
    /// # Errors
    /// If there already is a family with that id.
    pub fn with(mut self, family: &'static Family) -> Result<Self, EffectError> {
        if self.family(family.id).is_some() {
            return Err(EffectError::Taken { id: family.id.into() });
        }
        self.added.push(family);
        Ok(self)
    }

    /// All families: those of the catalogue in its order, then the others in order of addition.
    pub fn families(&self) -> impl Iterator<Item = &'static Family> + '_ {
        CATALOGUE.iter().chain(self.added.iter().copied())
    }

    /// The family of an id.
    pub fn family(&self, id: &str) -> Option<&'static Family> {
        let name = id.split_once(':').map_or(id, |(name, _)| name);
        self.families().find(|f| f.id == name)
    }
}

impl fmt::Debug for Registry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.families().map(|f| f.id)).finish()
    }
}

/// Compares ids: a registry cannot hold two families with one id, and families do not change.
impl PartialEq for Registry {
    fn eq(&self, other: &Self) -> bool {
        self.families().map(|f| f.id).eq(other.families().map(|f| f.id))
    }
}

/// Ids of all candidates that need no scan over orders, times or samples: the families, then the user-defined effects.
pub fn ids(subject: &Subject<'_>) -> Vec<String> {
    let own = subject.own.iter().map(|e| e.name.clone());
    subject.registry.families().flat_map(|f| f.ids(subject)).chain(own).collect()
}
