//! `robots`, `robots show ROBOT`, `robots from-urdf FILE -o ROBOT.toml`, `robots check ROBOT DATASET...`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::files::disk::write_whole;
use calibench::identify::problem::Use;
use calibench::measure::dataset::Dataset;
use calibench::residuals::misfit::data_fit;
use calibench::robot::robot_file::{robot, to_toml};
use calibench::robot::urdf::{ChainEnds, MissingMesh, UrdfRobot, missing_meshes, robot_from_urdf};
use calibench::robot::{BUILT_IN, FramePose, JointKind, Robot, built_in};
use calibench::units::{DEG, MM};
use calibench_report::{Printout, Table, documents, masses_sentence, misfit_sentence, nominal_fit_lines, plain_rows};
use clap::Subcommand;
use serde_json::{Value, json};

use crate::arguments::data::{dataset, named, read_datasets};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::streams::output;

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Arguments {
    #[command(subcommand)]
    errand: Option<Errand>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand)]
enum Errand {
    /// Print a robot as a robot file: joints, limits, masses, solids
    Show {
        /// A built-in robot, a robot file, or a URDF file: FILE.urdf, or FILE.urdf#BASE:TOOL with the names of the links between
        /// which the arm is taken
        robot: String,
        /// Print one JSON document instead
        #[arg(long)]
        json: bool,
    },
    /// Convert the serial chain of a URDF file to a robot file
    FromUrdf {
        /// URDF file; a xacro file must be expanded first
        file: PathBuf,
        /// Name of the base link; the default is the link that is the child of no joint
        #[arg(long)]
        base: Option<String>,
        /// Name of the tool link; the default is the far end of the only arm
        #[arg(long)]
        tool: Option<String>,
        /// Output file
        #[arg(short, long, visible_alias = "out", value_parser = output())]
        output: PathBuf,
        /// Print the robot as one JSON document as well
        #[arg(long)]
        json: bool,
    },
    /// Check whether datasets fit a robot: their residual with nominal links, and the mistake that would explain a misfit
    Check {
        /// The robot, as in `robots show`
        robot: String,
        /// Dataset folders; the robot that they name is not used
        #[arg(required = true, value_parser = dataset())]
        datasets: Vec<PathBuf>,
        /// Print one JSON document instead of sentences
        #[arg(long)]
        json: bool,
    },
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    match &arguments.errand {
        None => list(arguments.json),
        Some(Errand::Show { robot: reference, json }) => show(&named_robot(reference)?, *json),
        Some(Errand::FromUrdf { file, base, tool, output, json }) => {
            check_outputs([output])?;
            let read = robot_from_urdf(file, &ChainEnds { base: base.clone(), tool: tool.clone() })?;
            write_whole(output, to_toml(&read.robot).as_bytes())?;
            let missing: Vec<String> = missing_meshes(file)?.iter().map(missing_sentence).collect();
            if *json {
                print_json(&document_of(&read, &missing))?;
            } else {
                missing.iter().chain(&read.remarks).try_for_each(|line| print_answer(line))?;
                print_answer(converted(&read, output))?;
            }
            Ok(Outcome::Done)
        }
        Some(Errand::Check { robot, datasets, json }) => check(&named_robot(robot)?, datasets, *json),
    }
}

fn named_robot(reference: &str) -> Result<Robot, Failure> {
    Ok(robot(reference, Path::new(""))?)
}

fn list(as_json: bool) -> Result<Outcome, Failure> {
    let all: Vec<Robot> = BUILT_IN.iter().filter_map(|name| built_in(name)).collect();
    if as_json {
        print_json(&document(all.iter().map(entry).collect()))?;
        return Ok(Outcome::Done);
    }
    for robot in &all {
        print_answer(format!("{} ({} joints): {}", robot.name, robot.joints(), robot.source))?;
        print_answer(table(robot))?;
    }
    Ok(Outcome::Done)
}

/// A line on the masses of a robot from a file that lists none; empty if it lists them.
fn masses_words(robot: &Robot) -> String {
    match masses_sentence(robot) {
        Some(sentence) => format!("\nThe file has no masses. {sentence}"),
        None if robot.has_masses() => String::new(),
        None => "\nThe file has no masses: gravity torques cannot be computed from it.".into(),
    }
}

fn show(robot: &Robot, as_json: bool) -> Result<Outcome, Failure> {
    if as_json { print_json(&document(vec![entry(robot)])) } else { print_answer(to_toml(robot).trim_end()) }?;
    Ok(Outcome::Done)
}

/// Summary of a robot read from a URDF file.
fn converted(read: &UrdfRobot, output: &Path) -> Printout {
    let UrdfRobot { robot, joint_names, base_link, tool_link, .. } = read;
    let masses = masses_words(robot);
    let title = format!(
        "{} ({} joints), from link {base_link} to link {tool_link}: {}\n",
        robot.name,
        robot.joints(),
        joint_names.join(", ")
    );
    let written = format!(
        "{masses}\nWritten to {}; name it as `robot` in dataset.toml. Base and tool of a dataset are those of the two links.",
        output.display()
    );
    Printout::from(title) + table(robot) + written
}

