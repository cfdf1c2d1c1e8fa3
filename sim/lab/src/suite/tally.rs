//! Figures of many blind trials: false alarms, power, right names, credible sets, errors before and after.

use std::collections::BTreeMap;

use calibench::diagnosis::Verdict;
use calibench::math::nearest_rank;
use serde::Serialize;

use super::Outcome;
use super::answer::TO_BE_FOUND;
use calibench_sim::effect_names::family_of;

/// A share of trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Number of trials with the property.
    pub hits: usize,
    /// Number of trials considered.
    pub of: usize,
}

impl Share {
    /// Counts trials.
    pub(crate) fn count<T>(trials: impl Iterator<Item = T>, hit: impl Fn(T) -> bool) -> Self {
        trials.fold(Share { hits: 0, of: 0 }, |s, o| Share { hits: s.hits + usize::from(hit(o)), of: s.of + 1 })
    }

    /// The share; NaN without trials.
    pub fn value(self) -> f64 {
        self.hits as f64 / self.of as f64
    }
}

/// Detection at sizes between two bounds, in units of noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct Power {
    pub visible_from: f64,
    pub visible_to: f64,
    pub detected: Share,
    pub right: Share,
}

/// All figures of a suite. "Claimed" is a verdict that names effects; "detected" is any verdict except that nothing is left or
/// that the noise is larger than stated.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)] // the keys of the document
pub struct Tally {
    pub trials: usize,
    pub false_alarms: Share,
    pub false_alarms_noise_wrong: Share,
    pub false_unexplained: Share,
    pub top1_given_detection: Share,
    pub top1_merged_given_detection: Share,
    pub top3_given_detection: Share,
    pub set_covers: Share,
    pub set_size: f64,
    pub detected_from_half_sigma: Share,
    pub power: Vec<Power>,
    pub two_right: Share,
    pub clutter_claimed: BTreeMap<String, Share>,
    pub largest_contributor: Share,
    pub unknown_said_so: BTreeMap<String, Share>,
    pub unknown_joint: BTreeMap<String, Share>,
    pub after_over_before: f64,
    pub after_over_oracle: f64,
    pub predicted_within_25_percent: Share,
    pub predicted_over_actual: [f64; 3],
    pub families: BTreeMap<String, BTreeMap<String, usize>>,
}

/// Bounds of the power curve, in units of noise.
const VISIBLE: [f64; 7] = [0.0, 0.15, 0.3, 0.5, 1.0, 2.0, f64::INFINITY];

/// Workspace error below which it is mostly noise, mm (noise alone leaves 0.01 mm): no added effect can reduce it much.
const ABOVE_NOISE_MM: f64 = 0.04;

/// Quantile of the finite values; NaN if there are none.
pub(crate) fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.retain(|v| v.is_finite());
    nearest_rank(values, share)
}

/// Summarises outcomes.
pub fn tally(outcomes: &[Outcome]) -> Tally {
    // Trials under a special condition count only in their own row.
    let plain = |o: &&Outcome| o.class.starts_with(o.kind);
    let of = |kind: &'static str| outcomes.iter().filter(move |o| plain(o) && o.kind == kind && o.verdict.is_some());
    let detected = |o: &Outcome| !o.verdict.is_some_and(Verdict::is_noise);
    let one = || of("one").filter(|o| o.testable);
    let claimed = || one().filter(|o| o.claimed());
    let noise_wrong = |o: &&Outcome| o.case != "nothing";
    let by_case = |kind: &'static str, hit: &dyn Fn(&Outcome) -> bool| {
        let mut shares: BTreeMap<String, Share> = BTreeMap::new();
        for o in of(kind) {
            let share = shares.entry(o.case.clone()).or_insert(Share { hits: 0, of: 0 });
            share.hits += usize::from(hit(o));
            share.of += 1;
        }
        shares
    };
    let power = VISIBLE.windows(2).map(|w| {
        let within = || one().filter(|o| (w[0]..w[1]).contains(&o.visible));
        Power {
            visible_from: w[0],
            visible_to: w[1],
            detected: Share::count(within(), detected),
            right: Share::count(within(), |o| o.top_right_merged && detected(o)),
        }
    });
    let sizes: Vec<f64> = claimed().map(|o| o.set95.split(' ').count() as f64).collect();
    let fallen = || claimed().filter(|o| o.size >= 2.0 && o.visible >= TO_BE_FOUND && o.before_mm > ABOVE_NOISE_MM);
    let ratio = |of: &dyn Fn(&Outcome) -> Option<f64>| quantile(fallen().filter_map(of).collect(), 0.5);
    let predictions = || of("dense");
    let over: Vec<f64> = predictions().map(|o| o.predicted_mm / o.before_mm).collect();
    let mut families: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for o in one() {
        let family = |id: &str| family_of(id).to_owned();
        let said = if o.claimed() {
            if o.top_right_merged { family(&o.hidden) } else { family(&o.top) }
        } else {
            o.verdict_name().to_owned()
        };
        *families.entry(family(&o.hidden)).or_default().entry(said).or_default() += 1;
    }
    Tally {
        trials: outcomes.len(),
        false_alarms: Share::count(of("nothing").filter(|o| !noise_wrong(o)), Outcome::claimed),
        false_alarms_noise_wrong: Share::count(of("nothing").filter(noise_wrong), Outcome::claimed),
        false_unexplained: Share::count(of("nothing"), |o| o.verdict == Some(Verdict::Unexplained)),
        top1_given_detection: Share::count(claimed(), |o| o.top_right),
        top1_merged_given_detection: Share::count(claimed(), |o| o.top_right_merged),
        top3_given_detection: Share::count(claimed(), |o| o.top3_right),
        set_covers: Share::count(claimed(), |o| o.covered),
        set_size: sizes.iter().sum::<f64>() / sizes.len() as f64,
        detected_from_half_sigma: Share::count(one().filter(|o| o.visible >= TO_BE_FOUND), detected),
        power: power.collect(),
        two_right: Share::count(of("two").filter(|o| o.claimed()), |o| o.top_right_merged),
        clutter_claimed: by_case("clutter", &Outcome::claimed),
        largest_contributor: Share::count(of("dense"), |o| o.contributor_right),
        unknown_said_so: by_case("unknown", &|o| o.said_so),
        unknown_joint: by_case("unknown", &|o| o.joint_right),
        after_over_before: ratio(&|o| Some(o.after_mm? / o.before_mm)),
        after_over_oracle: ratio(&|o| Some(o.after_mm? / o.oracle_mm?)),
        predicted_within_25_percent: Share::count(predictions(), |o| (o.predicted_mm / o.before_mm - 1.0).abs() <= 0.25),
        predicted_over_actual: [0.1, 0.5, 0.9].map(|share| quantile(over.clone(), share)),
        families,
    }
}
