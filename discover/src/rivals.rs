//! What cannot be told from a law in these data, and the postures at which it could be.

use std::ops::Range;
use std::sync::Arc;

use calibench::diagnosis::Examination;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use calibench::prediction::WorkspacePoses;
use calibench::robot::kinematics::world_from_tool;
use nalgebra::{DMatrix, DVector};

use crate::data::{Data, Fitted};
use crate::factors::Factors;
use crate::field::{Field, Found};
use crate::law::{Apart, Rival};
use crate::metric::Metrics;
use crate::samples::{known, place_columns, spans};

/// A law is a rival if its odds are at least this share of those of the best.
const LIKELY: f64 = 0.05;

/// Number of rivals that are named.
const NAMED: usize = 3;

/// Number of postures that are named for each.
const POSTURES: usize = 3;

/// A posture tells two laws apart if they differ there by this many sigma of a measurement.
pub const TELLS: f64 = 3.0;

/// Two laws are the same if they differ nowhere by more than this share of the larger.
const SAME: f64 = 0.01;

/// Two postures are different if a joint differs by this much, rad.
const DIFFERENT: f64 = 0.5;

/// The rivals of the best law among all that were found, best first.
pub(crate) fn rivals(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    data: &Data,
    metrics: &Metrics,
    best: &Found,
    found: &[Found],
) -> Vec<Rival> {
    let likely = |f: &&Found| f.shape != best.shape && f.ln_odds > best.ln_odds + LIKELY.ln();
    let others: Vec<&Found> = found.iter().filter(likely).collect();
    if others.is_empty() {
        return Vec::new();
    }
    let ranges = examination.problem().joint_ranges();
    let everywhere = [WorkspacePoses::inside(datasets, &ranges), WorkspacePoses::over_limits(datasets)];
    let everywhere: Vec<Elsewhere> =
        everywhere.into_iter().filter_map(|poses| Elsewhere::of(datasets, examination, data, poses.q)).collect();
    let rival = |other: &&Found| {
        let apart: Vec<Vec<Apart>> = everywhere.iter().filter_map(|there| there.apart(data, metrics, [best, other])).collect();
        // What differs nowhere is the same law, written otherwise.
        if apart.iter().all(Vec::is_empty) && !apart.is_empty() {
            return None;
        }
        let tells = |apart: &Vec<Apart>| apart.first().is_some_and(|first| first.sigmas >= TELLS);
        Some(Rival {
            place: data.places[other.shape.place].words.clone(),
            site: data.places[other.shape.place].site.clone(),
            bases: data.factors.expressions(&other.shape.factors),
            odds: (other.ln_odds - best.ln_odds).exp(),
            apart: apart.iter().find(|apart| tells(apart)).or(apart.last()).cloned().unwrap_or_default(),
        })
    };
    others.iter().filter_map(rival).take(NAMED).collect()
}

/// Postures over the workspace, as the search sees them.
struct Elsewhere {
    q: Vec<Vec<f64>>,
    /// The ranges that were measured.
    ranges: Vec<[f64; 2]>,
    /// Whitened columns of the places (places x residuals), and the length of one whitened unit, m, at every posture.
    columns: DMatrix<f64>,
    spans: Vec<Range<usize>>,
    lengths: Vec<f64>,
    /// The factors here, and for each whether its variable is known.
    factors: Factors,
    has: Vec<bool>,
    /// Columns of the fitted parameters (residuals x parameters), zero for those that no posture shows.
    fitted: DMatrix<f64>,
}

