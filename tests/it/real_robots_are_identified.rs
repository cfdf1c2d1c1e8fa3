//! Three robots that other people measured are identified as well as an independent analysis of the same data found possible.
//!
//! The files are in `tests/data`. Run with `--nocapture` to see the table.

use std::path::PathBuf;

use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::import::{Holdout, HoldoutChoice, ImportOptions, import};
use calibench::measure::dataset::{Dataset, NamedDataset, SampleSet};
use calibench::residuals::Validation;
use calibench::robot::FramePose;
use calibench::units::{DEG, MM};

use crate::a_printed_socket_names_the_joint::{places, spread_at_places_left_out};
use crate::oracles::data;

/// Tolerance, as a ratio: the choice of rows changes the third digit of a mean over 4,000.
const SAME: f64 = 1.03;

fn bring(format: &str, files: &[PathBuf], options: &ImportOptions) -> Dataset {
    import(format, files, options).unwrap_or_else(|e| panic!("{format}: {e}")).0
}

fn ur10() -> Dataset {
    let root = data("ur10-ipa");
    let files = [root.join("Series_A/measurements_grid.csv"), root.join("Series_B/measurements_joint_configurations.csv")];
    let holdout = Some(Holdout { fraction: 0.3, seed: 1, choice: HoldoutChoice::Postures });
    bring("ur10-ipa", &files, &ImportOptions { holdout, ..ImportOptions::default() })
}

fn ur5() -> Dataset {
    let root = data("ur5-jacobi");
    let files = ["3D_UR5_uncalibrated_grid_cleaned.csv", "3D_UR5_uncalibrated_random_cleaned.csv"].map(|f| root.join(f));
    bring("ur5-jacobi", &files, &ImportOptions::default())
}

fn panda() -> Dataset {
    bring("mukca", &[data("mukca").join("panda_3")], &ImportOptions::default())
}

