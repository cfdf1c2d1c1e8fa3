//! A law: where an error arises, and what it follows.

use std::ops::Range;

use calibench::effects::own::{OwnEffect, OwnTerm};
use calibench::units::{DEG, MM, Unit};

use crate::factors::two_digits;

/// A term of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct LawTerm {
    /// As an expression in a model file.
    pub basis: String,
    /// Its coefficient, SI.
    pub coefficient: f64,
    /// Standard uncertainty of the coefficient, SI.
    pub sigma: f64,
}

/// A variable of a law, and the range in which it was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenRange {
    /// As in an expression.
    pub name: String,
    /// In words.
    pub words: String,
    /// Its range in the data, in the unit.
    pub range: Range<f64>,
    /// Unit of the range; empty for a number.
    pub unit: &'static str,
}

/// Another law that these data do not tell from one.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival {
    /// What errs, in words.
    pub place: String,
    /// The site that errs, as in a model file.
    pub site: String,
    /// What it follows, as expressions of its terms.
    pub bases: Vec<String>,
    /// Its odds against the law.
    pub odds: f64,
    /// The postures that would tell the two apart, the best first; empty if none would, or if the two differ by what no posture sets,
    /// such as time.
    pub apart: Vec<Apart>,
}

/// A posture at which two laws differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// Joint angles or travels, rad or m.
    pub q: Vec<f64>,
    /// Distance between the two predictions, m.
    pub differ: f64,
    /// The same in sigmas of a measurement.
    pub sigmas: f64,
    /// True if it lies outside the ranges that were measured.
    pub is_outside: bool,
}

/// Why a law is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doubt {
    /// Chance makes one as good too often.
    Chance,
    /// It may as well be at another place.
    Place,
    /// It explains the smaller part of the residual, and much more than noise remains: its shape may be that of something else.
    MuchElse,
}

/// A law that the data show.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// The site that errs, as in a model file.
    pub site: String,
    /// What errs, in words.
    pub place: String,
    /// True if it turns, false if it shifts.
    pub turns: bool,
    /// Its terms.
    pub terms: Vec<LawTerm>,
    /// What it follows.
    pub variables: Vec<SeenRange>,
    /// Root mean square of the error at the samples, rad or m.
    pub rms: f64,
    /// Share of the remaining sum of squares that it explains.
    pub explains: f64,
    /// Log odds of the law against no law.
    pub ln_odds: f64,
    /// Probability that the search finds as good a law where there is none.
    pub p_false: f64,
    /// Probability that it is at this place, and not at another.
    pub p_place: f64,
    /// Why it is not taken; `None` if it is.
    pub doubt: Option<Doubt>,
    /// What cannot be told from it.
    pub rivals: Vec<Rival>,
}

impl Law {
    /// As a user-defined effect of this name.
    ///
    /// Its plausible size is that of its largest coefficient: what was found would not surprise.
    pub fn effect(&self, name: &str) -> OwnEffect {
        let unit = if self.turns { Unit::DEG } else { Unit::MM };
        let largest = self.terms.iter().fold(OwnEffect::usual_size(unit), |a, t| a.max(t.coefficient.abs()));
        let terms = self.terms.iter().map(|t| OwnTerm { site: self.site.clone(), basis: t.basis.clone(), group: None });
        OwnEffect { name: name.into(), unit, plausible: two_digits(largest / unit.si) * unit.si, terms: terms.collect() }
    }

    /// The formula with its coefficients, in degrees or millimetres.
    pub fn formula(&self) -> String {
        let (si, unit) = if self.turns { (DEG, "deg") } else { (MM, "mm") };
        let mut text = String::new();
        for (k, term) in self.terms.iter().enumerate() {
            let size = term.coefficient / si;
            let sign = match (k, size < 0.0) {
                (0, false) => "",
                (0, true) => "-",
                (_, false) => " + ",
                (_, true) => " - ",
            };
            text.push_str(&format!("{sign}{:.4} {unit} * {}", size.abs(), term.basis));
        }
        text
    }

    /// What it follows, in words: `q2 and the load on joint 3`.
    pub fn follows(&self) -> String {
        let words: Vec<&str> = self.variables.iter().map(|v| v.words.as_str()).collect();
        match words.as_slice() {
            [] => String::new(),
            [one] => (*one).to_owned(),
            [others @ .., last] => format!("{} and {last}", others.join(", ")),
        }
    }
}
