//! User-defined effects, linear in their coefficients: `site += coefficient * basis(situation)`, term by term.

use thiserror::Error;

use super::expression::{BEFORE, Expression, HOSE};
use super::situation::Situation;
use super::{Effect, EffectId, Emit, Needs, Owner, ParameterSpec, Subject};
use crate::robot::sites::{Axis6, MOST_JOINTS, MdhEntry, Site};
use crate::units::{DEG, MM, Unit};

/// One term of a user-defined effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OwnTerm {
    /// The site it moves, as sites are printed (`theta:3`), or one ball (`ball:B:x`).
    pub site: String,
    /// Expression for the deviation per unit of its coefficient.
    pub basis: String,
    /// Terms of the same group share one coefficient.
    pub group: Option<String>,
}

/// A user-defined effect.
///
/// ```
/// use calibench::effects::Subject;
/// use calibench::effects::own::{OwnEffect, OwnTerm};
/// use calibench::robot::built_in;
/// use calibench::units::{DEG, Unit};
///
/// let term = OwnTerm { site: "theta:2".into(), basis: "sin(17*q2)".into(), group: None };
/// let plausible = OwnEffect::usual_size(Unit::DEG);
/// let ripple = OwnEffect { name: "ripple".into(), unit: Unit::DEG, plausible, terms: vec![term] };
/// let robot = built_in("ur5").ok_or("built in")?;
/// let effect = ripple.build(&Subject::new(&robot, &[]))?;
/// assert_eq!(effect.parameters().len(), 1);
/// assert_eq!(effect.parameters()[0].prior, 5e-3 * DEG);
///
/// // An angle is not measured in millimetres.
/// let wrong = OwnEffect { unit: Unit::MM, ..ripple };
/// assert!(wrong.unit_fits().is_err_and(|e| e.key() == "unit"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct OwnEffect {
    /// Its id.
    pub name: String,
    /// Unit of its coefficients.
    pub unit: Unit,
    /// Plausible size (1 sigma) of a coefficient, SI.
    pub plausible: f64,
    /// Its terms.
    pub terms: Vec<OwnTerm>,
}

/// An error in a user-defined effect: what is wrong, and how to correct it.
#[derive(Debug, Error, Clone, PartialEq)]
#[error("{}: {problem}; {remedy}", self.key())]
pub struct OwnEffectError {
    /// Index of the term, if the error is in one.
    pub term: Option<usize>,
    /// Key within the effect's table or the term: `name`, `basis`.
    pub field: &'static str,
    /// The problem.
    pub problem: String,
    /// The remedy.
    pub remedy: String,
}

impl OwnEffectError {
    /// The key within the effect's table: `name`, `terms[2].basis`.
    pub fn key(&self) -> String {
        self.term.map_or_else(|| self.field.to_owned(), |k| format!("terms[{k}].{}", self.field))
    }
}

/// Longest name, characters.
const LONGEST_NAME: usize = 64;
/// Longest quotation in an error, characters.
const LONGEST_QUOTE: usize = 60;
/// Largest number of terms of one effect.
const MOST_TERMS: usize = 500;

impl OwnEffect {
    /// True if a term depends on what was measured before the sample.
    pub fn follows_last_move(&self) -> bool {
        self.terms.iter().any(|term| term.basis.contains(BEFORE) || term.basis.contains(HOSE))
    }

    /// Plausible size (1 sigma) of a coefficient in that unit if the user states none, SI: 5 thousandths of a degree, 30
    /// um, else one unit.
    pub fn usual_size(unit: Unit) -> f64 {
        match unit {
            Unit::DEG | Unit::MRAD | Unit::URAD => 5e-3 * DEG,
            Unit::MM | Unit::UM => 0.03 * MM,
            other => other.si,
        }
    }

    /// Checks that the unit has the dimension of the sites, as far as all of them have the same.
    ///
    /// # Errors
    /// If it does not.
    pub fn unit_fits(&self) -> Result<(), OwnEffectError> {
        if matches!(self.unit, Unit::KG | Unit::KG_M) {
            let problem = format!("'{}' is not a unit of angle or length", self.unit.symbol);
            return Err(wrong("unit", problem, "give deg, urad, mm or um"));
        }
        let mut all = self.terms.iter().map(|t| turns(&t.site));
        let first = all.next().flatten();
        let other = first.filter(|first| all.all(|t| t == Some(*first)) && measures(self.unit).is_some_and(|u| u != *first));
        let Some(turning) = other else { return Ok(()) };
        let (moves, such) = if turning { ("turn", "deg, mrad or urad") } else { ("shift", "mm or um") };
        let problem = format!("'{}' is not a unit for its sites, which {moves}", self.unit.symbol);
        Err(wrong("unit", problem, format!("give {such}")))
    }

