//! The truth of a scenario, prepared for the plant: effects of the catalogue and of the user at their sizes, and true payloads.

use std::collections::BTreeMap;
use std::sync::Arc;

use calibench::effects;
use calibench::effects::facts::{Follows, Stray};
use calibench::effects::family::Family;
use calibench::effects::own::OwnEffect;
use calibench::effects::{Effect, EffectId, Subject};
use calibench::files::FileError;
use calibench::measure::dataset::Dataset;
use calibench::robot::statics::Payload;
use calibench::units::MM;
use nalgebra::Vector3;
use rand::RngExt;
use rand_distr::StandardNormal;

use super::sources::Sources;
use super::truth_keys::TruthToml;
use crate::effect_names::family_of;
use crate::flaw::{Flaw, Flaws, TrueEffect};
use crate::mismatch::misshapen;
use crate::random::Streams;
use crate::tilt::Tilt;

/// The ground truth.
#[derive(Clone)]
pub struct Truth {
    keys: TruthToml,
    effects: Vec<StatedEffect>,
    hidden: Vec<Arc<dyn Flaw>>,
    tilt: Option<Arc<Tilt>>,
}

/// An effect of the catalogue, or of the user, with its sizes as stated by the scenario.
#[derive(Clone)]
pub struct StatedEffect {
    effect: Arc<dyn Effect>,
    /// Its family; `None` for one of the user.
    family: Option<&'static Family>,
    /// Size by parameter, SI; `None` if it is sampled.
    sizes: Vec<Option<f64>>,
    /// One-sigma of the sampled sizes, in units of the plausible size.
    scale: f64,
}

impl StatedEffect {
    /// The effect.
    pub fn effect(&self) -> &dyn Effect {
        self.effect.as_ref()
    }

    /// Names of its parameters with their stated sizes (SI); `None` for a size that is sampled.
    pub fn parameters(&self) -> impl Iterator<Item = (&str, Option<f64>)> {
        self.effect.parameters().iter().map(|p| p.name.as_str()).zip(self.sizes.iter().copied())
    }

    /// The effect at its true sizes; `normal(one-sigma)` supplies the sampled ones, in the order of the parameters.
    pub fn drawn(&self, normal: &mut dyn FnMut(f64) -> f64) -> TrueEffect {
        let priors = self.effect.parameters().iter().map(|p| p.prior);
        let sizes =
            self.sizes.iter().zip(priors).map(|(size, prior)| size.unwrap_or_else(|| normal(self.scale * prior))).collect();
        TrueEffect { effect: self.effect.clone(), sizes }
    }
}

impl Truth {
    /// Builds the truth from its keys; `own` are the effects defined by the scenario's `[[effect]]` tables.
    pub(super) fn of(keys: TruthToml, cell: &Dataset, own: &[OwnEffect], sources: &Sources) -> Result<Self, FileError> {
        let n = cell.robot.joints();
        if !keys.link_mass_error.is_empty() && keys.link_mass_error.len() != n {
            let remedy = format!("give one number for each of the {n} links");
            return Err(sources.wrong("truth.link_mass_error", "has the wrong length", remedy));
        }
        if let Some(k) = keys.link_mass_error.iter().position(|&e| e <= -1.0) {
            let key = format!("truth.link_mass_error[{k}]");
            return Err(sources.wrong(&key, "leaves the link no mass", "give true mass over nominal mass, minus one"));
        }
        if !(0.0..=1.0).contains(&keys.mismatch) {
            let problem = format!("is {}", keys.mismatch);
            return Err(sources.wrong("truth.mismatch", problem, "give a number from 0 (the catalogue's shapes) to 1"));
        }
        for (name, error) in &keys.payload {
            let key = format!("truth.payload.{name}");
            let Some(payload) = cell.payloads.iter().find(|p| p.name == *name) else {
                let known: Vec<&str> = cell.payloads.iter().map(|p| p.name.as_str()).collect();
                return Err(sources.wrong(&key, "is not a payload", format!("name one of: {}", known.join(", "))));
            };
            if payload.mass + error.mass_error_kg < 0.0 {
                let key = format!("{key}.mass_error_kg");
                return Err(sources.wrong(&key, "leaves the payload no mass", "give true mass minus entered mass"));
            }
        }
        let balls = cell.ball_ids();
        let subject = Subject { own, ..Subject::new(&cell.robot, &balls) };
        let effects =
            keys.effects.iter().map(|(id, given)| stated(id, given, &subject, sources)).collect::<Result<Vec<_>, _>>()?;
        let hidden = keys
            .hidden
            .flaws(cell)
            .map_err(|misfit| sources.wrong(&format!("truth.hidden.{}", misfit.key), misfit.problem, misfit.remedy))?;
        keys.mujoco
            .check(&stated_compliance(&effects, n))
            .map_err(|unfit| sources.wrong(&format!("truth.mujoco.{}", unfit.key), unfit.problem, unfit.remedy))?;
        Ok(Truth { keys, effects, hidden, tilt: None })
    }

