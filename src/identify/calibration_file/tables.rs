//! Tables of `calibration.toml`.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::super::error_field_file::ErrorFieldTable;
use super::super::own_effects::OwnEffectTable;
use crate::identify::calibration::{Calibration, Estimate, MeasuredSetup};
#[cfg(feature = "schema")]
use crate::identify::fit::Outcome;
use crate::robot::statics::Payload;
use crate::robot::{FramePose, JointKind};
use crate::units::{DEG, MM};

/// An identified robot: every parameter with its uncertainty, and the data that it comes from.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = super::FORMAT)))]
    pub(super) format: String,
    /// A built-in robot, or a robot file relative to this file.
    pub(super) robot: String,
    /// Ids of the effects that were fitted.
    pub(super) effects: Vec<String>,
    /// True if joint torques were taken from the dataset, not from the masses of the links.
    #[serde(default)]
    pub(super) measured_torques: bool,
    /// One-sigma of an effect before the data, in plausible sizes, by its id.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) width: BTreeMap<String, f64>,
    /// SHA-256 of each dataset: of `dataset.toml` followed by `samples.csv`.
    pub(super) dataset_sha256: Vec<String>,
    /// Digests of rows that were fitted, 10 digits each, by which they are recognised in other datasets; of many rows the smallest 2,048.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(super) fitted_rows: String,
    /// True if the controller's own absolute-accuracy option was on; not there if nobody said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) absolute_accuracy: Option<bool>,
    /// Number of robots of the fleet whose prior was used; not there without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) fleet_robots: Option<usize>,
    /// The sentence by which its data were refused, where the fit was forced; not there otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) misfit: Option<String>,
    /// Groups of parameters that the data cannot tell apart.
    pub(super) unresolved: Vec<Vec<String>>,
    /// Goodness of fit.
    pub(super) fit: FitTable,
    /// Joint angles that the data cover, one for every joint; compensation outside them warns.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(length(min = 1)))]
    pub(super) joint_range: Vec<JointRange>,
    /// Each session of each dataset: its base, tool and payloads.
    #[serde(default)]
    pub(super) setup: Vec<SetupTable>,
    /// The user-defined effects among them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) effect: Vec<OwnEffectTable>,
    /// The field of joint errors that the effect `error_field` adds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) error_field: Option<ErrorFieldTable>,
    /// The parameters.
    #[serde(default)]
    pub(super) parameter: Vec<ParameterTable>,
    /// Correlations of the parameters, row k holding those with parameters 1 to k.
    pub(super) correlation: Vec<Vec<f64>>,
}

/// Statistics of the fit.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct FitTable {
    /// Outcome of the iteration; absent in older files.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(extend("enum" = Outcome::ALL.map(|(_, name)| name))))]
    pub(super) outcome: Option<String>,
    /// Samples that were fitted.
    pub(super) samples: usize,
    /// Root mean square of the residuals, mm.
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub(super) rms_mm: f64,
    /// Root mean square of the angles by which measured orientations deviate, deg; only if some were measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rms_orientation_deg: Option<f64>,
    /// Sum of squared residuals over the noise, per degree of freedom.
    pub(super) chi2_per_dof: f64,
    /// Degrees of freedom.
    pub(super) dof: usize,
    /// Rank of the Jacobian.
    pub(super) rank: usize,
    /// Condition number of the scaled Jacobian.
    pub(super) condition: f64,
    /// True if the noise was stated, false if it was estimated from the residuals.
    pub(super) noise_stated: bool,
    /// Iterations.
    pub(super) iterations: usize,
    /// Observability index O1: the geometric mean of the singular values.
    #[serde(rename = "O1")]
    pub(super) o1: f64,
    /// O2: the inverse condition number.
    #[serde(rename = "O2")]
    pub(super) o2: f64,
    /// O3: the smallest singular value.
    #[serde(rename = "O3")]
    pub(super) o3: f64,
    /// O4: O2 times O3, the noise amplification.
    #[serde(rename = "O4")]
    pub(super) o4: f64,
    /// O5: the harmonic mean of the singular values.
    #[serde(rename = "O5")]
    pub(super) o5: f64,
}

impl FitTable {
    pub(super) fn of(c: &Calibration) -> Self {
        let o = &c.observability;
        FitTable {
            outcome: c.outcome.map(|o| o.name().into()),
            samples: c.samples,
            rms_mm: c.rms / MM,
            rms_orientation_deg: c.rms_orientation.map(|r| r / DEG),
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
        }
    }
}

/// Range of a joint in the data, in the unit of its kind.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(extend("oneOf" = crate::schema::in_one_unit())))]
#[serde(deny_unknown_fields)]
pub(super) struct JointRange {
    /// Number of the joint, from 1.
    #[cfg_attr(feature = "schema", schemars(range(min = 1)))]
    pub(super) joint: usize,
    /// Smallest angle, deg.
    #[serde(skip_serializing_if = "Option::is_none")]
    min_deg: Option<f64>,
    /// Largest angle, deg.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_deg: Option<f64>,
    /// Smallest position of a prismatic joint, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    min_mm: Option<f64>,
    /// Largest position of a prismatic joint, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_mm: Option<f64>,
}

