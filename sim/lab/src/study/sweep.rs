//! `[sweep]`: the points of a study.

use calibench::files::FileError;

use super::axis::{Axis, MOST_POINTS};
use calibench_sim::scenario::{Design, Document, SweepToml};

/// One point of a sweep.
#[derive(Debug, Clone)]
pub struct SweepPoint {
    /// The scenario at this point.
    pub document: Document,
    /// Its label on each axis: a number or a text.
    pub at: Vec<String>,
}

/// The names of the axes, and every point in order: the last axis changes fastest.
///
/// # Errors
/// An error that names the axis.
pub fn sweep_points(document: &Document, sweep: Option<&SweepToml>) -> Result<(Vec<String>, Vec<SweepPoint>), FileError> {
    let Some(sweep) = sweep else {
        return Ok((Vec::new(), vec![SweepPoint { document: document.clone(), at: Vec::new() }]));
    };
    let wrong = |key: &str, problem: String, remedy: &str| Err(document.wrong(key, problem, remedy));
    if sweep.axes.is_empty() {
        return wrong("sweep", "has no axis".into(), "give at least one [[sweep.axis]]");
    }
    let axes: Vec<Axis> =
        sweep.axes.iter().enumerate().map(|(k, a)| Axis::of(document, k, a, sweep.design)).collect::<Result<_, _>>()?;
    for (k, axis) in axes.iter().enumerate() {
        if axes[..k].iter().any(|other| other.name == axis.name) {
            return wrong(&format!("sweep.axis[{k}]"), format!("is a second one called '{}'", axis.name), "give it a `name`");
        }
    }
    let places: Vec<Vec<f64>> = match (sweep.design, sweep.points) {
        (Design::Factorial, None) => {
            let sizes: Vec<usize> = axes.iter().map(Axis::levels).collect();
            let count = sizes.iter().try_fold(1_usize, |n, &s| n.checked_mul(s)).unwrap_or(usize::MAX);
            if count > MOST_POINTS {
                return wrong(
                    "sweep",
                    format!("has {count} points"),
                    &format!("take at most {MOST_POINTS}, or design = \"sobol\""),
                );
            }
            (0..count).map(|point| factorial(point, &sizes)).collect()
        }
        (Design::Factorial, Some(_)) => {
            return wrong("sweep.points", "is for design = \"sobol\"".into(), "leave it out: the axes say how many there are");
        }
        (Design::Sobol, Some(points)) if (1..=MOST_POINTS).contains(&points) => {
            // Studies with the same axes have the same points, whatever the seed.
            let number = |p: usize, axis: usize| f64::from(sobol_burley::sample(p as u32, axis as u32, 0));
            (0..points).map(|p| (0..axes.len()).map(|axis| number(p, axis)).collect()).collect()
        }
        (Design::Sobol, _) => {
            return wrong("sweep.points", "is missing or out of range".into(), &format!("give 1 to {MOST_POINTS} points"));
        }
    };
    let names = axes.iter().map(|a| a.name.clone()).collect();
    let points = places.iter().map(|place| point(document, &axes, place, sweep.design)).collect::<Result<_, _>>()?;
    Ok((names, points))
}

/// Positions on the axes (0 to 1) of a point: the middle of each level's share.
fn factorial(point: usize, sizes: &[usize]) -> Vec<f64> {
    let mut rest = point;
    let mut places: Vec<f64> = sizes
        .iter()
        .rev()
        .map(|&size| {
            let level = rest % size;
            rest /= size;
            (level as f64 + 0.5) / size as f64
        })
        .collect();
    places.reverse();
    places
}

fn point(document: &Document, axes: &[Axis], place: &[f64], design: Design) -> Result<SweepPoint, FileError> {
    let mut point = SweepPoint { document: document.clone(), at: Vec::with_capacity(axes.len()) };
    for (k, (axis, &place)) in axes.iter().zip(place).enumerate() {
        let label = axis
            .apply(place, design, &mut point.document)
            .map_err(|e| document.wrong(&format!("sweep.axis[{k}]"), e.to_string(), "name a key that the scenario has"))?;
        point.at.push(label);
    }
    Ok(point)
}
