//! Public measurements come in row by row, in our convention, with an initial base and tool that are right.
//!
//! The files are in `tests/data`.

use std::path::{Path, PathBuf};

use calibench::import::{Holdout, HoldoutChoice, ImportError, ImportOptions, import};
use calibench::measure::dataset::file::{read_dataset, write_dataset};
use calibench::measure::dataset::{Dataset, Measured, Sample, SampleSet};
use calibench::robot::kinematics::world_from_tool;
use calibench::units::{DEG, MM};
use nalgebra::Vector3;

use crate::oracles::data;

fn ur10() -> [PathBuf; 2] {
    let root = data("ur10-ipa");
    [root.join("Series_A/measurements_grid.csv"), root.join("Series_B/measurements_joint_configurations.csv")]
}

fn ur5() -> [PathBuf; 2] {
    let root = data("ur5-jacobi");
    [root.join("3D_UR5_uncalibrated_grid_cleaned.csv"), root.join("3D_UR5_uncalibrated_random_cleaned.csv")]
}

fn bring(format: &str, files: &[PathBuf], options: &ImportOptions) -> (Dataset, calibench::import::ImportReport) {
    import(format, files, options).unwrap_or_else(|e| panic!("{format}: {e}"))
}

/// Distances between where the nominal arm puts the TCP and where it was, mm.
fn misses<'a>(dataset: &'a Dataset, of: impl Fn(&Sample) -> bool + 'a) -> Vec<f64> {
    let miss = |s: &Sample| {
        let tcp = world_from_tool(&dataset.robot, &dataset.base, &dataset.tool, &s.q).translation.vector;
        match &s.measured {
            Measured::Point(p) => (p - tcp).norm() / MM,
            Measured::Ball { ball, .. } => (dataset.balls[*ball].position - tcp).norm() / MM,
            Measured::Distance { .. } => f64::NAN,
        }
    };
    dataset.samples.iter().filter(|s| of(s)).map(miss).collect()
}

fn rms(misses: &[f64]) -> f64 {
    (misses.iter().map(|m| m * m).sum::<f64>() / misses.len() as f64).sqrt()
}

fn point(sample: &Sample) -> Vector3<f64> {
    match &sample.measured {
        Measured::Point(p) => p / MM,
        other => panic!("{other:?}"),
    }
}

#[test]
fn ur10_campaigns_are_two_sessions() {
    let files = ur10();
    let (dataset, report) = bring("ur10-ipa", &files, &ImportOptions::default());
    assert_eq!((report.rows_read, report.rows_kept, report.skipped.len()), (11_911 + 1_495, 11_911 + 1_495, 0));
    let a = &dataset.samples[1];
    assert_eq!((a.id.as_str(), a.session.as_deref()), ("Series_A:3", Some("Series_A")));
    // Second row of the grid, by hand: 2020-07-14 16:39:24 is 20 s after the first.
    assert!((a.q[0] + 2.14055).abs() < 1e-12 && (a.q[5] + 0.001_878_56).abs() < 1e-12);
    assert!((point(a) - Vector3::new(1685.2797, -1665.3456, -415.81103)).norm() < 1e-9);
    assert_eq!((a.time_s, a.temp_c), (Some(20.0), Some(23.680_000_305_175_8)));
    let b = &dataset.samples[11_911];
    assert_eq!((b.id.as_str(), b.session.as_deref(), b.time_s), ("Series_B:2", Some("Series_B"), None));
    assert!((point(b) - Vector3::new(383.76294, -3240.8734, 201.93157)).norm() < 1e-9);
    let std = dataset.extra_columns.iter().position(|c| c == "extra_std_z_mm").expect("carried through");
    assert_eq!(b.extra[std], "0.0037622");
    assert_eq!(a.extra[std], "");
    assert!(report.notes.iter().any(|n| n.contains("Series_B") && n.contains("time")), "{report}");
    // The grid runs from 2020-07-14 16:39:04 to 2020-07-18 21:27:57, with breaks; its last rows were taken again before, the very last
    // at 2020-07-15 05:01:27.
    let times: Vec<f64> = dataset.samples[..11_911].iter().map(|s| s.time_s.expect("the grid has times")).collect();
    assert_eq!((times[11_910], times.iter().copied().fold(0.0, f64::max)), (44_543.0, 362_933.0));
}

