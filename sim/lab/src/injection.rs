//! Detectable effects: those of the catalogue are injected, one at a time, into measurements at the user's own postures
//! and with the user's own noise, and the diagnosis looks for them.

mod measurements;
mod summary;
mod trial;

use std::collections::BTreeMap;

use calibench::diagnosis::Examination;
use calibench::diagnosis::detectability::Detectability;
use calibench::diagnosis::library::{Library, Untestable};
use calibench::effects::{EffectId, build};
use calibench::identify::Model;
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::{Use, missing};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::prediction::{WORKSPACE_POSES, WorkspacePoses};
use calibench::robot::JointKind;
use calibench::units::MM;
use calibench_sim::random::{Streams, fnv1a};
use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;

pub(crate) use measurements::measured_by;
pub use summary::{FamilyRow, Injections};
pub use trial::{Injected, InjectedParameter};

/// Part of a session in which events occur.
const DURING: std::ops::Range<f64> = 0.2..0.8;

/// Orders of a ripple whose gear ratio is unknown, per turn.
const ORDERS: std::ops::RangeInclusive<u32> = 3..=140;

/// The noise that injected measurements are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseChoice {
    /// The instrument's, stated or from repeats: what can be seen once everything else is modelled. If it is unknown, the
    /// residual of the fit.
    Instrument,
    /// As large as the residual of the fit: what can be seen beside everything that the model lacks today.
    Residual,
}

/// The noise that was used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InjectedNoise {
    /// `stated`, `replicates` or `residual`.
    pub source: &'static str,
    /// Root mean square of the 3-D error that it causes, mm.
    pub rms_mm: f64,
    /// Residual of the fit of the measured data, rms, mm.
    pub residual_mm: f64,
    /// Its ratio to the noise by which the samples are weighted.
    #[serde(skip)]
    factor: f64,
}

impl InjectedNoise {
    /// The noise of measured data, all of them: fewer may have no repeats.
    ///
    /// # Errors
    /// When the data do not fit the model, or do not determine the unknowns.
    pub fn of(datasets: &[NamedDataset<'_>], model: &Model, choice: NoiseChoice) -> Result<Self, IdentifyError> {
        let examination = Examination::new(datasets, model)?;
        let (floor, fit) = (examination.noise(), examination.fit());
        let residual_mm = fit.rms / MM;
        let larger = floor.larger_than_stated().unwrap_or(1.0);
        Ok(match floor.level.filter(|_| choice == NoiseChoice::Instrument) {
            Some(level) => InjectedNoise {
                source: floor.source.name(),
                rms_mm: level.rms * larger / MM,
                residual_mm,
                factor: level.relative * larger,
            },
            None => {
                let factor = (fit.chi2 / fit.dof.max(1) as f64).sqrt();
                InjectedNoise { source: "residual", rms_mm: residual_mm, residual_mm, factor }
            }
        })
    }
}

/// The data, and the robot as calibrated from them.
pub struct Subject<'a> {
    datasets: &'a [NamedDataset<'a>],
    model: Model,
    baseline: Calibration,
    noise: InjectedNoise,
    /// Joint angles at which errors are judged, rad.
    poses: Vec<Vec<f64>>,
    /// True if nothing measured is known in the world, so that base and tool are re-fitted wherever a robot is judged.
    anew: bool,
    /// Smallest detectable size of each effect, in plausible sizes.
    smallest: BTreeMap<String, Option<f64>>,
    effects: Vec<String>,
    untestable: Vec<Untestable>,
}

