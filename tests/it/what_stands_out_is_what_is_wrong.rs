//! The comparison shows what is wrong where it is wrong, and little else; of a right model it says nothing.
//!
//! The oracle is an arm with known errors: its measurements are made by the nominal kinematics of a changed drawing, exactly, and noise
//! of a known size is added.

use std::sync::Arc;

use calibench::diagnosis::{Diagnosis, Verdict, diagnose};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Anchor, Ball, Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::residuals::comparison::{Comparison, Subject};
use calibench::residuals::noise::suspects;
use calibench::residuals::noise_floor::NoiseSource;
use calibench::residuals::views::JointVariable;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM, UM, URAD};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NOISE: f64 = 10.0 * UM;

/// Level of a finding, as the comparison claims it.
const LEVEL: f64 = 0.01;

/// A true arm in a cell.
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
        let mut arm = drawn.clone();
        arm.links[1].mdh.a += 0.4 * MM;
        arm.links[3].mdh.alpha += 0.03 * DEG;
        arm.links[2].mdh.theta -= 0.1 * DEG;
        let base = FramePose { xyz: [-0.5, 0.1, -0.1], rz_ry_rx: [0.2, 0.0, 0.0] };
        let tool = FramePose { xyz: [0.06, 0.01, -0.125], ..FramePose::default() };
        Cell { arm, drawn: Arc::new(drawn), base, tool, random: ChaCha8Rng::seed_from_u64(seed) }
    }

    fn posture(&mut self) -> Vec<f64> {
        let limits: Vec<[f64; 2]> = self.drawn.links.iter().map(|l| l.limits).collect();
        limits.iter().map(|l| self.random.random_range(0.8 * l[0]..0.8 * l[1])).collect()
    }

    /// TCP when the controller reports `q` and the joints are at `q + error(q)`.
    fn tcp(&self, q: &[f64], error: &dyn Fn(&[f64]) -> Vec<f64>) -> calibench::robot::Pose {
        let really: Vec<f64> = q.iter().zip(error(q)).map(|(q, e)| q + e).collect();
        world_from_tool(&self.arm, &self.base, &self.tool, &really)
    }

    /// Normal by the sum of twelve, which is near enough: the tests are of means.
    fn noise(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * ((0..12).map(|_| self.random.random_range(0.0..1.0)).sum::<f64>() - 6.0))
    }

    fn dataset(&self, samples: Vec<Sample>) -> Dataset {
        Dataset {
            robot: self.drawn.clone(),
            robot_reference: "kr6_r700".into(),
            base: FramePose { xyz: [-0.5, 0.1, -0.1], rz_ry_rx: [0.2, 0.0, 0.0] },
            tool: self.tool,
            noise: Noise { ball: Some(NOISE), point: Some(NOISE), joint: Vec::new(), ..Noise::default() },
            balls: places()
                .into_iter()
                .enumerate()
                .map(|(k, position)| Ball { id: (k + 1).to_string(), position, sigma: 0.0, free: false })
                .collect(),
            samples,
            ..Dataset::default()
        }
    }

    fn points(&mut self, count: usize, error: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<Sample> {
        let one = |k: usize| {
            let q = self.posture();
            let at = self.tcp(&q, error).translation.vector + self.noise(NOISE);
            let mut sample = Sample::new(format!("p{k}"), q, Measured::Point(at));
            sample.time_s = Some(30.0 * k as f64);
            sample.approach = Some((0..6).map(|j| if (k >> j) & 1 == 0 { 1 } else { -1 }).collect());
            sample
        };
        (0..count).map(one).collect()
    }

    /// Probings whose readings say where each ball is from the TCP; the balls stand at `at`.
    fn probings(&mut self, at: &[Vector3<f64>], each: usize) -> Vec<Sample> {
        let mut samples = Vec::new();
        for k in 0..each {
            for (b, at) in at.iter().enumerate() {
                let q = self.posture();
                let at = Point3::from(at + self.noise(NOISE));
                let reading = self.tcp(&q, &exact).inverse_transform_point(&at).coords;
                samples.push(Sample::new(format!("{b}-{k}"), q, Measured::Ball { ball: b, reading: Some(reading) }));
            }
        }
        samples
    }
}