    /// Builds the effect for a robot and an artifact.
    ///
    /// # Errors
    /// The first problem found.
    pub fn build(&self, subject: &Subject<'_>) -> Result<Box<dyn Effect>, OwnEffectError> {
        self.check(subject)?;
        self.unit_fits()?;
        let mut coefficients = Coefficients { effect: self, parameters: Vec::new(), numbered: Vec::new() };
        let mut terms = Vec::with_capacity(self.terms.len());
        for (k, term) in self.terms.iter().enumerate() {
            let within = |e: OwnEffectError| OwnEffectError { term: Some(k), ..e };
            let (site, ball) = term.place(subject).map_err(within)?;
            let basis = term.expression(subject).map_err(within)?;
            let parameter = coefficients.of(k, term).map_err(within)?;
            terms.push(Term { site, ball, basis, parameter });
        }
        let moves = |part: fn(Site) -> bool| terms.iter().any(|t| part(t.site));
        let mut needs: Vec<Needs> = terms.iter().flat_map(|t| t.basis.needs()).collect();
        if moves(|s| matches!(s, Site::Target(_))) {
            needs.push(Needs::Balls);
        }
        needs.dedup();
        let owner = if needs.contains(&Needs::Time) || moves(|s| matches!(s, Site::Base(_) | Site::Tool(_) | Site::Probe(_))) {
            Owner::Session
        } else if moves(|s| matches!(s, Site::Target(_))) {
            Owner::Artifact
        } else {
            Owner::Robot
        };
        Ok(Box::new(Own { id: self.name.clone(), parameters: coefficients.parameters, needs, owner, terms }))
    }

    /// Checks all but the unit and the terms themselves.
    fn check(&self, subject: &Subject<'_>) -> Result<(), OwnEffectError> {
        let name = &self.name;
        let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
        if !plain || name.len() > LONGEST_NAME {
            let remedy = format!("use up to {LONGEST_NAME} letters, digits, `_` and `-`");
            return Err(wrong("name", format!("'{}' is not a name", quoted(name)), remedy));
        }
        if subject.registry.family(name).is_some() || name == EffectId::ERROR_FIELD {
            let problem = format!("'{name}' is an effect of the catalogue");
            return Err(wrong("name", problem, "give your own another name"));
        }
        if !(self.plausible > 0.0 && self.plausible.is_finite()) {
            return Err(wrong("plausible", "is not positive", "give the size that would not surprise you"));
        }
        if !(1..=MOST_TERMS).contains(&self.terms.len()) {
            let problem = format!("there are {}", self.terms.len());
            return Err(wrong("terms", problem, format!("give 1 to {MOST_TERMS}")));
        }
        Ok(())
    }
}

impl OwnTerm {
    /// The site for a robot and an artifact, and the ball if it is of one ball; errors name the key within the term.
    fn place(&self, subject: &Subject<'_>) -> Result<(Site, Option<usize>), OwnEffectError> {
        place(&self.site, subject).ok_or_else(|| {
            let n = subject.robot.joints();
            let remedy = format!(
                "write theta:J, d:J (J = 1..{n}), alpha:K, a:K, beta:K (K = 0..{}), flex:K:AXIS (K = 0..{n}), base:AXIS, tool:x or ball:x",
                n - 1
            );
            wrong("site", format!("'{}' is not a site of this robot", quoted(&self.site)), remedy)
        })
    }

    /// The basis, parsed; errors name the key within the term.
    fn expression(&self, subject: &Subject<'_>) -> Result<Expression, OwnEffectError> {
        Expression::parse(&self.basis, subject.robot.joints()).map_err(|e| {
            let problem = format!("at character {} of `{}`: {}", e.position, quoted(&self.basis), e.problem);
            wrong("basis", problem, e.remedy)
        })
    }
}

/// Coefficients of the terms read so far.
struct Coefficients<'a> {
    effect: &'a OwnEffect,
    parameters: Vec<ParameterSpec>,
    /// True for a parameter that is numbered after its only term, false for one named after a group.
    numbered: Vec<bool>,
}

