//! A dataset on disk: a folder with `dataset.toml` and `samples.csv`.

use std::path::Path;
use std::sync::Arc;

use nalgebra::Vector3;
use serde::Deserialize;
use sha2::{Digest, Sha256};

use super::description::{
    AnchorToml, BallDistanceToml, DatasetToml, FORMAT, NoiseToml, PayloadToml, PlaceToml, SHAREABLE, describe, frame,
};
use super::limits::{Impossible, impossible};
use super::samples_file::{check_samples, read_samples};
use super::samples_text::samples_text;
use super::{Anchor, Ball, BallDistance, Dataset, Noise, Shared, ToolTarget};
use crate::files::disk::replace_folder;
use crate::files::disk::{is_file, is_there, read_bytes, write_whole};
use crate::files::{FileError, field_error, hexadecimal, parse_toml, read_text};
use crate::robot::robot_file::{RobotReference, robot, to_toml};
use crate::robot::statics::{DEFAULT_GRAVITY, Payload};
use crate::robot::{BUILT_IN, FramePose, JointKind, Robot};
use crate::units::{ARCSEC, DEG, MM, UM};

/// File with the description of the measurements.
pub const DATASET_TOML: &str = "dataset.toml";
/// File with the measurements.
pub(super) const SAMPLES_CSV: &str = "samples.csv";
/// File with the robot, if it is not built in.
const ROBOT_TOML: &str = "robot.toml";
/// Smallest distance between two balls, m: the smallest precision balls in use are larger.
const APART: f64 = 1.0 * MM;

#[derive(Deserialize)]
struct FormatKey {
    format: String,
}

/// Reads a dataset: the folder with `dataset.toml` and `samples.csv`.
///
/// # Errors
/// The first error, with its file, line, key or column, and remedy.
pub fn read_dataset(folder: &Path) -> Result<Dataset, FileError> {
    if is_file(folder) {
        let remedy = "name the folder that holds dataset.toml and samples.csv; of a table, `calibench calibrate` or `calibench import` makes one";
        return Err(FileError::whole(folder, "is a file", remedy));
    }
    let path = folder.join(DATASET_TOML);
    let mut dataset = described(&path, folder)?;
    let mut hash = Sha256::new();
    // The bytes of the file, byte-order mark included: `cat dataset.toml samples.csv | sha256sum` gives the same.
    let bytes = read_bytes(&path).map_err(|e| FileError::whole(&path, format!("cannot be read: {e}"), "check the disk"))?;
    hash.update(bytes);
    read_samples(&folder.join(SAMPLES_CSV), &mut dataset, &mut hash)?;
    dataset.hash = hexadecimal(&hash.finalize());
    Ok(dataset)
}

/// Reads the description at `path` of the dataset in a folder.
fn described(path: &Path, folder: &Path) -> Result<Dataset, FileError> {
    if !is_there(path) {
        return Err(FileError::whole(path, "is not there", "a dataset is a folder with dataset.toml and samples.csv"));
    }
    let text = read_text(path)?;
    Reading { path, text: &text, within: "" }.whole(folder)
}

/// Reads a dataset as [`read_dataset`] does, and keeps nothing: a million rows fit in memory once.
fn check_dataset(folder: &Path) -> Result<(), FileError> {
    let dataset = described(&folder.join(DATASET_TOML), folder)?;
    check_samples(&folder.join(SAMPLES_CSV), &dataset)
}

/// Reads a `dataset.toml` without the samples beside it.
///
/// # Errors
/// The first error, with its file, line, key, and remedy.
pub fn read_description(path: &Path) -> Result<Dataset, FileError> {
    let text = read_text(path)?;
    Reading { path, text: &text, within: "" }.whole(path.parent().unwrap_or(Path::new("")))
}

/// Writes a dataset: the folder appears whole or not at all, and only if it can be read back.
///
/// An existing dataset is replaced; other files in its folder are kept. A robot that is not built in is written beside the
/// samples as `robot.toml`, so that the folder can be moved.
///
/// # Errors
/// When the folder contains something that is not a dataset, cannot be written, or when `dataset` contradicts itself.
pub fn write_dataset(dataset: &Dataset, folder: &Path) -> Result<(), FileError> {
    write_dataset_with(dataset, folder, &[], |_| Ok(()))
}

