//! Reads `calibration.toml`, and reports impossible values in it.

use std::path::Path;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::super::{FittedRows, Model};
use super::FORMAT;
use super::tables::{File, JointRange, ParameterTable, SetupTable};
use crate::effects::registry::Registry;
use crate::effects::{self, EffectId, Subject};
use crate::files::disk::is_file;
use crate::files::{FileError, field_error, name_remedy, parse_toml, read_text};
use crate::identify::calibration::{Calibration, Estimate};
use crate::identify::fit::Outcome;
use crate::identify::model_file::{EffectList, check_effects, field_of};
use crate::math::Observability;
use crate::robot::robot_file::robot;
use crate::robot::{JointKind, Robot};
use crate::units::{DEG, MM, Unit};

/// Upper limit of any parameter in the unit of its file: a kilometre, thousands of revolutions.
const BELIEVABLE: f64 = 1e6;

/// The remedy of what no edit mends.
const AGAIN: &str = "identify the robot again, and write the calibration again";

/// A field, what is wrong with it, and the remedy.
type Wrong = (&'static str, String, String);

/// Reads a calibration, the effects of which are of the families of `registry`; a robot given by a path is looked up beside the
/// file.
///
/// # Errors
/// A single error that names file, line, key and remedy.
pub fn read_calibration(path: &Path, registry: &Registry) -> Result<Calibration, FileError> {
    let text = read_text(path)?;
    let reader = Reader { path, text: &text, file: parse_toml(path, &text)? };
    reader.check_format()?;
    let robot = reader.robot()?;
    let balls = reader.balls();
    let field = field_of(reader.file.error_field.clone(), path, &text)?;
    let subject = Subject { field: field.as_ref(), registry, ..Subject::new(&robot, &balls) };
    let Reader { file, .. } = &reader;
    let list = EffectList { path, text: &text, key: "effects", ids: &file.effects, tables: &file.effect };
    let (own, effects) = check_effects(&list, &subject)?;
    let subject = Subject { own: &own, ..subject };
    let joint_ranges = reader.joint_ranges(&robot)?;
    let estimates = reader.estimates(&effects, &subject)?;
    let correlation = reader.correlation(estimates.len())?;
    let outcome = reader.outcome()?;
    let File { fit: f, .. } = file;
    if f.rms_mm < 0.0 {
        return Err(reader.wrong("fit.rms_mm", "is negative", AGAIN));
    }
    Ok(Calibration {
        robot_reference: file.robot.clone(),
        model: Model {
            effects: effects.into_iter().map(EffectId::from).collect(),
            own,
            measured_torques: file.measured_torques,
            width: file.width.clone(),
            field: field.clone(),
            registry: registry.clone(),
            ..Model::default()
        },
        estimates,
        correlation,
        unresolved: file.unresolved.clone(),
        setups: file.setup.iter().map(SetupTable::setup).collect(),
        outcome,
        samples: f.samples,
        rms: f.rms_mm * MM,
        rms_orientation: f.rms_orientation_deg.map(|r| r * DEG),
        chi2_per_dof: f.chi2_per_dof,
        dof: f.dof,
        rank: f.rank,
        condition: f.condition,
        observability: Observability { o1: f.o1, o2: f.o2, o3: f.o3, o4: f.o4, o5: f.o5 },
        noise_stated: f.noise_stated,
        iterations: f.iterations,
        joint_ranges,
        dataset_hashes: reader.digests()?,
        fitted_rows: reader.fitted_rows()?,
        absolute_accuracy: file.absolute_accuracy,
        fleet_robots: file.fleet_robots,
        misfit: file.misfit.clone(),
        robot: Arc::new(robot),
    })
}

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
    file: File,
}

