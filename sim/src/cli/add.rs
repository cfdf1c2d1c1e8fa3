//! `add EFFECT DATASET... [--model M] [-o MODEL]`.

use std::path::PathBuf;

use calibench::assess::{Curve, Examination, ProvingGround, Rung, Variable, WorkspacePoses, add, place, rung};
use calibench::effects::{self, CATALOGUE, EffectError, Subject};
use calibench::files::nearest_name;
use calibench::identify::{Model, write_model, write_model_like};
use calibench::measure::Dataset;
use calibench::report::{objection_sentence, parameter_rows, rung_table, step_json, symptom_sentence};

use super::progress::Waiting;
use super::{Failure, Outcome, blame_data, check_datasets, model_for, named, print, print_json, read_datasets, warn_of_poses};

#[derive(clap::Args)]
pub struct Arguments {
    /// Effect to add, as `effects` lists it; `base_step`, `tool_step`, `joint_step:J`, `harmonic:J` and `outlier` without their moment,
    /// order or sample take the one that fits best; `curve:J:VARIABLE` is the curve of joint J over q1, tau2, q2+q3, time_s ...
    effect: String,
    /// Dataset folders: one robot; each session in each has its own base and tool
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Model file, rewritten in place; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long)]
    model: Option<PathBuf>,
    /// Where to write the new model in place of the old one's file; a file that is there is replaced
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    /// Campaigns that are not fitted: a step that makes one worse is refused
    #[arg(long, num_args = 1.., value_name = "DATASET")]
    check: Vec<PathBuf>,
    /// Take the step even if it is refused
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_for(arguments.model.as_deref(), &datasets)?;
    let named = named(&datasets);
    let effect = Wanted::parse(&arguments.effect, &model, &datasets[0].1)?;
    let checks = check_datasets(&arguments.check, &datasets[0].1)?;
    let checks = super::named(&checks);
    let poses = WorkspacePoses::of(&named);
    let ground = ProvingGround { poses: &poses.q, checks: &checks };
    let blame = |e| blame_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let waiting = Waiting::new("fitting");
    let before = rung(&named, &model, ground).map_err(blame)?;
    let wrong = |why: String| format!("effect '{}': {why}", arguments.effect);
    let after = match effect {
        Wanted::Effect(id) => {
            let examination = Examination::new(&named, &model).map_err(blame)?;
            let id = place(&examination, &id).map_err(|e| wrong(e.to_string()))?;
            // It is the data that lack something, not the model's file.
            add(&named, &before, &[id], ground).map_err(|e| blame_data(&arguments.datasets, &datasets, None, &e))?
        }
        Wanted::Curve { joint, variable } => {
            let examination = Examination::new(&named, &model).map_err(blame)?;
            let curve = Curve::of(&examination, joint, variable).map_err(|e| wrong(e.to_string()))?;
            let curve =
                curve.ok_or_else(|| wrong(format!("{} does not vary in these data, or is not known", variable.name())))?;
            let name = curve.effect_name();
            if model.effects.contains(&name) {
                return Err(wrong(format!("the model holds it already, as '{name}'")).into());
            }
            let rung = rung(&named, &curve.added_to(&model), ground).map_err(blame)?;
            Rung { added: vec![name], ..rung }
        }
    };
    drop(waiting);
    let objections = after.objections(&before);
    let refused = objections.iter().any(calibench::assess::Objection::refuses);
    let accepted = !refused || arguments.force;
    let target = arguments.output.as_deref().or(arguments.model.as_deref());
    if let Some(path) = target.filter(|_| accepted) {
        match &arguments.model {
            Some(like) => write_model_like(&after.model, like, path)?,
            None => write_model(&after.model, path)?,
        }
    }
    let added = after.added.join(" ");
    if arguments.json {
        print_json(&step_json(&before, &after, &objections, accepted))?;
    } else {
        print(&rung_table(&[&before, &after]))?;
        print(&format!("\nFOUND: {added}\n{}", parameter_rows(&after.calibration, &after.added)))?;
        for symptom in after.symptoms.iter().filter(|s| !before.symptoms.iter().any(|b| b.parameter == s.parameter)) {
            print(&symptom_sentence(symptom))?;
        }
        for objection in &objections {
            let weight = if objection.refuses() { "Against it" } else { "Note" };
            print(&format!("{weight}: {}.", objection_sentence(objection)))?;
        }
        match (target, accepted) {
            (Some(path), true) => print(&format!("Taken. The model with {added} is in {}.", path.display()))?,
            (None, true) => print("Taken. Name a file with -o to keep the model.")?,
            (_, false) => {}
        }
    }
    warn_of_poses(&after.calibration, &poses);
    if accepted {
        return Ok(Outcome::Done);
    }
    let why: Vec<String> = objections.iter().filter(|o| o.refuses()).map(objection_sentence).collect();
    let untouched = arguments.model.as_ref().map_or(String::new(), |m| format!("; {} is untouched", m.display()));
    eprintln!("calibench: {added} is refused: {}{untouched}; --force takes the step all the same", why.join("; "));
    Ok(Outcome::ExpectationFailed)
}

