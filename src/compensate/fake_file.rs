//! `FAKE.csv`: every target with its status, the target to be commanded, and its uncertainty.

use super::targets_file::POSE;
use super::{Compensated, Target, Uncertainty};
use crate::robot::{FramePose, JointKind, Pose, Robot};
use crate::units::{DEG, MM, decimal};

/// Targets and their results as the text of a CSV file, in order and complete.
///
/// | column | meaning |
/// |---|---|
/// | `id` | of the target |
/// | `status` | `ok`, or why it was not compensated (see [`super::Refusal`]): the columns of the fake target are then empty |
/// | `warnings` | `out_of_range`, `near_singular`, or both, or nothing |
/// | `x_mm` ... `c_deg` | the fake target, in the frame in which targets are given |
/// | `q1_deg` ... | the corresponding joints; `q1_mm` of a prismatic one |
/// | `s` `t` | their status and turn, for arms that have them |
/// | `sigma_worst_mm` `sigma_3d_mm` | predicted one-sigma of the TCP along its worst direction, and of all three together; empty if `out_of_range` |
/// | `shift_mm` | distance of the fake TCP from the desired one |
/// | `payload` | as named in the row |
/// | `target_x_mm` ... `target_c_deg` | the desired target |
pub fn fake_csv(robot: &Robot, targets: &[Target], results: &[Compensated]) -> String {
    let pose = POSE.map(str::to_owned).to_vec();
    let of_target = POSE.map(|name| format!("target_{name}")).to_vec();
    let own = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let header = [
        own(&["id", "status", "warnings"]),
        pose,
        robot.joint_columns(),
        own(&["s", "t", "sigma_worst_mm", "sigma_3d_mm", "shift_mm", "payload"]),
        of_target,
    ]
    .concat();
    let mut table = csv::Writer::from_writer(Vec::new());
    let into_memory = "a table in memory takes any row of its width";
    table.write_record(&header).expect(into_memory);
    for (target, result) in targets.iter().zip(results) {
        let warnings: Vec<&str> = result.warnings.names().collect();
        let mut row = vec![target.id.clone()];
        match &result.outcome {
            Ok(fake) => {
                row.extend(["ok".into(), warnings.join(" ")]);
                row.extend(pose_fields(&fake.pose));
                let position = |(q, kind): (&f64, JointKind)| match kind {
                    JointKind::Revolute => degrees(*q),
                    JointKind::Prismatic => millimetres(*q),
                };
                row.extend(fake.q.iter().zip(robot.kinds()).map(position));
                let bits = |of: fn(&crate::robot::inverse::StatusTurn) -> u8| {
                    fake.status_turn.as_ref().map_or(String::new(), |s| of(s).to_string())
                };
                row.extend([bits(|s| s.status), bits(|s| s.turn)]);
                let known = |of: fn(&Uncertainty) -> f64| result.uncertainty().map_or(String::new(), |u| millimetres(of(u)));
                row.extend([known(|u| u.worst_axis), known(|u| u.three_d), millimetres(fake.shift)]);
            }
            Err(refusal) => {
                row.extend([refusal.name().to_owned(), warnings.join(" ")]);
                row.resize(header.len() - 7, String::new());
            }
        }
        row.push(target.payload.as_ref().map_or(String::new(), |p| p.name.clone()));
        row.extend(pose_fields(&result.desired));
        table.write_record(&row).expect(into_memory);
    }
    let bytes = table.into_inner().expect("memory takes what is left");
    String::from_utf8(bytes).expect("made of text")
}

/// x, y, z, mm, and a, b, c, deg.
fn pose_fields(pose: &Pose) -> [String; 6] {
    let FramePose { xyz, rz_ry_rx } = FramePose::from_pose(pose);
    let ([x, y, z], [a, b, c]) = (xyz.map(millimetres), rz_ry_rx.map(degrees));
    [x, y, z, a, b, c]
}

/// Six decimals: a nanometre.
fn millimetres(si: f64) -> String {
    decimal(si / MM, 6)
}

/// Eight decimals: 2e-10 rad, less than a nanometre at the end of an arm of a metre.
fn degrees(si: f64) -> String {
    decimal(si / DEG, 8)
}
