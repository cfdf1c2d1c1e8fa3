//! Points, probed balls and distances, in one session or several, determine the arm that made them.
//!
//! The oracle is an arm with known errors: its measurements are made by the nominal kinematics of a changed drawing, exactly.

use std::sync::Arc;

use calibench::effects::registry::Registry;
use calibench::identify::calibration::{Calibration, IdentifyError, read_calibration, write_calibration};
use calibench::identify::problem::{ProblemError, Use};
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Anchor, Ball, BallDistance, Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM, UM};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Exact data leave only rounding, grown by the condition of the fit (about 1e3) from 1e-15 m.
const EXACT: f64 = 1e-9;

/// Lengths and angles that a fit with a known tool can tell, and by how much the true arm differs.
const ERRORS: [(&str, f64); 6] = [
    ("a2", 0.4 * MM),
    ("d4", -0.3 * MM),
    ("alpha1", 0.03 * DEG),
    ("theta3", -0.1 * DEG),
    ("beta2", 0.02 * DEG),
    ("a5", 0.1 * MM),
];

fn true_arm(drawn: &Robot) -> Robot {
    let mut arm = drawn.clone();
    for (name, error) in ERRORS {
        let (entry, index) = name.split_at(name.len() - 1);
        let index: usize = index.parse().unwrap();
        match entry {
            "a" => arm.links[index].mdh.a += error,
            "alpha" => arm.links[index].mdh.alpha += error,
            "beta" => arm.links[index].mdh.beta += error,
            "d" => arm.links[index - 1].mdh.d += error,
            _ => arm.links[index - 1].mdh.theta += error,
        }
    }
    arm
}

/// A set-up of the true arm, and random postures of it.
struct Cell {
    drawn: Arc<Robot>,
    arm: Robot,
    base: FramePose,
    tool: FramePose,
    random: ChaCha8Rng,
}

impl Cell {
    fn new(seed: u64) -> Self {
        let drawn = built_in("kr6_r700").unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut near = |about: f64, by: f64| about + random.random_range(-by..by);
        let base = FramePose {
            xyz: [near(-0.5, 0.01), near(0.1, 0.01), near(-0.1, 0.01)],
            rz_ry_rx: [near(0.2, 0.01), near(0.0, 0.01), near(0.0, 0.01)],
        };
        let tool = FramePose { xyz: [0.06, 0.01, -0.125], ..FramePose::default() };
        Cell { arm: true_arm(&drawn), drawn: Arc::new(drawn), base, tool, random }
    }

    fn posture(&mut self) -> Vec<f64> {
        let limits: Vec<[f64; 2]> = self.drawn.links.iter().map(|l| l.limits).collect();
        limits.iter().map(|l| self.random.random_range(0.8 * l[0]..0.8 * l[1])).collect()
    }

    fn tcp(&self, q: &[f64]) -> calibench::robot::Pose {
        world_from_tool(&self.arm, &self.base, &self.tool, q)
    }

    fn dataset(&self) -> Dataset {
        Dataset {
            robot: self.drawn.clone(),
            robot_reference: "kr6_r700".into(),
            base: FramePose { xyz: [-0.5, 0.1, -0.1], rz_ry_rx: [0.2, 0.0, 0.0] },
            tool: self.tool,
            noise: Noise { ball: Some(10.0 * UM), point: Some(10.0 * UM), joint: Vec::new(), ..Noise::default() },
            ..Dataset::default()
        }
    }

    fn points(&mut self, count: usize, name: &str) -> Vec<Sample> {
        let one = |k: usize| {
            let q = self.posture();
            let at = self.tcp(&q).translation.vector;
            Sample::new(format!("{name}{k}"), q, Measured::Point(at))
        };
        (0..count).map(one).collect()
    }

    /// Probings whose readings say where the ball is from the TCP: exact however far away.
    fn probings(&mut self, balls: &[Vector3<f64>], each: usize) -> Vec<Sample> {
        let mut samples = Vec::new();
        for (b, at) in balls.iter().enumerate() {
            for k in 0..each {
                let q = self.posture();
                let reading = self.tcp(&q).inverse_transform_point(&Point3::from(*at)).coords;
                samples.push(Sample::new(format!("{b}-{k}"), q, Measured::Ball { ball: b, reading: Some(reading) }));
            }
        }
        samples
    }
}

fn geometry() -> Model {
    Model::of(&["base_frame", "mdh"])
}

fn fit(dataset: &Dataset) -> Calibration {
    identify(&[NamedDataset::new("data", dataset)], &geometry()).unwrap()
}

