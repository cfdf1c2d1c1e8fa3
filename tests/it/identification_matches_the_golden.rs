//! Identifying the benchmark's 80 centrings gives the parameters and sigmas that scipy and an independent Gauss-Newton found,
//! and the paper's 31 independent parameters are found from the Jacobian's rank alone.

use crate::works::golden;
use std::sync::Arc;

use calibench::identify::fit::fit;
use calibench::identify::problem::{Problem, Use};
use calibench::identify::{Model, TorquePosture, identify};
use calibench::measure::dataset::{Ball, Dataset, Measured, NamedDataset, Noise, Sample};

/// The goldens were converged to rounding; the columns are scaled to metres, so this is in metres of TCP displacement per column.
const SAME_MINIMUM: f64 = 1e-9;

fn measured() -> Dataset {
    let model = golden::golden_model();
    let text = std::fs::read_to_string(golden::folder().join("inputs/w2_measured.csv")).unwrap();
    let samples = text.lines().skip(1).enumerate().map(|(k, line)| {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
        Sample::new(format!("{k}"), cells[1..].to_vec(), Measured::Ball { ball: cells[0] as usize, reading: None })
    });
    let samples: Vec<Sample> = samples.collect();
    Dataset {
        robot: Arc::new(model.robot.clone()),
        robot_reference: "kr6_r700".into(),
        gravity: model.gravity,
        base: model.base,
        tool: model.tool,
        payloads: vec![model.payload.clone()],
        balls: model
            .balls
            .iter()
            .enumerate()
            .map(|(k, p)| Ball { id: (k + 1).to_string(), position: *p, sigma: 0.0, free: false })
            .collect(),
        noise: Noise { ball: Some(1e-6), ..Noise::default() },
        samples,
        ..Dataset::default()
    }
}

/// The paper's model with the torques of the drawing's posture, as the golden defines them.
fn frozen() -> Model {
    Model { torque_posture: TorquePosture::Drawn, ..Model::paper() }
}

/// The golden's name of one of our parameters.
fn golden_name(name: &str) -> String {
    let base = [
        ("base_x", "x_0W"),
        ("base_y", "y_0W"),
        ("base_z", "z_0W"),
        ("base_rz", "alpha_0W"),
        ("base_ry", "beta_0W"),
        ("base_rx", "gamma_0W"),
    ];
    if let Some((_, golden)) = base.iter().find(|(ours, _)| *ours == name) {
        return (*golden).into();
    }
    let digit = name.find(|c: char| c.is_ascii_digit()).unwrap();
    let (kind, index) = name.split_at(digit);
    format!("{}_{index}", if kind == "theta" { "theta_offs" } else { kind })
}

