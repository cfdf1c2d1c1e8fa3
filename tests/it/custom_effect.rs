//! An effect of your own: six lines of `model.toml`, and its coefficients come out of the measurements.

use std::fs;
use std::sync::Arc;

use calibench::diagnosis::library::Library;
use calibench::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use calibench::effects::family::{Family, Origin, Scan};
use calibench::effects::registry::{Registry, ids};
use calibench::effects::situation::Situation;
use calibench::effects::{Effect, EffectError, Emit, ParameterSpec, Subject};
use calibench::identify::calibration::{Calibration, read_calibration, write_calibration};
use calibench::identify::model_file::{read_model, write_model};
use calibench::identify::problem::{Problem, ProblemError, Use, missing};
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::sites::{MdhEntry, Site};
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, built_in};
use calibench::units::{DEG, UM, URAD, Unit};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A bearing of joint 3 has seventeen balls, and ripples when they pass; and joint 5 sags with temperature, by its torque.
///
/// Each line of `terms` says what moves (`site`, as `calibench` prints sites) and by how much per unit of its coefficient (`basis`). Every
/// term has a coefficient of its own, in `unit`, but for those of one `group`, which share one.
const MODEL: &str = r#"
effects = ["base_frame", "mdh"]

[[effect]]
name = "ripple3"
unit = "deg"
terms = [
    { site = "theta:3", basis = "sin(17*q3)" },
    { site = "theta:3", basis = "cos(17*q3)" },
]

[[effect]]
name = "warm_wrist"
unit = "urad/(N*m)"
plausible = 20
terms = [{ site = "theta:5", basis = "tau5*(temp_c - 20)", group = "sag" }]
"#;

/// Effects of the true robot: 0.004 and -0.007 deg of ripple, 30 urad/(N·m) for every kelvin.
const TRUE_COEFFICIENTS: [(&str, f64); 4] =
    [("ripple3.1", 0.004), ("ripple3.2", -0.007), ("warm_wrist.sag", 30.0), ("cable_drag.c", CABLE_DRAG)];

/// Rotation by which the cables of a third party's effect pull, urad.
const CABLE_DRAG: f64 = 200.0;

/// One-sigma of each coordinate of a point: a laser tracker's.
const NOISE: f64 = 20.0 * UM;

#[test]
fn a_few_lines_of_toml_make_an_effect() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    fs::write(&path, MODEL).unwrap();

    // The model is read for a robot, and says what is wrong with an expression before anything is fitted.
    let robot = built_in("kr6_r700").unwrap();
    let model = read_model(&path, &Subject::new(&robot, &[])).unwrap();
    assert_eq!(model.effects, ["base_frame", "mdh", "ripple3", "warm_wrist"], "a defined effect is part of the fit");

    // Identified like any other: the coefficients come back, with their uncertainties.
    let data = measured(&model);
    let calibration = identify(&[NamedDataset::new("d", &data)], &model).unwrap();
    for (name, truth) in TRUE_COEFFICIENTS.into_iter().take(3) {
        let found = calibration.estimate(name).unwrap();
        let (value, sigma) = (found.unit.from_si(found.value), found.unit.from_si(found.sigma));
        assert!((value - truth).abs() < 4.0 * sigma, "{name}: {value} +- {sigma} {}, truly {truth}", found.unit.symbol);
        assert!(truth.abs() > 8.0 * sigma, "{name}: +- {sigma} {} tells nothing", found.unit.symbol);
    }

    // Without it, the ripple is left in the residuals: 0.006 deg at half a metre are 40 um.
    let without = identify(&[NamedDataset::new("d", &data)], &Model::of(&["base_frame", "mdh"])).unwrap();
    assert!(without.chi2_per_dof > 1.5 && calibration.chi2_per_dof < 1.2);

    // A calibration keeps its effects, and predicts with them when it is read again.
    let file = folder.path().join("calibration.toml");
    write_calibration(&Calibration { robot_reference: "kr6_r700".into(), ..calibration.clone() }, &file).unwrap();
    let read = read_calibration(&file, Registry::catalogue()).unwrap();
    assert_eq!(read.model.own, model.own);
    let errors = |c: &Calibration| c.predict(&[NamedDataset::new("d", &data)], Use::All).unwrap().residuals;
    let apart = errors(&calibration).iter().zip(errors(&read)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "files keep nine decimals, and these predictions are {apart} m apart");

    // So does a model.
    write_model(&model, &path).unwrap();
    assert_eq!(read_model(&path, &Subject::new(&robot, &[])).unwrap(), model);
}