fn exact(q: &[f64]) -> Vec<f64> {
    vec![0.0; q.len()]
}

fn places() -> Vec<Vector3<f64>> {
    vec![Vector3::new(0.1, -0.3, 0.2), Vector3::new(0.0, 0.3, 0.1), Vector3::new(-0.1, 0.1, 0.5), Vector3::new(0.2, 0.0, 0.3)]
}

fn geometry() -> Model {
    Model::of(&["base_frame", "mdh"])
}

fn compare(fitted: &Dataset, judged: &Dataset, which: Use) -> Comparison {
    let calibration = identify(&[NamedDataset::new("data", fitted)], &geometry()).unwrap();
    Comparison::of(&calibration, &[NamedDataset::new("data", judged)], which).unwrap()
}

#[test]
fn noise_alone_raises_an_alarm_as_rarely_as_claimed() {
    const TRIALS: u64 = 200;
    let (mut of_fit, mut of_new, mut of_unknown, mut lack) = (0, 0, 0, 0);
    // Sum of chi-square and of its degrees of freedom over all views: fitted rows, new rows.
    let mut chi2 = [[0.0; 2]; 2];
    for trial in 0..TRIALS {
        let mut cell = Cell::new(1000 + trial);
        let mut samples = cell.probings(&places(), 15);
        samples.extend(cell.points(20, &exact));
        let data = cell.dataset(samples);
        let c = compare(&data, &data, Use::Fit);
        assert!(c.fit_relation.fitted);
        add(&mut chi2[0], &c);
        of_fit += usize::from(!c.findings.is_empty());
        lack += usize::from(c.lack_of_fit.p.unwrap() < LEVEL);
        let new_points = cell.points(60, &exact);
        let new = cell.dataset(new_points);
        let c = compare(&data, &new, Use::Fit);
        assert!(!c.fit_relation.fitted);
        add(&mut chi2[1], &c);
        of_new += usize::from(!c.findings.is_empty());
        lack += usize::from(c.lack_of_fit.p.unwrap() < LEVEL);
        let silent = Dataset { noise: Noise::default(), ..data };
        let c = compare(&silent, &silent, Use::Fit);
        assert_eq!(c.noise.source, NoiseSource::Unknown);
        of_unknown += usize::from(!c.findings.is_empty());
    }
    println!(
        "of {TRIALS}: {of_fit} findings on fitted rows, {of_new} on new ones, {of_unknown} without stated noise; {lack} of {} lacks of fit",
        2 * TRIALS
    );
    // At 1 % two are expected; more than seven of 200 has a chance of 1e-3 (binomial).
    for alarms in [of_fit, of_new, of_unknown] {
        assert!(alarms <= 7);
    }
    assert!(lack <= 12, "four of 400 are expected");
    // That few alarms are raised must not be because the one-sigmas are too large. Views overlap, so a trial tells about as much as its
    // 240 residuals: 200 trials know the mean to sqrt(2 / 48,000) = 0.6 %; the noise drawn is known to 1e-3.
    for [sum, dof] in chi2 {
        println!("chi-square of the views by their degrees of freedom: {:.4}", sum / dof);
        assert!((sum / dof - 1.0).abs() < 0.025);
    }
}

fn add(sums: &mut [f64; 2], c: &Comparison) {
    let views = c.balls.iter().map(|b| b.test).chain(c.joints.iter().map(|j| j.test)).chain(c.offsets.iter().map(|o| o.test));
    for test in views.chain([c.tool.test, c.world.test]) {
        sums[0] += test.chi2;
        sums[1] += test.dof as f64;
    }
}

