//! Poses of six dimensions identify what positions alone cannot, with the uncertainty that they state.

use std::sync::Arc;

use calibench::diagnosis::{Verdict, diagnose};
use calibench::effects::EffectId;
use calibench::identify::calibration::Calibration;
use calibench::identify::fit::fit;
use calibench::identify::problem::{Problem, Use};
use calibench::identify::{Model, identify};
use calibench::import::{ImportOptions, guess, import};
use calibench::measure::dataset::file::{read_dataset, write_dataset};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Orientation, Sample, SampleSet};
use calibench::residuals::misfit::data_fit;
use calibench::residuals::noise::suspects;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Pose, Robot, built_in};
use calibench::units::{ARCSEC, DEG, MM, UM, URAD};
use nalgebra::{Isometry3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

const POSITION: f64 = 15.0 * UM;
const ANGLE: f64 = 0.002 * DEG;

/// Axes of the probe relative to those of the tool: nowhere near what is believed.
const PROBE: [f64; 3] = [1.1, -0.6, 1.9];

/// A UR10 with errors in every link, its base believed a degree and its tool 3 mm from where they are.
struct Twin {
    nominal: Arc<Robot>,
    truth: Robot,
    base: FramePose,
    tool: FramePose,
}

/// True pose of the tool: about its axis, joint 6 shows in the orientation alone.
fn truth(twin: &Twin, q: &[f64]) -> Pose {
    let mut turned = q.to_vec();
    turned[5] += GEAR[0] * q[5].sin() + GEAR[1] * q[5].cos();
    world_from_tool(&twin.truth, &twin.base, &twin.tool, &turned)
}

fn normal(random: &mut ChaCha8Rng, size: f64) -> f64 {
    let z: f64 = StandardNormal.sample(random);
    z * size
}

fn vector(random: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(random, size))
}

fn twin(random: &mut ChaCha8Rng) -> Twin {
    let nominal = built_in("ur10").unwrap();
    let mut truth = nominal.clone();
    for link in &mut truth.links {
        link.mdh.alpha += normal(random, 0.05 * DEG);
        link.mdh.a += normal(random, 0.3 * MM);
        link.mdh.theta += normal(random, 0.05 * DEG);
        link.mdh.d += normal(random, 0.3 * MM);
    }
    let base = FramePose { xyz: [2.0, -1.0, 0.3], rz_ry_rx: [0.8 * DEG, -0.5 * DEG, 1.0 * DEG] };
    let tool = FramePose { xyz: [0.0, 0.0, 110.0 * MM], rz_ry_rx: [0.2, -0.1, 0.4] };
    Twin { nominal: Arc::new(nominal), truth, base, tool }
}

/// A verdict, and the effects of the credible set.
type Judged = (Verdict, Vec<EffectId>);

/// Eccentricity of the gear of joint 6, as amplitudes of sine and cosine, rad.
const GEAR: [f64; 2] = [400.0 * URAD, -250.0 * URAD];

fn measured(twin: &Twin, poses: usize, random: &mut ChaCha8Rng) -> Dataset {
    let probe = Rotation3::new(Vector3::from(PROBE));
    let mut samples = Vec::new();
    for k in 0..poses {
        let q: Vec<f64> = twin.nominal.links.iter().map(|_| random.random_range(-2.5..2.5)).collect();
        let seen = truth(twin, &q);
        let point = seen.translation.vector + vector(random, POSITION);
        let rotation = (Rotation3::new(vector(random, ANGLE)) * seen.rotation * probe).scaled_axis();
        let set = if k % 4 == 3 { SampleSet::Validation } else { SampleSet::Fit };
        let orientation = Some(Orientation { rotation, sigma: None });
        samples.push(Sample { orientation, set, ..Sample::new(format!("p{k}"), q, Measured::Point(point)) });
    }
    let near = |frame: &FramePose, off: f64| FramePose { xyz: frame.xyz.map(|x| x + off), rz_ry_rx: frame.rz_ry_rx };
    Dataset {
        robot: twin.nominal.clone(),
        robot_reference: "ur10".into(),
        base: FramePose { rz_ry_rx: [0.0; 3], ..near(&twin.base, 2.0 * MM) },
        tool: near(&twin.tool, 3.0 * MM),
        tool_free: true,
        noise: Noise { point: Some(POSITION), orientation: Some(ANGLE), ..Noise::default() },
        samples,
        ..Dataset::default()
    }
}

