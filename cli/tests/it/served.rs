//! A served cell to test against, and the program that measures it: two processes connected by real sockets and terminals.
#![allow(dead_code)] // each test uses its own part

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};
use std::time::{Duration, Instant};

use calibench::measure::dataset::file::write_dataset;
use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::ways::HomeWays;
use calibench::measure::poses::{PlannedPose, ProbingPlan, write_plan};
use calibench::units::DEG;
use calibench_sim::planning::{find_ways, plan};
use calibench_sim::scenario::{Scenario, load_scenario};
use calibench_wire::ur::{Client, ClientError, Recipes};
use rs_openshowvar::OpenShowVar;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_calibench");

/// The seed used throughout.
pub const SEED: u64 = 1;

/// The makes of robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Make {
    Kuka,
    Ur,
}

/// The paper's cell, or the same around a Universal Robot, planned.
pub struct Bench {
    make: Make,
    folder: TempDir,
    pub scenario: Scenario,
    pub poses: Vec<PlannedPose>,
    pub ways: HomeWays,
}

impl Bench {
    /// A new bench with a quick plan.
    pub fn new() -> Bench {
        Bench::with(Make::Kuka, |poses| poses)
    }

    /// The same around a Universal Robot.
    pub fn ur() -> Bench {
        Bench::with(Make::Ur, |poses| poses)
    }

    /// Two poses on each ball, and one reserve.
    pub fn small() -> Bench {
        Bench::small_of(Make::Kuka)
    }

    /// The same around a robot of this make.
    pub fn small_of(make: Make) -> Bench {
        let few = |poses: Vec<PlannedPose>| {
            let mut taken = [[0; 2]; 4];
            let mut wanted = |pose: &PlannedPose| {
                let taken = &mut taken[pose.ball.unwrap()][usize::from(pose.reserve)];
                *taken += 1;
                *taken <= if pose.reserve { 1 } else { 2 }
            };
            poses.into_iter().filter(|pose| wanted(pose)).collect()
        };
        Bench::with(make, few)
    }

    fn with(make: Make, choose: impl FnOnce(Vec<PlannedPose>) -> Vec<PlannedPose>) -> Bench {
        let folder = tempfile::tempdir().unwrap();
        let paper = Path::new(env!("CARGO_MANIFEST_DIR")).join(match make {
            Make::Kuka => "../scenarios/paper.toml",
            Make::Ur => "../scenarios/ur5e-trical.toml",
        });
        let plan_keys = "[plan]\npool_per_ball = 200\nstarts = 1\n";
        let text = format!("format = \"calibench-scenario/1\"\nextends = \"{}\"\n{plan_keys}", paper.display());
        std::fs::write(folder.path().join("scenario.toml"), text).unwrap();
        let scenario = load_scenario(&folder.path().join("scenario.toml")).unwrap();
        let mut poses = choose(plan(&scenario, SEED).unwrap().probing.poses);
        let ways = find_ways(&scenario, SEED, None, &mut poses).unwrap();
        let bench = Bench { make, folder, scenario, poses, ways };
        let cell = bench.cell();
        // A dataset needs at least one sample; only its description is used.
        let sample = Sample::new("a", vec![0.0; cell.robot.joints()], Measured::Ball { ball: 0, reading: None });
        write_dataset(&Dataset { samples: vec![sample], ..cell.clone() }, &bench.path("cell")).unwrap();
        bench.scenario.scene().write(&bench.path("scene.toml")).unwrap();
        write_plan(&bench.path("plan.toml"), &bench.plan(), &cell).unwrap();
        bench
    }

    /// The planned poses and ways.
    pub fn plan(&self) -> ProbingPlan {
        ProbingPlan { poses: self.poses.clone(), ways: Some(self.ways.clone()) }
    }

    /// The cell as known to its owner.
    pub fn cell(&self) -> Dataset {
        self.scenario.gauge_dataset()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Serves the cell; nothing takes time unless `arguments` say so.
    pub fn serve(&self, arguments: &[&str]) -> Served {
        let mut command = Command::new(PROGRAM);
        command.args(["sim", "serve"]).arg(self.path("scenario.toml")).args(["--seed", &SEED.to_string(), "--commands"]);
        if self.make == Make::Ur {
            command.args(["--robot", "ur"]);
        }
        if !arguments.contains(&"--time-scale") {
            command.args(["--time-scale", "0"]);
        }
        let mut process =
            command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (stdin, mut out) = (process.stdin.take().unwrap(), BufReader::new(process.stdout.take().unwrap()));
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        let addresses: serde_json::Value = serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: {line}"));
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        let indicators = [0, 1, 2].map(|k| text(&addresses["indicators"][k]));
        Served {
            process,
            stdin,
            out,
            indicators,
            robot: text(&addresses["robot"]),
            tracker: addresses["tracker"].as_str().map(str::to_owned),
            make: self.make,
        }
    }

    /// Writes `cell.toml` for the served cell, with additional keys for the robot and the indicators, and additional tables.
    pub fn write_cell(&self, served: &Served, robot: &str, indicator: &str, tables: &str) -> PathBuf {
        let keys = match self.make {
            Make::Kuka => "flange.b_deg = 180\nvariables.joints = \"$AXIS_ACT_MEAS\"\nvariables.commanded = \"$AXIS_ACT\"\n",
            Make::Ur => "kind = \"ur\"\npayload = { mass_kg = 4.0, com_mm = [25.0, 0.0, 70.0] }\n",
        };
        let mut text = format!(
            "format = \"calibench-cell/1\"\ndataset = \"cell/dataset.toml\"\nsurroundings.scene = \"scene.toml\"\n[robot]\naddress = \"{}\"\nspeed_percent = 100\n\
             {keys}patience.settle_s = 0.0\npatience.poll_ms = 1\npatience.answer_s = 1.0\npatience.motion_s = 20.0\n{robot}\n{tables}\n",
            served.robot
        );
        for (axis, place) in ["x", "y", "z"].iter().zip(&served.indicators) {
            let key = if place.starts_with('/') { "port" } else { "address" };
            text += &format!(
                "[[indicator]]\naxis = \"{axis}\"\n{key} = \"{place}\"\nline = \"9600 8N1\"\ntimeout_s = 0.5\n{indicator}\n"
            );
        }
        let path = self.path("cell.toml");
        std::fs::write(&path, text).unwrap();
        path
    }

    /// The command that measures the cell of `write_cell` without asking questions.
    pub fn measure(&self, dataset: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM);
        command.args(["measure", "--yes", "--cell"]).arg(self.path("cell.toml")).arg("--plan").arg(self.path("plan.toml"));
        command.arg("-o").arg(self.path(dataset)).args(arguments).stdin(Stdio::null());
        command
    }

