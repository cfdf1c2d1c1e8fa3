//! Whatever is in the catalogue: its columns are the derivatives of the exact model, zero size changes nothing, names are unique.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::sync::Arc;

use calibench::assess::{Diagnosis, Verdict, diagnose};
use calibench::effects::{CATALOGUE, Effect, Follows, Needs, Scan, Subject, build, family};
use calibench::identify::{Fit, Model, Parameter, Problem, TorquePosture, Use, fit};
use calibench::measure::{Ball, Dataset, Measured, Noise, Sample};
use calibench::report::{Recommended, diagnosis_json, sentences};
use calibench::robot::{FramePose, Payload, built_in, world_from_tool};
use calibench::units::{MM, UM};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

/// Samples on balls, each on a ball of its own, and as many measured points.
const BALLS: usize = 60;

/// Length of the session, s.
const SESSION: f64 = 7200.0;

/// Every member of every family, of scanned families at one value.
fn ids(subject: &Subject<'_>) -> Vec<String> {
    let value = |scan| match scan {
        Scan::Order => "17",
        Scan::Time => "2400",
        Scan::Sample | Scan::None => "b007",
    };
    let all = CATALOGUE.iter().flat_map(|f| [f.ids(subject), f.scanned(subject, value(f.scan))].concat());
    // Of the balls that are probed late enough to be knocked before.
    all.filter(|id| !id.starts_with("ball_step:") || id.starts_with("ball_step:b05")).collect()
}

/// A cell in which every effect shows: balls and points all over the workspace, left-over readings of millimetres, two payloads, every
/// column filled.
fn cell() -> Dataset {
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let base = FramePose { xyz: [-0.5, 0.02, -0.06], rz_ry_rx: [0.3, 0.02, -0.01] };
    let tool = FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.1, -0.6, 0.8] };
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    let mut balls = Vec::new();
    let mut samples = Vec::new();
    for k in 0..2 * BALLS {
        let q: Vec<f64> = robot.links.iter().map(|l| between(l.limits[0], l.limits[1])).collect();
        let pose = world_from_tool(&robot, &base, &tool, &q);
        let mut sample = if k % 2 == 0 {
            let reading = Vector3::from_fn(|_, _| between(-2.0, 2.0) * MM);
            let position = pose.transform_point(&reading.into()).coords;
            balls.push(Ball { id: format!("b{:03}", k / 2), position, sigma: 0.0, free: false });
            Sample::new(format!("b{:03}", k / 2), q, Measured::Ball { ball: k / 2, reading: Some(reading) })
        } else {
            Sample::new(format!("p{:03}", k / 2), q, Measured::Point(pose.translation.vector))
        };
        let mut sign = || if between(0.0, 1.0) < 0.5 { -1 } else { 1 };
        sample.approach = Some((0..6).map(|_| sign()).collect());
        sample.plungers = Some([sign(), sign(), sign()]);
        sample.q_commanded = Some(sample.q.iter().map(|q| q + between(-1e-4, 1e-4)).collect());
        sample.payload = k / 2 % 2;
        sample.time_s = Some(SESSION * (k + 1) as f64 / (2 * BALLS) as f64);
        sample.temp_c = Some(20.0 + between(0.0, 10.0));
        samples.push(sample);
    }
    let payload = |name: &str, mass: f64| Payload { name: name.into(), mass, com: Vector3::new(25.0, 0.0, -70.0) * MM };
    Dataset {
        robot,
        base,
        tool,
        payloads: vec![payload("heavy", 6.0), payload("light", 1.3)],
        balls,
        samples,
        // There is none, and the fit settles to a thousandth of what is stated.
        noise: Noise { ball: Some(0.01 * UM), point: Some(0.01 * UM), joint: Vec::new() },
        ..Dataset::default()
    }
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