/// Models to fit, in addition to the tool and the balls that the datasets leave free.
fn models() -> [(&'static str, Model); 3] {
    let geometry = Model::of(&["base_frame", "mdh"]);
    [("base and tool", Model::of(&["base_frame"])), ("+ geometry", geometry), ("+ compliance", Model::paper())]
}

fn validate(dataset: &Dataset, model: &Model, anew: bool) -> Validation {
    let calibration = identify(&[NamedDataset::new("data", dataset)], model).unwrap_or_else(|e| panic!("{e}"));
    let judged = if anew { calibration.set_up_anew() } else { calibration };
    let prediction = judged.predict(&[NamedDataset::new("data", dataset)], Use::Validation).unwrap_or_else(|e| panic!("{e}"));
    Validation::of(&prediction).expect("rows are held out")
}

fn row(robot: &str, what: &str, model: &str, value: f64, bar: f64) {
    println!("| {robot:8} | {what:38} | {model:14} | {value:9.4} | {bar:5.3} |");
    assert!(value <= bar, "{robot}, {model}: {value} mm, above the bar of {bar} mm");
}

#[test]
fn ur10_of_two_campaigns() {
    let dataset = ur10();
    for ((model, effects), bar) in models().into_iter().zip([0.863, 0.448, 0.425]) {
        let v = validate(&dataset, &effects, false);
        assert_eq!(v.samples, 4_029);
        row("UR10", "30 % held out, rms, mm", model, v.rms / MM, bar * SAME);
    }
}

/// The probe is on the axis of joint 6, so positions alone say nothing of its angle, and nothing of theta 5 and d 5 beside the tool.
#[test]
fn ur10_by_poses() {
    let poses = ur10();
    let turned = |model: &Model| validate(&poses, model, false).orientation.expect("orientations are held out").rms / DEG;
    let [(_, nominal), (_, geometry), _] = models();
    let (before, after) = (turned(&nominal), turned(&geometry));
    println!("| UR10     | 30 % held out, orientation, rms, deg   | {before:.4} before, {after:.4} after");
    assert!(before > 0.11 && after < 0.06, "orientations held out: {before} deg before, {after} deg after");
    let mut points = poses.clone();
    points.samples.iter_mut().for_each(|s| s.orientation = None);
    let known = |data: &Dataset, name: &str| {
        let calibration = identify(&[NamedDataset::new("data", data)], &geometry).unwrap_or_else(|e| panic!("{e}"));
        calibration.estimate(name).map(|e| (e.value, e.sigma))
    };
    for name in ["theta5", "d5"] {
        assert_eq!(known(&points, name), None, "{name} by positions");
        let (value, sigma) = known(&poses, name).unwrap_or_else(|| panic!("{name} by poses"));
        assert!(value.is_finite() && sigma > 0.0, "{name}");
    }
    // With the gear of joint 6 in the model, positions leave its size as believed.
    let gear = Model::of(&["base_frame", "mdh", "harmonic1:6"]);
    let sigma = |data: &Dataset| {
        identify(&[NamedDataset::new("data", data)], &gear).unwrap().estimate("harmonic1:6.sin").map(|e| e.sigma_noise)
    };
    let (by_poses, by_points) = (sigma(&poses).expect("poses show joint 6"), sigma(&points));
    assert!(by_points.is_none_or(|s| s > 5.0 * by_poses), "{by_points:?} rad by points, {by_poses} by poses");
}

#[test]
fn ur5_grid_to_random_poses() {
    let dataset = ur5();
    for ((model, effects), bar) in models().into_iter().zip([0.75, 0.105, 0.105]) {
        let v = validate(&dataset, &effects, false);
        assert_eq!((v.samples, v.refitted.len() + v.from_fit_rows.len()), (20, 0));
        row(
            "UR5",
            "20 random poses, frames of the grid, mean",
            model,
            v.mean / MM,
            if model == "base and tool" { 1.0 } else { bar },
        );
        // As the reference does it: base and tool fitted to the twenty poses themselves.
        let mut alone = dataset.clone();
        alone.samples.retain(|s| s.set == SampleSet::Validation);
        let calibration =
            identify(&[NamedDataset::new("grid", &dataset)], &effects).unwrap_or_else(|e| panic!("{e}")).set_up_anew();
        let prediction =
            calibration.predict(&[NamedDataset::new("random", &alone)], Use::Validation).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(prediction.refitted.len(), 9, "{:?}", prediction.refitted);
        let v = Validation::of(&prediction).expect("twenty");
        row("UR5", "20 random poses, frames refitted, mean", model, v.mean / MM, bar);
    }
}

#[test]
fn panda_with_one_place_left_out() {
    let dataset = panda();
    assert_eq!(places(&dataset).len(), 6);
    for ((model, effects), bar) in models().into_iter().zip([2.84 * SAME, 0.22, 0.18]) {
        let spread = spread_at_places_left_out(&dataset, &effects);
        row("Panda 3", "a place left out, spread of the ball", model, spread / MM, bar);
    }
}

/// A base that says nothing: half a turn and metres from wherever the robot stood.
fn absurd(base: &FramePose) -> FramePose {
    let mut absurd = *base;
    absurd.xyz = [base.xyz[0] - 4.0, base.xyz[1] + 7.0, base.xyz[2] + 2.5];
    absurd.rz_ry_rx[0] += 180.0 * DEG;
    absurd
}

#[test]
fn an_absurd_base_changes_nothing() {
    for (name, dataset) in [("UR10", ur10()), ("UR5", ur5()), ("Panda 3", panda())] {
        let astray = Dataset { base: absurd(&dataset.base), ..dataset.clone() };
        let fits = [&dataset, &astray]
            .map(|d| identify(&[NamedDataset::new("data", d)], &Model::paper()).unwrap_or_else(|e| panic!("{name}: {e}")));
        println!("{name}: {:.6} mm with the base given, {:.6} mm with an absurd one", fits[0].rms / MM, fits[1].rms / MM);
        // A nanometre: both stand at the same minimum.
        assert!((fits[0].rms - fits[1].rms).abs() < 1e-9, "{name}");
        let names = |k: usize| fits[k].estimates.iter().map(|e| e.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(0), names(1), "{name}: the same parameters are determined");
        for e in fits[0].estimates.iter().filter(|e| e.effect == "mdh" || e.effect == "joint_compliance") {
            let other = fits[1].estimate(&e.name).map(|o| o.value).unwrap_or(f64::NAN);
            assert!((e.value - other).abs() < 1e-2 * e.sigma, "{name}, {}: {} and {other}, sigma {}", e.name, e.value, e.sigma);
        }
    }
}
