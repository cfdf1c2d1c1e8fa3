//! A hypothesis: an effect that may be missing, with its evidence.

use crate::effects::EffectId;

/// Place of an effect, found by a scan.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// Order, periods per turn.
    Order(u32),
    /// Time since the session began, s.
    Time(f64),
    /// Name of a sample.
    Sample(String),
}

/// An effect that may be missing, with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// Id in the catalogue.
    pub effect: EffectId,
    /// Id in a model: including the order, the moment or the sample if a scan found one.
    pub in_model: EffectId,
    /// Place found by a scan; `None` without a scan.
    pub place: Option<Place>,
    /// Logarithm of the evidence for the effect over that for noise alone; for a scan, of the mean evidence over all
    /// places.
    pub ln_evidence: f64,
    /// Logarithm of the evidence for the effect over that for the background; for effects that belong to every model,
    /// over that for noise alone.
    pub ln_evidence_against_background: f64,
    /// Share of the remaining sum of squares that its best coefficients explain.
    pub explains: f64,
    /// Number of coefficients that the data determine.
    pub coefficients: usize,
    /// Share of its energy that the fitted model does not absorb.
    pub visible: f64,
    /// Number of possible places; 1 without a scan.
    pub places: usize,
    /// Samples between which a step in time occurred; `None` for other effects.
    pub moment: Option<Moment>,
}

/// Samples between which a step occurred.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The session; `None` if there is only one.
    pub session: Option<String>,
    /// Samples just before and just after the most likely moment.
    pub between: [String; 2],
    /// Their times since the session began, s. The step occurred between them; the time in a model is one in their midst.
    pub between_s: [f64; 2],
    /// Rows of set `validation` between them, by name: on which side of the step they are is not known.
    pub undecided: Vec<String>,
    /// Samples that enclose the step with 95 % probability, given this effect: the last one before its earliest
    /// credible moment, and the first one after its latest.
    pub credible: [String; 2],
}
