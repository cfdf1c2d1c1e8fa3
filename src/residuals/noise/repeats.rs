//! Components of the scatter of repeats: white noise, motion of the base or the tool, joints that do not return to the
//! same angle.
//!
//! Variance components of the deviations from each posture's mean, by restricted maximum likelihood (Patterson &
//! Thompson 1971): `V = white I + sum_a base_a e_a e_a^T + sum_a tool_a t_a t_a^T + sum_j joint_j J_j J_j^T`, maximised
//! by the monotone updates of Zhou, Hu, Qiao & Cho 2019. A joint is named if omitting it lowers twice the
//! log-likelihood by more than [`REPEATS_ALARM`]. By chance, this has a probability of 3e-4 (half a chi-square of one
//! degree of freedom), or 2e-3 for six joints together.

use std::collections::BTreeMap;

use nalgebra::allocator::Allocator;
use nalgebra::{Const, DMatrix, DVector, DefaultAllocator, Dim, Dyn, OMatrix, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::math::positive_definite::cholesky;
use crate::measure::dataset::Measured;
use crate::measure::poses::Postures;
use crate::residuals::views::SeenSample;

/// A joint is said to scatter if omitting it lowers twice the log-likelihood by more than this.
pub(crate) const REPEATS_ALARM: f64 = 12.0;

/// Fewest degrees of freedom (events minus postures) for a decomposition.
const FEWEST: usize = 20;
/// Largest number of postures used in a decomposition.
const MOST_POSTURES: usize = 400;

/// Lower limit of the white noise, as a share of the scatter's variance.
const FLOOR: f64 = 1e-9;
/// Share of all events that count as the rarest.
const RAREST: f64 = 0.05;

/// Largest number of iterations.
const ROUNDS: usize = 400;
/// Change of any component, as a share of the scatter, at which the iterations stop.
const SETTLED: f64 = 1e-5;

/// Contribution of a joint to the scatter of repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointScatter {
    /// The joint, counted from 0.
    pub joint: usize,
    /// One-sigma of its angle between repeats, rad.
    pub sigma: f64,
    /// Reduction of twice the log-likelihood if it is omitted.
    pub lost: f64,
}

/// Components of the scatter of repeats, one-sigma each.
#[derive(Debug, Clone, PartialEq)]
pub struct RepeatScatter {
    /// Number of postures measured more than once.
    pub postures: usize,
    /// Number of times the arm was in one of them.
    pub events: usize,
    /// Total 3-D deviation from the posture's mean, root mean square, m.
    pub rms: f64,
    /// White noise per axis, m.
    pub white: f64,
    /// Motion of all targets together, world axes, m.
    pub base: [f64; 3],
    /// Motion of all targets together, tool axes, m.
    pub tool: [f64; 3],
    /// Contribution of each joint.
    pub joints: Vec<JointScatter>,
    /// Factor by which the rarest of these deviations exceed those of a normal distribution with these components; at least 1.
    pub tails: f64,
}

impl RepeatScatter {
    /// Joints that do not return to the same angle, the most significant first.
    pub fn alarms(&self) -> Vec<JointScatter> {
        let mut alarms: Vec<JointScatter> = self.joints.iter().copied().filter(|j| j.lost > REPEATS_ALARM).collect();
        alarms.sort_by(|a, b| b.lost.total_cmp(&a.lost));
        alarms
    }

    /// One-sigma of each of the [`patterns`].
    pub(crate) fn of_patterns(&self) -> Vec<f64> {
        self.base.iter().chain(&self.tool).copied().chain(self.joints.iter().map(|j| j.sigma)).collect()
    }