/// Makes the samples those of an arm whose parameters have these values (deviations, SI), to the last digits: points are moved, and
/// readings, since each ball is where it is.
fn make_true(data: &mut Dataset, model: &Model, values: &[f64]) {
    // Readings enter some effects, with thousandths of their size.
    for _ in 0..5 {
        let problem = Problem::new(&[("d", data)], model, Use::Fit).unwrap();
        let residuals = problem.residuals(values);
        let (robot, base, tool) = (data.robot.clone(), data.base, data.tool);
        for (sample, residual) in data.samples.iter_mut().zip(residuals) {
            match &mut sample.measured {
                Measured::Point(point) => *point -= residual,
                Measured::Ball { reading: Some(reading), .. } => {
                    *reading += world_from_tool(&robot, &base, &tool, &sample.q).rotation.inverse() * residual;
                }
                _ => unreachable!("the cell has no other samples"),
            }
        }
    }
}

/// Plausible sizes, one and a half of one or the other sign, in an order without system.
fn injected(problem: &Problem) -> Vec<f64> {
    let size = |(k, p): (usize, &calibench::identify::Parameter)| match p.effect.as_str() {
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
    // Only joint 6 makes a full turn; on less, forty orders cannot be told apart without their plausible sizes.
    for id in ids(&subject).into_iter().filter(|id| !id.starts_with("error_curve:") || id.ends_with(":6")) {
        let effect = build(&id, &subject).unwrap();
        let mut model = model(effect.as_ref());
        // By the data alone.
        model.width.insert(id.clone(), f64::INFINITY);
        let mut data = cell.clone();
        let truth = injected(&Problem::new(&[("d", &data)], &model, Use::Fit).unwrap());
        make_true(&mut data, &model, &truth);
        let problem = Problem::new(&[("d", &data)], &model, Use::Fit).unwrap();
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
    let balls = data.ball_ids();
    let subject = Subject::new(&data.robot, &balls);
    for id in ids(&subject) {
        let model = model(build(&id, &subject).unwrap().as_ref());
        let problem = Problem::new(&[("d", &data)], &model, Use::Fit).unwrap();
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
        assert!(families.insert(family.id), "{} stands twice in the catalogue", family.id);
        assert!(!family.what.is_empty() && !family.equation.is_empty() && !family.meaning.physics.is_empty());
    }
    let mut names = BTreeSet::new();
    for id in ids(&subject) {
        let effect = build(&id, &subject).unwrap();
        assert_eq!(effect.id(), id);
        for p in effect.parameters() {
            assert!(names.insert(p.name.clone()), "{} stands twice", p.name);
            assert!(p.prior > 0.0 && p.prior.is_finite() && p.nominal.is_finite(), "{}", p.name);
            let range = family(&id).unwrap().linear_range;
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
        let (effect, follows) = (build(&id, &subject).unwrap(), family(&id).unwrap().follows);
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

/// What is measured.
#[derive(Clone, Copy, PartialEq)]
enum Measures {
    /// Balls and points by turns.
    Both,
    /// The same in two sessions.
    TwoSessions,
    /// The balls alone.
    Balls,
}

/// A cell in which six balls are probed ten times each, and what a diagnosis of a model with the base alone finds in it when `effect` has
/// these sizes, in plausible ones.
fn diagnosed(effect: &str, measures: Measures, size: impl Fn(&Parameter) -> f64) -> Diagnosis {
    let mut data = cell();
    for (k, sample) in data.samples.iter_mut().enumerate() {
        if let Measured::Ball { ball, .. } = &mut sample.measured {
            *ball = k / 2 % 6;
        }
        sample.id = format!("s{k:03}");
        sample.approach = None;
        sample.plungers = None;
        sample.temp_c = None;
        if measures == Measures::TwoSessions {
            sample.session = Some(if k < BALLS { "first" } else { "second" }.into());
        }
    }
    if measures == Measures::Balls {
        data.samples.retain(|s| matches!(s.measured, Measured::Ball { .. }));
    }
    data.balls.truncate(6);
    data.noise = Noise { ball: Some(5.0 * UM), point: Some(5.0 * UM), joint: Vec::new() };
    let model = Model::of(&["base_frame", effect]);
    let problem = Problem::new(&[("d", &data)], &model, Use::Fit).unwrap();
    let of = |p: &Parameter| if p.effect == effect { size(p) * p.spec.prior } else { 0.0 };
    let sizes: Vec<f64> = problem.parameters().iter().map(of).collect();
    make_true(&mut data, &model, &sizes);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for sample in &mut data.samples {
        let noise = Vector3::from_fn(|_, _| (random.random_range(-1.0..1.0) + random.random_range(-1.0..1.0)) * 6.0 * UM);
        match &mut sample.measured {
            Measured::Point(point) => *point += noise,
            Measured::Ball { reading: Some(reading), .. } => *reading += noise,
            _ => {}
        }
    }
    diagnose(&[("d", &data)], &Model::of(&["base_frame"])).unwrap()
}

#[test]
fn a_step_is_placed_between_the_samples_between_which_it_happened() {
    // Samples are 60 s apart, the first at 60 s; balls are probed every other time, and each ball every twelfth.
    for (effect, measures, session, between) in [
        ("base_step:2430", Measures::Both, "", ["s039", "s040"]),
        ("joint_step:3:4890", Measures::Both, "", ["s080", "s081"]),
        ("artifact_step:3000", Measures::Both, "", ["s048", "s050"]),
        ("ball_step:b002:4000", Measures::Both, "", ["s064", "s076"]),
        ("base_step:5430", Measures::TwoSessions, "second", ["s089", "s090"]),
    ] {
        // Of the second session, where there are two.
        let sessions = measures == Measures::TwoSessions;
        let told = diagnosed(effect, measures, |p| if sessions && !p.name.ends_with("@second") { 0.0 } else { 3.0 });
        let stem = effect.rsplit_once(':').unwrap().0;
        let first = &told.findings[0].hypothesis;
        assert_eq!(first.effect, stem, "{effect}: {:?}", told.set95);
        let moment = first.moment.as_ref().unwrap();
        assert_eq!(moment.between, between, "{effect}");
        assert!(moment.credible[0] <= moment.between[0] && moment.credible[1] >= moment.between[1], "{effect}: {moment:?}");
        assert_eq!(moment.session.as_deref().unwrap_or_default(), session, "{effect}");
        // It is said, and written.
        let written = diagnosis_json(&told, None, &Recommended::default());
        assert_eq!(written["findings"][0]["moment"]["between"], json!(between), "{effect}");
        assert_eq!(written["findings"][0]["moment"]["between_95"], json!(moment.credible), "{effect}");
        let of_session = if sessions { " of session second" } else { "" };
        let [before, after] = between;
        let said = format!(
            "between samples {before} and {after}{of_session} (95 %: {} to {})",
            moment.credible[0], moment.credible[1]
        );
        assert!(sentences(&told, &Recommended::default()).iter().any(|s| s.contains(&said)), "{effect}: {said}");
    }
}

#[test]
fn what_these_data_cannot_tell_apart_is_said_with_what_would() {
    let mut told = diagnosed("base_step:2430", Measures::Balls, |_| 3.0);
    // Whatever is likelier: it is said of the step as soon as that is named.
    told.findings.retain(|f| f.hypothesis.effect == "base_step");
    (told.verdict, told.set95) = (Verdict::Identified, vec!["base_step".into()]);
    let first = &told.findings[0];
    let moment = first.hypothesis.in_model.strip_prefix("base_step:").unwrap();
    assert_eq!(first.exactly_same, [format!("artifact_step:{moment}")]);
    let said =
        format!("base_step:{moment} or artifact_step:{moment}: the same in these data; only a look at either from outside");
    assert!(sentences(&told, &Recommended::default()).iter().any(|s| s.contains(&said)), "{said}");
    let written = diagnosis_json(&told, None, &Recommended::default());
    assert_eq!(written["findings"][0]["exactly_same"], json!(first.exactly_same));
    assert!(written["findings"][0]["parted_by"].as_str().unwrap().contains("from outside"));
    // With points of the tool beside them they are two things.
    let told = diagnosed("base_step:2430", Measures::Both, |_| 3.0);
    assert!(told.findings[0].exactly_same.is_empty());
}

#[test]
fn joints_that_stand_where_they_were_sent_are_seen_in_whatever_background() {
    let told = diagnosed("joint_source", Measures::Both, |_| 1.0);
    assert_eq!((told.verdict, &told.set95[..]), (Verdict::Identified, &["joint_source".to_owned()][..]));
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
        "harmonic:1:2:3",
    ] {
        let error = build(id, &subject).err().unwrap_or_else(|| panic!("'{id}' was accepted"));
        assert!(error.to_string().contains(id), "{error}");
    }
}