impl Coefficients<'_> {
    /// Index of the coefficient of term `k`, appended unless its group has one; errors name the key within the term.
    fn of(&mut self, k: usize, term: &OwnTerm) -> Result<usize, OwnEffectError> {
        let name = &self.effect.name;
        let coefficient = match &term.group {
            Some(group) if group.is_empty() || !group.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') => {
                return Err(wrong("group", format!("'{group}' is not a name"), "use letters, digits and `_`"));
            }
            Some(group) => format!("{name}.{group}"),
            None => format!("{name}.{}", k + 1),
        };
        match self.parameters.iter().position(|p| p.name == coefficient) {
            Some(p) if term.group.is_some() && !self.numbered[p] => Ok(p),
            Some(_) => {
                let problem = format!("'{coefficient}' is the coefficient of another term already");
                Err(wrong("group", problem, "name groups by words, not by numbers"))
            }
            None => {
                self.parameters.push(ParameterSpec::new(coefficient, self.effect.unit, self.effect.plausible));
                self.numbered.push(term.group.is_none());
                Ok(self.parameters.len() - 1)
            }
        }
    }
}

/// An error in a key of the effect's table, or of a term's.
fn wrong(field: &'static str, problem: impl Into<String>, remedy: impl Into<String>) -> OwnEffectError {
    OwnEffectError { term: None, field, problem: problem.into(), remedy: remedy.into() }
}

/// True for a rotational site, false for a translational one; `None` if there is no such site, or if that depends on the
/// artifact.
fn turns(site: &str) -> Option<bool> {
    let turn = |axis: Axis6| matches!(axis, Axis6::Rz | Axis6::Ry | Axis6::Rx);
    match Site::parse(site, MOST_JOINTS)? {
        Site::Base(axis) | Site::Flex(_, axis) => Some(turn(axis)),
        Site::Mdh(_, entry) => Some(!matches!(entry, MdhEntry::A | MdhEntry::D)),
        Site::Tool(_) | Site::Target(_) => Some(false),
        Site::Probe(_) => Some(true),
    }
}

/// True for a unit of rotation, false for one of translation; `None` if it may be either.
fn measures(unit: Unit) -> Option<bool> {
    match unit {
        Unit::DEG | Unit::MRAD | Unit::URAD | Unit::MDEG_PER_NM | Unit::URAD_PER_NM | Unit::URAD_PER_RAD => Some(true),
        Unit::MM | Unit::UM | Unit::UM_PER_M | Unit::UM_PER_M_K => Some(false),
        _ => None,
    }
}

/// A text quoted in an error, truncated if longer than a line.
fn quoted(text: &str) -> String {
    match text.char_indices().nth(LONGEST_QUOTE) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text.to_owned(),
    }
}

/// Parses a site: as printed, or a coordinate of one ball.
fn place(text: &str, subject: &Subject<'_>) -> Option<(Site, Option<usize>)> {
    if let Some(site) = Site::parse(text, subject.robot.joints()) {
        return Some((site, None));
    }
    let (ball, axis) = text.strip_prefix("ball:")?.rsplit_once(':')?;
    let ball = subject.balls.iter().position(|b| b == ball)?;
    Some((Site::parse(&format!("ball:{axis}"), subject.robot.joints())?, Some(ball)))
}

struct Term {
    site: Site,
    /// The only ball moved, if the term is for one ball.
    ball: Option<usize>,
    basis: Expression,
    parameter: usize,
}

struct Own {
    id: String,
    parameters: Vec<ParameterSpec>,
    needs: Vec<Needs>,
    owner: Owner,
    terms: Vec<Term>,
}

impl Effect for Own {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn owner(&self) -> Owner {
        self.owner
    }

    fn needs(&self) -> &[Needs] {
        &self.needs
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>) {
        for Term { site, ball, basis, parameter } in &self.terms {
            let elsewhere =
                matches!(site, Site::Target(_)) && (at.ball().is_none() || ball.is_some_and(|b| at.ball() != Some(b)));
            if !elsewhere && let Some(weight) = basis.at(at) {
                emit(*parameter, *site, weight);
            }
        }
    }

    fn expression(&self, parameter: usize, site: Site) -> Option<&str> {
        self.terms.iter().find(|t| t.parameter == parameter && t.site == site).map(|t| t.basis.text.as_str())
    }
}
