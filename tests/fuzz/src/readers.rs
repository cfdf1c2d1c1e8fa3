//! Targets of the fuzzing, by name: every reader of a file, of a frame on the wire and of a line typed by a user.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use calibench::cell::gauge::{DigimaticWord, GaugeReply, LineReader};
use calibench::cell::replay::Recording;
use calibench::cell::scripted::{Script, ScriptedCell};
use calibench::compensate::targets_file::{Expected, read_targets};
use calibench::compensate::{Compensator, Task};
use calibench::effects::Subject;
use calibench::effects::registry::Registry;
use calibench::identify::calibration::{Calibration, read_calibration};
use calibench::identify::model_file::read_model;
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::import::{ImportOptions, guess, import};
use calibench::measure::campaign::Conditions;
use calibench::measure::campaign::cell::read_cell;
use calibench::measure::campaign::journal::Journal;
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::measure::poses::read_plan;
use calibench::robot::built_in;
use calibench::robot::robot_file::load_robot;
use calibench::robot::urdf::{ChainEnds, UrdfRobot, calibrated_urdf, robot_from_urdf};
use calibench_lab::study::RowsReader;
use calibench_logs::{LogOptions, Moving, read_logs, still_poses};
use calibench_programs::{Permissions, Program, read_program, rewrite_programs};
use calibench_serve::script::parse;
use calibench_serve::{Instrument, Manner};
use calibench_sim::scenario::load_scenario;
use calibench_wire::kuka::{FrameReader, Value};
use calibench_wire::ur::{PackageReader, StateMessageReader};
use tempfile::TempDir;

/// A reader, and the folder of its corpus.
pub struct Reader {
    pub name: &'static str,
    pub feed: fn(&[u8]),
}

/// All of them.
pub const READERS: &[Reader] = &[
    Reader { name: "dataset_toml", feed: dataset_toml },
    Reader { name: "samples_csv", feed: samples_csv },
    Reader { name: "model_toml", feed: model_toml },
    Reader { name: "expression", feed: expression },
    Reader { name: "calibration_toml", feed: calibration_toml },
    Reader { name: "robot_toml", feed: robot_toml },
    Reader { name: "robot_urdf", feed: robot_urdf },
    Reader { name: "plan_toml", feed: plan_toml },
    Reader { name: "scenario_toml", feed: scenario_toml },
    Reader { name: "column_map", feed: column_map },
    Reader { name: "foreign_table", feed: foreign_table },
    Reader { name: "unknown_table", feed: unknown_table },
    Reader { name: "iterations_csv", feed: iterations_csv },
    Reader { name: "study_csv", feed: study_csv },
    Reader { name: "journal", feed: journal },
    Reader { name: "cell_toml", feed: cell_toml },
    Reader { name: "targets_csv", feed: targets_csv },
    Reader { name: "program", feed: program },
    Reader { name: "recording", feed: recording },
    Reader { name: "gauge_line", feed: gauge_line },
    Reader { name: "gauge_word", feed: gauge_word },
    Reader { name: "gauge_command", feed: gauge_command },
    Reader { name: "kuka_frame", feed: kuka_frame },
    Reader { name: "kuka_value", feed: kuka_value },
    Reader { name: "ur_package", feed: ur_package },
    Reader { name: "ur_script", feed: ur_script },
];

/// A folder in memory where there is one: millions of files are written into it.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { TempDir::new_in(memory) } else { TempDir::new() };
    made.expect("a folder for what is read")
});

/// `bytes` as a file of that name.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = FOLDER.path().join(name);
    fs::write(&path, bytes).expect("a file for what is read");
    path
}

/// A small dataset that is right, in a folder of its own.
const DATASET_TOML: &str = include_str!("../corpus/dataset_toml/paper.toml");
const SAMPLES_CSV: &str = include_str!("../corpus/samples_csv/paper.csv");

fn dataset(folder: &str, toml: &[u8], samples: &[u8]) -> Option<Dataset> {
    let folder = FOLDER.path().join(folder);
    fs::create_dir_all(&folder).expect("a folder for a dataset");
    fs::write(folder.join("dataset.toml"), toml).expect("dataset.toml");
    fs::write(folder.join("samples.csv"), samples).expect("samples.csv");
    read_dataset(&folder).ok()
}

static PAPER: LazyLock<Dataset> =
    LazyLock::new(|| dataset("paper", DATASET_TOML.as_bytes(), SAMPLES_CSV.as_bytes()).expect("the dataset is right"));

