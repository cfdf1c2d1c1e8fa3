//! Which effect is missing: the verdict, the findings, and what they rest on.

mod diagnose;
mod findings;
mod judgement;
mod scatter;

use super::curve_families::CurveFamily;
use super::heat_map::HeatMap;
use super::hypotheses::{Hypothesis, Place};
use super::library::Untestable;
use super::noise::Suspect;
use super::relevance::Relevance;
pub use super::verdict::Verdict;
use crate::effects::{self, EffectId};
use crate::identify::Outcome;
use crate::units::Unit;

pub use self::diagnose::{diagnose, diagnose_examined};
pub use self::scatter::Scatter;

/// A number of an effect as it would be fitted now, held to an ordinary size.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundParameter {
    /// Name within its effect.
    pub name: String,
    /// Estimate, SI.
    pub value: f64,
    /// One-sigma, SI.
    pub sigma: f64,
    /// Unit to show it in.
    pub unit: Unit,
}

/// An effect that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The effect, its evidence and its visible share.
    pub hypothesis: Hypothesis,
    /// Probability that this is what is missing, that nothing is included in the count.
    pub probability: f64,
    /// Chance that noise alone explains so much with any of the effects tried (F test, Bonferroni).
    pub p_family: f64,
    /// Change of the Bayesian information criterion: positive speaks for the effect.
    pub delta_bic: f64,
    /// Share of the blocked cross-validated rms that it takes away.
    pub cv_gain: f64,
    /// Effects that explain the same in these data.
    pub rivals: Vec<String>,
    /// Effects, as a model takes them, that are exactly the same to these data, whatever their size.
    pub exactly_same: Vec<String>,
    /// Its numbers.
    pub parameters: Vec<FoundParameter>,
    /// Its size in plausible sizes, rms over its numbers, as the data alone would have it.
    pub size: f64,
}

/// One of the effects that together explain what is left.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// The id under which a model takes it.
    pub effect: String,
    /// Share of the remaining squares that it takes beside the others.
    pub share: f64,
}

/// How much an effect contributes when all are fitted at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// The effect.
    pub effect: String,
    /// Share of the squares beyond noise.
    pub share: f64,
    /// Its size in plausible sizes, rms over its numbers.
    pub size: f64,
}

/// What may be missing in a model, as the data see it.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// Samples fitted.
    pub samples: usize,
    /// Residuals minus unknowns.
    pub dof: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// What noise alone would leave of it, m: as stated, or as the best explanation leaves.
    pub noise: f64,
    /// The rest, m.
    pub unexplained: f64,
    /// Whitened squares per degree of freedom.
    pub chi2_per_dof: f64,
    /// Chance of so large a chi-square by the noise as stated; `None` when it is not.
    pub lack_of_fit_p: Option<f64>,
    /// What it comes to.
    pub verdict: Verdict,
    /// The same without the suspects, where there are any.
    pub verdict_without_suspects: Option<Verdict>,
    /// How the fit ended; anything but convergence makes void what is said of it.
    pub outcome: Outcome,
    /// The credible set.
    pub set95: Vec<String>,
    /// Share of the remaining squares that the first finding takes.
    pub explains: Option<f64>,
    /// Whitened squares per degree of freedom that would be left with the first finding; `None` where the noise is unknown.
    pub chi2_per_dof_with_it: Option<f64>,
    /// Up to three effects that together explain what is left, the largest first.
    pub together: Vec<Explained>,
    /// Share of the remaining squares that they take.
    pub together_explain: f64,
    /// Effects that would explain much at a size that is not believable: id, and size in plausible sizes.
    pub unbelievable: Vec<(String, f64)>,
    /// The catalogue's family that the best curve of any shape is of.
    pub curve_family: Option<CurveFamily>,
    /// What the data say of their own scatter.
    pub scatter: Scatter,
    /// Probability that nothing is missing beyond the ordinary small stuff.
    pub nothing: f64,
    /// Size of that ordinary small stuff, in plausible sizes.
    pub background: f64,
    /// Best first.
    pub findings: Vec<Finding>,
    /// Largest first.
    pub contributions: Vec<Contribution>,
    /// The whole library fitted to what the model leaves: what the contributions, and predictions, rest on.
    pub relevance: Relevance,
    /// What the library does not hold.
    pub heat_map: HeatMap,
    /// What these data cannot test.
    pub untestable: Vec<Untestable>,
    /// Effects of the fitted model.
    pub fitted: Vec<String>,
}

/// A sample disagrees with all others where setting it aside is so many times likelier than the ordinary small stuff of a robot.
const OUTLIER_ODDS: f64 = 20.0;

impl Diagnosis {
    /// Place of the finding by which a single sample disagrees with all others, if one does.
    pub fn outlier(&self) -> Option<usize> {
        let sticks_out = |f: &Finding| f.is_sample() && f.hypothesis.ln_evidence_against_background > OUTLIER_ODDS.ln();
        self.findings.iter().position(sticks_out)
    }

    /// The effects that set all suspects aside.
    pub fn without_suspects(&self) -> Vec<String> {
        all_aside(&self.scatter.suspects)
    }

    /// Whether it advises to set a sample aside: as a suspect, before anything else, or as what is missing in the model.
    pub fn advises_to_set_aside(&self, sample: &str) -> bool {
        let is_it = |f: &Finding| f.is_sample() && EffectId::new(&f.hypothesis.in_model).rest() == Some(sample);
        let named = |(k, f): (usize, &Finding)| {
            is_it(f) && (self.outlier() == Some(k) && k == 0 || self.set95.contains(&f.hypothesis.effect))
        };
        self.scatter.suspects.iter().any(|s| s.sample == sample) || self.findings.iter().enumerate().any(named)
    }
}

impl Finding {
    /// Whether it is a single sample that disagrees with the others.
    pub fn is_sample(&self) -> bool {
        EffectId::new(&self.hypothesis.effect).family() == "outlier"
    }
}

/// The effects that set these samples aside.
fn all_aside(suspects: &[Suspect]) -> Vec<String> {
    suspects.iter().map(|s| effects::setting_aside(&s.sample)).collect()
}

/// Place of a hypothesis in words.
impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Order(k) => write!(f, "{k} per turn"),
            Place::Time(t) => write!(f, "after {t} s"),
            Place::Sample(id) => write!(f, "at sample {id}"),
        }
    }
}
