//! `calibench-misfit/1`, printed where the data do not fit their robot.

use calibench::diagnosis;
use calibench::residuals;
use calibench::units::{DEG, MM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::format_tag;
use crate::misfit::{misfit_sentence, unbelievable_sentence};

format_tag!(MisfitFormat, "calibench-misfit/1");

/// A slip that would explain the misfit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Slip {
    /// Its name, such as `joint_sign:2` or `unit:points`.
    pub slip: String,
    /// Residual with the slip undone, rms, mm; where orientations do not fit, that of the positions.
    pub residual_mm: f64,
    /// Residual of the orientations with the slip undone, rms, deg; only where these do not fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_deg: Option<f64>,
    /// The slip in words.
    pub words: String,
}

/// A correction too large to be believed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Correction {
    /// Name of the parameter.
    pub parameter: String,
    /// Estimate minus nominal, in `unit`.
    pub deviation: f64,
    /// Symbol of the unit.
    pub unit: String,
    /// The same in plausible sizes.
    pub plausible_sizes: f64,
}

/// Data that do not fit their robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Misfit {
    /// Format tag.
    pub format: MisfitFormat,
    /// Always `data_do_not_fit`.
    pub verdict: String,
    /// `slips`, `base`, `rows`, `unknown` or `corrections`.
    pub cause: String,
    /// Slips that explain the misfit or, if none does, the best tried.
    pub slips: Vec<Slip>,
    /// The misfit in a sentence.
    pub sentence: Option<String>,
    /// The residual of the nominal arm; absent where the cause is `corrections`.
    #[serde(flatten)]
    pub residual: Option<MisfitResidual>,
    /// The corrections, where these are the cause.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corrections: Option<Vec<Correction>>,
}

/// The residual of the nominal arm, its base and a free tool fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MisfitResidual {
    /// Name of the dataset.
    pub dataset: String,
    /// Residual without gross rows, rms, mm.
    pub residual_mm: f64,
    /// Residual of all rows, rms, mm.
    pub residual_all_rows_mm: f64,
    /// `residual_mm` as a share of the reach, percent.
    pub residual_percent_of_reach: f64,
    /// Largest residual expected of a nominal arm, mm.
    pub expected_mm: f64,
    /// Number of rows.
    pub rows: usize,
}

impl Misfit {
    /// The document of a misfit.
    #[must_use]
    pub fn of(misfit: &residuals::misfit::Misfit) -> Self {
        let residuals::misfit::Misfit { nominal, measure, cause, slips, .. } = misfit;
        let turned = *measure == residuals::misfit::Measure::Orientations;
        let slip = |s: &residuals::misfit::SlipTried| Slip {
            slip: s.slip.clone(),
            residual_mm: if turned { nominal.residual } else { s.residual } / MM,
            residual_deg: turned.then_some(s.residual / DEG),
            words: s.words.clone(),
        };
        Misfit {
            format: MisfitFormat::Current,
            verdict: diagnosis::Verdict::DataDoNotFit.name().into(),
            cause: cause.name().into(),
            slips: slips.iter().map(slip).collect(),
            sentence: Some(misfit_sentence(misfit)),
            residual: Some(MisfitResidual {
                dataset: nominal.dataset.clone(),
                residual_mm: nominal.residual / MM,
                residual_all_rows_mm: nominal.plain / MM,
                residual_percent_of_reach: 100.0 * nominal.residual / nominal.reach,
                expected_mm: nominal.expected / MM,
                rows: nominal.rows,
            }),
            corrections: None,
        }
    }

    /// The document of corrections that cannot be believed.
    #[must_use]
    pub fn of_corrections(corrections: &[residuals::misfit::Unbelievable]) -> Self {
        let one = |c: &residuals::misfit::Unbelievable| Correction {
            parameter: c.parameter.clone(),
            deviation: c.unit.from_si(c.deviation),
            unit: c.unit.symbol.into(),
            plausible_sizes: c.sizes,
        };
        Misfit {
            format: MisfitFormat::Current,
            verdict: diagnosis::Verdict::DataDoNotFit.name().into(),
            cause: "corrections".into(),
            slips: Vec::new(),
            sentence: unbelievable_sentence(corrections),
            residual: None,
            corrections: Some(corrections.iter().map(one).collect()),
        }
    }
}
