//! A ladder in words: each step as it is reached, the objections to it, the reason for stopping, and the model to use.

use super::effect_names::{all_called, called, each_called};
use super::field::{shares_sentence, unused_sentence};
use super::figures::{CROSS_VALIDATED, RESIDUAL, expected};
use super::printout::Printout;
use super::recommended::Recommended;
use super::tables::plain_table;
use calibench::diagnosis::Symptom;
use calibench::effects::facts::Unphysical;
use calibench::effects::registry::Registry;
use calibench::effects::{self, EffectId};
use calibench::identify::fit::Outcome;
use calibench::planning::planned::Planned;
use calibench::selection::ladder::{Ladder, LadderStep, RefusedStep, StopReason};
use calibench::selection::recommend::{Choice, ChoiceKind, Gain, Insufficient};
use calibench::selection::{Contradiction, Objection};
use calibench::units::MM;

/// Relative rise of the expected error that is reported.
const WORTH_A_WORD: f64 = 0.05;

/// An objection in words.
pub fn objection_sentence(objection: &Objection) -> String {
    let from_to = |x: &[f64; 2]| format!("{:.4} mm before, {:.4} mm after", x[0] / MM, x[1] / MM);
    match objection {
        Objection::Gain(gain) => gain_sentence(gain),
        Objection::CrossValidation { rms } => {
            format!("blocks that were not fitted are predicted no better: {}", from_to(rms))
        }
        Objection::Workspace { at, mean } => {
            format!("the error {} does not fall: {}", expected(*at).name, from_to(mean))
        }
        Objection::Session { name, rms } => format!("'{name}' is predicted worse: {}", from_to(rms)),
        Objection::Campaign { name, by } => {
            format!("'{name}' is predicted worse by the robot of the other campaigns: {}", contradiction(by))
        }
        Objection::Check { name, by } => format!("'{name}', which was not fitted, gets worse: {}", contradiction(by)),
        Objection::CheckUnjudged { name, because } => format!("'{name}' cannot be judged any more: {because}"),
        Objection::Measured { by } => {
            format!("the rows that were not fitted are predicted worse: {}", contradiction(by))
        }
        Objection::NotFitted { because } => format!("the data do not determine it: {because}"),
    }
}

/// The deterioration and its significance.
fn contradiction(by: &Contradiction) -> String {
    format!("{:.4} mm before, {:.4} mm after ({:.1} standard errors)", by.rms[0] / MM, by.rms[1] / MM, by.sigma)
}

/// States what the gain of a step at postures that were not fitted lacks, with the errors before and after.
pub fn gain_sentence(gain: &Gain) -> String {
    let (better, wanted) = match gain.lacks() {
        None => ("better".into(), String::new()),
        Some(Insufficient::Gain) => ("no better".into(), String::new()),
        Some(Insufficient::Size { needed }) => {
            ("hardly better".into(), format!("; more than {:.0} % required", 100.0 * needed))
        }
        Some(Insufficient::Significance { needed }) => {
            ("better by no more than chance allows".into(), format!("; more than {needed:.1} required"))
        }
        Some(Insufficient::Tail { grows }) => {
            (format!("better on the whole, but the largest errors grow by {:.0} %", 100.0 * grows), String::new())
        }
    };
    let size = matches!(gain.lacks(), Some(Insufficient::Size { .. }));
    let (of_squares, of_sigma) = if size { (wanted.as_str(), "") } else { ("", wanted.as_str()) };
    format!(
        "{} that were not fitted are predicted {better}: {:.4} mm before, {:.4} mm after ({:+.1} % of the squares, the largest clipped{of_squares}; {:.1} standard errors{of_sigma})",
        gain.division.words(),
        gain.rms[0] / MM,
        gain.rms[1] / MM,
        -100.0 * gain.share,
        gain.sigma
    )
}

/// Describes a physically impossible value: its size, and the missing effects of which it is a symptom.
pub fn symptom_sentence(s: &Symptom) -> String {
    let name = &s.parameter;
    let value = format!("{:.3} ± {:.3} {}", s.unit.from_si(s.value), s.unit.from_si(s.sigma), s.unit.printed());
    let joint = s.joint();
    let families = s.unphysical.symptom_of();
    let missing = || {
        let of_joint =
            |j: usize| all_called(Registry::catalogue(), &families.iter().map(|f| EffectId::member(f, j)).collect::<Vec<_>>());
        joint.map_or_else(|| "another load".into(), of_joint)
    };
    match s.unphysical {
        Unphysical::NegativeCompliance => format!(
            "{name} is negative ({value}): a symptom of something missing (another effect that changes as its load does: {}, or a load entered wrongly), not a spring.",
            missing()
        ),
        Unphysical::Softening => format!(
            "{name} is positive ({value}): a gear that gets softer under load; a symptom of something missing ({}), not a gear.",
            missing()
        ),
        Unphysical::LostMotionAgainstLoad => format!(
            "{name} is negative ({value}): play that closes against the load; a symptom of something missing ({}), not play.",
            missing()
        ),
        Unphysical::NegativeMass => {
            format!(
                "{name} ({value}) makes a mass negative: a symptom of something missing, or of a load entered wrongly, not a mass."
            )
        }
    }
}

