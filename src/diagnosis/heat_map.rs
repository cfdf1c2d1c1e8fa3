//! Search for errors beyond the library: any smooth error of one joint as a function of one variable.
//!
//! For every joint and variable, `theta_J += f(v)`, where f is a Gaussian process with squared-exponential covariance
//! on u in [-1, 1] (the range of v in the data), expanded in sines on [-1.5, 1.5].

mod series;

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::background::Background;
use super::evidence::{LEAST_UNIT, Seen, ln_mean_exp};
use super::examination::Examination;
use super::sweep::{self, Sweep};
use crate::effects::own::{OwnEffect, OwnTerm};
use crate::identify::fit::FitError;
use crate::math::positive_definite;
use crate::robot::{JointKind, Robot};
use crate::units::{MM, URAD, Unit};

pub(crate) use series::{Scaled, size, term};

/// Length scales on [-1, 1], and the number of terms for each.
const SCALES: [(f64, usize); 2] = [(0.25, 14), (0.7, 8)];

/// Plausible amplitude of a joint error as a function of any variable, rad.
pub(crate) const AMPLITUDE: f64 = 60.0 * URAD;

/// Amplitudes tested, in units of the plausible amplitude.
pub(crate) const SIZES: [f64; 4] = [0.3, 1.0, 3.0, 10.0];

/// Odds against the background from which a cell is credible.
pub(crate) const CREDIBLE_ODDS: f64 = 20.0;

/// Terms with a plausible size below this share of the largest are dropped.
const LEAST_TERM: f64 = 1e-3;

/// Number of points of a drawn curve.
const DRAWN: usize = 41;

/// A variable on which a joint's error may depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// Angle of a joint, counted from 0.
    Angle(usize),
    /// Position of a prismatic joint, counted from 0.
    Slide(usize),
    /// Sum of the angles of joints 2 and 3: the inclination of the forearm if axes 2 and 3 are parallel.
    Forearm,
    /// Moment of the load about a joint, counted from 0.
    Torque(usize),
    /// Time since the session began.
    Time,
}

impl Variable {
    /// Notation in user-defined effects: `q1`, `(q2 + q3)`, `tau2`, `time_s`.
    pub fn expression(self) -> String {
        match self {
            Variable::Angle(j) | Variable::Slide(j) => format!("q{}", j + 1),
            Variable::Forearm => "(q2 + q3)".into(),
            Variable::Torque(j) => format!("tau{}", j + 1),
            Variable::Time => "time_s".into(),
        }
    }

    /// Parses a variable of a robot; `q2+q3` and `q2 + q3` are equivalent.
    ///
    /// ```
    /// use calibench::diagnosis::heat_map::Variable;
    /// use calibench::robot::built_in;
    ///
    /// let robot = built_in("ur5").ok_or("built in")?;
    /// assert_eq!(Variable::parse("tau2", &robot), Some(Variable::Torque(1)));
    /// assert_eq!(Variable::parse("q2 + q3", &robot).map(Variable::name).as_deref(), Some("q2+q3"));
    /// assert_eq!(Variable::parse("q7", &robot), None);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn parse(text: &str, robot: &Robot) -> Option<Self> {
        let joints = robot.joints();
        let plain: String = text.chars().filter(|c| !c.is_whitespace() && !"()".contains(*c)).collect();
        let joint = |digits: &str| digits.parse::<usize>().ok().filter(|j| (1..=joints).contains(j)).map(|j| j - 1);
        match plain.as_str() {
            "time_s" => Some(Variable::Time),
            "q2+q3" => Some(Variable::Forearm),
            other => match other.strip_prefix("tau") {
                Some(digits) => joint(digits).map(Variable::Torque),
                None => joint(other.strip_prefix('q')?).map(|j| Variable::of_joint(robot, j)),
            },
        }
    }

    /// Position of joint `j`, counted from 0.
    fn of_joint(robot: &Robot, j: usize) -> Self {
        match robot.kind(j) {
            JointKind::Revolute => Variable::Angle(j),
            JointKind::Prismatic => Variable::Slide(j),
        }
    }

    /// Notation in the id of a curve, without spaces or parentheses: `q1`, `q2+q3`, `tau2`, `time_s`.
    pub fn name(self) -> String {
        self.expression().chars().filter(|c| !" ()".contains(*c)).collect()
    }

    /// Unit in which it is shown, and its SI value.
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            Variable::Angle(_) | Variable::Forearm => ("deg", crate::units::DEG),
            Variable::Slide(_) => ("mm", MM),
            Variable::Torque(_) => ("N·m", 1.0),
            Variable::Time => ("s", 1.0),
        }
    }
}

/// Evidence that the error of a joint is a function of a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// The joint, counted from 0.
    pub joint: usize,
    /// The variable on which its error may depend.
    pub variable: Variable,
    /// Log evidence vs. noise alone.
    pub ln_evidence: f64,
    /// Log evidence vs. background.
    pub ln_evidence_against_background: f64,
    /// Share of the remaining sum of squares that the curve explains.
    pub explains: f64,
}

