//! A campaign that is cut at any byte of its journal goes on as if it had not been; what is damaged is recognised, what is changed refused.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::cell::replay::OffsetClock;
use calibench::cell::scripted::{Motion, Script, ScriptedCell, ScriptedFault};
use calibench::cell::{IndicatorError, ManipulatorError, TriCal};
use calibench::files::FileError;
use calibench::measure::campaign::journal::{Journal, JournalSession, OpenedJournal, journal_path};
use calibench::measure::campaign::mastering::{Mastering, MasteringError, MasteringSettings, still_mastered};
use calibench::measure::campaign::{Abort, Campaign, CampaignRecord, CampaignSettings, Conditions};
use calibench::measure::centring::{CenteringController, CentringSettings};
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::dataset::{Ball, Dataset};
use calibench::measure::poses::PlannedPose;
use calibench::robot::Robot;
use calibench::robot::robot_file::robot;
use calibench::units::MM;
use nalgebra::Vector3;
use tempfile::TempDir;

/// Two poses on each of two balls and a reserve on each; those named in `gone` are planned 40 mm off, where there is no ball.
fn plan(gone: &[usize]) -> Vec<PlannedPose> {
    let pose = |k: usize| {
        let off = if gone.contains(&k) { 40.0 * MM } else { 0.0 };
        let contact = vec![0.2 * MM * k as f64 + off, -0.1 * MM * k as f64, 0.0];
        let approach = contact.iter().map(|q| q + 30.0 * MM).collect();
        let reverses = (k == 3).then(|| "p0".into());
        PlannedPose {
            id: format!("p{k}"),
            ball: Some(k % 2),
            payload: 0,
            contact,
            approach,
            reserve: k >= 4,
            reverses,
            via: Vec::new(),
            clearance: None,
        }
    };
    (0..6).map(pose).collect()
}

/// The stage as a robot of three joints: of the first three of a KR 6, within wide limits.
fn stage() -> Dataset {
    let kr6 = robot("kr6_r700", Path::new(".")).expect("a built-in robot");
    let mut links = kr6.links[..3].to_vec();
    links.iter_mut().for_each(|link| link.limits = [-3.0, 3.0]);
    let ball = |id: &str, z: f64| Ball { id: id.into(), position: Vector3::new(0.0, 0.0, z), sigma: 0.0, free: false };
    Dataset {
        robot: Arc::new(Robot { links, gear_ratios: Vec::new(), solids: Vec::new(), ..kr6 }),
        robot_reference: "stage.toml".into(),
        balls: vec![ball("A", 0.0), ball("B", 0.5)],
        ..Dataset::default()
    }
}

/// A folder in memory, where there is one: thousands of files are synced.
fn folder() -> TempDir {
    let in_memory = Path::new("/dev/shm");
    if in_memory.is_dir() { tempfile::tempdir_in(in_memory) } else { tempfile::tempdir() }.expect("a temporary folder")
}

fn conditions(poses: &[PlannedPose]) -> Conditions {
    Conditions::of(poses, &stage()).and_settings("centring", &CentringSettings::default())
}

fn mastering(cell: &ScriptedCell) -> Mastering {
    Mastering { free_reading: cell.free_reading(), preset_residual: [0.0; 3], time_s: 5.0 }
}

fn ready(dataset: &Path, poses: &[PlannedPose], resume: bool) -> Result<Journal, FileError> {
    match Journal::open(dataset, &conditions(poses), resume)? {
        OpenedJournal::Ready(journal) => Ok(*journal),
        OpenedJournal::Finished { probings } => panic!("finished with {probings} probings"),
        OpenedJournal::Changed { what } => panic!("changed: {what:?}"),
        _ => panic!("neither ready, finished nor changed"),
    }
}

