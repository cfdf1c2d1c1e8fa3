//! Units that can differ between runs: parameters of the arm, effects as wholes, tools and balls; and the patterns of
//! differences.

use crate::diagnosis::Examination;
use crate::effects::facts::{Offered, Role};
use crate::effects::family::Origin;
use crate::effects::{EffectId, Owner};
use crate::identify::problem::Prior;
use crate::identify::{Model, RunChange};

/// The largest number of parameters of an effect that is tested as a whole.
const SMALL: usize = 4;

/// Something that may differ between runs.
#[derive(Debug, Clone)]
pub(super) struct Unit {
    /// Id of the effect, and the names of those of its parameters that are meant; empty for all.
    pub effect: EffectId,
    pub parameters: Vec<String>,
    /// Its columns, by index among those under test.
    pub columns: Vec<usize>,
    pub kind: UnitKind,
}

/// Kind of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UnitKind {
    /// A parameter of the arm.
    Parameter,
    /// An effect of the model.
    Effect,
    /// An effect of the catalogue that the model lacks.
    Missing,
    /// Tool, ball or base of one run, by index.
    SetUp(usize),
}

/// Pattern of a difference over the runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    /// From one run on, counted from 0, it is another value.
    Since(usize),
    /// It is another value in one run, counted from 0.
    Only(usize),
    /// It grows in proportion to the time.
    Drift,
}

/// Units, with the columns under test (by index among fitted columns and candidates) that they consist of.
pub(super) struct Units {
    pub all: Vec<Unit>,
    pub columns: Vec<usize>,
}

impl Units {
    /// Everything in an examined fit that may differ; `run_of_setup` is the run of each set-up.
    pub fn of(examination: &Examination, run_of_setup: &[usize]) -> Units {
        let mut units = Units { all: Vec::new(), columns: Vec::new() };
        units.add_fitted(examination, run_of_setup);
        let Examination { library, spans, columns, wide, fitted, model, .. } = examination;
        for (candidate, span) in library.candidates.iter().zip(spans) {
            let parameter = |k: usize| &wide.parameters()[columns[k].parameter];
            let Some(first) = span.range().next() else { continue };
            if model.family(&candidate.id).is_some_and(|f| f.role == Role::AnyShape) {
                continue;
            }
            if parameter(first).owner == Owner::Robot {
                let own: Vec<usize> = span.range().map(|k| units.column(fitted.len() + k)).collect();
                let effect = candidate.id.clone();
                units.all.push(Unit { effect, parameters: Vec::new(), columns: own, kind: UnitKind::Missing });
                continue;
            }
            for run in 0..=run_of_setup.iter().copied().max().unwrap_or(0) {
                let of_run = |k: &usize| parameter(*k).setup.is_some_and(|s| run_of_setup[s] == run);
                let own: Vec<usize> = span.range().filter(of_run).map(|k| units.column(fitted.len() + k)).collect();
                if !own.is_empty() {
                    let effect = candidate.id.clone();
                    units.all.push(Unit { effect, parameters: Vec::new(), columns: own, kind: UnitKind::SetUp(run) });
                }
            }
        }
        units
    }

    fn add_fitted(&mut self, examination: &Examination, run_of_setup: &[usize]) {
        let Examination { problem, fit, model, .. } = examination;
        for (column, &p) in fit.kept.iter().enumerate() {
            let parameter = &problem.parameters()[p];
            if parameter.effect.starts_with(CHANGE) {
                continue;
            }
            if parameter.owner != Owner::Robot {
                // A tool or a ball whose place is certified gives way no further than its certificate: it may have moved.
                if let (Some(setup), true) = (parameter.setup, parameter.knowledge != Prior::Uninformative) {
                    let own = self.column(column);
                    let kind = UnitKind::SetUp(run_of_setup[setup]);
                    match self.all.iter_mut().find(|u| u.effect == parameter.effect && u.kind == kind) {
                        Some(unit) => unit.columns.push(own),
                        None => self.all.push(Unit {
                            effect: parameter.effect.clone(),
                            parameters: Vec::new(),
                            columns: vec![own],
                            kind,
                        }),
                    }
                }
                continue;
            }
            let effect = &parameter.effect;
            if model.is_unregularised(effect) {
                let own = vec![self.column(column)];
                let parameters = vec![parameter.spec.name.clone()];
                self.all.push(Unit { effect: effect.clone(), parameters, columns: own, kind: UnitKind::Parameter });
                continue;
            }
            if model.family(effect).is_some_and(|f| f.role == Role::AnyShape) {
                continue;
            }
            let own = self.column(column);
            match self.all.iter_mut().find(|u| u.effect == *effect) {
                Some(unit) => unit.columns.push(own),
                None => self.all.push(Unit {
                    effect: effect.clone(),
                    parameters: Vec::new(),
                    columns: vec![own],
                    kind: UnitKind::Effect,
                }),
            }
        }
    }

