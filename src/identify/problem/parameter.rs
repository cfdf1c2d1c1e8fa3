//! The unknowns of a problem, the set-ups that own them, and the samples used to estimate them.

use nalgebra::Vector3;

use crate::effects::{EffectId, Owner, ParameterSpec};
use crate::measure::dataset::{Sample, SampleSet};
use crate::robot::FramePose;
use crate::robot::sites::Axis6;

/// Prior knowledge of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// None: determined by the data alone.
    Uninformative,
    /// Stated with a standard uncertainty (SI): a certified ball or TCP, included so that its uncertainty is not lost.
    Certified(f64),
    /// Of plausible size, 1 sigma (SI): an effect of the catalogue with no other prior. Without it, terms with low
    /// detectability would take absurd sizes and do harm where nothing was measured.
    Plausible(f64),
    /// As in robots of the same type, 1 sigma (SI): included as if it were measured.
    Fleet(f64),
}

impl Prior {
    /// 1 sigma of the prior, SI; infinite if there is none.
    pub fn sigma(self) -> f64 {
        match self {
            // What a fleet says is among the rows.
            Prior::Uninformative | Prior::Fleet(_) => f64::INFINITY,
            Prior::Certified(sigma) | Prior::Plausible(sigma) => sigma,
        }
    }

    /// Information of the prior, 1/sigma², SI; zero if there is none.
    ///
    /// ```
    /// use calibench::identify::problem::Prior;
    ///
    /// assert_eq!(Prior::Certified(0.5).information(), 4.0);
    /// assert_eq!(Prior::Uninformative.information(), 0.0);
    /// ```
    pub fn information(self) -> f64 {
        self.sigma().powi(-2)
    }
}

/// One unknown of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Unique name; parameters of a set-up end in `@label` if there are several.
    pub name: String,
    /// Unit, nominal value, plausible size.
    pub spec: ParameterSpec,
    /// The effect to which it belongs.
    pub effect: EffectId,
    /// The prior.
    pub knowledge: Prior,
    /// Its value at the start of the fit, SI: nominal, except for a base whose nominal pose is decimetres off.
    pub start: f64,
    /// Owner of the parameter.
    pub owner: Owner,
    /// Index of the set-up that owns it; for a parameter of an artifact, the first set-up of its dataset.
    pub setup: Option<usize>,
    /// True if all sessions of its dataset have it in common; `setup` is then the first of them.
    pub shared: bool,
    /// Link to which it belongs, counted from 0, for parameters of one link.
    pub link: Option<usize>,
    /// True if it acts through the unknown joint compliances, and so multiplies them.
    pub through: bool,
    /// True if it defines the world: a base component that nothing known in the world contradicts. It is not changed.
    pub defines_world: bool,
}

/// Robot base and tool of one session: nominal, and at the start of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Suffix of its parameters' names; empty if there is only one set-up.
    pub label: String,
    /// Name of its dataset.
    pub dataset: String,
    /// Name of its session; may be empty.
    pub session: String,
    /// Nominal base in the world.
    pub base: FramePose,
    /// Starting base of the fit: the nominal one unless it is decimetres off.
    pub start: FramePose,
    /// The base components that define the world, see [`Parameter::defines_world`].
    pub datum_freedoms: Vec<Axis6>,
    /// Nominal TCP frame.
    pub tool: FramePose,
    /// Rotation vector of the probe's axes relative to the tool's at the start of the fit, rad: zero unless it is decidedly
    /// turned.
    pub probe: Vector3<f64>,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// Longest time of its samples, s; `None` if times were not recorded.
    pub duration_s: Option<f64>,
}

impl Setup {
    /// Its dataset and session, which identify it.
    pub fn name(&self) -> [&str; 2] {
        [&self.dataset, &self.session]
    }

    /// True if a sample of its dataset belongs to it.
    pub(super) fn holds(&self, sample: &Sample) -> bool {
        sample.session.as_deref().map_or(self.session.is_empty(), |session| session == self.session)
    }
}

/// The samples to be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Rows of set `fit`.
    Fit,
    /// Rows of set `validation`.
    Validation,
    /// All rows.
    All,
}

impl Use {
    /// True if a sample is to be used.
    pub fn takes(self, sample: &Sample) -> bool {
        match self {
            Use::All => true,
            Use::Fit => sample.set == SampleSet::Fit,
            Use::Validation => sample.set == SampleSet::Validation,
        }
    }
}
