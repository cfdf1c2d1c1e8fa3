//! The views, computed from the scores of their patterns.

use nalgebra::{DMatrix, Vector3};

use super::finding::Judge;
use super::layout::{BallOf, Curve, Layout};
use crate::identify::problem::Setup;
use crate::math::rms;
use crate::measure::dataset::NamedDataset;
use crate::residuals::views::{
    BallView, JointBin, JointCurve, JointOffset, ScoreReduction, Scores, SeenSample, SetupView, ToolView, ViewTest, WorldView,
    WorstSample, remarks,
};
use crate::robot::Robot;

/// Input of the views.
pub(super) struct Views<'a> {
    pub robot: &'a Robot,
    pub layout: &'a Layout,
    pub seen: &'a [SeenSample<'a>],
    pub scores: &'a Scores,
    pub judge: &'a Judge<'a>,
    pub fitted: bool,
}

/// Weighted means of patterns that are fitted together, and their one-sigma by chance.
struct Means {
    values: Vec<f64>,
    sigmas: Vec<f64>,
}

impl Views<'_> {
    fn means(&self, patterns: &[usize]) -> Means {
        let n = patterns.len();
        let pick = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, k| m[(patterns[i], patterns[k])]);
        let own = pick(&self.scores.own);
        let unit = DMatrix::from_fn(n, 1, |i, _| if own[(i, i)] > 0.0 { own[(i, i)].sqrt().recip() } else { 0.0 });
        let scaled = DMatrix::from_fn(n, n, |i, k| own[(i, k)] * unit[i] * unit[k]);
        // Points on a line do not determine the rotation about it; it remains zero.
        let inverse = scaled.pseudo_inverse(1e-9).unwrap_or_else(|_| DMatrix::zeros(n, n));
        let inverse = DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] * unit[i] * unit[k]);
        let plain = DMatrix::from_fn(n, 1, |i, _| self.scores.plain[patterns[i]]);
        let covariance = &inverse * pick(&self.scores.plain_covariance) * &inverse;
        let sigma = self.judge.unit(self.scores);
        Means {
            values: (inverse * plain).iter().copied().collect(),
            sigmas: (0..n).map(|i| sigma * covariance[(i, i)].max(0.0).sqrt()).collect(),
        }
    }

    fn tool_and_world(&self, setup: usize, of: &dyn Fn(&SeenSample<'_>) -> bool, family: f64) -> (ToolView, WorldView) {
        let three = |v: &[f64], at: usize| Vector3::new(v[at], v[at + 1], v[at + 2]);
        let (tool, base) = (self.layout.tool(setup), self.layout.base(setup));
        let (mean, motion) = (self.means(&tool), self.means(&base));
        let shift = self.means(&base[..3]);
        let test = |patterns: &[usize]| self.judge.test(self.scores, &self.scores.reduction(patterns), family);
        let (translation, rotation) = (three(&motion.values, 0), three(&motion.values, 3));
        let after = |s: &SeenSample<'_>| {
            let moved = translation + rotation.cross(&s.from_base);
            // A distance shows only the component along the line of sight.
            let seen = if s.height == 1 {
                s.whitener.row(0).transpose() * (s.whitener.row(0).transpose().dot(&moved) * s.variance)
            } else {
                moved
            };
            (s.residual - seen).norm_squared()
        };
        let own: Vec<f64> = self.seen.iter().filter(|s| of(s)).map(after).collect();
        let tool_view = ToolView { mean: three(&mean.values, 0), sigma: three(&mean.sigmas, 0), test: test(&tool) };
        let world_view = WorldView {
            mean: three(&shift.values, 0),
            sigma: three(&shift.sigmas, 0),
            translation,
            translation_sigma: three(&motion.sigmas, 0),
            rotation,
            rotation_sigma: three(&motion.sigmas, 3),
            rms_after: (own.iter().sum::<f64>() / own.len().max(1) as f64).sqrt(),
            test: test(&base),
        };
        (tool_view, world_view)
    }

    /// Views of all set-ups combined.
    pub fn of_all(&self) -> (ToolView, WorldView) {
        self.tool_and_world(self.layout.setups, &|_| true, 1.0)
    }

    pub fn setups(&self, setups: &[Setup]) -> Vec<SetupView> {
        let one = |(k, setup): (usize, &Setup)| {
            let own = || self.seen.iter().filter(move |s| s.setup == k);
            let (tool, world) = self.tool_and_world(k, &|s| s.setup == k, setups.len() as f64);
            let samples = own().count();
            SetupView {
                dataset: setup.dataset.clone(),
                session: setup.session.clone(),
                samples,
                rms: rms(&own().map(|s| s.residual).collect::<Vec<_>>()),
                tool,
                world,
            }
        };
        setups.iter().enumerate().map(one).collect()
    }

    pub fn balls(&self, datasets: &[NamedDataset<'_>]) -> Vec<BallView> {
        let one = |(k, &BallOf { dataset: d, ball: b }): (usize, &BallOf)| {
            let patterns = self.layout.ball(k);
            let own = || self.seen.iter().filter(move |s| s.dataset == d && s.ball() == Some(b));
            let (mean, reduction) = (self.means(&patterns), self.scores.reduction(&patterns));
            let samples = own().count();
            let sigma = self.judge.unit(self.scores);
            // The arm was centred on the ball, so the TCP was at the true position of the ball, whereas the residual is
            // stated position minus TCP: the displacement has the opposite sign.
            let displacement = |reduction: &ScoreReduction| {
                let sigma = Vector3::from_fn(|i, _| sigma * reduction.covariance[(i, i)].max(0.0).sqrt());
                [Vector3::from_fn(|i, _| -reduction.sizes[i]), sigma]
            };
            BallView {
                dataset: datasets[d].name.to_owned(),
                ball: datasets[d].dataset.balls[b].id.clone(),
                samples,
                rms: rms(&own().map(|s| s.residual).collect::<Vec<_>>()),
                mean: Vector3::from_column_slice(&mean.values),
                sigma: Vector3::from_column_slice(&mean.sigmas),
                displacement: (self.fitted && reduction.dof == 3).then(|| displacement(&reduction)),
                test: self.judge.test(self.scores, &reduction, self.layout.balls.len() as f64),
            }
        };
        self.layout.balls.iter().enumerate().map(one).collect()
    }

    pub fn offsets(&self) -> Vec<JointOffset> {
        let one = |(k, &j): (usize, &usize)| {
            let level = [self.layout.level(k)];
            let mean = self.means(&level);
            let test = self.judge.test(self.scores, &self.scores.reduction(&level), self.layout.joints.len() as f64);
            JointOffset { joint: j + 1, mean: mean.values[0], sigma: mean.sigmas[0], test }
        };
        self.layout.joints.iter().enumerate().map(one).collect()
    }

    /// Curves in order of the share that they explain, each with its index in the layout.
    pub fn curves(&self) -> Vec<(usize, JointCurve)> {
        let family = self.layout.curves.len() as f64;
        let one = |(c, curve): (usize, &Curve)| {
            let patterns = self.layout.curve(c);
            let scale = curve.against.unit().1;
            let reduction = self.scores.reduction_beyond(&patterns, self.layout.level_of(curve.joint));
            let bin = |b: usize| {
                let mean = self.means(&patterns[b..=b]);
                let [x, from, to] = curve.bins.x[b].map(|x| x / scale);
                JointBin { x, from, to, mean: mean.values[0], sigma: mean.sigmas[0], samples: curve.bins.counts[b] }
            };
            let shown = JointCurve {
                joint: curve.joint + 1,
                against: curve.against,
                bins: (0..patterns.len()).map(bin).collect(),
                test: self.judge.test(self.scores, &reduction, family),
            };
            (c, shown)
        };
        let mut curves: Vec<(usize, JointCurve)> = self.layout.curves.iter().enumerate().map(one).collect();
        let order = |t: &ViewTest| (t.explains, t.chi2 / t.dof.max(1) as f64);
        curves.sort_by(|(_, a), (_, b)| {
            let (a, b) = (order(&a.test), order(&b.test));
            b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1))
        });
        curves
    }

    pub fn worst(&self, normalised: &[(f64, usize)]) -> Vec<WorstSample> {
        let unit = self.judge.unit(self.scores);
        let one = |(w, &place): (usize, &usize)| {
            let s = &self.seen[place];
            let (squares, dof) = normalised[place];
            WorstSample {
                id: s.sample.id.clone(),
                setup: s.setup,
                residual: s.residual,
                normalised: (squares / dof.max(1) as f64).sqrt() / unit,
                test: self.judge.test(self.scores, &self.scores.reduction(&self.layout.worst(w)), self.seen.len() as f64),
                remarks: remarks(self.robot, self.seen, place),
            }
        };
        self.layout.worst.iter().enumerate().map(one).collect()
    }
}
