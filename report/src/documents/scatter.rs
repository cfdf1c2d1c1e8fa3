//! The scatter of the data, part of the document of `diagnose`.

use calibench::diagnosis;
use calibench::residuals;
use calibench::units::{DEG, MM, UM, URAD};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A sample that disagrees with all others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Suspect {
    /// Id of the sample.
    pub sample: String,
    /// Index of its dataset, from 0.
    pub dataset: usize,
    /// Deviation in standard deviations.
    pub sigmas: f64,
    /// Chance of such a deviation among all samples.
    pub chance: f64,
}

/// Correlation of the residuals of samples a number of rows apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LagCorrelation {
    /// Number of rows.
    pub lag: usize,
    /// Correlation.
    pub correlation: f64,
    /// The same in standard deviations.
    pub z: f64,
}

/// Serial correlation of the residuals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SerialCorrelation {
    /// p-value over all lags.
    pub p: f64,
    /// True if significant.
    pub significant: bool,
    /// The lags tested.
    pub lags: Vec<LagCorrelation>,
}

/// Repeated measurements from which the noise is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Replicates {
    /// Number of targets measured repeatedly.
    pub targets: usize,
    /// Number of their samples.
    pub samples: usize,
    /// Degrees of freedom.
    pub dof: f64,
}

/// Rounding of the joint angles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointSteps {
    /// Step of the angles, deg.
    pub step_deg: f64,
    /// Scatter of the TCP that it causes, one-sigma per axis, um.
    pub per_axis_um: f64,
}

/// Scatter of a joint between repeated visits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointScatter {
    /// Joint, counted from 1.
    pub joint: usize,
    /// One-sigma of its angle, urad.
    pub sigma_urad: f64,
    /// Twice the log likelihood lost without it.
    pub two_ln_likelihood_lost: f64,
    /// True if the joint scatters significantly.
    pub scatters: bool,
}

/// Causes of the scatter between repeated visits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RepeatScatter {
    /// Number of postures visited repeatedly.
    pub postures: usize,
    /// Number of visits.
    pub events: usize,
    /// Scatter between visits, rms, mm.
    pub rms_mm: f64,
    /// Part without a pattern, one-sigma per axis, um.
    pub white_um: f64,
    /// Part fixed to the base, one-sigma per axis, um.
    pub base_um: [f64; 3],
    /// Part fixed to the tool, one-sigma per axis, um.
    pub tool_um: [f64; 3],
    /// Scatter of every joint.
    pub joints: Vec<JointScatter>,
}

/// The scatter of the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scatter {
    /// Noise of the instrument, one-sigma per axis, um; null if unknown.
    pub instrument_noise_um: Option<f64>,
    /// `stated`, `repeats` or `unknown`.
    pub noise_from: String,
    /// Stated noise, one-sigma per axis, um.
    pub noise_stated_um: Option<f64>,
    /// Factor by which the noise exceeds the stated one; null if it does not.
    pub noise_larger_by: Option<f64>,
    /// Number of postures.
    pub postures: usize,
    /// Mean number of samples in which the error of a posture occurs.
    pub repetition: f64,
    /// Repeated measurements.
    pub replicates: Option<Replicates>,
    /// Samples that disagree with all others.
    pub suspects: Vec<Suspect>,
    /// Correlation between successive residuals.
    pub serial_correlation: SerialCorrelation,
    /// Rounding of the joint angles; null if none is seen.
    pub joint_steps: Option<JointSteps>,
    /// Causes of the scatter between visits; null without repeated visits.
    pub repeats: Option<RepeatScatter>,
}

impl Scatter {
    pub(super) fn of(s: &diagnosis::Scatter) -> Self {
        let suspect = |x: &residuals::noise::Suspect| Suspect {
            sample: x.sample.clone(),
            dataset: x.dataset,
            sigmas: x.deviation,
            chance: x.chance,
        };
        let lag = |l: &residuals::noise::LagCorrelation| LagCorrelation { lag: l.lag, correlation: l.correlation, z: l.z };
        Scatter {
            instrument_noise_um: s.noise.level.map(|l| l.per_axis / UM),
            noise_from: s.noise.source.noise_from().into(),
            noise_stated_um: s.noise.stated_per_axis.map(|x| x / UM),
            noise_larger_by: s.larger_than_stated,
            postures: s.postures,
            repetition: s.repetition,
            replicates: s.noise.replicates.map(|r| Replicates { targets: r.groups, samples: r.samples, dof: r.dof }),
            suspects: s.suspects.iter().map(suspect).collect(),
            serial_correlation: SerialCorrelation {
                p: s.serial.p,
                significant: s.serial.is_significant(),
                lags: s.serial.lags.iter().map(lag).collect(),
            },
            joint_steps: s.joint_steps.map(|x| JointSteps { step_deg: x.step / DEG, per_axis_um: x.per_axis / UM }),
            repeats: s.repeats.as_ref().map(RepeatScatter::of),
        }
    }
}

impl RepeatScatter {
    fn of(r: &residuals::noise::RepeatScatter) -> Self {
        let alarms = r.alarms();
        let joint = |j: &residuals::noise::JointScatter| JointScatter {
            joint: j.joint + 1,
            sigma_urad: j.sigma / URAD,
            two_ln_likelihood_lost: j.lost,
            scatters: alarms.iter().any(|a| a.joint == j.joint),
        };
        RepeatScatter {
            postures: r.postures,
            events: r.events,
            rms_mm: r.rms / MM,
            white_um: r.white / UM,
            base_um: r.base.map(|x| x / UM),
            tool_um: r.tool.map(|x| x / UM),
            joints: r.joints.iter().map(joint).collect(),
        }
    }
}
