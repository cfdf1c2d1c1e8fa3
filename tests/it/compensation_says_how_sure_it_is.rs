//! The predicted uncertainty of a compensated target is what the uncertainties of the parameters do to its TCP, and what the model left
//! unexplained of its own data on top.

use crate::identified::{EFFECTS, calibration, calibration_of, postures, target};
use calibench::compensate::{Compensator, Desired, Fake, Task, WorkFrame};
use calibench::identify::calibration::Calibration;
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use calibench::robot::{FramePose, built_in};
use calibench::units::MM;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// A joint that gives way further stands under another torque, `c dtau/dtheta` of half a per cent and more on a compliant arm; the columns
/// of the fit leave that out, and so does the prediction.
const LINEAR: f64 = 2e-2;

fn fake(calibration: &Calibration, q: &[f64], frame: WorkFrame) -> Fake {
    let mut compensator = Compensator::new(calibration, &Task { frame, ..Task::default() }).unwrap();
    compensator.compensate(&target("t", Desired::Joints(q.to_vec()))).outcome.unwrap()
}

/// TCP of a calibrated arm, world, m.
fn tcp(calibration: &Calibration, q: &[f64]) -> Vector3<f64> {
    let setup = &calibration.setups[0];
    let sample = Sample {
        time_s: Some(3600.0),
        approach: Some(vec![0; q.len()]),
        ..Sample::new("t", q.to_vec(), Measured::Point(Vector3::zeros()))
    };
    let dataset = Dataset {
        robot: calibration.robot.clone(),
        base: setup.base,
        tool: setup.tool,
        gravity: setup.gravity,
        payloads: setup.payloads.clone(),
        samples: vec![sample],
        ..Dataset::default()
    };
    -calibration.predict(&[NamedDataset::new("cell", &dataset)], Use::All).unwrap().residuals[0]
}

#[test]
fn it_is_the_covariance_of_the_parameters_carried_to_the_tcp() {
    // What acts through the compliance multiplies two numbers that are both uncertain; the fit's columns hold one of them, and so does
    // the prediction.
    let effects: Vec<&str> = EFFECTS.into_iter().filter(|id| *id != "payload_mass").collect();
    let mut calibration = calibration_of(built_in("kr6_r700").unwrap(), &effects, 1);
    let m = calibration.estimates.len();
    // Neighbours are correlated by -0.4.
    calibration.correlation = DMatrix::from_fn(m, m, |r, c| [1.0, -0.4].get(r.abs_diff(c)).copied().unwrap_or(0.0));
    for q in postures(5, 7) {
        let told = fake(&calibration, &q, WorkFrame::World);
        let differences: Vec<Vector3<f64>> = (0..m)
            .map(|k| {
                let at = |sign: f64| {
                    let mut moved = calibration.clone();
                    moved.estimates[k].value += sign * moved.estimates[k].sigma;
                    tcp(&moved, &told.q)
                };
                0.5 * (at(1.0) - at(-1.0))
            })
            .collect();
        let mut covariance = Matrix3::zeros();
        for (r, a) in differences.iter().enumerate() {
            for (c, b) in differences.iter().enumerate() {
                covariance += a * b.transpose() * calibration.correlation[(r, c)];
            }
        }
        let (worst, three_d) = (covariance.symmetric_eigenvalues().max().sqrt(), covariance.trace().sqrt());
        let near = |told: f64, found: f64| assert!((told / found - 1.0).abs() < LINEAR, "{told} told, {found} found");
        near(told.uncertainty.worst_axis, worst);
        near(told.uncertainty.three_d, three_d);
    }
}

#[test]
fn what_the_model_left_of_its_data_is_added() {
    let mut calibration = calibration(2);
    let q = &postures(1, 8)[0];
    let frame = WorkFrame::Base(FramePose::default());
    let plain = fake(&calibration, q, frame).uncertainty;
    calibration.rms = 0.3 * MM;
    assert_eq!(fake(&calibration, q, frame).uncertainty, plain, "chi-square of one: the noise explains all of it");
    calibration.chi2_per_dof = 9.0;
    let added = fake(&calibration, q, frame).uncertainty;
    let floor = 0.3 * MM * (8f64 / 9.0).sqrt();
    assert!((added.three_d - plain.three_d.hypot(floor)).abs() < 1e-12);
    assert!((added.worst_axis - plain.worst_axis.hypot(floor / 3f64.sqrt())).abs() < 1e-12);
    calibration.noise_stated = false;
    assert!((fake(&calibration, q, frame).uncertainty.three_d - plain.three_d.hypot(0.3 * MM)).abs() < 1e-12);
}

/// From the robot's root it does not matter where in the world the base stands.
#[test]
fn the_place_of_the_base_counts_only_in_the_world() {
    let mut calibration = calibration(3);
    let q = &postures(1, 9)[0];
    let of = |calibration: &Calibration, frame| fake(calibration, q, frame).uncertainty.three_d;
    let root = WorkFrame::Base(FramePose::default());
    let (world_before, root_before) = (of(&calibration, WorkFrame::World), of(&calibration, root));
    calibration.estimates.iter_mut().filter(|e| e.effect == "base_frame").for_each(|e| e.sigma *= 10.0);
    assert_eq!(of(&calibration, root), root_before);
    assert!(of(&calibration, WorkFrame::World) > 2.0 * world_before);
}
