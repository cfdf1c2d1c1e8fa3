//! `ladder DATASET... [--model M]`.

use std::path::PathBuf;

use calibench::assess::{Top, WORKSPACE_POSES, ladder, workspace_poses};
use calibench::identify::write_model;
use calibench::report::{ladder_json, objection_sentence, rung_table};

use super::{Failure, Outcome, blame_data, model_for, named, print, print_json, read_datasets};

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders: one robot; each session in each has its own base and tool
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Model file to begin with; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long)]
    model: Option<PathBuf>,
    /// Where to write the model of the last rung (TOML); a file that is there is replaced
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_for(arguments.model.as_deref(), &datasets)?;
    let blame = |e| blame_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let named = named(&datasets);
    let poses = workspace_poses(&datasets[0].1, WORKSPACE_POSES);
    let ladder = ladder(&named, &model, &poses, &mut |rung| {
        if !arguments.json {
            eprintln!("{}", rung.added.join(" "));
        }
    })
    .map_err(blame)?;
    if let (Some(path), Some(last)) = (&arguments.output, ladder.rungs.last()) {
        write_model(&last.model, path)?;
    }
    if arguments.json {
        print_json(&ladder_json(&ladder))?;
        return Ok(Outcome::Done);
    }
    print(&rung_table(&ladder.rungs.iter().chain(&ladder.whole).collect::<Vec<_>>()))?;
    match &ladder.top {
        Top::NothingLeft => print("Nothing is left but noise.")?,
        Top::Tired => print("The ladder ends here; go on from its model.")?,
        Top::NoStepHelps { tried } => {
            for (effect, objections) in tried {
                let why: Vec<String> = objections.iter().map(objection_sentence).collect();
                print(&format!("not {effect}: {}", why.join("; ")))?;
            }
        }
    }
    Ok(Outcome::Done)
}
