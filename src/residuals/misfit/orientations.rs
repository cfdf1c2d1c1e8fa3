//! Test whether measured orientations fit the arm: the angle between them and those of the nominal arm, with its base found
//! from the positions and the axes of the tool fitted. If they do not, common slips are tried.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rayon::prelude::*;

use super::campaign::{Campaign, Seen};
use super::data_fit::SlipTried;
use super::frames::{Frames, flanges};
use super::orientation_slips::{Misread, all};
use super::slip::Slip;
use super::starts::fit;
use crate::math::CHI2_MEDIAN;
use crate::math::nearest_rotation;
use crate::measure::dataset::Dataset;
use crate::robot::{angle_between, rotation_vector};
use crate::units::DEG;

/// One-sigma of each angle of the links of a poorly assembled arm, rad: six plausible sizes of the catalogue.
const ILL_ASSEMBLED: f64 = 6.0 * 0.05 * DEG;
/// Multiple of the standard deviation that 99.9 % of arms do not exceed, in three axes.
const QUANTILE: f64 = 4.03;
/// A row is gross if its angle exceeds this multiple of that of the others, and what is expected.
const GROSS: f64 = 10.0;
/// Largest share of rows that are named one by one.
const FEW: f64 = 0.1;
/// A slip explains the orientations if it leaves at most this share of their angle.
const EXPLAINS: f64 = 1.0 / 3.0;
/// Slips with angles up to this multiple of the smallest cannot be told apart; the simplest is named.
const ALIKE: f64 = 1.25;
/// Share of the rows kept by a trimmed mean.
const TRIMMED: f64 = 0.7;
/// Smallest number of rows with which orientations can be judged.
const LEAST_ROWS: usize = 4;
/// Number of times that readings of several meanings are read anew.
const ROUNDS: usize = 3;
/// Largest angle between a base found from orientations and that found from positions, rad, that means nothing.
const BESIDE: f64 = 5.0 * DEG;
/// Number of rows named individually, at most.
const NAMED: usize = 6;

/// Orientations that do not fit.
#[derive(Debug, Clone)]
pub(super) struct Turned {
    /// Rms angle of all rows, rad.
    pub left: f64,
    /// Largest angle expected, rad.
    pub most: f64,
    /// Number of single rows that are off; zero if not they are the cause.
    pub rows: usize,
    /// The slip, with the rms angle left, rad; each row where rows are the cause. Empty if none was found.
    pub slips: Vec<SlipTried>,
}

/// Rows with an orientation, each with where the nominal arm turns its flange in the world.
struct Rows {
    shots: Vec<usize>,
    setup: Vec<usize>,
    bases: Vec<Rotation3<f64>>,
    flanges: Vec<Rotation3<f64>>,
    seen: Vec<Rotation3<f64>>,
    /// Orientation of the tool of each set-up where it is not fitted.
    tools: Vec<Option<Rotation3<f64>>>,
}

/// Tests the orientations; `None` if they fit, or there are too few.
pub(super) fn judge(dataset: &Dataset, campaign: &Campaign, frames: &Frames) -> Option<Turned> {
    let rows = Rows::of(dataset, campaign, frames);
    if rows.shots.len() < LEAST_ROWS {
        return None;
    }
    let most = expected(dataset, campaign);
    let own = as_stated(&rows.seen);
    let nominal = rows.angles(&rows.bases, &own, false);
    let left = rms(&nominal);
    if left <= most || rows.fit_beside(&own, most) {
        return None;
    }
    let middle = median(&nominal);
    let gross: Vec<usize> = (0..nominal.len()).filter(|&k| nominal[k] > (GROSS * middle).max(2.0 * most)).collect();
    if middle <= most && gross.len() as f64 <= FEW * nominal.len() as f64 {
        let row = |&k: &usize| {
            let id = &dataset.samples[campaign.shots[rows.shots[k]].source[1]].id;
            let others: Vec<f64> = (0..nominal.len()).filter(|k| !gross.contains(k)).map(|k| nominal[k]).collect();
            SlipTried {
                slip: format!("sample:{id}"),
                residual: rms(&others),
                words: format!("without sample {id}, turned by {:.0} deg, it", nominal[k] / DEG),
            }
        };
        let slips = gross.iter().take(NAMED).map(row).collect();
        return Some(Turned { left, most, rows: gross.len(), slips });
    }
    let mut tried: Vec<(usize, f64, String, String)> = all()
        .par_iter()
        .map(|m: &Misread| {
            let readings: Vec<_> = rows.seen.iter().map(|r| m.readings(r)).collect();
            (m.changes(), rms(&rows.angles(&rows.bases, &readings, false)), m.name(), m.words())
        })
        .collect();
    tried.extend(rows.of_other_frames(campaign, dataset));
    tried.extend(of_joints(dataset, campaign));
    tried.retain(|(_, angle, ..)| *angle <= most && *angle <= EXPLAINS * left);
    let least = tried.iter().map(|t| t.1).fold(f64::INFINITY, f64::min);
    tried.retain(|(_, angle, ..)| *angle <= ALIKE * least);
    tried.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let slips = tried.into_iter().take(1).map(|(_, residual, slip, words)| SlipTried { slip, residual, words }).collect();
    Some(Turned { left, most, rows: 0, slips })
}

