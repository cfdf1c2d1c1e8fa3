//! Summary of a table of trials, accumulated row by row in memory independent of its length.

use std::collections::BTreeMap;

use csv::StringRecord;
use serde::Serialize;

use super::bands::{HALF_WIDTH, Share, quantile_band};
use super::distribution::Distribution;
use super::rows::{DONE, ERROR, METHODS, RARE, WEIGHT};
use super::tail::{Tail, TailQuantile};
use calibench_sim::run::Methods;

/// Quantiles in the summary, per cent.
pub const PERCENT: [u32; 5] = [5, 25, 50, 75, 95];

/// Columns whose distribution is summarised.
const SPREAD: [&str; 10] = [
    "mean_mm",
    "max_mm",
    "std_mm",
    "rms_mm",
    "p95_mm",
    "before_mean_mm",
    "residual_mm",
    "chi2_per_dof",
    "readings_mean",
    "cell_s",
];

/// Columns whose tail a study of rare robots estimates: those that follow the mean square, at which it aims. The largest error
/// of a robot may be rare at one pose alone: in studies of 500 trials the few that were sampled so had spreads that were too
/// small.
const TAILS: [&str; 3] = ["mean_mm", "rms_mm", "p95_mm"];

/// Number of distinct failure reasons listed; others are only counted.
const MOST_REASONS: usize = 20;

/// Summary of a study.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Name and fingerprint of the study.
    pub study: String,
    /// Seed of the first point.
    pub seed: u64,
    /// Names of the axes.
    pub axes: Vec<String>,
    /// Summaries of the points.
    pub points: Vec<PointSummary>,
    columns: Columns,
}

/// Summary of one point.
#[derive(Debug, Clone)]
pub struct PointSummary {
    /// Its place on each axis.
    pub at: Vec<String>,
    /// Summaries of the methods.
    pub methods: Vec<MethodSummary>,
}

/// Summary of a method at a point.
#[derive(Debug, Clone)]
pub struct MethodSummary {
    /// `trical` or `tracker`.
    pub name: String,
    /// Number of completed trials.
    pub done: u64,
    /// Numbers of failed trials, by reason.
    pub failed: BTreeMap<String, u64>,
    /// Numbers of diagnoses, by verdict.
    pub verdicts: BTreeMap<String, u64>,
    /// In a study of rare robots the share of all that it asks for.
    pub rare: Option<f64>,
    tails: Vec<Tail>,
    spreads: Vec<Distribution>,
    coverage: Vec<(String, Share)>,
}

/// Distribution of a number, with bands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spread {
    /// Mean over the trials.
    pub mean: f64,
    /// Quantiles in the order of [`PERCENT`].
    pub quantiles: Vec<Quantile>,
}

/// A quantile and its band for infinitely many trials, covered in 95 of 100 studies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantile {
    /// Percentage of the trials below it.
    pub percent: u32,
    /// Value of the quantile.
    pub value: f64,
    /// Lower bound; `None` if there are too few trials for one.
    pub low: Option<f64>,
    /// Upper bound.
    pub high: Option<f64>,
}

/// Column indices in a row.
#[derive(Debug, Clone)]
struct Columns {
    axes: std::ops::Range<usize>,
    point: usize,
    seed: usize,
    method: usize,
    methods: usize,
    outcome: usize,
    verdict: Option<usize>,
    spreads: Vec<Option<usize>>,
    errors: Vec<(usize, String)>,
    /// Share and weight, in a study of rare robots.
    weighted: Option<[usize; 2]>,
}

impl Summary {
    /// A summary of rows under these columns; `None` if they are not those of a study.
    pub fn new(header: &StringRecord) -> Option<Self> {
        let at = |name: &str| header.iter().position(|h| h == name);
        let (point, trial) = (at("point")?, at("trial")?);
        let columns = Columns {
            axes: point + 1..trial,
            point,
            seed: at("seed")?,
            method: at("method")?,
            methods: at(METHODS)?,
            outcome: at("outcome")?,
            verdict: at("verdict"),
            spreads: SPREAD.map(at).to_vec(),
            errors: header.iter().enumerate().filter_map(|(k, h)| Some((k, h.strip_prefix(ERROR)?.to_owned()))).collect(),
            weighted: at(RARE).zip(at(WEIGHT)).map(|(rare, weight)| [rare, weight]),
        };
        let axes = header.iter().take(trial).skip(point + 1).map(str::to_owned).collect();
        Some(Summary { study: String::new(), seed: 0, axes, points: Vec::new(), columns })
    }