#[test]
fn a_candidate_is_offered_but_not_fitted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    fs::write(&path, MODEL.replace("unit = \"deg\"", "unit = \"deg\"\ncandidate = true")).unwrap();
    let robot = built_in("kr6_r700").unwrap();
    let model = read_model(&path, &Subject::new(&robot, &[])).unwrap();
    assert_eq!(model.effects, ["base_frame", "mdh", "warm_wrist"]);
    let offered = ids(&Subject { own: &model.own, ..Subject::new(&robot, &[]) });
    assert!(offered.contains(&"ripple3".to_owned()), "the diagnosis finds it among all others");
    write_model(&model, &path).unwrap();
    assert_eq!(read_model(&path, &Subject::new(&robot, &[])).unwrap(), model);
}

/// A tool that bends under its weight, a joint that has not settled, and a cell that bends the line of sight across it: written in
/// expressions, measured on a robot that moves by the arithmetic of this test.
#[test]
fn expressions_know_gravity_in_the_hand_the_posture_before_and_the_place() {
    const BENT: f64 = 0.3e-3;
    const UNSETTLED: f64 = 2e-4;
    const ACROSS: f64 = 4e-4;
    let text = r#"
effects = ["base_frame", "mdh"]
[[effect]]
name = "tool_sag"
unit = "1"
terms = [{ site = "tool:x", basis = "0.001*down_x", group = "k" }, { site = "tool:y", basis = "0.001*down_y", group = "k" }]
[[effect]]
name = "creep2"
unit = "1"
terms = [{ site = "theta:2", basis = "q2_before - q2", group = "k" }]
[[effect]]
name = "refraction"
unit = "1"
terms = [{ site = "base:z", basis = "tcp_x_m^2", group = "k" }]
"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    fs::write(&path, text).unwrap();
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let model = read_model(&path, &Subject::new(&robot, &[])).unwrap();

    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.0, -0.125], rz_ry_rx: [0.0; 3] });
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let mut before: Option<Vec<f64>> = None;
    let samples = (0..150).map(|k| {
        let q: Vec<f64> = robot.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
        let mut truly = q.clone();
        truly[1] += before.as_ref().map_or(0.0, |before| UNSETTLED * (before[1] - q[1]));
        let pose = world_from_tool(&robot, &base, &tool, &truly);
        let down = pose.rotation.inverse() * -Vector3::z();
        let mut point = pose * nalgebra::Point3::new(BENT * down.x, BENT * down.y, 0.0);
        point.z += ACROSS * pose.translation.x.powi(2);
        let noise = Vector3::from_fn(|_, _| NOISE * Distribution::<f64>::sample(&StandardNormal, &mut random));
        before = Some(q.clone());
        Sample::new(k.to_string(), q, Measured::Point(point.coords + noise))
    });
    let noise = Noise { point: Some(NOISE), ..Noise::default() };
    let data = Dataset { samples: samples.collect(), robot: robot.clone(), base, tool, noise, ..Dataset::default() };
    let calibration = identify(&[NamedDataset::new("d", &data)], &model).unwrap();
    for (name, truth) in [("tool_sag.k", 1e3 * BENT), ("creep2.k", UNSETTLED), ("refraction.k", ACROSS)] {
        let found = calibration.estimate(name).unwrap();
        assert!((found.value - truth).abs() < 4.0 * found.sigma, "{name}: {} +- {}, truly {truth}", found.value, found.sigma);
        assert!(truth > 8.0 * found.sigma, "{name}: +- {} tells nothing", found.sigma);
    }
    assert!(calibration.chi2_per_dof < 1.2, "{}", calibration.chi2_per_dof);
}

