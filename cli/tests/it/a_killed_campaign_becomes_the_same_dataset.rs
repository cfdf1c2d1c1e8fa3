//! The program is killed while it measures, or its disk is full, repeatedly: the final dataset equals that of an undisturbed
//! run.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::oracles::data;

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/table8.toml");

/// A folder with a plan.
fn planned() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plan = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .current_dir(&folder)
        .args(["plan", SCENARIO, "-o", "plan.toml"])
        .output()
        .expect("the program starts");
    assert!(plan.status.success(), "{}", String::from_utf8_lossy(&plan.stderr));
    folder
}

fn measure(folder: &Path, dataset: &str, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(["measure", SCENARIO, "--plan", "plan.toml", "-o", dataset]).args(more);
    command
}

fn said(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), [&output.stdout[..], &output.stderr[..]].map(String::from_utf8_lossy).concat())
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    entries.map(|entry| (entry.file_name().into(), fs::read(entry.path()).expect("a file"))).collect()
}

/// Number of complete lines in a journal.
fn lines(journal: &Path) -> usize {
    fs::read(journal).map_or(0, |bytes| bytes.iter().filter(|&&b| b == b'\n').count())
}

/// `many` kills that hit the program while it is alive.
fn change_no_byte(many: usize) {
    let folder = planned();
    let folder = folder.path();
    assert!(measure(folder, "alone", &[]).output().expect("the program starts").status.success());
    let alone = files(&folder.join("alone"));
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut kills, mut finished, mut in_the_middle) = (0, 0, 0);
    let mut kept = 0;
    while kills < many || kept > 0 {
        let mut child =
            measure(folder, "data", &["--resume"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("starts");
        let journal = folder.join("data.journal");
        if kills < many {
            // At most a third of the campaign ahead, so that each is killed several times whatever the machine's speed; then at
            // any point between two lines, or while the dataset is written. One in ten is hit during the start.
            let enough = if random.random_bool(0.1) { 0 } else { kept + random.random_range(0..30) };
            while lines(&journal) < enough && child.try_wait().expect("a child").is_none() {
                std::thread::sleep(Duration::from_micros(200));
            }
            std::thread::sleep(Duration::from_micros(random.random_range(0..5000)));
            child.kill().expect("a child");
        }
        let status = child.wait().expect("a child");
        if status.code().is_some() {
            assert!(status.success());
            assert!(files(&folder.join("data")) == alone, "after {kills} kills");
            assert!(!journal.exists());
            fs::remove_dir_all(folder.join("data")).expect("removed");
            (finished, kept) = (finished + 1, 0);
            continue;
        }
        kills += 1;
        let whole = lines(&journal);
        // Between the last two steps the dataset is complete, and the journal may or may not still exist.
        assert!(whole >= kept || folder.join("data").exists(), "{kept} lines were whole, then {whole}");
        if folder.join("data").exists() {
            assert!(files(&folder.join("data")) == alone, "a dataset that is there is whole");
        }
        in_the_middle += usize::from(whole > 2);
        kept = whole;
        if !journal.exists() && folder.join("data").exists() {
            fs::remove_dir_all(folder.join("data")).expect("removed");
            (finished, kept) = (finished + 1, 0);
        }
    }
    println!("{kills} kills, {in_the_middle} of them with probings done, {finished} campaigns finished");
    assert!(in_the_middle > many / 4 && finished > 1, "{in_the_middle} {finished}");
    let left: Vec<_> = fs::read_dir(folder).expect("a folder").filter_map(|e| e.ok()?.file_name().into_string().ok()).collect();
    let strangers: Vec<_> = left.iter().filter(|n| !n.starts_with(".data.") && *n != "alone" && *n != "plan.toml").collect();
    assert!(strangers.is_empty(), "{strangers:?}");
}

#[test]
fn two_dozen_kills_change_no_byte_and_lose_no_probing() {
    change_no_byte(24);
}

#[test]
#[ignore = "a study of 200 kills: validation/run a_killed_campaign_becomes_the_same_dataset"]
fn two_hundred_kills_change_no_byte_and_lose_no_probing() {
    change_no_byte(200);
}

/// Runs `measure --resume` with file sizes limited to so many blocks of 512 bytes (1024 with some shells).
fn with_little_room(folder: &Path, dataset: &str, blocks: usize, deaf: bool) -> Output {
    // Unless ignored, the signal for exceeding the file size limit ends the program like a kill.
    let trap = if deaf { "trap '' XFSZ; " } else { "" };
    let program = env!("CARGO_BIN_EXE_calibench");
    Command::new("sh")
        .current_dir(folder)
        .args(["-c", &format!("{trap}ulimit -c 0; ulimit -f {blocks}; exec \"$0\" \"$@\""), program])
        .args(["measure", SCENARIO, "--plan", "plan.toml", "-o", dataset, "--resume"])
        .output()
        .expect("a shell")
}

#[test]
fn a_full_disk_ends_it_cleanly_and_it_goes_on_when_there_is_room() {
    let folder = planned();
    let folder = folder.path();
    assert!(measure(folder, "alone", &[]).output().expect("the program starts").status.success());
    for deaf in [true, false] {
        let journal = folder.join("data.journal");
        let mut kept = 0;
        for blocks in [0, 1, 2, 3, 7, 8, 20, 41, 60] {
            let output = with_little_room(folder, "data", blocks, deaf);
            let (code, said) = said(&output);
            let whole = lines(&journal);
            assert!(whole >= kept, "{whole} {kept}");
            assert!(!folder.join("data").exists());
            if deaf && whole > 0 {
                assert_eq!(code, Some(3), "{said}");
                assert!(said.contains("data.journal: cannot be written: File too large"), "{said}");
                let probings = match whole.saturating_sub(2) {
                    1 => "; 1 probing is kept".to_owned(),
                    many => format!("; {many} probings are kept"),
                };
                assert!(said.contains(&format!("{probings} in data.journal: go on with `--resume`")), "{said}");
                let bytes = fs::read(&journal).expect("a journal");
                assert!(bytes.ends_with(b"\n"), "what was half written is taken back");
            } else if deaf {
                assert_eq!(code, Some(3), "nothing was begun: {said}");
            } else {
                assert_eq!(code, None, "the signal ends it: {said}");
            }
            kept = whole;
        }
        assert!(kept > 10, "{kept}");
        let output = measure(folder, "data", &["--resume"]).output().expect("the program starts");
        assert!(output.status.success(), "{}", said(&output).1);
        assert!(files(&folder.join("data")) == files(&folder.join("alone")));
        fs::remove_dir_all(folder.join("data")).expect("removed");
    }
}

#[test]
fn a_dataset_that_cannot_be_written_leaves_all_in_the_journal() {
    let folder = planned();
    let folder = folder.path();
    assert!(measure(folder, "alone", &[]).output().expect("the program starts").status.success());
    let journal = fs::read(folder.join("alone/campaign.journal")).expect("a journal");
    fs::write(folder.join("data.journal"), &journal).expect("written");
    // Enough room for the samples but not for the iterations.
    let (code, said) = said(&with_little_room(folder, "data", 20, true));
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("cannot be written"), "{said}");
    assert!(!folder.join("data").exists());
    assert_eq!(fs::read(folder.join("data.journal")).expect("still there"), journal);
    assert!(measure(folder, "data", &["--resume"]).output().expect("the program starts").status.success());
    assert!(files(&folder.join("data")) == files(&folder.join("alone")));
}