    fn column(&mut self, of_products: usize) -> usize {
        self.columns.push(of_products);
        self.columns.len() - 1
    }
}

/// The beginning of the id of a change as an effect.
pub(super) const CHANGE: &str = "change:";

/// Effects beside the model that are looked for in single runs: those of the arm with few parameters, of which every joint may
/// have one; a tool or balls that are not as stated.
pub(super) fn looked_for(model: &Model, candidates: impl Iterator<Item = String>) -> Vec<String> {
    let is_meant = |id: &String| {
        model.family(id).is_some_and(|f| {
            f.origin == Origin::Arm && f.role == Role::Cause && f.arguments.starts_with(":J") && f.offered == Offered::Always
        })
    };
    candidates.filter(is_meant).filter(|id| EffectId::new(id).number(0).is_some()).collect()
}

impl Unit {
    /// Its first parameter if it is of single ones, or its effect.
    pub fn name(&self) -> &str {
        self.parameters.first().map_or(self.effect.whole(), String::as_str)
    }

    /// True if it is small enough to be tested as a whole.
    pub fn is_small(&self) -> bool {
        self.columns.len() <= SMALL
    }

    /// The directions in which it differs by a pattern, for each of its columns; `months` are the times of the runs.
    pub fn directions(&self, pattern: &Pattern, months: &[f64]) -> Vec<Vec<(usize, usize, f64)>> {
        let weights = weights(pattern, months);
        let of = |&column: &usize| {
            weights.iter().enumerate().filter(|(_, w)| **w != 0.0).map(|(run, &w)| (column, run, w)).collect()
        };
        self.columns.iter().map(of).collect()
    }

    /// The same in all runs.
    pub fn shared(&self, runs: usize) -> Vec<Vec<(usize, usize, f64)>> {
        self.columns.iter().map(|&column| (0..runs).map(|run| (column, run, 1.0)).collect()).collect()
    }

    /// Other values in every run than in the first.
    pub fn free(&self, runs: usize) -> Vec<Vec<(usize, usize, f64)>> {
        self.columns.iter().flat_map(|&column| (1..runs).map(move |run| vec![(column, run, 1.0)])).collect()
    }

    /// The change as the model takes it.
    pub fn change(&self, pattern: &Pattern, names: &[&str], months: &[f64]) -> RunChange {
        let weights = weights(pattern, months);
        let weighed = names.iter().zip(weights).filter(|(_, w)| *w != 0.0).map(|(name, w)| ((*name).to_owned(), w));
        RunChange {
            when: pattern.words(names),
            effect: self.effect.clone(),
            parameters: self.parameters.clone(),
            weights: weighed.collect(),
        }
    }
}

impl Pattern {
    /// All patterns of a number of runs; `dated` if their times are known. Of two patterns that are the same, the first.
    pub(super) fn all(runs: usize, dated: bool) -> Vec<Pattern> {
        let mut all: Vec<Pattern> = (1..runs).map(Pattern::Since).collect();
        // The first run alone is all runs since the second, with the opposite sign; the last alone is since the last.
        all.extend((1..runs.saturating_sub(1)).map(Pattern::Only));
        if dated && runs > 2 {
            all.push(Pattern::Drift);
        }
        all
    }

    /// The runs that differ, in words, by name.
    ///
    /// ```
    /// use calibench::monitoring::runs::Pattern;
    ///
    /// let runs = ["march", "june", "october"];
    /// assert_eq!(Pattern::Since(1).words(&runs), "since june");
    /// assert_eq!(Pattern::Only(2).words(&runs), "in october");
    /// ```
    pub fn words(&self, names: &[&str]) -> String {
        match self {
            Pattern::Since(run) => format!("since {}", names[*run]),
            Pattern::Only(run) => format!("in {}", names[*run]),
            Pattern::Drift => "per month".into(),
        }
    }
}

/// The weight of each run.
fn weights(pattern: &Pattern, months: &[f64]) -> Vec<f64> {
    let of = |run: usize| match pattern {
        Pattern::Since(first) => f64::from(u8::from(run >= *first)),
        Pattern::Only(only) => f64::from(u8::from(run == *only)),
        Pattern::Drift => months[run] - months[0],
    };
    (0..months.len()).map(of).collect()
}
