//! An arm that is measured while it moves is known as well as one that is measured at eighty poses at which it stands, and the time
//! between its joints and the instrument is found to a tenth of a millisecond; or what is missing is said.

use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::import::ImportOptions;
use calibench::measure::dataset::{Dataset, NamedDataset, SampleSet};
use calibench::robot::{Robot, built_in};
use calibench_logs::{Log, LogOptions, LogTable, Moving, Track, log_table};

use crate::moving_arm::{Campaign, Truth};

/// Mean distance by which a calibration of one dataset misses another, m.
fn missed(fitted: &Dataset, left_out: &Dataset) -> f64 {
    let both = Dataset { samples: fitted.samples.iter().chain(&left_out.samples).cloned().collect(), ..fitted.clone() };
    let named = [NamedDataset::new("", &both)];
    let calibration = identify(&named, &Model::default_for(fitted)).unwrap();
    let found = calibration.predict(&named, Use::Validation).unwrap();
    found.residuals.iter().map(|r| r.norm()).sum::<f64>() / found.residuals.len() as f64
}

/// What a recording in motion is worth.
struct Outcome {
    /// By how much the shift is off, s.
    shift: f64,
    sigma: f64,
    /// Mean error at still poses left out, m: from motion, and from eighty poses.
    moving: f64,
    still: f64,
    said: Vec<String>,
}

fn outcome(robot: &Robot, campaign: &Campaign, clock: f64, seed: u64) -> Outcome {
    let mut truth = Truth::of(robot, seed);
    let (log, shift) = truth.recorded(campaign, clock);
    let folder = tempfile::tempdir().unwrap();
    let options = LogOptions { noise: Some(campaign.noise / 2.0), ..moving() };
    let LogTable { file, guess, said, shift_s, shift_sigma_s, .. } =
        log_table(&log, robot, &robot.name, &options, folder.path()).unwrap();
    let (dataset, _) = guess.import(&[folder.path().join(file)], &ImportOptions::default()).unwrap();
    let left_out = truth.still(campaign, &dataset, 200, SampleSet::Validation, 0.0);
    let eighty = truth.still(campaign, &dataset, 80, SampleSet::Fit, campaign.noise / 2.0);
    Outcome {
        shift: shift_s - shift,
        sigma: shift_sigma_s.unwrap(),
        moving: missed(&dataset, &left_out),
        still: missed(&eighty, &left_out),
        said,
    }
}

fn moving() -> LogOptions {
    LogOptions { moving: true, ..LogOptions::default() }
}

/// Joints of the second and further ones that follow their drives late, s.
const LATE: [f64; 6] = [0.0, 0.004, 0.002, 0.0, 0.001, 0.003];

/// Campaigns by their names, each with its robot.
fn campaigns() -> Vec<(&'static str, Robot, Campaign)> {
    let [ur5, kr6] = ["ur5", "kr6_r700"].map(|name| built_in(name).unwrap());
    let d = Campaign::default();
    vec![
        ("UR5 at 125 Hz", ur5.clone(), d.clone()),
        ("KR6 at 1,000 Hz", kr6.clone(), Campaign { rates: [1000.0, 100.0], ..d.clone() }),
        ("KR6 whose joints lag", kr6.clone(), Campaign { rates: [250.0, 100.0], late: LATE, ..d.clone() }),
        ("UR5 from pose to pose", ur5.clone(), Campaign { by_poses: true, ..d.clone() }),
        ("UR5 and a camera at 30 Hz", ur5.clone(), Campaign { rates: [125.0, 30.0], noise: 1e-4, filter: 0.015, ..d.clone() }),
        ("UR5 at half the speed", ur5, Campaign { speed: 1.0, ..d.clone() }),
        ("KR6 at half the speed", kr6, Campaign { rates: [1000.0, 1000.0], speed: 1.0, ..d }),
    ]
}

#[test]
fn the_time_and_the_arm_are_found() {
    // Robots that no figure of the study is of.
    for (k, (name, robot, campaign)) in campaigns().into_iter().take(5).enumerate() {
        let found = outcome(&robot, &campaign, 0.05 + 0.1 * k as f64, 1001 + k as u64);
        let said = found.said.join("\n");
        assert!(found.shift.abs() < 2e-4, "{name}: {} s off\n{said}", found.shift);
        assert!(found.moving < 1.4 * found.still, "{name}: {} m, {} m from eighty poses\n{said}", found.moving, found.still);
        assert_eq!(said.contains("do not follow alike"), campaign.late == LATE, "{name}\n{said}");
        assert!(found.said.iter().any(|line| line.contains("after the joints, give or take")), "{name}\n{said}");
    }
}