/// A term of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveTerm {
    /// Its expression, whose coefficient is in rad.
    pub basis: String,
    /// Plausible size of the coefficient, rad.
    pub size: f64,
}

/// The error of a joint as a function of a variable, with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The joint, counted from 0.
    pub joint: usize,
    /// The variable.
    pub variable: Variable,
    /// Values of the variable, SI.
    pub at: Vec<f64>,
    /// The error about its mean, rad, without the part that the fitted model absorbs.
    pub mean: Vec<f64>,
    /// Its one-sigma, rad.
    pub sigma: Vec<f64>,
    /// The curve as terms of a user-defined effect.
    pub terms: Vec<CurveTerm>,
}

/// All cells, and the curve of the best one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatMap {
    /// One entry per joint and variable; variables that do not vary in the data are omitted.
    pub cells: Vec<Cell>,
    /// Index of the cell with the highest evidence against the background.
    pub best: Option<usize>,
    /// Curve of the best cell.
    pub curve: Option<Curve>,
}

impl HeatMap {
    /// Tests every joint and variable on the residual of the fit.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub(crate) fn new(examination: &Examination, background: &Background) -> Result<Self, FitError> {
        let variables = variables(examination);
        let robot = examination.problem.robot();
        let turning: Vec<usize> = (0..robot.joints()).filter(|&j| robot.kind(j) == JointKind::Revolute).collect();
        let terms: usize = SCALES.iter().map(|(_, m)| m).sum();
        let samples = examination.contexts.len();
        let mut features = DMatrix::zeros(samples, variables.len() * terms);
        for (v, (_, scaled)) in variables.iter().enumerate() {
            let mut b = v * terms;
            for (length, count) in SCALES {
                for m in 0..count {
                    for (i, &u) in scaled.u.iter().enumerate() {
                        features[(i, b)] = term(m, length, u);
                    }
                    b += 1;
                }
            }
        }
        let of_joint = |j: usize| {
            let sweep = Sweep::new(examination, background, &sweep::joint(&examination.contexts, j), Cow::Borrowed(&features));
            let of_variable = |(v, (variable, _)): (usize, &(Variable, Scaled))| {
                let mut first = v * terms;
                let mut found = [Vec::new(), Vec::new()];
                let mut explains = 0.0_f64;
                for (_, count) in SCALES {
                    let block = sweep.block(first, count, AMPLITUDE);
                    let [plain, aware] = block.ln_evidence(examination, background, &SIZES);
                    found[0].push(plain);
                    found[1].push(aware);
                    explains = explains.max(Seen::new(block.k, &block.z).explained().0 / examination.remainder.squares);
                    first += count;
                }
                Cell {
                    joint: j,
                    variable: *variable,
                    ln_evidence: ln_mean_exp(&found[0]),
                    ln_evidence_against_background: ln_mean_exp(&found[1]),
                    explains,
                }
            };
            variables.iter().enumerate().map(of_variable).collect::<Vec<Cell>>()
        };
        let cells: Vec<Cell> = turning.into_par_iter().map(of_joint).collect::<Vec<_>>().into_iter().flatten().collect();
        let aware = |k: &usize| cells[*k].ln_evidence_against_background;
        let best = (0..cells.len()).max_by(|a, b| aware(a).total_cmp(&aware(b)));
        let of_cell = |k: usize| {
            let found = variables.iter().find(|(variable, _)| *variable == cells[k].variable)?;
            Some(curve(examination, background, cells[k].joint, found.0, &found.1))
        };
        let curve = best.and_then(of_cell).transpose()?;
        Ok(HeatMap { cells, best, curve })
    }

    /// The best cell.
    pub fn best_cell(&self) -> Option<&Cell> {
        self.best.map(|k| &self.cells[k])
    }

    /// The best cell of every joint whose evidence exceeds that of the background twentyfold, best first.
    pub fn credible(&self) -> Vec<&Cell> {
        let mut cells: Vec<&Cell> =
            self.cells.iter().filter(|c| c.ln_evidence_against_background > CREDIBLE_ODDS.ln()).collect();
        cells.sort_by(|a, b| b.ln_evidence_against_background.total_cmp(&a.ln_evidence_against_background));
        let mut joints = std::collections::BTreeSet::new();
        cells.retain(|c| joints.insert(c.joint));
        cells
    }

    /// Log of the mean evidence of all cells over that of the background: one hypothesis, that any joint depends on any
    /// variable.
    pub(crate) fn ln_evidence_against_background(&self) -> f64 {
        ln_mean_exp(&self.cells.iter().map(|c| c.ln_evidence_against_background).collect::<Vec<_>>())
    }
}

impl Curve {
    /// Computes the curve of any cell; `joint` counts from 0. `None` if the variable does not vary in the data.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of(examination: &Examination, joint: usize, variable: Variable) -> Result<Option<Self>, FitError> {
        let Some(found) = variables(examination).into_iter().find(|(v, _)| *v == variable) else { return Ok(None) };
        let background = Background::new(examination)?;
        Ok(Some(curve(examination, &background, joint, found.0, &found.1)?))
    }

    /// As the verb `add` takes it: `curve:3:tau2`.
    pub fn id(&self) -> String {
        format!("curve:{}:{}", self.joint + 1, self.variable.name())
    }

    /// Name of the curve as a user-defined effect: `curve_3_tau2`.
    pub fn effect_name(&self) -> String {
        self.id().replace([':', '+'], "_")
    }

    /// The curve as a user-defined effect, with a prior of the size estimated from the data.
    pub(crate) fn own_effect(&self) -> OwnEffect {
        own_effect(self.effect_name(), self.joint, &self.terms)
    }
}

