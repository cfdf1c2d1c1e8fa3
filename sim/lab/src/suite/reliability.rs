//! How often an effect named with a probability is a hidden one: probabilities that are frequencies.

use serde::Serialize;

use super::{Outcome, Share};
use crate::study;

/// Bounds of the probability, between which claims are counted together.
const BOUNDS: [f64; 7] = [0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0];

/// Claims of a kind of trial whose probability lies between two bounds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)] // the keys of the document
pub struct Reliability {
    /// `nothing`, `one` …; empty for all.
    pub kind: &'static str,
    pub from: f64,
    pub to: f64,
    /// Mean probability said.
    pub said: f64,
    /// Claims whose first effect, or one that the diagnosis cannot tell from it, was hidden.
    pub right: Share,
    /// Interval of 95 % of that share (Wilson).
    pub right_95: [f64; 2],
}

/// The rows of all trials, then those of each kind; without those that have no claim.
pub fn reliability(outcomes: &[Outcome]) -> Vec<Reliability> {
    let claims: Vec<&Outcome> = outcomes.iter().filter(|o| o.verdict.is_some_and(|verdict| verdict.names_effects())).collect();
    let mut kinds: Vec<&'static str> = claims.iter().map(|o| o.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let mut rows = Vec::new();
    for kind in [""].into_iter().chain(kinds) {
        rows.extend(BOUNDS.windows(2).filter_map(|bounds| row(&claims, kind, [bounds[0], bounds[1]])));
    }
    rows
}

fn row(claims: &[&Outcome], kind: &'static str, [from, to]: [f64; 2]) -> Option<Reliability> {
    let is_last = to >= 1.0;
    let counts = |o: &&&Outcome| {
        let p = o.top_probability;
        (kind.is_empty() || o.kind == kind) && p >= from && (p < to || is_last)
    };
    let within: Vec<&Outcome> = claims.iter().filter(counts).copied().collect();
    let said = within.iter().map(|o| o.top_probability).sum::<f64>() / within.len() as f64;
    let right = Share::count(within.iter(), |o| o.top_right_merged);
    let right_95 = study::Share { count: right.hits as u64, of: right.of as u64 }.band();
    (!within.is_empty()).then_some(Reliability { kind, from, to, said, right, right_95 })
}

#[cfg(test)]
mod tests {
    use calibench::diagnosis::Verdict;

    use super::*;

    fn claim(kind: &'static str, top_probability: f64, top_right_merged: bool) -> Outcome {
        Outcome { kind, top_probability, top_right_merged, verdict: Some(Verdict::Identified), ..Outcome::default() }
    }

    #[test]
    fn claims_are_counted_by_what_was_said() {
        let outcomes = [
            claim("one", 0.93, true),
            claim("one", 0.91, false),
            claim("two", 1.0, true),
            Outcome { kind: "nothing", verdict: Some(Verdict::NothingLeft), top_probability: 0.95, ..Outcome::default() },
        ];
        let rows = reliability(&outcomes);
        let all: Vec<(&str, f64, usize, usize)> = rows.iter().map(|r| (r.kind, r.from, r.right.hits, r.right.of)).collect();
        assert_eq!(all, [("", 0.9, 1, 2), ("", 0.99, 1, 1), ("one", 0.9, 1, 2), ("two", 0.99, 1, 1)]);
        assert!((rows[0].said - 0.92).abs() < 1e-12);
        // Wilson, 1 of 2: 0.0945 to 0.9055 (Agresti and Coull 1998).
        assert!((rows[0].right_95[0] - 0.0945).abs() < 1e-3 && (rows[0].right_95[1] - 0.9055).abs() < 1e-3);
    }
}