#[test]
fn a_clock_of_its_own_is_matched_or_asked_for() {
    let robot = built_in("ur5").unwrap();
    let campaign = Campaign { seconds: 40.0, ..Campaign::default() };
    let (mut log, shift) = Truth::of(&robot, 2001).recorded(&campaign, 731.25);
    log.tracks[0].recording = 1;
    let found = Moving::of(&log, &robot, &moving()).unwrap().poses();
    assert!((found.shift_s - shift).abs() < 5e-3, "{} s, and it is {shift} s", found.shift_s);
    // What another arm did is not matched.
    let (other, _) = Truth::of(&robot, 2003).recorded(&campaign, 731.25);
    let mixed = Log { tracks: vec![Track { recording: 1, ..other.tracks[0].clone() }], ..log.clone() };
    let told = Moving::of(&mixed, &robot, &moving()).err().unwrap().to_string();
    assert!(told.contains("cannot be matched") && told.contains("--shift"), "{told}");
    // Of a motion that repeats itself either cycle may be meant.
    let (joints, track) = (log.joints[0].clone(), log.tracks[0].clone());
    let later = |times: &[f64]| -> Vec<f64> {
        times.iter().chain(&times.iter().map(|t| t + 40.0).collect::<Vec<_>>()).copied().collect()
    };
    log.joints[0].positions.extend(joints.positions.clone());
    log.joints[0].times.stated = later(&joints.times.stated);
    log.joints[0].times.recorded = later(&joints.times.recorded);
    log.tracks[0] = Track { recording: 1, ..track };
    let told = Moving::of(&log, &robot, &moving()).err().unwrap().to_string();
    assert!(told.contains("or at more than one"), "{told}");
    let given = LogOptions { shift: Some(shift), ..moving() };
    assert_eq!(Moving::of(&log, &robot, &given).unwrap().poses().shift_s, shift);
}

#[test]
fn what_motion_cannot_show_is_refused() {
    let robot = built_in("ur5").unwrap();
    let told = |campaign: &Campaign| {
        let (log, shift) = Truth::of(&robot, 2002).recorded(campaign, 0.0);
        Moving::of(&log, &robot, &LogOptions { shift: Some(shift), ..moving() }).err().unwrap().to_string()
    };
    let d = Campaign { seconds: 30.0, ..Campaign::default() };
    // What loads the joints is more than the arm's weight.
    let fast = told(&Campaign { speed: 8.0, ..d.clone() });
    assert!(fast.contains("accelerates by more than 1 m/s2") && fast.contains("slowly"), "{fast}");
    let seldom = told(&Campaign { rates: [10.0, 100.0], ..d.clone() });
    assert!(seldom.contains("too seldom") && seldom.contains("fifty times a second"), "{seldom}");
    let short = told(&Campaign { seconds: 3.0, ..d });
    assert!(short.contains("can be used"), "{short}");
}

/// The table of docs/validation-studies.md: twenty robots of each campaign.
#[test]
#[ignore = "a study: validation/run a_moving_arm_is_measured"]
fn a_minute_of_motion_is_worth_eighty_poses() {
    const ROBOTS: u64 = 20;
    println!(
        "| recording | off, ms: mean | largest | in its uncertainties, rms | error from motion, mm | from eighty poses | ratio |"
    );
    for (name, robot, campaign) in campaigns() {
        let all: Vec<Outcome> = (1..=ROBOTS).map(|k| outcome(&robot, &campaign, 0.02 * k as f64, 5000 + k)).collect();
        let mean = |of: &dyn Fn(&Outcome) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        let largest = all.iter().map(|o| o.shift.abs()).fold(0.0, f64::max);
        let ratio = mean(&|o| o.moving / o.still);
        println!(
            "| {name} | {:.3} | {:.3} | {:.1} | {:.4} | {:.4} | {ratio:.2} |",
            mean(&|o| o.shift.abs()) * 1e3,
            largest * 1e3,
            mean(&|o| (o.shift / o.sigma).powi(2)).sqrt(),
            mean(&|o| o.moving) * 1e3,
            mean(&|o| o.still) * 1e3,
        );
        assert!(largest < 3e-4 && ratio < 1.4, "{name}");
    }
}