/// As [`write_dataset`], with additional files of these names in the folder, written by `fill`.
///
/// # Errors
/// Those of [`write_dataset`] and of `fill`.
pub fn write_dataset_with(
    dataset: &Dataset,
    folder: &Path,
    names: &[&str],
    fill: impl FnOnce(&Path) -> Result<(), FileError>,
) -> Result<(), FileError> {
    let fail = |e: String| FileError::whole(folder, format!("cannot be written: {e}"), "correct the dataset");
    let mut description = describe(dataset);
    let own_robot = !BUILT_IN.contains(&dataset.robot_reference.as_str());
    if own_robot {
        description.robot = ROBOT_TOML.into();
    }
    let description = toml::to_string(&description).map_err(|e| fail(e.to_string()))?;
    let samples = samples_text(dataset).map_err(|e| fail(e.to_string()))?;
    replace_folder(folder, "dataset", &[&[DATASET_TOML, SAMPLES_CSV], names].concat(), |new| {
        fill(new)?;
        if own_robot {
            write_whole(&new.join(ROBOT_TOML), to_toml(&dataset.robot).as_bytes())?;
        }
        write_whole(&new.join(DATASET_TOML), description.as_bytes())?;
        write_whole(&new.join(SAMPLES_CSV), &samples)?;
        drop(samples);
        check_dataset(new)
    })
}

/// SHA-256 of a dataset's description of its cell, the robot included: the same for two campaigns with the same setup.
pub(crate) fn description_hash(dataset: &Dataset) -> String {
    // A description that cannot be written is rejected on reading or writing; here it only needs to differ from all others.
    let description = toml::to_string(&describe(dataset)).unwrap_or_else(|e| e.to_string());
    hexadecimal(&Sha256::new().chain_update(description).chain_update(to_toml(&dataset.robot)).finalize())
}

/// Checks a dataset's description of its cell, as reading it would; a robot file is searched for relative to `folder`.
///
/// # Errors
/// The first error, with its key; the file named is the one that it would be written to.
pub fn check_description(dataset: &Dataset, folder: &Path) -> Result<(), FileError> {
    let path = Path::new(DATASET_TOML);
    let text = toml::to_string(&describe(dataset))
        .map_err(|e| FileError::whole(path, format!("cannot be written: {e}"), "correct the dataset"))?;
    Reading { path, text: &text, within: "" }.whole(folder).map(drop)
}

/// A `dataset.toml`, or the table of the same keys in another file, being read.
pub(crate) struct Reading<'a> {
    pub path: &'a Path,
    pub text: &'a str,
    /// Key path of the table, with the trailing dot.
    pub within: &'a str,
}

