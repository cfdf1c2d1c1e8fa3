//! Starts of the fit of the frames: the result that leaves least is kept.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Rotation3, Vector3};
use rayon::prelude::*;

use super::campaign::{Campaign, Place};
use super::frames::{Fitted, FrameFit, flanges};

/// Fits the frames of a campaign. Free tools start at their stated position and at the flange; the better result is
/// kept.
pub(super) fn fit(campaign: &Campaign) -> Fitted {
    let flanges = flanges(&campaign.robot, campaign);
    let fit = FrameFit::new(campaign, &flanges);
    let stated: Vec<Vector3<f64>> = campaign.places.iter().map(|p| p.tool.xyz.into()).collect();
    let first = fit.from(stated.clone(), Rotation3::identity());
    let at_flange = |(p, t): (&Place, &Vector3<f64>)| if p.tool_free { Vector3::zeros() } else { *t };
    let other: Vec<Vector3<f64>> = campaign.places.iter().zip(&stated).map(at_flange).collect();
    if other == stated {
        return first;
    }
    let second = fit.from(other, Rotation3::identity());
    if second.plain < first.plain { second } else { first }
}

/// As [`fit`], from more starts where there are distances alone: these have no closed form, and few anchors have several minima. The
/// bases start in all orientations of a cube.
pub(super) fn fit_anywhere(campaign: &Campaign) -> Fitted {
    let first = fit(campaign);
    if !campaign.has_distances_alone() || campaign.places.iter().all(|p| !p.base_free) {
        return first;
    }
    let flanges = flanges(&campaign.robot, campaign);
    let (fit, tools) = (FrameFit::new(campaign, &flanges), first.frames.tools.clone());
    let others: Vec<Fitted> = of_a_cube().into_par_iter().map(|turn| fit.from(tools.clone(), turn)).collect();
    others.into_iter().fold(first, |best, other| if other.plain < best.plain { other } else { best })
}

/// The rotations that bring a cube to itself.
fn of_a_cube() -> Vec<Rotation3<f64>> {
    let quarter = |axis, k: usize| Rotation3::from_axis_angle(&axis, k as f64 * FRAC_PI_2);
    let sides = (0..4).map(|k| quarter(Vector3::x_axis(), k)).chain([1, 3].map(|k| quarter(Vector3::y_axis(), k)));
    sides.flat_map(|side| (0..4).map(move |k| side * quarter(Vector3::z_axis(), k))).collect()
}