fn geometry() -> Model {
    Model::of(&["base_frame", "mdh", "harmonic1:6"])
}

#[test]
fn every_column_of_an_orientation_is_its_derivative() {
    for seen_from_tool in [false, true] {
        columns_are_derivatives(seen_from_tool);
    }
}

/// Compares the columns of six poses with differences of their residuals.
fn columns_are_derivatives(seen_from_tool: bool) {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut dataset = measured(&twin(&mut random), 6, &mut random);
    dataset.noise.seen_from_tool = seen_from_tool;
    // Errors of the joints correlate position and orientation.
    dataset.noise.joint = vec![20.0 * ARCSEC; 6];
    let model = Model::of(&["base_frame", "mdh", "joint_compliance", "link_bending:2", "probe_rotation"]);
    let problem = Problem::new(&[NamedDataset::new("", &dataset)], &model, Use::All).unwrap();
    assert_eq!(problem.row_count(), 36);
    // The derivatives neglect that a posture changes the loads, so nothing deflects here.
    let size = |effect: &str| if matches!(effect, "joint_compliance" | "link_bending:2") { 0.0 } else { 0.3 };
    let parameters = problem.parameters().iter();
    let values: Vec<f64> = parameters.map(|p| size(&p.effect) * p.spec.prior * random.random_range(-1.0..1.0)).collect();
    let all: Vec<usize> = (0..values.len()).collect();
    let near = problem.whitened(&values, &all);
    for p in all {
        let step = 1e-3 * problem.parameters()[p].spec.prior;
        let at = |by: f64| {
            let mut moved = values.clone();
            moved[p] += by;
            problem.whitened(&moved, &[]).row(0).into_owned()
        };
        let difference = (at(-step) - at(step)) / (2.0 * step);
        let off = (near.row(p) - &difference).norm();
        assert!(off <= 1e-5 * difference.norm() + 1e-9, "{}: {off} of {}", problem.parameters()[p].name, difference.norm());
    }
}

/// One-sigma noise of a camera on the hand: of the board's place, m, and of its orientation, rad.
const CAMERA: [f64; 2] = [0.2 * MM, 0.05 * DEG];

/// The same robot, measured by a camera on its hand that sees a board at the world's origin, a metre or two away.
fn seen_by_camera(twin: &Twin, poses: usize, camera: [f64; 2], random: &mut ChaCha8Rng) -> Dataset {
    let probe = Rotation3::new(Vector3::from(PROBE));
    let mut dataset = measured(twin, poses, random);
    for sample in &mut dataset.samples {
        let hand = truth(twin, &sample.q);
        let eye = Isometry3::from_parts(hand.translation, (hand.rotation * probe).into());
        let board = eye.inverse();
        let rotation = Rotation3::new(vector(random, camera[1])) * board.rotation.to_rotation_matrix();
        let seen = Isometry3::from_parts((board.translation.vector + vector(random, camera[0])).into(), rotation.into());
        sample.measured = Measured::Point(seen.inverse().translation.vector);
        sample.orientation = Some(Orientation { rotation: seen.inverse().rotation.scaled_axis(), sigma: None });
    }
    dataset.noise = Noise { point: Some(camera[0]), orientation: Some(camera[1]), seen_from_tool: true, ..Noise::default() };
    dataset
}

