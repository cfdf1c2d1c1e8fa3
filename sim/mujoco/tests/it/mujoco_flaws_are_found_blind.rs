//! Flaws that only MuJoCo simulates are found by a diagnosis that shares no code with it: named, or in the set that it
//! declares; and with the ladder's model the robot is as accurate as its noise permits.
//!
//! Each flaw is tried on one robot; the study of 60 robots, `validation/run mujoco_flaws_are_found_blind`, prints the table of
//! docs/validation.md.

use std::ops::RangeInclusive;
use std::path::Path;

use calibench::diagnosis::{Verdict, diagnose};
use calibench::identify::calibration::Calibration;
use calibench::identify::identify;
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::prediction::{PoseSource, WorkspacePoses};
use calibench::residuals::Validation;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::ladder;
use calibench::units::MM;
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Measurements, measure_all};
use calibench_sim::scenario::{Bearing, Friction, MujocoToml, Pedestal, Scenario, Stiffening, load_scenario};
use rayon::prelude::*;

/// Largest error that may remain after a flaw was named and added, relative to that of the robot without it: after the
/// largest stiffening it is 1.20.
const MOST_LEFT: f64 = 1.3;
/// Number of robots with each flaw.
const SEEDS: u64 = 5;
/// Residual of a flaw relative to the noise, above which it must be found.
const VISIBLE: f64 = 4.0;
/// Least number of robots of the study, of 15, that must show a flaw this clearly; with fewer, its sizes are chosen too small.
const ENOUGH: f64 = 4.0;

/// One flaw at three sizes, with its name in the catalogue.
struct Flaw {
    name: &'static str,
    sizes: [f64; 3],
    /// The flaw and its name, for a size and the seed of a robot.
    truth: fn(f64, u64) -> (MujocoToml, String),
}

const PEDESTAL: Flaw = Flaw {
    name: "pedestal, urad/N·m",
    sizes: [2.0, 6.0, 18.0],
    truth: |size, _| {
        let pedestal = Pedestal { x_urad_per_nm: size, y_urad_per_nm: 0.8 * size };
        (MujocoToml { pedestal: Some(pedestal), ..MujocoToml::default() }, "pedestal".into())
    },
};

const BEARING: Flaw = Flaw {
    name: "bearing, urad/N·m",
    sizes: [10.0, 40.0, 120.0],
    truth: |size, seed| {
        let joint = [2, 3, 4][seed as usize % 3];
        let bearing = vec![Bearing { joint, urad_per_nm: size }];
        (MujocoToml { bearing, ..MujocoToml::default() }, format!("bearing_tilt:{joint}"))
    },
};

const FRICTION: Flaw = Flaw {
    name: "friction, lost motion urad",
    sizes: [30.0, 80.0, 240.0],
    truth: |size, seed| {
        let joint = [2, 3, 4, 5][seed as usize % 4];
        // Compliances of Table 8, urad/(N·m).
        let compliance = [0.0, 52.1, 56.5, 152.2, 444.9, 491.5][joint - 1];
        let friction = vec![Friction { joint, torque_nm: size / compliance, presliding_urad: 80.0 }];
        (MujocoToml { friction, ..MujocoToml::default() }, format!("hysteresis:{joint}"))
    },
};

const STIFFENING: Flaw = Flaw {
    name: "stiffening, share at 60 N·m",
    sizes: [0.03, 0.06, 0.1],
    // At joint 3 the model hides too much of it. At the largest size (a quarter of the twist is missing at 100 N·m) the
    // twist is no longer a cubic of the torque, and the diagnosis may say so: unexplained, with stiffening:2 contributing
    // most.
    truth: |size, _| {
        let joint = 2;
        let stiffening = vec![Stiffening { joint, share: size, at_nm: 60.0 }];
        (MujocoToml { stiffening, ..MujocoToml::default() }, format!("stiffening:{joint}"))
    },
};

fn measured(scenario: &Scenario, plans: &Plans, flaw: MujocoToml, seed: u64) -> Measurements {
    let mut truth = scenario.truth().keys().clone();
    truth.mujoco = flaw;
    measure_all(&scenario.with_truth(truth).unwrap(), Streams { seed, trial: 0 }, plans, &mut ()).unwrap()
}

/// Mean position error on the validation poses, mm.
fn error(calibration: &Calibration, validation: &Dataset) -> f64 {
    let prediction = calibration.predict(&[NamedDataset::new("validation", validation)], Use::Validation).unwrap();
    Validation::of(&prediction).unwrap().mean / MM
}

/// Result for one robot.
struct Trial {
    /// Residual of the flaw after the fit, relative to the noise.
    visible: f64,
    /// True if the diagnosis names the flaw or declares a set that contains it; if no single hypothesis explains everything,
    /// true if the flaw contributes most.
    named: bool,
    /// Mean position error on poses not used in the fit, mm.
    before: f64,
    /// The same with the ladder's model, and relative to that of the robot without the flaw; only for robots that show it.
    after: Option<[f64; 2]>,
}

