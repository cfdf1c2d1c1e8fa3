//! The hidden effects of one trial, and the conditions of its measurement.

use calibench::effects::EffectId;

use std::fmt;

use calibench_sim::hidden::UNKNOWN;
use calibench_sim::random::fnv1a;
use calibench_sim::scenario::SuiteToml;

/// Kind of hidden effect.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // fields are said in the variants' own words
pub enum Kind {
    /// Nothing at all.
    Nothing,
    /// Effects of the catalogue, by id, all at this many plausible sizes. `@` stands for a random order, moment or sample.
    Effects { ids: Vec<String>, size: f64 },
    /// Every effect of the catalogue, normally distributed with this many plausible sizes as one-sigma.
    Clutter { size: f64 },
    /// Every effect of the catalogue, with sizes of every order of magnitude.
    Dense,
    /// A flaw outside the catalogue, at this many plausible sizes.
    Unknown { flaw: String, size: f64 },
    /// This many samples, each displaced by this many mm in a random direction.
    Outliers { count: usize, mm: f64 },
    /// A ball displaced by this many mm during the campaign.
    MovedBall { mm: f64 },
}

/// Deviation of the measurement from the ideal for a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // fields are said in the variants' own words
pub enum Condition {
    /// No deviation.
    AsStated,
    /// The noise is larger than stated by this factor.
    NoiseUnderstated { factor: f64 },
    /// Joint angles are rounded to this many degrees.
    Quantised { deg: f64 },
    /// Only this many samples.
    Few { samples: usize },
    /// Another robot, by its index among those of the suite.
    Robot { place: usize },
}

/// One trial of a suite.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// The class to which it belongs: a row of the table.
    pub class: String,
    /// Its index in its class.
    pub place: usize,
    /// The hidden effect.
    pub kind: Kind,
    /// The conditions of the measurement.
    pub condition: Condition,
}

impl Case {
    /// Number of its random streams, independent of the other classes and of the part of the suite that is run.
    pub fn trial(&self) -> u64 {
        // A class has fewer than a million trials.
        (fnv1a(self.class.as_bytes()) << 20) | self.place as u64
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Kind::Nothing => write!(f, "nothing"),
            Kind::Effects { ids, size } => write!(f, "{} x{size}", ids.join(" + ")),
            Kind::Clutter { size } => write!(f, "clutter x{size}"),
            Kind::Dense => write!(f, "dense"),
            Kind::Unknown { flaw, size } => write!(f, "unknown {flaw} x{size}"),
            Kind::Outliers { count, mm } => write!(f, "{count} outliers of {mm} mm"),
            Kind::MovedBall { mm } => write!(f, "a ball moved by {mm} mm"),
        }
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind)?;
        match self.condition {
            Condition::AsStated | Condition::Robot { .. } => Ok(()),
            Condition::NoiseUnderstated { factor } => write!(f, ", noise x{factor}"),
            Condition::Quantised { deg } => write!(f, ", joints read to {deg} deg"),
            Condition::Few { samples } => write!(f, ", {samples} samples"),
        }
    }
}

/// Under special conditions every third trial hides nothing: claims there are false alarms.
const NOTHING_EVERY: usize = 3;

/// Plausible sizes of effects hidden in pairs and under special conditions.
const SIZE: f64 = 2.0;

/// The ids of a robot's catalogue, extended by those whose place is random.
pub(super) fn with_scanned(mut ids: Vec<String>, joints: usize) -> Vec<String> {
    let steps = (1..=joints).map(|j| format!("{}:{j}:@", EffectId::JOINT_STEP));
    let ripples = (1..=joints).map(|j| format!("{}:{j}:@", EffectId::HARMONIC));
    let alone = [EffectId::BASE_STEP, EffectId::TOOL_STEP, EffectId::OUTLIER].map(|family| format!("{family}:@"));
    ids.extend(alone.into_iter().chain(steps).chain(ripples));
    ids
}

