//! The samples of a fit as a search sees them: the columns of the places where an error may arise, and the variables.

use std::ops::Range;

use calibench::diagnosis::Examination;
use calibench::effects::own::{OwnEffect, OwnTerm};
use calibench::identify::calibration::IdentifyError;
use calibench::identify::problem::{Use, missing};
use calibench::measure::dataset::NamedDataset;
use calibench::robot::JointKind;
use calibench::units::Unit;
use nalgebra::DMatrix;

use crate::factors::Known;
use crate::variables::Variable;

/// A place where an error may arise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    /// The site, as in a model file.
    pub site: String,
    /// In words: what errs, and how.
    pub words: String,
    /// True if it turns, false if it shifts.
    pub turns: bool,
    /// The joint, from 0, if it is its angle or travel.
    pub joint: Option<usize>,
    /// True if it is one of the tool.
    pub of_tool: bool,
    /// Log of its prior against that of one place among all.
    pub ln_prior: f64,
}

/// Share of the prior of all joints, of the tool, of the links, and of the base: what moves errs more often than what is bolted.
const PRIORS: [f64; 4] = [0.5, 0.25, 0.15, 0.1];

/// The places of an arm: its joints first, since of two places that cannot be told apart the first is named.
pub(crate) fn places(joints: usize, kind: impl Fn(usize) -> JointKind) -> Vec<Place> {
    let of_joint = |j: usize| match kind(j) {
        JointKind::Revolute => Place {
            site: format!("theta:{}", j + 1),
            words: format!("joint {} turns too far", j + 1),
            turns: true,
            joint: Some(j),
            of_tool: false,
            ln_prior: 0.0,
        },
        JointKind::Prismatic => Place {
            site: format!("d:{}", j + 1),
            words: format!("joint {} travels too far", j + 1),
            turns: false,
            joint: Some(j),
            of_tool: false,
            ln_prior: 0.0,
        },
    };
    let other = |site: String, words: String, of_tool: bool| Place {
        turns: site.rsplit_once(':').is_some_and(|s| s.1.starts_with('r')),
        site,
        words,
        joint: None,
        of_tool,
        ln_prior: 0.0,
    };
    let tool = ["x", "y", "z", "rx", "ry"].into_iter().map(move |axis| {
        let does = if axis.starts_with('r') { "tilts about" } else { "shifts along" };
        other(format!("flex:{joints}:{axis}"), format!("the tool {does} {} of the flange", axis.trim_start_matches('r')), true)
    });
    let links = (1..joints).flat_map(move |k| {
        ["rx", "ry"].map(|axis| {
            other(
                format!("flex:{k}:{axis}"),
                format!("link {k} tilts about {} of its frame", axis.trim_start_matches('r')),
                false,
            )
        })
    });
    let base = ["x", "y", "z", "rx", "ry"].into_iter().map(move |axis| {
        let does = if axis.starts_with('r') { "tilts about" } else { "shifts along" };
        other(format!("base:{axis}"), format!("the base {does} {} of the world", axis.trim_start_matches('r')), false)
    });
    let groups: [Vec<Place>; 4] = [(0..joints).map(of_joint).collect(), tool.collect(), links.collect(), base.collect()];
    let count = groups.iter().map(Vec::len).sum::<usize>() as f64;
    let weighed = groups.into_iter().zip(PRIORS).flat_map(|(group, prior)| {
        let ln_prior = (prior * count / group.len().max(1) as f64).ln();
        group.into_iter().map(move |place| Place { ln_prior, ..place })
    });
    weighed.collect()
}

/// Name of the effect whose columns are those of the places.
const PLACES: &str = "discover_places";
/// Name of the effect whose columns carry the variables.
const CARRIERS: &str = "discover_carriers";

fn effect(name: &str, terms: Vec<OwnTerm>) -> OwnEffect {
    OwnEffect { name: name.into(), unit: Unit::MM, plausible: 1.0, terms }
}

