//! A suite by class, the worst first.

use calibench::diagnosis::Verdict;
use serde::Serialize;

use super::answer::MORE_IS_MISSING;
use super::tally::quantile;
use super::{Outcome, Share};

/// Ratio of the error after the advice to the error before above which it counts as harm.
const HARM: f64 = 1.06;

/// One class of trials.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)] // the keys of the document
pub struct ClassRow {
    pub class: String,
    /// Number of measured trials; those whose balls could not be centred are not judged.
    pub trials: usize,
    pub not_measured: usize,
    /// Verdicts that name one effect, or several rivals, as the whole cause.
    pub claimed: Share,
    /// Right answers; docs/scenarios.md defines them for each class.
    pub right: Share,
    /// Verdict "identified" although the chi-square per degree of freedom with the effect is above 2.
    pub identified_but_more: Share,
    /// The 10 to 90 % band of the expected error covers the true one, before anything is added.
    pub band_holds: Share,
    /// Expected over true error before: quantiles at 10, 50, 90 %.
    pub predicted_over_actual: [f64; 3],
    /// Mean error over the workspace before and after following the advice: medians, mm.
    pub before_mm: f64,
    pub after_mm: f64,
    /// The error after is larger than before by more than 6 %.
    pub harmed: Share,
    /// Largest ratio of the error after to the error before.
    pub worst_ratio: f64,
    /// Coverage and ratio, as above, of the advised calibration's own expected error; no trials if it predicts none.
    pub band_holds_after: Share,
    pub predicted_over_actual_after: [f64; 3],
}

/// One row per class, sorted by the share of right answers, then by impossible identifications; the worst first.
pub fn class_rows(outcomes: &[Outcome]) -> Vec<ClassRow> {
    let mut classes: Vec<&str> = outcomes.iter().map(|o| o.class.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    let mut rows: Vec<ClassRow> = classes.into_iter().map(|class| row(class, outcomes)).collect();
    // A class without trials comes last.
    let worth = |r: &ClassRow| if r.trials == 0 { f64::INFINITY } else { r.right.value() };
    rows.sort_by(|a, b| {
        let by_right = worth(a).total_cmp(&worth(b));
        by_right.then(b.identified_but_more.value().total_cmp(&a.identified_but_more.value()))
    });
    rows
}

fn row(class: &str, outcomes: &[Outcome]) -> ClassRow {
    let all = || outcomes.iter().filter(|o| o.class == class);
    let measured = || all().filter(|o| o.verdict.is_some());
    let share = |hit: &dyn Fn(&Outcome) -> bool| Share::count(measured(), hit);
    let middle = |of: &dyn Fn(&Outcome) -> f64| quantile(measured().map(of).collect(), 0.5);
    let after = |o: &Outcome| o.after_mm.unwrap_or(o.before_mm);
    let quantiles = |of: &dyn Fn(&Outcome) -> Option<f64>| {
        [0.1, 0.5, 0.9].map(|share| quantile(measured().filter_map(of).collect(), share))
    };
    let says = || measured().filter(|o| o.predicted_after_mm.is_some());
    let within = |band: [Option<f64>; 2], value: f64| matches!(band, [Some(low), Some(high)] if (low..=high).contains(&value));
    ClassRow {
        class: class.to_owned(),
        trials: measured().count(),
        not_measured: all().count() - measured().count(),
        claimed: share(&Outcome::claimed),
        right: share(&|o| o.right),
        identified_but_more: share(&|o| {
            o.verdict == Some(Verdict::Identified) && o.chi2_left.is_some_and(|c| c > MORE_IS_MISSING)
        }),
        band_holds: share(&|o| within([Some(o.predicted_low_mm), Some(o.predicted_high_mm)], o.before_mm)),
        predicted_over_actual: quantiles(&|o| Some(o.predicted_mm / o.before_mm)),
        before_mm: middle(&|o| o.before_mm),
        after_mm: middle(&after),
        harmed: share(&|o| after(o) > HARM * o.before_mm),
        worst_ratio: quantile(measured().map(|o| after(o) / o.before_mm).collect(), 1.0),
        band_holds_after: Share::count(says(), |o| within([o.predicted_after_low_mm, o.predicted_after_high_mm], after(o))),
        predicted_over_actual_after: quantiles(&|o| Some(o.predicted_after_mm? / after(o))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(class: &str, right: bool, before_mm: f64, after_mm: f64) -> Outcome {
        let (class, verdict) = (class.to_owned(), Some(Verdict::Identified));
        let chi2_left = Some(if right { 1.0 } else { 9.0 });
        let (predicted_mm, predicted_low_mm, predicted_high_mm) = (0.1, 0.08, 0.12);
        let after_mm = Some(after_mm);
        Outcome {
            class,
            verdict,
            right,
            chi2_left,
            before_mm,
            after_mm,
            predicted_mm,
            predicted_low_mm,
            predicted_high_mm,
            ..Outcome::default()
        }
    }

    #[test]
    fn the_worst_class_comes_first_and_every_share_is_counted_over_its_own_trials() {
        let outcomes = [
            outcome("good", true, 0.1, 0.05),
            outcome("bad", false, 0.2, 0.3),
            outcome("bad", true, 0.1, 0.1),
            Outcome { class: "good".into(), ..Outcome::default() },
        ];
        let rows = class_rows(&outcomes);
        assert_eq!([rows[0].class.as_str(), rows[1].class.as_str()], ["bad", "good"]);
        let bad = &rows[0];
        assert_eq!((bad.trials, bad.right.value(), bad.identified_but_more.value()), (2, 0.5, 0.5));
        assert_eq!((bad.band_holds.value(), bad.harmed.value()), (0.5, 0.5));
        assert!((bad.worst_ratio - 1.5).abs() < 1e-12);
        assert_eq!((rows[1].trials, rows[1].not_measured, rows[1].after_mm), (1, 1, 0.05));
    }
}