#[test]
fn a_camera_on_the_hand_is_as_sure_as_it_says() {
    let (mut chi2, mut dof, mut squares) = (0.0, 0, Vec::new());
    let mut missed = [0.0, 0.0];
    for seed in 200..212 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let twin = twin(&mut random);
        let dataset = seen_by_camera(&twin, 80, CAMERA, &mut random);
        // Taken for a tracker's, an error of the camera's orientation is one of the hand's position.
        let mut as_seen = dataset.clone();
        as_seen.noise.seen_from_tool = false;
        for (k, dataset) in [&dataset, &as_seen].into_iter().enumerate() {
            let calibration = identify(&[NamedDataset::new("", dataset)], &geometry()).unwrap();
            for (j, link) in twin.truth.links.iter().enumerate().take(5).skip(1) {
                let estimate = calibration.estimate(&format!("theta{}", j + 1)).unwrap();
                missed[k] += (estimate.value - link.mdh.theta).powi(2);
                if k == 0 {
                    squares.push(((estimate.value - link.mdh.theta) / estimate.sigma).powi(2));
                }
            }
        }
        let problem = Problem::new(&[NamedDataset::new("", &dataset)], &geometry(), Use::Fit).unwrap();
        let fitted = fit(&problem).unwrap();
        (chi2, dof) = (chi2 + fitted.chi2, dof + fitted.dof);
        // Held out, what is left is the noise of the place where the camera saw the board.
        let calibration = identify(&[NamedDataset::new("", &dataset)], &geometry()).unwrap();
        let held_out = calibration.predict(&[NamedDataset::new("", &dataset)], Use::Validation).unwrap().residuals;
        let left = calibench::math::rms(&held_out) / 3f64.sqrt();
        assert!((0.6..1.7).contains(&(left / CAMERA[0])), "seed {seed}: {} mm per axis", left / MM);
    }
    let reduced = chi2 / dof as f64;
    assert!((reduced - 1.0).abs() < 5.0 * (2.0 / dof as f64).sqrt(), "chi-square per degree of freedom {reduced}");
    // 48 squares of standard normal numbers: mean 48, deviation 10.
    let sum: f64 = squares.iter().sum();
    assert!((16.0..90.0).contains(&sum), "{sum} for {}", squares.len());
    assert!(missed[0] < 0.25 * missed[1], "{missed:?}");
}

#[test]
fn a_camera_and_its_board_are_found_as_surely_as_is_said() {
    // Frames of a robot whose flange is not its last frame, with an arm that is as believed.
    let (mut squares, mut numbers) = (0.0, 0);
    for seed in 300..312 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let robot = built_in("kr6_r700").unwrap();
        let twin = Twin { truth: robot.clone(), nominal: Arc::new(robot), ..twin(&mut random) };
        let mut dataset = seen_by_camera(&twin, 40, CAMERA, &mut random);
        for sample in &mut dataset.samples {
            sample.set = SampleSet::Fit;
        }
        let calibration = identify(&[NamedDataset::new("", &dataset)], &Model::of(&["base_frame"])).unwrap();
        let probe = FramePose::from_pose(&Pose::from_parts(Vector3::zeros().into(), Rotation3::new(Vector3::from(PROBE))));
        let base = twin.base.then(&twin.nominal.root.inverse());
        let tool = twin.nominal.flange.inverse().then(&twin.tool.then(&probe));
        for (found, truth) in calibration.found_frames().iter().zip([base, tool]) {
            for ((found, truth), sigma) in found.frame.to_array().iter().zip(truth.to_array()).zip(found.sigma) {
                squares += ((found - truth) / sigma).powi(2);
                numbers += 1;
            }
        }
    }
    // 144 squares of standard normal numbers: mean 144, deviation 17.
    assert_eq!(numbers, 144);
    assert!((85.0..230.0).contains(&squares), "{squares}");
}

#[test]
fn a_poor_camera_is_no_misfit_and_a_mistake_is_one() {
    for seed in 400..420 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let twin = twin(&mut random);
        // A webcam, two metres from its board.
        let dataset = seen_by_camera(&twin, 60, [1.0 * MM, 0.3 * DEG], &mut random);
        let fit = |dataset: &Dataset| data_fit(&[NamedDataset::new("", dataset)], Use::All).remove(0);
        let right = fit(&dataset);
        assert!(right.misfit.is_none(), "seed {seed}: {:?}", right.misfit);
        if seed >= 404 {
            continue;
        }
        let mut wrong = dataset.clone();
        for sample in &mut wrong.samples {
            // The board's place in centimetres; joint 4 the other way.
            match (&mut sample.measured, seed % 2) {
                (Measured::Point(at), 0) => *at *= 10.0,
                _ => sample.q[3] = -sample.q[3],
            }
        }
        assert!(fit(&wrong).misfit.is_some(), "seed {seed}");
    }
}

