//! A measurement by hand: what is measured, what is not, and what is there after it was torn off at any byte.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use calibench_readout::{Attendant, ByHand, Ended, Journal, Typed, read_station};

/// An arm and an instrument: the joint and the point that they send now.
#[derive(Clone)]
struct Bench {
    joint: Arc<Mutex<f64>>,
    point: Arc<Mutex<String>>,
    /// How far the arm moves while a point is taken, deg.
    slips: Arc<Mutex<f64>>,
    addresses: [String; 2],
}

impl Bench {
    fn new() -> Self {
        let joint = Arc::new(Mutex::new(0.0));
        let point = Arc::new(Mutex::new("1,2,3\n".to_owned()));
        let slips = Arc::new(Mutex::new(0.0));
        let serve = |answer: Box<dyn Fn() -> String + Send>| {
            let listener = TcpListener::bind("127.0.0.1:0").unwrap();
            let address = listener.local_addr().unwrap().to_string();
            std::thread::spawn(move || {
                for stream in listener.incoming() {
                    let mut stream = stream.unwrap();
                    while stream.read_exact(&mut [0]).is_ok() && stream.write_all(answer().as_bytes()).is_ok() {}
                }
            });
            address
        };
        let (its, their, slip, moved) = (Arc::clone(&joint), Arc::clone(&point), Arc::clone(&slips), Arc::clone(&joint));
        let addresses = [
            serve(Box::new(move || format!("{},-20\n", *its.lock().unwrap()))),
            serve(Box::new(move || {
                *moved.lock().unwrap() += *slip.lock().unwrap();
                their.lock().unwrap().clone()
            })),
        ];
        Bench { joint, point, slips, addresses }
    }

    fn station(&self, folder: &Path, more: &str) -> calibench_readout::Station {
        let [arm, instrument] = &self.addresses;
        let text = format!(
            "format = \"calibench-station/1\"\n[controller]\nkind = \"text\"\naddress = \"{arm}\"\nask = '?'\nline = \"{{q1}},{{q2}}\"\n[instrument]\naddress = \"{instrument}\"\ntrigger = 'M'\ntimeout_s = 0.4\n[still]\nwait_s = 0.3\n{more}"
        );
        let file = folder.join("station.toml");
        std::fs::write(&file, text).unwrap();
        read_station(&file).unwrap()
    }
}

/// An operator who does the next thing whenever the arm was said to be still, or once something was told.
struct Script<'a> {
    steps: VecDeque<Box<dyn FnOnce() -> Typed + 'a>>,
    told: Vec<String>,
    is_still: bool,
    stops_after: usize,
    began: Instant,
}

impl<'a> Script<'a> {
    fn new(steps: Vec<Box<dyn FnOnce() -> Typed + 'a>>) -> Self {
        Script { steps: steps.into(), told: Vec::new(), is_still: false, stops_after: usize::MAX, began: Instant::now() }
    }
}

impl Attendant for Script<'_> {
    fn tell(&mut self, sentence: &str) {
        self.told.push(sentence.to_owned());
    }

    fn show(&mut self, status: &str) {
        self.is_still = status.contains("still at");
    }

    fn typed(&mut self, wait: Duration) -> Typed {
        assert!(self.began.elapsed() < Duration::from_secs(120), "it does not end: {:?}", self.told);
        std::thread::sleep(wait.min(Duration::from_millis(50)));
        if !self.is_still {
            return Typed::Nothing;
        }
        self.is_still = false;
        self.steps.pop_front().map_or(Typed::End, |step| step())
    }

    fn is_stopped(&self) -> bool {
        self.told.iter().filter(|told| told.contains(": point")).count() >= self.stops_after
    }
}

fn line(text: &str) -> Typed {
    Typed::Line(text.to_owned())
}

#[test]
fn a_still_arm_is_measured_and_a_moving_one_is_not() {
    let (bench, folder) = (Bench::new(), tempfile::tempdir().unwrap());
    let station = bench.station(folder.path(), "");
    let table = folder.path().join("table.csv");
    let mut by_hand = ByHand::connect(&station).unwrap();
    let mut journal = Journal::open(&table, by_hand.units(), None, false).unwrap();
    let jog = |q: f64| *bench.joint.lock().unwrap() = q;
    let slip = |by: f64| *bench.slips.lock().unwrap() = by;
    let send = |text: &str| text.clone_into(&mut bench.point.lock().unwrap());
    let mut script = Script::new(vec![
        Box::new(|| line("")),
        Box::new(|| {
            jog(30.0);
            Typed::Nothing
        }),
        Box::new(|| {
            send("4,5,6\n");
            line("")
        }),
        // The arm sags while the point is taken.
        Box::new(|| {
            jog(60.0);
            slip(0.5);
            Typed::Nothing
        }),
        Box::new(|| line("")),
        Box::new(|| {
            slip(0.0);
            send("nonsense\n");
            line("")
        }),
        Box::new(|| {
            send("7,8,9\n");
            line("")
        }),
        Box::new(|| line("what?")),
        Box::new(|| line("u")),
        // Back at the first posture.
        Box::new(|| {
            jog(0.0);
            Typed::Nothing
        }),
        Box::new(|| line("")),
        Box::new(|| line("Q")),
    ]);
    assert_eq!(by_hand.run(&mut journal, &mut script).unwrap(), Ended::Finished);
    let told = script.told.join("\n");
    for said in [
        "1: point 1.000, 2.000, 3.000 mm\n",
        "2: point 4.000, 5.000, 6.000 mm\n",
        "Not measured: joint 1 moved while the point was taken.",
        "sent 'nonsense'",
        "3: point 7.000, 8.000, 9.000 mm\n",
        "Enter measures",
        "Posture 3 is taken back.",
        "3: point 7.000, 8.000, 9.000 mm; the posture of 1 again",
    ] {
        assert!(told.contains(said), "{said}\n{told}");
    }
    let text = journal.table();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0], ["time_s", "q1_deg", "q2_deg", "x_mm", "y_mm", "z_mm"]);
    let joints: Vec<&str> = rows[1..].iter().map(|row| row[1]).collect();
    assert_eq!(joints, ["0.000000", "30.000000", "0.000000"]);
    assert_eq!(&rows[2][2..], ["-20.000000", "4.00000", "5.00000", "6.00000"]);
    journal.finish().unwrap();
    assert!(table.exists() && !Journal::of(&table).exists());
}

