//! One answer to the question what is missing.

/// Where a scan found its effect.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// Periods per turn.
    Order(u32),
    /// Seconds since the session began.
    Time(f64),
    /// Name of a sample.
    Sample(String),
}

/// One answer to the question what is missing, with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// Id of the catalogue.
    pub effect: String,
    /// The id under which a model takes it: with its moment or sample, where a scan found one.
    pub in_model: String,
    /// Where a scan found it.
    pub place: Option<Place>,
    /// Logarithm of the evidence over that of noise alone. Of a scan: averaged over all places.
    pub ln_evidence: f64,
    /// Logarithm of the evidence over that of the ordinary small stuff of a robot.
    pub ln_evidence_against_background: f64,
    /// Share of the remaining squares that its best coefficients take.
    pub explains: f64,
    /// Number of its coefficients that the data see.
    pub coefficients: usize,
    /// Share of its energy that the fitted model does not absorb.
    pub visible: f64,
    /// Number of places tried.
    pub places: usize,
    /// Between which samples it happened, where it is a step.
    pub moment: Option<Moment>,
}

/// Between which samples something moved.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The session, where there are several.
    pub session: Option<String>,
    /// Samples just before and just after the likeliest moment.
    pub between: [String; 2],
    /// Samples between which it happened with 95 % probability, given that it is this effect: the last one before it at the earliest, and
    /// the first one after it at the latest.
    pub credible: [String; 2],
}
