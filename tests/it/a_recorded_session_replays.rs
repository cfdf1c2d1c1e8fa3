//! A campaign's `iterations.csv` stands in for the cell that made it: the same commands give the same readings, other commands are
//! told where they depart.

use std::path::Path;

use calibench::cell::replay::{Recording, ReplayMismatch};
use calibench::cell::scripted::{Script, ScriptedCell, ScriptedFault};
use calibench::cell::{Indicator, IndicatorError, Manipulator, ManipulatorError, TriCal};
use calibench::measure::campaign::{Campaign, CampaignRecord, CampaignSettings};
use calibench::measure::centring::{CenteringController, CentringSettings};
use calibench::measure::poses::PlannedPose;
use calibench::units::{MM, UM};
use nalgebra::Vector3;

fn plan() -> Vec<PlannedPose> {
    let pose = |k: usize| {
        let contact = vec![0.4 * MM * k as f64, -0.3 * MM * k as f64, 0.0];
        let approach = contact.iter().map(|q| q + 30.0 * MM).collect();
        PlannedPose {
            id: format!("p{k}"),
            ball: Some(0),
            payload: 0,
            contact,
            approach,
            reserve: false,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        }
    };
    (0..5).map(pose).collect()
}

fn campaign(
    robot: impl Manipulator,
    indicators: [impl Indicator; 3],
    free: [f64; 3],
    settings: CentringSettings,
) -> CampaignRecord {
    let controller = CenteringController::new(robot, indicators, TriCal::default(), free, settings);
    Campaign::new(controller, CampaignSettings::default()).run(&plan(), &mut ())
}

/// A day with a lost answer, an indicator silent for a while and a refused step.
fn eventful() -> Script {
    let silent = |from, times| ScriptedFault::Answer { axis: 1, from, times, error: IndicatorError::Silent };
    let refused = ManipulatorError::Refused { reason: "drives off".into() };
    let faults = vec![silent(2, 1), silent(9, 3), ScriptedFault::Motion { number: 18, error: refused }];
    Script { faults, ..Script::default() }
}

fn recorded(folder: &Path) -> (CampaignRecord, [f64; 3]) {
    let cell = ScriptedCell::new(eventful());
    let record = campaign(cell.robot(), cell.indicators(), cell.free_reading(), CentringSettings::default());
    record.write(folder, &plan(), &["1".into()]).expect("a writable folder");
    (record, cell.free_reading())
}

#[test]
fn the_same_controller_makes_the_same_iterations() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (first, free) = recorded(folder.path());
    assert_eq!(first.samples.len(), 5, "{:?}", first.aborted);
    assert_eq!(first.probings.len(), 7, "two probings failed and were tried again");

    let recording = Recording::read(&folder.path().join("iterations.csv")).expect("its own file");
    let again = campaign(recording.robot(), recording.indicators(), free, CentringSettings::default());
    assert_eq!(recording.departure(), None);
    assert!(recording.is_finished());
    assert_eq!(again.probings.len(), first.probings.len());
    for (a, b) in again.probings.iter().zip(&first.probings) {
        assert_eq!((a.pose, a.attempt), (b.pose, b.attempt));
        assert_eq!(a.probing.iterations.len(), b.probing.iterations.len());
        for (i, j) in a.probing.iterations.iter().zip(&b.probing.iterations) {
            assert_eq!((i.phase, i.time_s), (j.phase, j.time_s));
            assert_eq!(i.fault.as_ref().map(|f| f.token()), j.fault.as_ref().map(|f| f.token()));
            assert_same(i.reading, j.reading);
            assert_same(i.step, j.step);
        }
    }
    for (a, b) in again.samples.iter().zip(&first.samples) {
        assert_eq!((&a.id, &a.approach, a.plungers), (&b.id, &b.approach, b.plungers));
        assert!(a.q.iter().zip(&b.q).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}

/// Equal but for the rounding of micrometres to metres.
fn assert_same(a: Option<Vector3<f64>>, b: Option<Vector3<f64>>) {
    assert_eq!(a.is_some(), b.is_some());
    if let (Some(a), Some(b)) = (a, b) {
        assert!((a - b).amax() < 1e-15, "{a} {b}");
    }
}

#[test]
fn a_stricter_controller_departs_and_is_told_where() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (first, free) = recorded(folder.path());
    let recording = Recording::read(&folder.path().join("iterations.csv")).expect("its own file");
    let strict = CentringSettings { tolerance: 0.01 * UM, ..CentringSettings::default() };
    let again = campaign(recording.robot(), recording.indicators(), free, strict);
    // It steps on where the recording was content: at the last stop on the ball, the one before the first retreat.
    let at = first.probings[0].probing.iterations.len() - 1;
    let Some(ReplayMismatch::Step { at: departed, recorded: None, .. }) = recording.departure() else {
        panic!("{:?}", recording.departure())
    };
    assert_eq!(departed, at);
    assert!(again.aborted.is_some() && again.samples.is_empty());
}

#[test]
fn commands_of_another_plan_depart_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recorded(folder.path());
    let recording = Recording::read(&folder.path().join("iterations.csv")).expect("its own file");
    let elsewhere = recording.robot().move_joints(&[1.0, 2.0, 3.0]);
    assert!(matches!(elsewhere, Err(ManipulatorError::Lost { .. })));
    assert_eq!(recording.departure(), Some(ReplayMismatch::Joints { at: 1, commanded: vec![1.0, 2.0, 3.0] }));
    // Once departed, it stays so.
    assert!(recording.robot().move_joints(&plan()[0].approach).is_err());
}

#[test]
fn a_damaged_recording_names_line_and_column() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recorded(folder.path());
    let path = folder.path().join("iterations.csv");
    let text = std::fs::read_to_string(&path).expect("just written");
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    let whole = lines.join("\n");
    lines[3] = lines[3].replacen(',', ",x,", 1).replace(",0,", ",");
    let cases = [
        (whole.replacen("r2_um", "r2_mm", 1), "r2_um"),
        (whole.replacen("approach,", "approach,NaN", 1), "time_s"),
        (whole.replacen("silent_indicator:2", "silent_indicator:9", 1), "fault"),
        (lines.join("\n"), ""),
        (String::new(), ""),
    ];
    for (text, field) in cases {
        std::fs::write(&path, text).expect("writable");
        let error = Recording::read(&path).err().expect("damaged");
        assert_eq!(error.field, field, "{error}");
    }
}