fn trial(scenario: &Scenario, plans: &Plans, flaw: &Flaw, size: f64, seed: u64, floor: f64) -> Trial {
    let model = &scenario.model;
    let (truth, name) = (flaw.truth)(size, seed);
    let Measurements { fit, validation, .. } = measured(scenario, plans, truth, seed);
    let data = [NamedDataset::new("fit", &fit)];
    let found = diagnose(&data, model).unwrap();
    let visible = (found.chi2_per_dof - 1.0).max(0.0).sqrt();
    let q = validation.samples.iter().map(|s| s.q.clone()).collect();
    let poses = WorkspacePoses { q, source: PoseSource::Validation };
    let after = (visible >= VISIBLE).then(|| {
        let ladder = ladder(&data, model, HoldOut { poses: &poses, checks: &[], worker: None }).unwrap();
        let after = error(&ladder.recommended().calibration, &validation);
        [after, after / floor]
    });
    Trial {
        visible,
        named: match found.verdict {
            Verdict::Unexplained => found.contributions.first().is_some_and(|c| c.effect == name),
            _ => {
                found.set95.iter().any(|id| *id == name)
                    || found.findings.first().is_some_and(|f| f.hypothesis.in_model == name)
            }
        },
        before: error(&identify(&data, model).unwrap(), &validation),
        after,
    }
}

/// Error of a robot without any flaw, measured and calibrated in the same way.
fn floor(scenario: &Scenario, plans: &Plans, seed: u64) -> f64 {
    let plain = measured(scenario, plans, MujocoToml::default(), seed);
    error(&identify(&[NamedDataset::new("fit", &plain.fit)], &scenario.model).unwrap(), &plain.validation)
}

/// Judges robots with one flaw at each of `sizes`, one a seed; prints a row a size.
fn judge(flaw: &Flaw, sizes: &[f64], seeds: RangeInclusive<u64>, enough: f64) {
    let mut scenario =
        load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/mujoco-pedestal.toml")).unwrap();
    scenario.mujoco = Some(calibench_mujoco::make_plant);
    let plans = Plans::new(&scenario, 1).unwrap();
    let floors: Vec<(u64, f64)> = seeds.into_par_iter().map(|seed| (seed, floor(&scenario, &plans, seed))).collect();
    let robots = floors.len();
    println!("without a flaw: {:.4} mm", floors.iter().map(|(_, floor)| floor).sum::<f64>() / robots as f64);
    println!(
        "{:30} {:>6} {:>8} {:>6} {:>7} {:>7} {:>12}",
        "flaw", "size", "visible", "named", "before", "after", "after/floor"
    );
    let mut seen = Vec::new();
    for &size in sizes {
        let trials: Vec<Trial> =
            floors.par_iter().map(|(seed, floor)| trial(&scenario, &plans, flaw, size, *seed, *floor)).collect();
        let mean = |of: &dyn Fn(&Trial) -> Option<f64>| {
            let all: Vec<f64> = trials.iter().filter_map(of).collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        // With no robot that shows the flaw clearly there is nothing to report.
        let or_dash = |value: f64| if value.is_nan() { "-".to_owned() } else { format!("{value:.4}") };
        println!(
            "{:30} {size:6} {:8.2} {:3}/{robots} {:7.4} {:>7} {:>12}",
            flaw.name,
            mean(&|t| Some(t.visible)),
            trials.iter().filter(|t| t.named).count(),
            mean(&|t| Some(t.before)),
            or_dash(mean(&|t| t.after.map(|[after, _]| after))),
            or_dash(mean(&|t| t.after.map(|[_, ratio]| ratio))),
        );
        seen.extend(trials.iter().filter_map(|t| t.after.map(|[_, ratio]| (t.named, ratio))));
    }
    let robots = seen.len() as f64;
    let named = seen.iter().filter(|(named, _)| *named).count() as f64 / robots;
    let ratio = seen.iter().map(|(_, ratio)| ratio).sum::<f64>() / robots;
    println!(
        "{}: of {robots} robots that show it {named:.2} are named; afterwards they are at {ratio:.2} of the floor",
        flaw.name
    );
    assert!(robots >= enough && named >= 0.9 && ratio < MOST_LEFT, "{}", flaw.name);
}

/// One robot with the flaw at its largest.
fn judge_one(flaw: &Flaw) {
    judge(flaw, &flaw.sizes[2..], 1..=1, 1.0);
}

#[test]
fn a_pedestal_is_named_and_taken_away() {
    judge_one(&PEDESTAL);
}

#[test]
fn a_bearing_is_named_and_taken_away() {
    judge_one(&BEARING);
}

#[test]
fn friction_is_named_and_taken_away() {
    judge_one(&FRICTION);
}

#[test]
fn stiffening_is_named_and_taken_away() {
    judge_one(&STIFFENING);
}

#[test]
#[ignore = "a study of 60 robots: validation/run mujoco_flaws_are_found_blind"]
fn each_is_named_and_taken_away() {
    for flaw in [PEDESTAL, BEARING, FRICTION, STIFFENING] {
        judge(&flaw, &flaw.sizes, 1..=SEEDS, ENOUGH);
    }
}
