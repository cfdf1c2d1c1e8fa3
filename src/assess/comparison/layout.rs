//! Which displacement patterns the views are made of, and the views themselves.

use nalgebra::{DMatrix, Vector3};

use super::finding::{Judge, Subject};
use crate::assess::residual_views::{
    BallView, Bins, JointBin, JointCurve, JointOffset, JointVariable, MOST_WORST, Patterns, Scores, SeenSample, SetupView,
    Taken, ToolView, ViewTest, WorldView, WorstSample, remarks,
};
use crate::identify::Setup;
use crate::measure::Dataset;

/// A joint that moves no sample's TCP by more than this, m/rad, has no apparent error.
const NO_LEVER: f64 = 1e-6;

/// Patterns of a set-up: six motions of its base, three shifts of its tool.
const PER_SETUP: usize = 9;

/// A moment that varies by less than this share of the largest one's variation shows the base's tilt, not a load.
const NO_LOAD: f64 = 0.01;

struct Curve {
    joint: usize,
    against: JointVariable,
    bins: Bins,
    /// First of its steps, one a bin; slopes within the bins follow.
    first: usize,
}

impl Curve {
    fn steps(&self) -> usize {
        self.bins.counts.len()
    }
}

/// Every pattern has a number: set-ups first, all of them together next, then joints' means, balls, curves, worst samples.
pub(super) struct Layout {
    setups: usize,
    /// Joints (from 0) with a lever arm.
    joints: Vec<usize>,
    /// Dataset and place of every ball probed.
    balls: Vec<(usize, usize)>,
    curves: Vec<Curve>,
    worst: Vec<usize>,
}

impl Layout {
    pub fn new(seen: &[SeenSample<'_>], setups: usize, datasets: &[(&str, &Dataset)], normalised: &[(f64, usize)]) -> Self {
        let count = seen.first().map_or(0, |s| s.joint_columns.len());
        let lever = |j: &usize| seen.iter().any(|s| (s.whitener * s.joint_columns[*j]).norm() * s.variance.sqrt() > NO_LEVER);
        let joints: Vec<usize> = (0..count).filter(lever).collect();
        let mut probed: Vec<Vec<bool>> = datasets.iter().map(|(_, d)| vec![false; d.balls.len()]).collect();
        for s in seen {
            if let Some(flag) = s.ball().and_then(|b| probed[s.dataset].get_mut(b)) {
                *flag = true;
            }
        }
        let of_dataset =
            |(d, flags): (usize, &Vec<bool>)| (0..flags.len()).filter(|&b| flags[b]).map(|b| (d, b)).collect::<Vec<_>>();
        let balls: Vec<(usize, usize)> = probed.iter().enumerate().flat_map(of_dataset).collect();
        let mut order: Vec<usize> = (0..seen.len()).collect();
        order.sort_by(|&a, &b| {
            (normalised[b].0 / normalised[b].1.max(1) as f64).total_cmp(&(normalised[a].0 / normalised[a].1.max(1) as f64))
        });
        order.truncate(MOST_WORST);
        let mut layout = Layout { setups, joints, balls, curves: Vec::new(), worst: order };
        let mut first = layout.first_ball() + 3 * layout.balls.len();
        let spread = |v: JointVariable| {
            let ends = |e: [f64; 2], x: f64| [e[0].min(x), e[1].max(x)];
            let [low, high] = seen.iter().filter_map(|s| v.of(s)).fold([f64::INFINITY, f64::NEG_INFINITY], ends);
            high - low
        };
        let largest = (1..=count).map(|j| spread(JointVariable::Torque(j))).fold(0.0, f64::max);
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

    fn base(&self, setup: usize) -> Vec<usize> {
        (PER_SETUP * setup..PER_SETUP * setup + 6).collect()
    }

    fn tool(&self, setup: usize) -> Vec<usize> {
        (PER_SETUP * setup + 6..PER_SETUP * (setup + 1)).collect()
    }

    fn level(&self, k: usize) -> usize {
        PER_SETUP * (self.setups + 1) + k
    }

    fn first_ball(&self) -> usize {
        self.level(self.joints.len())
    }

    fn ball(&self, b: usize) -> Vec<usize> {
        (self.first_ball() + 3 * b..self.first_ball() + 3 * (b + 1)).collect()
    }

    fn level_of(&self, joint: usize) -> usize {
        self.level(self.joints.iter().position(|&j| j == joint).unwrap_or(0))
    }

    fn curve(&self, c: usize) -> Vec<usize> {
        let curve = &self.curves[c];
        (curve.first..curve.first + curve.steps()).collect()
    }

    /// What the model is given when a subject is found: of a curve its slopes too, so that its steps are not found next.
    pub fn given(&self, subject: Subject, patterns: &[usize]) -> Vec<usize> {
        match subject {
            Subject::Curve(c) => (self.curves[c].first..self.curves[c].first + 2 * self.curves[c].steps()).collect(),
            _ => patterns.to_vec(),
        }
    }

    /// Dataset and place of a ball.
    pub fn ball_at(&self, b: usize) -> (usize, usize) {
        self.balls[b]
    }

    /// Joint (from 1) and variable of a curve.
    pub fn curve_of(&self, c: usize) -> (usize, JointVariable) {
        (self.curves[c].joint + 1, self.curves[c].against)
    }

    fn worst(&self, w: usize) -> Vec<usize> {
        (self.first_worst() + 3 * w..self.first_worst() + 3 * (w + 1)).collect()
    }

    fn first_worst(&self) -> usize {
        self.curves.last().map_or(self.first_ball() + 3 * self.balls.len(), |c| c.first + 2 * c.steps())
    }

    /// Number of patterns.
    pub fn patterns(&self) -> usize {
        self.first_worst() + 3 * self.worst.len()
    }

    /// Patterns of one sample.
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
        if let Some(b) = s.ball().and_then(|b| self.balls.iter().position(|known| *known == (s.dataset, b))) {
            own(self.first_ball() + 3 * b, out);
        }
        if let Some(k) = self.worst.iter().position(|&p| p == place) {
            own(self.first_worst() + 3 * k, out);
        }
    }

    /// What may stand out: its patterns, and the pattern whose share does not count.
    pub fn candidates(&self) -> Vec<(Subject, Vec<usize>, Option<usize>)> {
        let balls = (0..self.balls.len()).map(|b| (Subject::Ball(b), self.ball(b), None));
        let setups =
            (0..self.setups).flat_map(|s| [(Subject::Tool(s), self.tool(s), None), (Subject::World(s), self.base(s), None)]);
        let offsets = (0..self.joints.len()).map(|k| (Subject::Offset(k), vec![self.level(k)], None));
        let curves =
            (0..self.curves.len()).map(|c| (Subject::Curve(c), self.curve(c), Some(self.level_of(self.curves[c].joint))));
        let worst = (0..self.worst.len()).map(|w| (Subject::Sample(w), self.worst(w), None));
        balls.chain(setups).chain(offsets).chain(curves).chain(worst).collect()
    }
}

/// What the views are made from.
pub(super) struct Views<'a> {
    pub layout: &'a Layout,
    pub seen: &'a [SeenSample<'a>],
    pub scores: &'a Scores,
    pub judge: &'a Judge<'a>,
    pub fitted: bool,
}

