//! Control charts over the checks of a robot: a drift too small for any one check shows in their course.
//!
//! Every check is compared with the mean of all measurements before it at the same poses: those of the campaign and of the
//! earlier checks in which nothing had changed. These recursive residuals are independent from one check to the next while
//! nothing changes, although all share the noise of the campaign (D. M. Hawkins, Self-starting Cusum charts for location and
//! scale, *The Statistician* 36, 1987). Their component along each elementary change, whitened, is standard normal and enters
//! an exponentially weighted moving average (S. W. Roberts, *Technometrics* 1, 1959), whose limits follow from the run length by
//! the Markov chain of J. M. Lucas and M. S. Saccucci (*Technometrics* 32, 1990).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

use super::conditions::Elementary;
use super::{CheckError, CheckReference};
use crate::measure::dataset::{Dataset, NamedDataset, Sample};

/// Weight of the newest check in the moving average. 0.2 finds drifts of one sigma a check soonest (Lucas and Saccucci 1990).
const NEWEST: f64 = 0.2;

/// Mean number of checks until any of the charts signals while nothing changes (docs/check.md).
pub const RUN_LENGTH: f64 = 200.0;

/// States of the Markov chain on either side of zero.
const STATES: usize = 50;

/// One check in a chart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChartPoint {
    /// Change since the mean of the measurements before, SI.
    pub estimate: f64,
    /// Its one-sigma, SI; infinite if these poses do not show it.
    pub sigma: f64,
    /// The moving average, in standard deviations of its own.
    pub average: f64,
}

/// The course of one elementary change.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Quantity that may change.
    pub of: Elementary,
    /// One entry per check.
    pub points: Vec<ChartPoint>,
}

/// The charts of all elementary changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Charts {
    /// Limit of every moving average, in its standard deviations.
    pub limit: f64,
    /// The charts.
    pub charts: Vec<Chart>,
}

impl Chart {
    /// Index of the check at which its average left the limits, if it is still beyond them.
    ///
    /// ```
    /// use calibench::monitoring::check::charts::{Chart, ChartPoint};
    /// use calibench::monitoring::check::conditions::Elementary;
    ///
    /// let chart = |averages: &[f64]| Chart {
    ///     of: Elementary::Growth,
    ///     points: averages.iter().map(|&average| ChartPoint { estimate: 0.0, sigma: 1.0, average }).collect(),
    /// };
    /// assert_eq!(chart(&[0.5, 2.8, 3.1]).signal(2.7), Some(1));
    /// assert_eq!(chart(&[0.5, 2.8, 0.1]).signal(2.7), None);
    /// ```
    pub fn signal(&self, limit: f64) -> Option<usize> {
        let inside = self.points.iter().rposition(|p| p.average.abs() <= limit);
        let since = inside.map_or(0, |last| last + 1);
        (since < self.points.len()).then_some(since)
    }
}

impl Charts {
    /// The charts of `checks`, in the order in which they were measured, after the campaign of the reference.
    ///
    /// The noise is that of the campaign alone: the checks' own scatter is what the charts look for.
    ///
    /// # Errors
    /// As [`CheckReference::check`].
    pub fn of(reference: &CheckReference<'_>, checks: &[NamedDataset<'_>]) -> Result<Self, CheckError> {
        let then = reference.then;
        let mut before = then.dataset.clone();
        let mut courses: Vec<Chart> = Vec::new();
        let mut averages: Vec<f64> = Vec::new();
        for (k, now) in checks.iter().enumerate() {
            let scene = reference.scene(NamedDataset::new(then.name, &before), *now)?;
            // A changed robot shows nothing of its earlier state, and its change is not a drift.
            let changed = reference.has_changed(*now)?;
            for (c, (of, column)) in scene.elementary().into_iter().enumerate() {
                if k == 0 {
                    courses.push(Chart { of, points: Vec::new() });
                    averages.push(0.0);
                }
                let size = column.norm();
                let (mut estimate, mut sigma) = (0.0, f64::INFINITY);
                if size > 0.0 {
                    let score = column.dot(&scene.differences) / size;
                    if !changed {
                        averages[c] += NEWEST * (score - averages[c]);
                    }
                    (estimate, sigma) = (score / size, 1.0 / size);
                }
                courses[c].points.push(ChartPoint { estimate, sigma, average: averages[c] / spread() });
            }
            if !changed {
                let renamed = |s: &Sample| Sample { id: format!("check {}, {}", k + 1, s.id), ..s.clone() };
                append(&mut before, now.dataset, renamed);
            }
        }
        Ok(Charts { limit: limit_of(RUN_LENGTH * courses.len().max(1) as f64), charts: courses })
    }

    /// The charts that have signalled, each with the index of the check.
    pub fn signals(&self) -> Vec<(&Chart, usize)> {
        self.charts.iter().filter_map(|chart| Some((chart, chart.signal(self.limit)?))).collect()
    }
}

