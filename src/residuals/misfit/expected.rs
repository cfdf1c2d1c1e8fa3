//! Expected residual of the nominal arm: the prior predictive distribution of how far real arms deviate from their
//! drawings, scaled to this robot.
//!
//! The residual is linear in the sizes of the effects. With the columns of one-sigma sizes, projected orthogonal to the
//! frames, its mean square is `sum lambda_k z_k^2`, a quadratic form of standard normal variables, whose quantile is
//! that of a three-moment chi-square (Imhof 1961).

use nalgebra::{DMatrix, Vector3};

use super::campaign::{Campaign, Seen};
use super::frames::{FrameFit, Frames, flanges};
use crate::effects::EffectId;
use crate::effects::{self, Subject};
use crate::math::linalg::LinalgError;
use crate::math::positive_definite::cholesky;
use crate::robot::kinematics::Posture;
use crate::robot::sites::{MdhEntry, Site, SiteIndex};
use crate::robot::statics::{Loads, Payload};
use crate::robot::{FramePose, JointKind, Robot};
use crate::units::DEG;

/// One-sigma of the geometry of a real arm about its drawing, in plausible sizes of the catalogue, which are those of a
/// well assembled arm (docs/importing.md).
const ILL_ASSEMBLED: f64 = 6.0;
/// One-sigma of joint errors once and twice per turn, in plausible sizes of the catalogue.
const ILL_GEARED: f64 = 2.0;
/// One-sigma of a joint's deflection at the largest torque of all joints, rad (docs/importing.md).
const DEFLECTION: f64 = 2e-3;
/// Reach for which the lengths of the catalogue are plausible, m: that of the KR 6.
pub(super) const REACH_OF_CATALOGUE: f64 = 0.7;
/// Standard normal quantile of 99.9 %.
const QUANTILE: f64 = 3.090_232_306_167_813;
/// Approximate number of rows at which the columns are computed.
const ROWS: usize = 120;

/// Rms residual that the nominal arm does not exceed with probability 99.9 %, and the median, m; infinite if the frames
/// are not determined.
pub(super) fn expected(campaign: &Campaign, frames: &Frames) -> [f64; 2] {
    let some = campaign.selection(ROWS);
    let columns = columns(&some, frames);
    let rows = columns.nrows() as f64 / 3.0;
    // Of positions that are not finite any misfit is to be expected.
    let Ok(left) = without_frames(&some, frames, columns) else { return [f64::INFINITY; 2] };
    let form = left.tr_mul(&left) / rows.max(1.0);
    let [upper, median] = quantiles(&form);
    let noise = 3.0 * campaign.noise * campaign.noise;
    [(upper + noise).sqrt(), (median + noise).sqrt()]
}

/// Largest distance of the flange from the second joint, m, by coordinate search in steps of 5 deg; joint limits are
/// ignored, except those of prismatic joints.
pub(crate) fn reach(robot: &Robot) -> f64 {
    let distance = |q: &[f64]| {
        let mut pose = crate::robot::Pose::identity();
        let mut second = Vector3::zeros();
        for (i, (link, &q)) in robot.links.iter().zip(q).enumerate() {
            pose *= link.mdh.transform(q);
            if i == 1 {
                second = pose.translation.vector;
            }
        }
        (pose.translation.vector - second).norm()
    };
    let mut q = vec![0.0; robot.joints()];
    for _ in 0..3 {
        for j in 1..q.len() {
            let places: Vec<f64> = match robot.kind(j) {
                JointKind::Revolute => (-36..36).map(|k| f64::from(k) * 5.0 * DEG).collect(),
                JointKind::Prismatic => robot.links[j].limits.into(),
            };
            let best = places
                .into_iter()
                .map(|angle| {
                    let mut q = q.clone();
                    q[j] = angle;
                    (distance(&q), angle)
                })
                .max_by(|a, b| a.0.total_cmp(&b.0));
            q[j] = best.map_or(q[j], |(_, angle)| angle);
        }
    }
    distance(&q)
}

