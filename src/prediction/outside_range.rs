//! Poses outside the joint ranges in which a calibration was identified.

use crate::effects::EffectId;
use crate::effects::facts::Follows;
use crate::effects::registry::Registry;
use crate::identify::Model;
use crate::measure::dataset::{NamedDataset, Sample};
use crate::robot::{JointKind, Robot};

/// A joint that moves beyond its range during identification.
#[derive(Debug, Clone, PartialEq)]
pub struct OutsideRange {
    /// The joint, counted from 1.
    pub joint: usize,
    /// Kind of the joint.
    pub kind: JointKind,
    /// Smallest and largest position in the identification, rad, or m of a prismatic joint.
    pub identified: [f64; 2],
    /// Number of poses in which it is outside.
    pub poses: usize,
    /// Largest distance outside, rad or m.
    pub farthest: f64,
}

/// Extrapolation of a calibration beyond the joint ranges of its identification.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extrapolation {
    /// Number of poses judged.
    pub poses: usize,
    /// Number of poses with at least one joint outside.
    pub outside: usize,
    /// One entry per joint that is outside in any pose.
    pub joints: Vec<OutsideRange>,
    /// Effects of the model whose dependence on a joint angle is known only within the range of identification; beyond
    /// it, their values are extrapolated.
    pub shapes: Vec<EffectId>,
    /// The families to which these effects belong.
    pub registry: Registry,
}

/// Distance outside a range that is tolerated, rad or m: an arc minute.
const SLACK: f64 = 3e-4;

impl Extrapolation {
    /// Compares poses (rad or m, N) with the joint ranges in which a model was identified.
    ///
    /// ```
    /// use calibench::identify::Model;
    /// use calibench::prediction::Extrapolation;
    /// use calibench::robot::built_in;
    /// use calibench::units::DEG;
    ///
    /// // Identified within 30 deg of zero, applied with joint 2 at 40 deg.
    /// let robot = built_in("ur5").ok_or("built in")?;
    /// let q = [0.0, 40.0, 0.0, 0.0, 0.0, 0.0].map(|q| q * DEG);
    /// let ranges = [[-30.0 * DEG, 30.0 * DEG]; 6];
    /// let beyond = Extrapolation::of(&robot, &ranges, &Model::paper(), [&q[..]].into_iter());
    /// assert_eq!((beyond.outside, beyond.joints.len(), beyond.joints[0].joint), (1, 1, 2));
    /// assert!((beyond.joints[0].farthest - 10.0 * DEG).abs() < 1e-12);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn of<'q>(robot: &Robot, joint_ranges: &[[f64; 2]], model: &Model, poses: impl Iterator<Item = &'q [f64]>) -> Self {
        let none = |(j, range): (usize, &[f64; 2])| OutsideRange {
            joint: j + 1,
            kind: robot.kind(j),
            identified: *range,
            poses: 0,
            farthest: 0.0,
        };
        let mut joints: Vec<OutsideRange> = joint_ranges.iter().enumerate().map(none).collect();
        let (mut count, mut outside) = (0, 0);
        for q in poses {
            count += 1;
            let mut any = false;
            for (q, joint) in q.iter().zip(&mut joints) {
                let by = (q - joint.identified[1]).max(joint.identified[0] - q);
                if by > SLACK {
                    joint.poses += 1;
                    joint.farthest = joint.farthest.max(by);
                    any = true;
                }
            }
            outside += usize::from(any);
        }
        joints.retain(|j| j.poses > 0);
        let of_joint = |id: &EffectId| {
            let Some(family) = model.family(id) else { return false };
            let joint = family.joint(id);
            family.follows.contains(&Follows::JointAngle) && joints.iter().any(|o| joint.is_none_or(|j| j == o.joint))
        };
        let own = |id: &str| {
            let follows = |j: &OutsideRange| {
                let angle = format!("q{}", j.joint);
                let term = |basis: &str| {
                    basis
                        .match_indices(&angle)
                        .any(|(at, _)| !basis[at + angle.len()..].starts_with(|c: char| c.is_ascii_digit()))
                };
                model.own.iter().any(|o| o.name == id && o.terms.iter().any(|t| term(&t.basis)))
            };
            joints.iter().any(follows)
        };
        let shapes = model.effects.iter().filter(|id| of_joint(id) || own(id)).cloned().collect();
        Extrapolation { poses: count, outside, joints, shapes, registry: model.registry.clone() }
    }

    /// Compares the samples of datasets that `takes` selects with those joint ranges.
    pub fn of_samples(
        robot: &Robot,
        joint_ranges: &[[f64; 2]],
        model: &Model,
        datasets: &[NamedDataset<'_>],
        takes: impl Fn(&Sample) -> bool,
    ) -> Self {
        let rows = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| takes(s)));
        Extrapolation::of(robot, joint_ranges, model, rows.map(|s| s.q.as_slice()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_is_outside_by_how_far_and_how_often() {
        let model = Model::of(&["mdh", "harmonic1:2", "harmonic1:1"]);
        let poses = [[0.0, 1.5], [0.5, 1.2], [0.9, -0.2]];
        let found =
            Extrapolation::of(&Robot::default(), &[[-1.0, 1.0], [0.0, 1.0]], &model, poses.iter().map(|q| q.as_slice()));
        assert_eq!((found.poses, found.outside, found.joints.len()), (3, 3, 1));
        assert_eq!((found.joints[0].joint, found.joints[0].poses, found.joints[0].farthest), (2, 3, 0.5));
        assert_eq!(found.shapes, ["harmonic1:2"]);
    }

    #[test]
    fn inside_nothing_is_said() {
        let found = Extrapolation::of(
            &Robot::default(),
            &[[-1.0, 1.0]],
            &Model::of(&["harmonic1:1"]),
            [[0.3]].iter().map(|q| q.as_slice()),
        );
        assert_eq!((found.outside, found.joints.len(), found.shapes.len()), (0, 0, 0));
    }
}