/// Data that can be read must also be fitted, or refused, without a panic. A fit is a thousand readings long, so that only
/// small ones are made.
fn fitted(dataset: &Dataset) {
    if dataset.samples.len() <= 12 && dataset.robot.joints() <= 7 {
        black_box(identify(&[NamedDataset::new("d", dataset)], &Model::default_for(dataset)).is_ok());
    }
}

fn dataset_toml(bytes: &[u8]) {
    if let Some(dataset) = dataset("toml", bytes, SAMPLES_CSV.as_bytes()) {
        fitted(&dataset);
    }
}

fn samples_csv(bytes: &[u8]) {
    if let Some(dataset) = dataset("samples", DATASET_TOML.as_bytes(), bytes) {
        fitted(&dataset);
    }
}

fn model_toml(bytes: &[u8]) {
    let balls = PAPER.ball_ids();
    if let Ok(model) = read_model(&file("model.toml", bytes), &Subject::new(&PAPER.robot, &balls)) {
        black_box(identify(&[NamedDataset::new("paper", &PAPER)], &model).is_ok());
    }
}

/// As the basis of an effect of one's own, and fitted.
fn expression(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    if !text.contains("'''") {
        let term = format!("terms = [{{ site = \"theta:3\", basis = '''{text}''' }}]");
        let model = format!("effects = [\"base_frame\", \"own\"]\n[[effect]]\nname = \"own\"\nunit = \"deg\"\n{term}\n");
        model_toml(model.as_bytes());
    }
}

fn calibration_toml(bytes: &[u8]) {
    if let Ok(calibration) = read_calibration(&file("calibration.toml", bytes), Registry::catalogue()) {
        black_box(calibration.predict(&[NamedDataset::new("paper", &PAPER)], Use::All).is_ok());
    }
}

fn robot_toml(bytes: &[u8]) {
    black_box(load_robot(&file("robot.toml", bytes)).is_ok());
}

fn robot_urdf(bytes: &[u8]) {
    let (path, ends) = (file("robot.urdf", bytes), ChainEnds::default());
    if let Ok(UrdfRobot { robot, .. }) = robot_from_urdf(&path, &ends) {
        let text = calibrated_urdf(&path, &ends, &robot, &robot).expect("a file is that of its own robot");
        let again = robot_from_urdf(&file("calibrated.urdf", text.as_bytes()), &ends).expect("what is written can be read");
        assert_eq!(again.robot.joints(), robot.joints());
    }
}

fn plan_toml(bytes: &[u8]) {
    black_box(read_plan(&file("plan.toml", bytes), &PAPER).is_ok());
}

fn scenario_toml(bytes: &[u8]) {
    black_box(load_scenario(&file("scenario.toml", bytes)).is_ok());
}

fn unknown_table(bytes: &[u8]) {
    let robot = built_in("ur5").expect("a built-in robot");
    black_box(guess(&file("unknown.csv", bytes), &robot, "ur5").is_ok());
}

fn column_map(bytes: &[u8]) {
    let options = ImportOptions { map: Some(file("map.toml", bytes)), ..ImportOptions::default() };
    black_box(import("generic", &[file("table.csv", SAMPLES_CSV.as_bytes())], &options).is_ok());
}

/// The first byte says as what the rest is read.
fn foreign_table(bytes: &[u8]) {
    let Some((format, table)) = bytes.split_first() else { return };
    let format = ["ur10-ipa", "ur5-jacobi", "mukca"][usize::from(*format) % 3];
    black_box(import(format, &[file("foreign.csv", table)], &ImportOptions::default()).is_ok());
}

/// The first byte says as what the rest is read.
fn recording(bytes: &[u8]) {
    let Some((form, content)) = bytes.split_first() else { return };
    let name = ["one.mcap", "one.csv", "one.db3"][usize::from(*form) % 3];
    let robot = built_in("ur5").expect("built in");
    if let Ok(log) = read_logs(&[file(name, content)], &robot, &[]) {
        black_box(still_poses(&log, &robot, &LogOptions::default()).is_ok());
        black_box(Moving::of(&log, &robot, &LogOptions { moving: true, ..LogOptions::default() }).map(|m| m.poses()).is_ok());
    }
}

fn iterations_csv(bytes: &[u8]) {
    black_box(Recording::read(&file("iterations.csv", bytes)).is_ok());
}

fn study_csv(bytes: &[u8]) {
    if let Ok(mut rows) = RowsReader::open(&file("study.csv", bytes)) {
        while let Ok(Some(row)) = rows.next_row() {
            black_box(row.len());
        }
    }
}

