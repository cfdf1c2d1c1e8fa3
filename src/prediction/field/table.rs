//! The correction as a table: coefficients of a finite basis, small enough for a calibration file.

use serde::{Deserialize, Serialize};

use super::basis::{Group, Kind};
use super::campaign::{Campaign, There};
use super::rows::Coefficients;

/// Coefficients are rounded to this, rad: a nanometre at an arm's length.
const ROUNDING: f64 = 1e-9;

/// Functions of one group, with a coefficient each, rad.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Term {
    pub group: Group,
    /// In the order of [`Group::write`], in nanoradians.
    pub nrad: Vec<i32>,
}

/// What corrects a robot beside its parameters and the effects of the catalogue: errors of its joints' angles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Table {
    /// Root mean square load of each joint by which loads are divided, N·m.
    pub load: Vec<f64>,
    pub terms: Vec<Term>,
}

impl Table {
    /// The table of these coefficients; groups whose coefficients are all nothing are left out.
    pub(super) fn of(campaign: &Campaign, coefficients: &Coefficients) -> Self {
        let groups = &campaign.groups;
        let of_joints = groups.all.iter().enumerate().filter(|(_, group)| group.kind() != Kind::Effect);
        let term = |(g, group): (usize, &Group)| {
            let own = groups.part(g, coefficients);
            let nrad = own.iter().zip(group.scales()).map(|(b, scale)| (b * scale / ROUNDING).round() as i32).collect();
            Term { group: *group, nrad }
        };
        let is_something = |term: &Term| term.nrad.iter().any(|c| *c != 0);
        Table { load: campaign.basis.load.clone(), terms: of_joints.map(term).filter(is_something).collect() }
    }

    /// Error of every joint's angle at joint angles `q` (rad) and loads `tau` (N·m), rad: what to add to the angle that the
    /// controller shows.
    pub fn errors(&self, q: &[f64], tau: &[f64]) -> Vec<f64> {
        let mut errors = vec![0.0; self.load.len()];
        let mut functions = Vec::new();
        for Term { group, nrad } in &self.terms {
            let (Group::Curve { joint, .. } | Group::Angles { joint, .. } | Group::Load { joint, .. }) = *group else {
                continue;
            };
            functions.clear();
            functions.resize(nrad.len(), 0.0);
            group.write(q, tau, &self.load, &mut functions);
            errors[joint] += functions.iter().zip(nrad).map(|(f, c)| f * ROUNDING * f64::from(*c)).sum::<f64>();
        }
        errors
    }
}

/// What a share of the correction is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// An effect of the catalogue, by its index in the library.
    Effect(usize),
    /// A joint by its own angle.
    Curve { joint: usize },
    /// A joint by two angles.
    Angles { joint: usize, of: [usize; 2] },
    /// A joint by its load and an angle.
    Load { joint: usize, angle: usize },
}

impl Part {
    fn of(group: Group) -> Self {
        match group {
            Group::Effect(k) => Part::Effect(k),
            Group::Curve { joint, .. } => Part::Curve { joint },
            Group::Angles { joint, of } => Part::Angles { joint, of },
            Group::Load { joint, angle } => Part::Load { joint, angle },
        }
    }
}

/// Shares of what the groups move at given postures, the largest first: inner product of each with the sum of all, over the square
/// of that. They sum to 1; what another part undoes has a negative one.
pub(super) fn shares(campaign: &Campaign, there: &There, coefficients: &Coefficients) -> Vec<(Part, f64)> {
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
    let mut all: Vec<(Part, f64)> = Vec::new();
    for (group, own) in groups.all.iter().zip(&each) {
        let (part, share) = (Part::of(*group), own.dot(&sum) / square);
        match all.iter_mut().find(|(known, _)| *known == part) {
            Some((_, known)) => *known += share,
            None => all.push((part, share)),
        }
    }
    all.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    all
}
