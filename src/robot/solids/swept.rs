//! Clearance along a joint motion: conservative advancement.
//!
//! No body of the arm moves faster than the sum of its joints' speeds times its largest possible distance from their axes.
//! So the gap of a pair gives the part of the motion that must pass before it can have closed, and the pair is not
//! evaluated again until then: no step size is guessed, no gap is skipped, and pairs that are far apart are evaluated a few
//! times only.

use super::ClearanceCheck;
use super::{Clearance, Surroundings};
use crate::robot::kinematics::Posture;
use crate::robot::sites::SiteIndex;
use crate::robot::{FramePose, Link, Robot};
use crate::units::MM;

/// Tolerance of the narrowest gap, mm: it limits the evaluations of a pair that stays near its narrowest.
pub(super) const FOUND_WITHIN: f64 = 0.5;

/// The pace of a pair that may touch.
const EXCEPTED: f64 = -1.0;

/// The narrowest gap of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Narrowest {
    /// The gap and its bodies. The true gap is at most half a millimetre narrower.
    pub clearance: Clearance,
    /// Position along the motion: 0 at its start, 1 at its end.
    pub share: f64,
}

/// Finds the narrowest gap of joint motions: all joints move in proportion, as in a synchronous point-to-point motion.
#[derive(Debug, Clone)]
pub struct SweptCheck<'a> {
    robot: &'a Robot,
    base: &'a FramePose,
    tool: &'a FramePose,
    check: ClearanceCheck,
    posture: Posture,
    nominal: Vec<f64>,
    /// For each pair, the largest distance of a point of one body from the axis of each joint that moves it relative to the
    /// other, mm; 0 for other joints.
    levers: Vec<Vec<f64>>,
    /// For each pair, the largest change of its gap over the whole motion, mm.
    pace: Vec<f64>,
    /// For each pair, the share of the motion up to which it need not be evaluated.
    due: Vec<f64>,
    q: Vec<f64>,
}

impl<'a> SweptCheck<'a> {
    /// Creates the check for the nominal arm on its base, with this tool, in these surroundings.
    pub fn new(robot: &'a Robot, base: &'a FramePose, tool: &'a FramePose, surroundings: &Surroundings) -> Self {
        let check = ClearanceCheck::new(robot, surroundings);
        // Without Hayati's angle `a` and `d` are at right angles.
        let length = |l: &Link| if l.mdh.beta == 0.0 { l.mdh.a.hypot(l.mdh.d) } else { l.mdh.a.abs() + l.mdh.d.abs() };
        let lengths: Vec<f64> = robot.links.iter().map(|l| length(l) / MM).collect();
        let lever = |body: usize, joint: usize, after: usize| {
            let solid = &check.solids[body];
            if joint < after || joint >= solid.frame {
                return 0.0;
            }
            lengths[joint + 1..solid.frame].iter().sum::<f64>() + solid.shape.reach() / MM
        };
        let of_pair = |&[i, j]: &[usize; 2]| -> Vec<f64> {
            // Joints that move both bodies of a pair do not change their gap; fixed bodies are listed last.
            let (mover, after) = match (check.solids[i].frame, check.solids[j].frame) {
                _ if j >= check.moving => (i, 0),
                (a, b) if a < b => (j, a),
                (_, b) => (i, b),
            };
            (0..robot.joints()).map(|joint| lever(mover, joint, after)).collect()
        };
        let levers: Vec<Vec<f64>> = check.pairs.iter().map(of_pair).collect();
        SweptCheck {
            pace: vec![0.0; levers.len()],
            due: vec![0.0; levers.len()],
            levers,
            posture: Posture::new(robot),
            nominal: vec![0.0; SiteIndex::new(robot.joints()).len()],
            q: vec![0.0; robot.joints()],
            check,
            robot,
            base,
            tool,
        }
    }

    /// The check of one body of the arm, by its name, against all others.
    #[must_use]
    pub fn of_body(mut self, name: &str) -> Self {
        let keeps = |&[i, j]: &[usize; 2]| [i, j].iter().any(|&k| k < self.check.moving && self.check.solids[k].name == name);
        let kept: Vec<bool> = self.check.pairs.iter().map(keeps).collect();
        let (mut pairs, mut levers) = (kept.iter(), kept.iter());
        self.check.pairs.retain(|_| *pairs.next().unwrap_or(&false));
        self.levers.retain(|_| *levers.next().unwrap_or(&false));
        self.pace.truncate(self.levers.len());
        self.due.truncate(self.levers.len());
        self
    }

