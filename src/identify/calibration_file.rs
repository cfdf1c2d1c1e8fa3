//! `calibration.toml`: a calibration in mm and deg, readable by people and programs.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{DMatrix, Vector3};
use serde::{Deserialize, Serialize};

use super::own_effects::{OwnEffectTable, tables};
use super::{Calibration, EffectList, Estimate, MeasuredSetup, Model, Outcome, check_effects};
use crate::effects::{self, Subject};
use crate::files::{FileError, field_error, name_remedy, parse_toml, read_text, write_whole};
use crate::math::Observability;
use crate::robot::{FramePose, Payload, built_in, robot, to_toml};
use crate::units::{DEG, MM, Unit};

/// Format tag.
pub const FORMAT: &str = "calibench-calibration/1";

/// Upper limit of any parameter in the unit of its file: a kilometre, thousands of revolutions.
const BELIEVABLE: f64 = 1e6;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    robot: String,
    effects: Vec<String>,
    #[serde(default)]
    measured_torques: bool,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    width: BTreeMap<String, f64>,
    dataset_sha256: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    absolute_accuracy: Option<bool>,
    unresolved: Vec<Vec<String>>,
    fit: FitTable,
    #[serde(default)]
    joint_range: Vec<JointRange>,
    #[serde(default)]
    setup: Vec<SetupTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effect: Vec<OwnEffectTable>,
    #[serde(default)]
    parameter: Vec<ParameterTable>,
    /// Correlations of the parameters, row k holding those with parameters 1 to k.
    correlation: Vec<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FitTable {
    /// See [`Outcome`]; older files do not state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    outcome: Option<String>,
    samples: usize,
    rms_mm: f64,
    chi2_per_dof: f64,
    dof: usize,
    rank: usize,
    condition: f64,
    noise_stated: bool,
    iterations: usize,
    #[serde(rename = "O1")]
    o1: f64,
    #[serde(rename = "O2")]
    o2: f64,
    #[serde(rename = "O3")]
    o3: f64,
    #[serde(rename = "O4")]
    o4: f64,
    #[serde(rename = "O5")]
    o5: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointRange {
    joint: usize,
    min_deg: f64,
    max_deg: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SetupTable {
    label: String,
    dataset: String,
    session: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    duration_s: Option<f64>,
    gravity_m_s2: [f64; 3],
    /// Starting base of the fit; components that could not be determined kept these values.
    base_start: FrameTable,
    /// TCP in the last frame, as certified.
    tool: FrameTable,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    payload: Vec<PayloadTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PayloadTable {
    name: String,
    mass_kg: f64,
    com_mm: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameTable {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    a_deg: f64,
    b_deg: f64,
    c_deg: f64,
}

impl FrameTable {
    fn of(frame: &FramePose) -> Self {
        let ([x_mm, y_mm, z_mm], [a_deg, b_deg, c_deg]) = (frame.xyz.map(|v| v / MM), frame.rz_ry_rx.map(|v| v / DEG));
        FrameTable { x_mm, y_mm, z_mm, a_deg, b_deg, c_deg }
    }

    fn pose(&self) -> FramePose {
        FramePose {
            xyz: [self.x_mm, self.y_mm, self.z_mm].map(|v| v * MM),
            rz_ry_rx: [self.a_deg, self.b_deg, self.c_deg].map(|v| v * DEG),
        }
    }
}

impl SetupTable {
    fn of(setup: &MeasuredSetup) -> Self {
        let payload = |p: &Payload| PayloadTable { name: p.name.clone(), mass_kg: p.mass, com_mm: (p.com / MM).into() };
        SetupTable {
            label: setup.label.clone(),
            dataset: setup.dataset.clone(),
            session: setup.session.clone(),
            duration_s: setup.duration_s,
            gravity_m_s2: setup.gravity.into(),
            base_start: FrameTable::of(&setup.base),
            tool: FrameTable::of(&setup.tool),
            payload: setup.payloads.iter().map(payload).collect(),
        }
    }

    fn setup(self) -> MeasuredSetup {
        let payload = |p: PayloadTable| Payload { name: p.name, mass: p.mass_kg, com: Vector3::from(p.com_mm) * MM };
        MeasuredSetup {
            label: self.label,
            dataset: self.dataset,
            session: self.session,
            base: self.base_start.pose(),
            tool: self.tool.pose(),
            gravity: Vector3::from(self.gravity_m_s2),
            payloads: self.payload.into_iter().map(payload).collect(),
            duration_s: self.duration_s,
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterTable {
    name: String,
    effect: String,
    value: f64,
    sigma: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_noise: Option<f64>,
    unit: String,
    nominal: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    stated_sigma: Option<f64>,
}

/// Writes a calibration atomically; a robot that is not built in is written beside it, as `NAME.robot.toml`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_calibration(c: &Calibration, path: &Path) -> Result<(), FileError> {
    let o = &c.observability;
    let own_robot = built_in(&c.robot_reference).is_none().then(|| own_robot_name(path));
    let file = File {
        format: FORMAT.into(),
        robot: own_robot.clone().unwrap_or_else(|| c.robot_reference.clone()),
        effects: c.model.effects.clone(),
        measured_torques: c.model.measured_torques,
        width: c.model.width.clone(),
        dataset_sha256: c.dataset_hashes.clone(),
        absolute_accuracy: c.absolute_accuracy,
        unresolved: c.unresolved.clone(),
        fit: FitTable {
            outcome: c.outcome.map(|o| o.name().into()),
            samples: c.samples,
            rms_mm: c.rms / MM,
            chi2_per_dof: c.chi2_per_dof,
            dof: c.dof,
            rank: c.rank,
            condition: c.condition,
            noise_stated: c.noise_stated,
            iterations: c.iterations,
            o1: o.o1,
            o2: o.o2,
            o3: o.o3,
            o4: o.o4,
            o5: o.o5,
        },
        joint_range: c
            .joint_ranges
            .iter()
            .enumerate()
            .map(|(i, r)| JointRange { joint: i + 1, min_deg: r[0] / DEG, max_deg: r[1] / DEG })
            .collect(),
        setup: c.setups.iter().map(SetupTable::of).collect(),
        effect: tables(&c.model.own, &c.model.effects),
        parameter: c
            .estimates
            .iter()
            .map(|e| ParameterTable {
                name: e.name.clone(),
                effect: e.effect.clone(),
                value: e.unit.from_si(e.value),
                sigma: e.unit.from_si(e.sigma),
                sigma_noise: Some(e.unit.from_si(e.sigma_noise)),
                unit: e.unit.symbol.into(),
                nominal: e.unit.from_si(e.nominal),
                stated_sigma: e.stated_sigma.map(|s| e.unit.from_si(s)),
            })
            .collect(),
        correlation: (0..c.correlation.nrows()).map(|r| (0..=r).map(|k| c.correlation[(r, k)]).collect()).collect(),
    };
    let text = toml::to_string(&file).map_err(|e| FileError::whole(path, e.to_string(), "report this as a defect"))?;
    if let Some(name) = own_robot {
        write_whole(&path.with_file_name(name), to_toml(&c.robot).as_bytes())?;
    }
    write_whole(path, text.as_bytes())
}

/// File name of a robot that is not built in, for the calibration at `path`.
fn own_robot_name(path: &Path) -> String {
    // The name is stored in the calibration, which is text, so it must be UTF-8.
    format!("{}.robot.toml", path.file_stem().and_then(|s| s.to_str()).unwrap_or("calibration"))
}

/// Checks that a parameter belongs to an effect of the file and has a suitable unit; the error holds the field, the problem
/// and the remedy.
fn check_parameter(
    p: &ParameterTable,
    unit: Unit,
    effects: &[String],
    subject: &Subject<'_>,
) -> Result<(), (&'static str, String, String)> {
    let again = || "identify the robot again, and write the calibration anew".to_owned();
    for (field, text) in [("name", &p.name), ("effect", &p.effect)] {
        if text.chars().any(char::is_control) {
            return Err((field, format!("{text:?} holds a control character"), "use printable characters".into()));
        }
    }
    // Free and uncertain tools and balls come from the data, not from the model.
    let of_data = p.effect == "tool_frame" || p.effect.starts_with("ball:");
    if !of_data && !effects.contains(&p.effect) {
        return Err((
            "effect",
            format!("'{}' is not among the effects of this calibration", p.effect),
            format!("add it to `effects`, or {}", again()),
        ));
    }
    let effect = effects::build(&p.effect, subject).map_err(|e| ("effect", e.to_string(), again()))?;
    let own = |name: &str| p.name.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('@'));
    let spec = effect.parameters().iter().find(|spec| own(&spec.name));
    let spec = spec.ok_or_else(|| ("name", format!("'{}' is no parameter of effect '{}'", p.name, p.effect), again()))?;
    if quantity(spec.unit) == quantity(unit) {
        return Ok(());
    }
    Err(("unit", format!("'{}' does not measure {}", unit.symbol, p.name), format!("give it in {}", spec.unit.symbol)))
}

/// The quantity a unit measures, represented by one unit.
fn quantity(unit: Unit) -> &'static str {
    match unit {
        Unit::MM | Unit::UM => "mm",
        Unit::DEG | Unit::MRAD | Unit::URAD => "deg",
        Unit::MDEG_PER_NM | Unit::URAD_PER_NM => "mdeg/(N·m)",
        other => other.symbol,
    }
}

fn outcome(name: &str) -> Option<Outcome> {
    Outcome::ALL.into_iter().find(|(_, n)| *n == name).map(|(outcome, _)| outcome)
}

/// Reads a calibration; a robot given by a path is looked up beside the file.
///
/// # Errors
/// A single error that names file, line, key and remedy.
pub fn read_calibration(path: &Path) -> Result<Calibration, FileError> {
    let text = read_text(path)?;
    let file: File = parse_toml(path, &text)?;
    let wrong = |key: &str, problem: String, remedy: &str| field_error(path, &text, key, problem, remedy);
    let again = "identify the robot again, and write the calibration anew";
    if file.format != FORMAT {
        return Err(wrong("format", format!("is '{}', not '{FORMAT}'", file.format), again));
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    let robot =
        robot(&file.robot, folder).map_err(|e| if e.path.is_file() { e } else { wrong("robot", e.problem, &e.remedy) })?;
    // The names of the balls are known only from the effects that refer to them.
    let mut balls: Vec<String> = file.effects.iter().filter_map(|id| id.strip_prefix("ball:").map(str::to_owned)).collect();
    balls.extend(file.effect.iter().flat_map(|table| table.balls()));
    let of_ball = |p: &ParameterTable| p.effect.strip_prefix("ball:").map(str::to_owned);
    balls.extend(file.parameter.iter().filter_map(of_ball));
    let subject = Subject::new(&robot, &balls);
    let (own, effects) =
        check_effects(&EffectList { path, text: &text, key: "effects", ids: &file.effects, tables: &file.effect }, &subject)?;
    let subject = Subject { own: &own, ..subject };
    if file.joint_range.len() != robot.joints() {
        return Err(wrong(
            "joint_range",
            format!("has {} entries for {} joints", file.joint_range.len(), robot.joints()),
            again,
        ));
    }
    for (k, range) in file.joint_range.iter().enumerate() {
        if range.min_deg > range.max_deg {
            return Err(wrong(&format!("joint_range[{k}]"), "has its minimum above its maximum".into(), again));
        }
    }
    if file.fit.rms_mm < 0.0 {
        return Err(wrong("fit.rms_mm", "is negative".into(), again));
    }
    let mut estimates: Vec<Estimate> = Vec::new();
    for (k, p) in file.parameter.iter().enumerate() {
        let key = |field: &str| format!("parameter[{k}].{field}");
        for (field, number) in [("value", p.value), ("nominal", p.nominal)] {
            if number.abs() > BELIEVABLE {
                return Err(wrong(&key(field), format!("is {number:e} {}, which no arm can have", p.unit), again));
            }
        }
        let unit = Unit::from_symbol(&p.unit)
            .ok_or_else(|| wrong(&key("unit"), format!("'{}' is no unit known here", p.unit), again))?;
        for (field, sigma) in [("sigma", Some(p.sigma)), ("sigma_noise", p.sigma_noise), ("stated_sigma", p.stated_sigma)] {
            if sigma.is_some_and(|s| s < 0.0) {
                return Err(wrong(&key(field), "is negative".into(), again));
            }
        }
        if estimates.iter().any(|e| e.name == p.name) {
            return Err(wrong(&key("name"), format!("'{}' stands twice", p.name), "keep one of the two"));
        }
        check_parameter(p, unit, &effects, &subject)
            .map_err(|(field, problem, remedy)| field_error(path, &text, &key(field), problem, remedy))?;
        estimates.push(Estimate {
            name: p.name.clone(),
            effect: p.effect.clone(),
            unit,
            value: unit.to_si(p.value),
            sigma: unit.to_si(p.sigma),
            sigma_noise: unit.to_si(p.sigma_noise.unwrap_or(p.sigma)),
            nominal: unit.to_si(p.nominal),
            stated_sigma: p.stated_sigma.map(|s| unit.to_si(s)),
        });
    }
    let m = estimates.len();
    let shaped = file.correlation.len() == m && file.correlation.iter().enumerate().all(|(r, row)| row.len() == r + 1);
    if !shaped || file.correlation.iter().flatten().any(|v| !(-1.000_001..=1.000_001).contains(v)) {
        return Err(wrong("correlation", format!("is not the lower triangle of {m} x {m} correlations"), again));
    }
    let correlation = DMatrix::from_fn(m, m, |r, c| file.correlation[r.max(c)][r.min(c)]);
    let f = &file.fit;
    let outcome = match &f.outcome {
        None => None,
        Some(name) => Some(outcome(name).ok_or_else(|| {
            let known = Outcome::ALL.map(|(_, name)| name);
            wrong("fit.outcome", format!("'{name}' is no outcome of a fit"), &name_remedy(name, &known))
        })?),
    };
    Ok(Calibration {
        robot: std::sync::Arc::new(robot),
        robot_reference: file.robot.clone(),
        model: Model { effects, own, measured_torques: file.measured_torques, width: file.width, ..Model::default() },
        estimates,
        correlation,
        unresolved: file.unresolved,
        setups: file.setup.into_iter().map(SetupTable::setup).collect(),
        outcome,
        samples: f.samples,
        rms: f.rms_mm * MM,
        chi2_per_dof: f.chi2_per_dof,
        dof: f.dof,
        rank: f.rank,
        condition: f.condition,
        observability: Observability { o1: f.o1, o2: f.o2, o3: f.o3, o4: f.o4, o5: f.o5 },
        noise_stated: f.noise_stated,
        iterations: f.iterations,
        joint_ranges: file.joint_range.iter().map(|r| [r.min_deg * DEG, r.max_deg * DEG]).collect(),
        dataset_hashes: file.dataset_sha256,
        absolute_accuracy: file.absolute_accuracy,
    })
}
