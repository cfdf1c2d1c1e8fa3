//! The unknowns of a problem, whose set-up they belong to, and the samples that they are sought from.

use nalgebra::Vector3;

use crate::effects::{Owner, ParameterSpec};
use crate::measure::{Sample, SampleSet};
use crate::robot::{Axis6, FramePose};

/// How well a parameter is known beforehand, and why it is in the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knowledge {
    /// Nothing but the data.
    Flat,
    /// Stated with a one-sigma uncertainty (SI): a certified ball or TCP, carried along so that its uncertainty is not lost.
    Stated(f64),
    /// Of ordinary size, one-sigma (SI): an effect of the catalogue, about which nothing else is known. Without that, terms that the
    /// data see faintly would take absurd sizes and do harm where nothing was measured.
    Plausible(f64),
}

impl Knowledge {
    /// One-sigma before any data, SI; infinite when nothing is known.
    pub fn sigma(self) -> f64 {
        match self {
            Knowledge::Flat => f64::INFINITY,
            Knowledge::Stated(sigma) | Knowledge::Plausible(sigma) => sigma,
        }
    }

    /// Information that it carries, 1/sigma², SI; zero when nothing is known.
    pub fn information(self) -> f64 {
        self.sigma().powi(-2)
    }
}

/// One unknown of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Unique; parameters of a set-up end in `@label` when there are several.
    pub name: String,
    /// Unit, drawing value, plausible size.
    pub spec: ParameterSpec,
    /// The effect that it belongs to.
    pub effect: String,
    /// What is known beforehand.
    pub knowledge: Knowledge,
    /// Its value where the fit starts, SI: the drawing's, but for a base that the drawing puts decimetres off.
    pub start: f64,
    /// Whose property it is.
    pub owner: Owner,
    /// The set-up that owns it, by place; for what belongs to an artifact, the first set-up of its dataset.
    pub setup: Option<usize>,
    /// Link that it belongs to, counted from 0, for parameters of one link.
    pub link: Option<usize>,
    /// Whether it acts through the joint compliances sought, and so multiplies them.
    pub through: bool,
    /// Whether it defines the world: a number of a base that nothing known in the world contradicts. It stays where it is.
    pub defines_world: bool,
}

/// Robot base and tool of one session, as drawn, and as the fit starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// What its parameters' names end in; empty when there is only one set-up.
    pub label: String,
    /// Name of its dataset.
    pub dataset: String,
    /// Name of its session; may be empty.
    pub session: String,
    /// Nominal base in the world.
    pub base: FramePose,
    /// Base that the fit starts from: the nominal one unless it is decimetres off.
    pub start: FramePose,
    /// What of the base defines the world, see [`Parameter::defines_world`].
    pub worlds_own: Vec<Axis6>,
    /// Nominal TCP frame.
    pub tool: FramePose,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// Longest time of its samples, s; `None` where times were not recorded.
    pub duration_s: Option<f64>,
}

impl Setup {
    /// Its dataset and session, which name it.
    pub fn name(&self) -> [&str; 2] {
        [&self.dataset, &self.session]
    }

    /// Whether a sample of its dataset belongs to it.
    pub(super) fn holds(&self, sample: &Sample) -> bool {
        sample.session.as_deref().map_or(self.session.is_empty(), |session| session == self.session)
    }
}

/// Which samples enter.
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
    /// Whether a sample enters.
    pub fn takes(self, sample: &Sample) -> bool {
        match self {
            Use::All => true,
            Use::Fit => sample.set == SampleSet::Fit,
            Use::Validation => sample.set == SampleSet::Validation,
        }
    }
}