/// Measures what the journal does not hold yet, at a cell of which it is not known what it did before.
fn go_on(journal: &mut Journal, cell: &ScriptedCell, poses: &[PlannedPose]) -> CampaignRecord {
    // An hour after the beginning by the clock on the wall.
    let now = 1.7e9 + if journal.last_session().is_some() { 3600.0 } else { 0.0 };
    let later = OffsetClock::new(cell.robot(), journal.clock_s(now));
    let session = JournalSession { wall_clock_s: Some(now), ..JournalSession::first(mastering(cell)) };
    journal.begin_session(session).expect("room on the disk");
    let controller =
        CenteringController::new(later, cell.indicators(), TriCal::default(), cell.free_reading(), CentringSettings::default());
    Campaign::new(controller, CampaignSettings { skipped_in_a_row: 3, ..CampaignSettings::default() }).run_journalled(
        poses,
        journal,
        &mut (),
    )
}

fn finish(mut journal: Journal, record: &CampaignRecord, poses: &[PlannedPose]) {
    let dataset = Dataset { samples: record.samples.clone(), ..stage() };
    journal.finish(&dataset, record, poses).expect("room on the disk");
}

/// Measures with the usual settings, by the clock of the cell.
fn measured(cell: &ScriptedCell, poses: &[PlannedPose], journal: &mut Journal) -> CampaignRecord {
    let (robot, indicators) = (cell.robot(), cell.indicators());
    let controller =
        CenteringController::new(robot, indicators, TriCal::default(), cell.free_reading(), CentringSettings::default());
    Campaign::new(controller, CampaignSettings::default()).run_journalled(poses, journal, &mut ())
}

/// The same from the beginning in a cell that is the same every time.
fn simulate(dataset: &Path, poses: &[PlannedPose], resume: bool) -> Result<(), FileError> {
    let mut journal = ready(dataset, poses, resume)?;
    let cell = ScriptedCell::new(Script::default());
    journal.live_through_again();
    journal.begin_session(JournalSession::first(mastering(&cell)))?;
    let record = measured(&cell, poses, &mut journal);
    assert_eq!(record.aborted, None);
    finish(journal, &record, poses);
    Ok(())
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    entries.map(|entry| (entry.file_name().into(), fs::read(entry.path()).expect("a file"))).collect()
}

/// The files of a campaign that was not disturbed; one pose fails and its reserve comes in.
fn undisturbed(poses: &[PlannedPose]) -> BTreeMap<PathBuf, Vec<u8>> {
    let place = folder();
    simulate(&place.path().join("data"), poses, false).expect("a campaign");
    assert!(!journal_path(&place.path().join("data")).expect("a name").exists());
    files(&place.path().join("data"))
}

fn text(files: &BTreeMap<PathBuf, Vec<u8>>, name: &str) -> String {
    String::from_utf8(files[Path::new(name)].clone()).expect("text")
}

#[test]
fn cut_at_any_byte_a_simulated_campaign_becomes_the_same_files() {
    let poses = plan(&[1]);
    let whole = undisturbed(&poses);
    assert_eq!(whole.len(), 6, "two files of the dataset, the robot, two tables, the journal");
    let journal = &whole[Path::new("campaign.journal")];
    let place = folder();
    let data = place.path().join("data");
    for cut in 0..=journal.len() {
        fs::write(journal_path(&data).expect("a name"), &journal[..cut]).expect("written");
        simulate(&data, &poses, true).unwrap_or_else(|e| panic!("cut at {cut}: {e}"));
        assert!(files(&data) == whole, "cut at {cut}");
        fs::remove_dir_all(&data).expect("removed");
    }
}

