//! Relative weights of orientations and positions of unstated noise.

use super::ImportReport;
use crate::identify::{Model, identify};
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::units::DEG;

/// If the noise of the positions is not stated, states that of the orientations in the ratio of the residuals of both after a
/// calibration of the geometry. In another ratio, the residuals of one would seem to show effects in addition to those of the
/// other.
pub(super) fn balance(dataset: &mut Dataset, report: &mut ImportReport) {
    let unstated = dataset.noise.point.is_none() && dataset.samples.iter().all(|s| s.sigma.is_none());
    let (true, Some(stated)) = (unstated, dataset.noise.orientation) else { return };
    let Ok(calibration) = identify(&[NamedDataset::new("", dataset)], &Model::geometry()) else { return };
    let Some(balanced) = calibration.balanced_orientation().filter(|b| b.is_finite() && *b > 0.0) else { return };
    // Two digits: it is a weight.
    let unit = 10f64.powf((balanced / DEG).log10().floor() - 1.0);
    let rounded = (balanced / DEG / unit).round() * unit;
    let rounded = format!("{rounded:.6}").parse().unwrap_or(rounded);
    dataset.noise.orientation = Some(rounded * DEG);
    if ((rounded * DEG) / stated - 1.0).abs() > 0.01 {
        report.notes.push(format!(
            "the noise of the positions is not stated, so that of the orientations is a weight: {rounded} deg to 0.1 mm, in which ratio they err, not {} deg",
            (stated / DEG * 1e6).round() / 1e6
        ));
    }
}
