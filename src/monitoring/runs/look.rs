//! The runs at one fit: what every difference between them would explain.

use super::products::{Explained, Products, Reduced};
use super::units::{CHANGE, Pattern, Unit, UnitKind, Units, looked_for};
use super::{DAYS_A_MONTH, Difference, RUNS_FALSE_ALARM, RunsError, RunsQuestion, RunsTest, names};
use crate::diagnosis::Examination;
use crate::diagnosis::folds::postures;
use crate::diagnosis::library::{Candidate, Library};
use crate::effects;
use crate::effects::EffectId;
use crate::identify::Model;
use crate::identify::calibration::Estimate;
use crate::measure::dataset::NamedDataset;
use crate::residuals::noise_floor::fisher_chance;
use crate::selection::recommend::curves::bands;

/// Highest order, per revolution, of the error curves that are fitted together with the differences tested (docs/runs.md).
const HIGHEST_ORDER: usize = 20;

/// Two differences are distinguished if one explains more than the other by this sum of squares, in units of the noise.
const TOLD_APART: f64 = 9.0;

/// Fewest degrees of freedom that remain when all differences between runs, and those within runs, are free.
const LEAST_LEFT: f64 = 10.0;

/// The model with candidates, its set-ups assigned to runs.
pub(super) struct Look {
    pub examination: Examination,
    pub units: Units,
    pub reduced: Reduced,
    /// Mean square that differences within runs explain, in units of the noise, at least one; and its degrees of freedom.
    pub lacking: [f64; 2],
    pub months: Vec<f64>,
    pub dated: bool,
}

/// A difference with the unit that differs.
pub(super) struct Found {
    pub unit: usize,
    pub effect: String,
    pub pattern: Pattern,
    pub difference: Difference,
}

