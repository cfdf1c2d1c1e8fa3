//! Arguments of `compensate`.

use std::path::PathBuf;

use crate::terminal::streams::{input, output};
use calibench::compensate::WorkFrame;
use calibench::robot::FramePose;

use super::options;

#[derive(clap::Args)]
pub struct Arguments {
    /// Calibration file written by `identify`
    #[arg(value_parser = input())]
    pub calibration: PathBuf,
    /// Targets: id with x_mm, y_mm, z_mm, a_deg, b_deg, c_deg of the TCP, or id with q1_deg ... at which a nominal robot would
    /// reach it. Or robot programs that belong together: .src and .dat (KRL), .script (URScript), .mod, .modx, .prg (RAPID),
    /// .ls (FANUC), .jbi (Yaskawa), .pgx and .dtx (VAL 3)
    #[arg(requires = "out", value_name = "TARGETS.csv|PROGRAM", value_parser = input())]
    pub targets: Vec<PathBuf>,
    /// Output file for the fake targets, one row per target, or for the program; a folder for several programs
    #[arg(short, long, visible_alias = "output", value_name = "FAKE.csv|PROGRAM|FOLDER", requires = "targets", value_parser = output())]
    pub out: Option<PathBuf>,
    /// Write programs of which some positions cannot be rewritten
    #[arg(long, requires = "targets")]
    pub partly: bool,
    /// Joint positions of FANUC programs count joints as the robot file does, and J3 does not turn with J2
    #[arg(long, requires = "targets")]
    pub joints_as_in_robot_file: bool,
    /// External axes of programs carry neither the robot nor the work, wherever they stand
    #[arg(long, requires = "targets")]
    pub external_axes_apart: bool,
    /// Tools and bases by the names that programs have for them: .toml (`calibench-frames/1`) with [tools] and [bases], NAME = [X,Y,Z,A,B,C] (mm, deg);
    /// $config.dat (KRL); a module with tooldata and wobjdata (RAPID); the listing of $MNUTOOL and $MNUFRAME (FANUC)
    #[arg(long, value_name = "FILE", requires = "targets", value_parser = input())]
    pub frames: Vec<PathBuf>,
    /// Set-up of the calibration, if it has several
    #[arg(long)]
    pub session: Option<String>,
    /// Frame of the targets: `world`, the world of the set-up, or X,Y,Z,A,B,C (mm, deg) relative to the robot's base link,
    /// KUKA's $BASE; the default is the base link, KUKA's $ROBROOT
    #[arg(long, value_parser = options::work_frame, allow_hyphen_values = true)]
    pub base: Option<WorkFrame>,
    /// TCP relative to the flange, X,Y,Z,A,B,C (mm, deg), KUKA's $TOOL; the default is the tool of the set-up
    #[arg(long, value_parser = options::tool, allow_hyphen_values = true, value_name = "X,Y,Z,A,B,C")]
    pub tool: Option<FramePose>,
    /// Load on the flange and its centre of mass relative to the flange, KG,X,Y,Z (kg, mm); the default is the first payload of
    /// the set-up
    #[arg(long, value_parser = options::load, allow_hyphen_values = true, value_name = "KG,X,Y,Z")]
    pub load: Option<[f64; 4]>,
    /// Write the targets as a KRL module as well, NAME.src and NAME.dat beside FAKE.csv
    #[arg(long, value_name = "NAME", requires = "out")]
    pub krl: Option<String>,
    /// Move to the fake poses in straight lines in the KRL module, not by joints
    #[arg(long, requires = "krl")]
    pub lin: bool,
    /// Write the rigid part of the identified robot as a URDF
    #[arg(long, value_name = "FILE", value_parser = output())]
    pub urdf: Option<PathBuf>,
    /// URDF file of the robot: `--urdf` writes the same file with calibrated joint origins, and all else as it is
    #[arg(long, value_name = "FILE.urdf[#BASE:TOOL]", requires = "urdf")]
    pub urdf_of: Option<String>,
    /// Write the origins of the joints of `--urdf-of` as the kinematics file of the ROS package ur_description (YAML)
    #[arg(long, value_name = "FILE", requires = "urdf_of", value_parser = output())]
    pub ur_kinematics: Option<PathBuf>,
    /// Write the rigid part of the identified robot as a model of MuJoCo
    #[arg(long, value_name = "FILE", value_parser = output())]
    pub mjcf: Option<PathBuf>,
    /// Write the rigid part of the identified robot as a robot file, for use by a dataset
    #[arg(long, value_name = "FILE", value_parser = output())]
    pub mdh: Option<PathBuf>,
    /// Print one JSON document instead of sentences
    #[arg(long)]
    pub json: bool,
}