#[test]
fn joints_of_a_hand_eye_file_are_those_of_the_flange() {
    // Poses of the flange by arithmetic that is not ours (tests/data/tables/make.py), and the joints they are of.
    let tables = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/tables");
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.toml");
    let coordinate = |prefix: &str, axis: &str| format!("{axis} = {{ column = '{prefix}{axis}_mm', unit = 'mm' }}\n");
    let place = |prefix: &str| ["x", "y", "z"].map(|axis| coordinate(prefix, axis)).concat();
    let numbers = ["qx", "qy", "qz", "qw"].map(|n| format!("{{ column = 'board_{n}' }}")).join(", ");
    let turned = ["rx", "ry", "rz"].map(|n| format!("{{ column = '{n}_rad', unit = 'rad' }}")).join(", ");
    let text = |near: &str| {
        format!(
            "format = 'calibench-import/1'\nkind = 'pose'\n[columns]\n{}[rotation]\nform = 'quaternion_xyzw'\ninverse = true\ncolumns = [{numbers}]\n[flange]\n{}rotation = {{ form = 'vector', columns = [{turned}] }}\nnear_deg = {near}\n[dataset]\nrobot = 'ur5'\n[dataset.tool]\nx_mm = 0\ny_mm = 0\nz_mm = 0\nfree = true\n[dataset.noise]\npoint_um = 200.0\norientation_deg = 0.03\n",
            place("board_"),
            place("")
        )
    };
    let read = |text: &str| {
        std::fs::write(&map, text).unwrap();
        import(
            "generic",
            &[tables.join("hand_eye_flange.csv")],
            &ImportOptions { map: Some(map.clone()), ..Default::default() },
        )
    };
    let (dataset, report) = read(&text("[-10, -95, 105, -100, -90, 20]")).unwrap();
    assert!(report.notes.iter().any(|note| note.starts_with("the joints are a supposition")), "{:?}", report.notes);
    assert!(dataset.provenance.contains_key("joints"));
    let joints = std::fs::read_to_string(tables.join("hand_eye.csv")).unwrap();
    for (line, sample) in joints.lines().skip(1).zip(&dataset.samples) {
        for (text, q) in line.split(',').zip(&sample.q) {
            assert!((text.parse::<f64>().unwrap() - q).abs() < 2e-5, "{}: {text} is not {q}", sample.id);
        }
    }
    assert_eq!(dataset.samples.len(), 60);
    // What cannot be is named.
    let six = text("[-10, -95, 105, -100, -90, 20]");
    for (wrong, said) in [
        (text("[-10, -95, 105]"), "flange.near_deg: 3 numbers, and an arm has up to eight postures"),
        (six.replace("[columns]", "[columns]\nq1 = { column = 'x_mm', unit = 'deg' }"), "flange: columns state the joints too"),
        (six.replace("'ur5'", "'panda'"), "flange: a pose determines the joints of an arm of six"),
        (six.replace("'rx_rad'", "'r'"), "there is no such column"),
        (six.replace("unit = 'rad' }] }\n", "unit = 'rad' }], inverse = true }\n"), "flange.rotation.inverse: a controller"),
    ] {
        let error = read(&wrong).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    // Millimetres for metres: no row is within reach.
    let error = read(&six.replace("'x_mm', unit = 'mm'", "'x_mm', unit = 'm'")).unwrap_err().to_string();
    assert!(error.contains("no joints for the pose of the flange"), "{error}");
}

#[test]
fn a_pose_identifies_the_last_joint_and_states_its_uncertainty() {
    let (mut squares, mut numbers, mut chi2, mut dof) = (0.0, 0, 0.0, 0);
    for seed in 10..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let twin = twin(&mut random);
        let dataset = measured(&twin, 60, &mut random);
        let calibration = identify(&[NamedDataset::new("", &dataset)], &geometry()).unwrap();
        let prediction = calibration.predict(&[NamedDataset::new("", &dataset)], Use::Validation).unwrap();
        for (k, sample) in dataset.samples.iter().filter(|s| s.set == SampleSet::Validation).enumerate() {
            let truth = truth(&twin, &sample.q);
            let Measured::Point(point) = sample.measured else { unreachable!() };
            let missed = point - prediction.residuals[k] - truth.translation.vector;
            assert!(missed.norm() < 4.0 * POSITION, "seed {seed}: {missed:?}");
            assert!(prediction.orientations[k].unwrap().norm() < 6.0 * ANGLE, "seed {seed}: {:?}", prediction.orientations[k]);
        }
        let problem = Problem::new(&[NamedDataset::new("", &dataset)], &geometry(), Use::Fit).unwrap();
        let fitted = fit(&problem).unwrap();
        (chi2, dof) = (chi2 + fitted.chi2, dof + fitted.dof);
        // Theta and d of the last link are those of the probe and the tool, too.
        let last = &twin.truth.links[5].mdh;
        for (name, truth) in
            [("alpha5", last.alpha), ("a5", last.a), ("harmonic1:6.sin", GEAR[0]), ("harmonic1:6.cos", GEAR[1])]
        {
            let estimate = calibration.estimate(name).unwrap_or_else(|| panic!("no {name}: {:?}", calibration.unresolved));
            squares += ((estimate.value - truth) / estimate.sigma).powi(2);
            numbers += 1;
        }
        // By positions alone, what is believed of joint 6 remains what is plausible.
        let mut points = dataset.clone();
        points.samples.iter_mut().for_each(|s| s.orientation = None);
        let blind = identify(&[NamedDataset::new("", &points)], &geometry()).unwrap();
        let sigma = |c: &Calibration| c.estimate("harmonic1:6.sin").map(|e| e.sigma);
        assert!(sigma(&blind).is_none_or(|s| s > 20.0 * sigma(&calibration).unwrap()), "{:?}", sigma(&blind));
    }
    // 40 squares of standard normal numbers: mean 40, deviation 9.
    assert!((10.0..76.0).contains(&squares), "{squares} for {numbers}");
    let reduced = chi2 / dof as f64;
    assert!((reduced - 1.0).abs() < 5.0 * (2.0 / dof as f64).sqrt(), "chi-square per degree of freedom {reduced}");
}

