//! `effects prove` divides measurements, and keeps every division as rows for comparison with other regressors: the error of the
//! default model in such a file is the error stated by the proof.

use crate::oracles;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::program::{calibench, done, run_of};
use serde_json::Value;

/// Precision of the errors in the files, mm.
const NANOMETRE: f64 = 1e-6;

/// Largest distance of balls from the mean of their rows, mm, caused by known distances between them.
const HELD: f64 = 0.01;

/// Runs `effects prove` with `--rows`, checks every file against its proof, and counts the proofs of each kind of division.
fn proved(folder: &Path, arguments: &[&str]) -> BTreeMap<String, usize> {
    let v: Value =
        serde_json::from_str(&done(folder, &[&["effects", "prove", "--json", "--rows", "rows"], arguments].concat())).unwrap();
    let mut kinds = BTreeMap::new();
    let mut files = BTreeSet::new();
    for proof in v["proofs"].as_array().unwrap() {
        *kinds.entry(proof["division"].as_str().unwrap().to_owned()).or_insert(0) += 1;
        let path = proof["rows"].as_str().unwrap();
        assert!(files.insert(path.to_owned()), "{path} is two divisions");
        let rows = Rows::read(&folder.join(path));
        let default = proof["default_mm"].as_f64().unwrap();
        let rms = rows.rms("judged");
        assert!((rms - default).abs() < NANOMETRE, "{path}: {rms} and {default}");
        let postures = ["fitted", "judged"].map(|part| rows.postures(part));
        assert!(postures[0].is_disjoint(&postures[1]), "{path}: a posture is fitted and judged");
        assert_eq!(proof["postures"], serde_json::json!(postures.map(|p| p.len())), "{path}");
    }
    kinds
}

/// A file of rows, by column name.
struct Rows(Vec<BTreeMap<String, String>>);

impl Rows {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned));
        let names: Vec<String> = lines.next().unwrap().collect();
        Rows(lines.map(|fields| names.iter().cloned().zip(fields).collect()).collect())
    }

    fn of<'a>(&'a self, part: &'a str) -> impl Iterator<Item = &'a BTreeMap<String, String>> {
        self.0.iter().filter(move |row| row["part"] == part)
    }

    fn rms(&self, part: &str) -> f64 {
        let square = |row: &BTreeMap<String, String>| -> f64 {
            ["x", "y", "z"].iter().map(|axis| row[&format!("error_{axis}_mm")].parse::<f64>().unwrap().powi(2)).sum()
        };
        (self.of(part).map(square).sum::<f64>() / self.of(part).count() as f64).sqrt()
    }

    fn postures(&self, part: &str) -> BTreeSet<usize> {
        self.of(part).map(|row| row["posture"].parse().unwrap()).collect()
    }
}

#[test]
fn rows_of_postures_blocks_and_campaigns_leave_what_the_proof_says() {
    let folder = run_of("table8.toml");
    let kinds = proved(
        folder.path(),
        &["run/tracker", "run/trical", "--folds", "2", "--blocks", "2", "--short", "60", "--draws", "1", "--campaigns"],
    );
    let expected = [("postures", 4), ("blocks", 4), ("short", 2), ("campaigns", 2)].map(|(kind, n)| (kind.to_owned(), n));
    assert_eq!(kinds, BTreeMap::from(expected));
    let rows = Rows::read(&folder.path().join("rows/tracker-robot-of-trical.csv"));
    assert_eq!((rows.of("fitted").count(), rows.of("judged").count()), (80, 30), "fifty poses tell where the robot stands");
    assert!(rows.0.iter().all(|row| row["free_ball"].is_empty()), "the balls are certified");
    let output = calibench(folder.path(), &["effects", "prove", "run/tracker", "--folds", "0"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("nothing to divide"), "{said}");
    let output = calibench(folder.path(), &["effects", "prove", "run/tracker", "--folds", "0", "--short", "5", "--draws", "1"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("tracker, 5 postures, draw 1: 15 residuals"), "{said}");
}

#[test]
fn balls_of_a_place_left_out_stand_where_its_rows_say() {
    let folder = tempfile::tempdir().unwrap();
    let arm = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/robots/iiwa14.robot.toml");
    let (sockets, arm) = (oracles::data("mukca").join("kuka_14"), arm.display().to_string());
    done(folder.path(), &["import", "mukca", &sockets.display().to_string(), "--robot", &arm, "-o", "iiwa14"]);
    let kinds = proved(folder.path(), &["iiwa14", "--folds", "0", "--places"]);
    assert_eq!(kinds, BTreeMap::from([("places".to_owned(), 3)]));
    let rows = Rows::read(&folder.path().join("rows/iiwa14-place-front.csv"));
    let seen: BTreeSet<&str> = rows.of("fitted").map(|row| row["free_ball"].as_str()).collect();
    let mut mean: BTreeMap<&str, ([f64; 3], f64)> = BTreeMap::new();
    for row in rows.of("judged") {
        let (sum, count) = mean.entry(row["free_ball"].as_str()).or_default();
        ["x", "y", "z"].iter().zip(sum).for_each(|(axis, s)| *s += row[&format!("error_{axis}_mm")].parse::<f64>().unwrap());
        *count += 1.0;
    }
    for (ball, (sum, count)) in mean {
        assert!(!ball.is_empty() && !seen.contains(ball), "{ball}");
        assert!(sum.iter().all(|s| (s / count).abs() < HELD), "{ball}: {sum:?}");
    }
}