#[test]
fn cut_anywhere_a_real_campaign_keeps_every_whole_line_and_repeats_none() {
    let poses = plan(&[1]);
    let place = folder();
    let data = place.path().join("data");
    let mut journal = ready(&data, &poses, false).expect("a journal");
    let first = go_on(&mut journal, &ScriptedCell::new(Script::default()), &poses);
    finish(journal, &first, &poses);
    let whole = files(&data);
    fs::remove_dir_all(&data).expect("removed");
    let bytes = &whole[Path::new("campaign.journal")];
    let rows: Vec<String> = text(&whole, "samples.csv").lines().map(String::from).collect();
    // That every byte is alike but for the ends of lines is shown above.
    let at_an_end = |cut: usize| bytes[cut.saturating_sub(2)..(cut + 2).min(bytes.len())].contains(&b'\n');
    for cut in (0..=bytes.len()).filter(|&cut| cut % 11 == 0 || at_an_end(cut)) {
        fs::write(journal_path(&data).expect("a name"), &bytes[..cut]).expect("written");
        let mut journal = ready(&data, &poses, true).unwrap_or_else(|e| panic!("cut at {cut}: {e}"));
        // Two lines come before the first probing.
        let kept = bytes[..cut].iter().filter(|&&b| b == b'\n').count().saturating_sub(2);
        assert_eq!(journal.done_before(), kept, "cut at {cut}");
        let cell = ScriptedCell::new(Script::default());
        let again = go_on(&mut journal, &cell, &poses);
        finish(journal, &again, &poses);
        let done: Vec<(usize, usize)> = again.probings.iter().map(|p| (p.pose, p.attempt)).collect();
        assert_eq!(done, [(0, 1), (1, 1), (1, 2), (2, 1), (3, 1), (5, 1)], "cut at {cut}");
        let next = done.get(kept).map(|&(pose, _)| Motion::Joints(poses[pose].approach.clone()));
        assert_eq!(cell.motions().first(), next.as_ref(), "the first motion is that of the probing in hand, or none");
        let now = files(&data);
        let centred = first.probings[..kept].iter().filter(|p| p.probing.outcome.is_ok()).count();
        let kept_rows: Vec<String> = text(&now, "samples.csv").lines().take(1 + centred).map(String::from).collect();
        assert_eq!(kept_rows, rows[..=centred], "cut at {cut}");
        if kept > 0 {
            let times: Vec<f64> = again.samples.iter().filter_map(|s| s.time_s).collect();
            assert!(times.windows(2).all(|w| w[0] < w[1]), "{times:?}");
            assert!(centred == rows.len() - 1 || *times.last().expect("samples") > 3600.0, "{times:?}");
        }
        fs::remove_dir_all(&data).expect("removed");
    }
}

#[test]
fn a_flipped_byte_is_never_believed() {
    let poses = plan(&[1]);
    let whole = undisturbed(&poses);
    let journal = &whole[Path::new("campaign.journal")];
    let last_line = 1 + journal[..journal.len() - 1].iter().rposition(|&b| b == b'\n').expect("lines");
    let place = folder();
    let data = place.path().join("data");
    let path = journal_path(&data).expect("a name");
    for at in 0..journal.len() {
        let mut flipped = journal.clone();
        flipped[at] ^= 1 << (at % 8);
        fs::write(&path, &flipped).expect("written");
        match simulate(&data, &poses, true) {
            // Damage at the end cannot be distinguished from a line that was cut: it is done again.
            Ok(()) => {
                assert!(at + 1 >= last_line, "byte {at} was flipped and not missed");
                assert!(files(&data) == whole);
                fs::remove_dir_all(&data).expect("removed");
            }
            Err(e) => {
                assert!(at < last_line, "byte {at}: {e}");
                assert_eq!(fs::read(&path).expect("still there"), flipped, "a damaged journal is left as it is");
                let said = e.to_string();
                let line = 1 + journal[..at].iter().filter(|&&b| b == b'\n').count();
                let placed = said.contains(&format!("data.journal:{line}: the line is not as it was written"));
                assert!(placed || line == 1 && said.contains("is not a journal"), "byte {at}: {said}");
                assert!(!data.exists());
            }
        }
    }
}

#[test]
fn lines_removed_doubled_or_exchanged_are_recognised() {
    let poses = plan(&[]);
    let whole = undisturbed(&poses);
    let lines: Vec<String> = text(&whole, "campaign.journal").lines().map(|l| format!("{l}\n")).collect();
    let place = folder();
    let data = place.path().join("data");
    let (mut removed, mut doubled, mut exchanged) = (lines.clone(), lines.clone(), lines.clone());
    removed.remove(2);
    doubled.insert(2, lines[2].clone());
    exchanged.swap(2, 3);
    for (wrong, line) in [(removed, 3), (doubled, 4), (exchanged, 3)] {
        fs::write(journal_path(&data).expect("a name"), wrong.concat()).expect("written");
        let said = simulate(&data, &poses, true).expect_err("damaged").to_string();
        assert!(said.contains(&format!("data.journal:{line}: the line is not as it was written; restore it")), "{said}");
    }
}

