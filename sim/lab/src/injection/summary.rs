//! Injections summed up: by family, and in all.

use calibench::diagnosis::library::Untestable;
use calibench_sim::effect_names::family_of;
use serde::Serialize;

use super::trial::Injected;
use super::{InjectedNoise, Subject};
use crate::suite::{Share, quantile};

/// The injections of one family.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FamilyRow {
    /// The family.
    pub family: String,
    /// Members injected, of which the diagnosis said that something is missing.
    pub found: Share,
    /// Of which it named the effect.
    pub named: Share,
    /// Of those named, with estimates that agree with the injected size as closely as two sigma.
    pub within_2_sigma: Share,
    /// Medians of the mean position error over the workspace, mm, with the model and with the first finding added.
    pub before_mm: Option<f64>,
    #[allow(missing_docs)]
    pub after_mm: Option<f64>,
}

/// Everything that was injected, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Injections {
    /// Names of the datasets.
    pub datasets: Vec<String>,
    /// The effects of the model.
    pub model: Vec<String>,
    /// Number of samples.
    pub samples: usize,
    /// The noise of the injected measurements.
    pub noise: InjectedNoise,
    /// All injections.
    pub found: Share,
    #[allow(missing_docs)]
    pub named: Share,
    #[allow(missing_docs)]
    pub within_2_sigma: Share,
    /// Trials of nothing in which an effect was named.
    pub false_alarms: Share,
    /// By family, in the order of the catalogue.
    pub families: Vec<FamilyRow>,
    /// One entry per effect, in the same order.
    pub effects: Vec<Injected>,
    /// Effects that these data cannot test, and what they need.
    pub untestable: Vec<Needs>,
}

/// An effect that these data cannot test.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Needs {
    /// Its id.
    pub effect: String,
    /// The data that are missing.
    pub needs: &'static str,
}

impl Injections {
    pub(super) fn of(subject: &Subject<'_>, trials: Vec<Injected>) -> Self {
        let (effects, nothing): (Vec<Injected>, Vec<Injected>) = trials.into_iter().partition(|t| !t.effect.is_empty());
        let mut families: Vec<&str> = effects.iter().map(|t| family_of(&t.effect)).collect();
        families.dedup();
        let row = |family: &&str| {
            let own: Vec<&Injected> = effects.iter().filter(|t| family_of(&t.effect) == *family).collect();
            let [found, named, within_2_sigma] = shares(&own);
            FamilyRow {
                family: (*family).to_owned(),
                found,
                named,
                within_2_sigma,
                before_mm: median(own.iter().filter_map(|t| t.before_mm)),
                after_mm: median(own.iter().filter_map(|t| t.after_mm)),
            }
        };
        let [found, named, within_2_sigma] = shares(&effects.iter().collect::<Vec<_>>());
        let needs = |u: &Untestable| Needs { effect: u.effect.to_string(), needs: u.needs };
        Injections {
            datasets: subject.datasets.iter().map(|d| d.name.to_owned()).collect(),
            model: subject.model.ids(),
            samples: subject.baseline.samples,
            noise: subject.noise.clone(),
            found,
            named,
            within_2_sigma,
            false_alarms: Share::count(nothing.iter(), |t| !t.first.is_empty()),
            families: families.iter().map(row).collect(),
            untestable: subject.untestable.iter().map(needs).collect(),
            effects,
        }
    }
}

/// Found; named; of those named and fitted, within two sigma.
fn shares(trials: &[&Injected]) -> [Share; 3] {
    let fitted = trials.iter().filter(|t| t.within_2_sigma.is_some());
    [
        Share::count(trials.iter(), |t| t.found),
        Share::count(trials.iter(), |t| t.named),
        Share::count(fitted, |t| t.within_2_sigma == Some(true)),
    ]
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    Some(quantile(values.collect(), 0.5)).filter(|m| m.is_finite())
}
