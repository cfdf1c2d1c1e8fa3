//! What is hidden in one trial, and under which conditions it is measured.

use std::fmt;

use crate::hidden::UNKNOWN;
use crate::random::fnv1a;
use crate::scenario::SuiteToml;

/// What kind of thing.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // fields are said in the variants' own words
pub enum Kind {
    /// Nothing at all.
    Nothing,
    /// Effects of the catalogue, by id, all at this many plausible sizes. `@` stands for an order, a moment or a sample to be drawn.
    Effects { ids: Vec<String>, size: f64 },
    /// Every effect of the catalogue at a normal size, so many plausible sizes one-sigma.
    Clutter { size: f64 },
    /// Every effect of the catalogue, sizes of every order of magnitude.
    Dense,
    /// A flaw that no catalogue holds, at this many plausible sizes.
    Unknown { flaw: String, size: f64 },
    /// So many samples, each off by so many mm in a direction of its own.
    Outliers { count: usize, mm: f64 },
    /// A ball is knocked by so many mm during the campaign.
    MovedBall { mm: f64 },
}

/// What of the measurement is not as a diagnosis would have it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // fields are said in the variants' own words
pub enum Condition {
    /// Nothing.
    AsStated,
    /// The noise is larger than stated by this factor.
    NoiseUnderstated { factor: f64 },
    /// Joint angles are read to so many degrees.
    Quantised { deg: f64 },
    /// There are only so many samples.
    Few { samples: usize },
    /// It is another robot, by its place among those of the suite.
    Robot { place: usize },
}

/// One trial of a suite.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// The class that it counts for: a row of the table.
    pub class: String,
    /// Its place in its class.
    pub place: usize,
    /// What is hidden.
    pub kind: Kind,
    /// Under which conditions.
    pub condition: Condition,
}

impl Case {
    /// The number of its streams: the same whatever other classes there are, and whatever part of the suite is run.
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

/// Of the trials under a condition every third has nothing hidden: claims there are false alarms.
const NOTHING_EVERY: usize = 3;

/// Plausible sizes of what is hidden in pairs and under conditions.
const SIZE: f64 = 2.0;

/// The ids of a robot's catalogue, beside those whose place is drawn.
pub(super) fn with_scanned(mut ids: Vec<String>, joints: usize) -> Vec<String> {
    let steps = (1..=joints).map(|j| format!("joint_step:{j}:@"));
    let ripples = (1..=joints).map(|j| format!("harmonic:{j}:@"));
    ids.extend(["base_step:@", "tool_step:@", "outlier:@"].map(String::from).into_iter().chain(steps).chain(ripples));
    ids
}

/// Every case of a suite: `ids` are the effects of its robot, `robots` names and effects of the others.
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

/// Every effect alone, at every size; in an order in which the first trials are of all parts of the catalogue, and of all sizes.
fn singles(ids: &[String], spec: &SuiteToml) -> Vec<Kind> {
    let of = |id: &String, size: f64| vec![Kind::Effects { ids: vec![id.clone()], size }; spec.trials_per_effect];
    let all: Vec<Kind> = ids.iter().flat_map(|id| spec.sizes.iter().flat_map(move |&size| of(id, size))).collect();
    let stride = golden_stride(all.len());
    (0..all.len()).map(|k| all[k * stride % all.len()].clone()).collect()
}

/// About 0.618 of a number, and without a common factor with it: its multiples go through all places and leave no large gap on the way.
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

/// So many trials of each size, the sizes by turns: the first trials of a class have something of each.
fn by_turns(sizes: &[f64], trials: usize, kind: impl Fn(f64) -> Kind) -> Vec<Kind> {
    (0..trials).flat_map(|_| sizes.iter().map(|&size| kind(size))).collect()
}

/// Two effects far apart in the catalogue, each about as often as any other.
fn pair(ids: &[String], k: usize) -> Kind {
    let pair = [k * 7, k * 7 + 13 + k % 29].map(|i| ids[i % ids.len()].clone());
    Kind::Effects { ids: pair.to_vec(), size: SIZE }
}

/// One effect at a time, of all parts of the catalogue; nothing in every third.
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

    /// 11 and the number of effects of a six-joint arm have no common factor: a class goes through the whole catalogue.
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