/// A smooth error of a joint as a user-defined effect of this name; each term has its plausible size.
pub(crate) fn own_effect(name: String, joint: usize, terms: &[CurveTerm]) -> OwnEffect {
    let plausible = terms.iter().map(|t| t.size).fold(f64::MIN_POSITIVE, f64::max);
    let terms = terms.iter().filter(|t| t.size > LEAST_TERM * plausible).map(|CurveTerm { basis, size }| OwnTerm {
        site: format!("theta:{}", joint + 1),
        // The ratio of the term's plausible size to the common one.
        basis: format!("{:.6} * {basis}", size / plausible),
        group: None,
    });
    OwnEffect { name, unit: Unit::URAD, plausible, terms: terms.collect() }
}

/// Variables that vary in the data.
pub(crate) fn variables(examination: &Examination) -> Vec<(Variable, Scaled)> {
    let contexts = &examination.contexts;
    let robot = examination.problem.robot();
    let joints = robot.joints();
    let angle = |j: usize| Some(contexts.iter().map(|c| c.q[j]).collect());
    let turns = |j: &usize| robot.kind(*j) == JointKind::Revolute;
    let parallel = joints > 2 && [1, 2].iter().all(turns) && robot.links[2].mdh.alpha.sin().abs() < 1e-3;
    let mut all: Vec<(Variable, Option<Vec<f64>>)> = (0..joints).map(|j| (Variable::of_joint(robot, j), angle(j))).collect();
    if parallel {
        all.push((Variable::Forearm, Some(contexts.iter().map(|c| c.q[1] + c.q[2]).collect())));
    }
    if robot.has_masses() {
        let torque = |j: usize| Some(contexts.iter().map(|c| c.tau[j]).collect());
        all.extend((0..joints).filter(turns).map(|j| (Variable::Torque(j), torque(j))));
    }
    all.push((Variable::Time, contexts.iter().map(|c| c.time_s).collect()));
    all.into_iter().filter_map(|(variable, values)| Some((variable, Scaled::new(&values?)?))).collect()
}

/// Posterior curve at the length scale with the higher evidence, with the most credible amplitude.
fn curve(
    examination: &Examination,
    background: &Background,
    joint: usize,
    variable: Variable,
    scaled: &Scaled,
) -> Result<Curve, FitError> {
    let samples = scaled.u.len();
    let candidates = SCALES.map(|(length, count)| {
        let features = DMatrix::from_fn(samples, count, |i, m| term(m, length, scaled.u[i]));
        let sweep = Sweep::new(examination, background, &sweep::joint(&examination.contexts, joint), Cow::Owned(features));
        let block = sweep.block(0, count, AMPLITUDE);
        let seen = Seen::new(block.k.clone(), &block.z);
        let of_size = SIZES.map(|s| (s, seen.ln_evidence(&examination.remainder, &[s])));
        let (amplitude, ln_evidence) = of_size.into_iter().fold((1.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
        (ln_evidence, length, count, amplitude, block)
    });
    let [first, second] = candidates;
    let (_, length, count, amplitude, block) = if first.0 >= second.0 { first } else { second };
    let remainder = &examination.remainder;
    let explained = Seen::new(block.k.clone(), &block.z).explained().0;
    let noise = ((remainder.squares - explained) / remainder.dof).max(LEAST_UNIT);
    let precision = &block.k / noise + DMatrix::identity(count, count) / (amplitude * amplitude);
    let covariance = positive_definite::inverse(precision)?;
    let mean: DVector<f64> = &covariance * &block.z / noise;
    let mut curve = Curve { joint, variable, at: Vec::new(), mean: Vec::new(), sigma: Vec::new(), terms: Vec::new() };
    let along = |k: usize| 2.0 * k as f64 / (DRAWN - 1) as f64 - 1.0;
    let drawn = |u: f64| DVector::from_fn(count, |m, _| AMPLITUDE * term(m, length, u));
    // The mean is equivalent to the joint's zero offset, which every fit absorbs.
    let level = (0..DRAWN).fold(DVector::zeros(count), |sum, k| sum + drawn(along(k))) / DRAWN as f64;
    for k in 0..DRAWN {
        let u = along(k);
        let features = drawn(u) - &level;
        curve.at.push(scaled.centre + u * scaled.half_range);
        curve.mean.push(features.dot(&mean));
        curve.sigma.push((&covariance * &features).dot(&features).max(0.0).sqrt());
    }
    for m in 0..count {
        let basis = scaled.basis(m, &variable.expression());
        let size = amplitude * AMPLITUDE * size(m, length);
        curve.terms.push(CurveTerm { basis, size });
    }
    Ok(curve)
}
