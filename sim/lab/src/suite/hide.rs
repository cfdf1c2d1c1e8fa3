//! Draws the hidden effects of a trial, and disturbs the measurements.

use calibench::diagnosis::library::Library;
use calibench::effects;
use calibench::effects::catalogue::set_aside_by;
use calibench::effects::catalogue::setting_aside;
use calibench::effects::facts::Role;
use calibench::effects::family::Scan;
use calibench::effects::registry::Registry;
use calibench::effects::{EffectError, Subject};
use calibench::measure::dataset::{Dataset, Measured, Noise};
use calibench::units::{DEG, MM};
use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use thiserror::Error;
use toml::{Table, Value};

use super::{Case, Condition, Kind};
use calibench_sim::effect_names::joint_of;
use calibench_sim::hidden::{HiddenToml, MovedBall};
use calibench_sim::plans::Plans;
use calibench_sim::scenario::{Scenario, TruthToml, written_sizes};

/// Rms over the workspace of an unknown flaw of one plausible size: typical of a joint error of unknown origin.
const UNKNOWN_RMS_URAD: f64 = 60.0;

/// Approximate duration of a probing in the simulated cell, s: only used to draw moments within the session.
const PROBING_S: f64 = 12.5;

/// Part of the session in which events occur.
const DURING: std::ops::Range<f64> = 0.2..0.8;

/// The reason why something cannot be hidden.
#[derive(Debug, Error)]
pub enum HideError {
    /// An effect does not fit the robot.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// There is no such flaw, or a key is wrong.
    #[error("flaw '{flaw}' cannot be hidden: {problem}")]
    Flaw {
        /// Its table under `[truth.hidden]`.
        flaw: String,
        /// The problem.
        problem: toml::de::Error,
    },
}

/// A hidden effect: its id and its true values, SI.
pub(super) type Effect = (String, Vec<f64>);

/// The hidden effects of one trial.
pub(super) struct Hidden {
    /// Effects of the catalogue.
    pub effects: Vec<Effect>,
    /// Flaws outside the catalogue.
    pub flaws: HiddenToml,
    /// `nothing`, `one`, `two`, `clutter`, `dense`, `unknown`, `outliers` or `moved_ball`.
    pub kind: &'static str,
    /// Size, in plausible sizes; for outliers and moved balls in mm.
    pub size: f64,
}

impl Hidden {
    fn of(effects: Vec<Effect>, kind: &'static str, size: f64) -> Self {
        Hidden { effects, flaws: HiddenToml::default(), kind, size }
    }

    /// The joints in error, from 1.
    pub fn joints(&self) -> Vec<usize> {
        let by_name = self.effects.iter().filter_map(|(id, _)| joint_of(id));
        by_name.chain(self.flaws.joints()).collect()
    }

    /// Their ids, separated by spaces; `everything` for more than two effects.
    pub fn names(&self) -> String {
        if self.effects.len() > 2 {
            return "everything".into();
        }
        let flaws = self.flaws.listed().into_iter().map(|f| f.name.to_owned());
        self.effects.iter().map(|(id, _)| id.clone()).chain(flaws).collect::<Vec<_>>().join(" ")
    }

    /// The ground truth of a cell with these effects hidden in it.
    ///
    /// # Errors
    /// If an effect does not fit the robot.
    pub fn truth(&self, scenario: &Scenario) -> Result<TruthToml, HideError> {
        let cell = scenario.dataset();
        let balls = cell.ball_ids();
        let subject = Subject { own: &scenario.model.own, ..Subject::new(&cell.robot, &balls) };
        let mut keys = scenario.truth().keys().clone();
        for (id, sizes) in self.effects.iter().filter(|(id, _)| set_aside_by(id).is_none()) {
            let effect = effects::build(id, &subject)?;
            keys.effects.entry(id.clone()).or_default().extend(written_sizes(effect.as_ref(), sizes));
        }
        if self.flaws != HiddenToml::default() {
            keys.hidden = self.flaws.clone();
        }
        Ok(keys)
    }
}

