//! docs/formats holds the JSON Schema of every file that the program reads, its keys, and an example.
//! `CALIBENCH_WRITE_SCHEMAS=1` rewrites schemas and keys. The schemas are judged by a validator that shares no code with
//! the readers: both accept the same files, and refuse the same.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use boon::{Compiler, SchemaIndex, Schemas};
use calibench::effects::Subject;
use calibench::effects::registry::Registry;
use calibench::files::FileError;
use calibench::identify::calibration::read_calibration;
use calibench::identify::model_file::read_model;
use calibench::measure::campaign::cell::read_cell;
use calibench::measure::dataset::file::{read_dataset, read_description};
use calibench::measure::poses::read_plan;
use calibench::robot::robot_file::{load_robot, to_toml};
use calibench::robot::{BUILT_IN, built_in};
use calibench_report::documents;
use calibench_sim::scenario::load_scenario;
use schemars::Schema;
use serde_json::{Map, Value, json};

use crate::format_page;
use crate::schemas_are_written_down::{is_text_of, is_written, repository};

/// Name and schema of each file.
fn formats() -> Vec<(&'static str, Schema)> {
    let [rest @ .., last] = calibench::file_formats::schemas();
    let scenario = ("scenario", calibench_sim::scenario::file_schema());
    let frames = ("frames", calibench_programs::frames_schema());
    let station = ("station", calibench_readout::station_schema());
    rest.into_iter().chain([last, frames, station, scenario]).collect()
}

fn folder() -> PathBuf {
    repository().join("docs/formats")
}

/// The schemas, ready to judge.
struct Judge {
    schemas: Schemas,
    of: BTreeMap<&'static str, (Value, SchemaIndex)>,
}

impl Judge {
    fn new() -> Self {
        let (mut compiler, mut schemas, mut of) = (Compiler::new(), Schemas::new(), BTreeMap::new());
        let run = documents::schemas().into_iter().find(|(name, _)| *name == "calibench-run").unwrap().1;
        for (name, schema) in formats().into_iter().chain([("run", run)]) {
            let (value, at) = (schema.to_value(), format!("schema:{name}"));
            compiler.add_resource(&at, value.clone()).unwrap();
            of.insert(name, (value, compiler.compile(&at, &mut schemas).unwrap()));
        }
        Judge { schemas, of }
    }

    /// Verdict of the schema on a file.
    fn verdict(&self, format: &str, text: &str) -> Result<(), String> {
        let (schema, index) = &self.of[format];
        let documents = match format {
            "samples" => rows(text, schema),
            "run" => vec![serde_json::from_str(text).unwrap()],
            _ => vec![of_toml(toml::Value::Table(text.parse().unwrap()))],
        };
        documents.iter().try_for_each(|document| self.schemas.validate(document, *index).map_err(|e| format!("{e:#}")))
    }
}

/// A TOML value as JSON. Infinity, which JSON lacks, is a number still.
fn of_toml(value: toml::Value) -> Value {
    match value {
        toml::Value::Table(table) => Value::Object(table.into_iter().map(|(key, value)| (key, of_toml(value))).collect()),
        toml::Value::Array(values) => Value::Array(values.into_iter().map(of_toml).collect()),
        toml::Value::Float(number) => json!(number.clamp(f64::MIN, f64::MAX)),
        toml::Value::Integer(number) => json!(number),
        toml::Value::Boolean(flag) => json!(flag),
        toml::Value::String(text) => json!(text),
        toml::Value::Datetime(time) => json!(time.to_string()),
    }
}

/// The rows of a table as JSON: a field is text where its column holds text, and a number where it can be read as one.
fn rows(text: &str, schema: &Value) -> Vec<Value> {
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let titles = table.headers().unwrap().clone();
    let is_text = |title: &str| schema["properties"][title]["type"] == "string";
    let field = |title: &str, text: &str| match text.parse::<f64>() {
        Ok(number) if !is_text(title) => json!(number),
        _ => json!(text),
    };
    let row = |row: csv::StringRecord| {
        let filled = titles.iter().zip(row.iter()).filter(|(_, text)| !text.is_empty());
        Value::Object(filled.map(|(title, text)| (title.to_owned(), field(title, text))).collect::<Map<_, _>>())
    };
    table.records().map(|record| row(record.unwrap())).collect()
}