impl Look {
    pub fn at(named: &[NamedDataset<'_>], model: &Model, question: &RunsQuestion<'_>) -> Result<Look, RunsError> {
        let plain = Examination::with(named, model, Vec::new())?;
        let library: Vec<String> = Library::new(named, model).candidates.into_iter().map(|c| c.id.into()).collect();
        let curves: Vec<String> = bands(plain.problem().robot(), postures(&plain.contexts).count())
            .into_iter()
            .filter(|id| !model.lists(id) && EffectId::new(id).number(2).is_some_and(|high| high <= HIGHEST_ORDER))
            .collect();
        let count = curves.len();
        let mut candidates: Vec<String> = curves;
        // A payload that is not as entered moves what the model lets it bend.
        candidates.extend(library.iter().filter(|id| *id == EffectId::PAYLOAD_MASS).cloned());
        candidates.extend(looked_for(model, library.into_iter()));
        candidates.extend(set_up_candidates(named, model));
        let examination = plain.beside(named, candidates.into_iter().map(Candidate::new).collect())?;
        let run_of = |dataset: &str| named.iter().position(|d| d.name == dataset).unwrap_or(0);
        let run_of_setup: Vec<usize> = examination.problem().setups().iter().map(|s| run_of(&s.dataset)).collect();
        let days: Vec<f64> = question.runs.iter().filter_map(|run| run.day).collect();
        let dated = days.len() == named.len() && days.windows(2).all(|w| w[1] > w[0]);
        let months: Vec<f64> = match dated {
            true => days.iter().map(|d| (d - days[0]) / DAYS_A_MONTH).collect(),
            false => (0..named.len()).map(|k| k as f64).collect(),
        };
        let units = Units::of(&examination, &run_of_setup);
        let drifts = declared(&examination, question.drifts, &months)?;
        let products = Products::new(&examination, &run_of_setup, 0..count);
        let reduced = products.reduced(&units.columns, &drifts)?;
        let of_arm = |unit: &&Unit| unit.kind == UnitKind::Parameter;
        let columns: Vec<usize> = units.all.iter().filter(of_arm).flat_map(|unit| unit.columns.clone()).collect();
        let within = reduced.within_runs(&columns);
        let left = (reduced.squares - within.squares).max(1e-12 * reduced.squares) / (reduced.dof - within.directions).max(1.0);
        let lacking = match within.directions {
            d if d >= 1.0 && reduced.dof - d >= LEAST_LEFT => [(within.squares / d / left).max(1.0), d],
            _ => [1.0, f64::INFINITY],
        };
        Ok(Look { examination, units, reduced, lacking, months, dated })
    }

    fn runs(&self) -> usize {
        self.months.len()
    }

    /// The test of what some differences explain.
    fn test(&self, explained: &Explained) -> RunsTest {
        self.test_of(explained.squares, explained.directions)
    }

    fn test_of(&self, squares: f64, above: f64) -> RunsTest {
        let [lacking, known_by] = self.lacking;
        let below = (self.reduced.dof - above).max(1.0).min(known_by);
        if above < 1.0 || squares <= 0.0 {
            return RunsTest { f: 0.0, above, below, chance: 1.0 };
        }
        let left = (self.reduced.squares - squares).max(1e-12 * self.reduced.squares);
        let f = squares / above / (left / (self.reduced.dof - above).max(1.0)) / lacking;
        RunsTest { f, above, below, chance: fisher_chance(f, above, below).unwrap_or(1.0) }
    }

    /// Variance of the residuals, including model discrepancy.
    pub fn variance(&self) -> f64 {
        self.reduced.unit() * self.lacking[0]
    }

    /// Checks that enough is left beside all parameters free in every run: with next to nothing left, every other run of unchanged
    /// arms seemed to be of another robot.
    ///
    /// # Errors
    /// If there is not.
    pub fn expect_enough(&self, all_free: &RunsTest) -> Result<(), RunsError> {
        let spare = self.reduced.dof - all_free.above;
        if spare < LEAST_LEFT { Err(RunsError::TooFewRows { spare: spare.max(0.0) }) } else { Ok(()) }
    }

    /// All parameters and effects of the arm free in every run.
    pub fn all_free(&self) -> RunsTest {
        let of_arm = |unit: &&Unit| matches!(unit.kind, UnitKind::Parameter | UnitKind::Effect);
        let free: Vec<_> = self.units.all.iter().filter(of_arm).flat_map(|unit| unit.free(self.runs())).collect();
        self.test(&self.reduced.explained(&free))
    }

    /// Reduction by a difference of a unit between runs, beyond that by the same change of the unit in all runs.
    fn explained(&self, unit: &Unit, pattern: &Pattern) -> Explained {
        let own = unit.directions(pattern, &self.months);
        let alone = self.reduced.explained(&own);
        if unit.kind != UnitKind::Missing {
            return alone;
        }
        let shared = unit.shared(self.runs());
        let without = self.reduced.explained(&shared);
        let with = self.reduced.explained(&own.into_iter().chain(shared).collect::<Vec<_>>());
        Explained {
            squares: with.squares - without.squares,
            directions: with.directions - without.directions,
            coefficients: with.coefficients.rows(0, unit.columns.len()).into_owned(),
            covariance: with.covariance.view((0, 0), (unit.columns.len(), unit.columns.len())).into_owned(),
        }
    }

    /// The patterns in which a unit may differ.
    fn patterns(&self, unit: &Unit) -> Vec<Pattern> {
        match unit.kind {
            UnitKind::SetUp(run) => vec![Pattern::Only(run)],
            // Of two runs, that of the first alone is that of the second with the opposite sign.
            UnitKind::Missing => (usize::from(self.runs() == 2)..self.runs()).map(Pattern::Only).collect(),
            UnitKind::Parameter | UnitKind::Effect => Pattern::all(self.runs(), self.dated),
        }
    }

    /// The difference with the smallest chance, if it is smaller than chance allows.
    pub fn best(&self, named: &[NamedDataset<'_>]) -> Option<Found> {
        let mut all: Vec<(usize, Pattern, Explained, RunsTest)> = Vec::new();
        for (place, unit) in self.units.all.iter().enumerate().filter(|(_, unit)| unit.is_small()) {
            for pattern in self.patterns(unit) {
                let explained = self.explained(unit, &pattern);
                let test = self.test(&explained);
                if test.above >= 1.0 {
                    all.push((place, pattern, explained, test));
                }
            }
        }
        let tried = all.len();
        // Chances underflow where differences are gross: the ratio decides among equals.
        let order = |a: &RunsTest, b: &RunsTest| a.chance.total_cmp(&b.chance).then(b.f.total_cmp(&a.f));
        let best = all.iter().min_by(|a, b| order(&a.3, &b.3))?;
        if best.3.chance * tried as f64 >= 0.5 * RUNS_FALSE_ALARM {
            return None;
        }
        let (place, pattern, explained, test) = best;
        let unit = &self.units.all[*place];
        let unit_variance = self.variance();
        let near = |(other, other_pattern, e, _): &&(usize, Pattern, Explained, RunsTest)| {
            (other != place || other_pattern != pattern) && e.squares > explained.squares - TOLD_APART * unit_variance
        };
        let names = names(named);
        let words = |(other, pattern, ..): &(usize, Pattern, Explained, RunsTest)| {
            let unit = &self.units.all[*other];
            let name = unit.name();
            format!("{name} {}", pattern.words(&names))
        };
        Some(Found {
            unit: *place,
            effect: unit.name().to_owned(),
            pattern: pattern.clone(),
            difference: Difference {
                effect: unit.effect.clone(),
                parameters: Vec::new(),
                pattern: pattern.clone(),
                set_up_of: match unit.kind {
                    UnitKind::SetUp(run) => Some(run),
                    _ => None,
                },
                missing: unit.kind == UnitKind::Missing,
                test: *test,
                tried,
                aliased: all.iter().filter(near).map(words).collect(),
            },
        })
    }

    /// Estimates of the fitted parameters of an effect, with the error curves allowed for.
    pub fn estimates_of(&self, effect: &str) -> Vec<Estimate> {
        let Examination { problem, fit, .. } = &self.examination;
        let unit = self.variance();
        let of = |(column, &p): (usize, &usize)| {
            let parameter = &problem.parameters()[p];
            (parameter.effect == effect).then(|| {
                let sigma = (unit * self.reduced.covariance[(column, column)]).max(0.0).sqrt();
                Estimate {
                    name: parameter.name.clone(),
                    effect: parameter.effect.clone(),
                    unit: parameter.spec.unit,
                    value: parameter.start + fit.values[p] + self.reduced.correction[column],
                    sigma,
                    sigma_noise: fit.sigma(p).unwrap_or(0.0),
                    nominal: parameter.spec.nominal,
                    stated_sigma: None,
                }
            })
        };
        fit.kept.iter().enumerate().filter_map(of).collect()
    }
}

/// The declared drifts as columns with the variance of each increment.
fn declared(examination: &Examination, drifts: &[(String, f64)], months: &[f64]) -> Result<Vec<(usize, Vec<f64>)>, RunsError> {
    let Examination { problem, fit, .. } = examination;
    let of_arm = |p: &usize| {
        let parameter = &problem.parameters()[*p];
        parameter.owner == effects::Owner::Robot && !parameter.effect.starts_with(CHANGE)
    };
    let column = |(name, monthly): &(String, f64)| {
        let found = fit.kept.iter().position(|p| of_arm(p) && problem.parameters()[*p].name == *name);
        let column = found.ok_or_else(|| RunsError::NoParameter {
            name: name.clone(),
            known: fit
                .kept
                .iter()
                .filter(|p| of_arm(p))
                .map(|p| problem.parameters()[*p].name.as_str())
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        // A walk: its variance grows with the time.
        Ok((column, months.windows(2).map(|w| monthly * monthly * (w[1] - w[0])).collect()))
    };
    drifts.iter().map(column).collect()
}

/// Effects of tools and balls that are stated and may not be as stated.
fn set_up_candidates(named: &[NamedDataset<'_>], model: &Model) -> Vec<String> {
    let mut all = Vec::new();
    let absent = |id: &str| !model.lists(id);
    if named.iter().all(|d| !d.dataset.tool_free && d.dataset.tool_sigma == 0.0) && absent(EffectId::TOOL_FRAME) {
        all.push(EffectId::TOOL_FRAME.to_owned());
    }
    if absent(EffectId::BASE_FRAME) {
        all.push(EffectId::BASE_FRAME.to_owned());
    }
    let balls = named[0].dataset.ball_ids();
    if balls.len() > 1 && named.iter().all(|d| d.dataset.ball_ids() == balls && d.dataset.balls.iter().all(|b| !b.free)) {
        all.extend(balls.iter().map(|b| String::from(EffectId::of_ball(b))).filter(|id| absent(id)));
    }
    all
}
