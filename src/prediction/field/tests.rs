//! Robots with known errors, explained and judged.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::basis::Group;
use super::gate::Matter;
use super::*;
use crate::diagnosis::folds::Division;
use crate::effects::error_field::JointFunctions;
use crate::identify::Model;
use crate::measure::dataset::{Ball, Dataset, Measured as Reading, Noise, Sample};
use crate::prediction::at_new_poses::AtNewPoses;
use crate::prediction::chance::normal;
use crate::prediction::poses::workspace_poses;
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, JointKind, Link, MdhLink, Robot, built_in};
use crate::units::{MM, MRAD, UM};

/// Noise of a coordinate, m.
const NOISE: f64 = 10.0 * UM;

/// Number of postures at which the field is judged.
const JUDGED: usize = 200;

/// Errors of the joints' angles at joint angles, rad.
type Errors = dyn Fn(&[f64]) -> Vec<f64>;

/// A robot with links off by ordinary amounts whose joints err, its measured points, and postures with the true positions.
struct Known {
    data: Dataset,
    poses: Vec<Vec<f64>>,
    truth: Vec<Vector3<f64>>,
}

impl Known {
    fn new(seed: u64, samples: usize, errors: &Errors) -> Self {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let robot = built_in("kr6_r700").unwrap();
        let mut real: Robot = robot.clone();
        for link in &mut real.links {
            link.mdh.alpha += 0.5 * MRAD * normal(random);
            link.mdh.theta += 0.5 * MRAD * normal(random);
            link.mdh.a += 0.2 * MM * normal(random);
            link.mdh.d += 0.2 * MM * normal(random);
        }
        let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.0, -0.125], ..FramePose::default() });
        let reached = |q: &[f64]| -> Vector3<f64> {
            let q: Vec<f64> = q.iter().zip(errors(q)).map(|(q, e)| q + e).collect();
            world_from_tool(&real, &base, &tool, &q).translation.vector
        };
        let mut data = Dataset {
            robot: Arc::new(robot),
            robot_reference: "kr6_r700".into(),
            base,
            tool,
            noise: Noise { point: Some(NOISE), ..Noise::default() },
            ..Dataset::default()
        };
        let all = workspace_poses(&data, samples + JUDGED);
        let mut order: Vec<usize> = (0..all.len()).collect();
        rand::seq::SliceRandom::shuffle(&mut order[..], random);
        let measured = order[..samples].iter().map(|&k| {
            let noise = Vector3::from_fn(|_, _| NOISE * normal(random));
            Sample::new(format!("p{k}"), all[k].clone(), Reading::Point(reached(&all[k]) + noise))
        });
        data.samples = measured.collect();
        let poses: Vec<Vec<f64>> = order[samples..].iter().map(|&k| all[k].clone()).collect();
        let truth = poses.iter().map(|q| reached(q)).collect();
        Known { data, poses, truth }
    }

    /// Two angles at once: joint 1 errs by those of joints 1 and 3.
    fn by_two_angles(seed: u64, samples: usize) -> Self {
        let random = &mut ChaCha8Rng::seed_from_u64(seed ^ 0xff);
        let [p, r] = [0; 2].map(|_| random.random_range(0.0..TAU));
        let size = 1e-4 * random.random_range(1.0..4.0);
        let errors = move |q: &[f64]| {
            let mut errors = vec![0.0; q.len()];
            errors[0] = size * (2.0 * q[0] + p).sin() * (2.0 * q[2] + r).sin();
            errors
        };
        Known::new(seed, samples, &errors)
    }

    fn perfect(seed: u64, samples: usize) -> Self {
        Known::new(seed, samples, &|q| vec![0.0; q.len()])
    }

    fn named(&self) -> [NamedDataset<'_>; 1] {
        [NamedDataset::new("known", &self.data)]
    }

    fn examined(&self) -> Examination {
        Examination::new(&self.named(), &Model::paper()).unwrap()
    }

    /// True mean error of an examined fit, m.
    fn left_by(&self, examination: &Examination) -> f64 {
        let missed = self.missed_by(examination);
        missed.iter().map(|missed| missed.norm()).sum::<f64>() / missed.len() as f64
    }

    /// What an examined fit misses at the postures, m.
    fn missed_by(&self, examination: &Examination) -> Vec<Vector3<f64>> {
        let random = &mut ChaCha8Rng::seed_from_u64(1);
        let mut there = at_poses(&self.data, examination, &self.poses, random);
        for (sample, truth) in there.samples.iter_mut().zip(&self.truth) {
            sample.measured = Reading::Point(*truth);
        }
        AtNewPoses::of_the_arm(&there, examination).unwrap().residuals()
    }

    /// The worth of the field, and the true mean error of the model alone and of the model with its field, m.
    fn judged(&self) -> (Field, Worth, [f64; 2]) {
        let examination = self.examined();
        let field = Field::of(&self.named(), &examination).unwrap();
        let worth = field.worth(&self.named(), &examination, &self.poses).unwrap();
        let missed = self.missed_by(&examination);
        let random = &mut ChaCha8Rng::seed_from_u64(SEED);
        let there = field.campaign.there(&at_poses(&self.data, &examination, &self.poses, random), &examination).unwrap();
        // What the fit's parameters do there at the means of their priors.
        let mut offset = DVector::zeros(there.rows.count());
        for (column, [sigma, mean]) in there.rows.smooth.column_iter().zip(&field.campaign.priors) {
            offset.axpy(mean / sigma, &column, 1.0);
        }
        let left = |moved: DVector<f64>| {
            let moved = moved + &offset;
            let each = missed.iter().enumerate().map(|(p, missed)| (missed - moved.fixed_rows::<3>(3 * p)).norm());
            each.sum::<f64>() / missed.len() as f64
        };
        let alone = there.rows.of_model().applied(&field.alone.mean);
        let left = [left(alone), left(there.rows.applied(&field.mean))];
        (field, worth, left)
    }
}

