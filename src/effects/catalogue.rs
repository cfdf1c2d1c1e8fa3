//! The catalogue: what can be wrong with an arm, its gauge, the artifact and the set-up; one file an effect.

mod artifact_sag;
mod artifact_scale;
mod artifact_step;
mod ball;
mod ball_step;
mod base_drift;
mod base_frame;
mod base_step;
mod base_wander;
mod bearing_tilt;
mod cross_compliance;
mod error_curve;
mod gauge_gain;
mod gauge_tilt;
mod gauge_zero;
mod gravity_backlash;
mod gravity_direction;
mod harmonic;
mod hose_drag;
mod hysteresis;
mod instrument_scale;
mod joint_compliance;
mod joint_scale;
mod joint_source;
mod joint_step;
mod link_bending;
mod link_mass;
mod lumped_gravity;
mod mdh;
mod outlier;
mod payload_com;
mod payload_mass;
mod payload_moment;
mod pedestal;
mod probe_rotation;
mod product;
mod stiction;
mod stiffening;
mod target;
mod thermal_growth;
mod thermal_joint;
mod through_compliance;
mod tool_bending;
mod tool_frame;
mod tool_looseness;
mod tool_step;
mod tracker_registration;
mod unsettled;
mod wrist_coupling;

pub use outlier::{set_aside_by, setting_aside};

use super::family::Family;

/// All effects known to plant, model and diagnosis.
pub const CATALOGUE: &[Family] = &[
    base_frame::FAMILY,
    mdh::FAMILY,
    joint_compliance::FAMILY,
    stiffening::FAMILY,
    cross_compliance::FAMILY,
    gravity_backlash::FAMILY,
    lumped_gravity::FAMILY,
    hysteresis::FAMILY,
    harmonic::ONCE,
    harmonic::TWICE,
    harmonic::ANY,
    error_curve::FAMILY,
    joint_scale::FAMILY,
    wrist_coupling::FAMILY,
    joint_source::FAMILY,
    product::FAMILY,
    hose_drag::FAMILY,
    bearing_tilt::FAMILY,
    link_bending::FAMILY,
    link_mass::FAMILY,
    thermal_growth::FAMILY,
    thermal_joint::FAMILY,
    joint_step::FAMILY,
    tool_frame::FAMILY,
    probe_rotation::FAMILY,
    tool_step::FAMILY,
    tool_bending::FAMILY,
    tool_looseness::FAMILY,
    gauge_zero::FAMILY,
    gauge_gain::FAMILY,
    gauge_tilt::FAMILY,
    stiction::FAMILY,
    ball::FAMILY,
    ball_step::FAMILY,
    artifact_scale::FAMILY,
    artifact_sag::FAMILY,
    artifact_step::FAMILY,
    pedestal::FAMILY,
    payload_mass::FAMILY,
    payload_com::FAMILY,
    payload_moment::FAMILY,
    unsettled::FAMILY,
    gravity_direction::FAMILY,
    base_drift::FAMILY,
    base_step::FAMILY,
    base_wander::FAMILY,
    tracker_registration::FAMILY,
    instrument_scale::FAMILY,
    target::FAMILY,
    outlier::FAMILY,
];
