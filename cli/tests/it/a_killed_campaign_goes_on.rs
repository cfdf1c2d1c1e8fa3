//! A measurement killed (SIGKILL), terminated (SIGTERM) or interrupted by Ctrl-C (SIGINT) at random instants, many of them
//! with the gauge on a ball, resumes with `--resume` alone: earlier measurements are kept, byte for byte, and never repeated.
#![cfg(unix)]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::served::{Bench, Make, Served, assert_none_lost, measurements};
use calibench::measure::poses::ways::turn;
use calibench::units::DEG;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// True if the gauge is on a ball: the TCP is at the contact of a pose of the plan.
fn is_in_contact(served: &Served, bench: &Bench) -> bool {
    let q = served.joints();
    bench.poses.iter().any(|pose| turn(&pose.contact, &q) < 2.0 * DEG && turn(&pose.approach, &q) > 2.0 * DEG)
}

/// True if a session was begun, whose mastering a resumed campaign can check.
fn has_begun(journal: &Path) -> bool {
    std::fs::read_to_string(journal).is_ok_and(|text| text.lines().any(|line| line.contains("\"session\"")))
}

/// The signals sent in turn.
const SIGNALS: [&str; 4] = ["-KILL", "-TERM", "-KILL", "-INT"];

/// Exit code of a program that was interrupted and reports it.
const INTERRUPTED: i32 = 3;

fn is_kill(k: usize) -> bool {
    SIGNALS[k % SIGNALS.len()] == "-KILL"
}

/// `many` kills, with a robot of this make.
fn goes_on(make: Make, many: usize) {
    let bench = Bench::small_of(make);
    let mut served = bench.serve(&[]);
    served.tell("ball out");
    bench.write_cell(&served, "", "", "");
    let began = Instant::now();
    assert!(bench.measured("whole", &["--mastered"]).status.success());
    let whole = began.elapsed().as_secs_f64();

    let mut random = ChaCha8Rng::seed_from_u64(7);
    let (mut killed, mut campaign, mut amid, mut touching, mut kept) = (0, 0, 0, 0, Vec::new());
    while killed < many || !kept.is_empty() {
        let name = format!("killed{campaign}");
        // Nobody touches the cell: a campaign that was begun resumes with plain `--resume`.
        let arguments =
            if has_begun(&bench.path(&format!("{name}.journal"))) { &["--resume"][..] } else { &["--mastered", "--resume"] };
        let mut command = bench.measure(&name, arguments);
        let process = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        if killed < many {
            std::thread::sleep(Duration::from_secs_f64(whole * random.random::<f64>()));
            // A process that has already ended no longer exists.
            drop(Command::new("kill").args([SIGNALS[killed % SIGNALS.len()], &process.id().to_string()]).output().unwrap());
        }
        let output = process.wait_with_output().unwrap();
        let journal = bench.path(&format!("{name}.journal"));
        if output.status.success() {
            let dataset = bench.path(&name);
            assert_none_lost(&kept, &dataset);
            let poses: Vec<String> =
                measurements(&dataset.join("campaign.journal")).into_iter().map(|(pose, _)| pose).collect();
            assert_eq!((poses.len(), poses.iter().collect::<BTreeSet<_>>().len()), (8, 8), "each once: {poses:?}");
            assert!(!journal.exists());
            (campaign, kept) = (campaign + 1, Vec::new());
            continue;
        }
        let said = String::from_utf8_lossy(&output.stderr);
        match output.status.code() {
            // Before the program handles signals, they end it.
            None => {}
            Some(code) => {
                let is_told = code == INTERRUPTED || said.contains("cancelled");
                assert!(is_told && killed < many && !is_kill(killed), "{code}: {said}");
            }
        }
        killed += 1;
        touching += usize::from(is_in_contact(&served, &bench));
        let now = measurements(&journal);
        // After the renaming of the dataset there is no journal beside it any more, although the program has not ended.
        if bench.path(&name).exists() {
            assert_none_lost(&kept, &bench.path(&name));
            (campaign, kept) = (campaign + 1, Vec::new());
            continue;
        }
        assert!(now.len() >= kept.len() && now[..kept.len()] == kept[..], "what was measured stays");
        amid += usize::from(now.len() > kept.len());
        kept = now;
    }
    println!(
        "{killed} kills, {amid} amid the probings, {touching} with the gauge on a ball, over {campaign} campaigns of {whole:.2} s: 0 probings lost"
    );
    assert!(amid >= many / 10, "{amid} kills came while probings were made");
    assert!(touching >= many / 8, "{touching} kills came while the gauge was on a ball");
}

#[test]
fn at_any_instant() {
    goes_on(Make::Kuka, 24);
}

#[test]
#[ignore = "a study of 200 kills: validation/run a_killed_campaign_goes_on"]
fn at_any_of_many_instants() {
    goes_on(Make::Kuka, 200);
}

#[test]
fn at_any_instant_with_a_universal_robot() {
    goes_on(Make::Ur, 8);
}

#[test]
#[ignore = "a study of 200 kills: validation/run a_killed_campaign_goes_on"]
fn at_any_of_many_instants_with_a_universal_robot() {
    goes_on(Make::Ur, 200);
}
