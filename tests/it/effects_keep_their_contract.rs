//! Every effect of the catalogue: its columns are the derivatives of the exact model, zero size changes nothing, names are
//! unique.

use std::collections::BTreeSet;

use calibench::diagnosis::Verdict;
use calibench::effects::catalogue::CATALOGUE;
use calibench::effects::facts::Follows;
use calibench::effects::family::Scan;
use calibench::effects::registry::Registry;
use calibench::effects::{Effect, Needs, Subject, build};
use calibench::identify::fit::{Fit, fit};
use calibench::identify::problem::{Problem, Use};
use calibench::identify::{Model, TorquePosture};
use calibench::measure::dataset::{Dataset, NamedDataset, Orientation, ToolTarget};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::rotation_vector;
use calibench::units::UM;
use nalgebra::Vector3;

use crate::effect_cell::{self, Measures, diagnosed, make_true};

/// The cell in which every effect shows, with every other point that of a target, which is at the TCP as far as is known.
fn cell() -> Dataset {
    let mut cell = effect_cell::cell();
    cell.tool_targets.push(ToolTarget { id: "r".into(), position: Vector3::zeros(), sigma: 0.0, free: false });
    cell.samples.iter_mut().skip(1).step_by(4).for_each(|s| s.tool_target = Some(0));
    // Points are every other sample; one in three shows an orientation, too.
    for sample in cell.samples.iter_mut().skip(1).step_by(6) {
        let rotation = rotation_vector(&world_from_tool(&cell.robot, &cell.base, &cell.tool, &sample.q).rotation);
        sample.orientation = Some(Orientation { rotation, sigma: None });
    }
    // As certain at the end of a lever of a metre as a point.
    cell.noise.orientation = Some(cell.noise.point.unwrap());
    cell
}

/// Every member of every family, of scanned families at one value.
fn ids(subject: &Subject<'_>) -> Vec<String> {
    let value = |scan| match scan {
        Scan::Order => "17",
        Scan::Time => "2400",
        Scan::Sample | Scan::None => "b007",
    };
    let all = CATALOGUE.iter().flat_map(|f| [f.ids(subject), f.scanned(subject, value(f.scan))].concat());
    let all = all.chain(["target:r".to_owned()]);
    // Of the balls that are probed late enough to be knocked before.
    all.filter(|id| !id.starts_with("ball_step:") || id.starts_with("ball_step:b05")).collect()
}

/// Base and effect, and the compliance through which it acts, where it does.
fn model(effect: &dyn Effect) -> Model {
    let mut effects = vec!["base_frame"];
    if effect.needs().contains(&Needs::Compliance) {
        effects.push("joint_compliance");
    }
    effects.retain(|e| *e != effect.id());
    effects.push(effect.id());
    Model::of(&effects)
}

/// Plausible sizes, one and a half of one or the other sign, in an order without system.
fn injected(problem: &Problem) -> Vec<f64> {
    let size = |(k, p): (usize, &calibench::identify::problem::Parameter)| match p.effect.whole() {
        // Joints give way to the load, not against it.
        "joint_compliance" => p.spec.prior * (0.5 + 0.1 * k as f64),
        _ => p.spec.prior * 1.5 * (1.0 + k as f64 * 1.7).sin(),
    };
    problem.parameters().iter().enumerate().map(size).collect()
}

#[test]
fn what_is_injected_is_recovered() {
    /// Of the plausible size. The effects are exact in the model, and what is left is the last step of the fit and rounding of 1e-16 m.
    const RECOVERED: f64 = 1e-3;
    let cell = cell();
    let balls = cell.ball_ids();
    let subject = Subject::new(&cell.robot, &balls);
    // Only joint 6 makes a full turn; on less, forty orders cannot be distinguished without their plausible sizes.
    for id in ids(&subject).into_iter().filter(|id| !id.starts_with("error_curve:") || id.ends_with(":6")) {
        let effect = build(&id, &subject).unwrap();
        let mut model = model(effect.as_ref());
        // By the data alone.
        model.width.insert(id.clone(), f64::INFINITY);
        let mut data = cell.clone();
        let truth = injected(&Problem::new(&[NamedDataset::new("d", &data)], &model, Use::Fit).unwrap());
        make_true(&mut data, &model, &truth);
        let problem = Problem::new(&[NamedDataset::new("d", &data)], &model, Use::Fit).unwrap();
        let found: Fit = fit(&problem).unwrap_or_else(|e| panic!("{id}: {e}"));
        assert!(found.rms < 0.01 * UM, "{id}: rms {:.3} um is left", found.rms / UM);
        if id == "mdh" {
            continue; // what it shares with the base, and parallel axes among them, the data cannot tell
        }
        for (k, p) in problem.parameters().iter().enumerate().filter(|(_, p)| p.effect == id) {
            assert!(found.kept.contains(&k), "{id}: {} was not told from others", p.name);
            let error = (found.values[k] - truth[k]).abs() / p.spec.prior;
            assert!(error < RECOVERED, "{id}: {} is off by {error:.1e} of its plausible size", p.name);
        }
    }
}

