//! Layout of the displacement patterns of which the views consist.

use nalgebra::Vector3;

use super::standout::Subject;
use crate::effects::EffectId;
use crate::measure::dataset::NamedDataset;
use crate::residuals::views::{Bins, JointVariable, MOST_WORST, Patterns, SeenSample};
use crate::robot::JointKind;

/// A joint that moves the TCP by no more than this at every sample, m/rad, has no apparent error.
const NO_LEVER: f64 = 1e-6;

/// Patterns of a set-up: six motions of its base, three translations of its tool.
const PER_SETUP: usize = 9;

/// If a moment varies by less than this share of the largest variation, it shows the tilt of the base rather than a
/// load.
const NO_LOAD: f64 = 0.01;

pub(super) struct Curve {
    /// Joint, counted from 0.
    pub joint: usize,
    pub against: JointVariable,
    pub bins: Bins,
    /// First of its step patterns, one per bin; the slopes within the bins follow.
    first: usize,
}

impl Curve {
    fn steps(&self) -> usize {
        self.bins.counts.len()
    }
}

/// A ball that was probed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BallOf {
    /// Index of its dataset.
    pub dataset: usize,
    /// Its index there.
    pub ball: usize,
}

/// Numbering of the patterns: every set-up, all set-ups combined, the means of the joints, balls, curves, worst
/// samples.
pub(super) struct Layout {
    pub setups: usize,
    /// Joints (from 0) with a lever arm.
    pub joints: Vec<usize>,
    /// Every ball probed.
    pub balls: Vec<BallOf>,
    /// Indices in `balls` of those whose positions were fitted to these samples: their residuals show no displacement.
    placed: Vec<usize>,
    pub curves: Vec<Curve>,
    /// Indices of the samples with the worst fit, worst first.
    pub worst: Vec<usize>,
}

impl Layout {
    pub fn new(seen: &[SeenSample<'_>], setups: usize, datasets: &[NamedDataset<'_>], normalised: &[(f64, usize)]) -> Self {
        let count = seen.first().map_or(0, |s| s.joint_columns.len());
        let turns = |j: &usize| datasets.first().is_none_or(|d| d.dataset.robot.kind(*j) == JointKind::Revolute);
        let lever = |j: &usize| seen.iter().any(|s| (s.whitener * s.joint_columns[*j]).norm() * s.variance.sqrt() > NO_LEVER);
        let joints: Vec<usize> = (0..count).filter(turns).filter(lever).collect();
        let mut probed: Vec<Vec<bool>> = datasets.iter().map(|d| vec![false; d.dataset.balls.len()]).collect();
        for s in seen {
            if let Some(flag) = s.ball().and_then(|b| probed[s.dataset].get_mut(b)) {
                *flag = true;
            }
        }
        let of_dataset = |(dataset, flags): (usize, &Vec<bool>)| {
            let probed = (0..flags.len()).filter(|&ball| flags[ball]);
            probed.map(|ball| BallOf { dataset, ball }).collect::<Vec<_>>()
        };
        let balls: Vec<BallOf> = probed.iter().enumerate().flat_map(of_dataset).collect();
        let mut order: Vec<usize> = (0..seen.len()).collect();
        order.sort_by(|&a, &b| {
            (normalised[b].0 / normalised[b].1.max(1) as f64).total_cmp(&(normalised[a].0 / normalised[a].1.max(1) as f64))
        });
        order.truncate(MOST_WORST);
        let mut layout = Layout { setups, joints, balls, placed: Vec::new(), curves: Vec::new(), worst: order };
        let mut first = layout.first_ball() + 3 * layout.balls.len();
        let spread = |v: JointVariable| {
            let ends = |e: [f64; 2], x: f64| [e[0].min(x), e[1].max(x)];
            let [low, high] = seen.iter().filter_map(|s| v.of(s)).fold([f64::INFINITY, f64::NEG_INFINITY], ends);
            high - low
        };
        let largest = (1..=count).filter(|j| turns(&(j - 1))).map(|j| spread(JointVariable::Torque(j))).fold(0.0, f64::max);
        let mut shared: Vec<(JointVariable, Option<Bins>)> = Vec::new();
        for &j in &layout.joints {
            for against in JointVariable::of_joint(j + 1) {
                // Payload, time and temperature are the same for all joints.
                let known = shared.iter().find(|(v, _)| *v == against).map(|(_, bins)| bins.clone());
                let bins = known.unwrap_or_else(|| {
                    let bins = Bins::new(seen.iter().map(|s| against.of(s)));
                    shared.push((against, bins.clone()));
                    bins
                });
                let loaded = !matches!(against, JointVariable::Torque(_)) || spread(against) > NO_LOAD * largest;
                if let Some(bins) = bins.filter(|_| loaded) {
                    let curve = Curve { joint: j, against, bins, first };
                    first += 2 * curve.steps();
                    layout.curves.push(curve);
                }
            }
        }
        layout
    }