fn failing(worth: &Worth) -> Vec<Matter> {
    worth.gate.conditions.iter().filter(|c| !c.holds()).map(|c| c.matter).collect()
}

#[test]
fn a_joint_that_errs_by_two_angles_is_corrected_and_named() {
    let known = Known::by_two_angles(2, 80);
    let (field, worth, [before, after]) = known.judged();
    assert!(worth.gate.is_open(), "{:?}", worth.gate);
    assert!(after < 0.6 * before, "{before} {after}");
    assert_eq!(worth.shares[0].part, FieldPart::Angles { joint: 0, of: [0, 2] });
    assert!(worth.shares[0].share > 0.7 && (worth.shares.iter().map(|s| s.share).sum::<f64>() - 1.0).abs() < 1e-9);
    // What is said holds the truth: the instrument's noise is in it.
    for (said, true_error) in [(worth.before, before), (worth.after, after)] {
        let measured = true_error.hypot(1.6 * NOISE);
        let sigmas = (said.level() / measured).ln() / said.spread;
        assert!(!said.is_refused() && (-2.0..3.0).contains(&sigmas), "{said:?} {measured}");
    }
    // Fitted again with the field in the model, the robot is predicted as well.
    let examination = known.examined();
    let model = field.added_to(&known.named(), &examination);
    let refitted = Examination::new(&known.named(), &model).unwrap();
    let share = refitted.problem().parameters().iter().position(|p| p.effect == EffectId::ERROR_FIELD).unwrap();
    assert!((refitted.fit().values[share] - 1.0).abs() < 1e-3, "{}", refitted.fit().values[share]);
    let left = known.left_by(&refitted);
    assert!((left / after - 1.0).abs() < 0.1, "{left} {after}");
    let numbers = model.field.unwrap().numbers;
    assert!((5.0..130.0).contains(&numbers), "{numbers}");
}

