//! The search for laws, one after the other, until nothing is significant.

use calibench::diagnosis::Examination;
use calibench::effects::EffectId;
use calibench::identify::Model;
use calibench::identify::calibration::IdentifyError;
use calibench::measure::dataset::NamedDataset;
use nalgebra::DMatrix;

use crate::data::{Data, Fitted, SIGNIFICANT, beside};
use crate::false_laws::Nothing;
use crate::field::Found;
use crate::law::{Doubt, Law};
use crate::metric::Metrics;
use crate::rivals::rivals;

/// Largest share of data without a law in which one is said to be found.
pub const FALSE_LAW_RATE: f64 = 0.01;

/// Odds below which effects of the catalogue are named in place of a law: what somebody has seen in a robot before is that much more
/// likely to be in this one than one law among hundreds of thousands.
const OVER_THE_CATALOGUE: f64 = 1e4;

/// Probability of its place from which on a law is taken.
const CERTAIN: f64 = 0.9;

/// Share of the residual that a law has to explain if more than noise remains.
const LARGER_PART: f64 = 0.4;

/// Whitened sum of squares per degree of freedom below which what remains counts as noise, whose size is rarely stated to a quarter.
const NEARLY_NOISE: f64 = 2.0;

/// Largest number of laws.
const MOST_LAWS: usize = 3;

/// Largest number of effects of the catalogue in addition to them.
const MOST_LISTED: usize = 12;

/// What a search found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Discovery {
    /// The laws, the most evident first.
    pub laws: Vec<Law>,
    /// The law with which the search ended, if it is not taken; its `doubt` says why.
    pub suspected: Option<Law>,
    /// Effects of the catalogue that explain better what they explain than any law, in the order in which they were found.
    pub listed: Vec<String>,
    /// True if the residual is what ordinary amounts of effects of the catalogue leave in a robot, and not noise alone.
    pub is_ordinary: bool,
    /// Number of laws that were tried.
    pub tried: usize,
    /// Number of samples.
    pub samples: usize,
    /// Number of samples among which the search was made.
    pub searched: usize,
}

/// A model with what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct LargerModel {
    /// The model.
    pub model: Model,
    /// Ids of what was added: laws as effects of the user's own, and effects of the catalogue.
    pub added: Vec<EffectId>,
    /// Ids of the laws, in their order.
    pub laws: Vec<String>,
}

impl Discovery {
    /// The model with the laws that were found, and with the effects of the catalogue that explain what they explain better.
    pub fn added_to(&self, model: &Model) -> LargerModel {
        let mut larger = LargerModel { model: model.clone(), added: Vec::new(), laws: Vec::new() };
        // A step between two samples without a time is no id.
        for listed in self.listed.iter().filter(|name| !name.contains(' ')) {
            if !larger.model.holds(listed) {
                larger.model = larger.model.with(listed);
                larger.added.push(EffectId::new(listed));
            }
        }
        for law in &self.laws {
            let is_free = |name: &String| larger.model.own.iter().all(|own| own.name != *name);
            let name = (1..).map(|k| format!("law_{k}")).find(is_free).unwrap_or_default();
            larger.model.own.push(law.effect(&name));
            larger.model = larger.model.with(&name);
            larger.added.push(EffectId::new(&name));
            larger.laws.push(name);
        }
        larger
    }
}

