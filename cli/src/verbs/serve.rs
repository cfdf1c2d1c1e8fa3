//! `sim serve SCENARIO`: the simulated cell over the interfaces of a real one.

use std::io::Write;
use std::path::PathBuf;

use crate::arguments::choices::seed;
use crate::arguments::choices::{LoopChoice, MakeChoice, MakerChoice, PlantChoice, ServerChoice};
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::note;
use calibench_serve::{Injection, Manner, RobotManner, Service, serve};
use calibench_sim::planning::plan;
use calibench_sim::plans::session_s;
use calibench_sim::random::Streams;
use calibench_sim::scenario::PlantKind;

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file
    scenario: PathBuf,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Plant that simulates the mechanics of the cell, overriding the scenario's choice
    #[arg(long, value_enum)]
    plant: Option<PlantChoice>,
    /// Make of the robot
    #[arg(long, value_enum, default_value_t)]
    robot: MakeChoice,
    /// Port of the robot on the loopback address, of RTDE where it is a Universal Robot: its other ports lie beside; 0 takes a
    /// free one
    #[arg(long, default_value_t = 0)]
    robot_port: u16,
    /// First of three ports of the loopback address for the indicators, instead of pseudo-terminals; 0 takes any three
    #[arg(long)]
    indicator_port: Option<u16>,
    /// Port of a laser tracker on the loopback address, which answers every line with a point; 0 takes a free one
    #[arg(long)]
    tracker_port: Option<u16>,
    /// Seconds of cell time per second of real time; 0: nothing takes time
    #[arg(long, default_value_t = 1.0, value_parser = time_scale)]
    time_scale: f64,
    /// Command set of the indicators
    #[arg(long, value_enum, default_value_t)]
    maker: MakerChoice,
    /// Do not echo commands that change an indicator's settings
    #[arg(long)]
    no_echo: bool,
    /// Use a decimal comma in indicator readings
    #[arg(long)]
    comma: bool,
    /// End the indicators' lines with CR LF
    #[arg(long)]
    crlf: bool,
    /// Enable the indicators' tolerance mode: a verdict follows each value
    #[arg(long)]
    tolerance: bool,
    /// Number of decimals of a millimetre; the default is 4 (0.1 um), 3 for Digimatic
    #[arg(long, value_parser = clap::value_parser!(u8).range(2..=4))]
    decimals: Option<u8>,
    /// Accept only the newer command that recalls an indicator's preset: PRE ON
    #[arg(long)]
    preset_on: bool,
    /// Variable server of the robot
    #[arg(long, value_enum, default_value_t)]
    server: ServerChoice,
    /// Report the robot's numbers with seven digits, as older controllers do
    #[arg(long)]
    seven_digits: bool,
    /// Lose robot requests that arrive in pieces, as the real KUKAVARPROXY does
    #[arg(long)]
    no_reassembly: bool,
    /// Program on the robot's controller
    #[arg(long, value_enum, default_value_t)]
    program: LoopChoice,
    /// Operating mode that the robot reports: T1, T2, AUT (default) or EX of a KUKA, REMOTE (default) or LOCAL of a Universal
    /// Robot
    #[arg(long, value_parser = ["T1", "T2", "AUT", "EX", "REMOTE", "LOCAL"])]
    mode: Option<String>,
    /// Take commands for the cell's attendant from standard input: `ball in`, `ball out` for the master ball, `ball` asks for
    /// its place; `reset` after an emergency stop
    #[arg(long)]
    commands: bool,
    /// Fault to inject, NAME[:PART][@WHEN]; may be repeated. The guide docs/serve.md lists the faults
    #[arg(long, value_name = "FAULT")]
    fault: Vec<Injection>,
}

fn time_scale(text: &str) -> Result<f64, String> {
    let scale = text.parse().ok().filter(|scale: &f64| scale.is_finite() && *scale >= 0.0);
    scale.ok_or_else(|| "give a number, 0 or more".into())
}

impl Arguments {
    /// Flags of the other make of robot are refused.
    fn expect_make(&self) -> Result<(), Failure> {
        let is_ur = self.robot == MakeChoice::Ur;
        let mode = self.mode.as_deref().is_some_and(|mode| is_ur != matches!(mode, "REMOTE" | "LOCAL"));
        let others = [
            ("--mode", mode),
            ("--server", is_ur && self.server != ServerChoice::default()),
            ("--seven-digits", is_ur && self.seven_digits),
            ("--no-reassembly", is_ur && self.no_reassembly),
            ("--program", is_ur && self.program != LoopChoice::default()),
        ];
        match others.iter().find(|(_, is_given)| *is_given) {
            Some((flag, _)) if is_ur => Err(format!("{flag} is for a KUKA, and --robot is ur").into()),
            Some((flag, _)) => {
                Err(format!("--mode REMOTE and LOCAL are for a Universal Robot; give --robot ur with {flag}").into())
            }
            None => Ok(()),
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut scenario = read_scenario(&arguments.scenario)?;
    scenario.expect_trical("sim serve")?;
    arguments.expect_make()?;
    scenario.plant = arguments.plant.map_or(scenario.plant, PlantKind::from);
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let planned = plan(&scenario, seed).map_err(|e| scenario.locate_plan(&e))?.probing;
    let service = Service {
        robot_port: arguments.robot_port,
        indicator_port: arguments.indicator_port,
        tracker_port: arguments.tracker_port,
        time_scale: arguments.time_scale,
        indicators: Manner {
            maker: arguments.maker.into(),
            no_echo: arguments.no_echo,
            comma: arguments.comma,
            crlf: arguments.crlf,
            tolerance: arguments.tolerance,
            decimals: arguments.decimals,
            preset_on: arguments.preset_on,
        },
        make: arguments.robot.into(),
        robot: RobotManner {
            server: arguments.server.into(),
            seven_digits: arguments.seven_digits,
            no_reassembly: arguments.no_reassembly,
        },
        program: arguments.program.into(),
        mode: arguments.mode.clone(),
        faults: arguments.fault.clone(),
        stands: planned.ways.as_ref().map(|ways| ways.home.clone()),
        takes_commands: arguments.commands,
    };
    let session_s = session_s(&scenario, &planned.poses, 0);
    let traffic = serve(&scenario, Streams { seed, trial: 0 }, session_s, &service, |addresses| {
        let mut out = std::io::stdout().lock();
        serde_json::to_writer(&mut out, addresses)?;
        out.write_all(b"\n").and_then(|()| out.flush())
    })?;
    note(&traffic.to_string());
    Ok(Outcome::Done)
}
