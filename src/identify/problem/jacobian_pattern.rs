//! The parameters that move a sample's TCP, and the sites at which they act: shared by most samples of a problem, which
//! then store only their weights.

use crate::robot::sites::{Site, SiteIndex};

/// One site moved by a parameter, and its index in the vector of deviations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct JacobianPattern {
    pub parameter: usize,
    pub site: Site,
    pub place: usize,
    /// True if the weight is the same at every sample of a set-up.
    pub constant: bool,
}

/// The moves found for a sample's TCP, compared with the expected pattern.
pub(super) struct TermCollector<'a> {
    pub sites: SiteIndex,
    pub pattern: &'a [JacobianPattern],
    pub weights: Vec<f64>,
    /// The actual moves, once they differ from the pattern.
    pub other: Option<Vec<JacobianPattern>>,
}

impl TermCollector<'_> {
    #[inline]
    fn is_expected(&self, parameter: usize, site: Site, constant: bool) -> bool {
        let same = |moves: &JacobianPattern| moves.parameter == parameter && moves.site == site && moves.constant == constant;
        self.other.is_none() && self.pattern.get(self.weights.len()).is_some_and(same)
    }

    #[inline]
    pub fn add(&mut self, parameter: usize, site: Site, weight: f64, constant: bool) {
        if !self.is_expected(parameter, site, constant) {
            let so_far = || self.pattern[..self.weights.len()].to_vec();
            self.other.get_or_insert_with(so_far).push(JacobianPattern {
                parameter,
                site,
                place: self.sites.of(site),
                constant,
            });
        }
        self.weights.push(weight);
    }

    /// Adds the terms of an effect that are the same in every situation: a pattern that begins with them continues with
    /// them.
    #[inline]
    pub fn add_constant(&mut self, first: usize, terms: &[(usize, Site, f64)]) {
        match terms.first() {
            Some(&(k, site, _)) if self.is_expected(first + k, site, true) => {
                self.weights.extend(terms.iter().map(|(_, _, weight)| weight));
            }
            _ => terms.iter().for_each(|&(k, site, weight)| self.add(first + k, site, weight, true)),
        }
    }
}