impl Reader<'_> {
    fn wrong(&self, key: &str, problem: impl Into<String>, remedy: &str) -> FileError {
        field_error(self.path, self.text, key, problem.into(), remedy)
    }

    fn check_format(&self) -> Result<(), FileError> {
        let format = &self.file.format;
        if format == FORMAT { Ok(()) } else { Err(self.wrong("format", format!("is '{format}', not '{FORMAT}'"), AGAIN)) }
    }

    fn digests(&self) -> Result<Vec<String>, FileError> {
        let is_digest = |text: &String| text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit());
        match self.file.dataset_sha256.iter().find(|text| !text.is_empty() && !is_digest(text)) {
            Some(text) => {
                let problem = format!("'{text}' is not a SHA-256 digest, which has 64 hexadecimal digits");
                Err(self.wrong("dataset_sha256", problem, AGAIN))
            }
            None => Ok(self.file.dataset_sha256.clone()),
        }
    }

    fn fitted_rows(&self) -> Result<FittedRows, FileError> {
        let rows = FittedRows::from_text(&self.file.fitted_rows);
        rows.ok_or_else(|| self.wrong("fitted_rows", "is not a list of digests in order", "leave it out"))
    }

    fn robot(&self) -> Result<Robot, FileError> {
        let folder = self.path.parent().unwrap_or(Path::new("."));
        robot(&self.file.robot, folder)
            .map_err(|e| if is_file(&e.path) { e } else { self.wrong("robot", e.problem, &e.remedy) })
    }

    /// Names of the balls, which are known only from the effects that refer to them.
    fn balls(&self) -> Vec<String> {
        let File { effects, effect: own, parameter, .. } = &self.file;
        let of_parameters = parameter.iter().map(|p| &p.effect);
        let named = effects.iter().chain(of_parameters).filter_map(|id| EffectId::new(id).ball_of().map(str::to_owned));
        named.chain(own.iter().flat_map(|table| table.balls())).collect()
    }

    fn joint_ranges(&self, robot: &Robot) -> Result<Vec<[f64; 2]>, FileError> {
        let ranges = &self.file.joint_range;
        if ranges.len() != robot.joints() {
            let problem = format!("has {} entries for {} joints", ranges.len(), robot.joints());
            return Err(self.wrong("joint_range", problem, AGAIN));
        }
        let range = |(k, (range, kind)): (usize, (&JointRange, JointKind))| match range.si(kind) {
            Some([low, high]) if low > high => {
                Err(self.wrong(&format!("joint_range[{k}]"), "has its minimum above its maximum", AGAIN))
            }
            Some(range) => Ok(range),
            None => {
                let problem = format!("is not in the unit of joint {}, which is {}", k + 1, kind.name());
                Err(self.wrong(&format!("joint_range[{k}]"), problem, AGAIN))
            }
        };
        ranges.iter().zip(robot.kinds()).enumerate().map(range).collect()
    }

    fn estimates(&self, effects: &[String], subject: &Subject<'_>) -> Result<Vec<Estimate>, FileError> {
        let mut estimates: Vec<Estimate> = Vec::new();
        for (k, p) in self.file.parameter.iter().enumerate() {
            let named = |(field, problem, remedy): Wrong| self.wrong(&format!("parameter[{k}].{field}"), problem, &remedy);
            if estimates.iter().any(|e| e.name == p.name) {
                return Err(named(("name", format!("'{}' appears twice", p.name), "keep one of the two".into())));
            }
            estimates.push(checked(p, effects, subject).map_err(named)?);
        }
        Ok(estimates)
    }

    fn correlation(&self, m: usize) -> Result<DMatrix<f64>, FileError> {
        let rows = &self.file.correlation;
        let shaped = rows.len() == m && rows.iter().enumerate().all(|(r, row)| row.len() == r + 1);
        if !shaped || rows.iter().flatten().any(|v| !(-1.000_001..=1.000_001).contains(v)) {
            return Err(self.wrong("correlation", format!("is not the lower triangle of {m} x {m} correlations"), AGAIN));
        }
        Ok(DMatrix::from_fn(m, m, |r, c| rows[r.max(c)][r.min(c)]))
    }

    fn outcome(&self) -> Result<Option<Outcome>, FileError> {
        let Some(name) = &self.file.fit.outcome else { return Ok(None) };
        let known = Outcome::ALL.into_iter().find(|(_, n)| n == name).map(|(outcome, _)| outcome);
        known.map(Some).ok_or_else(|| {
            let names = Outcome::ALL.map(|(_, name)| name);
            self.wrong("fit.outcome", format!("'{name}' is not an outcome of a fit"), &name_remedy(name, &names))
        })
    }
}

/// A parameter as an estimate, if its numbers are possible and its effect has it.
fn checked(p: &ParameterTable, effects: &[String], subject: &Subject<'_>) -> Result<Estimate, Wrong> {
    for (field, number) in [("value", p.value), ("nominal", p.nominal)] {
        if number.abs() > BELIEVABLE {
            return Err((field, format!("is {number:e} {}, which no arm can have", p.unit), AGAIN.into()));
        }
    }
    let unit = Unit::from_symbol(&p.unit).ok_or_else(|| ("unit", format!("'{}' is not a known unit", p.unit), AGAIN.into()))?;
    for (field, sigma) in [("sigma", Some(p.sigma)), ("sigma_noise", p.sigma_noise), ("stated_sigma", p.stated_sigma)] {
        if sigma.is_some_and(|s| s < 0.0) {
            return Err((field, "is negative".into(), AGAIN.into()));
        }
    }
    check_parameter(p, unit, effects, subject)?;
    Ok(Estimate {
        name: p.name.clone(),
        effect: p.effect.clone().into(),
        unit,
        value: unit.to_si(p.value),
        sigma: unit.to_si(p.sigma),
        sigma_noise: unit.to_si(p.sigma_noise.unwrap_or(p.sigma)),
        nominal: unit.to_si(p.nominal),
        stated_sigma: p.stated_sigma.map(|s| unit.to_si(s)),
    })
}

/// Checks that a parameter belongs to an effect of the file and has a suitable unit.
fn check_parameter(p: &ParameterTable, unit: Unit, effects: &[String], subject: &Subject<'_>) -> Result<(), Wrong> {
    for (field, text) in [("name", &p.name), ("effect", &p.effect)] {
        if text.chars().any(char::is_control) {
            return Err((field, format!("{text:?} holds a control character"), "use printable characters".into()));
        }
    }
    // Free and uncertain tools, targets and balls come from the data, not from the model.
    let id = EffectId::new(&p.effect);
    let of_data = matches!(id.family(), EffectId::TOOL_FRAME | EffectId::PROBE_ROTATION | EffectId::TARGET | EffectId::BALL);
    if !of_data && !effects.contains(&p.effect) {
        let problem = format!("'{}' is not among the effects of this calibration", p.effect);
        return Err(("effect", problem, format!("add it to `effects`, or {AGAIN}")));
    }
    let effect = effects::build(&p.effect, subject).map_err(|e| ("effect", e.to_string(), AGAIN.to_owned()))?;
    let own = |name: &str| p.name.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('@'));
    let spec = effect.parameters().iter().find(|spec| own(&spec.name));
    let spec =
        spec.ok_or_else(|| ("name", format!("'{}' is not a parameter of effect '{}'", p.name, p.effect), AGAIN.to_owned()))?;
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
