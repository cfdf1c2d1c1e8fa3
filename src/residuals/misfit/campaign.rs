//! Measurements as needed by the fit of the frames: joint angles, measured values and set-up of the selected rows.

use std::sync::Arc;

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::identify::problem::Use;
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use crate::robot::{FramePose, Robot};

/// Measured place of one row; balls are numbered over all datasets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Seen {
    /// A ball, and its centre relative to the TCP in the tool's axes, m.
    Ball { ball: usize, reading: Vector3<f64> },
    /// A position in the world, m.
    Point(Vector3<f64>),
    /// A distance from an anchor, m; anchors are numbered over all datasets.
    Distance { anchor: usize, distance: f64 },
}

/// What was measured at one row: the place, and the orientation where there is one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reading {
    pub seen: Seen,
    pub turned: Option<Arc<Rotation3<f64>>>,
}

/// One row.
#[derive(Debug, Clone)]
pub(super) struct Shot {
    pub setup: usize,
    pub q: Vec<f64>,
    pub commanded: Option<Vec<f64>>,
    pub seen: Seen,
    /// Rotation from the tool's to the world's axes, if measured. It is held once: most campaigns measure none.
    pub turned: Option<Arc<Rotation3<f64>>>,
    /// Measurements of the rows before and after it in the same set-up.
    pub neighbours: [Option<Reading>; 2],
    /// Indices of dataset and sample.
    pub source: [usize; 2],
}

/// Base and tool of a session, as stated.
#[derive(Debug, Clone)]
pub(super) struct Place {
    /// Its name in sentences: that of the target or of the session.
    pub name: String,
    pub base: FramePose,
    pub tool: FramePose,
    pub tool_free: bool,
    /// Point of the tool that is measured, by index; `None` for the TCP.
    pub tool_target: Option<usize>,
    /// True if the base can be fitted: the session measures a known position, or a free ball of an earlier session.
    pub base_free: bool,
    pub gravity: Vector3<f64>,
}

/// A ball of an artifact, or an anchor of distances.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub id: String,
    pub position: Vector3<f64>,
    pub free: bool,
}

/// A known distance between two balls, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tie {
    pub between: [usize; 2],
    pub distance: f64,
}

/// Everything needed to fit the frames to a nominal arm.
#[derive(Debug, Clone)]
pub(super) struct Campaign {
    pub robot: Arc<Robot>,
    pub places: Vec<Place>,
    pub balls: Vec<Target>,
    pub anchors: Vec<Target>,
    pub ties: Vec<Tie>,
    pub shots: Vec<Shot>,
    /// Three times the largest stated one-sigma, but at least `UNSTATED_NOISE`, m.
    pub noise: f64,
    /// Rms in space of the stated noise over the rows, m; zero where none is stated.
    pub stated_noise: f64,
}