#[test]
fn parameters_and_sigmas_are_those_of_scipy() {
    let (dataset, truth) = (measured(), golden::read("identify_w2.json"));
    let calibration = identify(&[NamedDataset::new("w2", &dataset)], &frozen()).unwrap();
    let names: Vec<&str> = truth["names"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    let (rho, sigma) = (golden::numbers(&truth["rho"]), golden::numbers(&truth["stddev"]));
    assert_eq!(calibration.rank, 31, "unresolved: {:?}", calibration.unresolved);
    assert!(calibration.iterations <= 5, "four Gauss-Newton steps reach the minimum, a fifth confirms it");
    let s2 = calibration.chi2_per_dof;
    for (k, name) in names.iter().enumerate() {
        let ours = calibration.estimates.iter().find(|e| golden_name(&e.name) == *name).unwrap();
        // The golden's torque is the holding torque, ours the load's: compliances change sign.
        let sign = if name.starts_with("c_") { -1.0 } else { 1.0 };
        assert!((sign * ours.value - rho[k]).abs() < SAME_MINIMUM, "{name}: {} against {}", ours.value, rho[k]);
        assert!((ours.sigma * s2.sqrt() / sigma[k] - 1.0).abs() < 1e-6, "{name}: sigma {} against {}", ours.sigma, sigma[k]);
    }
    let rms = truth["residual_rms_m"].as_f64().unwrap();
    assert!((calibration.rms / 3f64.sqrt() - rms).abs() < 1e-12);
    let singular = golden::numbers(&truth["singular_values"]);
    assert!((calibration.observability.o3 / singular[30] - 1.0).abs() < 1e-3, "evaluated at the solution, not at the drawing");
}

#[test]
fn what_the_paper_leaves_out_is_found_by_rank() {
    let dataset = measured();
    let mut model = Model::of(&["base_frame", "mdh", "joint_compliance", "tool_frame"]);
    // As free as the links: no plausible size stands in for what the data do not tell.
    model.width.insert("tool_frame".into(), f64::INFINITY);
    let calibration = identify(&[NamedDataset::new("w2", &dataset)], &model).unwrap();
    let left_out: Vec<&str> = calibration.unresolved.iter().map(|g| g[0].as_str()).collect();
    for name in ["alpha0", "a0", "d1", "theta1", "d2", "c1", "tool_z"] {
        assert!(left_out.contains(&name), "{name} should be unresolved; got {left_out:?}");
    }
    let partner = |name: &str| calibration.unresolved.iter().find(|g| g[0] == name).unwrap()[1..].to_vec();
    assert_eq!(partner("d2"), ["d3"]);
    assert!(partner("d1").iter().any(|p| p == "base_z"));
    assert!(partner("tool_z").iter().any(|p| p == "d6"));
    assert!(partner("c1").is_empty(), "no torque about a vertical axis");
}

#[test]
fn a_tool_on_axis_six_loses_four_parameters() {
    let mut dataset = measured();
    dataset.tool.xyz = [0.0, 0.0, -0.15];
    let problem = Problem::new(&[NamedDataset::new("axis", &dataset)], &Model::paper(), Use::Fit).unwrap();
    let fit = fit(&problem).unwrap();
    // The TCP is then one point of link 5: theta6 and c6 move nothing, d5 moves it as alpha5 does, theta5 as a5 does.
    assert_eq!(fit.rank(problem.parameters()), 27);
    let left_out: Vec<&str> = fit.unresolved.iter().map(|u| problem.parameters()[u.parameter].name.as_str()).collect();
    for name in ["theta6", "c6", "d5", "theta5"] {
        assert!(left_out.contains(&name), "{name}: {left_out:?}");
    }
}

/// Of a parameter's own uncertainty, the others held, with the loads of the arm as it stands where the parameter is moved. The columns of a
/// step leave out how a parameter changes those loads, which costs a sixtieth.
const NO_FARTHER: f64 = 0.05;

/// No matter where and how often the arm was weighed on the way.
#[test]
fn no_parameter_would_rather_be_elsewhere_with_the_arm_weighed_where_it_stands() {
    let dataset = measured();
    let mut problem = Problem::new(&[NamedDataset::new("w2", &dataset)], &Model::paper(), Use::Fit).unwrap();
    let fit = fit(&problem).unwrap();
    assert!(fit.iterations <= 5, "weighed at every step, not after several: {} steps", fit.iterations);
    problem.update_loads(&fit.values);
    let noise = dataset.noise.ball.unwrap();
    let chi2 = |values: &[f64]| problem.residuals(values).iter().map(|r| (r / noise).norm_squared()).sum::<f64>();
    let at = chi2(&fit.values);
    assert!((fit.chi2 / at - 1.0).abs() < 1e-8, "{} is said, {at} is", fit.chi2);
    for &p in &fit.kept {
        let moved = |by: f64| {
            let mut values = fit.values.clone();
            values[p] += by;
            chi2(&values)
        };
        // Held alone a parameter is known far better: chi-square rises by one within its conditional sigma.
        let probe = 1e-6;
        let curvature = (moved(probe) + moved(-probe) - 2.0 * at) / (2.0 * probe * probe);
        let conditional = curvature.sqrt().recip();
        let h = 1e-2 * conditional;
        let off = (moved(h) - moved(-h)) / (4.0 * h * curvature);
        assert!(off.abs() < NO_FARTHER * conditional, "{} by {} of its sigma", problem.parameters()[p].name, off / conditional);
    }
}