#[test]
fn a_robot_whose_joints_do_not_err_keeps_its_model() {
    let (_, worth, [before, after]) = Known::perfect(1, 60).judged();
    assert!(!worth.gate.is_open() && failing(&worth).contains(&Matter::OwnRatio), "{:?}", worth.gate);
    assert!(after < 1.3 * before, "{before} {after}");
}

#[test]
fn fields_are_the_same_on_one_thread_and_on_two() {
    let known = Known::by_two_angles(5, 210);
    let examination = known.examined();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let field = Field::of(&known.named(), &examination).unwrap();
            (field.added_to(&known.named(), &examination), field.divisions.clone(), field.draws[0].clone())
        })
    };
    let [one, two] = [1, 2].map(on);
    assert!(one == two);
}

#[test]
fn what_carries_no_field_is_an_error_by_name() {
    let said = |known: &Known, model: &Model, change: fn(&mut Examination)| {
        let mut examination = Examination::new(&known.named(), model).unwrap();
        change(&mut examination);
        let field = Field::of(&known.named(), &examination);
        field.and_then(|f| f.worth(&known.named(), &examination, &[]).map(drop)).unwrap_err().to_string()
    };
    let enough = Known::perfect(3, 24);
    let as_fitted = |_: &mut Examination| {};
    assert!(said(&enough, &Model::paper(), as_fitted).contains("name at least one"));
    assert!(said(&Known::perfect(3, 19), &Model::paper(), as_fitted).contains("19 postures are too few"));
    assert!(
        said(&enough, &Model::of(&[EffectId::BASE_FRAME, EffectId::TOOL_FRAME]), as_fitted).contains("does not hold 'mdh'")
    );
    let stopped = |e: &mut Examination| e.fit.outcome = Outcome::IterationLimit;
    assert!(said(&enough, &Model::paper(), stopped).contains("did not converge"));
}

#[test]
fn all_samples_by_columns_give_what_fewer_give_by_rows() {
    let known = Known::by_two_angles(4, 120);
    let examination = known.examined();
    let campaign = Campaign::of(&known.named(), &examination).unwrap();
    let Campaign { rows, groups, y, stated, .. } = &campaign;
    let alone = rows.of_model();
    let weights = evidence::weights(&alone, y).unwrap();
    let by_rows = evidence::of_groups(rows, groups, y, &weights, *stated).unwrap();
    let by_columns = mean_of_all(&examination, &campaign, rows, groups, &by_rows.sizes).unwrap();
    let moved = rows.applied(&by_rows.mean);
    assert!((rows.applied(&by_columns) - &moved).norm() < 0.02 * moved.norm());
    // Of the model alone nothing is left out.
    let by_rows = evidence::of_model(&alone, y, &weights, *stated).unwrap();
    // At the fitted samples themselves, the variances over those of the noise sum to the number of parameters that the data determine.
    let variances = by_rows.variances(&alone, &Groups::default(), &alone);
    let taken = variances.iter().zip(&weights).map(|(v, w)| v * w).sum::<f64>() / by_rows.sizes.noise;
    let parameters = alone.smooth.ncols() as f64;
    assert!((0.8 * parameters..parameters).contains(&taken), "{taken} {parameters}");
    let by_columns = mean_of_all(&examination, &campaign, &alone, &Groups::default(), &by_rows.sizes).unwrap();
    assert!((&by_columns.smooth - &by_rows.mean.smooth).norm() < 1e-6 * by_rows.mean.smooth.norm());
}

/// A perfect arm that probes four balls of unknown place by turns.
fn at_unknown_balls(samples: usize) -> Known {
    let mut known = Known::perfect(6, samples);
    let random = &mut ChaCha8Rng::seed_from_u64(6);
    let data = &mut known.data;
    let places = [[0.5, 0.3, 0.1], [0.5, -0.3, 0.1], [0.3, 0.0, 0.5], [-0.3, 0.4, 0.3]];
    data.balls =
        (0..4).map(|k| Ball { id: format!("{k}"), position: Vector3::from(places[k]), sigma: 0.0, free: true }).collect();
    data.noise = Noise { ball: Some(NOISE), ..Noise::default() };
    for (k, sample) in data.samples.iter_mut().enumerate() {
        let tool = world_from_tool(&data.robot, &data.base, &data.tool, &sample.q);
        let noise = Vector3::from_fn(|_, _| NOISE * normal(random));
        let reading = tool.inverse_transform_point(&(data.balls[k % 4].position + noise).into()).coords;
        sample.measured = Reading::Ball { ball: k % 4, reading: Some(reading) };
    }
    known
}