    /// Runs the measuring command.
    pub fn measured(&self, dataset: &str, arguments: &[&str]) -> Output {
        self.measure(dataset, arguments).output().unwrap()
    }
}

/// A cell being served; dropping it ends the process.
pub struct Served {
    process: Child,
    stdin: ChildStdin,
    out: BufReader<ChildStdout>,
    pub indicators: [String; 3],
    pub robot: String,
    pub tracker: Option<String>,
    make: Make,
}

impl Served {
    /// Host and port of the robot.
    pub fn robot(&self) -> (String, u16) {
        let (host, port) = self.robot.rsplit_once(':').unwrap();
        (host.into(), port.parse().unwrap())
    }

    /// The measured joints, rad, as a client of the robot sees them.
    pub fn joints(&self) -> Vec<f64> {
        match self.make {
            Make::Kuka => {
                let (host, port) = self.robot();
                let mut robot = OpenShowVar::new(host, port);
                robot.connect().unwrap();
                let text = robot.read("$AXIS_ACT_MEAS").unwrap();
                let angle = |name: &str| -> f64 {
                    let rest = &text[text.find(name).unwrap() + name.len()..];
                    rest.trim_start().split([',', '}']).next().unwrap().trim().parse::<f64>().unwrap() * DEG
                };
                ["A1", "A2", "A3", "A4", "A5", "A6"].iter().map(|name| angle(name)).collect()
            }
            Make::Ur => self.rtde(&[]).unwrap().fresh().unwrap().six("actual_q").to_vec(),
        }
    }

    /// A client of a Universal Robot that writes these inputs.
    pub fn rtde(&self, inputs: &[&[&str]]) -> Result<Client, ClientError> {
        let recipes = Recipes { outputs: &["actual_q", "runtime_state"], inputs };
        Client::start(TcpStream::connect(&self.robot).unwrap(), &recipes, Duration::from_secs(5))
    }

    /// Sends the attendant a command; returns when it is done.
    pub fn tell(&mut self, command: &str) {
        assert_eq!(self.answer(command), "ok", "to {command}");
    }

    /// The attendant's answer.
    pub fn answer(&mut self, command: &str) -> String {
        writeln!(self.stdin, "{command}").unwrap();
        let mut answer = String::new();
        self.out.read_line(&mut answer).unwrap();
        answer.trim().to_owned()
    }

    pub fn id(&self) -> u32 {
        self.process.id()
    }

    /// Interrupts the process, waits for its end, and returns its final output.
    pub fn interrupt(mut self) -> String {
        assert!(Command::new("kill").args(["-INT", &self.process.id().to_string()]).status().unwrap().success());
        let asked = Instant::now();
        while self.process.try_wait().unwrap().is_none() {
            assert!(asked.elapsed() < Duration::from_secs(60), "an interrupted server ends");
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(self.process.wait().unwrap().success());
        let mut said = String::new();
        std::io::Read::read_to_string(&mut self.process.stderr.take().unwrap(), &mut said).unwrap();
        said
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.process.kill());
        drop(self.process.wait());
    }
}

/// The lines of a journal that hold measurements, each with its pose.
pub fn measurements(journal: &Path) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(journal).unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let measured = |line: &str| {
        let json: serde_json::Value = serde_json::from_str(line.splitn(3, ' ').nth(2)?).ok()?;
        let probing = &json["probing"];
        probing["probing"]["outcome"].get("Ok")?;
        Some((probing["pose"].as_str()?.to_owned(), line.to_owned()))
    };
    whole.lines().filter_map(measured).collect()
}

/// Checks that every measurement of `before` is in the finished dataset: its line in the journal there, its row among the
/// samples.
pub fn assert_none_lost(before: &[(String, String)], dataset: &Path) {
    let kept = measurements(&dataset.join("campaign.journal"));
    let rows = std::fs::read_to_string(dataset.join("samples.csv")).unwrap();
    for measurement in before {
        assert!(kept.contains(measurement), "lost: {}", measurement.1);
        assert!(rows.lines().any(|row| row.split(',').any(|field| field == measurement.0)), "no row: {}", measurement.0);
    }
}