/// Smallest noise assumed, also if none is stated, m.
const UNSTATED_NOISE: f64 = 1e-4;
/// Number of rows of each ball, or of the other targets of each set-up, that a selection keeps at least.
const LEAST_PER_TARGET: usize = 8;
/// Thickness, in parts of their extent, up to which anchors lie in a plane.
const IN_A_PLANE: f64 = 1e-3;
/// Inverse golden ratio: its multiples modulo 1 fill the unit interval evenly and share no period with any table.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Campaign {
    /// Collects all rows that `which` selects; `None` if there are none.
    pub fn of(datasets: &[NamedDataset<'_>], which: Use) -> Option<Campaign> {
        let NamedDataset { dataset: first, .. } = datasets.first()?;
        let mut campaign = Campaign {
            robot: first.robot.clone(),
            places: Vec::new(),
            balls: Vec::new(),
            anchors: Vec::new(),
            ties: Vec::new(),
            shots: Vec::new(),
            noise: UNSTATED_NOISE,
            stated_noise: 0.0,
        };
        for (d, NamedDataset { dataset, .. }) in datasets.iter().enumerate() {
            campaign.add(d, dataset, which);
        }
        campaign.find_free_bases();
        (!campaign.shots.is_empty()).then_some(campaign)
    }

    fn add(&mut self, d: usize, dataset: &Dataset, which: Use) {
        let (first_ball, first_place) = (self.balls.len(), self.places.len());
        let first = [first_ball, self.anchors.len()];
        let anchor = |a: &crate::measure::dataset::Anchor| Target { id: a.id.clone(), position: a.position, free: false };
        self.anchors.extend(dataset.anchors.iter().map(anchor));
        let target = |b: &crate::measure::dataset::Ball| Target { id: b.id.clone(), position: b.position, free: b.free };
        self.balls.extend(dataset.balls.iter().map(target));
        let tie = |t: &crate::measure::dataset::BallDistance| Tie {
            between: t.between.map(|b| first_ball + b),
            distance: t.distance,
        };
        // Each measured point of the tool is judged by itself: what is wrong may be wrong in its columns alone.
        let mut sessions: Vec<(Option<&str>, Option<usize>)> = Vec::new();
        let mut last: Vec<Option<usize>> = Vec::new();
        let (mut squares, mut stated) = (0.0, 0.0);
        for (k, sample) in dataset.samples.iter().enumerate().filter(|(_, s)| which.takes(s)) {
            let session = (sample.session.as_deref(), sample.tool_target);
            let place = sessions.iter().position(|s| *s == session).unwrap_or_else(|| {
                sessions.push(session);
                last.push(None);
                sessions.len() - 1
            });
            let seen = seen(first, sample);
            let turned = sample.orientation.map(|o| Arc::new(o.world_from_tool()));
            let shot = self.shots.len();
            let before = last[place].replace(shot);
            if let Some(before) = before {
                self.shots[before].neighbours[1] = Some(Reading { seen, turned: turned.clone() });
            }
            let neighbours = [before.map(|b| Reading { seen: self.shots[b].seen, turned: self.shots[b].turned.clone() }), None];
            let (q, commanded) = (sample.q.clone(), sample.q_commanded.clone());
            let setup = first_place + place;
            self.shots.push(Shot { setup, q, commanded, seen, turned, neighbours, source: [d, k] });
            if let Some(sigma) = sample.sigma.or(stated_noise(dataset, sample)) {
                self.noise = self.noise.max(3.0 * sigma);
                let axes = if matches!(seen, Seen::Distance { .. }) { 1.0 } else { 3.0 };
                squares += axes * sigma * sigma;
                stated += 1.0;
            }
        }
        // A free ball that none of these rows probe has no place to measure from.
        let is_placed = |&b: &usize| !self.balls[b].free || self.probes(b);
        let ties: Vec<Tie> = dataset.ball_distances.iter().map(tie).filter(|t| t.between.iter().all(is_placed)).collect();
        self.ties.extend(ties);
        if stated > 0.0 {
            self.stated_noise = (squares / stated).sqrt();
        }
        self.places.extend(sessions.iter().map(|(session, tool_target)| Place {
            name:
                tool_target.map_or_else(
                    || session.unwrap_or("the TCP").to_owned(),
                    |t| format!("target {}", dataset.tool_targets[t].id),
                ),
            base: dataset.base,
            tool: dataset.tool_at(*tool_target),
            tool_free: dataset.tool_free || tool_target.is_some_and(|r| dataset.tool_targets[r].free),
            tool_target: *tool_target,
            base_free: true,
            gravity: dataset.gravity,
        }));
    }

    /// Finds the bases that can be fitted. A set-up without any known position defines the world, so its base stays as
    /// stated.
    fn find_free_bases(&mut self) {
        let mut placed: Vec<bool> = self.balls.iter().map(|b| !b.free).collect();
        for s in 0..self.places.len() {
            let of_setup = || self.shots.iter().filter(move |shot| shot.setup == s);
            let knows = |shot: &Shot| match shot.seen {
                Seen::Ball { ball, .. } => placed[ball],
                _ => true,
            };
            self.places[s].base_free = of_setup().any(knows);
            for shot in of_setup() {
                if let Seen::Ball { ball, .. } = shot.seen {
                    placed[ball] = true;
                }
            }
        }
    }

    /// True if nothing but distances was measured.
    pub fn has_distances_alone(&self) -> bool {
        self.shots.iter().all(|shot| matches!(shot.seen, Seen::Distance { .. }))
    }

    /// True if the measured places tell a left-handed frame from a right-handed one: distances from anchors in one plane, as three
    /// are, are those from its other side as well.
    pub fn shows_handedness(&self) -> bool {
        let anchors: Vec<Vector3<f64>> =
            (0..self.anchors.len()).filter(|&a| self.sights(a)).map(|a| self.anchors[a].position).collect();
        let [first, others @ ..] = anchors.as_slice() else { return true };
        if !self.has_distances_alone() {
            return true;
        }
        let spread = others.iter().map(|a| (a - first) * (a - first).transpose()).sum::<Matrix3<f64>>();
        let sizes = spread.symmetric_eigenvalues();
        sizes.min() > IN_A_PLANE * IN_A_PLANE * sizes.max()
    }

    /// About `most` of the rows, spread evenly over every ball and every set-up; always the same ones.
    pub fn selection(&self, most: usize) -> Campaign {
        let group = |shot: &Shot| match shot.seen {
            Seen::Ball { ball, .. } => (shot.setup, ball),
            _ => (shot.setup, usize::MAX),
        };
        let mut count = std::collections::BTreeMap::new();
        self.shots.iter().for_each(|shot| *count.entry(group(shot)).or_insert(0usize) += 1);
        let share = most as f64 / self.shots.len() as f64;
        if share >= 1.0 {
            return self.clone();
        }
        let mut seen = std::collections::BTreeMap::new();
        let takes = |shot: &&Shot| {
            let of = count[&group(shot)];
            let place = seen.entry(group(shot)).or_insert(0usize);
            *place += 1;
            let share = share.max(LEAST_PER_TARGET as f64 / of as f64);
            (*place as f64 * GOLDEN).fract() < share
        };
        Campaign {
            robot: self.robot.clone(),
            places: self.places.clone(),
            balls: self.balls.clone(),
            anchors: self.anchors.clone(),
            ties: self.ties.clone(),
            shots: self.shots.iter().filter(takes).cloned().collect(),
            noise: self.noise,
            stated_noise: self.stated_noise,
        }
    }

    /// True if any row measured a position in the world that is known beforehand.
    pub fn has_known_places(&self) -> bool {
        self.shots.iter().any(|shot| match shot.seen {
            Seen::Ball { ball, .. } => !self.balls[ball].free,
            _ => true,
        })
    }

    /// True if any row measured a position.
    pub fn has_points(&self) -> bool {
        self.shots.iter().any(|shot| matches!(shot.seen, Seen::Point(_)))
    }

    /// True if any row measured a distance from this anchor.
    pub fn sights(&self, anchor: usize) -> bool {
        self.shots.iter().any(|shot| matches!(shot.seen, Seen::Distance { anchor: a, .. } if a == anchor))
    }

    /// True if any row probes this ball.
    pub fn probes(&self, ball: usize) -> bool {
        self.shots.iter().any(|shot| matches!(shot.seen, Seen::Ball { ball: b, .. } if b == ball))
    }
}

/// Measured place, with the numbers of the first ball and of the first anchor of its dataset.
fn seen([first_ball, first_anchor]: [usize; 2], sample: &Sample) -> Seen {
    match &sample.measured {
        Measured::Ball { ball, reading } => Seen::Ball { ball: first_ball + ball, reading: reading.unwrap_or_default() },
        Measured::Point(point) => Seen::Point(*point),
        Measured::Distance { anchor, distance } => Seen::Distance { anchor: first_anchor + anchor, distance: *distance },
    }
}

fn stated_noise(dataset: &Dataset, sample: &Sample) -> Option<f64> {
    match sample.measured {
        Measured::Ball { .. } => dataset.noise.ball,
        _ => dataset.noise.point,
    }
}
