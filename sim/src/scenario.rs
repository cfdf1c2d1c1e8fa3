//! A scenario: one question, the cell that answers it, what is truly wrong, and what is expected to come out.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::effects::{self, Subject};
use calibench::files::{FileError, field_error, parse_toml, read_text};
use calibench::identify::{Model, OwnEffectTable, check_effects, own_effects};
use calibench::measure::{Ball, Dataset, Noise, check_description};
use calibench::robot::{FramePose, Payload, Robot, Solid, Surroundings, robot};
use calibench::units::{ARCSEC, DEG, MM, MRAD, UM};
use nalgebra::{Unit, Vector3};
use serde::Deserialize;
use toml::{Table, Value};

use crate::arm::TrueEffect;
use crate::contact::{DATUM_RADIUS, TRAVEL};
use crate::controller::ControllerSpec;
use crate::planning::TRACKER_POOL;
use crate::plunger::PlungerSpec;
use crate::tracker::TrackerSpec;

/// Format tag of scenario files.
pub const FORMAT: &str = "calibench-scenario/1";

/// No number of a cell, in mm, um, deg or what its key says, is larger: a kilometre in um.
const LARGEST: f64 = 1e9;
/// Balls of one artifact.
const MOST_BALLS: usize = 100;
/// Poses of one plan, candidates it is chosen from (their Jacobian then takes 100 MB), starts of the search, poses to validate on.
const MOST_POSES: usize = 2_000;
const MOST_CANDIDATES: usize = 100_000;
const MOST_STARTS: usize = 100;
const MOST_VALIDATION_POSES: usize = 20_000;
/// Slower than this, deg/s, no session ends.
const SLOWEST: f64 = 1e-3;

/// A scenario as written; the units are in the names.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // the keys of the file, described in docs/scenarios.md
pub struct Scenario {
    pub format: String,
    pub name: String,
    pub question: String,
    pub seed: u64,
    pub robot: String,
    pub gravity_m_s2: [f64; 3],
    pub base: FrameSpec,
    pub tool: FrameSpec,
    #[serde(rename = "payload")]
    pub payloads: Vec<PayloadSpec>,
    #[serde(rename = "ball")]
    pub balls: Vec<BallSpec>,
    pub noise: NoiseSpec,
    #[serde(rename = "solid", default)]
    pub solids: Vec<SolidSpec>,
    #[serde(default)]
    pub carried: Vec<SolidSpec>,
    pub plan: PlanSpec,
    pub centring: CentringSpec,
    pub tracker: TrackerPlace,
    pub model: ModelSpec,
    pub truth: TruthSpec,
    #[serde(default)]
    pub expect: BTreeMap<String, [f64; 2]>,
    /// Files that it was read from, the scenario's own first.
    #[serde(skip)]
    files: Vec<(PathBuf, String)>,
    /// All keys, those of the extended file under the scenario's own.
    #[serde(skip)]
    merged: Table,
    /// The robot that `robot` names.
    #[serde(skip)]
    loaded: Option<Arc<Robot>>,
}

/// A frame: position, then turns about z, y, x.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct FrameSpec {
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(default)]
    pub a_deg: f64,
    #[serde(default)]
    pub b_deg: f64,
    #[serde(default)]
    pub c_deg: f64,
    #[serde(default)]
    pub sigma_um: f64,
}