    /// Decomposes the scatter of samples; `None` with too few repeats, or if a residual is not finite. Samples of one posture, dataset and time
    /// (`time_s`) belong to one event: the error of the arm was the same for all targets.
    pub(crate) fn of(seen: &[SeenSample<'_>]) -> Option<Self> {
        let groups = groups(seen);
        let dof: usize = groups.iter().map(|g| g.events - 1).sum();
        if dof < FEWEST {
            return None;
        }
        let joints = groups[0].patterns.len() - 6;
        let kinds = 7 + joints;
        let all = vec![true; kinds];
        let (start, numbers) = groups
            .iter()
            .fold((0.0, 0.0), |(s, n), g| (s + g.scatter.trace(), n + (g.scatter.nrows() * (g.events - 1)) as f64));
        let white = start / numbers;
        if white <= 0.0 {
            return None;
        }
        let (components, whole) = maximise(&groups, &all, white)?;
        let scatter_of = |j: usize| {
            let mut without = all.clone();
            without[7 + j] = false;
            let (_, ln) = maximise(&groups, &without, white)?;
            Some(JointScatter { joint: j, sigma: components[7 + j].sqrt(), lost: (2.0 * (whole - ln)).max(0.0) })
        };
        let three = |first: usize| [0, 1, 2].map(|k| components[first + k].sqrt());
        let samples: usize = groups.iter().map(|g| (g.events - 1) * g.scatter.nrows() / 3).sum();
        Some(RepeatScatter {
            postures: groups.len(),
            events: groups.iter().map(|g| g.events).sum(),
            rms: (start / samples.max(1) as f64).sqrt(),
            white: components[0].sqrt(),
            base: three(1),
            tool: three(4),
            joints: (0..joints).map(scatter_of).collect::<Option<_>>()?,
            tails: tails(&groups, &components, FLOOR * white)?,
        })
    }
}

/// A posture measured more than once.
struct Group {
    events: usize,
    /// Sum of the outer products of the events' deviations from their mean.
    scatter: DMatrix<f64>,
    /// These deviations.
    deviations: Vec<DVector<f64>>,
    /// Displacement of all components of an event per unit of base, tool (three axes each) and joint motion.
    patterns: Vec<DVector<f64>>,
}

impl Group {
    /// Covariance of one event, with at least this white noise; `n` is the number of its components.
    fn covariance<D: Dim>(&self, n: D, components: &[f64], least: f64) -> OMatrix<f64, D, D>
    where
        DefaultAllocator: Allocator<D, D>,
    {
        let mut v = OMatrix::identity_generic(n, n) * components[0].max(least);
        for (pattern, c) in self.patterns.iter().zip(&components[1..]).filter(|(_, c)| **c > 0.0) {
            let pattern = pattern.generic_view((0, 0), (n, Const::<1>));
            v.ger(*c, &pattern, &pattern, 1.0);
        }
        v
    }
}

/// By how much the largest deviations exceed what is expected of the largest of as many.
fn tails(groups: &[Group], components: &[f64], least: f64) -> Option<f64> {
    let mut chances = Vec::new();
    for g in groups {
        let factor = cholesky(g.covariance(Dyn(g.scatter.nrows()), components, least)).ok()?;
        let share = (g.events - 1) as f64 / g.events as f64;
        let law = ChiSquared::new(g.scatter.nrows() as f64).ok()?;
        for off in &g.deviations {
            let squares = factor.l_dirty().lower_triangle().solve_lower_triangular(off)?.norm_squared() / share;
            chances.push((squares, law));
        }
    }
    chances.sort_by(|a, b| b.0.total_cmp(&a.0));
    let whole = chances.len() as f64;
    let top = (RAREST * whole).ceil() as usize;
    let excess =
        |(k, (squares, law)): (usize, &(f64, ChiSquared))| squares / law.inverse_cdf(1.0 - (k as f64 + 1.0) / (whole + 1.0));
    Some(chances.iter().take(top).enumerate().map(excess).fold(1.0, f64::max).sqrt())
}

fn groups(seen: &[SeenSample<'_>]) -> Vec<Group> {
    let joints: Vec<&[f64]> = seen.iter().map(|s| s.sample.q.as_slice()).collect();
    let datasets: Vec<usize> = seen.iter().map(|s| s.dataset).collect();
    let postures = Postures::of_joints(&joints, &datasets);
    // Events of each posture: samples measured at the same time.
    let mut events: BTreeMap<(usize, (bool, u64)), Vec<usize>> = BTreeMap::new();
    for ((i, s), (&posture, moment)) in seen.iter().enumerate().zip(postures.of_samples().iter().zip(moments(seen))) {
        if s.height == 3 {
            events.entry((posture, moment)).or_default().push(i);
        }
    }
    let target = |i: usize| {
        let s = &seen[i];
        let aimed = match s.sample.measured {
            Measured::Ball { ball, .. } => (0, ball),
            Measured::Point(_) => (1, 0),
            Measured::Distance { anchor, .. } => (2, anchor),
        };
        (s.setup, aimed, s.sample.tool_target, s.sample.payload)
    };
    let mut of_posture: BTreeMap<(usize, Vec<_>), Vec<Vec<usize>>> = BTreeMap::new();
    for ((posture, _), mut members) in events {
        members.sort_by_key(|&i| (target(i), i));
        let targets: Vec<_> = members.iter().map(|&i| target(i)).collect();
        of_posture.entry((posture, targets)).or_default().push(members);
    }
    of_posture.into_values().filter(|e| e.len() > 1).take(MOST_POSTURES).map(|events| group(seen, &events)).collect()
}

/// The moment of each sample: its time, or a number of its own. Samples in a row that show different targets with the same
/// joint angles, and have no times, share one.
pub(crate) fn moments(seen: &[SeenSample<'_>]) -> Vec<(bool, u64)> {
    let (mut begun, mut tool_targets) = (0, Vec::new());
    let moment = |(i, s): (usize, &SeenSample<'_>)| {
        if let Some(time) = s.sample.time_s {
            return (true, time.to_bits());
        }
        let as_before = i
            .checked_sub(1)
            .map(|before| &seen[before])
            .is_some_and(|before| before.setup == s.setup && before.sample.time_s.is_none() && before.sample.q == s.sample.q);
        if !as_before || tool_targets.contains(&s.sample.tool_target) {
            begun = i;
            tool_targets.clear();
        }
        tool_targets.push(s.sample.tool_target);
        (false, begun as u64)
    };
    seen.iter().enumerate().map(moment).collect()
}

fn group(seen: &[SeenSample<'_>], events: &[Vec<usize>]) -> Group {
    let stack = |members: &[usize], of: &dyn Fn(&SeenSample<'_>) -> Vector3<f64>| {
        DVector::from_iterator(3 * members.len(), members.iter().flat_map(|&i| <[f64; 3]>::from(of(&seen[i]))))
    };
    let deviations: Vec<DVector<f64>> = events.iter().map(|members| stack(members, &|s| s.residual)).collect();
    let mean = deviations.iter().fold(DVector::zeros(deviations[0].len()), |sum, d| sum + d) / events.len() as f64;
    let mut scatter = DMatrix::zeros(mean.len(), mean.len());
    let deviations: Vec<DVector<f64>> = deviations.into_iter().map(|deviation| deviation - &mean).collect();
    for off in &deviations {
        scatter.ger(1.0, off, off, 1.0);
    }
    let first = &events[0];
    let of_members: Vec<Vec<Vector3<f64>>> = first.iter().map(|&i| patterns(&seen[i])).collect();
    let pattern = |p: usize| DVector::from_iterator(3 * first.len(), of_members.iter().flat_map(|of| <[f64; 3]>::from(of[p])));
    let patterns = (0..of_members[0].len()).map(pattern).collect();
    Group { events: events.len(), scatter, deviations, patterns }
}

/// Displacement of a sample per unit of what displaces all targets of a posture together: base and tool along each axis, joints.
pub(crate) fn patterns(seen: &SeenSample<'_>) -> Vec<Vector3<f64>> {
    let base = (0..3).map(|k| Vector3::ith(k, 1.0));
    let tool = (0..3).map(|k| seen.world_from_tool.matrix().column(k).into());
    base.chain(tool).chain(seen.joint_columns.iter().copied()).collect()
}

/// The logarithm of the likelihood, and the two sums of which the update of each component is the root of the ratio.
struct Sums {
    ln: f64,
    above: Vec<f64>,
    below: Vec<f64>,
}

impl Sums {
    /// Adds a group, the events of which have `n` components; `None` if its covariance is not positive definite.
    fn add<D: Dim>(&mut self, g: &Group, n: D, components: &[f64], least: f64) -> Option<()>
    where
        DefaultAllocator: Allocator<D, D> + Allocator<D>,
    {
        let times = (g.events - 1) as f64;
        let scatter = g.scatter.generic_view((0, 0), (n, n));
        let factor = cholesky(g.covariance(n, components, least)).ok()?;
        let inverse = factor.inverse();
        let weighted = &inverse * scatter * &inverse;
        let ln_det: f64 = (0..n.value()).map(|k| 2.0 * factor.l_dirty()[(k, k)].ln()).sum();
        self.ln -= 0.5 * (times * ln_det + inverse.component_mul(&scatter).sum());
        self.above[0] += weighted.trace();
        self.below[0] += times * inverse.trace();
        for (p, pattern) in g.patterns.iter().enumerate().filter(|(p, _)| components[p + 1] > 0.0) {
            let pattern = pattern.generic_view((0, 0), (n, Const::<1>));
            self.above[p + 1] += (&weighted * pattern).dot(&pattern);
            self.below[p + 1] += times * (&inverse * pattern).dot(&pattern);
        }
        Some(())
    }
}

/// Finds the components (white, base, tool, joints; variances) of the largest restricted likelihood, and its logarithm.
/// Components that `with` does not select are zero.
fn maximise(groups: &[Group], with: &[bool], white: f64) -> Option<(Vec<f64>, f64)> {
    // Every component starts at the value that alone would cause a third of the scatter.
    let mut components: Vec<f64> = vec![white / 3.0];
    for p in 0..groups[0].patterns.len() {
        let lever: f64 = groups.iter().map(|g| g.patterns[p].norm_squared()).sum::<f64>();
        let numbers: f64 = groups.iter().map(|g| g.scatter.nrows() as f64).sum();
        components.push(if with[p + 1] && lever > 1e-12 * numbers.max(1.0) { white / 3.0 * numbers / lever } else { 0.0 });
    }
    let floor = FLOOR * white;
    let mut ln = f64::NEG_INFINITY;
    for _ in 0..ROUNDS {
        let mut sums = Sums { ln: 0.0, above: vec![0.0; components.len()], below: vec![0.0; components.len()] };
        for g in groups {
            // Most events are of one target.
            match g.scatter.nrows() {
                3 => sums.add(g, Const::<3>, &components, floor)?,
                n => sums.add(g, Dyn(n), &components, floor)?,
            }
        }
        let Sums { above, below, .. } = &sums;
        ln = sums.ln;
        let mut change = 0.0_f64;
        for k in 0..components.len() {
            if components[k] > 0.0 && below[k] > 0.0 {
                let next = components[k] * (above[k] / below[k]).max(0.0).sqrt();
                // A component that tends to zero converges very slowly, so its share of the scatter decides.
                change = change.max((next - components[k]).abs() * below[k]);
                components[k] = next;
            }
        }
        let numbers: f64 = groups.iter().map(|g| (g.scatter.nrows() * (g.events - 1)) as f64).sum();
        if change < SETTLED * numbers {
            break;
        }
    }
    Some((components, ln))
}