#[test]
fn an_unknown_ball_left_out_is_judged_about_its_own_place() {
    let known = at_unknown_balls(100);
    let examination = known.examined();
    let field = Field::of(&known.named(), &examination).unwrap();
    let worth = field.worth(&known.named(), &examination, &known.poses).unwrap();
    let of = |division: Division| field.divisions.iter().find(|d| d.parting.division == division).unwrap();
    let (random, places) = (of(Division::Random), of(Division::Places));
    assert_eq!(places.parting.count, 4);
    // Nothing but noise: where the ball is, is no error, and no frame that defines the world is uncertain.
    for measured in [random, places] {
        assert!(measured.errors.iter().all(|e| (1.2..2.6).contains(&(e / NOISE))), "{measured:?}");
    }
    assert!(places.leverage.max(random.leverage) < 1.0, "{random:?} {places:?}");
    assert!(worth.before.leverage < 3.0 && !worth.gate.is_open(), "{:?}", worth.before);
}

/// An arm of these links, measured by a tracker at random joint positions.
fn elsewhere(links: Vec<Link>) -> Dataset {
    let random = &mut ChaCha8Rng::seed_from_u64(8);
    let robot = Robot { name: "gantry".into(), links, ..Robot::default() };
    let tool = FramePose { xyz: [0.06, 0.0, -0.125], ..FramePose::default() };
    let mut data = Dataset { tool, noise: Noise { point: Some(NOISE), ..Noise::default() }, ..Dataset::default() };
    let samples = (0..80).map(|k| {
        let q: Vec<f64> = robot.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
        let noise = Vector3::from_fn(|_, _| NOISE * normal(random));
        let point = world_from_tool(&robot, &data.base, &tool, &q).translation.vector + noise;
        Sample::new(format!("p{k}"), q, Reading::Point(point))
    });
    data.samples = samples.collect();
    data.robot = Arc::new(robot);
    data
}

#[test]
fn of_an_arm_on_a_rail_only_the_joints_that_turn_have_a_field() {
    let slide = |alpha: f64| Link {
        mdh: MdhLink { kind: JointKind::Prismatic, alpha, ..MdhLink::default() },
        limits: [0.0, 1.5],
        mass: 0.0,
        com: Vector3::zeros(),
    };
    let of = |links: Vec<Link>| {
        let data = elsewhere(links);
        let named = [NamedDataset::new("there", &data)];
        let examination = Examination::new(&named, &Model::geometry()).unwrap();
        Field::of(&named, &examination)
    };
    let mut links = built_in("kr6_r700").unwrap().links;
    links[0].mdh.alpha -= FRAC_PI_2;
    links.insert(0, slide(FRAC_PI_2));
    let on_a_rail = of(links).unwrap();
    assert!(!on_a_rail.campaign.basis.joints.is_empty());
    assert!(on_a_rail.campaign.groups.all.iter().all(|group| match *group {
        Group::Effect(_) => true,
        Group::Joint(JointFunctions::Curve { joint, .. }) => joint > 0,
        Group::Joint(JointFunctions::Angles { joint, of }) => joint > 0 && of[0] > 0,
        Group::Joint(JointFunctions::Load { joint, angle }) => joint > 0 && angle > 0,
    }));
    let gantry = of(vec![slide(0.0), slide(FRAC_PI_2), slide(FRAC_PI_2)]).map(drop);
    assert!(gantry.unwrap_err().to_string().starts_with("no joint of 'gantry' turns"));
}
