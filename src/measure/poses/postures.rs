//! Samples grouped by posture: the posture, not the row, is the unit of information. Repeats, and several targets seen from one
//! posture, share the errors of the arm there.

use std::collections::HashMap;

use crate::measure::dataset::{Measured, NamedDataset, Sample};
use crate::units::DEG;

/// Largest difference of joint angles within one posture, rad: a controller's repeatability, and angles reported to hundredths
/// of a degree.
pub(crate) const SAME_POSTURE: f64 = 0.01 * DEG;

/// Rounding of angles given in degrees, which must not separate two that differ by exactly the tolerance.
const ROUNDING: f64 = 1e-9;

/// The groups of a list of samples. Groups are numbered in the order in which they first appear.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Postures {
    of: Vec<usize>,
    count: usize,
}

impl Postures {
    /// Groups the samples that `takes` selects by posture, in the order of the datasets: all joints within 0.01 deg, in one
    /// session of one dataset; or one name in `posture` or `repeat` there. With `|s| Use::Fit.takes(s)` the order is that of the samples of a
    /// problem.
    pub fn of(datasets: &[NamedDataset<'_>], takes: impl Fn(&Sample) -> bool) -> Self {
        let taken = || {
            datasets
                .iter()
                .enumerate()
                .flat_map(|(d, NamedDataset { dataset: data, .. })| data.samples.iter().map(move |s| (d, s)))
        };
        let samples: Vec<(usize, &Sample)> = taken().filter(|(_, s)| takes(s)).collect();
        let joints: Vec<&[f64]> = samples.iter().map(|(_, s)| s.q.as_slice()).collect();
        let setups: Vec<(usize, Option<&str>)> = samples.iter().map(|(d, s)| (*d, s.session.as_deref())).collect();
        let alike = Postures::of_joints(&joints, &numbered(setups.iter()));
        let named = |name: fn(&Sample) -> Option<&str>| {
            samples.iter().zip(&setups).map(move |((_, s), setup)| Some((*setup, name(s)?)))
        };
        alike.joined(named(|s| s.repeat.as_deref())).joined(named(|s| s.posture.as_deref()))
    }

    /// Groups replicates: as [`Postures::of`], but with the same target, payload and direction of approach too, so that they
    /// differ only by scatter. Samples with the same `repeat` name are accepted as replicates.
    pub fn replicates(datasets: &[NamedDataset<'_>], takes: impl Fn(&Sample) -> bool) -> Self {
        let taken = || {
            datasets
                .iter()
                .enumerate()
                .flat_map(|(d, NamedDataset { dataset: data, .. })| data.samples.iter().map(move |s| (d, s)))
        };
        let samples: Vec<(usize, &Sample)> = taken().filter(|(_, s)| takes(s)).collect();
        let joints: Vec<&[f64]> = samples.iter().map(|(_, s)| s.q.as_slice()).collect();
        let target = |s: &Sample| match s.measured {
            Measured::Ball { ball, .. } => (0, ball, s.tool_target),
            Measured::Point(_) => (1, 0, s.tool_target),
            Measured::Distance { anchor, .. } => (2, anchor, s.tool_target),
        };
        let keys: Vec<_> = samples
            .iter()
            .map(|(d, s)| (*d, s.session.as_deref(), target(s), s.payload, s.approach.as_deref(), s.plungers))
            .collect();
        let alike = Postures::of_joints(&joints, &numbered(keys.iter()));
        let names = samples.iter().map(|(d, s)| Some((*d, s.session.as_deref(), target(s), s.repeat.as_deref()?)));
        alike.joined(names)
    }

    /// Groups of equal `key` whose joint angles (rad) all lie within 0.01 deg of each other; O(n log n).
    ///
    /// ```
    /// use calibench::measure::poses::Postures;
    /// use calibench::units::DEG;
    ///
    /// let joints = [[0.0], [0.005 * DEG], [1.0 * DEG]];
    /// let postures = Postures::of_joints(&joints.each_ref().map(|q| &q[..]), &[0, 0, 0]);
    /// assert_eq!((postures.count(), postures.of_samples()), (2, &[0, 0, 1][..]));
    /// ```
    pub fn of_joints(joints: &[&[f64]], key: &[usize]) -> Self {
        let mut groups: HashMap<usize, Vec<usize>> = HashMap::new();
        for (i, key) in key.iter().enumerate().take(joints.len()) {
            groups.entry(*key).or_default().push(i);
        }
        let mut open: Vec<Vec<usize>> = groups.into_values().collect();
        let mut label = vec![0; joints.len()];
        let mut closed = 0;
        while let Some(group) = open.pop() {
            match split(joints, &group) {
                Some(parts) => open.extend(parts),
                None => {
                    group.iter().for_each(|&i| label[i] = closed);
                    closed += 1;
                }
            }
        }
        Postures::numbered(label.iter())
    }

    /// Number of postures.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Posture of each sample, counted from 0.
    pub fn of_samples(&self) -> &[usize] {
        &self.of
    }

    /// Samples of each posture.
    pub fn members(&self) -> Vec<Vec<usize>> {
        let mut members = vec![Vec::new(); self.count];
        self.of.iter().enumerate().for_each(|(i, &p)| members[p].push(i));
        members
    }

    /// Samples per posture: at least 1.
    pub fn repetition(&self) -> f64 {
        (self.of.len() as f64 / self.count.max(1) as f64).max(1.0)
    }

    fn numbered<'a, T: Eq + std::hash::Hash + 'a>(labels: impl Iterator<Item = &'a T>) -> Self {
        let of = numbered(labels);
        Postures { count: of.iter().max().map_or(0, |m| m + 1), of }
    }

    /// Joins groups that share a name.
    fn joined<N: Eq + std::hash::Hash>(self, names: impl Iterator<Item = Option<N>>) -> Self {
        let mut parent: Vec<usize> = (0..self.count).collect();
        let mut holder: HashMap<N, usize> = HashMap::new();
        for (&posture, name) in self.of.iter().zip(names) {
            let Some(name) = name else { continue };
            let other = *holder.entry(name).or_insert(posture);
            let (a, b) = (root(&mut parent, posture), root(&mut parent, other));
            parent[a.max(b)] = a.min(b);
        }
        let of: Vec<usize> = self.of.iter().map(|&p| root(&mut parent, p)).collect();
        Postures::numbered(of.iter())
    }
}

fn root(parent: &mut [usize], mut at: usize) -> usize {
    while parent[at] != at {
        parent[at] = parent[parent[at]];
        at = parent[at];
    }
    at
}

/// Numbers labels in the order in which they first appear.
fn numbered<'a, T: Eq + std::hash::Hash + 'a>(labels: impl Iterator<Item = &'a T>) -> Vec<usize> {
    let mut known: HashMap<&T, usize> = HashMap::new();
    labels
        .map(|label| {
            let next = known.len();
            *known.entry(label).or_insert(next)
        })
        .collect()
}

/// Splits a group by a joint: first where its angles leave a gap, so that no posture is divided; if a sweep leaves none, into
/// stretches of the tolerance. `None` if all angles lie within it.
fn split(joints: &[&[f64]], group: &[usize]) -> Option<Vec<Vec<usize>>> {
    if group.len() < 2 {
        return None;
    }
    let tolerance = SAME_POSTURE + ROUNDING;
    let count = group.iter().map(|&i| joints[i].len()).max().unwrap_or(0);
    let angle = |i: usize, j: usize| joints[i].get(j).copied().unwrap_or(f64::NAN);
    let sorted = |j: usize| {
        let mut order = group.to_vec();
        order.sort_by(|&a, &b| angle(a, j).total_cmp(&angle(b, j)).then(a.cmp(&b)));
        order
    };
    let mut widest: Option<(f64, Vec<usize>, usize)> = None;
    for j in 0..count {
        let order = sorted(j);
        let range = angle(order[order.len() - 1], j) - angle(order[0], j);
        if range <= tolerance {
            continue;
        }
        let parts = cut(&order, |previous, _, i| angle(i, j) - angle(previous, j) > tolerance);
        if parts.len() > 1 {
            return Some(parts);
        }
        if widest.as_ref().is_none_or(|(w, ..)| range > *w) {
            widest = Some((range, order, j));
        }
    }
    let (_, order, j) = widest?;
    Some(cut(&order, |_, first, i| angle(i, j) - angle(first, j) > tolerance))
}

/// Cuts a sorted list before every element for which `apart(previous, first of the part, element)`.
fn cut(order: &[usize], apart: impl Fn(usize, usize, usize) -> bool) -> Vec<Vec<usize>> {
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for &i in order {
        match parts.last_mut() {
            Some(part) if !apart(part[part.len() - 1], part[0], i) => part.push(i),
            _ => parts.push(vec![i]),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::dataset::Dataset;
    use nalgebra::Vector3;

    fn of(angles: &[[f64; 2]]) -> Vec<usize> {
        let joints: Vec<Vec<f64>> = angles.iter().map(|q| q.iter().map(|q| q * DEG).collect()).collect();
        let joints: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
        Postures::of_joints(&joints, &vec![0; joints.len()]).of
    }

    #[test]
    fn a_hundredth_of_a_degree_is_one_posture_and_more_is_not() {
        assert_eq!(of(&[[10.0, 20.0], [10.01, 20.0], [10.0, 20.02], [30.0, 20.0], [10.005, 19.995]]), [0, 0, 1, 2, 0]);
        assert_eq!(of(&[]), [0; 0]);
    }

    #[test]
    fn a_slow_sweep_is_many_postures() {
        let sweep: Vec<[f64; 2]> = (0..100).map(|k| [0.005 * f64::from(k), 0.0]).collect();
        let found = of(&sweep);
        let count = found.iter().max().map_or(0, |m| m + 1);
        assert!((33..=50).contains(&count), "{count}");
    }

    #[test]
    fn grouping_agrees_with_a_comparison_of_all_pairs() {
        // Postures on a lattice of 0.5 deg, each repeated with a scatter of 4 millidegrees either way.
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1_u64 << 31) as f64
        };
        let angles: Vec<[f64; 2]> =
            (0..400).map(|_| [0, 1].map(|_| 0.5 * (8.0 * random()).floor() + 0.008 * (random() - 0.5))).collect();
        let found = of(&angles);
        for (a, p) in angles.iter().zip(&found) {
            for (b, q) in angles.iter().zip(&found) {
                let near = (0..2).all(|j| (a[j] - b[j]).abs() <= 0.01);
                assert_eq!(near, p == q, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn set_ups_part_and_repeat_names_join() {
        let sample = |q: f64, session: &str, repeat: Option<&str>, payload: usize| Sample {
            session: Some(session.into()),
            repeat: repeat.map(str::to_owned),
            payload,
            ..Sample::new("", vec![q * DEG], Measured::Point(Vector3::zeros()))
        };
        let samples = vec![
            sample(1.0, "a", None, 0),
            sample(1.0, "b", None, 0),
            sample(1.0, "a", Some("r"), 1),
            sample(1.05, "a", Some("r"), 0),
        ];
        let data = Dataset { samples, ..Dataset::default() };
        let postures = Postures::of(&[NamedDataset::new("", &data)], |_| true);
        assert_eq!((postures.of_samples(), postures.count()), (&[0, 1, 0, 0][..], 2));
        let replicates = Postures::replicates(&[NamedDataset::new("", &data)], |_| true);
        assert_eq!(replicates.of_samples(), [0, 1, 2, 2]);
        assert_eq!(replicates.members(), [vec![0], vec![1], vec![2, 3]]);
    }
}
