//! `plan CELL -o PLAN`: a plan for a real cell, made with the settings of the scenario that its file refers to.

use std::path::Path;

use calibench::files::{FileError, field_error, read_text};
use calibench::identify::Model;
use calibench::measure::campaign::cell::{CELL_FORMAT, Cell, read_cell};
use calibench::measure::dataset::Dataset;
use calibench::measure::poses::write_plan;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::rotation_vector;
use calibench::units::{DEG, MM};
use toml::Table;

use super::{Arguments, chosen_sentence};
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print, print_answer};
use crate::terminal::progress::Waiting;
use calibench_sim::planning::{PointRequest, layout, plan_points};
use calibench_sim::scenario::Scenario;

/// Starts of the search for poses where no scenario says it.
const STARTS: usize = 8;

/// Largest allowed distance of a ball or the TCP between scenario and cell, m: clearances are a few millimetres.
const SAME_PLACE: f64 = 1.0 * MM;
/// Largest allowed rotation of the tool between them, rad.
const SAME_TURN: f64 = 0.1 * DEG;

/// True if this is the file of a real cell. A file that is neither cell nor scenario is left to the scenario's reader to
/// reject.
pub fn is_cell(path: &Path) -> bool {
    let format = |text: String| text.parse::<Table>().ok()?.get("format")?.as_str().map(|format| format == CELL_FORMAT);
    read_text(path).ok().and_then(format).unwrap_or(false)
}

/// Reads the scenario to which a cell's file refers, with the bodies of the cell if its file names them, and the cell, whose
/// names and guards the plan must respect.
///
/// # Errors
/// If the file is invalid, refers to no scenario, or the scenario is of another cell.
pub fn scenario_of(path: &Path) -> Result<(Scenario, Cell), FileError> {
    let cell = read_cell(path)?;
    let wrong = |problem: String, remedy: &str| match read_text(path) {
        Ok(text) => field_error(path, &text, "scenario", problem, remedy),
        Err(error) => error,
    };
    let Some(named) = &cell.scenario else {
        let remedy =
            "name a scenario of the same cell, relative to this file: it has the settings with which poses are planned";
        return Err(wrong("is missing".into(), remedy));
    };
    if !named.exists() {
        return Err(wrong(format!("{} is not there", named.display()), "name a scenario, relative to this file"));
    }
    let scenario = read_scenario(named)?;
    if let Some(difference) = difference(&scenario.dataset(), &cell.dataset) {
        let problem = format!("{} is of another cell: {difference}", named.display());
        return Err(wrong(problem, "make robot, base, tool, balls and payloads those of the dataset"));
    }
    let scenario = match &cell.surroundings {
        Some(bodies) => scenario.with_surroundings(bodies.clone()),
        None => scenario,
    };
    Ok((scenario, cell))
}

/// Plans poses in which an instrument measures points.
pub fn plan_points_of(path: &Path, arguments: &Arguments, poses: usize) -> Result<Outcome, Failure> {
    if !is_cell(path) {
        let remedy = "give a cell.toml; a scenario plans its own points, by `tracker` and `plan.point_poses`";
        return Err(FileError::whole(path, "is not a cell", remedy).into());
    }
    let cell = read_cell(path)?;
    let scenario = cell.scenario.is_some().then(|| scenario_of(path)).transpose()?.map(|(scenario, _)| scenario);
    let bodies = match (&cell.surroundings, &scenario) {
        (Some(bodies), _) => bodies.clone(),
        (None, Some(scenario)) => scenario.surroundings(),
        (None, None) => {
            let remedy = "add `surroundings.scene`, a scene with the bodies around the arm";
            return Err(FileError::whole(path, "names no bodies around the arm", remedy).into());
        }
    };
    let facing = scenario.as_ref().and_then(|scenario| layout(scenario).facing);
    let model = scenario.as_ref().map_or_else(Model::default, |scenario| scenario.model.clone());
    let starts = scenario.as_ref().map_or(STARTS, |scenario| scenario.plan.starts);
    let seed = arguments.seed.or(scenario.as_ref().map(|scenario| scenario.seed)).unwrap_or_default();
    let waiting = Waiting::new("planning");
    let request =
        PointRequest { cell: &cell.dataset, bodies: &bodies, guards: &cell.guards, facing, model: &model, poses, starts, seed };
    let plan = plan_points(&request)?;
    drop(waiting);
    if let Some(file) = &arguments.output {
        write_plan(file, &plan.probing, &cell.dataset)?;
    }
    print_answer(chosen_sentence("points", plan.wanted(), &plan.chosen))?;
    if facing.is_none() {
        print("Where the instrument stands is not known: turn the target to it, and keep its view clear.")?;
    }
    if let Some(file) = &arguments.output {
        print(format!("The plan is in {}.", file.display()))?;
    }
    Ok(Outcome::Done)
}

/// A difference that would make a plan wrong, if any.
fn difference(scenario: &Dataset, cell: &Dataset) -> Option<String> {
    let names = |dataset: &Dataset| -> [Vec<String>; 2] {
        let balls = dataset.balls.iter().map(|b| b.id.clone()).collect();
        [balls, dataset.payloads.iter().map(|p| p.name.clone()).collect()]
    };
    if scenario.robot.name != cell.robot.name || scenario.robot.joints() != cell.robot.joints() {
        return Some(format!("its robot is {}, the dataset's {}", scenario.robot.name, cell.robot.name));
    }
    for (what, (theirs, own)) in ["balls", "payloads"].iter().zip(names(scenario).into_iter().zip(names(cell))) {
        if theirs != own {
            return Some(format!("its {what} are {theirs:?}, the dataset's {own:?}"));
        }
    }
    for (theirs, own) in scenario.balls.iter().zip(&cell.balls) {
        let apart = (theirs.position - own.position).norm();
        if apart > SAME_PLACE {
            return Some(format!("ball '{}' is {:.1} mm away", own.id, apart / MM));
        }
    }
    // Any difference of arm, base and tool shows at the tool in one posture or the other.
    for angle in [0.0, 0.7] {
        let tool = |d: &Dataset| world_from_tool(&d.robot, &d.base, &d.tool, &vec![angle; d.robot.joints()]);
        let step = tool(scenario).inv_mul(&tool(cell));
        let (apart, turned) = (step.translation.vector.norm(), rotation_vector(&step.rotation).norm());
        if apart > SAME_PLACE || turned > SAME_TURN {
            return Some(format!("its tool is {:.1} mm and {:.2} deg away", apart / MM, turned / DEG));
        }
    }
    None
}
