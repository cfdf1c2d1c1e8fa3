//! `mukca`: a ball on a Franka Panda seated by hand in printed sockets (github.com/platonics-delft/kinematics_calibration).
//!
//! `<place>/hole_{0,1}.csv` has one row per seating. The positions of the sockets are unknown; the distance of 50 mm between
//! the two of a place is known. Other arms, distances and numbers of sockets are read alike. Every socket is a free ball, and the TCP is free. The world is the robot's base.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::column_map::ColumnMap;
use super::initial_setup::flanges;
use super::table::{TableFile, read_table};
use super::{ImportError, ImportOptions, ImportReport};
use crate::files::{FileError, cannot_be_read};
use crate::measure::dataset::columns::Column;
use crate::measure::dataset::{Ball, BallDistance, Dataset, Measured, SampleSet};
use crate::robot::robot_file::robot;
use crate::robot::{Pose, Robot};
use crate::units::{MM, UM};

/// Distance between the two sockets of a place, m.
const SOCKETS_APART: f64 = 50.0 * MM;
/// One-sigma of that distance, m: the tolerance of a printed part.
const SOCKETS_APART_SIGMA: f64 = 100.0 * UM;
/// Depth below a folder at which files are searched for: robot / place / file.
const DEPTH: usize = 3;

/// Number of joints of the map: those of the Panda.
const JOINTS: usize = 7;

/// The map for an arm of so many joints, each with a column of its own, in their order.
fn map_for(joints: usize) -> String {
    let text = include_str!("maps/mukca.toml");
    let is_joint = |line: &&str| line.starts_with('q');
    let column = |k: usize| format!("q{k} = {{ column = {k}, unit = \"rad\" }}\n");
    let columns: String = (1..=joints).map(column).collect();
    let rest: Vec<&str> = text.lines().filter(|line| !is_joint(line)).collect();
    rest.join("\n").replace("[columns]\n", &format!("[columns]\n{columns}")) + "\n"
}

/// Imports the files, or all `hole_*.csv` below the folders.
pub(super) fn import(files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    let named = options.robot.as_ref().map(|r| r.to_string_lossy().into_owned());
    let arm = named.as_ref().map(|name| robot(name, Path::new(""))).transpose()?;
    let text = map_for(arm.as_ref().map_or(JOINTS, Robot::joints));
    let (map, mut dataset) = ColumnMap::parse(Path::new("maps/mukca.toml"), &text, Path::new(""))?;
    if let (Some(name), Some(arm)) = (named, arm) {
        (dataset.robot, dataset.robot_reference) = (Arc::new(arm), name);
    }
    let mut found: Vec<(PathBuf, SampleSet)> = Vec::new();
    for (k, file) in files.iter().enumerate() {
        let set = options.sets.get(k).copied().unwrap_or_default();
        let before = found.len();
        sockets_below(file, DEPTH, &mut |path| found.push((path, set)))?;
        if found.len() == before {
            return Err(FileError::whole(
                file,
                "holds no hole_0.csv or hole_1.csv",
                "name the folder of one robot, such as panda_3",
            )
            .into());
        }
    }
    // A place within a folder may be named again, to be kept for validation: the last mention applies.
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let mut last: BTreeMap<PathBuf, (PathBuf, SampleSet)> = BTreeMap::new();
    for (path, set) in found {
        last.entry(whole(&path)).and_modify(|first| first.1 = set).or_insert((path, set));
    }
    let found: Vec<(PathBuf, SampleSet)> = last.into_values().collect();
    let robot_folder = |path: &Path| whole(path).parent().and_then(Path::parent).map(Path::to_path_buf).unwrap_or_default();
    if let Some((other, _)) = found.iter().find(|(path, _)| robot_folder(path) != robot_folder(&found[0].0)) {
        return Err(ImportError::TwoRobots { one: robot_folder(&found[0].0), other: robot_folder(other) });
    }
    let mut report = ImportReport::default();
    for (path, set) in &found {
        let name = |p: Option<&Path>| p.and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let id = format!("{}/{}", name(path.parent()), name(Some(&path.with_extension(""))));
        dataset.balls.push(Ball { id: id.clone(), position: Vector3::zeros(), sigma: 0.0, free: true });
        let mut constants = vec![(Column::Kind, "ball".into()), (Column::Ball, id.clone())];
        if *set == SampleSet::Validation {
            constants.push((Column::Set, "validation".into()));
        }
        let table = TableFile { path, label: &id, constants: &constants, joined: None };
        read_table(&table, &map, &mut dataset, &mut report)?;
    }
    pair_sockets(&mut dataset, options.sockets_apart.unwrap_or(SOCKETS_APART), &mut report);
    place_sockets(&mut dataset);
    Ok((dataset, report))
}