#[test]
fn a_moved_ball_shows_in_the_ball_table_and_nowhere_else() {
    let mut cell = Cell::new(2);
    let moved = Vector3::new(0.12, -0.08, 0.05) * MM;
    let mut at = places();
    at[1] += moved;
    let samples = cell.probings(&at, 25);
    let data = cell.dataset(samples);
    let c = compare(&data, &data, Use::Fit);
    let subjects: Vec<Subject> = c.findings.iter().map(|f| f.subject).collect();
    assert_eq!(subjects, [Subject::Ball(1)]);
    let [displacement, sigma] = c.balls[1].displacement.unwrap();
    for axis in 0..3 {
        assert!((displacement[axis] - moved[axis]).abs() < 4.0 * sigma[axis], "{displacement} {sigma}");
    }
    assert!(sigma.max() < 20.0 * UM);
    assert!(c.lack_of_fit.p.unwrap() < 1e-6);
}

#[test]
fn an_error_once_a_turn_shows_at_its_joint_first() {
    let mut cell = Cell::new(3);
    let error = |q: &[f64]| vec![200.0 * URAD * q[0].sin(), 0.0, 0.0, 0.0, 0.0, 0.0];
    let samples = cell.points(200, &error);
    let data = cell.dataset(samples);
    let c = compare(&data, &data, Use::Fit);
    assert_eq!((c.joints[0].joint, c.joints[0].against), (1, JointVariable::Angle(1)));
    assert_eq!(c.findings[0].subject, Subject::Curve(0));
    assert!(c.joints[0].test.p_family < 1e-6);
}

