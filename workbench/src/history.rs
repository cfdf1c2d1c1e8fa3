//! The sets of effects that the user was at, in order, and the present one among them.

use calibench::identify::Model;
use calibench::selection::Objection;
use serde_json::{Value, json};

use crate::switches::Switches;

/// Number of moments that can be gone back to.
const MOST_MOMENTS: usize = 200;

/// Number of steps that are shown, the first included.
const MOST_SHOWN: usize = 12;

/// A set of effects that the user was at.
#[derive(Clone)]
pub(super) struct Moment {
    /// Datasets, by index.
    pub chosen: Vec<usize>,
    /// Effects that are on.
    pub switches: Switches,
    /// The model of those.
    pub model: Model,
    /// Effects switched on and off since the moment before.
    pub changed: [Vec<String>; 2],
    /// Objections to that.
    pub objections: Vec<Objection>,
    /// The figures, as a step of the ladder: those of the fit, and the others once they are known.
    pub rung: Value,
}

impl Moment {
    /// The moment of these switches, reached from `before` on the same data.
    pub fn new(chosen: Vec<usize>, switches: Switches, before: Option<&Moment>) -> Self {
        let changed = before.map_or_else(Default::default, |b| switches.changed_from(&b.switches));
        Moment { chosen, model: switches.model(), switches, changed, objections: Vec::new(), rung: Value::Null }
    }

    /// True if the other one is of the same model and data.
    pub fn is(&self, other: &Moment) -> bool {
        self.model == other.model && self.chosen == other.chosen
    }

    /// The figures of the fit alone.
    pub fn first_rung(&self, figures: &Value) -> Value {
        let mut rung = figures.clone();
        rung["added"] = json!(self.changed[0]);
        rung["effects"] = json!(self.model.effects);
        self.with_removed(rung)
    }

    /// A step of the ladder, and what was switched off.
    pub fn with_removed(&self, mut rung: Value) -> Value {
        if !self.changed[1].is_empty() {
            rung["removed"] = json!(self.changed[1]);
        }
        rung
    }
}

/// Moments in order.
pub(super) struct History {
    moments: Vec<Moment>,
    at: usize,
}

impl History {
    /// A history that begins.
    pub fn new(first: Moment) -> Self {
        History { moments: vec![first], at: 0 }
    }

    /// The present moment.
    pub fn here(&self) -> &Moment {
        &self.moments[self.at]
    }

    /// The same, to be added to.
    pub fn here_mut(&mut self) -> &mut Moment {
        &mut self.moments[self.at]
    }

    /// The moment before, on the same data.
    pub fn before(&self) -> Option<&Moment> {
        let before = &self.moments[self.at.checked_sub(1)?];
        (before.chosen == self.here().chosen && !self.here().changed.iter().all(Vec::is_empty)).then_some(before)
    }

    /// Goes on to a moment; what was taken back can no longer be gone forward to.
    pub fn go_on(&mut self, moment: Moment) {
        self.moments.truncate(self.at + 1);
        self.moments.push(moment);
        if self.moments.len() > MOST_MOMENTS {
            self.moments.remove(0);
        }
        self.at = self.moments.len() - 1;
    }

    /// The moment that is `by` away.
    pub fn away(&self, by: isize) -> Option<&Moment> {
        self.moments.get(self.at.checked_add_signed(by)?)
    }

    /// Goes there.
    pub fn turn(&mut self, by: isize) {
        if self.away(by).is_some() {
            self.at = self.at.saturating_add_signed(by);
        }
    }

    /// The steps since the data were chosen; of many, the first and the last ones.
    pub fn rungs(&self) -> Vec<&Value> {
        let begins = |k: &usize| self.moments[*k].changed.iter().all(Vec::is_empty);
        let first = (0..=self.at).rev().find(begins).unwrap_or(0);
        let shown = (self.at - first).min(MOST_SHOWN - 1);
        let last = self.at + 1 - shown..=self.at;
        std::iter::once(first).chain(last).map(|k| &self.moments[k].rung).collect()
    }
}