#[test]
fn a_lost_robot_a_refused_retreat_and_a_dead_indicator_are_gone_on_from() {
    let poses = plan(&[]);
    // Motions of the first probing: approach, contact, two steps, and 4 is the retreat.
    let motion = |number, error| ScriptedFault::Motion { number, error };
    let cases = [
        (motion(7, ManipulatorError::Lost { detail: "connection reset".into() }), 2),
        (motion(4, ManipulatorError::Refused { reason: "drives off".into() }), 1),
        (ScriptedFault::Answer { axis: 2, from: 7, times: usize::MAX, error: IndicatorError::Silent }, 7),
    ];
    for (fault, tried) in cases {
        let place = folder();
        let data = place.path().join("data");
        let cell = ScriptedCell::new(Script { faults: vec![fault.clone()], ..Script::default() });
        let mut journal = ready(&data, &poses, false).expect("a journal");
        let record = go_on(&mut journal, &cell, &poses);
        assert!(record.aborted.is_some(), "{fault:?}");
        assert_eq!(record.probings.len(), tried, "{fault:?}");
        drop(journal);
        let mut journal = ready(&data, &poses, true).expect("a journal");
        let record = go_on(&mut journal, &ScriptedCell::new(Script::default()), &poses);
        let ids: Vec<&str> = record.samples.iter().map(|s| s.id.as_str()).collect();
        assert_eq!((record.aborted, ids), (None, vec!["p0", "p1", "p2", "p3"]), "{fault:?}");
        // A third time nothing is left to do, and nothing is done.
        drop(journal);
        let mut journal = ready(&data, &poses, true).expect("a journal");
        let idle = ScriptedCell::new(Script::default());
        let same = go_on(&mut journal, &idle, &poses);
        assert_eq!((same.samples, idle.motions().len()), (record.samples, 0), "{fault:?}");
    }
}

#[test]
fn the_side_of_approach_is_unknown_until_a_joint_has_moved_again() {
    let mut poses = plan(&[]);
    // The second coordinate does not move from the approach of the third pose to its ball: the planned place is 0.9 mm off, as the ball is.
    poses[2].contact[1] = 0.9 * MM;
    poses[2].approach[1] = 0.9 * MM;
    let script = || Script { tool_response: nalgebra::Matrix3::identity(), ..Script::default() };
    let place = folder();
    let data = place.path().join("data");
    let mut journal = ready(&data, &poses, false).expect("a journal");
    let went_through = go_on(&mut journal, &ScriptedCell::new(script()), &poses);
    assert_eq!(went_through.samples[2].approach.as_ref().map(|signs| signs[1]), Some(-1));
    finish(journal, &went_through, &poses);
    let bytes = fs::read(data.join("campaign.journal")).expect("a journal");
    fs::remove_dir_all(&data).expect("removed");
    let third = bytes.split_inclusive(|&b| b == b'\n').take(4).map(<[u8]>::len).sum::<usize>();
    fs::write(journal_path(&data).expect("a name"), &bytes[..third]).expect("written");
    let mut journal = ready(&data, &poses, true).expect("a journal");
    let resumed = go_on(&mut journal, &ScriptedCell::new(script()), &poses);
    let signs = resumed.samples[2].approach.as_ref().expect("signs");
    assert_eq!((signs[0], signs[1]), (-1, 0), "it moved in the interrupted session only");
}