#[test]
fn ur10_stands_where_the_points_say() {
    let files = ur10();
    // Each campaign alone: 3-D RMS of the nominal arm with base and tool fitted is 0.86 mm over both (independent analysis); band for
    // either of them. The same T-Mac on the same arm, months apart: both tools are found in one place.
    let fitted = files.iter().map(|file| bring("ur10-ipa", std::slice::from_ref(file), &ImportOptions::default()).0);
    let fitted: Vec<Dataset> = fitted.collect();
    for dataset in &fitted {
        let rms = rms(&misses(dataset, |_| true));
        println!("{rms:.3} mm, tool {:?} mm", dataset.tool.xyz.map(|v| v / MM));
        assert!((0.4..1.2).contains(&rms), "{rms} mm");
    }
    let apart = (Vector3::from(fitted[0].tool.xyz) - Vector3::from(fitted[1].tool.xyz)).norm() / MM;
    assert!(apart < 1.0, "{apart} mm, as small as what the nominal arm misses by");
}

#[test]
fn ur5_files_share_one_base_and_one_tool() {
    let files = ur5();
    let (dataset, report) = bring("ur5-jacobi", &files, &ImportOptions::default());
    assert_eq!((report.rows_read, report.rows_kept), (1_020, 1_020));
    let in_set = |set| dataset.samples.iter().filter(|s| s.set == set).count();
    assert_eq!((in_set(SampleSet::Fit), in_set(SampleSet::Validation)), (1_000, 20));
    // First row: target minus difference.
    let s = &dataset.samples[0];
    assert!(
        (point(s)
            - Vector3::new(
                -430.327_840_758_850_13 + 2.144_122_241_149_887,
                -6.274_064_762_854_6 + 3.521_262_237_145_400_3,
                -98.636_846_942_807_6 - 0.814_414_942_807_587_7
            ))
        .norm()
            < 1e-9
    );
    assert!((s.q[2] / DEG - 135.397_846_762_763_38).abs() < 1e-9);
    // Nominal arm, base and tool fitted: 0.70 mm (independent analysis). The random poses with the base and tool of the grid miss by as
    // little: one set-up.
    let (grid, random) =
        (rms(&misses(&dataset, |s| s.set == SampleSet::Fit)), rms(&misses(&dataset, |s| s.set == SampleSet::Validation)));
    let alone = bring("ur5-jacobi", &files[1..], &ImportOptions::default()).0;
    println!(
        "grid {grid:.3} mm, random {random:.3} mm, random with its own base and tool {:.3} mm, tool {:?}, base {:?}",
        rms(&misses(&alone, |_| true)),
        dataset.tool.xyz,
        dataset.base
    );
    assert!((0.6..0.8).contains(&grid), "{grid} mm");
    assert!(random < 1.5 * grid, "{random} mm against {grid} mm");
}

#[test]
fn panda_sockets_are_free_balls_in_pairs() {
    let root = data("mukca");
    let panda = root.join("panda_3");
    let (dataset, report) = bring("mukca", std::slice::from_ref(&panda), &ImportOptions::default());
    // Lines of the twelve files (`wc -l`): none has a header.
    assert_eq!(
        (report.rows_read, report.rows_kept),
        (33 + 33 + 31 + 32 + 32 + 34 + 34 + 34 + 32 + 32 + 30 + 30, report.rows_read)
    );
    assert_eq!((dataset.balls.len(), dataset.ball_distances.len(), dataset.robot.joints()), (12, 6, 7));
    assert!(dataset.balls.iter().all(|b| b.free) && dataset.tool_free);
    assert!(dataset.ball_ids().contains(&"backleft/hole_1".to_owned()));
    let s = dataset.samples.iter().find(|s| s.id == "backleft/hole_0:1").expect("the first row");
    assert_eq!(s.q[3], -2.513_134_814_127_001_3);
    // Nominal arm: 2.84 mm with places left out (independent analysis); the sockets come out about 50 mm apart.
    let rms = rms(&misses(&dataset, |_| true));
    println!("{rms:.3} mm, tool {:?} mm", dataset.tool.xyz.map(|v| v / MM));
    assert!((1.0..4.0).contains(&rms), "{rms} mm");
    for d in &dataset.ball_distances {
        let apart = (dataset.balls[d.between[0]].position - dataset.balls[d.between[1]].position).norm() / MM;
        assert!(
            (apart - 50.0).abs() < 5.0,
            "{} and {}: {apart} mm",
            dataset.balls[d.between[0]].id,
            dataset.balls[d.between[1]].id
        );
    }
    // Single files are as good as the folder; two arms are not one.
    let files = ["hole_0.csv", "hole_1.csv"].map(|f| panda.join("backleft").join(f));
    let (pair, _) = bring("mukca", &files, &ImportOptions::default());
    assert_eq!((pair.samples.len(), pair.ball_distances.len()), (63, 1));
    assert!(matches!(import("mukca", &[root], &ImportOptions::default()), Err(ImportError::TwoRobots { .. })));
}