/// That the errors of the arm were found.
fn assert_found(c: &Calibration, tolerance: f64) {
    for (name, error) in ERRORS {
        let e = c.estimate(name).unwrap_or_else(|| panic!("{name} is left out: {:?}", c.unresolved));
        assert!((e.value - e.nominal - error).abs() < tolerance, "{name}: {} instead of {error}", e.value - e.nominal);
    }
}

fn places() -> Vec<Vector3<f64>> {
    vec![Vector3::new(0.1, -0.3, 0.2), Vector3::new(0.0, 0.3, 0.1), Vector3::new(-0.1, 0.1, 0.5), Vector3::new(0.2, 0.0, 0.3)]
}

fn balls(free: bool, sigma: f64) -> Vec<Ball> {
    let ball = |(k, position): (usize, Vector3<f64>)| Ball { id: (k + 1).to_string(), position, sigma, free };
    places().into_iter().enumerate().map(ball).collect()
}

#[test]
fn distances_to_anchors_find_the_arm() {
    let mut cell = Cell::new(1);
    let mut dataset = cell.dataset();
    let anchors = [[1.5, 0.0, 0.3], [-1.0, 1.4, 0.5], [-0.6, -1.6, 0.2], [0.3, 0.2, 1.8]].map(Vector3::from);
    dataset.anchors = anchors.iter().enumerate().map(|(k, &position)| Anchor { id: k.to_string(), position }).collect();
    for k in 0..60 {
        let q = cell.posture();
        let at = cell.tcp(&q).translation.vector;
        for (anchor, place) in anchors.iter().enumerate() {
            let measured = Measured::Distance { anchor, distance: (at - place).norm() };
            dataset.samples.push(Sample::new(format!("{k}-{anchor}"), q.clone(), measured));
        }
    }
    let c = fit(&dataset);
    assert_eq!((c.rank, c.dof), (26, 240 - 26), "one residual a distance");
    assert_found(&c, EXACT);
    assert!(c.rms < EXACT);
    // One anchor leaves the robot free to turn about it.
    dataset.samples.retain(|s| matches!(s.measured, Measured::Distance { anchor: 0, .. }));
    let c = fit(&dataset);
    for name in ["base_rz", "base_ry", "base_rx"] {
        assert!(c.estimate(name).is_none() && c.unresolved.iter().any(|g| g[0] == name), "{name}: {:?}", c.unresolved);
    }
}

#[test]
fn a_distance_between_free_balls_gives_the_scale() {
    let mut cell = Cell::new(2);
    let mut dataset = cell.dataset();
    dataset.samples = cell.probings(&places(), 30);
    dataset.balls = balls(true, 0.0);
    // First guesses centimetres off, and a base that nobody can check.
    dataset.balls.iter_mut().for_each(|b| b.position += Vector3::new(0.03, -0.02, 0.01));
    let between =
        |a: usize, b: usize| BallDistance { between: [a, b], distance: (places()[a] - places()[b]).norm(), sigma: 10.0 * UM };
    dataset.ball_distances = vec![between(0, 1), between(2, 3)];
    let c = fit(&dataset);
    assert_found(&c, EXACT);
    assert!(c.rms < EXACT);
    for axis in ["x", "y", "z", "rz", "ry", "rx"] {
        let name = format!("base_{axis}");
        assert!(c.estimate(&name).is_none(), "{name} defines the world");
        assert!(c.unresolved.iter().any(|g| g[0] == name && g[1].starts_with("ball:")), "{name}: {:?}", c.unresolved);
    }
    let apart = |a: &str, b: &str| {
        let of = |ball: &str| Vector3::from(["x", "y", "z"].map(|x| c.estimate(&format!("ball:{ball}.{x}")).unwrap().value));
        (of(a) - of(b)).norm()
    };
    assert!((apart("1", "4") - (places()[0] - places()[3]).norm()).abs() < EXACT, "distances nobody stated come out");
}

