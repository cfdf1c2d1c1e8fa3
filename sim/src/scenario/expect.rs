//! Quantities that a scenario may put bounds on.

/// A result of a run that a scenario may put bounds on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub enum Quantity {
    TricalMean,
    TricalMax,
    TricalStd,
    TrackerMean,
    TrackerMax,
    TrackerStd,
    BeforeMean,
    Probings,
    Points,
    Rank,
    ReadingsMean,
    Chi2PerDof,
    Within2Sigma,
    Within3Sigma,
}

impl Quantity {
    /// All quantities, in the order in which they are printed.
    pub const ALL: [Quantity; 14] = [
        Quantity::TricalMean,
        Quantity::TricalMax,
        Quantity::TricalStd,
        Quantity::TrackerMean,
        Quantity::TrackerMax,
        Quantity::TrackerStd,
        Quantity::BeforeMean,
        Quantity::Probings,
        Quantity::Points,
        Quantity::Rank,
        Quantity::ReadingsMean,
        Quantity::Chi2PerDof,
        Quantity::Within2Sigma,
        Quantity::Within3Sigma,
    ];

    /// Its key under `[expect]`.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::TricalMean => "trical_mean_mm",
            Quantity::TricalMax => "trical_max_mm",
            Quantity::TricalStd => "trical_std_mm",
            Quantity::TrackerMean => "tracker_mean_mm",
            Quantity::TrackerMax => "tracker_max_mm",
            Quantity::TrackerStd => "tracker_std_mm",
            Quantity::BeforeMean => "before_mean_mm",
            Quantity::Probings => "probings",
            Quantity::Points => "points",
            Quantity::Rank => "rank",
            Quantity::ReadingsMean => "readings_mean",
            Quantity::Chi2PerDof => "chi2_per_dof",
            Quantity::Within2Sigma => "within_2_sigma",
            Quantity::Within3Sigma => "within_3_sigma",
        }
    }

    /// The quantity with this key.
    pub fn named(name: &str) -> Option<Quantity> {
        Self::ALL.into_iter().find(|q| q.name() == name)
    }
}

/// A quantity and its expected band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// The quantity.
    pub quantity: Quantity,
    /// Least and greatest expected value.
    pub band: [f64; 2],
}
