//! What an identification starts from: a base and a tool in closed form, and the weight of orientations beside positions where
//! their noise is not stated.

use std::path::Path;

use nalgebra::{SMatrix, SVector, Vector3};

use super::{ImportError, ImportReport};
use crate::identify::problem::UNSTATED_SIGMA;
use crate::identify::{Model, identify};
use crate::math::positive_definite::cholesky;
use crate::math::rigid_fit;
use crate::measure::dataset::file::read_dataset;
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, Pose, angle_between};
use crate::units::DEG;

/// Maximum number of iterations: from a guess 0.1 m off it takes about five.
const ROUNDS: usize = 30;
/// Step below which the tool has converged, m.
const AT_REST: f64 = 1e-7;

/// Flange poses in the robot's own frame.
pub(super) fn flanges<'a>(dataset: &'a Dataset) -> impl Iterator<Item = Pose> + 'a {
    let origin = FramePose::default();
    dataset.samples.iter().map(move |s| world_from_tool(&dataset.robot, &origin, &origin, &s.q))
}

/// Largest angle between flanges of one orientation, rad: between them the tool moves by less than noise and errors of the arm.
const ONE_ORIENTATION: f64 = 3.0 * DEG;

/// Checks that poses by which base and tool are to be found are turned against each other.
pub(super) fn check_orientations(dataset: &Dataset) -> Result<(), ImportError> {
    let poses = dataset.tool_free && dataset.samples.len() > 1 && dataset.samples.iter().all(|s| s.orientation.is_some());
    let spread = spread_of_orientations(dataset);
    if poses && spread < ONE_ORIENTATION {
        return Err(ImportError::OneOrientation { spread_deg: spread / DEG });
    }
    Ok(())
}

/// Largest angle between the flange of the first row and that of any other, rad.
fn spread_of_orientations(dataset: &Dataset) -> f64 {
    let mut all = flanges(dataset);
    let Some(first) = all.next() else { return 0.0 };
    all.map(|flange| angle_between(&first.rotation, &flange.rotation)).fold(0.0, f64::max)
}

/// Fits the base, the tool if it is free, and the free targets to the fit rows of the first session with known positions.
///
/// Leaves the dataset unchanged if there are too few of them, or they are collinear.
pub(super) fn fit_base_and_tool(dataset: &mut Dataset) {
    let session = dataset.samples.first().and_then(|s| s.session.clone());
    let mut known: Vec<(Option<usize>, Pose, Vector3<f64>)> = Vec::new();
    for (sample, flange) in dataset.samples.iter().zip(flanges(dataset)) {
        if let Some(place) = known_place(dataset, sample)
            && sample.session == session
            && sample.set == SampleSet::Fit
        {
            known.push((sample.tool_target, flange, place));
        }
    }
    // The rows of the TCP; where it was never measured itself, those of the first target.
    let first = known.iter().map(|(tool_target, ..)| *tool_target).min().flatten();
    let offset = Vector3::from(dataset.tool_at(first).xyz) - Vector3::from(dataset.tool.xyz);
    let pairs: Vec<(Pose, Vector3<f64>)> =
        known.iter().filter(|(r, ..)| *r == first).map(|(_, flange, place)| (*flange, *place)).collect();
    let mut tool = Vector3::from(dataset.tool.xyz);
    let reached = |tool: &Vector3<f64>| {
        pairs.iter().map(|(flange, place)| (flange.transform_point(&(tool + offset).into()).coords, *place)).collect::<Vec<_>>()
    };
    let Some(mut base) = rigid_fit(&reached(&tool)) else { return };
    // Where the flange hardly turns, the tool cannot be told from the base: the stated one stays.
    if dataset.tool_free && spread_of_orientations(dataset) >= ONE_ORIENTATION {
        for _ in 0..ROUNDS {
            // Gauss-Newton on the translation and rotation of the base about the world's origin, and the tool in the flange.
            let (mut normal, mut right) = (SMatrix::<f64, 9, 9>::zeros(), SVector::<f64, 9>::zeros());
            for (flange, place) in &pairs {
                let held = base * flange;
                let tcp = held.transform_point(&(tool + offset).into()).coords;
                let mut columns = SMatrix::<f64, 3, 9>::zeros();
                columns.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
                columns.fixed_view_mut::<3, 3>(0, 3).copy_from(&-tcp.cross_matrix());
                columns.fixed_view_mut::<3, 3>(0, 6).copy_from(held.rotation.matrix());
                normal += columns.transpose() * columns;
                right += columns.transpose() * (place - tcp);
            }
            // If the flange never rotates, the tool cannot be separated from the base: keep the first fit.
            let Ok(step) = cholesky(normal).map(|c| c.solve(&right)) else { break };
            tool += step.fixed_rows::<3>(6);
            let Some(refitted) = rigid_fit(&reached(&tool)) else { break };
            base = refitted;
            if step.fixed_rows::<3>(6).norm() < AT_REST {
                break;
            }
        }
    }
    dataset.base = FramePose::from_pose(&base);
    dataset.tool.xyz = tool.into();
    place_targets(dataset, &known);
}