/// What is to be added.
enum Wanted {
    /// An effect, which may still lack its place.
    Effect(String),
    /// The curve of a cell of the heat map, joint counted from 0.
    Curve { joint: usize, variable: Variable },
}

impl Wanted {
    fn parse(id: &str, model: &Model, dataset: &Dataset) -> Result<Self, Failure> {
        let joints = dataset.robot.joints();
        if let Some(rest) = id.strip_prefix("curve:") {
            let (joint, variable) = rest.split_once(':').unwrap_or((rest, ""));
            let joint = joint.parse::<usize>().ok().filter(|j| (1..=joints).contains(j));
            return match (joint, Variable::parse(variable, joints)) {
                (Some(joint), Some(variable)) => Ok(Wanted::Curve { joint: joint - 1, variable }),
                _ => Err(format!(
                    "effect '{id}' is no curve; write curve:J:VARIABLE with a joint from 1 to {joints} and one of q1 ... q{joints}, q2+q3, tau1 ... tau{joints}, time_s"
                )
                .into()),
            };
        }
        if model.effects.iter().any(|e| e == id) {
            return Err(format!("effect '{id}' is in the model already").into());
        }
        let balls = dataset.ball_ids();
        let subject = Subject { own: &model.own, ..Subject::new(&dataset.robot, &balls) };
        let unplaced = unplaced(&subject);
        if !unplaced.iter().any(|u| u == id) {
            effects::build(id, &subject).map_err(|e| explained(&e, id, &subject, &unplaced))?;
        }
        Ok(Wanted::Effect(id.to_owned()))
    }
}

/// Ids that lack the place which a scan finds.
fn unplaced(subject: &Subject<'_>) -> Vec<String> {
    let scanned = CATALOGUE.iter().flat_map(|f| f.scanned(subject, ""));
    scanned.map(|id| id.trim_end_matches(':').to_owned()).collect()
}

/// Why there is no such effect, with the id that may be meant.
fn explained(error: &EffectError, id: &str, subject: &Subject<'_>, unplaced: &[String]) -> String {
    let all = effects::ids(subject);
    let families = CATALOGUE.iter().map(|f| f.id);
    let known = all.iter().chain(unplaced).map(String::as_str).chain(families);
    let nearest = nearest_name(id, known).or_else(|| {
        let family = id.split(':').next().unwrap_or_default();
        nearest_name(family, CATALOGUE.iter().map(|f| f.id))
    });
    if let EffectError::Argument { .. } = error {
        let form = effects::family(id).map(|f| format!("; write `{}{}`", f.id, f.arguments));
        return format!("{error}{}", form.unwrap_or_default());
    }
    match nearest {
        Some(near) if near != id => format!("{error}; did you mean `{near}`?"),
        _ => error.to_string(),
    }
}