/// Weighted means of patterns fitted together, and what chance makes of them.
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
        // Points on a line leave a turn about it open: it stays zero.
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
        let test = |patterns: &[usize]| self.judge.test(self.scores, &self.scores.taken(patterns), family);
        let (translation, rotation) = (three(&motion.values, 0), three(&motion.values, 3));
        let after = |s: &SeenSample<'_>| {
            let moved = translation + rotation.cross(&s.from_base);
            // Of a distance only what lies along the line of sight is seen.
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

    /// All set-ups as if they were one.
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
                rms: (own().map(|s| s.residual.norm_squared()).sum::<f64>() / samples.max(1) as f64).sqrt(),
                tool,
                world,
            }
        };
        setups.iter().enumerate().map(one).collect()
    }

    pub fn balls(&self, datasets: &[(&str, &Dataset)]) -> Vec<BallView> {
        let one = |(k, &(d, b)): (usize, &(usize, usize))| {
            let patterns = self.layout.ball(k);
            let own = || self.seen.iter().filter(move |s| s.dataset == d && s.ball() == Some(b));
            let (mean, taken) = (self.means(&patterns), self.scores.taken(&patterns));
            let samples = own().count();
            let sigma = self.judge.unit(self.scores);
            // The arm was centred on the ball: where it truly stands, the TCP was, and the residual is ball minus TCP.
            let displacement = |taken: &Taken| {
                let sigma = Vector3::from_fn(|i, _| sigma * taken.covariance[(i, i)].max(0.0).sqrt());
                [Vector3::from_fn(|i, _| -taken.sizes[i]), sigma]
            };
            BallView {
                dataset: datasets[d].0.to_owned(),
                ball: datasets[d].1.balls[b].id.clone(),
                samples,
                rms: (own().map(|s| s.residual.norm_squared()).sum::<f64>() / samples.max(1) as f64).sqrt(),
                mean: Vector3::from_column_slice(&mean.values),
                sigma: Vector3::from_column_slice(&mean.sigmas),
                displacement: (self.fitted && taken.dof == 3).then(|| displacement(&taken)),
                test: self.judge.test(self.scores, &taken, self.layout.balls.len() as f64),
            }
        };
        self.layout.balls.iter().enumerate().map(one).collect()
    }

    pub fn offsets(&self) -> Vec<JointOffset> {
        let one = |(k, &j): (usize, &usize)| {
            let level = [self.layout.level(k)];
            let mean = self.means(&level);
            let test = self.judge.test(self.scores, &self.scores.taken(&level), self.layout.joints.len() as f64);
            JointOffset { joint: j + 1, mean: mean.values[0], sigma: mean.sigmas[0], test }
        };
        self.layout.joints.iter().enumerate().map(one).collect()
    }

    /// Those first that explain most, each with its place in the layout.
    pub fn curves(&self) -> Vec<(usize, JointCurve)> {
        let family = self.layout.curves.len() as f64;
        let one = |(c, curve): (usize, &Curve)| {
            let patterns = self.layout.curve(c);
            let scale = curve.against.unit().1;
            let taken = self.scores.taken_beyond(&patterns, self.layout.level_of(curve.joint));
            let bin = |b: usize| {
                let mean = self.means(&patterns[b..=b]);
                let [x, from, to] = curve.bins.x[b].map(|x| x / scale);
                JointBin { x, from, to, mean: mean.values[0], sigma: mean.sigmas[0], samples: curve.bins.counts[b] }
            };
            let shown = JointCurve {
                joint: curve.joint + 1,
                against: curve.against,
                bins: (0..patterns.len()).map(bin).collect(),
                test: self.judge.test(self.scores, &taken, family),
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
                test: self.judge.test(self.scores, &self.scores.taken(&self.layout.worst(w)), self.seen.len() as f64),
                remarks: remarks(self.seen, place),
            }
        };
        self.layout.worst.iter().enumerate().map(one).collect()
    }
}