    /// The index of a fixed body, for motions that may touch it.
    pub fn fixed_named(&self, name: &str) -> Option<usize> {
        self.check.fixed_named(name)
    }

    /// The narrowest gap of the motion from `from` to `to` (rad, N), both ends included, or the first that is narrower than
    /// `enough` (m); `None` if there are no two bodies to compare. Carried bodies may touch the fixed body `except`.
    pub fn narrowest(&mut self, from: &[f64], to: &[f64], enough: f64, except: Option<usize>) -> Option<Narrowest> {
        let except = except.map(|k| self.check.moving + k);
        for ((pace, levers), [i, j]) in self.pace.iter_mut().zip(&self.levers).zip(&self.check.pairs) {
            let excepted = Some(*j) == except && *i >= self.check.carried;
            let moves = levers.iter().zip(from.iter().zip(to)).map(|(lever, (a, b))| lever * (b - a).abs()).sum();
            *pace = if excepted { EXCEPTED } else { moves };
        }
        for (due, pace) in self.due.iter_mut().zip(&self.pace) {
            *due = if *pace < 0.0 { f64::INFINITY } else { 0.0 };
        }
        let (mut best, mut share) = (None::<(f64, [usize; 2], f64)>, 0.0);
        loop {
            self.place(from, to, share);
            for (k, &pair) in self.check.pairs.iter().enumerate() {
                if self.due[k] > share {
                    continue;
                }
                let narrowest = best.map_or(f64::INFINITY, |(gap, ..)| gap);
                let mut gap = self.check.at_least(pair);
                if gap < narrowest {
                    gap = self.check.distance(pair);
                    if gap < narrowest {
                        best = Some((gap, pair, share));
                    }
                }
                let beyond = best.map_or(gap, |(narrowest, ..)| gap - narrowest);
                self.due[k] = share + beyond.max(FOUND_WITHIN) / self.pace[k];
            }
            if share >= 1.0 || best.is_some_and(|(gap, ..)| gap * MM < enough) {
                break;
            }
            share = self.due.iter().copied().fold(1.0, f64::min);
        }
        best.map(|(gap, pair, share)| Narrowest { clearance: self.check.named(gap, pair), share })
    }

    fn place(&mut self, from: &[f64], to: &[f64], share: f64) {
        for (q, (a, b)) in self.q.iter_mut().zip(from.iter().zip(to)) {
            *q = a + share * (b - a);
        }
        self.posture.set(self.robot, self.base, self.tool, &self.q, &self.nominal);
        self.check.place(&self.posture);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::robot::built_in;
    use crate::robot::solids::Solid;
    use nalgebra::Vector3;

    /// Sampled at thousands of postures, no motion is narrower than reported by more than half a millimetre, nor ever
    /// wider.
    #[test]
    fn the_narrowest_gap_is_that_of_a_thousand_looks() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for name in ["kr6_r700", "ur10", "panda"] {
            let robot = built_in(name).unwrap();
            let post = |x: f64, y: f64| {
                let ends = [Vector3::new(x, y, 0.0), Vector3::new(x, y, 0.5)];
                Solid::capsule(format!("post {x}"), 0, ends, 0.02)
            };
            let surroundings = Surroundings {
                fixed: vec![
                    post(0.45, 0.1),
                    post(-0.3, 0.4),
                    Solid::cuboid("table", 0, Vector3::new(0.0, 0.0, -0.1), Vector3::new(1.0, 1.0, 0.05)),
                ],
                carried: vec![Solid::capsule("gauge", 0, [Vector3::zeros(), Vector3::new(0.03, 0.02, 0.12)], 0.03)],
            };
            let (base, tool) = (FramePose::default(), FramePose::default());
            let mut swept = SweptCheck::new(&robot, &base, &tool, &surroundings);
            let mut check = ClearanceCheck::new(&robot, &surroundings);
            let (mut posture, nominal) = (Posture::new(&robot), vec![0.0; SiteIndex::new(robot.joints()).len()]);
            for _ in 0..12 {
                let mut drawn = || -> Vec<f64> {
                    robot.links.iter().map(|l| l.limits[0] + (l.limits[1] - l.limits[0]) * random.random::<f64>()).collect()
                };
                let (from, to) = (drawn(), drawn());
                let said = swept.narrowest(&from, &to, f64::NEG_INFINITY, None).unwrap();
                let mut seen = f64::INFINITY;
                for k in 0..=3000 {
                    let q: Vec<f64> = from.iter().zip(&to).map(|(a, b)| a + f64::from(k) / 3000.0 * (b - a)).collect();
                    posture.set(&robot, &base, &tool, &q, &nominal);
                    seen = seen.min(check.clearance(&posture).unwrap().distance);
                }
                // parry gives no depth for overlapping bodies.
                let (said, seen) = (said.clearance.distance.max(0.0), seen.max(0.0));
                assert!(said - 0.5001e-3 <= seen && seen <= said + 0.3e-3, "{name}: {said} against {seen}");
            }
        }
    }