/// Searches the residuals of a model for laws that nobody listed.
///
/// # Errors
/// When the data do not fit the model, or do not determine the unknowns.
pub fn discover(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Discovery, IdentifyError> {
    let examination = Examination::new(datasets, model)?;
    let data = Data::of(datasets, &examination)?;
    let field = data.field();
    let mut taken = data.fitted.clone();
    let mut found =
        Discovery { samples: examination.problem().sample_count(), searched: data.spans.len(), ..Discovery::default() };
    let mut listed_names = Vec::new();
    let (mut of_listed, mut of_laws) = (DMatrix::zeros(taken.nrows(), 0), Vec::new());
    while found.laws.len() < MOST_LAWS {
        let ground = data.ground(&taken);
        let metrics = ground.metrics();
        let searched = field.search(&metrics, true);
        found.tried += searched.tried;
        found.is_ordinary = metrics.likely_size(&DMatrix::zeros(taken.nrows(), 0)) > 0;
        let best = searched.best.iter().find(|f| data.is_law(f, &metrics));
        let listed = data.best_listed(&metrics);
        let of_law = best.map_or(f64::NEG_INFINITY, |f| f.ln_odds);
        let chain = listed.filter(|l| l.ln_odds > SIGNIFICANT).map_or_else(Vec::new, |first| data.together(&taken, first));
        let sum = |count: usize| chain[..count].iter().map(|l| l.ln_odds).sum::<f64>();
        let needed = (1..=chain.len()).find(|&count| sum(count) >= of_law - OVER_THE_CATALOGUE.ln());
        let mut take_listed = |count: usize, taken: &mut DMatrix<f64>| {
            for one in &chain[..count] {
                *taken = beside(taken, &one.listed.columns);
                of_listed = beside(&of_listed, &one.listed.columns);
                listed_names.push(one.listed.name.clone());
            }
            listed_names.len() <= MOST_LISTED
        };
        if let Some(needed) = needed {
            if !take_listed(needed, &mut taken) {
                break;
            }
            continue;
        }
        let Some(best) = best.filter(|f| f.ln_odds > SIGNIFICANT) else { break };
        let columns = field.columns_of(&best.shape);
        let kept = kept_terms(&metrics, &columns);
        let p_false = Nothing::beside(&field, &ground, &metrics, &columns).p_of(&field, &ground, best.ln_odds);
        let mut law = data.law(best, &kept, &metrics, p_false);
        law.p_place = p_place(&searched.best, best.shape.place);
        law.doubt = doubt(&law, examination.fit().noise_stated.then_some(data.chi2_per_dof_with(&kept, best, &metrics)));
        // Among much else the catalogue goes first, and the residual is searched again.
        if law.doubt == Some(Doubt::MuchElse) && !chain.is_empty() && take_listed(1, &mut taken) {
            continue;
        }
        law.rivals = rivals(datasets, &examination, &data, &metrics, best, &searched.best);
        if law.doubt.is_some() {
            found.suspected = Some(law);
            break;
        }
        found.laws.push(law);
        let columns = columns.select_columns(&kept);
        taken = beside(&taken, &columns);
        of_laws.push(columns);
    }
    refit(&data, &of_listed, &of_laws, &mut found.laws);
    listed_names.truncate(MOST_LISTED);
    Ok(Discovery { listed: listed_names, ..found })
}

/// Fits every law beside all others and the effects of the catalogue: each was fitted before the next was found.
fn refit(data: &Data, of_listed: &DMatrix<f64>, of_laws: &[DMatrix<f64>], laws: &mut [Law]) {
    for (k, (law, columns)) in laws.iter_mut().zip(of_laws).enumerate() {
        let others = of_laws.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, columns)| columns);
        let ground = others.fold(beside(&data.fitted, of_listed), |ground, columns| beside(&ground, columns));
        let fitted = Fitted::of(&data.ground(&ground).metrics(), columns);
        for (k, term) in law.terms.iter_mut().enumerate() {
            (term.coefficient, term.sigma) = (fitted.coefficients[k], fitted.sigmas[k]);
        }
    }
}

/// Why a law is not taken; `chi2_per_dof` is that of the residual with it, where the noise is stated.
fn doubt(law: &Law, chi2_per_dof: Option<f64>) -> Option<Doubt> {
    let leaves_noise = chi2_per_dof.is_some_and(|chi2| chi2 < NEARLY_NOISE);
    match law {
        law if law.p_false > FALSE_LAW_RATE => Some(Doubt::Chance),
        law if law.p_place < CERTAIN => Some(Doubt::Place),
        law if law.explains < LARGER_PART && !leaves_noise => Some(Doubt::MuchElse),
        _ => None,
    }
}

/// Probability that a law is at this place, if one of those found is there.
fn p_place(found: &[Found], place: usize) -> f64 {
    let best = found.first().map_or(0.0, |f| f.ln_odds);
    let (here, all) = found.iter().fold((0.0, 0.0), |(here, all), f| {
        let odds = (f.ln_odds - best).exp();
        (here + if f.shape.place == place { odds } else { 0.0 }, all + odds)
    });
    if all > 0.0 { here / all } else { 0.0 }
}

/// The terms of a law that it needs, by index: one whose removal makes it more probable is none.
fn kept_terms(metrics: &Metrics, columns: &DMatrix<f64>) -> Vec<usize> {
    let mut kept: Vec<usize> = (0..columns.ncols()).collect();
    while kept.len() > 1 {
        let of = |kept: &[usize]| metrics.ln_evidence_of(&columns.select_columns(kept)).unwrap_or(f64::NEG_INFINITY);
        let without = |k: usize| kept.iter().copied().filter(|&other| other != k).collect::<Vec<_>>();
        let shorter = kept.iter().map(|&k| without(k)).map(|kept| (of(&kept), kept));
        match shorter.reduce(|best, one| if one.0 > best.0 { one } else { best }) {
            Some((ln_evidence, shorter)) if ln_evidence >= of(&kept) => kept = shorter,
            _ => break,
        }
    }
    kept
}