#[test]
fn stated_balls_lie_between_fixed_and_free() {
    let mut cell = Cell::new(3);
    let mut dataset = cell.dataset();
    let mut true_places = places();
    true_places[2] += Vector3::new(0.0, 30.0 * UM, 0.0);
    dataset.samples = cell.probings(&true_places, 25);
    let with = |balls: Vec<Ball>| fit(&Dataset { balls, ..dataset.clone() });
    let (fixed, free) = (with(balls(false, 0.0)), with(balls(true, 0.0)));
    let (tight, stated, loose) = (with(balls(false, 1e-4 * UM)), with(balls(false, 20.0 * UM)), with(balls(false, 1.0)));
    let a2 = |c: &Calibration| c.estimate("a2").unwrap().value;
    assert!((a2(&tight) - a2(&fixed)).abs() < EXACT, "as good as fixed");
    assert!((a2(&loose) - a2(&free)).abs() < 1e-7, "as good as free; the world is then held by a metre's worth of certificate");
    let y = stated.estimate("ball:3.y").unwrap();
    let moved = (y.value - y.nominal) / UM;
    assert!(moved > 1.0 && moved < 30.0, "part of the 30 um: {moved}");
    assert_eq!(y.stated_sigma, Some(20.0 * UM));
    assert!(y.sigma < 20.0 * UM, "the data add to the certificate");
    // The certificate's own residuals count: the sum of squares is below that of fixed balls, above that of free ones.
    assert!(stated.chi2_per_dof < fixed.chi2_per_dof && stated.chi2_per_dof > 0.0);
    assert_eq!((stated.rank, stated.dof), (fixed.rank, fixed.dof));
}

#[test]
fn rows_weigh_as_they_state_and_replicates_are_only_named() {
    let mut cell = Cell::new(4);
    let mut dataset = cell.dataset();
    dataset.samples = cell.points(60, "p");
    for sample in &mut dataset.samples {
        let mut off = || cell.random.random_range(-10.0 * UM..10.0 * UM);
        if let Measured::Point(p) = &mut sample.measured {
            *p += Vector3::new(off(), off(), off());
        }
    }
    let without = fit(&dataset);
    let mut doubted = dataset.clone();
    let mut wrong = cell.points(1, "wrong").remove(0);
    if let Measured::Point(p) = &mut wrong.measured {
        p.x += 5.0 * MM;
    }
    wrong.sigma = Some(1e3);
    doubted.samples.push(wrong);
    let with = fit(&doubted);
    for (a, b) in without.estimates.iter().zip(&with.estimates) {
        assert!((a.value - b.value).abs() < 1e-6 * a.sigma, "{}: a row stated as worthless moves nothing", a.name);
    }
    // A row with half the sigma weighs as four rows do.
    let mut sharp = dataset.clone();
    sharp.samples[7].sigma = Some(5.0 * UM);
    let mut four = dataset.clone();
    for k in 0..3 {
        let copy = Sample { id: format!("again {k}"), repeat: Some("seven".into()), ..four.samples[7].clone() };
        four.samples.push(copy);
    }
    four.samples[7].repeat = Some("seven".into());
    let (sharp, four) = (fit(&sharp), fit(&four));
    for (a, b) in sharp.estimates.iter().zip(&four.estimates) {
        assert!((a.value - b.value).abs() < 1e-6 * a.sigma && (a.sigma / b.sigma - 1.0).abs() < 1e-6, "{}", a.name);
    }
}

/// Two campaigns of one arm in two cells, tracker points; a fifth of the rows for validation.
fn campaigns() -> [Dataset; 2] {
    [5, 6].map(|seed| {
        let mut cell = Cell::new(seed);
        if seed == 6 {
            cell.base.xyz = [2.0, -3.0, 0.7];
            cell.base.rz_ry_rx[0] = -2.5;
            cell.tool.xyz = [0.03, -0.02, -0.1];
        }
        let mut dataset = Dataset { tool_free: true, ..cell.dataset() };
        dataset.tool.xyz = [0.0, 0.0, -0.11];
        dataset.samples = cell.points(80, "p");
        dataset.samples.iter_mut().step_by(5).for_each(|s| s.set = SampleSet::Validation);
        dataset
    })
}

