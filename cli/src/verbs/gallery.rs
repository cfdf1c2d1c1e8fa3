//! `effects gallery SCENARIO` and `effects gallery DATASET...`: what each effect looks like in the residuals.

use std::path::{Path, PathBuf};

use calibench::effects::catalogue::CATALOGUE;
use calibench::effects::registry::Registry;
use calibench::files::disk::replace_folder;
use calibench::files::disk::{check_output_folder, write_whole};
use calibench::identify::problem::Use;
use calibench::measure::campaign::CampaignObserver;
use calibench_lab::gallery::{Campaign, gallery, of_scenario};
use calibench_report::{GALLERY_MARK, Gallery};

use crate::arguments::choices::seed;
use crate::arguments::data::{dataset, model_of, read_datasets};
use crate::arguments::data_gate::gate;
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::print;
use crate::terminal::progress::{Trials, Waiting};

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file, of which the cell is simulated; or dataset folders of one robot
    #[arg(required = true, value_name = "SCENARIO|DATASET", value_parser = dataset())]
    sources: Vec<PathBuf>,
    /// Output folder for pages (Markdown) and pictures (SVG); an existing gallery is replaced
    #[arg(short, long, visible_alias = "out")]
    output: PathBuf,
    /// Model file, for datasets; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long)]
    model: Option<PathBuf>,
    /// Show only the family of this effect; repeat for several
    #[arg(long = "effect", value_name = "ID")]
    effects: Vec<String>,
    /// Seed of the noise; that of the scenario unless stated
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Continue with data that do not fit the robot
    #[arg(long)]
    force: bool,
}

/// Nobody watches the simulated campaign.
struct Unwatched;

impl CampaignObserver for Unwatched {}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_output_folder(&arguments.output, "gallery", GALLERY_MARK)?;
    if let Some(id) = arguments.effects.iter().find(|id| Registry::catalogue().family(id).is_none()) {
        return Err(format!("--effect {id}: is not an effect of the catalogue; `calibench effects` lists it").into());
    }
    let waiting = Waiting::new("measuring");
    let (campaigns, seed) = campaigns(arguments)?;
    drop(waiting);
    let bar = Trials::new(if arguments.effects.is_empty() { CATALOGUE.len() } else { arguments.effects.len() });
    let (entries, untestable) = gallery(&campaigns, &arguments.effects, seed, &|| bar.done())?;
    drop(bar);
    let names: Vec<String> = arguments.sources.iter().map(|p| p.display().to_string()).collect();
    let whole = Gallery {
        campaign: match &campaigns[..] {
            [only] => only.words.clone(),
            _ => format!("the simulated cell of `{}`", names.join(" ")),
        },
        command: format!("calibench effects gallery {} -o {}", names.join(" "), arguments.output.display()),
        entries,
        untestable,
    };
    write(&whole, &arguments.output)?;
    let lacking = match whole.untestable.len() {
        0 => String::new(),
        n => format!("; {n} that these data cannot show are listed at the end of the index"),
    };
    print(format!(
        "{} effects drawn{lacking}\nWritten to {}; begin with {}",
        whole.entries.len(),
        arguments.output.display(),
        arguments.output.join("README.md").display()
    ))?;
    Ok(Outcome::Done)
}

/// The campaigns into which effects are injected, and the seed of their noise.
fn campaigns(arguments: &Arguments) -> Result<(Vec<Campaign>, u64), Failure> {
    let is_scenario = |path: &PathBuf| path.extension().is_some_and(|e| e == "toml");
    match &arguments.sources[..] {
        [path] if is_scenario(path) => {
            if arguments.model.is_some() {
                return Err("--model is for datasets: a scenario has its own".into());
            }
            let scenario = read_scenario(path)?;
            scenario.expect_trical("effects gallery")?;
            let seed = arguments.seed.unwrap_or(scenario.seed);
            Ok((of_scenario(&scenario, seed, &mut Unwatched).map_err(|e| scenario.locate(&e))?, seed))
        }
        sources if sources.iter().any(is_scenario) => {
            Err("give one scenario file, or dataset folders, and not both: the effects are injected into one robot".into())
        }
        folders => {
            let datasets = read_datasets(folders)?;
            let model = model_of(arguments.model.as_deref(), folders, &datasets)?;
            gate(&datasets, Use::Fit, arguments.force, false)?.tell()?;
            let count = datasets.iter().flat_map(|(_, d)| &d.samples).filter(|s| Use::Fit.takes(s)).count();
            let words = format!("{}, {count} samples", datasets[0].1.robot.name);
            Ok((vec![Campaign { words, datasets, model }], arguments.seed.unwrap_or(1)))
        }
    }
}

/// Writes the gallery, all or none; pages and pictures of an earlier one are replaced.
fn write(whole: &Gallery, folder: &Path) -> Result<(), Failure> {
    let ends = [".md", ".svg", "-beside.svg"];
    let all = CATALOGUE.iter().flat_map(|f| ends.map(|end| format!("{}{end}", f.id)));
    let names: Vec<String> = [GALLERY_MARK.to_owned(), "README.md".to_owned()].into_iter().chain(all).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    replace_folder(folder, "gallery", &names, |inside| {
        whole.files().iter().try_for_each(|(name, content)| write_whole(&inside.join(name), content.as_bytes()))
    })?;
    Ok(())
}