    /// A gap equal to `enough` does not end the search: the requested gap is often exactly that of an end of the motion.
    #[test]
    fn a_motion_is_looked_at_whole_where_its_end_has_what_is_asked_for() {
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let robot = built_in("kr6_r700").unwrap();
        let post = Solid::capsule("post", 0, [Vector3::new(0.4, 0.2, 0.0), Vector3::new(0.4, 0.2, 0.8)], 0.03);
        let surroundings = Surroundings { fixed: vec![post], carried: Vec::new() };
        let (base, tool) = (FramePose::default(), FramePose::default());
        let mut swept = SweptCheck::new(&robot, &base, &tool, &surroundings);
        let mut hits = 0;
        for _ in 0..200 {
            let mut drawn = || -> Vec<f64> {
                robot.links.iter().map(|l| l.limits[0] + (l.limits[1] - l.limits[0]) * random.random::<f64>()).collect()
            };
            let (from, to) = (drawn(), drawn());
            let ends = [&from, &to].map(|q| swept.narrowest(q, q, f64::NEG_INFINITY, None).unwrap().clearance.distance);
            let enough = ends[0].min(ends[1]);
            let whole = swept.narrowest(&from, &to, f64::NEG_INFINITY, None).unwrap().clearance.distance;
            let said = swept.narrowest(&from, &to, enough, None).unwrap().clearance.distance;
            assert_eq!(said < enough, whole < enough, "{said} of {whole}, {enough} asked for");
            hits += usize::from(enough > 0.0 && whole <= 0.0);
        }
        assert!(hits > 20, "{hits} motions hit between clear ends");
    }

    /// Carried bodies may touch the ball; the arm itself may not.
    #[test]
    fn only_what_is_carried_may_touch_the_excepted_body() {
        let robot = built_in("kr6_r700").unwrap();
        let (base, tool) = (FramePose::default(), FramePose::default());
        let from = vec![0.0, -1.0, 1.5, 0.0, 0.5, 0.0];
        let mut posture = Posture::new(&robot);
        posture.set(&robot, &base, &tool, &from, &vec![0.0; SiteIndex::new(6).len()]);
        for (at, free) in
            [(posture.frame(6).point(&Vector3::new(0.0, 0.0, -0.1)), true), (posture.frame(3).point(&Vector3::zeros()), false)]
        {
            let ball = Solid::capsule("ball", 0, [at, at], 0.0127);
            let carried = vec![Solid::capsule("gauge", 0, [Vector3::new(0.0, 0.0, -0.08), Vector3::new(0.0, 0.0, -0.1)], 0.01)];
            let surroundings = Surroundings { fixed: vec![ball], carried };
            let mut swept = SweptCheck::new(&robot, &base, &tool, &surroundings);
            let ball = swept.fixed_named("ball");
            let gap =
                |swept: &mut SweptCheck<'_>, except| swept.narrowest(&from, &from, 0.0, except).unwrap().clearance.distance;
            assert!(gap(&mut swept, None) <= 0.0);
            assert_eq!(gap(&mut swept, ball) > 0.0, free);
        }
    }
}