/// Verdict of the reader on a file that lies among the examples.
fn read(format: &str, path: &Path) -> Result<(), FileError> {
    let beside = path.parent().unwrap();
    match format {
        "robot" => load_robot(path).map(drop),
        "dataset" => read_description(path).map(drop),
        "samples" => read_dataset(beside).map(drop),
        "calibration" => read_calibration(path, Registry::catalogue()).map(drop),
        "cell" => read_cell(path).map(drop),
        "scenario" => load_scenario(path).map(drop),
        "frames" => calibench_programs::read_frames(path).map(drop),
        "station" => calibench_readout::read_station(path).map(drop),
        "run" => documents::Run::read(beside).map(drop),
        "plan" | "model" => {
            let cell = read_description(&beside.join("dataset.toml"))?;
            if format == "plan" {
                return read_plan(path, &cell).map(drop);
            }
            let balls: Vec<String> = cell.balls.iter().map(|b| b.id.clone()).collect();
            read_model(path, &Subject::new(&cell.robot, &balls)).map(drop)
        }
        other => panic!("{other}"),
    }
}

/// The example of a format.
fn example(format: &str) -> &str {
    match format {
        "robot" => "robot.toml",
        "dataset" => "dataset.toml",
        "samples" => "samples.csv",
        "model" => "model.toml",
        "calibration" => "calibration.toml",
        "plan" => "plan.toml",
        "cell" => "cell.toml",
        "frames" => "frames.toml",
        "station" => "station.toml",
        "scenario" => "scenario.toml",
        "run" => "run/result.json",
        other => panic!("{other}"),
    }
}

/// The examples with one of them changed, where the reader finds what they name.
fn changed(format: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let scratch = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(folder().join("examples")).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, scratch.path().join(path.file_name().unwrap())).unwrap();
        }
    }
    fs::create_dir(scratch.path().join("run")).unwrap();
    let path = scratch.path().join(example(format));
    let scenarios = repository().join("scenarios").canonicalize().unwrap();
    fs::write(&path, text.replace("../../../scenarios", scenarios.to_str().unwrap())).unwrap();
    (scratch, path)
}

#[test]
fn every_format_has_its_schema_in_the_documentation() {
    is_written(&folder().join("schema"), formats().into_iter().map(|(name, schema)| (name.into(), schema)).collect());
}

/// Between these two a page lists the keys.
const KEYS: [&str; 2] = ["<!-- keys, from the schema -->\n", "\n<!-- end of keys -->"];

#[test]
fn every_format_has_a_page_with_its_keys() {
    let list = fs::read_to_string(folder().join("README.md")).unwrap();
    for (format, schema) in formats() {
        let path = folder().join(format!("{format}.md"));
        let page = fs::read_to_string(&path).unwrap();
        for named in [format!("schema/{format}.json"), format!("examples/{}", example(format))] {
            assert!(page.contains(&format!("]({named})")), "{} does not name {named}", path.display());
        }
        assert!(list.contains(&format!("]({format}.md)")), "{format} is not in the list");
        // The keys of a scenario have a page of their own, which says where their numbers come from.
        if format != "scenario" {
            let [before, keys] = KEYS.map(|mark| page.find(mark).unwrap_or_else(|| panic!("{}: {mark}", path.display())));
            let before = before + KEYS[0].len();
            let page = format!("{}{}{}", &page[..before], format_page::keys(schema.as_value()), &page[keys..]);
            is_text_of(&path, &page);
        }
    }
}

#[test]
fn every_example_is_accepted_by_its_reader_and_by_its_schema() {
    let judge = Judge::new();
    for format in judge.of.keys() {
        let path = folder().join("examples").join(example(format));
        read(format, &path).unwrap_or_else(|e| panic!("{e}"));
        judge.verdict(format, &fs::read_to_string(&path).unwrap()).unwrap_or_else(|e| panic!("{format}: {e}"));
    }
}

