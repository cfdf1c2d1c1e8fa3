//! The UR5e of the scenarios and the manufacturer's simulator agree where the flange is.

use std::path::Path;

use calibench::robot::kinematics::world_from_tool;
use calibench::robot::robot_file::robot;
use calibench::robot::rotation_vector;

/// Joints (rad) and tool (m, rotation vector in rad) of a UR5e in URSim 5.8, from the state message that `tests/test_primary_parser.cpp`
/// of UniversalRobots/Universal_Robots_Client_Library records; its TCP is the flange.
const JOINTS: [f64; 6] = [-1.6007, -1.7271, -2.203, -0.808, 1.5951, -0.031];
const TOOL: [f64; 6] =
    [-0.143_968_656_7, -0.435_620_060_8, 0.202_030_025_4, -0.001_221_359_7, 3.116_276_528_5, 0.038_891_915_6];

/// The simulator's alpha is 90 deg to nine digits, which is 0.2 nm at this reach.
const SAME: f64 = 1e-9;

#[test]
fn the_flange_is_where_the_simulator_has_it() {
    let ur5e = robot("../scenarios/robots/ur5e.robot.toml", &Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")).unwrap();
    let pose = world_from_tool(&ur5e, &ur5e.root, &ur5e.flange, &JOINTS);
    let turned = rotation_vector(&pose.rotation);
    let is = pose.translation.vector.iter().chain(turned.iter());
    for (is, published) in is.zip(TOOL) {
        assert!((is - published).abs() < SAME, "{is} {published}");
    }
}