    /// The keys from which it was built.
    pub fn keys(&self) -> &TruthToml {
        &self.keys
    }

    /// Effects of the catalogue and the user.
    pub fn effects(&self) -> &[StatedEffect] {
        &self.effects
    }

    /// Effects of the catalogue in one trial, their sizes sampled from its stream `effects`.
    pub fn drawn(&self, streams: &Streams) -> Vec<TrueEffect> {
        let mut errors = self.drawn_errors(streams).into_iter();
        self.effects.iter().map(|stated| stated.drawn(&mut |sigma| sigma * errors.next().unwrap_or(0.0))).collect()
    }

    /// Number of sizes that are sampled.
    pub fn drawn_count(&self) -> usize {
        self.effects.iter().flat_map(StatedEffect::parameters).filter(|(_, size)| size.is_none()).count()
    }

    /// The sampled sizes of one trial in units of their one-sigma.
    fn drawn_errors(&self, streams: &Streams) -> Vec<f64> {
        let mut random = streams.stream("effects");
        let standard = (0..self.drawn_count()).map(|_| random.sample(StandardNormal)).collect();
        match &self.tilt {
            Some(tilt) => tilt.drawn(standard, streams),
            None => standard,
        }
    }

    /// Importance weight of a trial: density of the robot as the effects state it, over that from which it was sampled; `None`
    /// if both are the same.
    pub fn weight(&self, streams: &Streams) -> Option<f64> {
        self.tilt.as_ref().map(|tilt| tilt.weight(&self.drawn_errors(streams)))
    }

    /// The same truth with its sizes sampled by `tilt`, which has as many.
    pub(super) fn tilted(&self, tilt: Tilt) -> Truth {
        Truth { tilt: Some(Arc::new(tilt)), ..self.clone() }
    }

    /// All flaws of one trial for an arm with this number of joints, sizes and shapes sampled from its streams `effects`
    /// and `shapes`.
    pub fn flaws(&self, streams: &Streams, joints: usize) -> Flaws {
        let mut shapes = streams.stream("shapes");
        let mut flaws = Flaws { all: self.hidden.clone(), ..Flaws::none(joints) };
        for (effect, stated) in self.drawn(streams).into_iter().zip(&self.effects) {
            let family = stated.family.map(|family| family.id);
            for (parameter, size) in effect.effect.parameters().iter().zip(&effect.sizes) {
                let named = |names: &dyn Fn(usize) -> String, count: usize| (1..=count).find(|&k| parameter.name == names(k));
                match family {
                    Some(EffectId::JOINT_COMPLIANCE) => {
                        named(&|j| format!("c{j}"), joints).into_iter().for_each(|j| flaws.compliance[j - 1] += size);
                    }
                    Some(EffectId::HYSTERESIS) => {
                        named(&|j| format!("{}:{j}.h", EffectId::HYSTERESIS), joints)
                            .into_iter()
                            .for_each(|j| flaws.hysteresis[j - 1] += size);
                    }
                    Some(EffectId::STICTION) => {
                        named(&|i| format!("{}.{i}", EffectId::STICTION), 3)
                            .into_iter()
                            .for_each(|i| flaws.stiction[i - 1] += size);
                    }
                    _ => {}
                }
            }
            // Flaws with a Dahl friction state are kept apart from effects that take the sign of the last motion.
            let stray = stated.family.map_or(Stray::None, |family| family.stray);
            let flaw = Arc::from(misshapen(effect, stray, self.keys.mismatch, &mut shapes));
            if !matches!(family, Some(EffectId::HYSTERESIS | EffectId::STICTION)) {
                flaws.all.push(flaw);
            }
        }
        flaws
    }

