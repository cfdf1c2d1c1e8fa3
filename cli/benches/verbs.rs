//! W8: whole verbs, from datasets in memory to the printed text: diagnosis of 80 centrings and of 11,911 tracker points, a step
//! of the ladder, the response times of the workbench, and a study.
#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../../tests/it/oracles.rs"]
mod oracles;

use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use calibench::identify::Model;
use calibench::identify::problem::Use;
use calibench::import::{ImportOptions, import};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::prediction::WorkspacePoses;
use calibench::residuals::misfit::data_fit;
use calibench::selection::Advice;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{best_step, ladder_step};
use calibench_lab::study::{Extent, Study, Summary, run};
use calibench_report::{Recommended, diagnosis_tables, next_step_sentences, sentences};
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Methods, measure_all};
use calibench_sim::scenario::{Document, load_scenario};
use calibench_workbench::{Bench, Case, Place};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};

/// The effect missing from the model of the 80 centrings' robot.
const MISSING: &str = "harmonic:3:202";

/// 80 centrings of the simulated cell, whose robot has gear ripple.
fn centred() -> Dataset {
    let scenario = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/gear-ripple.toml")).unwrap();
    let seed = 1;
    let plans = Plans::new(&scenario, seed).unwrap();
    measure_all(&scenario, Streams { seed, trial: 0 }, &plans, &mut ()).unwrap().fit
}

/// The grid of the UR10 among the public data.
fn ur10() -> Dataset {
    let file = oracles::data("ur10-ipa").join("Series_A/measurements_grid.csv");
    import("ur10-ipa", &[file], &ImportOptions::default()).unwrap().0
}

/// `diagnose`, from the gate to the printed text.
fn diagnose(named: &[NamedDataset<'_>], model: &Model) -> String {
    assert!(data_fit(named, Use::Fit).iter().all(|fit| fit.misfit.is_none()));
    let poses = WorkspacePoses::of(named);
    let ground = HoldOut { poses: &poses, checks: &[], worker: None };
    let step = ladder_step(named, model, ground).unwrap();
    let advice = Advice::on(named, &step, ground).unwrap();
    let commands = Recommended::default();
    let said = sentences(&step.diagnosis).into_iter().map(|sentence| sentence.text);
    let said: Vec<String> = said.chain(next_step_sentences(&advice, &step.diagnosis, &commands)).collect();
    said.join("\n") + &diagnosis_tables(&step.diagnosis, false).to_string()
}

fn verbs(c: &mut Criterion) {
    let small = centred();
    let mut group = c.benchmark_group("W8");
    group.sample_size(10);
    let model = Model::paper();
    let named = [NamedDataset::new("W8", &small)];
    assert!(diagnose(&named, &model).contains(MISSING));
    group.bench_function("diagnose, 80 centrings", |b| b.iter(|| black_box(diagnose(&named, &model))));
    let large = ur10();
    group.bench_function("diagnose, 11,911 points", |b| {
        b.iter(|| black_box(diagnose(&[NamedDataset::new("W8", &large)], &model)))
    });

    let poses = WorkspacePoses::of(&named);
    let ground = HoldOut { poses: &poses, checks: &[], worker: None };
    let first = ladder_step(&named, &model, ground).unwrap();
    let step = || best_step(&named, &first, ground).unwrap();
    assert_eq!(step().unwrap().added, [MISSING]);
    group.bench_function("a step of the ladder, 80 centrings", |b| b.iter(|| black_box(step().is_ok())));
    workbench(&mut group, small);
    study(&mut group);
    group.finish();
}

/// The verb `sim study`: its trials on one thread and on two, and the whole of it, from the start of the program to the printed text.
fn study(group: &mut BenchmarkGroup<'_, WallTime>) {
    /// Number of trials: several batches, on one thread or two.
    const TRIALS: u64 = 200;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/table8.toml");
    let study = Study::new(&Document::read(&file).unwrap(), Methods::Trical, false, &|_, _| {}).unwrap();
    let header = csv::Reader::from_reader(&study.columns.header()[..]).headers().unwrap().clone();
    let trials = || {
        let mut summary = Summary::new(&header).unwrap();
        let extent = Extent { first: 1, trials: TRIALS };
        run(&study, extent, None, |lines| summary.add_lines(lines), &|| ()).unwrap();
        assert_eq!(summary.points[0].methods[0].done, TRIALS);
        summary
    };
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let name = format!("study, {TRIALS} TriCal trials, threads: {threads}");
        group.bench_function(name, |b| b.iter(|| black_box(pool.install(trials))));
    }
    group.bench_function(format!("study --method trical --trials {TRIALS}"), |b| {
        b.iter(|| {
            let mut verb = Command::new(env!("CARGO_BIN_EXE_calibench"));
            verb.args(["sim", "study"]).arg(&file).args(["--method", "trical", "--trials", &TRIALS.to_string()]);
            assert!(verb.output().unwrap().status.success());
        });
    });
}

/// Actions for which a user waits; undoing them in between is not timed.
fn workbench(group: &mut BenchmarkGroup<'_, WallTime>, dataset: Dataset) {
    let case = Case::of_datasets(&[], vec![("W8".into(), dataset)], None).unwrap();
    let place = Place::new(std::env::temp_dir(), None);
    let Ok(bench) = Bench::new(case, place) else { panic!("the data determine the model") };
    let bench = Arc::new(bench);
    // What is computed in the background, as in the served workbench.
    let worker = bench.clone();
    std::thread::spawn(move || worker.work());
    let mut timed = |name: &str, work: &dyn Fn(&Bench), after: &dyn Fn(&Bench)| {
        group.bench_function(name, |b| {
            b.iter_custom(|times| {
                let mut whole = Duration::ZERO;
                for _ in 0..times {
                    let began = Instant::now();
                    work(&bench);
                    whole += began.elapsed();
                    after(&bench);
                }
                whole
            });
        });
    };
    let undone = &|bench: &Bench| _ = bench.turn(-1).ok();
    // Its set is kept after the first time.
    timed("workbench: switch back", &|bench| assert!(bench.switch(MISSING, true, false).is_ok()), undone);
    timed("workbench: the next experiment", &|bench| assert!(bench.next_experiment().is_ok()), &|_| ());
}

criterion_group!(benches, verbs);
criterion_main!(benches);
