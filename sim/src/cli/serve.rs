//! `serve SCENARIO`: the simulated cell on the wires of a real one.

use std::io::Write;
use std::path::PathBuf;

use super::{Failure, Outcome, seed};
use crate::planning::plan;
use crate::random::Streams;
use crate::scenario::{PlantKind, load_scenario};
use crate::serve::{Injection, Loop, Maker, Manner, RobotManner, Service, VariableServer, serve};
use crate::session::session_s;

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file
    scenario: PathBuf,
    /// Seed in place of the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Who plays the mechanics of the cell, in place of the scenario's choice
    #[arg(long, value_enum)]
    plant: Option<PlantKind>,
    /// Port of the robot on the loopback address; 0 takes a free one
    #[arg(long, default_value_t = 0)]
    robot_port: u16,
    /// Indicators on three ports of the loopback address from this one on, not on pseudo-terminals; 0 takes any three
    #[arg(long)]
    indicator_port: Option<u16>,
    /// Seconds of the cell in one of ours; 0: nothing takes time
    #[arg(long, default_value_t = 1.0, value_parser = time_scale)]
    time_scale: f64,
    /// Whose commands the indicators know
    #[arg(long, value_enum, default_value_t)]
    maker: Maker,
    /// Indicators answer commands that set something with nothing, not with an echo
    #[arg(long)]
    no_echo: bool,
    /// Indicators write a comma
    #[arg(long)]
    comma: bool,
    /// Indicators end their lines with CR LF
    #[arg(long)]
    crlf: bool,
    /// Indicators have their tolerance mode on: a verdict follows each value
    #[arg(long)]
    tolerance: bool,
    /// Digits after the point of a millimetre; the default is 4 (0.1 um), 3 for Digimatic
    #[arg(long, value_parser = clap::value_parser!(u8).range(2..=4))]
    decimals: Option<u8>,
    /// Indicators know the newer way to recall a preset only: PRE ON
    #[arg(long)]
    preset_on: bool,
    /// Who answers for the robot
    #[arg(long, value_enum, default_value_t)]
    server: VariableServer,
    /// The robot's numbers have seven digits, as on older controllers
    #[arg(long)]
    seven_digits: bool,
    /// The robot loses requests that come in pieces, as the real KUKAVARPROXY
    #[arg(long)]
    no_reassembly: bool,
    /// What runs on the robot's controller
    #[arg(long, value_enum, default_value_t)]
    program: Loop,
    /// Operating mode that the robot says it is in
    #[arg(long, default_value = "AUT", value_parser = ["T1", "T2", "AUT", "EX"])]
    mode: String,
    /// Take commands for the cell's attendant from standard input: `ball in`, `ball out` for the master ball; `ball` asks where it is
    #[arg(long)]
    commands: bool,
    /// Something that goes wrong, NAME[:PART][@WHEN]; may be given again. The guide docs/serve.md lists them
    #[arg(long, value_name = "FAULT")]
    fault: Vec<Injection>,
}

fn time_scale(text: &str) -> Result<f64, String> {
    let scale = text.parse().ok().filter(|scale: &f64| scale.is_finite() && *scale >= 0.0);
    scale.ok_or_else(|| "give a number, 0 or more".into())
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut scenario = load_scenario(&arguments.scenario)?;
    scenario.expect_trical("serve")?;
    scenario.plant = arguments.plant.unwrap_or(scenario.plant);
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let planned = plan(&scenario, seed).map_err(|e| scenario.blame_plan(&e))?.probing;
    let service = Service {
        robot_port: arguments.robot_port,
        indicator_port: arguments.indicator_port,
        time_scale: arguments.time_scale,
        indicators: Manner {
            maker: arguments.maker,
            no_echo: arguments.no_echo,
            comma: arguments.comma,
            crlf: arguments.crlf,
            tolerance: arguments.tolerance,
            decimals: arguments.decimals,
            preset_on: arguments.preset_on,
        },
        robot: RobotManner {
            server: arguments.server,
            seven_digits: arguments.seven_digits,
            no_reassembly: arguments.no_reassembly,
        },
        program: arguments.program,
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
    eprintln!("{traffic}");
    Ok(Outcome::Done)
}
