//! The procedure meets the expectations stated in every scenario.

use std::path::{Path, PathBuf};

use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::run;
use calibench_sim::scenario::{Document, PlantKind, load_scenario};

/// Names of the scenarios: files that state a format; the others are cells that scenarios extend. Expectations of a `[suite]` are
/// checked by the suite, not by a single run.
fn scenarios() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.is_file());
    files.retain(|f| {
        let text = std::fs::read_to_string(f).unwrap();
        text.contains("\nformat =") && !text.contains("\n[suite]")
    });
    let mut names: Vec<String> = files.iter().map(|f| f.file_stem().unwrap().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn meets_its_expectations(name: &str) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenarios/{name}.toml"));
    let document = Document::read(&file).unwrap();
    #[cfg(feature = "mujoco")]
    let document = document.with_mujoco(calibench_mujoco::make_plant);
    let scenario = document.scenario().unwrap();
    assert!(!scenario.expect.is_empty(), "{} expects nothing", file.display());
    if scenario.plant == PlantKind::Mujoco && !cfg!(feature = "mujoco") {
        let why = "built without the feature `mujoco`; tests/run builds with it where Python can be had";
        assert!(std::env::var_os("CALIBENCH_REQUIRE_ALL").is_none(), "{}: {why}", scenario.name);
        println!("skipped: {}, {why}", scenario.name);
        return;
    }
    let streams = Streams { seed: scenario.seed, trial: 0 };
    let result = run(&scenario, Plans::new(&scenario, scenario.seed).unwrap(), streams, &mut ()).unwrap();
    for check in result.checks(&scenario) {
        assert!(check.met(), "{}: {} is {}, not in {:?}", scenario.name, check.name, check.value, check.band);
    }
}

macro_rules! scenarios {
    ($($test:ident: $name:literal,)*) => {
        const TRIED: &[&str] = &[$($name),*];

        $(
            #[test]
            fn $test() {
                meets_its_expectations($name);
            }
        )*
    };
}

scenarios! {
    bent_tool: "bent-tool",
    blind_cable_spring: "blind-cable-spring",
    blind_cross_coupled_wrist: "blind-cross-coupled-wrist",
    blind_gear_defect: "blind-gear-defect",
    blind_smooth_field: "blind-smooth-field",
    blind_suite_mixed: "blind-suite-mixed",
    blind_third_harmonic: "blind-third-harmonic",
    cluttered: "cluttered",
    compliance_missing: "compliance-missing",
    design_artifact: "design-artifact",
    design_fourth_ball: "design-fourth-ball",
    gallery: "gallery",
    gear_ripple: "gear-ripple",
    good_robots: "good-robots",
    loose_tool: "loose-tool",
    mixed: "mixed",
    moved_ball: "moved-ball",
    mujoco_bearing: "mujoco-bearing",
    mujoco_friction: "mujoco-friction",
    mujoco_pedestal: "mujoco-pedestal",
    mujoco_stiffening: "mujoco-stiffening",
    paper: "paper",
    paper_refit: "paper-refit",
    payload_wrong: "payload-wrong",
    perfect: "perfect",
    study_balls: "study-balls",
    study_indicators: "study-indicators",
    study_nulling: "study-nulling",
    study_poses: "study-poses",
    study_rivals: "study-rivals",
    study_robots: "study-robots",
    table8: "table8",
    table8_printed: "table8-printed",
    tilted_pedestal: "tilted-pedestal",
    ur10e_trical: "ur10e-trical",
    ur5e_trical: "ur5e-trical",
    wandering_base: "wandering-base",
    warm_robot: "warm-robot",
}

#[test]
fn no_scenario_is_forgotten() {
    assert_eq!(scenarios(), TRIED);
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
