//! Common implementation of an effect: its id, its parameters, its requirements, and its equation as a closure.

use nalgebra::Vector3;

use super::situation::Situation;
use super::{Effect, EffectError, EffectId, Emit, Needs, Owner, ParameterSpec};
use crate::robot::sites::{MdhEntry, Site};
use crate::robot::{JointKind, Robot};

/// An effect defined by a closure.
pub(super) struct Shape<F> {
    id: String,
    parameters: Vec<ParameterSpec>,
    owner: Owner,
    needs: &'static [Needs],
    constant: Option<Vec<(usize, Site, f64)>>,
    terms: F,
}

impl<F: Fn(&Situation<'_>, &mut Emit<'_>) + Send + Sync + 'static> Shape<F> {
    /// An effect of the arm that requires no columns.
    pub fn new(id: &EffectId, parameters: Vec<ParameterSpec>, terms: F) -> Self {
        Shape { id: id.whole().into(), parameters, owner: Owner::Robot, needs: &[], constant: None, terms }
    }

    /// Sets the owner.
    pub fn owner(self, owner: Owner) -> Self {
        Shape { owner, ..self }
    }

    /// Sets the required columns.
    pub fn needs(self, needs: &'static [Needs]) -> Self {
        Shape { needs, ..self }
    }

    /// Returns the boxed effect.
    pub fn built(self) -> Result<Box<dyn Effect>, EffectError> {
        Ok(Box::new(self))
    }
}

impl<F: Fn(&Situation<'_>, &mut Emit<'_>) + Send + Sync> Effect for Shape<F> {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn owner(&self) -> Owner {
        self.owner
    }

    fn needs(&self) -> &[Needs] {
        self.needs
    }

    fn constant(&self) -> Option<&[(usize, Site, f64)]> {
        self.constant.as_deref()
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>) {
        (self.terms)(at, emit);
    }
}

/// An effect whose terms (parameter, site, weight) are the same in every situation.
pub(super) fn constant(
    id: &EffectId,
    parameters: Vec<ParameterSpec>,
    terms: Vec<(usize, Site, f64)>,
) -> Shape<impl Fn(&Situation<'_>, &mut Emit<'_>) + Send + Sync + 'static> {
    let all = terms.clone();
    let emit_all =
        move |_: &Situation<'_>, emit: &mut Emit<'_>| all.iter().for_each(|&(k, site, weight)| emit(k, site, weight));
    Shape { constant: Some(terms), ..Shape::new(id, parameters, emit_all) }
}

/// An effect of the same form on each of `joints` (counted from 0): `parameters(j, "family:J")` returns the parameters of
/// joint j, the same number for each; `terms(at, j, emit)` numbers them from 0.
pub(super) fn per_joint<F>(
    id: &EffectId,
    joints: Vec<usize>,
    parameters: impl Fn(usize, &str) -> Vec<ParameterSpec>,
    terms: F,
) -> Shape<impl Fn(&Situation<'_>, &mut Emit<'_>) + Send + Sync + 'static>
where
    F: Fn(&Situation<'_>, usize, &mut Emit<'_>) + Send + Sync + 'static,
{
    let family = id.family();
    let all: Vec<ParameterSpec> = joints.iter().flat_map(|&j| parameters(j, &format!("{family}:{}", j + 1))).collect();
    let each = all.len() / joints.len().max(1);
    Shape::new(id, all, move |at, emit| {
        for (k, &j) in joints.iter().enumerate() {
            terms(at, j, &mut |parameter, site, weight| emit(k * each + parameter, site, weight));
        }
    })
}

/// Shifts the TCP by a vector of the last frame, m, for an error of a ball or an indicator.
pub(super) fn shift_tool(parameter: usize, by: &Vector3<f64>, emit: &mut Emit<'_>) {
    (0..3).for_each(|k| emit(parameter, Site::tool(k), by[k]));
}

/// The first of two for a joint that turns, the second for a prismatic one; `j` is counted from 0.
pub(super) fn by_kind<T>(robot: &Robot, j: usize, [turning, sliding]: [T; 2]) -> T {
    match robot.kind(j) {
        JointKind::Revolute => turning,
        JointKind::Prismatic => sliding,
    }
}

/// The angle of joint `j`, counted from 0.
pub(super) fn theta(j: usize) -> Site {
    Site::mdh(j, MdhEntry::Theta)
}