fn largest(c: &Calibration, datasets: &[NamedDataset<'_>]) -> f64 {
    c.predict(datasets, Use::Validation).unwrap().residuals.iter().map(|r| r.norm()).fold(0.0, f64::max)
}

#[test]
fn several_folders_are_one_robot_with_its_own_base_and_tool_in_each() {
    let [a, b] = campaigns();
    let both = identify(&[NamedDataset::new("A", &a), NamedDataset::new("B", &b)], &geometry()).unwrap();
    for name in ["base_x@A", "base_rz@A", "tool_z@A", "base_x@B", "base_rx@B", "tool_x@B", "a2"] {
        assert!(both.estimate(name).is_some(), "{name}");
    }
    assert!(both.estimates.iter().all(|e| e.name.contains('@') == (e.effect == "base_frame" || e.effect == "tool_frame")));
    assert!(both.rms < EXACT);
    let tool = ["x", "y", "z"].map(|x| both.estimate(&format!("tool_{x}@B")).unwrap().value);
    assert!((Vector3::from(tool) - Vector3::new(0.03, -0.02, -0.1)).norm() < EXACT, "{tool:?}");

    // The file says it all: the same predictions, whichever folders are judged.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("both.toml");
    write_calibration(&both, &path).unwrap();
    let read = read_calibration(&path, Registry::catalogue()).unwrap();
    let (of_a, of_b) = (NamedDataset::new("A", &a), NamedDataset::new("B", &b));
    for judged in [&[of_a, of_b][..], &[of_b], &[of_a]] {
        let (before, after) = (both.predict(judged, Use::Validation).unwrap(), read.predict(judged, Use::Validation).unwrap());
        assert!(before.refitted.is_empty() && before.from_fit_rows.is_empty(), "all set-ups are known");
        assert!(before.residuals.iter().zip(&after.residuals).all(|(x, y)| (x - y).norm() < 1e-12));
        assert!(after.residuals.iter().all(|r| r.norm() < EXACT));
    }

    // The robot of one campaign, judged in the other: set up again on its rows for fitting, and said so.
    let only_a = identify(&[NamedDataset::new("A", &a)], &geometry()).unwrap().set_up_anew();
    let there = only_a.predict(&[NamedDataset::new("B", &b)], Use::Validation).unwrap();
    assert_eq!(there.from_fit_rows.len(), 9, "{:?}", there.from_fit_rows);
    assert!(there.refitted.is_empty() && largest(&only_a, &[NamedDataset::new("B", &b)]) < EXACT);
    let sole = Dataset { samples: b.samples.iter().filter(|s| s.set == SampleSet::Validation).cloned().collect(), ..b.clone() };
    let there = only_a.predict(&[NamedDataset::new("B", &sole)], Use::Validation).unwrap();
    assert_eq!((there.refitted.len(), there.from_fit_rows.len()), (9, 0), "no other rows to take it from");

    let twice = identify(&[NamedDataset::new("A", &a), NamedDataset::new("A", &b)], &geometry());
    assert!(matches!(twice, Err(IdentifyError::Problem(ProblemError::SameName { .. }))));
}

#[test]
fn free_balls_of_several_folders_keep_to_themselves() {
    let one = |seed: u64, shift: f64| {
        let mut cell = Cell::new(seed);
        let mut dataset = cell.dataset();
        let moved: Vec<Vector3<f64>> = places().iter().map(|p| p + Vector3::new(shift, 0.0, 0.0)).collect();
        dataset.samples = cell.probings(&moved, 15);
        dataset.samples.iter_mut().step_by(5).for_each(|s| s.set = SampleSet::Validation);
        dataset.balls = balls(true, 0.0);
        dataset.ball_distances =
            vec![BallDistance { between: [0, 1], distance: (places()[0] - places()[1]).norm(), sigma: UM }];
        dataset
    };
    let (a, b) = (one(7, 0.0), one(8, 0.2));
    let both = identify(&[NamedDataset::new("A", &a), NamedDataset::new("B", &b)], &geometry()).unwrap();
    assert_found(&both, EXACT);
    assert!(both.estimate("ball:1.x@A").is_some() && both.estimate("ball:1.x@B").is_some());
    // Judged alone, a folder keeps its own balls.
    let alone = both.predict(&[NamedDataset::new("B", &b)], Use::Validation).unwrap();
    assert!(alone.refitted.is_empty() && alone.from_fit_rows.is_empty(), "{:?}", alone.refitted);
    assert!(alone.residuals.iter().all(|r| r.norm() < EXACT));
}

#[test]
fn a_robot_on_a_wall_and_one_astray_are_found() {
    for turned in [[0.2, 90.0 * DEG, 0.0], [0.2, 89.9 * DEG, 2.0], [3.0, -1.0, -2.0]] {
        let mut cell = Cell::new(9);
        cell.base.rz_ry_rx = turned;
        let samples = cell.points(60, "p");
        // The drawing knows it; the drawing knows nothing.
        for base in [cell.base, FramePose::default()] {
            let mut dataset = Dataset { base, samples: samples.clone(), ..cell.dataset() };
            dataset.base.xyz[0] += 0.003;
            let c = fit(&dataset);
            assert_found(&c, 1e-8);
            assert!(c.rms < EXACT, "{turned:?}: {}", c.rms);
        }
    }
}

#[test]
fn known_balls_tell_where_a_robot_astray_stands() {
    let mut cell = Cell::new(10);
    let mut dataset = Dataset { balls: balls(false, 0.0), ..cell.dataset() };
    dataset.samples = cell.probings(&places(), 20);
    dataset.base = FramePose { xyz: [5.0, -3.0, 2.0], rz_ry_rx: [3.3, 0.4, -0.2] };
    let c = fit(&dataset);
    assert_found(&c, EXACT);
    assert_eq!(c.rank, 26);
}