#[test]
fn every_new_posture_is_measured_by_itself_where_that_is_asked_for() {
    let (bench, folder) = (Bench::new(), tempfile::tempdir().unwrap());
    let station = bench.station(folder.path(), "automatic = true\n");
    let table = folder.path().join("table.csv");
    let mut by_hand = ByHand::connect(&station).unwrap();
    let mut journal = Journal::open(&table, by_hand.units(), None, false).unwrap();
    let jog = |q: f64| *bench.joint.lock().unwrap() = q;
    let mut script = Script::new(vec![
        Box::new(|| Typed::Nothing),
        Box::new(|| Typed::Nothing),
        Box::new(|| {
            jog(10.0);
            Typed::Nothing
        }),
        Box::new(|| Typed::Nothing),
        // It stands where it stood: what is taken back stays so.
        Box::new(|| line("u")),
        Box::new(|| Typed::Nothing),
        Box::new(|| Typed::Nothing),
    ]);
    assert_eq!(by_hand.run(&mut journal, &mut script).unwrap(), Ended::Finished);
    assert_eq!(journal.rows().len(), 1, "{:?}", script.told);
}

#[test]
fn whatever_tears_it_off_it_goes_on() {
    let (bench, folder) = (Bench::new(), tempfile::tempdir().unwrap());
    let station = bench.station(folder.path(), "");
    let table = folder.path().join("table.csv");
    let measure = |postures: usize, stops_after: usize, resume: bool| {
        let mut by_hand = ByHand::connect(&station).unwrap();
        let mut journal = Journal::open(&table, by_hand.units(), None, resume).map_err(|e| e.to_string())?;
        let before = journal.rows().len();
        let mut steps: Vec<Box<dyn FnOnce() -> Typed>> = Vec::new();
        for k in 0..postures {
            let joint = Arc::clone(&bench.joint);
            steps.push(Box::new(move || {
                *joint.lock().unwrap() = 10.0 * (before + k) as f64;
                Typed::Nothing
            }));
            steps.push(Box::new(|| line("")));
        }
        let mut script = Script { stops_after, ..Script::new(steps) };
        Ok::<_, String>((by_hand.run(&mut journal, &mut script).unwrap(), before, journal.rows().len()))
    };
    assert_eq!(measure(4, 3, false).unwrap(), (Ended::Interrupted, 0, 3));
    let said = measure(1, 9, false).unwrap_err();
    assert!(said.contains("interrupted; add --resume"), "{said}");
    // Torn at every byte of its last line: what stands before it is there.
    let path = Journal::of(&table);
    let whole = std::fs::read(&path).unwrap();
    let last = whole[..whole.len() - 1].iter().rposition(|&b| b == b'\n').unwrap() + 1;
    for cut in last..whole.len() - 1 {
        std::fs::write(&path, &whole[..cut]).unwrap();
        let units = ByHand::connect(&station).unwrap().units().to_vec();
        assert_eq!(Journal::open(&table, &units, None, true).unwrap().rows().len(), 2, "cut at {cut}");
        if cut % 40 == 0 {
            // The next row is written after the torn one, and both are read again.
            let mut journal = Journal::open(&table, &units, None, true).unwrap();
            let row = journal.rows()[0].clone();
            journal.add(row).unwrap();
            drop(journal);
            assert_eq!(Journal::open(&table, &units, None, true).unwrap().rows().len(), 3);
        }
    }
    std::fs::write(&path, &whole).unwrap();
    assert_eq!(measure(2, 9, true).unwrap(), (Ended::Finished, 3, 5));
    // Another arm does not go on with it, and neither does a second program.
    let units = [calibench_readout::JointUnit::Deg; 6];
    let said = Journal::open(&table, &units, None, true).map(|_| ()).unwrap_err().to_string();
    assert!(said.contains("joints of other units or number"), "{said}");
    let units = ByHand::connect(&station).unwrap().units().to_vec();
    let held = Journal::open(&table, &units, None, true).unwrap();
    let said = Journal::open(&table, &units, None, true).map(|_| ()).unwrap_err().to_string();
    assert!(said.contains("another program measures into it"), "{said}");
    drop(held);
    std::fs::write(&path, "{}\n").unwrap();
    let said = Journal::open(&table, &units, None, true).map(|_| ()).unwrap_err().to_string();
    assert!(said.contains("is not a journal of points"), "{said}");
}
