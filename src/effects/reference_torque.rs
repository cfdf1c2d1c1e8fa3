//! The torque that scales load-dependent effects: the largest that gravity exerts on each joint of the arm with a load of a
//! tenth of its mass in front of the flange.

use std::cell::RefCell;

use nalgebra::Vector3;

use crate::robot::kinematics::Posture;
use crate::robot::sites::SiteIndex;
use crate::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
use crate::robot::{FramePose, Link, Robot};

/// Number of postures tried; the largest torque of 512 is within a few per cent of the supremum, and only a scale is
/// needed.
const POSTURES: usize = 512;

/// Distance of the load's centre in front of the flange, m.
const LOAD_BEFORE: f64 = 0.1;
/// Distance of the load's centre from the last axis, m: joint 6 then carries a torque too.
const LOAD_BESIDE: f64 = 0.05;

/// Lower limit of the scale of any joint, N·m: a vertical axis carries no torque at all.
const LEAST: f64 = 1.0;

thread_local! {
    /// The links and torques computed last, cached because a diagnosis builds dozens of effects of one robot.
    static LAST: RefCell<(Vec<Link>, Vec<f64>)> = const { RefCell::new((Vec::new(), Vec::new())) };
}

/// Largest gravity torque of each joint over evenly spread postures, N·m (N).
pub fn reference_torque(robot: &Robot) -> Vec<f64> {
    LAST.with_borrow_mut(|(links, torque)| {
        if *links != robot.links || torque.is_empty() {
            *torque = largest_torque(robot);
            links.clone_from(&robot.links);
        }
        torque.clone()
    })
}

fn largest_torque(robot: &Robot) -> Vec<f64> {
    let n = robot.joints();
    let mass = 0.1 * robot.links.iter().map(|l| l.mass).sum::<f64>();
    // The last axis may point out of the flange or back into the wrist; its offset shows which.
    let outwards = robot.links.last().map_or(1.0, |l| l.mdh.d.signum());
    let com = Vector3::new(LOAD_BESIDE, 0.0, LOAD_BEFORE * outwards);
    let payload = Payload { name: String::new(), mass, com };
    let zero = vec![0.0; SiteIndex::new(n).len()];
    let (mut posture, mut loads) = (Posture::new(robot), Loads::new(n));
    let mut largest = vec![LEAST; n];
    let mut q = vec![0.0; n];
    for k in 0..POSTURES {
        for (i, link) in robot.links.iter().enumerate() {
            q[i] = link.limits[0] + (link.limits[1] - link.limits[0]) * additive_sequence(k, i);
        }
        posture.set(robot, &FramePose::default(), &FramePose::default(), &q, &zero);
        loads.compute(robot, &posture, &payload, &DEFAULT_GRAVITY, &Vector3::zeros());
        for (most, tau) in largest.iter_mut().zip(&loads.tau) {
            *most = most.max(tau.abs());
        }
    }
    largest
}

/// Evenly spread numbers in [0, 1): multiples of the square roots of primes (Weyl).
fn additive_sequence(k: usize, dimension: usize) -> f64 {
    /// Primes whose square roots are the steps of the sequences, one a dimension.
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    ((k as f64 + 0.5) * PRIMES[dimension % PRIMES.len()].sqrt()).fract()
}
