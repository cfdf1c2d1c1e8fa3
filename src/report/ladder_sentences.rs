//! A ladder in words: every rung as it is reached, what speaks against a step, why it ends, and which model to use.

use super::diagnosis_sentences::Recommended;
use crate::assess::{Ladder, Objection, Rung, Symptom, Top, Unphysical};
use crate::units::MM;

/// An objection in words.
pub fn objection_sentence(objection: &Objection) -> String {
    let from_to = |x: &[f64; 2]| format!("{:.4} mm before, {:.4} mm after", x[0] / MM, x[1] / MM);
    match objection {
        Objection::CrossValidation { rms } => {
            format!("blocks that were not fitted are predicted no better: {}", from_to(rms))
        }
        Objection::Workspace { mean } => {
            format!("the error predicted over the workspace does not fall: {}", from_to(mean))
        }
        Objection::Session { name, rms } => format!("'{name}' is predicted worse: {}", from_to(rms)),
        Objection::Check { name, rms } => format!("'{name}', which was not fitted, gets worse: {}", from_to(rms)),
        Objection::CheckUnjudged { name, because } => format!("'{name}' cannot be judged any more: {because}"),
        Objection::NotFitted { because } => format!("the data do not determine it: {because}"),
    }
}

/// A number that no arm can have, in words: what it is, and that it is no spring.
pub fn symptom_sentence(s: &Symptom) -> String {
    let name = &s.parameter;
    let value = format!("{:.3} ± {:.3} {}", s.unit.from_si(s.value), s.unit.from_si(s.sigma), s.unit.symbol);
    let joint = s.joint();
    let of_joint = |families: &[&str]| -> String {
        joint.map_or_else(
            || "another load".into(),
            |j| families.iter().map(|f| format!("{f}:{j}")).collect::<Vec<_>>().join(", "),
        )
    };
    match s.unphysical {
        Unphysical::NegativeCompliance => format!(
            "{name} is negative ({value}): a symptom of something missing (another effect that changes as its load does: {}, or a load entered wrongly), not a spring.",
            of_joint(&["stiffening", "harmonic1", "harmonic2"])
        ),
        Unphysical::Softening => format!(
            "{name} is positive ({value}): a gear that gets softer under load; a symptom of something missing ({}), not a gear.",
            of_joint(&["harmonic1", "gravity_backlash"])
        ),
        Unphysical::LostMotionAgainstLoad => format!(
            "{name} is negative ({value}): play that closes against the load; a symptom of something missing ({}), not play.",
            of_joint(&["stiffening", "harmonic1"])
        ),
        Unphysical::NegativeMass => {
            format!(
                "{name} ({value}) makes a mass negative: a symptom of something missing, or of a load entered wrongly, not a mass."
            )
        }
    }
}

/// A rung in one line.
pub fn rung_sentence(rung: &Rung) -> String {
    let what = match rung.added.as_slice() {
        [] => rung.model.effects.join(" + "),
        [one] => format!("+ {one}"),
        many => format!("+ {} effects at once", many.len()),
    };
    let workspace = rung
        .workspace
        .as_ref()
        .map_or(String::new(), |w| format!(", expected over the workspace {:.3} mm", w.mean.expected / MM));
    format!(
        "{what}: fit {:.4} mm, cross-validated {:.4} mm{workspace}; {}",
        rung.fit / MM,
        rung.cross_validated / MM,
        rung.diagnosis.verdict.name()
    )
}

/// Why a ladder ends, a line each.
pub fn top_sentences(top: &Top, commands: &Recommended) -> Vec<String> {
    match top {
        Top::NothingLeft => vec!["The ladder ends: nothing is left but noise.".into()],
        Top::Tired => vec!["The ladder ends after the most rungs it climbs; go on from its model.".into()],
        Top::NoStepHelps { tried } => {
            let mut all = vec!["The ladder ends: no step helps.".to_owned()];
            all.extend(tried.iter().map(|(effect, objections)| {
                let why: Vec<String> = objections.iter().map(objection_sentence).collect();
                format!("  not {effect}: {}", why.join("; "))
            }));
            all.push(format!(
                "`calibench next {}{}` names measurements that would tell more.",
                commands.datasets, commands.model
            ));
            all
        }
    }
}

/// Which model to use.
pub fn advice(ladder: &Ladder) -> String {
    let (rung, is_whole) = ladder.recommended();
    let last = ladder.last();
    let expected = |r: &Rung| {
        let w = r.workspace.as_ref();
        w.map_or("unknown".into(), |w| {
            format!("{:.3} mm ({:.3} to {:.3})", w.mean.expected / MM, w.mean.low / MM, w.mean.high / MM)
        })
    };
    let Some(whole) = &ladder.whole else {
        return format!("Use the last rung: nothing else is to be gained. Expected over the workspace: {}.", expected(last));
    };
    if is_whole {
        return format!(
            "Use the whole library ({} effects, each held to the size that the data give it): expected over the workspace {}, in place of {} of the last rung.",
            whole.added.len(),
            expected(whole),
            expected(last)
        );
    }
    let worse: Vec<String> = ladder.against_whole.iter().filter(|o| o.refuses()).map(objection_sentence).collect();
    if worse.is_empty() {
        format!(
            "Use the last rung: expected over the workspace {}; the whole library at once promises no less, {}.",
            expected(rung),
            expected(whole)
        )
    } else {
        format!("Use the last rung: the whole library at once is refused, because {}.", worse.join("; "))
    }
}