#[test]
fn a_bad_sample_is_looked_at_before_the_joint_that_explains_more() {
    let mut cell = Cell::new(8);
    let error = |q: &[f64]| vec![400.0 * URAD * q[0].sin(), 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut samples = cell.points(200, &error);
    if let Measured::Point(at) = &mut samples[70].measured {
        at.z += 0.6 * MM;
    }
    let data = cell.dataset(samples);
    let c = compare(&data, &data, Use::Fit);
    assert!(matches!(c.findings[0].subject, Subject::Curve(_)), "{:?}", c.findings);
    let first = c.first_look().map(|f| f.subject);
    assert!(matches!(first, Some(Subject::Sample(w)) if c.worst[w].id == "p70"), "{first:?}");
    let said = c.sentences();
    let place = |begin: &str| said.iter().position(|s| s.starts_with(begin));
    assert!(
        place("Look first at sample p70, even if more is explained elsewhere.").unwrap() < place("Joint 1").unwrap(),
        "{said:?}"
    );
}

#[test]
fn a_good_sample_is_not_accused_of_what_a_joint_does() {
    let accused = |seed: u64| {
        let mut cell = Cell::new(seed);
        let ripple = |q: &[f64]| vec![0.0, 0.0, 200.0 * URAD * (202.0 * q[2]).sin(), 0.0, 0.0, 0.0];
        let samples = cell.points(80, &ripple);
        let data = cell.dataset(samples);
        let c = compare(&data, &data, Use::Fit);
        assert!(c.lack_of_fit.p.unwrap() < LEVEL);
        c.findings.iter().any(|f| matches!(f.subject, Subject::Sample(_)))
    };
    let accused: Vec<u64> = (200..240).filter(|&seed| accused(seed)).collect();
    assert!(accused.len() <= 2, "of 40 campaigns without a bad sample: {accused:?}");
}

#[test]
fn a_moved_base_shows_in_the_world() {
    let mut cell = Cell::new(4);
    let samples = cell.points(120, &exact);
    let before = cell.dataset(samples);
    cell.base.xyz[0] += 0.15 * MM;
    cell.base.xyz[2] -= 0.10 * MM;
    let mut samples = cell.points(60, &exact);
    samples.iter_mut().for_each(|s| s.set = SampleSet::Validation);
    let after = cell.dataset(samples);
    let c = compare(&before, &after, Use::Validation);
    assert_eq!(c.findings.iter().map(|f| f.subject).collect::<Vec<_>>(), [Subject::World(0)]);
    let off = c.world.translation - Vector3::new(0.15, 0.0, -0.10) * MM;
    assert!(off.norm() < 4.0 * c.world.translation_sigma.norm());
    assert!(c.world.rms_after < 0.3 * c.rms);
}

#[test]
fn replicates_with_twice_the_stated_noise_are_found() {
    let mut cell = Cell::new(5);
    let postures: Vec<Vec<f64>> = (0..40).map(|_| cell.posture()).collect();
    let mut samples = Vec::new();
    for (k, q) in postures.iter().enumerate() {
        for turn in 0..3 {
            let at = cell.tcp(q, &exact).translation.vector + cell.noise(2.0 * NOISE);
            let mut sample = Sample::new(format!("{k}-{turn}"), q.clone(), Measured::Point(at));
            sample.repeat = Some(k.to_string());
            samples.push(sample);
        }
    }
    let data = cell.dataset(samples);
    let c = compare(&data, &data, Use::Fit);
    assert_eq!(c.noise.source, NoiseSource::Replicates);
    assert!(c.noise.contradicts_statement());
    let level = c.noise.level.unwrap();
    let [low, high] = level.interval.unwrap();
    let true_rms = 3f64.sqrt() * 2.0 * NOISE;
    assert!(low < true_rms && true_rms < high && high < 1.3 * low, "{level:?}");
    assert!(c.lack_of_fit.p.unwrap() > LEVEL, "against the true noise nothing is unexplained");
    assert!(c.findings.is_empty());
}

#[test]
fn distances_enter_along_their_line_of_sight() {
    let mut cell = Cell::new(6);
    let anchors = [[1.5, 0.0, 0.3], [-1.0, 1.4, 0.5], [-0.6, -1.6, 0.2], [0.3, 0.2, 1.8]].map(Vector3::from);
    let error = |q: &[f64]| vec![0.0, 0.0, 300.0 * URAD * (2.0 * q[2]).sin(), 0.0, 0.0, 0.0];
    let mut samples = Vec::new();
    for k in 0..150 {
        let q = cell.posture();
        let at = cell.tcp(&q, &error).translation.vector;
        for (anchor, place) in anchors.iter().enumerate() {
            let measured = Measured::Distance { anchor, distance: (at - place).norm() + cell.noise(NOISE).x };
            samples.push(Sample::new(format!("{k}-{anchor}"), q.clone(), measured));
        }
    }
    let mut data = cell.dataset(samples);
    data.anchors = anchors.iter().enumerate().map(|(k, &position)| Anchor { id: k.to_string(), position }).collect();
    let c = compare(&data, &data, Use::Fit);
    assert_eq!((c.joints[0].joint, c.joints[0].against), (3, JointVariable::Angle(3)));
    assert_eq!(c.findings[0].subject, Subject::Curve(0));
    assert!(c.balls.is_empty());
}

#[test]
fn noise_stated_ten_times_too_large_hides_no_moved_ball() {
    let mut cell = Cell::new(7);
    let mut at = places();
    at[2] += Vector3::new(0.05, 0.05, -0.05) * MM;
    let samples = cell.probings(&at, 25);
    let data = Dataset {
        noise: Noise { ball: Some(10.0 * NOISE), point: None, joint: Vec::new(), ..Noise::default() },
        ..cell.dataset(samples)
    };
    let c = compare(&data, &data, Use::Fit);
    assert!(c.lack_of_fit.noise_overstated);
    assert_eq!(c.findings.first().map(|f| f.subject), Some(Subject::Ball(2)));
}

/// Eighty points, of which those of `bad` are off by 5 mm in a random direction.
fn with_bad_samples(seed: u64, bad: &[usize]) -> Dataset {
    let mut cell = Cell::new(seed);
    let mut samples = cell.points(80, &exact);
    for &k in bad {
        let off = cell.noise(1.0).normalize() * 5.0 * MM;
        if let Measured::Point(at) = &mut samples[k].measured {
            *at += off;
        }
    }
    cell.dataset(samples)
}

#[test]
fn two_bad_samples_of_eighty_are_found_and_none_where_there_are_none() {
    const TRIALS: usize = 40;
    let named = |data: &Dataset| -> Vec<String> {
        let mut named: Vec<String> =
            suspects(&[NamedDataset::new("data", data)], &geometry()).unwrap().into_iter().map(|s| s.sample).collect();
        named.sort();
        named
    };
    let (mut found, mut accused, mut of_clean) = (0, 0, 0);
    for trial in 0..TRIALS {
        let (a, b) = ((trial * 7) % 80, (trial * 7 + 11 + trial) % 80);
        let names = named(&with_bad_samples(9000 + trial as u64, &[a, b]));
        let mut wanted = [format!("p{a}"), format!("p{b}")];
        wanted.sort();
        found += usize::from(wanted.iter().all(|w| names.contains(w)));
        accused += names.iter().filter(|n| !wanted.contains(n)).count();
        of_clean += named(&with_bad_samples(9500 + trial as u64, &[])).len();
    }
    println!("of {TRIALS}: both found in {found}, {accused} good ones accused, {of_clean} of clean data");
    assert!(found >= TRIALS * 9 / 10, "{found}");
    // A chance of 1e-3 a campaign: one in forty has a chance of 4 %, two of 1e-3.
    assert!(accused <= 1 && of_clean <= 1, "{accused}, {of_clean}");
}

fn diagnosis(data: &Dataset) -> Diagnosis {
    diagnose(&[NamedDataset::new("data", data)], &geometry()).unwrap()
}

#[test]
fn noise_twice_as_large_as_stated_is_said_and_no_effect_is_named() {
    const TRIALS: u64 = 10;
    for trial in 0..TRIALS {
        let mut cell = Cell::new(700 + trial);
        let samples = cell.points(80, &exact);
        let data = cell.dataset(samples);
        let right = diagnosis(&data);
        assert_eq!(right.verdict, Verdict::NothingLeft, "{trial}: {:?}", right.set95);
        let half = Dataset { noise: Noise { point: Some(NOISE / 2.0), ..data.noise.clone() }, ..data };
        let wrong = diagnosis(&half);
        assert_eq!(wrong.verdict, Verdict::NoiseLargerThanStated, "{trial}: {:?}", wrong.set95);
        let factor = wrong.scatter.larger_than_stated.unwrap();
        assert!((factor / 2.0 - 1.0).abs() < 0.2, "{factor}");
    }
}

/// Forty postures, six times each; from one time to the next joint `joint` is off by `angle`, and the whole by `shift`.
fn repeated(seed: u64, joint: Option<usize>, angle: f64, shift: f64) -> Dataset {
    let mut cell = Cell::new(seed);
    let mut samples = Vec::new();
    for k in 0..40 {
        let q = cell.posture();
        for turn in 0..6 {
            let wrong = cell.noise(angle).x;
            let error = |q: &[f64]| (0..q.len()).map(|j| if Some(j) == joint { wrong } else { 0.0 }).collect();
            let at = cell.tcp(&q, &error).translation.vector + cell.noise(NOISE) + cell.noise(shift);
            let mut sample = Sample::new(format!("{k}-{turn}"), q.clone(), Measured::Point(at));
            sample.repeat = Some(k.to_string());
            samples.push(sample);
        }
    }
    cell.dataset(samples)
}

#[test]
fn a_joint_that_does_not_come_back_is_named_by_its_repeats() {
    for seed in 0..5 {
        let found = diagnosis(&repeated(800 + seed, Some(0), 40.0 * URAD, 0.0)).scatter.repeats.unwrap();
        let alarms = found.alarms();
        assert_eq!(alarms.iter().map(|a| a.joint).collect::<Vec<_>>(), [0], "{found:?}");
        assert!((alarms[0].sigma / (40.0 * URAD) - 1.0).abs() < 0.25, "{found:?}");
        // Seen by one target alone, white noise and a shaking base or tool are one.
        let shaking: f64 = found.base.iter().chain(&found.tool).map(|s| s * s / 3.0).sum();
        assert!(((found.white.powi(2) + shaking).sqrt() / NOISE - 1.0).abs() < 0.3, "{found:?}");
    }
    // White noise, and a whole that shakes, raise no alarm: 2e-3 each by the promise.
    for seed in 0..10 {
        for shift in [0.0, 40.0 * UM] {
            let found = diagnosis(&repeated(900 + seed, None, 0.0, shift)).scatter.repeats.unwrap();
            assert!(found.alarms().is_empty(), "{found:?}");
        }
    }
}
