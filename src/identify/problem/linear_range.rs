//! How far corrections may go before the linear effects of a model no longer mean what they say.

use super::{Knowledge, Problem};
use crate::robot::{MdhEntry, Site};
use crate::units::Unit;

/// Largest turn of a link or a joint, rad: a tenth of it is left out by linear terms.
const MOST_TURN: f64 = 0.2;

/// Largest change of a link's length, as a share of the reach.
const MOST_OF_REACH: f64 = 0.2;

/// Largest size of an effect that a plausible size holds, in such sizes.
const MOST_SIZES: f64 = 50.0;

impl Problem {
    /// The first parameter whose deviation (SI) is beyond what its effect can mean; `None` when all are within.
    pub fn left_linear_range(&self, values: &[f64]) -> Option<usize> {
        let reach: f64 = self.robot.links.iter().map(|l| l.mdh.a.hypot(l.mdh.d)).sum();
        let beyond = |(p, value): (usize, f64)| {
            let parameter = &self.parameters[p];
            let held = matches!(parameter.knowledge, Knowledge::Plausible(_)) && value > MOST_SIZES * parameter.spec.prior;
            let of_link = parameter.effect == "mdh"
                && value > if parameter.spec.unit == Unit::MM { MOST_OF_REACH * reach } else { MOST_TURN };
            held || of_link
        };
        let sizes = values.iter().map(|v| v.abs()).enumerate();
        sizes.clone().find(|&size| beyond(size)).map(|(p, _)| p).or_else(|| self.turns_too_far(values))
    }

    /// The first parameter that turns a joint too far at some sample.
    fn turns_too_far(&self, values: &[f64]) -> Option<usize> {
        let state = self.load_state(values);
        state.rows.iter().find_map(|terms| {
            let moving = state.patterns[terms.pattern].iter().zip(&terms.weights);
            let too_far = |&(moves, weight): &(&super::moves::Moves, &f64)| {
                matches!(moves.site, Site::Mdh(_, MdhEntry::Theta)) && (weight * values[moves.parameter]).abs() > MOST_TURN
            };
            { moving }.find(too_far).map(|(moves, _)| moves.parameter)
        })
    }
}
