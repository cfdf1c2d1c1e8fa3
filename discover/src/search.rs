//! The search among all laws of one, two and three factors at every place.

use rayon::prelude::*;

use crate::field::{Field, Found, Searched, WIDEST};
use crate::metric::Metrics;
use crate::scan::Scan;
use crate::variables::Variable;

/// Shares of the prior among laws of one, two and three factors.
const PRIORS: [f64; 3] = [0.5, 0.35, 0.15];

/// Square of the cosine between the columns of two places from which on they are one.
const SAME: f64 = 0.998;

/// Number of the best laws of two factors that are extended by a third.
const EXTENDED: usize = 60;

impl Field<'_> {
    /// Laws of one and two factors at a place.
    fn shapes(&self, place: usize) -> Vec<Vec<usize>> {
        let joint = self.places[place].joint;
        let all = &self.factors.all;
        let here = |k: &usize| all[*k].only_of.is_none_or(|j| Some(j) == joint);
        if self.is_another(place) {
            return Vec::new();
        }
        let single: Vec<usize> = (0..all.len()).filter(here).collect();
        // Of a joint's own angle any curve is an effect of the catalogue: its waves stand for it.
        let is_law = |k: &&usize| all[**k].is_wave() || joint.is_none_or(|j| all[**k].variable != Variable::Joint(j));
        let mut shapes: Vec<Vec<usize>> = single.iter().filter(is_law).map(|&k| vec![k]).collect();
        // Variable by variable: products of the same two have columns in common.
        let of_variables: Vec<&[usize]> = single.chunk_by(|&a, &b| all[a].variable == all[b].variable).collect();
        for (n, first) in of_variables.iter().enumerate() {
            for second in &of_variables[n + 1..] {
                let pairs = first.iter().flat_map(|&a| second.iter().map(move |&b| [a, b]));
                shapes.extend(pairs.filter(|&[a, b]| self.multiply(a, b)).map(|pair| pair.to_vec()));
            }
        }
        shapes
    }

    /// True if a place moves what is measured as one before it does, so that no data tell the two from each other.
    fn is_another(&self, place: usize) -> bool {
        let own = self.columns.row(place);
        (0..place).any(|k| {
            let other = self.columns.row(k);
            own.dot(&other).powi(2) > SAME * own.norm_squared() * other.norm_squared()
        })
    }

    fn multiply(&self, a: usize, b: usize) -> bool {
        let (a, b) = (&self.factors.all[a], &self.factors.all[b]);
        a.multiplies && b.multiplies && !a.variable.overlaps(b.variable)
    }

    /// Searches among all laws of one and two factors, and extends the best by a third if `thrice`.
    pub fn search(&self, metrics: &Metrics, thrice: bool) -> Searched {
        let shapes: Vec<Vec<Vec<usize>>> = (0..self.places.len()).map(|p| self.shapes(p)).collect();
        let count = |factors: usize| shapes.iter().flatten().filter(|s| s.len() == factors).count() as f64;
        let third = self.factors.all.iter().filter(|f| f.multiplies && f.only_of.is_none()).count().max(1) as f64;
        let counts = [count(1), count(2), count(2) * third / 3.0];
        let ln_priors = [0, 1, 2].map(|k| (PRIORS[k] / counts[k].max(1.0)).ln());
        let all = (0..self.places.len()).into_par_iter();
        let found = all.map(|p| Scan::new(self, metrics, p, ln_priors).over(&shapes[p])).collect::<Vec<_>>();
        let mut searched = merged(found);
        if thrice {
            let longer: Vec<Vec<Vec<usize>>> = (0..self.places.len()).map(|p| self.extended(&searched.best, p)).collect();
            let all = (0..self.places.len()).into_par_iter().filter(|&p| !longer[p].is_empty());
            let found = all.map(|p| Scan::new(self, metrics, p, ln_priors).over(&longer[p])).collect::<Vec<_>>();
            searched = merged(std::iter::once(searched).chain(found).collect());
        }
        searched
    }

    /// The best wave of a joint over its own angle, with its log odds among all such.
    pub fn best_wave(&self, metrics: &Metrics) -> Option<Found> {
        let of_joint = |p: usize| {
            let own = |k: &usize| {
                let factor = &self.factors.all[*k];
                factor.is_wave() && self.places[p].joint.is_some_and(|j| factor.variable == Variable::Joint(j))
            };
            (0..self.factors.all.len()).filter(own).map(|k| vec![k]).collect::<Vec<_>>()
        };
        let shapes: Vec<Vec<Vec<usize>>> = (0..self.places.len()).map(of_joint).collect();
        let ln_prior = -(shapes.iter().map(Vec::len).sum::<usize>().max(1) as f64).ln();
        let all = (0..self.places.len()).into_par_iter().filter(|&p| !shapes[p].is_empty());
        merged(all.map(|p| Scan::new(self, metrics, p, [ln_prior; 3]).over(&shapes[p])).collect()).best.into_iter().next()
    }

    /// The best laws of two factors at a place, each with every third.
    fn extended(&self, best: &[Found], place: usize) -> Vec<Vec<usize>> {
        let pairs = best.iter().take(EXTENDED).filter(|f| f.shape.place == place && f.shape.factors.len() == 2);
        let mut longer: Vec<Vec<usize>> = Vec::new();
        for pair in pairs.map(|f| &f.shape.factors) {
            for (c, factor) in self.factors.all.iter().enumerate() {
                let width: usize = pair.iter().map(|&k| self.factors.all[k].width()).product::<usize>() * factor.width();
                if factor.only_of.is_none() && width <= WIDEST && pair.iter().all(|&k| self.multiply(k, c)) {
                    let mut shape = [pair.as_slice(), &[c]].concat();
                    shape.sort_unstable();
                    if !longer.contains(&shape) {
                        longer.push(shape);
                    }
                }
            }
        }
        longer
    }
}

/// The best of several searches.
fn merged(found: Vec<Searched>) -> Searched {
    let mut all = Searched::default();
    for one in found {
        all.best.extend(one.best);
        all.tried += one.tried;
        if all.of_series.is_empty() {
            all.of_series = one.of_series;
        } else {
            all.of_series.iter_mut().zip(one.of_series).for_each(|(a, b)| *a = a.max(b));
        }
    }
    // A stable sort: of equal laws the one at the first place stays first.
    all.best.sort_by(|a, b| b.ln_odds.total_cmp(&a.ln_odds));
    all
}
