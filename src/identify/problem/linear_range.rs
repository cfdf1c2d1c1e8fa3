//! Limits of corrections beyond which the linear effects of a model are no longer valid.

use super::{LoadState, Prior, Problem};
use crate::effects::EffectId;
use crate::robot::sites::{MdhEntry, Site};
use crate::units::Unit;

/// Largest rotation of a link or a joint, rad: linear terms neglect a tenth of it (docs/models.md).
const MOST_TURN: f64 = 0.2;

/// Largest change of a link's length, as a share of the reach (docs/models.md).
const MOST_OF_REACH: f64 = 0.2;

/// Largest size of an effect with a prior, in plausible sizes (docs/models.md).
const MOST_SIZES: f64 = 50.0;

impl Problem {
    /// The first parameter whose deviation (SI) is beyond the validity of its effect; `None` if all are within.
    pub fn left_linear_range(&self, values: &[f64]) -> Option<usize> {
        self.left_linear_range_under(values, &self.load_state(values))
    }

    /// The same under the loads `state` at these values.
    pub(in crate::identify) fn left_linear_range_under(&self, values: &[f64], state: &LoadState) -> Option<usize> {
        let reach: f64 = self.robot.links.iter().map(|l| l.mdh.a.hypot(l.mdh.d)).sum();
        let beyond = |(p, value): (usize, f64)| {
            let parameter = &self.parameters[p];
            let is_beyond = |sigma: f64| value > MOST_SIZES * sigma.max(parameter.spec.prior);
            let held = matches!(parameter.knowledge, Prior::Plausible(sigma) if is_beyond(sigma));
            let of_link = parameter.effect == EffectId::MDH
                && value > if parameter.spec.unit == Unit::MM { MOST_OF_REACH * reach } else { MOST_TURN };
            held || of_link
        };
        let sizes = values.iter().map(|v| v.abs()).enumerate();
        sizes.clone().find(|&size| beyond(size)).map(|(p, _)| p).or_else(|| self.turns_too_far(values, state))
    }

    /// The first parameter that rotates a joint too far at some sample.
    fn turns_too_far(&self, values: &[f64], state: &LoadState) -> Option<usize> {
        state.rows.iter().find_map(|terms| {
            let moving = state.patterns[terms.pattern].iter().zip(&terms.weights);
            let too_far = |&(moves, weight): &(&super::jacobian_pattern::JacobianPattern, &f64)| {
                matches!(moves.site, Site::Mdh(_, MdhEntry::Theta)) && (weight * values[moves.parameter]).abs() > MOST_TURN
            };
            { moving }.find(too_far).map(|(moves, _)| moves.parameter)
        })
    }
}