#[test]
fn a_touched_cell_has_a_session_of_its_own() {
    let poses = plan(&[]);
    let place = folder();
    let data = place.path().join("data");
    let mut journal = ready(&data, &poses, false).expect("a journal");
    let lost = ScriptedFault::Motion { number: 12, error: ManipulatorError::Lost { detail: "gone".into() } };
    let cell = ScriptedCell::new(Script { faults: vec![lost], ..Script::default() });
    assert_eq!(go_on(&mut journal, &cell, &poses).samples.len(), 2);
    drop(journal);
    let mut journal = ready(&data, &poses, true).expect("a journal");
    let cell = ScriptedCell::new(Script::default());
    journal.begin_session(JournalSession { number: 2, ..JournalSession::first(mastering(&cell)) }).expect("room");
    let record = measured(&cell, &poses, &mut journal);
    finish(journal, &record, &poses);
    let read = read_dataset(&data).expect("a dataset");
    let sessions: Vec<Option<&str>> = read.samples.iter().map(|s| s.session.as_deref()).collect();
    assert_eq!(sessions, [None, None, Some("2"), Some("2")]);
}

#[test]
fn a_clock_that_was_set_between_two_sessions_is_named() {
    let poses = plan(&[]);
    let place = folder();
    let data = place.path().join("data");
    let mut journal = ready(&data, &poses, false).expect("a journal");
    assert_eq!(journal.clock_jump(0.0), None, "nothing was measured before");
    let lost = ScriptedFault::Motion { number: 12, error: ManipulatorError::Lost { detail: "gone".into() } };
    let cell = ScriptedCell::new(Script { faults: vec![lost], ..Script::default() });
    let record = go_on(&mut journal, &cell, &poses);
    let lasted = record.probings.last().map(|p| p.probing.started_s + p.probing.duration_s).expect("a probing");
    drop(journal);
    let journal = ready(&data, &poses, true).expect("a journal");
    let (began, day) = (1.7e9, 86_400.0);
    for credible in [began + lasted, began + 3600.0, began + 30.0 * day] {
        assert_eq!(journal.clock_jump(credible), None, "{credible}");
    }
    for (now, says) in [(began - 3600.0, "set back"), (0.0, "1970-01-01T00:00:00Z"), (began + 365.0 * day, "365 days later")] {
        let jump = journal.clock_jump(now).expect("a jump");
        assert!((jump.before_s - began - lasted).abs() < 1e-6, "{jump:?}");
        let told = jump.to_string();
        assert!(told.contains("2023-11-14T22:") && told.contains(says), "{told}");
    }
}

#[test]
fn a_gauge_is_still_mastered_until_it_is_touched() {
    let cell = ScriptedCell::new(Script::default());
    // Away from the ball.
    cell.move_ball(None);
    let mastered = mastering(&cell);
    let (trical, settings) = (TriCal::default(), MasteringSettings::default());
    let still = |cell: &ScriptedCell| still_mastered(&mut cell.indicators(), Some(&mastered), &trical, &settings, || 0.0);
    assert_eq!(still(&cell), Ok(mastered.clone()));
    cell.shift_zero(1, 4e-6);
    assert!(matches!(still(&cell), Err(MasteringError::NotAsMastered { axis: 1, .. })));
}

#[test]
fn guards_that_were_changed_are_named_and_asked_for() {
    let poses = plan(&[]);
    let place = folder();
    let data = place.path().join("data");
    let at = |speed: u8| conditions(&poses).and("robot.speed_percent", speed);
    let cell = ScriptedCell::new(Script::default());
    let Ok(OpenedJournal::Ready(mut journal)) = Journal::open(&data, &at(10), false) else { panic!("a journal") };
    journal.begin_session(JournalSession::first(mastering(&cell))).expect("writable");
    // Nothing is lost with a journal that holds no probing; with one there is something to ask.
    drop(measured(&cell, &poses[..1], &mut journal));
    drop(journal);
    let Ok(OpenedJournal::Changed { what }) = Journal::open(&data, &at(30), true) else { panic!("a change") };
    assert_eq!(what, ["robot.speed_percent was 10, and is 30 now"]);
    assert!(matches!(Journal::open_changed(&data, &at(30)), Ok(OpenedJournal::Ready(_))));
    // Accepted once, it holds.
    assert!(matches!(Journal::open(&data, &at(30), true), Ok(OpenedJournal::Ready(_))));
    assert!(matches!(Journal::open(&data, &at(10), true), Ok(OpenedJournal::Changed { .. })));
    let other = Journal::open(&data, &at(30).and("centring.tolerance", 1.0), true).expect_err("another measurement");
    assert!(other.to_string().contains("centring.tolerance"), "{other}");
}