#[test]
fn an_orientation_that_slipped_is_a_suspect_and_no_other_is() {
    for seed in 30..36 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut dataset = measured(&twin(&mut random), 100, &mut random);
        // Where the noise of the positions is not stated, that of the orientations need not be in proportion to it.
        if seed % 2 == 1 {
            dataset.noise = Noise { orientation: Some([0.1, 10.0][seed as usize / 2 % 2] * ANGLE), ..Noise::default() };
        }
        assert_eq!(suspects(&[NamedDataset::new("", &dataset)], &geometry()).unwrap(), [], "seed {seed}");
        // The probe was read while it was settling; its position is right.
        let slipped = dataset.samples[40].orientation.as_mut().unwrap();
        slipped.rotation = (Rotation3::new(Vector3::new(0.0, 30.0 * ANGLE, 0.0)) * slipped.world_from_tool()).scaled_axis();
        let found = suspects(&[NamedDataset::new("", &dataset)], &geometry()).unwrap();
        assert_eq!(found.iter().map(|s| s.sample.as_str()).collect::<Vec<_>>(), ["p40"], "seed {seed}");
        // Set aside, it says nothing of the orientation either.
        let aside = Model::of(&["base_frame", "mdh", "harmonic1:6", "outlier:p40"]);
        let problem = Problem::new(&[NamedDataset::new("", &dataset)], &aside, Use::Fit).unwrap();
        let all = Problem::new(&[NamedDataset::new("", &dataset)], &geometry(), Use::Fit).unwrap();
        assert_eq!(problem.row_count() + 3, all.row_count());
    }
}