/// Draws the effects and their sizes.
///
/// # Errors
/// If an effect does not fit the robot, or if a flaw has wrong keys.
pub(super) fn hide(case: &Case, scenario: &Scenario, plans: &Plans, random: &mut ChaCha8Rng) -> Result<Hidden, HideError> {
    let cell = scenario.dataset();
    let balls = cell.ball_ids();
    let subject = Subject { own: &scenario.model.own, ..Subject::new(&cell.robot, &balls) };
    let priors = |id: &str| -> Result<Vec<f64>, EffectError> {
        Ok(effects::build(id, &subject)?.parameters().iter().map(|p| p.prior).collect())
    };
    // What an ordinary robot has of everything: a loose tool or a bump is there or is not.
    let is_ordinary = |id: &String| scenario.model.family(id).is_none_or(|f| f.role != Role::Event);
    let all = || {
        let candidates = Library::of_robot(&cell, &scenario.model).candidates.into_iter();
        candidates.map(|c| String::from(c.id)).filter(is_ordinary)
    };
    Ok(match &case.kind {
        Kind::Nothing => Hidden::of(Vec::new(), "nothing", 0.0),
        Kind::Unknown { flaw, size } => {
            let flaws = unknown_flaw(flaw, size * UNKNOWN_RMS_URAD, random)?;
            Hidden { flaws, ..Hidden::of(Vec::new(), "unknown", *size) }
        }
        Kind::Effects { ids, size } => {
            let hidden = ids.iter().map(|id| {
                let id = placed(id, plans, random);
                let sizes = unit_rms(&priors(&id)?, random).map(|s| s * size).collect();
                Ok((id, sizes))
            });
            Hidden::of(hidden.collect::<Result<_, EffectError>>()?, if ids.len() == 1 { "one" } else { "two" }, *size)
        }
        Kind::Clutter { size } => {
            let drawn = |id: String| {
                let sizes = priors(&id)?.iter().map(|p| size * p * normal(random)).collect();
                Ok((id, sizes))
            };
            Hidden::of(all().map(drawn).collect::<Result<_, EffectError>>()?, "clutter", *size)
        }
        Kind::Dense => {
            let drawn = |id: String| {
                let size = 0.5 * normal(random).exp();
                let sizes = priors(&id)?.iter().map(|p| size * p * normal(random)).collect();
                Ok((id, sizes))
            };
            Hidden::of(all().map(drawn).collect::<Result<_, EffectError>>()?, "dense", 1.0)
        }
        Kind::Outliers { count, mm } => Hidden::of(outliers(*count, *mm, plans, random), "outliers", *mm),
        Kind::MovedBall { mm } => {
            let ball = balls[random.random_range(0..balls.len())].clone();
            let at_share = random.random_range(DURING);
            let [x_mm, y_mm, z_mm] = (direction(random) * *mm).into();
            let moved_ball = Some(MovedBall { ball, at_share, x_mm, y_mm, z_mm });
            let flaws = HiddenToml { moved_ball, ..HiddenToml::default() };
            Hidden { flaws, ..Hidden::of(Vec::new(), "moved_ball", *mm) }
        }
    })
}

/// A flaw outside the catalogue with this size. The joint in error, and the kind of error, vary from trial to trial.
///
/// # Errors
/// If there is no such flaw, or if it has no such key.
fn unknown_flaw(flaw: &str, rms_urad: f64, random: &mut ChaCha8Rng) -> Result<HiddenToml, HideError> {
    let mut keys = unknown_keys(flaw, random);
    keys.insert("rms_urad".into(), rms_urad.into());
    let hidden = Table::from_iter([(flaw.to_owned(), Value::Table(keys))]);
    hidden.try_into().map_err(|problem| HideError::Flaw { flaw: flaw.into(), problem })
}

/// The keys of a flaw other than its size.
fn unknown_keys(flaw: &str, random: &mut ChaCha8Rng) -> Table {
    let mut keys = Table::new();
    let mut add = |key: &str, value: Value| keys.insert(key.into(), value);
    let joint =
        |from: i64, to: i64, random: &mut ChaCha8Rng| Value::from(random.random_range(from as usize..=to as usize) as i64);
    match flaw {
        "asymmetric_tooth" => {
            add("joint", joint(1, 4, random));
            add("teeth", Value::from(random.random_range(5..=15)));
        }
        "beat" => {
            add("joint", joint(1, 4, random));
            let first: f64 = random.random_range(3.2..7.8);
            add("per_turn", Value::from(vec![first, first * random.random_range(1.05..1.25)]));
        }
        "bilinear_coupling" => drop(add("joint", joint(1, 4, random))),
        "cable_spring" => drop(add("joint", joint(4, 5, random))),
        "gear_defect" => drop(add("centre_deg", Value::from(random.random_range(45.0..90.0)))),
        "posture_spring" => {
            add("joint", joint(2, 3, random));
            add("phase_deg", Value::from(random.random_range(0.0..360.0)));
        }
        "smooth_field" => {
            add("joint", joint(1, 4, random));
            add("seed", Value::from(random.random_range(0..1_000_000)));
        }
        _ => {}
    }
    keys
}

/// `count` different samples, each displaced by `mm` millimetres.
fn outliers(count: usize, mm: f64, plans: &Plans, random: &mut ChaCha8Rng) -> Vec<Effect> {
    let mut all: Vec<Effect> = Vec::new();
    while all.len() < count.min(plans.plan.wanted()) {
        let id = placed(&setting_aside("@"), plans, random);
        if all.iter().all(|(other, _)| *other != id) {
            all.push((id, (direction(random) * (mm * MM)).as_slice().to_vec()));
        }
    }
    all
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

/// A uniformly distributed direction.
fn direction(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(random)).normalize()
}