impl Elsewhere {
    fn of(datasets: &[NamedDataset<'_>], examination: &Examination, data: &Data, q: Vec<Vec<f64>>) -> Option<Self> {
        let first = datasets.first()?.dataset;
        let sample = |(k, q): (usize, &Vec<f64>)| {
            let at = world_from_tool(&first.robot, &first.base, &first.tool, q).translation.vector;
            Sample::new(format!("w{k}"), q.clone(), Measured::Point(at))
        };
        let samples: Vec<Sample> = q.iter().enumerate().map(sample).collect();
        let robot = Arc::clone(&first.robot);
        let planned = Dataset { robot, samples, ball_distances: Vec::new(), ..first.clone() };
        let there = Examination::of_plan(&planned, examination.model()).ok()?;
        let named = [NamedDataset::new("plan", &planned)];
        let columns = place_columns(&named, &there, &data.places).ok()?;
        let known = known(&named, &there).ok()?;
        let spans = spans(&there);
        let world = data.places.iter().position(|p| p.site == "base:x")?;
        let lengths = spans.iter().map(|rows| rows.clone().map(|r| columns[(world, r)].powi(2)).sum::<f64>().sqrt().recip());
        let whitened = there.whitened();
        let names = |e: &Examination| -> Vec<String> {
            e.fit().kept.iter().map(|&p| e.problem().parameters()[p].name.clone()).collect()
        };
        let seen = names(&there);
        let mut fitted = DMatrix::zeros(whitened.rows.ncols(), data.fitted.ncols());
        for (k, name) in names(examination).iter().enumerate() {
            if let Some(row) = seen.iter().position(|s| s == name) {
                fitted.column_mut(k).copy_from(&whitened.rows.row(row).transpose());
            }
        }
        let has = data.factors.all.iter().map(|f| known.iter().any(|k| k.variable == f.variable)).collect();
        Some(Elsewhere {
            lengths: lengths.collect(),
            ranges: examination.problem().joint_ranges(),
            q,
            columns,
            factors: data.factors.at(&known),
            has,
            spans,
            fitted,
        })
    }

    /// The postures at which two laws differ most; none if they are the same, `None` if one of them follows what no posture knows.
    fn apart(&self, data: &Data, metrics: &Metrics, pair: [&Found; 2]) -> Option<Vec<Apart>> {
        if pair.iter().any(|f| f.shape.factors.iter().any(|&k| !self.has[k])) {
            return None;
        }
        let field = Field { places: &data.places, columns: &self.columns, factors: &self.factors, spans: &self.spans };
        let error = |found: &Found| {
            let columns = data.field().columns_of(&found.shape);
            let coefficients = Fitted::of(metrics, &columns).coefficients;
            let absorbed = solved(&data.fitted, &(&columns * &coefficients));
            field.columns_of(&found.shape) * coefficients - &self.fitted * absorbed
        };
        let [one, other] = pair.map(error);
        let difference = &one - &other;
        if difference.norm() <= SAME * one.norm().max(other.norm()) {
            return Some(Vec::new());
        }
        let of = |(k, rows): (usize, &Range<usize>)| {
            let sigmas = difference.rows(rows.start, rows.len()).norm();
            let is_outside = self.q[k].iter().zip(&self.ranges).any(|(q, [low, high])| q < low || q > high);
            Apart { q: self.q[k].clone(), differ: sigmas * self.lengths[k], sigmas, is_outside }
        };
        let mut all: Vec<Apart> = self.spans.iter().enumerate().map(of).collect();
        all.sort_by(|a, b| b.differ.total_cmp(&a.differ));
        let mut chosen: Vec<Apart> = Vec::new();
        for one in all {
            let is_new = |c: &Apart| c.q.iter().zip(&one.q).any(|(a, b)| (a - b).abs() > DIFFERENT);
            if chosen.len() < POSTURES && chosen.iter().all(is_new) {
                chosen.push(one);
            }
        }
        Some(chosen)
    }
}

/// The parameters that absorb an error best, by the columns of the fit.
fn solved(columns: &DMatrix<f64>, error: &DVector<f64>) -> DVector<f64> {
    let scales = DVector::from_fn(columns.ncols(), |k, _| columns.column(k).norm().max(f64::MIN_POSITIVE).recip());
    let mut scaled = columns.clone();
    scaled.column_iter_mut().zip(&scales).for_each(|(mut c, s)| c *= *s);
    let normal = scaled.tr_mul(&scaled);
    normal
        .cholesky()
        .map_or_else(|| DVector::zeros(columns.ncols()), |factor| factor.solve(&scaled.tr_mul(error)).component_mul(&scales))
}
