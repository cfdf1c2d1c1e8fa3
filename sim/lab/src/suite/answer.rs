//! Comparison of a diagnosis with the ground truth.

use calibench::diagnosis::{Diagnosis, Finding, Verdict};
use calibench::effects::EffectId;

use super::advice::suspects;
use super::hide::Hidden;
use super::outcome::Outcome;
use super::{Case, Condition, Kind};
use calibench_sim::effect_names::{joint_of, same};
use calibench_sim::ground_truth::says_unknown;

/// Detectability, in units of noise, from which an effect must be found.
pub(super) const TO_BE_FOUND: f64 = 0.5;

/// Chi-square per degree of freedom above which more is missing than was named.
pub(super) const MORE_IS_MISSING: f64 = 2.0;

/// Chi-square per degree of freedom above which the verdict "nothing left" is contradicted.
const NOTHING_LEFT: f64 = 1.5;

/// The columns of an outcome determined by the diagnosis; `visible` is the detectability of each hidden effect, `chi2_left` the
/// chi-square per degree of freedom with the first finding fitted.
pub(super) fn answer(diagnosis: &Diagnosis, case: &Case, hidden: &Hidden, visible: &[f64], chi2_left: Option<f64>) -> Outcome {
    let is_true = |effect: &str| hidden.effects.iter().any(|(id, _)| same(id, effect));
    let twins = hidden.flaws.twins();
    let joints = hidden.joints();
    let top = diagnosis.findings.first();
    let name = |f: &Finding| f.hypothesis.in_model.to_string();
    let top3: Vec<String> = diagnosis.findings.iter().take(3).map(name).collect();
    let top_right = top.is_some_and(|f| is_true(&f.hypothesis.in_model));
    let merged = top_right || top.is_some_and(|f| f.rivals.iter().any(|r| is_true(r)));
    let contributor = diagnosis.contributions.first().map_or_else(String::new, |c| c.effect.to_string());
    let largest = (0..visible.len()).max_by(|&a, &b| visible[a].total_cmp(&visible[b])).map(|k| hidden.effects[k].0.as_str());
    let joint = match (diagnosis.verdict, diagnosis.heat_map.best_cell()) {
        (Verdict::Unexplained, Some(cell)) => Some(cell.joint + 1),
        _ => top.and_then(|f| joint_of(&f.hypothesis.in_model)),
    };
    let names_twin =
        top.is_some_and(|f| twins.iter().any(|t| same(t, &f.hypothesis.in_model) || f.rivals.iter().any(|r| r == t)));
    let outcome = Outcome {
        verdict: Some(diagnosis.verdict),
        top: top.map_or_else(String::new, name),
        top_probability: top.map_or(0.0, |finding| finding.probability),
        rivals: top.map_or_else(String::new, |f| f.rivals.join(" ")),
        top3_right: top3.iter().any(|e| is_true(e)),
        top3: top3.join(" "),
        set95: diagnosis.set95.join(" "),
        top_right,
        top_right_merged: merged,
        covered: diagnosis.set95.iter().any(|e| is_true(e)),
        joint_right: joint.is_some_and(|j| joints.contains(&j)),
        said_so: says_unknown(diagnosis.verdict) || names_twin,
        contributor_right: largest.is_some_and(|id| same(id, &contributor)),
        contributor,
        chi2_left,
        ..Outcome::default()
    };
    let judged = Judged { diagnosis, case, hidden, visible, largest, outcome: &outcome };
    Outcome { right: judged.right(), ..outcome }
}

/// A diagnosis with everything needed to judge it.
struct Judged<'a> {
    diagnosis: &'a Diagnosis,
    case: &'a Case,
    hidden: &'a Hidden,
    visible: &'a [f64],
    largest: Option<&'a str>,
    outcome: &'a Outcome,
}

impl Judged<'_> {
    /// True if the answer is right. Naming one effect as the whole cause while the chi-square shows that more is missing is
    /// wrong, even if that effect is present.
    fn right(&self) -> bool {
        let o = self.outcome;
        let names = o.claimed();
        let nothing = self.diagnosis.verdict == Verdict::NothingLeft;
        let open = says_unknown(self.diagnosis.verdict);
        let too_much = o.claimed() && o.chi2_left.is_some_and(|c| c > MORE_IS_MISSING);
        match self.case.kind {
            Kind::Nothing => nothing || self.noise_seen(),
            Kind::Effects { ref ids, .. } if ids.len() == 1 => {
                let unseen = self.visible.iter().all(|v| *v < TO_BE_FOUND);
                self.noise_seen() || if names { o.top_right_merged } else { nothing && unseen }
            }
            Kind::Effects { .. } => names && o.top_right_merged && !too_much,
            Kind::Outliers { .. } => self.both_suspected() && !too_much,
            Kind::MovedBall { .. } => {
                if names {
                    self.ball_named()
                } else {
                    open
                }
            }
            Kind::Clutter { .. } | Kind::Dense if o.claimed() => self.largest.is_some_and(|id| same(id, &o.top)) && !too_much,
            Kind::Clutter { .. } | Kind::Dense => open || (nothing && self.diagnosis.chi2_per_dof <= NOTHING_LEFT),
            Kind::Unknown { .. } => o.said_so,
        }
    }

    /// True if the noise is larger than stated and the diagnosis says so.
    fn noise_seen(&self) -> bool {
        matches!(self.case.condition, Condition::NoiseUnderstated { .. } | Condition::Quantised { .. })
            && self.diagnosis.verdict == Verdict::NoiseLargerThanStated
    }

    fn both_suspected(&self) -> bool {
        let suspects = suspects(self.diagnosis);
        let set: Vec<&str> = self.outcome.set95.split(' ').collect();
        self.outcome.claimed() && self.hidden.effects.iter().all(|(id, _)| suspects.contains(id) || set.contains(&id.as_str()))
    }

    /// True if the moved ball is named, as moved throughout or from some moment on.
    fn ball_named(&self) -> bool {
        let moved = self.hidden.flaws.moved_ball.as_ref();
        moved.is_some_and(|m| {
            [EffectId::of_ball(&m.ball), EffectId::member(EffectId::BALL_STEP, &m.ball)]
                .iter()
                .any(|id| same(id, &self.outcome.top))
        })
    }
}
