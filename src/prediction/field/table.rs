//! The correction as it is kept, and its shares.

use super::basis::{Group, scales};
use super::campaign::{Campaign, There};
use super::rows::Coefficients;
use crate::diagnosis::Examination;
use crate::effects::error_field::{COEFFICIENT, ErrorField, FieldTerm, JointFunctions, SizedEffect};
use crate::effects::{EffectId, Owner};

/// Effects below this are left out, in plausible sizes: they move nothing.
const LEAST_SIZE: f64 = 1e-4;

/// Effects of the set-up below this are left out, in plausible sizes: an ordinary set-up has as much.
const LEAST_BESIDE: f64 = 0.1;

/// The joint errors, and the effects of the arm, of these coefficients; groups whose coefficients are all nothing are left
/// out.
pub(super) fn kept(campaign: &Campaign, examination: &Examination, coefficients: &Coefficients) -> ErrorField {
    let groups = &campaign.groups;
    let (mut terms, mut effects) = (Vec::new(), Vec::new());
    for (g, group) in groups.all.iter().enumerate() {
        let own = groups.part(g, coefficients);
        match *group {
            Group::Joint(functions) => {
                let nrad = own.iter().zip(scales(functions)).map(|(b, scale)| (b * scale / COEFFICIENT).round() as i32);
                terms.push(FieldTerm { functions, nrad: nrad.collect() });
            }
            Group::Effect(k) if is_of_arm(examination, k) && own.iter().any(|size| size.abs() > LEAST_SIZE) => {
                let effect = examination.library.candidates[k].id.clone();
                effects.push(SizedEffect { effect, sizes: own.iter().copied().collect() });
            }
            Group::Effect(_) => {}
        }
    }
    terms.retain(|term| term.nrad.iter().any(|c| *c != 0));
    let width = |(&p, [sigma, _]): (&usize, &[f64; 2])| {
        let parameter = &examination.problem.parameters()[p];
        let is_free = parameter.owner == Owner::Robot && parameter.knowledge.information() == 0.0;
        is_free.then(|| (parameter.spec.name.clone(), sigma / parameter.spec.prior))
    };
    let widths = examination.fit.kept.iter().zip(&campaign.priors).filter_map(width).collect();
    ErrorField { load: campaign.basis.load.clone(), terms, effects, widths, ..ErrorField::default() }
}

/// Effects that are fitted beside the field, each with its one-sigma in plausible sizes: those of the set-up, which move the
/// campaign and not the arm.
pub(super) fn beside(
    campaign: &Campaign,
    examination: &Examination,
    coefficients: &Coefficients,
    sizes: &[f64],
) -> Vec<(EffectId, f64)> {
    let of = |(g, group): (usize, &Group)| {
        let Group::Effect(k) = *group else { return None };
        let own = campaign.groups.part(g, coefficients);
        let size = (own.norm_squared() / own.len().max(1) as f64).sqrt();
        let is_beside = size > LEAST_BESIDE && !is_of_arm(examination, k);
        is_beside.then(|| (examination.library.candidates[k].id.clone(), sizes[g].sqrt()))
    };
    campaign.groups.all.iter().enumerate().filter_map(of).collect()
}

/// True if a candidate belongs to the arm alone.
fn is_of_arm(examination: &Examination, candidate: usize) -> bool {
    let Some(first) = examination.columns.get(examination.spans[candidate].first) else { return false };
    examination.wide.parameters()[first.parameter].owner == Owner::Robot
}

/// What a share of the correction is of. Joints are counted from 0.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum FieldPart {
    /// An effect of the catalogue.
    Effect(EffectId),
    /// A joint by its own angle.
    Curve {
        /// The joint that errs.
        joint: usize,
    },
    /// A joint by two angles.
    Angles {
        /// The joint that errs.
        joint: usize,
        /// The joints whose angles it follows.
        of: [usize; 2],
    },
    /// A joint by its load and an angle.
    Load {
        /// The joint that errs.
        joint: usize,
        /// The joint whose angle it follows as well.
        angle: usize,
    },
}

/// A part of the correction.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldShare {
    /// The part.
    pub part: FieldPart,
    /// Its share of the squared correction; negative if it undoes what others do.
    pub share: f64,
}

/// The part to which a group belongs.
fn part(group: Group, examination: &Examination) -> FieldPart {
    match group {
        Group::Effect(k) => FieldPart::Effect(examination.library.candidates[k].id.clone()),
        Group::Joint(JointFunctions::Curve { joint, .. }) => FieldPart::Curve { joint },
        Group::Joint(JointFunctions::Angles { joint, of }) => FieldPart::Angles { joint, of },
        Group::Joint(JointFunctions::Load { joint, angle }) => FieldPart::Load { joint, angle },
    }
}

/// Shares of what the groups move at given postures, the largest first: inner product of each with the sum of all, over the square
/// of that. They sum to 1; what another part undoes has a negative one.
pub(super) fn shares(
    campaign: &Campaign,
    examination: &Examination,
    there: &There,
    coefficients: &Coefficients,
) -> Vec<FieldShare> {
    let groups = &campaign.groups;
    let moved = |g: usize| match groups.place(g) {
        Some((joint, span)) => there.rows.applied_part(joint, span, coefficients),
        None => {
            let span = &groups.effects[g];
            there.rows.effects.columns(span.start, span.len()) * groups.part(g, coefficients)
        }
    };
    let each: Vec<_> = (0..groups.all.len()).map(moved).collect();
    let mut sum = nalgebra::DVector::zeros(there.rows.count());
    each.iter().for_each(|own| sum += own);
    let square = sum.norm_squared();
    if square == 0.0 {
        return Vec::new();
    }
    let mut all: Vec<FieldShare> = Vec::new();
    for (group, own) in groups.all.iter().zip(&each) {
        let one = FieldShare { part: part(*group, examination), share: own.dot(&sum) / square };
        match all.iter_mut().find(|known| known.part == one.part) {
            Some(known) => known.share += one.share,
            None => all.push(one),
        }
    }
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}
