//! The order of probing.

use super::PlannedPose;

/// Smallest reduction of a motion that counts, rad: rounding must not decide.
const SHORTER: f64 = 1e-9;

/// Returns an order of `poses` that visits the balls in rounds, each ball once per round: indices into `poses`, each once.
///
/// If the balls were probed one by one, a drift of the robot would look like a displacement of the balls; in rounds, it affects
/// all of them alike. Among the unvisited poses of the next ball, the one with the shortest joint motion from the last approach
/// comes next (the largest joint angle counts, since all joints move together).
///
/// ```
/// use calibench::measure::poses::{PlannedPose, interleave};
///
/// let pose = |id: &str, ball, q: f64| PlannedPose {
///     id: id.into(),
///     ball: Some(ball),
///     approach: vec![q; 6],
/// #     payload: 0,
/// #     contact: vec![q; 6],
/// #     reserve: false,
/// #     reverses: None,
/// #     via: Vec::new(),
/// #     clearance: None,
///     // ...
/// };
/// // Two poses on ball 0, two on ball 1: the balls take turns, each with the pose that is nearest.
/// let poses = [pose("a", 0, 0.0), pose("b", 0, 0.5), pose("c", 1, 0.9), pose("d", 1, 0.1)];
/// assert_eq!(interleave(&poses), [0, 3, 1, 2]);
/// ```
pub fn interleave(poses: &[PlannedPose]) -> Vec<usize> {
    Tour::nearest(poses).order
}

/// As [`interleave`], followed by exchanges and reversals that shorten the tour, until none does: the order of the balls within
/// a round and the round of a pose of a ball are free. Neighbouring poses are then measured in succession, so that the drift of
/// a robot that warms up is aliased with an effect of the posture, a little more than before (decision 0028).
pub fn interleave_short(poses: &[PlannedPose]) -> Vec<usize> {
    let mut tour = Tour::nearest(poses);
    while tour.exchange() | tour.reverse() {}
    tour.order
}

/// An order, and the round of every element.
struct Tour<'a> {
    poses: &'a [PlannedPose],
    order: Vec<usize>,
    round: Vec<usize>,
}

impl<'a> Tour<'a> {
    /// Visits the balls in turn, at each the pose nearest to the last one, or the first of equals. It begins with the first
    /// pose.
    fn nearest(poses: &'a [PlannedPose]) -> Self {
        let mut balls: Vec<Option<usize>> = Vec::new();
        for pose in poses {
            if !balls.contains(&pose.ball) {
                balls.push(pose.ball);
            }
        }
        let (mut order, mut round) = (Vec::<usize>::with_capacity(poses.len()), Vec::with_capacity(poses.len()));
        let mut visited = vec![false; poses.len()];
        for turn in 0.. {
            if order.len() == poses.len() {
                break;
            }
            for &ball in &balls {
                let travel =
                    |k: usize| order.last().map_or(0.0, |&last| joint_travel(&poses[last].approach, &poses[k].approach));
                let unvisited = (0..poses.len()).filter(|&k| !visited[k] && poses[k].ball == ball);
                if let Some(next) = unvisited.min_by(|&a, &b| travel(a).total_cmp(&travel(b))) {
                    visited[next] = true;
                    order.push(next);
                    round.push(turn);
                }
            }
        }
        Tour { poses, order, round }
    }

    /// The motion that ends at position `k`, rad.
    fn motion(&self, k: usize) -> f64 {
        self.between(k.wrapping_sub(1), k)
    }

    /// The motion between the poses at two positions, rad; zero if a position is beyond either end.
    fn between(&self, a: usize, b: usize) -> f64 {
        match (self.order.get(a), self.order.get(b)) {
            (Some(&a), Some(&b)) => joint_travel(&self.poses[a].approach, &self.poses[b].approach),
            _ => 0.0,
        }
    }

    /// Exchanges two poses of one ball or two of one round, if that shortens the tour.
    fn exchange(&mut self) -> bool {
        let mut shortened = false;
        for i in 0..self.order.len() {
            for j in i + 1..self.order.len() {
                if self.round[i] != self.round[j] && self.poses[self.order[i]].ball != self.poses[self.order[j]].ball {
                    continue;
                }
                // For neighbours the motion between them is the same before and after, so it may count twice.
                let around = |tour: &Self| -> f64 { [i, i + 1, j, j + 1].iter().map(|&k| tour.motion(k)).sum() };
                let before = around(self);
                self.order.swap(i, j);
                if around(self) < before - SHORTER {
                    shortened = true;
                } else {
                    self.order.swap(i, j);
                }
            }
        }
        shortened
    }