impl JointRange {
    /// The range of joint `i`, counted from 0.
    pub(super) fn of(i: usize, [low, high]: [f64; 2], kind: JointKind) -> Self {
        let none = JointRange { joint: i + 1, min_deg: None, max_deg: None, min_mm: None, max_mm: None };
        match kind {
            JointKind::Revolute => JointRange { min_deg: Some(low / DEG), max_deg: Some(high / DEG), ..none },
            JointKind::Prismatic => JointRange { min_mm: Some(low / MM), max_mm: Some(high / MM), ..none },
        }
    }

    /// The range, SI, if it is one of a joint of this kind.
    pub(super) fn si(&self, kind: JointKind) -> Option<[f64; 2]> {
        match (self, kind) {
            (Self { min_deg: Some(low), max_deg: Some(high), min_mm: None, max_mm: None, .. }, JointKind::Revolute) => {
                Some([low * DEG, high * DEG])
            }
            (Self { min_mm: Some(low), max_mm: Some(high), min_deg: None, max_deg: None, .. }, JointKind::Prismatic) => {
                Some([low * MM, high * MM])
            }
            _ => None,
        }
    }
}

/// A session of a dataset.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct SetupTable {
    /// Suffix of its parameter names after `@`; empty if it is the only one.
    pub(super) label: String,
    /// The dataset.
    pub(super) dataset: String,
    /// The session; empty if it has no name.
    pub(super) session: String,
    /// Duration of the session, s, if times were recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) duration_s: Option<f64>,
    /// Gravity in the world frame, m/s².
    pub(super) gravity_m_s2: [f64; 3],
    /// Starting base of the fit; components that could not be determined kept these values.
    pub(super) base_start: FrameTable,
    /// TCP in the last frame, as certified.
    pub(super) tool: FrameTable,
    /// The payloads; the first is the default.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) payload: Vec<PayloadTable>,
}

/// A load on the flange.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct PayloadTable {
    /// Name.
    pub(super) name: String,
    /// Mass, kg.
    pub(super) mass_kg: f64,
    /// Its centre in the last frame of the arm, mm.
    pub(super) com_mm: [f64; 3],
}

/// A frame, `Tr Rz Ry Rx`.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct FrameTable {
    /// Position along x, mm.
    pub(super) x_mm: f64,
    /// Position along y, mm.
    pub(super) y_mm: f64,
    /// Position along z, mm.
    pub(super) z_mm: f64,
    /// Rotation about z, deg.
    pub(super) a_deg: f64,
    /// Then about the rotated y, deg.
    pub(super) b_deg: f64,
    /// Then about the rotated x, deg.
    pub(super) c_deg: f64,
}

impl FrameTable {
    pub(super) fn of(frame: &FramePose) -> Self {
        let ([x_mm, y_mm, z_mm], [a_deg, b_deg, c_deg]) = (frame.xyz.map(|v| v / MM), frame.rz_ry_rx.map(|v| v / DEG));
        FrameTable { x_mm, y_mm, z_mm, a_deg, b_deg, c_deg }
    }

    pub(super) fn pose(&self) -> FramePose {
        FramePose {
            xyz: [self.x_mm, self.y_mm, self.z_mm].map(|v| v * MM),
            rz_ry_rx: [self.a_deg, self.b_deg, self.c_deg].map(|v| v * DEG),
        }
    }
}

impl SetupTable {
    pub(super) fn of(setup: &MeasuredSetup) -> Self {
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

    pub(super) fn setup(&self) -> MeasuredSetup {
        let payload = |p: &PayloadTable| Payload { name: p.name.clone(), mass: p.mass_kg, com: Vector3::from(p.com_mm) * MM };
        MeasuredSetup {
            label: self.label.clone(),
            dataset: self.dataset.clone(),
            session: self.session.clone(),
            base: self.base_start.pose(),
            tool: self.tool.pose(),
            gravity: Vector3::from(self.gravity_m_s2),
            payloads: self.payload.iter().map(payload).collect(),
            duration_s: self.duration_s,
        }
    }
}

/// An identified parameter.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct ParameterTable {
    /// Name of the parameter.
    pub(super) name: String,
    /// Id of the effect that it belongs to.
    pub(super) effect: String,
    /// Its value, in `unit`.
    pub(super) value: f64,
    /// One-sigma, by noise and by model discrepancy, in `unit`.
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub(super) sigma: f64,
    /// One-sigma by noise alone, in `unit`; older files do not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub(super) sigma_noise: Option<f64>,
    /// Unit of all numbers of this parameter.
    pub(super) unit: String,
    /// Value of the nominal robot, in `unit`.
    pub(super) nominal: f64,
    /// One-sigma that was stated before the data, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    pub(super) stated_sigma: Option<f64>,
}

impl ParameterTable {
    pub(super) fn of(e: &Estimate) -> Self {
        ParameterTable {
            name: e.name.clone(),
            effect: e.effect.to_string(),
            value: e.unit.from_si(e.value),
            sigma: e.unit.from_si(e.sigma),
            sigma_noise: Some(e.unit.from_si(e.sigma_noise)),
            unit: e.unit.symbol.into(),
            nominal: e.unit.from_si(e.nominal),
            stated_sigma: e.stated_sigma.map(|s| e.unit.from_si(s)),
        }
    }
}
