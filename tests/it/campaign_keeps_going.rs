//! A campaign outlives a ball that is gone, an indicator that stutters and a pose that fails, and stops when going on would be unsafe.

use calibench::cell::scripted::{Script, ScriptedCell, ScriptedFault};
use calibench::cell::{IndicatorError, ManipulatorError, TriCal};
use calibench::measure::campaign::{Abort, Campaign, CampaignObserver, CampaignRecord, CampaignSettings, Progress};
use calibench::measure::centring::{CenteringController, CentringFailure, CentringSettings, Iteration, Probing};
use calibench::measure::dataset::{Measured, Sample};
use calibench::measure::poses::PlannedPose;
use calibench::units::{MM, UM};
use nalgebra::{Matrix3, Vector3};

/// Twelve poses around the ball; those named in `gone` are planned 40 mm off, where there is no ball.
fn plan(gone: &[usize]) -> Vec<PlannedPose> {
    let pose = |k: usize| {
        let off = if gone.contains(&k) { 40.0 * MM } else { 0.0 };
        let contact = vec![0.2 * MM * k as f64 + off, -0.1 * MM * k as f64, 0.0];
        let approach = contact.iter().map(|q| q + 30.0 * MM).collect();
        PlannedPose {
            id: format!("p{k}"),
            ball: Some(k % 4),
            payload: 0,
            contact,
            approach,
            reserve: false,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        }
    };
    (0..12).map(pose).collect()
}

fn run(cell: &ScriptedCell, poses: &[PlannedPose], observer: &mut dyn CampaignObserver) -> CampaignRecord {
    let settings = CentringSettings::default();
    let controller =
        CenteringController::new(cell.robot(), cell.indicators(), TriCal::default(), cell.free_reading(), settings);
    Campaign::new(controller, CampaignSettings::default()).run(poses, observer)
}

fn motion(number: usize, error: ManipulatorError) -> ScriptedCell {
    ScriptedCell::new(Script { faults: vec![ScriptedFault::Motion { number, error }], ..Script::default() })
}

#[test]
fn missing_balls_cost_their_poses_only() {
    let gone = [2, 3, 7];
    let record = run(&ScriptedCell::new(Script::default()), &plan(&gone), &mut ());
    assert_eq!(record.aborted, None);
    let ids: Vec<&str> = record.samples.iter().map(|s| s.id.as_str()).collect();
    assert_eq!(ids, ["p0", "p1", "p4", "p5", "p6", "p8", "p9", "p10", "p11"]);
    for k in gone {
        let tries: Vec<_> = record.probings.iter().filter(|p| p.pose == k).collect();
        assert_eq!(tries.len(), 2);
        for probing in tries {
            let failure = probing.probing.outcome.as_ref().expect_err("there is no ball");
            assert_eq!(failure.reason, CentringFailure::NoContact);
            assert!(failure.backed_off);
        }
    }
}

#[test]
fn samples_hold_what_the_dataset_needs() {
    // A perfect tool frame: one step from the contact pose to the ball.
    let script = Script { tool_response: Matrix3::identity(), ..Script::default() };
    let error = script.error;
    let record = run(&ScriptedCell::new(script), &plan(&[]), &mut ());
    assert_eq!(record.samples.len(), 12);
    for (k, sample) in record.samples.iter().enumerate() {
        let Measured::Ball { ball, reading: Some(reading) } = &sample.measured else { panic!("{sample:?}") };
        assert_eq!(*ball, k % 4);
        assert!(reading.amax() < 3.0 * UM);
        // The ball is at the origin, so the stage reads minus its error, less what is left.
        let q = Vector3::from_row_slice(&sample.q);
        assert!((q + error + reading).amax() < 1e-9);
        // That step goes from (0.2 k, -0.1 k, 0) to (-1.3, 0.9, -1.7) mm; the ball moves the other way in the gauge.
        assert_eq!(sample.approach.as_deref(), Some(&[-1, 1, -1][..]), "{}", sample.id);
        assert_eq!(sample.plungers, Some([1, -1, 1]), "{}", sample.id);
    }
    let times: Vec<f64> = record.samples.iter().filter_map(|s| s.time_s).collect();
    assert!(times.windows(2).all(|w| w[0] < w[1]));
}