/// Faults of examples: format, a part of its text, and its replacement.
const WRONG: &[[&str; 3]] = &[
    ["station", "kind = \"abb\"", "kind = \"yaskawa\""],
    ["station", "kind = \"abb\"\n", ""],
    ["station", "trigger", "triger"],
    ["station", "line = ", "average_s = '1'\nline = "],
    ["station", "format = \"calibench-station/1\"", "format = \"calibench-station/9\""],
    ["robot", "d_mm = 400.0\n", ""],
    ["robot", "min_deg = -170.0", "min_rad = -3.0"],
    ["robot", "mass_kg = 8.0", "mass_kg = '8'"],
    ["robot", "d_mm = 400.0\n", "d_mm = 400.0\nkind = \"prismatic\"\n"],
    ["robot", "min_deg = -170.0", "min_mm = -170.0"],
    ["robot", "d_mm = 400.0\n", "d_mm = 400.0\nkind = \"sliding\"\n"],
    ["robot", "d_mm = 400.0\n", "d_mm = 400.0\nsign = 2\n"],
    ["robot", "com_mm = [1.0, 2.0, -90.0]", "com_mm = [1.0, 2.0]"],
    ["robot", "robot/1", "robot/2"],
    ["dataset", "robot = \"kr6_r700\"\n", ""],
    ["dataset", "z_mm = -125.0\n", ""],
    ["dataset", "[base]\nx_mm = -536.32\ny_mm = -21.901\nz_mm = -58.349\n", ""],
    ["dataset", "format = \"calibench-dataset/1\"\n", ""],
    ["dataset", "mass_kg = 6.0", "mass = 6.0"],
    ["dataset", "ball_um = 1.0", "ball_um = 'small'"],
    ["dataset", "ball_um = 1.0", "ball_um = 0"],
    ["dataset", "share = [\"base\"]", "share = [\"ball\"]"],
    ["samples", ",ball,r1_um", ",extra_ball,r1_um"],
    ["samples", "id,kind", "id,kinds"],
    ["samples", "r2_um,", "extra_r2,"],
    ["samples", "p01,ball,", "p01,bowl,"],
    ["samples", "p01,ball,", "p01,pose,"],
    ["samples", "time_s", "time"],
    ["samples", ",22.7441,", ",east,"],
    ["samples", ",1,1,-1,morning", ",1,0,-1,morning"],
    ["model", "effects =", "effect_ids ="],
    ["model", "effects = [\"base_frame\", \"joint_compliance\"]", "effects = 'base_frame'"],
    ["model", "effects = [\"base_frame\", \"joint_compliance\"]\n", ""],
    ["model", "unit = \"deg\"\n", ""],
    ["model", "basis = \"sin", "base = \"sin"],
    ["calibration", "rank = 6\n", ""],
    ["calibration", "rank = 6", "rank = 6.5"],
    ["calibration", "[[joint_range]]\n", "[[joint_range]]\nmean_deg = 0.0\n"],
    ["calibration", "[[joint_range]]\n", "[[joint_range]]\nmin_mm = 0.0\n"],
    ["calibration", "O1 = ", "o1 = "],
    ["calibration", "outcome = \"converged\"", "outcome = \"perfect\""],
    ["calibration", "calibration/1", "calibration/0"],
    ["plan", "payload = \"heavy\"\n", ""],
    ["plan", "reserve = true", "reserve = 1"],
    ["plan", "clearance_mm", "clearance_um"],
    ["plan", "from = \"home\"", "from = \"p01\""],
    ["plan", "format = \"calibench-plan/1\"", "format = \"plan\""],
    ["cell", "address = \"192.168.1.10:7000\"\n", ""],
    ["cell", "port = \"/dev/ttyUSB1\"", "ports = \"/dev/ttyUSB1\""],
    ["cell", "axis = \"x\"", "axis = \"w\""],
    ["cell", "flange.b_deg = 180", "flange.b_deg = \"180\""],
    ["cell", "[[-200, -600, 100], [700, 600, 900]]", "[[-200, -600], [700, 600]]"],
    ["frames", "format = \"calibench-frames/1\"\n", ""],
    ["frames", "calibench-frames/1", "calibench-frames/2"],
    ["frames", "0, 35.5, 90, 30, 0, -20]", "0, 35.5, 90, 30, 0]"],
    ["frames", "0, 35.5, 90, 30, 0, -20]", "'0', 35.5, 90, 30, 0, -20]"],
    ["frames", "[bases]", "[base]"],
    ["scenario", "seed = 7", "seed = 'seven'"],
    ["scenario", "extends = \"../../../scenarios/table8.toml\"\n", ""],
    ["scenario", "[25, 52]", "25"],
    ["scenario", "[expect]", "[expected]"],
    ["scenario", "[expect]", "[[ball]]\nid = '1'\n\n[expect]"],
    ["run", "\"calibench-run/2\"", "\"calibench-run/1\""],
    ["run", "\"seed\": 7", "\"sead\": 7"],
    ["run", "\"seed\": 7", "\"seed\": \"7\""],
];

