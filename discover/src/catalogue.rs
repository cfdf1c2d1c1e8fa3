//! What the catalogue offers in place of a law: its effects, gear ripples of every order, and steps at every moment.

use calibench::diagnosis::Examination;
use calibench::effects::EffectId;
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::factors::Factor;
use crate::field::{Field, Shape};
use crate::metric::Metrics;
use crate::samples::Place;
use crate::variables::{Function, Variable};

/// Largest number of moments at which a step is tried.
const MOMENTS: usize = 40;

/// An effect that somebody listed, with its columns in the residuals.
#[derive(Debug, Clone)]
pub(crate) struct Listed {
    /// Its id, or the family and the samples between which it happened.
    pub name: String,
    /// Its columns (residuals x columns).
    pub columns: DMatrix<f64>,
}

/// The candidates of the library in these of the fit's residuals, the first of `residuals`.
pub(crate) fn of_library(examination: &Examination, chosen: &[usize], residuals: usize) -> Vec<Listed> {
    let whitened = examination.whitened();
    let of = |rows: &std::ops::Range<usize>| {
        let mut columns = DMatrix::zeros(residuals, rows.len());
        let own = whitened.rows.rows(rows.start, rows.len()).select_columns(chosen);
        columns.rows_mut(0, chosen.len()).copy_from(&own.transpose());
        columns
    };
    let each = whitened.candidates.iter().filter(|c| !c.rows.is_empty());
    each.map(|c| Listed { name: c.id.to_string(), columns: of(&c.rows) }).collect()
}

/// Steps of the base, the tool and every joint between two samples that follow each other; of samples without a time they have no id.
pub(crate) fn steps(field: &Field<'_>, sample_ids: &[&str], times: Option<&[f64]>) -> Vec<Listed> {
    let n = field.spans.len();
    let every = n.div_ceil(MOMENTS).max(1);
    let index = |site: &str| field.places.iter().position(|p| p.site == site);
    let shifts = |of: &str| ["x", "y", "z"].iter().filter_map(|axis| index(&format!("{of}:{axis}"))).collect::<Vec<_>>();
    let tool = field.places.iter().find(|p| p.of_tool).and_then(|p| p.site.rsplit_once(':')).map(|s| s.0.to_owned());
    let mut movers = vec![(EffectId::BASE_STEP.to_owned(), shifts("base"))];
    movers.extend(tool.map(|site| (EffectId::TOOL_STEP.to_owned(), shifts(&site))));
    movers.extend(
        field
            .places
            .iter()
            .enumerate()
            .filter_map(|(k, p)| Some((format!("{}:{}", EffectId::JOINT_STEP, p.joint? + 1), vec![k]))),
    );
    let mut listed = Vec::new();
    for first in (every..n).step_by(every) {
        for (name, places) in &movers {
            let mut columns = DMatrix::zeros(field.columns.ncols(), places.len());
            for (k, &place) in places.iter().enumerate() {
                for rows in &field.spans[first..] {
                    rows.clone().for_each(|r| columns[(r, k)] = field.columns[(place, r)]);
                }
            }
            let name = match times {
                Some(times) => format!("{name}:{:.1}", 0.5 * (times[first - 1] + times[first])),
                None => format!("{name} between {} and {}", sample_ids[first - 1], sample_ids[first]),
            };
            listed.push(Listed { name, columns });
        }
    }
    listed
}

/// The id of the effect that a law of one factor is, if somebody listed it.
pub(crate) fn name_of(shape: &Shape, places: &[Place], factors: &[Factor]) -> Option<String> {
    let [factor] = shape.factors.as_slice() else { return None };
    let (factor, place) = (&factors[*factor], &places[shape.place]);
    let j = place.joint?;
    match (factor.variable, factor.functions.as_slice()) {
        (Variable::Joint(v), [Function::Sine(k), Function::Cosine(_)]) if v == j => {
            let number = j + 1;
            Some(match k {
                1 => format!("{}:{number}", EffectId::HARMONIC_1),
                2 => format!("{}:{number}", EffectId::HARMONIC_2),
                k => format!("{}:{number}:{k}", EffectId::HARMONIC),
            })
        }
        (Variable::Joint(v), [Function::Sine(1) | Function::Cosine(1)]) if v == j => {
            Some(format!("{}:{}", EffectId::HARMONIC_1, j + 1))
        }
        (Variable::Joint(v), [Function::Plain]) if v == j => Some(format!("{}:{}", EffectId::JOINT_SCALE, j + 1)),
        (Variable::Torque(v), [Function::Plain]) if v == j => Some(format!("{}:{}", EffectId::JOINT_COMPLIANCE, j + 1)),
        _ => None,
    }
}

/// A listed effect, and its log odds against nothing.
#[derive(Debug, Clone)]
pub(crate) struct Likely {
    /// The effect.
    pub listed: Listed,
    /// Its log odds, the number of those tried included.
    pub ln_odds: f64,
}

/// The best of several listed effects.
pub(crate) fn best(listed: &[Listed], metrics: &Metrics) -> Option<Likely> {
    let ln_prior = -(listed.len().max(1) as f64).ln();
    let odds: Vec<f64> = listed
        .par_iter()
        .map(|one| metrics.ln_evidence_of(&one.columns).map_or(f64::NEG_INFINITY, |ln| ln_prior + ln))
        .collect();
    let best = (0..odds.len()).reduce(|best, k| if odds[k] > odds[best] { k } else { best })?;
    odds[best].is_finite().then(|| Likely { listed: listed[best].clone(), ln_odds: odds[best] })
}
