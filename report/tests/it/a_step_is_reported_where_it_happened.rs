//! A step is located between the samples between which it occurred, and both the sentences and the JSON report it.

use calibench::diagnosis::Verdict;
use calibench::effects::registry::Registry;
use calibench_report::documents;
use calibench_report::sentences;

use crate::effect_cell::{Measures, diagnosed};

#[test]
fn a_step_is_placed_between_the_samples_between_which_it_happened() {
    // Samples are 60 s apart, the first at 60 s; balls are probed every other time, and each ball every twelfth.
    for (effect, measures, session, between) in [
        ("base_step:2430", Measures::Both, "", ["s039", "s040"]),
        ("joint_step:3:4890", Measures::Both, "", ["s080", "s081"]),
        ("artifact_step:3000", Measures::Both, "", ["s048", "s050"]),
        ("ball_step:b002:4000", Measures::Both, "", ["s064", "s076"]),
        ("base_step:5430", Measures::TwoSessions, "second", ["s089", "s090"]),
    ] {
        // Of the second session, if there are two.
        let sessions = measures == Measures::TwoSessions;
        let told = diagnosed(effect, measures, |p| if sessions && !p.name.ends_with("@second") { 0.0 } else { 3.0 });
        let stem = effect.rsplit_once(':').unwrap().0;
        let first = &told.findings[0].hypothesis;
        assert_eq!(first.effect, stem, "{effect}: {:?}", told.set95);
        let moment = first.moment.as_ref().unwrap();
        assert_eq!(moment.between, between, "{effect}");
        assert!(moment.credible[0] <= moment.between[0] && moment.credible[1] >= moment.between[1], "{effect}: {moment:?}");
        assert_eq!(moment.session.as_deref().unwrap_or_default(), session, "{effect}");
        // It is reported in words and in JSON.
        let written = documents::Diagnosis::of(&told, None);
        let said_so = written.findings[0].moment.as_ref().unwrap();
        assert_eq!((&said_so.between, &said_so.between_95), (&moment.between, &moment.credible), "{effect}");
        let of_session = if sessions { " of session second" } else { "" };
        let [before, after] = between;
        let said = format!(
            "between samples {before} and {after}{of_session} (95 %: {} to {})",
            moment.credible[0], moment.credible[1]
        );
        assert!(sentences(&told).iter().any(|s| s.text.contains(&said)), "{effect}: {said}");
    }
}

#[test]
fn what_these_data_cannot_tell_apart_is_said_with_what_would() {
    let mut told = diagnosed("base_step:2430", Measures::Balls, |_| 3.0);
    // Keep only the step, whichever effect is more probable: its alias is reported as soon as it is named.
    told.findings.retain(|f| f.hypothesis.effect == "base_step");
    (told.verdict, told.set95) = (Verdict::Identified, vec!["base_step".into()]);
    let first = &told.findings[0];
    let moment = first.hypothesis.in_model.strip_prefix("base_step:").unwrap();
    assert_eq!(first.exactly_same, [format!("artifact_step:{moment}")]);
    let called = |id: String| format!("{} ({id})", Registry::catalogue().in_words(&id));
    let [base, artifact] = ["base_step", "artifact_step"].map(|family| called(format!("{family}:{moment}")));
    let said = format!("{base} or {artifact}: aliased in these data; only a look at either from outside");
    assert!(sentences(&told).iter().any(|s| s.text.contains(&said)), "{said}");
    let written = documents::Diagnosis::of(&told, None);
    assert_eq!(written.findings[0].exactly_same, first.exactly_same);
    assert!(written.findings[0].parted_by.as_ref().unwrap().contains("from outside"));
    // With points of the tool as well, the two effects are distinguishable.
    let told = diagnosed("base_step:2430", Measures::Both, |_| 3.0);
    assert!(told.findings[0].exactly_same.is_empty());
}
