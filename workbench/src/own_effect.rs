//! A user-defined effect, as entered in the form of the page.

use calibench::effects::own::{OwnEffect, OwnTerm};
use calibench::files::name_remedy;
use calibench::identify::Model;
use calibench::measure::dataset::Dataset;
use calibench::units::Unit;

use crate::refusal::Refusal;

/// Longest expression, characters; a typical line has a hundred.
const LONGEST: usize = 2000;

/// The form: one expression per line, all at one site, each with its own coefficient.
pub struct Draft {
    /// Name of the effect.
    pub name: String,
    /// Unit of the coefficients.
    pub unit: String,
    /// The quantity it modifies, such as `theta:3`.
    pub site: String,
    /// One expression per line, in `q1` ..., `tau1` ...
    pub expressions: String,
}

/// Parses the effect with the parser of model files.
///
/// # Errors
/// The first error, at its field.
pub(super) fn parse(draft: &Draft, model: &Model, dataset: &Dataset) -> Result<OwnEffect, Refusal> {
    if draft.expressions.len() > LONGEST {
        return Err(Refusal::field("expressions", format!("is longer than {LONGEST} characters; write it into a model file")));
    }
    let unit = Unit::from_symbol(&draft.unit.trim().replace('*', "·")).ok_or_else(|| {
        let known = Unit::ALL.map(|u| u.symbol);
        Refusal::field("unit", format!("'{}' is not a known unit; {}", draft.unit, name_remedy(&draft.unit, &known)))
    })?;
    let name = draft.name.trim();
    if model.effects.iter().any(|e| e == name) || model.own.iter().any(|e| e.name == name) {
        return Err(Refusal::field("name", format!("the model has an effect '{name}' already; give this one another name")));
    }
    let lines: Vec<&str> = draft.expressions.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    if lines.is_empty() {
        return Err(Refusal::field("expressions", "is empty; write an expression, such as `sin(17*q3)`"));
    }
    let term = |basis: &&str| OwnTerm { site: draft.site.trim().into(), basis: (*basis).into(), group: None };
    let effect =
        OwnEffect { name: name.into(), unit, plausible: OwnEffect::usual_size(unit), terms: lines.iter().map(term).collect() };
    let balls = dataset.ball_ids();
    let subject = model.subject(&dataset.robot, &balls);
    match effect.build(&subject) {
        Ok(_) => Ok(effect),
        Err(e) => {
            let field = match e.field {
                own @ ("name" | "site" | "unit") => own,
                _ => "expressions",
            };
            let line = e
                .term
                .filter(|_| field == "expressions" && lines.len() > 1)
                .map_or(String::new(), |k| format!("line {}, ", k + 1));
            Err(Refusal::field(field, format!("{line}{}; {}", e.problem, e.remedy)))
        }
    }
}
