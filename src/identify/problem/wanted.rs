//! The effects of a problem: those of the model, and those that a dataset requires.

use super::cell::takes_orientations;
use super::{Prior, Use};
use crate::effects::{EffectId, ParameterSpec};
use crate::identify::Model;
use crate::measure::dataset::{Ball, Dataset, Measured, Sample, ToolTarget};

/// Prior on the size of an effect.
#[derive(Debug, Clone, Copy)]
pub(super) enum StatedPrior {
    Flat,
    /// 1 sigma of each of its parameters, SI.
    Stated(f64),
    /// 1 sigma in plausible sizes; may be infinite.
    Width(f64),
    /// A certificate, combined with an allowance for changes since: 1 sigma each, the second in plausible sizes.
    StatedAndWidth(f64, f64),
}

impl StatedPrior {
    pub fn of(self, spec: &ParameterSpec) -> Prior {
        match self {
            StatedPrior::Flat => Prior::Uninformative,
            StatedPrior::Stated(sigma) => Prior::Certified(sigma),
            StatedPrior::Width(width) if width.is_finite() => Prior::Plausible(width * spec.prior),
            StatedPrior::StatedAndWidth(sigma, width) if width.is_finite() => Prior::Plausible(sigma.hypot(width * spec.prior)),
            StatedPrior::Width(_) | StatedPrior::StatedAndWidth(..) => Prior::Uninformative,
        }
    }
}

/// Effects of the model, and those required by a dataset (free or uncertain balls and tools), in the order of their columns.
pub(super) fn wanted(dataset: &Dataset, model: &Model, which: Use) -> Vec<(EffectId, StatedPrior)> {
    let mut wanted: Vec<(EffectId, StatedPrior)> = Vec::new();
    let probed = |b: usize| {
        let on = |s: &&Sample| matches!(s.measured, Measured::Ball { ball, .. } if ball == b);
        dataset.samples.iter().filter(|s| which.takes(s)).any(|s| on(&s))
    };
    // Free balls first: if no ball is known, it is the base that cannot be determined. A free tool before the
    // links: it enters linearly, and the last joint and link share parameters with the tool as the first ones do
    // with the base.
    for (b, ball) in dataset.balls.iter().enumerate() {
        if ball.free && probed(b) {
            wanted.push((EffectId::of_ball(&ball.id), StatedPrior::Flat));
        }
    }
    let reflected = |r: usize| dataset.samples.iter().any(|s| which.takes(s) && s.tool_target == Some(r));
    wanted.extend(model.in_order().into_iter().map(|e| {
        let width = model.width_of(e);
        let belief = stated(dataset, e).map_or(StatedPrior::Width(width), |s| StatedPrior::StatedAndWidth(s, width));
        (e.clone(), belief)
    }));
    if dataset.tool_free {
        wanted.retain(|(id, _)| id != EffectId::TOOL_FRAME);
        let base = wanted.iter().position(|(id, _)| id == EffectId::BASE_FRAME);
        let balls = wanted.iter().take_while(|(id, _)| id.ball_name().is_some()).count();
        wanted.insert(base.map_or(balls, |b| b + 1), (EffectId::TOOL_FRAME.into(), StatedPrior::Flat));
    } else if dataset.tool_sigma > 0.0 {
        wanted.push((EffectId::TOOL_FRAME.into(), StatedPrior::Stated(dataset.tool_sigma)));
    }
    let measures_orientation =
        takes_orientations(dataset, model) && dataset.samples.iter().any(|s| which.takes(s) && s.orientation.is_some());
    if measures_orientation && dataset.tool_free {
        wanted.retain(|(id, _)| id != EffectId::PROBE_ROTATION);
        let tool = wanted.iter().position(|(id, _)| id == EffectId::TOOL_FRAME);
        wanted.insert(tool.map_or(wanted.len(), |t| t + 1), (EffectId::PROBE_ROTATION.into(), StatedPrior::Flat));
    } else if measures_orientation && dataset.probe_sigma > 0.0 {
        wanted.push((EffectId::PROBE_ROTATION.into(), StatedPrior::Stated(dataset.probe_sigma)));
    }
    // Last of what the model leaves open: a target shares its place with a free tool if the TCP itself is not measured.
    let tool_targets = dataset.tool_targets.iter().enumerate().filter(|(r, _)| reflected(*r));
    for (id, tool_target) in tool_targets.rev().map(|(_, r)| (EffectId::of_target(&r.id), r)) {
        if tool_target.free {
            let tool = wanted.iter().position(|(id, _)| id == EffectId::TOOL_FRAME);
            wanted.retain(|(other, _)| *other != id);
            wanted.insert(tool.map_or(wanted.len(), |t| t + 1), (id, StatedPrior::Flat));
        } else if tool_target.sigma > 0.0 {
            wanted.push((id, StatedPrior::Stated(tool_target.sigma)));
        }
    }
    for (b, ball) in dataset.balls.iter().enumerate() {
        if !ball.free && ball.sigma > 0.0 && probed(b) {
            wanted.push((EffectId::of_ball(&ball.id), StatedPrior::Stated(ball.sigma)));
        }
    }
    wanted
}

/// 1 sigma, SI, that the dataset states for the TCP, ball or target moved by an effect of the model.
fn stated(dataset: &Dataset, effect: &EffectId) -> Option<f64> {
    let ball = |b: &&Ball| effect.ball_name() == Some(b.id.as_str()) && !b.free;
    let tool_target = |r: &&ToolTarget| *effect == EffectId::of_target(&r.id) && !r.free;
    let sigma = match effect.whole() {
        EffectId::TOOL_FRAME => (!dataset.tool_free).then_some(dataset.tool_sigma),
        EffectId::PROBE_ROTATION => (!dataset.tool_free).then_some(dataset.probe_sigma),
        _ => {
            let of_ball = dataset.balls.iter().find(ball).map(|b| b.sigma);
            of_ball.or_else(|| dataset.tool_targets.iter().find(tool_target).map(|r| r.sigma))
        }
    };
    sigma.filter(|s| *s > 0.0)
}