#[test]
fn what_is_there_is_never_overwritten_and_each_refusal_is_one_line() {
    let folder = planned();
    let folder = folder.path();
    let run = |more: &[&str]| said(&measure(folder, "data", more).output().expect("the program starts"));
    let refused = |more: &[&str], word: &str| {
        let (code, said) = run(more);
        assert_eq!((code, said.lines().count()), (Some(2), 1), "{said}");
        assert!(said.contains(word), "{said}");
    };
    let (code, told) = run(&[]);
    assert_eq!(code, Some(0), "{told}");
    let before = files(&folder.join("data"));
    for more in [&[][..], &["--resume"]] {
        let (code, told) = run(more);
        assert_eq!(code, Some(0));
        assert!(told.starts_with("nothing to do: the campaign is finished, after 8") && told.contains("is in data"), "{told}");
    }
    refused(&["--seed", "7"], "data/campaign.journal:1: seed: was 1, and is 7 now");
    // Nor does a table of another robot take its place.
    let table = data("ur5-jacobi").join("3D_UR5_uncalibrated_random_cleaned.csv");
    let import = ["import", "ur5-jacobi", table.to_str().expect("a path"), "-o", "data"];
    let (code, told) = said(
        &Command::new(env!("CARGO_BIN_EXE_calibench")).current_dir(folder).args(import).output().expect("the program starts"),
    );
    assert!(
        code == Some(2) && told.contains("data: holds a measured campaign, which would be lost; name another folder"),
        "{told}"
    );
    assert!(files(&folder.join("data")) == before);
    fs::rename(folder.join("data/campaign.journal"), folder.join("data.journal")).expect("renamed");
    refused(&["--resume"], "data: holds a dataset already; name another folder, or remove this one");
    fs::remove_dir_all(folder.join("data")).expect("removed");
    refused(&[], "data.journal: holds a campaign that is not finished; resume it");
    refused(&["--resume", "--seed", "7"], "data.journal:1: seed: was 1, and is 7 now; go on under the conditions");
    let plan = fs::read_to_string(folder.join("plan.toml")).expect("a plan");
    let other = plan.replacen("clearance_mm = ", "clearance_mm = 1", 1);
    fs::write(folder.join("plan.toml"), other).expect("written");
    refused(&["--resume"], "data.journal:1: plan: is of another plan; go on under the conditions");
    fs::write(folder.join("plan.toml"), plan).expect("written");
    assert_eq!(run(&["--resume"]).0, Some(0));
    assert!(files(&folder.join("data")) == before);
}