/// All cases of a suite: `ids` are the effects of its robot, `robots` the names and effects of the others.
pub(super) fn all(ids: &[String], robots: &[(String, Vec<String>)], spec: &SuiteToml) -> Vec<Case> {
    let mut cases = Vec::new();
    let mut class = |name: &str, condition: Condition, kinds: Vec<Kind>| {
        let case = |(place, kind)| Case { class: name.to_owned(), place, kind, condition };
        cases.extend(kinds.into_iter().enumerate().map(case));
    };
    let as_stated = Condition::AsStated;
    class("nothing", as_stated, vec![Kind::Nothing; spec.trials_of_nothing]);
    let understated = |factor: f64| (format!("noise_x{factor}"), Condition::NoiseUnderstated { factor });
    let (name, condition) = understated(spec.noise_wrong);
    class(&format!("nothing_{name}"), condition, vec![Kind::Nothing; spec.trials_of_nothing]);
    class("one", as_stated, singles(ids, spec));
    class("two", as_stated, (0..spec.trials_of_two).map(|k| pair(ids, k)).collect());
    class("clutter", as_stated, by_turns(&spec.clutter, spec.trials_of_clutter, |size| Kind::Clutter { size }));
    class("dense", as_stated, vec![Kind::Dense; spec.trials_of_dense]);
    let outliers = Kind::Outliers { count: 2, mm: spec.outlier_mm };
    class("two_outliers", as_stated, vec![outliers; spec.trials_of_outliers]);
    class("moved_ball", as_stated, vec![Kind::MovedBall { mm: spec.moved_ball_mm }; spec.trials_of_moved_ball]);
    for flaw in UNKNOWN {
        let of = |size| Kind::Unknown { flaw: flaw.into(), size };
        class(&format!("unknown_{flaw}"), as_stated, by_turns(&spec.unknown_sizes, spec.trials_of_unknown, of));
    }
    let (name, condition) = understated(spec.noise_understated);
    class(&name, condition, mixed(ids, spec.trials_of_understated));
    class("quantised", Condition::Quantised { deg: spec.quantised_deg }, mixed(ids, spec.trials_of_quantised));
    class("few_samples", Condition::Few { samples: spec.few_samples }, mixed(ids, spec.trials_of_few));
    for (place, (name, ids)) in robots.iter().enumerate() {
        class(&format!("robot_{name}"), Condition::Robot { place }, mixed(ids, spec.trials_of_robot));
    }
    cases
}

/// Every effect alone, at every size, in an order whose first trials cover all parts of the catalogue and all sizes.
fn singles(ids: &[String], spec: &SuiteToml) -> Vec<Kind> {
    let of = |id: &String, size: f64| vec![Kind::Effects { ids: vec![id.clone()], size }; spec.trials_per_effect];
    let all: Vec<Kind> = ids.iter().flat_map(|id| spec.sizes.iter().flat_map(move |&size| of(id, size))).collect();
    let stride = golden_stride(all.len());
    (0..all.len()).map(|k| all[k * stride % all.len()].clone()).collect()
}

/// About 0.618 of a number and coprime with it: its multiples visit all indices without leaving large gaps on the way.
fn golden_stride(length: usize) -> usize {
    let common = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let first = (0.618 * length as f64) as usize;
    (first.max(1)..).find(|&stride| common(stride, length) <= 1).unwrap_or(1)
}

/// `trials` cases of each size, alternating: the first trials of a class cover all sizes.
fn by_turns(sizes: &[f64], trials: usize, kind: impl Fn(f64) -> Kind) -> Vec<Kind> {
    (0..trials).flat_map(|_| sizes.iter().map(|&size| kind(size))).collect()
}

/// Two effects far apart in the catalogue, each about as often as any other.
fn pair(ids: &[String], k: usize) -> Kind {
    let pair = [k * 7, k * 7 + 13 + k % 29].map(|i| ids[i % ids.len()].clone());
    Kind::Effects { ids: pair.to_vec(), size: SIZE }
}

/// One effect at a time from all parts of the catalogue; nothing in every third trial.
fn mixed(ids: &[String], trials: usize) -> Vec<Kind> {
    let kind = |k: usize| match k % NOTHING_EVERY {
        0 => Kind::Nothing,
        _ => Kind::Effects { ids: vec![ids[(k * 11) % ids.len()].clone()], size: SIZE },
    };
    (0..trials).map(kind).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_keeps_its_streams_when_classes_come_and_go() {
        let case =
            |class: &str, place| Case { class: class.into(), place, kind: Kind::Nothing, condition: Condition::AsStated };
        let trials = [case("two", 0), case("two", 1), case("dense", 0)].map(|c| c.trial());
        assert!(trials[0] + 1 == trials[1] && trials[0] != trials[2]);
    }

    #[test]
    fn a_stride_goes_through_all_places_and_spreads_at_once() {
        for length in [1, 2, 10, 143, 572, 600] {
            let stride = golden_stride(length);
            let mut places: Vec<usize> = (0..length).map(|k| k * stride % length).collect();
            let first = &places[..length.min(8)];
            assert!((0..4).all(|q| length < 10 || first.iter().any(|p| 4 * p / length == q)), "{length}: {first:?}");
            places.sort_unstable();
            assert!(places.into_iter().eq(0..length), "{length}");
        }
    }

    /// 11 and the number of effects of a six-joint arm are coprime: a class covers the whole catalogue.
    #[test]
    fn mixed_trials_hide_nothing_in_a_third_and_never_the_same_twice() {
        let ids: Vec<String> = (0..130).map(|k| k.to_string()).collect();
        let kinds = mixed(&ids, 60);
        assert_eq!(kinds.iter().filter(|k| **k == Kind::Nothing).count(), 20);
        let mut effects: Vec<String> = kinds.iter().filter(|k| **k != Kind::Nothing).map(ToString::to_string).collect();
        effects.sort();
        effects.dedup();
        assert_eq!(effects.len(), 40);
    }
}
