//! The order of probing.

use super::PlannedPose;

/// An order of `poses` that visits the balls in turn: places in `poses`, each once.
///
/// Taken ball by ball, a drift of the robot would look like a displacement of the balls; taken in turn, it falls on all of them
/// alike. Among the unvisited poses of the ball whose turn it is, the one with the shortest joint motion from the last approach
/// comes next (the largest joint angle counts, since all joints move together); of equals the first. It begins with the first pose.
pub fn interleave(poses: &[PlannedPose]) -> Vec<usize> {
    let mut balls: Vec<usize> = Vec::new();
    for pose in poses {
        if !balls.contains(&pose.ball) {
            balls.push(pose.ball);
        }
    }
    let mut order: Vec<usize> = Vec::with_capacity(poses.len());
    let mut visited = vec![false; poses.len()];
    let mut turns = balls.iter().cycle();
    while order.len() < poses.len() {
        let Some(&ball) = turns.next() else { break };
        let travel = |k: usize| order.last().map_or(0.0, |&last| joint_travel(&poses[last].approach, &poses[k].approach));
        let next =
            (0..poses.len()).filter(|&k| !visited[k] && poses[k].ball == ball).min_by(|&a, &b| travel(a).total_cmp(&travel(b)));
        if let Some(next) = next {
            visited[next] = true;
            order.push(next);
        }
    }
    order
}

/// Largest joint motion between two postures, rad.
fn joint_travel(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(ball: usize, q: f64) -> PlannedPose {
        PlannedPose {
            id: format!("{ball}@{q}"),
            ball,
            payload: 0,
            contact: vec![q],
            approach: vec![q],
            reserve: false,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        }
    }

    #[test]
    fn the_balls_take_turns_and_each_pose_comes_once() {
        let poses = [pose(7, 0.0), pose(7, 3.0), pose(7, 1.0), pose(2, 2.5), pose(2, 0.2)];
        assert_eq!(interleave(&poses), [0, 4, 2, 3, 1]);
        assert!(interleave(&[]).is_empty());
    }
}