/// Names a step by the effects it adds; the first by its model.
pub(super) fn ladder_step_words(ladder_step: &LadderStep) -> String {
    if ladder_step.added.is_empty() {
        ladder_step.model.ids().join(" + ")
    } else {
        format!("+ {}", added_words(&ladder_step.added))
    }
}

/// The effects added in one step, worded alike everywhere; if there are many, their number.
pub(super) fn added_words(added: &[EffectId]) -> String {
    let samples = added.iter().filter(|effect| effects::catalogue::set_aside_by(effect).is_some()).count();
    match added {
        few if few.len() <= 3 => few.join(" + "),
        many if samples == many.len() => format!("{samples} samples excluded"),
        many => format!("{} effects at once", many.len()),
    }
}

/// A step on one line.
pub fn ladder_step_sentence(ladder_step: &LadderStep) -> String {
    let what = ladder_step_words(ladder_step);
    let workspace = ladder_step
        .workspace
        .as_ref()
        .map_or(String::new(), |w| format!(", {} {:.3} mm", expected(w.at).name, w.mean.expected / MM));
    let what = match ladder_step.added.as_slice() {
        [one] => format!("+ {}", called(&ladder_step.model.registry, one)),
        _ => what,
    };
    format!(
        "{what}: {} {:.4} mm, {} {:.4} mm{workspace}; {}",
        RESIDUAL.name,
        ladder_step.fit / MM,
        CROSS_VALIDATED.name,
        ladder_step.cross_validated / MM,
        ladder_step.diagnosis.verdict.in_words()
    )
}

/// The reasons why the effects of a step are not added, at most so many, in a clause.
pub fn not_added_sentence(registry: &Registry, step: &RefusedStep, most: usize) -> String {
    let why: Vec<String> = step.objections.iter().take(most).map(objection_sentence).collect();
    format!("not added: {}: {}", each_called(registry, &step.effects), why.join("; "))
}

/// The reasons why a ladder ends, one line each.
pub fn top_sentences(top: &StopReason, last: &LadderStep, commands: &Recommended) -> Vec<String> {
    match top {
        StopReason::NothingLeft if last.diagnosis.is_thin() => {
            vec!["The ladder stops: nothing is found, but the samples are too few to find anything.".into()]
        }
        StopReason::NothingLeft => vec!["The ladder stops: the residual is noise.".into()],
        StopReason::NoiseLargerThanStated => {
            vec!["The ladder stops: the residual is noise, and more of it than stated.".into()]
        }
        StopReason::NotConverged(outcome) => vec![format!("The ladder stops: the fit {}.", outcome.in_words())],
        StopReason::StepLimit => vec!["The ladder stops at its step limit; continue from its model.".into()],
        StopReason::NoStepHelps { tried } => {
            let mut all = vec!["The ladder ends: no step helps.".to_owned()];
            all.extend(tried.iter().map(|step| format!("  {}", not_added_sentence(&last.model.registry, step, usize::MAX))));
            all.push(commands.more_measurements());
            all
        }
        other => vec![format!("The ladder ends: {}.", other.name().replace('_', " "))],
    }
}

/// The outcome of the initial fit if it did not converge and no other model is recommended.
fn unconverged(ladder: &Ladder) -> Option<Outcome> {
    ladder.first().calibration.unconverged().filter(|_| ladder.kind() == ChoiceKind::Begin)
}

/// States that a fit that did not converge permits no conclusion, with the remedy.
pub fn unconverged_sentence(outcome: Outcome) -> String {
    format!(
        "the fit {}. It supports no conclusion, and nothing is recommended: measure more postures, or fit fewer effects.",
        outcome.in_words()
    )
}

/// The model to use.
fn what_to_use(ladder: &Ladder) -> String {
    match ladder.kind() {
        ChoiceKind::Begin => "the model to begin with".to_owned(),
        ChoiceKind::Steps => "the last step".to_owned(),
        ChoiceKind::Library => {
            let effects = ladder.recommendation.choice().added.len();
            format!("the whole library ({effects} effects, each constrained to the size that the data give it)")
        }
        ChoiceKind::Field if ladder.steps.len() > 1 => {
            "the named effects of the ladder with the field of joint errors".to_owned()
        }
        ChoiceKind::Field => "the model to begin with and the field of joint errors".to_owned(),
    }
}

