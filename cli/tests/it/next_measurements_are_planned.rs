//! `plan next` plans measurements that the cell then makes, the same on any number of threads, and rejects a cell other than the
//! data's.

use std::path::Path;
use std::process::{Command, Output};

use calibench::measure::dataset::file::read_dataset;
use calibench::measure::poses::read_plan;

/// Few poses, and lost motion that other effects of the catalogue can imitate.
const AMBIGUOUS: &str = r#"format = "calibench-scenario/1"
extends = "SCENARIOS/table8.toml"
name = "ambiguous"
question = "What do few poses leave open?"
seed = 5

[plan]
poses_per_ball = 10
reserves_per_ball = 1
pool_per_ball = 200
starts = 1

[truth.effects."gravity_backlash:5"]
b_urad = 60.0
"#;

fn calibench(folder: &Path, arguments: &[&str], threads: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.args(arguments).current_dir(folder).env("RAYON_NUM_THREADS", threads).output().unwrap()
}

fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn the_plan_of_next_is_measured() {
    let folder = tempfile::tempdir().unwrap();
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let text = AMBIGUOUS.replace("SCENARIOS", &scenarios.to_string_lossy());
    std::fs::write(folder.path().join("cell.toml"), &text).unwrap();
    done(&calibench(folder.path(), &["measure", "cell.toml", "-o", "data"], "2"));

    let next = ["plan", "next", "data", "--scenario", "cell.toml", "-o", "next.toml", "--json"];
    let told = done(&calibench(folder.path(), &next, "2"));
    let plan = std::fs::read(folder.path().join("next.toml")).unwrap();
    let again = done(&calibench(folder.path(), &next, "1"));
    assert_eq!(told, again, "the same on one thread as on two");
    assert_eq!(plan, std::fs::read(folder.path().join("next.toml")).unwrap());

    let document: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(document["format"], "calibench-next/1");
    let actions = document["actions"].as_array().unwrap();
    for kind in ["balls", "later", "moved_artifact", "points"] {
        assert!(actions.iter().any(|a| a["kind"] == kind), "no action {kind}");
    }
    let error = |step: &serde_json::Value| step["workspace_error_mm"].as_f64().unwrap();
    for action in actions {
        let mut before = error(&document["now"]);
        for step in action["steps"].as_array().unwrap() {
            assert!(error(step) <= before * (1.0 + 1e-9), "more data make nothing worse: {action}");
            before = error(step);
        }
    }

    let cell = read_dataset(&folder.path().join("data")).unwrap();
    let planned = read_plan(&folder.path().join("next.toml"), &cell).unwrap().poses.len();
    assert!([5, 10, 20, 40].contains(&planned), "{planned} poses");
    done(&calibench(folder.path(), &["measure", "cell.toml", "--plan", "next.toml", "-o", "more"], "2"));
    let more = read_dataset(&folder.path().join("more")).unwrap();
    assert!(more.samples.len() * 10 >= planned * 9, "{} of {planned}", more.samples.len());

    let other = format!("{text}\n[[ball]]\nid = \"1\"\nx_mm = -70.0\ny_mm = -330.0\nz_mm = 17.0\noutward = [0.0, 0.0, 1.0]\n");
    std::fs::write(folder.path().join("other.toml"), other).unwrap();
    let refused = calibench(folder.path(), &["plan", "next", "data", "--scenario", "other.toml"], "2");
    let why = String::from_utf8(refused.stderr).unwrap();
    assert!(refused.status.code() == Some(2) && why.contains("not those of the dataset"), "{why}");
}
