//! What a method reads and writes: `fitted.csv`, `judged.csv`, `robot.json`; `predicted.csv`.

use std::path::{Path, PathBuf};

use calibench::files::read_text;
use calibench::measure::dataset::Dataset;
use calibench::robot::{FramePose, Robot};
use calibench::units::{DEG, MM};
use nalgebra::Vector3;
use serde_json::json;
use thiserror::Error;

use super::Prediction;
use crate::prove::{Part, Row};

/// Name of the file that a method writes.
pub const PREDICTED: &str = "predicted.csv";

/// Columns of a predicted position, mm.
const POSITION: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

/// Column of the expected 3-D error, mm, which a method may leave out.
const EXPECTED: &str = "expected_mm";

/// The contents of the files of a division.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DivisionFiles {
    /// `fitted.csv`: the rows to learn from.
    pub fitted: String,
    /// `judged.csv`: the rows to predict, without what was measured.
    pub judged: String,
    /// `robot.json`: the nominal robot.
    pub robot: String,
}

/// Why a method has no result in a division.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Fault {
    /// It ended with an error.
    #[error("the command ended with {0}; its own words are in {log}", log = .1.display())]
    Failed(String, PathBuf),
    /// It did not end.
    #[error("the command had not ended after {0} s and was stopped; give it longer with --limit")]
    TooLong(u64),
    /// There is no file, or it cannot be read.
    #[error("{0}; write one row of {columns} (mm) for each row of judged.csv", columns = POSITION.join(", "))]
    Unreadable(String),
    /// The number of rows differs.
    #[error("{file} has {rows} rows and judged.csv {wanted}; write one for each, in their order", file = .file.display())]
    Rows {
        /// The file.
        file: PathBuf,
        /// Its rows.
        rows: usize,
        /// Rows to be predicted.
        wanted: usize,
    },
    /// A value is not a finite number.
    #[error("{file}:{line}: {column}: '{value}' is not a finite number; write mm", file = .file.display())]
    NotANumber {
        /// The file.
        file: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// The column.
        column: &'static str,
        /// What is written there.
        value: String,
    },
}

/// The files of a division of data of `robot`: `fitted` and `set_up` rows with what was measured, `judged` without.
pub fn bench_files(dataset: &Dataset, fitted: &[Row], judged: &[Row]) -> DivisionFiles {
    let robot = &dataset.robot;
    let joints = robot.joint_columns();
    let table = |rows: &[Row], with_measured: bool| {
        let mut file = csv::Writer::from_writer(Vec::new());
        let first = ["posture", "use", "tool", "ball"].map(String::from);
        let of = |name: &str| ["x", "y", "z"].map(|axis| format!("{name}_{axis}_mm"));
        let mut titles: Vec<String> = first.into_iter().chain(joints.clone()).chain(of("default")).collect();
        if with_measured {
            titles.extend(of("measured").into_iter().chain(of("residual")));
        }
        // Writing to memory cannot fail.
        let _ = file.write_record(titles);
        for row in rows {
            let mut fields = vec![
                row.posture.to_string(),
                if row.part == Part::SetUp { "set_up" } else { "fit" }.to_owned(),
                row.tool.clone(),
                row.free_ball.clone().unwrap_or_default(),
            ];
            fields.extend(robot.in_columns(&row.q).iter().map(|q| format!("{q:.6}")));
            let mut add = |v: &Vector3<f64>| fields.extend(v.iter().map(|x| format!("{:.6}", x / MM)));
            add(&row.predicted);
            if with_measured {
                add(&(row.predicted + row.error));
                add(&row.error);
            }
            let _ = file.write_record(fields);
        }
        file.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
    };
    DivisionFiles { fitted: table(fitted, true), judged: table(judged, false), robot: nominal(robot, &dataset.tool) }
}

/// The nominal robot as JSON: one modified Denavit-Hartenberg row for each joint, mm and deg.
fn nominal(robot: &Robot, tool: &FramePose) -> String {
    let links: Vec<_> = robot
        .links
        .iter()
        .map(|link| {
            let mdh = link.mdh;
            json!({
                "kind": mdh.kind.name(), "alpha_deg": mdh.alpha / DEG, "a_mm": mdh.a / MM, "beta_deg": mdh.beta / DEG,
                "theta_deg": mdh.theta / DEG, "d_mm": mdh.d / MM, "mass_kg": link.mass,
                "com_mm": [link.com.x / MM, link.com.y / MM, link.com.z / MM],
            })
        })
        .collect();
    let document = json!({
        "format": "calibench-bench-robot/1", "name": robot.name, "row": "Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d)",
        "links": links, "tool_mm": tool.xyz.map(|x| x / MM),
    });
    format!("{document:#}\n")
}

/// What a method predicted for `wanted` rows.
///
/// # Errors
/// If the file is not there, has another number of rows, or a value that is not a finite number.
pub fn read_predicted(path: &Path, wanted: usize) -> Result<Vec<Prediction>, Fault> {
    let text = read_text(path).map_err(|e| Fault::Unreadable(e.to_string()))?;
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(text.as_bytes());
    let unreadable = |e: csv::Error| Fault::Unreadable(format!("{}: {e}", path.display()));
    let titles = reader.headers().map_err(unreadable)?.clone();
    let place = |column: &str| titles.iter().position(|title| title == column);
    let missing = |column: &str| Fault::Unreadable(format!("{}: there is no column {column}", path.display()));
    let mut places = [0; 3];
    for (at, column) in places.iter_mut().zip(POSITION) {
        *at = place(column).ok_or_else(|| missing(column))?;
    }
    let expected_at = place(EXPECTED);
    let mut predictions = Vec::with_capacity(wanted);
    for (k, record) in reader.records().enumerate() {
        let record = record.map_err(unreadable)?;
        let number = |at: usize, column: &'static str| {
            let value = record.get(at).unwrap_or_default();
            let line = record.position().map_or(k + 2, |p| p.line() as usize);
            let wrong = || Fault::NotANumber { file: path.to_owned(), line, column, value: value.to_owned() };
            value.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(wrong)
        };
        let mut position = Vector3::zeros();
        for ((at, column), x) in places.into_iter().zip(POSITION).zip(position.iter_mut()) {
            *x = number(at, column)? * MM;
        }
        let expected = expected_at.map(|at| number(at, EXPECTED)).transpose()?.map(|e| e * MM);
        predictions.push(Prediction { position, expected });
    }
    match predictions.len() {
        rows if rows == wanted => Ok(predictions),
        rows => Err(Fault::Rows { file: path.to_owned(), rows, wanted }),
    }
}
