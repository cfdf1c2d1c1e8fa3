//! A step is located between the samples between which it occurred, and both the sentences and the JSON report it.

use calibench::diagnosis::{Verdict, diagnose};
use calibench::effects::registry::Registry;
use calibench::identify::Model;
use calibench::measure::dataset::{NamedDataset, SampleSet};
use calibench_report::documents;
use calibench_report::sentences;

use crate::effect_cell::{Measures, diagnosed, measured};

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

#[test]
fn the_time_of_a_step_is_known_to_what_was_measured_around_it() {
    // At 2430 s, among the points and balls of every minute, of which those at 2400 s and 2460 s are held out.
    let mut data = measured("base_step:2430", Measures::Both, |_| 3.0);
    for sample in data.samples.iter_mut().filter(|s| ["s039", "s040"].contains(&s.id.as_str())) {
        sample.set = SampleSet::Validation;
    }
    let told = diagnose(&[NamedDataset::new("d", &data)], &Model::of(&["base_frame"])).unwrap();
    let moment = told.findings[0].hypothesis.moment.as_ref().unwrap();
    assert_eq!(
        (moment.between_s, moment.undecided.as_slice()),
        ([2340.0, 2520.0], ["s039", "s040"].map(str::to_owned).as_slice())
    );
    let said = sentences(&told).into_iter().map(|s| s.text).find(|s| s.starts_with("Saw: ")).unwrap();
    assert!(said.starts_with("Saw: base bumped (base_step:"), "{said}");
    assert!(said.contains("), between 2340.0 s and 2520.0 s, between samples s038 and s041 (95 %"), "{said}");
    assert!(said.contains("on which side of it the held-out s039, s040 lie is not known"), "{said}");
    // What moves one ball alone says nothing of the others.
    let mut data = measured("ball_step:b002:4000", Measures::Both, |_| 3.0);
    let is_held_out = |id: &str| ["s066", "s067"].contains(&id);
    data.samples.iter_mut().filter(|s| is_held_out(&s.id)).for_each(|s| s.set = SampleSet::Validation);
    let told = diagnose(&[NamedDataset::new("d", &data)], &Model::of(&["base_frame"])).unwrap();
    let moment = told.findings[0].hypothesis.moment.as_ref().unwrap();
    assert_eq!(moment.undecided, Vec::<String>::new());
}