#[test]
fn another_plan_cell_or_setting_and_a_second_run_are_refused() {
    let poses = plan(&[]);
    let place = folder();
    let data = place.path().join("data");
    let mut held = ready(&data, &poses, false).expect("a journal");
    go_on(&mut held, &ScriptedCell::new(Script::default()), &poses[..1]);
    let refused =
        |conditions: &Conditions, resume| Journal::open(&data, conditions, resume).expect_err("must be refused").to_string();
    let same = conditions(&poses);
    assert!(refused(&same, true).contains("is being written by another run; wait for it"));
    drop(held);
    assert!(refused(&same, false).contains("holds a campaign that is not finished; resume it"));
    let mut other = poses.clone();
    other[1].contact[0] = f64::from_bits(other[1].contact[0].to_bits() + 1);
    assert!(refused(&conditions(&other), true).contains("data.journal:1: plan: is of another plan"));
    let mut cell = stage();
    cell.balls[0].position.z += 1e-6;
    let told = refused(&Conditions::of(&poses, &cell).and_settings("centring", &CentringSettings::default()), true);
    assert!(told.contains("cell: is of another cell"), "{told}");
    let coarse = CentringSettings { tolerance: 5e-6, ..CentringSettings::default() };
    let told = refused(&Conditions::of(&poses, &stage()).and_settings("centring", &coarse), true);
    assert!(told.contains("centring.tolerance: was 3e-6, and is 5e-6 now"), "{told}");
    assert!(ready(&data, &poses, true).is_ok());
}

#[test]
fn nothing_that_is_there_is_overwritten_and_what_is_done_is_not_done_again() {
    let poses = plan(&[]);
    let place = folder();
    let data = place.path().join("data");
    simulate(&data, &poses, false).expect("a campaign");
    let before = files(&data);
    for resume in [false, true] {
        match Journal::open(&data, &conditions(&poses), resume) {
            Ok(OpenedJournal::Finished { probings: 4 }) => {}
            other => panic!("{other:?}"),
        }
        let told = Journal::open(&data, &conditions(&plan(&[1])), resume).expect_err("another plan").to_string();
        assert!(told.contains("data/campaign.journal:1: plan: is of another plan"), "{told}");
    }
    // Killed after the dataset appeared and before its journal was removed.
    fs::copy(data.join("campaign.journal"), journal_path(&data).expect("a name")).expect("copied");
    simulate(&data, &poses, true).expect("goes on");
    assert!(files(&data) == before);
    // Somebody else's dataset, and somebody else's file.
    fs::remove_file(data.join("campaign.journal")).expect("removed");
    let told = Journal::open(&data, &conditions(&poses), true).expect_err("a dataset").to_string();
    assert!(told.contains("data: holds a dataset already; name another folder"), "{told}");
    fs::remove_dir_all(&data).expect("removed");
    fs::write(journal_path(&data).expect("a name"), "my notes").expect("written");
    let told = Journal::open(&data, &conditions(&poses), true).expect_err("notes").to_string();
    assert!(told.contains("data.journal: is not a journal of a campaign"), "{told}");
}

#[test]
fn a_cell_that_does_otherwise_is_not_the_one_that_was_simulated() {
    let poses = plan(&[]);
    let whole = undisturbed(&poses);
    let place = folder();
    let data = place.path().join("data");
    fs::write(journal_path(&data).expect("a name"), &whole[Path::new("campaign.journal")]).expect("written");
    let mut journal = ready(&data, &poses, true).expect("a journal");
    journal.live_through_again();
    let cell = ScriptedCell::new(Script { motion_s: 1.5, ..Script::default() });
    journal.begin_session(JournalSession::first(mastering(&cell))).expect("the same mastering");
    let record = measured(&cell, &poses, &mut journal);
    let Some(Abort::NotJournalled { why }) = record.aborted else { panic!("{:?}", record.aborted) };
    assert!(why.contains("data.journal:3: the simulated cell does not do this again"), "{why}");
}