fn journal(bytes: &[u8]) {
    let path = file("data.journal", bytes);
    black_box(Journal::open(&path.with_extension(""), &Conditions::of(&[], &PAPER), true).is_ok());
}

fn cell_toml(bytes: &[u8]) {
    LazyLock::force(&PAPER);
    black_box(read_cell(&file("cell.toml", bytes)).is_ok());
}

fn targets_csv(bytes: &[u8]) {
    let expected = Expected { robot: &PAPER.robot, payloads: &PAPER.payloads, by_temperature: None };
    black_box(read_targets(&file("targets.csv", bytes), &expected).is_ok());
}

/// The first byte says in which language the rest is. Rewritten, it has the same lines, and as many positions.
fn program(bytes: &[u8]) {
    static CALIBRATION: LazyLock<Calibration> = LazyLock::new(|| {
        read_calibration(
            &file("of-programs.toml", include_bytes!("../corpus/calibration_toml/paper.toml")),
            Registry::catalogue(),
        )
        .expect("it is right")
    });
    let Some((dialect, text)) = bytes.split_first() else { return };
    let extension = ["src", "script", "mod", "ls", "jbi", "dtx", "pgx", "dat"][usize::from(*dialect) % 8];
    let Ok(program) = read_program(&file(&format!("program.{extension}"), text)) else { return };
    let mut compensator = Compensator::new(&CALIBRATION, &Task::default()).expect("the calibration has one set-up");
    let permissions = Permissions { joints_as_in_robot_file: true, ..Permissions::default() };
    let rewrite = |program: &Program, compensator: &mut Compensator<'_>| {
        rewrite_programs(std::slice::from_ref(program), compensator, &permissions).remove(0)
    };
    let first = rewrite(&program, &mut compensator);
    let lines = |bytes: &[u8]| bytes.iter().filter(|b| **b == b'\n').count();
    assert_eq!(lines(&first.bytes), lines(text));
    let again = rewrite(&Program { bytes: first.bytes, ..program }, &mut compensator);
    assert_eq!(again.positions, first.positions);
}

/// Bytes from an indicator, in pieces: the first byte says how long they are.
fn gauge_line(bytes: &[u8]) {
    let Some((piece, sent)) = bytes.split_first() else { return };
    let mut reader = LineReader::default();
    for piece in sent.chunks(usize::from(*piece).max(1)) {
        reader.push(piece);
        while let Some(line) = reader.line() {
            black_box(GaugeReply::parse(&line));
        }
    }
}

fn gauge_word(bytes: &[u8]) {
    if let Some(bits) = bytes.first_chunk() {
        black_box(DigimaticWord::from_bits(u64::from_le_bytes(*bits)).decode().is_ok());
    }
}

/// Requests to a served indicator.
fn gauge_command(bytes: &[u8]) {
    let [mut plunger, ..] = ScriptedCell::new(Script::default()).indicators();
    let mut instrument = Instrument::new("1", Manner::default());
    for request in bytes.split(|b| *b == b'\r') {
        black_box(instrument.answer(request, &mut plunger));
    }
}

/// Bytes from a client or a server, in pieces; whole frames must encode to the bytes that they were decoded from.
fn kuka_frame(bytes: &[u8]) {
    let Some((piece, sent)) = bytes.split_first() else { return };
    let (mut requests, mut responses) = (FrameReader::default(), FrameReader::default());
    for piece in sent.chunks(usize::from(*piece).max(1)) {
        requests.push(piece);
        while let Ok(Some(request)) = requests.request() {
            black_box(request.encode().is_ok());
        }
        responses.push(piece);
        while let Ok(Some(response)) = responses.response() {
            black_box(response.encode().is_ok());
        }
    }
}

/// A value that can be read is written as one that can be read.
fn kuka_value(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    if let Ok(value) = Value::parse(text) {
        let written = value.to_string();
        assert!(Value::parse(&written).is_ok(), "`{text}` is written `{written}`");
    }
}

/// Bytes from a controller or a client, in pieces; whole packages must encode to what was read.
fn ur_package(bytes: &[u8]) {
    let Some((piece, sent)) = bytes.split_first() else { return };
    let (mut packages, mut states) = (PackageReader::default(), StateMessageReader::default());
    for piece in sent.chunks(usize::from(*piece).max(1)) {
        packages.push(piece);
        while let Ok(Some(package)) = packages.next_package() {
            let encoded = package.encode();
            assert_eq!(encoded.len(), package.body.len() + 3);
            black_box(package.words());
        }
        black_box(states.push(piece));
    }
}

/// A program from anybody on the network.
fn ur_script(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    black_box(parse(text).is_ok());
}
