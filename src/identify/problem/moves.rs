//! Which parameters move a sample's TCP, and where: most samples of a problem share that, and so keep their weights alone.

use crate::robot::{Site, SiteIndex};

/// What a parameter moves: a site, and its place in the vector of deviations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Moves {
    pub parameter: usize,
    pub site: Site,
    pub place: usize,
    /// Whether by as much at every sample of a set-up.
    pub constant: bool,
}

/// What is found to move a sample's TCP, beside what is expected to.
pub(super) struct Found<'a> {
    pub sites: SiteIndex,
    pub pattern: &'a [Moves],
    pub weights: Vec<f64>,
    /// What moves it, once that is other than the pattern.
    pub other: Option<Vec<Moves>>,
}

impl Found<'_> {
    #[inline]
    fn is_expected(&self, parameter: usize, site: Site, constant: bool) -> bool {
        let same = |moves: &Moves| moves.parameter == parameter && moves.site == site && moves.constant == constant;
        self.other.is_none() && self.pattern.get(self.weights.len()).is_some_and(same)
    }

    #[inline]
    pub fn add(&mut self, parameter: usize, site: Site, weight: f64, constant: bool) {
        if !self.is_expected(parameter, site, constant) {
            let so_far = || self.pattern[..self.weights.len()].to_vec();
            self.other.get_or_insert_with(so_far).push(Moves { parameter, site, place: self.sites.of(site), constant });
        }
        self.weights.push(weight);
    }

    /// Adds the terms of an effect that has the same in every situation: a pattern that begins with them goes on with them.
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