/// Checks that the base stated for a dataset is that of another that was measured on the same set-up.
pub(super) fn check_base(dataset: &Dataset, folder: &Path) -> Result<(), ImportError> {
    match read_dataset(folder)?.base == dataset.base {
        true => Ok(()),
        false => Err(ImportError::StatedOtherwise { path: folder.to_owned(), what: "base" }),
    }
}

/// Gives a dataset the base, gravity, tool and targets of another that was measured on the same set-up.
///
/// What was found from the rows of each would differ by what these rows happen to show.
pub(super) fn take_set_up(dataset: &mut Dataset, folder: &Path) -> Result<(), ImportError> {
    let of = read_dataset(folder)?;
    if !dataset.tool_free && dataset.tool != FramePose::default() && dataset.tool != of.tool {
        return Err(ImportError::StatedOtherwise { path: folder.to_owned(), what: "tool" });
    }
    if !of.robot.is_same_arm(&dataset.robot) {
        return Err(ImportError::SetUpOfAnother {
            path: folder.to_owned(),
            other: of.robot.name.clone(),
            robot: dataset.robot.name.clone(),
        });
    }
    dataset.base = of.base;
    dataset.gravity = of.gravity;
    dataset.contact_force = of.contact_force;
    dataset.tool = of.tool;
    dataset.tool_free = of.tool_free;
    dataset.tool_sigma = of.tool_sigma;
    dataset.probe_sigma = of.probe_sigma;
    for tool_target in &mut dataset.tool_targets {
        if let Some(known) = of.tool_targets.iter().find(|t| t.id == tool_target.id) {
            tool_target.clone_from(known);
        }
    }
    for ball in &mut dataset.balls {
        if let Some(known) = of.balls.iter().find(|b| b.id == ball.id) {
            ball.clone_from(known);
        }
    }
    Ok(())
}

/// World position of the measured point of a sample, if it is known.
fn known_place(dataset: &Dataset, sample: &Sample) -> Option<Vector3<f64>> {
    match &sample.measured {
        Measured::Point(point) => Some(*point),
        Measured::Ball { ball, .. } => Some(&dataset.balls[*ball]).filter(|b| !b.free).map(|b| b.position),
        Measured::Distance { .. } => None,
    }
}

/// Places every free target at the mean of where its rows (flange in the base, measured point in the world) saw it.
fn place_targets(dataset: &mut Dataset, known: &[(Option<usize>, Pose, Vector3<f64>)]) {
    let world_from_base = dataset.base.pose();
    let flange_from_tool = dataset.tool.pose();
    for (r, tool_target) in dataset.tool_targets.iter_mut().enumerate().filter(|(_, tool_target)| tool_target.free) {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        for (_, flange, place) in known.iter().filter(|(of, ..)| *of == Some(r)) {
            sum += (world_from_base * flange * flange_from_tool).inverse().transform_point(&(*place).into()).coords;
            count += 1.0;
        }
        if count > 0.0 {
            tool_target.position = sum / count;
        }
    }
}

