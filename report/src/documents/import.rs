//! `calibench-import-report/1`, printed by `import`.

use calibench::residuals;
use calibench::units::MM;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{finite, format_tag};
use crate::misfit::nominal_fit_line;

format_tag!(ImportFormat, "calibench-import-report/1");

/// The residual of the nominal arm, its base and a free tool fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NominalFit {
    /// Residual without gross rows, rms, mm.
    pub residual_mm: f64,
    /// Residual of all rows, rms, mm.
    pub residual_all_rows_mm: f64,
    /// Largest residual expected of a nominal arm, mm; null if nothing can be expected of so few rows.
    pub expected_mm: Option<f64>,
    /// `residual_mm` as a share of the reach, percent.
    pub residual_percent_of_reach: f64,
    /// The same in words.
    pub words: String,
}

/// Summary of an import.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ImportReport {
    /// Format tag.
    pub format: ImportFormat,
    /// Number of rows read.
    pub rows_read: usize,
    /// Number of rows kept.
    pub rows_kept: usize,
    /// Number of rows skipped.
    pub rows_skipped: usize,
    /// Number of samples in the dataset.
    pub samples: usize,
    /// Number of these that are kept for validation.
    pub validation: usize,
    /// Folder of the dataset.
    pub dataset: String,
    /// Agreement of the data with the nominal arm; null if it was not tested.
    pub nominal_fit: Option<NominalFit>,
    /// Warning that the data do not fit the robot, if written nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
    /// What was found in a recording over time; null, or missing, of other imports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub log: Option<ImportedLog>,
}

/// The rests of a recording over time, or the moments in motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ImportedLog {
    /// Number of rests with a measurement, each a row; of moments in motion, if these are the rows.
    pub rests: usize,
    /// Time added to those of the instrument, s.
    pub shift_s: f64,
    /// Standard uncertainty of that, s, where it was found from motion.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub shift_sigma_s: Option<f64>,
    /// What was understood, a sentence each.
    pub understood: Vec<String>,
    /// Rests that give no row.
    pub excluded: Vec<ExcludedRest>,
}

/// A rest that gives no row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExcludedRest {
    /// Its begin since the begin of the recording, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
    /// The reason.
    pub why: String,
}

impl NominalFit {
    /// The document of a nominal fit.
    #[must_use]
    pub fn of(n: &residuals::misfit::NominalFit) -> Self {
        NominalFit {
            residual_mm: n.residual / MM,
            residual_all_rows_mm: n.plain / MM,
            expected_mm: finite(n.expected / MM),
            residual_percent_of_reach: 100.0 * n.residual / n.reach,
            words: nominal_fit_line(n),
        }
    }
}

impl ImportReport {
    /// A report on these counts of rows.
    #[must_use]
    pub fn new(rows: &calibench::import::ImportReport, dataset: String) -> Self {
        ImportReport {
            format: ImportFormat::Current,
            rows_read: rows.rows_read,
            rows_kept: rows.rows_kept,
            rows_skipped: rows.skipped.len(),
            samples: 0,
            validation: 0,
            dataset,
            nominal_fit: None,
            misfit: None,
            log: None,
        }
    }
}
