//! Tables of `calibration.toml`.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::super::own_effects::OwnEffectTable;
use super::super::{Calibration, Estimate, MeasuredSetup};
use crate::robot::{FramePose, JointKind, Payload};
use crate::units::{DEG, MM};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) format: String,
    pub(super) robot: String,
    pub(super) effects: Vec<String>,
    #[serde(default)]
    pub(super) measured_torques: bool,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) width: BTreeMap<String, f64>,
    pub(super) dataset_sha256: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) absolute_accuracy: Option<bool>,
    pub(super) unresolved: Vec<Vec<String>>,
    pub(super) fit: FitTable,
    #[serde(default)]
    pub(super) joint_range: Vec<JointRange>,
    #[serde(default)]
    pub(super) setup: Vec<SetupTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) effect: Vec<OwnEffectTable>,
    #[serde(default)]
    pub(super) parameter: Vec<ParameterTable>,
    /// Correlations of the parameters, row k holding those with parameters 1 to k.
    pub(super) correlation: Vec<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FitTable {
    /// See [`Outcome`]; older files do not state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) outcome: Option<String>,
    pub(super) samples: usize,
    pub(super) rms_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rms_orientation_deg: Option<f64>,
    pub(super) chi2_per_dof: f64,
    pub(super) dof: usize,
    pub(super) rank: usize,
    pub(super) condition: f64,
    pub(super) noise_stated: bool,
    pub(super) iterations: usize,
    #[serde(rename = "O1")]
    pub(super) o1: f64,
    #[serde(rename = "O2")]
    pub(super) o2: f64,
    #[serde(rename = "O3")]
    pub(super) o3: f64,
    #[serde(rename = "O4")]
    pub(super) o4: f64,
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

/// The range of a joint, in the unit of its kind.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JointRange {
    pub(super) joint: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    min_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    min_mm: Option<f64>,
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

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SetupTable {
    pub(super) label: String,
    pub(super) dataset: String,
    pub(super) session: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) duration_s: Option<f64>,
    pub(super) gravity_m_s2: [f64; 3],
    /// Starting base of the fit; components that could not be determined kept these values.
    pub(super) base_start: FrameTable,
    /// TCP in the last frame, as certified.
    pub(super) tool: FrameTable,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) payload: Vec<PayloadTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PayloadTable {
    pub(super) name: String,
    pub(super) mass_kg: f64,
    pub(super) com_mm: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FrameTable {
    pub(super) x_mm: f64,
    pub(super) y_mm: f64,
    pub(super) z_mm: f64,
    pub(super) a_deg: f64,
    pub(super) b_deg: f64,
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

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ParameterTable {
    pub(super) name: String,
    pub(super) effect: String,
    pub(super) value: f64,
    pub(super) sigma: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) sigma_noise: Option<f64>,
    pub(super) unit: String,
    pub(super) nominal: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) stated_sigma: Option<f64>,
}

impl ParameterTable {
    pub(super) fn of(e: &Estimate) -> Self {
        ParameterTable {
            name: e.name.clone(),
            effect: e.effect.clone(),
            value: e.unit.from_si(e.value),
            sigma: e.unit.from_si(e.sigma),
            sigma_noise: Some(e.unit.from_si(e.sigma_noise)),
            unit: e.unit.symbol.into(),
            nominal: e.unit.from_si(e.nominal),
            stated_sigma: e.stated_sigma.map(|s| e.unit.from_si(s)),
        }
    }
}