impl Reading<'_> {
    fn wrong(&self, key: impl AsRef<str>, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        field_error(self.path, self.text, &format!("{}{}", self.within, key.as_ref()), problem, remedy)
    }

    /// Reads the content of a whole `dataset.toml` in `folder`.
    fn whole(&self, folder: &Path) -> Result<Dataset, FileError> {
        // The format first: a later one may have keys unknown to this version.
        if let Ok(FormatKey { format }) = toml::from_str(self.text)
            && format != FORMAT
        {
            let problem = format!("`{format}` is not read by this version");
            return Err(self.wrong("format", problem, format!("write `{FORMAT}`")));
        }
        let file: DatasetToml = parse_toml(self.path, self.text)?;
        if file.format.is_empty() {
            return Err(self.wrong("format", "is missing", format!("add `format = \"{FORMAT}\"`")));
        }
        if file.base.is_none() {
            return Err(self.wrong("base", "is missing", "add `[base]`, the nominal base of the robot in the world"));
        }
        self.dataset(file, folder)
    }

    /// The dataset described by the keys, without its samples; its base is the world's frame if none is given.
    pub fn dataset(&self, file: DatasetToml, folder: &Path) -> Result<Dataset, FileError> {
        // Values that cannot be written as a table are rejected below, by their key.
        let impossible = toml::Table::try_from(&file).ok().and_then(|table| impossible(&table));
        let robot = self.robot(&file.robot, folder)?;
        let payloads = self.payloads(&file.payload)?;
        let balls = self.balls(&file.ball)?;
        let t = &file.tool;
        let base = file.base.map_or(FramePose::default(), |b| b.frame());
        let dataset = Dataset {
            base: base.then(&robot.root),
            base_found: file.base_found,
            tool: robot.flange.then(&frame([t.x_mm, t.y_mm, t.z_mm], [t.a_deg, t.b_deg, t.c_deg])),
            tool_sigma: self.not_negative("tool.sigma_um", t.sigma_um.unwrap_or(0.0))? * UM,
            probe_sigma: self.not_negative("tool.sigma_deg", t.sigma_deg.unwrap_or(0.0))? * DEG,
            tool_free: t.free,
            shared: self.shared(&file.share)?,
            contact_force: t.contact_force_n.map_or(Vector3::zeros(), Vector3::from),
            absolute_accuracy: file.absolute_accuracy,
            ball_distances: self.ball_distances(&file.ball_distance, &balls)?,
            anchors: self.anchors(&file.anchor)?,
            noise: self.noise(&file.noise, &robot)?,
            robot,
            robot_reference: file.robot,
            gravity: file.gravity_m_s2.map_or(DEFAULT_GRAVITY, Vector3::from),
            payloads,
            balls,
            tool_targets: self.tool_targets(&file.target)?,
            extra_columns: Vec::new(),
            provenance: file.provenance,
            samples: Vec::new(),
            hash: String::new(),
        };
        match impossible {
            Some(Impossible { key, problem, remedy }) => Err(self.wrong(key, problem, remedy)),
            None => Ok(dataset),
        }
    }

    fn robot(&self, reference: &str, folder: &Path) -> Result<Arc<Robot>, FileError> {
        if !RobotReference::parse(reference).is_in(folder) {
            let remedy = format!("name a built-in robot ({}), or a robot file relative to this one", BUILT_IN.join(", "));
            return Err(self.wrong("robot", format!("there is no robot `{reference}`"), remedy));
        }
        robot(reference, folder).map(Arc::new)
    }

    fn not_negative(&self, key: &str, value: f64) -> Result<f64, FileError> {
        if value < 0.0 { Err(self.wrong(key, format!("{value} is negative"), "give zero or more")) } else { Ok(value) }
    }

    fn positive(&self, key: &str, value: f64) -> Result<f64, FileError> {
        if value > 0.0 {
            Ok(value)
        } else {
            Err(self.wrong(key, format!("{value} is not greater than zero"), "give a positive number, or leave the key out"))
        }
    }

    /// Checks that names are valid in a CSV field and unique.
    fn names<'a>(&self, table: &str, key: &str, names: impl Iterator<Item = &'a str>) -> Result<(), FileError> {
        let mut seen: Vec<&str> = Vec::new();
        for (k, name) in names.enumerate() {
            let at = format!("{table}[{k}].{key}");
            if name.is_empty() || name.trim() != name || name.contains(char::is_control) {
                return Err(self.wrong(
                    at,
                    format!("{name:?} is empty, has spaces around it, or has control characters"),
                    "give a plain name",
                ));
            }
            if seen.contains(&name) {
                return Err(self.wrong(at, format!("`{name}` appears twice"), "give every one its own name"));
            }
            seen.push(name);
        }
        Ok(())
    }

    fn payloads(&self, tables: &[PayloadToml]) -> Result<Vec<Payload>, FileError> {
        self.names("payload", "name", tables.iter().map(|p| p.name.as_str()))?;
        if tables.is_empty() {
            return Ok(vec![Payload::none()]);
        }
        let payload = |(k, p): (usize, &PayloadToml)| {
            let mass = self.not_negative(&format!("payload[{k}].mass_kg"), p.mass_kg)?;
            Ok(Payload { name: p.name.clone(), mass, com: Vector3::from(p.com_mm) * MM })
        };
        tables.iter().enumerate().map(payload).collect()
    }

    fn balls(&self, tables: &[PlaceToml]) -> Result<Vec<Ball>, FileError> {
        self.names("ball", "id", tables.iter().map(|b| b.id.as_str()))?;
        let mut balls: Vec<Ball> = Vec::with_capacity(tables.len());
        for (k, b) in tables.iter().enumerate() {
            let sigma = self.not_negative(&format!("ball[{k}].sigma_um"), b.sigma_um.unwrap_or(0.0))? * UM;
            let position = Vector3::new(b.x_mm, b.y_mm, b.z_mm) * MM;
            if let Some(other) = balls.iter().find(|o| !o.free && !b.free && (o.position - position).norm() < APART) {
                return Err(self.wrong(
                    format!("ball[{k}]"),
                    format!("`{}` is where ball `{}` is", b.id, other.id),
                    "correct its position",
                ));
            }
            balls.push(Ball { id: b.id.clone(), position, sigma, free: b.free });
        }
        Ok(balls)
    }

    fn shared(&self, names: &[String]) -> Result<Shared, FileError> {
        if let Some(k) = names.iter().position(|name| !SHAREABLE.contains(&name.as_str())) {
            let problem = format!("`{}` is not something that sessions share", names[k]);
            return Err(self.wrong(format!("share[{k}]"), problem, format!("write {}", SHAREABLE.join(" or "))));
        }
        let [base, tool] = SHAREABLE.map(|name| names.iter().any(|given| given == name));
        Ok(Shared { base, tool })
    }

    fn tool_targets(&self, tables: &[PlaceToml]) -> Result<Vec<ToolTarget>, FileError> {
        self.names("target", "id", tables.iter().map(|r| r.id.as_str()))?;
        let tool_target = |(k, r): (usize, &PlaceToml)| {
            let sigma = self.not_negative(&format!("target[{k}].sigma_um"), r.sigma_um.unwrap_or(0.0))? * UM;
            Ok(ToolTarget { id: r.id.clone(), position: Vector3::new(r.x_mm, r.y_mm, r.z_mm) * MM, sigma, free: r.free })
        };
        tables.iter().enumerate().map(tool_target).collect()
    }

    fn ball_distances(&self, tables: &[BallDistanceToml], balls: &[Ball]) -> Result<Vec<BallDistance>, FileError> {
        let known: Vec<&str> = balls.iter().map(|b| b.id.as_str()).collect();
        let mut distances = Vec::with_capacity(tables.len());
        for (k, t) in tables.iter().enumerate() {
            let mut between = [0; 2];
            for (end, id) in t.between.iter().enumerate() {
                between[end] = known.iter().position(|b| b == id).ok_or_else(|| {
                    self.wrong(
                        format!("ball_distance[{k}].between[{end}]"),
                        format!("there is no ball `{id}`"),
                        format!("balls: {}", known.join(", ")),
                    )
                })?;
            }
            if between[0] == between[1] {
                return Err(self.wrong(format!("ball_distance[{k}].between"), "names one ball twice", "name two balls"));
            }
            let distance = self.positive(&format!("ball_distance[{k}].d_mm"), t.d_mm)? * MM;
            let sigma = self.positive(&format!("ball_distance[{k}].sigma_um"), t.sigma_um)? * UM;
            distances.push(BallDistance { between, distance, sigma });
        }
        Ok(distances)
    }

    fn anchors(&self, tables: &[AnchorToml]) -> Result<Vec<Anchor>, FileError> {
        self.names("anchor", "id", tables.iter().map(|a| a.id.as_str()))?;
        Ok(tables.iter().map(|a| Anchor { id: a.id.clone(), position: Vector3::new(a.x_mm, a.y_mm, a.z_mm) * MM }).collect())
    }

    fn noise(&self, table: &NoiseToml, robot: &Robot) -> Result<Noise, FileError> {
        let given =
            |key: &str, value: Option<f64>, unit: f64| value.map(|v| self.positive(key, v).map(|v| v * unit)).transpose();
        let angles = self.joint_noise("noise.joint_arcsec", JointKind::Revolute, ARCSEC, &table.joint_arcsec, robot)?;
        let lengths = self.joint_noise("noise.joint_um", JointKind::Prismatic, UM, &table.joint_um, robot)?;
        let joint = if lengths.is_empty() {
            angles
        } else {
            (0..lengths.len()).map(|k| lengths[k] + angles.get(k).copied().unwrap_or_default()).collect()
        };
        Ok(Noise {
            ball: given("noise.ball_um", table.ball_um, UM)?,
            point: given("noise.point_um", table.point_um, UM)?,
            orientation: given("noise.orientation_deg", table.orientation_deg, DEG)?,
            joint,
            seen_from_tool: table.seen_from_tool,
        })
    }

    /// The noise of all joints, of which only those of one kind have any.
    fn joint_noise(&self, key: &str, kind: JointKind, unit: f64, given: &[f64], robot: &Robot) -> Result<Vec<f64>, FileError> {
        let joints = robot.joints();
        if !given.is_empty() && given.len() != joints {
            let problem = format!("{} numbers, and the robot has {joints} joints", given.len());
            return Err(self.wrong(key, problem, "give one a joint"));
        }
        let of_joint = |(k, &v): (usize, &f64)| {
            let key = format!("{key}[{k}]");
            if v != 0.0 && robot.kind(k) != kind {
                let problem = format!("joint {} is {}", k + 1, robot.kind(k).name());
                return Err(self.wrong(
                    &key,
                    problem,
                    "write 0 here: joint_arcsec is of joints that turn, joint_um of the others",
                ));
            }
            self.not_negative(&key, v).map(|v| v * unit)
        };
        given.iter().enumerate().map(of_joint).collect()
    }
}