#[test]
fn a_lost_robot_ends_it_and_keeps_what_was_measured() {
    let lost = ManipulatorError::Lost { detail: "connection reset".into() };
    let cell = motion(20, lost);
    let record = run(&cell, &plan(&[]), &mut ());
    assert!(matches!(record.aborted, Some(Abort::Robot(CentringFailure::RobotLost { .. }))));
    assert_eq!(cell.motions().len(), 21, "nothing is commanded after it");
    assert!(!record.samples.is_empty() && record.samples.len() < 12);
}

#[test]
fn an_arm_that_cannot_be_backed_off_ends_it() {
    // Motions of the first probing: approach, contact, two steps, and 4 is the retreat.
    let record = run(&motion(4, ManipulatorError::Refused { reason: "drives off".into() }), &plan(&[]), &mut ());
    assert!(matches!(record.aborted, Some(Abort::NotBackedOff(CentringFailure::RobotRefused { .. }))), "{:?}", record.aborted);
    assert_eq!(record.probings.len(), 1);
}

#[test]
fn a_dead_indicator_ends_it_after_five_poses() {
    let cell = ScriptedCell::new(Script::default());
    cell.add_fault(ScriptedFault::Answer { axis: 2, from: 12, times: usize::MAX, error: IndicatorError::Silent });
    let record = run(&cell, &plan(&[]), &mut ());
    let Some(Abort::TooManyFailures { skipped: 5, last }) = record.aborted else { panic!("{:?}", record.aborted) };
    assert_eq!(last, CentringFailure::SilentIndicator { axis: 2 });
    assert_eq!(record.samples.len(), 2);
}

/// Counts what it is told.
#[derive(Default)]
struct Bar {
    started: usize,
    iterations: usize,
    finished: usize,
    samples: usize,
    estimates: Vec<f64>,
}

impl CampaignObserver for Bar {
    fn probing_started(&mut self, _: &PlannedPose, _: usize, progress: &Progress) {
        self.started += 1;
        self.estimates.push(progress.elapsed_s + progress.remaining_s);
    }

    fn iteration(&mut self, _: &PlannedPose, _: &Iteration) {
        self.iterations += 1;
    }

    fn probing_finished(&mut self, _: &PlannedPose, _: &Probing, sample: Option<&Sample>) {
        self.finished += 1;
        self.samples += usize::from(sample.is_some());
    }
}

#[test]
fn a_witness_hears_everything_and_a_slow_robot_is_estimated() {
    let cell = ScriptedCell::new(Script { motion_s: 7.0, ..Script::default() });
    let mut bar = Bar::default();
    let record = run(&cell, &plan(&[4]), &mut bar);
    assert_eq!((bar.started, bar.finished, bar.samples), (13, 13, 11));
    assert_eq!(bar.iterations, record.probings.iter().map(|p| p.probing.iterations.len()).sum::<usize>());
    let took = record.probings.last().map_or(0.0, |p| p.probing.started_s + p.probing.duration_s);
    // Twelve poses at 30 s before anything is known; then at the pace seen, 20 % apart at most since probings differ by a step or two.
    assert_eq!(bar.estimates[0], 360.0);
    assert!((bar.estimates[6] / took - 1.0).abs() < 0.2, "{} {took}", bar.estimates[6]);
}

#[test]
fn the_files_have_a_row_for_everything() {
    let poses = plan(&[4]);
    let record = run(&ScriptedCell::new(Script::default()), &poses, &mut ());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let balls: Vec<String> = (1..=4).map(|b| b.to_string()).collect();
    record.write(folder.path(), &poses, &balls).expect("a writable folder");
    let rows = |name: &str| -> Vec<Vec<String>> {
        let mut reader = csv::Reader::from_path(folder.path().join(name)).expect("just written");
        reader.records().map(|r| r.expect("a row").iter().map(String::from).collect()).collect()
    };
    let probings = rows("probings.csv");
    assert_eq!(probings.len(), 13);
    assert_eq!(probings[4][1..5], ["p4", "1", "1", "no_contact"]);
    assert_eq!(probings[6][1..5], ["p5", "2", "1", "centred"]);
    let iterations = rows("iterations.csv");
    assert_eq!(iterations.len(), record.probings.iter().map(|p| p.probing.iterations.len()).sum::<usize>());
    // probing, phase, time, 3 joints, 3 readings, 3 steps, retries, fault
    assert!(iterations.iter().all(|row| row.len() == 14));
}