#[test]
fn imports_survive_the_disk() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let imports = [("ur10-ipa", &ur10()[1..]), ("ur5-jacobi", &ur5()[..]), ("mukca", &[data("mukca").join("panda_3")][..])];
    for (format, files) in imports {
        let dataset = bring(format, files, &ImportOptions::default()).0;
        let at = folder.path().join(&dataset.robot.name);
        write_dataset(&dataset, &at).unwrap_or_else(|e| panic!("{e}"));
        let back = read_dataset(&at).unwrap_or_else(|e| panic!("{e}"));
        // What came in through mm and deg goes out the same: the samples agree to the last bit.
        assert_eq!(back.samples, dataset.samples);
        assert_eq!(back.provenance, dataset.provenance);
        assert!(!back.hash.is_empty());
    }
}

/// A table of eight points of a KR6, with four rows that cannot be used.
fn small_table(folder: &Path) -> (PathBuf, PathBuf) {
    let map = "format = \"calibench-import/1\"\n[columns]\n".to_owned()
        + &(1..=6).map(|k| format!("q{k} = {{ column = \"a{k}\", unit = \"deg\" }}\n")).collect::<String>()
        + &["x", "y", "z"].map(|c| format!("{c} = {{ column = \"{c}\", unit = \"m\" }}\n")).concat()
        + "[dataset]\nrobot = \"kr6_r700\"\ntool = { x_mm = 60.0, y_mm = 0.0, z_mm = -125.0 }\n";
    let mut rows = "a1,a2,a3,a4,a5,a6,x,y,z\n".to_owned();
    for k in 0..8 {
        rows += &format!("{},-80,{},10,{},5,0.{k},0.1,0.2\n", 5 * k, 90 - k, 40 + 3 * k);
    }
    rows +=
        "1,-80,90,10,40,5,nan,0.1,0.2\n1,-80,90,10,40,5,,0.1,0.2\n5,-80,89,10,43,5,0.1,0.1,0.2\n7,-80,90,10,40,5,0,1,0.1,0.2\n";
    let (map_path, table) = (folder.join("map.toml"), folder.join("table.csv"));
    std::fs::write(&map_path, map).expect("writable");
    std::fs::write(&table, rows).expect("writable");
    (map_path, table)
}

#[test]
fn rows_without_a_measurement_are_skipped_and_reported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (map, table) = small_table(folder.path());
    let (dataset, report) = bring("generic", &[table], &ImportOptions { map: Some(map), ..Default::default() });
    assert_eq!((report.rows_read, report.rows_kept, dataset.samples.len()), (12, 8, 8));
    let why: Vec<(usize, &str)> = report.skipped.iter().map(|s| (s.line, s.reason.as_str())).collect();
    assert_eq!(
        why,
        [
            (10, "x: `nan` is not a finite number"),
            (11, "x is empty"),
            (12, "the same as line 3"),
            (13, "it has 10 fields, the header 9")
        ]
    );
    assert!(report.to_string().starts_with("12 rows read, 8 kept, 4 skipped\n"), "{report}");
}

#[test]
fn a_share_is_held_out_by_its_seed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (map, table) = small_table(folder.path());
    let held = |seed| {
        let options = ImportOptions {
            map: Some(map.clone()),
            holdout: Some(Holdout { fraction: 0.25, seed, choice: HoldoutChoice::Postures }),
            ..Default::default()
        };
        let (dataset, _) = bring("generic", std::slice::from_ref(&table), &options);
        dataset.samples.iter().map(|s| s.set == SampleSet::Validation).collect::<Vec<bool>>()
    };
    assert_eq!(held(1), held(1));
    assert!((1..20).all(|seed| held(seed).iter().filter(|&&v| v).count() == 2));
    assert!((2..20).any(|seed| held(seed) != held(1)));
}

