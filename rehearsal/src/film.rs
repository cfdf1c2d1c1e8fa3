//! The frames of the arm along its motions.

use calibench::measure::campaign::cell::Cell;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::units::{DEG, MM};
use nalgebra::UnitQuaternion;

use crate::motion::Rehearsed;

/// Largest turn of a joint from one picture to the next, rad.
const STEP: f64 = 4.0 * DEG;

/// Unit of the quaternions' components.
const QUATERNION_UNIT: f64 = 1e-4;

/// The arm in every picture.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Film {
    /// For each picture, for the base and each link: origin of the frame in the world, mm, and its quaternion (w, x, y, z) in
    /// units of 1e-4.
    pub pictures: Vec<Vec<i32>>,
    /// The TCP in each picture, world, mm.
    pub tcp: Vec<[i32; 3]>,
    /// Index of the last picture of each motion.
    pub ends: Vec<usize>,
}

impl Film {
    /// The film of the nominal arm.
    pub fn of(cell: &Cell, motions: &[Rehearsed]) -> Self {
        let (robot, dataset) = (&cell.dataset.robot, &cell.dataset);
        let mut posture = Posture::new(robot);
        let nominal = vec![0.0; SiteIndex::new(robot.joints()).len()];
        let mut film = Film::default();
        let mut show = |film: &mut Film, q: &[f64]| {
            posture.set(robot, &dataset.base, &dataset.tool, q, &nominal);
            let mut picture = Vec::with_capacity(7 * (robot.joints() + 1));
            for k in 0..=robot.joints() {
                let pose = posture.frame(k).pose();
                let turn = UnitQuaternion::from_rotation_matrix(&pose.rotation);
                picture.extend(pose.translation.vector.iter().map(|v| (v / MM).round() as i32));
                picture.extend([turn.w, turn.i, turn.j, turn.k].map(|v| (v / QUATERNION_UNIT).round() as i32));
            }
            film.pictures.push(picture);
            film.tcp.push(<[f64; 3]>::from(cell.guards.tcp(q)).map(|v| (v / MM).round() as i32));
        };
        let mut at: Option<&[f64]> = None;
        for motion in motions {
            let (from, to) = (motion.from.as_slice(), motion.to.as_slice());
            if at != Some(from) {
                show(&mut film, from);
            }
            at = Some(to);
            let steps = (motion.turn() / STEP).ceil().max(1.0) as usize;
            for step in 1..=steps {
                let share = step as f64 / steps as f64;
                let q: Vec<f64> = from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect();
                show(&mut film, &q);
            }
            film.ends.push(film.pictures.len() - 1);
        }
        film
    }
}
