//! Masses for an arm whose description lists none, guessed from its geometry.
//!
//! What a calibration needs of the masses is the pattern of the torques over the postures: their size goes into the compliances.
//! That pattern is hardly a matter of the masses. Of the four built-in robots, whose masses are published, the guess correlates
//! with the listed torques by 0.97 and more in joints 2 and 3, which bear almost all of the weight.
//!
//! Half of the mass lies in the joints, as motor and gearbox, half along the lengths between their axes. Both are the lighter the
//! less of the arm is outboard of them, by [`AT_TIP`] + the share of the length that is outboard. With the listed mass in all, the
//! torques of joints 2 to 4 of the built-in robots were 0.7 to 1.2 of the listed ones in size.

use nalgebra::Vector3;

use super::arm::LIGHTEST_ARM;
use super::{JointKind, Robot};

/// Weight of what is at the flange; the share of the arm's length that is outboard adds to it: 1 at the shoulder.
const AT_TIP: f64 = 0.2;
/// Share of the mass that is in the joints.
const IN_JOINTS: f64 = 0.5;
/// Sine below which the axes of two joints are taken for parallel: where along them the arm lies is then a convention.
const PARALLEL: f64 = 1e-2;
/// Distance below which two axes meet, m.
const MEET: f64 = 1e-4;
/// Pieces into which a length is cut to weigh it.
const PIECES: usize = 8;

/// Mass of a moving arm as a function of the length that it stretches: `factor * length^exponent`, kg and m.
struct Weight {
    factor: f64,
    exponent: f64,
}

impl Weight {
    /// The mass of an arm of a length (m), kg.
    fn total(&self, length: f64) -> f64 {
        self.factor * length.powf(self.exponent)
    }

    /// Arms for machining and handling, six joints and a wrist whose axes meet. Through the KR 6 R700 (34 kg of its 50 kg move,
    /// 0.82 m) and the FANUC R-2000iC/165F (about 1,090 kg, not looked up, of which the same share is taken to move; 3.11 m).
    const INDUSTRIAL: Weight = Weight { factor: 54.0, exponent: 2.3 };
    /// Light arms: all others. Fitted to UR5 (17.0 kg, 1.10 m), UR10 (28.4 kg, 1.56 m) and Panda (16.1 kg, 1.06 m).
    const LIGHT: Weight = Weight { factor: 14.7, exponent: 1.5 };

    fn of(robot: &Robot) -> Self {
        if has_industrial_wrist(robot) { Weight::INDUSTRIAL } else { Weight::LIGHT }
    }
}

/// True if an arm has six joints, all of which turn, and its last three axes meet.
fn has_industrial_wrist(robot: &Robot) -> bool {
    let [.., fifth, sixth] = robot.links.as_slice() else { return false };
    let meet = [fifth.mdh.a, fifth.mdh.d, sixth.mdh.a].iter().all(|length| length.abs() < MEET);
    robot.joints() == 6 && robot.first_prismatic().is_none() && meet
}

/// A straight piece of the arm, or a joint.
struct Part {
    /// The link that carries it.
    link: usize,
    /// Its ends in that link's frame, m; a joint's are the same.
    ends: [Vector3<f64>; 2],
    is_joint: bool,
}

impl Part {
    fn length(&self) -> f64 {
        (self.ends[1] - self.ends[0]).norm()
    }
}

/// The parts of an arm in their order: of every link the piece along its axis, its joint, and the piece across to the next axis.
///
/// Left out are the column that carries joint 2, along the first axis, and the position of a prismatic joint. Of a group of
/// parallel axes the lengths along them count once, at the last: how a table shares them out is a convention.
fn parts(robot: &Robot) -> Vec<Part> {
    let is_parallel = |i: usize| robot.links.get(i).is_some_and(|l| l.mdh.alpha.sin().abs() < PARALLEL);
    let mut all = Vec::with_capacity(3 * robot.joints());
    // Where the arm comes to the axis, along z of the frame, m.
    let mut height = 0.0;
    for (i, link) in robot.links.iter().enumerate() {
        let along = if i == 0 || link.mdh.kind == JointKind::Prismatic { 0.0 } else { link.mdh.d };
        height = if i > 0 && is_parallel(i) { height * link.mdh.alpha.cos() - along } else { -along };
        if !is_parallel(i + 1) {
            all.push(Part { link: i, ends: [Vector3::z() * height, Vector3::zeros()], is_joint: false });
            height = 0.0;
        }
        let joint = Vector3::z() * height;
        all.push(Part { link: i, ends: [joint, joint], is_joint: true });
        if let Some(next) = robot.links.get(i + 1) {
            all.push(Part { link: i, ends: [joint, joint + Vector3::x() * next.mdh.a], is_joint: false });
        }
    }
    all
}

