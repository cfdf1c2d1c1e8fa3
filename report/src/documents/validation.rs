//! `calibench-validation/1`, printed by `validate`.

use calibench::residuals;
use calibench::units::{DEG, MM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BeforeAndAfter, OutsideRange, Workspace, format_tag};

format_tag!(ValidationFormat, "calibench-validation/1");

/// Number of bins of the histogram.
const BINS: usize = 12;

/// Quantiles of the position errors, mm; keys in percent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Quantiles {
    /// 5 %.
    #[serde(rename = "5")]
    pub q05: f64,
    /// 25 %.
    #[serde(rename = "25")]
    pub q25: f64,
    /// The median.
    #[serde(rename = "50")]
    pub q50: f64,
    /// 75 %.
    #[serde(rename = "75")]
    pub q75: f64,
    /// 95 %.
    #[serde(rename = "95")]
    pub q95: f64,
}

/// A bin of a histogram of position errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HistogramBin {
    /// Lower edge, mm.
    pub from_mm: f64,
    /// Upper edge, mm.
    pub to_mm: f64,
    /// Number of rows.
    pub count: usize,
}

/// Orientation errors at rows that were not fitted: angles of rotation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OrientationErrors {
    /// Number of rows with an orientation.
    pub samples: usize,
    /// Mean, deg.
    pub mean_deg: f64,
    /// Largest, deg.
    pub max_deg: f64,
    /// Standard deviation, deg.
    pub std_deg: f64,
    /// Root mean square, deg.
    pub rms_deg: f64,
}

impl OrientationErrors {
    pub(super) fn of(o: &residuals::OrientationErrors) -> Self {
        let [mean_deg, max_deg, std_deg, rms_deg] = [o.mean, o.max, o.std, o.rms].map(|x| x / DEG);
        OrientationErrors { samples: o.samples, mean_deg, max_deg, std_deg, rms_deg }
    }
}

/// Position errors at rows that were not fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Validation {
    /// Format tag.
    pub format: ValidationFormat,
    /// Number of rows.
    pub samples: usize,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
    /// Standard deviation, mm.
    pub std_mm: f64,
    /// Root mean square, mm.
    pub rms_mm: f64,
    /// Quantiles.
    pub quantiles_mm: Quantiles,
    /// Errors of the orientations; only if some were measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<OrientationErrors>,
    /// Histogram.
    pub histogram: Vec<HistogramBin>,
    /// Set-ups whose base and tool were fitted to these rows.
    pub refitted: Vec<String>,
    /// Set-ups whose base and tool come from rows that were fitted.
    pub from_fit_rows: Vec<String>,
}

/// Errors of a validation, and the extrapolation of its rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Validated {
    /// The position errors.
    #[serde(flatten)]
    pub errors: Validation,
    /// The errors at these rows before the calibration and after it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub states: Option<BeforeAndAfter>,
    /// Rows outside the joint ranges of the calibration; null if there are none.
    pub outside_range: Option<OutsideRange>,
    /// Share of these rows that are the same as rows that were fitted, joints and readings; an estimate where more than 2,048 were
    /// fitted, null where it cannot be determined.
    pub fitted: Option<f64>,
    /// The error expected at these rows; null where the rows that were fitted are not among the data.
    pub workspace: Option<Workspace>,
}

impl Validation {
    /// The document of a validation.
    #[must_use]
    pub fn of(v: &residuals::Validation) -> Self {
        let [q05, q25, q50, q75, q95] = v.quantiles.map(|q| q / MM);
        let bin = |b: &residuals::HistogramBin| HistogramBin { from_mm: b.from / MM, to_mm: b.to / MM, count: b.count };
        Validation {
            format: ValidationFormat::Current,
            samples: v.samples,
            mean_mm: v.mean / MM,
            max_mm: v.max / MM,
            std_mm: v.std / MM,
            rms_mm: v.rms / MM,
            quantiles_mm: Quantiles { q05, q25, q50, q75, q95 },
            orientation: v.orientation.as_ref().map(OrientationErrors::of),
            histogram: v.histogram(BINS).iter().map(bin).collect(),
            refitted: v.refitted.clone(),
            from_fit_rows: v.from_fit_rows.clone(),
        }
    }
}