/// Largest angle expected, rad, of an arm poorly assembled, and of the noise.
fn expected(dataset: &Dataset, campaign: &Campaign) -> f64 {
    let noise = dataset.noise.orientation.unwrap_or(0.0);
    let angles = (3 * campaign.robot.joints()) as f64;
    QUANTILE / 3f64.sqrt() * (angles * ILL_ASSEMBLED.powi(2) / 3.0 + 3.0 * noise * noise).sqrt()
}

/// Noise of the places of a tool that saw the world, one-sigma per axis, m: what its orientations scatter by, over the distance from
/// which it saw the world's origin. Zero of orientations that do not fit: they are no noise.
pub(super) fn noise_of_places(dataset: &Dataset, campaign: &Campaign, frames: &Frames) -> f64 {
    let rows = Rows::of(dataset, campaign, frames);
    let own = as_stated(&rows.seen);
    let middle = median(&rows.angles(&rows.bases, &own, false));
    let scatter = if middle <= expected(dataset, campaign) { middle / CHI2_MEDIAN[2].sqrt() } else { 0.0 };
    let away = |&k: &usize| match campaign.shots[k].seen {
        Seen::Point(at) => at.norm(),
        _ => 0.0,
    };
    // Of the three axes, the one along the line of sight moves nothing.
    scatter * rms(&rows.shots.iter().map(away).collect::<Vec<_>>()) * (2.0f64 / 3.0).sqrt()
}

/// Slips of the joints that positions do not show.
fn of_joints(dataset: &Dataset, campaign: &Campaign) -> Vec<(usize, f64, String, String)> {
    let joints = |s: &Slip| matches!(s, Slip::JointSign(_) | Slip::JointZero(..) | Slip::RowsShifted(_) | Slip::LeftHanded);
    let one = |slip: &Slip| {
        let changed = slip.undone(campaign);
        let fitted = fit(&changed);
        let rows = Rows::of(dataset, &changed, &fitted.frames);
        let own = as_stated(&rows.seen);
        (1, rms(&rows.angles(&rows.bases, &own, false)), slip.name(campaign), slip.words(campaign))
    };
    Slip::all(campaign).iter().filter(|s| joints(s)).map(one).collect()
}

impl Rows {
    fn of(dataset: &Dataset, campaign: &Campaign, frames: &Frames) -> Self {
        let all = flanges(&campaign.robot, campaign);
        let shots: Vec<usize> = (0..campaign.shots.len()).filter(|&k| campaign.shots[k].turned.is_some()).collect();
        let tool = |p: &super::campaign::Place| {
            let fixed = !p.tool_free && dataset.probe_sigma == 0.0;
            fixed.then(|| p.tool.pose().rotation)
        };
        Rows {
            setup: shots.iter().map(|&k| campaign.shots[k].setup).collect(),
            bases: shots.iter().map(|&k| frames.bases[campaign.shots[k].setup].rotation).collect(),
            flanges: shots.iter().map(|&k| all[k].rotation).collect(),
            seen: shots.iter().filter_map(|&k| campaign.shots[k].turned.as_deref().copied()).collect(),
            tools: campaign.places.iter().map(tool).collect(),
            shots,
        }
    }

    /// Angle of each row between the arm and what was read, rad: of the readings that a row may have, the nearest. The tool is
    /// fitted where it is free, or everywhere if `all_free`.
    fn angles(&self, bases: &[Rotation3<f64>], readings: &[Vec<Rotation3<f64>>], all_free: bool) -> Vec<f64> {
        let mut angles = vec![0.0; self.shots.len()];
        for (s, stated) in self.tools.iter().enumerate() {
            let of: Vec<usize> = (0..self.shots.len()).filter(|&k| self.setup[k] == s && !readings[k].is_empty()).collect();
            let held: Vec<Rotation3<f64>> = of.iter().map(|&k| bases[k] * self.flanges[k]).collect();
            let nearest = |tool: Option<Rotation3<f64>>, i: usize| {
                let all = &readings[of[i]];
                let Some(tool) = tool else { return (0.0, all[0]) };
                let expected = held[i] * tool;
                all.iter()
                    .map(|r| (angle_between(&expected, r), *r))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .unwrap_or((0.0, all[0]))
            };
            let mut tool = stated.filter(|_| !all_free);
            if tool.is_none() {
                for _ in 0..ROUNDS {
                    let tools: Vec<_> = (0..of.len()).map(|i| held[i].inverse() * nearest(tool, i).1).collect();
                    tool = trimmed_mean(&tools).or(tool);
                }
            }
            (0..of.len()).for_each(|i| angles[of[i]] = nearest(tool, i).0);
        }
        angles
    }