    /// Adds a row.
    pub fn add(&mut self, row: &StringRecord) {
        let Columns { axes, point, seed, method, methods, outcome, verdict, spreads, errors, weighted } = &self.columns;
        let Some(point) = row.get(*point).and_then(|p| p.parse::<usize>().ok()) else { return };
        if self.points.is_empty() {
            self.study = row.get(0).unwrap_or_default().to_owned();
            self.seed = row.get(*seed).and_then(|s| s.parse().ok()).unwrap_or_default();
        }
        while self.points.len() <= point {
            let each = row.get(*methods).and_then(Methods::named).unwrap_or_default().each();
            self.points.push(PointSummary {
                at: Vec::new(),
                methods: each.iter().map(|name| MethodSummary::new(name, errors)).collect(),
            });
        }
        let of = &mut self.points[point];
        if of.at.is_empty() {
            of.at = row.iter().take(axes.end).skip(axes.start).map(str::to_owned).collect();
        }
        let Some(of) = of.methods.iter_mut().find(|m| Some(m.name.as_str()) == row.get(*method)) else { return };
        let outcome = row.get(*outcome).unwrap_or_default();
        let number = |column: usize| row.get(column).and_then(|v| v.parse::<f64>().ok());
        if let Some([rare, weight]) = *weighted {
            of.rare = number(rare);
            of.tails.resize(TAILS.len(), Tail::default());
            for (tail, name) in of.tails.iter_mut().zip(TAILS) {
                let column = SPREAD.iter().position(|s| *s == name).and_then(|k| spreads[k]);
                tail.add(column.and_then(number).unwrap_or(f64::INFINITY), number(weight).unwrap_or(0.0));
            }
        }
        if outcome != DONE {
            let known = of.failed.len() < MOST_REASONS || of.failed.contains_key(outcome);
            *of.failed.entry(if known { outcome } else { "other reasons" }.to_owned()).or_default() += 1;
            return;
        }
        of.done += 1;
        // Counts of trials with weights are not shares of robots.
        if weighted.is_some() {
            return;
        }
        for (spread, column) in of.spreads.iter_mut().zip(spreads) {
            if let Some(value) = column.and_then(number) {
                spread.add(value);
            }
        }
        for ((_, share), (column, _)) in of.coverage.iter_mut().zip(errors) {
            if let Some(z) = number(*column) {
                share.of += 1;
                share.count += u64::from(z.abs() <= HALF_WIDTH);
            }
        }
        if let Some(verdict) = verdict.and_then(|column| row.get(column)) {
            *of.verdicts.entry(verdict.to_owned()).or_default() += 1;
        }
    }

    /// Adds rows in CSV form, without their header.
    pub fn add_lines(&mut self, lines: &[u8]) {
        let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(lines);
        let mut row = StringRecord::new();
        // They were written a moment ago.
        while reader.read_record(&mut row).unwrap_or(false) {
            self.add(&row);
        }
    }

    /// True for a study of rare robots, whose trials have weights.
    pub fn is_weighted(&self) -> bool {
        self.columns.weighted.is_some()
    }

    /// Number of trials of each point.
    pub fn trials(&self) -> u64 {
        self.points.first().and_then(|p| p.methods.first()).map_or(0, MethodSummary::trials)
    }
}

impl MethodSummary {
    fn new(name: &str, errors: &[(usize, String)]) -> Self {
        MethodSummary {
            name: name.to_owned(),
            done: 0,
            failed: BTreeMap::new(),
            verdicts: BTreeMap::new(),
            rare: None,
            tails: Vec::new(),
            spreads: vec![Distribution::default(); SPREAD.len()],
            coverage: errors.iter().map(|(_, name)| (name.clone(), Share::default())).collect(),
        }
    }

    /// Number of all trials.
    pub fn trials(&self) -> u64 {
        self.done + self.failed.values().sum::<u64>()
    }

    /// The columns with a distribution.
    pub fn spreads(&self) -> impl Iterator<Item = (&'static str, Spread)> {
        SPREAD.iter().filter_map(|name| Some((*name, self.spread(name)?)))
    }

    /// In a study of rare robots, the errors that the share requested stay within.
    pub fn tails(&self) -> impl Iterator<Item = (&'static str, TailQuantile)> {
        let share = self.rare.unwrap_or(f64::NAN);
        TAILS.into_iter().zip(&self.tails).map(move |(name, tail)| (name, tail.quantile(share)))
    }

    /// Distribution of the numbers in a column; `None` if there are none.
    pub fn spread(&self, column: &str) -> Option<Spread> {
        let of = &self.spreads[SPREAD.iter().position(|s| *s == column)?];
        let quantile = |percent: u32| {
            let share = f64::from(percent) / 100.0;
            let [low, high] = quantile_band(of.count(), share).map(|rank| rank.and_then(|r| of.ranked(r)));
            Some(Quantile { percent, value: of.quantile(share)?, low, high })
        };
        Some(Spread { mean: of.mean(), quantiles: PERCENT.iter().map(|p| quantile(*p)).collect::<Option<_>>()? })
    }

    /// Share of trials in which the 95 % interval of each parameter covered its true value; parameters never estimated are
    /// omitted.
    pub fn coverage(&self) -> impl Iterator<Item = (&str, Share)> {
        self.coverage.iter().filter(|(_, share)| share.of > 0).map(|(name, share)| (name.as_str(), *share))
    }
}