#[test]
fn what_cannot_be_imported_says_why() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (map, table) = small_table(folder.path());
    let options = ImportOptions { map: Some(map.clone()), ..Default::default() };
    let says = |format: &str, files: &[PathBuf], options: &ImportOptions, text: &str| {
        let error = import(format, files, options).expect_err(text).to_string();
        assert!(error.contains(text), "{error}");
    };
    says("csv", std::slice::from_ref(&table), &options, "there are ur10-ipa, ur5-jacobi, mukca, generic");
    says("generic", &[], &options, "name at least one");
    says("generic", std::slice::from_ref(&table), &ImportOptions::default(), "column map");
    says("generic", &[folder.path().to_owned()], &options, "is a directory");
    says("generic", &[folder.path().join("none.csv")], &options, "check the path");
    says("ur10-ipa", std::slice::from_ref(&table), &options, "there is no such column");
    says("ur5-jacobi", std::slice::from_ref(&table), &options, "joint_1: there is no such column; this file has a1, a2");
    says("mukca", &[folder.path().to_owned()], &options, "hole_0.csv");
    let too_much =
        ImportOptions { holdout: Some(Holdout { fraction: 1.5, seed: 1, choice: HoldoutChoice::Postures }), ..options.clone() };
    says("generic", std::slice::from_ref(&table), &too_much, "between 0 and 1");
    let sets = ImportOptions { sets: vec![SampleSet::Fit; 2], ..options.clone() };
    says("generic", std::slice::from_ref(&table), &sets, "2 sets for 1 files");
    let text = std::fs::read_to_string(&map).expect("written");
    for (good, bad, expected) in [
        (
            "x = { column = \"x\", unit = \"m\" }",
            "x = { column = \"x\", unit = \"deg\" }",
            "map.toml:9: columns.x.unit: `deg` is not a unit of `x`; give one of mm, m, um",
        ),
        ("x = { column = \"x\", unit = \"m\" }", "x = { column = \"x\" }", "columns.x.unit: the unit is missing"),
        ("x = {", "x_mm = {", "columns.x_mm: there is no such quantity; "),
        ("import/1", "import/2", "calibench-import/1"),
        ("kr6_r700", "kr7", "dataset.robot: there is no robot `kr7`"),
        ("[columns]", "decimal = \",\"\n[columns]", "decimal: `,` cannot be the decimal sign here"),
        ("[columns]", "header = false\n[columns]", "give the place as a number"),
        ("x_mm = 60.0", "x = 60.0", "the unit is part of the name"),
        ("\"a1\"", "\"A1\"", "table.csv:1: A1: there is no such column"),
        ("unit = \"deg\"", "unit = \"rad\"", "outside the joint's limits"),
    ] {
        assert!(text.contains(good), "{good}");
        std::fs::write(&map, text.replacen(good, bad, 1)).expect("writable");
        says("generic", std::slice::from_ref(&table), &options, expected);
    }
    std::fs::write(&map, text).expect("writable");
    std::fs::write(&table, "a1,a2,a3,a4,a5,a6,x,y,z\n1,-80,90,10,40,5,?,0.1,0.2\n").expect("writable");
    says("generic", &[table], &options, "none of its 1 rows can be used; the first: x: `?` is not a finite number");
}

#[test]
fn the_example_of_the_documentation_works() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/importing.md")).expect("the page");
    let block = |language: &str, k: usize| {
        let opened = page.split(&format!("```{language}\n")).nth(k + 1).expect("a block");
        opened.split("```").next().unwrap_or_default().to_owned()
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (map, table) = (folder.path().join("map.toml"), folder.path().join("theirs.csv"));
    std::fs::write(&map, block("toml", 0)).expect("writable");
    std::fs::write(&table, block("csv", 0)).expect("writable");
    let (dataset, report) = bring("generic", &[table], &ImportOptions { map: Some(map), ..Default::default() });
    assert_eq!((report.rows_read, report.rows_kept), (5, 4));
    assert_eq!((report.skipped[0].line, report.skipped[0].reason.as_str()), (6, "q5 is empty"));
    let at = folder.path().join("set");
    write_dataset(&dataset, &at).expect("writable");
    // The row that the page shows, as it is written.
    let shown = block("csv", 1);
    let (titles, values) = shown.trim().split_once('\n').expect("two lines");
    let text = std::fs::read_to_string(at.join("samples.csv")).expect("written");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let first: Vec<&str> = lines.next().expect("a row").split(',').collect();
    for (title, value) in titles.split(',').zip(values.split(',')) {
        let place = header.iter().position(|h| *h == title).unwrap_or_else(|| panic!("no column {title}"));
        // A difference of two numbers carries its rounding.
        let same = match (first[place].parse::<f64>(), value.parse::<f64>()) {
            (Ok(written), Ok(shown)) => (written - shown).abs() < 1e-9,
            _ => first[place] == value,
        };
        assert!(same, "{title}: {} against {value}", first[place]);
    }
}