/// If the noise of the positions is not stated, states that of the orientations in the ratio of the residuals of both after a
/// calibration of the geometry. In another ratio, the residuals of one would seem to show effects in addition to those of the
/// other.
pub(super) fn balance(dataset: &mut Dataset, report: &mut ImportReport) {
    let unstated = dataset.noise.point.is_none() && dataset.samples.iter().all(|s| s.sigma.is_none());
    let (true, Some(stated)) = (unstated, dataset.noise.orientation) else { return };
    let Ok(calibration) = identify(&[NamedDataset::new("", dataset)], &Model::geometry()) else { return };
    let Some(balanced) = calibration.balanced_orientation().filter(|b| b.is_finite() && *b > 0.0) else { return };
    // Two digits: it is a weight.
    let unit = 10f64.powf((balanced / DEG).log10().floor() - 1.0);
    let rounded = (balanced / DEG / unit).round() * unit;
    let rounded = format!("{rounded:.6}").parse().unwrap_or(rounded);
    dataset.noise.orientation = Some(rounded * DEG);
    if ((rounded * DEG) / stated - 1.0).abs() > 0.01 {
        report.notes.push(format!(
            "the noise of the positions is not stated, so that of the orientations is a weight: {rounded} deg to 0.1 mm, in which ratio they err, not {} deg",
            (stated / DEG * 1e6).round() / 1e6
        ));
    }
}

/// States the one-sigma noise of the positions of a dataset, m. Where it was not stated, that of the orientations is a weight
/// beside positions of an assumed one, and keeps its ratio.
///
/// ```
/// use calibench::import::state_noise;
/// use calibench::measure::dataset::Dataset;
///
/// let mut dataset = Dataset::default();
/// dataset.noise.orientation = Some(1e-3);
/// state_noise(&mut dataset, 20e-6);
/// assert!((dataset.noise.orientation.unwrap() - 0.2e-3).abs() < 1e-12);
/// ```
pub fn state_noise(dataset: &mut Dataset, sigma: f64) {
    if dataset.noise.point.is_none() {
        dataset.noise.orientation = dataset.noise.orientation.map(|weight| weight * sigma / UNSTATED_SIGMA);
    }
    dataset.noise.point = Some(sigma);
}

/// The same dataset without the noise that it states for all its positions, that of orientations a weight again; `None` if it states
/// none, or one of single samples.
#[must_use]
pub fn without_noise(dataset: &Dataset) -> Option<Dataset> {
    let sigma = dataset.noise.point.or(dataset.noise.ball)?;
    if dataset.samples.iter().any(|s| s.sigma.is_some()) {
        return None;
    }
    let orientation = dataset.noise.orientation.map(|sigma_of| sigma_of * UNSTATED_SIGMA / sigma);
    let noise = Noise { point: None, ball: None, orientation, ..dataset.noise.clone() };
    Some(Dataset { noise, ..dataset.clone() })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::measure::dataset::Sample;
    use crate::robot::built_in;
    use crate::robot::kinematics::world_from_tool;

    #[test]
    fn base_and_tool_that_made_the_points_are_found() {
        let robot = built_in("ur5").expect("built in");
        let base = FramePose { xyz: [1.2, -0.4, 0.3], rz_ry_rx: [2.0, 0.3, -0.7] };
        let tool = FramePose { xyz: [0.03, -0.05, 0.11], ..FramePose::default() };
        let mut dataset = Dataset { robot: Arc::new(robot), tool_free: true, ..Dataset::default() };
        for k in 0..30 {
            let q: Vec<f64> = (0..6).map(|j| ((k * (2 * j + 3)) as f64).sin()).collect();
            let point = world_from_tool(&dataset.robot, &base, &tool, &q).translation.vector;
            dataset.samples.push(Sample::new(k.to_string(), q, Measured::Point(point)));
        }
        fit_base_and_tool(&mut dataset);
        for (found, made) in
            dataset.base.to_array().iter().chain(&dataset.tool.xyz).zip(base.to_array().iter().chain(&tool.xyz))
        {
            assert!((found - made).abs() < 1e-9, "{found} for {made}");
        }
    }
}