    /// True load on the flange when the payload `entered` is mounted.
    pub fn payload(&self, entered: &Payload) -> Payload {
        match self.keys.payload.get(&entered.name) {
            Some(error) => Payload {
                name: entered.name.clone(),
                mass: entered.mass + error.mass_error_kg,
                com: entered.com + Vector3::from(error.com_error_mm) * MM,
            },
            None => entered.clone(),
        }
    }
}

/// Compliance of each gear as stated, rad/(N·m); a sampled one counts as non-zero.
fn stated_compliance(effects: &[StatedEffect], joints: usize) -> Vec<f64> {
    let mut compliance = vec![0.0; joints];
    for (name, size) in effects.iter().flat_map(StatedEffect::parameters) {
        if let Some(joint) = (0..joints).find(|j| name == format!("c{}", j + 1)) {
            compliance[joint] += size.unwrap_or(f64::MIN_POSITIVE);
        }
    }
    compliance
}

/// An effect with the sizes `given` under their keys.
fn stated(
    id: &str,
    given: &BTreeMap<String, f64>,
    subject: &Subject<'_>,
    sources: &Sources,
) -> Result<StatedEffect, FileError> {
    let key = format!("truth.effects.{id}");
    let effect = effects::build(id, subject).map_err(|e| {
        let remedy = "correct its name, or define it in a [[model.effect]] table with `candidate = true`";
        sources.wrong(&key, e.to_string(), remedy)
    })?;
    let family = subject.registry.family(id);
    if family.is_some_and(|f| f.follows.contains(&Follows::LastMove)) {
        return Err(sources.wrong(
            &key,
            "depends on the move before, which leaves nothing in the simulated arm",
            "leave it out",
        ));
    }
    let keys: Vec<String> = effect.parameters().iter().map(|p| parameter_key(id, &p.name, p.unit.suffix)).collect();
    if let Some(unknown) = given.keys().find(|g| *g != "draw" && !keys.contains(g)) {
        let remedy = format!("its parameters are: {}, or draw", keys.join(", "));
        return Err(sources.wrong(&format!("{key}.{unknown}"), "is not a parameter of this effect", remedy));
    }
    let scale = given.get("draw").copied();
    let rest = if scale.is_some() { None } else { Some(0.0) };
    let size = |(key, spec): (&String, &effects::ParameterSpec)| given.get(key).map(|v| spec.unit.to_si(*v)).or(rest);
    let sizes = keys.iter().zip(effect.parameters()).map(size).collect();
    Ok(StatedEffect { effect: effect.into(), family, sizes, scale: scale.unwrap_or(0.0) })
}

/// Key of a parameter in `[truth.effects.ID]`: its name without the part given by the id, and its unit.
pub fn parameter_key(id: &str, name: &str, suffix: &str) -> String {
    let family = family_of(id);
    let own = name
        .strip_prefix(&format!("{id}."))
        .or_else(|| name.strip_prefix(&format!("{family}:")))
        .or_else(|| name.strip_prefix(&format!("{family}.")))
        .unwrap_or(name);
    format!("{own}_{suffix}")
}

/// The sizes (SI, one per parameter) of an effect as keys under `[truth.effects.ID]`.
pub fn written_sizes(effect: &dyn Effect, sizes: &[f64]) -> BTreeMap<String, f64> {
    let key = |p: &effects::ParameterSpec| parameter_key(effect.id(), &p.name, p.unit.suffix);
    effect.parameters().iter().zip(sizes).map(|(p, size)| (key(p), p.unit.from_si(*size))).collect()
}