#[test]
fn columns_are_derivatives_of_the_exact_model() {
    let mut data = cell();
    data.samples.truncate(16);
    let balls = data.ball_ids();
    for id in ids(&Subject::new(&data.robot, &balls)) {
        // Other deviations present, so that the columns are right where the arm is not as drawn.
        let others: Vec<&str> = ["base_frame", "mdh", "joint_compliance"].into_iter().filter(|o| *o != id).collect();
        let mut effects = vec![id.as_str()];
        effects.extend(others);
        let model = Model { torque_posture: TorquePosture::Drawn, ..Model::of(&effects) };
        let problem = Problem::new(&[NamedDataset::new("d", &data)], &model, Use::Fit).unwrap();
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
            let turned = [&more, &less].map(|at| problem.orientation_residuals(at).into_iter().flatten().collect::<Vec<_>>());
            for (s, (more, less)) in turned[0].iter().zip(&turned[1]).enumerate() {
                let difference = (less - more) / (2.0 * h);
                let column = exact.fixed_view::<3, 1>(3 * (data.samples.len() + s), c).into_owned();
                let tolerance = 1e-15 / h * 10.0 + 1e-6 * (1.0 + column.norm());
                assert!((difference - column).norm() < tolerance, "{id}: turns {difference} against {column}");
            }
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
    let plain = Problem::new(&[NamedDataset::new("d", &data)], &Model::of(&["base_frame"]), Use::Fit).unwrap();
    let before = plain.residuals(&plain.start());
    let balls = data.ball_ids();
    let subject = Subject::new(&data.robot, &balls);
    for id in ids(&subject) {
        let model = model(build(&id, &subject).unwrap().as_ref());
        let problem = Problem::new(&[NamedDataset::new("d", &data)], &model, Use::Fit).unwrap();
        assert_eq!(problem.residuals(&problem.start()), before, "{id}");
        let moves = problem.plain_jacobian(&problem.start(), &(0..problem.parameters().len()).collect::<Vec<_>>());
        let of_effect = problem.parameters().iter().enumerate().filter(|(_, p)| p.effect == id);
        // Joint 1 turns about the vertical, but for the tilt of the base.
        of_effect.for_each(|(k, p)| {
            assert!(moves.column(k).amax() > 0.0, "{id}: {} moves nothing in a cell where all does", p.name)
        });
    }
}

#[test]
fn names_are_unique_and_sizes_plausible() {
    let data = cell();
    let balls = data.ball_ids();
    let subject = Subject::new(&data.robot, &balls);
    let mut families = BTreeSet::new();
    for family in CATALOGUE {
        assert!(families.insert(family.id), "{} appears twice in the catalogue", family.id);
        assert!(!family.what.is_empty() && !family.equation.is_empty() && !family.meaning.physics.is_empty());
    }
    let mut names = BTreeSet::new();
    for id in ids(&subject) {
        let effect = build(&id, &subject).unwrap();
        assert_eq!(effect.id(), id);
        for p in effect.parameters() {
            assert!(names.insert(p.name.clone()), "{} appears twice", p.name);
            assert!(p.prior > 0.0 && p.prior.is_finite() && p.nominal.is_finite(), "{}", p.name);
            let range = Registry::catalogue().family(&id).unwrap().linear_range;
            assert!(range.holds(p, 1.5 * p.prior), "{}: what is plausible is not believable", p.name);
        }
    }
}

#[test]
fn what_a_family_is_said_to_follow_is_what_its_columns_follow() {
    let data = cell();
    let balls = data.ball_ids();
    let subject = Subject::new(&data.robot, &balls);
    for id in ids(&subject) {
        let (effect, follows) = (build(&id, &subject).unwrap(), Registry::catalogue().family(&id).unwrap().follows);
        let needs = |need| effect.needs().contains(&need);
        let said = |any: &[Follows]| any.iter().any(|f| follows.contains(f));
        assert_eq!(needs(Needs::Commanded), said(&[Follows::Commanded]), "{id}");
        assert_eq!(needs(Needs::Plungers), said(&[Follows::Plunger]), "{id}");
        assert_eq!(needs(Needs::Readings), said(&[Follows::Reading]), "{id}");
        assert!(!needs(Needs::Approach) || said(&[Follows::Approach]), "{id}");
        assert!(!(needs(Needs::Time) || needs(Needs::Temperature)) || said(&[Follows::Time, Follows::Temperature]), "{id}");
        let of_load = [Follows::Load, Follows::JointTorque, Follows::OtherTorque];
        assert!(!(needs(Needs::Torques) || needs(Needs::Masses) || needs(Needs::Compliance)) || said(&of_load), "{id}");
    }
}

#[test]
fn joints_that_stand_where_they_were_sent_are_seen_in_whatever_background() {
    let told = diagnosed("joint_source", Measures::Both, |_| 1.0);
    assert_eq!((told.verdict, &told.set95[..]), (Verdict::Identified, &["joint_source".into()][..]));
}

#[test]
fn an_effect_of_a_sample_that_is_not_there_is_refused() {
    let data = cell();
    let balls = data.ball_ids();
    let samples: Vec<String> = data.samples.iter().map(|s| s.id.clone()).collect();
    let subject = Subject { samples: Some(&samples), ..Subject::new(&data.robot, &balls) };
    assert!(build("outlier:b007", &subject).is_ok());
    let refused = build("outlier:nope", &subject).err().unwrap().to_string();
    assert!(refused.contains("'nope'"), "{refused}");
}

#[test]
fn arguments_that_do_not_fit_are_refused() {
    let data = cell();
    let balls = data.ball_ids();
    let subject = Subject::new(&data.robot, &balls);
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
        "link_bending:4",
        "link_bending:6",
        "cross_compliance:2:2",
        "cross_compliance:2",
        "gauge_zero",
        "gauge_zero:4",
        "base_step",
        "base_step:-1",
        "base_step:nan",
        "joint_step:2",
        "joint_step:2:soon",
        "outlier",
        "outlier:",
        "thermal_growth:time",
        "ball",
        "target",
        "target:",
        "harmonic:1:2:3",
    ] {
        let error = build(id, &subject).err().unwrap_or_else(|| panic!("'{id}' was accepted"));
        assert!(error.to_string().contains(id), "{error}");
    }
}