#[test]
fn a_hidden_gear_of_joint_6_is_named_and_nothing_where_nothing_is() {
    let verdicts = |model: &Model, noise: &(dyn Fn(u64) -> Noise + Sync)| -> Vec<Judged> {
        let judged = |seed: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut dataset = measured(&twin(&mut random), 80, &mut random);
            dataset.noise = noise(seed);
            let found = diagnose(&[NamedDataset::new("", &dataset)], model).unwrap();
            (found.verdict, found.set95)
        };
        (100..120).into_par_iter().map(judged).collect()
    };
    let stated = |_: u64| Noise { point: Some(POSITION), orientation: Some(ANGLE), ..Noise::default() };
    // Where the noise of the positions is unknown, orientations are stated three times too small or too large beside them.
    let unknown = |seed: u64| {
        let weight = [0.3, 3.0][seed as usize % 2] * ANGLE / POSITION * 0.1 * MM;
        Noise { orientation: Some(weight), ..Noise::default() }
    };
    let nothing = |found: &Judged| found.0 == Verdict::NothingLeft;
    let gear = |found: &Judged| found.0 == Verdict::Identified && found.1 == ["harmonic1:6"];
    let without = Model::of(&["base_frame", "mdh"]);
    let count = |of: Vec<Judged>, is: &dyn Fn(&Judged) -> bool| of.iter().filter(|v| is(v)).count();
    let counts = [
        count(verdicts(&geometry(), &stated), &nothing),
        count(verdicts(&without, &stated), &gear),
        count(verdicts(&geometry(), &unknown), &nothing),
        // Positions alone do not show it.
        count(verdicts(&without, &unknown), &nothing),
    ];
    assert!(counts.iter().all(|c| *c >= 19), "{counts:?} of 20");
}

#[test]
fn a_pose_survives_the_disk_and_states_its_noise() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut dataset = measured(&twin(&mut random), 4, &mut random);
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("poses");
    write_dataset(&dataset, &folder).unwrap();
    let back = read_dataset(&folder).unwrap();
    for (back, sample) in back.samples.iter().zip(&dataset.samples) {
        let [back, sample] = [back, sample].map(|s| s.orientation.unwrap().world_from_tool());
        assert!((back.matrix() - sample.matrix()).norm() < 1e-12);
    }
    // Nothing says how orientations and positions are to be weighed against each other.
    (dataset.noise.orientation, dataset.hash) = (None, String::new());
    let error = write_dataset(&dataset, &folder).unwrap_err().to_string();
    assert!(error.contains("samples.csv:2: sigma_deg") && error.contains("orientation_deg"), "{error}");
}

/// One row of a table: the numbers of the form, deg, and the position, mm.
fn row(form: &str, inverse: bool, sample: &Sample) -> String {
    let Measured::Point(point) = sample.measured else { unreachable!() };
    let pose = Isometry3::from_parts(point.into(), sample.orientation.unwrap().world_from_tool().into());
    let pose = if inverse { pose.inverse() } else { pose };
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let q = pose.rotation;
    // About X, new Y, new Z is what the inverse does about Z, Y, X the other way.
    let (c, b, a) = q.inverse().euler_angles();
    let numbers = match form {
        "zyz" => {
            let m = q.to_rotation_matrix();
            let angles = [m[(1, 2)].atan2(m[(0, 2)]), m[(2, 2)].acos(), m[(2, 1)].atan2(-m[(2, 0)])];
            angles.iter().map(|v| v / DEG).collect()
        }
        "matrix" => q.to_rotation_matrix().matrix().transpose().as_slice().to_vec(),
        "vector" => q.scaled_axis().map(|v| v / DEG).as_slice().to_vec(),
        "abc" => vec![yaw / DEG, pitch / DEG, roll / DEG],
        "rpy" => vec![roll / DEG, pitch / DEG, yaw / DEG],
        "xyz" => vec![-c / DEG, -b / DEG, -a / DEG],
        "quaternion_xyzw" => vec![q.i, q.j, q.k, q.w],
        _ => vec![q.w, q.i, q.j, q.k],
    };
    let at = pose.translation.vector / MM;
    let joints = sample.q.iter().copied();
    let all: Vec<String> = joints.chain(at.iter().copied()).chain(numbers).map(|v| format!("{v:?}")).collect();
    all.join(",")
}