fn term(site: &str, basis: String) -> OwnTerm {
    OwnTerm { site: site.into(), basis, group: None }
}

/// Whitened columns of the places, per rad or m: one row for each.
pub(crate) fn place_columns(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    places: &[Place],
) -> Result<DMatrix<f64>, IdentifyError> {
    let (turning, shifting): (Vec<usize>, Vec<usize>) = (0..places.len()).partition(|&k| places[k].turns);
    let mut columns = DMatrix::zeros(places.len(), examination.problem().row_count());
    for (unit, which) in [(Unit::DEG, turning), (Unit::MM, shifting)] {
        let terms = which.iter().map(|&k| term(&places[k].site, "1".into())).collect();
        let rows = examination.columns_of(datasets, &OwnEffect { unit, ..effect(PLACES, terms) })?;
        which.iter().enumerate().for_each(|(row, &k)| columns.row_mut(k).copy_from(&rows.row(row)));
    }
    Ok(columns)
}

/// Residuals of each sample of a fit.
pub(crate) fn spans(examination: &Examination) -> Vec<Range<usize>> {
    let mut spans = Vec::new();
    let values = &examination.fit().values;
    examination.problem().for_each_sample(values, &mut |s| spans.push(s.first_row..s.first_row + s.rows));
    spans
}

/// The variables known at every sample, with their values.
///
/// An error of the base along its axes moves every sample alike: where its size is a variable, its columns are those of a constant
/// one times the variable.
pub(crate) fn known(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Vec<Known>, IdentifyError> {
    const BASE: [&str; 3] = ["base:x", "base:y", "base:z"];
    let problem = examination.problem();
    let model = examination.model();
    let balls: Vec<Vec<String>> = datasets.iter().map(|d| d.dataset.ball_ids()).collect();
    let is_known = |variable: &Variable| {
        let probe = effect(CARRIERS, vec![term(BASE[0], variable.expression())]);
        datasets.iter().zip(&balls).all(|(d, balls)| {
            let built = probe.build(&model.subject(&d.dataset.robot, balls));
            built.is_ok_and(|effect| missing(effect.as_ref(), d.dataset, model, Use::Fit).is_none())
        })
    };
    let all = Variable::all(problem.robot().joints());
    // Sums are made of the angles.
    let variables: Vec<Variable> = all.iter().copied().filter(|v| v.angles().len() < 2 && is_known(v)).collect();
    let of = |variable: &Variable| BASE.map(|site| term(site, variable.expression()));
    let terms = BASE.iter().map(|site| term(site, "1".into())).chain(variables.iter().flat_map(of)).collect();
    let columns = examination.columns_of(datasets, &effect(CARRIERS, terms))?;
    let spans = spans(examination);
    let value = |k: usize, rows: &Range<usize>| {
        let (mut with, mut alone) = (0.0, 0.0);
        for row in rows.clone() {
            for axis in 0..BASE.len() {
                let one = columns[(axis, row)];
                with += one * columns[(BASE.len() * (k + 1) + axis, row)];
                alone += one * one;
            }
        }
        if alone > 0.0 { with / alone } else { 0.0 }
    };
    let of = |(k, variable): (usize, &Variable)| Known {
        variable: *variable,
        values: spans.iter().map(|rows| value(k, rows)).collect(),
    };
    let mut known: Vec<Known> = variables.iter().enumerate().map(of).collect();
    let angle = |j: usize| known.iter().find(|k| k.variable == Variable::Joint(j)).map(|k| k.values.clone());
    let sums = all.iter().filter_map(|variable| {
        let (j, k, sign) = match *variable {
            Variable::Sum(j, k) => (j, k, 1.0),
            Variable::Difference(j, k) => (j, k, -1.0),
            _ => return None,
        };
        let values = angle(j)?.iter().zip(&angle(k)?).map(|(a, b)| a + sign * b).collect();
        Some(Known { variable: *variable, values })
    });
    let sums: Vec<Known> = sums.collect();
    known.extend(sums);
    Ok(known)
}
