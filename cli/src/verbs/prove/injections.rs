//! Detectable effects: every effect of the catalogue is injected into the data and looked for.

use calibench::files::disk::write_whole;
use calibench::identify::problem::Use;
use calibench_lab::injection::{InjectedNoise, Subject};
use serde_json::{Value, json};

use super::{Arguments, thin};
use crate::arguments::data::{locate_in_data, model_of, named, read_datasets};
use crate::arguments::data_gate::gate;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_json, print_written};
use crate::terminal::progress::{Trials, Waiting};
use calibench_lab::injections_text::{markdown, page, sentences, text};

/// Number of fitted rows used of each dataset if not stated: a minute's work.
const AT_MOST: usize = 2000;

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let locate = |e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let waiting = Waiting::new("fitting the model");
    let noise = InjectedNoise::of(&named(&datasets), &model, arguments.noise.into()).map_err(locate)?;
    let mut used = datasets.clone();
    used.iter_mut().for_each(|(_, d)| thin(d, arguments.at_most.unwrap_or(AT_MOST), Use::Fit));
    let rows = [&used, &datasets].map(|data| data.iter().flat_map(|(_, d)| &d.samples).filter(|s| Use::Fit.takes(s)).count());
    let named = named(&used);
    let mut subject = Subject::new(&named, &model, noise, arguments.seed).map_err(locate)?;
    subject.only(&arguments.effects).map_err(|name| {
        format!(
            "--effect {name}: is not an effect that these data can test in addition to the model; `calibench effects` lists the catalogue"
        )
    })?;
    drop(waiting);
    let bar = Trials::new(subject.effects().len() + arguments.nothing);
    let found = subject.run(arguments.nothing, arguments.seed, &|| bar.done()).map_err(locate)?;
    drop(bar);
    let mut document = serde_json::to_value(&found)?;
    if let Value::Object(keys) = &mut document {
        keys.insert("format".into(), json!("calibench-injections/1"));
        keys.insert("rows".into(), json!({"used": rows[0], "of": rows[1]}));
        keys.insert("seed".into(), json!(arguments.seed));
    }
    if let Some(path) = &arguments.output {
        let is_page = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("html"));
        let whole = if is_page { page(&found, rows) } else { markdown(&found, rows) };
        write_whole(path, whole.as_bytes())?;
        print_written(path);
    }
    if arguments.json {
        print_json(&document)?;
    } else {
        gate.tell()?;
        print_answer(format!("{}\n", sentences(&found, rows).join("\n")))?;
        print(text(&found))?;
    }
    Ok(Outcome::Done)
}