/// Calls `take` for every `hole_*.csv` at or below `path`; `_pose.csv` holds the poses reported by the controller.
fn sockets_below(path: &Path, depth: usize, take: &mut dyn FnMut(PathBuf)) -> Result<(), FileError> {
    let fail = |e: std::io::Error| cannot_be_read(path, e);
    if !path.is_dir() {
        take(path.to_owned());
        return Ok(());
    }
    let mut inside: BTreeSet<PathBuf> = BTreeSet::new();
    for entry in std::fs::read_dir(path).map_err(fail)? {
        inside.insert(entry.map_err(fail)?.path());
    }
    for entry in inside {
        let name = entry.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let is_socket =
            name.strip_prefix("hole_").and_then(|n| n.strip_suffix(".csv")).is_some_and(|n| n.parse::<u32>().is_ok());
        if entry.is_dir() && depth > 1 {
            sockets_below(&entry, depth - 1, take)?;
        } else if is_socket {
            take(entry);
        }
    }
    Ok(())
}

/// Adds the known distance between neighbouring sockets of each place, and says it.
fn pair_sockets(dataset: &mut Dataset, apart: f64, report: &mut ImportReport) {
    let place = |b: &Ball| b.id.rsplit_once('/').map(|(place, _)| place.to_owned());
    for k in 1..dataset.balls.len() {
        if place(&dataset.balls[k - 1]) == place(&dataset.balls[k]) {
            dataset.ball_distances.push(BallDistance { between: [k - 1, k], distance: apart, sigma: SOCKETS_APART_SIGMA });
        }
    }
    if !dataset.ball_distances.is_empty() {
        let note =
            format!("neighbouring sockets of a place are taken to be {:.1} mm apart; --distance MM states another", apart / MM);
        report.notes.push(note);
    }
}

/// Sets the TCP that minimises the scatter of the seatings of each socket on the nominal arm, and the resulting socket
/// positions.
///
/// With flange poses (R, p) the ball is at `R t + p`; the scatter about the mean of a socket is linear in t.
fn place_sockets(dataset: &mut Dataset) {
    let poses: Vec<Pose> = flanges(dataset).collect();
    let of_socket = |ball: usize| {
        let seated = move |m: &Measured| matches!(m, Measured::Ball { ball: b, .. } if *b == ball);
        dataset.samples.iter().zip(&poses).filter(move |(s, _)| seated(&s.measured)).map(|(_, pose)| *pose)
    };
    let means: Vec<(Matrix3<f64>, Vector3<f64>)> = (0..dataset.balls.len())
        .map(|ball| {
            let count = of_socket(ball).count() as f64;
            let rotation = of_socket(ball).map(|p| *p.rotation.matrix()).sum::<Matrix3<f64>>() / count;
            (rotation, of_socket(ball).map(|p| p.translation.vector).sum::<Vector3<f64>>() / count)
        })
        .collect();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (ball, (rotation, position)) in means.iter().enumerate() {
        for pose in of_socket(ball) {
            let turned = pose.rotation.matrix() - rotation;
            normal += turned.transpose() * turned;
            right -= turned.transpose() * (pose.translation.vector - position);
        }
    }
    let Some(tool) = normal.cholesky().map(|c| c.solve(&right)) else { return };
    for (ball, (rotation, position)) in means.iter().enumerate() {
        dataset.balls[ball].position = rotation * tool + position;
    }
    dataset.tool.xyz = tool.into();
}