/// The model for which measurements are planned, and the reason.
pub fn planned_sentence(planned: &Planned) -> String {
    let ladder = &planned.ladder;
    let what = match ladder.kind() {
        ChoiceKind::Steps => {
            let added: Vec<EffectId> = ladder.steps.iter().skip(1).flat_map(|step| step.added.iter().cloned()).collect();
            format!("the last step of the ladder, with {}", all_called(&ladder.first().model.registry, &added))
        }
        _ => what_to_use(ladder),
    };
    if planned.in_question {
        return format!(
            "Planned for the present model: the effect that it lacks must be identified first. Until then the ladder recommends {what}."
        );
    }
    format!("Planned for {what}, which the ladder recommends: {}.", why(ladder))
}

/// The model to use, and the reason.
pub fn advice(ladder: &Ladder) -> String {
    if let Some(outcome) = unconverged(ladder) {
        return format!("Use no model yet: {}", unconverged_sentence(outcome));
    }
    let what = what_to_use(ladder);
    let aside = match ladder.recommendation.aside.as_slice() {
        [] => String::new(),
        ids => format!(" Excluded as disagreeing with all others: {}.", ids.join(", ")),
    };
    let field = ladder.recommendation.of_kind(ChoiceKind::Field).and_then(|choice| choice.field.as_ref());
    let of_field = field.and_then(|field| match ladder.kind() {
        ChoiceKind::Field => Some(shares_sentence(&ladder.first().model.registry, field)),
        _ => unused_sentence(&field.gate),
    });
    let of_field = of_field.map_or(String::new(), |sentence| format!(" {sentence}"));
    format!("Use {what}: {}.{aside}{of_field}{}", why(ladder), dearer_elsewhere(ladder).unwrap_or_default())
}

/// Warns if the recommended model is expected to be worse over the workspace, although it is better where it was
/// measured; the expectation mostly comes true.
fn dearer_elsewhere(ladder: &Ladder) -> Option<String> {
    let of = |ladder_step: &LadderStep| Some(ladder_step.workspace.as_ref()?.mean.expected / MM);
    let at = ladder.first().workspace.as_ref()?.at;
    // The gate of a field has compared the two at the very same poses.
    let (before, after) = (of(ladder.first())?, of(ladder.recommended()).filter(|_| ladder.kind() != ChoiceKind::Field)?);
    (after > before * (1.0 + WORTH_A_WORD)).then(|| {
        format!(
            " WARNING: its error {} is larger, {after:.3} mm instead of {before:.3} mm: use it only where the campaign \
             has measured, or measure where the robot is to work and name that with --check.",
            expected(at).name
        )
    })
}

/// The models that were compared with the first, what each leaves at postures that were not fitted, and the rule that chose.
#[must_use]
pub fn choices_text(ladder: &Ladder) -> Printout {
    let row = |(k, choice): (usize, &Choice)| {
        let chosen = if k == ladder.recommendation.chosen { "chosen" } else { "" };
        let convinces = if choice.convinces() { "yes" } else { "no" };
        let left = format!("{:.0}", 100.0 * choice.left());
        [
            if choice.kind == ChoiceKind::Begin { "the first".into() } else { choice.kind.name().replace('_', " ") },
            choice.added.len().to_string(),
            left,
            convinces.into(),
            chosen.to_owned(),
        ]
    };
    let rows: Vec<[String; 5]> = ladder.recommendation.choices.iter().enumerate().map(row).collect();
    let table = plain_table(["model", "effects added", "squares left at postures not fitted, %", "convinces", ""], rows);
    Printout::from(table)
        + format!(
            "\nOf those that are significant and leave about as little as the best, the one with the smallest product of the {} and the residual; a field of joint errors if it meets all its conditions.",
            ladder.first().workspace.as_ref().map_or("expected error", |w| expected(w.at).name)
        )
}

/// The reason for the recommendation.
pub fn why(ladder: &Ladder) -> String {
    if let Some(by) = &ladder.withdrawn {
        return format!(
            "what postures left out of the fit had recommended is withdrawn, because the rows of set 'validation' contradict it: {}",
            contradiction(by)
        );
    }
    if let Some(outcome) = unconverged(ladder) {
        return unconverged_sentence(outcome);
    }
    let choice = ladder.recommendation.choice();
    if choice.kind == ChoiceKind::Begin {
        return "nothing else predicts postures that were not fitted better by more than 5 % of the squares and two standard errors (more where postures are few)".into();
    }
    let gains: Vec<String> = choice
        .gains
        .iter()
        .map(|g| {
            let [before, after] = g.rms.map(|x| x / MM);
            format!("{} {before:.4} to {after:.4} mm ({:.0} standard errors)", g.division.words(), g.sigma)
        })
        .collect();
    format!("it predicts postures that were not fitted better: {}", gains.join(", "))
}
