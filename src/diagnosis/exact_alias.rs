//! Effects that no fit of these data can distinguish, because they move the same samples by the same amounts.

use crate::effects::facts::Alias;
use crate::effects::family::Scan;
use crate::effects::registry::Registry;
use crate::effects::{self, EffectId};
use crate::identify::problem::Use;
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample};

/// Returns the other effects that are exactly aliased with effect `id` in the fitted rows of `datasets`; empty if there
/// are none.
///
/// If only balls are measured, a motion of the base is the opposite motion of the artifact. If a ball is probed only
/// once, or only once after it was knocked, an outlier at that sample is the same as a displacement of the ball.
pub fn exact_aliases(id: &EffectId, registry: &Registry, datasets: &[NamedDataset<'_>]) -> Vec<EffectId> {
    let Some(family) = registry.family(id) else { return Vec::new() };
    let with = |family: &str| id.rest().map_or(family.to_owned(), |rest| format!("{family}:{rest}"));
    match (family.alias, family.scan) {
        (Alias::OnBalls(other), _) if only_balls(datasets) => vec![with(other).into()],
        (Alias::OfOnlySample, Scan::Time) => {
            let (ball, time) = id.rest().and_then(|rest| rest.rsplit_once(':')).unwrap_or_default();
            time.parse().map_or(Vec::new(), |time| alone(datasets, Some(ball), Some(time)))
        }
        (Alias::OfOnlySample, _) => alone(datasets, id.rest(), None),
        _ => Vec::new(),
    }
}

fn fitted<'d>(datasets: &'d [NamedDataset<'d>]) -> impl Iterator<Item = (&'d Dataset, &'d Sample)> {
    datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)).map(move |s| (d.dataset, s)))
}

fn only_balls(datasets: &[NamedDataset<'_>]) -> bool {
    fitted(datasets).all(|(_, s)| matches!(s.measured, Measured::Ball { .. }))
}

/// The outlier effect of the only sample of a ball, among those after `time` (s) if given.
fn alone(datasets: &[NamedDataset<'_>], ball: Option<&str>, time: Option<f64>) -> Vec<EffectId> {
    let probes = |(d, s): &(&Dataset, &Sample)| match s.measured {
        Measured::Ball { ball: b, .. } => {
            d.balls.get(b).map(|b| b.id.as_str()) == ball && time.is_none_or(|time| s.time_s > Some(time))
        }
        _ => false,
    };
    let mut samples = fitted(datasets).filter(probes);
    match (samples.next(), samples.next()) {
        (Some((_, only)), None) => vec![effects::catalogue::setting_aside(&only.id).into()],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::measure::dataset::Ball;

    fn data(points: bool) -> Dataset {
        let ball = |id: &str| Ball { id: id.into(), position: Vector3::zeros(), sigma: 0.0, free: false };
        let probe = |id: &str, ball: usize, time: f64| Sample {
            time_s: Some(time),
            ..Sample::new(id, vec![0.0; 6], Measured::Ball { ball, reading: None })
        };
        let mut samples = vec![probe("p1", 0, 10.0), probe("p2", 0, 20.0), probe("p3", 1, 30.0)];
        if points {
            samples.push(Sample::new("t1", vec![0.0; 6], Measured::Point(Vector3::zeros())));
        }
        Dataset { balls: vec![ball("a"), ball("b:2")], samples, ..Dataset::default() }
    }

    #[test]
    fn base_and_artifact_are_one_where_only_balls_are_measured() {
        let (balls, mixed) = (data(false), data(true));
        assert_eq!(
            exact_aliases(&"base_step:15".into(), Registry::catalogue(), &[NamedDataset::new("d", &balls)]),
            ["artifact_step:15"]
        );
        assert_eq!(
            exact_aliases(&"artifact_step".into(), Registry::catalogue(), &[NamedDataset::new("d", &balls)]),
            ["base_step"]
        );
        assert!(exact_aliases(&"base_step:15".into(), Registry::catalogue(), &[NamedDataset::new("d", &mixed)]).is_empty());
    }

    #[test]
    fn a_ball_that_is_probed_once_is_an_outlier() {
        let data = data(false);
        assert_eq!(exact_aliases(&"ball:b:2".into(), Registry::catalogue(), &[NamedDataset::new("d", &data)]), ["outlier:p3"]);
        assert!(exact_aliases(&"ball:a".into(), Registry::catalogue(), &[NamedDataset::new("d", &data)]).is_empty());
        assert_eq!(
            exact_aliases(&"ball_step:a:15".into(), Registry::catalogue(), &[NamedDataset::new("d", &data)]),
            ["outlier:p2"]
        );
        assert!(exact_aliases(&"ball_step:a:5".into(), Registry::catalogue(), &[NamedDataset::new("d", &data)]).is_empty());
    }
}
