//! Distance of a posture from a singularity.

use nalgebra::{Matrix6, SymmetricEigen};

use super::inverse::LEVER;
use super::kinematics::Posture;
use super::rel_tool::screw;

/// The smallest singular value of the 6 x N Jacobian, with angles of the tool multiplied by a lever of 0.3 m: the motion of
/// the tool (m) per radian of the joints in its least mobile direction of those that it has (six, or as many as joints). It falls to
/// zero at wrist, elbow and shoulder singularities alike, on any arm.
///
/// ```
/// use calibench::robot::inverse::dexterity;
/// use calibench::robot::kinematics::Posture;
/// use calibench::robot::sites::SiteIndex;
/// use calibench::robot::{FramePose, built_in};
///
/// // Axes 4 and 6 of a KR 6 are in line where A5 is zero.
/// let robot = built_in("kr6_r700").ok_or("built in")?;
/// let mut posture = Posture::new(&robot);
/// let nominal = vec![0.0; SiteIndex::new(6).len()];
/// posture.set(&robot, &FramePose::default(), &FramePose::default(), &[0.3, -1.2, 1.4, 0.4, 0.0, 0.5], &nominal);
/// assert!(dexterity(&posture, 6) < 1e-7);
/// # Ok::<(), &str>(())
/// ```
pub fn dexterity(posture: &Posture, joints: usize) -> f64 {
    let mut gram = Matrix6::zeros();
    for i in 0..joints {
        let mut column = screw(posture, i);
        column.fixed_rows_mut::<3>(3).scale_mut(LEVER);
        gram.ger(1.0, &column, &column, 1.0);
    }
    // An arm of fewer than six joints has as many directions, and is not singular for those that it never has.
    let mut squares: Vec<f64> = SymmetricEigen::new(gram).eigenvalues.iter().copied().collect();
    squares.sort_unstable_by(|a, b| b.total_cmp(a));
    squares[joints.clamp(1, squares.len()) - 1].max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use crate::robot::dexterity::dexterity;
    use crate::robot::kinematics::Posture;
    use crate::robot::sites::SiteIndex;
    use crate::robot::{FramePose, built_in};

    #[test]
    fn an_arm_of_five_joints_is_not_singular_everywhere() {
        let whole = built_in("kr6_r700").unwrap();
        let robot = crate::robot::Robot { links: whole.links[..5].to_vec(), ..whole.clone() };
        let mut posture = Posture::new(&robot);
        let mut at = |q: [f64; 5]| {
            let none = FramePose::default();
            posture.set(&robot, &none, &none, &q, &vec![0.0; SiteIndex::new(5).len()]);
            dexterity(&posture, 5)
        };
        assert!(at([0.3, -1.2, 1.4, 0.4, 0.9]) > 0.01);
        // Its arm stretched out.
        let stretched = (0..200).map(|k| at([0.3, -0.8, 0.01 * f64::from(k) - 1.0, 0.0, 0.0])).fold(1.0, f64::min);
        assert!(stretched < 0.01, "{stretched}");
    }

    fn at(q: [f64; 6]) -> f64 {
        let robot = built_in("kr6_r700").unwrap();
        let mut posture = Posture::new(&robot);
        posture.set(&robot, &FramePose::default(), &FramePose::default(), &q, &vec![0.0; SiteIndex::new(6).len()]);
        dexterity(&posture, 6)
    }

    #[test]
    fn all_three_singularities_are_seen() {
        let plain = at([0.0, -1.2, 1.4, 0.4, 0.9, 0.0]);
        assert!(plain > 0.05, "{plain}");
        assert!(at([0.3, -1.2, 1.4, 0.4, 0.0, 0.5]) < 1e-7, "wrist lined up");
        assert!(at([0.3, -1.2, 35f64.atan2(365.0), 0.4, 0.9, 0.5]) < 1e-7, "elbow stretched");
        // Wrist centre on axis 1: 25 + 315 cos A2 + L cos(A2 + A3 - atan2(35, 365)) = 0 (mm).
        let reach = (25.0 + 315.0 * (-1.0f64).cos()) / 365f64.hypot(35.0);
        let third = (-reach).acos() + 35f64.atan2(365.0) + 1.0;
        assert!(at([0.3, -1.0, third, 0.4, 0.9, 0.5]) < 1e-7, "over the shoulder");
    }

    #[test]
    fn it_shrinks_with_the_sine_of_joint_5() {
        let [near, nearer] = [0.1, 0.05].map(|q5| at([0.0, -1.2, 1.4, 0.4, q5, 0.0]));
        assert!((near / nearer - 2.0).abs() < 0.1, "{near} {nearer}");
        assert!(near > 0.015 && near < 0.025, "the default margin of the pool, 0.02, is |sin A5| of about 0.1: {near}");
    }
}
