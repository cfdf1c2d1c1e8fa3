//! A family that a third party registers is called by its words, explained and offered wherever those of the catalogue are.

use calibench::diagnosis::{Verdict, diagnose};
use calibench::effects::registry::Registry;
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::prediction::WorkspacePoses;
use calibench::residuals::comparison::Comparison;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{LadderProgress, observed_ladder};
use calibench_report::{
    Page, PageModel, PageSubject, Views, diagnosis_tables, each_called, lacking_sentence, ladder_step_sentence, sentences,
};
use calibench_workbench::{Bench, Case, Place};
use serde_json::{Value, json};

use crate::own_effect::{HOSE_PULL, campaign};

const ID: &str = "hose_pull:1";
const WORDS: &str = "pull of the hoses on joint 1";
const CALLED: &str = "pull of the hoses on joint 1 (hose_pull:1)";

/// A campaign of an arm whose hoses pull joint 1 back, and a model that knows of such an effect and does not have it.
fn lacking() -> (Dataset, Model) {
    let registry = Registry::default().with(&HOSE_PULL).unwrap();
    (campaign().unwrap(), Model { registry, ..Model::geometry() })
}

#[test]
fn sentences_of_diagnosis_comparison_and_ladder_call_it_by_its_words() {
    let (data, model) = lacking();
    let data = [NamedDataset::new("campaign", &data)];
    let found = diagnose(&data, &model).unwrap();
    assert_eq!((found.verdict, &found.set95[..]), (Verdict::Identified, &[ID.into()][..]));
    let said: String = sentences(&found).iter().map(|s| format!("{}\n", s.text)).collect();
    for text in [CALLED, HOSE_PULL.meaning.physics, HOSE_PULL.meaning.intervention.act] {
        assert!(said.contains(text), "{text}: {said}");
    }
    // It has no page in the gallery, which shows the catalogue.
    assert!(!said.contains("docs/gallery/hose_pull"), "{said}");
    assert!(diagnosis_tables(&found, false).to_string().contains(WORDS));
    assert!(lacking_sentence(&found).unwrap().to_lowercase().contains(CALLED));

    let compared = Comparison::of(&identify(&data, &model).unwrap(), &data, Use::Fit).unwrap();
    let of_joint = compared.sentences().into_iter().find(|s| s.starts_with("Joint 1 against the angle")).unwrap();
    assert!(of_joint.contains(CALLED), "{of_joint}");

    let poses = WorkspacePoses::of(&data);
    let mut told = Vec::new();
    let ladder = observed_ladder(&data, &model, HoldOut { poses: &poses, checks: &[], worker: None }, &mut |progress| {
        if let LadderProgress::Trying(effect) = &progress {
            told.push(each_called(&model.registry, effect));
        }
        std::ops::ControlFlow::<std::convert::Infallible>::Continue(())
    });
    let std::ops::ControlFlow::Continue(ladder) = ladder.unwrap();
    assert_eq!(told.first().map(String::as_str), Some(CALLED));
    assert!(ladder_step_sentence(&ladder.steps[1]).starts_with(&format!("+ {CALLED}:")));
}

#[test]
fn the_page_and_the_workbench_have_its_name_and_meaning() {
    let (data, model) = lacking();
    let explained = |meanings: &Value| {
        let meaning = &meanings[ID];
        assert_eq!(meaning["name"], WORDS);
        assert_eq!(meaning["what"], HOSE_PULL.what);
        assert_eq!(meaning["physics"], HOSE_PULL.meaning.physics);
        assert_eq!(meaning["gallery"], Value::Null);
    };
    let case = Case { model, ..Case::of_datasets(&[], vec![("campaign".into(), data)], None).unwrap() };
    let page = case.subject(&[0], &case.model, &case.commands, |subject: &PageSubject<'_>| {
        let page_model = PageModel::new(subject).unwrap();
        let views = Views::new(subject, &page_model).unwrap();
        Page::of(subject, &page_model, json!(null), &views).unwrap()
    });
    explained(&page.document["meanings"]);
    assert_eq!(page.document["verdict"]["headline"], format!("Missing in the model: {WORDS}"));

    let folder = tempfile::tempdir().unwrap();
    let Ok(bench) = Bench::new(case, Place::new(folder.path().into(), None)) else { panic!("the model can be fitted") };
    explained(&bench.document().unwrap()["document"]["meanings"]);
    bench.switch(ID, true, false).unwrap();
    let document = bench.document().unwrap();
    let switches = document["live"]["switches"].as_array().unwrap();
    assert_eq!(switches.iter().find(|s| s["effect"] == ID).unwrap()["words"], WORDS);
    explained(&document["document"]["meanings"]);
}