    /// Reverses consecutive rounds, if that shortens the tour.
    fn reverse(&mut self) -> bool {
        let mut shortened = false;
        let ends = |round: &[usize], k: usize| k == 0 || k == round.len() || round[k - 1] != round[k];
        for from in 0..self.order.len() {
            for to in from + 1..=self.order.len() {
                if !ends(&self.round, from) || !ends(&self.round, to) {
                    continue;
                }
                let before = self.motion(from) + self.motion(to);
                let after = self.between(from.wrapping_sub(1), to - 1) + self.between(from, to);
                if after < before - SHORTER {
                    self.order[from..to].reverse();
                    self.round[from..to].reverse();
                    shortened = true;
                }
            }
        }
        shortened
    }
}

/// Largest joint motion between two postures, rad.
fn joint_travel(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn pose(ball: usize, q: f64) -> PlannedPose {
        PlannedPose {
            id: format!("{ball}@{q}"),
            ball: Some(ball),
            payload: 0,
            contact: vec![q],
            approach: vec![q],
            reserve: false,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        }
    }

    fn travel(poses: &[PlannedPose], order: &[usize]) -> f64 {
        order.windows(2).map(|w| joint_travel(&poses[w[0]].approach, &poses[w[1]].approach)).sum()
    }

    #[test]
    fn the_balls_take_turns_and_each_pose_comes_once() {
        let poses = [pose(7, 0.0), pose(7, 3.0), pose(7, 1.0), pose(2, 2.5), pose(2, 0.2)];
        assert_eq!(interleave(&poses), [0, 4, 2, 3, 1]);
        assert!(interleave(&[]).is_empty());
    }

    #[test]
    fn every_round_has_each_ball_once_and_each_pose_comes_once() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for balls in [1, 2, 5] {
            let poses: Vec<_> = (0..6 * balls).map(|k| pose(k % balls, random.random())).collect();
            let order = interleave_short(&poses);
            for round in order.chunks(balls) {
                let mut seen: Vec<Option<usize>> = round.iter().map(|&k| poses[k].ball).collect();
                seen.sort_unstable();
                assert!(seen.into_iter().eq((0..balls).map(Some)), "{round:?}");
            }
            let mut all = order.clone();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..poses.len()));
            assert!(travel(&poses, &order) <= travel(&poses, &interleave(&poses)));
        }
        assert!(interleave_short(&[]).is_empty());
    }

    #[test]
    fn no_order_in_rounds_of_a_small_tour_is_much_shorter() {
        // All 3! x 3! x 2^3 orders of three rounds of two balls.
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut lengths = [0.0, 0.0];
        for _ in 0..200 {
            let poses: Vec<_> = (0..6).map(|k| pose(k % 2, random.random())).collect();
            let of = |ball: usize| -> Vec<Vec<usize>> {
                let [a, b, c] = [ball, ball + 2, ball + 4];
                vec![vec![a, b, c], vec![a, c, b], vec![b, a, c], vec![b, c, a], vec![c, a, b], vec![c, b, a]]
            };
            let mut shortest = f64::INFINITY;
            for (x, y) in of(0).iter().flat_map(|x| of(1).into_iter().map(move |y| (x.clone(), y))) {
                for first in 0..8 {
                    let round = |r: usize| if first >> r & 1 == 0 { [x[r], y[r]] } else { [y[r], x[r]] };
                    shortest = shortest.min(travel(&poses, &(0..3).flat_map(round).collect::<Vec<_>>()));
                }
            }
            let found = travel(&poses, &interleave_short(&poses));
            assert!(found >= shortest - SHORTER, "{found} for {shortest}");
            lengths[0] += found;
            lengths[1] += shortest;
        }
        println!("{:.3} of the shortest", lengths[0] / lengths[1]);
        assert!(lengths[0] < 1.2 * lengths[1], "{} for {}", lengths[0], lengths[1]);
    }
}
