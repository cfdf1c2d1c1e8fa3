//! `calibench-discovery/1`, printed by `discover`.

use calibench::robot::{JointKind, Robot};
use calibench::units::{DEG, MM, Unit};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Step, format_tag};
use crate::discovery::law_sentences;

format_tag!(DiscoveryFormat, "calibench-discovery/1");

/// A term of a law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LawTerm {
    /// Expression, as in a model file.
    pub basis: String,
    /// Its coefficient, in `unit` of the law.
    pub coefficient: f64,
    /// One-sigma of the coefficient.
    pub sigma: f64,
}

/// A variable of a law, and where it was seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LawVariable {
    /// As in an expression.
    pub name: String,
    /// In words.
    pub words: String,
    /// Smallest value in the data.
    pub low: f64,
    /// Largest value in the data.
    pub high: f64,
    /// Unit of both; empty for a number.
    pub unit: String,
}

/// A posture at which two laws differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TellingPosture {
    /// Joint angles, deg, or travels, mm.
    pub joints: Vec<f64>,
    /// Distance between the two predictions, mm.
    pub differ_mm: f64,
    /// The same in sigmas of a measurement: below 3, none tells them apart.
    pub differ_sigmas: f64,
    /// True if it lies outside the measured ranges of the joints.
    pub outside_ranges: bool,
}

/// Another law that these data do not tell from one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LawRival {
    /// What errs, in words.
    pub place: String,
    /// The site that errs, as in a model file.
    pub site: String,
    /// Expressions of its terms.
    pub bases: Vec<String>,
    /// Its odds against the law.
    pub odds: f64,
    /// The postures that would tell the two apart, the best first.
    pub apart: Vec<TellingPosture>,
}

/// Why a law is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawDoubt {
    /// Chance makes one as good too often.
    Chance,
    /// It may as well be at another place.
    Place,
    /// It explains the smaller part of what is left, and more than noise remains.
    MuchElse,
}

/// A law of an error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DiscoveredLaw {
    /// Its name as an effect of the model.
    pub name: String,
    /// What errs, in words.
    pub place: String,
    /// The site that errs, as in a model file.
    pub site: String,
    /// Unit of its coefficients and of `rms`: `deg` or `mm`.
    pub unit: String,
    /// Its terms.
    pub terms: Vec<LawTerm>,
    /// The variables that it follows.
    pub variables: Vec<LawVariable>,
    /// Root mean square at the measured postures.
    pub rms: f64,
    /// Share of what the model leaves that it explains.
    pub explains: f64,
    /// Log odds against no law, the number of laws tried included.
    pub ln_odds: f64,
    /// Share of searches in data without a law that find one as good; 0.0001 stands for less.
    pub p_false: f64,
    /// Probability that it is at this place, and not at another.
    pub p_place: f64,
    /// Why it is not taken; null if it is.
    pub doubt: Option<LawDoubt>,
    /// What is not told from it.
    pub rivals: Vec<LawRival>,
    /// The same in sentences.
    pub sentences: Vec<String>,
}

/// Result of a search for laws.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Discovery {
    /// Format tag.
    pub format: DiscoveryFormat,
    /// Number of fitted samples.
    pub samples: usize,
    /// Number of samples among which the search was made.
    pub searched: usize,
    /// Number of laws tried.
    pub tried: usize,
    /// The laws found, the most evident first.
    pub laws: Vec<DiscoveredLaw>,
    /// The law with which the search ended, if it is not taken.
    pub suspected: Option<DiscoveredLaw>,
    /// Effects of the catalogue, or steps between two samples, that explain better what they explain than any law.
    pub listed: Vec<String>,
    /// The model with the laws beside the one without; null if there is nothing to add.
    pub step: Option<Step>,
    /// Warning that the data do not fit the robot, if used nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
}

impl DiscoveredLaw {
    fn of(law: &calibench_discover::Law, name: String, robot: &Robot) -> Self {
        let unit = if law.turns { Unit::DEG } else { Unit::MM };
        let joints = |q: &[f64]| {
            let shown = |(j, q): (usize, &f64)| q / if robot.kind(j) == JointKind::Revolute { DEG } else { MM };
            q.iter().enumerate().map(shown).collect()
        };
        let term = |t: &calibench_discover::LawTerm| LawTerm {
            basis: t.basis.clone(),
            coefficient: unit.from_si(t.coefficient),
            sigma: unit.from_si(t.sigma),
        };
        let variable = |v: &calibench_discover::SeenRange| LawVariable {
            name: v.name.clone(),
            words: v.words.clone(),
            low: v.range.start,
            high: v.range.end,
            unit: v.unit.into(),
        };
        let telling = |a: &calibench_discover::Apart| TellingPosture {
            joints: joints(&a.q),
            differ_mm: a.differ / MM,
            differ_sigmas: a.sigmas,
            outside_ranges: a.is_outside,
        };
        let rival = |r: &calibench_discover::Rival| LawRival {
            place: r.place.clone(),
            site: r.site.clone(),
            bases: r.bases.clone(),
            odds: r.odds,
            apart: r.apart.iter().map(telling).collect(),
        };
        DiscoveredLaw {
            sentences: law_sentences(law, robot),
            name,
            place: law.place.clone(),
            site: law.site.clone(),
            unit: unit.symbol.into(),
            terms: law.terms.iter().map(term).collect(),
            variables: law.variables.iter().map(variable).collect(),
            rms: unit.from_si(law.rms),
            explains: law.explains,
            ln_odds: law.ln_odds,
            p_false: law.p_false,
            p_place: law.p_place,
            doubt: law.doubt.map(|doubt| match doubt {
                calibench_discover::Doubt::Chance => LawDoubt::Chance,
                calibench_discover::Doubt::Place => LawDoubt::Place,
                calibench_discover::Doubt::MuchElse => LawDoubt::MuchElse,
            }),
            rivals: law.rivals.iter().map(rival).collect(),
        }
    }
}

impl Discovery {
    /// The document of a search for laws that were added to a model by these names, with the step that adds them.
    #[must_use]
    pub fn of(found: &calibench_discover::Discovery, names: &[String], robot: &Robot, step: Option<Step>) -> Self {
        let named = found.laws.iter().zip(names);
        Discovery {
            format: DiscoveryFormat::Current,
            samples: found.samples,
            searched: found.searched,
            tried: found.tried,
            laws: named.map(|(law, name)| DiscoveredLaw::of(law, name.clone(), robot)).collect(),
            suspected: found.suspected.as_ref().map(|law| DiscoveredLaw::of(law, "suspected".into(), robot)),
            listed: found.listed.clone(),
            step,
            misfit: None,
        }
    }
}