/// Displacement of each row by a one-sigma size of each effect, m: three rows per shot.
fn columns(campaign: &Campaign, frames: &Frames) -> DMatrix<f64> {
    let robot = &campaign.robot;
    let subject = Subject::new(robot, &[]);
    let lengths = (reach(robot) / REACH_OF_CATALOGUE).max(1.0);
    let links: Vec<(Site, f64)> = errors_of_links(robot)
        .into_iter()
        .map(|(site, prior)| (site, if is_length(site) { prior * lengths } else { prior }))
        .collect();
    let harmonics: Vec<f64> = [EffectId::HARMONIC_1, EffectId::HARMONIC_2]
        .iter()
        .filter_map(|id| effects::build(id, &subject).ok())
        .map(|effect| ILL_GEARED * effect.parameters().first().map_or(0.0, |p| p.prior))
        .collect();
    let torques = deflections(campaign, frames);
    let n = robot.joints();
    let width = links.len() + n * (2 * harmonics.len() + 1);
    let mut columns = DMatrix::zeros(3 * campaign.shots.len(), width);
    let mut posture = Posture::new(robot);
    let none = vec![0.0; SiteIndex::new(n).len()];
    for (k, shot) in campaign.shots.iter().enumerate() {
        let base = FramePose::from_pose(&frames.bases[shot.setup]);
        let tool = FramePose { xyz: frames.tools[shot.setup].into(), ..campaign.places[shot.setup].tool };
        posture.set(robot, &base, &tool, &shot.q, &none);
        let mut put = |c: usize, column: Vector3<f64>| columns.fixed_view_mut::<3, 1>(3 * k, c).copy_from(&column);
        links.iter().enumerate().for_each(|(c, (site, size))| put(c, posture.column(*site) * *size));
        let mut c = links.len();
        for j in 0..n {
            let turn = posture.motion(j);
            for (h, size) in harmonics.iter().enumerate() {
                // A slide has no turns, and a slow wave over it would pass for its scale.
                if robot.kind(j) == JointKind::Revolute {
                    let (sin, cos) = ((h + 1) as f64 * shot.q[j]).sin_cos();
                    put(c, turn * (sin * size));
                    put(c + 1, turn * (cos * size));
                }
                c += 2;
            }
            put(c, turn * torques[(k, j)]);
            c += 1;
        }
    }
    columns
}

/// Errors of the links, each with its one-sigma size, SI, of an arm with the reach of the catalogue.
fn errors_of_links(robot: &Robot) -> Vec<(Site, f64)> {
    let Ok(mdh) = effects::build(EffectId::MDH, &Subject::new(robot, &[])) else { return Vec::new() };
    let sized = |&(k, site, weight): &(usize, Site, f64)| (site, ILL_ASSEMBLED * mdh.parameters()[k].prior * weight);
    mdh.constant().unwrap_or_default().iter().map(sized).collect()
}

fn is_length(site: Site) -> bool {
    matches!(site, Site::Mdh(_, MdhEntry::A | MdhEntry::D))
}

/// Of the columns of the arm in [`Designs`], those that are lengths of links.
pub(super) fn columns_of_lengths(robot: &Robot) -> Vec<usize> {
    errors_of_links(robot).iter().enumerate().filter(|(_, (site, _))| is_length(*site)).map(|(c, _)| c).collect()
}

/// Column of the arm in [`Designs`] along which a joint slides, and its one-sigma size, m.
pub(super) fn column_of_slide(robot: &Robot, joint: usize) -> Option<(usize, f64)> {
    let links = errors_of_links(robot);
    let lengths = (reach(robot) / REACH_OF_CATALOGUE).max(1.0);
    let at = links.iter().position(|(site, _)| *site == Site::mdh(joint, MdhEntry::D))?;
    Some((at, links[at].1 * lengths))
}

/// One-sigma deflection of each joint at each row, rad: proportional to the torque, zero if no masses are known.
fn deflections(campaign: &Campaign, frames: &Frames) -> DMatrix<f64> {
    let robot = &campaign.robot;
    let n = robot.joints();
    let mut torques = DMatrix::zeros(campaign.shots.len(), n);
    if !robot.has_masses() {
        return torques;
    }
    let (mut posture, mut loads) = (Posture::new(robot), Loads::new(n));
    let none = vec![0.0; SiteIndex::new(n).len()];
    for (k, shot) in campaign.shots.iter().enumerate() {
        let place = &campaign.places[shot.setup];
        posture.set(robot, &FramePose::from_pose(&frames.bases[shot.setup]), &place.tool, &shot.q, &none);
        loads.compute(robot, &posture, &Payload::none(), &place.gravity, &Vector3::zeros());
        let turning = (0..n).filter(|&j| robot.kind(j) == JointKind::Revolute);
        turning.for_each(|j| torques[(k, j)] = loads.tau[j]);
    }
    let largest = torques.amax();
    if largest > 0.0 { torques * (DEFLECTION / largest) } else { torques }
}

/// Derivatives of the residuals of a campaign: three rows per shot, of a distance the first of them.
pub(super) struct Designs {
    /// With respect to the unknown frames, negative.
    pub frames: DMatrix<f64>,
    /// Displacements by a one-sigma size of each effect of the arm, m.
    pub arm: DMatrix<f64>,
}

impl Designs {
    pub fn of(campaign: &Campaign, frames: &Frames) -> Self {
        Self::with(campaign, frames, columns(campaign, frames))
    }

