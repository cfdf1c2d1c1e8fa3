//! Whatever is in the catalogue: its columns are the derivatives of the exact model, zero size changes nothing, names are unique.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::sync::Arc;

use calibench::effects::{CATALOGUE, Subject, build};
use calibench::identify::{Model, Problem, TorquePosture, Use};
use calibench::measure::{Ball, Dataset, Measured, Sample};
use calibench::robot::{FramePose, Payload, built_in};
use calibench::units::{DEG, MM};
use nalgebra::Vector3;

/// Every family with arguments that exist.
fn ids() -> Vec<String> {
    CATALOGUE
        .iter()
        .flat_map(|f| match f.arguments {
            ":J" => vec![f.id.to_owned(), format!("{}:3", f.id)],
            ":J:k" => vec![format!("{}:2:17", f.id)],
            ":B" => vec![format!("{}:b", f.id)],
            _ => vec![f.id.to_owned()],
        })
        .collect()
}

fn cell() -> Dataset {
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let postures = [
        [10.0, -70.0, 80.0, 20.0, 40.0, 10.0],
        [-35.0, -40.0, 60.0, -70.0, 55.0, 130.0],
        [60.0, -95.0, 110.0, 100.0, -80.0, -20.0],
    ];
    let samples = postures.iter().enumerate().map(|(k, q)| {
        let reading = Some(Vector3::new(1.0, -2.0, 0.5) * 1e-3);
        let mut sample = Sample::new(k.to_string(), q.map(|v| v * DEG).to_vec(), Measured::Ball { ball: 0, reading });
        sample.time_s = Some(600.0 * k as f64);
        sample.approach = Some(vec![1, -1, 1, -1, 1, -1]);
        sample
    });
    Dataset {
        robot,
        base: FramePose { xyz: [-0.5, 0.02, -0.06], rz_ry_rx: [0.3, 0.02, -0.01] },
        tool: FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.1, -0.6, 0.8] },
        payloads: vec![Payload { name: "heavy".into(), mass: 6.0, com: Vector3::new(25.0, 0.0, -70.0) * MM }],
        balls: vec![Ball { id: "b".into(), position: Vector3::new(0.1, 0.2, 0.3), sigma: 0.0, free: false }],
        samples: samples.collect(),
        ..Dataset::default()
    }
}

#[test]
fn columns_are_derivatives_of_the_exact_model() {
    let data = cell();
    for id in ids() {
        // Other deviations present, so that the columns are right where the arm is not as drawn.
        let others: Vec<&str> = ["base_frame", "mdh", "joint_compliance"].into_iter().filter(|o| *o != id).collect();
        let mut effects = vec![id.as_str()];
        effects.extend(others);
        let model = Model { torque_posture: TorquePosture::Drawn, ..Model::of(&effects) };
        let problem = Problem::new(&[("d", &data)], &model, Use::Fit).unwrap();
        let at: Vec<f64> =
            problem.parameters().iter().enumerate().map(|(k, p)| p.spec.prior * ((k as f64 * 1.7).sin())).collect();
        let columns: Vec<usize> = (0..problem.parameters().len()).filter(|&k| problem.parameters()[k].effect == id).collect();
        assert!(!columns.is_empty());
        let exact = problem.plain_jacobian(&at, &columns);
        for (c, &k) in columns.iter().enumerate() {
            let h = problem.parameters()[k].spec.prior * 1e-2;
            let (mut more, mut less) = (at.clone(), at.clone());
            more[k] += h;
            less[k] -= h;
            let (more, less) = (problem.residuals(&more), problem.residuals(&less));
            for s in 0..more.len() {
                let difference = (less[s] - more[s]) / (2.0 * h);
                let column = exact.fixed_view::<3, 1>(3 * s, c).into_owned();
                // Central differences: rounding 1e-16 m over h, curvature h² times a length.
                let tolerance = 2e-16 / h * 10.0 + 1e-7 * (1.0 + column.norm());
                assert!(
                    (difference - column).norm() < tolerance,
                    "{id} {}: {difference} against {column}",
                    problem.parameters()[k].name
                );
            }
        }
    }
}

#[test]
fn zero_size_changes_nothing() {
    let data = cell();
    let plain = Problem::new(&[("d", &data)], &Model::of(&["base_frame"]), Use::Fit).unwrap();
    let before = plain.residuals(&plain.start());
    for id in ids().into_iter().filter(|id| id != "base_frame") {
        let problem = Problem::new(&[("d", &data)], &Model::of(&["base_frame", &id]), Use::Fit).unwrap();
        assert_eq!(problem.residuals(&problem.start()), before, "{id}");
    }
}

#[test]
fn names_are_unique_and_sizes_plausible() {
    let data = cell();
    let balls = data.ball_ids();
    let subject = Subject { robot: &data.robot, balls: &balls };
    let mut families = BTreeSet::new();
    for family in CATALOGUE {
        assert!(families.insert(family.id), "{} stands twice in the catalogue", family.id);
        assert!(!family.what.is_empty() && !family.equation.is_empty());
    }
    let mut names = BTreeSet::new();
    for id in ids().into_iter().filter(|id| !id.ends_with(":3")) {
        let effect = build(&id, &subject).unwrap();
        assert_eq!(effect.id(), id);
        for p in effect.parameters() {
            assert!(names.insert(p.name.clone()), "{} stands twice", p.name);
            assert!(p.prior > 0.0 && p.prior.is_finite() && p.nominal.is_finite(), "{}", p.name);
        }
    }
}

#[test]
fn arguments_that_do_not_fit_are_refused() {
    let data = cell();
    let balls = data.ball_ids();
    let subject = Subject { robot: &data.robot, balls: &balls };
    for id in [
        "mdhh",
        "",
        "mdh:1",
        "harmonic1:0",
        "harmonic1:7",
        "harmonic:2",
        "harmonic:2:0",
        "harmonic:2:x",
        "ball:c",
        "ball",
        "harmonic:1:2:3",
    ] {
        let error = build(id, &subject).err().unwrap_or_else(|| panic!("'{id}' was accepted"));
        assert!(error.to_string().contains(id), "{error}");
    }
}