/// Adds the rows of another dataset of the same cell, whose balls, anchors and payloads may be listed in another order.
fn append(to: &mut Dataset, from: &Dataset, renamed: impl Fn(&Sample) -> Sample) {
    use crate::measure::dataset::Measured;
    for sample in &from.samples {
        let mut sample = renamed(sample);
        let found = match &mut sample.measured {
            Measured::Ball { ball, .. } => same(from.balls.get(*ball).map(|b| &b.id), to.balls.iter().map(|b| &b.id), ball),
            Measured::Distance { anchor, .. } => {
                same(from.anchors.get(*anchor).map(|a| &a.id), to.anchors.iter().map(|a| &a.id), anchor)
            }
            Measured::Point(_) => true,
        };
        let name = from.payloads.get(sample.payload).map(|p| &p.name);
        if found && (to.payloads.is_empty() || same(name, to.payloads.iter().map(|p| &p.name), &mut sample.payload)) {
            to.samples.push(sample);
        }
    }
}

/// Sets `place` to that of the equal name; false if there is none.
fn same<'a>(name: Option<&String>, mut among: impl Iterator<Item = &'a String>, place: &mut usize) -> bool {
    let found = name.and_then(|name| among.position(|other| other == name));
    found.is_some_and(|at| {
        *place = at;
        true
    })
}

/// Standard deviation of the moving average in the long run, of scores of variance one.
fn spread() -> f64 {
    (NEWEST / (2.0 - NEWEST)).sqrt()
}

/// The limit, in standard deviations of the average, at which a chart signals once in this many checks while nothing changes.
fn limit_of(run_length: f64) -> f64 {
    let (mut low, mut high) = (1.0, 6.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if mean_run(NEWEST, middle) < run_length {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Mean number of scores, standard normal, until their average of this weight leaves `limit` standard deviations.
fn mean_run(weight: f64, limit: f64) -> f64 {
    let Ok(normal) = Normal::new(0.0, 1.0) else { return f64::INFINITY };
    let edge = limit * (weight / (2.0 - weight)).sqrt();
    let count = 2 * STATES + 1;
    let half = edge / count as f64;
    let state = |k: usize| (2.0 * k as f64 + 1.0 - count as f64) * half;
    let to = |i: usize, j: usize| {
        let at = |shift: f64| normal.cdf((state(j) + shift - (1.0 - weight) * state(i)) / weight);
        at(half) - at(-half)
    };
    let stays = DMatrix::from_fn(count, count, |i, j| f64::from(u8::from(i == j)) - to(i, j));
    let runs = stays.lu().solve(&DVector::from_element(count, 1.0));
    // Singular if the average never leaves.
    runs.map_or(f64::INFINITY, |runs| runs[STATES])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lucas and Saccucci (1990), table 3: limits of charts that signal once in 500 checks.
    #[test]
    fn limits_are_those_of_the_table() {
        for (weight, limit) in [(0.1, 2.814), (0.25, 2.998), (0.5, 3.071)] {
            let run = mean_run(weight, limit);
            assert!((run - 500.0).abs() < 5.0, "{weight}: {run}");
        }
        assert!((mean_run(NEWEST, limit_of(2600.0)) / 2600.0 - 1.0).abs() < 1e-6);
    }
}
