//! Mistakes that were met in the field, in small: each is named, and none is taken for the arm or for noise.

use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::import::{ImportOptions, import};
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::residuals::misfit::{Cause, abnormal, data_fit};

fn folder(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/slips").join(name)
}

fn table(name: &str) -> Result<Dataset, String> {
    let options = ImportOptions { map: Some(folder(name).join("map.toml")), ..ImportOptions::default() };
    import("generic", &[folder(name).join("t.csv")], &options).map(|(dataset, _)| dataset).map_err(|e| e.to_string())
}

#[test]
fn a_mistake_that_was_met_is_named() {
    let tables = [
        ("constant_joints", "joints_constant"),
        ("frozen_joints", "joints_frozen:"),
        ("gon", "orientation_unit"),
        ("left_handed", "left_handed"),
        ("flipped_row", "sample:"),
        ("orientation_of_the_base", "orientation_frame"),
        ("quaternion_order", "orientation_form"),
        ("copied_target", "copied:"),
        ("target_in_metres", "unit:target:b"),
        ("target_elsewhere", "target:c"),
        ("one_anchor_elsewhere", "anchor:a1"),
        ("scale_of_distances", "scale:distances"),
    ];
    let datasets = [
        ("stale_camera", "joints_constant"),
        ("camera_scale", "scale:points"),
        ("pendant_minus", "joint_coupled:3:2"),
        ("pendant_plus", "joint_coupled:3:2"),
        ("normalised_joints", "joint_scales"),
    ];
    let read = |name: &str| read_dataset(&folder(name)).map_err(|e| e.to_string());
    let all = tables.iter().map(|(n, s)| (n, s, table(n))).chain(datasets.iter().map(|(n, s)| (n, s, read(n))));
    let mut wrong = Vec::new();
    for (name, slip, dataset) in all {
        let found = dataset.map(|d| data_fit(&[NamedDataset::new("", &d)], Use::All).pop().and_then(|f| f.misfit));
        let is_named = matches!(&found, Ok(Some(m)) if m.cause != Cause::Unknown && m.slips[0].slip.starts_with(slip));
        if !is_named {
            wrong.push(format!("{name}: {found:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A joint that moved and was not recorded.
#[test]
fn a_joint_that_never_changes_is_named() {
    let mut data = table("target_elsewhere").unwrap();
    data.samples.retain(|s| s.tool_target.is_none());
    let fits = |data: &Dataset| data_fit(&[NamedDataset::new("", data)], Use::All).remove(0).misfit;
    assert!(fits(&data).is_none());
    data.samples.iter_mut().for_each(|s| s.q[2] = 0.5);
    let misfit = fits(&data).expect("the forearm stood still in the table alone");
    assert_eq!(misfit.slips[0].slip, "joint_constant:3");
}

/// One anchor cannot tell a left-handed frame, and has several minima.
#[test]
fn a_ball_bar_is_right() {
    let bar = table("ball_bar").unwrap();
    let fit = data_fit(&[NamedDataset::new("", &bar)], Use::All).remove(0);
    assert!(fit.misfit.is_none() && fit.nominal.residual < 1e-3, "{fit:?}");
}

#[test]
fn poses_of_one_orientation_are_refused_at_import() {
    let error = table("one_orientation").expect_err("base and tool cannot be told apart");
    assert!(error.contains("all poses have one orientation") && error.contains("two axes"), "{error}");
}

/// What is asked again is fitted without some of what was fitted before, which must not stay where it was.
#[test]
fn touches_of_one_pin_that_are_asked_again_are_read_back() {
    let dataset = read_dataset(&folder("one_pin")).expect("a dataset");
    let calibration = identify(&[NamedDataset::new("", &dataset)], &Model::default()).expect("a calibration");
    let abnormal = abnormal(&calibration);
    assert_eq!(abnormal.first().and_then(|a| a.zero_of), Some(4), "{abnormal:?}");
}