#[test]
fn a_pose_is_the_same_in_whatever_form_a_table_states_it() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let dataset = measured(&twin(&mut random), 12, &mut random);
    let folder = tempfile::tempdir().unwrap();
    let (table, map) = (folder.path().join("table.csv"), folder.path().join("map.toml"));
    for (form, inverse) in [
        ("vector", false),
        ("abc", false),
        ("rpy", false),
        ("xyz", false),
        ("zyz", false),
        ("matrix", false),
        ("matrix", true),
        ("quaternion_xyzw", false),
        ("quaternion_wxyz", false),
        ("vector", true),
        ("abc", true),
        ("quaternion_xyzw", true),
    ] {
        let text: Vec<String> = dataset.samples.iter().map(|s| row(form, inverse, s)).collect();
        std::fs::write(&table, text.join("\n")).unwrap();
        let column = |place: usize, unit: &str| format!("{{ column = {place}{unit} }}");
        let (count, unit) = match form {
            "matrix" => (9, ""),
            _ if form.starts_with("quaternion") => (4, ""),
            _ => (3, ", unit = 'deg'"),
        };
        let numbers: Vec<String> = (10..10 + count).map(|k| column(k, unit)).collect();
        let joints: Vec<String> = (1..=6).map(|k| format!("q{k} = {}", column(k, ", unit = 'rad'"))).collect();
        let places: Vec<String> =
            (0..3).map(|k| format!("{} = {}", ["x", "y", "z"][k], column(7 + k, ", unit = 'mm'"))).collect();
        let head = "format = 'calibench-import/1'\nheader = false\nkind = 'pose'\n[columns]";
        let rotation = format!("[rotation]\nform = '{form}'\ninverse = {inverse}\ncolumns = [{}]", numbers.join(", "));
        let rest = "[dataset]\nrobot = 'ur10'\n[dataset.tool]\nx_mm = 0\ny_mm = 0\nz_mm = 113\nfree = true\n[dataset.noise]\norientation_deg = 0.01";
        std::fs::write(&map, [head, &joints.join("\n"), &places.join("\n"), &rotation, rest].join("\n")).unwrap();
        let options = ImportOptions { map: Some(map.clone()), ..ImportOptions::default() };
        let (read, _) = import("generic", std::slice::from_ref(&table), &options).unwrap_or_else(|e| panic!("{form}: {e}"));
        assert_eq!((read.samples.len(), read.noise.seen_from_tool), (12, inverse));
        for (read, sample) in read.samples.iter().zip(&dataset.samples) {
            let (Measured::Point(at), Measured::Point(point)) = (&read.measured, &sample.measured) else { panic!("{form}") };
            assert!((at - point).norm() < 1e-9, "{form} {inverse}");
            let [a, b] = [read, sample].map(|s| s.orientation.unwrap().world_from_tool());
            assert!((a.matrix() - b.matrix()).norm() < 1e-9, "{form} {inverse}");
        }
    }
    // A quaternion that is none, and columns that do not fit the form.
    std::fs::write(&table, "0,0,0,0,0,0,1,2,3,0.5,0.5,0.5,0").unwrap();
    let options = ImportOptions { map: Some(map.clone()), ..ImportOptions::default() };
    let error = import("generic", std::slice::from_ref(&table), &options).unwrap_err().to_string();
    assert!(error.contains("not of unit length"), "{error}");
    let text = std::fs::read_to_string(&map).unwrap();
    for (from, to, said) in [
        ("quaternion_xyzw", "quaternion", "rotation.form: `quaternion` is not a form"),
        ("quaternion_xyzw", "abc", "rotation.columns: 4 columns, and the form has 3 numbers"),
        ("kind = 'pose'", "kind = 'point'", "rotation: rows of kind `point` have no orientation"),
        ("{ column = 13 }", "{ column = 13, unit = 'deg' }", "rotation.columns[3].unit: a quaternion has no unit"),
    ] {
        std::fs::write(&map, text.replace(from, to)).unwrap();
        let error = import("generic", std::slice::from_ref(&table), &options).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn an_orientation_in_an_unknown_table_is_found_or_left_out_with_a_word() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut dataset = measured(&twin(&mut random), 30, &mut random);
    dataset.base = FramePose::default();
    let robot = built_in("ur10").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("table.csv");
    let joints = "j1,j2,j3,j4,j5,j6,x_mm,y_mm,z_mm,";
    let proposed = |head: &str, rows: &[String]| {
        std::fs::write(&table, format!("{head}{}\n", rows.join("\n"))).unwrap();
        guess(&table, &robot, "ur10").unwrap_or_else(|e| panic!("{head}: {e}"))
    };
    for (form, titles) in [
        ("vector", "rx_deg,ry_deg,rz_deg"),
        ("vector", "meas_rx,meas_ry,meas_rz"),
        ("abc", "A,B,C"),
        ("rpy", "roll [deg],pitch [deg],yaw [deg]"),
        ("rpy", "W,P,R"),
        ("xyz", "rx,ry,rz"),
        ("zyz", "O,A,T"),
        ("quaternion_xyzw", "qx,qy,qz,qw"),
        ("quaternion_wxyz", "tcp_qw,tcp_qx,tcp_qy,tcp_qz"),
        ("matrix", "r11,r12,r13,r21,r22,r23,r31,r32,r33"),
    ] {
        for inverse in [false, true] {
            let rows: Vec<String> = dataset.samples.iter().map(|s| row(form, inverse, s)).collect();
            for head in [format!("{joints}{titles}\n"), String::new()] {
                let read = proposed(&head, &rows).dataset;
                assert_eq!(read.noise.seen_from_tool, inverse, "{form} {head}");
                for (read, sample) in read.samples.iter().zip(&dataset.samples) {
                    let found = read.orientation.unwrap_or_else(|| panic!("{form} {head} {inverse}"));
                    let seen = sample.orientation.unwrap().world_from_tool();
                    let turned = (found.world_from_tool().matrix() - seen.matrix()).norm();
                    assert!(turned < 1e-7, "{form} {head} {inverse}: {turned}");
                }
            }
        }
    }
    // A board that was seen upside down once, in the words of a vision library: the row is named, not the table.
    let camera = seen_by_camera(&twin(&mut random), 40, CAMERA, &mut random);
    let titles = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,tvec_x_mm,tvec_y_mm,tvec_z_mm,rvec_x_deg,rvec_y_deg,rvec_z_deg";
    let over = |k: usize| {
        let mut sample = camera.samples[k].clone();
        if k == 7 {
            let (Measured::Point(at), Some(seen)) = (&mut sample.measured, &mut sample.orientation) else { unreachable!() };
            let board = Rotation3::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0));
            *at = board * *at;
            seen.rotation = (board * seen.world_from_tool()).scaled_axis();
        }
        row("vector", true, &sample)
    };
    for titles in [titles, &titles.replace("_x", "0").replace("_y", "1").replace("_z", "2")] {
        let rows: Vec<String> = (0..40).map(over).collect();
        let read = proposed(&format!("{titles}\n"), &rows).dataset;
        assert!(read.noise.seen_from_tool && read.samples.iter().all(|s| s.orientation.is_some()));
        let misfit = data_fit(&[NamedDataset::new("", &read)], Use::All).remove(0).misfit.unwrap();
        let named: Vec<&str> = misfit.slips.iter().map(|s| s.slip.as_str()).collect();
        assert_eq!(named, ["sample:table:9"]);
    }

    // The same columns with the rows exchanged are in no form an orientation of the tool.
    let wrong = |k: usize| Sample { orientation: dataset.samples[(7 * k + 3) % 30].orientation, ..dataset.samples[k].clone() };
    let rows: Vec<String> = (0..30).map(|k| row("rpy", false, &wrong(k))).collect();
    let found = proposed(&format!("{joints}roll,pitch,yaw\n"), &rows);
    assert!(found.dataset.samples.iter().all(|s| s.orientation.is_none()));
    let said = "an orientation, which `roll`, `pitch`, `yaw` seem to be, is not used: in no usual form does it fit the arm";
    assert!(found.reasons.iter().any(|reason| reason == said), "{:?}", found.reasons);
}