    /// Excludes from the candidates the balls whose position parameters are among `refitted`.
    pub fn acquit(&mut self, refitted: &[String], datasets: &[NamedDataset<'_>]) {
        let is_placed = |&b: &usize| {
            let BallOf { dataset, ball } = self.balls[b];
            let of_ball = format!("{}.", EffectId::of_ball(&datasets[dataset].dataset.balls[ball].id));
            refitted.iter().any(|name| name.starts_with(&of_ball))
        };
        self.placed = (0..self.balls.len()).filter(is_placed).collect();
    }

    /// Six motions of a set-up's base; the index after the last set-up stands for all combined.
    pub fn base(&self, setup: usize) -> Vec<usize> {
        (PER_SETUP * setup..PER_SETUP * setup + 6).collect()
    }

    /// Three translations of a set-up's tool.
    pub fn tool(&self, setup: usize) -> Vec<usize> {
        (PER_SETUP * setup + 6..PER_SETUP * (setup + 1)).collect()
    }

    /// Mean of the joint with this index in [`Layout::joints`].
    pub fn level(&self, k: usize) -> usize {
        PER_SETUP * (self.setups + 1) + k
    }

    fn first_ball(&self) -> usize {
        self.level(self.joints.len())
    }

    /// Three displacements of a ball.
    pub fn ball(&self, b: usize) -> Vec<usize> {
        (self.first_ball() + 3 * b..self.first_ball() + 3 * (b + 1)).collect()
    }

    /// Mean of a joint, counted from 0.
    pub fn level_of(&self, joint: usize) -> usize {
        self.level(self.joints.iter().position(|&j| j == joint).unwrap_or(0))
    }

    /// Step patterns of a curve.
    pub fn curve(&self, c: usize) -> Vec<usize> {
        let curve = &self.curves[c];
        (curve.first..curve.first + curve.steps()).collect()
    }

    /// Patterns that the model receives once a subject is found; for a curve the slopes too, as otherwise its steps
    /// would be found next.
    pub fn given(&self, subject: Subject, patterns: &[usize]) -> Vec<usize> {
        match subject {
            Subject::Curve(c) => (self.curves[c].first..self.curves[c].first + 2 * self.curves[c].steps()).collect(),
            _ => patterns.to_vec(),
        }
    }

    /// The dataset of a ball, and its index there.
    pub fn ball_at(&self, b: usize) -> BallOf {
        self.balls[b]
    }

    /// Joint (from 1) and variable of a curve.
    pub fn curve_of(&self, c: usize) -> (usize, JointVariable) {
        (self.curves[c].joint + 1, self.curves[c].against)
    }

    /// Three displacements of one of the worst samples.
    pub fn worst(&self, w: usize) -> Vec<usize> {
        (self.first_worst() + 3 * w..self.first_worst() + 3 * (w + 1)).collect()
    }

    fn first_worst(&self) -> usize {
        self.curves.last().map_or(self.first_ball() + 3 * self.balls.len(), |c| c.first + 2 * c.steps())
    }

    /// Number of patterns.
    pub fn patterns(&self) -> usize {
        self.first_worst() + 3 * self.worst.len()
    }

    /// Adds the patterns of the sample with index `place`.
    pub fn show(&self, s: &SeenSample<'_>, place: usize, out: &mut Patterns) {
        let w = &s.whitener;
        let mut of_setups = |first: usize, vector: Vector3<f64>| {
            out.push(PER_SETUP * s.setup + first, vector);
            let at = out.vectors.len() - 1;
            out.places.push((PER_SETUP * self.setups + first, at));
        };
        for k in 0..3 {
            of_setups(k, w.column(k).into());
            of_setups(3 + k, w * Vector3::ith(k, 1.0).cross(&s.from_base));
            of_setups(6 + k, w * s.world_from_tool.matrix().column(k));
        }
        for (k, &j) in self.joints.iter().enumerate() {
            out.push(self.level(k), w * s.joint_columns[j]);
            let at = out.vectors.len() - 1;
            for curve in self.curves.iter().filter(|c| c.joint == j) {
                if let Some(bin) = curve.bins.of[place].map(usize::from) {
                    out.places.push((curve.first + bin, at));
                    let [mean, low, high] = curve.bins.x[bin];
                    let within = curve.against.of(s).filter(|_| high > low).map_or(0.0, |x| (x - mean) / (high - low));
                    out.push(curve.first + curve.steps() + bin, out.vectors[at] * within);
                }
            }
        }
        let own = |first: usize, out: &mut Patterns| (0..3).for_each(|k| out.push(first + k, w.column(k).into()));
        if let Some(b) =
            s.ball().and_then(|b| self.balls.iter().position(|known| *known == BallOf { dataset: s.dataset, ball: b }))
        {
            own(self.first_ball() + 3 * b, out);
        }
        if let Some(k) = self.worst.iter().position(|&p| p == place) {
            own(self.first_worst() + 3 * k, out);
        }
    }

    /// Candidates for findings: subject, patterns, and the pattern whose contribution is deducted.
    pub fn candidates(&self) -> Vec<(Subject, Vec<usize>, Option<usize>)> {
        let known = (0..self.balls.len()).filter(|b| !self.placed.contains(b));
        let balls = known.map(|b| (Subject::Ball(b), self.ball(b), None));
        let setups =
            (0..self.setups).flat_map(|s| [(Subject::Tool(s), self.tool(s), None), (Subject::World(s), self.base(s), None)]);
        let offsets = (0..self.joints.len()).map(|k| (Subject::Offset(k), vec![self.level(k)], None));
        let curves =
            (0..self.curves.len()).map(|c| (Subject::Curve(c), self.curve(c), Some(self.level_of(self.curves[c].joint))));
        let worst = (0..self.worst.len()).map(|w| (Subject::Sample(w), self.worst(w), None));
        balls.chain(setups).chain(offsets).chain(curves).chain(worst).collect()
    }
}