impl FrameSpec {
    /// The frame in SI.
    pub fn frame(&self) -> FramePose {
        FramePose {
            xyz: [self.x_mm, self.y_mm, self.z_mm].map(|v| v * MM),
            rz_ry_rx: [self.a_deg, self.b_deg, self.c_deg].map(|v| v * DEG),
        }
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct PayloadSpec {
    pub name: String,
    pub mass_kg: f64,
    pub com_mm: [f64; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct BallSpec {
    pub id: String,
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(default)]
    pub sigma_um: f64,
    #[serde(default = "up")]
    pub outward: [f64; 3],
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct NoiseSpec {
    pub ball_um: f64,
    pub point_um: f64,
    pub joint_arcsec: Vec<f64>,
}

/// A body: a box (`min_mm`, `max_mm`) or a capsule (`from_mm`, `to_mm`, `radius_mm`).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct SolidSpec {
    pub name: String,
    pub min_mm: Option<[f64; 3]>,
    pub max_mm: Option<[f64; 3]>,
    pub from_mm: Option<[f64; 3]>,
    pub to_mm: Option<[f64; 3]>,
    pub radius_mm: Option<f64>,
}

/// In which order the balls are probed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Turn by turn: drift cannot pass for a ball's error.
    Interleaved,
    /// All poses of one ball, then the next, as the paper does.
    BallByBall,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct PlanSpec {
    pub poses_per_ball: usize,
    pub reserves_per_ball: usize,
    pub pool_per_ball: usize,
    pub starts: usize,
    pub cone_deg: f64,
    pub retreat_mm: f64,
    pub clearance_mm: f64,
    pub order: Order,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct CentringSpec {
    pub tolerance_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct TrackerPlace {
    pub position_mm: [f64; 3],
    pub facing_deg: f64,
    pub identification_poses: usize,
    pub validation_poses: usize,
    pub nests_mm: [[f64; 3]; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct ModelSpec {
    pub effects: Vec<String>,
    /// The user's own.
    #[serde(default)]
    pub effect: Vec<OwnEffectTable>,
}

/// Everything that is truly so and that no model is told.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct TruthSpec {
    /// Sizes by effect id and parameter (`a1_mm`), or `draw = s`: normal with s times the plausible size.
    #[serde(default)]
    pub effects: BTreeMap<String, BTreeMap<String, f64>>,
    /// True mass of each link over the drawing's, minus one.
    #[serde(default)]
    pub link_mass_error: Vec<f64>,
    pub indicators: IndicatorTruth,
    pub controller: ControllerSpec,
    pub artifact: ArtifactTruth,
    pub tool: ToolTruth,
    pub tracker: TrackerTruth,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct IndicatorTruth {
    pub resolution_um: f64,
    pub noise_um: f64,
    pub scale_error_um: f64,
    pub hysteresis_um: f64,
    pub placement_mm: f64,
    pub tilt_mrad: f64,
    pub squareness_mrad: f64,
    pub concurrency_um: f64,
    pub preload_n: f64,
    pub full_force_n: f64,
    pub drop_out: f64,
    pub ball_diameter_um: f64,
    pub ball_form_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct ArtifactTruth {
    pub ball_sigma_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct ToolTruth {
    pub sigma_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct TrackerTruth {
    pub sigma_um: f64,
    pub point_shots: std::num::NonZeroU32,
    pub nest_shots: std::num::NonZeroU32,
}

/// Reads a scenario and what it extends; every value is checked before anything runs.
///
/// # Errors
/// One error that names file, line, key and remedy.
pub fn load_scenario(path: &Path) -> Result<Scenario, FileError> {
    let text = read_text(path)?;
    let own: Table = parse_toml(path, &text)?;
    let mut files = vec![(path.to_owned(), text)];
    let merged = extend(path, own, &mut files)?;
    let whole = merged.to_string();
    let mut scenario: Scenario = parse_toml(path, &whole).map_err(|e| place(&files, &e.field, e.problem, e.remedy))?;
    scenario.files = files;
    scenario.merged = merged;
    scenario.check()?;
    Ok(scenario)
}

/// Merges the file named by `extends` under `own`: tables key by key, everything else replaced.
fn extend(path: &Path, mut own: Table, files: &mut Vec<(PathBuf, String)>) -> Result<Table, FileError> {
    let Some(name) = own.remove("extends") else { return Ok(own) };
    let here = &files[0];
    let Value::String(name) = name else {
        return Err(field_error(&here.0, &here.1, "extends", "is not a file name", "name one scenario file, in quotes"));
    };
    let parent_path = path.parent().unwrap_or(Path::new(".")).join(name);
    let parent_text = read_text(&parent_path).map_err(|e| {
        field_error(
            &here.0,
            &here.1,
            "extends",
            format!("'{}' {}", parent_path.display(), e.problem),
            "name an existing scenario file",
        )
    })?;
    let mut parent: Table = parse_toml(&parent_path, &parent_text)?;
    if parent.contains_key("extends") {
        return Err(field_error(
            &parent_path,
            &parent_text,
            "extends",
            "a file that is extended extends another",
            "extend one level only",
        ));
    }
    merge(&mut parent, own);
    files.push((parent_path, parent_text));
    Ok(parent)
}

fn merge(under: &mut Table, over: Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(below, above),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

/// An error at a key, in that of the files (the scenario's own first) which says most of it.
fn place(files: &[(PathBuf, String)], key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
    // Lists are replaced whole: who has the list has its elements.
    let tables: Vec<&str> = key.split('[').next().unwrap_or_default().split('.').collect();
    let depth = |text: &str| {
        let Ok(root) = text.parse::<Table>() else { return 0 };
        let root = Value::Table(root);
        let mut at = Some(&root);
        tables
            .iter()
            .take_while(|name| {
                at = at.and_then(|v| v.get(**name));
                at.is_some()
            })
            .count()
    };
    // The first of equals: `max_by_key` takes the last.
    match files.iter().rev().max_by_key(|(_, text)| depth(text)) {
        Some((path, text)) => field_error(path, text, key, problem, remedy),
        None => FileError::whole(Path::new("scenario"), problem, remedy),
    }
}

impl Scenario {
    /// An error at a key of the scenario, in the file that has it.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        place(&self.files, key, problem, remedy)
    }

    /// Folder of the scenario file, for paths relative to it.
    pub fn folder(&self) -> PathBuf {
        self.files.first().and_then(|(p, _)| p.parent()).unwrap_or(Path::new(".")).to_owned()
    }

    /// The robot.
    pub fn robot(&self) -> Arc<Robot> {
        self.loaded.clone().unwrap_or_else(|| Dataset::default().robot)
    }

    fn check(&mut self) -> Result<(), FileError> {
        if self.format != FORMAT {
            return Err(self.wrong("format", format!("is '{}'", self.format), format!("write format = \"{FORMAT}\"")));
        }
        let robot = robot(&self.robot, &self.folder())
            .map_err(|e| if e.path.is_file() { e } else { self.wrong("robot", e.problem, e.remedy) })?;
        let n = robot.joints();
        self.loaded = Some(Arc::new(robot));
        if self.payloads.is_empty() {
            return Err(self.wrong("payload", "there is none", "give at least one [[payload]]"));
        }
        if !(1..=MOST_BALLS).contains(&self.balls.len()) {
            return Err(self.wrong(
                "ball",
                format!("there are {}", self.balls.len()),
                format!("give 1 to {MOST_BALLS} [[ball]]"),
            ));
        }
        for (k, ball) in self.balls.iter().enumerate() {
            if ball.outward.iter().all(|&v| v == 0.0) {
                return Err(self.wrong(
                    &format!("ball[{k}].outward"),
                    "has no direction",
                    "point it away from the ball's stem",
                ));
            }
        }
        for (key, list) in [
            ("noise.joint_arcsec", &self.noise.joint_arcsec),
            ("truth.controller.servo_error_arcsec", &self.truth.controller.servo_error_arcsec),
            ("truth.controller.lost_motion_arcsec", &self.truth.controller.lost_motion_arcsec),
            ("truth.controller.small_move_play_arcsec", &self.truth.controller.small_move_play_arcsec),
        ] {
            if list.len() != n {
                return Err(self.wrong(
                    key,
                    format!("has {} numbers", list.len()),
                    format!("give one for each of the {n} joints"),
                ));
            }
        }
        if !self.truth.link_mass_error.is_empty() && self.truth.link_mass_error.len() != n {
            return Err(self.wrong(
                "truth.link_mass_error",
                "has the wrong length",
                format!("give one number for each of the {n} links"),
            ));
        }
        for (path, value) in self.numbers() {
            if value.abs() > LARGEST && path != "seed" {
                return Err(self.wrong(&path, format!("{value:e} is absurdly large"), "check its unit, which is in its name"));
            }
            if value < 0.0 && must_not_be_negative(&path) {
                return Err(self.wrong(&path, format!("is {value}, below zero"), "give zero or a positive number"));
            }
        }
        // A probability, two angles, a reading.
        for (key, value, most) in [
            ("truth.indicators.drop_out", self.truth.indicators.drop_out, 1.0),
            ("plan.cone_deg", self.plan.cone_deg, 180.0),
            ("tracker.facing_deg", self.tracker.facing_deg, 180.0),
            // Beyond the range of an indicator everything is centred.
            ("centring.tolerance_um", self.centring.tolerance_um, TRAVEL / UM),
        ] {
            if value > most {
                return Err(self.wrong(key, format!("is {value}"), format!("give a number from 0 to {most}")));
            }
        }
        if let Some(k) = self.truth.link_mass_error.iter().position(|&e| e <= -1.0) {
            let key = format!("truth.link_mass_error[{k}]");
            return Err(self.wrong(&key, "leaves the link no mass", "give true mass over drawn mass, minus one"));
        }
        let pool = MOST_CANDIDATES / self.balls.len();
        for (key, count, least, most) in [
            ("plan.poses_per_ball", self.plan.poses_per_ball, 1, MOST_POSES / self.balls.len()),
            ("plan.reserves_per_ball", self.plan.reserves_per_ball, 0, MOST_POSES / self.balls.len()),
            ("plan.pool_per_ball", self.plan.pool_per_ball, self.plan.poses_per_ball + self.plan.reserves_per_ball, pool),
            ("plan.starts", self.plan.starts, 1, MOST_STARTS),
            ("tracker.identification_poses", self.tracker.identification_poses, 1, TRACKER_POOL),
            ("tracker.validation_poses", self.tracker.validation_poses, 1, MOST_VALIDATION_POSES),
        ] {
            if !(least..=most).contains(&count) {
                return Err(self.wrong(key, format!("is {count}"), format!("give a whole number from {least} to {most}")));
            }
        }
        if self.truth.controller.speed_deg_per_s < SLOWEST {
            let remedy = format!("give the joints a speed of at least {SLOWEST} deg/s");
            return Err(self.wrong("truth.controller.speed_deg_per_s", "is not positive, or as good as zero", remedy));
        }
        if self.centring.tolerance_um <= 0.0 {
            return Err(self.wrong("centring.tolerance_um", "is not positive", "the paper nulls to 3 um"));
        }
        let as_here = |e: FileError| self.wrong(&e.field, e.problem, e.remedy);
        // What the scenario's datasets will say, in the same keys.
        check_description(&self.dataset(), &self.folder()).map_err(as_here)?;
        let (robot, balls) = (self.robot(), self.ball_ids());
        let subject = Subject::new(&robot, &balls);
        check_effects(Path::new(""), "", "model.effects", &self.model.effects, &self.model.effect, &subject).map_err(as_here)?;
        self.true_effects(&mut |_, _| 0.0)?;
        self.solids("solid", &self.solids)?;
        self.solids("carried", &self.carried)?;
        for (name, [low, high]) in &self.expect {
            if low > high || !crate::run::CHECKS.contains(&name.as_str()) {
                let known = crate::run::CHECKS.join(", ");
                return Err(self.wrong(
                    &format!("expect.{name}"),
                    "is not a check with a band [least, most]",
                    format!("the checks are: {known}"),
                ));
            }
        }
        Ok(())
    }

    /// Every number with its key.
    fn numbers(&self) -> Vec<(String, f64)> {
        fn walk(key: String, value: &Value, out: &mut Vec<(String, f64)>) {
            match value {
                Value::Float(v) => out.push((key, *v)),
                Value::Integer(v) => out.push((key, *v as f64)),
                Value::Array(list) => list.iter().enumerate().for_each(|(k, v)| walk(format!("{key}[{k}]"), v, out)),
                Value::Table(table) => table.iter().for_each(|(k, v)| {
                    let key = if key.is_empty() { k.clone() } else { format!("{key}.{k}") };
                    walk(key, v, out);
                }),
                _ => {}
            }
        }
        let mut out = Vec::new();
        walk(String::new(), &Value::Table(self.merged.clone()), &mut out);
        out
    }

    /// Names of the balls.
    pub fn ball_ids(&self) -> Vec<String> {
        self.balls.iter().map(|b| b.id.clone()).collect()
    }

    /// The true effects with their sizes; `draw(effect and parameter, one-sigma)` gives those that are to be drawn.
    ///
    /// # Errors
    /// When an id, a parameter or its unit does not exist.
    pub fn true_effects(&self, draw: &mut dyn FnMut(&str, f64) -> f64) -> Result<Vec<TrueEffect>, FileError> {
        let (robot, balls) = (self.robot(), self.ball_ids());
        let mut all = Vec::new();
        for (id, given) in &self.truth.effects {
            let key = format!("truth.effects.{id}");
            let effect = effects::build(id, &Subject::new(&robot, &balls))
                .map_err(|e| self.wrong(&key, e.to_string(), "correct its name"))?;
            let keys: Vec<String> = effect.parameters().iter().map(|p| parameter_key(id, &p.name, p.unit.suffix)).collect();
            let drawn = given.get("draw").copied();
            let mut sizes = vec![0.0; keys.len()];
            for (k, spec) in effect.parameters().iter().enumerate() {
                sizes[k] = match given.get(&keys[k]) {
                    Some(value) => spec.unit.to_si(*value),
                    None => drawn.map_or(0.0, |scale| draw(&spec.name, scale * spec.prior)),
                };
            }
            if let Some(unknown) = given.keys().find(|g| *g != "draw" && !keys.contains(g)) {
                return Err(self.wrong(
                    &format!("{key}.{unknown}"),
                    "is not a parameter of this effect",
                    format!("its parameters are: {}, or draw", keys.join(", ")),
                ));
            }
            all.push(TrueEffect { effect, sizes });
        }
        Ok(all)
    }

    fn solids(&self, list: &str, specs: &[SolidSpec]) -> Result<Vec<Solid>, FileError> {
        let v = |a: &[f64; 3]| Vector3::from(*a) * MM;
        let n = self.robot().joints();
        specs
            .iter()
            .enumerate()
            .map(|(k, s)| match (&s.min_mm, &s.max_mm, &s.from_mm, &s.to_mm, s.radius_mm) {
                (Some(min), Some(max), None, None, None) if (0..3).all(|i| min[i] < max[i]) => {
                    Ok(Solid::cuboid(&s.name, n, (v(min) + v(max)) / 2.0, (v(max) - v(min)) / 2.0))
                }
                (None, None, Some(from), Some(to), Some(radius)) if radius > 0.0 => {
                    Ok(Solid::capsule(&s.name, n, [v(from), v(to)], radius * MM))
                }
                _ => Err(self.wrong(
                    &format!("{list}[{k}]"),
                    format!("'{}' is neither a box nor a capsule", s.name),
                    "give min_mm below max_mm for a box, or from_mm, to_mm and a positive radius_mm for a capsule",
                )),
            })
            .collect()
    }

    /// What stands around the arm.
    pub fn surroundings(&self) -> Surroundings {
        // Checked when the scenario was read.
        let mut fixed = self.solids("solid", &self.solids).unwrap_or_default();
        fixed.extend(self.balls.iter().map(|b| {
            let centre = Vector3::new(b.x_mm, b.y_mm, b.z_mm) * MM;
            Solid::capsule(ball_body(&b.id), 0, [centre, centre], DATUM_RADIUS)
        }));
        Surroundings { fixed, carried: self.solids("carried", &self.carried).unwrap_or_default() }
    }

    /// An empty dataset of this cell: what its owner knows.
    pub fn dataset(&self) -> Dataset {
        Dataset {
            robot: self.robot(),
            robot_reference: self.robot.clone(),
            gravity: Vector3::from(self.gravity_m_s2),
            base: self.base.frame(),
            tool: self.tool.frame(),
            tool_sigma: self.tool.sigma_um * UM,
            payloads: self
                .payloads
                .iter()
                .map(|p| Payload { name: p.name.clone(), mass: p.mass_kg, com: Vector3::from(p.com_mm) * MM })
                .collect(),
            balls: self
                .balls
                .iter()
                .map(|b| Ball {
                    id: b.id.clone(),
                    position: Vector3::new(b.x_mm, b.y_mm, b.z_mm) * MM,
                    sigma: b.sigma_um * UM,
                    free: false,
                })
                .collect(),
            noise: Noise {
                ball: Some(self.noise.ball_um * UM),
                point: Some(self.noise.point_um * UM),
                joint: self.noise.joint_arcsec.iter().map(|v| v * ARCSEC).collect(),
            },
            ..Dataset::default()
        }
    }

    /// Directions from which the balls can be approached.
    pub fn outward(&self) -> Vec<Unit<Vector3<f64>>> {
        self.balls.iter().map(|b| Unit::new_normalize(Vector3::from(b.outward))).collect()
    }

    /// The model.
    pub fn model(&self) -> Model {
        let ModelSpec { effects, effect } = &self.model;
        // Checked when the scenario was read.
        let (own, effects) = own_effects(effect, effects).unwrap_or_default();
        Model { effects, own, ..Model::default() }
    }

    /// Flaws of the indicators.
    pub fn plungers(&self) -> PlungerSpec {
        let t = &self.truth.indicators;
        let ideal = PlungerSpec::ideal();
        PlungerSpec {
            placement: t.placement_mm * MM,
            orthogonality: t.squareness_mrad * MRAD,
            concurrency: t.concurrency_um * UM,
            disk_tilt: t.tilt_mrad * MRAD,
            scale_amplitude: t.scale_error_um * UM,
            resolution: t.resolution_um * UM,
            hysteresis: [t.hysteresis_um * UM; 2],
            noise: [t.noise_um * UM; 2],
            preload: t.preload_n,
            full_force: t.full_force_n,
            drop_out: t.drop_out,
            ..ideal
        }
    }

    /// Flaws of the tracker.
    pub fn tracker_spec(&self) -> TrackerSpec {
        let t = &self.truth.tracker;
        TrackerSpec { shot: t.sigma_um * UM, point_shots: t.point_shots, nest_shots: t.nest_shots }
    }
}

/// Name of a ball's body among the surroundings.
pub fn ball_body(id: &str) -> String {
    format!("ball {id}")
}

/// Key of a parameter in `[truth.effects.ID]`: its name without what the id already says, and its unit.
pub fn parameter_key(id: &str, name: &str, suffix: &str) -> String {
    let family = id.split(':').next().unwrap_or(id);
    let own = name
        .strip_prefix(&format!("{id}."))
        .or_else(|| name.strip_prefix(&format!("{family}:")))
        .or_else(|| name.strip_prefix(&format!("{family}.")))
        .unwrap_or(name);
    format!("{own}_{suffix}")
}

/// Keys under which a negative number makes no sense.
fn must_not_be_negative(path: &str) -> bool {
    let last = path.rsplit('.').next().unwrap_or(path);
    let size = [
        "sigma_um",
        "noise_um",
        "ball_um",
        "point_um",
        "_arcsec",
        "mass_kg",
        "resolution",
        "hysteresis",
        "preload",
        "full_force",
        "drop_out",
        "_mrad",
        "concurrency_um",
        "ball_diameter_um",
        "ball_form_um",
        "facing_deg",
        "retreat_mm",
        "clearance_mm",
        "cone_deg",
        "settle_s",
        "scale_error_um",
        "placement_mm",
    ];
    size.iter().any(|s| last.contains(s)) && !path.starts_with("truth.effects")
}
