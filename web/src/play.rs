//! A simulated robot with an error that the visitor chooses: measured by the simulated cell, as `measure SCENARIO` does, and opened
//! like any other dataset.

use std::path::{Path, PathBuf};

use calibench::effects::registry::Registry;
use calibench::effects::{Effect, EffectId, Subject, build};
use calibench::files::disk::write_whole;
use calibench::files::{read_text, with_reasons};
use calibench::measure::campaign::CampaignObserver;
use calibench::measure::centring::Probing;
use calibench::measure::dataset::file::{read_dataset, write_dataset};
use calibench::measure::dataset::{Dataset, Sample};
use calibench::measure::poses::PlannedPose;
use calibench::robot::{BUILT_IN, built_in};
use calibench_sim::planning::plan;
use calibench_sim::plans::session_s;
use calibench_sim::random::Streams;
use calibench_sim::scenario::{load_scenario, written_sizes};
use calibench_sim::session::Session;
use calibench_workbench::Place;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::host::Host;
use crate::opening::{NotOpened, Opened, Opening, SAVED, open_datasets};

/// The cell that is measured, and what it extends.
const SCENARIOS: [(&str, &str); 2] = [
    ("table8.toml", include_str!("../../scenarios/table8.toml")),
    ("kr6-trical.toml", include_str!("../../scenarios/kr6-trical.toml")),
];

/// File of the scenario of the simulated robot.
const SCENARIO: &str = "simulated.toml";

/// Folder of its dataset.
const DATASET: &str = "simulated";

/// Effects that can be hidden, each clearly distinguished from the others: gears, bearings, springs, the foot, the artifact.
const HIDDEN: [(&str, &str); 10] = [
    (EffectId::HARMONIC, ":3:202"),
    (EffectId::HARMONIC_1, ":2"),
    (EffectId::HARMONIC_2, ":4"),
    (EffectId::GRAVITY_BACKLASH, ":2"),
    (EffectId::STIFFENING, ":2"),
    (EffectId::BEARING_TILT, ":3"),
    (EffectId::PEDESTAL, ""),
    (EffectId::BALL, ":3"),
    (EffectId::JOINT_SCALE, ":2"),
    (EffectId::PAYLOAD_MASS, ":heavy"),
];

/// Sizes, in plausible ones.
const SIZES: [f64; 3] = [2.0, 5.0, 10.0];

/// A robot to be simulated.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlayRequest {
    /// The hidden effect; `None` if the robot has only the errors of every robot.
    pub effect: Option<String>,
    /// Its size, in plausible ones.
    pub times: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// The built-in robots, and what a simulated one can hide.
#[must_use]
pub fn hidden_choices() -> Value {
    let robots = BUILT_IN.iter().filter_map(|name| built_in(name)).map(|r| json!({"name": r.name, "joints": r.joints()}));
    let catalogue = Registry::catalogue();
    let hidden = HIDDEN.iter().map(|(family, arguments)| {
        let id = format!("{family}{arguments}");
        let physics = catalogue.family(&id).map(|f| f.meaning.physics);
        json!({"effect": id, "words": catalogue.in_words(&id), "physics": physics})
    });
    json!({"robots": robots.collect::<Vec<_>>(), "hidden": hidden.collect::<Vec<_>>(), "sizes": SIZES})
}

/// Measures a simulated robot, and opens the measurements.
///
/// # Errors
/// If there is no such effect, or the cell cannot be measured.
pub fn play(request: &PlayRequest, host: Host) -> Result<Opened, NotOpened> {
    for (name, text) in SCENARIOS {
        write_whole(Path::new(name), text.as_bytes())?;
    }
    let scenario = scenario_of(request)?;
    write_whole(Path::new(SCENARIO), scenario.as_bytes())?;
    let scenario = load_scenario(Path::new(SCENARIO))?;
    host.tell("Planning 80 probings …");
    let planned = plan(&scenario, scenario.seed).map_err(|e| failed(&scenario.locate_plan(&e)))?.probing;
    let streams = Streams { seed: scenario.seed, trial: 0 };
    let session = Session::begin(&scenario, streams, session_s(&scenario, &planned.poses, 0)).map_err(|e| failed(&e))?;
    let wanted = planned.wanted();
    let record = session.probe(&planned, None, &mut Counted { host, wanted, done: 0 });
    if let Some(aborted) = &record.aborted {
        return Err(failed(aborted));
    }
    let cell = scenario.dataset();
    let contact_force = scenario.indicators.contact_force();
    write_dataset(&Dataset { contact_force, samples: record.samples, ..cell }, Path::new(DATASET))?;
    // As whoever opens the folder reads it.
    let folder = PathBuf::from(DATASET);
    let dataset = read_dataset(&folder)?;
    let hidden = request.effect.as_deref().map(|id| Registry::catalogue().in_words(id));
    let mut told = json!({"hidden": hidden, "effect": request.effect, "times": request.times, "scenario": read_text(Path::new(SCENARIO))?});
    let place = Place::new(SAVED.into(), None);
    open_datasets(&[folder], vec![(DATASET.into(), dataset)], None, place, Opening { force: false, host }, &mut told)
}

fn failed(error: &dyn std::error::Error) -> NotOpened {
    NotOpened::Simulation(with_reasons(error))
}

/// The scenario of a robot with the errors of the paper and the effect that is hidden in it.
fn scenario_of(request: &PlayRequest) -> Result<String, NotOpened> {
    let mut text = format!(
        "format = \"calibench-scenario/1\"\nextends = \"{}\"\nname = \"simulated\"\nquestion = \"What is wrong with this robot?\"\nseed = {}\n",
        SCENARIOS[0].0, request.seed
    );
    let Some(id) = &request.effect else { return Ok(text) };
    let cell = load_scenario(Path::new(SCENARIOS[0].0))?.dataset();
    let balls = cell.ball_ids();
    let effect = build(id, &Subject::new(&cell.robot, &balls)).map_err(|e| failed(&e))?;
    text.push_str(&format!("\n[truth.effects.\"{id}\"]\n"));
    for (key, value) in written_sizes(effect.as_ref(), &sizes(effect.as_ref(), request.times)) {
        text.push_str(&format!("{key} = {value:?}\n"));
    }
    Ok(text)
}

/// Sizes of the parameters that are together `times` the plausible one, no two of them alike.
fn sizes(effect: &dyn Effect, times: f64) -> Vec<f64> {
    let parameters = effect.parameters();
    let weight = |k: usize| if k.is_multiple_of(2) { 0.8 } else { -0.6 };
    let length: f64 = (0..parameters.len()).map(|k| weight(k) * weight(k)).sum::<f64>().sqrt();
    parameters.iter().enumerate().map(|(k, p)| times * p.prior * weight(k) / length).collect()
}

/// Counts the probings.
struct Counted {
    host: Host,
    wanted: usize,
    done: usize,
}

impl CampaignObserver for Counted {
    fn probing_finished(&mut self, _: &PlannedPose, _: &Probing, sample: Option<&Sample>) {
        self.done += usize::from(sample.is_some());
        self.host.tell(&format!("Probing: {} of {} measured …", self.done, self.wanted));
    }
}
