//! The procedure meets the expectations stated in every scenario.

use std::path::{Path, PathBuf};

use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::run;
use calibench_sim::scenario::PlantKind;
use calibench_sim::scenario::load_scenario;

/// Scenario files: those that state a format; the others are cells that scenarios extend. Expectations of a `[suite]` are
/// checked by the suite, not by a single run.
fn scenarios() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| {
        let text = std::fs::read_to_string(f).unwrap();
        text.contains("\nformat =") && !text.contains("\n[suite]")
    });
    files.sort();
    files
}

#[test]
fn every_expectation_is_met() {
    #[cfg(feature = "mujoco")]
    calibench_mujoco::provide();
    let files = scenarios();
    assert!(files.len() >= 20, "perfect, table8, paper, mixed, seven with one cause each, five blind ones, four by MuJoCo");
    for file in files {
        let scenario = load_scenario(&file).unwrap();
        assert!(!scenario.expect.is_empty(), "{} expects nothing", file.display());
        if scenario.plant == PlantKind::Mujoco && !cfg!(feature = "mujoco") {
            let why = "built without the feature `mujoco`; tests/run builds with it where Python can be had";
            assert!(std::env::var_os("CALIBENCH_REQUIRE_ALL").is_none(), "{}: {why}", scenario.name);
            println!("skipped: {}, {why}", scenario.name);
            continue;
        }
        let streams = Streams { seed: scenario.seed, trial: 0 };
        let result = run(&scenario, Plans::new(&scenario, scenario.seed).unwrap(), streams, &mut ()).unwrap();
        for check in result.checks(&scenario) {
            assert!(check.met(), "{}: {} is {}, not in {:?}", scenario.name, check.name, check.value, check.band);
        }
    }
}

#[test]
fn with_nothing_wrong_every_estimate_is_zero_within_its_sigma() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let scenario = load_scenario(&folder.join("perfect.toml")).unwrap();
    let result = run(&scenario, Plans::new(&scenario, 1).unwrap(), Streams { seed: 1, trial: 0 }, &mut ()).unwrap();
    // The largest of 31 normal numbers exceeds 3.9 sigma once in 300 seeds.
    for p in &result.trical.score.parameters {
        assert!(p.z().abs() < 3.9, "{} is {} sigma from the drawing", p.name, p.z());
    }
}