/// Random numbers of unit rms, each multiplied by its plausible size.
fn unit_rms(priors: &[f64], random: &mut ChaCha8Rng) -> impl Iterator<Item = f64> + use<> {
    let drawn: Vec<f64> = priors.iter().map(|_| normal(random)).collect();
    let rms = (drawn.iter().map(|d| d * d).sum::<f64>() / drawn.len().max(1) as f64).sqrt();
    let sizes: Vec<f64> = drawn.iter().zip(priors).map(|(d, p)| d / rms * p).collect();
    sizes.into_iter()
}

/// An id with a random order, moment or sample.
fn placed(id: &str, plans: &Plans, random: &mut ChaCha8Rng) -> String {
    let Some(stem) = id.strip_suffix('@') else { return id.to_owned() };
    let probings = plans.plan.wanted();
    match Registry::catalogue().family(stem).map(|family| family.scan) {
        Some(Scan::Order) => format!("{stem}{}", random.random_range(3..=140)),
        Some(Scan::Sample) => format!("{stem}{}", plans.plan.probing.poses[random.random_range(0..probings)].id),
        _ => {
            let session = PROBING_S * probings as f64;
            format!("{stem}{:.1}", session * random.random_range(DURING))
        }
    }
}

/// Modifies the data after the measurement: displaced samples, and the conditions of the case.
pub(super) fn disturb(data: &mut Dataset, case: &Case, hidden: &Hidden) {
    hidden.effects.iter().for_each(|(id, sizes)| put_off(data, id, sizes));
    match case.condition {
        Condition::AsStated | Condition::Robot { .. } => {}
        Condition::NoiseUnderstated { factor } => understate(&mut data.noise, factor),
        Condition::Quantised { deg } => {
            let read = |q: &mut f64| *q = (*q / (deg * DEG)).round() * deg * DEG;
            data.samples.iter_mut().for_each(|s| s.q.iter_mut().for_each(read));
        }
        Condition::Few { samples } => data.samples.truncate(samples),
    }
}

/// Understates the noise.
fn understate(noise: &mut Noise, factor: f64) {
    noise.ball = noise.ball.map(|s| s / factor);
    noise.point = noise.point.map(|s| s / factor);
    noise.joint.iter_mut().for_each(|s| *s /= factor);
}

/// Displaces a sample by `sizes` (m, world), like a centring that ended off the ball while its final reading did not show it.
fn put_off(data: &mut Dataset, id: &str, sizes: &[f64]) {
    let Some(name) = set_aside_by(id) else { return };
    let offset = Vector3::from_fn(|k, _| sizes.get(k).copied().unwrap_or(0.0));
    for sample in data.samples.iter_mut().filter(|s| s.id == name) {
        match &mut sample.measured {
            Measured::Ball { reading: Some(reading), .. } => *reading += offset,
            Measured::Point(at) => *at += offset,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::measure::dataset::Sample;
    use calibench_sim::hidden::UNKNOWN;
    use calibench_sim::random::Streams;

    #[test]
    fn every_unknown_flaw_is_drawn_and_no_two_trials_are_alike() {
        for flaw in UNKNOWN {
            let drawn: Vec<HiddenToml> = (0..40)
                .map(|trial| {
                    let mut random = Streams { seed: 1, trial }.stream("suite");
                    unknown_flaw(flaw, 60.0, &mut random).unwrap_or_else(|e| panic!("{flaw}: {e}"))
                })
                .collect();
            assert!(drawn.iter().all(|d| d.listed().len() == 1 && d.listed()[0].name == flaw), "{flaw}");
            assert!(drawn.iter().any(|d| *d != drawn[0]), "{flaw} is always the same");
        }
    }

    #[test]
    fn a_flaw_that_does_not_exist_is_an_error_and_does_not_count_as_missed() {
        let mut random = Streams { seed: 1, trial: 0 }.stream("suite");
        let refused = unknown_flaw("cable_sprung", 60.0, &mut random).expect_err("there is none");
        assert!(refused.to_string().contains("cable_sprung"), "{refused}");
    }

    #[test]
    fn joints_are_read_to_the_step_and_no_finer() {
        let sample = Sample::new("a", vec![0.123_456_7, -1.0], Measured::Point(Vector3::zeros()));
        let mut data = Dataset { samples: vec![sample], ..Dataset::default() };
        let condition = Condition::Quantised { deg: 0.01 };
        let case = Case { class: "quantised".into(), place: 0, kind: Kind::Nothing, condition };
        disturb(&mut data, &case, &Hidden::of(Vec::new(), "nothing", 0.0));
        for (read, was) in data.samples[0].q.iter().zip([0.123_456_7, -1.0]) {
            assert!((read / DEG * 100.0 - (read / DEG * 100.0).round()).abs() < 1e-9 && (read - was).abs() <= 0.005 * DEG);
        }
    }
}
