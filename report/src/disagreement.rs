//! Sentences that explain why an expected and a measured figure differ beyond their bands.

use calibench::prediction::WorkspaceError;
use calibench::residuals::Validation;
use calibench::selection::ladder::LadderStep;
use calibench::units::MM;

use super::effect_names::capital;
use super::figures::NOT_FITTED;

/// States that the error measured at the poses of a forecast is outside the band expected there, and what that means; `None` if
/// the two agree. A step is judged at its validation rows, so both figures are of the same poses. `outside` is the number of
/// these poses beyond the joint ranges of the fit.
pub fn disagreement_sentence(step: &LadderStep, outside: usize) -> Option<String> {
    let (measured, expected) = (step.validation.as_ref()?, step.workspace.as_ref()?);
    judged_alike(measured, expected, outside)
}

/// As [`disagreement_sentence`], for errors measured and expected at the same poses; `None` if they are of different ones.
pub fn judged_alike(measured: &Validation, expected: &WorkspaceError, outside: usize) -> Option<String> {
    // For a set-up that was refitted to the judged rows the residual is a spread, smaller than the error that is expected.
    (measured.refitted.is_empty() && measured.samples == expected.poses.len()).then(|| between(measured, expected, outside))?
}

fn between(measured: &Validation, expected: &WorkspaceError, outside: usize) -> Option<String> {
    let [low, high] = expected.band_as_measured();
    // The mean of so many poses is itself known to two standard errors.
    let reach = 2.0 * measured.std / (measured.samples.max(1) as f64).sqrt();
    let why = if measured.mean - reach > high {
        let there = match outside {
            0 => String::new(),
            some => format!(" {some} of them bend a joint farther than any fitted row."),
        };
        format!(
            "Larger:{there} The set-up of these rows is another than that of the fit (base, tool, load, temperature), or the model \
             lacks an effect that the fitted rows hardly show. `calibench compare CALIBRATION DATASET --validation` shows by its \
             views whether base, tool or a joint is off."
        )
    } else if measured.mean + reach < low {
        "Smaller: the fitted rows leave larger errors possible than there are, as few rows or a wide prior do.".to_owned()
    } else {
        return None;
    };
    Some(format!(
        "{}: mean {:.3} mm at {} poses, where {:.3} to {:.3} mm was expected with the instrument's noise. {why}",
        capital(NOT_FITTED.name),
        measured.mean / MM,
        measured.samples,
        low / MM,
        high / MM,
    ))
}

#[cfg(test)]
mod tests {
    use calibench::prediction::{Banded, PoseSource};

    use super::*;

    fn measured(mean: f64, std: f64) -> Validation {
        Validation {
            samples: 25,
            mean,
            max: mean,
            std,
            rms: mean,
            quantiles: [mean; 5],
            errors: vec![mean; 25],
            orientation: None,
            refitted: Vec::new(),
            from_fit_rows: Vec::new(),
        }
    }

    fn expected() -> WorkspaceError {
        let mean = Banded { expected: 0.2e-3, low: 0.15e-3, high: 0.3e-3 };
        WorkspaceError {
            at: PoseSource::Validation,
            mean,
            max: mean,
            ranges_seen: None,
            elsewhere: None,
            poses: Vec::new(),
            noise: 0.0,
            at_least: false,
        }
    }

    #[test]
    fn what_lies_in_the_band_needs_no_word() {
        assert_eq!(between(&measured(0.25e-3, 0.0), &expected(), 0), None);
        // Beyond the band by less than two standard errors of the mean.
        assert_eq!(between(&measured(0.33e-3, 0.1e-3), &expected(), 0), None);
        assert!(between(&measured(0.35e-3, 0.1e-3), &expected(), 0).is_some());
    }

    #[test]
    fn the_noise_of_the_instrument_is_expected_in_what_it_measures() {
        let noisy = WorkspaceError { noise: 0.2e-3, ..expected() };
        assert_eq!(between(&measured(0.4e-3, 0.0), &noisy, 0), None);
        assert!(between(&measured(0.2e-3, 0.0), &noisy, 0).is_some_and(|s| s.contains("Smaller:")));
    }

    #[test]
    fn a_larger_error_is_put_down_to_joint_ranges_where_it_can() {
        let sentence = between(&measured(0.5e-3, 0.0), &expected(), 3).unwrap();
        assert!(sentence.starts_with("Measured, held out: mean 0.500 mm at 25 poses, where 0.150 to 0.300 mm"), "{sentence}");
        assert!(sentence.contains("Larger: 3 of them bend a joint farther"), "{sentence}");
    }
}
