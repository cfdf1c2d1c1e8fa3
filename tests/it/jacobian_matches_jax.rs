//! The 31 columns of the position Jacobian equal those that JAX differentiates automatically.

use crate::works::golden;
use calibench::robot::kinematics::Posture;

/// JAX and the closed form agree to 1e-13 on entries up to 10 m per unit.
const TOLERANCE: f64 = 1e-9;

#[test]
fn all_columns_match() {
    let model = golden::golden_model();
    let (jacobians, poses) = (golden::read("jac31_64.json"), golden::read("fk_torque_200.json"));
    // The Jacobians are those of the first configurations.
    let (joints, holding) = (golden::rows(&poses["q"]), golden::rows(&poses["tau_pinocchio"]));
    let mut posture = Posture::new(&model.robot);
    for (values, key) in [(model.nominal(), "nominal"), (model.table8(), "table8")] {
        let expected = golden::rows(&jacobians[key]["J"]);
        assert_eq!(expected.len(), 64);
        for (k, (q, expected)) in joints.iter().zip(&expected).enumerate() {
            posture.set(&model.robot, &model.base, &model.tool, q, &model.deviations(&values, &holding[k]));
            for (c, parameter) in model.parameters.iter().enumerate() {
                let weight = match parameter.site {
                    calibench::robot::sites::Site::Mdh(j, _) if parameter.compliance => holding[k][usize::from(j)],
                    _ => 1.0,
                };
                let column = posture.column(parameter.site) * weight;
                for axis in 0..3 {
                    let difference = (column[axis] - expected[axis * model.parameters.len() + c]).abs();
                    assert!(difference < TOLERANCE, "{key} {k} {}: {difference:e}", parameter.name);
                }
            }
        }
    }
}
