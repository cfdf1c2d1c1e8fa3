//! The order in which samples were measured, and the posture preceding each.

use std::collections::BTreeMap;

use crate::measure::dataset::Sample;

/// Joints (rad) of the sample preceding each in the same session: by time if all samples of the session have one, otherwise
/// in the order listed. `None` for the first of a session. All samples count, whatever their use.
pub(super) fn joints_before(samples: &[Sample]) -> Vec<Option<&[f64]>> {
    let mut sessions: BTreeMap<Option<&str>, Vec<usize>> = BTreeMap::new();
    for (i, sample) in samples.iter().enumerate() {
        sessions.entry(sample.session.as_deref()).or_default().push(i);
    }
    let mut before = vec![None; samples.len()];
    for places in sessions.values_mut() {
        if places.iter().all(|&i| samples[i].time_s.is_some()) {
            let time = |i: usize| samples[i].time_s.unwrap_or_default();
            places.sort_by(|&a, &b| time(a).total_cmp(&time(b)));
        }
        for pair in places.windows(2) {
            before[pair[1]] = Some(samples[pair[0]].q.as_slice());
        }
    }
    before
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::dataset::Measured;

    #[test]
    fn the_sample_before_is_the_earlier_one_of_the_same_session() {
        let sample = |q: f64, session: Option<&str>, time_s: Option<f64>| {
            let plain = Sample::new(format!("{q}"), vec![q], Measured::Point(nalgebra::Vector3::zeros()));
            Sample { session: session.map(str::to_owned), time_s, ..plain }
        };
        let by_time = [
            sample(1.0, Some("a"), Some(30.0)),
            sample(2.0, Some("b"), None),
            sample(3.0, Some("a"), Some(10.0)),
            sample(4.0, Some("b"), None),
            sample(5.0, Some("a"), Some(20.0)),
        ];
        let before: Vec<Option<f64>> = joints_before(&by_time).into_iter().map(|q| q.map(|q| q[0])).collect();
        assert_eq!(before, [Some(5.0), None, None, Some(2.0), Some(3.0)]);
    }
}
