//! Errors in laying out a problem.

use thiserror::Error;

use crate::effects::EffectError;

/// The reason why datasets and model do not make a problem.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// An effect id is not in the catalogue or does not fit.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The datasets are of different robots.
    #[error("the datasets are of different robots: '{first}' and '{other}'; identify one robot at a time")]
    DifferentRobots {
        /// Robot of the first dataset.
        first: String,
        /// Another robot.
        other: String,
    },
    /// Two datasets with the same name: their parameters would be indistinguishable.
    #[error("two datasets are named '{name}'; name each one differently")]
    SameName {
        /// The name.
        name: String,
    },
    /// Nothing to fit.
    #[error("there are no samples {of}; the dataset needs rows of that set")]
    NoSamples {
        /// The samples that were requested.
        of: &'static str,
    },
    /// An effect needs data that are missing.
    #[error("effect '{effect}' needs {needs}; add it to the data, or leave the effect out of the model")]
    Missing {
        /// The effect.
        effect: String,
        /// The missing column or fact.
        needs: &'static str,
    },
    /// The factor of an effect has no value at a sample.
    #[error("effect '{effect}' has no value at sample '{sample}'{expression}; leave the sample or the effect out")]
    NoValue {
        /// The effect.
        effect: String,
        /// The sample.
        sample: String,
        /// The user's expression in words, if there is one; else empty.
        expression: String,
    },
    /// The noise of a sample, its joints' included, has no finite covariance.
    #[error(
        "the noise of sample '{sample}' is not finite; check its joint angles, its sigma, and the noise of the joints for absurd values"
    )]
    NoiseNotFinite {
        /// The sample.
        sample: String,
    },
    /// Samples of another campaign that was not made to the same plan.
    #[error("the samples are not those of the campaign that the problem was laid out for: {found}; lay it out again")]
    AnotherPlan {
        /// The first that differs, or their number.
        found: String,
    },
}