impl<'a> Subject<'a> {
    /// Calibrates the robot from the rows of set `fit`, and lists the effects that these can test.
    ///
    /// # Errors
    /// When the data do not fit the model, or do not determine the unknowns.
    pub fn new(
        datasets: &'a [NamedDataset<'a>],
        model: &Model,
        noise: InjectedNoise,
        seed: u64,
    ) -> Result<Self, IdentifyError> {
        let examination = Examination::new(datasets, model)?;
        let model = examination.model().clone();
        let library = Library::new(datasets, &model);
        let sights = Detectability::of(&examination).sights;
        let all = WorkspacePoses::of(datasets).q;
        let spread = all.len().div_ceil(WORKSPACE_POSES).max(1);
        Ok(Subject {
            datasets,
            baseline: examination.calibration(datasets),
            noise,
            poses: all.into_iter().step_by(spread).collect(),
            anew: examination.problem().parameters().iter().any(|p| p.defines_world),
            smallest: sights.into_iter().map(|s| (s.effect.into(), s.smallest)).collect(),
            effects: effects_of(datasets, &model, &library, seed),
            untestable: library.untestable,
            model,
        })
    }

    /// The effects that will be injected.
    pub fn effects(&self) -> &[String] {
        &self.effects
    }

    /// Keeps only the effects that these names name: ids, or families. Returns the first name that names none.
    ///
    /// # Errors
    /// The name.
    pub fn only<'n>(&mut self, names: &'n [String]) -> Result<(), &'n str> {
        let is = |id: &str, name: &String| id == name || EffectId::new(id).family() == name;
        if let Some(name) = names.iter().find(|name| !self.effects.iter().any(|id| is(id, name))) {
            return Err(name);
        }
        self.effects.retain(|id| names.is_empty() || names.iter().any(|name| is(id, name)));
        Ok(())
    }

    /// Injects every effect once, and nothing in `nothing` further trials; `done` is called after each.
    ///
    /// # Errors
    /// The first error of a trial, in their order.
    pub fn run(&self, nothing: usize, seed: u64, done: &(dyn Fn() + Sync)) -> Result<Injections, IdentifyError> {
        // An effect has its own draws, whatever else is injected.
        let effects = self.effects.iter().map(|e| (fnv1a(e.as_bytes()), Some(e.as_str())));
        let trials: Vec<(u64, Option<&str>)> = effects.chain((0..nothing as u64).map(|k| (k, None))).collect();
        let one = |(trial, effect): &(u64, Option<&str>)| {
            let source = if effect.is_some() { "injection" } else { "no injection" };
            let trial = self.trial(*effect, &mut Streams { seed, trial: *trial }.stream(source));
            done();
            trial
        };
        let trials: Vec<Injected> = trials.par_iter().map(one).collect::<Result<_, _>>()?;
        Ok(Injections::of(self, trials))
    }
}

/// The members of the catalogue that these data can test, those to be scanned at an order or moment sampled for each.
fn effects_of(datasets: &[NamedDataset<'_>], model: &Model, library: &Library, seed: u64) -> Vec<String> {
    let ids: Vec<&EffectId> = library.candidates.iter().map(|c| &c.id).collect();
    // A family as a whole is the sum of its members.
    let has_members = |id: &str| ids.iter().any(|other| other.starts_with(&format!("{id}:")));
    let mut effects: Vec<String> = ids.iter().filter(|id| !has_members(id)).map(|id| id.to_string()).collect();
    let first = datasets[0].dataset;
    let joints = (1..=first.robot.joints()).filter(|j| first.robot.kind(j - 1) == JointKind::Revolute);
    let mut random = Streams { seed, trial: 0 }.stream("places of injections");
    let mut scanned: Vec<String> =
        joints.clone().map(|j| format!("{}:{j}:{}", EffectId::HARMONIC, random.random_range(ORDERS))).collect();
    let times = |d: &Dataset| d.samples.iter().filter(|s| Use::Fit.takes(s)).filter_map(|s| s.time_s).reduce(f64::max);
    if let Some(duration) = datasets.iter().filter_map(|d| times(d.dataset)).reduce(f64::min) {
        let mut moment = || format!("{:.1}", duration * random.random_range(DURING));
        scanned.extend([EffectId::BASE_STEP, EffectId::TOOL_STEP].map(|family| format!("{family}:{}", moment())));
        scanned.extend(joints.map(|j| format!("{}:{j}:{}", EffectId::JOINT_STEP, moment())));
    }
    let balls = first.ball_ids();
    let subject = model.subject(&first.robot, &balls);
    let testable = |id: &String| {
        let effect = build(id, &subject);
        effect.is_ok_and(|e| datasets.iter().all(|d| missing(e.as_ref(), d.dataset, model, Use::Fit).is_none()))
    };
    effects.extend(scanned.into_iter().filter(|id| !model.holds(id) && testable(id)));
    effects.sort_by_key(|id| model.registry.families().position(|f| f.id == EffectId::new(id).family()));
    effects
}
