//! W8: whole verbs, from datasets that have been read to what is printed: diagnosis of 80 centrings and of 11,911 points of a tracker, a
//! step of the ladder, and what a user of the workbench waits for.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use calibench::assess::{
    Examination, Extrapolation, ProvingGround, WorkspaceError, WorkspacePoses, best_step, data_fit, diagnose_examined, rung,
};
use calibench::identify::{Model, Use};
use calibench::import::{ImportOptions, import};
use calibench::measure::Dataset;
use calibench::report::{Outlook, Recommended, diagnosis_text};
use calibench_sim::opened::Opened;
use calibench_sim::random::Streams;
use calibench_sim::run::{Plans, measure_all};
use calibench_sim::scenario::load_scenario;
use calibench_sim::workbench::{Bench, Place};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use serde_json::Value;

/// What is wrong with the robot of the 80 centrings.
const MISSING: &str = "harmonic:3:202";

/// 80 centrings of the simulated cell, whose robot has a gear that ripples.
fn centred() -> Dataset {
    let scenario = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/gear-ripple.toml")).unwrap();
    let seed = 1;
    let plans = Plans::new(&scenario, seed).unwrap();
    measure_all(&scenario, Streams { seed, trial: 0 }, &plans, &mut ()).unwrap().fit
}

/// The grid of the UR10 among the public data, that `CALIBENCH_DATA` names the folder of.
fn ur10() -> Option<Dataset> {
    let root = std::env::var_os("CALIBENCH_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let file = root.join("ur10-ipa/Series_A/measurements_grid.csv");
    if !file.is_file() {
        println!("SKIPPED: {} is not there; set CALIBENCH_DATA to the folder of the public data", file.display());
        return None;
    }
    Some(import("ur10-ipa", &[file], &ImportOptions::default()).unwrap().0)
}

/// `diagnose`, from the gate to the text.
fn diagnose(named: &[(&str, &Dataset)], model: &Model) -> String {
    assert!(data_fit(named, Use::Fit).iter().all(|fit| fit.misfit.is_none()));
    let examination = Examination::new(named, model).unwrap();
    let diagnosis = diagnose_examined(named, &examination).unwrap();
    let poses = WorkspacePoses::of(named);
    let error = WorkspaceError::predict(named, &examination, &poses.q).unwrap();
    let ranges = examination.problem().joint_ranges();
    let extrapolation = Extrapolation::of(&ranges, examination.model(), poses.q.iter().map(Vec::as_slice));
    let outlook = Ok(Outlook { error: error.unwrap(), source: poses.source, extrapolation });
    diagnosis_text(&diagnosis, &outlook, &Recommended::default(), false)
}

fn verbs(c: &mut Criterion) {
    let small = centred();
    let mut group = c.benchmark_group("W8");
    group.sample_size(10);
    let model = Model::paper();
    let named = [("W8", &small)];
    assert!(diagnose(&named, &model).contains(MISSING));
    group.bench_function("diagnose, 80 centrings", |b| b.iter(|| black_box(diagnose(&named, &model))));
    if let Some(large) = ur10() {
        let named = [("W8", &large)];
        group.bench_function("diagnose, 11,911 points", |b| b.iter(|| black_box(diagnose(&named, &model))));
    }

    let poses = WorkspacePoses::of(&named);
    let ground = ProvingGround { poses: &poses.q, checks: &[] };
    let first = rung(&named, &model, ground).unwrap();
    let step = || best_step(&named, &first, ground, &mut |_| ()).unwrap();
    assert_eq!(step().unwrap().added, [MISSING]);
    group.bench_function("a step of the ladder, 80 centrings", |b| b.iter(|| black_box(step().is_ok())));
    workbench(&mut group, small);
    group.finish();
}

/// What a user waits for; what is undone in between is not timed.
fn workbench(group: &mut BenchmarkGroup<'_, WallTime>, dataset: Dataset) {
    let opened = Opened {
        title: "W8".into(),
        question: None,
        model: Model::default_for(&dataset),
        datasets: vec![("W8".into(), dataset)],
        misfits: Vec::new(),
        judged: None,
        commands: Recommended::default(),
        commands_from: String::new(),
        campaign: None,
        pictures: Vec::new(),
        run: Value::Null,
    };
    let place = Place::new(std::env::temp_dir(), None);
    let Ok(mut bench) = Bench::new(opened, place) else { panic!("the data determine the model") };
    let mut timed = |name: &str, work: &mut dyn FnMut(&mut Bench), after: &mut dyn FnMut(&mut Bench)| {
        group.bench_function(name, |b| {
            b.iter_custom(|times| {
                let mut whole = Duration::ZERO;
                for _ in 0..times {
                    let began = Instant::now();
                    work(&mut bench);
                    whole += began.elapsed();
                    after(&mut bench);
                }
                whole
            });
        });
    };
    let undone = &mut |bench: &mut Bench| _ = bench.undo().ok();
    timed("workbench: add", &mut |bench| assert!(bench.add(MISSING, false).is_ok()), undone);
    timed("workbench: the next experiment", &mut |bench| assert!(bench.next_experiment().is_ok()), &mut |_| ());
}

criterion_group!(benches, verbs);
criterion_main!(benches);