#[test]
fn what_the_reader_refuses_the_schema_refuses() {
    let judge = Judge::new();
    for [format, from, to] in WRONG {
        let text = fs::read_to_string(folder().join("examples").join(example(format))).unwrap();
        assert!(text.contains(from), "{format}: {from}");
        let (_scratch, path) = changed(format, &text.replacen(from, to, 1));
        let text = fs::read_to_string(&path).unwrap();
        assert!(read(format, &path).is_err(), "{format}: the reader accepts {to:?} for {from:?}");
        assert!(judge.verdict(format, &text).is_err(), "{format}: the schema accepts {to:?} for {from:?}");
    }
    for format in judge.of.keys() {
        assert!(WRONG.iter().filter(|[of, ..]| of == format).count() >= 3, "{format}");
    }
}

#[test]
fn files_in_use_are_accepted_by_both() {
    let judge = Judge::new();
    let accept = |format: &str, path: &Path| {
        read(format, path).unwrap_or_else(|e| panic!("{e}"));
        let text = fs::read_to_string(path).unwrap();
        judge.verdict(format, &text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    };
    for path in [
        "docs/robots/iiwa14.robot.toml",
        "docs/robots/r2000ic.robot.toml",
        "scenarios/robots/ur5e.robot.toml",
        "scenarios/robots/ur10e.robot.toml",
        "tests/fuzz/corpus/robot_toml/two.toml",
    ] {
        accept("robot", &repository().join(path));
    }
    for name in BUILT_IN {
        let (_scratch, path) = changed("robot", &to_toml(&built_in(name).unwrap()));
        accept("robot", &path);
    }
    for (format, corpus) in [
        ("dataset", "dataset_toml"),
        ("samples", "samples_csv"),
        ("model", "model_toml"),
        ("calibration", "calibration_toml"),
        ("plan", "plan_toml"),
        ("cell", "cell_toml"),
    ] {
        for entry in fs::read_dir(repository().join("tests/fuzz/corpus").join(corpus)).unwrap() {
            let text = fs::read_to_string(entry.unwrap().path()).unwrap();
            let (_scratch, path) = changed(format, &text.replace("paper/dataset.toml", "dataset.toml"));
            accept(format, &path);
        }
    }
    for entry in fs::read_dir(repository().join("scenarios")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            // A file that is there for others to extend has no question of its own.
            if path.file_stem().is_some_and(|name| name != "kr6-trical") {
                accept("scenario", &path);
            }
        }
    }
}

#[test]
fn a_scenario_that_extends_no_other_is_complete() {
    let judge = Judge::new();
    let cell = fs::read_to_string(repository().join("scenarios/kr6-trical.toml")).unwrap();
    let named = "format = 'calibench-scenario/1'\nname = 'whole'\nquestion = 'Is it whole?'\nseed = 1\n";
    let without = |key: &str| cell.lines().filter(|line| !line.starts_with(key)).collect::<Vec<_>>().join("\n");
    for (text, complete) in [
        (cell.clone(), false),
        (format!("{named}{cell}"), true),
        // One of the keys has a default.
        (format!("{named}{}", without("outward = ")), true),
        (format!("{named}{}", without("drop_out = ")), false),
    ] {
        let (_scratch, path) = changed("scenario", &text);
        assert_eq!(read("scenario", &path).is_ok(), complete);
        assert_eq!(judge.verdict("scenario", &text).is_ok(), complete);
    }
}
