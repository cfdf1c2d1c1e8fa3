//! Joints and frames in KRL's structures: millimetres and degrees there, SI here.

use calibench_wire::kuka::Structure;

use crate::robot::FramePose;
use crate::units::{DEG, MM};

const AXES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];
const EXTERNAL: [&str; 6] = ["E1", "E2", "E3", "E4", "E5", "E6"];
const FRAME: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];

/// Returns `{E6AXIS: A1 .., A6 .., E1 0.0 ..}` of joint angles (rad, at most six); axes not given are zero.
pub fn e6axis(joints: &[f64]) -> Structure {
    let angle = |k: usize| joints.get(k).map_or(0.0, |q| q / DEG);
    let axes = AXES.iter().enumerate().map(|(k, name)| (*name, angle(k)));
    Structure::of_reals("E6AXIS", axes.chain(EXTERNAL.map(|name| (name, 0.0))))
}

/// Joint angles (rad) of an E6AXIS; `None` if one is missing.
pub fn joints_of(axes: &Structure) -> Option<[f64; 6]> {
    Some(axes.numbers(AXES)?.map(|angle| angle * DEG))
}

/// `{FRAME: X .., Y .., Z .., A .., B .., C ..}`: A, B, C turn about z, then y, then x, as in [`FramePose`].
pub fn krl_frame(frame: &FramePose) -> Structure {
    let [x, y, z] = frame.xyz.map(|v| v / MM);
    let [a, b, c] = frame.rz_ry_rx.map(|v| v / DEG);
    Structure::of_reals("FRAME", FRAME.into_iter().zip([x, y, z, a, b, c]))
}

/// The frame in a FRAME, POS or E6POS; `None` if a member is missing.
pub fn frame_of(position: &Structure) -> Option<FramePose> {
    let [x, y, z, a, b, c] = position.numbers(FRAME)?;
    Some(FramePose { xyz: [x * MM, y * MM, z * MM], rz_ry_rx: [a * DEG, b * DEG, c * DEG] })
}
