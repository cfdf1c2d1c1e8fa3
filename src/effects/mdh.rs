//! `mdh`: links not made to the drawing. Every entry of every MDH line is proposed, and Hayati's beta where two axes are
//! nominally parallel; what the data cannot tell apart is found from the Jacobian's rank, not written here.
//!
//! Subscripts are the paper's: alpha_{i-1}, a_{i-1}, beta_{i-1} stand in the line of joint i (Eq. 1).

use super::{Effect, EffectError, Family, Id, ParameterSpec, Situation, Subject};
use crate::robot::{MdhEntry, Robot, Site};
use crate::units::{DEG, MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "mdh",
    arguments: "",
    what: "links are not made to the drawing",
    equation: "alpha_{i-1}, a_{i-1}, beta_{i-1}, theta_i, d_i += deviation",
    build,
};

/// Axes closer to parallel than this get a beta: below it, a common normal is too ill-defined to carry the error in d.
const PARALLEL: f64 = 1.0 * DEG;

struct Mdh {
    parameters: Vec<ParameterSpec>,
    sites: Vec<Site>,
}

/// Name, nominal value and unit of an MDH entry of link `i` (counted from 0).
fn describe(robot: &Robot, i: usize, entry: MdhEntry) -> ParameterSpec {
    let mdh = &robot.links[i].mdh;
    let (name, nominal, unit, prior) = match entry {
        MdhEntry::Alpha => (format!("alpha{i}"), mdh.alpha, Unit::DEG, 0.05 * DEG),
        MdhEntry::A => (format!("a{i}"), mdh.a, Unit::MM, 0.3 * MM),
        MdhEntry::Beta => (format!("beta{i}"), mdh.beta, Unit::DEG, 0.05 * DEG),
        MdhEntry::Theta => (format!("theta{}", i + 1), mdh.theta, Unit::DEG, 0.05 * DEG),
        MdhEntry::D => (format!("d{}", i + 1), mdh.d, Unit::MM, 0.3 * MM),
    };
    ParameterSpec { name, unit, nominal, prior }
}

fn build(id: &Id<'_>, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    id.at_most(0)?;
    let robot = subject.robot;
    let mut sites = Vec::new();
    // Table 8's order: twists, lengths, offsets, joint offsets, skews.
    for entry in [MdhEntry::Alpha, MdhEntry::A, MdhEntry::D, MdhEntry::Theta, MdhEntry::Beta] {
        for i in 0..robot.joints() {
            let parallel = i > 0 && robot.links[i].mdh.alpha.sin().abs() < PARALLEL.sin();
            if entry != MdhEntry::Beta || parallel {
                sites.push(Site::Mdh(i, entry));
            }
        }
    }
    let parameters = sites
        .iter()
        .map(|site| match *site {
            Site::Mdh(i, entry) => describe(robot, i, entry),
            _ => unreachable!("only MDH sites were pushed"),
        })
        .collect();
    Ok(Box::new(Mdh { parameters, sites }))
}

impl Effect for Mdh {
    fn id(&self) -> &str {
        "mdh"
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn terms(&self, _: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64)) {
        for (k, site) in self.sites.iter().enumerate() {
            emit(k, *site, 1.0);
        }
    }
}