#[test]
fn what_an_expression_needs_must_be_measured() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    let robot = built_in("kr6_r700").unwrap();
    let with_basis = |basis: &str| {
        let text = format!(
            "effects = [\"base_frame\"]\n[[effect]]\nname = \"own\"\nunit = \"deg\"\nterms = [{{ site = \"theta:2\", basis = \"{basis}\" }}]\n"
        );
        fs::write(&path, text).unwrap();
        read_model(&path, &Subject::new(&robot, &[])).unwrap()
    };
    let data = measured(&Model::of(&["base_frame"]));
    let subject = Subject::new(&robot, &[]);
    for (basis, needs) in [("approach2", "columns approach1 ... approachN"), ("time_s/60", "column time_s")] {
        let model = with_basis(basis);
        let effect = model.own[0].build(&subject).unwrap();
        assert_eq!(missing(effect.as_ref(), &data, &model, Use::Fit), Some(needs));
        assert!(
            matches!(identify(&[NamedDataset::new("d", &data)], &model).unwrap_err().to_string(), e if e.contains("'own'") && e.contains(needs))
        );
    }
    // Where an expression has no value, the sample and the expression are named.
    let model = with_basis("ln(q2 + 1)");
    match Problem::new(&[NamedDataset::new("d", &data)], &model, Use::Fit).err().unwrap() {
        ProblemError::NoValue { effect, sample, expression } => {
            assert_eq!(effect, "own");
            let q2 = data.samples.iter().find(|s| s.id == sample).unwrap().q[1];
            assert!(q2 < -1.0, "ln({} + 1) has a value", q2);
            assert!(expression.contains("ln(q2 + 1)") && expression.contains("theta:2"), "{expression}");
        }
        other => panic!("{other}"),
    }
}

/// `cable_drag`, written by a third party: the cables along the arm pull joint 1 towards its middle.
struct CableDrag([ParameterSpec; 1]);

impl Effect for CableDrag {
    fn id(&self) -> &str {
        CABLE.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.0
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>) {
        emit(0, Site::mdh(0, MdhEntry::Theta), (3.0 * at.q[0]).tanh());
    }
}

static CABLE: Family = Family {
    id: "cable_drag",
    arguments: "",
    name: "cable on joint 1",
    what: "cables pull joint 1 back",
    equation: "theta_1 += c tanh(3 q_1)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngle],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the cables along the arm pull joint 1 towards its middle",
        intervention: Intervention {
            work: Work::Service,
            act: "look at the hoses",
            verify: "the same postures with the hoses off",
        },
    },
    signature: Signature {
        looks: [
            "Joint 1 stops short on both sides.",
            "Against its own angle there is a step at zero.",
            "It does not grow with the load.",
        ],
        parted_by: "The same postures with the cables off.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: |_| vec![String::new()],
    build: |id, _| {
        id.at_most(0)?;
        Ok(Box::new(CableDrag([ParameterSpec::new("cable_drag.c", Unit::URAD, 50.0 * URAD)])))
    },
};