fn check(robot: &Robot, folders: &[PathBuf], as_json: bool) -> Result<Outcome, Failure> {
    let mut datasets = read_datasets(folders)?;
    let robot = Arc::new(robot.clone());
    for (name, dataset) in &mut datasets {
        if dataset.robot.joints() != robot.joints() {
            let (has, wants) = (dataset.robot.joints(), robot.joints());
            return Err(
                format!("{name}/samples.csv: has {has} joint angles a row where {} has {wants} joints", robot.name).into()
            );
        }
        mount(dataset, &robot);
    }
    let fits = data_fit(&named(&datasets), Use::All);
    let misfits = fits.iter().filter_map(|fit| fit.misfit.as_ref());
    if as_json {
        let rows = fits.iter().map(|fit| {
            let n = &fit.nominal;
            json!({"dataset": n.dataset, "rows": n.rows, "residual_mm": n.residual / MM, "residual_all_rows_mm": n.plain / MM,
                "expected_mm": n.expected / MM, "fits": fit.misfit.is_none(), "misfit": fit.misfit.as_ref().map(documents::Misfit::of)})
        });
        print_json(&json!({"format": "calibench-robot-check/1", "robot": robot.name, "datasets": rows.collect::<Vec<_>>()}))?;
    } else {
        nominal_fit_lines(&fits).iter().try_for_each(|line| print_answer(line))?;
        misfits.clone().try_for_each(|misfit| print_answer(misfit_sentence(misfit)))?;
    }
    Ok(if misfits.count() == 0 { Outcome::Done } else { Outcome::ExpectationFailed })
}

/// Puts another robot into a dataset, between the same base and tool.
fn mount(dataset: &mut Dataset, robot: &Arc<Robot>) {
    dataset.base = dataset.base.then(&dataset.robot.root.inverse()).then(&robot.root);
    dataset.tool = robot.flange.then(&dataset.robot.flange.inverse()).then(&dataset.tool);
    dataset.robot = Arc::clone(robot);
}

fn document(robots: Vec<Value>) -> Value {
    json!({"format": "calibench-robots/1", "robots": robots})
}

fn missing_sentence(mesh: &MissingMesh) -> String {
    format!("line {}: mesh {} does not exist; solids are not taken from meshes", mesh.line, mesh.file)
}

fn document_of(read: &UrdfRobot, missing: &[String]) -> Value {
    let mut entry = entry(&read.robot);
    entry["joint_names"] = json!(read.joint_names);
    entry["base_link"] = json!(read.base_link);
    entry["tool_link"] = json!(read.tool_link);
    if !missing.is_empty() {
        entry["missing_meshes"] = json!(missing);
    }
    if !read.remarks.is_empty() {
        entry["remarks"] = json!(read.remarks);
    }
    document(vec![entry])
}

fn entry(robot: &Robot) -> Value {
    let frame = |f: &FramePose| {
        let ([x, y, z], [a, b, c]) = (f.xyz.map(|v| v / MM), f.rz_ry_rx.map(|v| v / DEG));
        json!({"x_mm": x, "y_mm": y, "z_mm": z, "a_deg": a, "b_deg": b, "c_deg": c})
    };
    let links: Vec<_> = robot
        .links
        .iter()
        .map(|l| {
            let mut link = json!({"alpha_deg": l.mdh.alpha / DEG, "a_mm": l.mdh.a / MM, "beta_deg": l.mdh.beta / DEG,
                "theta_deg": l.mdh.theta / DEG, "d_mm": l.mdh.d / MM,
                "mass_kg": l.mass, "com_mm": [l.com.x / MM, l.com.y / MM, l.com.z / MM]});
            let unit = l.mdh.kind.unit();
            for (end, limit) in ["min", "max"].into_iter().zip(l.limits) {
                link[format!("{end}_{}", unit.suffix)] = json!(limit / unit.si);
            }
            if l.mdh.kind == JointKind::Prismatic {
                link["kind"] = json!(l.mdh.kind.name());
            }
            link
        })
        .collect();
    let mut entry = json!({"name": robot.name, "source": robot.source, "joints": robot.joints(), "links": links,
        "root": frame(&robot.root), "flange": frame(&robot.flange)});
    if robot.masses_guessed {
        entry["masses_guessed"] = json!(true);
    }
    entry
}

fn table(robot: &Robot) -> Table {
    let g = |v: f64| format!("{v:.3}");
    let slides = robot.first_prismatic().is_some();
    let skewed = robot.links.iter().any(|l| l.mdh.beta != 0.0);
    let row = |(i, l): (usize, &calibench::robot::Link)| {
        let mut row = vec![(i + 1).to_string(), g(l.mdh.alpha / DEG), g(l.mdh.a / MM)];
        row.extend(skewed.then(|| g(l.mdh.beta / DEG)));
        row.extend([g(l.mdh.theta / DEG), g(l.mdh.d / MM)]);
        let unit = l.mdh.kind.unit();
        let limits = format!("{:.0} .. {:.0}", l.limits[0] / unit.si, l.limits[1] / unit.si);
        row.extend([if slides { format!("{limits} {}", unit.symbol) } else { limits }, g(l.mass)]);
        row
    };
    let mut header = vec!["i", "alpha_{i-1} deg", "a_{i-1} mm"];
    header.extend(skewed.then_some("beta_{i-1} deg"));
    header.extend(["theta_i deg", "d_i mm", if slides { "limits" } else { "limits deg" }]);
    header.push(if robot.masses_guessed { "mass kg, guessed" } else { "mass kg" });
    plain_rows(header, robot.links.iter().enumerate().map(row).collect())
}