/// Gives an arm guessed masses and marks it so, unless its description lists masses, or it is too small to weigh anything. The
/// same geometry always gets the same masses.
pub(super) fn guess_masses(robot: &mut Robot) {
    let parts = parts(robot);
    let reach: f64 = parts.iter().map(Part::length).sum();
    let total = Weight::of(robot).total(reach);
    if robot.has_masses() || !total.is_finite() || total < LIGHTEST_ARM {
        return;
    }
    // Mass and first moment of every link, in shares of the whole and m.
    let mut bodies = vec![(0.0, Vector3::zeros()); robot.joints()];
    let mut outboard = reach;
    for part in &parts {
        let length = part.length();
        let share = if part.is_joint { IN_JOINTS / robot.joints() as f64 } else { (1.0 - IN_JOINTS) * length / reach };
        for piece in 0..PIECES {
            let at = (piece as f64 + 0.5) / PIECES as f64;
            let mass = share / PIECES as f64 * (AT_TIP + (outboard - at * length) / reach);
            bodies[part.link].0 += mass;
            bodies[part.link].1 += part.ends[0].lerp(&part.ends[1], at) * mass;
        }
        outboard -= length;
    }
    let whole: f64 = bodies.iter().map(|(mass, _)| mass).sum();
    for (link, (mass, moment)) in robot.links.iter_mut().zip(bodies) {
        (link.mass, link.com) = (mass / whole * total, moment / mass);
    }
    robot.masses_guessed = true;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::kinematics::Posture;
    use crate::robot::sites::SiteIndex;
    use crate::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
    use crate::robot::{BUILT_IN, FramePose, Link, MdhLink, built_in};

    /// Rounding of sums of torques of some hundred newton metres, N·m.
    const SAME: f64 = 1e-9;
    const POSTURES: usize = 200;

    fn stripped(robot: &Robot) -> Robot {
        let mut bare = robot.clone();
        for link in &mut bare.links {
            (link.mass, link.com) = (0.0, Vector3::zeros());
        }
        bare
    }

    fn guessed(robot: &Robot) -> Robot {
        let mut guess = stripped(robot);
        guess_masses(&mut guess);
        guess
    }

    fn total(robot: &Robot) -> f64 {
        robot.links.iter().map(|l| l.mass).sum()
    }

    /// Torques of an arm at postures spread within its limits, N·m, one series a joint.
    fn torques(robot: &Robot) -> Vec<Vec<f64>> {
        let n = robot.joints();
        let (mut posture, mut loads) = (Posture::new(robot), Loads::new(n));
        let nominal = vec![0.0; SiteIndex::new(n).len()];
        let mut all = vec![Vec::new(); n];
        for k in 0..POSTURES {
            let spread = |i: usize| ((k as f64 + 0.5) * ((i * i + i + 2) as f64).sqrt()).fract();
            let q: Vec<f64> = { robot.links.iter() }
                .enumerate()
                .map(|(i, l)| l.limits[0] + (l.limits[1] - l.limits[0]) * spread(i))
                .collect();
            posture.set(robot, &FramePose::default(), &FramePose::default(), &q, &nominal);
            loads.compute(robot, &posture, &Payload::none(), &DEFAULT_GRAVITY, &Vector3::zeros());
            all.iter_mut().zip(&loads.tau).for_each(|(series, tau)| series.push(*tau));
        }
        all
    }

    fn rms_about_mean(x: &[f64]) -> f64 {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
    }

    fn correlation(x: &[f64], y: &[f64]) -> f64 {
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let (mx, my) = (mean(x), mean(y));
        let product = x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / x.len() as f64;
        product / (rms_about_mean(x) * rms_about_mean(y))
    }

    #[test]
    fn the_guess_is_near_what_is_published() {
        for name in BUILT_IN {
            let listed = built_in(name).unwrap();
            let guess = guessed(&listed);
            assert!(guess.masses_guessed && guess.has_masses() && !guess.lists_masses(), "{name}");
            let ratio = total(&guess) / total(&listed);
            assert!((0.5..2.0).contains(&ratio), "{name}: {:.1} kg, listed {:.1}", total(&guess), total(&listed));
            assert_eq!(guess, guessed(&listed), "{name}: the same every time");
            for (j, (x, y)) in torques(&listed).iter().zip(torques(&guess)).enumerate().skip(1).take(2) {
                let size = rms_about_mean(&y) / rms_about_mean(x);
                assert!(correlation(x, &y) > 0.97, "{name} joint {}: correlation {:.3}", j + 1, correlation(x, &y));
                assert!((0.5..2.0).contains(&size), "{name} joint {}: {size:.2} of the size", j + 1);
            }
        }
    }

    #[test]
    fn listed_masses_stay_and_dummies_do_not() {
        let listed = built_in("ur10").unwrap();
        let mut same = listed.clone();
        guess_masses(&mut same);
        assert_eq!(same, listed);
        let mut dummies = stripped(&listed);
        dummies.links.iter_mut().for_each(|link| link.mass = 1e-3);
        guess_masses(&mut dummies);
        assert_eq!(dummies, guessed(&listed), "grams are dummies");
    }

    #[test]
    fn lengths_along_parallel_axes_may_be_shared_out_in_any_way() {
        let drawn = built_in("ur5").unwrap();
        let mut shifted = drawn.clone();
        // Axes 2, 3 and 4 are parallel: the arm is the same.
        shifted.links[1].mdh.d += 1.5;
        shifted.links[3].mdh.d -= 1.5;
        let apart = |a: &Robot, b: &Robot| {
            let (a, b) = (torques(a), torques(b));
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        assert!(apart(&guessed(&drawn), &guessed(&shifted)) < SAME);
    }

    #[test]
    fn an_arm_that_has_no_length_gets_none() {
        let slide = Link {
            mdh: MdhLink { kind: JointKind::Prismatic, d: 2.0, ..MdhLink::default() },
            limits: [0.0, 1.0],
            mass: 0.0,
            com: Vector3::zeros(),
        };
        let rail = Robot { links: vec![slide.clone()], ..Robot::default() };
        assert_eq!(guessed(&rail), rail);
        // On a rail the arm weighs what it weighs without one.
        let arm = built_in("ur5").unwrap();
        let mut on_rail = stripped(&arm);
        on_rail.links.insert(0, slide);
        guess_masses(&mut on_rail);
        let ratio = total(&on_rail) / total(&guessed(&arm));
        assert!(on_rail.masses_guessed && (0.9..1.3).contains(&ratio), "{ratio}");
        assert_eq!(guessed(&Robot::default()), Robot::default(), "no joints");
    }
}
