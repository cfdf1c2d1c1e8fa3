//! The samples in the order of measurement, and what each inherits from those before it.

use std::collections::BTreeMap;

use crate::measure::dataset::Sample;

/// Half the play with which a hose follows its joint, rad: the free length of a dress pack between two clamps.
const PLAY: f64 = 0.5;

/// What a sample inherits from those before it in its session.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Inherited {
    /// Joint angles of the sample before, rad (N); `None` for the first.
    pub q: Option<Vec<f64>>,
    /// How far each joint is turned against its hose, as a share of the play, -1 to 1 (N); the hose is where the joint began.
    pub hose: Vec<f64>,
}

/// What each sample inherits: in the order of times where all samples of a session have one, else in that of the rows.
pub(super) fn inherited(samples: &[Sample]) -> Vec<Inherited> {
    let mut sessions: BTreeMap<Option<&str>, Vec<usize>> = BTreeMap::new();
    for (i, sample) in samples.iter().enumerate() {
        sessions.entry(sample.session.as_deref()).or_default().push(i);
    }
    let mut all: Vec<Inherited> = samples.iter().map(|s| Inherited { q: None, hose: vec![0.0; s.q.len()] }).collect();
    for places in sessions.values_mut() {
        if places.iter().all(|&i| samples[i].time_s.is_some()) {
            let time = |i: usize| samples[i].time_s.unwrap_or_default();
            places.sort_by(|&a, &b| time(a).total_cmp(&time(b)));
        }
        let mut lies = places.first().map_or(Vec::new(), |&first| samples[first].q.clone());
        for pair in places.windows(2) {
            let (before, now) = (&samples[pair[0]], &samples[pair[1]]);
            all[pair[1]].q = Some(before.q.clone());
            for ((hose, q), lies) in all[pair[1]].hose.iter_mut().zip(&now.q).zip(&mut lies) {
                *lies = lies.clamp(q - PLAY, q + PLAY);
                *hose = (q - *lies) / PLAY;
            }
        }
    }
    all
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
        let before: Vec<Option<f64>> = inherited(&by_time).into_iter().map(|e| e.q.map(|q| q[0])).collect();
        assert_eq!(before, [Some(5.0), None, None, Some(2.0), Some(3.0)]);
        // Of session a: 3, 5, 1.
        let hose: Vec<f64> = inherited(&by_time).into_iter().map(|e| e.hose[0]).collect();
        assert_eq!(hose, [-1.0, 0.0, 0.0, 1.0, 1.0]);
    }

    #[test]
    fn a_hose_follows_with_play() {
        let sample = |q: f64| Sample::new(format!("{q}"), vec![q], Measured::Point(nalgebra::Vector3::zeros()));
        let samples = [0.0, 0.25, 1.0, 0.75, 0.25, -1.0].map(sample);
        let hose: Vec<f64> = inherited(&samples).into_iter().map(|e| e.hose[0]).collect();
        assert_eq!(hose, [0.0, 0.5, 1.0, 0.5, -0.5, -1.0]);
    }
}