    fn with(campaign: &Campaign, frames: &Frames, mut arm: DMatrix<f64>) -> Self {
        let flanges = flanges(&campaign.robot, campaign);
        let fit = FrameFit::new(campaign, &flanges);
        let mut design = DMatrix::<f64>::zeros(arm.nrows(), fit.unknowns());
        for k in 0..campaign.shots.len() {
            let row = fit.row(k, frames);
            for (at, block) in &row.blocks[..row.used] {
                design.fixed_view_mut::<3, 3>(3 * k, *at).copy_from(block);
            }
            if let Seen::Distance { anchor, .. } = campaign.shots[k].seen {
                let held = frames.bases[campaign.shots[k].setup] * flanges[k];
                let tcp = held.transform_point(&frames.tools[campaign.shots[k].setup].into()).coords;
                let along = (tcp - frames.anchors[anchor]).normalize().transpose() * arm.fixed_rows::<3>(3 * k);
                arm.fixed_rows_mut::<3>(3 * k).fill(0.0);
                arm.row_mut(3 * k).copy_from(&along);
            }
        }
        Designs { frames: design, arm }
    }
}

/// Columns after projection orthogonal to the unknown frames.
///
/// # Errors
/// When a column is not finite.
fn without_frames(campaign: &Campaign, frames: &Frames, columns: DMatrix<f64>) -> Result<DMatrix<f64>, LinalgError> {
    let Designs { frames: design, arm } = Designs::with(campaign, frames, columns);
    if design.ncols() == 0 {
        return Ok(arm);
    }
    let mut normal = design.tr_mul(&design);
    let size = normal.diagonal().max();
    (0..normal.nrows()).for_each(|k| normal[(k, k)] += 1e-12 * size);
    let held = cholesky(normal)?.solve(&design.tr_mul(&arm));
    Ok(arm - design * held)
}

/// Motion of the flange while one target is measured: rms about the mean over the rows of each ball, or over all other
/// rows of a set-up, m.
pub(super) fn signal(campaign: &Campaign) -> f64 {
    let flanges = flanges(&campaign.robot, campaign);
    let mut groups = std::collections::BTreeMap::new();
    for (shot, flange) in campaign.shots.iter().zip(&flanges) {
        let ball = match shot.seen {
            Seen::Ball { ball, .. } => ball,
            _ => usize::MAX,
        };
        groups.entry((shot.setup, ball)).or_insert_with(Vec::new).push(flange.translation.vector);
    }
    rms_about_means(groups.values(), campaign.shots.len())
}

fn rms_about_means<'a>(groups: impl Iterator<Item = &'a Vec<Vector3<f64>>>, count: usize) -> f64 {
    let squares = |all: &Vec<Vector3<f64>>| {
        let mean = all.iter().sum::<Vector3<f64>>() / all.len() as f64;
        all.iter().map(|p| (p - mean).norm_squared()).sum::<f64>()
    };
    (groups.map(squares).sum::<f64>() / count.max(1) as f64).sqrt()
}

/// Spread of what was measured: rms of positions, of distances from each anchor and of known balls about their means, m.
pub(super) fn spread(campaign: &Campaign) -> f64 {
    let mut groups = std::collections::BTreeMap::new();
    for shot in &campaign.shots {
        let (group, at) = match shot.seen {
            Seen::Point(point) => ((0, shot.setup), point),
            Seen::Ball { ball, .. } => ((1, 0), campaign.balls[ball].position),
            Seen::Distance { anchor, distance } => ((2, anchor), Vector3::new(distance, 0.0, 0.0)),
        };
        groups.entry(group).or_insert_with(Vec::new).push(at);
    }
    rms_about_means(groups.values(), campaign.shots.len())
}

/// 99.9 % quantile and median of a quadratic form of standard normal variables.
fn quantiles(form: &DMatrix<f64>) -> [f64; 2] {
    let square = form * form;
    let first = form.trace();
    let second = square.trace();
    let third = square.component_mul(form).sum();
    if !(third > 0.0 && second > 0.0) {
        return [first.max(0.0); 2];
    }
    let freedom = second.powi(3) / third.powi(2);
    [QUANTILE, 0.0].map(|z| (first + (chi_square(freedom, z) - freedom) * (second / freedom).sqrt()).max(0.0))
}

/// Quantile of chi-square at the standard normal quantile z (Wilson and Hilferty).
fn chi_square(freedom: f64, z: f64) -> f64 {
    let a = 2.0 / (9.0 * freedom);
    freedom * (1.0 - a + z * a.sqrt()).max(0.0).powi(3)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::robot::built_in;

    #[test]
    fn quantile_of_one_normal_number_squared() {
        // 3.2905² and 0.6745²; the Wilson-Hilferty approximation is worst at one degree of freedom.
        let [upper, median] = quantiles(&DMatrix::from_diagonal(&DVector::from_vec(vec![1.0])));
        assert!((upper / 10.828 - 1.0).abs() < 0.04 && (median / 0.4549 - 1.0).abs() < 0.05, "{upper} {median}");
    }

    #[test]
    fn reach_is_that_of_the_data_sheets() {
        // Reach to the wrist according to data sheets, m; the flange is up to 0.16 m further.
        for (name, sheet) in [("kr6_r700", 0.706), ("ur5", 0.85), ("ur10", 1.3), ("panda", 0.855)] {
            let reach = reach(&built_in(name).unwrap());
            assert!((0.85 * sheet..sheet + 0.2).contains(&reach), "{name}: {reach}");
        }
    }
}
