//! A measurement killed (SIGKILL) at 200 random instants goes on with `--resume`: what was measured stays, byte for byte, and is never
//! measured again.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

mod served;

use std::collections::BTreeSet;
use std::process::Stdio;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rs_openshowvar::OpenShowVar;
use served::{Bench, Served, assert_none_lost, measurements};

/// What the operator does after an interruption: jogs the arm clear of the ball that it may be on.
fn jog_clear(served: &Served) {
    let (host, port) = served.robot();
    let mut robot = OpenShowVar::new(host, port);
    robot.connect().unwrap();
    let asked = Instant::now();
    let wait = |robot: &mut OpenShowVar| {
        while robot.read("COM_ACTION").unwrap() != "0" {
            assert!(asked.elapsed() < Duration::from_secs(10), "the program does what is asked");
        }
    };
    wait(&mut robot);
    let order: i64 = robot.read("COM_DONE").unwrap().parse().unwrap();
    robot.write("COM_E6AXIS", "{A1 0, A2 -90, A3 90, A4 0, A5 0, A6 0}").unwrap();
    robot.write("COM_ORDER", &(order + 1).to_string()).unwrap();
    robot.write("COM_ACTION", "2").unwrap();
    wait(&mut robot);
}

const KILLS: usize = 200;

#[test]
fn at_any_instant() {
    let bench = Bench::small();
    let mut served = bench.serve(&[]);
    served.tell("ball out");
    bench.write_cell(&served, "", "", "");
    let began = Instant::now();
    assert!(bench.measured("whole", &["--mastered"]).status.success());
    let whole = began.elapsed().as_secs_f64();

    let mut random = ChaCha8Rng::seed_from_u64(7);
    let (mut killed, mut campaign, mut amid, mut kept) = (0, 0, 0, Vec::new());
    while killed < KILLS || !kept.is_empty() {
        jog_clear(&served);
        let name = format!("killed{campaign}");
        let mut command = bench.measure(&name, &["--mastered", "--resume"]);
        let mut process = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        if killed < KILLS {
            std::thread::sleep(Duration::from_secs_f64(whole * random.random::<f64>()));
            process.kill().unwrap();
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
        assert_eq!(output.status.code(), None, "killed, not failed: {}", String::from_utf8_lossy(&output.stderr));
        killed += 1;
        let now = measurements(&journal);
        // Between the renaming of the dataset and the end of the program there is no journal beside it any more.
        if bench.path(&name).exists() {
            assert_none_lost(&kept, &bench.path(&name));
            (campaign, kept) = (campaign + 1, Vec::new());
            continue;
        }
        assert!(now.len() >= kept.len() && now[..kept.len()] == kept[..], "what was measured stays");
        amid += usize::from(now.len() > kept.len());
        kept = now;
    }
    println!("{killed} kills, {amid} amid the probings, over {campaign} campaigns of {whole:.2} s: 0 probings lost");
    assert!(amid >= KILLS / 10, "{amid} kills came while probings were made");
}