    /// True if the orientations fit with a base of their own that is turned little from that of the positions, which few postures
    /// hardly determine.
    fn fit_beside(&self, own: &[Vec<Rotation3<f64>>], most: f64) -> bool {
        let Some(bases) = self.own_bases(&self.seen) else { return false };
        let near = bases.iter().zip(&self.bases).all(|(a, b)| angle_between(a, b) <= BESIDE);
        near && rms(&self.angles(&bases, own, false)) <= most
    }

    /// Orientations in a frame of their own: found from how the tool turns between rows, whatever frame that is seen in.
    /// The same for orientations of the row before or after, and of another frame on the flange.
    fn of_other_frames(&self, campaign: &Campaign, dataset: &Dataset) -> Vec<(usize, f64, String, String)> {
        let mut found = Vec::new();
        for inverse in [false, true] {
            let seen: Vec<Rotation3<f64>> = self.seen.iter().map(|r| if inverse { r.inverse() } else { *r }).collect();
            let Some(bases) = self.own_bases(&seen) else { continue };
            let readings = as_stated(&seen);
            let angle = rms(&self.angles(&bases, &readings, true));
            let at_base = bases.iter().all(|b| rotation_vector(b).norm() < 2.0 * DEG);
            let frame = if at_base { "in the frame of the robot's base" } else { "in another frame than the positions" };
            let mut words = format!("the orientations taken {frame}");
            let mut name = "orientation_frame".to_owned();
            if inverse {
                words += " and inverted";
                name = "orientation_inverse+orientation_frame".into();
            }
            found.push((2 + usize::from(inverse), angle, name, words));
        }
        for (to, of) in ["before", "after"].into_iter().enumerate() {
            let neighbour = |&k: &usize| {
                campaign.shots[k].neighbours[to].as_ref().and_then(|n| n.turned.as_deref().copied()).into_iter().collect()
            };
            let readings: Vec<Vec<_>> = self.shots.iter().map(neighbour).collect();
            let angle = rms(&self.angles(&self.bases, &readings, false));
            let words = format!("each row with the orientation of the row {of} it");
            found.push((1, angle, "orientation_rows_shifted".into(), words));
        }
        let fixed = self.tools.iter().any(Option::is_some);
        if fixed && dataset.samples.len() > LEAST_ROWS {
            let readings = as_stated(&self.seen);
            let angle = rms(&self.angles(&self.bases, &readings, true));
            found.push((
                1,
                angle,
                "orientation_tool".into(),
                "the orientations taken of another frame on the flange than the stated tool".into(),
            ));
        }
        found
    }

    /// Frame in which each row's orientation was measured, from the axes about which flange and tool turn between rows.
    fn own_bases(&self, seen: &[Rotation3<f64>]) -> Option<Vec<Rotation3<f64>>> {
        let mut bases = vec![Rotation3::identity(); seen.len()];
        for s in 0..self.tools.len() {
            let of: Vec<usize> = (0..seen.len()).filter(|&k| self.setup[k] == s).collect();
            let mut axes = Matrix3::<f64>::zeros();
            for pair in of.windows(2) {
                let tool: Vector3<f64> = rotation_vector(&(seen[pair[0]].inverse() * seen[pair[1]]));
                let flange: Vector3<f64> = rotation_vector(&(self.flanges[pair[0]].inverse() * self.flanges[pair[1]]));
                axes += flange * tool.transpose();
            }
            if of.is_empty() {
                continue;
            }
            let tool = nearest_rotation(&axes)?;
            let all: Vec<_> = of.iter().map(|&k| seen[k] * (self.flanges[k] * tool).inverse()).collect();
            let base = trimmed_mean(&all)?;
            of.iter().for_each(|&k| bases[k] = base);
        }
        Some(bases)
    }
}

/// Orientations of one reading each, as they are stated.
fn as_stated(seen: &[Rotation3<f64>]) -> Vec<Vec<Rotation3<f64>>> {
    seen.iter().map(|r| vec![*r]).collect()
}

/// Mean rotation without the rows farthest from it; `None` if there is none.
fn trimmed_mean(all: &[Rotation3<f64>]) -> Option<Rotation3<f64>> {
    let mean = |of: &mut dyn Iterator<Item = &Rotation3<f64>>| nearest_rotation(&of.map(|r| *r.matrix()).sum());
    let mut found = mean(&mut all.iter())?;
    for _ in 0..3 {
        let mut sorted: Vec<&Rotation3<f64>> = all.iter().collect();
        sorted.sort_by(|a, b| angle_between(&found, a).total_cmp(&angle_between(&found, b)));
        sorted.truncate((TRIMMED * all.len() as f64).ceil() as usize);
        found = mean(&mut sorted.into_iter()).unwrap_or(found);
    }
    Some(found)
}

fn rms(all: &[f64]) -> f64 {
    (all.iter().map(|x| x * x).sum::<f64>() / all.len().max(1) as f64).sqrt()
}

pub(super) fn median(all: &[f64]) -> f64 {
    let mut all = all.to_vec();
    let middle = all.len() / 2;
    if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(middle, f64::total_cmp).1 }
}