#[test]
fn a_family_of_a_third_party_is_fitted_and_offered_like_any_other() {
    let registry = Registry::default().with(&CABLE).unwrap();
    let model = Model { registry, ..Model::of(&["base_frame", "mdh", "cable_drag"]) };
    let data = measured(&model);
    let calibration = identify(&[NamedDataset::new("d", &data)], &model).unwrap();
    let found = calibration.estimate("cable_drag.c").unwrap();
    let (value, sigma) = (found.value / URAD, found.sigma / URAD);
    assert!((value - CABLE_DRAG).abs() < 4.0 * sigma && CABLE_DRAG > 8.0 * sigma, "{value} +- {sigma} urad");

    let without = model.without("cable_drag");
    let offered = Library::new(&[NamedDataset::new("d", &data)], &without);
    assert!(offered.place("cable_drag").is_some(), "a diagnosis finds it among all others");
    // A program that does not know it says so.
    let unknown = Model::of(&["base_frame", "cable_drag"]);
    let error = identify(&[NamedDataset::new("d", &data)], &unknown).unwrap_err().to_string();
    assert!(error.contains("'cable_drag'"), "{error}");
    assert!(matches!(model.registry.clone().with(&CABLE), Err(EffectError::Taken { .. })));
}

#[test]
fn a_calibration_with_a_family_of_a_third_party_is_read_by_those_who_know_it() {
    let registry = Registry::default().with(&CABLE).unwrap();
    let model = Model { registry: registry.clone(), ..Model::of(&["base_frame", "mdh", "cable_drag"]) };
    let data = measured(&model);
    let data = [NamedDataset::new("d", &data)];
    let calibration = Calibration { robot_reference: "kr6_r700".into(), ..identify(&data, &model).unwrap() };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("calibration.toml");
    write_calibration(&calibration, &file).unwrap();

    let read = read_calibration(&file, &registry).unwrap();
    assert_eq!((&read.model.effects, &read.model.registry), (&model.effects, &registry));
    let of_cable = |c: &Calibration| c.estimate("cable_drag.c").map(|e| (e.value, e.effect.clone()));
    let ((written, _), (value, effect)) = (of_cable(&calibration).unwrap(), of_cable(&read).unwrap());
    assert_eq!(effect, "cable_drag");
    assert!((value - written).abs() < 1e-9 * URAD, "files keep nine decimals");
    let errors = |c: &Calibration| c.predict(&data, Use::All).unwrap().residuals;
    let apart = errors(&calibration).iter().zip(errors(&read)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "files keep nine decimals, and these predictions are {apart} m apart");

    // Who does not know the family is told so, at its line.
    let error = read_calibration(&file, Registry::catalogue()).unwrap_err();
    assert!(error.line.is_some() && error.problem.contains("'cable_drag'"), "{error}");
}

/// A hundred and fifty points of a robot that truly has the effects of `model` at [`TRUE_COEFFICIENTS`], and noise.
fn measured(model: &Model) -> Dataset {
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.0, -0.125], rz_ry_rx: [0.0; 3] });
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let samples = (0..150).map(|k| {
        let q: Vec<f64> = robot.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
        let tcp = world_from_tool(&robot, &base, &tool, &q).translation.vector;
        let mut sample = Sample::new(k.to_string(), q, Measured::Point(tcp));
        sample.temp_c = Some(random.random_range(18.0..30.0));
        sample
    });
    let payloads = vec![Payload { name: "gripper".into(), mass: 6.0, com: Vector3::new(0.025, 0.0, -0.07) }];
    let noise = Noise { point: Some(NOISE), ..Noise::default() };
    let mut data =
        Dataset { samples: samples.collect(), robot: robot.clone(), base, tool, payloads, noise, ..Dataset::default() };
    let problem = Problem::new(&[NamedDataset::new("d", &data)], model, Use::Fit).unwrap();
    let truth = |name: &str| TRUE_COEFFICIENTS.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, value)| *value);
    let values: Vec<f64> = problem.parameters().iter().map(|p| p.spec.unit.to_si(truth(&p.name))).collect();
    for (sample, residual) in data.samples.iter_mut().zip(problem.residuals(&values)) {
        let Measured::Point(point) = &mut sample.measured else { continue };
        *point -= residual;
        point.iter_mut().for_each(|x| *x += NOISE * Distribution::<f64>::sample(&StandardNormal, &mut random));
    }
    assert!(data.samples.iter().any(|s| s.q[1] < -60.0 * DEG));
    data
}
